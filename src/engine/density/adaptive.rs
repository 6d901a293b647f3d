//! Kernels that differ from cell to cell in size and shape, found by iteration.
//!
//! Owns the iteration and its end. May use pyramids, curvatures and limits. It deliberately computes bandwidths only where
//! particles are.

use super::super::parallel;
use super::classes::{Fill, Table, bandwidth_of, class_of};
use super::curvature::{Curvatures, curvatures};
use super::frame::Frame;
use super::global::histogram;
use super::held::{Held, turned_over};
use super::kinds::{Adaptive, Cell, Estimate, Start};
use super::lattice::{AXES, End, Field, Lattice, Window};
use super::limits::{GROWTH, Limits};
use super::local::Basis;
use super::smoothed::Smoothed;
use super::stencil::scatter;
use super::tally::{Tally, Weighing};
use super::taps::{Integral, Line, REACH, Taps};
use crate::maths::vector::{ln, pow};
use crate::maths::wide::Width;
use std::f64::consts::PI;

/// Cells that a thread takes at once.
pub(super) const PORTION: usize = 64;

/// Of the largest density, what one is at least where particles are.
const LEAST: f64 = 1e-9;

/// From this loop on the running mean of the error may end the iteration.
const RUNNING: usize = 8;

pub(super) struct Search<'a> {
    pub(super) lattice: &'a Lattice,
    pub(super) adaptive: &'a Adaptive,
    /// Whether kernels have axes of their own.
    pub(super) is_oriented: bool,
    pub(super) limits: Limits,
    pub(super) integral: Integral,
    pub(super) width: Width,
    pub(super) counts: Vec<f64>,
    pub(super) cells: Vec<Cell>,
    /// The density with their kernels.
    pub(super) rho: (Window, Field),
    /// Walls that hold a value, and counts per mass, as values are of mass.
    pub(super) held: Option<Held>,
    pub(super) per_mass: f64,
    pub(super) d: f64,
    pub(super) constants: Constants,
}

/// Logarithms of what hangs on nothing but the number of axes.
pub(super) struct Constants {
    pub(super) support: f64,
    pub(super) curvature: f64,
}

impl Constants {
    fn new(d: f64) -> Self {
        Self {
            support: 0.25 * ln((d + 2.0) * pow(8.0 * PI, 0.5 * d) / 4.0),
            curvature: ln((1.0 + pow(2.0, 0.5 * d + 2.0)) / (3.0 * pow(2.0, 4.0 / (d + 4.0)))) / (d + 6.0)
                + ln(d + 2.0) / (d + 4.0)
                - ln(d + 4.0) / (d + 6.0),
        }
    }
}

/// The density of particles that are counted on a lattice.
pub fn estimate(lattice: &Lattice, tally: &Tally, adaptive: &Adaptive, width: Width) -> Estimate {
    let frame = Frame::new(lattice, tally, adaptive.takes_cells());
    if frame.is_point() {
        let (density, standard_error) = histogram(lattice, tally);
        return Estimate { density, standard_error, cells: Vec::new(), history: vec![0.0], is_settled: true };
    }
    let (own_lattice, own_tally) = frame.reduced.as_ref().map_or((lattice, tally), |(own, of)| (own, of));
    let start = match adaptive.start {
        Start::Bandwidth(h) => Start::Bandwidth(h / frame.mean()),
        other => other,
    };
    let own = Adaptive { start, ..adaptive.clone() };
    let mut limits = Limits::new(own_lattice);
    if let Some(bounds) = adaptive.bounds {
        let axes = AXES - own_lattice.d..;
        for (limit, scale) in limits.kernel[axes].iter_mut().zip(&frame.scales) {
            *limit = bounds.map(|bound| (bound / scale).clamp(limit[0], limit[1]));
        }
    }
    // On a line there is one direction.
    let is_oriented = adaptive.is_oriented() && own_lattice.d > 1;
    let n_bases = if is_oriented { tally.cells.len() } else { 0 };
    let bases: Vec<(Basis, bool)> = (0..n_bases).map(|idx| adaptive.orientation.basis(idx, &frame)).collect();
    let found = solve((own_lattice, own_tally), (&own, limits), is_oriented.then_some(&bases), width);
    frame.restore(found, is_oriented)
}

fn solve(
    (lattice, tally): (&Lattice, &Tally),
    (adaptive, limits): (&Adaptive, Limits),
    bases: Option<&Vec<(Basis, bool)>>,
    width: Width,
) -> Estimate {
    let (counts, unit) = tally.pseudo_counts(adaptive.weighing);
    let mut search = Search {
        lattice,
        adaptive,
        is_oriented: bases.is_some(),
        limits,
        integral: Integral::new(),
        width,
        counts,
        cells: Vec::new(),
        rho: Default::default(),
        held: None,
        per_mass: 1.0,
        d: lattice.d as f64,
        constants: Constants::new(lattice.d as f64),
    };
    if search.counts.iter().any(|count| !(count.is_finite() && *count > 0.0)) {
        return Estimate::unknown(lattice);
    }
    search.begin(tally, bases);
    let mut history = vec![search.mean_bandwidth()];
    let mut ends = Ends::default();
    let mut is_settled = false;
    for _ in 0..if search.cells.is_empty() { 0 } else { adaptive.most_loops } {
        let old = search.cells.clone();
        search.go_on();
        history.push(search.mean_bandwidth());
        is_settled = ends.are_reached(&search, &old);
        if is_settled {
            break;
        }
    }
    search.finish(tally, unit, (history, is_settled))
}

impl Search<'_> {
    fn begin(&mut self, tally: &Tally, bases: Option<&Vec<(Basis, bool)>>) {
        let (lattice, d) = (self.lattice, self.d);
        let deviations = tally.deviations();
        let n: f64 = self.counts.iter().sum();
        let smallest = lattice.smallest();
        let mean: f64 = lattice.axes().map(|axis| deviations[axis].max(smallest)).product();
        let reference = pow(mean, 1.0 / d) * pow(4.0 / ((d + 2.0) * n), 1.0 / (d + 4.0));
        let h = match self.adaptive.start {
            Start::NormalReference => reference,
            Start::Times(factor) => factor * reference,
            Start::Bandwidth(h) => h,
        };
        let cell = |&idx: &u32| {
            let sigma = (2.0 * h).clamp(self.limits.support[0], self.limits.support[1]);
            let mut cell = Cell { at: lattice.cell(idx as usize), sigma, h, ..Cell::default() };
            if bases.is_none() {
                self.limit(&mut cell, [h; AXES]);
            }
            cell
        };
        self.cells = tally.cells.iter().map(cell).collect();
        let places: Vec<[usize; AXES]> = self.cells.iter().map(|cell| cell.at).collect();
        (self.held, self.per_mass) = (Held::new(lattice, &places), n / tally.mass());
        if let Some(bases) = bases {
            self.turn(bases);
        }
        if !self.cells.is_empty() {
            self.spread();
        }
    }

    fn mean_bandwidth(&self) -> f64 {
        self.cells.iter().map(|cell| cell.h).sum::<f64>() / self.cells.len().max(1) as f64
    }

    /// Bandwidths along axes within their bounds, and what follows from them.
    fn limit(&self, cell: &mut Cell, h: [f64; AXES]) {
        if self.is_oriented {
            return self.limit_along(cell, h);
        }
        let smallest = self.lattice.smallest();
        let mut product = 1.0;
        let mut own = [1.0; AXES];
        for axis in self.lattice.axes() {
            let [low, high] = self.limits.kernel[axis];
            own[axis] = h[axis].clamp(low, high);
            if self.adaptive.is_fast {
                cell.h_class[axis] = class_of(ln(own[axis] / smallest));
                own[axis] = smallest * bandwidth_of(cell.h_class[axis]);
            }
            product *= own[axis];
        }
        cell.h = pow(product, 1.0 / self.d);
        cell.s = [1.0; AXES];
        self.lattice.axes().for_each(|axis| cell.s[axis] = own[axis] / cell.h);
    }

    /// Work on all cells, in portions.
    fn for_all(&mut self, work: &(dyn Fn(&Self, &mut Cell, &mut [Taps; AXES]) + Sync)) {
        let mut cells = std::mem::take(&mut self.cells);
        let mut portions: Vec<&mut [Cell]> = cells.chunks_mut(PORTION).collect();
        parallel::for_each(&mut portions, &|_, portion| {
            let mut taps = Default::default();
            portion.iter_mut().for_each(|cell| work(self, cell, &mut taps));
        });
        self.cells = cells;
    }

    /// One loop.
    fn go_on(&mut self) {
        let tools = (self.lattice, self.integral, self.width);
        let (window, rho) = std::mem::take(&mut self.rho);
        let (least, most) = self.widths();
        // They may shrink as they like; what shrinks by more is seen by the next loop.
        let range = (self.limits.support[0].max(0.5 * least), GROWTH * most);
        let rho = Smoothed::new(tools, (self.adaptive.is_fast, &window), rho, range);
        self.for_all(&|search, cell, taps| {
            let n = rho.at(tools, cell, taps) + search.beyond(cell);
            search.widen(cell, n);
            cell.n = rho.at(tools, cell, taps) + search.beyond(cell);
            search.choose_curvature(cell);
        });
        drop(rho);
        if self.is_oriented {
            self.average_along();
        } else {
            self.average(tools);
        }
        self.for_all(&|search, cell, _| search.choose(cell));
        self.fill_smooth();
        self.spread();
    }

    /// Locally averaged products of curvatures along axes.
    fn average(&mut self, tools: (&Lattice, Integral, Width)) {
        let settings = (self.adaptive.variant, self.adaptive.is_fast);
        let held = self.held.as_ref().map(|held| (held, self.per_mass));
        let Curvatures { window, fields } = curvatures(tools, settings, (&self.cells, &self.counts), held);
        let range = self.widths();
        let lattice = behind_walls(self.lattice);
        let tools = (&lattice, self.integral, self.width);
        let mut place = 0;
        for i in 0..fields.len() {
            for j in 0..=i {
                let mut product = fields[i].clone();
                product.values.iter_mut().zip(&fields[j].values).for_each(|(own, other)| *own *= other);
                let product = Smoothed::new(tools, (self.adaptive.is_fast, &window), product, range);
                self.for_all(&|_, cell, taps| cell.psi[place] = product.at(tools, cell, taps));
                place += 1;
            }
        }
    }

    /// Supports: the narrowest and the widest, m.
    pub(super) fn widths(&self) -> (f64, f64) {
        let sigmas = || self.cells.iter().map(|cell| cell.sigma);
        (sigmas().fold(f64::INFINITY, f64::min), sigmas().fold(0.0, f64::max))
    }

    /// Fine cells that kernels reach.
    fn reach(&self) -> [usize; AXES] {
        if self.is_oriented {
            return self.reach_along();
        }
        let mut most = [0.0_f64; AXES];
        for cell in &self.cells {
            for axis in self.lattice.axes() {
                most[axis] = most[axis].max(cell.h * cell.s[axis] / self.lattice.edge[axis]);
            }
        }
        most.map(|own| (REACH * own).ceil() as usize + 1)
    }

    /// Where nothing is rough kernels are as wide as the widest, and all are brought within their bounds.
    fn fill_smooth(&mut self) {
        let widest = self.cells.iter().fold(0.0_f64, |widest, cell| widest.max(cell.h));
        let mut cells = std::mem::take(&mut self.cells);
        for cell in &mut cells {
            let h = match (cell.h > 0.0, widest > 0.0) {
                (true, _) => cell.h,
                (false, true) => widest,
                (false, false) => self.limits.support[1],
            };
            let wanted = cell.s.map(|s| h * s);
            self.limit(cell, wanted);
        }
        self.cells = cells;
    }

    /// The density with the kernels as they are.
    fn spread(&mut self) {
        let mut window = Window::around(self.lattice, self.cells.iter().map(|cell| cell.at), self.reach());
        if self.held.is_some() {
            window = Window { first: [0; AXES], end: self.lattice.cells };
        }
        let field = self.density_of((&self.counts, self.per_mass), &window, false);
        let most = field.values.iter().fold(0.0, |most: f64, value| most.max(*value));
        for cell in &mut self.cells {
            let [x, y, z] = cell.at;
            cell.rho = field.values[field.row(x, y) + z - field.first[2]];
            // Kernels that are turned may have more behind an end that changes signs than before it.
            if self.is_oriented {
                cell.rho = cell.rho.max(LEAST * most);
            }
        }
        self.rho = (window, field);
    }

    /// `ρ = Σ_b c_b W_b/V_c` on a window, or `Σ_b c_b W_b²/V_c²`.
    fn density_of(&self, (counts, per_mass): (&[f64], f64), window: &Window, is_squared: bool) -> Field {
        if self.is_oriented {
            return self.density_along((counts, per_mass), window, is_squared);
        }
        let lattice = self.lattice;
        let mut fields = [Field::zeros(window, [1; AXES])];
        let volume = lattice.volume();
        let fill: Fill = &|line, own, b, taps| {
            line.gaussian(self.integral, b, (own, own), taps);
            if is_squared {
                taps.values.iter_mut().for_each(|tap| *tap *= *tap);
            }
        };
        let tables: Vec<Option<Table>> = (0..AXES).map(|axis| self.table(axis, fill)).collect();
        scatter((self.cells.len(), self.width), &mut fields, &|idx, spread| {
            let cell = &self.cells[idx];
            spread.weight = counts[idx] / if is_squared { volume * volume } else { volume };
            for (axis, lent) in spread.taps[0].iter_mut().enumerate() {
                let line = Line::of(lattice, axis, 1);
                if axis + lattice.d < AXES {
                    lent.own.be_one();
                    continue;
                }
                let own = cell.h * cell.s[axis] / lattice.edge[axis];
                match &tables[axis] {
                    Some(table) => table.lend(line, cell.h_class[axis], cell.at[axis], lent, fill),
                    None => fill(line, own, cell.at[axis], &mut lent.own),
                }
            }
        });
        // What walls hold does not scatter.
        if let Some(held) = self.held.as_ref().filter(|_| !is_squared) {
            self.add_held((held, per_mass), fill, &mut fields[0]);
        }
        let [field] = fields;
        field
    }

    /// Adds what walls hold.
    ///
    /// - Equation: `2 ρ_w I/N`, `I` kernels of all cells that the wall has turned over, `N` those and the others.
    /// - Symbols: `ρ_w` density of the wall.
    /// - Range: N differs from one only where bandwidths differ from cell to cell.
    /// - Source: methods, section 4.7; at the wall I is half of N, and what is smoothed is zero: there is ρ_w.
    /// - Shape: falls from the wall on.
    fn add_held(&self, (held, per_mass): (&Held, f64), fill: Fill, field: &mut Field) {
        let (lattice, reach) = (self.lattice, self.reach());
        let mirrored = mirrored(lattice);
        let window = Window { first: [0; AXES], end: lattice.cells };
        for &wall in &held.walls {
            let spread = |lattice: &Lattice, depth: usize, is_behind: bool| {
                let sources = held.before(lattice, wall, depth);
                let mut fields = [Field::zeros(&window, [1; AXES])];
                scatter((sources.len(), self.width), &mut fields, &|idx, spread| {
                    let ((at, owner), line) = (sources[idx], |axis| Line::of(lattice, axis, 1));
                    let cell = &self.cells[owner];
                    spread.weight = 1.0;
                    spread.taps[0][..AXES - lattice.d].iter_mut().for_each(|lent| lent.own.be_one());
                    for axis in lattice.axes() {
                        let own = cell.h * cell.s[axis] / lattice.edge[axis];
                        let side = (is_behind && axis == wall.axis).then_some(wall.side);
                        turned_over(line(axis), own, (at[axis], side), fill, &mut spread.taps[0][axis].own);
                    }
                });
                let [field] = fields;
                field
            };
            let reach = reach[wall.axis];
            let (behind, all) = (spread(lattice, reach, true), spread(&mirrored, 2 * reach, false));
            add_ratio(field, (&behind, &all), 2.0 * wall.value * per_mass);
        }
    }

    /// What the support of a cell has of walls that hold a value.
    fn beyond(&self, cell: &Cell) -> f64 {
        let of = |held: &Held| held.beyond(self.lattice, self.integral, cell.at, cell.sigma);
        self.held.as_ref().map_or(0.0, |held| self.per_mass * of(held))
    }

    /// Kernels of all classes along an axis, if bandwidths are rounded.
    fn table(&self, axis: usize, fill: Fill) -> Option<Table> {
        let classes = || self.cells.iter().map(|cell| cell.h_class[axis]);
        let range = (classes().min()?, classes().max()?);
        let is_used = axis + self.lattice.d >= AXES && self.adaptive.is_fast;
        is_used.then(|| {
            Table::new(
                range,
                (self.lattice.cells[axis], self.lattice.edge[axis] / self.lattice.smallest()),
                REACH,
                fill,
            )
        })
    }

    fn finish(self, tally: &Tally, unit: f64, (history, is_settled): (Vec<f64>, bool)) -> Estimate {
        let all = Window { first: [0; AXES], end: self.lattice.cells };
        let (counts, unit, per_mass) = match self.adaptive.weighing {
            Weighing::OfAll | Weighing::Mean => (&self.counts, unit, self.per_mass),
            Weighing::Number | Weighing::OfCell => (&tally.masses, 1.0, 1.0),
        };
        let n = self.lattice.n_cells();
        let (mut density, mut standard_error) = (vec![0.0; n], vec![0.0; n]);
        if !self.cells.is_empty() {
            density = self.density_of((counts, per_mass), &all, false).values;
            density.truncate(n);
            density.iter_mut().for_each(|value| *value *= unit);
            if self.held.is_some() || self.is_oriented {
                density.iter_mut().for_each(|value| *value = value.max(0.0));
            }
            standard_error = self.density_of((&tally.squares, 0.0), &all, true).values;
            standard_error.truncate(n);
            standard_error.iter_mut().for_each(|value| *value = tally.largest * value.sqrt());
        }
        Estimate { density, standard_error, cells: self.cells, history, is_settled }
    }
}

/// Adds a ratio where there is one, so many times.
pub(super) fn add_ratio(field: &mut Field, (own, all): (&Field, &Field), factor: f64) {
    for ((sum, own), all) in field.values.iter_mut().zip(&own.values).zip(&all.values) {
        if *own > 0.0 {
            *sum += factor * own / all;
        }
    }
}

/// A lattice whose ends keep signs.
pub(super) fn mirrored(lattice: &Lattice) -> Lattice {
    let mut own = lattice.clone();
    own.ends.as_flattened_mut().iter_mut().filter(|end| end.is_odd()).for_each(|end| *end = End::Mirror);
    own
}

/// The lattice as products of curvatures see it: behind a wall that holds a value they are what they are before it.
pub(super) fn behind_walls(lattice: &Lattice) -> Lattice {
    let mut own = lattice.clone();
    let held = own.ends.as_flattened_mut().iter_mut().filter(|end| matches!(end, End::Held(_)));
    held.for_each(|end| *end = End::Mirror);
    own
}

/// What ends the iteration.
#[derive(Default)]
struct Ends {
    errors: Vec<f64>,
}

impl Ends {
    /// Whether anything has changed by less than the tolerance: the predicted error, densities, bandwidths, or from some loop
    /// on the running mean of the error.
    fn are_reached(&mut self, search: &Search, old: &[Cell]) -> bool {
        let (cells, d) = (&search.cells, search.d);
        let n: f64 = search.counts.iter().sum();
        let error = |cell: &Cell| {
            let h = cell.h;
            let variance = cell.n / (pow(4.0 * PI, 0.5 * d) * pow(h, d));
            (variance + 0.25 * cell.roughness * h * h * h * h) / (n * n)
        };
        let root = |squares: f64| (squares / cells.len() as f64).sqrt();
        let total = root(cells.iter().map(|cell| error(cell) * error(cell)).sum());
        let change = |new: f64, old: f64| (new / old - 1.0) * (new / old - 1.0);
        let pairs = || cells.iter().zip(old);
        let [most, most_old] =
            [cells, old].map(|all| all.iter().fold(0.0_f64, |most, cell| most.max(cell.rho)));
        let of_densities = root(pairs().map(|(new, old)| change(new.rho / most, old.rho / most_old)).sum());
        let of_bandwidths = root(pairs().map(|(new, old)| change(new.h, old.h)).sum());
        let tolerance = search.adaptive.tolerance;
        let before = self.errors.last().copied();
        let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
        let mean_before = (self.errors.len() + 1 >= RUNNING).then(|| mean(&self.errors));
        self.errors.push(total);
        let of_error = before.is_some_and(|before| (total / before - 1.0).abs() < tolerance);
        let of_mean = mean_before.is_some_and(|before| (mean(&self.errors) / before - 1.0).abs() < tolerance);
        of_error || of_densities < tolerance || of_bandwidths < tolerance || of_mean
    }
}
