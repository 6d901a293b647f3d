//! A start for the iteration from cells twice as long, where loops cost a part.
//!
//! Owns the coarser lattice and the way back. May use lattices, tallies and the search. It deliberately leaves the last word to
//! the fine cells: where kernels are narrow for coarser ones, they loop until they are settled themselves.

use super::adaptive::{Search, iterate};
use super::kinds::{Adaptive, Cell, Start};
use super::lattice::{AXES, End, Lattice};
use super::limits::Limits;
use super::local::Basis;
use super::tally::Tally;

/// Bandwidths over edges of cells, from which on cells twice as long say as much of them: on a line densities do not hang on
/// cells up to twice a bandwidth long (methods, table P3-a).
const RESOLVED: f64 = 1.2;

/// Loops on coarser cells, at most: what does not settle soon begins anew on its own cells, as where a density jumps loops go on
/// without an end, and away from it.
const MOST_LOOPS: usize = 8;

/// Cells of an axis, at least, that are put together by two.
const SHORTEST: usize = 32;

/// Cells with particles, at least, for which a start of their own is worth it.
const FEWEST: usize = 256;

pub(super) struct Coarser {
    pub(super) lattice: Lattice,
    pub(super) tally: Tally,
    /// By cell with particles, the coarse one in which it lies.
    pub(super) parents: Vec<u32>,
}

impl Coarser {
    /// The lattice of cells twice as long, if kernels of a bandwidth are still half as wide as one of them, and what is in it.
    pub(super) fn of(lattice: &Lattice, tally: &Tally, bandwidth: f64) -> Option<Self> {
        let is_fit = |axis: usize| {
            let is_held = lattice.ends[axis].iter().any(|end| matches!(end, End::Held(_)));
            let n = lattice.cells[axis];
            // Half a cell beyond an end would look like a density that falls there.
            n >= SHORTEST && n.is_multiple_of(2) && !is_held && bandwidth >= lattice.edge[axis]
        };
        if tally.cells.len() < FEWEST || !lattice.axes().all(is_fit) {
            return None;
        }
        let mut coarse = lattice.clone();
        for axis in lattice.axes() {
            coarse.cells[axis] = lattice.cells[axis] / 2;
            coarse.edge[axis] *= 2.0;
        }
        let place = |&idx: &u32| {
            let at = lattice.cell(idx as usize);
            let own: [usize; AXES] =
                std::array::from_fn(|axis| if axis + lattice.d < AXES { 0 } else { at[axis] / 2 });
            ((own[0] * coarse.cells[1] + own[1]) * coarse.cells[2] + own[2]) as u32
        };
        let places: Vec<u32> = tally.cells.iter().map(place).collect();
        let (tally, parents) = tally.joined(&places, coarse.n_cells());
        Some(Self { lattice: coarse, tally, parents })
    }

    /// Directions: those of the first cell with particles of each coarse one.
    pub(super) fn bases(&self, fine: &[(Basis, bool)]) -> Vec<(Basis, bool)> {
        let mut bases: Vec<Option<(Basis, bool)>> = vec![None; self.tally.cells.len()];
        for (parent, basis) in self.parents.iter().zip(fine) {
            bases[*parent as usize].get_or_insert(*basis);
        }
        bases.into_iter().flatten().collect()
    }
}

impl Search<'_> {
    /// Whether the start is free: where loops are numbered, or it is given, they are as published.
    fn begins_coarser(&self) -> bool {
        let adaptive = self.adaptive;
        adaptive.is_fast && adaptive.tolerance > 0.0 && adaptive.start == Start::NormalReference
    }

    /// Takes kernels that are found on cells twice as long, if these serve and they are settled there; tells how.
    pub(super) fn take_coarser(
        &mut self,
        tally: &Tally,
        bases: Option<&Vec<(Basis, bool)>>,
    ) -> Option<Vec<f64>> {
        let h = self.cells.first().map_or(0.0, |cell| cell.h);
        let coarser = self.begins_coarser().then(|| Coarser::of(self.lattice, tally, h)).flatten()?;
        let own = bases.map(|bases| coarser.bases(bases));
        let limits = Limits::new(&coarser.lattice).within(&self.limits);
        let adaptive =
            Adaptive { most_loops: self.adaptive.most_loops.min(MOST_LOOPS), ..self.adaptive.clone() };
        let (found, history) =
            iterate((&coarser.lattice, &coarser.tally), (&adaptive, limits), own.as_ref(), self.width);
        let mut history = history.and_then(|(history, is_settled)| is_settled.then_some(history))?;
        let mut parents = found.cells;
        for parent in &mut parents {
            parent.sigma = parent.sigma.clamp(self.limits.support[0], self.limits.support[1]);
            let own = parent.s.map(|s| parent.h * s);
            self.limit(parent, own);
        }
        for (cell, parent) in self.cells.iter_mut().zip(&coarser.parents) {
            let parent = &parents[*parent as usize];
            *cell = Cell { at: cell.at, axes: cell.axes, is_stagnant: cell.is_stagnant, ..parent.clone() };
        }
        if let Some(last) = history.last_mut() {
            *last = self.mean_bandwidth();
        }
        Some(history)
    }

    /// Whether cells twice as long resolve all kernels.
    pub(super) fn is_resolved(&self) -> bool {
        let is_wide = |cell: &Cell, axis: usize| cell.h * cell.s[axis] >= RESOLVED * self.lattice.edge[axis];
        self.cells.iter().all(|cell| self.lattice.axes().all(|axis| is_wide(cell, axis)))
    }
}
