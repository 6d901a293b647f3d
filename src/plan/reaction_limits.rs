//! Limits of reactions: how fast they are against the step, transport and exchange.
//!
//! Owns these numbers and verdicts. May use `scenario` for the places. It deliberately refuses no step for
//! being long against a reaction: sub-steps resolve that, and taking turns with exchange is what is judged.

use super::chemistry::{Method, Splitting};
use super::integrator::Expected;
use super::limits::{Limit, dispersion, short};
use super::time_scales::TimeScales;
use super::{Plan, ZoneRate, turns};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{N106, N107, N201};
use crate::scenario::Scenario;

/// Relative error of taking turns above which it shows.
const VISIBLE_SPLITTING: f64 = 0.1;

/// Part of a reactant that the noise of means keeps from its partner above which it shows.
const VISIBLE_NOISE: f64 = 0.03;
/// Particles per bin below which what lives in bins meets too few.
const FEW_PER_BIN: f64 = 10.0;

pub(super) fn check(
    scenario: &Scenario,
    plan: &Plan,
    scales: Option<&TimeScales>,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    if plan.has_immobile() && !plan.carries_mass() {
        particles_per_bin(scenario, plan, diagnostics);
    }
    noise_of_means(scenario, plan, limits, diagnostics);
    if let Some(decay) = plan.transport.as_ref().and_then(|transport| transport.decay.as_ref()) {
        limits.push(Limit {
            name: "reactions of a particle per step".into(),
            formula: "k dt on the mean over the run",
            value: turns::per_step(plan, decay),
            advice: "any: they are followed, hundreds to and fro together, and a long step is as right as a short one",
        });
    }
    let (Some(scales), Some(kinetics)) =
        (scales, plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref()))
    else {
        return;
    };
    for (reaction, rate) in kinetics.reactions.iter().zip(&scales.rates).filter(|(_, rate)| **rate > 0.0) {
        limits.push(Limit {
            name: format!("shortest time of reaction `{}` in s", reaction.name),
            formula: "1 / |dr/dc . nu|",
            value: 1.0 / rate,
            advice: "no limit to the step: sub-steps follow it",
        });
    }
    let rate = scales.fastest_rate();
    limits.push(Limit {
        name: "fastest reaction per step".into(),
        formula: "|dr/dc . nu| dt",
        value: rate * plan.time.step,
        advice: "any: sub-steps are as short as they must be",
    });
    limits.push(Limit {
        name: "stiffness".into(),
        formula: "fastest reaction / slowest reaction",
        value: scales.stiffness(),
        advice: "no limit: implicit integrators take any",
    });
    sub_steps(plan, scales, limits);
    damkohler(plan, rate, limits);
    splitting(scenario, plan, scales, limits, diagnostics);
}

/// What decides between explicit and implicit integration.
fn sub_steps(plan: &Plan, scales: &TimeScales, limits: &mut Vec<Limit>) {
    let Some(chemistry) = plan.chemistry.as_ref().filter(|chemistry| chemistry.has_error_control()) else {
        return;
    };
    let expected = Expected::new(scales, chemistry, plan.components.len());
    limits.push(Limit {
        name: "sub-steps of an explicit integrator".into(),
        formula: "about int |dr/dc . nu| dt / 3.3 in a step, or as accuracy asks",
        value: expected.explicit,
        advice: "it is taken where this is less than those of an implicit one times what they cost",
    });
    limits.push(Limit {
        name: "the same for an implicit one, in explicit ones".into(),
        formula: "about as accuracy asks, times what its matrix costs",
        value: expected.price * expected.implicit,
        advice: "above the explicit ones the network is not stiff over a step",
    });
}

/// Fastest reaction against transport over the domain and against exchange.
fn damkohler(plan: &Plan, rate: f64, limits: &mut Vec<Limit>) {
    for (idx, axis) in plan.axes.iter().enumerate() {
        let extent = axis.high - axis.low;
        let (drift, spread) = (plan.walk.drift[idx].abs(), dispersion(plan, idx));
        let name = ["x", "y", "z"][axis.index];
        if drift > 0.0 {
            limits.push(Limit {
                name: format!("Damköhler number along {name}, against flow"),
                formula: "|dr/dc . nu| extent / |v - v_frame|",
                value: rate * extent / drift,
                advice: "far above 1 mixing limits the reaction, far below it the rate does",
            });
        }
        if spread > 0.0 {
            limits.push(Limit {
                name: format!("Damköhler number along {name}, against dispersion"),
                formula: "|dr/dc . nu| extent^2 / D",
                value: rate * extent * extent / spread,
                advice: "far above 1 mixing limits the reaction, far below it the rate does",
            });
        }
    }
    for zone in plan.mixing.iter().flat_map(|mixing| &mixing.zones) {
        let ZoneRate::Finite(exchange) = zone.rate else { continue };
        if exchange > 0.0 {
            limits.push(Limit {
                name: format!("Damköhler number of zone `{}`", zone.name),
                formula: "2 |dr/dc . nu| / chi",
                value: 2.0 * rate / exchange,
                advice: "far above 1 exchange limits the reaction, far below it the rate does",
            });
        }
    }
}

/// What taking turns misses: exchange and reaction in one step, each without the other.
///
/// - Equation: `e = ½ η (χΔt/2) min(λΔt, 1)`; with symmetric splitting its square.
/// - Symbols: η fraction and χ rate of the fastest zone that exchanges, λ the fastest reaction.
/// - Dimensions and range: relative to what one step exchanges; an estimate of size, not a bound.
/// - Source: the leading term ½Δt[T, R] of Lie splitting; methods, section 8.2.
/// - Shape: one number.
fn splitting(
    scenario: &Scenario,
    plan: &Plan,
    scales: &TimeScales,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let (step, rate) = (plan.time.step, scales.fastest_rate());
    // What an instant zone has reacted is seen by others when the next mean over the parcels around is taken.
    let of_instant = if plan.has_kernel_mean() { 1.0 / step } else { 0.0 };
    let zones = plan.mixing.iter().flat_map(|mixing| &mixing.zones);
    let exchange = zones.map(|zone| match zone.rate {
        ZoneRate::Finite(rate) => 0.5 * zone.fraction * rate,
        ZoneRate::Instant => zone.fraction * of_instant,
    });
    let exchange = exchange.fold(0.0, f64::max);
    if exchange == 0.0 {
        return;
    }
    let first_order = 0.5 * exchange * step * (rate * step).min(1.0);
    let is_strang = plan.chemistry.as_ref().is_some_and(|chemistry| chemistry.splitting == Splitting::Strang);
    let is_symmetric = is_strang && of_instant == 0.0;
    let value = if is_symmetric { first_order * first_order } else { first_order };
    limits.push(Limit {
        name: "splitting of exchange and reaction".into(),
        formula: if is_symmetric { "(eta chi dt min(k dt, 1) / 4)^2" } else { "eta chi dt min(k dt, 1) / 4" },
        value,
        advice: "relative to what a step exchanges; below 0.1",
    });
    if value <= VISIBLE_SPLITTING {
        return;
    }
    let needed = step * VISIBLE_SPLITTING / value;
    let mut message = Diagnostic::warning(N106, "the step is coarse for exchange and reaction in turns")
        .at(scenario.run.step_span, format!("{} s", short(step)))
        .found(format!("an error of about {} of what a step exchanges", short(value)))
        .expected(format!("at most {VISIBLE_SPLITTING}"))
        .help(format!("use `step {} s` or less, or `chemistry order 2`", short(needed)));
    let name =
        plan.chemistry.as_ref().and_then(|c| c.kinetics.as_ref()).map(|k| &k.reactions[scales.fastest].name);
    if let Some(reaction) = name.and_then(|name| scenario.reaction(name)) {
        message = message.also(reaction.span, format!("the fastest reaction: 1/k = {} s", short(1.0 / rate)));
    }
    diagnostics.push(message);
}

/// What well-mixed reactants leave of each other, as their means over a bin are those of few particles.
///
/// - Equation: `E|k − n/2| / (n/2) = √(2/(π n))`, k of n particles with one reactant, the others with the other.
/// - Symbols: n particles per bin.
/// - Dimensions and range: relative to the reactants before a complete reaction in the proportion in which they react;
///   a product of means is less by 1/n only, and one that is never complete is between the two. Zones with a rate hold
///   other means from step to step and are free of it.
/// - Source: the mean deviation of the binomial distribution for many particles; docs/methods.md.
/// - Shape: one number.
fn noise_of_means(
    scenario: &Scenario,
    plan: &Plan,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let n_bins: f64 = plan.axes.iter().map(|axis| axis.bins as f64).product();
    let is_well_mixed = plan.mixing.as_ref().is_some_and(|mixing| mixing.is_well_mixed);
    let averaging = plan.averaging();
    if !is_well_mixed || !plan.moves() || n_bins <= 1.0 && averaging.is_none() {
        return;
    }
    let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
    let is_linear = |method: Method| matches!(method, Method::Observed | Method::Exponential | Method::Zero);
    if plan.reactions.is_empty() && kinetics.is_none_or(|kinetics| is_linear(kinetics.method)) {
        return;
    }
    let of = |per_bin: f64| (std::f64::consts::FRAC_2_PI / per_bin).sqrt();
    let found = match averaging {
        None => plan.particles.count as f64 / n_bins,
        Some(averaging) => averaging.extents(plan).effective,
    };
    let value = of(found);
    limits.push(Limit {
        name: "reactants that the noise of means keeps apart".into(),
        formula: "sqrt(2 / (pi n)), n particles in a mean",
        value,
        advice: "at most, where reactants are in balance; below 0.03; falls with the root of the particles",
    });
    if value <= VISIBLE_NOISE {
        return;
    }
    let per_bin = std::f64::consts::FRAC_2_PI / (VISIBLE_NOISE * VISIBLE_NOISE);
    if let Some(written) = &scenario.averaging {
        let more = (plan.particles.count as f64 * per_bin / found).ceil();
        diagnostics.push(
            Diagnostic::warning(N107, "the noise of means keeps reactants apart")
                .at(written.bandwidth.span, format!("means of {} parcels", short(found)))
                .found(format!("up to {} of reactants in balance are left", short(value)))
                .expected(format!("at most {VISIBLE_NOISE}"))
                .help(format!("use at least {more} particles, or a larger bandwidth")),
        );
        return;
    }
    let span = scenario.bins.as_ref().map_or(scenario.domain.span, |bins| bins.span);
    let affordable = (plan.particles.count as f64 / per_bin).floor();
    let fewer_bins =
        if affordable >= 1.0 { format!(", or at most {affordable} bins in all") } else { String::new() };
    diagnostics.push(
        Diagnostic::warning(N107, "the noise of bin means keeps reactants apart")
            .at(scenario.particles.count_span, format!("{} particles", plan.particles.count))
            .also(span, format!("{n_bins} bins"))
            .found(format!("up to {} of reactants in balance are left", short(value)))
            .expected(format!("at most {VISIBLE_NOISE}"))
            .help(format!("use at least {} particles{fewer_bins}", (n_bins * per_bin).ceil())),
    );
}

fn particles_per_bin(scenario: &Scenario, plan: &Plan, diagnostics: &mut Vec<Diagnostic>) {
    let n_bins: f64 = plan.axes.iter().map(|axis| axis.bins as f64).product();
    let per_bin = plan.particles.count as f64 / n_bins;
    if per_bin >= FEW_PER_BIN || !plan.moves() && per_bin >= 1.0 {
        return;
    }
    let span = scenario.bins.as_ref().map_or(scenario.domain.span, |bins| bins.span);
    diagnostics.push(
        Diagnostic::refused(N201, "what is immobile meets too few particles")
            .at(span, format!("{n_bins} bins"))
            .also(scenario.particles.count_span, format!("{} particles", plan.particles.count))
            .found(format!("{} particles per bin", short(per_bin)))
            .expected(format!("at least {FEW_PER_BIN}"))
            .help(format!("use at least {} particles, or fewer bins", (n_bins * FEW_PER_BIN).ceil())),
    );
}
