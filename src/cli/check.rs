//! `lamella check`: all mistakes that can be found without a run.

use super::load;
use super::{CommandResult, Exit, Terminal};
use lamella::diagnostic::any_fatal;
use lamella::scenario::Settings;
use std::path::{Path, PathBuf};

/// Find all mistakes in scenes, without a run
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Scene files; `-` is standard input
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Set a parameter, or particles, step, bins; such as v=2cm/s, particles=1e5
    #[arg(long, value_name = "NAME=VALUE", value_parser = load::parse_setting)]
    set: Vec<(String, String)>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let settings = Settings { set: arguments.set.clone(), ..Settings::default() };
    let mut exit = Exit::Done;
    for path in &arguments.files {
        exit = exit.max(check_one(path, &settings, terminal));
    }
    Ok(exit)
}

/// A file that cannot be read does not keep the others from being checked.
fn check_one(path: &Path, settings: &Settings, terminal: &Terminal) -> Exit {
    let checked = match load::load(path, settings, false) {
        Ok(checked) => checked,
        Err(stopped) => return terminal.stopped(stopped),
    };
    terminal.diagnostics(&checked.diagnostics, &checked.sources);
    if any_fatal(&checked.diagnostics) {
        return Exit::SceneWrong;
    }
    terminal.remark(&format!("{}: no mistakes", super::files::display_name(path)));
    Exit::Done
}
