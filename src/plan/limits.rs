//! Limits of stability and accuracy, computed from the scene before anything runs.
//!
//! Owns the numbers and the verdicts; a step, a number of bins or of particles that cannot work is
//! refused at its line, with the one that would. May use `scenario` for the places.

use super::cost::Cost;
use super::passes::Draft;
use super::time_scales::TimeScales;
use super::{
    OutputKind, Plan, ZoneRate, auto_step, averaging_limits, edges, exchange_limits, kernel_limits,
    reaction_limits, shares,
};
use crate::diagnostic::codes::{N101, N102, N103, N104, N201, N202, N203, N204, N301};
use crate::diagnostic::{Diagnostic, number, precise};
use crate::scenario::{self, MAX_BINS, Scenario};
use crate::source::Span;
use serde::Serialize;

/// A dimensionless number of the run and what it means.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limit {
    pub name: String,
    pub formula: &'static str,
    pub value: f64,
    pub advice: &'static str,
}

/// Particles per bin below which means are mostly noise, and below which they mean nothing.
pub(super) const FEW_PER_BIN: f64 = 50.0;
pub(super) const TOO_FEW_PER_BIN: f64 = 2.0;
/// χΔt above which splitting shows, and above which the covariance of a zone is lost in one step.
const LARGE_EXCHANGE: f64 = 0.2;
const TOO_LARGE_EXCHANGE: f64 = 2.0;
/// Numerical dispersion of the bins against the physical one.
pub(super) const VISIBLE_DISPERSION: f64 = 0.02;
/// Standard deviation by which the bins spread in a run, against the extent, where nothing else disperses.
pub(super) const VISIBLE_SPREADING: f64 = 0.01;

/// Works all limits out; diagnostics tell of those that are passed.
pub fn check(
    scenario: &Scenario,
    draft: &Draft,
    scales: Option<&TimeScales>,
    cost: &Cost,
    memory: Option<u64>,
) -> (Vec<Limit>, Vec<Diagnostic>) {
    let plan = &draft.plan;
    let mut limits = Vec::new();
    let mut diagnostics = Vec::new();
    // What walks by `transport` has no numbers in the walk with constant coefficients.
    if plan.transport.is_none() {
        travel(scenario, plan, &mut limits, &mut diagnostics);
        edges::check(scenario, plan, &mut diagnostics);
    } else if plan.carries_mass() {
        diagnostics.extend(between_steps(scenario, draft));
    }
    if plan.sees_bins() {
        particles_per_bin(scenario, plan, &mut limits, &mut diagnostics);
    }
    exchange(scenario, plan, &mut limits, &mut diagnostics);
    if plan.sees_bins() {
        numerical_dispersion(scenario, plan, &mut limits, &mut diagnostics);
    }
    averaging_limits::check(scenario, plan, &mut limits, &mut diagnostics);
    exchange_limits::check(scenario, plan, &mut limits, &mut diagnostics);
    reaction_limits::check(scenario, plan, scales, &mut limits, &mut diagnostics);
    kernel_limits::check(scenario, plan, &mut limits, &mut diagnostics);
    check_memory(scenario, plan, cost, memory, &mut diagnostics);
    (limits, diagnostics)
}

/// Masses are looked at after whole steps: between two of them nothing is known yet.
fn between_steps(scenario: &Scenario, draft: &Draft) -> Option<Diagnostic> {
    let (plan, time) = (&draft.plan, &draft.plan.time);
    let is_last = |t: f64| (t - time.duration).abs() <= 1e-9 * time.step;
    let (output_idx, t) = auto_step::times_between(&plan.outputs, time.step).find(|(_, t)| !is_last(*t))?;
    let kind = plan.outputs[output_idx].kind;
    let written = scenario.outputs.iter().find(|output| output.kind == kind && output.times.contains(&t));
    let message = Diagnostic::refused(N204, "mass particles are looked at after whole steps only")
        .at(scenario.run.step_span, format!("steps of {} s", precise(time.step)))
        .also(
            written.map_or(scenario.run.span, |output| output.span),
            format!("{} s is asked for here", precise(t)),
        )
        .found(format!("an output at {} s, between two steps", precise(t)))
        .expected("outputs at multiples of the step");
    let fitting = auto_step::fitting(&plan.outputs, time.step.min(time.duration), time.duration);
    Some(match fitting {
        Some(step) => {
            message.help(format!("use `step {} s`, of which all output times are multiples", precise(step)))
        }
        None => message.help("choose a step of which the output times are multiples"),
    })
}

pub(super) fn axis_name(index: usize) -> &'static str {
    ["x", "y", "z"][index]
}

/// Standard deviation of one step along an axis, m.
fn spread_length(plan: &Plan, axis_idx: usize, step: f64) -> f64 {
    let row = &plan.walk.spread[axis_idx * (axis_idx + 1) / 2..][..=axis_idx];
    // Relative to the largest entry, as squares of the largest and smallest numbers are none.
    let largest = row.iter().fold(0.0, |largest: f64, b| largest.max(b.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * row.iter().map(|b| (b / largest) * (b / largest)).sum::<f64>().sqrt() * step.sqrt()
}

/// Dispersion coefficient along an axis, m²/s, by walk and exchange; the largest one where it varies.
pub(super) fn dispersion(plan: &Plan, axis_idx: usize) -> f64 {
    let exchanged = plan.exchange.as_ref().map_or(0.0, |exchange| exchange.largest_along(plan, axis_idx));
    walking_dispersion(plan, axis_idx) + exchanged
}

/// The part of it that moves parcels.
pub(super) fn walking_dispersion(plan: &Plan, axis_idx: usize) -> f64 {
    if let Some(transport) = &plan.transport {
        let speed = shares::speed(&plan.axes, transport);
        return shares::spread(&plan.axes, &transport.dispersion, speed);
    }
    0.5 * spread_length(plan, axis_idx, 1.0).powi(2)
}

fn travel(scenario: &Scenario, plan: &Plan, limits: &mut Vec<Limit>, diagnostics: &mut Vec<Diagnostic>) {
    let step = plan.time.step.min(plan.time.duration);
    for (idx, axis) in plan.axes.iter().enumerate() {
        let extent = axis.high - axis.low;
        let width = extent / axis.bins as f64;
        let advective = plan.walk.drift[idx].abs() * step;
        let dispersive = spread_length(plan, idx, step);
        if axis.bins > 1 {
            limits.push(Limit {
                name: format!("Courant number along {}", axis_name(axis.index)),
                formula: "|v - v_frame| dt / bin width",
                value: advective / width,
                advice: "any value is exact for constant coefficients",
            });
            limits.push(Limit {
                name: format!("dispersion length per bin along {}", axis_name(axis.index)),
                formula: "sqrt(2 D dt) / bin width",
                value: dispersive / width,
                advice: "bins re-mix when particles change bins; below 0.1 exchange saturates within bins",
            });
        }
        if advective + 3.0 * dispersive > extent {
            diagnostics.push(
                Diagnostic::warning(
                    N104,
                    format!(
                        "a step carries particles across the whole domain along {}",
                        axis_name(axis.index)
                    ),
                )
                .at(scenario.run.step_span, format!("{} s", precise(step)))
                .found(format!("{} m in a step", short(advective + 3.0 * dispersive)))
                .expected(format!("less than the extent, {} m", short(extent)))
                .note("positions stay right in law; what happens between two outputs is not resolved")
                .help("use a shorter step, or a `frame` that moves with the flow"),
            );
        }
    }
}

fn n_bins(plan: &Plan) -> f64 {
    plan.axes.iter().map(|axis| axis.bins as f64).product()
}

fn bins_span(scenario: &Scenario) -> Span {
    scenario.bins.as_ref().map_or(scenario.particles.count_span, |bins| bins.span)
}

fn particles_per_bin(
    scenario: &Scenario,
    plan: &Plan,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let n_particles = plan.particles.count as f64;
    let per_bin = n_particles / n_bins(plan);
    limits.push(Limit {
        name: "particles per bin".into(),
        formula: "N / bins",
        value: per_bin,
        advice: "at least 50; above 1000 the bias of products is below 0.1 %",
    });
    let needed = (n_bins(plan) * FEW_PER_BIN).ceil();
    let affordable = (n_particles / FEW_PER_BIN).floor();
    let fewer_bins =
        if affordable >= 1.0 { format!(", or at most {affordable} bins in all") } else { String::new() };
    let place = |message: Diagnostic| {
        message
            .at(bins_span(scenario), format!("{} bins", n_bins(plan)))
            .also(scenario.particles.count_span, {
                let plural = if plan.particles.count == 1 { "" } else { "s" };
                format!("{} particle{plural}", plan.particles.count)
            })
            .found(format!("{} particles per bin", short(per_bin)))
            .expected(format!("at least {FEW_PER_BIN}"))
            .help(format!("use at least {needed} particles{fewer_bins}"))
    };
    if per_bin < TOO_FEW_PER_BIN {
        diagnostics
            .push(place(Diagnostic::refused(N201, "bins without particles have no mean to exchange with")));
    } else if per_bin < FEW_PER_BIN {
        diagnostics.push(place(Diagnostic::warning(N101, "means over few particles are mostly noise")));
    }
}

fn exchange(scenario: &Scenario, plan: &Plan, limits: &mut Vec<Limit>, diagnostics: &mut Vec<Diagnostic>) {
    let Some(mixing) = &plan.mixing else { return };
    for zone in &mixing.zones {
        let ZoneRate::Finite(rate) = zone.rate else { continue };
        let value = rate * plan.time.step;
        limits.push(Limit {
            name: format!("exchange per step of zone `{}`", zone.name),
            formula: "chi dt",
            value,
            advice: "below 0.2; the relaxation itself is exact for any value",
        });
        if value <= LARGE_EXCHANGE {
            continue;
        }
        let written = scenario.mixing.as_ref().and_then(|m| m.zones.iter().find(|z| z.name == zone.name));
        let step = LARGE_EXCHANGE / rate;
        let message = if value > TOO_LARGE_EXCHANGE {
            let title = format!(
                "step {} s cannot resolve zone `{}`: 1/chi = {} s, allowed {} s",
                short(plan.time.step),
                zone.name,
                short(1.0 / rate),
                short(step)
            );
            Diagnostic::refused(N202, title)
        } else {
            Diagnostic::warning(N102, format!("the step is coarse for zone `{}`", zone.name))
        };
        let mut message = message
            .at(scenario.run.step_span, format!("chi dt = {}", short(value)))
            .found(format!("chi dt = {}", short(value)))
            .expected(format!("chi dt <= {LARGE_EXCHANGE}"))
            .help(format!(
                "use `step {}` or less, or write `rate instant` if the limit is meant",
                round_down(step)
            ));
        if let Some(written) = written {
            message = message.also(written.rate_span, "the rate is set here");
        }
        diagnostics.push(message);
    }
}

/// A step of two figures, not above the given one, as text of the language.
pub(crate) fn round_down(seconds: f64) -> String {
    format!("{} s", number(rounded(seconds, 2, -1)))
}

/// Three figures, not below the given value.
pub(super) fn short_up(value: f64) -> String {
    number(rounded(value, 3, 1))
}

/// Three figures are enough for a message.
pub(crate) fn short(value: f64) -> String {
    number(rounded(value, 3, 0))
}

/// A value of so many decimal figures: the nearest one, or the next one above (1) or below (-1), but for
/// rounding. By way of text, as powers of ten of the largest and smallest numbers are none.
fn rounded(value: f64, n_figures: usize, direction: i8) -> f64 {
    let text = format!("{value:.*e}", n_figures - 1);
    let Some((mantissa, exponent)) = text.split_once('e') else { return value };
    let (Ok(mantissa), Ok(nearest)) = (mantissa.replace('.', "").parse::<i64>(), text.parse::<f64>()) else {
        return value;
    };
    let slack = 1e-12 * value.abs();
    let is_wrong = match direction {
        1 => nearest < value - slack,
        -1 => nearest > value + slack,
        _ => false,
    };
    if nearest.is_infinite() {
        return value;
    }
    if !is_wrong {
        return nearest;
    }
    let unit = exponent.parse::<i64>().unwrap_or(0) - (n_figures as i64 - 1);
    // Below a power of ten lie finer steps: from 100 it is 99 and not 90.
    let is_power = direction < 0 && mantissa == 10i64.pow(n_figures as u32 - 1);
    let (mantissa, unit) = if is_power { (10 * mantissa, unit - 1) } else { (mantissa, unit) };
    format!("{}e{unit}", mantissa + i64::from(direction)).parse().unwrap_or(value)
}

/// D_num = Σ η_i min(χ_i Δ²/24, Δ²/(12 Δt)) / Σ η_i over the zones that set the mean.
///
/// - Symbols: η_i fraction, χ_i exchange rate, Δ bin width, Δt step; instant zones follow the mean.
/// - Dimensions and range: m²/s; an upper estimate that holds while motion re-mixes the bins.
/// - Source: Sole-Mari, Fernàndez-Garcia, Sanchez-Vila, Bolster 2020 (quadratic scaling in Δ);
///   derivation in docs/methods.md.
/// - Shape: one value per axis.
fn bin_dispersion(plan: &Plan, axis_idx: usize) -> f64 {
    let Some(mixing) = &plan.mixing else { return 0.0 };
    let axis = &plan.axes[axis_idx];
    let width = (axis.high - axis.low) / axis.bins as f64;
    let saturated = width * width / (12.0 * plan.time.step);
    let mut sum = 0.0;
    let mut weight = 0.0;
    for zone in &mixing.zones {
        if let ZoneRate::Finite(rate) = zone.rate {
            sum += zone.fraction * (rate * width * width / 24.0).min(saturated);
            weight += zone.fraction;
        }
    }
    if weight > 0.0 { sum / weight } else { 0.0 }
}

fn numerical_dispersion(
    scenario: &Scenario,
    plan: &Plan,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    for (idx, axis) in plan.axes.iter().enumerate() {
        let physical = dispersion(plan, idx);
        let numerical = bin_dispersion(plan, idx);
        if axis.bins <= 1 || numerical == 0.0 {
            continue;
        }
        if physical == 0.0 {
            spreading(scenario, plan, idx, limits, diagnostics);
            continue;
        }
        let ratio = numerical / physical;
        limits.push(Limit {
            name: format!("numerical dispersion along {}", axis_name(axis.index)),
            formula: "chi width^2 / 24 / D",
            value: ratio,
            advice: "below 0.02; falls with the square of the bin width",
        });
        if ratio <= VISIBLE_DISPERSION {
            continue;
        }
        let name = axis_name(axis.index);
        let message = if ratio > 1.0 {
            Diagnostic::refused(N203, format!("the bins along {name} disperse more than the scene does"))
        } else {
            Diagnostic::warning(N103, format!("the bins along {name} add dispersion"))
        };
        diagnostics.push(
            message
                .at(bins_span(scenario), format!("{} bins along {name}", axis.bins))
                .found(format!("{} of the dispersion coefficient", short(ratio)))
                .expected(format!("at most {VISIBLE_DISPERSION}"))
                .help(enough_bins(plan, idx, ratio)),
        );
    }
}

/// Without dispersion there is nothing to compare the bins with but the domain. What moves relative to
/// them is spread all the same; what rests in them is not.
fn spreading(
    scenario: &Scenario,
    plan: &Plan,
    axis_idx: usize,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    if plan.walk.drift[axis_idx] == 0.0 {
        return;
    }
    let axis = &plan.axes[axis_idx];
    let name = axis_name(axis.index);
    let extent = axis.high - axis.low;
    let spread = (2.0 * bin_dispersion(plan, axis_idx) * plan.time.duration).sqrt();
    limits.push(Limit {
        name: format!("spreading by the bins along {name}"),
        formula: "sqrt(2 chi width^2 / 24 T) / extent",
        value: spread / extent,
        advice: "below 0.01; falls with the bin width",
    });
    if spread <= VISIBLE_SPREADING * extent {
        return;
    }
    let needed = (axis.bins as f64 * spread / (VISIBLE_SPREADING * extent)).ceil();
    let others = n_bins(plan) / axis.bins as f64;
    let frame =
        "let the frame move with the flow (`frame moving v`): what rests in its bins is not dispersed";
    let bins = if needed * others > MAX_BINS {
        String::new()
    } else {
        format!(
            ", or use at least {needed} bins along {name}, and {} particles",
            needed * others * FEW_PER_BIN
        )
    };
    diagnostics.push(
        Diagnostic::warning(N103, format!("the bins along {name} disperse, and the scene does not"))
            .at(bins_span(scenario), format!("{} bins along {name}", axis.bins))
            .found(format!("up to {} m of spreading in the run (standard deviation)", short(spread)))
            .expected(format!("at most {} m, 1 % of the extent", short(VISIBLE_SPREADING * extent)))
            .help(format!("{frame}{bins}")),
    );
}

/// What brings the dispersion of the bins down to where it is not seen.
fn enough_bins(plan: &Plan, axis_idx: usize, ratio: f64) -> String {
    let axis = &plan.axes[axis_idx];
    let name = axis_name(axis.index);
    let factor = ratio / VISIBLE_DISPERSION;
    let needed = (axis.bins as f64 * factor.sqrt()).ceil();
    let others = n_bins(plan) / axis.bins as f64;
    if needed * others > MAX_BINS {
        let enough = short_up(dispersion(plan, axis_idx) * factor);
        let larger = if factor.is_finite() {
            format!(", or a dispersion coefficient of {enough} m^2/s or more along {name}")
        } else {
            ", or a shorter domain".to_owned()
        };
        return format!("no number of bins is enough: use `rate instant`, which adds none{larger}");
    }
    let particles = needed * others * FEW_PER_BIN;
    if particles > plan.particles.count as f64 {
        format!("use at least {needed} bins along {name}, and {particles} particles to fill them")
    } else {
        format!("use at least {needed} bins along {name}")
    }
}

fn check_memory(
    scenario: &Scenario,
    plan: &Plan,
    cost: &Cost,
    memory: Option<u64>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let Some(available) = memory else { return };
    let needed = cost.bytes();
    if needed <= available {
        return;
    }
    let gib = |bytes: u64| bytes as f64 / f64::from(1u32 << 30);
    let message = Diagnostic::refused(N301, "the run does not fit into memory")
        .found(format!("{:.2} GiB needed", gib(needed)))
        .expected(format!("at most {:.2} GiB", gib(available)));
    let size = |output: &scenario::Output| {
        let n_bins: f64 = output.bins.iter().map(|&bins| bins as f64).product();
        n_bins * output.times.len() as f64 * output.species.len() as f64
    };
    let is_particles = |output: &scenario::Output| output.kind == OutputKind::Particles;
    let largest = scenario.outputs.iter().max_by(|a, b| size(a).total_cmp(&size(b)));
    diagnostics.push(match largest {
        // Fewer particles do not help where bins take the memory.
        Some(largest) if 2 * cost.output_bytes > needed && !scenario.outputs.iter().any(is_particles) => {
            message
                .at(
                    largest.bins_span,
                    format!("{:.2} GiB of outputs, most of them here", gib(cost.output_bytes)),
                )
                .help("use fewer bins, fewer times or fewer species")
        }
        _ => {
            let per_particle = needed as f64 / plan.particles.count as f64;
            let fitting = (available as f64 / per_particle).floor();
            message
                .at(
                    scenario.particles.count_span,
                    format!("{:.2} GiB of particles, bins and outputs", gib(needed)),
                )
                .help(format!("at most {fitting} particles fit"))
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_rounded_the_way_that_is_safe_at_every_size() {
        assert_eq!(
            [1234.0, 0.0, 1.234e-305, 1.7e308, f64::MAX].map(short),
            ["1230", "0", "1.23e-305", "1.7e308", "1.7977e308"]
        );
        assert_eq!([1.999e-300, 0.119, 7.0, 99.9].map(round_down), ["1.9e-300 s", "0.11 s", "7 s", "99 s"]);
        assert_eq!([1231.0, 0.999_1, 5.0, 1e-9].map(short_up), ["1240", "1", "5", "1e-9"]);
        assert_eq!([f64::INFINITY, f64::NAN].map(short), ["inf", "NaN"]);
    }
}
