//! What the user is told: coded, spanned messages with help, collected and never thrown.
//!
//! Owns the message type, the list of codes and their rendering as text and JSON. May use `source`.
//! It deliberately decides nothing: the phases decide, this module carries.

pub mod codes;
mod number;
pub mod render;

use crate::source::Span;
pub use codes::Code;
pub use number::{number, precise};

/// How a message weighs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// For information; nothing to mend.
    Note,
    /// The scene runs, but the result may not be what was meant.
    Warning,
    /// The scene is well-formed and cannot work as asked (a limit computed from the scene says so).
    Refused,
    /// The scene is wrong.
    Error,
}

/// A place in the text and what is said there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    pub span: Span,
    pub text: String,
    /// The primary label carries the header's line and column.
    pub is_primary: bool,
}

/// One message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    pub code: Code,
    pub severity: Severity,
    pub message: String,
    pub labels: Vec<Label>,
    /// What stands there, in the user's terms (a token, a dimension, a value).
    pub found: Option<String>,
    /// What would be right there.
    pub expected: Option<String>,
    /// Lines of explanation (`= …`).
    pub notes: Vec<String>,
    /// Lines of help: what to write instead.
    pub help: Vec<String>,
}

impl Diagnostic {
    fn new(severity: Severity, code: Code, message: impl Into<String>) -> Self {
        Self {
            code,
            severity,
            message: message.into(),
            labels: Vec::new(),
            found: None,
            expected: None,
            notes: Vec::new(),
            help: Vec::new(),
        }
    }

    pub fn error(code: Code, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, code, message)
    }

    pub fn refused(code: Code, message: impl Into<String>) -> Self {
        Self::new(Severity::Refused, code, message)
    }

    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, code, message)
    }

    pub fn remark(code: Code, message: impl Into<String>) -> Self {
        Self::new(Severity::Note, code, message)
    }

    /// Adds the primary label: the place the message is about.
    pub fn at(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into(), is_primary: true });
        self
    }

    /// Adds a secondary label: a place that explains.
    pub fn also(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into(), is_primary: false });
        self
    }

    pub fn found(mut self, found: impl Into<String>) -> Self {
        self.found = Some(found.into());
        self
    }

    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help.push(help.into());
        self
    }

    /// Whether a scene with this message can still run.
    pub fn is_fatal(&self) -> bool {
        self.severity >= Severity::Refused
    }

    /// The place the message is about, if it has one.
    pub fn primary_span(&self) -> Option<Span> {
        self.labels.iter().find(|label| label.is_primary).map(|label| label.span)
    }
}

/// Whether any message of a list stops the scene.
pub fn any_fatal(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(Diagnostic::is_fatal)
}

/// The closest of `candidates` to a misspelt `name`, if it is close enough to be meant.
///
/// Distance is Damerau–Levenshtein over characters, at most a third of the longer word (and at
/// least one); a word that differs in case only always counts.
pub fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let n_chars = name.chars().count();
    candidates
        .into_iter()
        .filter(|candidate| *candidate != name)
        .filter_map(|candidate| {
            if candidate.eq_ignore_ascii_case(name) {
                return Some((0, candidate));
            }
            let allowed = (n_chars.max(candidate.chars().count()) / 3).max(1);
            let distance = strsim::damerau_levenshtein(name, candidate);
            // A whole different one-letter name is not a misspelling of another one.
            let is_close = distance <= allowed && distance < n_chars;
            is_close.then_some((distance, candidate))
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}
