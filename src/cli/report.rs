//! `lamella report`: one page and its numbers from the tables of a run or a sweep.

use super::files::write_whole;
use super::{CommandResult, Exit, Stopped, Terminal};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::report::{self, ReportError};
use lamella::table::TableError;
use std::path::{Path, PathBuf};

/// Draw report.html from the tables of a run or a sweep
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Folder of the results, such as results/gramling
    folder: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let written = write(&arguments.folder)?;
    if !terminal.is_quiet() {
        let (path, numbers) = (written.page.display().to_string(), written.numbers.display().to_string());
        let text = if terminal.is_json() {
            serde_json::json!({ "report": path, "folder": numbers, "files": written.files }).to_string()
                + "\n"
        } else {
            format!("report:   {path}\nnumbers:  {numbers} ({} CSV files)\n", written.files.len())
        };
        terminal.product(&text)?;
    }
    Ok(Exit::Done)
}

/// What a report consists of.
pub(crate) struct Written {
    pub(crate) page: PathBuf,
    numbers: PathBuf,
    files: Vec<String>,
}

/// Draws the report of a folder into it.
pub(crate) fn write(folder: &Path) -> Result<Written, Stopped> {
    let page = report::report(folder).map_err(|error| failed(&error))?;
    let numbers = folder.join("report");
    std::fs::create_dir_all(&numbers)
        .map_err(|error| super::files::unwritable(&numbers, &error.to_string()))?;
    remove_earlier(&numbers);
    for (name, text) in &page.files {
        write_whole(&numbers.join(name), text)?;
    }
    let path = folder.join("report.html");
    write_whole(&path, &page.html)?;
    Ok(Written { page: path, numbers, files: page.files.into_iter().map(|(name, _)| name).collect() })
}

/// Numbers of an earlier report that this one may not have; other files stay.
fn remove_earlier(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.ends_with(".csv") && report::FILE_STEMS.iter().any(|stem| name.starts_with(stem)) {
            drop(std::fs::remove_file(path));
        }
    }
}

fn failed(error: &ReportError) -> Stopped {
    let message = Diagnostic::error(codes::F101, error.to_string());
    match error {
        ReportError::NoResults(_) => {
            let help = "`lamella run scene.lam` writes results/scene; give that folder. The tables of a sweep \
                        are made by `lamella gather`";
            Stopped::new(Exit::SceneWrong, message.help(help))
        }
        // What is damaged was whole once: running again makes it anew.
        ReportError::Table(TableError::Foreign { .. } | TableError::Format { .. }) => {
            Stopped::new(Exit::Failed, message.help("run the scene again to make the folder anew"))
        }
        ReportError::Mixed { .. } => {
            let help = "run the scene again, or `lamella gather` the sweep, to make the tables anew";
            Stopped::new(Exit::Failed, message.help(help))
        }
        ReportError::Table(_) | ReportError::Text { .. } => Stopped::new(Exit::Failed, message),
    }
}
