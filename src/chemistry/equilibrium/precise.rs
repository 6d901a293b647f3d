//! The convex problem in 32 digits: where 16 do not tell the way.
//!
//! Owns the iteration that is tried last, and the proof that minerals form without end. May use the compiled
//! system and the words. It deliberately is not fast, and takes activities as they are.

use super::basis::Basis;
use super::quadratic::{Bounds, Factors, Stuck, dot, nearest};
use super::system::System;
use crate::maths::double::Double;
use crate::maths::scalar::expm1;

const MAX_STEPS: usize = 3000;
/// Minerals held and let go within one step.
const MAX_CHANGES: usize = 100;
/// No component of a step in ln c is longer.
const MAX_STEP: f64 = 10.0;
/// A step of less than this leaves less than its square.
const LAST_STEP: f64 = 1e-13;
/// Balances that are solved: what doubles hold of them is, too.
const SOLVED: f64 = 1e-13;
/// Balances below this, mol/m³, are those of species that are absent.
const NOTHING: f64 = 1e-250;

/// What is solved: rows with the activities of the moment, without the species that cannot be present.
pub(super) struct Problem<'a> {
    pub system: &'a System,
    pub totals: &'a [f64],
    /// `ln K` of each row, activity coefficients included.
    pub constants: Vec<f64>,
    /// Which of all species are absent.
    pub is_absent: Vec<bool>,
}

/// Concentrations of all species, amounts of minerals, and `ln c` of primaries.
pub(super) struct Solution {
    pub xi: Vec<f64>,
    pub values: Vec<f64>,
}

/// A point and the step from it.
struct Step {
    c: Vec<Double>,
    /// Change of the logarithm of each species with the whole step, and of ξ.
    change: Vec<f64>,
    xi: Vec<Double>,
    amounts: Vec<Double>,
    /// `Σ c Δ² − Σ m s`: how fast the potential falls.
    fall: f64,
}

impl Problem<'_> {
    /// A proof that no waters are at or below the saturation of all minerals: amounts `y ≥ 0` of them that add up
    /// to nothing, and form all the same, `Σ y ln S < 0`.
    pub fn endless(&self) -> Option<Vec<f64>> {
        let n = self.system.n_primaries;
        let bounds = self.bounds(&vec![Double::ZERO; n]);
        let Err(Stuck::Contradiction(proof)) = nearest(n, &bounds) else { return None };
        let mut all = vec![0.0; self.system.n_minerals];
        self.minerals().zip(proof).for_each(|(k, part)| all[k] = part);
        Some(all)
    }

    /// Newton's method within the bounds of saturation, where the potential alone says how far to go; an error is
    /// what is left of the worst balance.
    ///
    /// - Equation: `δ` makes `½ δᵀHδ + F·δ` least under `s_k + ν_k·δ ≤ 0`; multipliers are the amounts m of minerals. A
    ///   part p of it is taken for which `Σ c (e^{pΔ} − 1 − pΔ) ≤ 0.9999 p (Σ c Δ² − Σ m s)`, Δ the changes of ln c: the
    ///   potential falls by at least `10⁻⁴ p` of what its slope says (Armijo), in terms that do not cancel.
    /// - Symbols: F balances without minerals, H their derivatives, s saturation indices.
    /// - Range: the waters that are at or below saturation; the first is the one nearest to the guess.
    /// - Source: Nocedal & Wright 2006, Numerical Optimization, §18.1 (quadratic steps) with methods 8.1.
    /// - Shape: convex, with linear bounds: every part of a step keeps them, and the potential falls.
    pub fn solve(&self, guess: &[f64]) -> Result<Solution, f64> {
        let n = self.system.n_primaries;
        let mut xi: Vec<Double> = guess.iter().map(|&xi| Double::from(xi)).collect();
        let first = nearest(n, &self.bounds(&xi)).map_err(|_| 1.0)?;
        add(&mut xi, &first, 1.0);
        let mut held = Vec::new();
        for _ in 0..MAX_STEPS {
            let Some(step) = self.step(&xi, &mut held) else { break };
            let longest = step.change.iter().map(|change| change.abs()).fold(0.0, f64::max);
            let part = self.part(&step, longest);
            if longest <= LAST_STEP || part == 0.0 {
                let worst = self.defect(&step);
                return if worst <= SOLVED { Ok(self.solution(&xi, &step)) } else { Err(worst) };
            }
            add(&mut xi, &step.xi, part);
        }
        Err(1.0)
    }

    /// The step with the minerals that hold it, which are those of the last step at first.
    ///
    /// - Equation: along the way to the least with held minerals at saturation, the first other one that becomes
    ///   saturated is held, too; at its end, one of negative amount is let go.
    /// - Source: Nocedal & Wright 2006, §16.5 (primal active sets).
    fn step(&self, xi: &[Double], held: &mut Vec<usize>) -> Option<Step> {
        let c = self.concentrations(xi);
        let bounds = self.bounds(xi);
        let mut x = vec![Double::ZERO; xi.len()];
        held.retain(|&k| bounds.b[k] == Double::ZERO);
        for _ in 0..MAX_CHANGES {
            let step = self.step_with(&c, held, &bounds.b);
            let way: Vec<Double> = step.xi.iter().zip(&x).map(|(to, from)| *to - *from).collect();
            let others = (0..bounds.b.len()).filter(|k| !held.contains(k));
            let parts = others.filter_map(|k| {
                let (rise, room) = (dot(&bounds.a[k], &way), bounds.b[k] - dot(&bounds.a[k], &x));
                let size: f64 = way.iter().map(|way| way.nearest().abs()).sum();
                let is_rising = rise.nearest() > 1e-26 * (size + 1.0);
                is_rising.then(|| ((room.nearest() / rise.nearest()).max(0.0), k))
            });
            match parts.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(part, _)| *part < 1.0) {
                Some((part, k)) => {
                    add(&mut x, &way, part);
                    held.push(k);
                }
                None => {
                    let amounts =
                        held.iter().enumerate().map(|(place, &k)| (step.amounts[k].nearest(), place));
                    let worst = amounts.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(m, _)| *m < 0.0);
                    let Some((_, place)) = worst else { return Some(step) };
                    x.clone_from(&step.xi);
                    held.remove(place);
                }
            }
        }
        None
    }

    /// The step that makes minerals saturated which are held, and of the potential the least.
    fn step_with(&self, c: &[Double], held: &[usize], room: &[Double]) -> Step {
        let (n, system) = (self.system.n_primaries, self.system);
        let sizes: Vec<f64> = c.iter().map(|c| c.nearest()).collect();
        let minerals: Vec<usize> = self.minerals().collect();
        let first: Vec<usize> = held.iter().map(|&k| minerals[k]).collect();
        let basis = Basis::new(system, &first, &sizes);
        let mut shares: Vec<Vec<Double>> = (0..n).map(|j| basis.over([(j, 1.0)])).collect();
        let rows = system.secondaries().iter();
        shares.extend(rows.map(|row| basis.over(row.entries.iter().map(|entry| (entry.primary, entry.nu)))));
        // −F and H.
        let mut right = basis.over(self.totals.iter().copied().enumerate());
        let mut hessian: Vec<Vec<Double>> = (0..n).map(|_| vec![Double::ZERO; n]).collect();
        for (share, c) in shares.iter().zip(c).filter(|(_, c)| c.nearest() > 0.0) {
            for b in (0..n).filter(|&b| share[b] != Double::ZERO) {
                let part = *c * share[b];
                right[b] -= part;
                hessian[b].iter_mut().zip(share).for_each(|(cell, share)| *cell += part * *share);
            }
        }
        let n_held = held.len();
        let mut x: Vec<Double> = held.iter().map(|&k| room[k]).collect();
        let free = (n_held..n).map(|b| right[b] - dot(&hessian[b][..n_held], &x));
        let mut free: Vec<Double> = free.collect();
        let rest: Vec<Vec<Double>> = hessian[n_held..].iter().map(|row| row[n_held..].to_vec()).collect();
        Factors::new(&rest).solve(&mut free);
        x.extend(free);
        let mut amounts = vec![Double::ZERO; room.len()];
        held.iter().enumerate().for_each(|(b, &k)| amounts[k] = right[b] - dot(&hessian[b], &x));
        let change = |share: &Vec<Double>| dot(share, &x).nearest();
        let changes = shares.iter().zip(&sizes).map(|(share, &c)| if c > 0.0 { change(share) } else { 0.0 });
        let change: Vec<f64> = changes.collect();
        let bend: f64 = sizes.iter().zip(&change).map(|(c, change)| c * change * change).sum();
        let below = dot(room, &amounts).nearest().max(0.0);
        Step { c: c.to_vec(), change, xi: basis.back(&x), amounts, fall: bend + below }
    }

    /// The part of a step for which the potential falls; 0 if there is none.
    fn part(&self, step: &Step, longest: f64) -> f64 {
        let mut part = (MAX_STEP / longest).min(1.0);
        for _ in 0..60 {
            let over = step.c.iter().zip(&step.change).map(|(c, change)| c.nearest() * bow(part * change));
            if over.sum::<f64>() <= 0.9999 * part * step.fall {
                return part;
            }
            part *= 0.5;
        }
        0.0
    }

    /// Minerals that may be there.
    fn minerals(&self) -> impl Iterator<Item = usize> {
        let first = self.system.n_primaries + self.system.n_secondaries;
        (0..self.system.n_minerals).filter(move |k| !self.is_absent[first + k])
    }

    /// `ν_k · δ ≤ −s_k` at a point.
    fn bounds(&self, xi: &[Double]) -> Bounds {
        let first = self.system.n_secondaries;
        let bound = |k: usize| {
            let entries = &self.system.rows[first + k].entries;
            let mut row = vec![Double::ZERO; self.system.n_primaries];
            entries.iter().for_each(|entry| row[entry.primary] = Double::from(entry.nu));
            let room = -self.logarithm(first + k, xi);
            // What is saturated up to rounding is saturated.
            (row, if room.nearest().abs() < 1e-27 { Double::ZERO } else { room })
        };
        let (a, b) = self.minerals().map(bound).unzip();
        Bounds { a, b }
    }

    /// `ln C` of a secondary, or a saturation index.
    fn logarithm(&self, row: usize, xi: &[Double]) -> Double {
        let entries = self.system.rows[row].entries.iter();
        entries.fold(Double::from(self.constants[row]), |sum, entry| sum + xi[entry.primary].times(entry.nu))
    }

    fn concentrations(&self, xi: &[Double]) -> Vec<Double> {
        let primaries = xi.iter().copied();
        let secondaries = (0..self.system.n_secondaries).map(|i| self.logarithm(i, xi));
        let all = primaries.chain(secondaries).zip(&self.is_absent);
        all.map(|(ln, is_absent)| if *is_absent { Double::ZERO } else { ln.exponential() }).collect()
    }

    /// The worst balance, relative to its terms.
    fn defect(&self, step: &Step) -> f64 {
        let n = self.system.n_primaries;
        let mut residual: Vec<Double> = self.totals.iter().map(|&total| Double::from(-total)).collect();
        let mut size: Vec<f64> = self.totals.iter().map(|total| total.abs()).collect();
        let mut count = |j: usize, part: Double| {
            residual[j] += part;
            size[j] += part.nearest().abs();
        };
        (0..n).for_each(|j| count(j, step.c[j]));
        let aqueous = self.system.secondaries().iter().zip(&step.c[n..]);
        let first = self.system.n_secondaries;
        let solid = self.minerals().zip(&step.amounts).map(|(k, m)| (&self.system.rows[first + k], m));
        for (row, amount) in aqueous.chain(solid) {
            row.entries.iter().for_each(|entry| count(entry.primary, amount.times(entry.nu)));
        }
        let relative = residual.iter().zip(size).map(|(f, size)| f.nearest().abs() / (size + NOTHING));
        relative.fold(0.0, |worst, own| if own <= worst { worst } else { own })
    }

    fn solution(&self, xi: &[Double], step: &Step) -> Solution {
        let mut values: Vec<f64> = step.c.iter().map(|c| c.nearest()).collect();
        let first = values.len();
        values.resize(self.system.n_species(), 0.0);
        self.minerals().zip(&step.amounts).for_each(|(k, m)| values[first + k] = m.nearest().max(0.0));
        Solution { xi: xi.iter().map(|xi| xi.nearest()).collect(), values }
    }
}

/// `e^x − 1 − x`
fn bow(x: f64) -> f64 {
    if x.abs() < 1e-3 { x * x * (0.5 + x / 6.0) } else { expm1(x) - x }
}

fn add(xi: &mut [Double], step: &[Double], part: f64) {
    xi.iter_mut().zip(step).for_each(|(xi, step)| *xi += step.times(part));
}
