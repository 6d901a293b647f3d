//! One step of exchange in time: explicit, implicit, or exponential.
//!
//! Owns the three ways. May use the operator. It deliberately knows no particle: columns come in and go out.
//!
//! All three solve `dv/dt = −L v` over a step in which `L` is scaled by the share β: `L v = −Σ_j w_ij (v_j − v_i)`.

use super::super::parallel;
use super::operator::{Operator, PORTION};
use crate::plan::exchange::Integration;

/// What a parcel gives away may reach all that it has, to rounding.
const WHOLE: f64 = 1.0 + 1e-12;

/// Values that a thread takes at once where little is done with each.
const MANY: usize = 32 * PORTION;

/// Residual of the implicit step over the right side.
const RESIDUAL: f64 = 1e-14;
const MOST_ITERATIONS: usize = 10_000;

/// Rest of the exponential series, relative to the values.
const REST: f64 = 1e-16;

/// Takes columns through a step that exchanges the share `beta`.
pub fn step<const D: usize>(
    operator: &mut Operator<D>,
    integration: Integration,
    beta: f64,
    columns: &mut [Vec<f64>],
) {
    match integration {
        Integration::Explicit => explicit(operator, beta, columns),
        Integration::Implicit => implicit(operator, beta, columns),
        Integration::Exponential => exponential(operator, (beta, REST), columns),
    }
}

fn zeros(n_columns: usize, n: usize) -> Vec<Vec<f64>> {
    vec![vec![0.0; n]; n_columns]
}

/// The largest sum of weights of others.
fn largest(sums: &[f64]) -> f64 {
    let parts: Vec<&[f64]> = sums.chunks(MANY).collect();
    let of_parts = parallel::map(parts.len(), &|part| {
        parts[part].iter().fold(0.0, |largest: f64, &sum| largest.max(sum))
    });
    of_parts.into_iter().fold(0.0, f64::max)
}

/// `v ← v + factor u`
fn add(values: &mut [f64], factor: f64, others: &[f64]) {
    let mut parts: Vec<_> = values.chunks_mut(MANY).zip(others.chunks(MANY)).collect();
    parallel::for_each(&mut parts, &|_, (values, others)| {
        values.iter_mut().zip(*others).for_each(|(value, other)| *value += factor * other);
    });
}

/// `v ← v + β Σ_j w_ij (v_j − v_i)`, with the weights of what would give more than it has cut down.
///
/// - Equation: `w_ij ← w_ij min(1, 1/(β r_i), 1/(β r_j))` where some `β r > 1`, `r_i = Σ_{j≠i} w_ij`.
/// - Symbols: `β` share.
/// - Range: any; new values are means of old ones with positive weights, so that none is beyond the others.
/// - Source: methods, section 6.3 (maximum principle); the cut is ours, symmetric, so that nothing is lost.
/// - Shape: columns in place.
fn explicit<const D: usize>(operator: &mut Operator<D>, beta: f64, columns: &mut [Vec<f64>]) {
    let n = columns.first().map_or(0, Vec::len);
    let mut found = zeros(columns.len() + 1, n);
    operator.first_differences(columns, &mut found);
    let sums = &found[columns.len()];
    if beta * largest(sums) > WHOLE {
        let cap = |&sum: &f64| if beta * sum > 1.0 { 1.0 / (beta * sum) } else { 1.0 };
        operator.caps = sums.iter().map(cap).collect();
        operator.differences(columns, &mut found[..columns.len()]);
        operator.caps.clear();
    }
    for (column, found) in columns.iter_mut().zip(&found) {
        add(column, beta, found);
    }
}

/// `(1 + β L) v ← v` by conjugate gradients.
///
/// - Equation: M. R. Hestenes, E. Stiefel 1952, doi:10.6028/jres.049.044.
/// - Symbols: `L` symmetric, with eigenvalues from 0 to twice the largest sum of weights.
/// - Range: any β; iterations grow as its root.
/// - Source: methods, section 6.5.
/// - Shape: columns in place, each with its own scalars.
fn implicit<const D: usize>(operator: &Operator<D>, beta: f64, columns: &mut [Vec<f64>]) {
    let (n_columns, n) = (columns.len(), columns.first().map_or(0, Vec::len));
    let mut found = zeros(n_columns, n);
    operator.differences(columns, &mut found);
    // The first guess is the right side: its residual is β Σ_j w_ij (v_j − v_i).
    let mut residuals: Vec<Vec<f64>> =
        found.iter().map(|own| own.iter().map(|change| beta * change).collect()).collect();
    let mut directions = residuals.clone();
    let mut squares: Vec<f64> = residuals.iter().map(|own| dot(own, own)).collect();
    let goals: Vec<f64> = columns.iter().map(|own| RESIDUAL * RESIDUAL * dot(own, own)).collect();
    for _ in 0..MOST_ITERATIONS {
        if squares.iter().zip(&goals).all(|(square, goal)| square <= goal) {
            break;
        }
        operator.differences(&directions, &mut found);
        for column in 0..n_columns {
            if squares[column] <= goals[column] {
                continue;
            }
            let direction = &mut directions[column];
            let image = &mut found[column];
            image.iter_mut().zip(&*direction).for_each(|(image, own)| *image = own - beta * *image);
            let along = squares[column] / dot(direction, image);
            columns[column].iter_mut().zip(&*direction).for_each(|(value, own)| *value += along * own);
            let residual = &mut residuals[column];
            residual.iter_mut().zip(&*image).for_each(|(rest, image)| *rest -= along * image);
            let square = dot(residual, residual);
            let turn = square / squares[column];
            squares[column] = square;
            direction.iter_mut().zip(&*residual).for_each(|(own, rest)| *own = rest + turn * *own);
        }
    }
}

/// A sum of products in lanes of a fixed order.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    for (a, b) in a.chunks(8).zip(b.chunks(8)) {
        for (lane, (a, b)) in lanes.iter_mut().zip(a.iter().zip(b)) {
            *lane += a * b;
        }
    }
    lanes.iter().sum()
}

/// `v ← e^{−β L} v` as a mean over numbers of jumps.
///
/// - Equation: `e^{−βL} = Σ_k e^{−Λ} Λ^k/k! P^k`, `P = 1 − L β/Λ`, `Λ = β max_i Σ_{j≠i} w_ij`.
/// - Symbols: `P` has no negative entry and sums of one.
/// - Range: any β; `Λ + 8 √Λ` sums, up to a rest of the series. No value gets beyond the others.
/// - Source: A. Jensen 1953, Scand. Actuar. J. 1953, 87, doi:10.1080/03461238.1953.10419459 (uniformisation).
/// - Shape: columns in place.
pub fn exponential<const D: usize>(
    operator: &Operator<D>,
    (beta, rest): (f64, f64),
    columns: &mut [Vec<f64>],
) {
    let (n_columns, n) = (columns.len(), columns.first().map_or(0, Vec::len));
    let mut found = zeros(n_columns + 1, n);
    operator.differences(columns, &mut found);
    let scale = beta * largest(&found[n_columns]);
    if scale <= 0.0 {
        return;
    }
    let mut power = columns.to_vec();
    let mut weight = crate::maths::scalar::exp(-scale);
    let mut left = 1.0 - weight;
    columns.iter_mut().flatten().for_each(|value| *value *= weight);
    let most = scale + 12.0 * scale.sqrt() + 40.0;
    let mut k = 0.0;
    while k < most && left > rest {
        if k > 0.0 {
            operator.differences(&power, &mut found[..n_columns]);
        }
        k += 1.0;
        for (power, change) in power.iter_mut().zip(&found) {
            add(power, beta / scale, change);
        }
        weight *= scale / k;
        left -= weight;
        columns.iter_mut().zip(&power).for_each(|(column, power)| add(column, weight, power));
    }
    // What rounding and the end of the series left out belongs to the last one: sums stay what they were.
    let rest = left.max(0.0);
    columns.iter_mut().zip(&power).for_each(|(column, power)| add(column, rest, power));
}
