//! `sweep.json`: what a sweep was made of and what is to be drawn of it, in the shape of
//! `docs/schema/sweep-1.json`.
//!
//! Owns the shape and its version. May use nothing. It deliberately holds no result but the outcome of
//! the expectations: numbers stand in the tables.

use serde::{Deserialize, Serialize};

/// Version of this shape; a later one is refused.
pub const SWEEP_VERSION: u32 = 1;
/// Its name in the folder of results.
pub const SWEEP_FILE: &str = "sweep.json";

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepDescription {
    pub version: u32,
    /// Name of the sweep, and of the scene that it sweeps.
    pub name: String,
    pub scene: String,
    /// In the order of the sweep: the first varies slowest.
    pub axes: Vec<SweepAxis>,
    /// Points that have a number; those that a `skip` leaves out are counted apart.
    pub n_points: u64,
    pub n_skipped: u64,
    pub replicates: SweepReplicates,
    /// Root of all random numbers.
    pub seed: u64,
    pub has_common_random_numbers: bool,
    pub reports: Vec<SweepReport>,
    pub expectations: Vec<SweepExpectation>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepAxis {
    /// As the scene calls it: a parameter, `particles`, `step` or `bins`.
    pub name: String,
    /// The column of `points.parquet` that holds its values, which may have a longer name.
    pub column: String,
    /// SI unit of the values, `s`; `1` for numbers.
    pub unit: String,
    /// SI. Of an axis that sets several numbers, such as bins in two directions, their product.
    pub values: Vec<f64>,
    /// Axes with the same number go together; the others are multiplied.
    pub group: u32,
}

/// Runs of each point: `least`, or up to `most` until a condition holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SweepReplicates {
    pub least: u32,
    pub most: u32,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepReport {
    pub kind: SweepReportKind,
    /// Name of the measure, which is its column in `points.parquet`.
    pub measure: String,
    /// Of work–precision `wall_time`, `cpu_time` or a measure; of convergence and minimum axes.
    pub against: Vec<String>,
    /// Axes that tell series apart.
    pub by: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SweepReportKind {
    WorkPrecision,
    Convergence,
    Minimum,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepExpectation {
    /// As it stands in the scene: `order(err, particles) in -0.6 .. -0.4`.
    pub text: String,
    pub outcome: ExpectationOutcome,
    /// What was found, or why nothing can be said; may be empty.
    pub detail: String,
    /// Of an expected order, so that its slope can be drawn.
    pub order: Option<ExpectedOrder>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExpectationOutcome {
    Met,
    NotMet,
    /// Points are missing, or the condition is not defined for what was found.
    Unknown,
}

/// The slope of ln(mean of the measure) by ln(value of the axis).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExpectedOrder {
    pub measure: String,
    pub axis: String,
    pub low: f64,
    pub high: f64,
}

impl SweepDescription {
    /// One sentence if the text is no description, or of another version.
    pub fn from_json(text: &str) -> Result<Self, String> {
        #[derive(Deserialize)]
        struct Head {
            version: u32,
        }
        let wrong = |reason: serde_json::Error| format!("not the description of a sweep: {reason}");
        let head: Head = serde_json::from_str(text).map_err(wrong)?;
        if head.version != SWEEP_VERSION {
            return Err(format!(
                "the description of a sweep of version {}; this program reads {SWEEP_VERSION}",
                head.version
            ));
        }
        serde_json::from_str(text).map_err(wrong)
    }

    /// With a line break at the end; the same description gives the same bytes.
    pub fn to_json(&self) -> Result<String, String> {
        let text = serde_json::to_string_pretty(self);
        text.map(|text| text + "\n").map_err(|reason| format!("the sweep cannot be written: {reason}"))
    }

    pub fn axis(&self, name: &str) -> Option<&SweepAxis> {
        self.axes.iter().find(|axis| axis.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_another_version_is_refused() {
        let sweep = SweepDescription {
            version: SWEEP_VERSION,
            name: "convergence".to_owned(),
            scene: "column".to_owned(),
            axes: vec![SweepAxis {
                name: "step".to_owned(),
                column: "step".to_owned(),
                unit: "s".to_owned(),
                values: vec![0.25, 1.0 / 3.0],
                group: 0,
            }],
            n_points: 2,
            n_skipped: 0,
            replicates: SweepReplicates { least: 8, most: 64 },
            seed: u64::MAX,
            has_common_random_numbers: false,
            reports: vec![SweepReport {
                kind: SweepReportKind::WorkPrecision,
                measure: "err".to_owned(),
                against: vec!["wall_time".to_owned()],
                by: vec!["step".to_owned()],
            }],
            expectations: vec![SweepExpectation {
                text: "leak < 1e-12".to_owned(),
                outcome: ExpectationOutcome::NotMet,
                detail: "point 1: 2e-12".to_owned(),
                order: None,
            }],
        };
        let text = sweep.to_json().unwrap();
        assert!(text.contains("\"work_precision\"") && text.contains("\"not_met\""), "{text}");
        assert_eq!(SweepDescription::from_json(&text), Ok(sweep));
        let later = text.replacen("\"version\": 1", "\"version\": 2", 1);
        assert!(SweepDescription::from_json(&later).unwrap_err().contains("version 2"));
        assert!(SweepDescription::from_json("{}").unwrap_err().contains("version"));
    }
}
