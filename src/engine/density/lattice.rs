//! The cells that densities live on, and what their ends are to kernels.
//!
//! Owns cells, levels of coarser ones, and windows on them. May use nothing. It deliberately knows no particle.

#![allow(clippy::needless_range_loop)] // An axis belongs to several arrays at once.

/// Axes of every lattice: those that a domain does not have come first, with one cell.
pub const AXES: usize = 3;

/// What an end of an axis is to kernels that reach over it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum End {
    /// Nothing passes: kernels are mirrored, the density has no gradient.
    #[default]
    Mirror,
    /// What leaves here comes in at the other end.
    Wrap,
    /// Nothing stays: kernels are mirrored with the other sign, the density is zero.
    Sink,
    /// The density has this value, mass per m^d: what differs from it is mirrored with the other sign.
    Held(f64),
}

impl End {
    /// Whether kernels are mirrored with the other sign.
    #[inline(always)]
    pub fn is_odd(self) -> bool {
        matches!(self, Self::Sink | Self::Held(_))
    }
}

/// Cells of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Number of axes that are used, the last ones.
    pub d: usize,
    pub cells: [usize; AXES],
    /// m; 1 on axes that are not used.
    pub edge: [f64; AXES],
    pub ends: [[End; 2]; AXES],
}

impl Lattice {
    /// A lattice of the axes that are given, at most three, each with cells, their size and its two ends; nothing if it
    /// has none, or more cells than there can be.
    pub fn new(axes: &[(usize, f64, [End; 2])]) -> Option<Self> {
        if axes.is_empty() || axes.len() > AXES {
            return None;
        }
        let mut lattice =
            Self { d: axes.len(), cells: [1; AXES], edge: [1.0; AXES], ends: [[End::Mirror; 2]; AXES] };
        for (axis, &(cells, edge, ends)) in (AXES - axes.len()..).zip(axes) {
            (lattice.cells[axis], lattice.edge[axis], lattice.ends[axis]) = (cells, edge, ends);
        }
        let is_possible = |end: &End| match end {
            End::Held(value) => *value >= 0.0 && value.is_finite(),
            _ => true,
        };
        let n = lattice.cells.iter().try_fold(1_usize, |n, &own| n.checked_mul(own))?;
        let is_sound = n > 0
            && n <= u32::MAX as usize
            && lattice.edge.iter().all(|edge| *edge > 0.0 && edge.is_finite())
            && lattice.ends.as_flattened().iter().all(is_possible);
        is_sound.then_some(lattice)
    }

    pub fn n_cells(&self) -> usize {
        self.cells.iter().product()
    }

    /// Axes that are used.
    pub fn axes(&self) -> std::ops::Range<usize> {
        AXES - self.d..AXES
    }

    /// The places beside one along an axis; of a periodic one the first and the last are beside each other.
    pub fn beside(&self, at: usize, axis: usize) -> impl Iterator<Item = usize> + use<> {
        let n = self.cells[axis];
        let is_ring = self.ends[axis].contains(&End::Wrap);
        let below = at.checked_sub(1).or(is_ring.then_some(n - 1));
        let above = (at + 1 < n).then_some(at + 1).or(is_ring.then_some(0));
        below.into_iter().chain(above)
    }

    /// Volume of a cell, m^d.
    pub fn volume(&self) -> f64 {
        self.edge.iter().product()
    }

    pub fn cell(&self, idx: usize) -> [usize; AXES] {
        let [_, ny, nz] = self.cells;
        [idx / (ny * nz), idx / nz % ny, idx % nz]
    }

    /// The shortest edge of a cell, m.
    pub fn smallest(&self) -> f64 {
        self.axes().map(|axis| self.edge[axis]).fold(f64::INFINITY, f64::min)
    }

    /// Cells put together to a level: about `2^level` of the smallest ones along each axis.
    pub fn level(&self, level: u32) -> [usize; AXES] {
        let smallest = self.smallest();
        let wanted = (1_u64 << level) as f64 * smallest * (1.0 + 1e-9);
        let mut factors = [1; AXES];
        for axis in self.axes() {
            while 2.0 * factors[axis] as f64 * self.edge[axis] <= wanted
                && 2 * factors[axis] <= self.cells[axis]
            {
                factors[axis] *= 2;
            }
        }
        factors
    }

    /// The finest level but one whose cells are no longer than a length, along any axis.
    pub fn level_of(&self, length: f64) -> u32 {
        let smallest = self.smallest();
        let mut level = 0;
        while level < MOST_LEVEL && (2_u64 << level) as f64 * smallest <= length {
            level += 1;
        }
        level
    }
}

/// Cells of the coarsest level are so many powers of two as large.
const MOST_LEVEL: u32 = 12;

/// Values on a part of the cells of a level.
#[derive(Debug, Clone, Default)]
pub struct Field {
    /// The first cell of the level that is there, and how many.
    pub first: [usize; AXES],
    pub cells: [usize; AXES],
    /// The last axis runs fastest; longer than the cells, so that whole pieces can be read.
    pub values: Vec<f64>,
}

/// Values beyond the last one that may be read.
pub const PADDING: usize = 8;

impl Field {
    /// Zeros on the cells of a level that are within a window of fine cells.
    pub fn zeros(window: &Window, factors: [usize; AXES]) -> Self {
        let mut field = Self::default();
        for axis in 0..AXES {
            field.first[axis] = window.first[axis] / factors[axis];
            field.cells[axis] = window.end[axis].div_ceil(factors[axis]) - field.first[axis];
        }
        field.values = vec![0.0; field.cells.iter().product::<usize>() + PADDING];
        field
    }

    pub fn n(&self) -> usize {
        self.cells.iter().product()
    }

    /// Where the row of two coordinates begins.
    #[inline(always)]
    pub fn row(&self, x: usize, y: usize) -> usize {
        ((x - self.first[0]) * self.cells[1] + (y - self.first[1])) * self.cells[2]
    }

    /// All cells of a lattice of so many: zeros beyond the window.
    pub fn whole(&self, cells: [usize; AXES]) -> Vec<f64> {
        let mut whole = vec![0.0; cells.iter().product::<usize>() + PADDING];
        let n = self.cells[2];
        for x in 0..self.cells[0] {
            for y in 0..self.cells[1] {
                let from = (x * self.cells[1] + y) * n;
                let to = ((x + self.first[0]) * cells[1] + y + self.first[1]) * cells[2] + self.first[2];
                whole[to..to + n].copy_from_slice(&self.values[from..from + n]);
            }
        }
        whole
    }

    /// Means over the cells of the next level, along one axis after the other. The last ones may be narrower.
    pub fn coarsened(&self, window: &Window, cells: [usize; AXES], factors: [[usize; AXES]; 2]) -> Self {
        let target = Self::zeros(window, factors[1]);
        let mut coarse: Option<Self> = None;
        for axis in (0..AXES).filter(|&axis| factors[1][axis] > factors[0][axis]) {
            let own = coarse.as_ref().unwrap_or(self);
            let shape = (target.first[axis], target.cells[axis]);
            coarse = Some(own.halved(axis, shape, cells[axis], factors[0][axis]));
        }
        coarse.unwrap_or_else(|| self.clone())
    }

    /// Means of two cells each along an axis whose cells are so many fine ones.
    fn halved(&self, axis: usize, (first, n): (usize, usize), n_fine: usize, factor: usize) -> Self {
        let mut halved = Self { first: self.first, cells: self.cells, values: Vec::new() };
        (halved.first[axis], halved.cells[axis]) = (first, n);
        halved.values = vec![0.0; halved.n() + PADDING];
        let inner: usize = self.cells[axis + 1..].iter().product();
        let outer: usize = self.cells[..axis].iter().product();
        // Fine cells of a cell, of which the last one may have less.
        let width = |cell: usize, factor: usize| (n_fine - cell * factor).min(factor) as f64;
        let share = |cell: usize| {
            let at = cell + self.first[axis];
            width(at, factor) / width(at / 2, 2 * factor)
        };
        if inner == 1 {
            let shares: Vec<f64> = (0..self.cells[axis]).map(share).collect();
            let rows = self.values.chunks_exact(self.cells[axis]).take(outer);
            for (row, halved) in rows.zip(halved.values.chunks_exact_mut(n)) {
                for (cell, (value, share)) in row.iter().zip(&shares).enumerate() {
                    halved[(cell + self.first[axis]) / 2 - first] += share * value;
                }
            }
            return halved;
        }
        for cell in 0..self.cells[axis] {
            let at = (cell + self.first[axis]) / 2;
            let share = share(cell);
            for block in 0..outer {
                let from = (block * self.cells[axis] + cell) * inner;
                let to = (block * n + at - first) * inner;
                let source = &self.values[from..from + inner];
                for (value, source) in halved.values[to..to + inner].iter_mut().zip(source) {
                    *value += share * source;
                }
            }
        }
        halved
    }
}

/// A box of fine cells.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Window {
    pub first: [usize; AXES],
    pub end: [usize; AXES],
}

impl Window {
    /// Around some cells, with so many more to all sides as are there. All of a periodic axis.
    pub fn around(
        lattice: &Lattice,
        cells: impl Iterator<Item = [usize; AXES]>,
        more: [usize; AXES],
    ) -> Self {
        let mut window = Self { first: lattice.cells, end: [0; AXES] };
        for cell in cells {
            for axis in 0..AXES {
                window.first[axis] = window.first[axis].min(cell[axis]);
                window.end[axis] = window.end[axis].max(cell[axis] + 1);
            }
        }
        for axis in 0..AXES {
            window.first[axis] = window.first[axis].min(window.end[axis]).saturating_sub(more[axis]);
            window.end[axis] = (window.end[axis] + more[axis]).min(lattice.cells[axis]).max(1);
            if lattice.ends[axis].contains(&End::Wrap) {
                (window.first[axis], window.end[axis]) = (0, lattice.cells[axis]);
            }
        }
        window
    }
}
