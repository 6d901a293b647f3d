//! Running sums that are searched often.
//!
//! Owns the search. May use nothing else of the crate. It deliberately knows not what is summed.

/// Entries of a guide above which it has fewer than there are sums.
const MOST_PARTS: usize = 1 << 16;

/// Sums that never fall, with an index of where they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Running {
    sums: Vec<f64>,
    /// For equal parts of the total the first place whose sum is above the beginning of the part.
    guide: Vec<u32>,
}

impl Running {
    /// The sums as they are.
    ///
    /// - Equation: `guide[k] = min {i : sums[i] > k total / m}`.
    /// - Symbols: `m` number of sums, or an eighth of it where the guide would not fit a cache.
    /// - Range: sums that never fall; up to 2³² of them.
    /// - Source: H.-C. Chen, Y. Asau, 1974: On generating random variates from an empirical distribution, AIIE
    ///   Transactions 6, 163, doi:10.1080/05695557408974949. A search takes one step on average, where halving a
    ///   million sums takes twenty that wait for memory.
    /// - Shape: as many entries as `m`.
    pub fn new(sums: Vec<f64>) -> Self {
        let n = sums.len();
        // Eight sums are a line of a cache: to walk along one costs less than to wait for a second one.
        let n_parts = if n > MOST_PARTS { n / 8 } else { n };
        let total = sums.last().copied().unwrap_or(0.0);
        let mut guide = Vec::with_capacity(n_parts);
        let mut idx = 0;
        for part in 0..n_parts {
            let from = total * (part as f64 / n_parts as f64);
            while idx + 1 < n && sums[idx] <= from {
                idx += 1;
            }
            guide.push(idx as u32);
        }
        Self { sums, guide }
    }

    /// Sums of weights.
    pub fn of(weights: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let next = |weight: f64| {
            sum += weight;
            sum
        };
        Self::new(weights.map(next).collect())
    }

    pub fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// Bytes of memory.
    pub fn size(&self) -> usize {
        size_of_val(&self.sums[..]) + size_of_val(&self.guide[..])
    }

    pub fn sums(&self) -> &[f64] {
        &self.sums
    }

    /// The first place whose sum is above a value (the last one if none is), and the part of its own that is below.
    pub fn find(&self, wanted: f64) -> (usize, f64) {
        let Some(last) = self.sums.len().checked_sub(1) else { return (0, 0.5) };
        let part = (wanted / self.total() * self.guide.len() as f64) as usize;
        let mut idx = self.guide[part.min(self.guide.len() - 1)] as usize;
        // The part is rounded: the guide may be a place too far.
        while idx > 0 && self.sums[idx - 1] > wanted {
            idx -= 1;
        }
        while idx < last && self.sums[idx] <= wanted {
            idx += 1;
        }
        let before = if idx == 0 { 0.0 } else { self.sums[idx - 1] };
        let own = self.sums[idx] - before;
        (idx, if own > 0.0 { ((wanted - before) / own).clamp(0.0, 1.0) } else { 0.5 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_found_as_by_halving() {
        let weights = |seed: usize, n: usize| {
            (0..n).map(move |k| match (k * seed) % 7 {
                0 | 3 => 0.0,
                other => 0.1 * other as f64 + 1e3 * f64::from(u8::from((k * seed) % 31 == 5)),
            })
        };
        for (seed, n) in [(1, 1), (3, 2), (5, 13), (11, 1000), (13, 4099), (11, (1 << 16) + 5)] {
            let running = Running::of(weights(seed, n));
            let sums = running.sums().to_vec();
            let inside = (0..=5 * n).map(|k| running.total() * (k as f64 / (5 * n) as f64));
            let ends = sums.iter().flat_map(|&sum| [sum, sum.next_up(), sum.next_down()]);
            for wanted in inside.chain(ends).chain([-1.0, 0.0, f64::MAX]) {
                let halved = sums.partition_point(|&sum| sum <= wanted).min(n - 1);
                assert_eq!(running.find(wanted).0, halved, "{wanted} of {n}");
            }
        }
    }

    #[test]
    fn nothing_at_all_is_found_in_the_first_place() {
        assert_eq!(Running::new(vec![0.0, 0.0]).find(0.0), (1, 0.5));
        assert_eq!(Running::new(Vec::new()).find(0.0), (0, 0.5));
    }
}
