//! Porosity at places and in boxes.
//!
//! Owns the choice between cells and expressions. May use `flow` and the plan. It deliberately looks at no particle.

use super::world::Site;
use crate::flow::FaceFlow;
use crate::plan::tape::Operation;
use crate::plan::transport::Flow;
use crate::state::grid::Grid;

/// Points along each axis at which porosity by an expression is looked at in a box.
const POINTS: usize = 64;

impl<const D: usize> Site<'_, D> {
    /// The cells whose porosity counts, where it may differ between them: a particle's water is that of its cell.
    pub fn pores(&self) -> Option<&FaceFlow> {
        let is_constant = matches!(self.transport.porosity.operations[..], [Operation::Constant(_)]);
        let may_differ = !is_constant || matches!(self.transport.flow, Flow::File(_));
        self.flow.as_deref().filter(|_| may_differ)
    }

    /// Whether porosity changes within a cell, or where there are none.
    pub fn has_smooth_pores(&self) -> bool {
        let is_constant = matches!(self.transport.porosity.operations[..], [Operation::Constant(_)]);
        !is_constant && self.pores().is_none()
    }

    /// Which way the water goes at a place, and how fast: of cells the mean discharge of their faces, m/s;
    /// `flows` are all of the plan.
    pub fn velocity(&self, flows: &[Flow], place: &[f64; D], t: f64) -> [f64; D] {
        let period = self.period_at(t);
        if let Some(flow) = self.face_flow(period) {
            let cell = flow.cells.place(self.cell_at(flow, place));
            return std::array::from_fn(|axis| {
                let index = self.plan.axes[axis].index;
                let (low, high) = flow.cells.faces(index, cell);
                0.5 * (flow.flux[index][low] + flow.flux[index][high])
            });
        }
        match flows.get(period) {
            Some(Flow::Uniform(velocity)) => std::array::from_fn(|axis| velocity[axis]),
            Some(Flow::Expression(tapes)) => {
                std::array::from_fn(|axis| self.evaluate(&tapes[axis], &[*place], t)[0])
            }
            _ => [0.0; D],
        }
    }

    fn cell_at(&self, flow: &FaceFlow, at: &[f64; D]) -> usize {
        let mut place = [0; 3];
        for (axis, &x) in at.iter().enumerate() {
            let index = self.plan.axes[axis].index;
            let edges = &flow.cells.edges()[index];
            place[index] = edges.partition_point(|&edge| edge <= x).clamp(1, edges.len() - 1) - 1;
        }
        flow.cells.cell(place)
    }

    pub fn porosity(&self, places: &[[f64; D]]) -> Vec<f64> {
        let Some(flow) = self.pores() else { return self.evaluate(&self.transport.porosity, places, 0.0) };
        let of_place = |at: &[f64; D]| flow.porosity[self.cell_at(flow, at)];
        places.iter().map(of_place).collect()
    }

    /// Mean porosity in the bins of an output; that in their middles where it is an expression.
    pub fn porosity_of_bins(&self, grid: &Grid<D>) -> Vec<f64> {
        let centres = (0..grid.n_bins()).map(|bin| grid.centre(bin));
        if self.pores().is_none() {
            return self.porosity(&centres.collect::<Vec<_>>());
        }
        let bins = grid.bins();
        let half: [f64; D] =
            std::array::from_fn(|axis| 0.5 * (self.high[axis] - self.low[axis]) / bins[axis] as f64);
        let of_bin = |centre: [f64; D]| {
            let low = std::array::from_fn(|axis| centre[axis] - half[axis]);
            let high = std::array::from_fn(|axis| centre[axis] + half[axis]);
            self.porosity_in(&low, &high)
        };
        centres.map(of_bin).collect()
    }

    /// Mean porosity in a box: of cells by the parts of them that lie in it, of an expression by the midpoint rule.
    pub fn porosity_in(&self, low: &[f64; D], high: &[f64; D]) -> f64 {
        if let Some(flow) = self.pores() {
            return self.mean_of_cells(flow, low, high);
        }
        let per_axis = if D == 3 { POINTS / 4 } else { POINTS };
        let n = per_axis.pow(D as u32);
        let places: Vec<[f64; D]> = (0..n)
            .map(|mut idx| {
                std::array::from_fn(|axis| {
                    let part = ((idx % per_axis) as f64 + 0.5) / per_axis as f64;
                    idx /= per_axis;
                    low[axis] + part * (high[axis] - low[axis])
                })
            })
            .collect();
        self.evaluate(&self.transport.porosity, &places, 0.0).iter().sum::<f64>() / n as f64
    }

    /// - Equation: `φ = Σ φ_c V_c / Σ V_c`.
    /// - Symbols: `V_c` the part of a cell that lies in the box.
    /// - Range: boxes that meet the cells; the nearest cell's porosity elsewhere.
    /// - Source: definition of the mean.
    /// - Shape: one number.
    fn mean_of_cells(&self, flow: &FaceFlow, low: &[f64; D], high: &[f64; D]) -> f64 {
        let mut parts: [Vec<(usize, f64)>; 3] = std::array::from_fn(|_| vec![(0, 1.0)]);
        for axis in 0..D {
            let index = self.plan.axes[axis].index;
            let edges = &flow.cells.edges()[index];
            let first = edges.partition_point(|&edge| edge <= low[axis]).clamp(1, edges.len() - 1) - 1;
            let overlap = |cell: usize| high[axis].min(edges[cell + 1]) - low[axis].max(edges[cell]);
            let met = (first..edges.len() - 1).take_while(|&cell| edges[cell] < high[axis]);
            parts[index] = met.map(|cell| (cell, overlap(cell))).filter(|(_, part)| *part > 0.0).collect();
            if parts[index].is_empty() {
                parts[index] = vec![(first, 1.0)];
            }
        }
        let (mut water, mut whole) = (0.0, 0.0);
        for &(i, along_x) in &parts[0] {
            for &(j, along_y) in &parts[1] {
                for &(k, along_z) in &parts[2] {
                    let volume = along_x * along_y * along_z;
                    water += flow.porosity[flow.cells.cell([i, j, k])] * volume;
                    whole += volume;
                }
            }
        }
        water / whole
    }
}
