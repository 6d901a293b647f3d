//! What parcels of water exchange with those around them, and what follows for it from kernel, step and spacing.
//!
//! Owns the plan's words of an exchange and its sizes. May use the catalogue and tapes. It deliberately moves nothing.

use super::Plan;
use super::check::{check_operations, require};
use super::check_transport::check_dispersion;
use super::shares;
use super::tape::Tape;
use super::tape::dual::differentiate;
use super::transport::Dispersion;
use crate::catalog::kernel::{self, Item};
use crate::maths::quadrature::integrate;
use crate::maths::scalar::{exp, pow};
pub use crate::scenario::exchange::{CUTOFFS, Cutoff};
pub use crate::scenario::{Integration, Normalisation};
use serde::{Deserialize, Serialize};

/// Exchange of everything that parcels carry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exchange {
    pub kernel: Kernel,
    /// Bandwidth h, m, over the inputs `collocation` and `spacing`, m.
    pub bandwidth: Tape,
    /// Dispersion by exchange: lower triangle row by row over the active axes, m²/s. What walks is beside it.
    /// Where it varies from place to place, that of a typical one, the same along all axes.
    pub diffusion: Vec<f64>,
    /// The dispersion by exchange where it varies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spreading: Option<Dispersion>,
    pub cutoff: Cutoff,
    /// Whether what the cut-off takes from the dispersion is given back.
    pub is_compensated: bool,
    pub normalisation: Normalisation,
    pub integration: Integration,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// Of the catalogue.
    Catalogue(String),
    /// Of the scene: W over the input q, and where it ends.
    Profile { name: String, value: Tape, support: f64 },
}

/// `W` and `−W′/q` over q.
pub type Profile<'e> = Box<dyn Fn(f64) -> (f64, f64) + 'e>;

/// Bytes of what a run remembers of pairs of parcels, at most, on one thread; more threads have more.
pub const MOST_PAIR_BYTES: usize = 12 << 20;

/// What follows from a plan for its exchange.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Mean distance of particles, m, in the metric of the dispersion.
    pub spacing: f64,
    /// The bandwidth that makes the leading error of a step vanish, m.
    pub collocation: f64,
    /// m
    pub bandwidth: f64,
    /// Where the kernel ends, in bandwidths.
    pub radius: f64,
    /// Dispersion of the kernel as it is cut off over what is asked for.
    pub fidelity: f64,
    /// Share of a parcel's water that is exchanged in a step.
    pub share: f64,
    /// What the fourth moment says of the bandwidth, m: that of a Gaussian with the same leading error.
    pub effective: f64,
    /// Within the radius, on average.
    pub neighbours: f64,
    /// Geometric mean of the principal dispersions, m²/s.
    pub diffusion: f64,
}

/// Moments of a kernel that ends at a radius: `∫ W q^{d−1}`, and `∫ (−W′/q) q^{d−1+k}` for k of 0, 2, 4.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Moments {
    mass: f64,
    force: [f64; 3],
}

impl Exchange {
    /// The profile and where it ends, however far.
    pub fn profile(&self) -> (Profile<'_>, f64) {
        match &self.kernel {
            Kernel::Catalogue(name) => {
                let item: &Item = kernel::find(name).unwrap_or(&kernel::ALL[0]);
                (Box::new(|q| ((item.value)(q * q), (item.force)(q * q))), item.support)
            }
            Kernel::Profile { value, support, .. } => (Box::new(|q| of_tape(value, q)), *support),
        }
    }

    /// Everything that follows for steps of `dt` of a plan with `n_axes`.
    ///
    /// - Equation: `ℓ = √(2 D Δt)`, collocation `ℓ/κ`, spacing `(V/N)^{1/d}`, share `β = (2 D Δt/h²) ∫(−W′/q)/∫W`,
    ///   fidelity `M₂/(d ∫W)`, effective bandwidth `κ h` with `κ² = M₄/(d (d + 2) ∫W)`.
    /// - Symbols: `D = (det D)^{1/d}`, `M_k = ∫ (−W′/q) q^{d−1+k} dq`, all up to the radius.
    /// - Range: dispersion along all axes.
    /// - Source: methods, sections 6.1, 6.5, 6.7; κ by the same expansion for any kernel (1 for a Gaussian).
    /// - Shape: one set of numbers.
    pub fn sizes(&self, plan: &Plan, dt: f64) -> Sizes {
        let d = plan.axes.len();
        let extent: f64 = plan.axes.iter().map(|axis| axis.high - axis.low).product();
        let spacing = pow(extent / plan.particles.count as f64, 1.0 / d as f64);
        let diffusion = self.mean_diffusion(d);
        let step = (2.0 * diffusion * dt).sqrt();
        let radius = self.radius(d);
        let moments = self.moments(d, radius);
        let fidelity = moments.force[1] / (d as f64 * moments.mass);
        let given_back = if self.is_compensated { 1.0 / fidelity } else { 1.0 };
        let kappa = (given_back * moments.force[2] / ((d * (d + 2)) as f64 * moments.mass)).sqrt();
        let collocation = step / kappa;
        let bandwidth = self.bandwidth.evaluate(&[collocation, spacing]);
        let share = (step / bandwidth) * (step / bandwidth) * given_back * moments.force[0] / moments.mass;
        let ball = [2.0, std::f64::consts::PI, 4.0 / 3.0 * std::f64::consts::PI][d.clamp(1, 3) - 1];
        let reach = radius * bandwidth;
        let neighbours = ball * (0..d).map(|_| reach / spacing).product::<f64>();
        Sizes {
            spacing,
            collocation,
            bandwidth,
            radius,
            fidelity,
            share,
            effective: kappa * bandwidth,
            neighbours,
            diffusion,
        }
    }

    /// Dispersion by exchange along an axis, m²/s.
    pub fn along(&self, axis_idx: usize) -> f64 {
        self.diffusion[axis_idx * (axis_idx + 1) / 2 + axis_idx]
    }

    /// The same where it is largest, as far as that is known.
    pub fn largest_along(&self, plan: &Plan, axis_idx: usize) -> f64 {
        match (&self.spreading, &plan.transport) {
            (Some(spreading), Some(transport)) => {
                shares::spread(&plan.axes, spreading, shares::speed(&plan.axes, transport))
            }
            _ => self.along(axis_idx),
        }
    }

    /// Whether it is well-formed for so many axes.
    pub fn check(&self, d: usize) -> Result<(), String> {
        check_operations(&self.bandwidth.operations, 2)?;
        self.spreading.as_ref().map_or(Ok(()), |spreading| check_dispersion(spreading, d))?;
        require(self.diffusion.len() == d * (d + 1) / 2, || {
            "the exchange has no dispersion for each axis".into()
        })?;
        let is_positive = (1..=d).all(|n| determinant(&self.diffusion[..n * (n + 1) / 2], n) > 0.0);
        require(is_positive, || "an exchange needs dispersion along all axes".into())?;
        match &self.kernel {
            Kernel::Catalogue(name) => {
                require(kernel::find(name).is_some(), || format!("no kernel `{name}`"))?
            }
            Kernel::Profile { value, support, .. } => {
                check_operations(&value.operations, 1)?;
                require(support.is_finite() && *support > 0.0, || "a kernel without an end".into())?;
            }
        }
        let radius = self.radius(d);
        require(radius.is_finite() && radius > 0.0, || "a kernel that ends nowhere".into())
    }

    /// Sums over neighbours, about: those that make the weights of parcels as they stand, and those of a step that exchanges
    /// this share.
    pub fn sums(&self, share: f64) -> (f64, f64) {
        let weights = match self.normalisation {
            Normalisation::Arithmetic | Normalisation::Geometric => 1.0,
            Normalisation::Sinkhorn => 20.0,
        };
        let applied = match self.integration {
            Integration::Explicit => 1.0,
            Integration::Implicit => 5.0 + 15.0 * share.sqrt(),
            Integration::Exponential => 15.0 + share + 8.0 * share.sqrt(),
        };
        (weights, applied)
    }

    /// The geometric mean of the principal dispersions, m²/s.
    pub fn mean_diffusion(&self, d: usize) -> f64 {
        pow(determinant(&self.diffusion, d).max(0.0), 1.0 / d as f64)
    }

    /// Where the kernel ends, in bandwidths.
    pub fn radius(&self, d: usize) -> f64 {
        let (_, support) = self.profile();
        let wanted = match self.cutoff {
            Cutoff::Radius(radius) => radius,
            Cutoff::Error(_) if support.is_finite() => support,
            Cutoff::Error(error) => {
                let (mut low, mut high) = (*CUTOFFS.start(), *CUTOFFS.end());
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    let moments = self.moments(d, middle);
                    let lost = 1.0 - moments.force[1] / (d as f64 * moments.mass);
                    if lost > error { low = middle } else { high = middle }
                }
                high
            }
        };
        wanted.min(support)
    }

    fn moments(&self, d: usize, radius: f64) -> Moments {
        let (profile, _) = self.profile();
        let mass = radial_moment(|q| profile(q).0, d - 1, radius);
        let force = [0, 2, 4].map(|k| radial_moment(|q| profile(q).1, d - 1 + k, radius));
        Moments { mass, force }
    }
}

/// `∫ f(q) qⁿ dq` from 0 to a radius.
pub(super) fn radial_moment(f: impl Fn(f64) -> f64, n: usize, radius: f64) -> f64 {
    let breaks: Vec<f64> = (0..=8).map(f64::from).filter(|at| *at < radius).chain([radius]).collect();
    let power = |q: f64| (0..n).map(|_| q).product::<f64>();
    integrate(|q| f(q) * power(q), &breaks, 1e-300, 1e-13).value
}

/// `W` and `−W′/q` of a profile of the scene.
pub fn of_tape(value: &Tape, q: f64) -> (f64, f64) {
    // At zero a profile is flat: there the second slope is met in a small distance.
    let at = if q > 1e-6 { q } else { 1e-6 };
    let (_, slopes) = differentiate(&value.operations, &[at], 0, 1);
    let slope = slopes.last().and_then(|own| own.first()).map_or(0.0, |&(_, slope)| slope);
    (value.evaluate(&[q]), -slope / at)
}

/// Determinant of a symmetric matrix of up to three rows, from its lower triangle.
pub fn determinant(triangle: &[f64], d: usize) -> f64 {
    match (d, triangle) {
        (1, &[a]) => a,
        (2, &[a, b, c]) => a * c - b * b,
        (3, &[a, b, c, e, f, g]) => a * (c * g - f * f) - b * (b * g - f * e) + e * (b * f - c * e),
        _ => 0.0,
    }
}

/// The relative error, in the norm of squares, of a Gaussian plume at the end.
///
/// - Equation: `(c_d/4) D t |h² − ℓ²| / σ⁴`, `c_d² = (d + 6)(d + 4)(d + 2) d / 16`; for exact integration `ℓ` is left out, for
///   implicit steps it is added.
/// - Symbols: `h` effective bandwidth, `σ` standard deviation at the end.
/// - Range: h and ℓ well below σ.
/// - Source: methods, section 6.5 (0.6404 in one dimension).
/// - Shape: a number.
pub fn plume_error(
    sizes: &Sizes,
    integration: Integration,
    (d, duration, dt): (usize, f64, f64),
    sigma: f64,
) -> f64 {
    let d = d as f64;
    let factor = ((d + 6.0) * (d + 4.0) * (d + 2.0) * d / 16.0).sqrt() / 4.0;
    let step = 2.0 * sizes.diffusion * dt;
    let excess = match integration {
        Integration::Explicit => sizes.effective * sizes.effective - step,
        Integration::Exponential => sizes.effective * sizes.effective,
        Integration::Implicit => sizes.effective * sizes.effective + step,
    };
    factor * sizes.diffusion * duration * excess.abs() / (sigma * sigma * sigma * sigma)
}

/// What is left of a mode with the wavelength of the spacing on ordered particles: the error of sums over them.
pub fn lattice_error(sizes: &Sizes) -> f64 {
    let ratio = sizes.bandwidth / sizes.spacing;
    2.0 * exp(-2.0 * std::f64::consts::PI * std::f64::consts::PI * ratio * ratio)
}
