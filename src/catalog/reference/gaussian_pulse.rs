//! A normally shaped pulse that moves and spreads, in one to three dimensions.

use super::arguments::{C0, DISPERSION, VELOCITY, X0, checked, extent, position, renamed, velocity};
use super::{Argument, Built, Item, Predicts, Solution};
use crate::maths::scalar::exp;

pub(super) const ITEM: Item = Item {
    name: "gaussian_pulse",
    predicts: Predicts::Concentration,
    arguments: ARGUMENTS,
    equation: "c = c0 Π_i (w_i / σ_i) exp(−(x_i − x0_i − v_i t)² / (2 σ_i²)), σ_i² = w_i² + 2 D_i t",
    summary: "a pulse of peak `c0` and standard deviation `width` at time 0 that moves and spreads; \
              with `width_y` and `width_z` it is bounded along y and z, too",
    source: "Crank 1975, The Mathematics of Diffusion, chapter 2; product of one-dimensional pulses",
    build,
};

const ANY: (f64, f64) = (-f64::MAX, f64::MAX);

const ARGUMENTS: &[Argument; 13] = &[
    renamed(C0, "c0", None, "peak concentration at time 0"),
    extent("width", None, "standard deviation along x at time 0; 0 means uniform along x"),
    DISPERSION,
    X0,
    VELOCITY,
    extent("width_y", Some(0.0), "standard deviation along y at time 0; 0 means uniform along y"),
    renamed(DISPERSION, "D_y", Some(0.0), "dispersion along y; needed with `width_y`"),
    position("y0", "centre along y at time 0"),
    velocity("v_y", Some(0.0), ANY, "velocity along y relative to the frame of the scene"),
    extent("width_z", Some(0.0), "standard deviation along z at time 0; 0 means uniform along z"),
    renamed(DISPERSION, "D_z", Some(0.0), "dispersion along z; needed with `width_z`"),
    position("z0", "centre along z at time 0"),
    velocity("v_z", Some(0.0), ANY, "velocity along z relative to the frame of the scene"),
];

/// Concentration of a spreading normal pulse.
///
/// Equation: `c = c0 Π_i (w_i / σ_i) exp(−(x_i − x0_i − v_i t)² / (2 σ_i²))`, `σ_i² = w_i² + 2 D_i t`.
/// Symbols: w_i initial standard deviation, D_i dispersion and v_i velocity along axis i, c0 initial peak.
/// Dimensions and range: concentration; 0 to c0.
/// Source: Crank 1975, The Mathematics of Diffusion, chapter 2; product of one-dimensional pulses.
/// Shape: a bell along every axis that has a width, uniform along the others.
fn build(values: &[f64]) -> Built {
    let [c0, width, d, x0, v, width_y, d_y, y0, v_y, width_z, d_z, z0, v_z] = checked(ARGUMENTS, values)?;
    for (axis, width, dispersion) in [("y", width_y, d_y), ("z", width_z, d_z)] {
        if width > 0.0 && dispersion == 0.0 {
            return Err(format!(
                "`width_{axis}` bounds the pulse along {axis}, so `D_{axis}` is needed, too."
            ));
        }
    }
    let axes = [
        Bell { width, dispersion: d, centre: x0, velocity: v },
        Bell { width: width_y, dispersion: d_y, centre: y0, velocity: v_y },
        Bell { width: width_z, dispersion: d_z, centre: z0, velocity: v_z },
    ];
    Ok(Box::new(Pulse { c0, axes }))
}

struct Pulse {
    c0: f64,
    axes: [Bell; 3],
}

impl Solution for Pulse {
    fn fill(&self, t: f64, positions: [&[f64]; 3], out: &mut [f64]) {
        for (idx, value) in out.iter_mut().enumerate() {
            let factors = (0..3).map(|axis| self.axes[axis].factor(positions[axis][idx], t));
            *value = self.c0 * factors.product::<f64>();
        }
    }
}

/// One axis of the pulse.
struct Bell {
    width: f64,
    dispersion: f64,
    centre: f64,
    velocity: f64,
}

impl Bell {
    fn factor(&self, x: f64, t: f64) -> f64 {
        if self.width == 0.0 {
            return 1.0;
        }
        let t = t.max(0.0);
        let sigma = (self.width * self.width + 2.0 * self.dispersion * t).sqrt();
        let z = (x - self.centre - self.velocity * t) / sigma;
        self.width / sigma * exp(-0.5 * z * z)
    }
}
