//! Centre and spread of a species over time.
//!
//! Owns the panels of moments. May use `panel`, `scale`, `display` and snapshots. It deliberately works out nothing:
//! the numbers stand in the rows.

use super::color::SERIES;
use super::display;
use super::panel::{KeyEntry, Look, Mark, Panel};
use super::scale::{Scale, Spacing};
use crate::engine::snapshot::{Snapshot, Values};

const AXES: [&str; 3] = ["x", "y", "z"];
/// Where the numbers of a row of moments begin.
const CENTRE: usize = 1;
const VARIANCE: usize = 4;
/// More dots of one series hide each other.
const MOST_DOTS: usize = 400;

/// Panels of the centre and of the variances of one species; `time` is the unit of times and its text.
pub fn panels<'a>(
    snapshots: impl Iterator<Item = &'a Snapshot> + Clone,
    q: usize,
    name: &str,
    time: (f64, &str),
) -> Vec<Panel> {
    let centre = panel(series(snapshots.clone(), q, CENTRE), time, |largest| {
        let unit = display::length(largest);
        (unit.factor, "centre", unit.text)
    });
    let variance = panel(series(snapshots, q, VARIANCE), time, |largest| {
        let unit = display::length(largest.sqrt());
        (unit.factor * unit.factor, "variance", format!("{}²", unit.text))
    });
    let titled = |panel: Panel, what: &str| Panel { title: format!("{what} of {name}"), ..panel };
    let centre = centre.map(|panel| titled(panel, "centre"));
    centre.into_iter().chain(variance.map(|panel| titled(panel, "variance"))).collect()
}

/// Per axis that has any, the times and values.
fn series<'a>(
    snapshots: impl Iterator<Item = &'a Snapshot>,
    q: usize,
    first: usize,
) -> Vec<(usize, Vec<(f64, f64)>)> {
    let mut series: Vec<(usize, Vec<(f64, f64)>)> = (0..3).map(|axis| (axis, Vec::new())).collect();
    for snapshot in snapshots {
        let Values::Rows(rows) = &snapshot.values else { continue };
        let Some(row) = rows.get(q).and_then(|rows| rows.first()) else { continue };
        for (axis, points) in &mut series {
            let value = row.numbers.get(first + *axis).copied().filter(|value| value.is_finite());
            points.extend(value.map(|value| (snapshot.t, value)));
        }
    }
    series.retain(|(_, points)| points.len() > 1);
    series
}

fn panel(
    series: Vec<(usize, Vec<(f64, f64)>)>,
    (factor, text): (f64, &str),
    unit: impl Fn(f64) -> (f64, &'static str, String),
) -> Option<Panel> {
    let values = || series.iter().flat_map(|(_, points)| points.iter().map(|point| point.1));
    let largest = values().fold(0.0, |most: f64, value| most.max(value.abs()));
    let (divisor, what, unit) = unit(largest);
    let mark = |(axis, points): &(usize, Vec<(f64, f64)>)| {
        let every = points.len().div_ceil(MOST_DOTS).max(1);
        let points = points.iter().step_by(every).map(|(t, value)| (t / factor, value / divisor));
        Mark { points: points.collect(), color: SERIES[*axis], look: Look::Dots }
    };
    let entry = |(axis, _): &(usize, Vec<(f64, f64)>)| KeyEntry {
        text: format!("along {}", AXES[*axis]),
        color: SERIES[*axis],
        look: Look::Dots,
    };
    let marks: Vec<Mark> = series.iter().map(mark).collect();
    let points = || marks.iter().flat_map(|mark| &mark.points);
    (!marks.is_empty()).then(|| Panel {
        title: String::new(),
        x_label: format!("time ({text})"),
        y_label: format!("{what} ({unit})"),
        x: Scale::covering(points().map(|point| point.0), Spacing::Linear),
        y: Scale::covering(points().map(|point| point.1), Spacing::Linear),
        key: series.iter().map(entry).collect(),
        marks: marks.clone(),
        heat: None,
        notes: Vec::new(),
    })
}
