//! Source text: files, byte spans, lines and columns.
//!
//! Owns the text of every file that a scene is made of, and its files of numbers. May use these only.
//! It deliberately does not read from disk: callers hand in the text.

use crate::data::DataFile;
use std::sync::Arc;

/// Which file of a [`Sources`] a span lies in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct FileId(pub u16);

/// A half-open byte range `start..end` in one file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Span {
    pub file: FileId,
    pub start: u32,
    pub end: u32,
}

impl Span {
    /// The span `start..end` of `file`; files are refused above 4 GiB long before this.
    pub fn new(file: FileId, start: usize, end: usize) -> Self {
        debug_assert!(start <= end);
        Self { file, start: start as u32, end: end as u32 }
    }

    /// The smallest span that covers both; both must lie in one file.
    pub fn to(self, other: Span) -> Self {
        debug_assert_eq!(self.file, other.file);
        Self { file: self.file, start: self.start.min(other.start), end: self.end.max(other.end) }
    }

    /// Like [`Span::to`], or this span alone if the other lies in another file.
    pub fn to_if_same_file(self, other: Span) -> Self {
        if self.file == other.file { self.to(other) } else { self }
    }

    /// The byte range, for slicing the text.
    pub fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// A value with the place where it was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Spanned<T> {
    pub value: T,
    pub span: Span,
}

impl<T> Spanned<T> {
    pub fn new(value: T, span: Span) -> Self {
        Self { value, span }
    }
}

/// One file: its name as the user gave it, and its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceFile {
    pub name: String,
    pub text: String,
}

/// A file that a scene uses and that could not be had.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RefusedFile {
    pub name: String,
    /// One sentence for the user.
    pub reason: String,
    /// Whether it lies where scenes may not look.
    pub is_outside: bool,
}

/// All files of one scene; the first is the scene itself.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sources {
    files: Vec<SourceFile>,
    data: Vec<Arc<DataFile>>,
    refused: Vec<RefusedFile>,
}

impl Sources {
    /// A scene that consists of one file.
    pub fn single(name: impl Into<String>, text: impl Into<String>) -> Self {
        let mut sources = Self::default();
        sources.add(name, text);
        sources
    }

    /// Adds a file and returns its id.
    ///
    /// # Panics
    /// If there are more than 65,535 files; `scenario` bounds includes far below.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        let id = u16::try_from(self.files.len()).expect("number of files is bounded by the caller");
        self.files.push(SourceFile { name: name.into(), text: text.into() });
        FileId(id)
    }

    /// Adds a file of numbers, once under each name.
    pub fn add_data(&mut self, file: Arc<DataFile>) {
        if self.find_data(&file.name).is_none() {
            self.data.push(file);
        }
    }

    /// The file of numbers of that name.
    pub fn find_data(&self, name: &str) -> Option<&Arc<DataFile>> {
        self.data.iter().find(|file| file.name == name)
    }

    /// All files of numbers.
    pub fn data(&self) -> &[Arc<DataFile>] {
        &self.data
    }

    /// Notes that a file which the scene uses cannot be had, so that a message can say why.
    pub fn refuse(&mut self, file: RefusedFile) {
        self.refused.push(file);
    }

    /// Why a file is not among the sources.
    pub fn refusal(&self, name: &str) -> Option<&RefusedFile> {
        self.refused.iter().find(|file| file.name == name)
    }

    /// All files that could not be had.
    pub fn refused(&self) -> &[RefusedFile] {
        &self.refused
    }

    /// The file of that name.
    pub fn find(&self, name: &str) -> Option<FileId> {
        self.files().find(|(_, file)| file.name == name).map(|(id, _)| id)
    }

    pub fn file(&self, id: FileId) -> &SourceFile {
        &self.files[usize::from(id.0)]
    }

    pub fn files(&self) -> impl Iterator<Item = (FileId, &SourceFile)> {
        self.files.iter().enumerate().map(|(idx, file)| (FileId(idx as u16), file))
    }

    /// The text that a span covers.
    pub fn slice(&self, span: Span) -> &str {
        &self.file(span.file).text[span.range()]
    }

    /// Line and column of a span's start, both from 1; the column counts characters.
    pub fn line_column(&self, span: Span) -> (usize, usize) {
        let text = &self.file(span.file).text;
        let mut start = (span.start as usize).min(text.len());
        while !text.is_char_boundary(start) {
            start -= 1;
        }
        let before = &text[..start];
        let line = before.bytes().filter(|&b| b == b'\n').count() + 1;
        let line_start = before.rfind('\n').map_or(0, |idx| idx + 1);
        (line, before[line_start..].chars().count() + 1)
    }
}
