//! Columns of neighbouring lines.
//!
//! Owns which tokens of which statements stand below each other. May use the lines of `format`.
//! It deliberately aligns whole one-line statements of one kind only, and never across an empty line.

use super::{Code, Line};

/// What a line shares with its neighbours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    group: &'static str,
    /// Column number and the piece that begins there, in order.
    stops: Vec<(usize, usize)>,
}

/// The columns of a statement on one line, given its tokens.
pub fn columns_of(words: &[&str]) -> Option<Columns> {
    let (group, stops) = match *words.first()? {
        "title" | "cite" => ("head", vec![Some(1)]),
        "let" | "param" => ("value", vec![outside(words, "="), outside(words, "in"), doc(words)]),
        "species" => ("species", vec![doc(words).filter(|_| outside(words, ",").is_none())]),
        "data" => ("data", vec![outside(words, "="), doc(words)]),
        "kernel" => ("kernel", vec![outside(words, "="), doc(words)]),
        "initial" => ("initial", vec![outside(words, "=")]),
        "measure" => ("measure", vec![outside(words, "=")]),
        "reference" if words.get(2) == Some(&"for") => ("reference", vec![Some(2), outside(words, "=")]),
        "reaction" => {
            let equation = outside(words, ":").map(|colon| colon + 1);
            ("reaction", vec![equation, equation.and_then(|_| outside(words, "@"))])
        }
        "boundary" => ("boundary", vec![after_sides(words)]),
        "source" => ("source", vec![outside(words, ":").map(|colon| colon + 1)]),
        "output" => ("output", vec![Some(2).filter(|_| is_species_list(words)), first_clause_at(words)]),
        _ => return None,
    };
    let stops = stops.into_iter().enumerate().filter_map(|(column, piece)| Some((column, piece?))).collect();
    Some(Columns { group, stops })
}

/// The columns of a zone on its own line: after the name and after each comma.
pub fn zone_columns(words: &[&str]) -> Option<Columns> {
    if words.get(1) != Some(&":") {
        return None;
    }
    let commas = positions_outside(words).filter(|&position| words[position] == ",");
    let starts = std::iter::once(2).chain(commas.map(|comma| comma + 1));
    let stops = starts.filter(|&start| start < words.len()).enumerate().collect();
    Some(Columns { group: "zone", stops })
}

/// The column of an entry of a sweep: after its first word; the axes of a zip have their own.
pub fn entry_columns(words: &[&str], is_zipped: bool) -> Option<Columns> {
    let mut value = 1;
    while words.get(value) == Some(&".") {
        value += 2;
    }
    let has_value = words.get(value).is_some_and(|word| !matches!(*word, "{" | ";"));
    let group = if is_zipped { "zipped" } else { "entry" };
    has_value.then(|| Columns { group, stops: vec![(0, value)] })
}

/// What follows the list of sides: a part of them, or what happens there.
fn after_sides(words: &[&str]) -> Option<usize> {
    let mut position = 2;
    while words.get(position) == Some(&",") {
        position += 2;
    }
    (position < words.len()).then_some(position)
}

fn is_species_list(words: &[&str]) -> bool {
    words.get(2).is_some_and(|word| !super::super::words::RESERVED_WORDS.contains(word))
}

/// The clause `at` where it is the first after the species.
fn first_clause_at(words: &[&str]) -> Option<usize> {
    let is_clause = |word: &&str| super::super::words::RESERVED_WORDS.contains(word);
    words.iter().position(is_clause).filter(|&position| words[position] == "at")
}

/// The last token if it is a text.
fn doc(words: &[&str]) -> Option<usize> {
    words.last().filter(|word| word.starts_with('"')).map(|_| words.len() - 1)
}

/// The first place of a token outside brackets.
fn outside(words: &[&str], word: &str) -> Option<usize> {
    positions_outside(words).find(|&position| words[position] == word)
}

fn positions_outside<'a>(words: &'a [&'a str]) -> impl Iterator<Item = usize> + 'a {
    let mut depth = 0_usize;
    words.iter().enumerate().filter_map(move |(position, word)| {
        match *word {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth = depth.saturating_sub(1),
            _ if depth == 0 => return Some(position),
            _ => {}
        }
        None
    })
}

/// Sets the gaps of all lines that share columns, then those before comments.
pub fn align(lines: &mut [Line]) {
    for_each_run(
        lines,
        |first, second| {
            first.columns.as_ref().map(|it| it.group) == second.columns.as_ref().map(|it| it.group)
                && first.columns.is_some()
        },
        align_columns,
    );
    for_each_run(lines, |first, second| first.comment.is_some() && second.comment.is_some(), align_comments);
}

/// Calls `act` on every longest run of code lines in which neighbours belong together.
fn for_each_run<'t>(
    lines: &mut [Line<'t>],
    belong: impl Fn(&Code, &Code) -> bool,
    act: impl Fn(&mut [&mut Code<'t>]),
) {
    let mut run: Vec<&mut Code<'t>> = Vec::new();
    for line in lines {
        let Line::Code(code) = line else {
            act(&mut std::mem::take(&mut run));
            continue;
        };
        if run.last().is_some_and(|last| !belong(last, code)) {
            act(&mut std::mem::take(&mut run));
        }
        run.push(code);
    }
    act(&mut run);
}

fn align_columns(run: &mut [&mut Code]) {
    let n_columns =
        run.iter().flat_map(|code| &code.columns).flat_map(|it| &it.stops).map(|stop| stop.0 + 1).max();
    for column in 0..n_columns.unwrap_or(0) {
        let stop = |code: &Code| {
            let stops = &code.columns.as_ref()?.stops;
            stops.iter().find(|stop| stop.0 == column).map(|stop| stop.1)
        };
        let width = run.iter().filter_map(|code| Some(code.width_before(stop(code)?))).max().unwrap_or(0);
        for code in run.iter_mut() {
            if let Some(piece) = stop(code) {
                code.pieces[piece].0 = width + 1 - code.width_before(piece);
            }
        }
    }
}

fn align_comments(run: &mut [&mut Code]) {
    let width = run.iter().map(|code| code.width_before(code.pieces.len())).max().unwrap_or(0);
    for code in run.iter_mut().filter(|code| code.comment.is_some()) {
        code.comment_gap = width + 2 - code.width_before(code.pieces.len());
    }
}
