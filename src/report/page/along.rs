//! A measure of the points of some series along an axis.
//!
//! Owns which points log axes can show, and the table of all. May use `study`, `stats`, `series`. It deliberately draws
//! nothing.

use super::csv::{Csv, number};
use super::series::Series;
use super::stats::Moments;
use super::study::{PointSummary, Study};

/// Value of the axis and measure of the points that log axes can show.
pub fn places<'a>(
    group: &'a Series,
    axis: usize,
    column: usize,
) -> impl Iterator<Item = (f64, Moments)> + 'a {
    let place = move |point: &PointSummary| {
        let x = point.axes.get(axis).copied().flatten()?;
        let moments = *point.values.get(column)?;
        (x > 0.0 && moments.mean > 0.0).then_some((x, moments))
    };
    group.points.iter().filter_map(move |(_, point)| place(point))
}

/// A row for each point of the series, with all digits.
pub fn points_csv(study: &Study, measure: &str, column: usize, groups: &[Series]) -> String {
    let mut heads: Vec<String> = vec!["point".to_owned()];
    heads.extend(study.axes.iter().map(|axis| axis.name.clone()));
    let endings = ["n", "mean", "standard_deviation", "standard_error"];
    heads.extend(endings.map(|ending| format!("{measure}.{ending}")));
    let mut csv = Csv::new(&heads);
    for (point_number, point) in groups.iter().flat_map(|group| &group.points) {
        let moments = &point.values[column];
        let mut cells = vec![point_number.to_string()];
        cells.extend(point.axes.iter().map(|value| number(*value)));
        cells.push(moments.n.to_string());
        cells.extend([moments.mean(), moments.deviation(), moments.standard_error()].map(number));
        csv.row(cells);
    }
    csv.text
}
