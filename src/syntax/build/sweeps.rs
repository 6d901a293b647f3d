//! Sweeps and reports: their entries in the order of the text.
//!
//! Owns the shapes of what many runs are made of. May use the statements and expressions beside it.
//! It deliberately allows every entry any number of times: `scenario` says which may stand once.

use super::statements::{each, whole_number};
use super::{Parts, span_at, spanned};
use crate::syntax::climb::Built;
use crate::syntax::grammar::Rule;
use crate::syntax::tree::{Criterion, Expect, Replicates, Report, Sweep, SweepAxis, SweepEntry, SweepValue};

pub fn sweep(parts: &mut Parts) -> Built<Sweep> {
    let (name, of) = (parts.name()?, parts.take_name()?);
    let mut entries = Vec::new();
    while let Some(pair) = parts.next() {
        let (rule, span) = (pair.as_rule(), span_at(parts.place, &pair));
        let mut inner = Parts::of(parts.place, pair);
        entries.push(match rule {
            Rule::replicates => SweepEntry::Replicates(replicates(&mut inner)?),
            Rule::sweep_seed => SweepEntry::Seed(whole_number(&mut inner, "a seed")?),
            Rule::common => SweepEntry::Common(span),
            Rule::skip => SweepEntry::Skip(span, inner.expression()?),
            Rule::expect => SweepEntry::Expect(expect(&mut inner)?),
            Rule::zip => SweepEntry::Zip(span, each(&mut inner, Rule::sweep_axis, axis)?),
            Rule::sweep_axis => SweepEntry::Axis(axis(&mut inner)?),
            _ => break,
        });
    }
    Ok(Sweep { name, of, entries })
}

fn axis(parts: &mut Parts) -> Built<SweepAxis> {
    let target = parts.need(Rule::dotted)?;
    Ok(SweepAxis { target: spanned(parts.place, &target), values: each(parts, Rule::sweep_value, value)? })
}

fn value(parts: &mut Parts) -> Built<SweepValue> {
    let Some(pair) = parts.take(Rule::progression) else { return Ok(SweepValue::One(parts.expression()?)) };
    let span = span_at(parts.place, &pair);
    let is_factor = pair.clone().into_inner().any(|part| part.as_rule() == Rule::kw_factor);
    let mut inner = Parts::of(parts.place, pair);
    Ok(SweepValue::Progression { span, range: inner.range()?, is_factor, by: inner.expression()? })
}

fn replicates(parts: &mut Parts) -> Built<Replicates> {
    let least = parts.expression()?;
    let most = parts.optional_expression()?;
    let until = match most {
        None => None,
        Some(most) => {
            let pair = parts.need(Rule::criterion)?;
            Some((most, criterion(&mut Parts::of(parts.place, pair))?))
        }
    };
    Ok(Replicates { span: parts.whole, least, until })
}

fn criterion(parts: &mut Parts) -> Built<Criterion> {
    Ok(Criterion {
        function: parts.name()?,
        measure: parts.name()?,
        threshold: parts.expression()?,
        of: parts.name()?,
        of_measure: parts.name()?,
    })
}

fn expect(parts: &mut Parts) -> Built<Expect> {
    let value = parts.expression()?;
    let has_range = parts.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::range);
    let range = has_range.then(|| parts.range()).transpose()?;
    Ok(Expect { span: parts.whole, value, range, when: parts.optional_expression()? })
}

pub fn report(parts: &mut Parts) -> Built<Report> {
    let (kind, measure) = (parts.name()?, parts.name()?);
    let against = parts.names(Rule::name);
    let by = match parts.take(Rule::series) {
        Some(pair) => Parts::of(parts.place, pair).names(Rule::name),
        None => Vec::new(),
    };
    Ok(Report { kind, measure, against, by })
}
