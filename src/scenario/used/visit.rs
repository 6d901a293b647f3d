//! Every expression and every dotted name of a statement.
//!
//! Owns the walk. May use the tree. It deliberately knows no meaning: who visits says what to do.

use crate::syntax::tree::{
    Assignment, Average, Axis, Change, ChangeTimes, Count, DarcyEntry, DarcyKind, Dispersion, EstimateEntry,
    EstimateValue, Expr, ExprKind, Field, FileValue, FlowArgument, Name, Output, Place, Range, Rate,
    RegionArgument, Source, StatementKind, SweepAxis, SweepEntry, SweepValue, Times,
};

/// What is done at each place.
pub(super) trait Visitor {
    /// An expression, after those inside it.
    fn expression(&mut self, expr: &mut Expr);
    /// A name that may stand with the alias of a used scene before it.
    fn dotted(&mut self, name: &mut Name);
}

pub(super) fn visit(kind: &mut StatementKind, visitor: &mut impl Visitor) {
    match kind {
        StatementKind::Let(it) => expression(&mut it.value, visitor),
        StatementKind::Param(it) => {
            expression(&mut it.value, visitor);
            it.range.iter_mut().for_each(|it| range(it, visitor));
        }
        StatementKind::Function(it) => expression(&mut it.body, visitor),
        StatementKind::Species(list) => {
            let values = list.iter_mut().flat_map(|it| &mut it.qualifiers).filter_map(|it| it.value.as_mut());
            values.for_each(|it| expression(it, visitor));
        }
        StatementKind::Reaction(it) => {
            let terms = it.reactants.iter_mut().chain(&mut it.products);
            terms.filter_map(|it| it.coefficient.as_mut()).for_each(|it| expression(it, visitor));
            match &mut it.rate {
                Rate::One(it) => expression(it, visitor),
                Rate::Directions(list) => list.iter_mut().for_each(|it| expression(&mut it.value, visitor)),
            }
        }
        StatementKind::Chemistry(list) | StatementKind::Medium(list) | StatementKind::Exchange(list) => {
            fields(list, visitor)
        }
        StatementKind::Kernel(it) => {
            expression(&mut it.value, visitor);
            expression(&mut it.support, visitor);
        }
        StatementKind::Estimate(it) => it.entries.iter_mut().for_each(|it| estimate(it, visitor)),
        StatementKind::Domain(it) => {
            it.axes.iter_mut().for_each(|it| axis(it, visitor));
            it.frame.iter_mut().for_each(|it| expression(it, visitor));
        }
        StatementKind::Boundary(_)
        | StatementKind::Flow(_)
        | StatementKind::Dispersion(_)
        | StatementKind::Source(_) => transport(kind, visitor),
        StatementKind::MixingZones(zones) => {
            let fields = zones.iter_mut().flat_map(|zone| &mut zone.fields);
            fields.for_each(|it| expression(&mut it.value, visitor));
        }
        StatementKind::Average(it) => average(it, visitor),
        StatementKind::Initial(list) => assignments(list, visitor),
        StatementKind::Particles(it) => match &mut it.count {
            Count::All(it) => expression(it, visitor),
            Count::Shares(list) => fields(list, visitor),
        },
        StatementKind::Run(it) => {
            expression(&mut it.duration, visitor);
            it.step.iter_mut().for_each(|it| expression(it, visitor));
        }
        StatementKind::Output(it) => output(it, visitor),
        StatementKind::Reference(it) => {
            it.target.species.iter_mut().for_each(|name| visitor.dotted(name));
            expression(&mut it.value, visitor);
        }
        StatementKind::Measure(it) => {
            expression(&mut it.value, visitor);
            it.over.iter_mut().for_each(|it| axis(it, visitor));
            it.times.iter_mut().for_each(|list| expressions(list, visitor));
        }
        StatementKind::Sweep(it) => it.entries.iter_mut().for_each(|it| sweep_entry(it, visitor)),
        StatementKind::Edition(_)
        | StatementKind::Title(_)
        | StatementKind::Cite(_)
        | StatementKind::Seed(_)
        | StatementKind::Data(_)
        | StatementKind::Use(_)
        | StatementKind::Report(_) => {}
    }
}

fn estimate(it: &mut EstimateEntry, visitor: &mut impl Visitor) {
    match &mut it.value {
        EstimateValue::One(it) => expression(it, visitor),
        EstimateValue::Range(it) => range(it, visitor),
        EstimateValue::Counts(list) => expressions(list, visitor),
    }
}

fn output(it: &mut Output, visitor: &mut impl Visitor) {
    expressions(&mut it.grid, visitor);
    match &mut it.place {
        Some(Place::Plane(_, at, part)) => {
            expression(at, visitor);
            part.iter_mut().for_each(|it| axis(it, visitor));
        }
        Some(Place::Side(_, part)) => part.iter_mut().for_each(|it| axis(it, visitor)),
        Some(Place::Box(_, ranges)) => ranges.iter_mut().for_each(|it| range(it, visitor)),
        Some(Place::Well(_)) | None => {}
    }
    match &mut it.times {
        Some(Times::List(list)) => expressions(list, visitor),
        Some(Times::Every(every)) => expression(every, visitor),
        None => {}
    }
}

/// Sides, flow, dispersion and sources.
fn transport(kind: &mut StatementKind, visitor: &mut impl Visitor) {
    match kind {
        StatementKind::Boundary(it) => {
            it.patch.iter_mut().for_each(|it| axis(it, visitor));
            assignments(&mut it.carried, visitor);
            it.rate.iter_mut().for_each(|it| expression(&mut it.value, visitor));
        }
        StatementKind::Flow(it) => {
            match &mut it.argument {
                FlowArgument::None => {}
                FlowArgument::Value(it) | FlowArgument::Assigned(it) => expression(it, visitor),
                FlowArgument::Entries(list) => list.iter_mut().for_each(|it| darcy_entry(it, visitor)),
                FlowArgument::Files(_, list) => {
                    for entry in list {
                        if let FileValue::Value(it) = &mut entry.value {
                            expression(it, visitor);
                        }
                    }
                }
            }
            it.change.iter_mut().for_each(|it| change(it, visitor));
        }
        StatementKind::Dispersion(Dispersion::Value(it)) => expression(it, visitor),
        StatementKind::Dispersion(Dispersion::Parts(list)) => fields(list, visitor),
        StatementKind::Source(it) => source(it, visitor),
        _ => {}
    }
}

fn average(it: &mut Average, visitor: &mut impl Visitor) {
    it.bins.iter_mut().for_each(|(_, counts)| expressions(counts, visitor));
    fields(&mut it.settings, visitor);
}

fn fields(list: &mut [Field], visitor: &mut impl Visitor) {
    list.iter_mut().for_each(|it| expression(&mut it.value, visitor));
}

fn assignments(list: &mut [Assignment], visitor: &mut impl Visitor) {
    list.iter_mut().for_each(|it| expression(&mut it.value, visitor));
}

fn darcy_entry(entry: &mut DarcyEntry, visitor: &mut impl Visitor) {
    match &mut entry.kind {
        DarcyKind::Head(list) | DarcyKind::Flux(list) => {
            list.iter_mut().for_each(|(_, it)| expression(it, visitor));
        }
        DarcyKind::NoFlow(_) | DarcyKind::Periodic(_) => {}
        DarcyKind::Conductivity(it) | DarcyKind::Anisotropy(it) => expression(it, visitor),
        DarcyKind::Well(it) => {
            expression(&mut it.at, visitor);
            it.rate.iter_mut().for_each(|it| expression(it, visitor));
            it.screen.iter_mut().for_each(|it| range(it, visitor));
            assignments(&mut it.carrying, visitor);
        }
        DarcyKind::Change(it) => change(it, visitor),
        DarcyKind::Grid(counts) => expressions(counts, visitor),
    }
}

fn change(change: &mut Change, visitor: &mut impl Visitor) {
    match &mut change.times {
        ChangeTimes::At(list) => expressions(list, visitor),
        ChangeTimes::Every(it) => expression(it, visitor),
    }
}

fn source(source: &mut Source, visitor: &mut impl Visitor) {
    assignments(&mut source.carried, visitor);
    visitor.dotted(&mut source.region);
    for argument in &mut source.arguments {
        match argument {
            RegionArgument::Range(it) => range(it, visitor),
            RegionArgument::Value(it) => expression(it, visitor),
        }
    }
    source.during.iter_mut().for_each(|it| range(it, visitor));
}

fn sweep_entry(entry: &mut SweepEntry, visitor: &mut impl Visitor) {
    match entry {
        SweepEntry::Axis(it) => sweep_axis(it, visitor),
        SweepEntry::Zip(_, axes) => axes.iter_mut().for_each(|it| sweep_axis(it, visitor)),
        SweepEntry::Replicates(it) => {
            expression(&mut it.least, visitor);
            if let Some((most, criterion)) = &mut it.until {
                expression(most, visitor);
                expression(&mut criterion.threshold, visitor);
            }
        }
        SweepEntry::Skip(_, it) => expression(it, visitor),
        SweepEntry::Expect(it) => {
            expression(&mut it.value, visitor);
            it.range.iter_mut().for_each(|it| range(it, visitor));
            it.when.iter_mut().for_each(|it| expression(it, visitor));
        }
        SweepEntry::Seed(_) | SweepEntry::Common(_) => {}
    }
}

fn sweep_axis(axis: &mut SweepAxis, visitor: &mut impl Visitor) {
    visitor.dotted(&mut axis.target);
    for value in &mut axis.values {
        match value {
            SweepValue::One(it) => expression(it, visitor),
            SweepValue::Progression { range: ends, by, .. } => {
                range(ends, visitor);
                expression(by, visitor);
            }
        }
    }
}

fn axis(axis: &mut Axis, visitor: &mut impl Visitor) {
    range(&mut axis.range, visitor);
}

fn range(range: &mut Range, visitor: &mut impl Visitor) {
    expression(&mut range.low, visitor);
    expression(&mut range.high, visitor);
}

fn expressions(list: &mut [Expr], visitor: &mut impl Visitor) {
    list.iter_mut().for_each(|it| expression(it, visitor));
}

fn expression(expr: &mut Expr, visitor: &mut impl Visitor) {
    match &mut expr.kind {
        ExprKind::Number(_) | ExprKind::Path(_) => {}
        ExprKind::Call { arguments, .. } => {
            arguments.iter_mut().for_each(|it| expression(&mut it.value, visitor));
        }
        ExprKind::Unary { operand, .. } => expression(operand, visitor),
        ExprKind::Binary { left, right, .. } => {
            expression(left, visitor);
            expression(right, visitor);
        }
        ExprKind::If { condition, then, otherwise } => {
            for part in [condition, then, otherwise] {
                expression(part, visitor);
            }
        }
        ExprKind::Tuple(parts) => expressions(parts, visitor),
    }
    visitor.expression(expr);
}
