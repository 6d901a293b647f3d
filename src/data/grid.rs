//! Rows of a table to a function: coordinates sorted out, a value at each point of their grid.
//!
//! Owns what rows can be. May use columns and the function. It deliberately fills no gap: a grid with a hole is refused.

use super::columns::{Column, Columns};
use super::error::{Kind, ReadError};
use super::table::{Rule, Table};

/// The function of the first `n_axes` columns that another one gives.
pub(super) fn table(
    columns: &Columns,
    names: &[Column],
    n_axes: usize,
    value: usize,
    rule: Rule,
) -> Result<Table, ReadError> {
    let axes: Vec<Vec<f64>> = columns.numbers[..n_axes].iter().map(|numbers| distinct(numbers)).collect();
    let n_points = axes.iter().try_fold(1_usize, |n, axis| n.checked_mul(axis.len())).unwrap_or(usize::MAX);
    let n_rows = columns.n_rows();
    // A row of its own for each point: fewer points have a row twice, more a hole.
    let mut row_of = vec![u32::MAX; n_points.min(n_rows)];
    for row in 0..n_rows {
        let point = point_of(columns, &axes, row);
        // Rows beyond the list would fill a grid of more points than there are rows.
        let Some(known) = row_of.get_mut(point) else { continue };
        if *known != u32::MAX {
            return Err(twice(columns, names, n_axes, [*known as usize, row]));
        }
        *known = row as u32;
    }
    if n_points > n_rows {
        return Err(hole(columns, names, &axes));
    }
    let values = row_of.iter().map(|&row| columns.numbers[value][row as usize]).collect();
    Table::new(axes, values, rule).map_err(|reason| ReadError::new(Kind::Points, reason))
}

fn distinct(numbers: &[f64]) -> Vec<f64> {
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.dedup();
    sorted
}

fn point_of(columns: &Columns, axes: &[Vec<f64>], row: usize) -> usize {
    axes.iter().zip(&columns.numbers).fold(0, |point: usize, (axis, numbers)| {
        let along = axis.partition_point(|&x| x < numbers[row]);
        point.saturating_mul(axis.len()).saturating_add(along)
    })
}

fn twice(columns: &Columns, names: &[Column], n_axes: usize, [first, again]: [usize; 2]) -> ReadError {
    let place =
        words(names, &columns.numbers[..n_axes].iter().map(|numbers| numbers[again]).collect::<Vec<_>>());
    let message = format!("the place {place} has been given at {} already", columns.places.of(first));
    let error = ReadError::new(Kind::Points, message).at(columns.places.of(again));
    match n_axes {
        1 => error.help("with more coordinates, give the function more arguments"),
        _ => error,
    }
}

/// The first point that no row gives.
fn hole(columns: &Columns, names: &[Column], axes: &[Vec<f64>]) -> ReadError {
    let mut points: Vec<usize> = (0..columns.n_rows()).map(|row| point_of(columns, axes, row)).collect();
    points.sort_unstable();
    if let Some(pair) = points.windows(2).find(|pair| pair[0] == pair[1]) {
        let mut rows = (0..columns.n_rows()).filter(|&row| point_of(columns, axes, row) == pair[0]);
        if let (Some(first), Some(again)) = (rows.next(), rows.next()) {
            return twice(columns, names, axes.len(), [first, again]);
        }
    }
    let missing =
        points.iter().enumerate().find(|(idx, point)| idx != *point).map_or(points.len(), |(idx, _)| idx);
    let mut rest = missing;
    let mut place = vec![0.0; axes.len()];
    for (at, axis) in place.iter_mut().zip(axes).rev() {
        *at = axis[rest % axis.len()];
        rest /= axis.len();
    }
    let size: Vec<String> = axes.iter().map(|axis| axis.len().to_string()).collect();
    let message = format!(
        "the rows fill no rectangular grid: {} of them on {} coordinates, and none at {}",
        columns.n_rows(),
        size.join(" x "),
        words(names, &place)
    );
    ReadError::new(Kind::Points, message).help("give a row for every combination of coordinates")
}

/// Coordinates in the units of the file.
fn words(names: &[Column], place: &[f64]) -> String {
    let word = |(column, at): (&Column, &f64)| {
        format!("{} = {}", column.name, crate::diagnostic::precise(at / column.unit.factor()))
    };
    names.iter().zip(place).map(word).collect::<Vec<_>>().join(", ")
}
