//! Densities by kernels of one size for all particles, and histograms.
//!
//! Owns the rules by which that size is found. May use spectra, limits and bands. It deliberately lets kernels differ along
//! axes, but nowhere else.

use super::bands::{Band, smooth};
use super::frame::Frame;
use super::kinds::Shape;
use super::lattice::{AXES, End, Field, Lattice, Window};
use super::limits::Limits;
use super::spectrum::Spectrum;
use super::tally::{Tally, Weighing};
use super::taps::{Integral, Line, REACH, Taps};
use crate::maths::vector::{exp, ln, pow};
use crate::maths::wide::Width;
use std::f64::consts::PI;

/// Change of a bandwidth that ends the plug-in's iteration, and the number of loops that ends it anyway. Each loop leaves up to
/// two thirds of what was missing, so that less than a thousandth of a bandwidth is missing in the end.
const TOLERANCE: f64 = 1e-4;
const MOST_LOOPS: usize = 100;

/// Stages of the fixed point, as orders of derivatives: the first is taken with the variance that is tried.
const STAGES: [i32; 6] = [7, 6, 5, 4, 3, 2];

/// The largest variance that the fixed point is looked for at, in squared lengths of the line; variances that are tried, a
/// factor apart; bisections between two of them.
const WIDEST: f64 = 0.1;
const FACTOR: f64 = 1.2;
const N_BISECTIONS: usize = 60;

/// Cells that a kernel may reach to each side; more would take long, and show nothing.
const MOST_REACH: f64 = 2000.0;

/// How the bandwidth is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// m, the same along all axes.
    Fixed(f64),
    /// The best one for a normal density with the standard deviations that particles have.
    NormalReference,
    /// The best one for the density's own roughness, which is found with a wider kernel, in turns.
    PlugIn(Shape),
    /// The best one by a chain of roughnesses that supposes no shape; on a line alone.
    Botev,
}

/// Why there is no density.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trouble {
    /// The bandwidth is not a number above zero.
    Bandwidth,
    /// The rule is for lattices of one axis.
    OnlyOnALine,
    /// An end holds a value: what such a density is made of is known of kernels that differ alone.
    Held,
    /// Masses are not finite.
    Masses,
    /// Particles were counted on other cells.
    OtherCells,
    /// Kernels reach too many cells.
    TooFine,
}

impl std::fmt::Display for Trouble {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Bandwidth => "the bandwidth is not a number above zero",
            Self::OnlyOnALine => "this rule finds a bandwidth on a line, not in a plane or in space",
            Self::Held => "ends that hold a value are for kernels that differ from place to place",
            Self::Masses => "masses of particles, or their sums, are not finite",
            Self::TooFine => {
                "cells are so fine that a kernel reaches more than two thousand: fewer cells show as much"
            }
            Self::OtherCells => "particles were counted on another lattice",
        })
    }
}

impl std::error::Error for Trouble {}

/// A density, and the bandwidths that it has.
#[derive(Debug, Clone, PartialEq)]
pub struct Global {
    /// Mass per m^d, by cell of the lattice, and its standard error by the numbers of particles.
    pub density: Vec<f64>,
    pub standard_error: Vec<f64>,
    /// m; zero on axes that are not used.
    pub bandwidths: [f64; AXES],
    /// Bandwidths that were tried after the first one.
    pub n_loops: usize,
    /// Whether the last one changed by less than the tolerance; false, too, where a bound of bandwidths was met.
    pub is_settled: bool,
}

/// The density of particles that are counted on a lattice, with one kernel for all.
///
/// - Equation: `f = Σ_b m_b Π_i W_i/V`, standard error `√(Σ_b (Σ m²)_b Π_i W_i²)/V`.
/// - Symbols: `m_b` mass in a cell, `V` volume of a cell, `W_i` Gaussians integrated over cells.
/// - Range: bandwidths within limits, as those of kernels that differ are; an axis of one cell is not smoothed.
/// - Source: methods, (2.1), section 2.4, section 4.5.
/// - Shape: one value per cell; mass stays between mirrors.
pub fn global(
    lattice: &Lattice,
    tally: &Tally,
    rule: Rule,
    weighing: Weighing,
    width: Width,
) -> Result<Global, Trouble> {
    check(lattice, tally)?;
    let frame = Frame::new(lattice, tally, false);
    if let Some((own, of)) = &frame.reduced {
        // An axis of one cell tells nothing of a density.
        let mut found = global(own, of, rule, weighing, width)?;
        let values = found.density.iter_mut().chain(&mut found.standard_error);
        values.for_each(|value| *value *= frame.per_volume());
        let mut bandwidths = [0.0; AXES];
        for (k, &axis) in frame.kept.iter().enumerate() {
            bandwidths[axis] = found.bandwidths[AXES - own.d + k];
        }
        return Ok(Global { bandwidths, ..found });
    }
    let search = Search::new(lattice, tally, weighing);
    let found = match rule {
        Rule::Fixed(h) if h > 0.0 && h.is_finite() => Found::at_once(search.limited([h; AXES])),
        Rule::Fixed(_) => return Err(Trouble::Bandwidth),
        Rule::NormalReference => Found::at_once(search.normal_reference(tally)),
        Rule::Botev if lattice.d > 1 => return Err(Trouble::OnlyOnALine),
        Rule::Botev => search.fixed_point(tally),
        Rule::PlugIn(shape) => search.plug_in(tally, shape),
    };
    let Found { bandwidths, n_loops, is_settled } = found;
    let is_wide = |axis: usize| REACH * bandwidths[axis] / lattice.edge[axis] > MOST_REACH;
    if lattice.axes().any(is_wide) {
        return Err(Trouble::TooFine);
    }
    let volume = lattice.volume();
    let mut density = spread(lattice, (&tally.cells, &tally.masses), (bandwidths, false), width);
    density.iter_mut().for_each(|value| *value /= volume);
    let mut standard_error = spread(lattice, (&tally.cells, &tally.squares), (bandwidths, true), width);
    standard_error.iter_mut().for_each(|value| *value = tally.largest * value.sqrt() / volume);
    Ok(Global { density, standard_error, bandwidths, n_loops, is_settled })
}

/// Mass per volume of each cell, and its standard error by the numbers of particles.
///
/// - Equation: `f_b = m_b/V`, standard error `√(Σ m²)_b/V`.
/// - Symbols: as for [`global`].
/// - Range: any lattice; particles that were counted on other cells are left out.
/// - Source: methods, section 2.2.
/// - Shape: one value per cell.
pub fn histogram(lattice: &Lattice, tally: &Tally) -> (Vec<f64>, Vec<f64>) {
    let volume = lattice.volume();
    let (mut density, mut standard_error) = (vec![0.0; lattice.n_cells()], vec![0.0; lattice.n_cells()]);
    for ((&cell, mass), square) in tally.cells.iter().zip(&tally.masses).zip(&tally.squares) {
        if let (Some(density), Some(error)) =
            (density.get_mut(cell as usize), standard_error.get_mut(cell as usize))
        {
            (*density, *error) = (mass / volume, tally.largest * square.sqrt() / volume);
        }
    }
    (density, standard_error)
}

fn check(lattice: &Lattice, tally: &Tally) -> Result<(), Trouble> {
    let n = lattice.n_cells();
    if lattice.ends.as_flattened().iter().any(|end| matches!(end, End::Held(_))) {
        return Err(Trouble::Held);
    }
    if tally.cells.iter().any(|&cell| cell as usize >= n) {
        return Err(Trouble::OtherCells);
    }
    let (mass, square): (f64, f64) = (tally.mass(), tally.squares.iter().sum());
    if mass.is_finite() && square.is_finite() { Ok(()) } else { Err(Trouble::Masses) }
}

/// Bandwidths, and how they were found.
struct Found {
    bandwidths: [f64; AXES],
    n_loops: usize,
    is_settled: bool,
}

impl Found {
    fn at_once(bandwidths: [f64; AXES]) -> Self {
        Self { bandwidths, n_loops: 0, is_settled: true }
    }
}

struct Search<'a> {
    lattice: &'a Lattice,
    limits: Limits,
    counts: Vec<f64>,
    n: f64,
}

impl<'a> Search<'a> {
    fn new(lattice: &'a Lattice, tally: &Tally, weighing: Weighing) -> Self {
        let (mut counts, unit) = tally.pseudo_counts(weighing);
        // Masses that cancel, or that are all zero, count for nothing.
        let is_sound = unit.is_finite() && unit != 0.0 && counts.iter().all(|count| count.is_finite());
        if !is_sound {
            counts.fill(0.0);
        }
        let n: f64 = counts.iter().sum();
        Self { lattice, limits: Limits::new(lattice), counts, n }
    }

    /// Bandwidths within their bounds; those that are no number are as wide as can be.
    fn limited(&self, wanted: [f64; AXES]) -> [f64; AXES] {
        let mut limited = [0.0; AXES];
        for axis in self.lattice.axes() {
            let [low, high] = self.limits.kernel[axis];
            limited[axis] = if wanted[axis] < high { wanted[axis].max(low) } else { high };
        }
        limited
    }

    /// The best bandwidths for a normal density.
    ///
    /// - Equation: `h_i = σ_i [4/((d + 2) N)]^{1/(d+4)}`.
    /// - Symbols: `σ_i` standard deviation along axis i, `N` number of particles, the effective one where masses differ.
    /// - Range: within limits.
    /// - Source: methods, (2.4) with r = 0.
    /// - Shape: one per axis, m.
    fn normal_reference(&self, tally: &Tally) -> [f64; AXES] {
        let d = self.lattice.d as f64;
        let factor = pow(4.0 / ((d + 2.0) * self.n.max(0.0)), 1.0 / (d + 4.0));
        self.limited(tally.deviations().map(|deviation| deviation * factor))
    }

    fn spectrum(&self, tally: &Tally) -> Spectrum {
        Spectrum::new(self.lattice, (&tally.cells, &self.counts))
    }

    fn smallest(&self) -> f64 {
        self.lattice.axes().map(|axis| self.lattice.edge[axis]).fold(f64::INFINITY, f64::min)
    }

    /// The best bandwidths for the roughness that counts have with wider ones, in turns.
    ///
    /// - Equation: `h = [d N/((4π)^{d/2} Λ(g))]^{1/(d+4)}`, `g_i = N^p h_i`, `h_0 = IQR/N`.
    /// - Symbols: `Λ = Σ_ij s_i² s_j² ψ_ij`, `s_i = h_i/h`; `p` 1/10 on a line, else `2/((d+4)(d+6))`.
    /// - Range: `g_i` and `h_0` of at least one cell; h within limits.
    /// - Source: methods, (2.5), (2.2), (3.4).
    /// - Shape: one per axis, m; a density without roughness has the widest ones.
    fn plug_in(&self, tally: &Tally, shape: Shape) -> Found {
        let lattice = self.lattice;
        let d = lattice.d as f64;
        let power = if lattice.d == 1 { 0.1 } else { 2.0 / ((d + 4.0) * (d + 6.0)) };
        let inflation = pow(self.n.max(1.0), power);
        let (spectrum, unit) = (self.spectrum(tally), self.smallest());
        let mut start = [0.0; AXES];
        for axis in lattice.axes() {
            start[axis] = (self.quartiles(tally, axis) / self.n.max(1.0)).max(lattice.edge[axis]);
        }
        if shape == Shape::Round {
            start = [start.into_iter().fold(0.0, f64::max); AXES];
        }
        let mut found = Found { bandwidths: self.limited(start), n_loops: 0, is_settled: false };
        while found.n_loops < MOST_LOOPS && !found.is_settled {
            let old = found.bandwidths;
            let mut g = [0.0; AXES];
            for axis in lattice.axes() {
                g[axis] = (inflation * old[axis]).max(lattice.edge[axis]) / unit;
            }
            let products = spectrum.products(g);
            found.bandwidths = self.limited(self.best(products, shape).map(|h| h * unit));
            found.n_loops += 1;
            let change = |axis: usize| (found.bandwidths[axis] / old[axis] - 1.0).abs();
            found.is_settled = lattice.axes().all(|axis| change(axis) < TOLERANCE);
        }
        found
    }

    /// The bandwidths that are best with some integrals of curvatures, in units of the smallest cell.
    fn best(&self, products: [[f64; AXES]; AXES], shape: Shape) -> [f64; AXES] {
        let lattice = self.lattice;
        let d = lattice.d as f64;
        let own = |axis: usize| products[axis][axis];
        let is_round =
            shape == Shape::Round || lattice.axes().any(|axis| own(axis).is_nan() || own(axis) <= 0.0);
        let mean: f64 = lattice.axes().map(|axis| ln(own(axis))).sum::<f64>() / d;
        let stretch = |axis: usize| {
            if is_round { 1.0 } else { exp(0.25 * (mean - ln(own(axis)))) }
        };
        let mut roughness = 0.0;
        for i in lattice.axes() {
            for j in lattice.axes() {
                let both = stretch(i) * stretch(j);
                roughness += both * both * products[i][j];
            }
        }
        let h = if roughness > 0.0 {
            pow(d * self.n.max(0.0) / (pow(4.0 * PI, 0.5 * d) * roughness), 1.0 / (d + 4.0))
        } else {
            f64::INFINITY
        };
        let mut best = [0.0; AXES];
        lattice.axes().for_each(|axis| best[axis] = h * stretch(axis));
        best
    }

    /// The distance between quartiles along an axis, m; particles stand evenly in their cell.
    fn quartiles(&self, tally: &Tally, axis: usize) -> f64 {
        let mut along = vec![0.0; self.lattice.cells[axis]];
        for (&cell, count) in tally.cells.iter().zip(&self.counts) {
            along[self.lattice.cell(cell as usize)[axis]] += count;
        }
        let place = |part: f64| {
            let (mut below, wanted) = (0.0, part * self.n);
            for (at, &count) in along.iter().enumerate() {
                if below + count >= wanted && count > 0.0 {
                    return at as f64 + ((wanted - below) / count).clamp(0.0, 1.0);
                }
                below += count;
            }
            0.0
        };
        (place(0.75) - place(0.25)).max(0.0) * self.lattice.edge[axis]
    }

    /// The bandwidth that a chain of roughnesses gives back.
    ///
    /// - Equation: `t = (2 N √π f_2(t_2))^{−2/5}` with `t_s = [2 (1 + 2^{−s−1/2})/3 (2s−1)!!/(√(2π) N f_{s+1}(t_{s+1}))]^{2/(3+2s)}`
    ///   for s from 6 to 2, and `t_7 = t`; `h = √t`.
    /// - Symbols: `f_s(t)` integral of the squared s-th derivative, smoothed with variance t.
    /// - Range: the narrowest solution within the limits; without one, the limit that the equation points to. Derivatives up to
    ///   the seventh are seen where h is some six cells; on coarser ones it is off by a few per cent.
    /// - Source: methods, section 2.3.
    /// - Shape: m.
    fn fixed_point(&self, tally: &Tally) -> Found {
        let (spectrum, unit) = (self.spectrum(tally), self.smallest());
        let n_cells = self.lattice.cells[AXES - 1] as f64;
        let [low, _] = self.limits.kernel[AXES - 1].map(|h| h / unit * (h / unit));
        let most = (WIDEST * n_cells * n_cells).max(low);
        let mut found = Found { bandwidths: [0.0; AXES], n_loops: 0, is_settled: false };
        let mut is_above = |t: f64| {
            found.n_loops += 1;
            // What is no number ends the search, with the widest.
            t >= self.chain(&spectrum, t)
        };
        let (mut below, mut above) = (low, low);
        let mut is_found = is_above(low);
        if !is_found {
            while !is_found && above < most {
                (below, above) = (above, FACTOR * above);
                is_found = is_above(above);
            }
            for _ in 0..if is_found { N_BISECTIONS } else { 0 } {
                let middle = 0.5 * (below + above);
                *(if is_above(middle) { &mut above } else { &mut below }) = middle;
            }
            found.is_settled = is_found;
        }
        found.bandwidths = self.limited([if is_found { above.sqrt() * unit } else { f64::INFINITY }; AXES]);
        found
    }

    /// What the chain gives for a variance, in units of the cells' size.
    fn chain(&self, spectrum: &Spectrum, t: f64) -> f64 {
        let per_square = 1.0 / (self.n * self.n);
        let mut roughness = spectrum.roughness(STAGES[0], t) * per_square;
        for s in &STAGES[1..] {
            let order = f64::from(*s);
            let odd: f64 = (1..=*s).map(|k| f64::from(2 * k - 1)).product();
            let factor = (1.0 + pow(2.0, -order - 0.5)) / 3.0;
            let per = (2.0 * PI).sqrt() * self.n * roughness;
            let own = pow(2.0 * factor * odd / per, 2.0 / (3.0 + 2.0 * order));
            roughness = spectrum.roughness(*s, own) * per_square;
        }
        pow(2.0 * self.n * PI.sqrt() * roughness, -0.4)
    }
}

/// What cells have of others with kernels of one size or with their squares.
fn spread(
    lattice: &Lattice,
    (cells, masses): (&[u32], &[f64]),
    (bandwidths, is_squared): ([f64; AXES], bool),
    width: Width,
) -> Vec<f64> {
    let all = Window { first: [0; AXES], end: lattice.cells };
    let mut field = Field::zeros(&all, [1; AXES]);
    for (&cell, mass) in cells.iter().zip(masses) {
        field.values[cell as usize] = *mass;
    }
    for axis in lattice.axes() {
        // On one cell there is nowhere to go.
        if lattice.cells[axis] > 1 {
            let line = Line::of(lattice, axis, 1);
            let band = band(line, bandwidths[axis] / lattice.edge[axis], is_squared);
            smooth(&mut field, axis, &band, width);
        }
    }
    field.values.truncate(lattice.n_cells());
    field.values
}

pub(super) fn band(line: Line, own: f64, is_squared: bool) -> Band {
    let integral = Integral::new();
    if !is_squared {
        return Band::gaussian(line, integral, (own, own));
    }
    let reach = (REACH * own).ceil() as usize + 1;
    Band::of((line, reach), false, &|line: Line, cell: usize, taps: &mut Taps| {
        line.gaussian(integral, cell, (own, own), taps);
        taps.values.iter_mut().for_each(|tap| *tap *= *tap);
    })
}
