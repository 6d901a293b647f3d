//! What is remembered of pairs of parcels changes no bit, however much of it there is room for.

mod support;

use lamella::engine::Settings;
use lamella::engine::snapshot::Values;
use lamella::plan::exchange::{Integration, Kernel, Normalisation};
use lamella::plan::*;
use support::parcels::{cloud, gaussian};

/// Memory for none, for a sheet or two, for some of them, and for all.
const ROOMS: [Option<usize>; 3] = [Some(90_000), Some(400_000), None];

fn identity(d: usize) -> Vec<f64> {
    (0..d).flat_map(|row| (0..=row).map(move |column| f64::from(u8::from(row == column)))).collect()
}

/// Bits of all places and values that are seen.
fn bits(plan: &Plan, settings: &Settings) -> Vec<u64> {
    let (_, snapshots) = support::run_with(plan, settings).unwrap();
    let mut bits = Vec::new();
    for snapshot in &snapshots {
        let Values::Particles { positions, concentrations } = &snapshot.values else {
            panic!("no particles")
        };
        bits.extend(positions.iter().chain(concentrations).flatten().map(|value| value.to_bits()));
    }
    bits
}

/// Parcels between all kinds of sides, with as many columns, that exchange in three steps.
fn parcels(
    sides: &[Side],
    (n, bandwidth): (u64, f64),
    (kernel, normalisation, integration): (&str, Normalisation, Integration),
    (walks, n_columns): (bool, usize),
) -> Plan {
    let mut exchange = gaussian(identity(sides.len()), support::constant(bandwidth));
    exchange.kernel = Kernel::Catalogue(kernel.to_owned());
    if kernel != "gaussian" {
        exchange.cutoff = Default::default();
    }
    (exchange.normalisation, exchange.integration) = (normalisation, integration);
    let share = if integration == Integration::Explicit { 1.0 } else { 3.0 };
    let of_one = exchange.sizes(&cloud(sides, n, exchange.clone(), 1.0), 1.0).share;
    let dt = share / of_one;
    let mut plan = cloud(sides, n, exchange, dt);
    for column in 1..n_columns {
        let name = format!("A{column}");
        plan.components.push(Component {
            name: name.clone(),
            initial: support::step_down(column as u16 % sides.len() as u16),
            is_immobile: false,
        });
        plan.species.push(support::species(&name, 0.0, vec![(column, 1.0)]));
    }
    (plan.time.n_steps, plan.time.duration) = (3, 3.0 * dt);
    if walks {
        plan.walk = support::walk(sides.len(), 0.05);
        plan.stages = vec![Stage::Move, Stage::Bound, Stage::Exchange, Stage::Observe];
    }
    // The last one in the middle of a step.
    plan.outputs = vec![support::all_particles(&plan, vec![0.0, dt, 2.5 * dt, 3.0 * dt])];
    plan
}

const CASES: [(&[Side], u64, f64); 4] = [
    (&[Side::Periodic], 2000, 0.004),
    (&[Side::Periodic, Side::Reflect], 2600, 0.022),
    (&[Side::Reflect, Side::Open], 1100, 0.12),
    (&[Side::Periodic, Side::Open, Side::Reflect], 2100, 0.055),
];

fn compare(normalisation: Normalisation, integration: Integration) {
    for (idx, (sides, n, bandwidth)) in CASES.into_iter().enumerate() {
        for (kernel, walks) in
            [("gaussian", true), ("gaussian", false), ("wendland_c2", true), ("wendland_c2", false)]
        {
            // Kernels of two bandwidths and of six are equally long.
            let bandwidth = if kernel == "gaussian" { bandwidth } else { 3.0 * bandwidth };
            let way = (kernel, normalisation, integration);
            let plan = parcels(sides, (n, bandwidth), way, (walks, 1 + idx % 2));
            let with = |threads: usize, is_narrow: bool, most_pair_bytes: Option<usize>| {
                let settings =
                    Settings { threads: Some(threads), is_narrow, most_pair_bytes, ..Settings::default() };
                bits(&plan, &settings)
            };
            let without = with(1, false, Some(0));
            for (room, (threads, is_narrow)) in ROOMS.into_iter().zip([(2, true), (7, false), (2, false)]) {
                assert!(
                    with(threads, is_narrow, room) == without,
                    "{sides:?} {way:?}, walks: {walks}, {room:?} bytes, {threads} threads, narrow: {is_narrow}"
                );
            }
        }
    }
}

#[test]
fn explicit_steps_have_the_bits_that_they_have_without_notes() {
    for normalisation in [Normalisation::Arithmetic, Normalisation::Geometric, Normalisation::Sinkhorn] {
        compare(normalisation, Integration::Explicit);
    }
}

#[test]
fn implicit_and_exponential_steps_have_the_bits_that_they_have_without_notes() {
    compare(Normalisation::Arithmetic, Integration::Implicit);
    compare(Normalisation::Geometric, Integration::Exponential);
    compare(Normalisation::Sinkhorn, Integration::Implicit);
}

/// Parcels far beyond an open side exchange with images of each other, too: nothing is lost there.
#[test]
fn parcels_beyond_an_open_side_lose_nothing() {
    let way = ("wendland_c2", Normalisation::Arithmetic, Integration::Implicit);
    let mut plan = parcels(&[Side::Reflect, Side::Open], (1500, 0.9), way, (true, 1));
    plan.walk = support::walk(2, 2.0);
    let (outcome, _) = support::run_with(&plan, &Settings::default()).unwrap();
    assert!(outcome.mass_defect[0] < 1e-12, "{:?}", outcome.mass_defect);
}
