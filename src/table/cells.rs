//! The table of a flow: a row for each of its cells.
//!
//! Owns its columns and rows. May use `flow`. It deliberately holds at most one row group at a time.

use super::failure::TableError;
use super::schema::{Column, Measured, coordinates, head};
use super::sheet::{ROW_GROUP, Sheet};
use crate::flow::FaceFlow;
use crate::plan::Plan;
use crate::units::Dimension;
use arrow_array::{ArrayRef, Float64Array, RecordBatch, UInt32Array};
use arrow_schema::{DataType, SchemaRef};
use std::ops::Range;
use std::sync::Arc;

/// The columns, in order.
pub(super) fn columns() -> Vec<Column> {
    let real = |name: &str, dimension: Dimension, doc: &str| {
        Column::new(name, DataType::Float64, Measured::Fixed(dimension), doc).or_null()
    };
    let mut columns = head().to_vec();
    columns[2].doc = "from when this flow holds".to_owned();
    columns.extend(coordinates().map(|column| Column {
        doc: "middle of the cell; null if the domain has no such axis".to_owned(),
        ..column
    }));
    columns.push(real("head", Dimension::LENGTH, "hydraulic head; null where it is not known"));
    columns.push(real(
        "conductivity",
        Dimension::VELOCITY,
        "conductivity along x; null where it is not known",
    ));
    columns.push(real(
        "porosity",
        Dimension::NONE,
        "volume of water per volume of medium; 0 where no water is",
    ));
    columns.extend(["x", "y", "z"].map(|axis| {
        let doc = "water per area of the medium, mean of the two faces of the cell; null if the domain has no such axis";
        real(&format!("discharge_{axis}"), Dimension::VELOCITY, doc)
    }));
    columns
}

/// Appends the rows of a flow, x slowest.
pub(super) fn append(
    sheet: &mut Sheet,
    schema: &SchemaRef,
    plan: &Plan,
    flow: &FaceFlow,
    t: f64,
) -> Result<(), TableError> {
    let n = flow.cells.n_cells();
    for start in (0..n).step_by(ROW_GROUP) {
        let arrays = arrays(plan, flow, t, start..(start + ROW_GROUP).min(n));
        let batch = RecordBatch::try_new(schema.clone(), arrays)
            .map_err(|reason| TableError::Format { file: "flow".into(), reason: reason.to_string() })?;
        sheet.append(&batch)?;
    }
    Ok(())
}

fn arrays(plan: &Plan, flow: &FaceFlow, t: f64, cells: Range<usize>) -> Vec<ArrayRef> {
    let n = cells.len();
    let zeros = || -> ArrayRef { Arc::new(UInt32Array::from(vec![0; n])) };
    let column = |of: &dyn Fn(usize) -> Option<f64>| -> ArrayRef {
        Arc::new(
            cells.clone().map(|cell| of(cell).filter(|value| value.is_finite())).collect::<Float64Array>(),
        )
    };
    let has = |axis: usize| plan.axes.iter().any(|own| own.index == axis);
    let mut arrays = vec![zeros(), zeros(), column(&|_| Some(t))];
    for axis in 0..3 {
        arrays.push(column(&|cell| has(axis).then(|| flow.cells.centre(flow.cells.place(cell))[axis])));
    }
    for values in [&flow.head, &flow.conductivity] {
        arrays.push(column(&|cell| values.as_ref().map(|values| values[cell])));
    }
    arrays.push(column(&|cell| Some(flow.porosity[cell])));
    for axis in 0..3 {
        let mean = |cell: usize| {
            let (low, high) = flow.cells.faces(axis, flow.cells.place(cell));
            0.5 * (flow.flux[axis][low] + flow.flux[axis][high])
        };
        arrays.push(column(&|cell| has(axis).then(|| mean(cell))));
    }
    arrays
}
