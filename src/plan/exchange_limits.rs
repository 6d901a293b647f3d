//! Limits of an exchange between parcels: how much a step may exchange, and whom a kernel must reach.
//!
//! Owns these numbers and messages (N109, N110, N206, N207). May use the sizes of the exchange, and `scenario` for
//! the places. It deliberately asks nothing about single parcels: where they lie is known when they move.

use super::cost::first_exchange;
use super::exchange::{Exchange, Integration, Sizes};
use super::explain_exchange::walks;
use super::limits::{Limit, axis_name, round_down, short, short_up};
use super::tape::Operation;
use super::transport::{Dispersion, Flow};
use super::{Placement, Plan, shares};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{N109, N110, N206, N207};
use crate::maths::scalar::pow;
use crate::scenario::Scenario;
use crate::source::Span;

/// Rules of so many mean distances are rules of thumb: what a cut-off takes from a kernel is no reason to warn.
const SLACK: f64 = 0.05;
/// What rounding may add to a share of one.
const ROUNDING: f64 = 1e-9;
/// Neighbours of a parcel, and seconds of one core for one step, beyond which nobody waits.
pub(super) const MOST_NEIGHBOURS: f64 = 1e5;
const LONGEST_STEP: f64 = 1e6;

/// An exchange with what follows from its plan.
struct Sized<'a> {
    scenario: &'a Scenario,
    plan: &'a Plan,
    exchange: &'a Exchange,
    sizes: Sizes,
    /// Where the bandwidth is written, or the statement without one.
    place: Span,
}

/// Works them out; diagnostics tell of those that are passed.
pub(super) fn check(
    scenario: &Scenario,
    plan: &Plan,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let (Some(exchange), Some(written)) = (&plan.exchange, &scenario.exchange) else { return };
    let sizes = exchange.sizes(plan, step(plan));
    let sized = Sized { scenario, plan, exchange, sizes, place: written.bandwidth.span };
    let numbers = [sizes.bandwidth, sizes.spacing, sizes.share, sizes.neighbours, sizes.collocation];
    if !numbers.into_iter().all(|number| number > 0.0 && number.is_finite()) {
        diagnostics.push(sized.no_length());
        return;
    }
    limits.extend(sized.limits());
    let refused = [sized.too_large_share(), sized.nobody(), sized.too_many(), sized.too_slow()];
    let n_before = diagnostics.len();
    diagnostics.extend(refused.into_iter().flatten());
    if diagnostics.len() == n_before {
        diagnostics.extend(sized.sparse());
        diagnostics.extend(sized.wide());
    }
}

/// The longest step that is taken, s.
fn step(plan: &Plan) -> f64 {
    plan.time.step.min(plan.time.duration)
}

/// The least bandwidth in mean distances that sums over parcels are right at.
///
/// - Equation: 1 for ordered parcels that rest, 1.5 for those that walk, 3 for random ones that rest in one dimension.
/// - Symbols: of `κh/s`, `κh` the bandwidth of a Gaussian with the same leading error, `s` the mean distance.
/// - Range: rules from trials of a plume; where others lie between these the one for walking parcels is taken.
/// - Source: methods, sections 6.7 and 6.9.
/// - Shape: one number.
pub(super) fn least_bandwidths(plan: &Plan) -> f64 {
    let is_sheared =
        plan.transport.as_ref().is_some_and(|transport| !matches!(transport.flow, Flow::Uniform(_)));
    let rests = !walks(plan) && !is_sheared;
    match plan.particles.placement {
        Placement::Ordered if rests && plan.particles.disorder == 0.0 => 1.0,
        Placement::Random if rests && plan.axes.len() == 1 => 3.0,
        Placement::Ordered if rests && plan.axes.len() == 1 && plan.particles.disorder > 2.0 => 3.0,
        _ => 1.5,
    }
}

impl Sized<'_> {
    fn limits(&self) -> [Limit; 4] {
        let sizes = &self.sizes;
        let limit = |name: &str, formula, value, advice| Limit { name: name.into(), formula, value, advice };
        [
            limit(
                "bandwidth against the collocation length",
                "h / l, l = sqrt(2 D dt) / kappa",
                sizes.bandwidth / sizes.collocation,
                "1 leaves no leading error of an explicit step; above it the error grows with the square",
            ),
            limit(
                "bandwidth against the distance of parcels",
                "kappa h / (V / N)^(1/d), kappa = 1 for a Gaussian",
                sizes.effective / sizes.spacing,
                "at least 1 for ordered parcels, 1.5 for those that walk, 3 for random ones that rest in one dimension",
            ),
            limit(
                "share exchanged in a step",
                "2 D dt / h^2 for a Gaussian",
                sizes.share,
                "explicit: at most 1, then nothing overshoots; others: any, with more sums",
            ),
            limit(
                "neighbours of a parcel",
                "ball of the radius / volume of a parcel",
                sizes.neighbours,
                "what a step costs",
            ),
        ]
    }

    fn no_length(&self) -> Diagnostic {
        let found = format!("a bandwidth of {} m", short(self.sizes.bandwidth));
        Diagnostic::refused(N207, "the bandwidth of the exchange is no length to exchange over")
            .at(self.place, found.clone())
            .found(format!("{found} for parcels {} m apart", short(self.sizes.spacing)))
            .expected("a length above zero, of a size that numbers can hold")
            .help("write a length that fits the parcels, such as `bandwidth 1.5 * spacing`")
    }

    fn too_large_share(&self) -> Option<Diagnostic> {
        let (sizes, most, step) = (&self.sizes, self.exchange.integration.most(), step(self.plan));
        if sizes.share <= most * (1.0 + ROUNDING) {
            return None;
        }
        let title = match self.exchange.integration {
            Integration::Explicit => "an explicit step exchanges more than a parcel has",
            _ => "a step exchanges more than sums can follow",
        };
        let wider = short_up(sizes.bandwidth * (sizes.share / most).sqrt());
        let shorter = step * most / sizes.share;
        // Where the bandwidth follows the step, so does the share.
        let is_enough = self.exchange.sizes(self.plan, shorter).share <= most * (1.0 + 1e-6);
        let mut ways = vec![format!("use a bandwidth of `{wider} m` or more")];
        if is_enough {
            ways.insert(0, format!("use `step {}` or less", round_down(shorter)));
        } else {
            let times = short_up(sizes.bandwidth * (sizes.share / most).sqrt() / sizes.collocation);
            ways.push(match times.as_str() {
                "1" => "of `collocation`".to_owned(),
                times => format!("of `{times} * collocation`"),
            });
        }
        if self.exchange.integration == Integration::Explicit {
            ways.push("integrate it as `implicit`".to_owned());
        }
        Some(
            Diagnostic::refused(N206, title)
                .at(self.scenario.run.step_span, format!("steps of {} s", short(step)))
                .also(self.place, format!("a bandwidth of {} m", short(sizes.bandwidth)))
                .found(format!("a share of {} in a step", short(sizes.share)))
                .expected(format!("at most {}", short(most)))
                .help(ways.join(", or ")),
        )
    }

    fn reads_spacing(&self) -> bool {
        self.exchange.bandwidth.operations.iter().any(|operation| matches!(operation, Operation::Input(1)))
    }

    /// What brings the bandwidth up to what the parcels need.
    fn enough(&self) -> String {
        let (sizes, d) = (&self.sizes, self.plan.axes.len());
        let kappa = sizes.effective / sizes.bandwidth;
        // A kernel that is all but a Gaussian counts as one.
        let kappa = if (kappa - 1.0).abs() < SLACK { 1.0 } else { kappa };
        let least = least_bandwidths(self.plan) / kappa;
        let wider = short_up(least * sizes.spacing);
        let more = self.plan.particles.count as f64 * pow(least * sizes.spacing / sizes.bandwidth, d as f64);
        let length =
            format!("use a bandwidth of `{wider} m` or more, such as `{} * spacing`", short_up(least));
        if self.reads_spacing() || more > 1e15 {
            return length;
        }
        format!("{length}, or at least {} particles", more.ceil())
    }

    fn nobody(&self) -> Option<Diagnostic> {
        let reach = self.sizes.radius * self.sizes.bandwidth;
        (reach < self.sizes.spacing * (1.0 - ROUNDING)).then(|| {
            Diagnostic::refused(N207, "the kernel reaches no neighbour")
                .at(self.place, format!("it ends {} m away", short(reach)))
                .also(
                    self.scenario.particles.count_span,
                    format!("parcels {} m apart", short(self.sizes.spacing)),
                )
                .found(format!("a reach of {} of the distance of parcels", short(reach / self.sizes.spacing)))
                .expected("at least 1")
                .help(self.enough())
        })
    }

    fn too_many(&self) -> Option<Diagnostic> {
        // Those in images behind the sides are summed as well.
        let sizes = &self.sizes;
        (sizes.neighbours > MOST_NEIGHBOURS).then(|| {
            let share = pow(MOST_NEIGHBOURS / sizes.neighbours, 1.0 / self.plan.axes.len() as f64);
            Diagnostic::refused(N207, "each parcel would exchange with too many others")
                .at(self.place, format!("it reaches {} m", short(sizes.radius * sizes.bandwidth)))
                .also(self.scenario.particles.count_span, format!("parcels {} m apart", short(sizes.spacing)))
                .found(format!("{} neighbours of each", short(sizes.neighbours)))
                .expected(format!("at most {}", short(MOST_NEIGHBOURS)))
                .help(format!(
                    "use a bandwidth of {} m or less, an earlier `cutoff`, a shorter step if it follows that, or fewer \
                     particles",
                    short(share * sizes.bandwidth)
                ))
        })
    }

    fn too_slow(&self) -> Option<Diagnostic> {
        let per_parcel = first_exchange(self.plan, self.exchange);
        let seconds = 1e-9 * per_parcel * self.plan.particles.count as f64;
        (seconds > LONGEST_STEP).then(|| {
            Diagnostic::refused(N207, "one step of the exchange would not end")
                .at(self.place, format!("{} neighbours of each parcel", short(self.sizes.neighbours)))
                .also(self.scenario.particles.count_span, format!("{} parcels", self.plan.particles.count))
                .found(format!("about {} s of one core for a step", short(seconds)))
                .expected(format!("at most {} s", short(LONGEST_STEP)))
                .help("use a smaller bandwidth, an explicit step, or fewer particles")
        })
    }

    fn somewhere(&self) -> &'static str {
        if self.exchange.spreading.is_some() { ", where dispersion is least" } else { "" }
    }

    /// The bandwidth, m, where dispersion by an expression is least.
    fn least_bandwidth(&self) -> f64 {
        let sizes = &self.sizes;
        let Some(Dispersion::Isotropic(tape)) = &self.exchange.spreading else { return sizes.bandwidth };
        let all = shares::places(&self.plan.axes, tape.operations.len());
        let values = all.iter().map(|place| tape.evaluate(place)).filter(|value| *value > 0.0);
        let ratio = (values.fold(sizes.diffusion, f64::min) / sizes.diffusion).sqrt();
        self.exchange.bandwidth.evaluate(&[sizes.collocation * ratio, sizes.spacing])
    }

    fn sparse(&self) -> Option<Diagnostic> {
        let kappa = self.sizes.effective / self.sizes.bandwidth;
        let bandwidth = self.least_bandwidth();
        let (found, least) = (kappa * bandwidth / self.sizes.spacing, least_bandwidths(self.plan));
        (found < least * (1.0 - SLACK)).then(|| {
            Diagnostic::warning(N109, "the bandwidth is small for the distance of the parcels")
                .at(self.place, format!("{} m", short(bandwidth)))
                .also(self.scenario.particles.count_span, format!("parcels {} m apart", short(self.sizes.spacing)))
                .found(format!("{} of the distance, as a Gaussian{}", short(found), self.somewhere()))
                .expected(format!("at least {} for parcels that lie and move like these", short(least)))
                .note("where parcels have few neighbours sums over them are no integrals: too little is exchanged")
                .help(self.enough())
        })
    }

    /// The first axis that the kernel reaches across.
    fn wide(&self) -> Option<Diagnostic> {
        let sizes = &self.sizes;
        let (idx, reach) = (0..self.plan.axes.len()).find_map(|idx| {
            let axis = &self.plan.axes[idx];
            let along = self.exchange.largest_along(self.plan, idx);
            let reach = sizes.radius * sizes.bandwidth * (along / sizes.diffusion).sqrt();
            (reach > axis.high - axis.low).then_some((idx, reach))
        })?;
        let axis = &self.plan.axes[idx];
        let name = axis_name(axis.index);
        Some(
            Diagnostic::warning(N110, format!("the kernel reaches across the whole domain along {name}"))
                .at(self.place, format!("it reaches {} m", short(reach)))
                .also(self.scenario.domain.span, format!("{} m long", short(axis.high - axis.low)))
                .found(format!("a reach of {} m", short(reach)))
                .expected("less than the domain")
                .note("parcels exchange with all others and their mirror images: sides decide what becomes of a plume")
                .help("use a smaller bandwidth, a shorter step if it follows that, or a longer domain"),
        )
    }
}
