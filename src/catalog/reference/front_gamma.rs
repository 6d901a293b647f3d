//! How incomplete mixing lowers the mixing state of a front.

use super::arguments::{CHI, ETA, checked, renamed};
use super::solutions::of_time;
use super::{Argument, Built, Item, Predicts};
use crate::maths::special::dawson_ratio;

pub(super) const ITEM: Item = Item {
    name: "front_gamma",
    predicts: Predicts::Gamma,
    arguments: ARGUMENTS,
    equation: "γ_AB = −η² F(√(χt)) / √(χt), F Dawson's integral",
    summary: "gamma of A and B at a step front, one slow mixing zone",
    source: "Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1, gamma of the dual-rate step front",
    build,
};

pub(super) const MULTIRATE: Item = Item {
    name: "multirate_front_gamma",
    predicts: Predicts::Gamma,
    arguments: ZONE_ARGUMENTS,
    equation: "γ_AB = −Σ_ij η_i η_j F(√(χ_ij t)) / √(χ_ij t), χ_ij = ½ (χ_i + χ_j)",
    summary: "gamma of A and B at a step front, up to three slow mixing zones",
    source: "Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1, multi-rate gamma of the step front",
    build: build_multirate,
};

const ARGUMENTS: &[Argument; 2] = &[ETA, CHI];

/// Three slow zones; what is left to a fraction of one mixes instantly.
pub(super) const ZONE_ARGUMENTS: &[Argument; 6] = &[
    renamed(ETA, "eta1", None, "fraction of the first slow mixing zone"),
    renamed(CHI, "chi1", None, "rate of the first slow mixing zone"),
    renamed(ETA, "eta2", Some(0.0), "fraction of the second slow mixing zone"),
    renamed(CHI, "chi2", Some(0.0), "rate of the second slow mixing zone"),
    renamed(ETA, "eta3", Some(0.0), "fraction of the third slow mixing zone"),
    renamed(CHI, "chi3", Some(0.0), "rate of the third slow mixing zone"),
];

/// γ of a step front.
///
/// Equation: `γ_AB = −η² F(√(χt)) / √(χt)`, F Dawson's integral.
/// Symbols: η fraction and χ rate of the slow zone, t time.
/// Dimensions and range: none; −1 to 0.
/// Source: Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1.
/// Shape: −η² at first, then rising to 0 like −η²/(2χt).
fn build(values: &[f64]) -> Built {
    let [eta, chi] = checked(ARGUMENTS, values)?;
    Ok(of_time(move |t| -eta * eta * dawson_ratio((chi * t.max(0.0)).sqrt())))
}

/// γ of a step front with several slow zones.
///
/// Equation: `γ_AB = −Σ_ij η_i η_j F(√(χ_ij t)) / √(χ_ij t)`, `χ_ij = ½(χ_i + χ_j)`.
/// Symbols: η_i fraction and χ_i rate of slow zone i, t time, F Dawson's integral.
/// Dimensions and range: none; −1 to 0.
/// Source: Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1.
/// Shape: −(Σ η_i)² at first, then rising to 0 zone by zone.
fn build_multirate(values: &[f64]) -> Built {
    let [eta1, chi1, eta2, chi2, eta3, chi3] = checked(ZONE_ARGUMENTS, values)?;
    let zones = Zones::new([(eta1, chi1), (eta2, chi2), (eta3, chi3)], MULTIRATE_DOC)?;
    Ok(of_time(move |t| -zones.sum_over_pairs(|chi| dawson_ratio((chi * t.max(0.0)).sqrt()))))
}

pub(super) const MULTIRATE_DOC: &str = "the fractions `eta1`, `eta2` and `eta3` must not exceed 1 together";

/// Slow zones as pairs of fraction and rate.
pub(super) struct Zones([(f64, f64); 3]);

impl Zones {
    /// Refuses fractions above one in sum, with `rule` as the reason.
    pub(super) fn new(zones: [(f64, f64); 3], rule: &str) -> Result<Self, String> {
        let sum: f64 = zones.iter().map(|zone| zone.0).sum();
        // A sum like 0.3 + 0.6 + 0.1 may exceed one by rounding.
        if sum > 1.0 + 1e-12 { Err(format!("{rule}, and their sum is {sum}.")) } else { Ok(Self(zones)) }
    }

    /// Σ_ij η_i η_j f(½(χ_i + χ_j))
    pub(super) fn sum_over_pairs(&self, f: impl Fn(f64) -> f64) -> f64 {
        let mut sum = 0.0;
        for (i, &(eta_i, chi_i)) in self.0.iter().enumerate() {
            for (j, &(eta_j, chi_j)) in self.0.iter().enumerate().skip(i) {
                let weight = if i == j { eta_i * eta_j } else { 2.0 * eta_i * eta_j };
                if weight > 0.0 {
                    sum += weight * f(0.5 * (chi_i + chi_j));
                }
            }
        }
        sum
    }
}
