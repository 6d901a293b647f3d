//! Messages as text for people and as JSON for tools.
//!
//! Owns the look of a message: header, place, quoted source, notes, help; and the JSON fields. May
//! use `source` and the message type. It deliberately prints nothing: it returns text.

use super::{Diagnostic, Label, Severity};
use crate::source::{FileId, Sources, Span};
use codespan_reporting::diagnostic as codespan;
use codespan_reporting::files::SimpleFiles;
use codespan_reporting::term::termcolor::{Ansi, Color, ColorSpec, NoColor, WriteColor};
use codespan_reporting::term::{self, Styles, StylesWriter};
use serde::Serialize;

/// Whether text carries ANSI colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    Plain,
    Ansi,
}

/// All messages as text, in the order given, an empty line after each.
pub fn text(diagnostics: &[Diagnostic], sources: &Sources, colour: Colour) -> String {
    let files = quotable_files(sources);
    let mut out = Vec::new();
    for diagnostic in diagnostics {
        match colour {
            Colour::Plain => write_one(&mut NoColor::new(&mut out), diagnostic, sources, &files),
            Colour::Ansi => write_one(&mut Ansi::new(&mut out), diagnostic, sources, &files),
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// All messages as JSON, one object per line.
pub fn json(diagnostics: &[Diagnostic], sources: &Sources) -> String {
    diagnostics.iter().map(|diagnostic| json_line(diagnostic, sources) + "\n").collect()
}

/// Headers are broken before they get longer than this many characters.
const MAX_HEADER_WIDTH: usize = 110;

/// The word in a header.
pub fn severity_word(severity: Severity) -> &'static str {
    match severity {
        Severity::Note => "note",
        Severity::Warning => "warning",
        Severity::Refused => "refused",
        Severity::Error => "error",
    }
}

type Quotable = SimpleFiles<String, String>;

fn quotable_files(sources: &Sources) -> Quotable {
    let mut files = SimpleFiles::new();
    for (_, file) in sources.files() {
        files.add(visible(&file.name), visible_same_length(&file.text));
    }
    files
}

fn write_one<W: WriteColor>(out: &mut W, diagnostic: &Diagnostic, sources: &Sources, files: &Quotable) {
    let block = codespan_block(diagnostic, sources);
    let styles = Styles::default();
    let mut rendered = Vec::new();
    let config = term::Config::default();
    // Writing to memory cannot fail, and every span was clamped to its file.
    if out.supports_color() {
        let mut writer = StylesWriter::new(Ansi::new(&mut rendered), &styles);
        let _ = term::emit_to_write_style(&mut writer, &config, files, &block);
    } else {
        let mut writer = StylesWriter::new(NoColor::new(&mut rendered), &styles);
        let _ = term::emit_to_write_style(&mut writer, &config, files, &block);
    }
    let mut text = String::from_utf8_lossy(&rendered).into_owned();
    if diagnostic.severity == Severity::Refused {
        // codespan has no such severity; the header comes first, so the first match is the header.
        text = text.replacen("bug", severity_word(Severity::Refused), 1);
    }
    let _ = writeln!(out, "{}", without_trailing_blanks(&text));
    let mut help_style = ColorSpec::new();
    help_style.set_fg(Some(Color::Cyan)).set_bold(true).set_intense(true);
    for help in &diagnostic.help {
        let _ = out.set_color(&help_style);
        let _ = write!(out, "help");
        let _ = out.reset();
        let _ = writeln!(out, ": {}", visible(help).replace('\n', "\n      "));
    }
    let _ = writeln!(out);
}

/// Lines lose the blanks that codespan leaves after an empty label, and the block its empty end.
fn without_trailing_blanks(text: &str) -> String {
    let lines: Vec<&str> = text.trim_end().lines().map(str::trim_end).collect();
    lines.join("\n")
}

fn codespan_block(diagnostic: &Diagnostic, sources: &Sources) -> codespan::Diagnostic<usize> {
    let severity = match diagnostic.severity {
        Severity::Note => codespan::Severity::Note,
        Severity::Warning => codespan::Severity::Warning,
        Severity::Refused => codespan::Severity::Bug,
        Severity::Error => codespan::Severity::Error,
    };
    let labels = diagnostic.labels.iter().filter(|label| is_in_sources(label, sources));
    // `severity[code]: ` stands before the message.
    let prefix = severity_word(diagnostic.severity).len() + diagnostic.code.0.len() + 4;
    codespan::Diagnostic::new(severity)
        .with_code(diagnostic.code.0)
        .with_message(wrapped(&visible(&diagnostic.message), prefix))
        .with_labels(labels.map(|label| codespan_label(label, sources)).collect())
        .with_notes(all_notes(diagnostic))
}

/// A long message on several lines, broken at blanks; the first line begins after `prefix` characters.
fn wrapped(message: &str, prefix: usize) -> String {
    let mut text = String::new();
    let mut column = prefix;
    for word in message.split(' ') {
        let width = word.chars().count();
        if !text.is_empty() && column + 1 + width > MAX_HEADER_WIDTH {
            text.push_str("\n  ");
            column = 2;
        } else if !text.is_empty() {
            text.push(' ');
            column += 1;
        }
        text.push_str(word);
        column += width;
    }
    text
}

fn codespan_label(label: &Label, sources: &Sources) -> codespan::Label<usize> {
    let style =
        if label.is_primary { codespan::LabelStyle::Primary } else { codespan::LabelStyle::Secondary };
    let file = usize::from(label.span.file.0);
    let range = without_line_end(clamped(label.span, sources), &sources.file(label.span.file).text);
    codespan::Label::new(style, file, range).with_message(visible(&label.text))
}

/// A span that runs over the end of its line would be drawn as a bracket over two lines.
fn without_line_end(range: std::ops::Range<usize>, text: &str) -> std::ops::Range<usize> {
    let start = range.start;
    start..start + text[range].trim_end().len()
}

fn all_notes(diagnostic: &Diagnostic) -> Vec<String> {
    let mut notes = Vec::new();
    match (&diagnostic.expected, &diagnostic.found) {
        (Some(expected), Some(found)) => {
            notes.push(format!("expected {}\n   found {}", visible(expected), visible(found)));
        }
        (Some(expected), None) => notes.push(format!("expected {}", visible(expected))),
        (None, Some(found)) => notes.push(format!("found {}", visible(found))),
        (None, None) => {}
    }
    notes.extend(diagnostic.notes.iter().map(|note| visible(note)));
    notes
}

fn is_in_sources(label: &Label, sources: &Sources) -> bool {
    usize::from(label.span.file.0) < sources.files().count()
}

/// The byte range of a span, cut to its file and moved outwards to whole characters.
fn clamped(span: Span, sources: &Sources) -> std::ops::Range<usize> {
    let text = &sources.file(span.file).text;
    let mut start = (span.start as usize).min(text.len());
    let mut end = (span.end as usize).clamp(start, text.len());
    while !text.is_char_boundary(start) {
        start -= 1;
    }
    while !text.is_char_boundary(end) {
        end += 1;
    }
    start..end
}

/// A control or direction character could rewrite the terminal; show a stand-in.
fn is_unsafe_to_show(c: char) -> bool {
    let is_direction =
        matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    (c.is_control() && !matches!(c, '\n' | '\r' | '\t')) || is_direction || c == '\u{feff}'
}

fn visible(text: &str) -> String {
    text.chars().map(|c| if is_unsafe_to_show(c) { '\u{fffd}' } else { c }).collect()
}

/// As [`visible`], with stand-ins of the same number of bytes, so that spans stay right.
fn visible_same_length(text: &str) -> String {
    let stand_in = |c: char| match c.len_utf8() {
        1 => '?',
        2 => '\u{b7}',
        _ => '\u{fffd}',
    };
    text.chars().map(|c| if is_unsafe_to_show(c) { stand_in(c) } else { c }).collect()
}

#[derive(Serialize)]
struct JsonMessage<'a> {
    code: &'a str,
    severity: Severity,
    message: &'a str,
    labels: Vec<JsonLabel<'a>>,
    found: Option<&'a str>,
    expected: Option<&'a str>,
    notes: &'a [String],
    help: &'a [String],
}

#[derive(Serialize)]
struct JsonLabel<'a> {
    file: &'a str,
    /// Bytes from the start of the file, the end exclusive.
    start: usize,
    end: usize,
    /// From 1; columns count characters; the end is the place after the last character.
    line: usize,
    column: usize,
    end_line: usize,
    end_column: usize,
    text: &'a str,
    primary: bool,
}

fn json_line(diagnostic: &Diagnostic, sources: &Sources) -> String {
    let labels = diagnostic.labels.iter().filter(|label| is_in_sources(label, sources));
    let message = JsonMessage {
        code: diagnostic.code.0,
        severity: diagnostic.severity,
        message: &diagnostic.message,
        labels: labels.map(|label| json_label(label, sources)).collect(),
        found: diagnostic.found.as_deref(),
        expected: diagnostic.expected.as_deref(),
        notes: &diagnostic.notes,
        help: &diagnostic.help,
    };
    serde_json::to_string(&message).expect("strings and numbers serialise")
}

fn json_label<'a>(label: &'a Label, sources: &'a Sources) -> JsonLabel<'a> {
    let file = label.span.file;
    let range = clamped(label.span, sources);
    let (line, column) = place(file, range.start, sources);
    let (end_line, end_column) = place(file, range.end, sources);
    JsonLabel {
        file: &sources.file(file).name,
        start: range.start,
        end: range.end,
        line,
        column,
        end_line,
        end_column,
        text: &label.text,
        primary: label.is_primary,
    }
}

fn place(file: FileId, byte: usize, sources: &Sources) -> (usize, usize) {
    sources.line_column(Span::new(file, byte, byte))
}

#[cfg(test)]
#[path = "render_tests.rs"]
mod tests;
