//! What of a species came, went, reacted and is there; and means in a box.
//!
//! Owns these sums over parcels of water. May use the lab. It deliberately keeps no books: accounts are handed in.

use super::super::program::Program;
use super::super::snapshot::{Row, Values};
use super::lab::Lab;
use super::tally::lane_sum;

/// The budget of some species.
pub struct Budget {
    pub species: Vec<usize>,
    /// Per species and row what entered and what left.
    pub accounts: Vec<Vec<[f64; 2]>>,
    /// Amounts of what lives in bins, over the volume of a particle; `None` for what particles carry.
    pub in_bins: Vec<Option<f64>>,
}

impl Budget {
    /// Per species `Σ U`.
    #[inline(always)]
    pub fn add<const D: usize>(&self, lab: &Lab<D>, sums: &mut [f64]) {
        for (sum, &idx) in sums.iter_mut().zip(&self.species) {
            *sum += lane_sum(&lab.unreacted[idx][..lab.n]);
        }
    }

    /// Doors, reactions, what is there, and that less all others.
    pub fn rows<const D: usize>(&self, program: &Program<D>, sums: &[f64]) -> Values {
        let of = |((account, sum), in_bins): ((&Vec<[f64; 2]>, &f64), &Option<f64>)| {
            let inside = program.volume * in_bins.unwrap_or(*sum);
            let mut rows: Vec<Row> = Vec::with_capacity(account.len() + 2);
            let mut whole = 0.0;
            for (place, &[entered, left]) in account.iter().enumerate() {
                whole += entered - left;
                rows.push(Row { place: place as u16, numbers: vec![entered - left, entered, left] });
            }
            for amount in [inside, inside - whole] {
                rows.push(Row { place: rows.len() as u16, numbers: vec![amount, f64::NAN, f64::NAN] });
            }
            rows
        };
        Values::Rows(self.accounts.iter().zip(sums).zip(&self.in_bins).map(of).collect())
    }
}

/// Parcels in a box, then per species `Σ c`.
#[inline(always)]
pub fn add_within<const D: usize>(
    lab: &Lab<D>,
    low: &[f64; D],
    high: &[f64; D],
    species: &[usize],
    sums: &mut [f64],
) {
    for particle in 0..lab.n {
        let is_inside = (0..D).all(|axis| {
            let x = lab.positions[axis][particle];
            x >= low[axis] && x < high[axis]
        });
        if !is_inside {
            continue;
        }
        sums[0] += 1.0;
        for (sum, &idx) in sums[1..].iter_mut().zip(species) {
            *sum += lab.species[idx][particle];
        }
    }
}

/// Mean concentrations in a box; not a number without parcels.
pub fn within(sums: &[f64]) -> Values {
    let [n, sums @ ..] = sums else { return Values::Rows(Vec::new()) };
    let row = |sum: &f64| vec![Row { place: 0, numbers: vec![sum / n, f64::NAN, f64::NAN, *n] }];
    Values::Rows(sums.iter().map(row).collect())
}
