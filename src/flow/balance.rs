//! How well the water of a flow adds up.
//!
//! Owns the measures of what is missing. May use the flow. It deliberately mends nothing: a flow that was
//! read is as good as the program that wrote it, and whoever uses it must be able to see how good.

use super::FaceFlow;

/// What is missing in the water balance of the cells, each by its worst cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Balance {
    /// The cell where most water appears or vanishes, …
    pub worst_cell: usize,
    /// … how much, m³/s, …
    pub worst: f64,
    /// … and as part of what flows through the domain. Without any flow 0.
    pub worst_of_through_flow: f64,
    /// Divergence in the worst cell, relative to mean discharge over cell size.
    pub worst_divergence: f64,
    /// Root mean square of the same over all cells, each weighed by its volume.
    pub rms_divergence: f64,
}

impl FaceFlow {
    /// What is missing in the water balance of the cells.
    ///
    /// - Equation: `worst = max |r|`, `δ = r L / (V q̄)`, `rms = √(Σ V δ² / Σ V)`.
    /// - Symbols: `r` imbalance of a cell, `V` its volume, `L` its size (the mean of its edges along axes with
    ///   more than one cell), `q̄` mean amount of the discharge over all faces that carry water.
    /// - Range: any flow; all zero where no water flows and none is missing.
    /// - Source: conservation of water of constant density; `δ` is 1 where a cell gains what crosses one of its faces.
    /// - Shape: one summary per flow.
    pub fn balance(&self) -> Balance {
        let rest = self.imbalance();
        let mean = mean_discharge(&self.flux);
        let through = self.through_flow();
        let n = self.cells.n();
        let active = || (0..3).filter(|&axis| n[axis] > 1);
        let mut balance = Balance {
            worst_cell: 0,
            worst: 0.0,
            worst_of_through_flow: 0.0,
            worst_divergence: 0.0,
            rms_divergence: 0.0,
        };
        let (mut squares, mut volumes) = (0.0, 0.0);
        for (cell, &rest) in rest.iter().enumerate() {
            let place = self.cells.place(cell);
            let volume = self.cells.volume(place);
            let edges: f64 = active().map(|axis| self.cells.width(axis, place[axis])).sum();
            let size = if edges > 0.0 { edges / active().count() as f64 } else { self.cells.width(0, 0) };
            let divergence = relative(rest.abs() * size, volume * mean);
            squares += volume * divergence * divergence;
            volumes += volume;
            balance.worst_divergence = balance.worst_divergence.max(divergence);
            if rest.abs() > balance.worst {
                (balance.worst, balance.worst_cell) = (rest.abs(), cell);
            }
        }
        balance.worst_of_through_flow = relative(balance.worst, through);
        balance.rms_divergence = (squares / volumes).sqrt();
        balance
    }
}

/// Nothing of nothing is 0, something of nothing is infinite.
fn relative(part: f64, whole: f64) -> f64 {
    if part == 0.0 { 0.0 } else { part / whole }
}

/// Mean amount over the faces that carry water; walls would make it depend on how much of the grid is
/// inactive.
fn mean_discharge(flux: &[Vec<f64>; 3]) -> f64 {
    let carrying = || flux.iter().flatten().filter(|flux| **flux != 0.0);
    let n = carrying().count();
    if n == 0 { 0.0 } else { carrying().map(|flux| flux.abs()).sum::<f64>() / n as f64 }
}

#[cfg(test)]
mod tests {
    use crate::flow::{Cells, FaceFlow, Sink};

    fn column(flux: Vec<f64>) -> FaceFlow {
        let n = flux.len() - 1;
        let cells = Cells::equal([0.0; 3], [0.5 * n as f64, 1.0, 1.0], [n, 1, 1]).unwrap();
        let flux = [flux, vec![0.0; 2 * n], vec![0.0; 2 * n]];
        FaceFlow { cells, flux, porosity: vec![0.3; n], head: None, conductivity: None, sinks: Vec::new() }
    }

    #[test]
    fn water_that_appears_is_found_where_it_does() {
        let sound = column(vec![2.0; 5]).balance();
        assert_eq!((sound.worst, sound.worst_divergence, sound.rms_divergence), (0.0, 0.0, 0.0));
        // The third of four cells gains 1 of the 2 that flow in; mean discharge 2.4.
        let gaining = column(vec![2.0, 2.0, 2.0, 3.0, 3.0]).balance();
        assert_eq!((gaining.worst_cell, gaining.worst, gaining.worst_of_through_flow), (2, 1.0, 0.5));
        assert!((gaining.worst_divergence - 1.0 / 2.4).abs() < 1e-15);
        assert!((gaining.rms_divergence - 0.5 / 2.4).abs() < 1e-15);
    }

    #[test]
    fn still_water_is_balanced_and_a_lone_well_is_not() {
        let mut still = column(vec![0.0; 3]);
        assert_eq!(still.balance().worst_of_through_flow, 0.0);
        still.sinks.push(Sink { cell: 1, rate: 1.0, owner: 0 });
        assert_eq!(still.balance().worst_of_through_flow, f64::INFINITY);
    }
}
