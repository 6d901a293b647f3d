//! `lamella plan`: what would run, what it costs, what was left out and why.

use super::files::display_name;
use super::{CommandResult, Exit, Terminal, load, record};
use clap::ValueEnum;
use lamella::Checked;
use lamella::diagnostic::any_fatal;
use lamella::plan::document;
use lamella::plan::explain::explain;
use lamella::scenario::Settings;
use lamella::source::FileId;
use std::path::PathBuf;

/// Show what would run, what it costs, and what was left out and why
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Scene file; `-` is standard input
    file: PathBuf,
    /// Print a station on the way from text to run instead
    #[arg(long, value_enum)]
    emit: Option<Emit>,
    /// Set a parameter, or particles, step, bins; such as v=2cm/s, particles=1e5
    #[arg(long, value_name = "NAME=VALUE", value_parser = load::parse_setting)]
    set: Vec<(String, String)>,
    /// Root of all random numbers, instead of the scene's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Of several used scenes the one that this sweep is of [default: that of the first sweep]
    #[arg(long, value_name = "NAME")]
    sweep: Option<String>,
    /// Leave nothing out
    #[arg(long)]
    no_passes: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Emit {
    /// The text as a tree
    Tree,
    /// Names resolved, everything in SI
    Scenario,
    /// What the engine is given
    Plan,
    /// The plan as results keep it, with its hash
    Yaml,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let settings = Settings {
        set: arguments.set.clone(),
        seed: arguments.seed,
        sweep: arguments.sweep.clone(),
        ..Settings::default()
    };
    let checked = load::load(&arguments.file, &settings, arguments.no_passes)?;
    terminal.diagnostics(&checked.diagnostics, &checked.sources);
    if let Some(text) = product(arguments, &checked) {
        terminal.product(&text)?;
    }
    Ok(if any_fatal(&checked.diagnostics) { Exit::SceneWrong } else { Exit::Done })
}

/// The files of numbers that the scene reads, as a section of the plan.
fn files_of_numbers(checked: &Checked) -> String {
    let files = super::data::named_data(&checked.sources);
    let lines = files.iter().map(|file| format!("  {}, BLAKE3 {}\n", file.name, file.hash));
    let lines: String = lines.collect();
    if lines.is_empty() { lines } else { format!("\nfiles of numbers\n{lines}") }
}

/// What was asked for, if the scene came that far.
fn product(arguments: &Arguments, checked: &Checked) -> Option<String> {
    let compiled = checked.compiled.as_ref();
    let scenario = checked.scenario.as_ref();
    match arguments.emit {
        Some(Emit::Tree) => Some(format!("{:#?}\n", checked.file)),
        Some(Emit::Scenario) => scenario.map(|scenario| format!("{scenario:#?}\n")),
        Some(Emit::Plan) => compiled.map(|compiled| format!("{:#?}\n", compiled.plan)),
        Some(Emit::Yaml) => {
            let name = checked.sources.file(FileId(0)).name.clone();
            let sources = record::embedded(checked, name);
            let data = super::data::named_data(&checked.sources);
            Some(document::write(compiled?, scenario?, &sources, &data))
        }
        None => compiled.map(|compiled| {
            let title = scenario.and_then(|scenario| scenario.title.as_deref());
            let mut text = explain(compiled, &display_name(&arguments.file), title);
            text.push_str(&files_of_numbers(checked));
            text
        }),
    }
}
