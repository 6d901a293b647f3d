//! Points that fill a box more evenly than chance does, one after another.
//!
//! Owns the sequence. May use `state`. It deliberately knows no domain: its points are those of a unit cube.

use crate::state::stream::Stream;

/// A place in the sequence for each axis, from which it goes on: the seed of the run moves all points together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quasi {
    shift: [u64; 4],
}

/// By the number of axes: the fractions of 2⁶⁴ by which a point goes on, φ^−1, φ^−2, …
const STEPS: [[u64; 4]; 4] = [
    [0x9e37_79b9_7f4a_7c15, 0, 0, 0],
    [0xc13f_a9a9_02a6_328f, 0x91e1_0da5_c79e_7b1c, 0, 0],
    [0xd1b5_4a32_d192_ed03, 0xabc9_8388_fb8f_ac02, 0x8cb9_2ba7_2f3d_8dd7, 0],
    [0xdb4f_0b91_75ae_2165, 0xbbe0_5633_03a4_615f, 0xa0f2_ec75_a1fe_1575, 0x89e1_8285_7d9e_d688],
];

/// An identity that no particle has.
const NOBODY: u64 = u64::MAX;

impl Quasi {
    pub fn new(stream: &Stream) -> Self {
        let uniforms = stream.uniforms_of(NOBODY, 0);
        Self { shift: std::array::from_fn(|axis| (uniforms[axis] * 2_f64.powi(53)) as u64 * (1 << 11)) }
    }

    /// Point `count` in `(0, 1)^N`.
    ///
    /// - Equation: `x_k = frac(s_k + n φ^−k)`, `φ^{N+1} = φ + 1`.
    /// - Symbols: `s` shift by the seed, `n` count; φ is the golden ratio on a line.
    /// - Range: up to four axes; exact, in whole numbers of 2⁻⁶⁴.
    /// - Source: M. Roberts 2018, "The unreasonable effectiveness of quasirandom sequences"; shift: R. Cranley,
    ///   T. N. L. Patterson 1976, doi:10.1137/0713071.
    /// - Shape: one point.
    pub fn point<const N: usize>(self, count: u64) -> [f64; N] {
        let steps = STEPS[N.clamp(1, 4) - 1];
        std::array::from_fn(|axis| {
            let fraction = self.shift[axis].wrapping_add(count.wrapping_mul(steps[axis]));
            ((fraction >> 11) as f64 + 0.5) / 2_f64.powi(53)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::stream::Purpose;

    fn of(seed: u64) -> Quasi {
        Quasi::new(&Stream::new(seed, Purpose::Placement))
    }

    /// However many points there are on a line, their gaps are of two or three sizes, none above φ² = 2.62 others.
    #[test]
    fn gaps_on_a_line_are_of_three_sizes() {
        for (seed, n) in [(1, 100_u64), (2, 1000), (3, 4181)] {
            let mut points: Vec<f64> = (0..n).map(|count| of(seed).point::<1>(count)[0]).collect();
            points.sort_by(f64::total_cmp);
            let mut gaps: Vec<f64> = points.windows(2).map(|pair| pair[1] - pair[0]).collect();
            gaps.sort_by(f64::total_cmp);
            assert!(gaps[gaps.len() - 1] / gaps[0] < 2.7);
            gaps.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
            assert!(gaps.len() <= 3, "{gaps:?}");
        }
    }

    /// Boxes with 64 points on average: by chance the worst of so many would be off by 22 and more.
    #[test]
    fn every_box_has_nearly_its_share() {
        fn worst<const N: usize>(n_along: usize, seed: u64) -> u64 {
            let n_boxes = n_along.pow(N as u32);
            let mut counts = vec![0_u64; n_boxes];
            for count in 0..64 * n_boxes as u64 {
                let point = of(seed).point::<N>(count);
                let at = point.iter().fold(0, |at, x| at * n_along + (x * n_along as f64) as usize);
                counts[at] += 1;
            }
            counts.iter().map(|count| count.abs_diff(64)).max().unwrap_or(0)
        }
        assert!(worst::<1>(256, 1) <= 3);
        assert!(worst::<2>(16, 2) <= 8, "{}", worst::<2>(16, 2));
        assert!(worst::<3>(8, 3) <= 19, "{}", worst::<3>(8, 3));
    }
}
