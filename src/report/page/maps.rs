//! Maps of one point at its last time, as means over the replicates.
//!
//! Owns the passes over the table of maps. May use `table::scan` and `heat`. It deliberately writes no
//! CSV file: the table itself has the bins, and a map has too many for a second copy.

use super::super::figure::sheet;
use super::super::heat::Heat;
use super::super::panel::Panel;
use super::super::scale::{Scale, Spacing};
use super::courses::sorted_key;
use super::html::figure;
use super::quantity::{label, shown, with_unit};
use super::series::full_name;
use super::stats::Moments;
use super::study::Study;
use crate::table::scan::{Selection, parts, scan};
use crate::table::{Kind, TableError};
use std::collections::BTreeMap;
use std::path::Path;

/// Maps on the page.
const MOST_MAPS: usize = 6;

/// A species on the bins of an output.
struct Map {
    output: u16,
    species: String,
    unit: String,
    t: f64,
    bins: BTreeMap<[u64; 3], Bin>,
}

#[derive(Default)]
struct Bin {
    place: [f64; 3],
    value: Moments,
    n_particles: u64,
}

/// The maps of the last point that is done; empty if there are none.
pub fn maps(folder: &Path, study: &Study) -> Result<String, TableError> {
    let done = study.points.iter().rev().find(|(_, point)| point.n_done > 0);
    let Some((point_number, point)) = done else { return Ok(String::new()) };
    let mut maps = read(folder, *point_number)?;
    maps.sort_by(|a, b| (a.output, &a.species).cmp(&(b.output, &b.species)));
    maps.truncate(MOST_MAPS);
    let panels: Vec<Panel> = maps.iter().filter_map(panel).collect();
    if panels.is_empty() {
        return Ok(String::new());
    }
    let n_columns = panels.len().min(2);
    let svg = sheet(None, Vec::new(), &panels, (540.0, 340.0), n_columns);
    let values = full_name(study, point);
    let of = if values.is_empty() { String::new() } else { format!(" of point {point_number} ({values})") };
    let what = match point.n_done {
        1 => format!("The last time{of}"),
        n => format!("Means{of} over {n} replicates at the last time"),
    };
    let is_grey = |map: &Map| map.bins.values().any(|bin| bin.value.n == 0);
    let grey = if maps.iter().any(is_grey) { "; grey bins hold no particle" } else { "" };
    let caption = format!("{what}{grey}.");
    Ok(format!("<h3>Maps</h3>\n{}", figure(&svg, &caption)))
}

/// A pass for the last time of each output, a pass for the values.
fn read(folder: &Path, point: u32) -> Result<Vec<Map>, TableError> {
    let mut last: BTreeMap<u16, f64> = BTreeMap::new();
    let only = [point];
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    for part in parts(folder, Kind::Map) {
        let numbers = ["point", "output", "t"];
        scan(&part, Selection { numbers: &numbers, words: &[], points: Some(&only) }, |row| {
            if number(row.number(0)) == f64::from(point) {
                let t = last.entry(number(row.number(1)) as u16).or_insert(f64::NEG_INFINITY);
                *t = t.max(number(row.number(2)));
            }
        })?;
    }
    let mut maps: Vec<Map> = Vec::new();
    for part in parts(folder, Kind::Map) {
        let numbers = ["point", "output", "t", "x", "y", "z", "concentration", "n_particles"];
        let words = ["species", "unit"];
        scan(&part, Selection { numbers: &numbers, words: &words, points: Some(&only) }, |row| {
            let (output, t) = (number(row.number(1)) as u16, number(row.number(2)));
            if number(row.number(0)) != f64::from(point) || last.get(&output) != Some(&t) {
                return;
            }
            let species = row.word(0).unwrap_or_default();
            let is_mine = |map: &Map| map.output == output && map.species == *species;
            let idx = maps.iter().position(is_mine).unwrap_or_else(|| {
                let unit = row.word(1).unwrap_or_default().into_owned();
                let species = species.clone().into_owned();
                maps.push(Map { output, species, unit, t, bins: BTreeMap::new() });
                maps.len() - 1
            });
            let place = [3, 4, 5].map(|axis| row.number(axis).unwrap_or(0.0));
            let bin = maps[idx].bins.entry(place.map(sorted_key)).or_default();
            bin.place = place;
            bin.n_particles += row.number(7).unwrap_or(0.0) as u64;
            row.number(6).into_iter().for_each(|value| bin.value.add(value));
        })?;
    }
    Ok(maps)
}

/// Over its first two axes of more than one bin; a third is cut in the middle.
fn panel(map: &Map) -> Option<Panel> {
    let centres: Vec<Vec<f64>> = (0..3).map(|axis| centres(map, axis)).collect();
    let axes: Vec<usize> = (0..3).filter(|axis| centres[*axis].len() > 1).collect();
    let &[a, b] = axes.first_chunk::<2>()?;
    let middle = centres.iter().map(|centres| centres[centres.len() / 2]);
    let middle: Vec<f64> = middle.collect();
    let largest = map.bins.values().map(|bin| bin.value.mean.abs()).fold(0.0, f64::max);
    let value = shown(&map.unit, largest);
    // A bin without particles has a value only where particles carry mass: none is there. All bins count alike then.
    let are_masses = map.bins.values().any(|bin| bin.value.n > 0 && bin.n_particles == 0);
    let cell = |i: usize, j: usize| {
        let mut place = [middle[0], middle[1], middle[2]];
        (place[a], place[b]) = (centres[a][i], centres[b][j]);
        let bin = map.bins.get(&place.map(sorted_key)).filter(|bin| bin.value.n > 0);
        let weight = |bin: &Bin| if are_masses { 1 } else { bin.n_particles };
        bin.map_or((f64::NAN, 0), |bin| (bin.value.mean / value.factor, weight(bin)))
    };
    // Bins reach half their width beyond the outermost centres.
    let ends = |centres: &[f64]| {
        let (first, last) = (centres[0], centres[centres.len() - 1]);
        let half = 0.5 * (last - first) / (centres.len() - 1) as f64;
        (first - half, last + half)
    };
    let reach = [ends(&centres[a]), ends(&centres[b])];
    let length = shown("m", reach.iter().map(|(low, high)| low.abs().max(high.abs())).fold(0.0, f64::max));
    let scale = |(low, high): (f64, f64)| Scale {
        low: low / length.factor,
        high: high / length.factor,
        spacing: Spacing::Linear,
    };
    let names = ["x", "y", "z"];
    // Without its place the cut would read like a mean.
    let cut: String = axes[2..]
        .iter()
        .map(|&axis| format!(", {} = {}", names[axis], with_unit(middle[axis], "m")))
        .collect();
    Some(Panel {
        title: format!("{} at {}{cut}", map.species, with_unit(map.t, "s")),
        x_label: label(names[a], &length),
        y_label: label(names[b], &length),
        x: scale(reach[0]),
        y: scale(reach[1]),
        marks: Vec::new(),
        heat: Some(Heat::new((centres[a].len(), centres[b].len()), cell, value.text)),
        key: Vec::new(),
        notes: Vec::new(),
    })
}

/// The different places along an axis, in order.
fn centres(map: &Map, axis: usize) -> Vec<f64> {
    let all: BTreeMap<u64, f64> = map.bins.iter().map(|(key, bin)| (key[axis], bin.place[axis])).collect();
    all.into_values().collect()
}
