//! Kernels along directions: the parts of the iteration that differ from those of kernels along the axes of the lattice.
//!
//! Owns their bounds, their sums, and curvatures along directions from those along axes. May use ellipses, patches and ladders.
//! It deliberately follows the same formulas: those of a cell are on the axes of its kernel.

use super::super::parallel;
use super::adaptive::{PORTION, Search, add_ratio, behind_walls, mirrored};
use super::bands::{Band, smooth};
use super::ellipse::Ellipse;
use super::held::{Held, Wall};
use super::kinds::Cell;
use super::ladder::blended;
use super::lattice::{AXES, End, Field, Lattice, Window};
use super::levels::{coarse, refine};
use super::local::{Basis, bound};
use super::patch::{fold, inside, scatter};
use super::smoothed::Smoothed;
use super::taps::{CURVATURE_REACH, REACH, Taps};
use crate::maths::vector::{exp, ln, pow};

/// Cells that differences take to each side; those of order six, first and second.
const DIFFERENCES: usize = 3;
const FIRST: [f64; 7] = [-1.0 / 60.0, 0.15, -0.75, 0.0, 0.75, -0.15, 1.0 / 60.0];
const SECOND: [f64; 7] = [1.0 / 90.0, -0.15, 1.5, -49.0 / 18.0, 1.5, -0.15, 1.0 / 90.0];

/// Cells of which a bandwidth of curvatures has at least so many.
const LEAST: f64 = 0.8;

/// Cells of its level that a kernel for curvatures has within its standard deviation, at least.
const RESOLVED: f64 = 2.0;

/// Averages of products with the narrower and the wider of two supports, by rows of the lower triangle, and where between them.
type Between = ([[f64; 6]; 2], f64);

/// The kernel of a cell, of one kind.
type Kind<'k> = &'k (dyn Fn(&Cell) -> Ellipse + Sync);

impl Search<'_> {
    /// Axes of all kernels, and bandwidths for a start: as many cells along each.
    pub(super) fn turn(&mut self, bases: &[(Basis, bool)]) {
        let mut cells = std::mem::take(&mut self.cells);
        for (cell, (basis, is_stagnant)) in cells.iter_mut().zip(bases) {
            (cell.axes, cell.is_stagnant) = (*basis, *is_stagnant);
            let h = cell.h;
            let size = |axis: &[f64; AXES]| axis.iter().map(|part| part * part).sum::<f64>().sqrt();
            let all: f64 = self.lattice.axes().map(|k| size(&basis[k])).product();
            let mean = pow(all, 1.0 / self.d);
            let wanted = basis.map(|axis| if *is_stagnant { h } else { h * mean / size(&axis) });
            self.limit_along(cell, wanted);
        }
        self.cells = cells;
    }

    /// Bandwidths along the axes of a kernel within their bounds, and what follows from them.
    pub(super) fn limit_along(&self, cell: &mut Cell, h: [f64; AXES]) {
        let bounds = self.bounds_along(cell, |i| self.limits.kernel[i]);
        let (mut product, mut own) = (1.0, [1.0; AXES]);
        for k in self.lattice.axes() {
            own[k] = h[k].min(bounds[k][1]).max(bounds[k][0]);
            product *= own[k];
        }
        cell.h = pow(product, 1.0 / self.d);
        cell.s = [1.0; AXES];
        self.lattice.axes().filter(|_| !cell.is_stagnant).for_each(|k| cell.s[k] = own[k] / cell.h);
    }

    /// Lower and upper bounds along the axes of a kernel; of one that is round the same.
    fn bounds_along(&self, cell: &Cell, of: impl Fn(usize) -> [f64; 2]) -> [[f64; 2]; AXES] {
        let used = self.lattice.axes();
        let own = |k: usize| [0, 1].map(|side| bound(cell.axes[k], |i| of(i)[side], used.clone()));
        let mut bounds = [[0.0, f64::INFINITY]; AXES];
        used.clone().for_each(|k| bounds[k] = own(k));
        if cell.is_stagnant {
            let of_all = bounds[used]
                .iter()
                .fold([0.0_f64, f64::INFINITY], |all, own| [all[0].max(own[0]), all[1].min(own[1])]);
            bounds = [of_all; AXES];
        }
        bounds
    }

    /// Bandwidths of curvatures along the axes of a kernel: its own ones, all by the same factor.
    ///
    /// - Equation: `g_k = α N_v^β h s_k`
    /// - Symbols: as for those along axes of the lattice, of which this is the one of a round kernel.
    /// - Range: within bounds.
    /// - Source: methods, (4.3), where lengths are counted in bandwidths: there every cloud is round. All second derivatives
    ///   are then of one kernel, and those along any axes follow from those along others.
    /// - Shape: one per axis of the kernel.
    pub(super) fn choose_curvature_along(&self, cell: &mut Cell, common: f64) {
        let wanted = cell.s.map(|s| exp(common + ln(s)));
        let bounds = self.bounds_along(cell, |i| {
            let [_, high] = self.limits.curvature_along[i];
            [LEAST * self.lattice.edge[i], high]
        });
        cell.g = [0.0; AXES];
        self.lattice.axes().for_each(|k| cell.g[k] = wanted[k].min(bounds[k][1]).max(bounds[k][0]));
    }

    fn kernel(&self, cell: &Cell) -> Ellipse {
        let widths = cell.s.map(|s| cell.h * s);
        Ellipse::new(self.lattice.d, (&cell.axes, widths, self.lattice.edge), false)
    }

    /// The kernel for curvatures on a lattice of perhaps coarser cells.
    fn curvature(&self, cell: &Cell, lattice: &Lattice) -> Ellipse {
        Ellipse::new(lattice.d, (&cell.axes, cell.g, lattice.edge), true)
    }

    /// Cells that kernels reach along each axis of the lattice.
    pub(super) fn reach_along(&self) -> [usize; AXES] {
        let mut most = [0; AXES];
        for ellipse in self.cells.iter().map(|cell| self.kernel(cell)) {
            (0..AXES).for_each(|axis| most[axis] = most[axis].max(ellipse.reach[axis].unsigned_abs()));
        }
        most
    }

    /// `ρ = Σ_b c_b W_b/V_c` on a window, or `Σ_b c_b W_b²/V_c²`.
    pub(super) fn density_along(
        &self,
        (counts, per_mass): (&[f64], f64),
        window: &Window,
        is_squared: bool,
    ) -> Field {
        let volume = self.lattice.volume();
        let volume = if is_squared { volume * volume } else { volume };
        let mut field = Field::zeros(window, [1; AXES]);
        let most = self.cells.iter().map(|cell| size(self.lattice, REACH * cell.h)).fold(0.0, f64::max);
        scatter((self.cells.len(), most as usize), &mut field, self.width, &|idx, patch| {
            let cell = &self.cells[idx];
            let place = (inside(cell.at), &self.kernel(cell));
            patch.fill(self.lattice, place, counts[idx] / volume, (is_squared, false), self.width);
        });
        // What walls hold does not scatter.
        if let Some(held) = self.held.as_ref().filter(|_| !is_squared) {
            let kernel: Kind = &|cell| self.kernel(cell);
            self.add_held_along((held, per_mass), (kernel, self.reach_along(), most), &mut field);
        }
        field
    }

    /// Adds what walls hold, as kernels along axes do.
    fn add_held_along(
        &self,
        (held, per_mass): (&Held, f64),
        (kernel, reach, most): (Kind, [usize; AXES], f64),
        field: &mut Field,
    ) {
        let lattice = self.lattice;
        let mirrored = mirrored(lattice);
        let window = Window { first: [0; AXES], end: lattice.cells };
        for &wall in &held.walls {
            let Wall { axis, side, .. } = wall;
            let spread = |lattice: &Lattice, depth: usize, is_behind: bool| {
                let sources = held.before(lattice, wall, depth);
                let mut field = Field::zeros(&window, [1; AXES]);
                scatter((sources.len(), most as usize), &mut field, self.width, &|idx, patch| {
                    let (at, owner) = sources[idx];
                    let (mut at, mut ellipse) = (inside(at), kernel(&self.cells[owner]));
                    if is_behind {
                        at[axis] =
                            if side == 0 { 0 } else { 2 * lattice.cells[axis] as isize } - 1 - at[axis];
                        ellipse = ellipse.turned_over(axis);
                    }
                    patch.fill(lattice, (at, &ellipse), 1.0, (false, is_behind), self.width);
                });
                field
            };
            let (behind, all) =
                (spread(lattice, reach[axis], true), spread(&mirrored, 2 * reach[axis], false));
            add_ratio(field, (&behind, &all), 2.0 * wall.value * per_mass);
        }
    }

    /// A difference of a field along an axis; behind a wall is twice what it holds, less what is before it.
    fn differ(&self, field: &mut Field, axis: usize, taps: &[f64; 7]) {
        smooth(field, axis, &difference(self.lattice, axis, taps), self.width);
        let n = self.lattice.cells[axis];
        for wall in self.held.iter().flat_map(|held| &held.walls).filter(|wall| wall.axis == axis) {
            for depth in 0..DIFFERENCES.min(n) {
                let (cell, behind) = match wall.side {
                    0 => (depth, &taps[..DIFFERENCES - depth]),
                    _ => (n - 1 - depth, &taps[DIFFERENCES + 1 + depth..]),
                };
                let more = 2.0 * wall.value * self.per_mass * behind.iter().sum::<f64>();
                let inner: usize = field.cells[axis + 1..].iter().product();
                let n_rows: usize = field.cells[..axis].iter().product();
                let rows = field.values.chunks_mut(inner).skip(cell).step_by(n);
                rows.take(n_rows).flatten().for_each(|value| *value += more);
            }
        }
    }

    /// Adds kernels for curvatures to a field of a level.
    fn scatter_on(&self, level: u32, sources: &[usize], field: &mut Field) {
        let (own, factors) = coarse(self.lattice, level);
        let ellipse = |cell: &Cell| {
            let place = |axis: usize| (cell.at[axis] as f64 + 0.5) / factors[axis] as f64;
            let offset = |axis: usize| place(axis) - (cell.at[axis] / factors[axis]) as f64 - 0.5;
            self.curvature(cell, &own).beside(std::array::from_fn(offset))
        };
        let product = |cell: &Cell| own.axes().map(|axis| cell.g[axis]).product::<f64>();
        let widest = sources.iter().map(|&idx| product(&self.cells[idx])).fold(0.0, f64::max);
        let most = size(&own, CURVATURE_REACH * pow(widest, 1.0 / self.d));
        scatter((sources.len(), most as usize), field, self.width, &|at, patch| {
            let (cell, count) = (&self.cells[sources[at]], self.counts[sources[at]]);
            let place = inside(std::array::from_fn(|axis| cell.at[axis] / factors[axis]));
            patch.fill(&own, (place, &ellipse(cell)), count / own.volume(), (false, false), self.width);
        });
    }

    /// All second derivatives of a density with wider kernels, by rows of the lower triangle.
    ///
    /// - Equation: `H_ij = D_i D_j Σ_b c_b W_b/V_c`, with `D_i D_i` the second difference.
    /// - Symbols: `W_b` with the bandwidths of curvatures, `D` differences of seven cells.
    /// - Range: bandwidths of at least 0.8 cells, of which differences see derivatives to some per cent.
    /// - Source: derivatives of a sum of kernels are the sum of theirs; sums over all cells are 0 and sums of squares those of
    ///   integrals, as (A.3) and (A.4) of the methods want them. Wide kernels are put on coarse cells, between which the field
    ///   is a polynomial, if short cuts are taken.
    /// - Shape: one field each.
    fn curvatures_along(&self) -> (Window, Vec<Field>) {
        let lattice = self.lattice;
        let (mut levels, mut reach) = (vec![0; self.cells.len()], [0; AXES]);
        for (level, cell) in levels.iter_mut().zip(&self.cells) {
            let ellipse = self.curvature(cell, lattice);
            (0..AXES).for_each(|axis| reach[axis] = reach[axis].max(ellipse.reach[axis].unsigned_abs()));
            // What walls hold is put on the finest.
            let is_coarse = self.adaptive.is_fast && self.held.is_none();
            while is_coarse && f64::from(2 << *level) * RESOLVED <= ellipse.narrowest() {
                *level += 1;
            }
        }
        let highest = levels.iter().copied().max().unwrap_or(0);
        let more = reach.map(|reach| reach + DIFFERENCES);
        let mut window = Window::around(lattice, self.cells.iter().map(|cell| cell.at), more);
        if self.held.is_some() {
            window = Window { first: [0; AXES], end: lattice.cells };
        }
        let mut field = Field::zeros(&window, coarse(lattice, highest).1);
        for level in (0..=highest).rev() {
            let sources: Vec<usize> = (0..levels.len()).filter(|&idx| levels[idx] == level).collect();
            self.scatter_on(level, &sources, &mut field);
            if level > 0 {
                let mut below = Field::zeros(&window, coarse(lattice, level - 1).1);
                refine(lattice, &window, (field, level), &mut below);
                field = below;
            }
        }
        if let Some(held) = &self.held {
            let most = self.cells.iter().map(|cell| size(lattice, CURVATURE_REACH * cell.g[AXES - 1]));
            let kernel: Kind = &|cell| self.curvature(cell, lattice);
            self.add_held_along((held, self.per_mass), (kernel, reach, most.fold(0.0, f64::max)), &mut field);
        }
        let of = |(i, j): (usize, usize)| {
            let mut own = field.clone();
            if i == j {
                self.differ(&mut own, i, &SECOND);
            } else {
                self.differ(&mut own, i, &FIRST);
                // A wall holds the same all along it.
                smooth(&mut own, j, &difference(lattice, j, &FIRST), self.width);
            }
            let per = 1.0 / (lattice.edge[i] * lattice.edge[j]);
            own.values.iter_mut().for_each(|value| *value *= per);
            own
        };
        (window, pairs(lattice.d).map(of).collect())
    }

    /// Locally averaged products of curvatures along the axes of the kernel of each cell.
    ///
    /// - Equation: `ψ_kl = Σ_PQ e_kP e_lQ ⟨H_P H_Q⟩`, `e_kP = e_ki e_kj`, twice that for i ≠ j.
    /// - Symbols: `H_P` second derivatives of the density, `P = (i, j)`; `e_k` axes of the kernel whose cell it is; `⟨⟩` average
    ///   over its support.
    /// - Range: what lies between two supports is taken of ψ, not of averages, which cancel.
    /// - Source: methods, (3.2), section 3.4.
    /// - Shape: by rows of the lower triangle.
    pub(super) fn average_along(&mut self) {
        let (window, fields) = self.curvatures_along();
        let range = self.widths();
        let (places, is_fast): (Vec<(usize, usize)>, bool) =
            (pairs(self.lattice.d).collect(), self.adaptive.is_fast);
        let mut found: Vec<Between> = vec![Default::default(); self.cells.len()];
        for p in 0..fields.len() {
            for q in 0..=p {
                let mut product = fields[p].clone();
                product.values.iter_mut().zip(&fields[q].values).for_each(|(own, other)| *own *= other);
                let lattice = behind_mirrors(self.lattice, places[p], places[q]);
                let tools = (&lattice, self.integral, self.width);
                let product = Smoothed::new(tools, (is_fast, &window), product, range);
                let mut portions: Vec<(&[Cell], &mut [Between])> =
                    self.cells.chunks(PORTION).zip(found.chunks_mut(PORTION)).collect();
                parallel::for_each(&mut portions, &|_, (cells, found)| {
                    let mut taps = Default::default();
                    for (cell, (sums, part)) in cells.iter().zip(found.iter_mut()) {
                        let averages;
                        (averages, *part) = product.between(tools, cell, &mut taps);
                        let shares = shares(&cell.axes, (places[p], places[q]), p == q, &places);
                        for (sums, average) in sums.iter_mut().zip(averages) {
                            sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share * average);
                        }
                    }
                });
            }
        }
        for (cell, ([narrow, wide], part)) in self.cells.iter_mut().zip(found) {
            cell.psi = std::array::from_fn(|place| blended(narrow[place], wide[place], part));
        }
    }
}

/// The lattice as a product of second derivatives sees it: a mirror changes its sign if it has an odd number of derivatives along
/// that axis.
fn behind_mirrors(lattice: &Lattice, (i, j): (usize, usize), (k, l): (usize, usize)) -> Lattice {
    let mut own = behind_walls(lattice);
    for axis in lattice.axes() {
        let is_odd = [i, j, k, l].iter().filter(|other| **other == axis).count() % 2 == 1;
        for end in own.ends[axis].iter_mut().filter(|end| is_odd && **end == End::Mirror) {
            *end = End::Sink;
        }
    }
    own
}

/// About how many cells a kernel has that reaches so far, on the mean.
fn size(lattice: &Lattice, reach: f64) -> f64 {
    lattice.axes().map(|axis| 2.0 * reach / lattice.edge[axis] + 4.0).product()
}

/// Places of second derivatives: rows of the lower triangle.
fn pairs(d: usize) -> impl Iterator<Item = (usize, usize)> {
    let first = AXES - d;
    (first..AXES).flat_map(move |i| (first..=i).map(move |j| (i, j)))
}

/// A difference along an axis; beyond ends is what these make of the field.
fn difference(lattice: &Lattice, axis: usize, taps: &[f64]) -> Band {
    let (n, ends) = (lattice.cells[axis], lattice.ends[axis]);
    let near = |cell: usize| {
        let mut own = Taps { first: 0, values: vec![0.0; n] };
        for (tap, at) in taps.iter().zip(cell as isize - DIFFERENCES as isize..) {
            let (other, sign, _) = fold(n, ends, at);
            own.values[other] += sign * tap;
        }
        own
    };
    let n_ends = if n > DIFFERENCES { 0 } else { n };
    let of_ends = [0, 1].map(|end| (0..n_ends).map(|k| near(if end == 0 { k } else { n - 1 - k })).collect());
    Band { taps: taps.to_vec(), reach: DIFFERENCES, ends: of_ends, n, sides: ends }
}

/// What an average of two second derivatives is to products of curvatures along the axes of a kernel.
fn shares(
    axes: &Basis,
    (p, q): ((usize, usize), (usize, usize)),
    is_same: bool,
    places: &[(usize, usize)],
) -> [f64; 6] {
    let of = |k: usize, (i, j): (usize, usize)| axes[k][i] * axes[k][j] * if i == j { 1.0 } else { 2.0 };
    let mut shares = [0.0; 6];
    for (share, &(k, l)) in shares.iter_mut().zip(places) {
        *share = of(k, p) * of(l, q) + if is_same { 0.0 } else { of(k, q) * of(l, p) };
    }
    shares
}
