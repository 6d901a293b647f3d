//! The exchange of a scene, from the scenario to the plan, and what a kernel of the scene has to be.
//!
//! Owns the lowering and the look at profiles. May use the scenario and tapes. It deliberately judges no size: the
//! limits do.

use super::averaging::Averaging;
use super::build_tape::build_tape;
use super::exchange::{Exchange, Kernel, determinant, of_tape};
use super::lower::too_large;
use super::lower_transport::{self, of_fluid};
use super::tape::Tape;
use super::transport::{Dispersion, Flow, Transport};
use super::{Axis, shares};
use crate::diagnostic::codes::{M005, M036, M037};
use crate::diagnostic::{Diagnostic, precise};
use crate::maths::scalar::pow;
use crate::scenario::exchange::{Choice, Kernel as Written};
use crate::scenario::{self, Scenario};

/// Points at which a profile is looked at.
const N_POINTS: usize = 4096;
/// Relative to the largest value: what rounding may do to a profile that ends at zero.
const ROUNDING: f64 = 1e-12;
/// Small distances, relative to the support, at which the slope must have become proportional to them.
const NEAR: [f64; 3] = [1e-2, 1e-4, 1e-6];
/// The force of a kernel may grow by so much from one of them to the next.
const FLAT: f64 = 1.5;

/// The exchange of a scene; kernels that nobody uses are looked at as well.
pub(super) fn exchange(
    scenario: &Scenario,
    axes: &[Axis],
    transport: Option<&Transport>,
) -> Result<Option<Exchange>, Vec<Diagnostic>> {
    let mut problems = Vec::new();
    let mut profiles = Vec::new();
    for kernel in &scenario.kernels {
        match profile(kernel) {
            Ok(tape) => profiles.push(tape),
            Err(problem) => problems.push(*problem),
        }
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    // What mixes nothing is a plain walk; `compile` says so.
    let Some(written) = scenario.exchange.as_ref().filter(|written| written.mixing_fraction > 0.0) else {
        return Ok(None);
    };
    let Some(bandwidth) = build_tape(&written.bandwidth.value, &[]) else {
        return Err(vec![too_large(written.bandwidth.span)]);
    };
    let kernel = match written.kernel.value {
        Choice::Catalogue(name) => Kernel::Catalogue(name.to_owned()),
        Choice::Own(idx) => own(scenario, idx, profiles.swap_remove(idx)),
    };
    let (diffusion, spreading) = match transport.map(|transport| varying(scenario, axes, transport, written))
    {
        Some(Some(spreading)) => {
            let spreading = spreading?;
            (typical(scenario, axes, transport, &spreading, written)?, Some(spreading))
        }
        _ => (diffusion(scenario, written)?, None),
    };
    Ok(Some(Exchange {
        kernel,
        bandwidth,
        diffusion,
        spreading,
        cutoff: written.cutoff,
        is_compensated: written.is_compensated,
        normalisation: written.normalisation,
        integration: written.integration,
    }))
}

/// The means that zones exchange with; nothing where they are those of bins.
pub(super) fn averaging(scenario: &Scenario) -> Result<Option<Averaging>, Vec<Diagnostic>> {
    let Some(written) = &scenario.averaging else { return Ok(None) };
    let Some(bandwidth) = build_tape(&written.bandwidth.value, &[]) else {
        return Err(vec![too_large(written.bandwidth.span)]);
    };
    let kernel = match written.kernel.value {
        Choice::Catalogue(name) => Kernel::Catalogue(name.to_owned()),
        Choice::Own(idx) => {
            own(scenario, idx, profile(&scenario.kernels[idx]).map_err(|problem| vec![*problem])?)
        }
    };
    let (cutoff, normalisation) = (written.cutoff, written.normalisation);
    Ok(Some(Averaging { kernel, bandwidth, cutoff, normalisation }))
}

fn own(scenario: &Scenario, idx: usize, value: Tape) -> Kernel {
    let Written { name, support, .. } = &scenario.kernels[idx];
    Kernel::Profile { name: name.clone(), value, support: support.value }
}

/// The part of the dispersion that walks.
pub(super) fn walking_part(scenario: &Scenario) -> f64 {
    scenario.exchange.as_ref().map_or(1.0, |exchange| 1.0 - exchange.mixing_fraction)
}

/// The part of a dispersion that is exchanged, where it varies from place to place.
fn varying(
    scenario: &Scenario,
    axes: &[Axis],
    transport: &Transport,
    written: &scenario::exchange::Exchange,
) -> Option<Result<Dispersion, Vec<Diagnostic>>> {
    let full = match lower_transport::dispersion(scenario, axes) {
        Ok(full) => full,
        Err(problems) => return Some(Err(problems)),
    };
    let varies = match &full {
        Dispersion::Constant(_) => false,
        Dispersion::Isotropic(_) => true,
        Dispersion::Velocity { longitudinal, transverse, transverse_vertical, .. } => {
            let follows =
                [longitudinal, transverse, transverse_vertical].into_iter().any(|length| *length != 0.0);
            follows && !(matches!(transport.flow, Flow::Uniform(_)) && transport.changes.is_empty())
        }
    };
    varies.then(|| Ok(full.times(written.mixing_fraction, axes.len())))
}

/// A dispersion that varies at a typical place: lower triangle, the same along all axes, m²/s.
///
/// - Equation: the mean of an expression; `(D_L D_T^{d−1})^{1/d}` at the mean speed.
/// - Symbols: `D_L`, `D_T` dispersion along the flow and across it.
/// - Range: an estimate, for sizes that are shown and checked before a flow is known.
/// - Source: the metric of the exchange; methods, section 6.4.
/// - Shape: `d (d + 1)/2` entries.
fn typical(
    scenario: &Scenario,
    axes: &[Axis],
    transport: Option<&Transport>,
    spreading: &Dispersion,
    written: &scenario::exchange::Exchange,
) -> Result<Vec<f64>, Vec<Diagnostic>> {
    let d = axes.len();
    let size = match spreading {
        Dispersion::Isotropic(tape) => shares::mean(tape, axes),
        Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular } => {
            let speed = transport.map_or(0.0, |transport| shares::speed(axes, transport));
            let lengths = [longitudinal, transverse, transverse_vertical];
            let all = lengths.iter().take(d).map(|length| **length * speed + molecular);
            all.map(|own| pow(own, 1.0 / d as f64)).product()
        }
        Dispersion::Constant(_) => 0.0,
    };
    if size > 0.0 && size.is_finite() {
        return Ok((0..d).flat_map(|i| (0..=i).map(move |j| if i == j { size } else { 0.0 })).collect());
    }
    let place = scenario.dispersion.as_ref().map_or(written.span, |dispersion| dispersion.span);
    Err(vec![
        Diagnostic::refused(M036, "parcels of water cannot exchange in this scene")
            .at(place, "no dispersion along some direction")
            .also(written.span, "the exchange")
            .found(format!("{} m^2/s at a typical place", precise(size)))
            .expected("dispersion along all axes, of a size that numbers can hold")
            .help(
                "give every direction dispersion, molecular diffusion for example, or leave `exchange` out",
            ),
    ])
}

/// The part that is exchanged: lower triangle over the axes of the domain, m²/s.
fn diffusion(
    scenario: &Scenario,
    written: &scenario::exchange::Exchange,
) -> Result<Vec<f64>, Vec<Diagnostic>> {
    let (_, tensor) = of_fluid(scenario);
    let axes = &scenario.domain.axes;
    let entry = |row: usize, column: usize| written.mixing_fraction * tensor[row][column];
    let rows = axes.iter().enumerate();
    let triangle: Vec<f64> = rows
        .flat_map(|(i, row)| axes[..=i].iter().map(move |column| entry(row.index, column.index)))
        .collect();
    let place = scenario.dispersion.as_ref().map_or(written.span, |dispersion| dispersion.span);
    if !triangle.iter().copied().all(f64::is_finite) {
        return Err(vec![
            Diagnostic::error(M005, "the dispersion is out of range")
                .at(place, "too large for an exchange")
                .found("an infinite dispersion")
                .expected("a size that numbers can hold"),
        ]);
    }
    let minors = (1..=axes.len()).map(|n| determinant(&triangle[..n * (n + 1) / 2], n));
    if minors.into_iter().all(|minor| minor > 0.0 && minor.is_finite()) {
        return Ok(triangle);
    }
    Err(vec![
        Diagnostic::refused(M036, "parcels of water cannot exchange in this scene")
            .at(place, "no dispersion along some direction")
            .also(written.span, "the exchange")
            .found(format!("the lower triangle ({}) m^2/s", list(&triangle)))
            .expected("dispersion along all axes, of a size whose products numbers can hold")
            .help("give every axis dispersion, molecular diffusion for example, or leave `exchange` out"),
    ])
}

fn list(values: &[f64]) -> String {
    values.iter().map(|value| precise(*value)).collect::<Vec<_>>().join(", ")
}

/// A profile as a tape, if it is one: finite and not negative, falling, with something below it, and flat at its
/// middle.
fn profile(kernel: &Written) -> Result<Tape, Box<Diagnostic>> {
    let tape = build_tape(&kernel.value, &[]).ok_or_else(|| Box::new(too_large(kernel.value.span)))?;
    let end = kernel.support.value;
    let values: Vec<f64> =
        (0..=N_POINTS).map(|k| tape.evaluate(&[end * k as f64 / N_POINTS as f64])).collect();
    let at = |k: usize| precise(end * k as f64 / N_POINTS as f64);
    let refuse = |what: String, found: String, help: &str| {
        Box::new(
            Diagnostic::refused(M037, format!("`{}` is no kernel: {what}", kernel.name))
                .at(kernel.value.span, found.clone())
                .found(found)
                .expected(
                    "a profile that is finite, not negative, falls to its end and is flat at its middle",
                )
                .help(help),
        )
    };
    if let Some(k) = values.iter().position(|value| !value.is_finite()) {
        let found = format!("{} at q = {}", values[k], at(k));
        return Err(refuse("it is not finite".into(), found, "let it end before, or write it another way"));
    }
    let slack = ROUNDING * values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    if let Some(k) = values.iter().position(|value| *value < -slack) {
        let found = format!("{} at q = {}", precise(values[k]), at(k));
        return Err(refuse(
            "it is below zero".into(),
            found,
            "what is exchanged would flow uphill there: end it before",
        ));
    }
    if let Some(k) = (1..values.len()).find(|&k| values[k] > values[k - 1] + slack) {
        let found = format!("from {} to {} up to q = {}", precise(values[k - 1]), precise(values[k]), at(k));
        return Err(refuse(
            "it rises".into(),
            found,
            "what is exchanged would flow uphill there: let it fall",
        ));
    }
    if values[0] - values[N_POINTS] <= slack {
        let found = format!("{} everywhere", precise(values[0]));
        return Err(refuse("it does not fall".into(), found, "slopes are what is exchanged by"));
    }
    let forces = NEAR.map(|share| of_tape(&tape, share * end).1);
    if let Some(force) = steep(forces) {
        let found = format!("-W'/q is {} at q = {}", precise(force), precise(NEAR[2] * end));
        return Err(refuse(
            "it has a tip".into(),
            found,
            "let the slope vanish at q = 0, as that of 1 - q^2 does",
        ));
    }
    Ok(tape)
}

/// The force nearest to the middle, if it grows without bound there.
fn steep(forces: [f64; 3]) -> Option<f64> {
    let [far, middle, near] = forces;
    let grows = middle > FLAT * far && near > FLAT * middle;
    (grows || !forces.iter().all(|force| force.is_finite())).then_some(near)
}
