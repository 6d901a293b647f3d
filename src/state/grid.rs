//! Rectangular bins over the active axes.
//!
//! Owns the map from a position to the index of a bin. May use nothing else of the crate. It
//! deliberately accumulates nothing.

/// Equal bins along each axis; the first axis is slowest.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<const D: usize> {
    low: [f64; D],
    high: [f64; D],
    inverse_width: [f64; D],
    bins: [usize; D],
    /// Axes that a particle may leave.
    is_open: [bool; D],
}

impl<const D: usize> Grid<D> {
    /// `None` if an axis has no bins or no length, or if there are more than 2³¹ − 2 bins.
    pub fn new(low: [f64; D], high: [f64; D], bins: [usize; D], is_open: [bool; D]) -> Option<Self> {
        let n_bins = bins.iter().try_fold(1_usize, |product, &n| product.checked_mul(n))?;
        let is_sound =
            (0..D).all(|axis| high[axis] - low[axis] > 0.0 && (high[axis] - low[axis]).is_finite());
        if n_bins == 0 || n_bins >= i32::MAX as usize || !is_sound {
            return None;
        }
        let inverse_width = std::array::from_fn(|axis| bins[axis] as f64 / (high[axis] - low[axis]));
        Some(Self { low, high, inverse_width, bins, is_open })
    }

    /// The same space with other bins.
    pub fn with_bins(&self, bins: [usize; D]) -> Option<Self> {
        Self::new(self.low, self.high, bins, self.is_open)
    }

    pub fn n_bins(&self) -> usize {
        self.bins.iter().product()
    }

    /// Bins and one slot more for the particles outside open sides.
    pub fn n_slots(&self) -> usize {
        self.n_bins() + 1
    }

    pub fn bins(&self) -> [usize; D] {
        self.bins
    }

    /// Middle of a bin.
    pub fn centre(&self, bin: usize) -> [f64; D] {
        let mut rest = bin;
        let mut centre = [0.0; D];
        for axis in (0..D).rev() {
            let along = rest % self.bins[axis];
            rest /= self.bins[axis];
            centre[axis] = self.low[axis] + (along as f64 + 0.5) / self.inverse_width[axis];
        }
        centre
    }

    pub fn has_open_side(&self) -> bool {
        self.is_open.contains(&true)
    }

    /// Slot of each particle: its bin, or `n_bins` outside an open side.
    ///
    /// A position on an inner face belongs to the upper bin, on the upper end to the last.
    #[inline(always)]
    pub fn locate(&self, positions: [&[f64]; D], slots: &mut [i32]) {
        let n = slots.len();
        let positions = positions.map(|axis| &axis[..n]);
        let last = self.bins.map(|bins| (bins - 1) as f64);
        for (idx, slot) in slots.iter_mut().enumerate() {
            let along = |axis: usize| {
                let along = floor((positions[axis][idx] - self.low[axis]) * self.inverse_width[axis]);
                if along < last[axis] { along } else { last[axis] }
            };
            let mut bin = if D > 0 { along(0) } else { 0.0 };
            for (axis, last) in last.iter().enumerate().skip(1) {
                bin = bin * (last + 1.0) + along(axis);
            }
            *slot = low_bits(bin);
        }
        if self.has_open_side() {
            self.put_outside(positions, slots);
        }
    }

    /// Moves the slots of particles beyond open sides.
    #[inline(always)]
    fn put_outside(&self, positions: [&[f64]; D], slots: &mut [i32]) {
        let outside = self.n_bins() as i32;
        for (axis, positions) in positions.iter().enumerate() {
            if self.is_open[axis] {
                let (low, high) = (self.low[axis], self.high[axis]);
                for (slot, &x) in slots.iter_mut().zip(*positions) {
                    *slot = if x >= low && x <= high { *slot } else { outside };
                }
            }
        }
    }
}

/// Added to a number of moderate size it leaves the nearest whole number in the low bits.
const SHIFT: f64 = 4_503_599_627_370_496.0;

/// Largest whole number not above `x`, and 0 below 0 and for what is not a number. Sums with a large
/// power of two vectorise on every machine; conversions to integers do not.
#[inline(always)]
fn floor(x: f64) -> f64 {
    let x = if x > 0.0 { x } else { 0.0 };
    let nearest = (x + SHIFT) - SHIFT;
    if nearest > x { nearest - 1.0 } else { nearest }
}

/// A whole number below 2³¹ as an integer.
#[inline(always)]
fn low_bits(whole: f64) -> i32 {
    (whole + SHIFT).to_bits() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_axis_is_slowest_and_ends_belong_inside() {
        let grid = Grid::new([0.0, -1.0], [2.0, 1.0], [2, 4], [false, false]).unwrap();
        let mut slots = [9; 4];
        grid.locate([&[0.0, 2.0, 0.99, 1.0], &[-1.0, 1.0, -0.5, 0.49]], &mut slots);
        assert_eq!(slots, [0, 7, 1, 6]);
    }

    #[test]
    fn outside_an_open_side_is_the_last_slot() {
        let grid = Grid::new([0.0], [1.0], [10], [true]).unwrap();
        let mut slots = [0; 4];
        grid.locate([&[-1e-300, 1.5, 1.0, f64::INFINITY]], &mut slots);
        assert_eq!(slots, [10, 10, 9, 10]);
    }

    #[test]
    fn a_bin_holds_its_centre() {
        let grid = Grid::new([0.0, -1.0, 3.0], [2.0, 1.0, 4.0], [2, 4, 5], [false; 3]).unwrap();
        for bin in 0..grid.n_bins() {
            let centre = grid.centre(bin);
            let mut slot = [0];
            grid.locate([&centre[..1], &centre[1..2], &centre[2..]], &mut slot);
            assert_eq!(slot[0] as usize, bin);
        }
        assert_eq!(grid.centre(0), [0.5, -0.75, 3.1]);
    }

    #[test]
    fn floors_are_exact_on_and_beside_whole_numbers() {
        for whole in [0.0_f64, 1.0, 2.0, 3.0, 299.0, 1e6, 2_147_483_646.0] {
            assert_eq!(floor(whole), whole);
            assert_eq!(floor(whole + 0.5), whole);
            assert_eq!(low_bits(whole), whole as i32);
            if whole > 0.0 {
                assert_eq!(floor(whole.next_down()), whole - 1.0);
            }
        }
        assert_eq!(floor(-3.5), 0.0);
        assert_eq!(floor(f64::NAN), 0.0);
        assert!(floor(1e300) >= 1e15);
    }

    #[test]
    fn unsound_grids_are_refused() {
        assert!(Grid::new([0.0], [0.0], [1], [false]).is_none());
        assert!(Grid::new([0.0], [1.0], [0], [false]).is_none());
        assert!(Grid::new([0.0, 0.0], [1.0, 1.0], [1 << 20, 1 << 20], [false; 2]).is_none());
    }
}
