//! A half-space that is fed through its boundary with what decays, and sorbs.

use super::arguments::{C0, CHI, DISPERSION, VELOCITY, X0, checked, renamed};
use super::inflow::Column;
use super::solutions::of_x_and_time;
use super::{Argument, ArgumentDimension, Built, Item, Predicts};
use crate::maths::quadrature::integrate;
use crate::maths::scalar::{erfc, exp};
use crate::maths::special::erfcx;
use crate::units::Dimension;

pub(super) const FIXED_CONCENTRATION: Item = Item {
    name: "decaying_ogata_banks",
    predicts: Predicts::Concentration,
    arguments: ARGUMENTS,
    equation: "c = ½ inlet [exp((w − u) x/2E) erfc((x − u t)/s) + exp((w + u) x/2E) erfc((x + u t)/s)], w = v/R, E = D/R, u = √(w² + 4 k E), s = 2 √(E t)",
    summary: "flow into a clean half-space x > x0 whose boundary keeps the concentration `inlet`, with decay of all that is there",
    source: "van Genuchten & Alves 1982, USDA Technical Bulletin 1661, first-order decay with a fixed boundary value",
    build: build_fixed_concentration,
};

pub(super) const FIXED_FLUX: Item = Item {
    name: "decaying_cauchy_inflow",
    predicts: Predicts::Concentration,
    arguments: ARGUMENTS,
    equation: "c = inlet [w/(w + u) exp((w − u) x/2E) erfc((x − u t)/s) + w/(w − u) exp((w + u) x/2E) erfc((x + u t)/s) + w²/(2 k E) exp(w x/E − k t) erfc((x + w t)/s)], w = v/R, E = D/R, u = √(w² + 4 k E), s = 2 √(E t)",
    summary: "flow into a clean half-space x > x0 through a boundary with the flux `velocity * inlet`, with decay of all that is there",
    source: "van Genuchten & Alves 1982, USDA Technical Bulletin 1661, first-order decay under a flux boundary",
    build: build_fixed_flux,
};

const ARGUMENTS: &[Argument; 6] = &[
    Argument {
        range: (0.0, f64::MAX),
        ..renamed(VELOCITY, "velocity", None, "pore velocity, towards larger x")
    },
    renamed(DISPERSION, "dispersion", None, "hydrodynamic dispersion"),
    renamed(C0, "inlet", None, "concentration of the inflowing water"),
    renamed(CHI, "rate", None, "rate of decay, in the water and sorbed"),
    Argument {
        name: "retardation",
        dimension: ArgumentDimension::Fixed(Dimension::NONE),
        default: Some(1.0),
        range: (1.0, f64::MAX),
        doc: "total over dissolved concentration",
    },
    renamed(X0, "x0", Some(0.0), "position of the boundary"),
];

/// Half-space with a prescribed concentration at its boundary, and decay.
///
/// Equation: `c = ½ inlet e^{(w − u)x/2E} [erfc(ξ₋) + e^{−ξ₋²} erfcx(ξ₊)]`, `ξ∓ = (x ∓ u t)/(2√(E t))`.
/// Symbols: x distance from the boundary, `w = v/R`, `E = D/R`, `u = √(w² + 4kE)`, k rate.
/// Dimensions and range: concentration; 0 to `inlet`, which is also the value outside (x < 0).
/// Source: van Genuchten & Alves 1982, USDA Technical Bulletin 1661.
/// Shape: a front that comes to rest as `e^{(w − u)x/2E}`.
fn build_fixed_concentration(values: &[f64]) -> Built {
    let (column, inlet, x0) = column(values)?;
    Ok(of_x_and_time(move |x, t| inlet * column.fixed_concentration(x - x0, t)))
}

/// Half-space with a prescribed flux through its boundary, and decay.
///
/// Equation: `c = inlet {e^{(w − u)x/2E} [w/(w + u) erfc(ξ₋) + w/(w − u) e^{−ξ₋²} erfcx(ξ₊)]
/// + w²/(2kE) e^{−kt − η₋²} erfcx(η₊)}`, `η∓ = (x ∓ w t)/(2√(E t))`.
/// Symbols: as for a prescribed concentration; `inlet` is flux divided by velocity.
/// Dimensions and range: concentration; 0 to `inlet`; the boundary's value is taken outside (x < 0). Where `kE/w²` is
/// below 10⁻⁶ and the terms cancel, `c = e^{−kt} c₀(t) + k ∫ e^{−kτ} c₀(τ) dτ` with c₀ without decay (Danckwerts 1951).
/// Source: van Genuchten & Alves 1982, USDA Technical Bulletin 1661.
/// Shape: as above, with `2w/(w + u)` of `inlet` at the boundary in the end.
fn build_fixed_flux(values: &[f64]) -> Built {
    let (column, inlet, x0) = column(values)?;
    Ok(of_x_and_time(move |x, t| inlet * column.fixed_flux(x - x0, t)))
}

fn column(values: &[f64]) -> Result<(Decaying, f64, f64), String> {
    let [velocity, dispersion, inlet, rate, retardation, x0] = checked(ARGUMENTS, values)?;
    let plain = Column { velocity: velocity / retardation, dispersion: dispersion / retardation };
    Ok((Decaying { plain, rate }, inlet, x0))
}

/// `kE/w²` below which the terms of the closed form cancel.
const SLOW: f64 = 1e-6;

#[derive(Clone, Copy)]
struct Decaying {
    plain: Column,
    rate: f64,
}

impl Decaying {
    /// √(w² + 4kE)
    fn speed(self) -> f64 {
        let Column { velocity, dispersion } = self.plain;
        (velocity * velocity + 4.0 * self.rate * dispersion).sqrt()
    }

    /// What is left at a distance in the end.
    fn decayed(self, x: f64) -> f64 {
        // (w − u)/2E = −2k/(w + u)
        exp(-2.0 * self.rate * x / (self.plain.velocity + self.speed()))
    }

    /// ξ₋ and ξ₊ at a speed, if anything has spread.
    fn similarity(self, speed: f64, x: f64, t: f64) -> Option<(f64, f64)> {
        Column { velocity: speed, ..self.plain }.similarity(x, t)
    }

    fn fixed_concentration(self, x: f64, t: f64) -> f64 {
        if x <= 0.0 || self.rate == 0.0 {
            return self.plain.fixed_concentration(x, t);
        }
        let Some((behind, ahead)) = self.similarity(self.speed(), x, t) else {
            return self.plug(x, t);
        };
        0.5 * self.decayed(x) * (erfc(behind) + exp(-behind * behind) * erfcx(ahead))
    }

    fn fixed_flux(self, x: f64, t: f64) -> f64 {
        let Column { velocity, dispersion } = self.plain;
        let x = x.max(0.0);
        if self.rate == 0.0 || velocity == 0.0 {
            return self.plain.fixed_flux(x, t);
        }
        let u = self.speed();
        let Some((behind, ahead)) = self.similarity(u, x, t) else {
            return self.plug(x, t);
        };
        let slowness = self.rate * dispersion / (velocity * velocity);
        if slowness < SLOW {
            return self.slow(x, t);
        }
        let Some((plain_behind, plain_ahead)) = self.similarity(velocity, x, t) else {
            return self.plug(x, t);
        };
        // w/(w − u) = −w (w + u)/(4kE)
        let image = -0.25 * (1.0 + u / velocity) / slowness;
        let bells = [behind, plain_behind].map(|z| exp(-z * z));
        let front = velocity / (velocity + u) * erfc(behind) + image * bells[0] * erfcx(ahead);
        let lost = 0.5 / slowness * exp(-self.rate * t) * bells[1] * erfcx(plain_ahead);
        (self.decayed(x) * front + lost).max(0.0)
    }

    /// By the solution without decay.
    fn slow(self, x: f64, t: f64) -> f64 {
        let came = |tau: f64| exp(-self.rate * tau) * self.plain.fixed_flux(x, tau);
        // What it integrates rises about the time of arrival.
        let arrival = (x / self.plain.velocity).min(0.5 * t);
        self.rate * integrate(came, &[0.0, 0.5 * arrival, 1.5 * arrival, t], 0.0, 1e-11).value + came(t)
    }

    /// Without dispersion the front is sharp.
    fn plug(self, x: f64, t: f64) -> f64 {
        if x < self.plain.velocity * t { self.decayed(x) } else { 0.0 }
    }
}
