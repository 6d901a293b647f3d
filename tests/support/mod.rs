//! Plans built by hand, for tests and benches of the engine.
#![allow(dead_code)]

pub mod parcels;

use lamella::engine::snapshot::{Outcome, Snapshot};
use lamella::engine::{self, RunError, Settings, Unattended};
use lamella::plan::tape::{Binary, Operation, Tape};
use lamella::plan::*;

/// Seconds and metres of the experiment P5-a.
pub const D: f64 = 1.3e-7;
pub const CHI: f64 = 1e-3;
pub const HALF_LENGTH: f64 = 0.075;

pub fn axis(index: usize, low: f64, high: f64, side: Side, bins: usize) -> Axis {
    Axis { index, low, high, low_side: side, high_side: side, bins }
}

/// `value` everywhere.
pub fn constant(value: f64) -> Tape {
    Tape { operations: vec![Operation::Constant(value)] }
}

/// 1 where the axis is negative, else 0.
pub fn step_down(axis: u16) -> Tape {
    let operations =
        vec![Operation::Input(axis), Operation::Constant(0.0), Operation::Binary(Binary::Less, 0, 1)];
    Tape { operations }
}

/// Isotropic walk.
pub fn walk(n_axes: usize, dispersion: f64) -> Walk {
    let mut spread = Vec::new();
    for row in 0..n_axes {
        spread.extend(std::iter::repeat_n(0.0, row));
        spread.push((2.0 * dispersion).sqrt());
    }
    Walk { drift: vec![0.0; n_axes], spread, normals: Normals::Single }
}

pub fn zone(name: &str, fraction: f64, rate: ZoneRate) -> Zone {
    Zone { name: name.to_owned(), fraction, rate, is_stored: rate != ZoneRate::Instant }
}

pub fn dual_rate(eta: f64, chi: f64) -> Option<Mixing> {
    let zones = vec![zone("fast", 1.0 - eta, ZoneRate::Instant), zone("slow", eta, ZoneRate::Finite(chi))];
    Some(Mixing { zones, is_well_mixed: false, averaging: None })
}

pub fn output(kind: OutputKind, quantities: Vec<Quantity>, bins: Vec<usize>, times: Vec<f64>) -> Output {
    Output { kind, quantities, bins, times, unit: None, station: None }
}

pub fn species(name: &str, constant: f64, terms: Vec<(usize, f64)>) -> Species {
    Species { name: name.to_owned(), constant, terms, is_molar: true }
}

/// The front A + B → AB of P5-a with c0 = 1, without outputs.
pub fn front(n_particles: u64, bins: usize, duration: f64, step: f64) -> Plan {
    Plan {
        numerics: NUMERICS_VERSION,
        axes: vec![axis(0, -HALF_LENGTH, HALF_LENGTH, Side::Reflect, bins)],
        walk: walk(1, D),
        particles: Particles {
            count: n_particles,
            placement: Placement::Stratified,
            disorder: 0.0,
            volume: 2.0 * HALF_LENGTH / n_particles as f64,
        },
        species: vec![
            species("A", 0.0, vec![(0, 1.0)]),
            species("B", 1.0, vec![(0, -1.0)]),
            species("AB", 0.0, vec![]),
        ],
        components: vec![Component { name: "A".to_owned(), initial: step_down(0), is_immobile: false }],
        mixing: dual_rate(0.5, CHI),
        exchange: None,
        reactions: vec![InstantReaction {
            name: "complexation".to_owned(),
            reactants: vec![(0, 1.0), (1, 1.0)],
            products: vec![(2, 1.0)],
        }],
        chemistry: None,
        transport: None,
        kernels: None,
        time: Time { step, n_steps: (duration / step - 1e-9).ceil() as u64, duration },
        outputs: vec![],
        writes_flow: false,
        stages: vec![Stage::FusedStep, Stage::Observe],
        seed: 42,
    }
}

/// The outputs of the first scenario.
pub fn front_outputs(bins: usize, times: Vec<f64>, every: Vec<f64>) -> Vec<Output> {
    let ab = (0..3).map(Quantity::Species).collect();
    let pair = vec![Quantity::Pair(0, 1)];
    vec![
        output(OutputKind::Profile, ab, vec![bins], times.clone()),
        output(OutputKind::Covariance, pair.clone(), vec![bins], times),
        output(OutputKind::Total, vec![Quantity::Species(2)], vec![], every.clone()),
        output(OutputKind::Mixing, pair, vec![bins], every),
    ]
}

/// A fluid of conserved particles in a box, with no chemistry, no zones and no outputs.
pub fn plain(axes: Vec<Axis>, walk: Walk, n_particles: u64, duration: f64, step: f64) -> Plan {
    let size: f64 = axes.iter().map(|axis| axis.high - axis.low).product();
    Plan {
        axes,
        walk,
        particles: Particles {
            count: n_particles,
            placement: Placement::Stratified,
            disorder: 0.0,
            volume: size / n_particles as f64,
        },
        species: vec![species("A", 0.0, vec![(0, 1.0)])],
        components: vec![Component { name: "A".to_owned(), initial: constant(1.0), is_immobile: false }],
        mixing: None,
        reactions: vec![],
        chemistry: None,
        transport: None,
        ..front(n_particles, 1, duration, step)
    }
}

/// Every species at all times, as particles.
pub fn all_particles(plan: &Plan, times: Vec<f64>) -> Output {
    let quantities = (0..plan.species.len()).map(Quantity::Species).collect();
    output(OutputKind::Particles, quantities, vec![], times)
}

pub fn run_with(plan: &Plan, settings: &Settings) -> Result<(Outcome, Vec<Snapshot>), RunError> {
    let mut snapshots = Vec::new();
    let mut sink = |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    };
    let outcome = engine::run(plan, settings, &Unattended, &mut sink)?;
    Ok((outcome, snapshots))
}

pub fn run(plan: &Plan) -> (Outcome, Vec<Snapshot>) {
    run_with(plan, &Settings::default()).unwrap()
}
