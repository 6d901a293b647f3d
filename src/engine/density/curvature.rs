//! Second derivatives of a density, by kernels of their own.
//!
//! Owns these fields. May use stencils. It deliberately chooses no bandwidth.

use super::bands::{Band, smooth};
use super::classes::{Fill, Table};
use super::held::{Held, Wall, turned_over};
use super::kinds::{Cell, Variant};
use super::lattice::{AXES, Field, Lattice, Window};
use super::stencil::{Lent, scatter};
use super::taps::{CURVATURE_REACH, Curvature, Integral, Line, Smooth, Taps};
use crate::maths::vector::{ln, pow};
use crate::maths::wide::Width;

/// Bandwidths of a cascade: a factor of √2 apart.
const STEP: f64 = 2.0;

/// Bandwidths over the smallest edge of a cell, from which on there may be cascades.
const NARROWEST: [f64; 6] = [2.0, 2.83, 4.0, 5.66, 8.0, f64::INFINITY];

/// An addition of a short row costs so much of one of a long one.
const SHORT: f64 = 4.0;

/// Of the variance of a Gaussian, what is left when it is cut off at three standard deviations.
const CUT: f64 = 0.973_337_0;

/// Curvatures along each axis that is used, on the fine cells of a window.
pub struct Curvatures {
    pub window: Window,
    pub fields: Vec<Field>,
}

/// `κ_i = Σ_b c_b V_i/(V_c Δ_i²)`.
///
/// - Equation: as above, of all cells with particles; m^{−d−2}.
/// - Symbols: `c_b` counts, `V_i` the second derivative along axis i, `V_c` volume of a cell.
/// - Range: any bandwidths; fast ones take each for a mean of two of a cascade, with its variance.
/// - Source: methods, section 4.3, step 5; section 4.8.
/// - Shape: one field per axis.
pub fn curvatures(
    tools: (&Lattice, Integral, Width),
    (variant, is_fast): (Variant, bool),
    (cells, counts): (&[Cell], &[f64]),
    held: Option<(&Held, f64)>,
) -> Curvatures {
    let (lattice, integral, width) = tools;
    let first = AXES - lattice.d;
    let most = cells.iter().flat_map(|cell| &cell.g[first..]).fold(0.0_f64, |most, &g| most.max(g));
    let more = lattice.edge.map(|edge| (CURVATURE_REACH * most / edge).ceil() as usize + 1);
    let mut window = Window::around(lattice, cells.iter().map(|cell| cell.at), more);
    if held.is_some() {
        window = Window { first: [0; AXES], end: lattice.cells };
    }
    // What walls hold is found with the same kernels, one by one, as it cancels most of what is mirrored.
    let narrowest =
        if is_fast && held.is_none() { narrowest(lattice, cells, &window) } else { f64::INFINITY };
    let is_narrow = |cell: &Cell| cell.g[first..].iter().any(|&g| g < narrowest);
    let (narrow, wide): (Vec<usize>, Vec<usize>) = (0..cells.len()).partition(|&idx| is_narrow(&cells[idx]));
    let of_wide = |along| {
        let none = || Field::zeros(&window, [1; AXES]);
        if wide.is_empty() {
            none()
        } else {
            cascade(tools, (variant, &window), along, (cells, &wide), counts)
        }
    };
    let mut fields: Vec<Field> = lattice.axes().map(of_wide).collect();
    let narrow_cells = || narrow.iter().map(|&idx| &cells[idx]);
    let kernels = Kernels::new((lattice, integral), (variant, is_fast), narrow_cells);
    scatter((narrow.len(), width), &mut fields, &|at, spread| {
        let idx = narrow[at];
        *spread.weight = counts[idx] / lattice.volume();
        for along in first..AXES {
            kernels.lend(&cells[idx], along, &mut spread.taps[along - first]);
        }
    });
    for (held, wall) in held.iter().flat_map(|held| held.0.walls.iter().map(move |wall| (held, wall))) {
        let sources = held.0.before(lattice, *wall, more[wall.axis]);
        scatter((sources.len(), width), &mut fields, &|idx, spread| {
            let (at, owner) = sources[idx];
            *spread.weight = 2.0 * wall.value * held.1;
            for along in first..AXES {
                kernels.turn_over(&cells[owner], along, (at, wall), &mut spread.taps[along - first]);
            }
        });
    }
    Curvatures { window, fields }
}

/// From which bandwidth on, m, a cascade is cheaper than kernels one by one, by numbers of additions.
fn narrowest(lattice: &Lattice, cells: &[Cell], window: &Window) -> f64 {
    let smallest = lattice.smallest();
    let n_window: f64 = (0..AXES).map(|axis| (window.end[axis] - window.first[axis]) as f64).product();
    let stencil =
        |g: f64| lattice.axes().map(move |axis| 2.0 * CURVATURE_REACH * g / lattice.edge[axis] + 1.0);
    let bandwidths = |cell: &Cell| cell.g.into_iter().skip(AXES - lattice.d);
    let most = cells.iter().flat_map(bandwidths).fold(0.0, f64::max);
    let cost = |bound: f64| {
        let is_narrow = |cell: &&Cell| bandwidths(cell).any(|g| g < bound);
        let direct = |cell: &Cell| bandwidths(cell).map(|g| stencil(g).product::<f64>()).sum::<f64>();
        let narrow: f64 = cells.iter().filter(is_narrow).map(direct).sum();
        if bound > most {
            return SHORT * narrow;
        }
        // Each step smooths by two thirds of what it reaches, within three standard deviations of four.
        let n_steps = (STEP * ln(most / bound) / std::f64::consts::LN_2).ceil();
        let taps: f64 =
            stencil(bound).sum::<f64>() + 0.5 * n_steps * stencil(0.5 * (bound + most)).sum::<f64>();
        SHORT * narrow + lattice.d as f64 * n_window * taps
    };
    let bounds = NARROWEST.map(|bound| bound * smallest);
    let costs = bounds.map(cost);
    let best = (0..bounds.len()).fold(0, |best, at| if costs[at] < costs[best] { at } else { best });
    bounds[best]
}

/// Second derivatives as products of taps, one by one.
struct Kernels<'a> {
    lattice: &'a Lattice,
    integral: Integral,
    variant: Variant,
    /// By axis of the derivative, and by axis; none if every bandwidth is worked out.
    tables: [[Option<Table>; AXES]; AXES],
}

impl<'a> Kernels<'a> {
    fn new<'c, I: Iterator<Item = &'c Cell>>(
        (lattice, integral): (&'a Lattice, Integral),
        (variant, is_fast): (Variant, bool),
        cells: impl Fn() -> I,
    ) -> Self {
        let mut kernels = Self { lattice, integral, variant, tables: Default::default() };
        for along in lattice.axes().filter(|_| is_fast) {
            let classes = || cells().map(|cell| cell.g_class[along]);
            let Some(range) = classes().min().zip(classes().max()) else { continue };
            for axis in lattice.axes() {
                let shape = (lattice.cells[axis], lattice.edge[axis] / lattice.smallest());
                let table = Table::new(range, shape, CURVATURE_REACH, &|line, own, b, taps| {
                    kernels.work_out((along, axis), (line, own), b, taps);
                });
                kernels.tables[along][axis] = Some(table);
            }
        }
        kernels
    }

    fn work_out(&self, (along, axis): (usize, usize), (line, own): (Line, f64), b: usize, taps: &mut Taps) {
        let edge = self.lattice.edge[axis];
        let factors = Factors::new((self.lattice, self.integral), self.variant, own * edge, along);
        factors.fill(line, (axis, edge), b, taps);
    }

    /// The derivative along an axis of the kernel of a cell.
    fn lend<'t>(&'t self, cell: &Cell, along: usize, taps: &mut [Lent<'t>; AXES]) {
        let lattice = self.lattice;
        taps[..AXES - lattice.d].iter_mut().for_each(|lent| lent.be_one());
        for axis in lattice.axes() {
            let line = Line::of(lattice, axis, 1);
            let (own, b) = (cell.g[along] / lattice.edge[axis], cell.at[axis]);
            let fill: Fill = &|line, own, b, taps| self.work_out((along, axis), (line, own), b, taps);
            match &self.tables[along][axis] {
                Some(table) => table.lend(line, cell.g_class[along], b, &mut taps[axis], fill),
                None => fill(line, own, b, &mut taps[axis].own),
            }
        }
    }
}

impl Kernels<'_> {
    /// The same of a cell behind a wall.
    fn turn_over(
        &self,
        cell: &Cell,
        along: usize,
        (at, wall): ([usize; AXES], &Wall),
        taps: &mut [Lent; AXES],
    ) {
        let lattice = self.lattice;
        taps[..AXES - lattice.d].iter_mut().for_each(|lent| lent.be_one());
        for axis in lattice.axes() {
            let place = (at[axis], (axis == wall.axis).then_some(wall.side));
            let fill: Fill = &|line, own, b, taps| self.work_out((along, axis), (line, own), b, taps);
            let own = cell.g[along] / lattice.edge[axis];
            turned_over(Line::of(lattice, axis, 1), own, place, fill, &mut taps[axis].own);
        }
    }
}

/// One of them: counts of wide kernels are smoothed to those of narrower ones, step by step, and all together by the narrowest.
fn cascade(
    (lattice, integral, width): (&Lattice, Integral, Width),
    (variant, window): (Variant, &Window),
    along: usize,
    (cells, wide): (&[Cell], &[usize]),
    counts: &[f64],
) -> Field {
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for cell in wide.iter().map(|&idx| &cells[idx]) {
        (least, most) = (least.min(cell.g[along]), most.max(cell.g[along]));
    }
    let ratio = pow(2.0, 1.0 / STEP);
    let n_steps = (STEP * ln(most / least) / std::f64::consts::LN_2).ceil().max(0.0) as usize;
    let bandwidths: Vec<f64> = (0..=n_steps).map(|k| least * pow(ratio, k as f64)).collect();
    // By step, the cells that have a part of it.
    let mut parts: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n_steps + 1];
    for (cell, count) in wide.iter().map(|&idx| (&cells[idx], counts[idx])) {
        let g = cell.g[along];
        let low = bandwidths.partition_point(|own| *own <= g).clamp(1, n_steps.max(1)) - 1;
        let high = (low + 1).min(n_steps);
        let square = |k: usize| bandwidths[k] * bandwidths[k];
        let gap = square(high) - square(low);
        let t = if gap > 0.0 { ((g * g - square(low)) / gap).clamp(0.0, 1.0) } else { 0.0 };
        let [x, y, z] = cell.at;
        let at = ((x - window.first[0]) * (window.end[1] - window.first[1]) + y - window.first[1])
            * (window.end[2] - window.first[2])
            + z
            - window.first[2];
        parts[low].push((at, (1.0 - t) * count));
        parts[high].push((at, t * count));
    }
    let mut field = Field::zeros(window, [1; AXES]);
    for step in (0..=n_steps).rev() {
        parts[step].iter().for_each(|&(at, count)| field.values[at] += count / lattice.volume());
        if step == 0 {
            break;
        }
        let square = bandwidths[step] * bandwidths[step] - bandwidths[step - 1] * bandwidths[step - 1];
        for axis in lattice.axes() {
            let line = Line::of(lattice, axis, 1);
            // A Gaussian integrated over cells is wider by a twelfth.
            let own = square / (lattice.edge[axis] * lattice.edge[axis]);
            let deviation = ((own - 1.0 / 12.0).max(0.5 * own) / CUT).sqrt();
            smooth(&mut field, axis, &Band::gaussian(line, integral, (deviation, deviation)), width);
        }
    }
    let bare = Factors::new((lattice, integral), variant, least, along);
    for axis in lattice.axes() {
        smooth(&mut field, axis, &bare.band(lattice, axis), width);
    }
    field
}

/// A second derivative as a product along axes.
struct Factors {
    along: usize,
    g: f64,
    curvature: Curvature,
    per: f64,
    integral: Integral,
}

impl Factors {
    fn new((lattice, integral): (&Lattice, Integral), variant: Variant, g: f64, along: usize) -> Self {
        let own = |axis: usize| g / lattice.edge[axis];
        let mut others = [0.0; AXES];
        let mut n_others = 0;
        for axis in lattice.axes().filter(|&axis| axis != along) {
            others[n_others] = own(axis);
            n_others += 1;
        }
        let curvature = Curvature::along(own(along));
        // Of kernels that are wider than an axis is long no sum says anything.
        let is_short = lattice.axes().any(|axis| own(axis) > 2.0 * lattice.cells[axis] as f64);
        let curvature = match variant {
            _ if is_short => curvature,
            Variant::Corrected => curvature.corrected(integral, lattice.d, &others[..n_others]),
            Variant::Released => {
                curvature.scaled((AXES - lattice.d..along).map(|axis| 1.0 / own(axis).sqrt()).product())
            }
        };
        Self { along, g, curvature, per: 1.0 / (lattice.edge[along] * lattice.edge[along]), integral }
    }

    /// What the cells along an axis have of a kernel in cell `b`.
    fn fill(&self, line: Line, (axis, edge): (usize, f64), b: usize, taps: &mut Taps) {
        let g = self.g / edge;
        let reach = (CURVATURE_REACH * g).ceil() + 0.5;
        if line.is_short_for(g) {
            let even = if axis == self.along { 0.0 } else { 1.0 / line.n as f64 };
            return line.fill_evenly(even, taps);
        }
        if axis == self.along {
            return line.sample(b, reach, &|z| self.per * self.curvature.at(z), taps);
        }
        let smooth = Smooth::new(self.integral, g);
        line.sample(b, reach, &|z| smooth.at(z), taps);
    }

    /// All of them; kernels are even, so that what a cell gives is what it takes.
    fn band(&self, lattice: &Lattice, axis: usize) -> Band {
        let edge = lattice.edge[axis];
        let line = Line::of(lattice, axis, 1);
        let reach = (CURVATURE_REACH * self.g / edge).ceil() as usize + 1;
        Band::of((line, reach), true, &|line, b, taps| self.fill(line, (axis, edge), b, taps))
    }
}
