//! Domain, sides, frame, flow, dispersion and bins.

use super::check::Checker;
use super::choice::SIDES;
use super::collect::Statements;
use super::slot::tuple_parts;
use super::{Axis, Domain, Particles, Side};
use crate::diagnostic::codes::{D009, M001, M002, M004, M006, M007, M008};
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
    let sides = is_right_number && set_sides(checker, statements, &mut axes, statement);
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

/// The words for the two sides of an axis in a domain of given axes.
///
/// x has left and right; the vertical axis (z, or y without z) has bottom and top; y of a box has
/// front and back. A line may call its sides left and right whatever its axis.
fn side_names(index: usize, axes: &[usize]) -> Vec<[&'static str; 2]> {
    let mut names = match index {
        0 => vec![["left", "right"]],
        1 if axes.contains(&2) => vec![["front", "back"]],
        _ => vec![["bottom", "top"]],
    };
    if axes.len() == 1 && index != 0 {
        names.push(["left", "right"]);
    }
    names
}

/// Every side must say what happens there: physics has no default.
fn set_sides<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    axes: &mut [Axis],
    domain: &tree::Domain,
) -> bool {
    let indices: Vec<usize> = axes.iter().map(|axis| axis.index).collect();
    let mut words = Vec::new();
    for (axis_idx, axis) in axes.iter().enumerate() {
        for pair in side_names(axis.index, &indices) {
            words.push((pair[0], (axis_idx, 0)));
            words.push((pair[1], (axis_idx, 1)));
        }
    }
    let mut set: Vec<[Option<(Side, Span)>; 2]> = vec![[None; 2]; axes.len()];
    let mut is_right = true;
    for statement in &statements.boundaries {
        let kind = checker.word(&statement.kind, "a kind of boundary", SIDES);
        for side in &statement.sides {
            let Some((axis_idx, end)) = checker.word(side, "a side of this domain", &words) else {
                is_right = false;
                continue;
            };
            if let Some((_, first)) = set[axis_idx][end] {
                checker.report(
                    Diagnostic::error(M002, format!("side `{}` is given twice", side.value))
                        .at(side.span, "here again")
                        .also(first, "first here")
                        .found("two boundaries for one side")
                        .expected("one boundary for every side"),
                );
                is_right = false;
            }
            match kind {
                Some(kind) => set[axis_idx][end] = Some((kind, side.span)),
                // The wrong word has been reported; the side itself is not missing.
                None => {
                    set[axis_idx][end] = Some((Side::Reflect, side.span));
                    is_right = false;
                }
            }
        }
    }
    let mut missing = Vec::new();
    for (axis_idx, axis) in axes.iter_mut().enumerate() {
        let names = side_names(axis.index, &indices)[0];
        for (end, name) in names.into_iter().enumerate() {
            match set[axis_idx][end] {
                None => missing.push(name),
                Some((side, span)) if end == 0 => (axis.low_side, axis.low_side_span) = (side, span),
                Some((side, span)) => (axis.high_side, axis.high_side_span) = (side, span),
            }
        }
        is_right &= check_periodic(checker, &set[axis_idx], axis, names);
    }
    if !missing.is_empty() && is_right {
        report_missing_sides(checker, &missing, domain);
    }
    is_right && missing.is_empty()
}

fn report_missing_sides(checker: &mut Checker<'_>, missing: &[&str], domain: &tree::Domain) {
    let list = missing.join(", ");
    checker.report(
        Diagnostic::error(M001, format!("nothing says what happens at {list}"))
            .at(domain.shape.span, "sides of this domain without a boundary")
            .found(format!("no boundary for {list}"))
            .expected("one boundary for every side")
            .help(format!("add for example `boundary {list} reflect`")),
    );
}

fn check_periodic(
    checker: &mut Checker<'_>,
    set: &[Option<(Side, Span)>; 2],
    axis: &Axis,
    names: [&str; 2],
) -> bool {
    let [Some((low, low_span)), Some((high, high_span))] = *set else { return true };
    if (low == Side::Periodic) == (high == Side::Periodic) {
        return true;
    }
    let (place, other) = if low == Side::Periodic { (low_span, high_span) } else { (high_span, low_span) };
    checker.report(
        Diagnostic::error(M007, format!("`periodic` joins {} and {}: both or none", names[0], names[1]))
            .at(place, "periodic")
            .also(other, "not periodic")
            .also(axis.span, "of this axis")
            .found("one periodic side")
            .expected("two periodic sides"),
    );
    false
}

/// `Some(None)`: there is no flow statement, and nothing flows.
pub(super) fn flow<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
) -> Option<Option<Spanned<[f64; 3]>>> {
    let Some((span, statement)) = statements.flow else { return Some(None) };
    checker.word(&statement.kind, "a kind of flow", &[("uniform", ())])?;
    let Some(argument) = &statement.argument else {
        checker.report(
            Diagnostic::error(M004, "`flow uniform` needs a velocity")
                .at(statement.kind.span, "no velocity after this")
                .found("the end of the statement")
                .expected("a velocity, such as `1 m/d`"),
        );
        return None;
    };
    let velocity = checker.vector(argument, "the velocity", Dimension::VELOCITY)?;
    Some(Some(Spanned::new(velocity, span)))
}

pub(super) fn dispersion<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
) -> Option<Option<Spanned<[[f64; 3]; 3]>>> {
    let Some((span, written)) = statements.dispersion else { return Some(None) };
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    let rows = tuple_parts(written);
    let mut tensor = [[0.0; 3]; 3];
    let is_tensor = rows.iter().any(|row| matches!(row.kind, tree::ExprKind::Tuple(_)));
    if rows.len() == 1 {
        let value = checker.slot(written, "the dispersion coefficient", Dimension::DISPERSION)?.value;
        indices.iter().for_each(|&index| tensor[index][index] = value);
    } else if is_tensor {
        read_tensor(checker, written, &rows, &indices, &mut tensor)?;
    } else {
        let diagonal = checker.vector(written, "a diagonal dispersion tensor", Dimension::DISPERSION)?;
        indices.iter().for_each(|&index| tensor[index][index] = diagonal[index]);
    }
    check_tensor(checker, written, &tensor)?;
    Some(Some(Spanned::new(tensor, span)))
}

fn read_tensor<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    rows: &[&'a tree::Expr],
    indices: &[usize],
    tensor: &mut [[f64; 3]; 3],
) -> Option<()> {
    if rows.len() != indices.len() {
        checker.report(
            Diagnostic::error(D009, "a dispersion tensor has a row for each axis of the domain")
                .at(written.span, format!("{} rows here", rows.len()))
                .found(format!("{} rows", rows.len()))
                .expected(format!("{} rows", indices.len())),
        );
        return None;
    }
    let mut is_right = true;
    for (row, &index) in rows.iter().zip(indices) {
        match checker.vector(row, "a row of the dispersion tensor", Dimension::DISPERSION) {
            Some(values) => tensor[index] = values,
            None => is_right = false,
        }
    }
    is_right.then_some(())
}

/// A dispersion tensor is symmetric and has no negative eigenvalue.
fn check_tensor(checker: &mut Checker<'_>, written: &tree::Expr, tensor: &[[f64; 3]; 3]) -> Option<()> {
    let matrix = nalgebra::Matrix3::from_fn(|row, column| tensor[row][column]);
    let largest = matrix.amax();
    let is_symmetric = (matrix - matrix.transpose()).amax() <= 1e-12 * largest;
    let smallest = if is_symmetric { matrix.symmetric_eigenvalues().min() } else { 0.0 };
    let (label, found) = if !is_symmetric {
        ("it is not symmetric".to_owned(), "a tensor that is not symmetric".to_owned())
    } else if smallest < -1e-12 * largest {
        let found = format!("the negative eigenvalue {} m^2/s", precise(smallest));
        (format!("it has {found}"), found)
    } else {
        return Some(());
    };
    checker.report(
        Diagnostic::error(M008, "this is no dispersion tensor")
            .at(written.span, label)
            .found(found)
            .expected("a symmetric tensor without negative eigenvalues; one value is not negative"),
    );
    None
}

/// `Some(None)`: there is no `average` statement.
pub(super) fn bins<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
) -> Option<Option<Spanned<Vec<usize>>>> {
    let Some((span, statement)) = statements.average else { return Some(None) };
    checker.word(&statement.kind, "a kind of average", &[("bins", ())])?;
    grid(checker, &statement.counts, "the number of bins", span).map(Some)
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
