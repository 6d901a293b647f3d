//! Errors against references, in the shapes of the tables.
//!
//! Owns the names of error columns. May use `measure` and `table`. It deliberately computes no norm.

use crate::measure;
use crate::plan::{OutputKind, Plan, Quantity};
use crate::table::{ErrorRow, Kind, Norms, Value, integrated, si_text, value_dimension};
use crate::units::Dimension;

/// Rows of the errors table for point 0, replicate 0.
pub fn error_rows(plan: &Plan, n_axes: usize, rows: &[measure::ErrorRow]) -> Vec<ErrorRow> {
    rows.iter().map(|row| error_row(plan, n_axes, row)).collect()
}

fn error_row(plan: &Plan, n_axes: usize, row: &measure::ErrorRow) -> ErrorRow {
    let (species_a, species_b) = match row.quantity {
        Quantity::Species(s) => (species(plan, s), None),
        Quantity::Pair(a, b) => (species(plan, a), Some(species(plan, b))),
    };
    let relative = row.l2_relative.or(row.l1_relative).or(row.l_inf_relative).map(|_| {
        let or_nan = |value: Option<f64>| value.unwrap_or(f64::NAN);
        Norms {
            l1: or_nan(row.l1_relative),
            l2: or_nan(row.l2_relative),
            linf: or_nan(row.l_inf_relative),
            // All bins of an output are equally large, so that the volume cancels.
            rmse: or_nan(row.l2_relative),
        }
    });
    ErrorRow {
        point: 0,
        replicate: 0,
        t: row.t,
        reference: row.reference.clone(),
        output: row.output_idx as u16,
        kind: Kind::from(row.kind).name().to_owned(),
        species_a,
        species_b,
        n: row.n_bins,
        n_empty: row.n_empty,
        norms: Norms { l1: row.l1, l2: row.l2, linf: row.l_inf, rmse: row.rmse },
        relative,
        noise: row.noise,
        unit: si_text(dimension(plan, row, n_axes)),
    }
}

/// Columns of `points.parquet`: `REFERENCE.KIND.SPECIES.NORM` over all times, for each reference.
///
/// Where two outputs would share the name, the number of the output stands between.
pub fn error_values(plan: &Plan, n_axes: usize, rows: &[measure::ErrorRow]) -> Vec<Value> {
    let over_all_times: Vec<_> = rows.iter().filter(|row| row.t.is_none()).collect();
    let mut values = Vec::new();
    for row in &over_all_times {
        let stem = stem(plan, row);
        let has_twin = over_all_times
            .iter()
            .any(|other| other.output_idx != row.output_idx && self::stem(plan, other) == stem);
        let stem = if has_twin { format!("{stem}.{}", row.output_idx) } else { stem };
        let field = dimension(plan, row, n_axes);
        let integral = |root| integrated(plan, row.kind, field, root);
        let norms = [
            ("l1", Some(row.l1), integral(1)),
            ("l2", Some(row.l2), integral(2)),
            ("linf", Some(row.l_inf), field),
            ("rmse", Some(row.rmse), field),
            ("l1_relative", row.l1_relative, Dimension::NONE),
            ("l2_relative", row.l2_relative, Dimension::NONE),
            ("linf_relative", row.l_inf_relative, Dimension::NONE),
        ];
        values.extend(norms.map(|(norm, value, dimension)| Value {
            name: format!("{stem}.{norm}"),
            unit: si_text(dimension),
            value,
        }));
    }
    values
}

fn stem(plan: &Plan, row: &measure::ErrorRow) -> String {
    let quantity = match row.quantity {
        Quantity::Species(s) => species(plan, s),
        Quantity::Pair(a, b) => format!("{}_{}", species(plan, a), species(plan, b)),
    };
    format!("{}.{}.{quantity}", row.reference, Kind::from(row.kind).name())
}

fn species(plan: &Plan, idx: usize) -> String {
    plan.species.get(idx).map_or_else(String::new, |species| species.name.clone())
}

/// Of the compared field; for mixing that is γ.
fn dimension(plan: &Plan, row: &measure::ErrorRow, n_axes: usize) -> Dimension {
    match row.kind {
        OutputKind::Mixing => Dimension::NONE,
        kind => value_dimension(plan, kind, row.quantity, n_axes),
    }
}
