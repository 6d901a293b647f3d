//! Rectilinear cells: edges along each axis.
//!
//! Owns the numbering of cells and faces. May use nothing else of the crate. It deliberately holds no
//! values.

/// Cells between edges along x, y and z. An axis that the domain does not have is one cell of length 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    edges: [Vec<f64>; 3],
}

impl Cells {
    /// `None` if an axis has no cell, or edges that do not rise.
    pub fn new(edges: [Vec<f64>; 3]) -> Option<Self> {
        let rises = |edges: &Vec<f64>| {
            edges.len() >= 2
                && edges.iter().all(|edge| edge.is_finite())
                && edges.windows(2).all(|pair| pair[1] > pair[0])
        };
        edges.iter().all(rises).then_some(Self { edges })
    }

    /// Cells of equal size along each axis.
    pub fn equal(low: [f64; 3], high: [f64; 3], n: [usize; 3]) -> Option<Self> {
        let along = |axis: usize| {
            let width = (high[axis] - low[axis]) / n[axis] as f64;
            let edge = |idx: usize| if idx == n[axis] { high[axis] } else { low[axis] + width * idx as f64 };
            (0..=n[axis]).map(edge).collect()
        };
        Self::new([along(0), along(1), along(2)])
    }

    /// The same cells elsewhere; `None` if edges become one.
    pub fn moved(&self, by: [f64; 3]) -> Option<Self> {
        let mut edges = self.edges.clone();
        for (edges, by) in edges.iter_mut().zip(by) {
            edges.iter_mut().for_each(|edge| *edge += by);
        }
        Self::new(edges)
    }

    pub fn edges(&self) -> &[Vec<f64>; 3] {
        &self.edges
    }

    /// Cells along each axis.
    pub fn n(&self) -> [usize; 3] {
        [0, 1, 2].map(|axis| self.edges[axis].len() - 1)
    }

    pub fn n_cells(&self) -> usize {
        self.n().iter().product()
    }

    /// Faces normal to an axis.
    pub fn n_faces(&self, axis: usize) -> usize {
        let mut n = self.n();
        n[axis] += 1;
        n.iter().product()
    }

    /// Number of the cell at a place; the last axis is fastest.
    pub fn cell(&self, place: [usize; 3]) -> usize {
        let n = self.n();
        (place[0] * n[1] + place[1]) * n[2] + place[2]
    }

    /// Place of a cell along each axis.
    pub fn place(&self, cell: usize) -> [usize; 3] {
        let n = self.n();
        [cell / (n[1] * n[2]), cell / n[2] % n[1], cell % n[2]]
    }

    /// Numbers of the two faces of a cell that are normal to an axis: the lower, the upper.
    pub fn faces(&self, axis: usize, place: [usize; 3]) -> (usize, usize) {
        let mut n = self.n();
        n[axis] += 1;
        let face = |place: [usize; 3]| (place[0] * n[1] + place[1]) * n[2] + place[2];
        let mut upper = place;
        upper[axis] += 1;
        (face(place), face(upper))
    }

    /// Length of a cell along an axis, m.
    pub fn width(&self, axis: usize, along: usize) -> f64 {
        self.edges[axis][along + 1] - self.edges[axis][along]
    }

    /// Area of the faces of a cell that are normal to an axis, m².
    pub fn face_area(&self, axis: usize, place: [usize; 3]) -> f64 {
        (0..3).filter(|&other| other != axis).map(|other| self.width(other, place[other])).product()
    }

    /// Volume of a cell, m³.
    pub fn volume(&self, place: [usize; 3]) -> f64 {
        (0..3).map(|axis| self.width(axis, place[axis])).product()
    }

    /// Middle of a cell, m.
    pub fn centre(&self, place: [usize; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| 0.5 * (self.edges[axis][place[axis]] + self.edges[axis][place[axis] + 1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_numbers_belong_together() {
        let cells = Cells::equal([0.0, 0.0, 0.0], [2.0, 3.0, 4.0], [2, 3, 4]).unwrap();
        for cell in 0..cells.n_cells() {
            assert_eq!(cells.cell(cells.place(cell)), cell);
        }
        assert_eq!(cells.n_faces(1), 2 * 4 * 4);
        assert_eq!(cells.faces(2, [1, 2, 3]), (28, 29));
        assert_eq!(cells.face_area(0, [0, 0, 0]), 1.0);
        assert!(Cells::new([vec![0.0, 1.0], vec![0.0], vec![0.0, 1.0]]).is_none());
        assert!(Cells::new([vec![0.0, 1.0], vec![0.0, 0.0], vec![0.0, 1.0]]).is_none());
    }
}
