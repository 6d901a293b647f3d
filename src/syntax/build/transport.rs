//! Sides, flow, dispersion and sources: their parts in the order of the grammar.
//!
//! Owns the shapes of these statements. May use the statements and expressions beside it. It deliberately
//! resolves no name.

use super::statements::{Once, assignment, axis, counts, each, field};
use super::{Parts, Place, span_at, spanned};
use crate::syntax::climb::Built;
use crate::syntax::grammar::Rule;
use crate::syntax::tree::{
    Assignment, Boundary, Change, ChangeTimes, Column, DarcyEntry, DarcyKind, Dispersion, Expr, Field,
    FileEntry, FileValue, Flow, FlowArgument, Name, RegionArgument, Source, Well,
};
use pest::iterators::Pair;

pub fn boundary(parts: &mut Parts) -> Built<Boundary> {
    let sides = parts.names(Rule::side);
    let patch = match parts.take(Rule::patch) {
        Some(pair) => each(&mut Parts::of(parts.place, pair), Rule::axis, axis)?,
        None => Vec::new(),
    };
    let kind = parts.wrapped_name(Rule::boundary_kind)?;
    let carried = carried(parts)?;
    let rate =
        parts.take(Rule::side_rate).map(|pair| field(&mut Parts::of(parts.place, pair))).transpose()?;
    Ok(Boundary { sides, patch, kind, carried, rate })
}

fn carried(parts: &mut Parts) -> Built<Vec<Assignment>> {
    match parts.take(Rule::carried) {
        Some(pair) => each(&mut Parts::of(parts.place, pair), Rule::assignment, assignment),
        None => Ok(Vec::new()),
    }
}

pub fn flow(parts: &mut Parts) -> Built<Flow> {
    // The `=` is no part; it stands right after the kind.
    let text = parts.pairs.clone().find(|pair| matches!(pair.as_rule(), Rule::assign | Rule::darcy));
    let is_assigned = text.is_some_and(|pair| pair.as_rule() == Rule::assign);
    let kind = parts.wrapped_name(Rule::kind)?;
    let files = parts.take(Rule::files).map(|pair| files(&mut Parts::of(parts.place, pair))).transpose()?;
    let argument = match parts.take(Rule::darcy) {
        None if let Some(files) = files => files,
        Some(pair) => FlowArgument::Entries(entries(&mut Parts::of(parts.place, pair))?),
        None if parts.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::change) => FlowArgument::None,
        None => match parts.optional_expression()? {
            Some(value) if is_assigned => FlowArgument::Assigned(value),
            Some(value) => FlowArgument::Value(value),
            None => FlowArgument::None,
        },
    };
    let change = parts.take(Rule::change).map(|pair| change(parts.place, pair)).transpose()?;
    Ok(Flow { kind, argument, change })
}

fn change(place: Place, pair: Pair<Rule>) -> Built<Change> {
    let span = pair
        .clone()
        .into_inner()
        .next()
        .map_or_else(|| span_at(place, &pair), |keyword| span_at(place, &keyword));
    let mut inner = Parts::of(place, pair);
    let times = match inner.take(Rule::change_times) {
        Some(pair) => ChangeTimes::At(Parts::of(place, pair).expressions()?),
        None => ChangeTimes::Every(Parts::of(place, inner.need(Rule::every)?).expression()?),
    };
    Ok(Change { span, times })
}

fn files(parts: &mut Parts) -> Built<FlowArgument> {
    let mut names = Vec::new();
    while let Some(text) = parts.optional_text()? {
        names.push(text);
    }
    Ok(FlowArgument::Files(names, each(parts, Rule::file_entry, file_entry)?))
}

fn file_entry(parts: &mut Parts) -> Built<FileEntry> {
    let word = parts.need(Rule::entry_word)?;
    let word = spanned(parts.place, &word);
    let value = match parts.pairs.peek().map(Pair::as_rule) {
        Some(Rule::file_unit) => FileValue::Unit(file_unit(parts)?),
        Some(Rule::corner) => {
            let pair = parts.need(Rule::corner)?;
            FileValue::Value(Parts::of(parts.place, pair).expression()?)
        }
        _ => FileValue::Columns(each(parts, Rule::file_column, file_column)?),
    };
    Ok(FileEntry { word, value })
}

fn file_unit(parts: &mut Parts) -> Built<Name> {
    let pair = parts.need(Rule::file_unit)?;
    let unit = Parts::of(parts.place, pair).need(Rule::unit)?;
    Ok(spanned(parts.place, &unit))
}

fn file_column(parts: &mut Parts) -> Built<Column> {
    let text = parts.optional_text()?;
    let is_quoted = text.is_some();
    let name = text.map_or_else(|| parts.name(), Ok)?;
    let has_unit = parts.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::file_unit);
    let unit = has_unit.then(|| file_unit(parts)).transpose()?;
    Ok(Column { name, is_quoted, unit })
}

fn entries(parts: &mut Parts) -> Built<Vec<DarcyEntry>> {
    let mut list = Vec::new();
    while let Some(pair) = parts.next() {
        let word = pair
            .clone()
            .into_inner()
            .next()
            .map_or_else(|| span_at(parts.place, &pair), |keyword| span_at(parts.place, &keyword));
        let kind = entry(parts, pair)?;
        list.push(DarcyEntry { word, kind });
    }
    Ok(list)
}

fn entry(parts: &Parts, pair: Pair<Rule>) -> Built<DarcyKind> {
    let rule = pair.as_rule();
    if rule == Rule::change {
        return Ok(DarcyKind::Change(change(parts.place, pair)?));
    }
    let mut inner = Parts::of(parts.place, pair);
    Ok(match rule {
        Rule::head => DarcyKind::Head(each(&mut inner, Rule::side_value, side_value)?),
        Rule::flux => DarcyKind::Flux(each(&mut inner, Rule::side_value, side_value)?),
        Rule::no_flow => DarcyKind::NoFlow(inner.names(Rule::side)),
        Rule::periodic => DarcyKind::Periodic(inner.names(Rule::side)),
        Rule::conductivity => DarcyKind::Conductivity(inner.expression()?),
        Rule::anisotropy => DarcyKind::Anisotropy(inner.expression()?),
        Rule::well => DarcyKind::Well(Box::new(well(&mut inner)?)),
        _ => DarcyKind::Grid(counts(&mut inner)?),
    })
}

fn side_value(parts: &mut Parts) -> Built<(Name, Expr)> {
    let side = parts.need(Rule::side)?;
    Ok((spanned(parts.place, &side), parts.expression()?))
}

fn well(parts: &mut Parts) -> Built<Well> {
    let (name, at) = (parts.name()?, parts.expression()?);
    let (mut rate, mut screen, mut carrying) = (Once::default(), Once::default(), Once::default());
    while let Some(pair) = parts.next() {
        let (rule, span) = (pair.as_rule(), span_at(parts.place, &pair));
        let mut inner = Parts::of(parts.place, pair);
        match rule {
            Rule::well_rate => rate.set("rate", span, inner.expression()?)?,
            Rule::well_carrying => {
                carrying.set("carrying", span, each(&mut inner, Rule::assignment, assignment)?)?
            }
            _ => screen.set("screen", span, inner.range()?)?,
        }
    }
    let carrying = carrying.value().unwrap_or_default();
    Ok(Well { name, at, rate: rate.value(), screen: screen.value(), carrying })
}

pub fn dispersion(parts: &mut Parts) -> Built<Dispersion> {
    let list = each(parts, Rule::dispersion_part, |parts| {
        let word = parts.need(Rule::dispersion_word)?;
        Ok(Field { name: spanned(parts.place, &word), value: parts.expression()? })
    })?;
    if list.is_empty() { Ok(Dispersion::Value(parts.expression()?)) } else { Ok(Dispersion::Parts(list)) }
}

pub fn source(parts: &mut Parts) -> Built<Source> {
    let name = parts.wrapped_name(Rule::label)?;
    let carried = carried(parts)?;
    let pair = parts.need(Rule::region)?;
    let mut region = Parts::of(parts.place, pair);
    let kind = region.need(Rule::dotted)?;
    let kind = spanned(parts.place, &kind);
    let arguments = each(&mut region, Rule::region_argument, |parts| {
        let is_range = parts.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::range);
        if is_range {
            Ok(RegionArgument::Range(parts.range()?))
        } else {
            Ok(RegionArgument::Value(parts.expression()?))
        }
    })?;
    let during = parts.take(Rule::during).map(|pair| Parts::of(parts.place, pair).range()).transpose()?;
    Ok(Source { name, carried, region: kind, arguments, during })
}
