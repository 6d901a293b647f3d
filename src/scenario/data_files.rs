//! Files of numbers that a scene names.
//!
//! Owns which names these are and where they may lie. May use the tree and the rule of paths. It deliberately reads
//! no file: callers put the bytes into the sources, or the reason why they could not.

use super::check::Checker;
use super::transport::flow_file::NamedFile;
use super::used::name_of;
use crate::data::DataFile;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{F105, F106};
use crate::source::{RefusedFile, Sources};
use crate::syntax::tree::{FileEntry, FileValue, FlowArgument, StatementKind, Text};
use std::sync::Arc;

/// What the checks know of the files of a scene.
#[derive(Debug, Default)]
pub(super) struct Files {
    /// Names of the texts, by their ids.
    texts: Vec<String>,
    data: Vec<Arc<DataFile>>,
    refused: Vec<RefusedFile>,
}

impl Files {
    pub(super) fn of(sources: &Sources) -> Self {
        Self {
            texts: sources.files().map(|(_, file)| file.name.clone()).collect(),
            data: sources.data().to_vec(),
            refused: sources.refused().to_vec(),
        }
    }
}

impl Checker<'_> {
    /// The file of numbers that a text names, by its name and hash.
    pub(super) fn data_file(&mut self, written: &Text) -> Option<NamedFile> {
        let file = self.file_of_numbers(written)?;
        Some(NamedFile { name: written.value.clone(), hash: file.hash.clone() })
    }

    /// The file of numbers that a text names.
    pub(super) fn file_of_numbers(&mut self, written: &Text) -> Option<Arc<DataFile>> {
        let (path, span) = (written.value.as_str(), written.span);
        let text = self.files.texts.get(usize::from(span.file.0)).map_or("", String::as_str);
        let outside = || {
            Diagnostic::error(F106, "a file lies outside of the folder of its scene")
                .at(span, "this does not stay in the folder of this file")
                .found(format!("\"{path}\""))
                .expected("a path such as \"field.csv\" or \"flows/field.csv\"")
                .help("copy the file into the folder of this scene, or the scene to it")
        };
        let Some(name) = name_of(text, path) else {
            self.report(outside());
            return None;
        };
        if let Some(file) = self.files.data.iter().find(|file| file.name == name) {
            return Some(file.clone());
        }
        let message = match self.files.refused.iter().find(|file| file.name == name) {
            Some(refused) if refused.is_outside => outside().note(refused.reason.clone()),
            refused => {
                let reason = refused.map_or_else(|| format!("{name} is not there"), |it| it.reason.clone());
                Diagnostic::error(F105, format!("cannot read \"{path}\""))
                    .at(span, reason)
                    .found(format!("\"{path}\""))
                    .expected("a file, with its path from the folder of this file")
            }
        };
        self.report(message);
        None
    }
}

/// The names, among the sources, of the files of numbers that the texts of a scene name. Paths that leave the folder
/// of their text are not among them: a scene may not look there.
pub fn wanted_data(sources: &Sources) -> Vec<String> {
    let mut list: Vec<String> = Vec::new();
    for (id, file) in sources.files() {
        let begins = |word: &str| {
            file.text.lines().any(|line| line.trim_start_matches('\u{feff}').trim_start().starts_with(word))
        };
        if !begins("flow") && !begins("data") {
            continue;
        }
        let (tree, _) = crate::syntax::parse(id, &file.text);
        for text in tree.statements.iter().flat_map(|statement| named_by(&statement.kind)) {
            if let Some(name) = name_of(&file.name, &text.value)
                && !list.contains(&name)
            {
                list.push(name);
            }
        }
    }
    list
}

/// The files of numbers that a statement names.
fn named_by(kind: &StatementKind) -> Vec<&Text> {
    match kind {
        StatementKind::Data(data) => vec![&data.path],
        StatementKind::Flow(flow) => match &flow.argument {
            FlowArgument::Files(names, entries) => {
                names.iter().chain(entries.iter().flat_map(texts)).collect()
            }
            _ => Vec::new(),
        },
        _ => Vec::new(),
    }
}

/// File names among the entries: `grid "model.dis.grb"`. A column in quotes has a unit, or stands in a list that is
/// looked up by the word before it.
fn texts(entry: &FileEntry) -> impl Iterator<Item = &Text> {
    let columns = match &entry.value {
        FileValue::Columns(list) if matches!(entry.word.value.as_str(), "grid" | "heads") => list.as_slice(),
        _ => &[],
    };
    columns.iter().filter(|column| column.is_quoted).map(|column| &column.name)
}
