//! Sources: what is put in, where, how much, when.
//!
//! Owns the statement. May use the scenario's slots. It deliberately cuts nothing into particles.

use super::super::Domain;
use super::super::check::{Allow, Checker};
use super::super::collect::Statements;
use super::super::expression::Type;
use super::super::model::species_index;
use super::super::slot::{Value, tuple_parts};
use super::{Region, Source, Strength};
use crate::diagnostic::codes::{D002, D009, M002, M005, M028, M031, U104};
use crate::diagnostic::{Code, Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree::{self, RegionArgument};
use crate::units::Dimension;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Point,
    Line,
    Box,
    Gaussian,
}

const KINDS: &[(&str, Kind)] =
    &[("point", Kind::Point), ("line", Kind::Line), ("box", Kind::Box), ("gaussian", Kind::Gaussian)];

impl Checker<'_> {
    /// Reports a place that lies outside of the domain, as far as its extents are known.
    pub(in crate::scenario) fn is_inside(
        &mut self,
        places: &[[f64; 3]],
        what: &str,
        span: Span,
        code: Code,
    ) -> Option<()> {
        for &(index, low, high) in &self.extents.clone() {
            let Some(wrong) = places.iter().map(|place| place[index]).find(|x| !(low..=high).contains(x))
            else {
                continue;
            };
            let name = ["x", "y", "z"][index];
            self.report(
                Diagnostic::error(code, format!("{what} lies outside of the domain"))
                    .at(span, format!("{name} = {} m", precise(wrong)))
                    .found(format!("{name} = {} m", precise(wrong)))
                    .expected(format!("{name} from {} m to {} m", precise(low), precise(high))),
            );
            return None;
        }
        Some(())
    }
}

/// What a value of a source can be, of a species with this concentration.
pub(super) fn dimensions(concentration: Dimension, n_axes: usize) -> [Dimension; 3] {
    let space = Dimension::LENGTH.power(n_axes as i32, 1).unwrap_or(Dimension::NONE);
    let amount = concentration.times(space);
    [concentration, amount.over(Dimension::TIME), amount]
}

/// The concentration of a species of which a source gives this much.
pub fn concentration_for(kind: Type, n_axes: usize) -> Option<Dimension> {
    let Type::Number(found) = kind else { return None };
    [Dimension::MOLAR_CONCENTRATION, Dimension::MASS_CONCENTRATION]
        .into_iter()
        .find(|&concentration| dimensions(concentration, n_axes).contains(&found))
}

/// All sources; nothing if one is wrong.
pub fn sources<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    duration: Option<f64>,
    domain: Option<&Domain>,
) -> Option<Vec<Source>> {
    let mut list = Vec::new();
    let mut is_right = true;
    for (idx, (span, written)) in statements.sources.iter().enumerate() {
        let name = &written.name;
        if let Some((_, first)) = statements.sources[..idx].iter().find(|(_, it)| it.name.value == name.value)
        {
            checker.report(
                Diagnostic::error(D002, format!("source `{}` is defined twice", name.value))
                    .at(name.span, "here again")
                    .also(first.name.span, "first here")
                    .found("a second definition")
                    .expected("one definition of each source"),
            );
            is_right = false;
        }
        match source(checker, *span, written, duration) {
            Some(sources) => list.extend(sources),
            None => is_right = false,
        }
    }
    // Without its extents nothing can be said of places.
    domain?;
    is_right.then_some(list)
}

fn source<'a>(
    checker: &mut Checker<'a>,
    span: Span,
    written: &'a tree::Source,
    duration: Option<f64>,
) -> Option<Vec<Source>> {
    let is_table = written.arguments.is_empty() && checker.table_of(&written.region.value).is_some();
    let region = if is_table { None } else { region(checker, written) };
    let end = duration.unwrap_or(f64::INFINITY);
    let during = written.during.as_ref().map(|range| {
        let (from, to, _) = checker.range(range, "the time of a source", Some(Dimension::TIME))?;
        let found = format!("{} s", precise(from.value));
        let rule = format!("from 0 s to below {} s, the end of the run", precise(end));
        let is_within = (0.0..end).contains(&from.value);
        checker.require(is_within, "the beginning of a source", found, &rule, from.span)?;
        Some((from, to))
    });
    let mut list = Vec::new();
    let mut is_right = true;
    let table = written.arguments.is_empty().then(|| checker.table_of(&written.region.value)).flatten();
    for (place, assignment) in written.carried.iter().enumerate() {
        if let Some(first) = written.carried[..place].iter().find(|it| it.name.value == assignment.name.value)
        {
            checker.report(
                Diagnostic::error(M002, format!("`{}` is given twice", assignment.name.value))
                    .at(assignment.name.span, "here again")
                    .also(first.name.span, "first here")
                    .found("one species twice")
                    .expected("each species once"),
            );
            is_right = false;
            continue;
        }
        let found = match (table, &region) {
            (Some(table), _) => super::cloud::rows(checker, table, written, assignment),
            (None, region) => strength(checker, assignment).zip(region.clone()),
        };
        match found {
            Some(found) => list.push((found, assignment)),
            None => is_right = false,
        }
    }
    let during = match during {
        Some(during) => Some(during?),
        None => None,
    };
    let mut sources = Vec::new();
    for (((species, strength), region), assignment) in list {
        is_right &= check_strength(checker, &strength, &region, during, written, assignment).is_some();
        let window = match strength {
            Strength::Pulse(_) => None,
            _ => during.map(|(from, to)| (from.value, to.value)).or(Some((0.0, duration?))),
        };
        let name = written.name.value.clone();
        sources.push(Source { name, span, species, region, strength, during: window });
    }
    is_right.then_some(sources)
}

/// What the dimension of the value says.
fn strength<'a>(checker: &mut Checker<'a>, written: &'a tree::Assignment) -> Option<(usize, Strength)> {
    let species = species_index(checker, &written.name);
    let value = checker.check(&written.value, Allow::TIME);
    let (species, value) = (species?, value?);
    let n_axes = checker.axes.len();
    let Some(concentration) = checker.concentration_of(species) else {
        if value.kind != Type::Zero && concentration_for(value.kind, n_axes).is_none() {
            let molar = dimensions(Dimension::MOLAR_CONCENTRATION, n_axes);
            report_dimension(checker, written, value.kind, molar, n_axes);
        }
        return None;
    };
    let wanted = dimensions(concentration, n_axes);
    let what = format!("what the source gives of `{}`", written.name.value);
    let found = match value.kind {
        Type::Zero => Some(0),
        Type::Number(dimension) => wanted.iter().position(|own| *own == dimension),
        Type::Truth => None,
    };
    let Some(found) = found else {
        report_dimension(checker, written, value.kind, wanted, n_axes);
        return None;
    };
    let constant = value.value();
    if let Some(number) = constant {
        let dimension = value.kind.dimension().unwrap_or_default();
        let shown = checker.shown(number, dimension, written.value.span);
        checker.require(number >= 0.0, &what, shown, "zero or more", written.value.span)?;
    }
    let strength = match (found, constant) {
        (0, _) => Strength::Held(value),
        (1, _) => Strength::Rate(value),
        (_, Some(number)) => Strength::Pulse(number),
        (_, None) => {
            checker.report(
                Diagnostic::error(M031, "an amount comes at once, at the start of the run")
                    .at(written.value.span, "this changes in time")
                    .found("an amount and `t`")
                    .expected("an amount per time that changes, or a constant amount")
                    .help("divide the amount by the time that it takes"),
            );
            return None;
        }
    };
    Some((species, strength))
}

pub(super) fn report_dimension(
    checker: &mut Checker<'_>,
    written: &tree::Assignment,
    found: Type,
    [concentration, rate, amount]: [Dimension; 3],
    n_axes: usize,
) {
    let name = &written.name.value;
    let mut message = Diagnostic::error(U104, format!("this is no source of `{name}`"))
        .at(written.value.span, format!("this is {}", found.describe()))
        .found(found.describe())
        .expected(format!(
            "a concentration ({}), an amount per time ({}) or an amount ({})",
            concentration.unit_text(),
            rate.unit_text(),
            amount.unit_text()
        ));
    let missing = ["m^2", "m"].get(n_axes.wrapping_sub(1));
    if let (Some(missing), Type::Number(dimension)) = (missing, found) {
        let space = Dimension::LENGTH.power(3 - n_axes as i32, 1).unwrap_or(Dimension::NONE);
        if [rate, amount].contains(&dimension.over(space)) {
            let axes = if n_axes == 1 { "1 axis".to_owned() } else { format!("{n_axes} axes") };
            message = message.help(format!(
                "in a domain with {axes} amounts are per {missing}: divide it by the {}",
                if n_axes == 1 { "area across the line" } else { "thickness of the domain" }
            ));
        }
    }
    checker.report(message);
}

fn check_strength(
    checker: &mut Checker<'_>,
    strength: &Strength,
    region: &Region,
    during: Option<(Value, Value)>,
    written: &tree::Source,
    assignment: &tree::Assignment,
) -> Option<()> {
    let refuse = |message: &str, place: Span, label: &str, found: &str, expected: &str, help: &str| {
        Diagnostic::error(M031, message)
            .at(place, label)
            .also(assignment.value.span, "this value")
            .found(found)
            .expected(expected)
            .help(help)
    };
    let message = match (strength, region, during) {
        (Strength::Held(_), Region::Box(..), _) | (Strength::Rate(_), ..) | (Strength::Pulse(_), _, None) => {
            return Some(());
        }
        (Strength::Held(_), ..) => refuse(
            "a concentration is kept in a box",
            written.region.span,
            "has no volume of its own",
            &format!("a concentration and `{}`", written.region.value),
            "a concentration in a `box`, or an amount",
            "write `in box(…)`, or an amount per time",
        ),
        (Strength::Pulse(_), _, Some((from, to))) => refuse(
            "an amount comes at once, at the start of the run",
            from.span.to_if_same_file(to.span),
            "a time window here",
            "an amount and a time window",
            "an amount per time, or no `during`",
            "divide the amount by the length of the window",
        ),
    };
    checker.report(message);
    None
}

fn region<'a>(checker: &mut Checker<'a>, written: &'a tree::Source) -> Option<Region> {
    let kind = checker.word(&written.region, "a region", KINDS)?;
    let name = &written.region;
    let arguments = &written.arguments;
    let what = format!("the {} of source `{}`", name.value, written.name.value);
    let (region, places) = match kind {
        Kind::Point => {
            let at = point(checker, name, arguments, &what)?;
            (Region::Point(at), vec![at])
        }
        Kind::Box => {
            let (low, high) = edges(checker, name, arguments)?;
            (Region::Box(low, high), vec![low, high])
        }
        Kind::Line => {
            let [from, to] = two(checker, name, arguments, "two points")?;
            let (from, to) = (
                checker.vector(from, &what, Dimension::LENGTH),
                checker.vector(to, &what, Dimension::LENGTH),
            );
            (Region::Line(from?, to?), vec![from?, to?])
        }
        Kind::Gaussian => {
            let [centre, deviation] = two(checker, name, arguments, "a centre and a standard deviation")?;
            let centre = checker.vector(centre, &what, Dimension::LENGTH);
            let deviation = deviation_of(checker, deviation);
            (Region::Gaussian(centre?, deviation?), vec![centre?])
        }
    };
    let span = match (arguments.first(), arguments.last()) {
        (Some(first), Some(last)) => span_of(first).to_if_same_file(span_of(last)),
        _ => name.span,
    };
    checker.is_inside(&places, &what, span, M028)?;
    Some(region)
}

fn span_of(argument: &RegionArgument) -> Span {
    match argument {
        RegionArgument::Range(range) => range.low.span.to_if_same_file(range.high.span),
        RegionArgument::Value(value) => value.span,
    }
}

fn wrong_arguments<T>(
    checker: &mut Checker<'_>,
    name: &tree::Name,
    arguments: &[RegionArgument],
    expected: &str,
) -> Option<T> {
    let n = arguments.len();
    let found = if n == 1 { "1 argument".to_owned() } else { format!("{n} arguments") };
    checker.report(
        Diagnostic::error(D009, format!("`{}` takes {expected}", name.value))
            .at(name.span, format!("{found} here"))
            .found(found)
            .expected(expected),
    );
    None
}

/// `point(3 m, 4 m)`, or `point((3 m, 4 m))`.
fn point<'a>(
    checker: &mut Checker<'a>,
    name: &tree::Name,
    arguments: &'a [RegionArgument],
    what: &str,
) -> Option<[f64; 3]> {
    let mut values: Vec<&'a tree::Expr> = Vec::new();
    for argument in arguments {
        let RegionArgument::Value(value) = argument else {
            return wrong_arguments(checker, name, arguments, "a coordinate for each axis of the domain");
        };
        values.push(value);
    }
    if let [one] = values[..] {
        values = tuple_parts(one);
    }
    if values.len() != checker.axes.len() {
        return wrong_arguments(checker, name, arguments, "a coordinate for each axis of the domain");
    }
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    let values: Vec<Option<Value>> =
        values.into_iter().map(|value| checker.slot(value, what, Dimension::LENGTH)).collect();
    let mut at = [0.0; 3];
    for (index, value) in indices.into_iter().zip(values) {
        at[index] = value?.value;
    }
    Some(at)
}

/// `box(5 .. 10 m, 30 .. 50 m)`: a range for each axis.
fn edges<'a>(
    checker: &mut Checker<'a>,
    name: &tree::Name,
    arguments: &'a [RegionArgument],
) -> Option<([f64; 3], [f64; 3])> {
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    let all_ranges = arguments.iter().all(|argument| matches!(argument, RegionArgument::Range(_)));
    if arguments.len() != indices.len() || !all_ranges {
        return wrong_arguments(
            checker,
            name,
            arguments,
            "a range `low .. high` for each axis of the domain",
        );
    }
    let mut is_right = true;
    for (index, argument) in indices.into_iter().zip(arguments) {
        let RegionArgument::Range(range) = argument else { continue };
        match checker.range(range, "an edge of the box", Some(Dimension::LENGTH)) {
            Some((from, to, _)) => (low[index], high[index]) = (from.value, to.value),
            None => is_right = false,
        }
    }
    is_right.then_some((low, high))
}

fn two<'a>(
    checker: &mut Checker<'a>,
    name: &tree::Name,
    arguments: &'a [RegionArgument],
    expected: &str,
) -> Option<[&'a tree::Expr; 2]> {
    match arguments {
        [RegionArgument::Value(a), RegionArgument::Value(b)] => Some([a, b]),
        _ => wrong_arguments(checker, name, arguments, expected),
    }
}

/// One length for all axes, or one for each.
fn deviation_of<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr) -> Option<[f64; 3]> {
    let what = "the standard deviation";
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    let deviation = if tuple_parts(written).len() == 1 {
        let value = checker.slot(written, what, Dimension::LENGTH)?.value;
        let mut all = [0.0; 3];
        indices.iter().for_each(|&index| all[index] = value);
        all
    } else {
        checker.vector(written, what, Dimension::LENGTH)?
    };
    if let Some(wrong) = deviation.iter().find(|value| **value < 0.0) {
        checker.report(
            Diagnostic::error(M005, "the standard deviation is out of range")
                .at(written.span, format!("this is {} m", precise(*wrong)))
                .found(format!("{} m", precise(*wrong)))
                .expected("zero or more"),
        );
        return None;
    }
    Some(deviation)
}
