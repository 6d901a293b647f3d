//! Elimination: which species in equilibrium are primary, and the others written over them.
//!
//! Owns the choice of primary species and the arithmetic of the constants. May use nothing of the crate.
//! It deliberately knows no names, units or activities: species are numbers, and `ln K` may have any unit
//! as long as all have the same.
//!
//! Gauss–Jordan elimination of the reactions, the minerals first, since they can be nothing but
//! eliminated, then one species of each reaction. The choice depends only on the order of species and
//! reactions, and it prefers what chemists call the complex: the one that stands alone on its side.

/// One reaction in equilibrium: `ln K = Σ ν_s ln a_s`, with ν > 0 for products and ν < 0 for reactants;
/// what is a mineral (or water) has activity 1 and is not in K.
#[derive(Debug, Clone, PartialEq)]
pub struct Balance {
    /// `(species, ν)`; a species that is named twice counts with its sum.
    pub coefficients: Vec<(usize, f64)>,
    pub ln_constant: f64,
}

/// Species in equilibrium, all but the primary ones written over them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Elimination {
    /// In the order of species.
    pub primaries: Vec<usize>,
    /// `ln a = ln_constant + Σ ν ln a_primary`, in the order of species. One without coefficients has an
    /// activity that the reactions fix.
    pub secondaries: Vec<Written>,
    /// `Σ ν ln a_primary = ln_constant` at saturation, ν being what dissolving one unit gives; in the order of
    /// species.
    pub minerals: Vec<Written>,
}

/// A species, or a mineral, over primary species.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    pub species: usize,
    pub ln_constant: f64,
    /// `(index into Elimination::primaries, ν)`, in their order.
    pub coefficients: Vec<(usize, f64)>,
}

/// Why reactions cannot be eliminated. Reactions by their place in the list, species by number.
#[derive(Debug, Clone, PartialEq)]
pub enum EliminationError {
    /// These reactions add up to nothing, so that one of them says nothing new; their constants agree.
    Redundant { reactions: Vec<usize> },
    /// These reactions add up to nothing, but their constants do not: they contradict each other.
    Contradiction { reactions: Vec<usize> },
    /// No reaction is left that says when this mineral dissolves: all its reactions are also those of others.
    NoSolubility { mineral: usize },
    /// The activities of these minerals fix each other, and they all can be present in any proportion: more
    /// phases than the phase rule allows.
    PhaseRule { minerals: Vec<usize> },
    /// No solution is at or below saturation with all of these minerals.
    NeverSaturated { minerals: Vec<usize> },
}

/// Writes species and minerals over as few primary species as possible.
///
/// Equation: rows of `[ν | ln K]` brought to reduced echelon form over the eliminated species; then
/// `ln a_i = (ln K − Σ ν_j ln a_j)/ν_i` is a row.
/// Symbols: ν coefficients of a reaction, K its constant; `is_mineral` says of each species whether it is a
/// pure phase.
/// Dimensions and range: K in (unit of concentration)^Δν, minerals not counted; any number of reactions.
/// Source: Morel & Hering 1993, Principles and Applications of Aquatic Chemistry, ch. 1 (tableaux); Molins et
/// al. 2004, Water Resour. Res. 40, W10301.
/// Shape: as many secondary species and minerals as reactions, whatever the order of the reactions.
pub fn eliminate(is_mineral: &[bool], balances: &[Balance]) -> Result<Elimination, EliminationError> {
    let mut rows: Vec<Row> =
        balances.iter().enumerate().map(|(idx, balance)| Row::new(balance, idx, balances.len())).collect();
    let n_species = rows.iter().map(|row| row.coefficients.len()).max().unwrap_or(0).max(is_mineral.len());
    for row in &mut rows {
        row.coefficients.resize(n_species, 0.0);
    }
    let mineral = |species: usize| is_mineral.get(species).copied().unwrap_or(false);
    check_independence(&rows)?;
    for species in (0..n_species).filter(|&species| mineral(species)) {
        let is_used = rows.iter().any(|row| row.coefficients[species] != 0.0);
        let open = (0..rows.len())
            .filter(|&idx| rows[idx].pivot.is_none() && rows[idx].coefficients[species] != 0.0)
            .min_by_key(|&idx| {
                (rows[idx].n_minerals(mineral), rows[idx].coefficients[species].abs() != 1.0, idx)
            });
        match open {
            Some(row_idx) => pivot(&mut rows, row_idx, species),
            None if is_used => return Err(EliminationError::NoSolubility { mineral: species }),
            None => {}
        }
    }
    while let Some((row_idx, species)) = next_pivot(&rows) {
        pivot(&mut rows, row_idx, species);
    }
    let found = collect(&rows, n_species, mineral);
    check_phases(&found)?;
    Ok(found)
}

/// A reaction while others are subtracted from it.
#[derive(Debug, Clone)]
struct Row {
    coefficients: Vec<f64>,
    ln_constant: f64,
    /// Which multiple of each given reaction it is made of.
    origin: Vec<f64>,
    pivot: Option<usize>,
}

impl Row {
    fn new(balance: &Balance, idx: usize, n_rows: usize) -> Self {
        let n = balance.coefficients.iter().map(|&(species, _)| species + 1).max().unwrap_or(0);
        let mut coefficients = vec![0.0; n];
        for &(species, nu) in &balance.coefficients {
            coefficients[species] += nu;
        }
        let mut origin = vec![0.0; n_rows];
        origin[idx] = 1.0;
        Self { coefficients, ln_constant: balance.ln_constant, origin, pivot: None }
    }

    fn n_minerals(&self, mineral: impl Fn(usize) -> bool) -> usize {
        self.coefficients.iter().enumerate().filter(|&(species, &nu)| nu != 0.0 && mineral(species)).count()
    }

    fn divide(&mut self, by: f64) {
        let Self { coefficients, ln_constant, origin, .. } = self;
        for value in coefficients.iter_mut().chain(origin) {
            *value /= by;
        }
        *ln_constant /= by;
    }

    fn subtract(&mut self, factor: f64, other: &Row) {
        let pairs = self.coefficients.iter_mut().zip(&other.coefficients);
        for (value, other) in pairs.chain(self.origin.iter_mut().zip(&other.origin)) {
            *value = clean(*value - factor * other);
        }
        self.ln_constant -= factor * other.ln_constant;
    }
}

/// Coefficients are whole numbers or simple fractions: what differs from a whole number by rounding is one.
fn clean(value: f64) -> f64 {
    let whole = value.round();
    if (value - whole).abs() < 1e-11 { whole + 0.0 } else { value }
}

/// Divides a row by its coefficient of the species and subtracts it from all others.
fn pivot(rows: &mut [Row], row_idx: usize, species: usize) {
    let by = rows[row_idx].coefficients[species];
    rows[row_idx].divide(by);
    rows[row_idx].pivot = Some(species);
    let own = rows[row_idx].clone();
    for (idx, row) in rows.iter_mut().enumerate() {
        let factor = row.coefficients[species];
        if idx != row_idx && factor != 0.0 {
            row.subtract(factor, &own);
            row.coefficients[species] = 0.0;
        }
    }
}

/// The row and species to eliminate next: the first row without one, and its species that has, in this order,
/// coefficient ±1, nobody beside it on its side, few other reactions, the side of the products, and the
/// highest number.
fn next_pivot(rows: &[Row]) -> Option<(usize, usize)> {
    let row_idx = rows.iter().position(|row| row.pivot.is_none())?;
    let row = &rows[row_idx];
    let is_in = |species: &usize| row.coefficients[*species] != 0.0;
    let rank = |species: usize| {
        let nu = row.coefficients[species];
        let on_side = row.coefficients.iter().filter(|other| **other * nu > 0.0).count();
        let n_rows = rows.iter().filter(|row| row.coefficients[species] != 0.0).count();
        (nu.abs() != 1.0, on_side > 1, n_rows, nu < 0.0, usize::MAX - species)
    };
    let species = (0..row.coefficients.len()).filter(is_in).min_by_key(|&species| rank(species))?;
    Some((row_idx, species))
}

/// Refuses reactions that add up to nothing, with all that take part in the sum.
fn check_independence(rows: &[Row]) -> Result<(), EliminationError> {
    let mut rows = rows.to_vec();
    for row_idx in 0..rows.len() {
        let largest = (0..rows[row_idx].coefficients.len()).max_by(|&a, &b| {
            rows[row_idx].coefficients[a].abs().total_cmp(&rows[row_idx].coefficients[b].abs())
        });
        match largest.filter(|&species| rows[row_idx].coefficients[species] != 0.0) {
            Some(species) => pivot(&mut rows, row_idx, species),
            None => {
                let row = &rows[row_idx];
                let reactions = (0..rows.len()).filter(|&idx| row.origin[idx] != 0.0).collect();
                return Err(if agrees(row) {
                    EliminationError::Redundant { reactions }
                } else {
                    EliminationError::Contradiction { reactions }
                });
            }
        }
    }
    Ok(())
}

/// Whether the constants of a sum that is nothing are 1 in total, to the accuracy with which people write them.
fn agrees(row: &Row) -> bool {
    row.ln_constant.abs() < 1e-9
}

fn collect(rows: &[Row], n_species: usize, mineral: impl Fn(usize) -> bool) -> Elimination {
    let is_used = |species: &usize| rows.iter().any(|row| row.coefficients[*species] != 0.0);
    let row_of = |species: usize| rows.iter().find(|row| row.pivot == Some(species));
    let primaries: Vec<usize> =
        (0..n_species).filter(is_used).filter(|&species| row_of(species).is_none()).collect();
    let mut found = Elimination { primaries, ..Elimination::default() };
    for species in 0..n_species {
        let Some(row) = row_of(species) else { continue };
        // One unit of the eliminated species is what stands on the other side of its reaction.
        let over = |primary: &usize| 0.0 - row.coefficients[*primary];
        let coefficients: Vec<(usize, f64)> =
            found.primaries.iter().map(over).enumerate().filter(|(_, nu)| *nu != 0.0).collect();
        if mineral(species) {
            found.minerals.push(Written { species, ln_constant: -row.ln_constant, coefficients });
        } else {
            found.secondaries.push(Written { species, ln_constant: row.ln_constant, coefficients });
        }
    }
    found
}

/// More minerals than this are checked in pairs only: sets of minerals are many.
const MAX_SETS: usize = 12;

/// Refuses sets of minerals that saturate together or never, whatever the solution.
///
/// A set is looked at when no smaller part of it is dependent: then one relation `Σ λ_m ν_m = 0` holds with
/// all λ ≠ 0. All are saturated together if `Σ λ_m ln S_m = 0`; if all λ > 0 and the sum is negative, one of
/// them is always above saturation.
fn check_phases(found: &Elimination) -> Result<(), EliminationError> {
    let n = found.minerals.len();
    let by_size = |size: u32| (0_usize..1 << n.min(MAX_SETS)).filter(move |set| set.count_ones() == size);
    let sets: Vec<Vec<usize>> = if n <= MAX_SETS {
        (1..=n as u32)
            .flat_map(by_size)
            .map(|set| (0..n).filter(|idx| set >> idx & 1 == 1).collect())
            .collect()
    } else {
        (0..n).flat_map(|a| (a + 1..n).map(move |b| vec![a, b])).collect()
    };
    for set in sets {
        let Some(relation) = relation(found, &set) else { continue };
        let minerals = set.iter().map(|&idx| found.minerals[idx].species).collect();
        if relation.ln_constant.abs() < 1e-9 {
            return Err(EliminationError::PhaseRule { minerals });
        }
        let sign = relation.ln_constant.signum();
        if relation.origin.iter().all(|lambda| lambda * sign < 0.0) {
            return Err(EliminationError::NeverSaturated { minerals });
        }
    }
    Ok(())
}

/// The one relation between the minerals of a set, if all of them take part in it.
fn relation(found: &Elimination, set: &[usize]) -> Option<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for (place, &idx) in set.iter().enumerate() {
        let mineral = &found.minerals[idx];
        let balance =
            Balance { coefficients: mineral.coefficients.clone(), ln_constant: mineral.ln_constant };
        let mut row = Row::new(&balance, place, set.len());
        row.coefficients.resize(found.primaries.len(), 0.0);
        for done in &rows {
            let factor = done.pivot.map_or(0.0, |species| row.coefficients[species]);
            row.subtract(factor, done);
        }
        match (0..row.coefficients.len()).find(|&species| row.coefficients[species] != 0.0) {
            Some(species) => {
                let by = row.coefficients[species];
                row.divide(by);
                row.pivot = Some(species);
                rows.push(row);
            }
            None => return row.origin.iter().all(|lambda| *lambda != 0.0).then_some(row),
        }
    }
    None
}

#[cfg(test)]
mod tests;
