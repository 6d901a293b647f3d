//! One function per statement: its parts in the order of the grammar.
//!
//! Owns the shapes of statements. May use the expressions beside it.
//! It deliberately resolves no name; clauses in free order are counted, nothing else is checked.

use super::expressions::{bare_number, operand};
use super::kernels::estimate;
use super::{Parts, Place, data, span_at, spanned, sweeps, transport};
use crate::diagnostic::{Diagnostic, codes};
use crate::source::{Span, Spanned};
use crate::syntax::climb::Built;
use crate::syntax::grammar::Rule;
use crate::syntax::tree::{
    self, Arrow, Assignment, Average, Axis, Count, Domain, Expr, ExprKind, Field, Function, Kernel, Let,
    Measure, Name, Output, Param, Particles, Qualifier, Rate, Reaction, Reference, Run, Species,
    StatementKind, Target, Term, Times, UnaryOperator, Use, Zone,
};
use pest::iterators::Pair;

/// The kind of the statement whose rule is `rule`.
pub fn kind(mut parts: Parts, rule: Rule) -> Built<StatementKind> {
    use StatementKind as S;
    let parts = &mut parts;
    Ok(match rule {
        Rule::edition => S::Edition(whole_number(parts, "an edition")?),
        Rule::title => S::Title(parts.text()?),
        Rule::cite => {
            S::Cite(std::iter::from_fn(|| parts.optional_text().transpose()).collect::<Built<_>>()?)
        }
        Rule::seed => S::Seed(whole_number(parts, "a seed")?),
        Rule::constant => {
            S::Let(Let { name: parts.name()?, value: parts.expression()?, doc: parts.optional_text()? })
        }
        Rule::parameter => S::Param(parameter(parts)?),
        Rule::function => S::Function(Function {
            name: parts.name()?,
            parameters: parts.names(Rule::name),
            body: parts.expression()?,
        }),
        Rule::species => S::Species(each(parts, Rule::species_item, species)?),
        Rule::reaction => S::Reaction(reaction(parts)?),
        Rule::chemistry => S::Chemistry(each(parts, Rule::chemistry_setting, field)?),
        Rule::domain => S::Domain(domain(parts)?),
        Rule::boundary => S::Boundary(transport::boundary(parts)?),
        Rule::medium => S::Medium(each(parts, Rule::medium_part, field)?),
        Rule::flow => S::Flow(transport::flow(parts)?),
        Rule::dispersion => S::Dispersion(transport::dispersion(parts)?),
        Rule::source => S::Source(transport::source(parts)?),
        Rule::mixing => S::MixingZones(each(parts, Rule::zone, zone)?),
        Rule::exchange => S::Exchange(each(parts, Rule::exchange_setting, field)?),
        Rule::kernel => match parts.take(Rule::estimate) {
            Some(pair) => S::Estimate(estimate(&mut Parts::of(parts.place, pair))?),
            None => S::Kernel(kernel(parts)?),
        },
        Rule::average => S::Average(average(parts)?),
        Rule::initial => S::Initial(each(parts, Rule::assignment, assignment)?),
        Rule::particles => S::Particles(particles(parts)?),
        Rule::run => S::Run(run(parts)?),
        Rule::output => S::Output(output(parts)?),
        Rule::reference => S::Reference(reference(parts)?),
        Rule::measure => S::Measure(measure(parts)?),
        Rule::data => S::Data(data::data(parts)?),
        Rule::r#use => S::Use(Use { path: parts.text()?, alias: parts.name()? }),
        Rule::report => S::Report(sweeps::report(parts)?),
        _ => S::Sweep(sweeps::sweep(parts)?),
    })
}

/// The word in front of bins; a setting may stand in their place.
const BINS: &str = "bins";

fn average(parts: &mut Parts) -> Built<Average> {
    let mut average = Average { bins: None, settings: Vec::new() };
    for (name, mut values) in each(parts, Rule::average_part, average_part)? {
        // The grammar takes a word or a number for a count.
        match values.pop() {
            Some(value) if values.is_empty() && (name.value != BINS || average.bins.is_some()) => {
                average.settings.push(Field { name, value });
            }
            last => {
                values.extend(last);
                average.bins = Some((name, values));
            }
        }
    }
    Ok(average)
}

fn average_part(parts: &mut Parts) -> Built<(Name, Vec<Expr>)> {
    if let Some(pair) = parts.take(Rule::kind) {
        let name = Parts::of(parts.place, pair).name()?;
        return Ok((name, counts(parts)?));
    }
    let pair = parts.need(Rule::exchange_setting)?;
    let Field { name, value } = field(&mut Parts::of(parts.place, pair))?;
    Ok((name, vec![value]))
}

/// All following parts of one rule, each built by `build`.
pub fn each<T>(parts: &mut Parts, rule: Rule, build: fn(&mut Parts) -> Built<T>) -> Built<Vec<T>> {
    let place = parts.place;
    std::iter::from_fn(|| parts.take(rule)).map(|pair| build(&mut Parts::of(place, pair))).collect()
}

pub fn whole_number<T: std::str::FromStr>(parts: &mut Parts, what: &str) -> Built<Spanned<T>> {
    let pair = parts.need(Rule::bare_number)?;
    let span = span_at(parts.place, &pair);
    match pair.as_str().replace('_', "").parse() {
        Ok(value) => Ok(Spanned::new(value, span)),
        Err(_) => Err(Box::new(
            Diagnostic::error(codes::S013, format!("{what} is a whole number"))
                .at(span, "not a whole number in its range")
                .expected("digits only, such as `42`"),
        )),
    }
}

fn parameter(parts: &mut Parts) -> Built<Param> {
    let (name, value) = (parts.name()?, parts.expression()?);
    let has_range = parts.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::range);
    let range = has_range.then(|| parts.range()).transpose()?;
    Ok(Param { name, value, range, doc: parts.optional_text()? })
}

/// `W(q) = (1 - q)^2 support 1`
fn kernel(parts: &mut Parts) -> Built<Kernel> {
    let (name, parameter, value) = (parts.name()?, parts.name()?, parts.expression()?);
    let support = parts.need(Rule::support)?;
    let support = Parts::of(parts.place, support).expression()?;
    Ok(Kernel { name, parameter, value, support, doc: parts.optional_text()? })
}

fn species(parts: &mut Parts) -> Built<Species> {
    let name = parts.name()?;
    let mut qualifiers = each(parts, Rule::qualifier, qualifier)?;
    let doc = parts.optional_text()?;
    loop {
        qualifiers.extend(each(parts, Rule::qualifier, qualifier)?);
        let Some(pair) = parts.take(Rule::valued) else { break };
        qualifiers.push(valued(&mut Parts::of(parts.place, pair))?);
    }
    Ok(Species { name, qualifiers, doc })
}

fn qualifier(parts: &mut Parts) -> Built<Qualifier> {
    let place = parts.place;
    if let Some(pair) = parts.take(Rule::charge) {
        let mut inner = Parts::of(place, pair);
        let name = inner.need(Rule::charge_word)?;
        let value = signed_number(place, inner.need(Rule::signed_number)?)?;
        return Ok(Qualifier { name: spanned(place, &name), value: Some(value) });
    }
    if let Some(pair) = parts.take(Rule::ion_size) {
        let mut inner = Parts::of(place, pair);
        let name = inner.need(Rule::ion_size_word)?;
        return Ok(Qualifier { name: spanned(place, &name), value: Some(inner.expression()?) });
    }
    if let Some(pair) = parts.take(Rule::valued) {
        return valued(&mut Parts::of(place, pair));
    }
    Ok(Qualifier { name: parts.name()?, value: None })
}

/// `retardation 2`
fn valued(parts: &mut Parts) -> Built<Qualifier> {
    let name = parts.need(Rule::valued_word)?;
    Ok(Qualifier { name: spanned(parts.place, &name), value: Some(parts.expression()?) })
}

/// `2`, `-1`: without a unit, since a further word may follow.
fn signed_number(place: Place, pair: Pair<Rule>) -> Built<Expr> {
    let span = span_at(place, &pair);
    let mut inner = Parts::of(place, pair);
    let sign = inner.take(Rule::sign);
    let number = bare_number(place, inner.need(Rule::bare_number)?)?;
    match sign.filter(|sign| sign.as_str() == "-") {
        None => Ok(number),
        Some(sign) => {
            let operator = Spanned::new(UnaryOperator::Negate, span_at(place, &sign));
            let span = Span { end: number.span.end, ..span };
            Ok(Expr { span, kind: ExprKind::Unary { operator, operand: Box::new(number) } })
        }
    }
}

/// Two words, the second a value: `rate 1 /d`, `tolerance 1e-6`.
pub fn field(parts: &mut Parts) -> Built<Field> {
    Ok(Field { name: parts.name()?, value: parts.expression()? })
}

fn reaction(parts: &mut Parts) -> Built<Reaction> {
    let name = parts.take(Rule::label).map(|label| Parts::of(parts.place, label).name()).transpose()?;
    let reactants = side(parts, Rule::reactants)?;
    let arrow = parts.need(Rule::arrow)?;
    let direction = if arrow.as_str() == "->" { Arrow::Forward } else { Arrow::Both };
    let arrow = Spanned::new(direction, span_at(parts.place, &arrow));
    let products = side(parts, Rule::products)?;
    let place = parts.place;
    let pair = parts.need(Rule::rate)?;
    Ok(Reaction { name, reactants, arrow, products, rate: rate(&mut Parts::of(place, pair))? })
}

fn rate(parts: &mut Parts) -> Built<Rate> {
    let directions = each(parts, Rule::direction, |parts| {
        let word = parts.need(Rule::direction_word)?;
        Ok(Field { name: spanned(parts.place, &word), value: parts.expression()? })
    })?;
    if directions.is_empty() { Ok(Rate::One(parts.expression()?)) } else { Ok(Rate::Directions(directions)) }
}

fn side(parts: &mut Parts, rule: Rule) -> Built<Vec<Term>> {
    let Some(pair) = parts.take(rule) else { return Ok(Vec::new()) };
    each(&mut Parts::of(parts.place, pair), Rule::term, |parts| {
        let place = parts.place;
        let coefficient = parts.take(Rule::coefficient).map(|pair| coefficient(place, pair)).transpose()?;
        Ok(Term { coefficient, species: parts.name()? })
    })
}

/// A number, or the name of one.
fn coefficient(place: Place, pair: Pair<Rule>) -> Built<Expr> {
    let mut inner = Parts::of(place, pair);
    match inner.take(Rule::bare_number) {
        Some(number) => bare_number(place, number),
        None => {
            let name = inner.name()?;
            Ok(Expr { span: name.span, kind: ExprKind::Path(vec![name]) })
        }
    }
}

fn domain(parts: &mut Parts) -> Built<Domain> {
    let shape = parts.wrapped_name(Rule::shape)?;
    let (mut axes, mut frame) = (Vec::new(), Once::default());
    while let Some(pair) = parts.next() {
        let span = span_at(parts.place, &pair);
        let mut inner = Parts::of(parts.place, pair);
        match inner.pairs.peek().map(Pair::as_rule) {
            Some(Rule::axis_name) => axes.push(axis(&mut inner)?),
            Some(Rule::expression) => frame.set("frame moving", span, inner.expression()?)?,
            _ => break,
        }
    }
    Ok(Domain { shape, axes, frame: frame.value() })
}

pub fn axis(parts: &mut Parts) -> Built<Axis> {
    let name = parts.need(Rule::axis_name)?;
    Ok(Axis { name: spanned(parts.place, &name), range: parts.range()? })
}

fn zone(parts: &mut Parts) -> Built<Zone> {
    let name = parts.wrapped_name(Rule::label)?;
    let fields = each(parts, Rule::zone_field, field)?;
    Ok(Zone { name, fields })
}

pub fn counts(parts: &mut Parts) -> Built<Vec<Expr>> {
    let pair = parts.need(Rule::counts)?;
    let mut parts = Parts::of(parts.place, pair);
    let mut counts = Vec::new();
    while let Some(pair) = parts.take(Rule::count) {
        counts.push(count(parts.place, pair)?);
    }
    Ok(counts)
}

/// A bare number, or a name.
pub fn count(place: Place, pair: Pair<Rule>) -> Built<Expr> {
    let mut inner = Parts::of(place, pair);
    match inner.take(Rule::bare_number) {
        Some(number) => bare_number(place, number),
        None => Ok(operand(place, inner.need(Rule::path)?)?.expr),
    }
}

pub fn assignment(parts: &mut Parts) -> Built<Assignment> {
    Ok(Assignment { name: parts.name()?, value: parts.expression()? })
}

fn particles(parts: &mut Parts) -> Built<Particles> {
    let kind = parts.wrapped_name(Rule::kind)?;
    let place = parts.place;
    let shares = each(parts, Rule::share, |parts| {
        let name = parts.name()?;
        let pair = parts.need(Rule::count)?;
        Ok(Field { name, value: count(parts.place, pair)? })
    })?;
    let count = match shares.is_empty() {
        true => Count::All(count(place, parts.need(Rule::count)?)?),
        false => Count::Shares(shares),
    };
    let Some(pair) = parts.take(Rule::placement) else {
        return Ok(Particles { kind, count, placement: None, disorder: None });
    };
    let mut parts = Parts::of(place, pair);
    let placement = Some(parts.name()?);
    let disorder = parts.take(Rule::kw_disorder).map(|_| parts.expression()).transpose()?;
    Ok(Particles { kind, count, placement, disorder })
}

fn run(parts: &mut Parts) -> Built<Run> {
    let duration = parts.expression()?;
    let (mut step, mut settings) = (Once::default(), Vec::new());
    while let Some(pair) = parts.next() {
        let (rule, span) = (pair.as_rule(), span_at(parts.place, &pair));
        let mut inner = Parts::of(parts.place, pair);
        match rule {
            Rule::run_step => step.set("step", span, inner.expression()?)?,
            Rule::setting => settings.push((inner.name()?, inner.name()?)),
            _ => break,
        }
    }
    Ok(Run { duration, step: step.value(), settings })
}

fn output(parts: &mut Parts) -> Built<Output> {
    let kind = parts.wrapped_name(Rule::output_kind)?;
    let species = species_list(parts)?;
    let mut clauses = Clauses::read(parts)?;
    Ok(Output {
        kind,
        species,
        times: clauses.times.value(),
        along: clauses.along.value(),
        grid: clauses.on.value().unwrap_or_default(),
        unit: clauses.unit.value(),
        place: clauses.place.value(),
        averaging: clauses.averaging.value(),
    })
}

fn species_list(parts: &mut Parts) -> Built<Vec<Spanned<String>>> {
    let Some(pair) = parts.take(Rule::species_list) else { return Ok(Vec::new()) };
    Ok(Parts::of(parts.place, pair).names(Rule::name))
}

fn reference(parts: &mut Parts) -> Built<Reference> {
    let place = parts.place;
    if let Some(pair) = parts.take(Rule::reference_call) {
        let mut inner = Parts::of(place, pair);
        let value = operand(place, inner.need(Rule::call)?)?.expr;
        return Ok(Reference { name: None, target: target(&mut inner)?, value });
    }
    let pair = parts.need(Rule::reference_formula)?;
    let mut inner = Parts::of(place, pair);
    let name = Some(inner.name()?);
    Ok(Reference { name, target: target(&mut inner)?, value: inner.expression()? })
}

fn target(parts: &mut Parts) -> Built<Target> {
    let pair = parts.need(Rule::target)?;
    let mut inner = Parts::of(parts.place, pair);
    let output = inner.take(Rule::target_kind).map(|pair| Parts::of(inner.place, pair).name()).transpose()?;
    Ok(Target { output, species: inner.names(Rule::dotted) })
}

fn measure(parts: &mut Parts) -> Built<Measure> {
    let (name, value) = (parts.name()?, parts.expression()?);
    let mut clauses = Clauses::read(parts)?;
    let times = match clauses.times.value() {
        Some(Times::List(times)) => Some(times),
        _ => None,
    };
    Ok(Measure { name, value, over: clauses.over.value(), times, doc: parts.optional_text()? })
}

/// The clauses that may follow in any order, each once.
#[derive(Default)]
struct Clauses {
    times: Once<Times>,
    along: Once<Spanned<String>>,
    on: Once<Vec<Expr>>,
    unit: Once<Spanned<String>>,
    over: Once<Axis>,
    place: Once<tree::Place>,
    averaging: Once<Spanned<String>>,
}

impl Clauses {
    fn read(parts: &mut Parts) -> Built<Self> {
        let mut clauses = Self::default();
        while parts.pairs.peek().is_some_and(|pair| pair.as_rule() != Rule::text) {
            let Some(pair) = parts.next() else { break };
            clauses.add(parts.place, pair)?;
        }
        Ok(clauses)
    }

    fn add(&mut self, place: Place, pair: Pair<Rule>) -> Built<()> {
        let (rule, span) = (pair.as_rule(), keyword_span(place, &pair));
        let (whole, text) = (span_at(place, &pair), pair.as_str().trim().to_owned());
        let mut inner = Parts::of(place, pair);
        match rule {
            Rule::at => self.times.set("at` or `every", span, Times::List(inner.expressions()?)),
            Rule::every => self.times.set("at` or `every", span, Times::Every(inner.expression()?)),
            Rule::at_place => self.place.set("at` a place or `in box", span, output_place(&mut inner)?),
            Rule::in_box => {
                let ranges = std::iter::from_fn(|| inner.take_range()).collect::<Built<Vec<_>>>()?;
                self.place.set("at` a place or `in box", span, tree::Place::Box(whole, ranges))
            }
            Rule::averaging => {
                self.averaging.set("resident` or `flux_weighted", span, Spanned::new(text, whole))
            }
            Rule::along => self.along.set("along", span, spanned(place, &inner.need(Rule::axis_name)?)),
            Rule::on => self.on.set("on", span, counts(&mut inner)?),
            Rule::in_unit => self.unit.set("in", span, spanned(place, &inner.need(Rule::unit)?)),
            _ => self.over.set(
                "over",
                span,
                inner.need(Rule::axis).and_then(|pair| axis(&mut Parts::of(place, pair)))?,
            ),
        }
    }
}

/// `at x = 10 m`, `at right` or parts of these, or `at well pump`
fn output_place(parts: &mut Parts) -> Built<tree::Place> {
    if let Some(side) = parts.take(Rule::side) {
        let part = match parts.take(Rule::patch) {
            Some(pair) => each(&mut Parts::of(parts.place, pair), Rule::axis, axis)?,
            None => Vec::new(),
        };
        return Ok(tree::Place::Side(spanned(parts.place, &side), part));
    }
    let Some(plane) = parts.take(Rule::plane) else { return Ok(tree::Place::Well(parts.name()?)) };
    let mut inner = Parts::of(parts.place, plane);
    let name = inner.need(Rule::axis_name)?;
    let at = inner.expression()?;
    Ok(tree::Place::Plane(spanned(inner.place, &name), at, each(&mut inner, Rule::axis, axis)?))
}

/// The place of the word that a clause begins with.
fn keyword_span(place: Place, pair: &Pair<Rule>) -> Span {
    pair.clone().into_inner().next().map_or_else(|| span_at(place, pair), |keyword| span_at(place, &keyword))
}

/// A clause that may stand once.
pub struct Once<T>(Option<(Span, T)>);

impl<T> Default for Once<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> Once<T> {
    pub fn set(&mut self, what: &str, span: Span, value: T) -> Built<()> {
        if let Some((first, _)) = &self.0 {
            let diagnostic = Diagnostic::error(codes::S011, format!("`{what}` stands here twice"))
                .at(span, "the second")
                .also(*first, "the first")
                .help("keep one of them");
            return Err(Box::new(diagnostic));
        }
        self.0 = Some((span, value));
        Ok(())
    }

    pub fn value(&mut self) -> Option<T> {
        self.0.take().map(|(_, value)| value)
    }
}
