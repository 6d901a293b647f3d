//! Flows that change, as steady flows one after another.
//!
//! Owns the choice of the periods and the values in them. May use tapes, and `scenario` for places. It deliberately
//! cuts no steps: the engine ends them where flows change.

use super::Axis;
use super::in_time::{at_time, is_timed, switches};
use super::limits::short;
use super::shares::places;
use super::tape::Tape;
use super::transport::{Change, Changed, Darcy, DarcySide, Flow};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M005, M035, N108};
use crate::scenario::transport::Changes;
use crate::source::Span;

/// Flows at most, and cells of all of them that are solved for.
const MOST_PERIODS: usize = 10_000;
const MOST_CELLS: f64 = 1e8;
/// Points in a period at which values are held against that in its middle.
const TIMES: usize = 9;
/// Places at most at which a velocity is looked at.
const PLACES: usize = 8;
/// Changes within a period that are none, and those that are told, of the largest value.
const STEADY: f64 = 1e-9;
const TOLD: f64 = 0.05;

/// What is lowered over time, with what is wrong with it.
pub(super) struct Periods<'a> {
    pub axes: &'a [Axis],
    /// s
    pub duration: f64,
    pub problems: &'a mut Vec<Diagnostic>,
}

/// What the water does at a side, over time.
pub(super) enum TimedSide {
    Head(Tape),
    Flux(Tape),
    NoFlow,
    Periodic,
}

impl TimedSide {
    fn tape(&self) -> Option<&Tape> {
        match self {
            Self::Head(tape) | Self::Flux(tape) => Some(tape),
            Self::NoFlow | Self::Periodic => None,
        }
    }

    fn at(&self, t: f64) -> DarcySide {
        match self {
            Self::Head(head) => DarcySide::Head(number(head, t)),
            Self::Flux(flux) => DarcySide::Flux(number(flux, t)),
            Self::NoFlow => DarcySide::NoFlow,
            Self::Periodic => DarcySide::Periodic,
        }
    }
}

/// A tape of the time alone.
fn number(tape: &Tape, t: f64) -> f64 {
    tape.evaluate(&[0.0, 0.0, 0.0, t])
}

impl Periods<'_> {
    /// A flow by expressions.
    pub fn velocity(&mut self, tapes: &[Tape], changes: &Changes, span: Span) -> Option<(Flow, Vec<Change>)> {
        let all: Vec<&Tape> = tapes.iter().collect();
        let starts = self.starts(&all, changes, span, 1)?;
        let flows: Vec<Vec<Tape>> = self
            .middles(&starts)
            .into_iter()
            .map(|t| tapes.iter().map(|tape| at_time(tape, t)).collect())
            .collect();
        let uniform = |tapes: &Vec<Tape>| -> Option<Vec<f64>> { tapes.iter().map(constant).collect() };
        let are_uniform = flows.iter().all(|tapes| uniform(tapes).is_some());
        let mut list = flows.into_iter().zip(starts);
        let of = |tapes: Vec<Tape>| match uniform(&tapes).filter(|_| are_uniform) {
            Some(velocity) => Changed::Uniform(velocity),
            None => Changed::Expression(tapes),
        };
        let first = match of(list.next()?.0) {
            Changed::Uniform(velocity) => Flow::Uniform(velocity),
            Changed::Expression(tapes) => Flow::Expression(tapes),
            Changed::Darcy { .. } => return None,
        };
        Some((first, list.map(|(tapes, from)| Change { from, flow: of(tapes) }).collect()))
    }

    /// A flow that is solved for; sides and rates are those of the wells and sides of `darcy`.
    pub fn darcy(
        &mut self,
        mut darcy: Darcy,
        sides: &[[TimedSide; 2]],
        rates: &[Tape],
        changes: &Changes,
        span: Span,
    ) -> Option<(Flow, Vec<Change>)> {
        let all: Vec<&Tape> = sides.iter().flatten().filter_map(TimedSide::tape).chain(rates).collect();
        let n_cells = darcy.cells.iter().product();
        let starts = self.starts(&all, changes, span, n_cells)?;
        let sides_at = |t: f64| sides.iter().map(|[low, high]| [low.at(t), high.at(t)]).collect();
        let rates_at = |t: f64| rates.iter().map(|rate| number(rate, t)).collect::<Vec<_>>();
        let mut list = self.middles(&starts).into_iter().zip(starts);
        let first = list.next()?.0;
        darcy.sides = sides_at(first);
        darcy.wells.iter_mut().zip(rates_at(first)).for_each(|(well, rate)| well.rate = rate);
        let change =
            |(t, from)| Change { from, flow: Changed::Darcy { sides: sides_at(t), rates: rates_at(t) } };
        Some((Flow::Darcy(Box::new(darcy)), list.map(change).collect()))
    }

    /// When periods begin: where an expression switches, and when the scene says. The first begins at 0.
    fn starts(&mut self, tapes: &[&Tape], changes: &Changes, span: Span, n_cells: usize) -> Option<Vec<f64>> {
        let place = changes.span.unwrap_or(span);
        let mut starts = vec![0.0];
        for (tape, place) in tapes.iter().flat_map(|tape| self.places().into_iter().map(move |at| (tape, at)))
        {
            starts.extend(switches(tape, place, 0.0, self.duration));
        }
        starts.extend(changes.at.iter().copied());
        if let Some(every) = changes.every {
            let n = (self.duration / every).min(2.0 * MOST_PERIODS as f64) as usize;
            starts.extend((1..=n).map(|k| k as f64 * every));
        }
        starts.retain(|&t| t == 0.0 || t < self.duration * (1.0 - 1e-12));
        starts.sort_by(f64::total_cmp);
        let near = 1e-12 * self.duration;
        starts.dedup_by(|next, last| *next - *last <= near);
        let most = MOST_PERIODS.min((MOST_CELLS / n_cells.max(1) as f64) as usize).max(1);
        if starts.len() > most {
            let message = Diagnostic::error(M005, "the flow has too many periods")
                .at(place, format!("{} of them", starts.len()))
                .found(format!("{} periods", starts.len()))
                .expected(format!("at most {most} for a flow of {n_cells} cells"));
            self.problems.push(message);
            return None;
        }
        self.check_steady(tapes, &starts, changes, place)?;
        Some(starts)
    }

    /// The middle of each period.
    fn middles(&self, starts: &[f64]) -> Vec<f64> {
        let ends = starts.iter().skip(1).copied().chain([self.duration]);
        starts.iter().zip(ends).map(|(from, to)| 0.5 * (from + to)).collect()
    }

    /// Some places of the domain.
    fn places(&self) -> Vec<[f64; 3]> {
        let all = places(self.axes, 0);
        let stride = all.len().div_ceil(PLACES).max(1);
        all.iter().skip(stride / 2).step_by(stride).map(|place| [place[0], place[1], place[2]]).collect()
    }

    /// Reports what changes within a period: the value in the middle stands for all of it.
    fn check_steady(&mut self, tapes: &[&Tape], starts: &[f64], changes: &Changes, span: Span) -> Option<()> {
        let ends: Vec<f64> = starts.iter().skip(1).copied().chain([self.duration]).collect();
        let mut worst = (0.0, 0.0);
        for tape in tapes.iter().filter(|tape| is_timed(tape)) {
            for place in self.places() {
                let at = |t: f64| tape.evaluate(&[place[0], place[1], place[2], t]);
                let (mut most, mut largest) = ((0.0, 0.0), 0.0_f64);
                for (&from, &to) in starts.iter().zip(&ends) {
                    let middle = at(0.5 * (from + to));
                    for k in 0..TIMES {
                        let t = from + (to - from) * (k as f64 + 0.5) / TIMES as f64;
                        let value = at(t);
                        if !value.is_finite() {
                            self.problems.push(not_finite(span, t));
                            return None;
                        }
                        largest = largest.max(value.abs());
                        if (value - middle).abs() > most.0 {
                            most = ((value - middle).abs(), t);
                        }
                    }
                }
                if most.0 > worst.0 * largest {
                    worst = (most.0 / largest, most.1);
                }
            }
        }
        let is_said = changes.span.is_some();
        let of = format!("{} % at {} s", short(100.0 * worst.0), short(worst.1));
        if worst.0 > STEADY && !is_said {
            let message = Diagnostic::error(M035, "the flow changes all the time")
                .at(span, "nothing says how often it is taken anew")
                .found(format!("a change between two switches of its expressions, by {of}"))
                .expected(
                    "expressions that switch, as `if t < 30 d then … else …` does, or a clause `change`",
                )
                .help("add for example `change every 1 d`: the flow of each period is that of its middle");
            self.problems.push(message);
            return None;
        }
        if worst.0 > TOLD {
            let message = Diagnostic::warning(N108, "the flow changes much within a period")
                .at(span, format!("by {of}, of the largest value"))
                .found(format!("{of} away from the value in the middle of the period"))
                .expected(format!("at most {} %", short(100.0 * TOLD)))
                .help("let it change more often");
            self.problems.push(message);
        }
        Some(())
    }
}

fn constant(tape: &Tape) -> Option<f64> {
    match tape.operations[..] {
        [super::tape::Operation::Constant(value)] => Some(value),
        _ => None,
    }
}

fn not_finite(span: Span, t: f64) -> Diagnostic {
    Diagnostic::error(M005, "the flow is out of range")
        .at(span, format!("no finite number at {} s", short(t)))
        .found(format!("no finite number at {} s", short(t)))
        .expected("a finite value at all times of the run")
}
