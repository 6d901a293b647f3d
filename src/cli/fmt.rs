//! `lamella fmt`: one layout for all scenes; never another meaning.

use super::files::{display_name, is_stdin, read_scene, write_whole};
use super::{CommandResult, Exit, Stopped, Terminal};
use lamella::diagnostic::any_fatal;
use lamella::source::{FileId, Sources};
use lamella::syntax;
use std::path::{Path, PathBuf};

/// Lay out scenes in one way
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Scene files; `-` is standard input, written to standard output
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Change nothing; name the files that would change and exit with 1
    #[arg(long)]
    check: bool,
    /// Write to standard output instead of the file
    #[arg(long, conflicts_with = "check")]
    stdout: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let mut exit = Exit::Done;
    for path in &arguments.files {
        let one = format_one(path, arguments, terminal).unwrap_or_else(|stopped| terminal.stopped(stopped));
        exit = exit.max(one);
    }
    Ok(exit)
}

fn format_one(path: &Path, arguments: &Arguments, terminal: &Terminal) -> Result<Exit, Stopped> {
    let sources = Sources::single(display_name(path), read_scene(path)?);
    let text = &sources.file(FileId(0)).text;
    let (tree, diagnostics) = syntax::parse(FileId(0), text);
    if any_fatal(&diagnostics) {
        terminal.diagnostics(&diagnostics, &sources);
        return Ok(Exit::SceneWrong);
    }
    let formatted = syntax::format(&tree, text);
    let is_changed = formatted != *text;
    if arguments.check {
        if is_changed {
            terminal.remark(&format!("{}: would change", display_name(path)));
        }
        return Ok(if is_changed { Exit::Failed } else { Exit::Done });
    }
    if arguments.stdout || is_stdin(path) {
        terminal.product(&formatted)?;
    } else if is_changed {
        write_whole(path, &formatted)?;
    }
    Ok(Exit::Done)
}
