//! The report of a folder of results: one page that holds everything, and the numbers of its figures.
//!
//! Owns the order of the sections. May use the tables, `sweep.json`, `plan.yaml`, the crate, and the
//! figures of `report`. It deliberately runs nothing and judges nothing: the same folder gives the same bytes.

mod along;
mod balance;
mod bands;
mod budget;
mod convergence;
mod courses;
mod csv;
mod html;
mod maps;
mod minimum;
mod numbers;
mod provenance;
mod quantity;
mod series;
mod stats;
mod study;
mod work;

use super::ro_crate::{self, CRATE_FILE};
use super::sweep::{ExpectationOutcome, SWEEP_FILE, SweepDescription, SweepReportKind};
use crate::table::scan::parts;
use crate::table::{Footer, Kind, TableError, read};
use html::{Section, escape, paragraph, table};
use provenance::PlanText;
use std::fmt;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use study::Study;

/// A page and the tables beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    pub html: String,
    /// Name and content of each CSV file.
    pub files: Vec<(String, String)>,
}

/// What the names of the CSV files begin with.
pub const FILE_STEMS: [&str; 10] = [
    "convergence-",
    "minimum-",
    "minima-",
    "orders-",
    "work_precision-",
    "mass_budget.",
    "profile.",
    "covariance.",
    "total.",
    "mixing.",
];

/// Why there is no report.
#[derive(Debug)]
pub enum ReportError {
    /// The folder holds no results.
    NoResults(PathBuf),
    Table(TableError),
    Text {
        path: PathBuf,
        reason: String,
    },
    /// A table that tells of another plan than `points.parquet`.
    Mixed {
        file: PathBuf,
    },
}

impl fmt::Display for ReportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoResults(folder) => {
                write!(f, "`{}` holds no results: it has no points.parquet", folder.display())
            }
            Self::Table(error) => error.fmt(f),
            Self::Text { path, reason } => write!(f, "cannot read `{}`: {reason}", path.display()),
            Self::Mixed { file } => write!(
                f,
                "`{}` and the points.parquet of the folder are of two plans or two scenes",
                file.display()
            ),
        }
    }
}

impl std::error::Error for ReportError {}

impl From<TableError> for ReportError {
    fn from(error: TableError) -> Self {
        Self::Table(error)
    }
}

/// Tables that were copied together are no result.
fn of_one_plan(folder: &Path, points: &Footer) -> Result<(), ReportError> {
    for kind in Kind::ALL {
        for file in parts(folder, kind) {
            let footer = read::footer(&file)?;
            if footer.plan != points.plan || footer.scene != points.scene {
                return Err(ReportError::Mixed { file });
            }
        }
    }
    Ok(())
}

/// Makes the report of a folder, of a sweep or of a single run, from its tables alone.
pub fn report(folder: &Path) -> Result<Page, ReportError> {
    let points = folder.join("points.parquet");
    if !points.is_file() {
        return Err(ReportError::NoResults(folder.to_path_buf()));
    }
    let sweep = match text(&folder.join(SWEEP_FILE))? {
        Some(text) => {
            let path = folder.join(SWEEP_FILE);
            Some(SweepDescription::from_json(&text).map_err(|reason| ReportError::Text { path, reason })?)
        }
        None => None,
    };
    let plan = text(&folder.join("plan.yaml"))?.map(|text| PlanText::read(&text)).unwrap_or_default();
    let facts = text(&folder.join(CRATE_FILE))?.map(|text| ro_crate::facts(&text)).unwrap_or_default();
    let footer = read::footer(&points)?;
    of_one_plan(folder, &footer)?;
    let study = Study::read(&points, sweep.as_ref())?;
    let mut book = Book::default();
    if let Some(sweep) = &sweep {
        book.expectations(sweep);
        book.reports(&study, sweep);
    } else {
        numbers::measures(&study).into_iter().for_each(|html| book.add("measures", "Measures", html));
        numbers::errors(folder)?
            .into_iter()
            .for_each(|html| book.add("errors", "Errors against references", html));
    }
    let (mut html, files) = bands::bands(folder, &study)?;
    html += &maps::maps(folder, &study)?;
    if !html.is_empty() {
        book.add("results", "Results", html);
        book.files(files);
    }
    let (html, files) = budget::budget(&study);
    book.add("mass", "Mass budget", html);
    book.add("mass", "Mass budget", balance::balances(folder, &study)?);
    book.files(files);
    book.failures(&study);
    book.add("left-out", "Left out of the runs", provenance::omissions(&plan));
    let origin = provenance::Origin { footer: &footer, sweep: sweep.as_ref(), plan: &plan, facts: &facts };
    book.add("provenance", "Provenance", provenance::provenance(&study, &origin));
    let scene_title = footer.scene.title.as_deref().unwrap_or(&footer.scene.name);
    let title = match &sweep {
        Some(sweep) => format!("{scene_title}: sweep {}", sweep.name),
        None => scene_title.to_owned(),
    };
    let html = html::page(&title, &summary(&study, sweep.as_ref()), &book.sections);
    Ok(Page { html, files: book.files })
}

/// A text that may be absent.
fn text(path: &Path) -> Result<Option<String>, ReportError> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(ReportError::Text { path: path.to_path_buf(), reason: error.to_string() }),
    }
}

/// Sections and files in the order they come.
#[derive(Default)]
struct Book {
    sections: Vec<Section>,
    files: Vec<(String, String)>,
}

impl Book {
    fn add(&mut self, id: &'static str, heading: &str, body: String) {
        match self.sections.iter_mut().find(|section| section.id == id) {
            Some(section) => section.body += &body,
            None => self.sections.push(Section { id, heading: heading.to_owned(), body }),
        }
    }

    /// A table that is asked for twice is there once.
    fn files(&mut self, files: Vec<(String, String)>) {
        for file in files {
            if !self.files.iter().any(|(name, _)| *name == file.0) {
                self.files.push(file);
            }
        }
    }

    fn expectations(&mut self, sweep: &SweepDescription) {
        if sweep.expectations.is_empty() {
            return;
        }
        let rows: Vec<_> = sweep
            .expectations
            .iter()
            .map(|expectation| {
                let outcome = match expectation.outcome {
                    ExpectationOutcome::Met => "✓ met",
                    ExpectationOutcome::NotMet => "✗ not met",
                    ExpectationOutcome::Unknown => "? not known",
                };
                vec![outcome.to_owned(), expectation.text.clone(), expectation.detail.clone()]
            })
            .collect();
        self.add("expectations", "Expectations", table(&["", "expected", "found"], &rows));
    }

    fn reports(&mut self, study: &Study, sweep: &SweepDescription) {
        for report in &sweep.reports {
            let (id, heading, (html, files)) = match report.kind {
                SweepReportKind::WorkPrecision => {
                    ("work-precision", "Work and precision", work::work_precision(study, report))
                }
                SweepReportKind::Convergence => {
                    ("convergence", "Convergence", convergence::convergence(study, sweep, report))
                }
                SweepReportKind::Minimum => ("minimum", "Where it is least", minimum::minimum(study, report)),
            };
            self.add(id, heading, html);
            self.files(files);
        }
    }

    fn failures(&mut self, study: &Study) {
        let n = study.n_failed + study.n_interrupted;
        if n == 0 {
            return;
        }
        let row = |failed: &study::Failed| {
            vec![
                failed.point.to_string(),
                failed.replicate.to_string(),
                format!("{} {}", failed.status, failed.code).trim_end().to_owned(),
                failed.message.clone(),
                failed.key.chars().take(12).collect(),
            ]
        };
        let rows: Vec<_> = study.failed.iter().map(row).collect();
        let mut html = table(&["point", "replicate", "status", "message", "key"], &rows);
        if n > rows.len() as u64 {
            html += &paragraph(&format!("{} more stand in points.parquet.", n - rows.len() as u64));
        }
        self.add("failed", "Failed points", html);
    }
}

/// The paragraph that a hurried reader reads.
fn summary(study: &Study, sweep: Option<&SweepDescription>) -> String {
    let mut text = match sweep {
        Some(sweep) => points_sentence(study, sweep),
        None => run_sentence(study),
    };
    text += &format!(
        "{} {} of wall time and {} of CPU time.",
        if sweep.is_some() { " The runs took, added up," } else { " It took" },
        quantity::duration(study.wall),
        quantity::duration(study.cpu)
    );
    if let Some(worst) = study.worst_defect {
        let at = match sweep {
            Some(_) if worst.value > 0.0 => {
                format!(" (point {}, replicate {})", worst.point, worst.replicate)
            }
            _ => String::new(),
        };
        text += &format!(" The worst mass defect is {}{at}.", quantity::number(worst.value));
    }
    let mut html = escape(&text);
    if let Some(sweep) = sweep.filter(|sweep| !sweep.expectations.is_empty()) {
        let count = |outcome| sweep.expectations.iter().filter(|e| e.outcome == outcome).count();
        let all = sweep.expectations.len();
        let met = count(ExpectationOutcome::Met);
        let are = if all == 1 { "expectation is" } else { "expectations are" };
        html += &format!(" {met} of {all} {are} met");
        match (count(ExpectationOutcome::NotMet), count(ExpectationOutcome::Unknown)) {
            (0, 0) => {}
            (0, unknown) => html += &format!(", {unknown} not known"),
            (wrong, 0) => html += &format!(", <strong>{wrong} not</strong>"),
            (wrong, unknown) => html += &format!(", <strong>{wrong} not</strong>, {unknown} not known"),
        }
        html += ".";
    }
    format!("<p class=\"lead\">{html}</p>\n")
}

fn points_sentence(study: &Study, sweep: &SweepDescription) -> String {
    let n_runs = study.n_done + study.n_failed + study.n_interrupted;
    let replicates = match (sweep.replicates.least, sweep.replicates.most) {
        (1, 1) => "one replicate each".to_owned(),
        (least, most) if least == most => format!("{least} replicates each"),
        (least, most) => format!("{least} to {most} replicates each"),
    };
    let mut text =
        format!("{} points with {replicates}: {n_runs} runs, {} done", sweep.n_points, study.n_done);
    if study.n_failed > 0 {
        text += &format!(", {} failed", study.n_failed);
    }
    if study.n_interrupted > 0 {
        text += &format!(", {} interrupted", study.n_interrupted);
    }
    text += ".";
    let n_missing = sweep.n_points.saturating_sub(study.points.len() as u64);
    if n_missing > 0 {
        text += &format!(" {n_missing} points have not run yet.");
    }
    if sweep.n_skipped > 0 {
        text += &format!(" {} points were skipped by the scene.", sweep.n_skipped);
    }
    text
}

fn run_sentence(study: &Study) -> String {
    match (study.n_done, study.n_failed + study.n_interrupted) {
        (1, 0) => "One run, done.".to_owned(),
        (done, other) => format!("{} runs, {done} done.", done + other),
    }
}
