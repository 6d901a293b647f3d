//! Names of a scene: each has one origin, whatever the order of statements.

use super::expression::{Expr, Type};
use crate::catalog::rate;
use crate::diagnostic::codes::{D002, D003, D004};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::source::Span;
use crate::syntax::tree;
use std::collections::{BTreeMap, BTreeSet};

/// Where a name comes from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Origin<'a> {
    Let(&'a tree::Let),
    Param(&'a tree::Param),
    Function(&'a tree::Function),
    Data(&'a tree::Data),
    Kernel,
    Species(usize),
    Reaction,
    Reference(usize),
    Measure(usize),
}

impl Origin<'_> {
    pub(super) fn describe(self) -> &'static str {
        match self {
            Origin::Let(_) => "a constant",
            Origin::Param(_) => "a parameter",
            Origin::Function(_) => "a function",
            Origin::Data(_) => "a table of numbers",
            Origin::Kernel => "a kernel",
            Origin::Species(_) => "a species",
            Origin::Reaction => "a reaction",
            Origin::Reference(_) => "a reference",
            Origin::Measure(_) => "a measure",
        }
    }
}

/// How far the value of a constant has been worked out.
#[derive(Debug, Clone)]
pub(super) enum Progress {
    Untouched,
    Running,
    Known(f64, Type),
    /// Already reported.
    Wrong,
}

#[derive(Debug)]
pub(super) struct Entry<'a> {
    pub origin: Origin<'a>,
    pub span: Span,
    pub progress: Progress,
    pub n_uses: usize,
}

impl Entry<'_> {
    /// Where the value was set: a setting of the command line has a text of its own.
    pub(super) fn place_of_value(&self) -> Span {
        match self.origin {
            Origin::Param(statement) if statement.value.span.file != self.span.file => statement.value.span,
            _ => self.span,
        }
    }
}

/// All names of a scene.
#[derive(Debug, Default)]
pub(super) struct Scope<'a> {
    entries: BTreeMap<String, Entry<'a>>,
    /// Names with a second definition, or a meaning of the language: what does not fit the first one
    /// may fit the other.
    doubtful: BTreeSet<String>,
    /// Undefined names and the places that use them; reported once each.
    undefined: BTreeMap<String, BTreeSet<Span>>,
    /// Those of them that stand where only a species can.
    wanted_species: BTreeSet<String>,
    /// For some of these the parameter of a function that may be what is misspelt.
    suspects: BTreeMap<String, (String, Span)>,
}

/// Names that the language itself gives a meaning.
pub(super) const BUILT_IN_FUNCTIONS: &[&str] = &[
    "exp", "ln", "log10", "sqrt", "abs", "min", "max", "tanh", "erf", "erfc", "sin", "cos", "pow", "l1",
    "l2", "linf", "rmse", "integral", "mean", "minimum", "maximum",
];
/// What the only reference of a scene may be called in measures.
pub(super) const THE_REFERENCE: &str = "reference";
const RESERVED: &[(&str, &str)] = &[("t", "the time"), ("pi", "the number π"), ("instant", "a rate")];

impl<'a> Scope<'a> {
    /// Adds a name, or reports that it is taken.
    pub(super) fn define(
        &mut self,
        name: &tree::Name,
        origin: Origin<'a>,
        axes: &[String],
        diagnostics: &mut Vec<Diagnostic>,
    ) {
        let text = name.value.as_str();
        if let Some(meaning) = reserved_meaning(text, axes) {
            self.doubtful.insert(text.to_owned());
            diagnostics.push(
                Diagnostic::error(D003, format!("`{text}` already means {meaning}"))
                    .at(name.span, "choose another name")
                    .found(format!("`{text}`"))
                    .expected("a name of your own"),
            );
            return;
        }
        if let Some(known) = self.entries.get(text) {
            // Kinds of statements are gathered one after another: the text decides which came first.
            self.doubtful.insert(text.to_owned());
            let mut places = [(known.span, known.origin), (name.span, origin)];
            // What a used file defines was there before.
            places.sort_by_key(|(span, _)| (std::cmp::Reverse(span.file), span.start));
            let [first, second] = places;
            diagnostics.push(
                Diagnostic::error(D002, format!("`{text}` is defined twice"))
                    .at(second.0, format!("here again, as {}", second.1.describe()))
                    .also(first.0, format!("first defined here, as {}", first.1.describe()))
                    .found("a second definition")
                    .expected("one definition of each name")
                    .help("rename one of the two, or delete it"),
            );
            return;
        }
        let entry = Entry { origin, span: name.span, progress: Progress::Untouched, n_uses: 0 };
        self.entries.insert(text.to_owned(), entry);
    }

    pub(super) fn get_mut(&mut self, name: &str) -> Option<&mut Entry<'a>> {
        self.entries.get_mut(name)
    }

    /// Whether a name has two meanings, which has been reported.
    pub(super) fn is_doubtful(&self, name: &str) -> bool {
        self.doubtful.contains(name)
    }

    pub(super) fn get(&self, name: &str) -> Option<&Entry<'a>> {
        self.entries.get(name)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&String, &Entry<'a>)> {
        self.entries.iter()
    }

    /// Notes a use of a name that does not exist; [`Scope::report_undefined`] tells it.
    pub(super) fn note_undefined(&mut self, name: &str, span: Span) {
        self.undefined.entry(name.to_owned()).or_default().insert(span);
    }

    /// The same where only a species can stand: nothing else is offered for it.
    pub(super) fn note_undefined_species(&mut self, name: &str, span: Span) {
        self.wanted_species.insert(name.to_owned());
        self.note_undefined(name, span);
    }

    /// Whether an entry can be what is meant by an undefined name.
    fn fits(&self, name: &str, entry: &Entry<'a>) -> bool {
        matches!(entry.origin, Origin::Species(_)) || !self.wanted_species.contains(name)
    }

    /// Notes a parameter that nothing uses and that an undefined name may mean.
    pub(super) fn suspect(&mut self, name: &str, parameter: &tree::Name) {
        self.suspects.insert(name.to_owned(), (parameter.value.clone(), parameter.span));
    }

    /// The reference that a name in a measure means: that of this name, or for `reference` the only one.
    pub(super) fn reference(&self, name: &str) -> Option<usize> {
        match (self.entries.get(name).map(|entry| entry.origin), &self.references()[..]) {
            (Some(Origin::Reference(idx)), _) => Some(idx),
            (None, [(_, idx)]) if name == THE_REFERENCE => Some(*idx),
            _ => None,
        }
    }

    /// All references by name.
    pub(super) fn references(&self) -> Vec<(&str, usize)> {
        let of = self.entries.iter().filter_map(|(name, entry)| match entry.origin {
            Origin::Reference(idx) => Some((name.as_str(), idx)),
            _ => None,
        });
        of.collect()
    }

    /// Whether something else uses a name that does not exist.
    pub(super) fn is_undefined(&self, name: &str) -> bool {
        self.undefined.contains_key(name)
    }

    /// One message per undefined name, at its first use or at the definition that is misspelt.
    pub(super) fn report_undefined(&self, axes: &[String], diagnostics: &mut Vec<Diagnostic>) {
        for (name, uses) in &self.undefined {
            let Some(first) = uses.first() else { continue };
            let message = match self.misspelt_definition(name, uses) {
                Some((written, entry)) => misspelt_definition(name, *first, written, entry),
                None => self.undefined_use(name, *first, axes),
            };
            diagnostics.push(match uses.len() - 1 {
                0 => message,
                1 => message.note(format!("`{name}` is used in one more place")),
                n => message.note(format!("`{name}` is used in {n} more places")),
            });
        }
    }

    /// The definition to blame for an undefined name: one that nothing uses and that differs by a slip,
    /// while the name is written the same in several places.
    fn misspelt_definition(&self, name: &str, uses: &BTreeSet<Span>) -> Option<(&str, &Entry<'a>)> {
        if uses.len() < 2 { None } else { self.only_unused(name) }
    }

    /// The only definition that nothing uses and that differs from a name by a slip.
    fn only_unused(&self, name: &str) -> Option<(&str, &Entry<'a>)> {
        let unused =
            self.entries.iter().filter(|(written, entry)| entry.n_uses == 0 && is_slip(name, written));
        let mut unused = unused.filter(|(_, entry)| self.fits(name, entry));
        let (written, entry) = unused.next()?;
        unused.next().is_none().then_some((written, entry))
    }

    fn undefined_use(&self, name: &str, span: Span, axes: &[String]) -> Diagnostic {
        let is_species = self.wanted_species.contains(name);
        let (what, expected) = match is_species {
            true => ("no such species", "a species of the scene"),
            false => ("no such name", "a name that the scene defines"),
        };
        let mut message = Diagnostic::error(D004, format!("`{name}` is not defined"))
            .at(span, what)
            .found(format!("`{name}`"))
            .expected(expected);
        let names =
            self.entries.iter().filter(|(_, entry)| self.fits(name, entry)).map(|(own, _)| own.as_str());
        let functions = BUILT_IN_FUNCTIONS.iter().copied().chain(rate::ALL.iter().map(|item| item.name));
        let others = functions.chain(axes.iter().map(String::as_str)).filter(|_| !is_species);
        let candidates = names.chain(others);
        let parameter = self.suspects.get(name).map(|(written, span)| (written.as_str(), *span));
        let unused = || self.only_unused(name).map(|(written, entry)| (written, entry.span));
        if let Some((written, place)) = parameter.or_else(unused) {
            // One of the two places is misspelt, and nothing says which.
            message = message
                .at(place, format!("`{written}` is defined here, and nothing uses it"))
                .help(format!("write the same in both places: `{written}` or `{name}`"));
        } else if let Some(candidate) = did_you_mean(name, candidates) {
            message = message.help(format!("did you mean `{candidate}`?"));
            if let Some(entry) = self.entries.get(candidate) {
                message = message.also(entry.span, format!("`{candidate}` is defined here"));
            }
        }
        if name == "l" {
            message = message.help("the litre is `L`: `mg/L`");
        }
        if ["x", "y", "z"].contains(&name) {
            message = message.note(format!("the domain has no axis `{name}`"));
        }
        message
    }
}

/// Whether two names differ by no more than a slip of the fingers.
pub(super) fn is_slip(name: &str, written: &str) -> bool {
    let allowed = (name.chars().count().max(written.chars().count()) / 3).max(1);
    strsim::damerau_levenshtein(name, written) <= allowed
}

fn misspelt_definition(name: &str, first_use: Span, written: &str, entry: &Entry<'_>) -> Diagnostic {
    Diagnostic::error(D004, format!("`{name}` is not defined, and nothing uses `{written}`"))
        .at(entry.span, format!("{} that nothing uses: did you mean `{name}`?", entry.origin.describe()))
        .also(first_use, "no such name")
        .found(format!("`{written}`"))
        .expected(format!("`{name}`"))
        .help(format!("call it `{name}` here, or use `{written}` there"))
}

/// What a name means before any scene speaks.
pub(super) fn reserved_meaning(name: &str, axes: &[String]) -> Option<String> {
    if let Some((_, meaning)) = RESERVED.iter().find(|(reserved, _)| *reserved == name) {
        return Some((*meaning).to_owned());
    }
    if axes.iter().any(|axis| axis == name) {
        return Some(format!("the coordinate along axis `{name}` of the domain"));
    }
    BUILT_IN_FUNCTIONS.contains(&name).then(|| format!("the built-in function `{name}`"))
}

/// The values that a function's parameters have while its body is checked.
pub(super) type Locals = Vec<(String, Expr)>;
