//! Domain, frame and bins.

use super::check::Checker;
use super::collect::Statements;
use super::{Axis, Domain, Particles, Side};
use crate::diagnostic::codes::{D009, M002, M006};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::{Span, Spanned};
use crate::syntax::tree;
use crate::units::Dimension;

const AXES: [&str; 3] = ["x", "y", "z"];
const SHAPES: &[(&str, usize)] = &[("line", 1), ("rect", 2), ("box", 3)];

/// Bins along one axis, and in all.
pub const MAX_BINS: f64 = 1e8;

/// The axes that the domain statement names, as far as they are axes.
pub(super) fn axis_names(statements: &Statements<'_>) -> Vec<(String, usize)> {
    let Some((_, domain)) = statements.domain else { return Vec::new() };
    let known = |axis: &tree::Axis| {
        let index = AXES.iter().position(|name| *name == axis.name.value)?;
        Some((axis.name.value.clone(), index))
    };
    let mut axes: Vec<(String, usize)> = domain.axes.iter().filter_map(known).collect();
    axes.sort_by_key(|(_, index)| *index);
    axes.dedup();
    axes
}

pub(super) fn domain<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Domain> {
    let (span, statement) = statements.domain?;
    let n_axes = checker.word(&statement.shape, "a shape of a domain", SHAPES);
    let axes: Vec<Option<Axis>> = statement
        .axes
        .iter()
        .enumerate()
        .map(|(idx, axis)| read_axis(checker, statement, idx, axis))
        .collect();
    let is_right_number = n_axes.is_none_or(|n| n == statement.axes.len());
    if !is_right_number {
        let expected = match n_axes {
            Some(1) => "one axis".to_owned(),
            n => format!("{} axes", n.unwrap_or(0)),
        };
        let n_given = statement.axes.len();
        checker.report(
            Diagnostic::error(M006, format!("a {} has {expected}", statement.shape.value))
                .at(statement.shape.span.to(statement.axes.last().map_or(span, |axis| axis.name.span)), "")
                .found(if n_given == 1 { "one axis".to_owned() } else { format!("{n_given} axes") })
                .expected(expected)
                .help("`line` has one axis, `rect` two, `box` three"),
        );
    }
    let frame = match &statement.frame {
        Some(velocity) => checker.vector(velocity, "the velocity of the frame", Dimension::VELOCITY),
        None => Some([0.0; 3]),
    };
    let mut axes: Vec<Axis> = axes.into_iter().collect::<Option<_>>()?;
    axes.sort_by_key(|axis| axis.index);
    // The names of the sides follow from the axes: with a wrong number of these nothing is said of them.
    let sides =
        is_right_number && super::transport::sides::set_sides(checker, statements, &mut axes, statement);
    (n_axes.is_some() && sides).then_some(())?;
    Some(Domain { span, axes, frame: frame? })
}

fn read_axis<'a>(
    checker: &mut Checker<'a>,
    statement: &'a tree::Domain,
    idx: usize,
    axis: &'a tree::Axis,
) -> Option<Axis> {
    let words: Vec<(&str, usize)> = AXES.iter().enumerate().map(|(index, name)| (*name, index)).collect();
    let index = checker.word(&axis.name, "an axis", &words);
    let name = &axis.name.value;
    let range = checker.range(&axis.range, &format!("the extent along {name}"), Some(Dimension::LENGTH));
    if let Some(first) = statement.axes[..idx].iter().find(|first| first.name.value == *name) {
        checker.report(
            Diagnostic::error(M002, format!("axis `{name}` is given twice"))
                .at(axis.name.span, "here again")
                .also(first.name.span, "first here")
                .found(format!("`{name}` twice"))
                .expected("different axes"),
        );
        return None;
    }
    let (low, high, _) = range?;
    let extent = high.value - low.value;
    let span = low.span.to(high.span);
    checker.require(extent.is_normal(), &format!("the extent along {name}"), metres(extent), SIZE, span)?;
    Some(Axis {
        index: index?,
        low: low.value,
        high: high.value,
        low_side: Side::Reflect,
        high_side: Side::Reflect,
        patches: [Vec::new(), Vec::new()],
        low_side_span: axis.name.span,
        high_side_span: axis.name.span,
        span: axis.name.span.to(high.span),
    })
}

const SIZE: &str = "a size that numbers can hold (2.3e-308 to 1.7e308)";

fn metres(size: f64) -> String {
    format!("{} m", precise(size))
}

/// Extents that numbers can hold may have a product that they cannot.
pub(super) fn check_volume(checker: &mut Checker<'_>, domain: &Domain, particles: &Particles) {
    let volume: f64 = domain.axes.iter().map(|axis| axis.high - axis.low).product();
    let per_particle = volume / particles.count as f64;
    let is_right = volume.is_normal() && per_particle.is_normal();
    let Some((first, last)) = domain.axes.first().zip(domain.axes.last()) else { return };
    let n_axes = domain.axes.len();
    let unit = if n_axes == 1 { "m".to_owned() } else { format!("m^{n_axes}") };
    let what =
        if volume.is_normal() { "the size of the domain per particle" } else { "the size of the domain" };
    let found = format!("{} {unit}", precise(if volume.is_normal() { per_particle } else { volume }));
    // Axes stand in the order of x, y, z, not in that of the text.
    let place = first.span.to(last.span);
    let place = if first.span.start <= last.span.start { place } else { last.span.to(first.span) };
    checker.require(is_right, what, found, SIZE, place);
}

/// `Some(None)`: there is no `average` statement, or none with bins.
pub(super) fn bins<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
) -> Option<Option<Spanned<Vec<usize>>>> {
    let Some((span, statement)) = statements.average else { return Some(None) };
    let Some((kind, counts)) = &statement.bins else { return Some(None) };
    checker.word(kind, "a kind of average", &[("bins", ())])?;
    grid(checker, counts, "the number of bins", span).map(Some)
}

/// One number of bins: written, or a dimensionless constant.
pub(super) fn count_of<'a>(checker: &mut Checker<'a>, count: &'a tree::Expr, what: &str) -> Option<u64> {
    let value = checker.slot(count, what, Dimension::NONE)?;
    checker.count(value.value, what, MAX_BINS, value.span)
}

/// Counts such as `200 x 80`, one for each axis of the domain.
pub(super) fn grid<'a>(
    checker: &mut Checker<'a>,
    counts: &'a [tree::Expr],
    what: &str,
    span: Span,
) -> Option<Spanned<Vec<usize>>> {
    let n_axes = checker.axes.len();
    let values: Vec<Option<u64>> = counts.iter().map(|count| count_of(checker, count, what)).collect();
    let values: Vec<u64> = values.into_iter().collect::<Option<_>>()?;
    let place = match (counts.first(), counts.last()) {
        (Some(first), Some(last)) => first.span.to(last.span),
        _ => span,
    };
    if values.len() != n_axes {
        checker.report(
            Diagnostic::error(D009, format!("{what} must be given for each axis of the domain"))
                .at(place, format!("{} here", values.len()))
                .found(if values.len() == 1 {
                    "1 count".to_owned()
                } else {
                    format!("{} counts", values.len())
                })
                .expected(if n_axes == 1 {
                    "one count".to_owned()
                } else {
                    format!("{n_axes} counts, joined by `x`")
                }),
        );
        return None;
    }
    let total: f64 = values.iter().map(|&count| count as f64).product();
    checker.require(total <= MAX_BINS, "the number of bins in all", precise(total), "at most 1e8", place)?;
    Some(Spanned::new(values.into_iter().map(|count| count as usize).collect(), place))
}
