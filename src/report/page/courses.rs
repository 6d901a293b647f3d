//! Values over a place or over time of a few points, as means over the replicates.
//!
//! Owns the passes over the large tables. May use `table::scan`. It deliberately keeps one mean per
//! bin or time of the chosen points: the number of replicates and of other points does not matter.

use super::quantity::with_unit;
use super::stats::Moments;
use crate::table::scan::{Row, Selection, parts, scan};
use crate::table::{Kind, TableError};
use std::collections::BTreeMap;
use std::path::Path;

/// A curve of one point: over x, y or z at one time, or over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    pub output: u16,
    pub point: u32,
    /// A species, or `A, B`.
    pub name: String,
    /// The column of the table.
    pub number: &'static str,
    /// Where it is taken, as ` at x = 80 m`; empty without a place.
    pub station: String,
    /// Absent if the course is over time.
    pub t: Option<f64>,
    /// 0, 1, 2: the axis it runs along.
    pub axis: usize,
    pub unit: String,
    /// By a key that sorts like the place; the place with its values.
    bins: BTreeMap<u64, (f64, Moments)>,
}

impl Course {
    pub fn places(&self) -> impl Iterator<Item = &(f64, Moments)> {
        self.bins.values()
    }

    pub fn most_replicates(&self) -> u64 {
        self.places().map(|(_, moments)| moments.n).max().unwrap_or(0)
    }
}

/// The columns of a kind of table that are shown.
fn numbers_of(kind: Kind) -> &'static [&'static str] {
    match kind {
        Kind::Profile | Kind::Map | Kind::Breakthrough => &["concentration"],
        Kind::Total => &["amount"],
        Kind::Covariance => &["covariance"],
        Kind::Mixing => &["gamma"],
        Kind::FirstPassage => &["cumulative"],
        Kind::Moments => &["mean_x", "mean_y", "mean_z", "xx", "yy", "zz"],
        Kind::Dilution => &["index"],
        Kind::Kernels => &["bandwidth", "narrow", "wide", "stretch"],
        _ => &[],
    }
}

/// All curves of a kind of table; those without any value are left out.
pub fn read(folder: &Path, kind: Kind, points: &[u32], most_times: usize) -> Result<Vec<Course>, TableError> {
    let is_over_time = !matches!(kind, Kind::Profile | Kind::Map | Kind::Covariance);
    let times = if is_over_time { BTreeMap::new() } else { times(folder, kind, points, most_times)? };
    let mut courses = Vec::new();
    for number in numbers_of(kind) {
        let found = of_number(folder, kind, number, points, &times)?;
        courses.extend(found.into_iter().filter(|course| course.most_replicates() > 0));
    }
    Ok(courses)
}

/// The times of curves over a place that are shown, by output and point.
type Times = BTreeMap<(u16, u32), Vec<f64>>;

fn of_number(
    folder: &Path,
    kind: Kind,
    number: &'static str,
    points: &[u32],
    times: &Times,
) -> Result<Vec<Course>, TableError> {
    let is_over_time = !matches!(kind, Kind::Profile | Kind::Map | Kind::Covariance);
    let has_place = matches!(kind, Kind::Breakthrough | Kind::FirstPassage);
    let words: &[&str] = match kind {
        Kind::Covariance | Kind::Mixing => &["unit", "species_a", "species_b"],
        _ if has_place => &["unit", "species", "place"],
        _ => &["unit", "species"],
    };
    let is_pair = matches!(kind, Kind::Covariance | Kind::Mixing);
    let mut gathered = Gathered { courses: Vec::new(), last: 0, number, is_over_time, is_pair, has_place };
    let mut numbers = vec!["point", "output", "t", number];
    if !is_over_time || has_place {
        numbers.extend(["x", "y", "z"]);
    }
    for part in parts(folder, kind) {
        let selection = Selection { numbers: &numbers, words, points: Some(points) };
        scan(&part, selection, |row| {
            let place = Place::of(row);
            let is_shown = || times.get(&(place.output, place.point)).is_some_and(|t| t.contains(&place.t));
            if points.contains(&place.point) && (is_over_time || is_shown()) {
                gathered.add(row, place);
            }
        })?;
    }
    gathered.courses.sort_by(|a, b| {
        let key = |c: &Course| (c.output, c.name.clone(), c.point);
        key(a).cmp(&key(b)).then(a.t.unwrap_or(0.0).total_cmp(&b.t.unwrap_or(0.0)))
    });
    Ok(gathered.courses)
}

/// The times of each output and point that are shown: evenly spread, the last among them.
fn times(folder: &Path, kind: Kind, points: &[u32], most: usize) -> Result<Times, TableError> {
    let mut found = Times::new();
    for part in parts(folder, kind) {
        let selection =
            Selection { numbers: &["point", "output", "t"], points: Some(points), ..Selection::default() };
        scan(&part, selection, |row| {
            let place = Place::of(row);
            if points.contains(&place.point) {
                let times = found.entry((place.output, place.point)).or_default();
                // Rows of one time follow each other.
                if times.last() != Some(&place.t) && !times.contains(&place.t) {
                    times.push(place.t);
                }
            }
        })?;
    }
    for times in found.values_mut() {
        times.sort_by(f64::total_cmp);
        let n = times.len();
        if n > most {
            *times = (1..=most).map(|k| times[k * n / most - 1]).collect();
        }
    }
    Ok(found)
}

/// What a row belongs to.
#[derive(Clone, Copy)]
struct Place {
    point: u32,
    output: u16,
    t: f64,
}

impl Place {
    fn of(row: &Row) -> Self {
        let number = |idx: usize| row.number(idx).unwrap_or(0.0);
        Self { point: number(0) as u32, output: number(1) as u16, t: number(2) }
    }
}

struct Gathered {
    courses: Vec<Course>,
    /// The course of the row before: the next row mostly belongs to it, too.
    last: usize,
    number: &'static str,
    is_over_time: bool,
    is_pair: bool,
    has_place: bool,
}

impl Gathered {
    fn add(&mut self, row: &Row, place: Place) {
        let first = row.word(1).unwrap_or_default();
        let second = if self.is_pair { row.word(2) } else { None };
        let t = (!self.is_over_time).then_some(place.t);
        let is_mine = |course: &Course| {
            let is_named = match &second {
                Some(second) => course.name.split_once(", ") == Some((&*first, &**second)),
                None => course.name == *first,
            };
            course.point == place.point && course.output == place.output && course.t == t && is_named
        };
        if !self.courses.get(self.last).is_some_and(is_mine) {
            self.last = self.courses.iter().position(is_mine).unwrap_or_else(|| {
                let name = second.as_ref().map_or_else(|| first.to_string(), |b| format!("{first}, {b}"));
                let unit = match self.number {
                    "gamma" => "1".to_owned(),
                    "mean_x" | "mean_y" | "mean_z" => "m".to_owned(),
                    "xx" | "yy" | "zz" => "m^2".to_owned(),
                    _ => row.word(0).unwrap_or_default().into_owned(),
                };
                let station = if self.has_place { station(row) } else { String::new() };
                let axis = (0..3).find(|axis| row.number(4 + axis).is_some()).unwrap_or(0);
                let Place { point, output, .. } = place;
                let number = self.number;
                let bins = BTreeMap::new();
                self.courses.push(Course { output, point, name, number, station, t, axis, unit, bins });
                self.courses.len() - 1
            });
        }
        let course = &mut self.courses[self.last];
        let x = match t {
            Some(_) => row.number(4 + course.axis).unwrap_or(f64::NAN),
            None => place.t,
        };
        let (_, moments) = course.bins.entry(sorted_key(x)).or_insert((x, Moments::default()));
        row.number(3).into_iter().for_each(|value| moments.add(value));
    }
}

/// ` at pump`, ` at right`, ` at x = 80 m`
fn station(row: &Row) -> String {
    let place = row.word(2).unwrap_or_default();
    let known = ["x", "y", "z"].iter().enumerate();
    let known =
        known.filter_map(|(axis, name)| Some(format!("{name} = {}", with_unit(row.number(4 + axis)?, "m"))));
    let position = known.collect::<Vec<_>>().join(", ");
    match &*place {
        "plane" => format!(" at {position}"),
        "box" => format!(" in a box around {position}"),
        part if part.starts_with("part of") => format!(" in a part around {position}"),
        side => format!(" at {side}"),
    }
}

/// Bits that sort like the numbers.
pub fn sorted_key(value: f64) -> u64 {
    let bits = (value + 0.0).to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_sort_like_numbers() {
        let values = [f64::NEG_INFINITY, -2.0, -1e-300, 0.0, 1e-300, 3.0];
        assert!(values.windows(2).all(|pair| sorted_key(pair[0]) < sorted_key(pair[1])));
        assert_eq!(sorted_key(-0.0), sorted_key(0.0));
    }
}
