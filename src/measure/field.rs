//! Fields over the bins and times of one output, and their norms.
//!
//! Owns the arithmetic of field expressions. May use the other parts of `measure`. It deliberately
//! interpolates nothing: fields of different grids do not mix.

use super::grid::{Grid, is_binned};
use super::observed::{Observed, Run, column};
use super::reference::Prepared;
use crate::plan::evaluation::Field;
use crate::plan::{OutputKind, Quantity};

/// Sums from which all norms follow.
pub(super) struct Norms {
    weight: f64,
    count: u64,
    sum: f64,
    sum_of_sizes: f64,
    sum_of_squares: f64,
    minimum: f64,
    maximum: f64,
}

impl Norms {
    pub(super) fn new(weight: f64) -> Self {
        Self {
            weight,
            count: 0,
            sum: 0.0,
            sum_of_sizes: 0.0,
            sum_of_squares: 0.0,
            minimum: f64::INFINITY,
            maximum: f64::NEG_INFINITY,
        }
    }

    pub(super) fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
        self.sum_of_sizes += value.abs();
        self.sum_of_squares += value * value;
        // A value that is not a number must show: `f64::min` would pass over it.
        self.minimum = if value.is_nan() || value < self.minimum { value } else { self.minimum };
        self.maximum = if value.is_nan() || value > self.maximum { value } else { self.maximum };
    }

    pub(super) fn count(&self) -> u64 {
        self.count
    }

    pub(super) fn l1(&self) -> f64 {
        self.unless_empty(self.sum_of_sizes * self.weight)
    }

    pub(super) fn l2(&self) -> f64 {
        self.unless_empty((self.sum_of_squares * self.weight).sqrt())
    }

    pub(super) fn l_inf(&self) -> f64 {
        self.unless_empty(largest(-self.minimum, self.maximum))
    }

    pub(super) fn rmse(&self) -> f64 {
        (self.sum_of_squares / self.count as f64).sqrt()
    }

    pub(super) fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }

    pub(super) fn integral(&self) -> f64 {
        self.unless_empty(self.sum * self.weight)
    }

    pub(super) fn minimum(&self) -> f64 {
        self.unless_empty(self.minimum)
    }

    pub(super) fn maximum(&self) -> f64 {
        self.unless_empty(self.maximum)
    }

    /// A norm of nothing is undefined: an error of zero would read as perfect.
    fn unless_empty(&self, value: f64) -> f64 {
        if self.count == 0 { f64::NAN } else { value }
    }
}

fn largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// A field with its grid.
pub(super) struct Values {
    pub(super) grid: Grid,
    pub(super) times: Vec<AtTime>,
}

/// A field at one time, over the bins.
pub(super) struct AtTime {
    pub(super) t: f64,
    pub(super) values: Vec<f64>,
    /// False where the norm's output, or another one in the expression, has no value.
    pub(super) is_filled: Vec<bool>,
}

/// The values of a field on the bins and times of an output. Every part of the field lives there: a
/// reference or a constant alone has no value where the output has none, or quotients of norms would
/// compare different bins.
pub(super) fn values(
    run: &Run,
    references: &[Prepared],
    field: &Field,
    output_idx: usize,
) -> Result<Values, String> {
    let output = run.plan.outputs.get(output_idx).ok_or("the run does not have its output.")?;
    let series = run.series(output_idx, output.quantities[0])?;
    let n_bins = series.grid.n_bins();
    // Without bins a value is missing for one pair and not for another: the parts tell which is meant.
    let is_binned = is_binned(output.kind);
    let blank = |observed: Observed| AtTime {
        t: observed.t,
        values: vec![0.0; n_bins],
        is_filled: if is_binned { observed.is_filled } else { vec![true; n_bins] },
    };
    let times = series.times.into_iter().map(blank).collect();
    let mut target = Values { grid: series.grid, times };
    fill(run, references, field, output_idx, &mut target)?;
    Ok(target)
}

/// Replaces the values of `target` by those of the field on output `on`; bins without a value are marked.
fn fill(
    run: &Run,
    references: &[Prepared],
    field: &Field,
    on: usize,
    target: &mut Values,
) -> Result<(), String> {
    match field {
        Field::Number(number) => target.times.iter_mut().for_each(|time| time.values.fill(*number)),
        Field::Position(index) => {
            let centres = target.grid.centres(*index).ok_or("the run has no such axis.")?;
            target.times.iter_mut().for_each(|time| time.values.copy_from_slice(&centres));
        }
        Field::Output(kind, quantity) => fill_from(run, (*kind, *quantity, 0), on, target)?,
        Field::Column(kind, quantity, number) => fill_from(run, (*kind, *quantity, *number), on, target)?,
        Field::Reference(idx) => {
            let reference = references.get(*idx).ok_or("it uses a reference that does not exist.")?;
            for time in &mut target.times {
                time.values = reference.bin_means(time.t, &target.grid);
                if reference.has_gaps {
                    let values = time.is_filled.iter_mut().zip(&time.values);
                    values.for_each(|(is_filled, value)| *is_filled &= !value.is_nan());
                }
            }
            let quantity = reference.reference.target;
            if column(run.output(on), quantity).is_some() {
                let series = run.series_of(on, quantity, reference.reference.number)?;
                target.times.iter_mut().zip(&series.times).for_each(|(time, observed)| time.mask(observed));
            }
        }
        Field::Unary(operator, a) => {
            fill(run, references, a, on, target)?;
            let values = target.times.iter_mut().flat_map(|time| &mut time.values);
            values.for_each(|value| *value = operator.apply(*value));
        }
        Field::Binary(operator, a, b) => {
            let mut other = target.blank();
            fill(run, references, a, on, target)?;
            fill(run, references, b, on, &mut other)?;
            target.combine(&other, |a, b| operator.apply(a, b));
        }
    }
    Ok(())
}

/// Replaces the values of `target` by a number of an output.
fn fill_from(
    run: &Run,
    (kind, quantity, number): (OutputKind, Quantity, usize),
    on: usize,
    target: &mut Values,
) -> Result<(), String> {
    let output_idx = run.find(kind, quantity, run.output(on));
    let output_idx = output_idx
        .ok_or("no output of the run has that species or pair on the bins and times of the others.")?;
    let series = run.series_of(output_idx, quantity, number)?;
    if series.times.len() != target.times.len() {
        return Err("it combines outputs whose times differ.".into());
    }
    for (time, observed) in target.times.iter_mut().zip(series.times) {
        time.values.clone_from(&observed.values);
        time.mask(&observed);
    }
    Ok(())
}

impl AtTime {
    /// Leaves out what another result leaves out.
    fn mask(&mut self, observed: &Observed) {
        self.is_filled.iter_mut().zip(&observed.is_filled).for_each(|(own, other)| *own &= other);
    }
}

impl Values {
    /// The same bins and times without values of the field.
    fn blank(&self) -> Self {
        let times = self.times.iter().map(|time| AtTime {
            t: time.t,
            values: vec![0.0; time.values.len()],
            is_filled: time.is_filled.clone(),
        });
        Self { grid: self.grid.clone(), times: times.collect() }
    }

    fn combine(&mut self, other: &Self, operator: impl Fn(f64, f64) -> f64) {
        for (time, other) in self.times.iter_mut().zip(&other.times) {
            for (bin, value) in time.values.iter_mut().enumerate() {
                *value = operator(*value, other.values[bin]);
                time.is_filled[bin] &= other.is_filled[bin];
            }
        }
    }
}
