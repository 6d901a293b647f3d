//! Numbers of a run without a sweep: its measures, and its errors against references.
//!
//! Owns two tables. May use `study` and `table::scan`. It deliberately shows errors over all times of
//! an output only; the table has them one by one.

use super::html::{paragraph, table};
use super::quantity::{digits, with_unit};
use super::study::Study;
use crate::table::scan::{Selection, parts, scan};
use crate::table::{Kind, TableError};
use std::path::Path;

const MOST_ROWS: usize = 60;

/// Measures of the scene; absent if it has none.
pub fn measures(study: &Study) -> Option<String> {
    let is_measure = |name: &str| !name.contains('.') && name != "wall" && name != "cpu";
    let mut rows = Vec::new();
    for (idx, head) in study.columns.iter().enumerate().filter(|(_, head)| is_measure(&head.name)) {
        for point in study.points.values().filter(|point| point.n_done > 0) {
            let value = point.values[idx].mean().map(|value| with_unit(value, &head.unit));
            rows.push(vec![head.name.clone(), value.unwrap_or_else(|| "not defined".to_owned())]);
        }
    }
    (!rows.is_empty()).then(|| table(&["measure", "value"], &rows))
}

/// Errors against references; absent if there are none.
pub fn errors(folder: &Path) -> Result<Option<String>, TableError> {
    const NUMBERS: [&str; 6] = ["t", "l1", "l2", "linf", "rmse", "relative_l2"];
    const WORDS: [&str; 5] = ["reference", "kind", "species_a", "species_b", "unit"];
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut n_more = 0;
    for part in parts(folder, Kind::Errors) {
        let selection = Selection { numbers: &NUMBERS, words: &WORDS, points: None };
        scan(&part, selection, |row| {
            if row.number(0).is_some() {
                return;
            }
            if rows.len() == MOST_ROWS {
                n_more += 1;
                return;
            }
            let word = |idx: usize| row.word(idx).unwrap_or_default();
            let number =
                |idx: usize| row.number(idx).map_or_else(|| "–".to_owned(), |value| digits(value, 3));
            let second = row.word(3).map(|second| format!(", {second}")).unwrap_or_default();
            let unit = super::super::display::raised(&word(4));
            rows.push(vec![
                word(0).into_owned(),
                format!("{} {}{second}", word(1), word(2)),
                number(5),
                number(2),
                number(1),
                number(3),
                number(4),
                unit,
            ]);
        })?;
    }
    if rows.is_empty() {
        return Ok(None);
    }
    let heads = ["reference", "of", "relative L2", "L2 *", "L1 *", "L∞", "RMSE", "unit"];
    let mut html = table(&heads, &rows)
        + &paragraph(
            "Over all times of the output. * An integral: its unit has the axes in it, see columns.parquet.",
        );
    if n_more > 0 {
        html += &paragraph(&format!("{n_more} more rows stand in errors/."));
    }
    Ok(Some(html))
}
