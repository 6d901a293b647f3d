//! Settings of the command line: parameters and sizes with other values than the scene gives them.
//!
//! Owns `--set name=value` from its text to what it replaces. May use `syntax`. It deliberately leaves
//! ranges and dimensions to the statements that the values go to.

use super::Settings;
use super::check::{Allow, Checker};
use super::expression::Type;
use super::scope::Origin;
use super::slot::each_name;
use super::sweep::Target;
use crate::diagnostic::codes::{M005, P001, S010, U104};
use crate::diagnostic::{Diagnostic, Label, did_you_mean};
use crate::source::{Sources, Span};
use crate::syntax::tree::{self, ExprKind, StatementKind, UnaryOperator};
use std::collections::BTreeSet;

/// Each setting is a source of its own, and sources are counted in 16 bits.
const MAX_SETTINGS: usize = 10_000;

/// What the command line sets.
#[derive(Default)]
pub(super) struct Given {
    pub params: Vec<tree::Param>,
    /// Sizes: the same as what a point of a sweep sets.
    pub sizes: Vec<(Target, tree::Expr)>,
}

/// `--set name=value`: each has a source of its own, `name=value` as it was typed.
pub(super) fn read_settings(
    file: &tree::File,
    sources: &mut Sources,
    settings: &Settings,
    diagnostics: &mut Vec<Diagnostic>,
) -> Given {
    let mut given = Given::default();
    if settings.set.len() > MAX_SETTINGS {
        diagnostics.push(
            Diagnostic::error(S010, "there are too many settings")
                .at(Span::new(file.file, 0, 0), "for this scene")
                .found(format!("{} settings", settings.set.len()))
                .expected(format!("at most {MAX_SETTINGS}")),
        );
        return given;
    }
    let params: Vec<&tree::Param> = file
        .statements
        .iter()
        .filter_map(|statement| match &statement.kind {
            StatementKind::Param(param) => Some(param),
            _ => None,
        })
        .collect();
    let sizes = sizes(file);
    for (name, value) in &settings.set {
        let text = format!("{name}={value}");
        let id = sources.add("--set", text.clone());
        let name = name.trim();
        // A parameter of that name comes first, as in a sweep.
        let param = params.iter().find(|param| param.name.value == name);
        let size = sizes.iter().find(|size| size.name() == name);
        if param.is_none() && size.is_none() {
            let start = text.len() - text.trim_start().len();
            let place = Span::new(id, start, start + name.len());
            diagnostics.push(unknown_setting(name, place, &params, &sizes, constant(file, name)));
            continue;
        }
        let (value, errors) = crate::syntax::parse_setting(id, &text);
        diagnostics.extend(errors);
        let Some(value) = value else { continue };
        match (param, size) {
            (Some(param), _) => given.params.push(tree::Param { value, ..(*param).clone() }),
            (None, Some(size)) => given.sizes.push((size.clone(), value)),
            (None, None) => {}
        }
    }
    given
}

/// The sizes that the scene has a statement for.
fn sizes(file: &tree::File) -> Vec<Target> {
    let of = |statement: &tree::Statement| match &statement.kind {
        StatementKind::Particles(_) => Some(Target::Particles),
        StatementKind::Run(_) => Some(Target::Step),
        StatementKind::Average(average) => average.bins.as_ref().map(|_| Target::Bins),
        _ => None,
    };
    let mut sizes: Vec<Target> = file.statements.iter().filter_map(of).collect();
    sizes.sort();
    sizes.dedup();
    sizes
}

/// The `let` statement of that name.
fn constant<'a>(file: &'a tree::File, name: &str) -> Option<&'a tree::Let> {
    file.statements.iter().find_map(|statement| match &statement.kind {
        StatementKind::Let(constant) if constant.name.value == name => Some(constant),
        _ => None,
    })
}

fn unknown_setting(
    name: &str,
    place: Span,
    params: &[&tree::Param],
    sizes: &[Target],
    constant: Option<&tree::Let>,
) -> Diagnostic {
    let params = params.iter().map(|param| param.name.value.as_str());
    let names: Vec<&str> = params.chain(sizes.iter().map(Target::name)).collect();
    let mut message = Diagnostic::error(P001, format!("the scene has no parameter `{name}`"))
        .at(place, "set on the command line")
        .found(format!("`{name}`"))
        .expected(if names.is_empty() {
            "no setting: the scene has nothing that could be set".into()
        } else {
            names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
        });
    if let Some(constant) = constant {
        message = message
            .also(constant.name.span, "a constant, which is fixed")
            .help("write it as `param` instead of `let`, and it can be set");
    } else if let Some(statement) = Target::SIZES.iter().find(|(word, _)| *word == name) {
        message = message.help(format!("the scene has no `{}` statement that it could replace", statement.1));
    } else if let Some(candidate) = did_you_mean(name, names.iter().copied()) {
        message = message.help(format!("did you mean `{candidate}`?"));
    }
    message
}

/// A setting of the command line keeps the dimension that the scene gives its parameter.
pub(super) fn check_setting<'a>(checker: &mut Checker<'a>, written: &'a tree::Param, kind: Option<Type>) {
    let set = match checker.scope.get(&written.name.value).map(|entry| entry.origin) {
        Some(Origin::Param(set)) if !std::ptr::eq(set, written) => set,
        _ => return,
    };
    let own = checker.check(&written.value, Allow::CONSTANT);
    let (Some(own), Some(kind)) = (own, kind) else { return };
    if own.kind.unify(kind).is_none() {
        checker.report(
            Diagnostic::error(
                U104,
                format!("`{}` is set to a value of another dimension", written.name.value),
            )
            .at(set.value.span, format!("this is {}", kind.describe()))
            .also(written.value.span, format!("this is {}", own.kind.describe()))
            .found(kind.describe())
            .expected(own.kind.describe()),
        );
    }
}

/// Adds the settings of the command line to what is told of a value that follows from them.
pub(super) fn name_settings(checker: &Checker<'_>, diagnostics: &mut [Diagnostic]) {
    for message in diagnostics.iter_mut().filter(|message| message.code == M005) {
        let Some(expr) = message.primary_span().and_then(|span| checker.checked.get(&span)) else { continue };
        let mut settings = Vec::new();
        let (mut open, mut seen) = (vec![*expr], BTreeSet::new());
        while let Some(expr) = open.pop() {
            each_name(expr, &mut |name, _| {
                let entry = checker.scope.get(&name.value).filter(|_| seen.insert(name.value.as_str()));
                match entry.map(|entry| (entry.origin, entry.span)) {
                    Some((Origin::Let(it), _)) => open.push(&it.value),
                    Some((Origin::Param(it), own)) if it.value.span.file != own.file => {
                        settings.push((it.value.span, &it.name.value));
                    }
                    Some((Origin::Param(it), _)) => open.push(&it.value),
                    _ => {}
                }
            });
        }
        settings.sort();
        let is_new = |span: &Span| message.labels.iter().all(|label| label.span != *span);
        let labels = settings.into_iter().filter(|(span, _)| is_new(span)).map(|(span, name)| Label {
            span,
            text: format!("`{name}` is set here"),
            is_primary: false,
        });
        let labels: Vec<Label> = labels.collect();
        message.labels.extend(labels);
    }
}

/// The unit of a value that is a number with a unit; nothing else has one.
pub(super) fn unit_as_written(value: &tree::Expr) -> Option<String> {
    match &value.kind {
        ExprKind::Number(number) => number.unit.as_ref().map(|unit| unit.value.clone()),
        ExprKind::Unary { operator, operand } if operator.value == UnaryOperator::Negate => {
            unit_as_written(operand)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::FileId;

    #[test]
    fn any_number_of_settings_is_answered() {
        let many = Settings { set: vec![("a".to_owned(), "1".to_owned()); 70_000], ..Settings::default() };
        let text = "lamella 1\nparam a = 1\n";
        let (file, _) = crate::syntax::parse(FileId(0), text);
        let mut sources = Sources::single("a.lam", text);
        let (scenario, diagnostics) = crate::scenario::resolve(&file, &mut sources, &many, false);
        assert!(scenario.is_none());
        assert!(diagnostics.iter().any(|diagnostic| diagnostic.code == S010));
    }
}
