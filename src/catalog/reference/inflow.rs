//! A half-space that is fed through its boundary.

use super::arguments::{C0, DISPERSION, VELOCITY, X0, checked, renamed};
use super::solutions::of_x_and_time;
use super::{Argument, Built, Item, Predicts};
use crate::maths::scalar::{erfc, exp};
use crate::maths::special::erfcx;

pub(super) const OGATA_BANKS: Item = Item {
    name: "ogata_banks",
    predicts: Predicts::Concentration,
    arguments: ARGUMENTS,
    equation: "c = ½ inlet [erfc(ξ₋) + exp(v x/D) erfc(ξ₊)], ξ∓ = (x ∓ v t) / (2 √(D t))",
    summary: "flow into a clean half-space x > x0 whose boundary keeps the concentration `inlet`",
    source: "Ogata & Banks 1961, USGS Professional Paper 411-A",
    build: build_ogata_banks,
};

pub(super) const CAUCHY_INFLOW: Item = Item {
    name: "cauchy_inflow",
    predicts: Predicts::Concentration,
    arguments: ARGUMENTS,
    equation: "c = inlet [½ erfc(ξ₋) + √(v² t / πD) exp(−ξ₋²) − ½ (1 + v x/D + v² t/D) exp(v x/D) erfc(ξ₊)]",
    summary: "flow into a clean half-space x > x0 through a boundary with the flux `velocity * inlet`",
    source: "Lindstrom, Haque, Freed, Boersma 1967, Environ. Sci. Technol. 1, solution for a flux boundary",
    build: build_cauchy_inflow,
};

const ARGUMENTS: &[Argument; 4] = &[
    Argument {
        range: (0.0, f64::MAX),
        ..renamed(VELOCITY, "velocity", None, "pore velocity, towards larger x")
    },
    renamed(DISPERSION, "dispersion", None, "hydrodynamic dispersion"),
    renamed(C0, "inlet", None, "concentration of the inflowing water"),
    renamed(X0, "x0", Some(0.0), "position of the boundary"),
];

/// Half-space with a prescribed concentration at its boundary.
///
/// Equation: `c = ½ inlet [erfc(ξ₋) + e^{v x/D} erfc(ξ₊)]`, `ξ∓ = (x ∓ v t) / (2 √(D t))`.
/// Symbols: x distance from the boundary, v velocity, D dispersion, t time, inlet the boundary's value.
/// Dimensions and range: concentration; 0 to `inlet`, which is also the value outside (x < 0).
/// Source: Ogata & Banks 1961, USGS Professional Paper 411-A; the second term as exp(−ξ₋²) erfcx(ξ₊).
/// Shape: a front that leaves the boundary and spreads.
fn build_ogata_banks(values: &[f64]) -> Built {
    let [velocity, dispersion, inlet, x0] = checked(ARGUMENTS, values)?;
    let column = Column { velocity, dispersion };
    Ok(of_x_and_time(move |x, t| inlet * column.fixed_concentration(x - x0, t)))
}

/// Half-space with a prescribed flux through its boundary.
///
/// Equation: `c = inlet [½ erfc(ξ₋) + √(v²t/πD) e^{−ξ₋²} − ½ (1 + v x/D + v²t/D) e^{v x/D} erfc(ξ₊)]`.
/// Symbols: as for a prescribed concentration; `inlet` is flux divided by velocity.
/// Dimensions and range: concentration; 0 to `inlet`; the boundary's value is taken outside (x < 0).
/// Source: Lindstrom et al. 1967; the exponential as exp(−ξ₋²) erfcx(ξ₊).
/// Shape: as above, with a value at the boundary that rises from 0 to `inlet`.
fn build_cauchy_inflow(values: &[f64]) -> Built {
    let [velocity, dispersion, inlet, x0] = checked(ARGUMENTS, values)?;
    let column = Column { velocity, dispersion };
    Ok(of_x_and_time(move |x, t| inlet * column.fixed_flux(x - x0, t)))
}

#[derive(Clone, Copy)]
pub(super) struct Column {
    pub velocity: f64,
    pub dispersion: f64,
}

impl Column {
    pub fn fixed_concentration(self, x: f64, t: f64) -> f64 {
        if x <= 0.0 {
            return 1.0;
        }
        let Some((behind, ahead)) = self.similarity(x, t) else {
            return self.plug(x, t);
        };
        0.5 * (erfc(behind) + exp(-behind * behind) * erfcx(ahead))
    }

    pub fn fixed_flux(self, x: f64, t: f64) -> f64 {
        let x = x.max(0.0);
        let Some((behind, ahead)) = self.similarity(x, t) else {
            return self.plug(x, t);
        };
        // 2 v√t/√D · ξ₊ = v x/D + v²t/D, and 1/√π − ξ₊ erfcx(ξ₊) stays accurate for large ξ₊.
        let speed = self.velocity * (t / self.dispersion).sqrt();
        let bell = exp(-behind * behind);
        if bell == 0.0 {
            return 0.5 * erfc(behind);
        }
        0.5 * erfc(behind) + bell * (speed * flux_defect(ahead) - 0.5 * erfcx(ahead))
    }

    /// ξ₋ and ξ₊, if the front has spread at all.
    pub fn similarity(self, x: f64, t: f64) -> Option<(f64, f64)> {
        let width = 2.0 * (self.dispersion * t).sqrt();
        let travelled = self.velocity * t;
        (t > 0.0 && width > 0.0).then(|| ((x - travelled) / width, (x + travelled) / width))
    }

    /// Without dispersion the front is sharp.
    fn plug(self, x: f64, t: f64) -> f64 {
        if x < self.velocity * t { 1.0 } else { 0.0 }
    }
}

/// `1/√π − z erfcx(z)`, which falls like 1/(2 √π z²).
fn flux_defect(z: f64) -> f64 {
    const INVERSE_SQRT_PI: f64 = 0.564_189_583_547_756_3;
    if z < 20.0 {
        INVERSE_SQRT_PI - z * erfcx(z)
    } else {
        let q = 0.5 / z / z;
        INVERSE_SQRT_PI * q * (1.0 - 3.0 * q * (1.0 - 5.0 * q * (1.0 - 7.0 * q * (1.0 - 9.0 * q))))
    }
}
