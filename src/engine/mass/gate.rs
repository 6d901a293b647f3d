//! What goes through planes and sides, in bins of time.
//!
//! Owns the bins of breakthroughs and first passages. May use exact sums and the plan. It deliberately moves
//! nothing: it is told what happened.

use super::super::calendar::Calendar;
use super::super::schedule::Due;
use super::super::snapshot::{Row, Snapshot, Values};
use super::super::track::monitors::{Gap, Part, Plane, Watch};
use super::book::{Event, What};
use super::flock;
use crate::maths::exact::{Quanta, Sum};
use crate::plan::{Output, OutputKind, Plan, Quantity, Station};

/// Times on steps hold everything of the step before, which rounding may put a little later: so much of the next step,
/// in which nothing happens as early.
const SLACK: f64 = 1e-9;

/// What a gate hears of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Trigger {
    /// Number among the tracker's planes.
    Plane(usize),
    /// Number among sides, and wells behind them.
    Side(usize),
    /// Number among the tracker's gaps.
    Gap(usize),
}

/// One output of what passes a place.
#[derive(Debug, Clone)]
pub struct Gate {
    output_idx: usize,
    trigger: Trigger,
    is_first_passage: bool,
    station: Station,
    /// Water through the place in the direction that counts, m³/s (m², m with fewer axes), and since when.
    water: Vec<(f64, f64)>,
    /// Populations of the output's species.
    populations: Vec<Option<usize>>,
    times: Vec<f64>,
    /// Until when each bin reaches, s; and the steps that must be over before it is handed out.
    ends: Vec<f64>,
    steps: Vec<u64>,
    bins: Vec<Vec<Bin>>,
    /// Per species the sum of all bins that were handed out.
    so_far: Vec<Sum>,
    n_done: usize,
    /// Particles that have been here, a bit each, by origin.
    seen: Vec<Vec<u64>>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Bin {
    net: Sum,
    n: u64,
}

/// All gates of a run.
#[derive(Debug, Clone, Default)]
pub struct Gates {
    gates: Vec<Gate>,
    /// Planes of the tracker; gaps are counted on behind them.
    n_planes: usize,
}

impl Gates {
    /// Takes the outputs of gates out of the dues.
    pub fn new<const D: usize>(
        plan: &Plan,
        calendar: &Calendar,
        dues: &mut Vec<Due>,
        monitors: &mut Monitors<D>,
    ) -> Self {
        let mut gates = Vec::new();
        let has_sub_steps = plan.transport.as_ref().is_some_and(|transport| transport.sub_steps.is_some());
        for (output_idx, output) in plan.outputs.iter().enumerate() {
            let Some(station) = output.station.as_ref().filter(|_| is_gate(output)) else { continue };
            let own: Vec<&Due> = dues.iter().filter(|due| due.outputs.contains(&output_idx)).collect();
            let is_first_passage = output.kind == OutputKind::FirstPassage;
            let is_part = matches!(station, Station::Part { .. });
            let is_between = has_sub_steps || is_part || own.iter().any(|due| due.fraction > 0.0);
            let watch = match (is_first_passage, is_between) {
                (true, _) => Watch::Touch,
                (false, true) => Watch::Times,
                (false, false) => Watch::Ends,
            };
            let Some(trigger) = monitors.trigger(plan, station, watch) else { continue };
            let end = |due: &Due| match due.fraction == 0.0 {
                true if due.steps >= calendar.n_steps() => f64::INFINITY,
                true => calendar.start(due.steps) + SLACK * calendar.length(due.steps),
                false => due.t,
            };
            let n_times = own.len();
            gates.push(Gate {
                output_idx,
                trigger,
                is_first_passage,
                station: station.clone(),
                water: Vec::new(),
                populations: populations(plan, output),
                times: own.iter().map(|due| due.t).collect(),
                ends: own.iter().map(|due| end(due)).collect(),
                steps: own.iter().map(|due| due.steps + u64::from(due.fraction > 0.0)).collect(),
                bins: vec![vec![Bin::default(); n_times]; output.quantities.len()],
                so_far: vec![Sum::default(); output.quantities.len()],
                n_done: 0,
                seen: Vec::new(),
            });
        }
        for due in dues.iter_mut() {
            due.outputs.retain(|&idx| !is_gate(&plan.outputs[idx]));
        }
        dues.retain(|due| !due.outputs.is_empty());
        Self { gates, n_planes: monitors.planes.len() }
    }

    /// Asks how much water goes through each place from a time on.
    pub fn look(&mut self, from: f64, water: impl Fn(&Station) -> f64) {
        for gate in &mut self.gates {
            gate.water.push((from, water(&gate.station)));
        }
    }

    pub fn are_none(&self) -> bool {
        self.gates.is_empty()
    }

    #[inline]
    pub fn note(&mut self, event: &Event, entered_by: Option<usize>, quanta: Quanta) {
        let n_planes = self.n_planes;
        self.gates.iter_mut().for_each(|gate| gate.note(event, entered_by, n_planes, quanta));
    }

    /// Everything that is complete after so many steps.
    pub fn ready(&mut self, steps: u64) -> Vec<Snapshot> {
        self.gates.iter_mut().flat_map(|gate| gate.ready(steps)).collect()
    }
}

/// What the tracker has to look out for.
#[derive(Debug, Clone)]
pub struct Monitors<const D: usize> {
    pub planes: Vec<Plane<D>>,
    pub gaps: Vec<Gap<D>>,
    pub periods: [Option<(f64, f64)>; D],
}

impl<const D: usize> Monitors<D> {
    /// What a station hears of; nothing in a box, where nothing passes.
    fn trigger(&mut self, plan: &Plan, station: &Station, watch: Watch) -> Option<Trigger> {
        match station {
            Station::Plane { axis, at } => Some(self.plane(*axis, *at, watch, None)),
            Station::Side(side) => Some(Trigger::Side(*side)),
            Station::Well(name) => Some(Trigger::Side(2 * D + plan.outlet(name)?.0)),
            Station::Part { of, low, high } => {
                let part = part(plan, low, high);
                match **of {
                    Station::Plane { axis, at } => Some(self.plane(axis, at, watch, Some(part))),
                    Station::Side(side) => {
                        self.gaps.push(Gap { side, part });
                        Some(Trigger::Gap(self.gaps.len() - 1))
                    }
                    _ => None,
                }
            }
            Station::Box { .. } => None,
        }
    }

    fn plane(&mut self, axis: usize, at: f64, watch: Watch, part: Option<Part<D>>) -> Trigger {
        let is_here = |other: &&Plane<D>| (other.axis, other.at, other.watch) == (axis, at, watch);
        let draws = self.planes.iter().find(is_here).map_or(self.planes.len(), |other| other.draws);
        let plane = Plane { axis, at, periods: self.periods, watch, part, draws };
        let number = self.planes.iter().position(|other| *other == plane).unwrap_or_else(|| {
            self.planes.push(plane);
            self.planes.len() - 1
        });
        Trigger::Plane(number)
    }
}

/// A part with limits only where they are not the ends of the domain: what is on or behind a wall belongs to it.
fn part<const D: usize>(plan: &Plan, low: &[f64], high: &[f64]) -> Part<D> {
    let limit = |at: f64, end: f64, beyond: f64| if at == end { beyond } else { at };
    Part {
        low: std::array::from_fn(|axis| limit(low[axis], plan.axes[axis].low, f64::NEG_INFINITY)),
        high: std::array::from_fn(|axis| limit(high[axis], plan.axes[axis].high, f64::INFINITY)),
    }
}

/// Whether an output counts what passes.
fn is_gate(output: &Output) -> bool {
    output.station.as_ref().is_some_and(|station| !matches!(station, Station::Box { .. }))
}

/// The populations of an output's species, in its order; nothing is carried by some. Parcels of water carry them all.
pub fn populations(plan: &Plan, output: &Output) -> Vec<Option<usize>> {
    let of = |quantity: &Quantity| {
        let (Quantity::Species(species) | Quantity::Pair(species, _)) = *quantity;
        if !plan.carries_mass() {
            return Some(species);
        }
        let mut populations = plan.transport.iter().flat_map(|transport| &transport.populations);
        populations.position(|population| population.species == species)
    };
    output.quantities.iter().map(of).collect()
}

impl Gate {
    /// `entered_by` is the side that a particle came in through; `n_planes` are those before the gaps.
    fn note(&mut self, event: &Event, entered_by: Option<usize>, n_planes: usize, quanta: Quanta) {
        let sign = match (self.trigger, event.what) {
            (Trigger::Plane(own), What::Crossed { plane, is_forward }) if own == plane => {
                if is_forward {
                    1.0
                } else {
                    -1.0
                }
            }
            (Trigger::Gap(own), What::Crossed { plane, is_forward }) if n_planes + own == plane => {
                match (is_forward, self.is_first_passage) {
                    (true, _) => 1.0,
                    (false, true) => return,
                    (false, false) => -1.0,
                }
            }
            (Trigger::Side(own), What::Left { side, .. }) if own == side => 1.0,
            (Trigger::Side(own), What::Entered { .. }) if entered_by == Some(own) => {
                if self.is_first_passage {
                    return;
                }
                -1.0
            }
            _ => return,
        };
        if self.is_first_passage && !self.is_new(event.id) {
            return;
        }
        let bin = self.ends.partition_point(|&end| end < event.t);
        if bin == self.ends.len() {
            return;
        }
        let mass = if self.is_first_passage { event.mass } else { sign * event.mass };
        for (own, bins) in self.populations.iter().zip(&mut self.bins) {
            if *own == Some(event.population) {
                quanta.add(&mut bins[bin].net, mass);
                bins[bin].n += 1;
            }
        }
    }

    /// Whether a particle is here for the first time; from now on it is not.
    fn is_new(&mut self, id: u64) -> bool {
        let (origin, count) = (flock::origin(id), flock::count(id) as usize);
        if self.seen.len() <= origin {
            self.seen.resize(origin + 1, Vec::new());
        }
        let bits = &mut self.seen[origin];
        if bits.len() <= count / 64 {
            bits.resize(count / 64 + 1, 0);
        }
        let bit = 1_u64 << (count % 64);
        let is_new = bits[count / 64] & bit == 0;
        bits[count / 64] |= bit;
        is_new
    }

    fn ready(&mut self, steps: u64) -> Vec<Snapshot> {
        let mut snapshots = Vec::new();
        while self.n_done < self.times.len() && self.steps[self.n_done] <= steps {
            snapshots.push(self.hand_out(self.n_done));
            self.n_done += 1;
        }
        snapshots
    }

    /// Water per time, on average between two times.
    fn water_between(&self, from: f64, to: f64) -> f64 {
        if let [(_, water)] = self.water[..] {
            return water;
        }
        let ends = self.water.iter().skip(1).map(|it| it.0).chain([f64::INFINITY]);
        let volume =
            |(&(start, water), end): (&(f64, f64), f64)| water * (end.min(to) - start.max(from)).max(0.0);
        self.water.iter().zip(ends).map(volume).sum::<f64>() / (to - from)
    }

    fn hand_out(&mut self, bin: usize) -> Snapshot {
        let t = self.times[bin];
        let dt = t - if bin == 0 { 0.0 } else { self.times[bin - 1] };
        let water = self.water_between(t - dt, t);
        let known = |value: f64, is_known: bool| if is_known { value } else { f64::NAN };
        let mut rows = Vec::new();
        for (bins, so_far) in self.bins.iter().zip(&mut self.so_far) {
            let Bin { net, n } = bins[bin];
            so_far.merge(net);
            // Not a number at once: 0 / 0 and x / 0 have no value.
            let rate = known(net.value() / dt, dt > 0.0);
            let concentration = known(rate / water, water != 0.0);
            let numbers = match self.is_first_passage {
                true => vec![so_far.value(), rate, n as f64],
                false => vec![concentration, rate, so_far.value(), n as f64],
            };
            rows.push(vec![Row { place: 0, numbers }]);
        }
        Snapshot { output_idx: self.output_idx, t, values: Values::Rows(rows) }
    }
}
