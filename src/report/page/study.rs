//! `points.parquet` as means per point.
//!
//! Owns which columns are read and what is kept of them. May use `table` and `sweep`. It deliberately
//! holds a few numbers per point and no row: a sweep may have any number of replicates.

use super::super::sweep::{SweepAxis, SweepDescription};
use super::stats::Moments;
use crate::table::scan::{ColumnHead, Row, Selection, columns, scan};
use crate::table::{Status, TableError};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Failed replicates that are shown with their messages.
const MOST_FAILED: usize = 50;

/// All that a report tells of the points.
#[derive(Debug, Default)]
pub struct Study {
    pub axes: Vec<Axis>,
    /// Columns whose means are kept, in the order of [`PointSummary::values`].
    pub columns: Vec<ColumnHead>,
    /// By number.
    pub points: BTreeMap<u32, PointSummary>,
    pub n_done: u64,
    pub n_failed: u64,
    pub n_interrupted: u64,
    pub failed: Vec<Failed>,
    /// Of all replicates, s.
    pub wall: f64,
    pub cpu: f64,
    pub worst_defect: Option<Defect>,
    pub circumstances: Circumstances,
}

/// An axis of the sweep with its column.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub name: String,
    pub unit: String,
    pub group: u32,
    column: String,
}

#[derive(Debug, Clone, Default)]
pub struct PointSummary {
    /// In the order of [`Study::axes`]; SI.
    pub axes: Vec<Option<f64>>,
    pub n_done: u64,
    pub n_failed: u64,
    /// Over the replicates that are done.
    pub values: Vec<Moments>,
    pub worst_defect: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Failed {
    pub point: u32,
    pub replicate: u32,
    pub status: String,
    pub code: String,
    pub message: String,
    pub key: String,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defect {
    pub value: f64,
    pub point: u32,
    pub replicate: u32,
}

/// Where and when the points ran.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Circumstances {
    pub versions: BTreeSet<String>,
    pub numerics: BTreeSet<u64>,
    pub hosts: BTreeSet<String>,
    pub threads: BTreeSet<u64>,
    /// Microseconds since 1970, UTC.
    pub first_started: Option<i64>,
    pub last_finished: Option<i64>,
    /// The seeds of the first few replicates.
    pub seeds: Vec<String>,
    pub n_seeds: u64,
}

const NUMBERS: [&str; 9] =
    ["point", "replicate", "wall", "cpu", "mass_defect", "numerics", "threads", "started", "finished"];
const WORDS: [&str; 7] = ["status", "error_code", "error_message", "key", "version", "host", "seed"];
/// Seeds that are listed.
const MOST_SEEDS: usize = 8;

impl Study {
    /// Reads the table once. `sweep` says which columns are axes and measures.
    pub fn read(path: &Path, sweep: Option<&SweepDescription>) -> Result<Self, TableError> {
        let heads = columns(path)?;
        let mut study = Self { axes: axes(&heads, sweep), ..Self::default() };
        study.columns = value_columns(&heads, sweep, &study.axes);
        let axis_columns = study.axes.iter().map(|axis| axis.column.clone());
        let more: Vec<String> =
            axis_columns.chain(study.columns.iter().map(|head| head.name.clone())).collect();
        let numbers: Vec<&str> = NUMBERS.into_iter().chain(more.iter().map(String::as_str)).collect();
        let selection = Selection { numbers: &numbers, words: &WORDS, points: None };
        scan(path, selection, |row| study.add(row))?;
        Ok(study)
    }

    fn add(&mut self, row: &Row) {
        let count = |idx: usize| row.number(idx).unwrap_or(0.0) as u32;
        let word = |idx: usize| row.word(idx).unwrap_or_default().into_owned();
        let (number, replicate) = (count(0), count(1));
        self.wall += row.number(2).unwrap_or(0.0);
        self.cpu += row.number(3).unwrap_or(0.0);
        self.circumstances.add(row);
        let n_axes = self.axes.len();
        let point = self.points.entry(number).or_insert_with(|| PointSummary {
            axes: vec![None; n_axes],
            values: vec![Moments::default(); self.columns.len()],
            ..PointSummary::default()
        });
        for (idx, value) in point.axes.iter_mut().enumerate() {
            *value = value.or_else(|| row.number(NUMBERS.len() + idx));
        }
        match Status::from_text(&word(0)) {
            Some(Status::Done) => {
                self.n_done += 1;
                point.n_done += 1;
            }
            status => {
                let is_interrupted = status == Some(Status::Interrupted);
                *if is_interrupted { &mut self.n_interrupted } else { &mut self.n_failed } += 1;
                point.n_failed += 1;
                if self.failed.len() < MOST_FAILED {
                    let (status, code, message, key) = (word(0), word(1), word(2), word(3));
                    self.failed.push(Failed { point: number, replicate, status, code, message, key });
                }
                return;
            }
        }
        for (idx, moments) in point.values.iter_mut().enumerate() {
            row.number(NUMBERS.len() + n_axes + idx).into_iter().for_each(|value| moments.add(value));
        }
        if let Some(value) = row.number(4) {
            point.worst_defect = Some(point.worst_defect.map_or(value, |worst| worst.max(value)));
            if self.worst_defect.is_none_or(|worst| value > worst.value) {
                self.worst_defect = Some(Defect { value, point: number, replicate });
            }
        }
    }

    /// The place of a measure or cost by the name that a scene gives it.
    pub fn column(&self, name: &str) -> Option<usize> {
        let wanted = alias(name);
        let renamed = format!("measure.{wanted}");
        let of = |name: &str| self.columns.iter().position(|head| head.name == name);
        of(&renamed).or_else(|| of(wanted))
    }

    pub fn axis(&self, name: &str) -> Option<usize> {
        self.axes.iter().position(|axis| axis.name == name)
    }
}

impl Circumstances {
    fn add(&mut self, row: &Row) {
        // A point that was refused has run nowhere.
        if row.word(3).is_none_or(|key| key.is_empty()) {
            return;
        }
        let insert = |set: &mut BTreeSet<String>, idx: usize| {
            row.word(idx).into_iter().for_each(|word| {
                set.insert(word.into_owned());
            });
        };
        insert(&mut self.versions, 4);
        insert(&mut self.hosts, 5);
        row.number(5).into_iter().for_each(|value| _ = self.numerics.insert(value as u64));
        row.number(6).into_iter().for_each(|value| _ = self.threads.insert(value as u64));
        let times = (row.number(7).map(|t| t as i64), row.number(8).map(|t| t as i64));
        self.first_started = [self.first_started, times.0].into_iter().flatten().min();
        self.last_finished = [self.last_finished, times.1].into_iter().flatten().max();
        self.n_seeds += 1;
        if self.seeds.len() < MOST_SEEDS {
            self.seeds.extend(row.word(6).map(|seed| seed.into_owned()));
        }
    }
}

/// What a report calls the costs that every run has.
fn alias(name: &str) -> &str {
    match name {
        "wall_time" => "wall",
        "cpu_time" => "cpu",
        other => other,
    }
}

fn axes(heads: &[ColumnHead], sweep: Option<&SweepDescription>) -> Vec<Axis> {
    let one = |axis: &SweepAxis| {
        let choices = [axis.column.clone(), format!("swept.{}", axis.name), axis.name.clone()];
        let is_there = |name: &String| heads.iter().any(|head| head.name == *name && head.is_number);
        let column = choices.into_iter().find(is_there)?;
        Some(Axis { name: axis.name.clone(), unit: axis.unit.clone(), group: axis.group, column })
    };
    sweep.into_iter().flat_map(|sweep| &sweep.axes).filter_map(one).collect()
}

/// The costs, then all numbers that the scene named: measures and errors.
fn value_columns(heads: &[ColumnHead], sweep: Option<&SweepDescription>, axes: &[Axis]) -> Vec<ColumnHead> {
    let asked: Vec<&str> = sweep
        .into_iter()
        .flat_map(|sweep| &sweep.reports)
        .flat_map(|report| std::iter::once(&report.measure).chain(&report.against))
        .map(|name| alias(name))
        .collect();
    let is_kept = |head: &&ColumnHead| {
        let name = head.name.as_str();
        let is_axis = axes.iter().any(|axis| axis.column == name);
        let is_asked = asked.contains(&name) || asked.contains(&name.trim_start_matches("measure."));
        let is_named = sweep.is_none() && !crate::table::is_fixed_column(name);
        head.is_number && !is_axis && (is_asked || is_named || matches!(name, "wall" | "cpu"))
    };
    heads.iter().filter(is_kept).cloned().collect()
}
