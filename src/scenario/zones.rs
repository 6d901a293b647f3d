//! Mixing zones: fractions and exchange rates.

use super::check::Checker;
use super::collect::Statements;
use super::{Mixing, Zone};
use crate::diagnostic::codes::{D002, M001, M002, M013};
use crate::diagnostic::{Diagnostic, precise};
use crate::syntax::tree::{self, ExprKind};
use crate::units::Dimension;

/// `Some(None)`: no zones, no mixing.
pub(super) fn mixing<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Option<Mixing>> {
    let Some((span, written)) = statements.zones else { return Some(None) };
    let mut names: Vec<&tree::Name> = Vec::new();
    let mut zones = Vec::new();
    let mut is_right = true;
    for zone in written {
        if let Some(first) = names.iter().find(|first| first.value == zone.name.value) {
            checker.report(
                Diagnostic::error(D002, format!("zone `{}` is defined twice", zone.name.value))
                    .at(zone.name.span, "here again")
                    .also(first.span, "first here")
                    .found("a second definition")
                    .expected("one definition of each zone"),
            );
            is_right = false;
        }
        names.push(&zone.name);
        match read_zone(checker, zone) {
            Some(zone) => zones.push(zone),
            None => is_right = false,
        }
    }
    if statements.average.is_none() && !zones.is_empty() {
        checker.report(
            Diagnostic::error(M001, "mixing zones need an average to exchange with")
                .at(span, "zones without an `average` statement")
                .found("no `average`")
                .expected("one `average` statement")
                .help("add for example `average bins 300`"),
        );
    }
    if !is_right {
        return None;
    }
    // The sum of nothing is −0, which no reader expects.
    let sum = zones.iter().map(|zone| zone.fraction).sum::<f64>() + 0.0;
    if (sum - 1.0).abs() > 1e-9 {
        checker.report(
            Diagnostic::error(M013, "the fractions of the zones do not add up")
                .at(span, format!("their sum is {sum}"))
                .found(sum.to_string())
                .expected("1")
                .help("write the last fraction as 1 minus the others"),
        );
        return None;
    }
    Some(Some(Mixing { span, zones }))
}

fn read_zone<'a>(checker: &mut Checker<'a>, zone: &'a tree::Zone) -> Option<Zone> {
    let mut fraction = None;
    let mut rate = None;
    let mut is_right = true;
    for field in &zone.fields {
        let Some(is_fraction) =
            checker.word(&field.name, "a property of a zone", &[("fraction", true), ("rate", false)])
        else {
            is_right = false;
            continue;
        };
        let slot = if is_fraction { &mut fraction } else { &mut rate };
        if let Some(first) = slot.replace(field) {
            let first: &tree::Field = first;
            checker.report(
                Diagnostic::error(
                    M002,
                    format!("a second `{}` of zone `{}`", field.name.value, zone.name.value),
                )
                .at(field.name.span, "here again")
                .also(first.name.span, "first here")
                .found(format!("`{}` twice", field.name.value))
                .expected(format!("one `{}`", field.name.value)),
            );
            is_right = false;
        }
    }
    for (slot, word, example) in [(&fraction, "fraction", "fraction 0.5"), (&rate, "rate", "rate 1e-3 /s")] {
        if slot.is_none() && is_right {
            checker.report(
                Diagnostic::error(M001, format!("zone `{}` has no {word}", zone.name.value))
                    .at(zone.name.span, format!("without a {word}"))
                    .found(format!("no `{word}`"))
                    .expected(format!("`{word}` and a value"))
                    .help(format!("add for example `{example}`")),
            );
        }
    }
    let (fraction, rate) = (fraction?, rate?);
    let share = checker.slot(&fraction.value, "a fraction", Dimension::NONE);
    let share = share.and_then(|share| {
        let is_fine = (0.0..=1.0).contains(&share.value);
        checker.require(is_fine, "a fraction", precise(share.value), "from 0 to 1", share.span)?;
        Some(share.value)
    });
    let is_instant =
        matches!(&rate.value.kind, ExprKind::Path(path) if path.len() == 1 && path[0].value == "instant");
    let speed = if is_instant {
        Some(None)
    } else {
        checker.slot(&rate.value, "an exchange rate", Dimension::RATE).and_then(|speed| {
            checker.require(
                speed.value >= 0.0,
                "an exchange rate",
                precise(speed.value),
                "zero or more",
                speed.span,
            )?;
            Some(Some(speed.value))
        })
    };
    is_right.then_some(())?;
    Some(Zone {
        name: zone.name.value.clone(),
        span: zone.name.span,
        fraction: share?,
        rate: speed?,
        rate_span: rate.value.span,
    })
}
