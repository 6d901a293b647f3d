//! A plan and snapshots made up by hand, with every kind of output, both kinds of unit, an empty
//! bin and a bin of one particle.

use lamella::engine::snapshot::{MixingState, Snapshot, Values};
use lamella::plan::{
    Axis, Normals, Output, OutputKind, OutputUnit, Particles, Placement, Plan, Quantity, Side, Species,
    Stage, Time, Walk,
};
use lamella::table::{ErrorRow, Norms, Parameter, PointRow, Record, Status, Swept, SweptValue, Value};
use lamella::units::Dimension;

pub const N_BINS: usize = 6;

fn axis(index: usize, half: f64) -> Axis {
    Axis { index, low: -half, high: half, low_side: Side::Reflect, high_side: Side::Reflect, bins: N_BINS }
}

fn species(name: &str, is_molar: bool) -> Species {
    Species { name: name.to_owned(), constant: 0.0, terms: Vec::new(), is_molar }
}

fn output(kind: OutputKind, quantities: Vec<Quantity>, bins: Vec<usize>, times: &[f64]) -> Output {
    Output { kind, quantities, bins, times: times.to_vec(), unit: None, station: None }
}

/// Two axes, two species in mol and one in kg.
pub fn plan() -> Plan {
    use Quantity::{Pair, Species as One};
    let mut in_milligrams = output(OutputKind::Profile, vec![One(2)], vec![N_BINS, 1], &[10.0]);
    in_milligrams.unit = Some(OutputUnit { text: "mg/L".to_owned(), factor: 1e-3 });
    Plan {
        numerics: 1,
        axes: vec![axis(0, 0.075), axis(1, 0.01)],
        walk: Walk { drift: vec![0.0; 2], spread: vec![1e-4, 0.0, 1e-4], normals: Normals::Single },
        particles: Particles {
            count: 4,
            placement: Placement::Stratified,
            disorder: 0.0,
            volume: 0.003 / 4.0,
        },
        species: vec![species("A", true), species("B", true), species("biomass", false)],
        components: Vec::new(),
        mixing: None,
        exchange: None,
        reactions: Vec::new(),
        chemistry: None,
        transport: None,
        kernels: None,
        time: Time { step: 2.0, n_steps: 10, duration: 20.0 },
        outputs: vec![
            output(OutputKind::Profile, vec![One(0), One(1)], vec![N_BINS, 1], &[10.0, 20.0]),
            in_milligrams,
            output(OutputKind::Covariance, vec![Pair(0, 1), Pair(0, 0)], vec![N_BINS, 1], &[20.0]),
            output(OutputKind::Map, vec![One(1)], vec![N_BINS, 2], &[20.0]),
            output(OutputKind::Total, vec![One(0), One(2)], Vec::new(), &[0.0, 10.0, 20.0]),
            output(OutputKind::Mixing, vec![Pair(0, 1)], vec![N_BINS, 1], &[10.0, 20.0]),
            output(OutputKind::Particles, vec![One(0), One(1)], Vec::new(), &[20.0]),
        ],
        writes_flow: false,
        stages: vec![Stage::Move, Stage::Bound, Stage::Average, Stage::Observe],
        seed: u64::MAX,
    }
}

/// Bins as the engine fills them: the third is empty, the fourth holds one particle.
fn binned(n_quantities: usize, n_bins: usize, scale: f64) -> Values {
    let column =
        |q: usize| -> Vec<f64> { (0..n_bins).map(|bin| scale * (1.0 + q as f64 + bin as f64)).collect() };
    let mut mean: Vec<_> = (0..n_quantities).map(column).collect();
    let mut standard_error: Vec<_> = (0..n_quantities).map(|_| vec![0.25 * scale; n_bins]).collect();
    mean.iter_mut().for_each(|column| column[2] = f64::NAN);
    standard_error.iter_mut().for_each(|column| column[3] = f64::NAN);
    Values::Binned { mean, standard_error, n_particles: n_particles(n_bins) }
}

fn n_particles(n_bins: usize) -> Vec<u64> {
    (0..n_bins as u64).map(|bin| [5, 4, 0, 1][bin.min(3) as usize]).collect()
}

pub fn snapshots() -> Vec<Snapshot> {
    let state = MixingState { m: 1.5, m_mean: 1.0, m_cov: 0.5, gamma: 0.5 };
    let undefined = MixingState { m: 0.0, m_mean: 0.0, m_cov: 0.0, gamma: f64::NAN };
    let covariance = Values::Covariance {
        covariance: vec![vec![-0.5; N_BINS], vec![0.5; N_BINS]],
        n_particles: n_particles(N_BINS),
    };
    let particles = Values::Particles {
        positions: vec![vec![0.0, 0.01, 0.02, 0.03], vec![0.001; 4]],
        concentrations: vec![vec![1.0, 2.0, 3.0, 4.0], vec![0.0; 4]],
    };
    let total = |k: f64| Values::Total { amount: vec![3.0 - k, k * 1e-6] };
    let at = |output_idx, t, values| Snapshot { output_idx, t, values };
    vec![
        at(4, 0.0, total(0.0)),
        at(0, 10.0, binned(2, N_BINS, 1.0)),
        at(1, 10.0, binned(1, N_BINS, 1e-3)),
        at(4, 10.0, total(1.0)),
        at(5, 10.0, Values::Mixing(vec![undefined])),
        at(0, 20.0, binned(2, N_BINS, 2.0)),
        at(2, 20.0, covariance),
        at(3, 20.0, binned(1, 2 * N_BINS, 1.0)),
        at(4, 20.0, total(2.0)),
        at(5, 20.0, Values::Mixing(vec![state])),
        at(6, 20.0, particles),
    ]
}

pub fn record() -> Record {
    Record {
        data: Vec::new(),
        scene_name: "two_axes".to_owned(),
        scene_text: "lamella 1\nseed 1 # größer als ASCII\n".to_owned(),
        scene_source: "lamella 1\nseed   1 # größer als ASCII\n".to_owned(),
        title: Some("A plan made up by hand".to_owned()),
        citations: vec!["doi:10.1021/es0157144".to_owned()],
        parameters: vec![Parameter {
            name: "D".to_owned(),
            value_si: 1.3e-7,
            unit: "m^2/s".to_owned(),
            dimension: Dimension::DISPERSION,
            doc: Some("hydrodynamic dispersion".to_owned()),
        }],
        species_docs: vec![("A".to_owned(), "Cu2+".to_owned())],
        n_axes: 2,
        plan_hash: "5f".repeat(32),
        plan_yaml: "numerics: 1\n".to_owned(),
        version: "0.1.0".to_owned(),
    }
}

/// A row with every kind of column a scene can name, two of them in the way of fixed ones.
pub fn point() -> PointRow {
    let value = |name: &str, unit: &str, value| Value { name: name.to_owned(), unit: unit.to_owned(), value };
    let swept = |name: &str, value| Swept { name: name.to_owned(), value };
    PointRow {
        point: 0,
        replicate: 0,
        key: "5f".repeat(32),
        swept: vec![
            swept("chi", SweptValue::Real(1e-3, "1/s".to_owned())),
            swept("n", SweptValue::Integer(-3)),
            swept("law", SweptValue::Text("monod".to_owned())),
        ],
        seed: u64::MAX,
        status: Status::Done,
        error_code: None,
        error_message: None,
        wall: 1.5,
        loop_wall: 1.25,
        cpu: 2.5,
        compile_wall: 0.01,
        write_wall: None,
        peak_memory: Some(123_456_789),
        particles: 4,
        step: 2.0,
        duration: 20.0,
        steps: 10,
        sub_steps: None,
        mass_defect: Some(1e-16),
        values: vec![
            value("err", "mol/m^3", Some(0.125)),
            value("host", "1", Some(7.0)),
            value("limit.profile.A.l2", "mol/m^2.5", None),
        ],
        version: "0.1.0".to_owned(),
        numerics: 1,
        host: "a-machine".to_owned(),
        threads: 2,
        started: 1_768_392_000_000_000,
        finished: 1_768_392_001_500_000,
    }
}

pub fn errors() -> Vec<ErrorRow> {
    let row = |t, species_b: Option<&str>, relative| ErrorRow {
        point: 0,
        replicate: 0,
        t,
        reference: "limit".to_owned(),
        output: 0,
        kind: "profile".to_owned(),
        species_a: "A".to_owned(),
        species_b: species_b.map(str::to_owned),
        n: 5,
        n_empty: 1,
        norms: Norms { l1: 0.5, l2: 0.25, linf: 2.0, rmse: 1.0 },
        relative,
        noise: Some(0.125),
        unit: "mol/m^3".to_owned(),
    };
    vec![
        row(Some(10.0), None, Some(Norms { l1: 0.1, l2: 0.2, linf: 0.3, rmse: 0.4 })),
        row(None, Some("B"), None),
    ]
}
