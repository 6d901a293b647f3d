//! Edges along one axis, of any distance from each other.
//!
//! Owns the search for the cell of a place. May use lanes. It deliberately knows no flow.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::super::lanes::{LANES, Lane, Narrow};

/// Entries of the table per cell, and at most.
const FINENESS: f64 = 4.0;
const MOST_ENTRIES: f64 = 1_048_576.0;

/// Cells along an axis, found by a table of equal parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Ruler {
    edges: Vec<f64>,
    inverse_widths: Vec<f64>,
    /// Per part of the axis the cell that its lower end lies in.
    table: Vec<u32>,
    inverse_part: f64,
}

impl Ruler {
    /// `edges` rise, and there are two at least.
    pub fn new(edges: &[f64]) -> Self {
        let n = edges.len() - 1;
        let (low, high) = (edges[0], edges[n]);
        let widths = edges.windows(2).map(|pair| pair[1] - pair[0]);
        let smallest = widths.clone().fold(high - low, f64::min);
        // Parts as small as the smallest cell hold one edge at most, where so many are worth their memory.
        let n_parts = ((high - low) / smallest).ceil().min(FINENESS * n as f64 + 64.0).min(MOST_ENTRIES);
        let part = (high - low) / n_parts;
        let of_part = |k: usize| edges.partition_point(|&edge| edge <= low + k as f64 * part).clamp(1, n) - 1;
        Self {
            edges: edges.to_vec(),
            inverse_widths: widths.map(|width| 1.0 / width).collect(),
            table: (0..n_parts as usize).map(|k| of_part(k) as u32).collect(),
            inverse_part: 1.0 / part,
        }
    }

    pub fn n(&self) -> usize {
        self.inverse_widths.len()
    }

    /// Lower and upper edge of a cell, m.
    pub fn ends(&self, cell: usize) -> [f64; 2] {
        [self.edges[cell], self.edges[cell + 1]]
    }

    /// The cell of a place; outside that which is next.
    #[inline(always)]
    pub fn cell(&self, x: f64) -> usize {
        let part = (x - self.edges[0]) * self.inverse_part;
        // A place that is no number is in the first cell.
        let part = if part > 0.0 { (part as usize).min(self.table.len() - 1) } else { 0 };
        let mut cell = self.table[part] as usize;
        while cell + 1 < self.n() && x >= self.edges[cell + 1] {
            cell += 1;
        }
        while cell > 0 && x < self.edges[cell] {
            cell -= 1;
        }
        cell
    }

    /// Cells, fractions of them from the lower edge on, and 1/width in 1/m.
    #[inline(always)]
    pub fn locate(
        &self,
        x: &Lane,
        place: &mut [u32; LANES],
        fraction: &mut Narrow,
        inverse_width: &mut Narrow,
    ) {
        for lane in 0..LANES {
            let cell = self.cell(x[lane]);
            let along = (x[lane] - self.edges[cell]) * self.inverse_widths[cell];
            place[lane] = cell as u32;
            fraction[lane] = along.clamp(0.0, 1.0) as f32;
            inverse_width[lane] = self.inverse_widths[cell] as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_in_cells_of_any_width() {
        for edges in [vec![0.0, 1.0], vec![-3.0, -2.9999, 0.0, 4.0, 4.5, 100.0], vec![1e6, 1e6 + 1e-3, 2e6]] {
            let ruler = Ruler::new(&edges);
            for cell in 0..ruler.n() {
                let [low, high] = ruler.ends(cell);
                for part in [0.0, 1e-9, 0.3, 0.5, 0.999_999] {
                    let x = low + part * (high - low);
                    assert_eq!(ruler.cell(x), cell, "{x} in {edges:?}");
                }
            }
            assert_eq!(ruler.cell(f64::NEG_INFINITY), 0);
            assert_eq!(ruler.cell(f64::INFINITY), ruler.n() - 1);
            assert_eq!(ruler.cell(f64::NAN), 0);
        }
    }
}
