//! The point nearest to the origin under a few linear bounds, in 32 digits.
//!
//! Owns the proof that bounds contradict each other, and factors of small matrices. May use the words. It
//! deliberately knows no species.

use crate::maths::double::Double;

/// Whole coefficients: what is left of a dependent one is rounding.
const DEPENDENT: f64 = 1e-18;
const MAX_CHANGES: usize = 1000;

/// `H = G D Gᵀ`, where directions without curvature answer zero.
pub(super) struct Factors {
    n: usize,
    /// G row by row, with 1/d on its diagonal.
    rows: Vec<Vec<Double>>,
}

impl Factors {
    /// Of the lower triangle of a positive matrix; source and form as of [`super::lanes::factor`].
    pub fn new(matrix: &[Vec<Double>]) -> Self {
        let n = matrix.len();
        let mut rows: Vec<Vec<Double>> = Vec::with_capacity(n);
        for j in 0..n {
            let mut own = matrix[j][..=j].to_vec();
            for l in 0..j {
                for m in 0..l {
                    let part = own[m] * rows[l][m];
                    own[l] -= part;
                }
            }
            let mut pivot = own[j];
            for l in 0..j {
                let t = own[l];
                own[l] = t * rows[l][l];
                pivot -= t * own[l];
            }
            let is_flat = pivot.nearest() <= 1e-30 * matrix[j][j].nearest() || pivot.nearest() < 1e-290;
            own[j] = if is_flat { Double::ZERO } else { Double::ONE.over(pivot) };
            rows.push(own);
        }
        Self { n, rows }
    }

    pub fn solve(&self, x: &mut [Double]) {
        for j in 0..self.n {
            for l in 0..j {
                let part = self.rows[j][l] * x[l];
                x[j] -= part;
            }
        }
        for j in 0..self.n {
            x[j] = x[j] * self.rows[j][j];
        }
        for j in (0..self.n).rev() {
            for l in j + 1..self.n {
                let part = self.rows[l][j] * x[l];
                x[j] -= part;
            }
        }
    }
}

/// Why there is no nearest point.
pub(super) enum Stuck {
    /// Nothing keeps the bounds: weights `y ≥ 0` with `Σ y a = 0` and `Σ y b < 0`.
    Contradiction(Vec<f64>),
    /// Bounds came and went without end.
    Cycling,
}

/// `a_k·x ≤ b_k`.
pub(super) struct Bounds {
    pub a: Vec<Vec<Double>>,
    pub b: Vec<Double>,
}

/// Makes `½ x·x` least under the bounds.
///
/// - Equation: bounds that do not hold are added one by one; `x ← x − t z`, `u_A ← u_A − t r`, `u_k ← u_k + t` with
///   `z = a_k − Σ r a_A`, `r = (A Aᵀ)⁻¹ A a_k`.
/// - Symbols: `A` bounds that are active, `u` their multipliers (push).
/// - Range: whole coefficients.
/// - Source: Goldfarb & Idnani 1983, Mathematical Programming 27, 1.
/// - Shape: each pass raises the least, so that it ends.
pub(super) fn nearest(n: usize, bounds: &Bounds) -> Result<Vec<Double>, Stuck> {
    let (x, push) = (vec![Double::ZERO; n], vec![Double::ZERO; bounds.b.len()]);
    let mut search = Search { bounds, x, push, active: Vec::new() };
    for _ in 0..MAX_CHANGES {
        let Some(worst) = search.most_broken() else { return Ok(search.x) };
        while !search.go(worst)? {}
    }
    Err(Stuck::Cycling)
}

struct Search<'a> {
    bounds: &'a Bounds,
    x: Vec<Double>,
    push: Vec<Double>,
    active: Vec<usize>,
}

impl Search<'_> {
    /// Towards a bound that does not hold: until it does, or until another one lets go.
    fn go(&mut self, worst: usize) -> Result<bool, Stuck> {
        let Self { bounds: Bounds { a, b }, x, push, active } = self;
        let r = shares(worst, active, a);
        let mut z = a[worst].clone();
        for (&k, &r) in active.iter().zip(&r) {
            z.iter_mut().zip(&a[k]).for_each(|(z, a)| *z -= r * *a);
        }
        let is_dependent = dot(&z, &z).nearest() <= DEPENDENT * dot(&a[worst], &a[worst]).nearest();
        let held = (0..active.len()).filter(|&place| r[place].nearest() > 1e-20);
        let held = held.map(|place| (push[active[place]].over(r[place]), place));
        let first = held.min_by(|a, b| a.0.nearest().total_cmp(&b.0.nearest()));
        let (t, leaving) = match first {
            None if is_dependent => {
                let mut proof = vec![0.0; push.len()];
                proof[worst] = 1.0;
                active.iter().zip(&r).for_each(|(&k, r)| proof[k] = (-r.nearest()).max(0.0));
                return Err(Stuck::Contradiction(proof));
            }
            Some((t, place)) if is_dependent => (t, Some(place)),
            _ => {
                let full = (dot(&a[worst], x) - b[worst]).over(dot(&a[worst], &z));
                first.filter(|(t, _)| *t < full).map_or((full, None), |(t, place)| (t, Some(place)))
            }
        };
        if !is_dependent {
            x.iter_mut().zip(&z).for_each(|(x, z)| *x -= t * *z);
        }
        active.iter().zip(&r).for_each(|(&k, &r)| push[k] -= t * r);
        push[worst] += t;
        match leaving {
            None => active.push(worst),
            Some(place) => push[active.remove(place)] = Double::ZERO,
        }
        Ok(leaving.is_none())
    }

    /// The bound that is passed most.
    fn most_broken(&self) -> Option<usize> {
        let Bounds { a, b } = self.bounds;
        let excess = |k: usize| {
            let size: f64 = a[k].iter().zip(&self.x).map(|(a, x)| (a.nearest() * x.nearest()).abs()).sum();
            let excess = (dot(&a[k], &self.x) - b[k]).nearest();
            if excess > 1e-26 * (size + b[k].nearest().abs()) { excess } else { 0.0 }
        };
        let candidates = (0..b.len()).filter(|k| !self.active.contains(k)).map(|k| (excess(k), k));
        let worst = candidates.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(excess, _)| *excess > 0.0);
        worst.map(|(_, k)| k)
    }
}

pub(super) fn dot(a: &[Double], x: &[Double]) -> Double {
    a.iter().zip(x).fold(Double::ZERO, |sum, (a, x)| sum + *a * *x)
}

/// How much of each active bound is in another one: `(A Aᵀ)⁻¹ A a`.
fn shares(worst: usize, active: &[usize], a: &[Vec<Double>]) -> Vec<Double> {
    let row = |&k: &usize| active.iter().map(|&l| dot(&a[k], &a[l])).collect::<Vec<_>>();
    let gram: Vec<Vec<Double>> = active.iter().map(row).collect();
    let mut r: Vec<Double> = active.iter().map(|&k| dot(&a[k], &a[worst])).collect();
    Factors::new(&gram).solve(&mut r);
    r
}
