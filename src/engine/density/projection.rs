//! Kernels that are kept: what cells spread over others with them, and what they find of a field.
//!
//! Owns both directions, one the transpose of the other, so that what is taken of a field is what was given to it. May use
//! classes, stencils and bands. It deliberately finds no kernel.

use super::super::parallel::{self, Pool};
use super::bands::smooth;
use super::classes::{Fill, Table, bandwidth_of, class_of};
use super::global::band;
use super::kinds::{Cell, Estimate};
use super::lattice::{AXES, Field, Lattice, Window};
use super::limits::Limits;
use super::stencil::{Gathering, Lent, scatter};
use super::taps::{Integral, Line, REACH, Taps};
use crate::maths::vector::ln;
use crate::maths::wide::Width;
use std::collections::VecDeque;

/// Cells that a thread takes at once.
const PORTION: usize = 64;

/// Kernels of all cells of a lattice.
#[derive(Debug, Clone)]
pub struct Projection {
    lattice: Lattice,
    kind: Kind,
    width: Width,
}

#[derive(Debug, Clone)]
enum Kind {
    /// What is in a cell is there alone.
    Cells,
    /// The same bandwidths everywhere, m.
    One([f64; AXES]),
    /// Classes of bandwidths in cells along each axis, by cell.
    Each { classes: [Vec<i16>; AXES], tables: Vec<Option<Table>> },
}

impl Projection {
    /// Without kernels.
    pub fn of_cells(lattice: Lattice, width: Width) -> Self {
        Self { lattice, kind: Kind::Cells, width }
    }

    /// One kernel for all; bandwidths within what the lattice can hold.
    pub fn of_one(lattice: Lattice, bandwidths: [f64; AXES], width: Width) -> Self {
        let limits = Limits::new(&lattice);
        let mut own = [0.0; AXES];
        for axis in lattice.axes() {
            let [low, high] = limits.kernel[axis];
            own[axis] = bandwidths[axis].clamp(low, high);
        }
        Self { lattice, kind: Kind::One(own), width }
    }

    /// Those of an estimate, each a part as wide as one says. A cell that had no particle then has the kernel of the nearest one
    /// that had; without any they are as wide as can be.
    pub fn of_estimate(
        lattice: Lattice,
        estimate: &Estimate,
        part: impl Fn(&Cell) -> f64,
        width: Width,
    ) -> Self {
        let limits = Limits::new(&lattice);
        let n = lattice.n_cells();
        let mut classes: [Vec<i16>; AXES] = std::array::from_fn(|_| Vec::new());
        let mut known = Vec::with_capacity(estimate.cells.len());
        for axis in lattice.axes() {
            let own = |h: f64| class_of(ln(h / lattice.edge[axis])) as i16;
            let [low, high] = limits.kernel[axis];
            classes[axis] = vec![own(high); n];
            for cell in &estimate.cells {
                let h = part(cell) * cell.h * cell.s[axis];
                classes[axis][index(&lattice, cell.at)] = own(h.clamp(low, high));
            }
        }
        known.extend(estimate.cells.iter().map(|cell| index(&lattice, cell.at)));
        fill_nearest(&lattice, &known, &mut classes);
        let tables = (0..AXES).map(|axis| table(&lattice, &classes[axis], axis)).collect();
        Self { lattice, kind: Kind::Each { classes, tables }, width }
    }

    /// Bandwidths of a cell along axes, m; zero on axes that are not used, and without kernels.
    pub fn bandwidths(&self, cell: usize) -> [f64; AXES] {
        let mut own = [0.0; AXES];
        match &self.kind {
            Kind::Cells => {}
            Kind::One(bandwidths) => own = *bandwidths,
            Kind::Each { classes, .. } => {
                for axis in self.lattice.axes() {
                    own[axis] = self.lattice.edge[axis] * bandwidth_of(i64::from(classes[axis][cell]));
                }
            }
        }
        own
    }

    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// What each cell of the lattice has of masses in some cells, or of their squares with squared kernels.
    ///
    /// - Equation: `F(z) = Σ_b m_b W_b(z)`.
    /// - Symbols: `W_b` kernel of cell b, integrated over cells.
    /// - Range: any masses; between mirrors nothing is lost.
    /// - Source: methods, section 4.3, step 10.
    /// - Shape: one value per cell of the lattice.
    pub fn spread(&self, cells: &[u32], masses: &[f64]) -> Vec<f64> {
        match &self.kind {
            Kind::Cells => {
                let mut values = vec![0.0; self.lattice.n_cells()];
                cells.iter().zip(masses).for_each(|(&cell, mass)| values[cell as usize] += mass);
                values
            }
            Kind::One(bandwidths) => self.spread_evenly(cells, masses, bandwidths),
            Kind::Each { classes, tables } => self.scatter(cells, masses, (classes, tables)),
        }
    }

    /// About the variance of what cells have of particles whose squared masses are summed in some cells.
    ///
    /// - Equation: `Σ_b (Σ m²)_b W_b²(z) ≈ Σ_b (Σ m²)_b W_b(z) Π_i min(1, 1/(2√π ĥ_i))`.
    /// - Symbols: `ĥ` bandwidths in cells; the sum over z of a squared kernel is the product.
    /// - Range: where kernels and squares change little within a kernel.
    /// - Source: `∫ W² = (2√π h)^{−d}` of a Gaussian.
    /// - Shape: one value per cell of the lattice.
    pub fn spread_squares(&self, cells: &[u32], squares: &[f64]) -> Vec<f64> {
        let weighed = cells.iter().zip(squares).map(|(&cell, square)| square * self.squared(cell as usize));
        self.spread(cells, &weighed.collect::<Vec<f64>>())
    }

    /// About the sum over cells of the square of a cell's kernel: `Π_i min(1, 1/(2√π ĥ_i))`.
    pub fn squared(&self, cell: usize) -> f64 {
        let h = self.bandwidths(cell);
        let of_axis = |axis: usize| match h[axis] / self.lattice.edge[axis] {
            own if own > 0.0 => (0.5 / (std::f64::consts::PI.sqrt() * own)).min(1.0),
            _ => 1.0,
        };
        self.lattice.axes().map(of_axis).product()
    }

    /// What the kernels of some cells find of a field.
    ///
    /// - Equation: `L_b = Σ_z W_b(z) f(z)`.
    /// - Symbols: as in [`Projection::spread`], of which this is the transpose: `Σ_b m_b L_b = Σ_z F(z) f(z)`.
    /// - Range: any field.
    /// - Source: methods, (5.1), with the integral taken over cells.
    /// - Shape: one value per cell that is asked for.
    pub fn gather(&self, cells: &[u32], field: Vec<f64>) -> Vec<f64> {
        let all = Window { first: [0; AXES], end: self.lattice.cells };
        let mut own = Field::zeros(&all, [1; AXES]);
        own.values[..field.len()].copy_from_slice(&field);
        match &self.kind {
            Kind::Cells => cells.iter().map(|&cell| field[cell as usize]).collect(),
            Kind::One(bandwidths) => {
                self.smooth(&mut own, bandwidths);
                cells.iter().map(|&cell| own.values[cell as usize]).collect()
            }
            Kind::Each { classes, tables } => self.gather_each(cells, &own, (classes, tables)),
        }
    }

    fn spread_evenly(&self, cells: &[u32], masses: &[f64], bandwidths: &[f64; AXES]) -> Vec<f64> {
        let all = Window { first: [0; AXES], end: self.lattice.cells };
        let mut field = Field::zeros(&all, [1; AXES]);
        cells.iter().zip(masses).for_each(|(&cell, mass)| field.values[cell as usize] += mass);
        self.smooth(&mut field, bandwidths);
        field.values.truncate(self.lattice.n_cells());
        field.values
    }

    /// Kernels of one size, and images of them, are the same from b to z as from z to b.
    fn smooth(&self, field: &mut Field, bandwidths: &[f64; AXES]) {
        for axis in self.lattice.axes().filter(|&axis| self.lattice.cells[axis] > 1) {
            let line = Line::of(&self.lattice, axis, 1);
            let own = band(line, bandwidths[axis] / self.lattice.edge[axis], false);
            smooth(field, axis, &own, self.width);
        }
    }

    fn scatter(
        &self,
        cells: &[u32],
        masses: &[f64],
        (classes, tables): (&[Vec<i16>; AXES], &[Option<Table>]),
    ) -> Vec<f64> {
        let all = Window { first: [0; AXES], end: self.lattice.cells };
        let mut fields = [Field::zeros(&all, [1; AXES])];
        scatter((cells.len(), self.width), &mut fields, &|idx, spread| {
            *spread.weight = masses[idx];
            self.lend(cells[idx], (classes, tables), &mut spread.taps[0]);
        });
        let [mut field] = fields;
        field.values.truncate(self.lattice.n_cells());
        field.values
    }

    fn lend<'t>(
        &self,
        cell: u32,
        (classes, tables): (&[Vec<i16>; AXES], &'t [Option<Table>]),
        taps: &mut [Lent<'t>; AXES],
    ) {
        let at = self.lattice.cell(cell as usize);
        for (axis, lent) in taps.iter_mut().enumerate() {
            match &tables[axis] {
                None => lent.be_one(),
                Some(table) => {
                    let class = i64::from(classes[axis][cell as usize]);
                    table.lend(Line::of(&self.lattice, axis, 1), class, at[axis], lent, FILL);
                }
            }
        }
    }

    fn gather_each(
        &self,
        cells: &[u32],
        field: &Field,
        kernels: (&[Vec<i16>; AXES], &[Option<Table>]),
    ) -> Vec<f64> {
        let mut sums = vec![0.0; cells.len()];
        let mut portions: Vec<(&[u32], &mut [f64])> =
            cells.chunks(PORTION).zip(sums.chunks_mut(PORTION)).collect();
        let benches: Pool<[Taps; AXES]> = Pool::new();
        parallel::for_each(&mut portions, &|_, (cells, sums)| {
            benches.lend(Default::default, |taps| {
                let mut lent: [Lent; AXES] = Default::default();
                for (&cell, sum) in cells.iter().zip(sums.iter_mut()) {
                    self.lend(cell, kernels, &mut lent);
                    for (own, lent) in taps.iter_mut().zip(&lent) {
                        lent.copy_to(own);
                    }
                    taps[AXES - 1].pad();
                    let sum = std::slice::from_mut(sum);
                    self.width.run(Gathering { taps, fields: &[field], sums: sum });
                }
            });
        });
        sums
    }
}

const FILL: Fill = &|line, own, b, taps| line.gaussian(Integral::new(), b, (own, own), taps);

/// Kernels of all classes along an axis that has some.
fn table(lattice: &Lattice, classes: &[i16], axis: usize) -> Option<Table> {
    let (first, last) = (classes.iter().min()?, classes.iter().max()?);
    let range = (i64::from(*first), i64::from(*last));
    Some(Table::new(range, (lattice.cells[axis], 1.0), REACH, FILL))
}

fn index(lattice: &Lattice, at: [usize; AXES]) -> usize {
    (at[0] * lattice.cells[1] + at[1]) * lattice.cells[2] + at[2]
}

/// Gives cells without a class that of the nearest one with one, in steps from cell to cell.
fn fill_nearest(lattice: &Lattice, known: &[usize], classes: &mut [Vec<i16>; AXES]) {
    let mut is_known = vec![false; lattice.n_cells()];
    known.iter().for_each(|&cell| is_known[cell] = true);
    let mut queue: VecDeque<u32> = known.iter().map(|&cell| cell as u32).collect();
    while let Some(cell) = queue.pop_front() {
        let at = lattice.cell(cell as usize);
        for axis in lattice.axes() {
            for beside in lattice.beside(at[axis], axis) {
                let mut next = at;
                next[axis] = beside;
                let other = index(lattice, next);
                if !std::mem::replace(&mut is_known[other], true) {
                    lattice.axes().for_each(|axis| classes[axis][other] = classes[axis][cell as usize]);
                    queue.push_back(other as u32);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::lattice::End;
    use super::*;

    fn lattices() -> Vec<Lattice> {
        let ends = [[End::Mirror; 2], [End::Wrap; 2], [End::Sink, End::Mirror], [End::Mirror; 2]];
        let line = |n: usize, ends: [End; 2]| Lattice::new(&[(n, 0.5, ends)]).unwrap();
        let mut all: Vec<Lattice> = ends.iter().map(|&ends| line(23, ends)).collect();
        all.push(Lattice::new(&[(17, 0.5, ends[0]), (9, 0.25, ends[1])]).unwrap());
        all.push(Lattice::new(&[(6, 0.5, ends[2]), (9, 1.0, ends[0]), (7, 1.0, ends[1])]).unwrap());
        all
    }

    /// Bandwidths of any kind in every third cell.
    fn of_estimate(lattice: &Lattice) -> Projection {
        let cell = |idx: usize| Cell {
            at: lattice.cell(idx),
            h: 0.3 + 0.1 * (idx % 7) as f64,
            s: [1.3, 0.9, 1.1 - 0.05 * (idx % 4) as f64],
            ..Cell::default()
        };
        let estimate = Estimate {
            density: Vec::new(),
            standard_error: Vec::new(),
            cells: (0..lattice.n_cells()).step_by(3).map(cell).collect(),
            history: Vec::new(),
            is_settled: true,
        };
        Projection::of_estimate(lattice.clone(), &estimate, |_| 1.0, Width::widest())
    }

    /// Of two kernels the nearest one, which may be nearest around a ring.
    #[test]
    fn kernels_of_empty_cells_are_those_of_the_nearest_one() {
        for (ends, last) in [([End::Mirror; 2], 7), ([End::Wrap; 2], 5)] {
            let lattice = Lattice::new(&[(20, 1.0, ends)]).unwrap();
            let mut classes: [Vec<i16>; AXES] = std::array::from_fn(|_| vec![0; 20]);
            (classes[2][1], classes[2][12]) = (5, 7);
            fill_nearest(&lattice, &[1, 12], &mut classes);
            assert_eq!((classes[2][0], classes[2][6], classes[2][8], classes[2][19]), (5, 5, 7, last));
        }
    }

    #[test]
    fn what_is_found_is_what_was_spread() {
        for lattice in lattices() {
            let n = lattice.n_cells();
            let cells: Vec<u32> = (0..n as u32).filter(|cell| cell % 5 != 1).collect();
            let masses: Vec<f64> = cells.iter().map(|cell| 1.0 + f64::from(cell % 11)).collect();
            let field: Vec<f64> = (0..n).map(|cell| ((cell * 31) % 17) as f64 - 5.0).collect();
            let one = Projection::of_one(lattice.clone(), [0.7; AXES], Width::widest());
            for projection in
                [of_estimate(&lattice), one, Projection::of_cells(lattice.clone(), Width::widest())]
            {
                let spread = projection.spread(&cells, &masses);
                let found = projection.gather(&cells, field.clone());
                let by_cells: f64 = masses.iter().zip(&found).map(|(m, l)| m * l).sum();
                let by_field: f64 = spread.iter().zip(&field).map(|(f, own)| f * own).sum();
                let size: f64 = spread.iter().zip(&field).map(|(f, own)| (f * own).abs()).sum();
                assert!((by_cells - by_field).abs() < 1e-13 * size, "{by_cells} {by_field}");
                if !lattice.ends.as_flattened().contains(&End::Sink) {
                    let (all, whole): (f64, f64) = (spread.iter().sum(), masses.iter().sum());
                    assert!((all / whole - 1.0).abs() < 1e-13, "{all} {whole}");
                }
            }
        }
    }
}
