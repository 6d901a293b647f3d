//! Conditions over the points of a sweep: parameters, sizes, measures.
//!
//! Owns which names they know and how they are worked out. May use the checker. It deliberately refuses
//! constants that follow a swept parameter: their value here would be that of another point.

use super::check::{Allow, Checker};
use super::expression::{Expr, Node, Type, coordinates};
use super::scope::{Locals, Origin};
use super::slot::collect_names;
use super::sweep::Target;
use super::{Measure, Parameter};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D005, U108};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::Dimension;

/// A name that has a value for each point.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Variable {
    Parameter(String),
    Measure(String),
    Particles,
    /// Time step, s.
    Step,
    /// Simulated time, s.
    Duration,
    Steps,
    /// Bins of the averages, over all axes.
    Bins,
    WallTime,
    CpuTime,
    MassDefect,
}

const SIZES: &[(&str, Variable, Dimension)] = &[
    ("particles", Variable::Particles, Dimension::NONE),
    ("step", Variable::Step, Dimension::TIME),
    ("duration", Variable::Duration, Dimension::TIME),
    ("steps", Variable::Steps, Dimension::NONE),
    ("bins", Variable::Bins, Dimension::NONE),
];

const FACTS: &[(&str, Variable, Dimension)] = &[
    ("wall_time", Variable::WallTime, Dimension::TIME),
    ("cpu_time", Variable::CpuTime, Dimension::TIME),
    ("mass_defect", Variable::MassDefect, Dimension::NONE),
];

/// Whether a name is that of a size, or of what a run tells of itself.
pub(super) fn is_fact(name: &str) -> bool {
    SIZES.iter().chain(FACTS).any(|(word, ..)| *word == name)
}

/// The names that conditions of a sweep know.
pub(super) struct Known {
    variables: Vec<Variable>,
    locals: Locals,
}

/// Parameters and sizes; with measures also those, and what a run tells of itself.
pub(super) fn known_names(
    checker: &mut Checker<'_>,
    parameters: &[Parameter],
    measures: &[Measure],
) -> Known {
    let mut known = Known { variables: Vec::new(), locals: Vec::new() };
    let place = Span::new(crate::source::FileId(0), 0, 0);
    let mut add = |name: &str, variable: Variable, dimension: Dimension| {
        let node = Node::Species(known.variables.len());
        known.locals.push((name.to_owned(), Expr::leaf(node, dimension, place)));
        known.variables.push(variable);
    };
    for parameter in parameters {
        add(&parameter.name, Variable::Parameter(parameter.name.clone()), parameter.dimension);
    }
    for measure in measures {
        add(&measure.name, Variable::Measure(measure.name.clone()), measure.dimension);
    }
    let facts = if measures.is_empty() { &[][..] } else { FACTS };
    for (name, variable, dimension) in SIZES.iter().chain(facts) {
        // A name of the scene comes first.
        if checker.scope.get(name).is_none() {
            add(name, variable.clone(), *dimension);
        }
    }
    known
}

/// A condition with the names that it uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    pub span: Span,
    /// [`Node::Species`] is the index of a variable.
    expr: Expr,
    pub variables: Vec<Variable>,
}

impl Condition {
    pub(super) fn check<'a>(
        checker: &mut Checker<'a>,
        written: &'a tree::Expr,
        known: &Known,
        swept: &[&Target],
    ) -> Option<Self> {
        let mut names = Vec::new();
        collect_names(written, &mut names);
        for name in &names {
            if let Some(entry) = checker.scope.get_mut(name) {
                entry.n_uses += 1;
            }
            follows_no_sweep(checker, written.span, name, swept)?;
        }
        let expr = checker.check_with(written, Allow::CONSTANT, &known.locals)?;
        if expr.kind != Type::Truth {
            checker.report(
                Diagnostic::error(U108, "a condition is needed here")
                    .at(written.span, format!("this is {}", expr.kind.describe()))
                    .found(expr.kind.describe())
                    .expected("a condition such as `particles > 1e6`"),
            );
            return None;
        }
        Some(Self { span: written.span, expr, variables: known.variables.clone() })
    }

    /// Whether it holds; `value` gives the value of a variable of this point.
    pub fn holds(&self, value: &impl Fn(&Variable) -> f64) -> bool {
        self.value_of(&self.expr, value) != 0.0
    }

    /// The variables that it uses with their values, for messages.
    pub fn uses(&self) -> Vec<&Variable> {
        let mut list = Vec::new();
        self.expr.walk(&mut |expr| {
            if let Node::Species(idx) = expr.node
                && !list.contains(&&self.variables[idx])
            {
                list.push(&self.variables[idx]);
            }
        });
        list
    }

    fn value_of(&self, expr: &Expr, value: &impl Fn(&Variable) -> f64) -> f64 {
        match &expr.node {
            Node::Constant(constant) => *constant,
            Node::Species(idx) => value(&self.variables[*idx]),
            // The checker lets neither into a condition.
            Node::Axis(_) | Node::Time => f64::NAN,
            Node::Unary(operator, a) => operator.apply(self.value_of(a, value)),
            Node::Binary(operator, a, b) => operator.apply(self.value_of(a, value), self.value_of(b, value)),
            Node::Select(condition, a, b) => {
                let chosen = if self.value_of(condition, value) != 0.0 { a } else { b };
                self.value_of(chosen, value)
            }
            Node::Table(table, at) => {
                let at: Vec<f64> = at.iter().map(|expr| self.value_of(expr, value)).collect();
                table.value(coordinates(&at))
            }
        }
    }
}

/// Refuses a `let` that is worked out from a swept parameter.
fn follows_no_sweep(checker: &mut Checker<'_>, span: Span, name: &str, swept: &[&Target]) -> Option<()> {
    let (mut open, mut seen) = (vec![name.to_owned()], vec![name.to_owned()]);
    while let Some(next) = open.pop() {
        let Some(Origin::Let(statement)) = checker.scope.get(&next).map(|entry| entry.origin) else {
            continue;
        };
        let mut names = Vec::new();
        collect_names(&statement.value, &mut names);
        let is_swept =
            |name: &&String| swept.iter().any(|target| matches!(target, Target::Parameter(p) if p == *name));
        if let Some(parameter) = names.iter().find(is_swept) {
            checker.report(
                Diagnostic::error(D005, format!("`{name}` has another value at each point"))
                    .at(span, format!("`{name}` follows the swept parameter `{parameter}`"))
                    .also(statement.name.span, "defined here")
                    .found("a constant made of a swept parameter")
                    .expected("parameters, measures and constants")
                    .help(format!("write its formula here, with `{parameter}` in it")),
            );
            return None;
        }
        names.retain(|name| !seen.contains(name));
        seen.extend(names.iter().cloned());
        open.extend(names);
    }
    Some(())
}
