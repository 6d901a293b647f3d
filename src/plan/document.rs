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

/// A file of numbers that a scene reads; its bytes stand beside the plan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NamedData {
    /// From the folder of the scene.
    pub name: String,
    /// BLAKE3 of the bytes.
    pub hash: String,
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
    #[serde(skip_serializing_if = "<[NamedData]>::is_empty")]
    data: &'a [NamedData],
}

#[derive(Deserialize)]
struct ReadDocument {
    document: u32,
    plan_hash: String,
    plan: Plan,
    evaluation: Evaluation,
}

/// The YAML text of a compiled plan, with what the scene and the command line set.
pub fn write(
    compiled: &Compiled,
    scenario: &Scenario,
    sources: &[EmbeddedSource],
    data: &[NamedData],
) -> String {
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
        data,
    };
    serde_yaml::to_string(&document).expect("a plan is made of numbers, lists and names")
}

/// Where a plan comes from: what is needed to make it again.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// `--set name=value`, in order.
    pub settings: Vec<(String, String)>,
    pub seed: u64,
    /// The scene, then the files that it uses.
    pub sources: Vec<EmbeddedSource>,
    pub data: Vec<NamedData>,
}

impl Origin {
    /// The name of the scene's file without its ending.
    pub fn scene_name(&self) -> String {
        let name = self.sources.first().map_or("scene.lam", |source| source.name.as_str());
        name.strip_suffix(".lam").unwrap_or(name).to_owned()
    }

    /// Names and texts of the used files.
    pub fn used(&self) -> impl Iterator<Item = (&str, &str)> {
        self.sources.iter().skip(1).map(|source| (source.name.as_str(), source.text.as_str()))
    }
}

/// Reads where a plan comes from; one sentence if the text does not tell.
pub fn origin(text: &str) -> Result<Origin, String> {
    #[derive(Deserialize)]
    struct ReadSetting {
        name: String,
        value: String,
    }
    #[derive(Deserialize)]
    struct Seeded {
        seed: u64,
    }
    #[derive(Deserialize)]
    struct ReadOrigin {
        settings: Vec<ReadSetting>,
        plan: Seeded,
        sources: Vec<EmbeddedSource>,
        #[serde(default)]
        data: Vec<NamedData>,
    }
    let read: ReadOrigin = serde_yaml::from_str(text).map_err(|error| format!("not a plan: {error}"))?;
    let settings = read.settings.into_iter().map(|setting| (setting.name, setting.value)).collect();
    Ok(Origin { settings, seed: read.plan.seed, sources: read.sources, data: read.data })
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
