//! The scenes of `experiments/modflow6_import`: a flow that MODFLOW 6 wrote, against the same flow solved for.

use lamella::Checked;
use lamella::data::DataFile;
use lamella::engine::snapshot::{Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::flow::FaceFlow;
use lamella::plan::{OutputKind, Plan};
use lamella::scenario::{Settings, wanted_data};
use lamella::source::Sources;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/modflow6_import")
}

fn check(scene: &str) -> Checked {
    let text = std::fs::read_to_string(folder().join(scene)).unwrap();
    let mut sources = Sources::single(scene, text);
    for name in wanted_data(&sources) {
        let bytes = std::fs::read(folder().join(&name)).unwrap();
        sources.add_data(Arc::new(DataFile::new(name, bytes)));
    }
    lamella::check(sources, &Settings::default(), &Default::default())
}

/// The plan of a scene and its flow.
fn flow(checked: &Checked) -> (Plan, Arc<FaceFlow>) {
    let compiled = checked.compiled.clone();
    let plan = compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics)).plan;
    let flow = checked.flows.of(&plan, &checked.sources).unwrap().unwrap();
    (plan, flow.flow(0).clone())
}

/// What has left through a place by each time, kg/m.
fn left(plan: &Plan, flow: Arc<FaceFlow>, place: &str) -> Vec<f64> {
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let settings =
        EngineSettings { flow: Some(lamella::flow::FlowSeries::steady(flow)), ..EngineSettings::default() };
    let outcome = lamella::engine::run(plan, &settings, &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    });
    let worst = outcome.expect("the scene runs").worst_defect();
    assert!(worst < 1e-12, "mass in = inside + out to {worst:e}");
    let mut found = Vec::new();
    for snapshot in snapshots {
        let output = &plan.outputs[snapshot.output_idx];
        if let (OutputKind::Budget, Values::Rows(rows)) = (output.kind, &snapshot.values) {
            let places = plan.places(output);
            let row = rows[0].iter().find(|row| places[usize::from(row.place)] == place).unwrap();
            found.push(row.numbers[2]);
        }
    }
    found
}

#[test]
fn a_plume_in_a_flow_of_modflow_is_that_in_the_same_flow() {
    let (read, solved) = (check("plume.lam"), check("darcy.lam"));
    assert!(read.diagnostics.is_empty(), "{:#?}", read.diagnostics);
    let ((read_plan, read), (solved_plan, solved)) = (flow(&read), flow(&solved));
    assert_eq!((&read.cells, &read.porosity), (&solved.cells, &solved.porosity));
    for axis in 0..2 {
        let largest = solved.flux[axis].iter().fold(0.0, |a: f64, q| a.max(q.abs()));
        for (read, solved) in read.flux[axis].iter().zip(&solved.flux[axis]) {
            assert!((read - solved).abs() < 1e-9 * largest, "axis {axis}: {read}, {solved}");
        }
    }
    let pump = left(&read_plan, read, "PUMP");
    // 4.8 m²/d of 1 g/m³ over 1000 d; four times the noise of some 1600 particles, which is 2.5 %.
    let taken = pump[1] - pump[0];
    assert!((taken - 4.8).abs() < 0.1 * 4.8, "{taken} kg/m");
    // If all paths parted, the difference of 5600 particles of 20 000 would have a deviation of 90, or 1.6 %.
    let same = left(&solved_plan, solved, "PUMP");
    assert!((pump[1] - same[1]).abs() < 0.04 * same[1], "{pump:?}, {same:?}");
}
