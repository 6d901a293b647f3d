//! The plan as a YAML document: what runs, where it came from, and its hash.

use super::compile::Compiled;
use super::evaluation::Evaluation;
use super::passes::LeftOut;
use super::{Plan, hash};
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

#[derive(Serialize)]
struct WrittenDocument<'a> {
    document: u32,
    plan_hash: &'a str,
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

/// The YAML text of a compiled plan.
pub fn write(compiled: &Compiled, sources: &[EmbeddedSource]) -> String {
    let document = WrittenDocument {
        document: DOCUMENT_VERSION,
        plan_hash: &compiled.hash,
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
