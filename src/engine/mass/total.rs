//! Long sums of numbers of one kind.
//!
//! Owns a sum with what rounding took from it. May use nothing. It deliberately hangs on the order of its terms.

/// A running sum that does not lose what is small against it.
///
/// - Equation: `s ← s + v`, `c ← c + ((s_old − s) + v)`, with the two changed round where `v` is the larger.
/// - Symbols: `s` sum, `c` what rounding has taken.
/// - Range: any finite terms; right to a rounding of the result for as many terms as fit in a run.
/// - Source: A. Neumaier 1974, Z. angew. Math. Mech. 54, 39.
/// - Shape: one number.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Total {
    sum: f64,
    rest: f64,
}

impl Total {
    pub fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        let lost = match self.sum.abs() >= value.abs() {
            true => (self.sum - sum) + value,
            false => (value - sum) + self.sum,
        };
        self.rest += lost;
        self.sum = sum;
    }

    pub fn value(self) -> f64 {
        self.sum + self.rest
    }

    pub fn of(values: impl Iterator<Item = f64>) -> f64 {
        let mut total = Self::default();
        values.for_each(|value| total.add(value));
        total.value()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_small_is_kept() {
        let values = [1e16, 1.0, 1.0, -1e16, 3.0].into_iter();
        assert_eq!(Total::of(values.cycle().take(5000)), 5000.0);
    }
}
