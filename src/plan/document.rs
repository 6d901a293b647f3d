//! The plan as a YAML document: what runs, where it came from, and its hash.

use super::compile::Compiled;
use super::evaluation::Evaluation;
use super::passes::LeftOut;
use super::{Plan, hash};
use crate::scenario::Scenario;
use serde::{Deserialize, Serialize};

/// Version of this document's layout.
pub const DOCUMENT_VERSION: u32 = 2;

/// A text that belongs to a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EmbeddedSource {
    pub name: String,
    /// BLAKE3 of the text.
    pub hash: String,
    pub text: String,
}

impl EmbeddedSource {
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let text = text.into();
        Self { name: name.into(), hash: blake3::hash(text.as_bytes()).to_hex().to_string(), text }
    }
}

/// `--set name=value`, as it was given.
#[derive(Serialize)]
struct Setting<'a> {
    name: &'a str,
    value: &'a str,
}

/// A `param` of the scene with the value it had.
#[derive(Serialize)]
struct Parameter<'a> {
    name: &'a str,
    /// In SI.
    value: f64,
    si_unit: String,
    /// As written; null for a value that is worked out.
    unit: Option<&'a str>,
    is_set: bool,
}

#[derive(Serialize)]
struct WrittenDocument<'a> {
    document: u32,
    plan_hash: &'a str,
    settings: Vec<Setting<'a>>,
    parameters: Vec<Parameter<'a>>,
    plan: &'a Plan,
    evaluation: &'a Evaluation,
    left_out: &'a [LeftOut],
    sources: &'a [EmbeddedSource],
}

#[derive(Deserialize)]
struct ReadDocument {
    document: u32,
    plan_hash: String,
    plan: Plan,
    evaluation: Evaluation,
}

/// The YAML text of a compiled plan, with what the scene and the command line set.
pub fn write(compiled: &Compiled, scenario: &Scenario, sources: &[EmbeddedSource]) -> String {
    let settings = scenario.settings.iter().map(|(name, value)| Setting { name, value });
    let parameters = scenario.parameters.iter().map(|parameter| Parameter {
        name: &parameter.name,
        value: parameter.value,
        si_unit: parameter.dimension.unit_text(),
        unit: parameter.unit.as_deref(),
        is_set: parameter.is_set,
    });
    let document = WrittenDocument {
        document: DOCUMENT_VERSION,
        plan_hash: &compiled.hash,
        settings: settings.collect(),
        parameters: parameters.collect(),
        plan: &compiled.plan,
        evaluation: &compiled.evaluation,
        left_out: &compiled.left_out,
        sources,
    };
    serde_yaml::to_string(&document).expect("a plan is made of numbers, lists and names")
}

/// Reads a plan back; one sentence if the text is no plan, or not the one whose hash it carries.
pub fn read(text: &str) -> Result<(Plan, Evaluation), String> {
    let document: ReadDocument =
        serde_yaml::from_str(text).map_err(|error| format!("not a plan: {error}"))?;
    if document.document != DOCUMENT_VERSION {
        return Err(format!(
            "a plan document of version {}; this program reads {DOCUMENT_VERSION}",
            document.document
        ));
    }
    document.plan.check()?;
    if hash(&document.plan) != document.plan_hash {
        return Err("the plan does not have the hash that it carries: it was changed by hand".to_owned());
    }
    Ok((document.plan, document.evaluation))
}
