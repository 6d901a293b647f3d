//! How fast a scene reacts, from its laws and its values alone.
//!
//! Owns the states that are looked at and the numbers found there. May use the tape. It deliberately runs
//! no particle: a few states, and a coarse implicit course from each to the end of the run.

use super::chemistry::{Kinetic, Kinetics};
use super::tape::dual::{Slopes, differentiate};
use super::{Axis, Plan};
use crate::maths::scalar::ln;
use std::collections::BTreeMap;

/// Points along each axis at which initial values are taken.
const POINTS: usize = 17;
/// States of the beginning from which courses start.
const MAX_STARTS: usize = 6;
/// Further ones at the places where reactions are fastest.
const MAX_PLACES: usize = 4;
/// Each implicit step of a course is this much longer than the one before.
const GROWTH: f64 = 3.0;
/// The first one, against the fastest reaction.
const FIRST_STEP: f64 = 1e-3;

/// What integrators meet on the way over one step of the run: means over the states that are looked at.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Way {
    /// ∫|∇r · ν| dt of the fastest reaction: an explicit method is stable over 3.3 of it per sub-step.
    pub relaxations: f64,
    /// Times that a value changes by the factor e, of the one that changes most: any method follows these.
    pub foldings: f64,
}

/// The time scales of a plan's kinetics.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeScales {
    /// Per reaction the largest |∇r · ν| met, 1/s: how fast it would relax by itself. Below the floors nothing
    /// is looked at: how a rate without order ends there is no time of the reaction.
    pub rates: Vec<f64>,
    /// The largest of all, such ends included, 1/s: what an integrator meets.
    pub steepest: f64,
    /// The reaction with the largest.
    pub fastest: usize,
    /// The smallest above zero, 1/s.
    pub slowest_rate: f64,
    pub way: Way,
}

impl TimeScales {
    /// 1/s
    pub fn fastest_rate(&self) -> f64 {
        self.rates[self.fastest]
    }

    /// Fastest against slowest reaction.
    pub fn stiffness(&self) -> f64 {
        self.fastest_rate() / self.slowest_rate
    }

    /// `None` if nothing reacts in steps, if what reacts hangs on an equilibrium, or if a rate at the
    /// initial values is no number.
    pub fn of(plan: &Plan) -> Option<Self> {
        let chemistry = plan.chemistry.as_ref().filter(|chemistry| chemistry.equilibrium.is_none())?;
        if !plan.reacts_in_steps() {
            return None;
        }
        let kinetics = chemistry.kinetics.as_ref()?;
        let network = Network { plan, kinetics };
        let states = network.states();
        let mut rates = vec![0.0_f64; kinetics.reactions.len()];
        let mut steepest = 0.0_f64;
        // What is mixed again in each step begins again in each step; what is not comes to rest in time.
        let begins_again = plan.mixing.is_some() || plan.has_immobile();
        let span = if begins_again { plan.time.step } else { plan.time.duration };
        let span = span.min(plan.time.duration);
        let mut way = Way::default();
        for (position, state) in &states {
            network.course(*position, state.clone(), (&mut rates, &mut steepest), (span, &mut way));
        }
        let share = 1.0 / (states.len() as f64 * (span / plan.time.step).max(1.0));
        let way = Way { relaxations: way.relaxations * share, foldings: way.foldings * share };
        let fastest = (0..rates.len()).max_by(|&a, &b| rates[a].total_cmp(&rates[b]))?;
        let slowest_rate = rates.iter().copied().filter(|rate| *rate > 0.0).fold(f64::INFINITY, f64::min);
        (rates[fastest] > 0.0).then_some(Self { rates, steepest, fastest, slowest_rate, way })
    }
}

/// How fast reactions are at the start, per reaction, 1/s.
pub(super) struct AtStart {
    /// The largest |∇r · ν|.
    pub speeds: Vec<f64>,
    /// The largest part of a reactant that is taken in a time, ν r/c.
    pub losses: Vec<f64>,
}

/// At the initial states, and at the one with every component at its largest or at `brought`; nothing without rates.
pub(super) fn at_start(plan: &Plan, brought: &[f64]) -> Option<AtStart> {
    let kinetics = plan.chemistry.as_ref()?.kinetics.as_ref()?;
    let network = Network { plan, kinetics };
    let mut states = network.states();
    let largest = |k: usize| states.iter().map(|(_, values)| values[k]).fold(brought[k], f64::max);
    let most: Vec<f64> = (0..plan.components.len()).map(largest).collect();
    states.extend(states.first().map(|(place, _)| (*place, most)));
    let n = kinetics.reactions.len();
    let mut found = AtStart { speeds: vec![0.0; n], losses: vec![0.0; n] };
    for (place, state) in states {
        let raised = network.raised(&state);
        let (rates, slopes) = network.rates(place, 0.0, &raised);
        for (k, reaction) in kinetics.reactions.iter().enumerate() {
            found.speeds[k] = found.speeds[k].max(speed(reaction, &slopes[k]));
            let loss = |&(i, nu): &(usize, f64)| (-nu * rates[k] / raised[i]).max(0.0);
            let losses = reaction.changes.iter().filter(|(i, _)| raised[*i] > 0.0).map(loss);
            found.losses[k] = losses.filter(|own| own.is_finite()).fold(found.losses[k], f64::max);
        }
    }
    Some(found)
}

/// |∇r · ν| of a reaction, 1/s.
fn speed(reaction: &Kinetic, slopes: &Slopes) -> f64 {
    let slope_by =
        |i: usize| slopes.binary_search_by_key(&i, |(other, _)| *other).map_or(0.0, |at| slopes[at].1);
    let own: f64 = reaction.changes.iter().map(|&(i, nu)| nu * slope_by(i)).sum();
    if own.is_finite() { own.abs() } else { 0.0 }
}

struct Network<'p> {
    plan: &'p Plan,
    kinetics: &'p Kinetics,
}

type State = ([f64; 3], Vec<f64>);

impl Network<'_> {
    /// States that particles may have: where a component is largest at the beginning, the mean of all, and
    /// every component at its largest, as mixing might bring them together.
    fn states(&self) -> Vec<State> {
        let samples: Vec<State> = sample_points(&self.plan.axes)
            .into_iter()
            .map(|[x, y, z]| {
                let of = |c: &super::Component| c.initial.evaluate(&[x, y, z, 0.0]).max(0.0);
                ([x, y, z], self.plan.components.iter().map(of).collect())
            })
            .collect();
        let n = self.plan.components.len();
        let column = |k: usize| samples.iter().map(move |(_, values)| values[k]);
        let mean = (0..n).map(|k| column(k).sum::<f64>() / samples.len() as f64).collect();
        let largest: Vec<f64> = (0..n).map(|k| column(k).fold(0.0, f64::max)).collect();
        let middle = samples[samples.len() / 2].0;
        let mut states = vec![(middle, mean)];
        for place in self.fastest_places(middle, &samples, &largest) {
            states.push((place, largest.clone()));
        }
        for k in 0..n {
            let place = (0..samples.len()).max_by(|&a, &b| samples[a].1[k].total_cmp(&samples[b].1[k]));
            let Some(place) = place else { continue };
            if states.len() < MAX_STARTS + MAX_PLACES
                && !states.iter().any(|(_, values)| *values == samples[place].1)
            {
                states.push(samples[place].clone());
            }
        }
        states
    }

    /// The middle, and where a reaction is faster than there: laws may depend on the place.
    fn fastest_places(&self, middle: [f64; 3], samples: &[State], state: &[f64]) -> Vec<[f64; 3]> {
        let rates_at = |place: [f64; 3]| -> Vec<f64> {
            self.rates(place, 0.0, state).0.into_iter().map(f64::abs).collect()
        };
        let at: Vec<_> = samples.iter().map(|(place, _)| (*place, rates_at(*place))).collect();
        let mut places = vec![middle];
        let mut best = rates_at(middle);
        for k in 0..best.len() {
            let fastest = at.iter().max_by(|a, b| a.1[k].total_cmp(&b.1[k]));
            let Some((place, rates)) = fastest.filter(|(_, rates)| rates[k] > best[k]) else { continue };
            if places.len() > MAX_PLACES {
                break;
            }
            places.push(*place);
            best.iter_mut().zip(rates).for_each(|(best, rate)| *best = best.max(*rate));
        }
        places
    }

    /// Concentrations of all species.
    fn species(&self, components: &[f64]) -> Vec<f64> {
        let of = |species: &super::Species| {
            let terms = species.terms.iter().map(|&(k, coefficient)| coefficient * components[k]);
            (species.constant + terms.sum::<f64>()).max(0.0)
        };
        self.plan.species.iter().map(of).collect()
    }

    /// The same state with no component below its floor.
    fn raised(&self, components: &[f64]) -> Vec<f64> {
        let floors = self.plan.chemistry.as_ref().map_or(&[][..], |chemistry| &chemistry.floors);
        let floor = |k: usize| 1.001 * floors.get(k).copied().unwrap_or(0.0);
        components.iter().enumerate().map(|(k, value)| value.max(floor(k))).collect()
    }

    /// Rates, and their derivatives by components.
    fn rates(&self, position: [f64; 3], t: f64, components: &[f64]) -> (Vec<f64>, Vec<Slopes>) {
        let [x, y, z] = position;
        let mut inputs = vec![x, y, z, t];
        inputs.extend(self.species(components));
        let n_species = self.plan.species.len();
        let (values, slopes) = differentiate(&self.kinetics.laws.operations, &inputs, 4, n_species);
        let registers = self.kinetics.laws.rates.iter().map(|&register| usize::from(register));
        let by_component = |register: usize| {
            let mut slope: BTreeMap<usize, f64> = BTreeMap::new();
            for &(s, own) in slopes[register].iter().filter(|(_, own)| *own != 0.0) {
                for &(k, coefficient) in &self.plan.species[s].terms {
                    *slope.entry(k).or_default() += own * coefficient;
                }
            }
            slope.into_iter().collect()
        };
        (registers.clone().map(|register| values[register]).collect(), registers.map(by_component).collect())
    }

    /// Follows a state to the end of the run with linearly implicit Euler steps of growing length, and
    /// keeps the largest |∇r · ν| of each reaction. What is met over `span` is added to the way.
    fn course(
        &self,
        position: [f64; 3],
        mut y: Vec<f64>,
        (largest, steepest): (&mut [f64], &mut f64),
        (span, way): (f64, &mut Way),
    ) {
        let duration = self.plan.time.duration;
        let (mut t, mut step) = (0.0, None);
        let n = y.len();
        while t < duration {
            let (rates, slopes) = self.rates(position, t, &y);
            let raised = self.raised(&y);
            let above = (raised != y).then(|| self.rates(position, t, &raised).1);
            let mut fastest = 0.0_f64;
            let mut f = vec![0.0; n];
            let mut j = vec![0.0; n * n];
            for (k, reaction) in self.kinetics.reactions.iter().enumerate() {
                let own = speed(reaction, &slopes[k]);
                largest[k] = largest[k].max(above.as_ref().map_or(own, |above| speed(reaction, &above[k])));
                *steepest = steepest.max(own);
                fastest = fastest.max(own);
                for &(i, nu) in &reaction.changes {
                    f[i] += nu * rates[k];
                    slopes[k].iter().for_each(|&(column, slope)| j[i * n + column] += nu * slope);
                }
            }
            let h = step.unwrap_or(if fastest > 0.0 { FIRST_STEP / fastest } else { duration });
            let h = h.max(1e-12 * duration).min(duration - t);
            let Some(change) = implicit(&j, &f, h) else { return };
            let share = ((span - t) / h).clamp(0.0, 1.0);
            way.relaxations += share * h * fastest;
            way.foldings += share * self.folding(&mut y, &change, h * fastest);
            t += h;
            step = Some(h * GROWTH);
        }
    }
}

impl Network<'_> {
    /// Changes the values; the largest change of a logarithm, above the floors.
    ///
    /// What grows from nothing at a steady rate has no rate that changes, and is followed at no cost: it counts
    /// for no more than `most_grown`. What runs out at a steady rate ends, which has to be found.
    fn folding(&self, y: &mut [f64], change: &[f64], most_grown: f64) -> f64 {
        let floors = self.plan.chemistry.as_ref().map_or(&[][..], |chemistry| &chemistry.floors);
        let mut most = 0.0_f64;
        for (k, (y, change)) in y.iter_mut().zip(change).enumerate() {
            let new = (*y + change).max(0.0);
            let floor = floors.get(k).copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
            let change = ln((new + floor) / (*y + floor));
            most = most.max((-change).max(change.min(most_grown)));
            *y = new;
        }
        most
    }
}

/// `(I − hJ) δ = h f` by elimination with column pivots; `None` if it has no answer in numbers.
fn implicit(j: &[f64], f: &[f64], h: f64) -> Option<Vec<f64>> {
    let n = f.len();
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|row| {
            let mut line: Vec<f64> = (0..n).map(|column| -h * j[row * n + column]).collect();
            line[row] += 1.0;
            line.push(h * f[row]);
            line
        })
        .collect();
    for pivot in 0..n {
        let best = (pivot..n).max_by(|&a, &b| rows[a][pivot].abs().total_cmp(&rows[b][pivot].abs()))?;
        rows.swap(pivot, best);
        // Networks of many reactions are sparse: a component meets few others.
        let head: Vec<(usize, f64)> =
            (pivot..=n).map(|column| (column, rows[pivot][column])).filter(|(_, x)| *x != 0.0).collect();
        let largest = rows[pivot][pivot];
        if largest == 0.0 {
            return None;
        }
        for row in rows.iter_mut().skip(pivot + 1).filter(|row| row[pivot] != 0.0) {
            let factor = row[pivot] / largest;
            head.iter().for_each(|&(column, x)| row[column] -= factor * x);
        }
    }
    let mut solution = vec![0.0; n];
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|column| rows[row][column] * solution[column]).sum();
        solution[row] = (rows[row][n] - known) / rows[row][row];
    }
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}

/// Centres of a coarse grid over the domain; axes that were left out are at 0.
pub(super) fn sample_points(axes: &[Axis]) -> Vec<[f64; 3]> {
    let mut points = vec![[0.0; 3]];
    let per_axis = if axes.len() > 2 { POINTS / 2 } else { POINTS };
    for axis in axes {
        let along = |idx: usize| axis.low + (axis.high - axis.low) * (idx as f64 + 0.5) / per_axis as f64;
        let spread = |mut point: [f64; 3], idx: usize| {
            point[axis.index] = along(idx);
            point
        };
        points = points.iter().flat_map(|&point| (0..per_axis).map(move |idx| spread(point, idx))).collect();
    }
    points
}
