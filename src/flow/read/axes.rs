//! A flow of three axes on those that a domain has.
//!
//! Owns the change of axes. May use the flow. It deliberately averages nothing: an axis goes only if it has a
//! single cell.

use super::error::{Kind, ReadError};
use crate::flow::{Cells, FaceFlow, Sink};

/// The owner of what crosses the outer faces along an axis that goes is this and the axis.
pub const ACROSS: usize = 1 << 32;

/// The flow on the axes in `keep`, in that order: `[0, 1]` is the map of a model with one layer, `[0, 2]` the
/// section of a model with one row. What crosses the outer faces along the other axes becomes sinks.
///
/// - Equation: `Q' = (Q + A (q_high − q_low)) / L`.
/// - Symbols: `Q` sink of a cell, `q` discharge through its two faces along an axis that goes, `A` their area,
///   `L` length of the cell along that axis.
/// - Range: axes with one cell; those kept rise, so that cells keep their numbers.
/// - Source: conservation of water.
/// - Shape: a flow with as many cells.
pub fn on_axes(flow: FaceFlow, keep: &[usize]) -> Result<FaceFlow, ReadError> {
    let n = flow.cells.n();
    let gone: Vec<usize> = (0..3).filter(|axis| !keep.contains(axis)).collect();
    let rises = keep.windows(2).all(|pair| pair[0] < pair[1]);
    if !rises || keep.is_empty() || keep.iter().any(|&axis| axis > 2) {
        return Err(ReadError::new(Kind::Mismatch, format!("{keep:?} are no axes in their order")));
    }
    if let Some(&axis) = gone.iter().find(|&&axis| n[axis] > 1) {
        let message = format!("the flow has {} cells along {}", n[axis], ["x", "y", "z"][axis]);
        return Err(ReadError::new(Kind::Mismatch, message)
            .help("a domain without that axis needs a flow with one cell along it"));
    }
    let length: f64 = gone.iter().map(|&axis| flow.cells.width(axis, 0)).product();
    let mut sinks: Vec<Sink> =
        flow.sinks.iter().map(|sink| Sink { rate: sink.rate / length, ..*sink }).collect();
    for &axis in &gone {
        for cell in 0..flow.cells.n_cells() {
            let place = flow.cells.place(cell);
            let (low, high) = flow.cells.faces(axis, place);
            let rate = flow.cells.face_area(axis, place) * (flow.flux[axis][high] - flow.flux[axis][low]);
            if rate != 0.0 {
                sinks.push(Sink { cell, rate: rate / length, owner: ACROSS + axis });
            }
        }
    }
    let mut edges = [vec![0.0, 1.0], vec![0.0, 1.0], vec![0.0, 1.0]];
    for (own, &axis) in keep.iter().enumerate() {
        edges[own].clone_from(&flow.cells.edges()[axis]);
    }
    let Some(cells) = Cells::new(edges) else {
        return Err(ReadError::new(Kind::Mismatch, "the edges of the cells do not rise"));
    };
    let mut flux = [0, 1, 2].map(|axis| vec![0.0; cells.n_faces(axis)]);
    for (own, &axis) in keep.iter().enumerate() {
        flux[own].clone_from(&flow.flux[axis]);
    }
    Ok(FaceFlow { cells, flux, sinks, ..flow })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A section of 3 x 2 cells, 4 m deep along y, with rain above and a well.
    fn section() -> FaceFlow {
        let cells = Cells::equal([0.0; 3], [6.0, 4.0, 1.0], [3, 1, 2]).unwrap();
        let mut flux = [0, 1, 2].map(|axis| vec![0.0; cells.n_faces(axis)]);
        flux[0] = vec![1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.5];
        flux[2] = vec![0.0, 0.0, 0.0, 0.0, 0.0, -0.25, 0.0, 0.0, 0.0];
        flux[1][7] = -0.5;
        let porosity = vec![0.3; 6];
        let sink = |cell, rate| Sink { cell, rate, owner: 1 };
        let sinks = vec![sink(2, 0.0), sink(4, 2.0)];
        FaceFlow { cells, flux, porosity, head: None, conductivity: None, sinks }
    }

    #[test]
    fn a_section_keeps_its_balance_per_metre() {
        let flow = section();
        let before = flow.imbalance();
        let turned = on_axes(flow, &[0, 2]).unwrap();
        assert_eq!(turned.cells.n(), [3, 2, 1]);
        assert_eq!(turned.flux[1][5], -0.25);
        for (after, before) in turned.imbalance().iter().zip(before) {
            assert!((after - before / 4.0).abs() < 1e-15);
        }
        // The face at y = 4 m of the cell above in the middle lets in 0.5 m/s through 1 m².
        let sinks: Vec<_> = turned.sinks.iter().map(|sink| (sink.cell, sink.rate, sink.owner)).collect();
        assert_eq!(sinks, [(2, 0.0, 1), (4, 0.5, 1), (3, -0.125, ACROSS + 1)]);
    }

    #[test]
    fn an_axis_with_cells_stays() {
        assert_eq!(on_axes(section(), &[0, 1]).unwrap_err().message, "the flow has 2 cells along z");
        assert!(on_axes(section(), &[2, 0]).is_err() && on_axes(section(), &[]).is_err());
        assert_eq!(on_axes(section(), &[0, 1, 2]).unwrap(), section());
    }
}
