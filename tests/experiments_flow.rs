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

/// One record of the budget file of the valley with another end of its time step, all flows times a factor.
fn again(record: &[u8], step: i32, end: f64, factor: f64) -> Vec<u8> {
    const HEADER: usize = 64;
    let mut bytes = record.to_vec();
    bytes[..4].copy_from_slice(&step.to_le_bytes());
    bytes[HEADER - 16..HEADER - 8].copy_from_slice(&end.to_le_bytes());
    bytes[HEADER - 8..HEADER].copy_from_slice(&end.to_le_bytes());
    let is_list = record[36] == 6;
    // Lists have four names and two counts before their rows, and two numbers of cells before each flow.
    let (first, stride, skipped) = if is_list { (HEADER + 64 + 8, 16, 8) } else { (HEADER, 8, 0) };
    for row in bytes[first..].chunks_exact_mut(stride) {
        let value: [u8; 8] = row[skipped..].try_into().unwrap();
        row[skipped..].copy_from_slice(&(factor * f64::from_le_bytes(value)).to_le_bytes());
    }
    bytes
}

/// The records of the budget file of the valley: the flow between cells, three lists.
fn records(bytes: &[u8]) -> Vec<&[u8]> {
    let starts: Vec<usize> = ["FLOW-JA-FACE", "GHB", "GHB", "WEL"]
        .iter()
        .scan(0, |from, kind| {
            let text = format!("{kind:>16}");
            let at = bytes[*from..].windows(16).position(|window| window == text.as_bytes())? + *from;
            *from = at + 16;
            Some(at - 8)
        })
        .collect();
    assert_eq!((starts.len(), starts[0]), (4, 0));
    let ends = starts[1..].iter().copied().chain([bytes.len()]);
    starts.iter().zip(ends).map(|(&start, end)| &bytes[start..end]).collect()
}

/// Two time steps of ten days, the second with twice the flow of the first.
#[test]
fn time_steps_of_a_budget_are_flows_one_after_another() {
    let one = std::fs::read(folder().join("valley.bud")).unwrap();
    let both = [(1, 10.0, 1.0), (2, 20.0, 2.0)];
    let budget: Vec<u8> = both
        .iter()
        .flat_map(|&(step, end, factor)| {
            records(&one).into_iter().flat_map(move |record| again(record, step, end, factor))
        })
        .collect();
    let text = std::fs::read_to_string(folder().join("plume.lam")).unwrap();
    let text = text.replace("4000 d", "20 d").replace("3000 d", "10 d").replace("500 d", "10 d");
    let mut sources = Sources::single("plume.lam", text);
    let grid = std::fs::read(folder().join("valley.dis.grb")).unwrap();
    for (name, bytes) in [("valley.bud", budget), ("valley.dis.grb", grid)] {
        sources.add_data(Arc::new(DataFile::new(name.to_owned(), bytes)));
    }
    let checked = lamella::check(sources, &Settings::default(), &Default::default());
    let (plan, first) = flow(&checked);
    let flows = checked.flows.of(&plan, &checked.sources).unwrap().unwrap();
    assert_eq!(flows.changes(), [10.0 * 86_400.0]);
    assert_eq!(plan.transport.as_ref().unwrap().outlets().len(), 1);
    for axis in 0..2 {
        let pairs = first.flux[axis].iter().zip(&flows.flow(1).flux[axis]);
        assert!(pairs.into_iter().all(|(one, two)| *two == 2.0 * one));
    }
    // Water that enters on the left, m²/s.
    let inflow: f64 = (0..16).map(|row| first.flux[0][row] * 10.0).sum();
    let mut entered = Vec::new();
    let settings = EngineSettings { flow: Some(flows), ..EngineSettings::default() };
    let outcome = lamella::engine::run(&plan, &settings, &Unattended, &mut |snapshot| {
        let output = &plan.outputs[snapshot.output_idx];
        if let (OutputKind::Budget, Values::Rows(rows)) = (output.kind, &snapshot.values) {
            let places = plan.places(output);
            let row = rows[0].iter().find(|row| places[usize::from(row.place)] == "left").unwrap();
            entered.push(row.numbers[1]);
        }
        Ok(())
    });
    assert!(outcome.unwrap().worst_defect() < 1e-12);
    // 1 g/m³ for ten days, and for ten days of twice the water; at ten days whole particles of 16 parts have come.
    let expected = 1e-3 * inflow * 86_400.0;
    assert!((entered[1] - 30.0 * expected).abs() < 1e-6 * entered[1], "{entered:?}, {expected}");
    assert!((entered[0] - 10.0 * expected).abs() < 0.01 * entered[0], "{entered:?}, {expected}");
}
