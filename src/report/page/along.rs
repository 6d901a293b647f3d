//! A measure of the points of some series along an axis.
//!
//! Owns the series along an axis, which points log axes can show, and the table of all. May use `study`, `stats`, `series`.
//! It deliberately draws nothing.

use super::super::sweep::SweepReport;
use super::csv::{Csv, number};
use super::html::paragraph;
use super::series::{self, Series, slug};
use super::stats::Moments;
use super::study::{PointSummary, Study};

/// What was drawn of a measure against one axis.
pub struct Drawn<'a> {
    pub html: String,
    pub groups: Vec<Series<'a>>,
    /// A table besides that of the points: the first word of its name, and its text.
    pub table: (&'static str, String),
}

/// The body of a section and its tables: `draw` is given the column of the measure and each axis that a report is against.
/// Tables of points have names that begin with `kind`.
pub fn against<'a>(
    study: &'a Study,
    report: &SweepReport,
    kind: &str,
    draw: impl Fn(usize, usize) -> Drawn<'a>,
) -> (String, Vec<(String, String)>) {
    let (mut body, mut files) = (String::new(), Vec::new());
    let Some(column) = study.column(&report.measure) else {
        return (paragraph(&format!("points.parquet has no column `{}`.", report.measure)), files);
    };
    for name in &report.against {
        let Some(axis) = study.axis(name) else {
            body += &paragraph(&format!("points.parquet has no column for the axis `{name}`."));
            continue;
        };
        let drawn = draw(column, axis);
        body += &drawn.html;
        let stem = format!("{}-{}", slug(&report.measure), slug(name));
        let points = points_csv(study, &report.measure, column, &drawn.groups);
        files.push((format!("{kind}-{stem}.csv"), points));
        files.push((format!("{}-{stem}.csv", drawn.table.0), drawn.table.1));
    }
    (body, files)
}

/// A series for each combination of all that varies besides the axis, or it would mix points of different physics; each in
/// the order of the axis.
pub fn courses(study: &Study, axis: usize) -> Vec<Series<'_>> {
    let is_other = |idx: &usize| study.axes[*idx].group != study.axes[axis].group;
    let others: Vec<usize> = (0..study.axes.len()).filter(is_other).collect();
    let mut groups = series::series(study, &others);
    let place = |point: &PointSummary| point.axes[axis].unwrap_or(f64::NAN);
    groups.iter_mut().for_each(|group| group.points.sort_by(|a, b| place(a.1).total_cmp(&place(b.1))));
    groups
}

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
fn points_csv(study: &Study, measure: &str, column: usize, groups: &[Series]) -> String {
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
