//! Symmetric systems of conductances between nodes.
//!
//! Owns their storage, products and sums in fixed order. May use nothing else of the crate. It deliberately knows
//! no cells.

/// `A = diag(anchor + Σ conductance) − conductance`: rows of conductances to other nodes, and to what is fixed.
///
/// Conductances and anchors are not negative; kept apart from their sums, so that nothing cancels when nodes are joined.
#[derive(Debug, Clone, Default)]
pub struct Matrix {
    /// Row `i` is `start[i]..start[i + 1]`.
    pub start: Vec<u32>,
    pub node: Vec<u32>,
    pub conductance: Vec<f64>,
    pub anchor: Vec<f64>,
    pub diagonal: Vec<f64>,
}

impl Matrix {
    pub fn n(&self) -> usize {
        self.anchor.len()
    }

    pub fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let range = self.start[i] as usize..self.start[i + 1] as usize;
        (&self.node[range.clone()], &self.conductance[range])
    }

    /// Fills the diagonal from the rows.
    pub fn close(&mut self) {
        self.diagonal = (0..self.n()).map(|i| self.anchor[i] + self.row(i).1.iter().sum::<f64>()).collect();
    }

    /// `Σ_j t_ij x_j`.
    #[inline(always)]
    pub fn neighbours(&self, i: usize, x: &[f64]) -> f64 {
        let (nodes, conductances) = self.row(i);
        let mut sum = 0.0;
        for (&node, &conductance) in nodes.iter().zip(conductances) {
            sum += conductance * x[node as usize];
        }
        sum
    }

    /// `y = A x`.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        for (i, y) in y.iter_mut().enumerate() {
            *y = self.diagonal[i] * x[i] - self.neighbours(i, x);
        }
    }
}

/// `Σ x_i y_i` in eight lanes: wide, and in one order everywhere.
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    let (x_blocks, x_rest) = x.as_chunks::<8>();
    let (y_blocks, y_rest) = y.as_chunks::<8>();
    for (x, y) in x_blocks.iter().zip(y_blocks) {
        for lane in 0..8 {
            lanes[lane] += x[lane] * y[lane];
        }
    }
    lanes.iter().sum::<f64>() + x_rest.iter().zip(y_rest).map(|(x, y)| x * y).sum::<f64>()
}

/// `y += a x`.
pub fn add(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}
