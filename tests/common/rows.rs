//! Outputs in rows beside those of the plan made up by hand.

use lamella::engine::snapshot::{Row, Snapshot, Values};
use lamella::plan::{Output, OutputKind, Plan, Quantity, Station};

/// Outputs in rows beside the others: at a plane and in a box, of a species in mol and of one in kg.
pub fn with_rows(mut plan: Plan) -> Plan {
    let output = |kind, bins: Vec<usize>, station| Output {
        kind,
        quantities: vec![Quantity::Species(0), Quantity::Species(2)],
        bins,
        times: vec![0.0, 20.0],
        unit: None,
        station,
    };
    let plane = Some(Station::Plane { axis: 0, at: 0.05 });
    let inside = Some(Station::Box { low: vec![-0.01; 2], high: vec![0.01, 0.005] });
    plan.outputs.extend([
        output(OutputKind::Breakthrough, vec![], plane.clone()),
        output(OutputKind::Breakthrough, vec![], inside),
        output(OutputKind::FirstPassage, vec![], plane),
        output(OutputKind::Moments, vec![], None),
        output(OutputKind::Dilution, vec![4, 2], None),
        output(OutputKind::Budget, vec![], None),
    ]);
    plan
}

/// Numbers that rise from row to row, some of them unknown.
pub fn with_snapshots_of_rows() -> Vec<Snapshot> {
    let mut snapshots = crate::common::snapshots();
    let kinds = crate::common::plan().outputs.len()..;
    for (output_idx, output) in
        kinds.zip(&with_rows(crate::common::plan()).outputs[crate::common::plan().outputs.len()..])
    {
        let n_rows = if output.kind == OutputKind::Budget { 7 } else { 1 };
        let row = |place: usize, t: f64| Row {
            place: place as u16,
            numbers: (0..output.kind.numbers().len())
                .map(|idx| if idx == 1 && t == 0.0 { f64::NAN } else { (10 * place + idx) as f64 + t })
                .collect(),
        };
        for t in [0.0, 20.0] {
            let rows: Vec<Row> = (0..n_rows).map(|place| row(place, t)).collect();
            snapshots.push(Snapshot { output_idx, t, values: Values::Rows(vec![rows.clone(), rows]) });
        }
    }
    snapshots
}
