//! What the sides of the domain do to the fluid in it, before anything runs.
//!
//! Owns the message about fluid that leaves or is held back (N105). May use `scenario` for the places.
//! It deliberately looks at the initial concentrations along the axis of a side only.

use super::limits::{axis_name, short, walking_dispersion};
use super::{Axis, Plan, Side};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::N105;
use crate::scenario::{self, Scenario};

/// Share of the domain that may run empty, and share of the largest concentration by which a
/// concentration may vary near an open side, before it is said.
const SMALL_SHARE: f64 = 0.01;
/// Standard deviations of the dispersion that a side is felt from: beyond them 0.1 % of the fluid is lost.
const REACH: f64 = 3.0;
/// Points at which initial concentrations are looked at: along the axis, and across it.
const N_ALONG: usize = 129;
const N_ACROSS: usize = 7;
const LARGE_TAPE: usize = 500;

/// One axis with what moves along it.
struct Edges<'a> {
    plan: &'a Plan,
    axis: &'a Axis,
    written: &'a scenario::Axis,
    drift: f64,
    dispersion: f64,
}

/// Warns of sides behind which the domain runs empty.
pub(super) fn check(scenario: &Scenario, plan: &Plan, diagnostics: &mut Vec<Diagnostic>) {
    for (idx, axis) in plan.axes.iter().enumerate() {
        let Some(written) = scenario.domain.axes.iter().find(|written| written.index == axis.index) else {
            continue;
        };
        let (drift, dispersion) = (plan.walk.drift[idx], walking_dispersion(plan, idx));
        let edges = Edges { plan, axis, written, drift, dispersion };
        diagnostics.extend(edges.emptied().or_else(|| edges.open()));
    }
}

impl Edges<'_> {
    fn extent(&self) -> f64 {
        self.axis.high - self.axis.low
    }

    /// √(2DT), m.
    fn spread(&self) -> f64 {
        (2.0 * self.dispersion * self.plan.time.duration).sqrt()
    }

    /// Nothing comes in through an open side or out of a wall: the flow carries the edge of the fluid
    /// into the domain.
    fn emptied(&self) -> Option<Diagnostic> {
        let is_forward = self.drift > 0.0;
        let (low, high) = (
            (self.axis.low_side, self.written.low_side_span),
            (self.axis.high_side, self.written.high_side_span),
        );
        let (upstream, downstream) = if is_forward { (low, high) } else { (high, low) };
        let travelled = self.drift.abs() * self.plan.time.duration;
        let share = travelled / self.extent();
        // Between walls dispersion spreads the fluid again: to all but the share |v|L/D of it.
        let is_spread_again = upstream.0 == Side::Reflect
            && downstream.0 == Side::Reflect
            && self.drift.abs() * self.extent() <= SMALL_SHARE * self.dispersion;
        if upstream.0 == Side::Periodic || share <= SMALL_SHARE || is_spread_again {
            return None;
        }
        let duration = self.plan.time.duration;
        let end = if share < 1.0 { duration } else { duration / share };
        let name = axis_name(self.axis.index);
        let (speed, percent) = (short(self.drift.abs()), short(100.0 * share.min(1.0)));
        let is_wall = upstream.0 == Side::Reflect;
        let mut message =
            Diagnostic::warning(N105, format!("the flow along {name} empties the domain: nothing comes in"))
                .at(upstream.1, format!("{percent} % of the domain is empty after {} s", short(end)));
        if downstream.0 == Side::Reflect {
            message = message.also(downstream.1, "the fluid piles up at this wall");
        }
        let found = if is_wall { "a wall upstream, the flow leaves it at" } else { "an open side upstream," };
        let across = if is_wall { "" } else { " across it" };
        message = message
            .found(format!("{found} {speed} m/s{across}"))
            .expected(format!("at most {} % empty at the end", short(100.0 * SMALL_SHARE)))
            .note(if is_wall {
                "a side that reflects turns particles back and lets no fluid in"
            } else {
                "an open side lets particles out; inflow is not in this version"
            });
        if self.dispersion > 0.0 {
            message = message.note(format!(
                "dispersion thins the fluid out up to {} m from this side",
                short((travelled + REACH * self.spread()).min(self.extent()))
            ));
        }
        let other = if is_wall {
            "make both sides periodic".to_owned()
        } else {
            format!("begin the domain {} m further upstream", short(travelled))
        };
        Some(message.help(format!(
            "let the frame move with the flow (`frame moving v`), {other}, or end the run earlier"
        )))
    }

    /// What disperses out of an open side does not come back: near it means are those of the fluid from
    /// inside. Where the concentration is uniform that fluid has the right concentration all the same.
    fn open(&self) -> Option<Diagnostic> {
        let low = self.axis.low_side == Side::Open;
        let high = self.axis.high_side == Side::Open;
        let reach_low = if low { self.reach(self.drift) } else { 0.0 };
        let reach_high = if high { self.reach(-self.drift) } else { 0.0 };
        if reach_low == 0.0 && reach_high == 0.0 {
            return None;
        }
        let variation = self.variation(reach_low, reach_high);
        if variation <= SMALL_SHARE {
            return None;
        }
        let reach = reach_low.max(reach_high);
        let (place, other) = match (low, high) {
            (true, true) => (self.written.low_side_span, Some(self.written.high_side_span)),
            (true, false) => (self.written.low_side_span, None),
            _ => (self.written.high_side_span, None),
        };
        let name = axis_name(self.axis.index);
        let mut message =
            Diagnostic::warning(N105, format!("fluid disperses out along {name}: nothing comes in"))
                .at(place, format!("means are wrong up to {} m from here", short(reach)));
        if let Some(other) = other {
            message = message.also(other, "and from here");
        }
        let percent = short(100.0 * variation.min(1.0));
        Some(
            message
                .found(format!("a concentration that varies by {percent} % of its largest value so near"))
                .expected(format!("at most {} %", short(100.0 * SMALL_SHARE)))
                .note("an open side lets particles out; inflow is not in this version")
                .note(format!("sqrt(2 D T) is {} m in this run", short(self.spread())))
                .help("let the domain end further outside, where the concentration is uniform, use sides that reflect, or end the run earlier"),
        )
    }

    /// How far from a side its loss is felt when the flow carries it inwards (positive) or holds it back:
    /// the largest value of `REACH √(2Dt) + inwards t` in the run.
    fn reach(&self, inwards: f64) -> f64 {
        let duration = self.plan.time.duration;
        let at = |t: f64| REACH * (2.0 * self.dispersion * t).sqrt() + inwards * t;
        let turning = if inwards < 0.0 {
            REACH * REACH * self.dispersion / (2.0 * inwards * inwards)
        } else {
            f64::INFINITY
        };
        at(turning.min(duration)).min(self.extent())
    }

    /// Largest change of an initial concentration within the reach of the sides, relative to the largest
    /// concentration.
    fn variation(&self, reach_low: f64, reach_high: f64) -> f64 {
        let (low, high) = (self.axis.low, self.axis.high);
        let strips = [(low, low + reach_low), (high - reach_high, high)];
        let mut largest: f64 = 0.0;
        for component in &self.plan.components {
            let mut size: f64 = 0.0;
            let mut change: f64 = 0.0;
            // An expression this large is looked at along one line, or a check would take seconds.
            let n_across = if component.initial.operations.len() > LARGE_TAPE { 1 } else { N_ACROSS };
            for across in self.across(n_across) {
                let at = |from: f64, to: f64| {
                    let mut range = (f64::INFINITY, f64::NEG_INFINITY);
                    for idx in 0..N_ALONG {
                        let mut inputs = across;
                        inputs[self.axis.index] = from + (to - from) * idx as f64 / (N_ALONG - 1) as f64;
                        let value = component.initial.evaluate(&inputs);
                        range = (range.0.min(value), range.1.max(value));
                    }
                    range
                };
                let whole = at(low, high);
                size = size.max(whole.0.abs()).max(whole.1.abs());
                for (from, to) in strips.into_iter().filter(|(from, to)| from < to) {
                    let range = at(from, to);
                    change = change.max(range.1 - range.0);
                }
            }
            if size > 0.0 && size.is_finite() && change.is_finite() {
                largest = largest.max(change / size);
            }
        }
        largest
    }

    /// Places on the other axes: x, y, z and the time 0.
    fn across(&self, n_across: usize) -> Vec<[f64; 4]> {
        let mut list = vec![[0.0; 4]];
        for axis in self.plan.axes.iter().filter(|axis| axis.index != self.axis.index) {
            let at = |idx: usize| axis.low + (axis.high - axis.low) * (idx as f64 + 0.5) / n_across as f64;
            list = list
                .iter()
                .flat_map(|place| {
                    (0..n_across).map(move |idx| {
                        let mut place = *place;
                        place[axis.index] = at(idx);
                        place
                    })
                })
                .collect();
        }
        list
    }
}
