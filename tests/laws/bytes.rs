//! The same bytes: for any number of threads, wide or narrow code, fused or separate passes, with or
//! without other outputs.

use crate::support::*;
use lamella::engine::Settings;
use lamella::engine::snapshot::Snapshot;
use lamella::plan::*;

/// Bit-faithful text (the shortest digits that give the number back).
fn text(snapshots: &[Snapshot]) -> String {
    format!("{snapshots:?}")
}

/// Four blocks in one axis, with outputs on and between steps.
fn line() -> Plan {
    let mut plan = front(30_000, 40, 31.0, 2.0);
    let times = vec![0.0, 3.7, 10.0, 31.0];
    plan.outputs = front_outputs(30, times.clone(), times.clone());
    plan.outputs.push(all_particles(&plan, vec![3.7, 10.0]));
    plan
}

/// Two axes, two components, open and periodic sides, three zones.
fn sheet() -> Plan {
    let mut plan = line();
    plan.axes = vec![axis(0, -0.01, 0.01, Side::Open, 8), axis(1, 0.0, 0.02, Side::Periodic, 6)];
    plan.axes[0].high_side = Side::Reflect;
    plan.walk = Walk { drift: vec![1e-5, -2e-5], spread: vec![5e-4, 1e-4, 3e-4], normals: Normals::Single };
    plan.components.push(Component { name: "C".to_owned(), initial: constant(0.25), is_immobile: false });
    plan.species.push(species("C", 0.0, vec![(1, 1.0), (0, 0.5)]));
    plan.mixing.as_mut().unwrap().zones =
        vec![zone("slow", 0.25, ZoneRate::Finite(0.01)), zone("fast", 0.5, ZoneRate::Instant)];
    plan.mixing.as_mut().unwrap().zones.push(zone("slower", 0.25, ZoneRate::Finite(0.03)));
    let pairs = vec![Quantity::Pair(0, 3), Quantity::Pair(3, 3)];
    plan.outputs = vec![
        output(
            OutputKind::Map,
            vec![Quantity::Species(0), Quantity::Species(3)],
            vec![5, 4],
            vec![7.0, 31.0],
        ),
        output(OutputKind::Covariance, pairs.clone(), vec![5, 1], vec![7.0, 31.0]),
        output(OutputKind::Mixing, pairs, vec![8, 6], vec![7.0, 31.0]),
        output(OutputKind::Total, vec![Quantity::Species(2)], vec![], vec![7.0, 30.0]),
    ];
    plan
}

#[test]
fn threads_and_width_change_nothing() {
    for plan in [line(), sheet()] {
        let with = |threads, is_narrow| {
            let settings = Settings { threads: Some(threads), is_narrow, ..Settings::default() };
            text(&run_with(&plan, &settings).unwrap().1)
        };
        let reference = with(1, false);
        for (threads, is_narrow) in [(2, false), (7, false), (1, true), (2, true)] {
            assert!(with(threads, is_narrow) == reference, "{threads} threads, narrow {is_narrow}");
        }
    }
}

#[test]
fn separate_passes_give_the_bytes_of_the_fused_step() {
    for mut plan in [line(), sheet()] {
        let fused = text(&run(&plan).1);
        plan.stages = vec![Stage::Move, Stage::Bound, Stage::Average, Stage::Mix, Stage::Observe];
        assert!(text(&run(&plan).1) == fused);
    }
}

#[test]
fn a_stored_instant_zone_changes_nothing() {
    for mut plan in [line(), sheet()] {
        let dropped = text(&run(&plan).1);
        for zone in &mut plan.mixing.as_mut().unwrap().zones {
            zone.is_stored = true;
        }
        assert!(text(&run(&plan).1) == dropped);
    }
    let mut plan = line();
    let zones = vec![zone("fast", 0.4, ZoneRate::Instant), zone("other", 0.6, ZoneRate::Instant)];
    plan.mixing = Some(Mixing { zones, is_well_mixed: true, averaging: None });
    let dropped = text(&run(&plan).1);
    plan.mixing.as_mut().unwrap().zones[1].is_stored = true;
    assert!(text(&run(&plan).1) == dropped);
}

/// One output less, or times between steps more: the others keep every byte.
#[test]
fn outputs_do_not_disturb_each_other() {
    for plan in [line(), sheet()] {
        let all = run(&plan).1;
        for output_idx in 0..plan.outputs.len() {
            let mut alone = plan.clone();
            alone.outputs = vec![plan.outputs[output_idx].clone()];
            let mut expected: Vec<Snapshot> =
                all.iter().filter(|snapshot| snapshot.output_idx == output_idx).cloned().collect();
            expected.iter_mut().for_each(|snapshot| snapshot.output_idx = 0);
            assert!(text(&run(&alone).1) == text(&expected), "output {output_idx}");
        }
    }
}
