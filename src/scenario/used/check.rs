//! What can be wrong with the uses of a scene.

use super::alias::Mentions;
use super::{MAX_USES, Used, definitions, sweeps, written};
use crate::diagnostic::codes::{D002, D003, F105, F106, M002, S010, W001, W004, W005, W006};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::scenario::choice::OUTPUTS;
use crate::scenario::scope::reserved_meaning;
use crate::scenario::sweep::Target;
use crate::source::{FileId, Sources, Span};
use crate::syntax::tree::{File, Sweep, Use};
use crate::syntax::words::is_statement_keyword;

pub(super) fn too_many(statement: &Use) -> Diagnostic {
    Diagnostic::error(S010, "the scene uses too many files")
        .at(statement.path.span, "one more than can be")
        .found(format!("more than {MAX_USES} used files"))
        .expected(format!("at most {MAX_USES}"))
}

/// The name of a file among the sources; none if its path does not go down from the folder of the
/// file that uses it.
pub(in crate::scenario) fn name_of(user: &str, path: &str) -> Option<String> {
    let is_inside = |part: &str| !part.is_empty() && part != "..";
    // A backslash or a colon would mean another place on some machines.
    if path.contains(['\\', ':', '\0']) || !path.split('/').all(is_inside) {
        return None;
    }
    let folder = user.rfind(['/', '\\']).map_or("", |slash| &user[..=slash]);
    let parts: Vec<&str> = path.split('/').filter(|part| *part != ".").collect();
    Some(format!("{folder}{}", parts.join("/"))).filter(|_| !parts.is_empty())
}

/// The used file among the sources, or why it is not there.
pub(super) fn find(
    scene: FileId,
    sources: &Sources,
    statement: &Use,
    earlier: &[&Use],
) -> Result<FileId, Box<Diagnostic>> {
    let (path, span) = (statement.path.value.as_str(), statement.path.span);
    let scene_name = &sources.file(scene).name;
    let Some(name) = name_of(scene_name, path) else { return Err(Box::new(outside(path, span))) };
    if let Some(first) = earlier.iter().find(|it| name_of(scene_name, &it.path.value).as_ref() == Some(&name))
    {
        let message = Diagnostic::error(W006, format!("\"{path}\" is used twice"))
            .at(span, format!("here again, as `{}`", statement.alias.value))
            .also(first.path.span, format!("first here, as `{}`", first.alias.value))
            .found("one file twice")
            .expected("one `use` for each file")
            .help(format!("delete one of the two, and write `{}` for both", first.alias.value));
        return Err(Box::new(message));
    }
    if name == *scene_name {
        let message = Diagnostic::error(W004, "a scene cannot use itself")
            .at(span, "this very file")
            .found(format!("\"{path}\""))
            .expected("another file");
        return Err(Box::new(message));
    }
    if let Some(id) = sources.find(&name) {
        return Ok(id);
    }
    Err(Box::new(match sources.refusal(&name) {
        Some(refused) if refused.is_outside => outside(path, span).note(refused.reason.clone()),
        refused => {
            let reason = refused.map_or_else(|| format!("{name} is not there"), |it| it.reason.clone());
            Diagnostic::error(F105, format!("cannot use \"{path}\""))
                .at(span, reason)
                .found(format!("\"{path}\""))
                .expected("a scene file, with its path from the folder of this file")
        }
    }))
}

fn outside(path: &str, span: Span) -> Diagnostic {
    Diagnostic::error(F106, "a used file lies outside of the folder of its scene")
        .at(span, "this does not stay in the folder of this file")
        .found(format!("\"{path}\""))
        .expected("a path such as \"column.lam\" or \"scenes/column.lam\"")
        .help("copy the file into the folder of this scene, or the scene to it")
}

/// An alias has one meaning, as other names do.
pub(super) fn alias(file: &File, statement: &Use, earlier: &[&Use], list: &[Used]) -> Option<Diagnostic> {
    let name = &statement.alias;
    let text = name.value.as_str();
    if let Some(meaning) = meaning_of(text) {
        let message = Diagnostic::error(D003, format!("`{text}` already means {meaning}"))
            .at(name.span, "choose another alias")
            .found(format!("`{text}`"))
            .expected("a name of your own");
        return Some(message);
    }
    let twice = |first: Span, what: &str| {
        Diagnostic::error(D002, format!("`{text}` is defined twice"))
            .at(name.span, "here again, as a used scene")
            .also(first, format!("{what} of this name"))
            .found("a second definition")
            .expected("one definition of each name")
            .help("choose another alias")
    };
    if let Some(first) = earlier.iter().find(|it| it.alias.value == text) {
        return Some(twice(first.alias.span, "a used scene"));
    }
    if let Some(own) = definitions(file).get(text) {
        return Some(twice(*own, "a definition"));
    }
    list.iter().find_map(|used| Some(twice(*definitions(&used.file).get(text)?, "a definition")))
}

fn meaning_of(text: &str) -> Option<String> {
    let axes = ["x", "y", "z"].map(str::to_owned);
    if let Some(meaning) = reserved_meaning(text, &axes) {
        return Some(meaning);
    }
    if OUTPUTS.iter().any(|(word, _)| *word == text) {
        return Some("a kind of output".to_owned());
    }
    let is_size = Target::SIZES.iter().any(|(word, _)| *word == text);
    (is_size || is_statement_keyword(text)).then(|| "something in the language".to_owned())
}

/// Used files use no others.
pub(super) fn nested(sources: &Sources, file: &File, used: &Used) -> Vec<Diagnostic> {
    let scene = &sources.file(file.file).name;
    let user = &sources.file(used.file.file).name;
    let message = |statement: &&Use| {
        let is_circle = name_of(user, &statement.path.value).as_ref() == Some(scene);
        let what = if is_circle { "two scenes use each other" } else { "a used scene uses another" };
        Diagnostic::error(W004, what)
            .at(statement.path.span, "used by a used scene")
            .also(used.alias.span, format!("`{}` is used here", used.path))
            .found("uses inside each other")
            .expected("used scenes that stand by themselves")
            .help("put what is needed of it into the used scene")
    };
    written(&used.file).iter().map(message).collect()
}

/// Each sweep says of which scene it is, if there is a choice.
pub(super) fn sweeps_of(file: &File, wanted: &[&Use]) -> Vec<Diagnostic> {
    let aliases: Vec<&str> = wanted.iter().map(|it| it.alias.value.as_str()).collect();
    let listed = || aliases.iter().map(|alias| format!("`of {alias}`")).collect::<Vec<_>>().join(", ");
    let mut messages = Vec::new();
    for (idx, sweep) in sweeps(file).enumerate() {
        let is_twin = |it: &&Sweep| it.name.value == sweep.name.value && !is_same_scene(it, sweep);
        if let Some(first) = sweeps(file).take(idx).find(is_twin) {
            messages.push(
                Diagnostic::error(M002, format!("two sweeps are called `{}`", sweep.name.value))
                    .at(sweep.name.span, "here again")
                    .also(first.name.span, "first here")
                    .found("one name twice")
                    .expected("a name for each sweep, whichever scene it is of"),
            );
        }
        match &sweep.of {
            Some(of) if !aliases.contains(&of.value.as_str()) => {
                if let Some(message) = misspelt_alias(file, wanted, &of.value, of.span) {
                    messages.push(message);
                    continue;
                }
                let mut message = Diagnostic::error(W001, format!("`{}` is no used scene", of.value))
                    .at(of.span, "no such scene")
                    .found(format!("`{}`", of.value));
                message = match (did_you_mean(&of.value, aliases.iter().copied()), aliases.is_empty()) {
                    (Some(meant), _) => message.expected(listed()).help(format!("did you mean `{meant}`?")),
                    (None, false) => message.expected(listed()),
                    (None, true) => message.expected("a scene of a `use` statement").help(
                        "a sweep of this very scene has no `of`; another is named by `use \"FILE.lam\" as NAME`",
                    ),
                };
                messages.push(message);
            }
            None if aliases.len() > 1 => messages.push(
                Diagnostic::error(W005, format!("of which scene is the sweep `{}`?", sweep.name.value))
                    .at(sweep.name.span, "without `of`")
                    .found(format!("{} used scenes", aliases.len()))
                    .expected(listed()),
            ),
            _ => {}
        }
    }
    if let [_, second, ..] = wanted
        && sweeps(file).next().is_none()
    {
        messages.push(
            Diagnostic::error(W005, "two used scenes, and no sweep of either")
                .at(second.alias.span, "the second")
                .also(wanted[0].alias.span, "the first")
                .found(format!("{} used scenes", aliases.len()))
                .expected("one used scene, or a sweep of each"),
        );
    } else if wanted.len() > 1 {
        for unused in wanted {
            let is_swept =
                sweeps(file).any(|it| it.of.as_ref().is_none_or(|of| of.value == unused.alias.value));
            if !is_swept {
                messages.push(
                    Diagnostic::warning(crate::diagnostic::codes::D010, "a used scene is never swept")
                        .at(unused.alias.span, "used without effect")
                        .help("delete it, or sweep it"),
                );
            }
        }
    }
    messages
}

/// Sweeps of one scene are compared when it is resolved.
fn is_same_scene(a: &Sweep, b: &Sweep) -> bool {
    a.of.as_ref().map(|of| &of.value) == b.of.as_ref().map(|of| &of.value)
}

/// The alias to blame for one that does not exist: one that nothing uses and that differs by a slip, while
/// the other is written the same in several places.
fn misspelt_alias(file: &File, wanted: &[&Use], meant: &str, first_use: Span) -> Option<Diagnostic> {
    let n_uses = |alias: &str| {
        let speaks = |statement| Mentions::of(statement, [alias].into()).scenes.contains_key(alias);
        file.statements.iter().filter(|statement| speaks(statement)).count()
            + sweeps(file).filter(|sweep| sweep.of.as_ref().is_some_and(|of| of.value == alias)).count()
    };
    let candidate = did_you_mean(meant, wanted.iter().map(|it| it.alias.value.as_str()))?;
    let written = wanted.iter().find(|it| it.alias.value == candidate)?;
    (n_uses(meant) > 1 && n_uses(candidate) == 0).then(|| {
        Diagnostic::error(W001, format!("`{meant}` is no used scene, and nothing uses `{candidate}`"))
            .at(written.alias.span, format!("did you mean `{meant}`?"))
            .also(first_use, "no such scene")
            .found(format!("`{candidate}`"))
            .expected(format!("`{meant}`"))
            .help(format!("call it `{meant}` here, or use `{candidate}` there"))
    })
}

/// A statement that speaks of two used scenes belongs to neither.
pub(super) fn speaks_of_two(file: &File, list: &[Used]) -> Vec<Diagnostic> {
    let aliases: std::collections::BTreeSet<&str> =
        list.iter().map(|used| used.alias.value.as_str()).collect();
    let message = |statement| {
        let scenes = Mentions::of(statement, aliases.clone()).scenes;
        let [(first, first_span), (second, second_span)] = [scenes.iter().next()?, scenes.iter().nth(1)?];
        let message = Diagnostic::error(W005, "one statement speaks of two used scenes")
            .at(*second_span, format!("of `{second}`"))
            .also(*first_span, format!("of `{first}`"))
            .found("two scenes")
            .expected("names of one scene: each is run by itself");
        Some(message)
    };
    file.statements.iter().filter_map(message).collect()
}
