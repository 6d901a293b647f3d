//! Which panels a run has, and what they show.
//!
//! Owns the choice of times, units and scales. May use `plan`, `engine::snapshot`, `table` and
//! `measure`. It deliberately draws nothing.

use super::color::{BLACK, FAINT, Rgb, SERIES, blend};
use super::display::{self, Shown, plain};
use super::heat::Heat;
use super::moments;
use super::panel::{KeyEntry, Look, Mark, Panel};
use super::scale::{Scale, Spacing};
use crate::engine::snapshot::{Snapshot, Values, counts};
use crate::measure::Curve;
use crate::plan::{Output, OutputKind, Plan, Quantity, Station};
use crate::table::{Grid, value_dimension};
use crate::units::Dimension;

/// More dots of one series hide each other.
const MOST_DOTS: usize = 400;
/// Times of profiles told apart by colour.
const MOST_TIMES: usize = 6;
/// References in the order they are given: whole, dashed, dotted, dash-dotted.
const PATTERNS: [&[f64]; 4] = [&[], &[5.0, 2.5], &[1.5, 2.0], &[7.0, 2.0, 1.5, 2.0]];

/// All that the panels are made of.
pub struct Story<'a> {
    plan: &'a Plan,
    n_axes: usize,
    snapshots: &'a [Snapshot],
    curves: &'a [Curve],
    /// Times of profiles that are shown, s.
    times: Vec<f64>,
    n_times: usize,
    time_unit: Shown,
    references: Vec<&'a str>,
}

impl<'a> Story<'a> {
    pub fn new(plan: &'a Plan, n_axes: usize, snapshots: &'a [Snapshot], curves: &'a [Curve]) -> Self {
        let kind = |snapshot: &Snapshot| plan.outputs.get(snapshot.output_idx).map(|output| output.kind);
        let is_profile = |snapshot: &&Snapshot| {
            matches!(kind(snapshot), Some(OutputKind::Profile | OutputKind::Covariance))
        };
        let mut times: Vec<f64> = snapshots.iter().filter(is_profile).map(|snapshot| snapshot.t).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut references: Vec<&str> = Vec::new();
        for curve in curves {
            if !references.contains(&curve.reference.as_str()) {
                references.push(&curve.reference);
            }
        }
        let latest = snapshots.iter().map(|snapshot| snapshot.t).fold(0.0, f64::max);
        let (n_times, times) = (times.len(), spread(&times, MOST_TIMES));
        Self { plan, n_axes, snapshots, curves, times, n_times, time_unit: display::time(latest), references }
    }

    /// In the order of the plan's outputs; one per species of a profile or map, one per other output.
    pub fn panels(&self) -> Vec<Panel> {
        let mut panels = Vec::new();
        for (output_idx, output) in self.plan.outputs.iter().enumerate() {
            let quantities = || output.quantities.iter().copied().enumerate();
            match output.kind {
                OutputKind::Profile | OutputKind::Covariance => {
                    panels.extend(quantities().filter_map(|(q, _)| self.profile(output_idx, output, q)));
                }
                OutputKind::Map => {
                    panels.extend(quantities().filter_map(|(q, _)| self.map(output_idx, output, q)));
                }
                OutputKind::Budget => {
                    panels.extend(quantities().filter_map(|(q, _)| self.budget(output_idx, output, q)));
                }
                OutputKind::Particles => {}
                OutputKind::Moments if self.curves.iter().all(|curve| curve.output_idx != output_idx) => {
                    let time = (self.time_unit.factor, &self.time_unit.text[..]);
                    panels.extend(quantities().flat_map(|(q, quantity)| {
                        moments::panels(self.of_output(output_idx), q, &self.names(quantity), time)
                    }));
                }
                _ => panels.extend(self.courses(output_idx, output)),
            }
        }
        panels
    }

    /// The key of the whole page: times by colour, the run by dots, references by their lines.
    pub fn key(&self) -> Vec<KeyEntry> {
        let mut key: Vec<KeyEntry> = self
            .times
            .iter()
            .enumerate()
            .map(|(idx, t)| KeyEntry { text: self.time_text(*t), color: time_color(idx), look: Look::Dots })
            .collect();
        if self.n_times > self.times.len() {
            let last = key.last_mut();
            last.into_iter().for_each(|entry| {
                entry.text += &format!(" ({} of {} times)", self.times.len(), self.n_times)
            });
        }
        if !self.references.is_empty() {
            key.push(KeyEntry { text: "this run".to_owned(), color: FAINT, look: Look::Dots });
        }
        let references = self.references.iter().enumerate();
        key.extend(references.map(|(idx, name)| KeyEntry {
            text: (*name).to_owned(),
            color: BLACK,
            look: Look::Line(PATTERNS[idx % PATTERNS.len()]),
        }));
        key
    }

    fn time_text(&self, t: f64) -> String {
        format!("{} {}", plain(t / self.time_unit.factor), self.time_unit.text)
    }

    fn look_of(&self, reference: &str) -> Look {
        let idx = self.references.iter().position(|name| *name == reference).unwrap_or(0);
        Look::Line(PATTERNS[idx % PATTERNS.len()])
    }

    fn of_output(&self, output_idx: usize) -> impl Iterator<Item = &'a Snapshot> + Clone + use<'a> {
        self.snapshots.iter().filter(move |snapshot| snapshot.output_idx == output_idx)
    }

    fn curves_of(&self, output_idx: usize, quantity: Quantity) -> impl Iterator<Item = &'a Curve> + use<'a> {
        let is_mine = move |curve: &&Curve| curve.output_idx == output_idx && curve.quantity == quantity;
        self.curves.iter().filter(is_mine)
    }

    fn names(&self, quantity: Quantity) -> String {
        let name = |idx: usize| self.plan.species.get(idx).map_or("?", |species| species.name.as_str());
        match quantity {
            Quantity::Species(s) => name(s).to_owned(),
            Quantity::Pair(a, b) => format!("{}, {}", name(a), name(b)),
        }
    }

    fn profile(&self, output_idx: usize, output: &Output, q: usize) -> Option<Panel> {
        let quantity = output.quantities[q];
        let grid = Grid::new(self.plan, output);
        let axis = (0..3).max_by_key(|axis| (grid.centres(*axis).map_or(0, <[f64]>::len), 3 - axis))?;
        let centres = grid.centres(axis)?;
        let mut marks = Vec::new();
        for snapshot in self.of_output(output_idx) {
            let Some(color) = self.color_at(snapshot.t) else { continue };
            let points = bin_values(&snapshot.values, self.plan.carries_mass(), q, centres);
            let every = points.len().div_ceil(MOST_DOTS).max(1);
            marks.push(Mark { points: points.into_iter().step_by(every).collect(), color, look: Look::Dots });
        }
        if marks.is_empty() {
            return None;
        }
        for curve in self.curves_of(output_idx, quantity) {
            let Some(color) = curve.t.and_then(|t| self.color_at(t)) else { continue };
            let points = curve.x.iter().copied().zip(curve.y.iter().copied()).collect();
            marks.push(Mark {
                points,
                color: blend(color, BLACK, 0.25),
                look: self.look_of(&curve.reference),
            });
        }
        let ends = self.plan.axes.iter().find(|other| other.index == axis)?;
        let length = display::length(ends.low.abs().max(ends.high.abs()));
        let shown = display::value(self.plan, output, quantity, self.n_axes, largest(&marks));
        rescale(&mut marks, length.factor, shown.factor);
        let what = if output.kind == OutputKind::Covariance { "covariance" } else { "concentration" };
        let title = match output.kind {
            OutputKind::Covariance => format!("cov({})", self.names(quantity)),
            _ => self.names(quantity),
        };
        Some(Panel {
            title,
            x_label: labelled(AXES[axis], &length.text),
            y_label: labelled(what, &shown.text),
            x: Scale {
                low: ends.low / length.factor,
                high: ends.high / length.factor,
                spacing: Spacing::Linear,
            },
            y: Scale::covering(values_of(&marks), Spacing::Linear),
            marks,
            heat: None,
            key: Vec::new(),
            notes: Vec::new(),
        })
    }

    fn color_at(&self, t: f64) -> Option<Rgb> {
        let is_same = |other: &f64| (other - t).abs() <= 1e-9 * t.abs();
        self.times.iter().position(is_same).map(time_color)
    }

    /// Totals or γ over time: a panel for all quantities of one dimension.
    fn courses(&self, output_idx: usize, output: &Output) -> Vec<Panel> {
        let dimension = |q: usize| match output.kind {
            OutputKind::Mixing => Dimension::NONE,
            kind => value_dimension(self.plan, kind, output.quantities[q], self.n_axes),
        };
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for q in 0..output.quantities.len() {
            match groups.iter_mut().find(|group| dimension(group[0]) == dimension(q)) {
                Some(group) => group.push(q),
                None => groups.push(vec![q]),
            }
        }
        groups.iter().filter_map(|group| self.course(output_idx, output, group)).collect()
    }

    fn course(&self, output_idx: usize, output: &Output, group: &[usize]) -> Option<Panel> {
        let (mut marks, key) = self.course_marks(output_idx, output, group);
        if marks.iter().all(|mark| mark.points.len() < 2) {
            return None;
        }
        let is_mixing = output.kind == OutputKind::Mixing;
        let shown = if is_mixing {
            Shown::one()
        } else {
            display::value(self.plan, output, output.quantities[group[0]], self.n_axes, largest(&marks))
        };
        rescale(&mut marks, self.time_unit.factor, shown.factor);
        let spacing = |is_wide: bool| if is_mixing && is_wide { Spacing::Log } else { Spacing::Linear };
        let names: Vec<String> = group.iter().map(|q| self.names(output.quantities[*q])).collect();
        Some(Panel {
            title: match output.kind {
                OutputKind::Mixing => format!("γ({})", names.join("; ")),
                OutputKind::Total => format!("total {}", names.join(", ")),
                kind => format!("{} {}{}", course_name(kind), names.join(", "), self.station(output)),
            },
            x_label: labelled("time", &self.time_unit.text),
            y_label: if is_mixing {
                "γ".to_owned()
            } else {
                labelled(course_value(output.kind), &shown.text)
            },
            x: Scale::covering(times_of(&marks), spacing(is_wide(times_of(&marks)))),
            y: Scale::covering(values_of(&marks), spacing(is_wide(values_of(&marks)))),
            marks,
            heat: None,
            key,
            notes: Vec::new(),
        })
    }

    /// Where a course is taken.
    fn station(&self, output: &Output) -> String {
        let Some(station) = &output.station else { return String::new() };
        if let Station::Well(name) = station {
            return format!(" at {name}");
        }
        let position = self.plan.position(station);
        let known = AXES.iter().zip(position).filter_map(|(name, at)| Some((name, at?)));
        let text: Vec<String> =
            known.map(|(name, at)| format!("{name} = {} m", crate::diagnostic::number(at))).collect();
        format!(" at {}", text.join(", "))
    }

    /// What is there and what came and went, over time: a line of dots for each place that has any.
    fn budget(&self, output_idx: usize, output: &Output, q: usize) -> Option<Panel> {
        let places = self.plan.places(output);
        let mut series: Vec<(usize, Vec<(f64, f64)>)> = Vec::new();
        for snapshot in self.of_output(output_idx) {
            let Values::Rows(rows) = &snapshot.values else { continue };
            for row in rows.get(q)?.iter().filter(|row| usize::from(row.place) + 1 < places.len()) {
                let point = (snapshot.t, *row.numbers.first()?);
                match series.iter_mut().find(|(place, _)| *place == usize::from(row.place)) {
                    Some((_, points)) => points.push(point),
                    None => series.push((row.place.into(), vec![point])),
                }
            }
        }
        series.retain(|(_, points)| points.iter().any(|point| point.1 != 0.0));
        let (mut marks, mut key) = (Vec::new(), Vec::new());
        for (idx, (place, points)) in series.into_iter().enumerate() {
            let color = SERIES[idx % SERIES.len()];
            let every = points.len().div_ceil(MOST_DOTS).max(1);
            marks.push(Mark { points: points.into_iter().step_by(every).collect(), color, look: Look::Dots });
            key.push(KeyEntry { text: places[place].clone(), color, look: Look::Dots });
        }
        if marks.iter().all(|mark| mark.points.len() < 2) {
            return None;
        }
        let shown = display::value(self.plan, output, output.quantities[q], self.n_axes, largest(&marks));
        rescale(&mut marks, self.time_unit.factor, shown.factor);
        Some(Panel {
            title: format!("budget of {}", self.names(output.quantities[q])),
            x_label: labelled("time", &self.time_unit.text),
            y_label: labelled("amount", &shown.text),
            x: Scale::covering(times_of(&marks), Spacing::Linear),
            y: Scale::covering(values_of(&marks), Spacing::Linear),
            marks,
            heat: None,
            key,
            notes: Vec::new(),
        })
    }

    /// Dots and references of some quantities over time, SI; a key if there are several. One alone is
    /// drawn in ink, because colours of the page's key are times.
    fn course_marks(
        &self,
        output_idx: usize,
        output: &Output,
        group: &[usize],
    ) -> (Vec<Mark>, Vec<KeyEntry>) {
        let (mut marks, mut key) = (Vec::new(), Vec::new());
        for (place, &q) in group.iter().enumerate() {
            let quantity = output.quantities[q];
            let color = if group.len() > 1 { SERIES[place % SERIES.len()] } else { FAINT };
            let snapshots = self.of_output(output_idx);
            let points: Vec<_> = snapshots
                .map(|snapshot| (snapshot.t, value_at(&snapshot.values, q)))
                .filter(|p| !p.1.is_nan())
                .collect();
            let every = points.len().div_ceil(MOST_DOTS).max(1);
            marks.push(Mark { points: points.into_iter().step_by(every).collect(), color, look: Look::Dots });
            key.push(KeyEntry { text: self.names(quantity), color, look: Look::Dots });
            for curve in self.curves_of(output_idx, quantity).filter(|curve| curve.t.is_none()) {
                let points = curve.x.iter().copied().zip(curve.y.iter().copied()).collect();
                let look = self.look_of(&curve.reference);
                marks.push(Mark { points, color: blend(color, BLACK, 0.25), look });
            }
        }
        if key.len() < 2 {
            key.clear();
        }
        (marks, key)
    }

    /// The last time of a map over its first two axes of more than one bin; a third is cut in the middle.
    fn map(&self, output_idx: usize, output: &Output, q: usize) -> Option<Panel> {
        let snapshot = self.of_output(output_idx).last()?;
        let grid = Grid::new(self.plan, output);
        let axes: Vec<usize> =
            (0..3).filter(|axis| grid.centres(*axis).is_some_and(|c| c.len() > 1)).collect();
        let (&[a, b], rest) = (axes.first_chunk::<2>()?, &axes[2..]);
        let middle: usize = rest
            .iter()
            .map(|axis| grid.centres(*axis).map_or(0, |c| c.len() / 2) * grid.stride(*axis).unwrap_or(0))
            .sum();
        let Values::Binned { mean, n_particles, .. } = &snapshot.values else { return None };
        let mean = mean.get(q)?;
        let n_particles = counts(n_particles, mean.len(), q);
        // A bin without masses holds none, and counts like all others.
        let has_masses = self.plan.carries_mass();
        let largest = mean.iter().filter(|v| v.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()));
        let shown = display::value(self.plan, output, output.quantities[q], self.n_axes, largest);
        let (stride_a, stride_b) = (grid.stride(a)?, grid.stride(b)?);
        let cell = |i: usize, j: usize| {
            let row = i * stride_a + j * stride_b + middle;
            (mean[row] / shown.factor, if has_masses { 1 } else { n_particles[row] })
        };
        let n = (grid.centres(a)?.len(), grid.centres(b)?.len());
        let ends = |axis: usize| self.plan.axes.iter().find(|other| other.index == axis);
        let reach = [ends(a)?.low, ends(a)?.high, ends(b)?.low, ends(b)?.high];
        let length = display::length(reach.iter().fold(0.0, |most, end| most.max(end.abs())));
        let scale = |low: f64, high: f64| Scale {
            low: low / length.factor,
            high: high / length.factor,
            spacing: Spacing::Linear,
        };
        // A third axis is cut in the middle: without its place the panel would read like a mean.
        let name_of = |axis: usize| ["x", "y", "z"].get(axis).copied().unwrap_or_default();
        let place_of = |axis: &usize| grid.centres(*axis).and_then(|c| c.get(c.len() / 2).copied());
        let cut = |axis: &usize| {
            let place = place_of(axis)? / length.factor;
            Some(format!(", {} = {} {}", name_of(*axis), crate::diagnostic::number(place), length.text))
        };
        let cut: String = rest.iter().filter_map(cut).collect();
        let title = format!("{} at {}{cut}", self.names(output.quantities[q]), self.time_text(snapshot.t));
        Some(Panel {
            title,
            x_label: labelled(AXES[a], &length.text),
            y_label: labelled(AXES[b], &length.text),
            x: scale(reach[0], reach[1]),
            y: scale(reach[2], reach[3]),
            marks: Vec::new(),
            heat: Some(Heat::new(n, cell, shown.text)),
            key: Vec::new(),
            notes: Vec::new(),
        })
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

fn time_color(idx: usize) -> Rgb {
    SERIES[idx % SERIES.len()]
}

fn labelled(what: &str, unit: &str) -> String {
    format!("{what} ({unit})")
}

/// At most `n` of the values, evenly spread, the last among them.
fn spread(values: &[f64], n: usize) -> Vec<f64> {
    if values.len() <= n {
        return values.to_vec();
    }
    (1..=n).map(|k| values[k * values.len() / n - 1]).collect()
}

/// Bins that hold particles; all of them where particles carry mass.
fn bin_values(values: &Values, has_masses: bool, q: usize, centres: &[f64]) -> Vec<(f64, f64)> {
    let (column, n_particles) = match values {
        Values::Binned { mean, .. } if has_masses => (mean.get(q), None),
        Values::Binned { mean, n_particles, .. } => (mean.get(q), Some(n_particles)),
        Values::Covariance { covariance, n_particles } => (covariance.get(q), Some(n_particles)),
        _ => return Vec::new(),
    };
    let column = column.map_or(&[][..], Vec::as_slice);
    let is_known = |row: usize| n_particles.is_none_or(|n| n.get(row).is_some_and(|&n| n > 0));
    let rows = centres.iter().zip(column).enumerate();
    let rows = rows.filter(|(row, (_, value))| is_known(*row) && value.is_finite());
    rows.map(|(_, (x, value))| (*x, *value)).collect()
}

fn value_at(values: &Values, q: usize) -> f64 {
    match values {
        Values::Total { amount } => amount.get(q).copied().unwrap_or(f64::NAN),
        Values::Mixing(states) => states.get(q).map_or(f64::NAN, |state| state.gamma),
        Values::Rows(rows) => {
            rows.get(q).and_then(|rows| rows.first()?.numbers.first().copied()).unwrap_or(f64::NAN)
        }
        _ => f64::NAN,
    }
}

fn course_name(kind: OutputKind) -> &'static str {
    match kind {
        OutputKind::Breakthrough => "breakthrough of",
        OutputKind::FirstPassage => "first passage of",
        OutputKind::Dilution => "dilution of",
        _ => "amount of",
    }
}

/// What the number of a course is.
fn course_value(kind: OutputKind) -> &'static str {
    match kind {
        OutputKind::Breakthrough => "concentration",
        OutputKind::Dilution => "dilution index",
        _ => "amount",
    }
}

fn times_of(marks: &[Mark]) -> impl Iterator<Item = f64> {
    marks.iter().flat_map(|mark| mark.points.iter().map(|point| point.0))
}

fn values_of(marks: &[Mark]) -> impl Iterator<Item = f64> {
    marks.iter().flat_map(|mark| mark.points.iter().map(|point| point.1))
}

fn largest(marks: &[Mark]) -> f64 {
    values_of(marks).filter(|value| value.is_finite()).fold(0.0, |most, value| most.max(value.abs()))
}

/// Positive values over more than a decade and a half: a log axis shows them better.
fn is_wide(values: impl Iterator<Item = f64>) -> bool {
    let (mut low, mut high) = (f64::INFINITY, 0.0);
    for value in values.filter(|value| value.is_finite() && *value != 0.0) {
        low = value.min(low);
        high = value.max(high);
    }
    low > 0.0 && high > 30.0 * low
}

fn rescale(marks: &mut [Mark], x: f64, y: f64) {
    for point in marks.iter_mut().flat_map(|mark| &mut mark.points) {
        *point = (point.0 / x, point.1 / y);
    }
}
