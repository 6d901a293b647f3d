//! What a run will cost: time from a table of measured stage costs, memory from the state.

use super::chemistry::{Chemistry, Method};
use super::exchange::{Exchange, Integration, MOST_PAIR_BYTES};
use super::integrator::Expected;
use super::kernels::Manner;
use super::time_scales::TimeScales;
use super::transport::{Flow, Transport};
use super::{Normals, Output, OutputKind, Plan, Stage, Zone, ZoneRate, turns};
use serde::Serialize;

/// Measured on one core of a shared x86-64 server (Zen 3, AVX2) by `make bench`; nanoseconds.
/// They serve estimates only: no decision that changes bytes hangs on them.
mod table {
    /// One normal number and its displacement.
    pub(super) const MOVE_SINGLE: f64 = 3.2;
    pub(super) const MOVE_DOUBLE: f64 = 12.0;
    /// One side pair applied and one bin index worked out, per axis.
    pub(super) const BOUND: f64 = 0.5;
    /// Sum of one value and count of one particle.
    pub(super) const AVERAGE: f64 = 0.9;
    /// One parcel put in the order of cells, and its values brought there and back; and where it is found at rest.
    pub(super) const SORT: f64 = 50.0;
    pub(super) const STAND: f64 = 25.0;
    /// One parcel among its neighbours, and one of them weighed, with one, two and three axes: more dimensions have more
    /// that is sifted for each that is near. And one value of a neighbour.
    pub(super) const PARCEL: [f64; 3] = [60.0, 105.0, 200.0];
    pub(super) const PAIR: [f64; 3] = [3.5, 3.3, 7.4];
    pub(super) const PAIR_VALUE: f64 = 0.6;
    /// One parcel, and one neighbour weighed, of which another sum has noted what it found. In space a parcel has more
    /// candidates to each of these.
    pub(super) const NOTED: [f64; 3] = [50.0, 50.0, 200.0];
    pub(super) const NOTED_PAIR: [f64; 3] = [0.6, 0.6, 3.0];
    /// Neighbours where each parcel has a kernel of its own: more of them are looked at.
    pub(super) const OWN_KERNELS: f64 = 2.5;
    /// One cell that a kernel reaches, cells that it reaches along an axis, and one search for the kernel of a cell.
    pub(super) const KERNEL_CELL: f64 = 0.15;
    pub(super) const KERNEL_LENGTH: f64 = 24.0;
    pub(super) const SEARCH: f64 = 25_000.0;
    /// Relaxation of one stored value.
    pub(super) const MIX: f64 = 0.7;
    /// One reaction of a particle in closed form, with reading and writing it.
    pub(super) const CLOSED_FORM: f64 = 8.0;
    /// One entry of a matrix exponential applied.
    pub(super) const PROPAGATE: f64 = 0.5;
    /// A sub-step with either integrator: as such, per component, and per operation of the laws.
    pub(super) const EXPLICIT: [f64; 3] = [30.0, 6.0, 1.0];
    pub(super) const ROSENBROCK: [f64; 3] = [30.0, 8.0, 2.5];
    /// One component brought together from its zones, taken back where that is needed, and given out again.
    pub(super) const GATHER: f64 = 15.0;
    /// One species of one speciation from scratch.
    pub(super) const SPECIATE: f64 = 250.0;
    /// Speciations from scratch that those of an implicit sub-step are worth.
    pub(super) const SPECIATIONS: f64 = 2.0;
    /// Sub-steps of a step if time scales are not known: what is taken at a constant rate runs out somewhere.
    pub(super) const UNKNOWN: f64 = 6.0;
    /// One displacement of a particle along its track, walls and random numbers included: along one axis or by
    /// expressions, and in cells with two and three axes.
    pub(super) const TRACK: f64 = 15.0;
    pub(super) const TRACK_CELLS: [f64; 2] = [40.0, 80.0];
    /// One particle asked whether it reacts, and one reaction of it.
    pub(super) const WAIT: f64 = 6.0;
    pub(super) const TURN: f64 = 60.0;
    /// Reactions to and fro that are followed one by one; more are taken together.
    pub(super) const MOST_TURNS: f64 = 120.0;
    /// One particle observed once: positions worked out again, species restored, sums.
    pub(super) const OBSERVE: f64 = 25.0;
    /// One value of a bin observed once: its sums, mean and error.
    pub(super) const OBSERVE_BIN: f64 = 45.0;
    /// One row of a table written.
    pub(super) const WRITE_ROW: f64 = 380.0;
}

/// The estimate for a whole run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// Bytes of particle state.
    pub state_bytes: u64,
    /// Bytes of sums over bins, for all groups of blocks together.
    pub bin_bytes: u64,
    /// Bytes of what is observed: all values over bins, which are kept to the end for the measures, and the
    /// sums or the particles of the largest observation.
    pub output_bytes: u64,
    pub particle_steps: f64,
    /// Displacements that a particle takes in a step, as far as they can be told before a flow is solved for.
    pub displacements_per_step: f64,
    /// Nanoseconds per particle and step, one entry per stage.
    pub stages: Vec<(Stage, f64)>,
    /// Seconds of one core, observations and their writing included.
    pub cpu_seconds: f64,
}

impl Cost {
    /// Bytes that the run needs at once.
    pub fn bytes(&self) -> u64 {
        self.state_bytes.saturating_add(self.bin_bytes).saturating_add(self.output_bytes)
    }
}

/// Values that every particle stores for each component.
pub fn n_stored_values(plan: &Plan) -> usize {
    match &plan.mixing {
        None => 1,
        Some(mixing) => {
            let stores_mean = mixing.stores_mean();
            let is_of_its_own =
                |zone: &&Zone| zone.is_stored && !(stores_mean && zone.rate == ZoneRate::Instant);
            let n_zones = mixing.zones.iter().filter(is_of_its_own).count();
            n_zones + usize::from(mixing.is_well_mixed) + usize::from(stores_mean)
        }
    }
}

/// Works the estimate out. Without time scales the sub-steps of reactions are those of a slow network.
pub fn estimate(plan: &Plan, scales: Option<&TimeScales>) -> Cost {
    let n_axes = plan.axes.len() as f64;
    let n_particles = plan.particles.count as f64;
    let n_values = (plan.components.len() * n_stored_values(plan)) as f64;
    let n_exchanging = plan.mixing.as_ref().map_or(0, |mixing| {
        mixing.zones.iter().filter(|zone| matches!(zone.rate, ZoneRate::Finite(rate) if rate > 0.0)).count()
    });
    let n_relaxed = (plan.components.len() * n_exchanging) as f64;
    let move_cost = match plan.walk.normals {
        Normals::Single => table::MOVE_SINGLE,
        Normals::Double => table::MOVE_DOUBLE,
    };
    let react_cost = react_cost(plan, scales);
    let cost_of = |stage: Stage| match stage {
        Stage::Mix => table::MIX * n_relaxed,
        Stage::React => react_cost,
        Stage::FusedReact => react_cost + table::MIX * n_relaxed,
        Stage::Move => {
            plan.transport.as_ref().map_or(move_cost * n_axes, |transport| track_cost(plan, transport))
        }
        Stage::Bound => table::BOUND * n_axes,
        Stage::Exchange => exchange_cost(plan, n_values),
        Stage::KernelMean => means_cost(plan),
        Stage::Average => table::AVERAGE * n_values,
        Stage::Estimate => estimate_cost(plan),
        Stage::FusedStep => {
            let step = move_cost * n_axes + table::BOUND * n_axes + table::AVERAGE * n_values;
            let is_coupled = plan.stages.contains(&Stage::FusedReact);
            if is_coupled { step } else { step + table::MIX * n_relaxed + react_cost }
        }
        Stage::Observe => 0.0,
    };
    let stages: Vec<(Stage, f64)> = plan.stages.iter().map(|&stage| (stage, cost_of(stage))).collect();
    let per_step: f64 = stages.iter().map(|(_, cost)| cost).sum();
    let particle_steps = n_particles * plan.time.n_steps as f64;
    let n_observations: usize = plan.outputs.iter().map(|output| output.times.len()).sum();
    let n_binned: f64 =
        plan.outputs.iter().map(|output| output.times.len() as f64 * binned_values(output)).sum();
    let nanoseconds = per_step * particle_steps
        + (table::OBSERVE + speciation_cost(plan)) * n_observations as f64 * n_particles
        + (table::OBSERVE_BIN + table::WRITE_ROW) * n_binned;
    let n_bins: f64 = plan.axes.iter().map(|axis| axis.bins as f64).product();
    Cost {
        state_bytes: (8.0 * n_particles * (n_axes + n_values + own_values(plan, n_values))
            + pair_bytes(plan)
            + lattice_bytes(plan)) as u64,
        bin_bytes: (8.0 * n_bins * (1.0 + n_values) * 2.0) as u64,
        output_bytes: output_bytes(plan),
        particle_steps,
        displacements_per_step: super::auto_step::displacements(plan),
        stages,
        cpu_seconds: nanoseconds * 1e-9,
    }
}

/// Nanoseconds per particle and step of finding concentrations in cells and what particles have of these, kernels of some five
/// cells to each side; half of all cells have particles.
fn estimate_cost(plan: &Plan) -> f64 {
    let Some(kernels) = &plan.kernels else { return 0.0 };
    let d = plan.axes.len() as i32;
    let n_populations = plan.transport.as_ref().map_or(0, |transport| transport.populations.len()) as f64;
    let n_cells = (0.5 * kernels.n_cells() as f64).min(plan.particles.count as f64);
    let per_cell = match kernels.manner {
        Manner::Adaptive => {
            2.0 * table::KERNEL_CELL * table::KERNEL_LENGTH.powi(d) + table::SEARCH / kernels.refresh as f64
        }
        _ => 2.0 * table::KERNEL_CELL * table::KERNEL_LENGTH * f64::from(d),
    };
    n_populations * n_cells * per_cell / plan.particles.count as f64 + table::AVERAGE
}

/// Bytes of the cells that kernels give to: content of each species before and after, what is lost, where all are; and the fields
/// that a search for kernels goes through.
fn lattice_bytes(plan: &Plan) -> f64 {
    let Some(kernels) = &plan.kernels else { return 0.0 };
    let n_species = plan.species.len() as f64;
    let d = plan.axes.len() as f64;
    8.0 * kernels.n_cells() as f64 * (4.0 * n_species + d + 8.0 + d * (d + 1.0))
}

/// Numbers per particle beside its position and what it carries: of parcels that come and go, and of those that are
/// sorted and weighed for an exchange.
fn own_values(plan: &Plan, n_values: f64) -> f64 {
    let d = plan.axes.len() as f64;
    let of_exchange = 2.0 * d + 3.0 * n_values + 4.0;
    let exchanged = match &plan.exchange {
        None => 0.0,
        Some(exchange) if exchange.spreading.is_none() => of_exchange,
        // Half a metric and a share, as parcels lie and in the order of cells.
        Some(_) => of_exchange + d * (d + 1.0) + 2.0,
    };
    // The sums of an exponential step have room of their own.
    let averaged = if plan.has_kernel_mean() { 2.0 * d + 6.0 * n_values + 4.0 } else { 0.0 };
    exchanged + averaged + f64::from(u8::from(plan.transport.is_some()))
}

/// Bytes of what is remembered of pairs, by an exchange and by means over the parcels around, as long as there is room.
fn pair_bytes(plan: &Plan) -> f64 {
    let exchange = plan.exchange.as_ref().filter(|exchange| exchange.spreading.is_none());
    let exchanged = exchange.map_or(0.0, |exchange| all_pair_bytes(plan, exchange));
    let averaging = plan.averaging();
    let averaged = averaging.map_or(0.0, |it| bytes_of_pairs(plan, it.extents(plan).neighbours));
    exchanged.min(MOST_PAIR_BYTES as f64) + averaged.min(MOST_PAIR_BYTES as f64)
}

fn all_pair_bytes(plan: &Plan, exchange: &Exchange) -> f64 {
    bytes_of_pairs(plan, exchange.sizes(plan, plan.time.step).neighbours)
}

/// A number and a weight of each of them, which fill whole lanes.
fn bytes_of_pairs(plan: &Plan, neighbours: f64) -> f64 {
    10.0 * plan.particles.count as f64 * (neighbours + 4.0)
}

/// Nanoseconds per particle and step of an exchange. Parcels at rest are sorted, and their weights made, once in a run.
fn exchange_cost(plan: &Plan, n_values: f64) -> f64 {
    let Some(exchange) = &plan.exchange else { return 0.0 };
    let walks = parcels_walk(plan) || exchange.spreading.is_some();
    let [anew, applied] = exchange_parts(plan, exchange, n_values, walks);
    applied + per_step(plan, anew, walks)
}

fn parcels_walk(plan: &Plan) -> bool {
    plan.stages.iter().any(|stage| matches!(stage, Stage::Move | Stage::FusedStep))
}

/// What has to be done anew where parcels walk, and once in a run where they rest.
fn per_step(plan: &Plan, anew: f64, walks: bool) -> f64 {
    if walks { anew } else { table::STAND + anew / plan.time.n_steps.max(1) as f64 }
}

/// The part of all pairs that there is room to remember.
fn noted_share(all_bytes: f64) -> f64 {
    all_bytes.min(MOST_PAIR_BYTES as f64) / all_bytes.max(1.0)
}

/// Means over the parcels around: weights, the sums of each rate, and the mean that is stored. All sums but the first are of
/// notes, as far as there is room.
fn means_cost(plan: &Plan) -> f64 {
    let Some(mixing) = &plan.mixing else { return 0.0 };
    let Some(averaging) = &mixing.averaging else { return 0.0 };
    let d = plan.axes.len();
    let axis = d.clamp(1, 3) - 1;
    let n = averaging.extents(plan).neighbours;
    let share = noted_share(bytes_of_pairs(plan, n));
    let sum = |n_values: f64| {
        let anew = table::PARCEL[axis] + n * (table::PAIR[axis] + table::PAIR_VALUE * n_values);
        let noted = table::NOTED[axis] + n * (table::NOTED_PAIR[axis] + table::PAIR_VALUE * n_values);
        (anew, share * noted + (1.0 - share) * anew)
    };
    let n_components = plan.n_mobile() as f64;
    let of_zone = |zone: &Zone| match zone.rate {
        ZoneRate::Finite(rate) if rate > 0.0 => jumps(0.5 * rate * plan.time.step) * sum(n_components).1,
        ZoneRate::Finite(_) | ZoneRate::Instant => 0.0,
    };
    let zones: f64 = mixing.zones.iter().map(of_zone).sum();
    // Weights that add up to more than one are cut down in a sum of their own: those of parcels that lie at random do.
    let stored = if mixing.stores_mean() { 2.0 * sum(n_components).1 } else { 0.0 };
    let (weights, _) = averaging.as_exchange(d).sums(1.0);
    let anew = table::SORT + sum(0.0).0 + (weights - 1.0) * sum(1.0).1;
    per_step(plan, anew, parcels_walk(plan)) + zones + stored
}

/// Sums of an exponential step up to a rest of 1e-12, about: terms of a Poisson distribution.
fn jumps(share: f64) -> f64 {
    let (mut weight, mut n) = (crate::maths::scalar::exp(-share), 0.0);
    let mut left = 1.0 - weight;
    while left > 1e-12 && n < 12.0 * share.sqrt() + share + 40.0 {
        n += 1.0;
        weight *= share / n;
        left -= weight;
    }
    n.max(1.0)
}

/// The same of the first step, which is the dearest.
pub(super) fn first_exchange(plan: &Plan, exchange: &Exchange) -> f64 {
    let n_values = (plan.components.len() * n_stored_values(plan)) as f64;
    exchange_parts(plan, exchange, n_values, true).iter().sum()
}

/// What it takes to sort parcels and to make their weights, and to apply these; in steps in which all sums may be noted, or as
/// far as there is room.
fn exchange_parts(plan: &Plan, exchange: &Exchange, n_values: f64, are_noted: bool) -> [f64; 2] {
    let sizes = exchange.sizes(plan, plan.time.step);
    let (weights, applied) = exchange.sums(sizes.share);
    let axis = plan.axes.len().clamp(1, 3) - 1;
    let has_notes = exchange.spreading.is_none();
    let looked_at = if has_notes { 1.0 } else { table::OWN_KERNELS } * sizes.neighbours;
    let sum = table::PARCEL[axis] + looked_at * (table::PAIR[axis] + table::PAIR_VALUE * n_values);
    let noted = table::NOTED[axis] + looked_at * (table::NOTED_PAIR[axis] + table::PAIR_VALUE * n_values);
    let share = match exchange.integration {
        _ if !has_notes => 0.0,
        Integration::Explicit if are_noted && weights <= 1.0 => 1.0,
        _ => noted_share(all_pair_bytes(plan, exchange)),
    };
    let again = share * noted + (1.0 - share) * sum;
    [table::SORT + sum + (weights - 1.0) * again, applied * again]
}

/// Nanoseconds per particle and step of a walk along tracks.
fn track_cost(plan: &Plan, transport: &Transport) -> f64 {
    let in_cells = matches!(transport.flow, Flow::Darcy(_) | Flow::File(_));
    let own = match plan.axes.len() {
        2 if in_cells => table::TRACK_CELLS[0],
        3 if in_cells => table::TRACK_CELLS[1],
        _ => table::TRACK,
    };
    own * super::auto_step::displacements(plan)
}

/// Nanoseconds per particle and step, with the sub-steps that are expected.
fn react_cost(plan: &Plan, scales: Option<&TimeScales>) -> f64 {
    if let Some(decay) = plan.transport.as_ref().and_then(|transport| transport.decay.as_ref()) {
        return table::WAIT + table::TURN * turns::per_step(plan, decay).min(table::MOST_TURNS);
    }
    let Some(chemistry) = &plan.chemistry else { return 0.0 };
    let Some(kinetics) = &chemistry.kinetics else { return 0.0 };
    let n = plan.components.len() as f64;
    let price = |[own, component, operation]: [f64; 3]| {
        own + component * n + operation * kinetics.laws.operations.len() as f64
    };
    let integrated = match kinetics.method {
        Method::Observed => return 0.0,
        Method::Pair | Method::Saturation | Method::Zero => table::CLOSED_FORM,
        Method::Exponential => table::PROPAGATE * n * n,
        Method::Explicit => sub_steps(plan, chemistry, scales) * price(table::EXPLICIT),
        Method::Rosenbrock => {
            let speciations = table::SPECIATIONS * speciation_cost(plan);
            sub_steps(plan, chemistry, scales) * (price(table::ROSENBROCK) + speciations)
        }
    };
    if let Some(kernels) = plan.kernels.as_ref().filter(|_| plan.carries_mass()) {
        // Cells react, and not particles.
        let n_cells = 0.5 * kernels.n_cells() as f64;
        return integrated * n_cells / plan.particles.count as f64;
    }
    if plan.mixing.is_some() || plan.has_immobile() { integrated + table::GATHER * n } else { integrated }
}

fn sub_steps(plan: &Plan, chemistry: &Chemistry, scales: Option<&TimeScales>) -> f64 {
    let is_explicit = chemistry.kinetics.as_ref().is_some_and(|kinetics| kinetics.method == Method::Explicit);
    match scales.map(|scales| Expected::new(scales, chemistry, plan.components.len())) {
        Some(expected) if is_explicit => expected.explicit,
        Some(expected) => expected.implicit,
        None if chemistry.equilibrium.is_some() => 1.0,
        None => table::UNKNOWN,
    }
}

/// Nanoseconds of one speciation of one particle; none without equilibrium.
fn speciation_cost(plan: &Plan) -> f64 {
    let equilibrium = plan.chemistry.as_ref().and_then(|chemistry| chemistry.equilibrium.as_ref());
    equilibrium.map_or(0.0, |own| {
        table::SPECIATE * (own.primaries.len() + own.secondaries.len() + own.minerals.len()) as f64
    })
}

/// Bins times quantities of one observation; none for what has no value per bin.
fn binned_values(output: &Output) -> f64 {
    match output.kind {
        OutputKind::Profile | OutputKind::Map | OutputKind::Covariance => {
            n_bins(output) * output.quantities.len() as f64
        }
        _ => 0.0,
    }
}

fn n_bins(output: &Output) -> f64 {
    output.bins.iter().map(|&bins| bins as f64).product()
}

/// Numbers per bin that are kept of an observation, and that its first and second pass sum.
fn numbers_per_bin(plan: &Plan, output: &Output) -> [f64; 3] {
    let n_quantities = output.quantities.len() as f64;
    // With zones, errors follow the mean of every component.
    let n_slopes = if plan.mixing.is_some() { plan.components.len() as f64 } else { 0.0 };
    match output.kind {
        OutputKind::Profile | OutputKind::Map => {
            [1.0 + 2.0 * n_quantities, 1.0 + n_quantities * (1.0 + n_slopes), n_quantities]
        }
        OutputKind::Covariance => [1.0 + n_quantities, 1.0 + 2.0 * n_quantities, n_quantities],
        OutputKind::Dilution => [0.0, n_quantities, 0.0],
        _ => [0.0; 3],
    }
}

fn output_bytes(plan: &Plan) -> u64 {
    let mut kept = 0.0;
    let mut largest: f64 = 0.0;
    for output in &plan.outputs {
        let [values, first, second] = numbers_per_bin(plan, output).map(|n| 8.0 * n * n_bins(output));
        kept += (values + row_bytes(plan, output)) * output.times.len() as f64;
        // Sums of groups of blocks beside what they are added to, first in one pass and then in the other.
        largest = largest.max((2.0 * first).max(first + 2.0 * second) - values).max(first + second);
    }
    (kept + largest) as u64 + particle_output_bytes(plan)
}

/// Bytes of the rows of one time, and of the bin of time that they are summed in.
fn row_bytes(plan: &Plan, output: &Output) -> f64 {
    let n_rows = if output.kind == OutputKind::Budget { plan.places(output).len() } else { 1 };
    let numbers = output.kind.numbers().len();
    let summed = if output.kind.has_station() { 3 } else { 0 };
    if numbers == 0 { 0.0 } else { (8 * output.quantities.len() * (n_rows * (numbers + 4) + summed)) as f64 }
}

/// Bytes that one whole observation of every particle takes while it is written.
fn particle_output_bytes(plan: &Plan) -> u64 {
    // Densities list them, too, and weigh one species after the other.
    let columns = |output: &Output| {
        let weighed = usize::from(output.kind.is_by_kernels());
        (plan.axes.len() + output.quantities.len() + weighed) as u64
    };
    let lists = |kind: OutputKind| kind == OutputKind::Particles || kind.is_by_kernels();
    let of_particles = plan.outputs.iter().filter(|output| lists(output.kind));
    of_particles.map(columns).max().unwrap_or(0) * 8 * plan.particles.count
}
