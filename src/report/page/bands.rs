//! Profiles, covariances, totals and mixing of a few points, with bands over the replicates.
//!
//! Owns which points are shown and how. May use `courses`, `study`, `series`. It deliberately draws
//! means and deviations only.

use super::super::canvas::Pattern;
use super::super::color::{FAINT, Rgb, SERIES};
use super::super::figure::sheet;
use super::super::panel::{KeyEntry, Look, Mark, Panel};
use super::super::scale::{Scale, Spacing};
use super::courses::{self, Course};
use super::csv::{Csv, number};
use super::html::{escape, figure, paragraph};
use super::quantity::{label, shown, with_unit};
use super::series::full_name;
use super::study::Study;
use crate::table::{Kind, TableError};
use std::path::Path;

/// Points that are shown, evenly spread over the sweep.
const MOST_POINTS: usize = 4;
/// Times of a profile where only one point is shown.
const MOST_TIMES: usize = 4;
/// Panels of one kind of table.
const MOST_PANELS: usize = 9;
/// Places of a curve that are drawn.
const MOST_PLACES: usize = 300;

/// Tables with curves, over a place or over time.
const KINDS: [Kind; 9] = [
    Kind::Profile,
    Kind::Covariance,
    Kind::Total,
    Kind::Mixing,
    Kind::Breakthrough,
    Kind::FirstPassage,
    Kind::Moments,
    Kind::Dilution,
    Kind::Kernels,
];

const PATTERNS: [Pattern; 4] = [&[], &[6.0, 2.5], &[2.0, 2.0], &[8.0, 2.5, 2.0, 2.5]];

/// The body of a section for each kind that is there, and their tables.
pub fn bands(folder: &Path, study: &Study) -> Result<(String, Vec<(String, String)>), TableError> {
    let done: Vec<u32> =
        study.points.iter().filter(|(_, point)| point.n_done > 0).map(|(number, _)| *number).collect();
    let points = spread(&done, MOST_POINTS);
    let most_times = if points.len() > 1 { 1 } else { MOST_TIMES };
    let (mut body, mut files) = (String::new(), Vec::new());
    for kind in KINDS {
        let courses = courses::read(folder, kind, &points, most_times)?;
        if courses.is_empty() {
            continue;
        }
        let story = Story { study, kind, points: &points, courses: &courses };
        body += &story.html();
        files.push((format!("{}.csv", kind.name()), story.csv()));
    }
    Ok((body, files))
}

/// At most `n` of the values, evenly spread, the first and the last among them.
fn spread(values: &[u32], n: usize) -> Vec<u32> {
    match values.len() {
        len if len <= n => values.to_vec(),
        len => (0..n).map(|k| values[k * (len - 1) / (n - 1)]).collect(),
    }
}

struct Story<'a> {
    study: &'a Study,
    kind: Kind,
    points: &'a [u32],
    courses: &'a [Course],
}

impl Story<'_> {
    fn html(&self) -> String {
        let mut panels: Vec<Vec<&Course>> = Vec::new();
        for course in self.courses {
            let is_mine = |panel: &&mut Vec<&Course>| {
                let first = panel[0];
                (first.output, &first.name, first.number) == (course.output, &course.name, course.number)
            };
            match panels.iter_mut().find(is_mine) {
                Some(panel) => panel.push(course),
                None => panels.push(vec![course]),
            }
        }
        let n_left_out = panels.len().saturating_sub(MOST_PANELS);
        panels.truncate(MOST_PANELS);
        let n_columns = panels.len().min(3);
        let drawn: Vec<Panel> = panels.iter().map(|courses| self.panel(courses)).collect();
        let size = if n_columns == 1 { (700.0, 360.0) } else { (360.0, 280.0) };
        let svg = sheet(None, self.key(), &drawn, size, n_columns.max(1));
        let mut html = format!("<h3>{}</h3>\n", heading(self.kind)) + &figure(&svg, &self.caption());
        if n_left_out > 0 {
            html += &paragraph(&format!("{n_left_out} more panels stand in the CSV file only."));
        }
        html
    }

    fn caption(&self) -> String {
        let n = self.courses.iter().map(Course::most_replicates).max().unwrap_or(0);
        let bands = if n > 1 {
            format!("Lines are means over up to {n} replicates, bands ± their standard deviation.")
        } else {
            "One replicate: there are no bands.".to_owned()
        };
        let n_all = self.study.points.values().filter(|point| point.n_done > 0).count();
        let choice = match (self.points.len(), self.courses.first().and_then(|course| course.t)) {
            (1, Some(_)) if self.times().len() == MOST_TIMES => {
                format!("At most {MOST_TIMES} times are shown.")
            }
            (1, Some(_)) => String::new(),
            (1, None) => String::new(),
            (shown, Some(_)) => format!("{shown} of {n_all} points, each at its last time."),
            (shown, None) => format!("{shown} of {n_all} points."),
        };
        format!("{bands} {choice}").trim_end().to_owned()
    }

    /// Which colour a course has: by point, or by time if there is one point.
    fn place(&self, course: &Course) -> usize {
        if self.points.len() > 1 {
            return self.points.iter().position(|point| *point == course.point).unwrap_or(0);
        }
        self.times().iter().position(|t| Some(*t) == course.t).unwrap_or(0)
    }

    fn times(&self) -> Vec<f64> {
        let mut times: Vec<f64> = self.courses.iter().filter_map(|course| course.t).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    fn key(&self) -> Vec<KeyEntry> {
        let entry = |(idx, text)| KeyEntry { text, color: color(idx), look: Look::Line(pattern(idx)) };
        let point_name = |number: &u32| {
            let point = self.study.points.get(number);
            let values = point.map(|point| full_name(self.study, point)).unwrap_or_default();
            if values.is_empty() { format!("point {number}") } else { values }
        };
        let texts: Vec<String> = if self.points.len() > 1 {
            self.points.iter().map(point_name).collect()
        } else {
            self.times().iter().map(|t| with_unit(*t, "s")).collect()
        };
        let mut key: Vec<KeyEntry> = texts.into_iter().enumerate().map(entry).collect();
        if self.courses.iter().any(|course| course.most_replicates() > 1) {
            let text = "± standard deviation".to_owned();
            key.push(KeyEntry { text, color: FAINT, look: Look::Band });
        }
        key
    }

    fn panel(&self, courses: &[&Course]) -> Panel {
        let places = || courses.iter().flat_map(|course| course.places());
        let largest_x = places().map(|(x, _)| x.abs()).fold(0.0, f64::max);
        let largest_y = places().map(|(_, y)| y.mean.abs()).fold(0.0, f64::max);
        let is_over_time = courses[0].t.is_none();
        let x = shown(if is_over_time { "s" } else { "m" }, largest_x);
        let y = shown(&courses[0].unit, largest_y);
        let mut marks = Vec::new();
        for course in courses {
            marks.extend(course_marks(course, self.place(course), (x.factor, y.factor)));
        }
        // γ falls over orders of magnitude; on linear axes its course would be a corner.
        let spacing = |values: &[f64]| match self.kind {
            Kind::Mixing if is_wide(values) => Spacing::Log,
            _ => Spacing::Linear,
        };
        let xs: Vec<f64> = marks.iter().flat_map(|mark| &mark.points).map(|point| point.0).collect();
        let ys: Vec<f64> = marks.iter().flat_map(|mark| &mark.points).map(|point| point.1).collect();
        let name = &courses[0].name;
        let x_name = if is_over_time { "time" } else { ["x", "y", "z"][courses[0].axis] };
        let (title, what) = match self.kind {
            Kind::Covariance => (format!("cov({name})"), "covariance"),
            Kind::Mixing => (format!("γ({name})"), "γ"),
            Kind::Total => (format!("total {name}"), "amount"),
            Kind::Moments => moment_name(courses[0]),
            Kind::FirstPassage => (format!("first passage of {name}{}", courses[0].station), "amount"),
            Kind::Dilution => (format!("dilution of {name}"), "dilution index"),
            Kind::Kernels => kernel_name(courses[0]),
            _ => (format!("{name}{}", courses[0].station), "concentration"),
        };
        Panel {
            title,
            x_label: label(x_name, &x),
            y_label: label(what, &y),
            x: if is_over_time { Scale::covering(xs.iter().copied(), spacing(&xs)) } else { tight(&xs) },
            y: Scale::covering(ys.iter().copied(), spacing(&ys)),
            marks,
            heat: None,
            key: Vec::new(),
            notes: Vec::new(),
        }
    }

    fn csv(&self) -> String {
        let over = if self.courses.first().is_some_and(|course| course.t.is_none()) { "t" } else { "place" };
        let mut csv = Csv::new(&[
            "point",
            "output",
            "species",
            "number",
            "time",
            over,
            "n",
            "mean",
            "standard_deviation",
            "standard_error",
            "unit",
        ]);
        for course in self.courses {
            for (place, moments) in course.places() {
                csv.row(vec![
                    course.point.to_string(),
                    course.output.to_string(),
                    course.name.clone(),
                    course.number.to_owned(),
                    number(course.t),
                    number(Some(*place)),
                    moments.n.to_string(),
                    number(moments.mean()),
                    number(moments.deviation()),
                    number(moments.standard_error()),
                    course.unit.clone(),
                ]);
            }
        }
        csv.text
    }
}

/// The title of a moment, and what it is.
fn moment_name(course: &Course) -> (String, &'static str) {
    let axis = course.number.chars().last().unwrap_or('x');
    match course.number.starts_with("mean") {
        true => (format!("centre of {} along {axis}", course.name), "centre"),
        false => (format!("variance of {} along {axis}", course.name), "variance"),
    }
}

/// The title of a size of kernels, and what it is.
fn kernel_name(course: &Course) -> (String, &'static str) {
    let name = &course.name;
    match course.number {
        "narrow" => (format!("kernels of {name}: a twentieth is narrower"), "bandwidth"),
        "wide" => (format!("kernels of {name}: a twentieth is wider"), "bandwidth"),
        "stretch" => (format!("kernels of {name}: longest over shortest"), "stretch"),
        _ => (format!("kernels of {name}: median"), "bandwidth"),
    }
}

fn heading(kind: Kind) -> String {
    let text = match kind {
        Kind::Profile => "Profiles",
        Kind::Covariance => "Covariances",
        Kind::Total => "Totals",
        Kind::Mixing => "Mixing",
        Kind::Breakthrough => "Breakthrough",
        Kind::FirstPassage => "First passage",
        Kind::Moments => "Moments",
        Kind::Dilution => "Dilution",
        Kind::Kernels => "Kernels",
        other => other.name(),
    };
    escape(text)
}

fn color(idx: usize) -> Rgb {
    SERIES[idx % SERIES.len()]
}

fn pattern(idx: usize) -> Pattern {
    PATTERNS[idx % PATTERNS.len()]
}

/// The band, then the mean on it, thinned; values in the units of the axes.
fn course_marks(course: &Course, idx: usize, factors: (f64, f64)) -> Vec<Mark> {
    let all: Vec<_> = course.places().filter(|(_, moments)| moments.n > 0).collect();
    let every = all.len().div_ceil(MOST_PLACES).max(1);
    let kept: Vec<_> = all.iter().step_by(every).collect();
    let at = |x: f64, y: f64| (x / factors.0, y / factors.1);
    let side = |sign: f64| -> Vec<(f64, f64)> {
        let spread = kept.iter().filter_map(|(x, moments)| Some((*x, moments.mean, moments.deviation()?)));
        spread.map(|(x, mean, deviation)| at(x, mean + sign * deviation)).collect()
    };
    let mut outline = side(1.0);
    outline.extend(side(-1.0).into_iter().rev());
    let mean = kept.iter().map(|(x, moments)| at(*x, moments.mean)).collect();
    let line = Mark { points: mean, color: color(idx), look: Look::Line(pattern(idx)) };
    let band = Mark { points: outline, color: color(idx), look: Look::Band };
    if band.points.is_empty() { vec![line] } else { vec![band, line] }
}

/// From end to end, without a margin.
fn tight(values: &[f64]) -> Scale {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if low < high {
        Scale { low, high, spacing: Spacing::Linear }
    } else {
        Scale::covering(values.iter().copied(), Spacing::Linear)
    }
}

/// Positive values over more than a decade and a half.
fn is_wide(values: &[f64]) -> bool {
    let present = || values.iter().copied().filter(|value| value.is_finite() && *value != 0.0);
    let (low, high) = (present().fold(f64::INFINITY, f64::min), present().fold(0.0, f64::max));
    low > 0.0 && high > 30.0 * low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shown_points_reach_from_end_to_end() {
        let all: Vec<u32> = (0..100).collect();
        assert_eq!(spread(&all, 4), [0, 33, 66, 99]);
        assert_eq!(spread(&[3, 5], 4), [3, 5]);
    }
}
