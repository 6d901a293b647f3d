//! Whether totals can be made of species at all.
//!
//! Owns the proof that they cannot. May use the compiled system. It deliberately finds no concentrations.

use super::system::System;

/// What rounding makes of a total, relative to what went into it.
const ROUNDING: f64 = 1e-11;
const MAX_PIVOTS: usize = 20_000;

/// A proof that no amounts `x ≥ 0` of species, minerals among them, have these totals; `None` if some do.
///
/// Equation: minimise `Σ |T_j − Σ_s ν_sj x_s|` over `x ≥ 0`; if it is not 0, there is a d with `d·ν_s ≥ 0` for all
/// species and `d·T < 0`, which proves it (Farkas).
/// Symbols: ν coefficients of a species over primaries, T totals.
/// Dimensions and range: any; a part of 1e-11 of what adds up to a total is taken for rounding.
/// Source: Chvátal 1983, Linear Programming, ch. 8 (first phase of the simplex method) and ch. 3 (Bland's rule,
/// which ends always).
/// Shape: a total is feasible if it lies in the cone of the species.
pub(super) fn infeasible(system: &System, totals: &[f64]) -> Option<Vec<f64>> {
    let mut tableau = Tableau::new(system, totals);
    for _ in 0..MAX_PIVOTS {
        let Some(column) = tableau.entering() else { break };
        let Some(row) = tableau.leaving(column) else { break };
        tableau.pivot(row, column);
    }
    if tableau.is_solved() { None } else { Some(tableau.proof(totals)) }
}

/// The species that no feasible amounts contain, as the totals lie on an edge of what species can make.
///
/// Equation: x_s is made largest over `x ≥ 0` with `ν x = T`; species of which that is 0 are absent.
/// Symbols: as of [`infeasible`].
/// Dimensions and range: feasible totals; else none is absent.
/// Source: Chvátal 1983, ch. 8 (second phase).
/// Shape: one phase per species that is not in any amounts seen before.
pub(super) fn absent(system: &System, totals: &[f64]) -> Vec<bool> {
    let mut tableau = Tableau::new(system, totals);
    let n_species = tableau.n_species;
    for _ in 0..MAX_PIVOTS {
        let Some(column) = tableau.entering() else { break };
        let Some(row) = tableau.leaving(column) else { break };
        tableau.pivot(row, column);
    }
    if !tableau.is_solved() {
        return vec![false; n_species];
    }
    tableau.drop_rests();
    let mut is_present = vec![false; n_species];
    for species in 0..n_species {
        tableau.mark(&mut is_present);
        if !is_present[species] {
            is_present[species] = tableau.can_rise(species);
        }
    }
    is_present.into_iter().map(|is_present| !is_present).collect()
}

struct Tableau {
    n_species: usize,
    /// Coefficients of species and of the rests of the totals, then the right side, then the size of what was
    /// added up to it.
    rows: Vec<Vec<f64>>,
    /// Species of each row; `n_species + j` is the rest of total j.
    basis: Vec<usize>,
}

impl Tableau {
    fn new(system: &System, totals: &[f64]) -> Self {
        let n = system.n_primaries;
        let n_species = n + system.rows.len();
        let right = n_species + n;
        let mut rows = vec![vec![0.0; right + 2]; n];
        for (j, row) in rows.iter_mut().enumerate() {
            row[j] = 1.0;
            row[right] = totals[j];
            row[right + 1] = totals[j].abs();
        }
        for (i, species) in system.rows.iter().enumerate() {
            for entry in &species.entries {
                rows[entry.primary][n + i] = entry.nu;
            }
        }
        for row in rows.iter_mut().filter(|row| row[right] < 0.0) {
            for value in &mut row[..=right] {
                *value = -*value;
            }
        }
        for (j, row) in rows.iter_mut().enumerate() {
            row[n_species + j] = 1.0;
        }
        Self { n_species, rows, basis: (n_species..n_species + n).collect() }
    }

    fn right(&self) -> usize {
        self.n_species + self.rows.len()
    }

    /// What the rests say about each total, when they cannot become less.
    fn proof(&self, totals: &[f64]) -> Vec<f64> {
        let rests: Vec<usize> = (0..self.rows.len()).filter(|&row| self.is_rest(row)).collect();
        let sum = |column: usize| rests.iter().map(|&row| self.rows[row][column]).sum::<f64>();
        let signed =
            |(j, total): (usize, &f64)| -sum(self.n_species + j) * if *total < 0.0 { -1.0 } else { 1.0 };
        totals.iter().enumerate().map(signed).collect()
    }

    fn is_rest(&self, row: usize) -> bool {
        self.basis[row] >= self.n_species
    }

    /// The first species of which more makes the rests less.
    fn entering(&self) -> Option<usize> {
        (0..self.n_species).find(|&column| {
            let rests = (0..self.rows.len()).filter(|&row| self.is_rest(row));
            !self.basis.contains(&column) && rests.map(|row| self.rows[row][column]).sum::<f64>() > 1e-9
        })
    }

    /// The row that bounds it, of equal ones the one of the first species.
    fn leaving(&self, column: usize) -> Option<usize> {
        let right = self.right();
        let candidates = (0..self.rows.len()).filter(|&row| self.rows[row][column] > 1e-9);
        candidates.min_by(|&a, &b| {
            let ratio = |row: usize| self.rows[row][right].max(0.0) / self.rows[row][column];
            ratio(a).total_cmp(&ratio(b)).then(self.basis[a].cmp(&self.basis[b]))
        })
    }

    fn pivot(&mut self, row: usize, column: usize) {
        let by = self.rows[row][column];
        for value in &mut self.rows[row] {
            *value /= by;
        }
        let own = self.rows[row].clone();
        let right = self.right();
        for (idx, other) in self.rows.iter_mut().enumerate() {
            let factor = other[column];
            if idx == row || factor == 0.0 {
                continue;
            }
            for (value, own) in other[..=right].iter_mut().zip(&own) {
                *value -= factor * own;
            }
            other[right + 1] += factor.abs() * own[right + 1];
            other[column] = 0.0;
        }
        self.basis[row] = column;
    }

    fn is_solved(&self) -> bool {
        let right = self.right();
        let is_rounding = |row: &Vec<f64>| row[right] <= ROUNDING * row[right + 1];
        (0..self.rows.len()).all(|idx| !self.is_rest(idx) || is_rounding(&self.rows[idx]))
    }

    /// Species in place of rests that are 0.
    fn drop_rests(&mut self) {
        for row in 0..self.rows.len() {
            let column = (0..self.n_species).find(|&column| {
                self.is_rest(row) && !self.basis.contains(&column) && self.rows[row][column].abs() > 1e-9
            });
            if let Some(column) = column {
                self.pivot(row, column);
            }
        }
    }

    fn is_positive(&self, row: usize) -> bool {
        let right = self.right();
        self.rows[row][right] > ROUNDING * self.rows[row][right + 1]
    }

    fn mark(&self, is_present: &mut [bool]) {
        for (row, &species) in self.basis.iter().enumerate() {
            if species < self.n_species && self.is_positive(row) {
                is_present[species] = true;
            }
        }
    }

    /// Whether amounts have some of a species.
    fn can_rise(&mut self, species: usize) -> bool {
        for _ in 0..MAX_PIVOTS {
            let own = self.basis.iter().position(|&other| other == species);
            let entering = match own {
                Some(row) if self.is_positive(row) => return true,
                Some(row) => (0..self.n_species)
                    .find(|&column| !self.basis.contains(&column) && self.rows[row][column] < -1e-9),
                None => Some(species),
            };
            let Some(column) = entering else { return false };
            // Without a bound it rises for ever.
            let Some(row) = self.leaving(column) else { return true };
            self.pivot(row, column);
        }
        false
    }
}
