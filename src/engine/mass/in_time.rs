//! What enters where its concentration or the flow changes.
//!
//! Owns the masses of places over time. May use the plan and paces. It deliberately draws nothing.

use super::pace::Pace;
use super::place::Faces;
use super::world::Site;
use crate::plan::in_time::{bounds, is_timed, kinks, switches};
use crate::plan::tape::Tape;
use crate::plan::transport::{SideRule, Strength};

/// Faces at most whose switches and bounds are looked at; between them fronts move on.
const MOST_FACES: usize = 64;
/// Cuts of steps at most by one expression.
const MOST_CUTS: usize = 10_000;

/// A concentration over places and a window of time.
pub struct Course<'a, const D: usize> {
    pub tape: &'a Tape,
    pub faces: Vec<([f64; D], [f64; D])>,
    pub window: (f64, f64),
}

impl<const D: usize> Course<'_, D> {
    pub fn centres(&self) -> Vec<[f64; D]> {
        let centre =
            |(low, high): &([f64; D], [f64; D])| std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
        self.faces.iter().map(centre).collect()
    }
}

impl<const D: usize> Site<'_, D> {
    /// Mass over time: concentrations times what `water` says of a period and a face, per time. Faces come with
    /// each piece if there are several.
    pub fn pace(&self, course: &Course<D>, water: impl Fn(usize, usize) -> f64) -> (Pace, Vec<Faces<D>>) {
        let (from, to) = course.window;
        let centres = course.centres();
        let mut edges = self.switches(course.tape, &centres, course.window);
        edges.extend(kinks(course.tape, from, to));
        edges.extend(self.starts.iter().filter(|&&t| from < t && t < to));
        edges.extend([from, to.max(from)]);
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let mut rates = |t: f64, values: &mut [f64]| {
            let period = self.period_at(t);
            let found = self.evaluate(course.tape, &centres, t);
            for (idx, (value, c)) in values.iter_mut().zip(found).enumerate() {
                *value = c * water(period, idx);
            }
        };
        let width = |from: f64, to: f64| {
            if !is_timed(course.tape) {
                return 0.0;
            }
            let period = self.period_at(0.5 * (from + to));
            let chosen = some(centres.len());
            let sum: f64 = chosen
                .iter()
                .map(|&idx| {
                    let bounds = bounds(course.tape, self.in_space(&centres[idx]), from, to);
                    (bounds.high - bounds.low) * water(period, idx)
                })
                .filter(|width| width.is_finite())
                .sum();
            sum * centres.len() as f64 / chosen.len().max(1) as f64
        };
        let (pace, masses) = Pace::new(&edges, centres.len(), &mut rates, &width);
        let faces = match centres.len() {
            0 | 1 => Vec::new(),
            _ => Faces::in_time(&course.faces, &masses),
        };
        (pace, faces)
    }

    /// When a tape switches at some of these places, rising.
    pub fn switches(&self, tape: &Tape, places: &[[f64; D]], (from, to): (f64, f64)) -> Vec<f64> {
        if !is_timed(tape) {
            return Vec::new();
        }
        let mut list: Vec<f64> = some(places.len())
            .into_iter()
            .flat_map(|idx| switches(tape, self.in_space(&places[idx]), from, to))
            .collect();
        list.sort_by(f64::total_cmp);
        list.dedup();
        list.truncate(MOST_CUTS);
        list
    }

    /// When the concentrations switch that sides and boxes are held at: steps end there.
    pub fn switches_of_held(&self) -> Vec<f64> {
        let duration = self.plan.time.duration;
        let mut list = Vec::new();
        for side in 0..2 * D {
            let side = [side / 2, side % 2];
            for (idx, patch) in self.transport.sides[side[0]][side[1]].iter().enumerate() {
                let SideRule::Held(tapes) = &patch.rule else { continue };
                for tape in tapes.iter().filter(|tape| is_timed(tape)) {
                    let faces = self.held_faces(side, idx, tape);
                    let course = Course { tape, faces, window: (0.0, duration) };
                    list.extend(self.switches(tape, &course.centres(), course.window));
                }
            }
        }
        for source in &self.transport.sources {
            if let Strength::HeldInTime(tape) = &source.strength {
                let (from, to) = source.during;
                list.extend([from, to]);
                list.extend(switches(tape, [0.0; 3], from, to.min(duration)));
            }
        }
        list
    }
}

/// Numbers of some of so many, evenly.
fn some(n: usize) -> Vec<usize> {
    if n <= MOST_FACES {
        return (0..n).collect();
    }
    (0..MOST_FACES).map(|k| k * (n - 1) / (MOST_FACES - 1)).collect()
}
