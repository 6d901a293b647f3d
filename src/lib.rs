//! Lamella: scenes of Lagrangian reactive transport, from text to tables.
//!
//! The flow: [`syntax::tree::File`] → `Scenario` → [`plan::Plan`] → [`engine::snapshot::Snapshot`] → `Table` → `Report`.

pub mod catalog;
pub mod chemistry;
pub mod data;
pub mod diagnostic;
pub mod engine;
pub mod estimate;
pub mod flow;
pub mod maths;
pub mod measure;
pub mod plan;
pub mod report;
pub mod scenario;
pub mod source;
pub mod state;
pub mod stop;
pub mod stress;
pub mod sweep;
pub mod syntax;
pub mod table;
pub mod units;

use diagnostic::{Diagnostic, any_fatal};
use flow::Flows;
use plan::compile::{Compiled, Options, compile};
use scenario::{Scenario, Settings, Uses};
use source::{FileId, Sources};
use std::sync::Arc;
use syntax::tree;

/// How far a scene came on its way from text to plan, and everything that is to be said about it.
#[derive(Debug, Clone)]
pub struct Checked {
    /// The scene's files; settings of the command line are appended, so that messages can show them.
    pub sources: Sources,
    /// The first file; statements of used files are not in it.
    pub file: tree::File,
    /// The same with the statements that [`check_with`] was given besides.
    pub whole: tree::File,
    /// The files that it uses.
    pub uses: Uses,
    /// Absent if the scene is wrong. Of several used scenes it is that of the first sweep.
    pub scenario: Option<Scenario>,
    /// Absent if the scene is wrong or cannot run as asked.
    pub compiled: Option<Compiled>,
    /// Flows that were read on the way.
    pub flows: Arc<Flows>,
    pub diagnostics: Vec<Diagnostic>,
}

/// The scene of an alias in the first file of `sources`, as a tree: its own statements and those of the
/// used file. Without an alias it is what [`check`] takes to a plan; a file that uses no other is
/// itself. Mistakes are told by [`check`].
pub fn base(file: &tree::File, sources: &Sources, alias: Option<&str>) -> tree::File {
    Uses::read(file, sources).base(file, alias).0.into_owned()
}

/// Takes the first file of `sources` as far as it goes. Ends for every text, and never panics.
pub fn check(sources: Sources, settings: &Settings, options: &Options) -> Checked {
    check_with(sources, &[], settings, options)
}

/// The same with further statements: each text begins with its own `lamella 1`.
pub fn check_with(
    mut sources: Sources,
    further: &[(&str, String)],
    settings: &Settings,
    options: &Options,
) -> Checked {
    let (file, mut diagnostics) = syntax::parse(FileId(0), &sources.file(FileId(0)).text);
    let mut whole = file.clone();
    for (name, text) in further {
        let id = sources.add(*name, text.clone());
        let (more, messages) = syntax::parse(id, text);
        whole.statements.extend(more.statements);
        diagnostics.extend(messages);
    }
    let uses = Uses::read(&whole, &sources);
    diagnostics.extend(uses.syntax.iter().cloned());
    let has_syntax_errors = any_fatal(&diagnostics);
    diagnostics.extend(uses.diagnostics.iter().cloned());
    let mut scenario = None;
    if uses.are_whole {
        let (resolved, more) =
            scenario::resolve_all(&whole, &uses, &mut sources, settings, has_syntax_errors);
        diagnostics.extend(more);
        scenario = resolved.filter(|_| !any_fatal(&diagnostics));
    }
    let flows = Arc::new(Flows::default());
    if let Some(scenario) = &mut scenario {
        diagnostics.extend(flow::scene::attach(scenario, &sources, &flows));
    }
    scenario = scenario.filter(|_| !any_fatal(&diagnostics));
    let compiled = scenario.as_ref().and_then(|scenario| {
        let (compiled, more) = compile(scenario, options);
        diagnostics.extend(more);
        compiled
    });
    // What stops a scene comes before what it may be run with.
    diagnostics.sort_by_key(|diagnostic| !diagnostic.is_fatal());
    Checked { sources, file, whole, uses, scenario, compiled, flows, diagnostics }
}
