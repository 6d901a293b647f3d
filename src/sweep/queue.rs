//! What is left to run: replicates of points, and when a point has had enough of them.
//!
//! Owns the order and the count of replicates. May use the sweep's criterion. It deliberately looks at
//! replicates in the order of their numbers, whoever finished first: the count never hangs on the schedule.

use crate::scenario::sweep::Replicates;

/// Means and standard errors of one measure over the first replicates of a point.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Per replicate its value; not a number if it failed or has none.
    values: Vec<Option<f64>>,
}

impl Series {
    pub fn set(&mut self, replicate: u32, value: f64) {
        let place = replicate as usize;
        if self.values.len() <= place {
            self.values.resize(place + 1, None);
        }
        self.values[place] = Some(value);
    }

    /// Replicates that the point needs as far as is known, and whether that is the last word.
    pub fn needed(&self, replicates: &Replicates) -> (u32, bool) {
        let Some(until) = &replicates.until else { return (replicates.least, true) };
        let mut n = replicates.least;
        while n < until.most {
            let Some(first) = self.values.get(..n as usize) else { return (n, false) };
            if first.iter().any(Option::is_none) {
                return (n, false);
            }
            let known: Vec<f64> = first.iter().flatten().copied().filter(|value| value.is_finite()).collect();
            if is_precise(&known, until.threshold) {
                return (n, true);
            }
            n += 1;
        }
        (n, true)
    }
}

impl Series {
    /// Whether the mean is as precise as was asked for; always, if nothing was asked.
    pub fn is_precise(&self, replicates: &Replicates) -> bool {
        let Some(until) = &replicates.until else { return true };
        let known: Vec<f64> =
            self.values.iter().flatten().copied().filter(|value| value.is_finite()).collect();
        is_precise(&known, until.threshold)
    }
}

/// Whether the standard error of the mean is below its part of the mean.
fn is_precise(values: &[f64], threshold: f64) -> bool {
    let n = values.len() as f64;
    if n < 2.0 {
        return false;
    }
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (variance / n).sqrt() < threshold * mean.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::sweep::Until;

    fn replicates(least: u32, most: u32, threshold: f64) -> Replicates {
        let until = Until { most, measure: "err".to_owned(), threshold };
        Replicates { least, until: Some(until) }
    }

    #[test]
    fn a_fixed_number_is_the_last_word() {
        assert_eq!(Series::default().needed(&Replicates { least: 8, until: None }), (8, true));
    }

    /// 1, 3: mean 2, standard error 1; with a third 2 it is √(1/3) = 0.577.
    #[test]
    fn replicates_are_counted_until_the_mean_is_precise() {
        let mut series = Series::default();
        assert_eq!(series.needed(&replicates(2, 5, 0.3)), (2, false));
        series.set(1, 3.0);
        assert_eq!(series.needed(&replicates(2, 5, 0.3)), (2, false));
        series.set(0, 1.0);
        assert_eq!(series.needed(&replicates(2, 5, 0.51)), (2, true));
        assert_eq!(series.needed(&replicates(2, 5, 0.3)), (3, false));
        series.set(2, 2.0);
        assert_eq!(series.needed(&replicates(2, 5, 0.3)), (3, true));
        assert_eq!(series.needed(&replicates(2, 3, 0.1)), (3, true));
        assert_eq!(series.needed(&replicates(2, 5, 0.1)), (4, false));
    }

    #[test]
    fn replicates_without_a_value_count_and_say_nothing() {
        let mut series = Series::default();
        [1.0, f64::NAN, 1.0].into_iter().enumerate().for_each(|(idx, value)| series.set(idx as u32, value));
        assert_eq!(series.needed(&replicates(2, 9, 0.1)), (3, true));
    }
}
