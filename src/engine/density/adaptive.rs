//! Kernels that differ from cell to cell in size and shape, found by iteration.
//!
//! Owns the iteration and its end. May use pyramids, curvatures and limits. It deliberately computes bandwidths only where
//! particles are.

use super::super::parallel;
use super::choice::Constants;
use super::classes::{Fill, Table, bandwidth_of, class_of};
use super::curvature::{Curvatures, curvatures};
use super::frame::Frame;
use super::global::histogram;
use super::held::{Held, turned_over};
use super::kinds::{Adaptive, Cell, Estimate, Order, Start};
use super::lattice::{AXES, End, Field, Lattice, Window};
use super::limits::{GROWTH, Limits};
use super::local::Basis;
use super::settled::{Before, Ends};
use super::smoothed::Smoothed;
use super::stencil::scatter;
use super::tally::{Tally, Weighing};
use super::taps::{Integral, Line, REACH, Taps};
use crate::maths::vector::{ln, pow};
use crate::maths::wide::Width;

/// Cells that a thread takes at once.
pub(super) const PORTION: usize = 64;

/// Of the largest density, what one is at least where particles are.
const LEAST: f64 = 1e-9;

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
    let (search, found) = iterate((lattice, tally), (adaptive, limits), bases, width);
    match found {
        None => Estimate::unknown(lattice),
        Some(history) => {
            let (_, unit) = tally.pseudo_counts(adaptive.weighing);
            search.finish(tally, unit, history)
        }
    }
}

/// Kernels of all cells, their history and whether they are settled; no history where masses are no numbers.
pub(super) fn iterate<'a>(
    (lattice, tally): (&'a Lattice, &Tally),
    (adaptive, limits): (&'a Adaptive, Limits),
    bases: Option<&Vec<(Basis, bool)>>,
    width: Width,
) -> (Search<'a>, Option<(Vec<f64>, bool)>) {
    let (counts, _) = tally.pseudo_counts(adaptive.weighing);
    let constants = Constants::new(lattice, &limits);
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
        constants,
    };
    if search.counts.iter().any(|count| !(count.is_finite() && *count > 0.0)) {
        return (search, None);
    }
    let mut ends = Ends::default();
    search.begin(tally, bases);
    let coarser = search.take_coarser(tally, bases);
    if coarser.is_some() {
        ends.errors.push(search.error());
    }
    if !search.cells.is_empty() {
        search.spread();
    }
    // Coarser cells that resolve all kernels say as much of them as these do.
    let mut is_settled = coarser.is_some() && search.is_resolved();
    let mut history = coarser.unwrap_or_else(|| vec![search.mean_bandwidth()]);
    let left = adaptive.most_loops.saturating_sub(history.len() - 1);
    let n_loops = if is_settled || search.cells.is_empty() { 0 } else { left };
    for _ in 0..n_loops {
        let old: Vec<Before> = search.cells.iter().map(Before::of).collect();
        search.go_on();
        history.push(search.mean_bandwidth());
        is_settled = ends.are_reached(&search, &old);
        if is_settled {
            break;
        }
    }
    (search, Some((history, is_settled)))
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
        let sigma = (2.0 * h).clamp(self.limits.support[0], self.limits.support[1]);
        let mut first = Cell { sigma, h, ..Cell::default() };
        if bases.is_none() {
            self.limit(&mut first, [h; AXES]);
        }
        let cell = |&idx: &u32| Cell { at: lattice.cell(idx as usize), ..first.clone() };
        self.cells = tally.cells.iter().map(cell).collect();
        let places: Vec<[usize; AXES]> = self.cells.iter().map(|cell| cell.at).collect();
        (self.held, self.per_mass) = (Held::new(lattice, &places), n / tally.mass());
        if let Some(bases) = bases {
            self.turn(bases);
        }
    }

    pub(super) fn mean_bandwidth(&self) -> f64 {
        self.cells.iter().map(|cell| cell.h).sum::<f64>() / self.cells.len().max(1) as f64
    }

    /// Bandwidths along axes within their bounds, and what follows from them.
    pub(super) fn limit(&self, cell: &mut Cell, h: [f64; AXES]) {
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
        let product = |(i, j): (usize, usize)| {
            let mut product = fields[i].clone();
            product.values.iter_mut().zip(&fields[j].values).for_each(|(own, other)| *own *= other);
            Smoothed::new(tools, (self.adaptive.is_fast, &window), product, range)
        };
        let pairs: Vec<(usize, usize)> =
            (0..fields.len()).flat_map(|i| (0..=i).map(move |j| (i, j))).collect();
        // Those that keep no fine field need little room, and are read together.
        let mut first = 0;
        while first < pairs.len() {
            let mut own = vec![product(pairs[first])];
            if own[0].is_small() {
                own.extend(pairs[first + 1..].iter().map(|&pair| product(pair)));
            }
            let places = first..first + own.len();
            first = places.end;
            self.for_all(&|_, cell, taps| {
                let mut psi = cell.psi;
                Smoothed::all_at(&own, tools, cell, (taps, &mut psi[places.clone()]));
                cell.psi = psi;
            });
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
    pub(super) fn density_of(
        &self,
        (counts, per_mass): (&[f64], f64),
        window: &Window,
        is_squared: bool,
    ) -> Field {
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
            *spread.weight = counts[idx] / if is_squared { volume * volume } else { volume };
            for (axis, lent) in spread.taps[0].iter_mut().enumerate() {
                let line = Line::of(lattice, axis, 1);
                if axis + lattice.d < AXES {
                    lent.be_one();
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
                    *spread.weight = 1.0;
                    spread.taps[0][..AXES - lattice.d].iter_mut().for_each(|lent| lent.be_one());
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

    fn finish(mut self, tally: &Tally, unit: f64, (history, is_settled): (Vec<f64>, bool)) -> Estimate {
        let all = Window { first: [0; AXES], end: self.lattice.cells };
        let is_of_all = matches!(self.adaptive.weighing, Weighing::OfAll | Weighing::Mean);
        let n = self.lattice.n_cells();
        let (mut density, mut standard_error) = (vec![0.0; n], vec![0.0; n]);
        if !self.cells.is_empty() {
            let unit = if is_of_all { unit } else { 1.0 };
            let counts = if is_of_all { self.counts.clone() } else { tally.masses.clone() };
            let per_mass = if is_of_all { self.per_mass } else { 1.0 };
            let is_even = !self.lattice.ends.as_flattened().iter().any(|end| end.is_odd());
            if self.adaptive.order == Order::Fourth && is_even {
                let [of_masses, of_squares] = self.fourth((&counts, &tally.squares));
                (density, standard_error) = (of_masses.values, of_squares.values);
            } else {
                density = if is_of_all && !self.is_oriented {
                    self.rho.1.whole(self.lattice.cells)
                } else {
                    self.density_of((&counts, per_mass), &all, false).values
                };
                standard_error = self.density_of((&tally.squares, 0.0), &all, true).values;
            }
            density.truncate(n);
            density.iter_mut().for_each(|value| *value *= unit);
            if self.held.is_some() || self.is_oriented {
                density.iter_mut().for_each(|value| *value = value.max(0.0));
            }
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
