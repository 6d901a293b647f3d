//! Gaussian random fields on equal cells, for conductivity whose logarithm is one.
//!
//! Owns covariances, the embedding in a periodic box, and its random numbers. May use `maths`, `state` and
//! cells. It deliberately solves for no flow.

use super::Cells;
use crate::maths::chacha::DRAW;
use crate::maths::fourier::{self, Complex};
use crate::maths::scalar::exp;
use crate::maths::wide::Width;
use crate::state::stream::{Purpose, Stream};
use std::fmt;

#[cfg(test)]
mod tests;

/// Cells of the periodic box that are taken at most: 1 GiB of complex numbers.
const MOST_CELLS: usize = 64 << 20;

/// Share of the variance that may be cut off where the largest box still has negative eigenvalues.
pub const MOST_CLIPPED: f64 = 1e-3;

/// A share of the variance that no sample shows: boxes grow no further.
const NEGLIGIBLE: f64 = 1e-6;

/// Lengths of correlation after which a Gaussian covariance is nothing: exp(−36).
const GAUSSIAN_REACH: f64 = 6.0;

/// How the covariance falls with distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Covariance {
    /// `σ² exp(−√(Σ (dᵢ/lᵢ)²))`.
    Exponential,
    /// `σ² exp(−Σ (dᵢ/lᵢ)²)`.
    Gaussian,
}

/// A stationary Gaussian field of mean zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomField {
    pub covariance: Covariance,
    pub variance: f64,
    /// Per axis, m; not read for an axis of one cell.
    pub lengths: [f64; 3],
    pub seed: u64,
}

/// One field, and how well the periodic box held its covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Realisation {
    /// Per cell.
    pub values: Vec<f64>,
    /// Share of the variance in eigenvalues that were negative and are cut off.
    pub clipped: f64,
    /// Cells of the periodic box.
    pub embedded: [usize; 3],
}

/// Why there is no field.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldError {
    /// Variance negative or no number.
    Variance(f64),
    /// A length that is not positive, and its axis.
    Length { axis: usize, length: f64 },
    /// Cells of different sizes along an axis.
    UnequalCells { axis: usize },
    /// The smallest periodic box that can hold the covariance.
    TooLarge { embedded: [usize; 3], bytes: u64, limit: u64 },
    /// Too much of the variance is negative in the largest periodic box that fits into memory.
    Indefinite { embedded: [usize; 3], clipped: f64, limit: f64 },
}

impl fmt::Display for FieldError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = |axis: &usize| ["x", "y", "z"][*axis];
        match self {
            Self::Variance(variance) => {
                write!(f, "the variance of the random field is {variance}; it must be positive or zero")
            }
            Self::Length { axis: along, length } => {
                write!(f, "the correlation length along {} is {length} m; it must be positive", axis(along))
            }
            Self::UnequalCells { axis: along } => {
                write!(f, "a random field needs cells of equal size, and those along {} differ", axis(along))
            }
            Self::TooLarge { embedded: [x, y, z], bytes, limit } => write!(
                f,
                "the random field needs a periodic box of {x} × {y} × {z} cells and {} MiB, above the limit of {} MiB",
                bytes >> 20,
                limit >> 20
            ),
            Self::Indefinite { embedded: [x, y, z], clipped, limit } => write!(
                f,
                "the covariance does not fit into a periodic box: with {x} × {y} × {z} cells a share of {clipped:.1e} \
                 of the variance would be cut off, above the limit of {limit:.1e}; shorter correlation lengths \
                 or fewer cells would do"
            ),
        }
    }
}

impl RandomField {
    /// A realisation by circulant embedding.
    ///
    /// - Equation: `Y = Re F(√(s/M) (z₁ + i z₂))`, `s = F(c)`.
    /// - Symbols: `c` covariance with the first cell on a periodic box of `M` cells; `F` the discrete Fourier transform; `z`
    ///   standard normal numbers.
    /// - Range: exact where no `s` is negative; boxes grow until a share of 1e-6 at most is, which is cut off and reported.
    /// - Source: C. R. Dietrich and G. N. Newsam (1997), SIAM J. Sci. Comput. 18, 1088, doi:10.1137/S1064827592240555.
    /// - Shape: one number per cell.
    pub fn realise(&self, cells: &Cells) -> Result<Realisation, FieldError> {
        self.realise_within(cells, MOST_CELLS)
    }

    fn realise_within(&self, cells: &Cells, most_cells: usize) -> Result<Realisation, FieldError> {
        self.check(cells)?;
        let n = cells.n();
        let (embedded, mut data, clipped) = self.spectrum(cells, most_cells)?;
        let scale = 1.0 / data.re.len() as f64;
        let stream = Stream::new(self.seed, Purpose::Conductivity);
        let width = Width::widest();
        let mut normals = [0.0; DRAW];
        let blocks = data.re.chunks_mut(DRAW / 2).zip(data.im.chunks_mut(DRAW / 2));
        for (block_idx, (re, im)) in blocks.enumerate() {
            stream.double_normals(width, block_idx as u64, 0, &mut normals);
            let (first, second) = normals.split_at(DRAW / 2);
            for (((re, im), first), second) in re.iter_mut().zip(im).zip(first).zip(second) {
                let amplitude = (re.max(0.0) * scale).sqrt();
                *re = amplitude * first;
                *im = amplitude * second;
            }
        }
        fourier::transform(&mut data, embedded);
        let mut values = Vec::with_capacity(cells.n_cells());
        for i in 0..n[0] {
            for j in 0..n[1] {
                let start = (i * embedded[1] + j) * embedded[2];
                values.extend_from_slice(&data.re[start..start + n[2]]);
            }
        }
        Ok(Realisation { values, clipped, embedded })
    }

    fn check(&self, cells: &Cells) -> Result<(), FieldError> {
        if !(self.variance >= 0.0 && self.variance.is_finite()) {
            return Err(FieldError::Variance(self.variance));
        }
        for axis in (0..3).filter(|&axis| cells.n()[axis] > 1) {
            let length = self.lengths[axis];
            if !(length > 0.0 && length.is_finite()) {
                return Err(FieldError::Length { axis, length });
            }
            let mean = mean_width(cells, axis);
            if (0..cells.n()[axis]).any(|along| (cells.width(axis, along) - mean).abs() > 1e-6 * mean) {
                return Err(FieldError::UnequalCells { axis });
            }
        }
        Ok(())
    }

    /// Eigenvalues of the smallest box that has hardly any below zero, or of the largest that fits.
    fn spectrum(&self, cells: &Cells, most_cells: usize) -> Result<([usize; 3], Complex, f64), FieldError> {
        let mut embedded = self.first_box(cells);
        if !fits(embedded, most_cells) {
            let bytes = embedded.iter().fold(16_u64, |product, &size| product.saturating_mul(size as u64));
            return Err(FieldError::TooLarge { embedded, bytes, limit: 16 * most_cells as u64 });
        }
        loop {
            let mut data = self.covariances(cells, embedded);
            fourier::transform(&mut data, embedded);
            // The imaginary part is rounding: the covariance is even.
            let negative: f64 = data.re.iter().map(|value| (-value).max(0.0)).sum();
            let all: f64 = data.re.iter().map(|value| value.abs()).sum();
            let clipped = if all > 0.0 { negative / all } else { 0.0 };
            let larger = embedded.map(|size| if size > 1 { fourier::good_size(size + size / 2) } else { 1 });
            let is_last = !fits(larger, most_cells);
            if is_last && clipped > MOST_CLIPPED {
                return Err(FieldError::Indefinite { embedded, clipped, limit: MOST_CLIPPED });
            }
            if is_last || clipped <= NEGLIGIBLE {
                return Ok((embedded, data, clipped));
            }
            embedded = larger;
        }
    }

    /// Twice the domain, or for a Gaussian the domain and its reach.
    fn first_box(&self, cells: &Cells) -> [usize; 3] {
        [0, 1, 2].map(|axis| {
            let n = cells.n()[axis];
            let reach = GAUSSIAN_REACH * self.lengths[axis] / mean_width(cells, axis);
            match self.covariance {
                _ if n == 1 => 1,
                Covariance::Exponential => fourier::good_size(2 * n),
                // Above the limit in any case: a size that can be multiplied.
                Covariance::Gaussian if reach > MOST_CELLS as f64 => MOST_CELLS,
                Covariance::Gaussian => fourier::good_size(n + reach.ceil() as usize),
            }
        })
    }

    /// Covariance of each cell of the box with the first. A Gaussian is the sum over all periods, which has no
    /// negative eigenvalue; an exponential, whose sum would reach into the domain, that of the nearest period.
    fn covariances(&self, cells: &Cells, embedded: [usize; 3]) -> Complex {
        let along = [0, 1, 2].map(|axis| self.along(cells, axis, embedded[axis]));
        let mut data = Complex::zeros(embedded.iter().product());
        let mut idx = 0;
        for x in &along[0] {
            for y in &along[1] {
                for z in &along[2] {
                    data.re[idx] = self.variance
                        * match self.covariance {
                            Covariance::Exponential => exp(-(x + y + z).sqrt()),
                            Covariance::Gaussian => x * y * z,
                        };
                    idx += 1;
                }
            }
        }
        data
    }

    /// Along an axis: squares of distances in lengths of correlation, or the Gaussian of them summed over periods.
    fn along(&self, cells: &Cells, axis: usize, size: usize) -> Vec<f64> {
        let one_cell = match self.covariance {
            Covariance::Exponential => 0.0,
            Covariance::Gaussian => 1.0,
        };
        if size == 1 {
            return vec![one_cell];
        }
        let step = mean_width(cells, axis) / self.lengths[axis];
        let square = |lag: f64| (lag * step) * (lag * step);
        let at = |idx: usize| match self.covariance {
            Covariance::Exponential => square(idx.min(size - idx) as f64),
            // The box is wider than the reach: farther periods add nothing to a number of 53 bits.
            Covariance::Gaussian => {
                (-2..=2).map(|period| exp(-square(idx as f64 + f64::from(period) * size as f64))).sum()
            }
        };
        (0..size).map(at).collect()
    }
}

fn fits(embedded: [usize; 3], most_cells: usize) -> bool {
    let product = embedded.iter().try_fold(1_usize, |product, &size| product.checked_mul(size));
    product.is_some_and(|product| product <= most_cells)
}

fn mean_width(cells: &Cells, axis: usize) -> f64 {
    let edges = &cells.edges()[axis];
    (edges[edges.len() - 1] - edges[0]) / (edges.len() - 1) as f64
}

/// Conductivity whose logarithm is a random field: `K = K_G exp(Y)`.
pub fn lognormal(geometric_mean: f64, field: &Realisation) -> Vec<f64> {
    field.values.iter().map(|value| geometric_mean * exp(*value)).collect()
}
