//! MODFLOW's structured grid as rectilinear cells.
//!
//! Owns the map between the two numberings. May use the grid file and the cells. It deliberately refuses what
//! has no rectilinear cells: layers that are not flat.
//!
//! MODFLOW counts layers from the top and rows from the north; here x points along rows, y to the north and z
//! up, and all count from the lower end.

use super::grid::DisGrid;
use crate::flow::Cells;
use crate::flow::read::error::{Kind, ReadError};

/// Heights that differ by less than this part of the thickness of the whole are equal.
const FLAT: f64 = 1e-9;

impl DisGrid {
    /// Rectilinear cells in metres, x and y from the lower left corner of the grid, z as the file has it.
    pub(super) fn cells(&self, length: f64) -> Result<Cells, ReadError> {
        if let Some(cell) = (0..self.n_cells()).find(|&cell| self.idomain[cell] < 0) {
            let message = format!("the cell in {} is one that water passes through", self.shown(cell));
            return Err(ReadError::new(Kind::Unsupported, message)
                .help("use idomain 0 (no flow) or 1, and give layers a thickness everywhere"));
        }
        let along = |widths: &mut dyn Iterator<Item = &f64>| {
            let mut edges = vec![0.0];
            for width in widths {
                edges.push(edges[edges.len() - 1] + width * length);
            }
            edges
        };
        let x = along(&mut self.delr.iter());
        let y = along(&mut self.delc.iter().rev());
        let z = self.heights()?.into_iter().map(|height| height * length).collect();
        Cells::new([x, y, z]).ok_or_else(|| {
            let message = "columns, rows and layers must have a size above 0";
            ReadError::new(Kind::Damaged, message)
        })
    }

    /// Heights of the flat surfaces from the bottom up.
    fn heights(&self) -> Result<Vec<f64>, ReadError> {
        let surface = |n: usize, height: &dyn Fn(usize) -> f64, name: &dyn Fn() -> String| {
            let start = n * self.n_rows * self.n_columns;
            let layer = start..start + self.n_rows * self.n_columns;
            let first = layer.clone().find(|&cell| self.is_active(cell)).unwrap_or(start);
            let thick = (self.top[first - start] - self.bottom[self.n_cells() - 1]).abs();
            let is_off = |&cell: &usize| (height(cell) - height(first)).abs() > FLAT * thick;
            match layer.filter(|&cell| self.is_active(cell)).find(is_off) {
                None => Ok(height(first)),
                Some(cell) => {
                    let message = format!(
                        "the {} is not flat: {} in {}, {} in {}",
                        name(),
                        height(first),
                        self.shown(first),
                        height(cell),
                        self.shown(cell)
                    );
                    Err(ReadError::new(Kind::Unsupported, message)
                        .help("layers with the same top and bottom everywhere make rectilinear cells"))
                }
            }
        };
        let mut heights = vec![surface(0, &|cell| self.top[cell], &|| "top of the grid".to_owned())?];
        for layer in 0..self.n_layers {
            let name = || format!("bottom of layer {}", layer + 1);
            heights.push(surface(layer, &|cell| self.bottom[cell], &name)?);
        }
        heights.reverse();
        Ok(heights)
    }

    /// Place of a cell of MODFLOW along x, y and z.
    pub(super) fn place_of(&self, cell: usize) -> [usize; 3] {
        let [layer, row, column] = self.place(cell);
        [column, self.n_rows - 1 - row, self.n_layers - 1 - layer]
    }
}
