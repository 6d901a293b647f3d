//! Measures: expressions that give one number.
//!
//! Owns facts, norms and their arithmetic. May use the other parts of `measure`. It deliberately
//! rounds nothing.

use super::field::{self, Norms};
use super::grid::Grid;
use super::observed::Run;
use super::reference::Prepared;
use crate::engine::snapshot::Outcome;
use crate::flow::statistics::Statistics;
use crate::plan::evaluation::{Evaluation, Fact, Field, Measure, Norm, SAME_TIME, Scalar};

/// The values of all measures, in the order of the scene.
pub(super) fn values(
    run: &Run,
    references: &[Prepared],
    evaluation: &Evaluation,
) -> Result<Vec<f64>, String> {
    let mut known: Vec<Option<f64>> = vec![None; evaluation.measures.len()];
    for idx in evaluation.order() {
        let measure = &evaluation.measures[idx];
        let value = Evaluator { run, references, measure, known: &known }.scalar(&measure.value);
        let no_value = |reason| format!("The measure `{}` has no value: {reason}", measure.name);
        known[idx] = Some(value.map_err(no_value)?);
    }
    Ok(known.into_iter().flatten().collect())
}

struct Evaluator<'a> {
    run: &'a Run<'a>,
    references: &'a [Prepared<'a>],
    measure: &'a Measure,
    /// Values of the measures that come before it.
    known: &'a [Option<f64>],
}

impl Evaluator<'_> {
    fn scalar(&self, scalar: &Scalar) -> Result<f64, String> {
        Ok(match scalar {
            Scalar::Number(number) => *number,
            Scalar::Fact(fact) => value_of(*fact, self.run.outcome),
            Scalar::Measure(idx) => {
                self.known.get(*idx).copied().flatten().ok_or("it names a measure that needs it, or none.")?
            }
            Scalar::Norm(norm, output_idx, field) => self.norm(*norm, *output_idx, field)?,
            Scalar::Unary(operator, a) => operator.apply(self.scalar(a)?),
            Scalar::Binary(operator, a, b) => operator.apply(self.scalar(a)?, self.scalar(b)?),
        })
    }

    fn norm(&self, norm: Norm, output_idx: usize, field: &Field) -> Result<f64, String> {
        let field = field::values(self.run, self.references, field, output_idx)?;
        let is_within = self.bins_within(&field.grid)?;
        let wanted = self.times_within(&field.times.iter().map(|time| time.t).collect::<Vec<_>>())?;
        let mut norms = Norms::new(field.grid.weight);
        for &idx in &wanted {
            let time = &field.times[idx];
            for (bin, &value) in time.values.iter().enumerate() {
                if time.is_filled[bin] && is_within[bin] {
                    norms.add(value);
                }
            }
        }
        Ok(match norm {
            Norm::L1 => norms.l1(),
            Norm::L2 => norms.l2(),
            Norm::LInf => norms.l_inf(),
            Norm::Rmse => norms.rmse(),
            Norm::Integral => norms.integral() / wanted.len() as f64,
            Norm::Mean => norms.mean(),
            Norm::Minimum => norms.minimum(),
            Norm::Maximum => norms.maximum(),
        })
    }

    /// Which bins have their centre in the range of the measure. An axis that the run left out has no
    /// gradient: a range along it changes no mean and is passed over.
    fn bins_within(&self, grid: &Grid) -> Result<Vec<bool>, String> {
        let n_bins = grid.n_bins();
        let Some((index, low, high)) = self.measure.over else {
            return Ok(vec![true; n_bins]);
        };
        if grid.axes.is_empty() {
            return Err("a range in space is given for a total or a mixing state, which have no bins.".into());
        }
        let Some(axis_idx) = grid.axes.iter().position(|axis| axis.index == index) else {
            return Ok(vec![true; n_bins]);
        };
        let axis = grid.axes[axis_idx];
        // Centres on the limit count: they may be off by rounding.
        let slack = 1e-9 * (high - low).abs();
        let is_within = (0..n_bins).map(|bin| {
            let centre = axis.centre(grid.bin_along(bin, axis_idx));
            low - slack <= centre && centre <= high + slack
        });
        Ok(is_within.collect())
    }

    /// Indices of the times that the measure asks for.
    fn times_within(&self, times: &[f64]) -> Result<Vec<usize>, String> {
        let Some(wanted) = &self.measure.times else {
            return Ok((0..times.len()).collect());
        };
        let find = |&t: &f64| {
            let is_same = |other: &f64| (other - t).abs() <= SAME_TIME * t.abs().max(other.abs());
            times.iter().position(is_same).ok_or_else(|| format!("its output has no values at {t} s."))
        };
        wanted.iter().map(find).collect()
    }
}

fn value_of(fact: Fact, outcome: &Outcome) -> f64 {
    let of_flow = |value: fn(&Statistics) -> f64| outcome.flow.as_ref().map_or(f64::NAN, value);
    match fact {
        Fact::WallTime => outcome.wall,
        Fact::CpuTime => outcome.cpu,
        Fact::MassDefect => outcome.worst_defect(),
        Fact::Particles => outcome.n_particles as f64,
        Fact::Steps => outcome.n_steps as f64,
        Fact::SubSteps => outcome.sub_steps().unwrap_or(0) as f64,
        Fact::VelocityMeanX => of_flow(|flow| flow.mean[0]),
        Fact::VelocityMeanY => of_flow(|flow| flow.mean[1]),
        Fact::VelocityMeanZ => of_flow(|flow| flow.mean[2]),
        Fact::VelocityVarianceX => of_flow(|flow| flow.variance[0]),
        Fact::VelocityVarianceY => of_flow(|flow| flow.variance[1]),
        Fact::VelocityVarianceZ => of_flow(|flow| flow.variance[2]),
        Fact::EffectiveConductivity => of_flow(|flow| flow.conductivity),
    }
}
