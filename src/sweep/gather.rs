//! From journals to one set of tables.
//!
//! Owns the order of rows, which follows from the sweep's definition alone: not from the schedule, the
//! shards or the history. May use the journals and `table`. It deliberately runs nothing.

use super::expect::Judge;
use super::frame::Replicate;
use super::points::{Point, Points};
use super::queue::Series;
use super::replicate::refresh;
use super::{Journal, JournalError, Scene};
use crate::plan::Plan;
use crate::plan::compile::Compiled;
use crate::report::{
    ExpectationOutcome, SWEEP_FILE, SWEEP_VERSION, SweepAxis, SweepDescription, SweepReplicates, SweepReport,
    SweepReportKind,
};
use crate::scenario::Scenario;
use crate::scenario::sweep::{Report, ReportKind, Target};
use crate::table::{Gatherer, PointRow, Record, Shape, Status, TableError, WrittenFile, si_text};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;

/// Most points that are read side by side before their rows are written, and most bytes of theirs.
const MAX_BATCH: usize = 64;
const BATCH_BYTES: u64 = 64 << 20;

/// What went into the tables.
#[derive(Debug, Clone, PartialEq)]
pub struct Gathered {
    pub files: Vec<WrittenFile>,
    pub n_points: u64,
    pub n_done: u64,
    pub n_failed: u64,
    /// Points with replicates that no journal has.
    pub n_missing: u64,
    /// Points whose mean is less precise than was asked for, after all replicates that are allowed.
    pub n_imprecise: u64,
    /// What stands in `sweep.json`.
    pub description: SweepDescription,
    /// Number of the journal and of the session in it, of each session that ran a replicate of the tables.
    pub sessions: BTreeSet<(usize, u32)>,
    /// Of the replicates, microseconds since 1970, UTC.
    pub started: Option<i64>,
    pub finished: Option<i64>,
}

impl Gathered {
    pub fn is_met(&self) -> bool {
        // What a whole sweep cannot tell is not met either.
        let is_whole = self.n_missing == 0;
        self.description.expectations.iter().all(|expectation| match expectation.outcome {
            ExpectationOutcome::Met => true,
            ExpectationOutcome::NotMet => false,
            ExpectationOutcome::Unknown => !is_whole,
        })
    }
}

/// How much of a sweep is there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Standing {
    pub n_done: u64,
    pub n_failed: u64,
    /// Points that are not complete.
    pub n_missing: u64,
}

#[derive(Debug)]
pub enum GatherError {
    Journal(JournalError),
    Table(TableError),
    Description(String),
    Interrupted,
}

impl std::fmt::Display for GatherError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Journal(error) => error.fmt(f),
            Self::Table(error) => error.fmt(f),
            Self::Description(error) => f.write_str(error),
            Self::Interrupted => f.write_str("interrupted"),
        }
    }
}

impl From<JournalError> for GatherError {
    fn from(error: JournalError) -> Self {
        Self::Journal(error)
    }
}

impl From<TableError> for GatherError {
    fn from(error: TableError) -> Self {
        Self::Table(error)
    }
}

/// A sweep whose journals become tables.
pub struct Gather<'a> {
    pub scene: &'a Scene,
    pub points: &'a Points,
    pub journals: &'a [&'a Journal],
    /// Of the scene without a point.
    pub base: &'a Compiled,
    pub record: &'a Record,
    pub reports: &'a [Report],
    /// The name of the scene that is swept.
    pub scene_name: &'a str,
    /// Version of the program, for rows of points that never ran.
    pub version: &'a str,
    pub is_cancelled: &'a (dyn Fn() -> bool + Sync),
}

/// One point as it goes into the tables.
struct Whole {
    scenario: Option<Scenario>,
    plan: Option<Plan>,
    replicates: Vec<Replicate>,
    /// See [`Gathered::sessions`].
    sessions: BTreeSet<(usize, u32)>,
    is_missing: bool,
    is_imprecise: bool,
}

impl Gather<'_> {
    /// Writes all tables into `folder`. Points that are not in the journals have no rows.
    pub fn write(&self, folder: &Path) -> Result<Gathered, GatherError> {
        let shape = self.shape()?;
        let mut gatherer = Gatherer::create(folder, &self.base.plan, self.record, shape.clone())?;
        let mut judge = Judge::new(self.scene);
        let mut gathered = Gathered {
            files: Vec::new(),
            n_points: self.points.len() as u64,
            n_done: 0,
            n_failed: 0,
            n_missing: 0,
            n_imprecise: 0,
            description: self.description(&shape),
            sessions: BTreeSet::new(),
            started: None,
            finished: None,
        };
        let batch_size = self.batch_size();
        for (batch_idx, batch) in self.points.list.chunks(batch_size).enumerate() {
            if (self.is_cancelled)() {
                return Err(GatherError::Interrupted);
            }
            let wholes: Vec<Result<Whole, JournalError>> =
                batch.par_iter().map(|point| self.whole(point)).collect();
            for (idx, (point, whole)) in batch.iter().zip(wholes).enumerate() {
                let number = (batch_idx * batch_size + idx) as u32;
                self.add(number, point, whole?, &mut gatherer, &mut judge, &mut gathered)?;
            }
        }
        let is_whole = gathered.n_missing == 0;
        gathered.description.expectations = judge.judge(is_whole);
        let description = gathered.description.to_json().map_err(GatherError::Description)?;
        gathered.files = gatherer.finish(&[(SWEEP_FILE, &description)])?.files;
        Ok(gathered)
    }

    /// What the journals have of the sweep as it is defined now.
    pub fn standing(&self) -> Result<Standing, JournalError> {
        let each: Vec<Result<Standing, JournalError>> =
            self.points.list.par_iter().map(|point| self.standing_of(point)).collect();
        each.into_iter().try_fold(Standing::default(), |sum, own| {
            let own = own?;
            Ok(Standing {
                n_done: sum.n_done + own.n_done,
                n_failed: sum.n_failed + own.n_failed,
                n_missing: sum.n_missing + own.n_missing,
            })
        })
    }

    fn standing_of(&self, point: &Point) -> Result<Standing, JournalError> {
        let mut standing = Standing::default();
        if self.scene.sweep.replicates.until.is_some() {
            let whole = self.whole(point)?;
            let is_done = |replicate: &&Replicate| replicate.row.status == Status::Done;
            standing.n_done = whole.replicates.iter().filter(is_done).count() as u64;
            standing.n_failed = whole.replicates.len() as u64 - standing.n_done;
            standing.n_missing = u64::from(whole.is_missing);
            return Ok(standing);
        }
        let compiled = self.scene.compile(point.combination).ok().filter(|_| point.refusal.is_none());
        let Some((_, compiled)) = compiled else {
            return Ok(Standing { n_failed: 1, ..standing });
        };
        for replicate in 0..self.scene.sweep.replicates.least {
            let (_, key) = self.scene.replicate(&compiled.plan, point.combination, replicate);
            let entries = self.journals.iter().filter_map(|journal| journal.entry(&key));
            match entries.map(|entry| entry.is_done()).reduce(|a, b| a | b) {
                Some(true) => standing.n_done += 1,
                Some(false) => standing.n_failed += 1,
                None => standing.n_missing = 1,
            }
        }
        Ok(standing)
    }

    /// Columns in the order of the axes, then what the first replicate that ended well has, with the
    /// references and measures of today: every other one has the same.
    fn shape(&self) -> Result<Shape, JournalError> {
        let mut shape = Shape::default();
        if let Some(point) = self.points.list.first() {
            let swept = self.scene.swept(point.combination);
            shape.add(&PointRow { swept, ..refused_row(self.version) });
        }
        for point in &self.points.list {
            let replicates = self.whole(point)?.replicates;
            if let Some(done) = replicates.iter().find(|replicate| replicate.row.status == Status::Done) {
                shape.add(&PointRow { swept: Vec::new(), ..done.row.clone() });
                break;
            }
        }
        Ok(shape)
    }

    /// As many points as fit into the bytes that may be read at once, by the mean of the journals.
    fn batch_size(&self) -> usize {
        let bytes: u64 = self.journals.iter().map(|journal| journal.n_bytes()).sum();
        let records: usize = self.journals.iter().map(|journal| journal.len()).sum();
        let replicates = &self.scene.sweep.replicates;
        let most = replicates.until.as_ref().map_or(replicates.least, |until| until.most);
        let per_point = bytes / records.max(1) as u64 * u64::from(most);
        (BATCH_BYTES / per_point.max(1)).clamp(1, MAX_BATCH as u64) as usize
    }

    fn whole(&self, point: &Point) -> Result<Whole, JournalError> {
        let mut sessions = BTreeSet::new();
        let nothing = Whole {
            scenario: None,
            plan: None,
            replicates: Vec::new(),
            sessions: BTreeSet::new(),
            is_missing: false,
            is_imprecise: false,
        };
        if point.refusal.is_some() {
            return Ok(nothing);
        }
        let Ok((scenario, compiled)) = self.scene.compile(point.combination) else { return Ok(nothing) };
        let replicates = &self.scene.sweep.replicates;
        let (mut list, mut series): (Vec<Replicate>, Series) = (Vec::new(), Series::default());
        let mut is_missing = false;
        loop {
            let number = list.len() as u32;
            if number >= series.needed(replicates).0 {
                break;
            }
            let (_, key) = self.scene.replicate(&compiled.plan, point.combination, number);
            // One that ended well comes before one that failed in another shard's journal.
            let found = self.journals.iter().enumerate();
            let found = found.filter_map(|(idx, journal)| Some((idx, journal.entry(&key)?)));
            let Some((idx, entry)) = found.min_by_key(|(_, entry)| entry.status != Status::Done) else {
                is_missing = true;
                break;
            };
            let mut replicate = self.journals[idx].replicate(entry)?;
            sessions.insert((idx, entry.session));
            refresh(&mut replicate, &scenario, &compiled);
            if let Some(until) = &replicates.until {
                let value = replicate.row.values.iter().find(|value| value.name == until.measure);
                series.set(number, value.and_then(|value| value.value).unwrap_or(f64::NAN));
            }
            list.push(replicate);
        }
        let is_imprecise = !is_missing && !series.is_precise(replicates);
        let (scenario, plan) = (Some(scenario), Some(compiled.plan));
        Ok(Whole { scenario, plan, replicates: list, sessions, is_missing, is_imprecise })
    }

    fn add(
        &self,
        number: u32,
        point: &Point,
        whole: Whole,
        gatherer: &mut Gatherer,
        judge: &mut Judge,
        gathered: &mut Gathered,
    ) -> Result<(), GatherError> {
        gathered.n_missing += u64::from(whole.is_missing);
        gathered.n_imprecise += u64::from(whole.is_imprecise);
        if let Some(refusal) = &point.refusal {
            gathered.n_failed += 1;
            let values = self.scene.values(point.combination);
            let of = |target: Target| {
                let own = values.iter().find(|value| *value.target == target);
                own.and_then(|value| value.value.si.first().copied())
            };
            let base = &self.base.plan;
            let row = PointRow {
                point: number,
                swept: self.scene.swept(point.combination),
                particles: of(Target::Particles).map_or(base.particles.count, |n| n as u64),
                step: of(Target::Step).unwrap_or(base.time.step),
                duration: base.time.duration,
                error_code: Some(refusal.code.clone()),
                error_message: Some(refusal.message.clone()),
                ..refused_row(self.version)
            };
            return Ok(gatherer.add(&self.base.plan, row, &[], Vec::new())?);
        }
        let (Some(scenario), Some(plan)) = (&whole.scenario, &whole.plan) else { return Ok(()) };
        gathered.sessions.extend(&whole.sessions);
        for (idx, mut replicate) in whole.replicates.into_iter().enumerate() {
            let (started, finished) = (replicate.row.started, replicate.row.finished);
            gathered.started = Some(gathered.started.map_or(started, |first| first.min(started)));
            gathered.finished = gathered.finished.max(Some(finished));
            let place = (number, idx as u32);
            (replicate.row.point, replicate.row.replicate) = place;
            // A renamed axis is another column, whatever it was called when the point ran.
            replicate.row.swept = self.scene.swept(point.combination);
            for error in &mut replicate.errors {
                (error.point, error.replicate) = place;
            }
            if replicate.row.status == Status::Done {
                gathered.n_done += 1;
                judge.look(point.combination, scenario, &replicate.row);
            } else {
                gathered.n_failed += 1;
            }
            gatherer.add(plan, replicate.row, &replicate.snapshots, replicate.errors)?;
        }
        Ok(())
    }

    /// Expectations are judged when all points are in.
    fn description(&self, shape: &Shape) -> SweepDescription {
        let scene = self.scene;
        let axes = scene.sweep.groups.iter().enumerate().flat_map(|(group, axes)| {
            axes.iter().map(move |axis| SweepAxis {
                name: axis.target.name().to_owned(),
                column: column(shape, &axis.target),
                unit: si_text(axis.dimension),
                values: axis.values.iter().map(|value| value.si.iter().product()).collect(),
                group: group as u32,
            })
        });
        let replicates = &scene.sweep.replicates;
        let most = replicates.until.as_ref().map_or(replicates.least, |until| until.most);
        SweepDescription {
            version: SWEEP_VERSION,
            name: scene.sweep.name.clone(),
            scene: self.scene_name.to_owned(),
            axes: axes.collect(),
            n_points: self.points.len() as u64,
            n_skipped: self.points.n_skipped,
            replicates: SweepReplicates { least: replicates.least, most },
            seed: scene.root_seed(),
            has_common_random_numbers: scene.sweep.has_common_numbers,
            reports: self.reports.iter().map(report).collect(),
            expectations: Vec::new(),
        }
    }
}

/// The column of `points.parquet` that holds an axis.
fn column(shape: &Shape, target: &Target) -> String {
    match target {
        Target::Particles | Target::Step => target.name().to_owned(),
        Target::Parameter(_) | Target::Bins => shape.column_of(target.name()),
    }
}

fn report(report: &Report) -> SweepReport {
    SweepReport {
        kind: match report.kind {
            ReportKind::WorkPrecision => SweepReportKind::WorkPrecision,
            ReportKind::Convergence => SweepReportKind::Convergence,
            ReportKind::Minimum => SweepReportKind::Minimum,
        },
        measure: report.measure.clone(),
        against: report.against.clone(),
        by: report.by.clone(),
    }
}

/// The row of a point that was refused before it ran.
fn refused_row(version: &str) -> PointRow {
    PointRow {
        point: 0,
        replicate: 0,
        key: String::new(),
        swept: Vec::new(),
        seed: 0,
        status: Status::Failed,
        error_code: None,
        error_message: None,
        wall: 0.0,
        loop_wall: 0.0,
        cpu: 0.0,
        compile_wall: 0.0,
        write_wall: None,
        peak_memory: None,
        particles: 0,
        step: f64::NAN,
        duration: f64::NAN,
        steps: 0,
        sub_steps: None,
        mass_defect: None,
        values: Vec::new(),
        version: version.to_owned(),
        numerics: crate::plan::NUMERICS_VERSION,
        host: String::new(),
        threads: 0,
        started: 0,
        finished: 0,
    }
}
