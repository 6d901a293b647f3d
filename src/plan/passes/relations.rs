//! Fields that follow from others by a conservation relation are not carried.
//!
//! Transport, exchange with the mean and instant reactions on totals are linear and keep constants,
//! so a relation between initial concentrations, `U_b = α + Σ β_k U_k`, holds for ever. Relations are
//! found by writing every initial concentration as a constant plus a combination of basis
//! functions (indicators of conditions, coordinates, anything not linear) and eliminating.
//!
//! Components that reactions at finite rates change are always carried and make no relation: as the
//! difference of two others one would have their errors, and near zero nothing but that. What moves and what
//! stays in its bin have no relation but that of constants.

use super::Draft;
use super::species::{retain_by, retain_carried};
use crate::diagnostic::number;
use crate::maths::operator::{Binary, Unary};
use crate::plan::chemistry::Method;
use crate::plan::tape::{Operation, Register, Tape};
use crate::plan::transport::{SideRule, Transport};
use crate::plan::{Component, Plan};
use std::collections::BTreeMap;

/// A constant plus multiples of basis functions, which are named by a canonical text.
#[derive(Debug, Clone, PartialEq, Default)]
struct Affine {
    constant: f64,
    terms: BTreeMap<String, f64>,
}

/// Relations are accepted when they hold to this relative size.
const TOLERANCE: f64 = 1e-12;

pub(super) fn run(draft: &mut Draft) {
    if draft.plan.carries_mass() {
        return;
    }
    let mut forms: Vec<Affine> = draft.plan.components.iter().map(form_of).collect();
    if let Some(transport) = &draft.plan.transport {
        forms.iter_mut().enumerate().for_each(|(component, form)| add_sides(form, transport, component));
    }
    let mut kept: Vec<usize> = Vec::new();
    // Of those that are kept, the ones that others may follow from.
    let mut still: Vec<usize> = Vec::new();
    let mut relations: Vec<Option<Relation>> = Vec::new();
    for (idx, form) in forms.iter().enumerate() {
        let is_changed = is_changed(&draft.plan, idx);
        let relation = if is_changed { None } else { express(form, &still, &forms) };
        if relation.is_none() {
            kept.push(idx);
        }
        if relation.is_none() && !is_changed {
            still.push(idx);
        }
        relations.push(relation);
    }
    if kept.len() == forms.len() {
        return;
    }
    note(draft, &relations);
    restore(draft, &relations, &kept);
}

/// A component over initial shapes; those of what stays in its bin are shapes of their own.
fn form_of(component: &Component) -> Affine {
    let mut form = affine_of(&component.initial);
    if component.is_immobile {
        form.terms = form.terms.into_iter().map(|(name, value)| (format!("resting {name}"), value)).collect();
    }
    form
}

/// Adds what sides and wells bring: a relation must hold there, too, with the same constant.
fn add_sides(form: &mut Affine, transport: &Transport, component: usize) {
    let start = form.constant;
    let mut add = |place: &str, other: Affine| {
        let level = other.constant - start;
        let shapes = other.terms.into_iter().map(|(name, value)| (format!("{place} {name}"), value));
        form.terms.extend(shapes);
        if level != 0.0 {
            form.terms.insert(format!("{place} level"), level);
        }
    };
    for (idx, patch) in transport.sides.iter().flatten().flatten().enumerate() {
        match &patch.rule {
            SideRule::Inflow(tapes) | SideRule::Held(tapes) => {
                if let Some(tape) = tapes.get(component) {
                    add(&format!("side {idx}"), affine_of(tape));
                }
            }
            // Nothing comes in there, and what goes takes all components alike.
            SideRule::Reflect | SideRule::Periodic | SideRule::Open | SideRule::Outflow => {}
            // What is taken out of the water leaves it with less of all.
            SideRule::Absorb | SideRule::Partial(_) => add("clean", Affine::default()),
        }
    }
    if transport.injects() {
        add("clean", Affine::default());
    }
}

/// Whether reactions change a component in steps.
fn is_changed(plan: &Plan, component: usize) -> bool {
    let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
    // Of a network that is propagated when somebody looks, particles carry what has not reacted.
    let in_steps = kinetics.filter(|kinetics| kinetics.method != Method::Observed);
    in_steps.is_some_and(|kinetics| {
        kinetics
            .reactions
            .iter()
            .any(|reaction| reaction.changes.iter().any(|(other, _)| *other == component))
    })
}

/// Whether a species of this name takes part in a reaction of any kind.
fn is_reacting(plan: &Plan, name: &str) -> bool {
    let Some(idx) = plan.species.iter().position(|species| species.name == name) else { return false };
    let is_it = |(species, _): &(usize, f64)| *species == idx;
    let is_instant = plan.reactions.iter().any(|own| own.reactants.iter().chain(&own.products).any(is_it));
    let component = plan.components.iter().position(|component| component.name == name);
    let chemistry = plan.chemistry.as_ref();
    let kinetics = chemistry.and_then(|chemistry| chemistry.kinetics.as_ref());
    let is_slow = kinetics.is_some_and(|kinetics| {
        let mut changes = kinetics.reactions.iter().flat_map(|reaction| &reaction.changes);
        changes.any(|(other, _)| Some(*other) == component)
    });
    let equilibrium = chemistry.and_then(|chemistry| chemistry.equilibrium.as_ref());
    let is_balanced =
        equilibrium.is_some_and(|equilibrium| equilibrium.primaries.iter().any(|own| own.species == idx));
    is_instant || is_slow || is_balanced
}

/// `α + Σ β_k U_k` over kept components.
struct Relation {
    constant: f64,
    terms: Vec<(usize, f64)>,
}

fn note(draft: &mut Draft, relations: &[Option<Relation>]) {
    let name = |idx: usize| draft.plan.components[idx].name.clone();
    let mut notes = Vec::new();
    for (idx, relation) in relations.iter().enumerate() {
        let Some(relation) = relation else { continue };
        let terms: Vec<String> = relation
            .terms
            .iter()
            .map(|(component, factor)| match *factor {
                1.0 => format!(" + {}", name(*component)),
                -1.0 => format!(" - {}", name(*component)),
                factor if factor < 0.0 => format!(" - {} {}", number(-factor), name(*component)),
                factor => format!(" + {} {}", number(factor), name(*component)),
            })
            .collect();
        let constant = number(relation.constant);
        // What is carried is a total, or what there was before reactions that are worked out at outputs.
        let reacts = is_reacting(&draft.plan, &name(idx));
        let why = match (relation.terms.is_empty(), reacts) {
            (true, false) => format!("{constant} everywhere and always, restored at output"),
            (true, true) => format!("{constant} everywhere before reaction, restored at output"),
            (false, false) => format!("{constant}{} everywhere, restored at output", terms.concat()),
            (false, true) => {
                format!("{constant}{} everywhere before reaction, restored at output", terms.concat())
            }
        };
        notes.push((format!("carrying species `{}`", name(idx)), why));
    }
    for (what, why) in notes {
        draft.leave_out(what, why);
    }
}

/// Rewrites species over the kept components and drops the others.
fn restore(draft: &mut Draft, relations: &[Option<Relation>], kept: &[usize]) {
    let place = |component: usize| kept.iter().position(|known| *known == component);
    for species in &mut draft.plan.species {
        rewrite(&mut species.constant, &mut species.terms, relations, &place);
    }
    let is_kept: Vec<bool> = relations.iter().map(Option::is_none).collect();
    retain_by(&mut draft.plan.components, &is_kept);
    if let Some(transport) = &mut draft.plan.transport {
        retain_carried(transport, &is_kept);
    }
    let Some(chemistry) = &mut draft.plan.chemistry else { return };
    retain_by(&mut chemistry.floors, &is_kept);
    // What changes is kept; only its number is another one.
    let kinetics = chemistry.kinetics.iter_mut().filter(|kinetics| kinetics.method != Method::Observed);
    for reaction in kinetics.flat_map(|kinetics| &mut kinetics.reactions) {
        let changes = std::mem::take(&mut reaction.changes);
        reaction.changes =
            changes.into_iter().filter_map(|(component, change)| Some((place(component)?, change))).collect();
    }
    for primary in chemistry.equilibrium.iter_mut().flat_map(|equilibrium| &mut equilibrium.primaries) {
        rewrite(&mut primary.constant, &mut primary.terms, relations, &place);
    }
}

/// An affine combination of all components over the kept ones.
fn rewrite(
    constant: &mut f64,
    terms: &mut Vec<(usize, f64)>,
    relations: &[Option<Relation>],
    place: &impl Fn(usize) -> Option<usize>,
) {
    let mut kept: BTreeMap<usize, f64> = BTreeMap::new();
    for (component, factor) in std::mem::take(terms) {
        match &relations[component] {
            None => *kept.entry(component).or_default() += factor,
            Some(relation) => {
                *constant += factor * relation.constant;
                for (other, share) in &relation.terms {
                    *kept.entry(*other).or_default() += factor * share;
                }
            }
        }
    }
    *terms = kept.into_iter().filter_map(|(component, factor)| Some((place(component)?, factor))).collect();
}

/// The relation of `form` to the kept components, if there is one.
fn express(form: &Affine, kept: &[usize], forms: &[Affine]) -> Option<Relation> {
    if form.terms.is_empty() {
        return form.constant.is_finite().then_some(Relation { constant: form.constant, terms: Vec::new() });
    }
    // A shape that no kept component has cannot be made of them: the usual case, and cheap to see.
    let is_known = |name: &String| kept.iter().any(|idx| forms[*idx].terms.contains_key(name));
    if !form.terms.keys().all(is_known) {
        return None;
    }
    let mut names: Vec<&String> = form.terms.keys().collect();
    kept.iter().for_each(|idx| names.extend(forms[*idx].terms.keys()));
    names.sort_unstable();
    names.dedup();
    let entry = |form: &Affine, row: usize| form.terms.get(names[row]).copied().unwrap_or(0.0);
    let matrix =
        nalgebra::DMatrix::from_fn(names.len(), kept.len(), |row, column| entry(&forms[kept[column]], row));
    let target = nalgebra::DVector::from_fn(names.len(), |row, _| entry(form, row));
    let scale = target.amax();
    let solved = matrix.clone().svd(true, true).solve(&target, 1e-13 * matrix.amax()).ok()?;
    let factors: Vec<f64> = solved.iter().map(|factor| snap(*factor)).collect();
    let residual = (&matrix * nalgebra::DVector::from_vec(factors.clone()) - &target).amax();
    // Not a number is no relation, too.
    if residual.is_nan() || residual > TOLERANCE * scale {
        return None;
    }
    let constant = kept
        .iter()
        .zip(&factors)
        .fold(form.constant, |sum, (idx, factor)| sum - factor * forms[*idx].constant);
    let terms = kept.iter().copied().zip(factors).filter(|(_, factor)| *factor != 0.0).collect();
    constant.is_finite().then_some(Relation { constant, terms })
}

/// The nearest whole number, if the factor is that up to rounding.
fn snap(factor: f64) -> f64 {
    let rounded = factor.round();
    if (factor - rounded).abs() <= 1e-12 * rounded.abs().max(1.0) { rounded } else { factor }
}

fn affine_of(tape: &Tape) -> Affine {
    let mut walker = Walker { tape, texts: Vec::new(), forms: Vec::new() };
    for idx in 0..tape.operations.len() {
        walker.visit(idx);
    }
    walker.forms.pop().unwrap_or_default()
}

/// Works forwards through a tape: a text and an affine form for every register.
struct Walker<'t> {
    tape: &'t Tape,
    texts: Vec<String>,
    forms: Vec<Affine>,
}

impl Walker<'_> {
    fn visit(&mut self, idx: usize) {
        let operation = &self.tape.operations[idx];
        let text = self.text(operation);
        let form = self.form(operation).unwrap_or_else(|| Affine::atom(text.clone()));
        self.texts.push(text);
        self.forms.push(form);
    }

    /// A canonical text; hashed once it grows, so that shared registers stay small.
    fn text(&self, operation: &Operation) -> String {
        let of = |register: Register| self.texts[usize::from(register)].as_str();
        let text = match *operation {
            Operation::Constant(value) => format!("{:016x}", value.to_bits()),
            Operation::Input(column) => format!("in{column}"),
            Operation::Unary(operator, a) => format!("{operator:?}({})", of(a)),
            Operation::Binary(operator, a, b) => format!("{operator:?}({},{})", of(a), of(b)),
            Operation::Select(a, b, c) => format!("Select({},{},{})", of(a), of(b), of(c)),
            Operation::Table(ref lookup) => {
                let at: Vec<&str> = lookup.reads().iter().map(|&register| of(register)).collect();
                format!("{}({})", lookup.table.hash(), at.join(","))
            }
        };
        if text.len() > 200 { blake3::hash(text.as_bytes()).to_hex().to_string() } else { text }
    }

    fn form(&self, operation: &Operation) -> Option<Affine> {
        let of = |register: Register| &self.forms[usize::from(register)];
        match *operation {
            Operation::Constant(value) => Some(Affine { constant: value, terms: BTreeMap::new() }),
            Operation::Unary(Unary::Negate, a) => Some(of(a).times(-1.0)),
            Operation::Binary(Binary::Add, a, b) => Some(of(a).plus(of(b), 1.0)),
            Operation::Binary(Binary::Subtract, a, b) => Some(of(a).plus(of(b), -1.0)),
            Operation::Binary(Binary::Multiply, a, b) => match (of(a).as_constant(), of(b).as_constant()) {
                (Some(factor), _) => Some(of(b).times(factor)),
                (_, Some(factor)) => Some(of(a).times(factor)),
                _ => None,
            },
            Operation::Binary(Binary::Divide, a, b) => {
                of(b).as_constant().map(|divisor| of(a).times(1.0 / divisor))
            }
            Operation::Select(condition, then, otherwise) => {
                let difference = of(then).plus(of(otherwise), -1.0).as_constant()?;
                let indicator = self.indicator(condition);
                Some(of(otherwise).plus(&indicator, difference))
            }
            Operation::Input(_) | Operation::Unary(..) | Operation::Binary(..) | Operation::Table(_) => None,
        }
    }

    /// One where a condition holds, zero elsewhere; `a >= b` is one minus `a < b`.
    fn indicator(&self, condition: Register) -> Affine {
        let of = |register: Register| self.texts[usize::from(register)].as_str();
        let complement = |name: String| Affine { constant: 1.0, terms: BTreeMap::from([(name, -1.0)]) };
        match self.tape.operations[usize::from(condition)] {
            Operation::Binary(Binary::Less, a, b) => Affine::atom(format!("[{}<{}]", of(a), of(b))),
            Operation::Binary(Binary::Greater, a, b) => Affine::atom(format!("[{}<{}]", of(b), of(a))),
            Operation::Binary(Binary::GreaterEqual, a, b) => complement(format!("[{}<{}]", of(a), of(b))),
            Operation::Binary(Binary::LessEqual, a, b) => complement(format!("[{}<{}]", of(b), of(a))),
            Operation::Unary(Unary::Not, a) => {
                Affine { constant: 1.0, terms: BTreeMap::new() }.plus(&self.indicator(a), -1.0)
            }
            _ => Affine::atom(format!("[{}]", of(condition))),
        }
    }
}

impl Affine {
    fn atom(name: String) -> Self {
        Self { constant: 0.0, terms: BTreeMap::from([(name, 1.0)]) }
    }

    fn as_constant(&self) -> Option<f64> {
        self.terms.is_empty().then_some(self.constant)
    }

    fn times(&self, factor: f64) -> Self {
        if factor == 0.0 {
            return Self::default();
        }
        let terms = self.terms.iter().map(|(name, value)| (name.clone(), value * factor)).collect();
        Self { constant: self.constant * factor, terms }
    }

    fn plus(&self, other: &Self, factor: f64) -> Self {
        let mut sum = self.clone();
        sum.constant += other.constant * factor;
        for (name, value) in &other.terms {
            let entry = sum.terms.entry(name.clone()).or_default();
            *entry += value * factor;
            if *entry == 0.0 {
                sum.terms.remove(name);
            }
        }
        sum
    }
}
