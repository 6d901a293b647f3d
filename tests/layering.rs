//! The rules of the house, held by a test: imports point one way, files and functions stay small,
//! no arithmetic from the system, every message code has its page and its fixture.

use lamella::diagnostic::codes;
use std::path::{Path, PathBuf};

/// Modules that may use each other and all modules of the lines above, but none of the lines below.
const LAYERS: &[&[&str]] = &[
    &["source", "diagnostic", "units", "maths", "state", "data"],
    &["catalog"],
    &["syntax"],
    &["scenario"],
    &["plan"],
    &["flow"],
    &["chemistry"],
    &["engine"],
    &["stop"],
    &["stress"],
    &["table"],
    &["measure"],
    &["report"],
    &["estimate"],
    &["sweep"],
];

/// Functions of `f64` that the standard library takes from the system, whose last bit therefore
/// depends on the machine.
const SYSTEM_FUNCTIONS: &[&str] = &[
    "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "sin", "cos", "sin_cos", "tan", "asin",
    "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "powf", "cbrt", "hypot",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All files below a folder whose name ends in `.extension`, in the order of their paths.
fn files_below(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for entry in entries {
            let path = entry.expect("a folder can be listed").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == extension) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn relative(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).display().to_string()
}

/// The text without line comments; a `//` inside a string goes, too, which no rule here minds.
fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// The path of modules that a file of `src` is: `["plan", "passes", "drop"]`.
fn module_path(file: &Path) -> Vec<String> {
    let inside = file.strip_prefix(root().join("src")).expect("the file lies in src");
    let mut parts: Vec<String> =
        inside.with_extension("").iter().map(|part| part.to_string_lossy().into_owned()).collect();
    if parts.last().is_some_and(|last| last == "mod") {
        parts.pop();
    }
    parts
}

fn identifier(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    &text[..end]
}

/// The first names of a path or of a group: of `plan::X` `plan`, of `{a::X, b}` `a` and `b`.
fn first_names(text: &str) -> Vec<&str> {
    let Some(group) = text.strip_prefix('{') else { return vec![identifier(text)] };
    let mut names = Vec::new();
    let mut depth = 0;
    let mut is_first = true;
    for (idx, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => is_first = true,
            c if is_first && depth == 0 && !c.is_whitespace() => {
                names.push(identifier(&group[idx..]));
                is_first = false;
            }
            _ => {}
        }
    }
    names
}

/// The top modules that a file names, by `crate::…` or by enough `super::`.
fn used_modules(file: &Path) -> Vec<String> {
    let text = without_comments(&read(file));
    let depth = module_path(file).len();
    let mut used = Vec::new();
    for (idx, _) in text.match_indices("crate::") {
        used.extend(first_names(&text[idx + "crate::".len()..]).into_iter().map(str::to_owned));
    }
    for (idx, _) in text.match_indices("super::") {
        if text[..idx].ends_with("super::") {
            continue;
        }
        let rest = text[idx..].trim_start_matches("super::");
        let n_supers = (text[idx..].len() - rest.len()) / "super::".len();
        if n_supers >= depth {
            used.extend(first_names(rest).into_iter().map(str::to_owned));
        }
    }
    used
}

fn layer(module: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&module))
}

fn library_files() -> Vec<PathBuf> {
    let is_program = |path: &PathBuf| {
        let module = module_path(path);
        matches!(module.first().map(String::as_str), Some("cli" | "main" | "lib"))
    };
    files_below("src", "rs").into_iter().filter(|path| !is_program(path)).collect()
}

fn assert_none(broken: Vec<String>, rule: &str) {
    assert!(broken.is_empty(), "{rule}\n  {}", broken.join("\n  "));
}

#[test]
fn imports_point_up_the_list_of_layers() {
    let mut broken = Vec::new();
    for file in library_files() {
        let module = module_path(&file)[0].clone();
        let Some(own) = layer(&module) else {
            broken.push(format!("{}: `{module}` is in no layer", relative(&file)));
            continue;
        };
        for used in used_modules(&file) {
            if layer(&used).is_some_and(|other| other > own) {
                broken.push(format!("{}: `{module}` uses `{used}`", relative(&file)));
            }
        }
    }
    assert_none(broken, "a module may use only what stands above it:");
}

#[test]
fn the_walk_of_imports_sees_groups_and_relative_paths() {
    assert_eq!(first_names("plan::Plan;"), ["plan"]);
    assert_eq!(first_names("{source::{Span, FileId}, units, maths::exp};"), ["source", "units", "maths"]);
    assert_eq!(module_path(&root().join("src/plan/mod.rs")), ["plan"]);
    assert_eq!(module_path(&root().join("src/plan/tape.rs")), ["plan", "tape"]);
}

#[test]
fn only_the_command_line_prints() {
    let mut broken = Vec::new();
    for file in library_files() {
        let text = without_comments(&read(&file));
        for name in ["println!", "print!", "eprintln!", "eprint!", "dbg!", "io::stdout", "io::stderr"] {
            if text.contains(name) {
                broken.push(format!("{}: {name}", relative(&file)));
            }
        }
    }
    assert_none(broken, "the library returns text, `src/cli` prints it:");
}

#[test]
fn arithmetic_comes_from_the_maths_module() {
    let mut broken = Vec::new();
    for file in library_files().into_iter().filter(|file| module_path(file)[0] != "maths") {
        let text = without_comments(&read(&file));
        for name in SYSTEM_FUNCTIONS {
            let forms = [format!(".{name}()"), format!("f64::{name}("), format!("f64::{name})")];
            let with_argument = ["powf", "log", "atan2", "hypot"].contains(name);
            let method = format!(".{name}(");
            if forms.iter().any(|form| text.contains(form)) || (with_argument && text.contains(&method)) {
                broken.push(format!("{}: {name}", relative(&file)));
            }
        }
    }
    assert_none(broken, "use `crate::maths`, whose bits are the same on every machine:");
}

#[test]
fn files_and_functions_stay_small() {
    let mut broken = Vec::new();
    for file in ["src", "tests", "benches"].into_iter().flat_map(|folder| files_below(folder, "rs")) {
        let text = read(&file);
        if text.lines().count() > 500 {
            broken.push(format!("{}: {} lines", relative(&file), text.lines().count()));
        }
        for (name, n_lines) in functions(&text).into_iter().filter(|(_, n_lines)| *n_lines > 70) {
            broken.push(format!("{}: `{name}` has {n_lines} lines", relative(&file)));
        }
    }
    assert_none(broken, "a file has at most 500 lines, a function at most 70:");
}

/// Names and numbers of lines of the functions; relies on rustfmt's indentation.
fn functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (start, line) in lines.iter().enumerate() {
        let indent = line.len() - line.trim_start().len();
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some(at) = words.iter().position(|word| *word == "fn") else { continue };
        let is_item = words[..at]
            .iter()
            .all(|word| matches!(*word, "const" | "unsafe" | "async" | "extern") || word.starts_with("pub"));
        if !is_item || at + 1 >= words.len() {
            continue;
        }
        let end_mark = format!("{}}}", " ".repeat(indent));
        let end = (start..lines.len())
            .find(|&idx| lines[idx] == end_mark || lines[idx].ends_with(';') && idx == start);
        if let Some(end) = end {
            found.push((identifier(words[at + 1]).to_owned(), end - start + 1));
        }
    }
    found
}

#[test]
fn every_code_has_a_page_that_explains_it() {
    let mut broken = Vec::new();
    for entry in codes::ALL {
        let heading = format!("# {}: ", entry.code);
        let n_words = entry.page.split_whitespace().count();
        if !entry.page.starts_with(&heading) || n_words < 30 {
            broken
                .push(format!("docs/diagnostics/{}.md: heading `{heading}…`, at least 30 words", entry.code));
        }
    }
    assert_none(broken, "every code has a page with its heading and a text:");
    let n_pages = files_below("docs/diagnostics", "md").len();
    assert_eq!(n_pages, codes::ALL.len(), "a page without a code is out of date");
}

/// Codes that no text of a scene can cause are shown by a test of the program instead.
#[test]
fn every_code_has_a_fixture() {
    let shown: String = files_below("tests/diagnostics", "txt").iter().map(|path| read(path)).collect();
    let of_program =
        ["tests/cli", "tests/sweeps", "src/cli"].into_iter().flat_map(|folder| files_below(folder, "rs"));
    let in_program: String = of_program.map(|path| read(&path)).collect();
    let is_shown = |code: &str| {
        let is_outside = code.starts_with(['F', 'R', 'L']);
        let is_in = |text: &str, code: &str| text.contains(&format!("[{code}]"));
        let is_named = in_program.contains(&format!("\"{code}\"")) || is_in(&in_program, code);
        is_in(&shown, code) || (is_outside && is_named)
    };
    let missing = codes::ALL.iter().map(|entry| entry.code.0).filter(|code| !is_shown(code));
    assert_none(missing.map(str::to_owned).collect(), "every code has a fixture under tests/diagnostics:");
}

#[test]
fn every_dependency_has_a_reason() {
    let manifest = read(&root().join("Cargo.toml"));
    let architecture = read(&root().join("ARCHITECTURE.md"));
    let mut is_inside = false;
    let mut missing = Vec::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            is_inside = line.ends_with("dependencies]");
        } else if let Some((name, _)) = line.split_once('=').filter(|_| is_inside && !line.starts_with('#')) {
            let name = name.trim();
            if !architecture.contains(&format!("`{name}`")) {
                missing.push(name.to_owned());
            }
        }
    }
    assert_none(missing, "ARCHITECTURE.md gives no reason for:");
}
