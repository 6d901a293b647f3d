//! The part of a flow that a domain holds.
//!
//! Owns the cut, and the places of axes. May use the flow. It deliberately cuts no cell: a domain begins and ends where
//! cells do.

use super::error::{Kind, ReadError};
use crate::diagnostic::number;
use crate::flow::{Cells, FaceFlow, Sink};

/// An edge of a domain may miss that of a cell by this part of the cell's width: files keep few digits.
const SAME: f64 = 1e-4;

/// An axis of a domain: 0, 1, 2 for x, y, z, and its ends in m.
pub type Extent = (usize, f64, f64);

/// A flow whose first axes are those of a domain, on the axes that these have.
pub fn placed(flow: FaceFlow, axes: &[Extent]) -> Result<FaceFlow, ReadError> {
    let mut edges = [vec![0.0, 1.0], vec![0.0, 1.0], vec![0.0, 1.0]];
    for (own, &(index, ..)) in axes.iter().enumerate() {
        edges[index].clone_from(&flow.cells.edges()[own]);
    }
    let cells = Cells::new(edges).ok_or_else(no_cells)?;
    let mut flux = [0, 1, 2].map(|axis| vec![0.0; cells.n_faces(axis)]);
    let mut given = flow.flux;
    for (own, &(index, ..)) in axes.iter().enumerate() {
        flux[index] = std::mem::take(&mut given[own]);
    }
    Ok(FaceFlow { cells, flux, ..flow })
}

fn no_cells() -> ReadError {
    ReadError::new(Kind::Mismatch, "the edges of the cells do not rise")
}

/// The cells within a domain, with its own numbers for the outer edges.
pub fn within(flow: FaceFlow, axes: &[Extent]) -> Result<FaceFlow, ReadError> {
    let (mut first, mut n) = ([0; 3], flow.cells.n());
    let mut edges = flow.cells.edges().clone();
    for &(index, low, high) in axes {
        let (from, to) = range(&edges[index], index, low, high)?;
        edges[index] = edges[index][from..=to].to_vec();
        edges[index][0] = low;
        edges[index][to - from] = high;
        (first[index], n[index]) = (from, to - from);
    }
    let cells = Cells::new(edges).ok_or_else(no_cells)?;
    if n == flow.cells.n() {
        return Ok(FaceFlow { cells, ..flow });
    }
    let old = |place: [usize; 3]| [0, 1, 2].map(|axis| place[axis] + first[axis]);
    let cell_of: Vec<usize> =
        (0..cells.n_cells()).map(|cell| flow.cells.cell(old(cells.place(cell)))).collect();
    let mut flux = [0, 1, 2].map(|axis| vec![0.0; cells.n_faces(axis)]);
    for (axis, flux) in flux.iter_mut().enumerate() {
        for cell in 0..cells.n_cells() {
            let place = cells.place(cell);
            let (low, high) = cells.faces(axis, place);
            let (old_low, old_high) = flow.cells.faces(axis, old(place));
            (flux[low], flux[high]) = (flow.flux[axis][old_low], flow.flux[axis][old_high]);
        }
    }
    let take = |values: &Vec<f64>| cell_of.iter().map(|&cell| values[cell]).collect();
    let is_inside =
        |place: [usize; 3]| (0..3).all(|axis| (first[axis]..first[axis] + n[axis]).contains(&place[axis]));
    let moved = |sink: &Sink| {
        let place = flow.cells.place(sink.cell);
        let new = || cells.cell([0, 1, 2].map(|axis| place[axis] - first[axis]));
        is_inside(place).then(|| Sink { cell: new(), ..*sink })
    };
    Ok(FaceFlow {
        flux,
        porosity: take(&flow.porosity),
        head: flow.head.as_ref().map(take),
        conductivity: flow.conductivity.as_ref().map(take),
        sinks: flow.sinks.iter().filter_map(moved).collect(),
        cells,
    })
}

/// The edges at which a domain begins and ends along an axis.
fn range(edges: &[f64], index: usize, low: f64, high: f64) -> Result<(usize, usize), ReadError> {
    let name = ["x", "y", "z"][index];
    let n = edges.len() - 1;
    let near = |at: f64| {
        let right = edges.partition_point(|&edge| edge < at).clamp(1, n);
        if at - edges[right - 1] < edges[right] - at { right - 1 } else { right }
    };
    let width = |edge: usize| {
        let below = edge.checked_sub(1).map_or(f64::INFINITY, |below| edges[edge] - edges[below]);
        let above = edges.get(edge + 1).map_or(f64::INFINITY, |above| above - edges[edge]);
        below.min(above)
    };
    let (from, to) = (near(low), near(high));
    let fits = |edge: usize, at: f64| (edges[edge] - at).abs() <= SAME * width(edge);
    if fits(from, low) && fits(to, high) && from < to {
        return Ok((from, to));
    }
    let tolerance = SAME * width(0).min(width(n));
    if edges[0] > low + tolerance || edges[n] < high - tolerance {
        let message = format!(
            "the cells of the flow reach from {} to {} m along {name}, the domain from {} to {} m",
            number(edges[0]),
            number(edges[n]),
            number(low),
            number(high)
        );
        return Err(ReadError::new(Kind::Points, message).help("the flow must cover the domain"));
    }
    let (edge, at) = if fits(from, low) { (to, high) } else { (from, low) };
    let message = format!("the domain has an end at {name} = {} m, within a cell of the flow", number(at));
    Err(ReadError::new(Kind::Points, message)
        .help(format!("let it begin or end where a cell does, such as at {} m", number(edges[edge]))))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 4 x 3 cells of 1 m by 2 m: water along x that gains 1 in the cell (2, 1) and turns there.
    fn flow() -> FaceFlow {
        let cells = Cells::equal([0.0; 3], [4.0, 6.0, 1.0], [4, 3, 1]).unwrap();
        let mut flux = [0, 1, 2].map(|axis| vec![0.0; cells.n_faces(axis)]);
        flux[0] = (0..15).map(f64::from).collect();
        flux[1] = (0..16).map(|face| 100.0 + f64::from(face)).collect();
        let porosity = (0..12).map(f64::from).collect();
        let sinks = vec![Sink { cell: 7, rate: 1.0, owner: 3 }, Sink { cell: 0, rate: 2.0, owner: 4 }];
        FaceFlow { cells, flux, porosity, head: None, conductivity: None, sinks }
    }

    #[test]
    fn a_domain_takes_its_cells_with_their_faces() {
        let part = within(flow(), &[(0, 1.0, 3.0), (1, 2.0, 6.0)]).unwrap();
        assert_eq!(part.cells.n(), [2, 2, 1]);
        assert_eq!(
            (part.cells.edges()[0].as_slice(), part.cells.edges()[1].as_slice()),
            ([1.0, 2.0, 3.0].as_slice(), [2.0, 4.0, 6.0].as_slice())
        );
        assert_eq!(part.flux[0], [4.0, 5.0, 7.0, 8.0, 10.0, 11.0]);
        assert_eq!(part.flux[1], [105.0, 106.0, 107.0, 109.0, 110.0, 111.0]);
        assert_eq!(part.porosity, [4.0, 5.0, 7.0, 8.0]);
        assert_eq!(part.sinks, [Sink { cell: 2, rate: 1.0, owner: 3 }]);
        let whole = within(flow(), &[(0, 0.0, 4.00001), (1, 0.0, 6.0)]).unwrap();
        assert_eq!((whole.cells.edges()[0][4], whole.porosity.len()), (4.00001, 12));
    }

    #[test]
    fn a_domain_that_is_not_covered_or_cuts_cells_is_refused() {
        let of = |x: (f64, f64)| within(flow(), &[(0, x.0, x.1), (1, 0.0, 6.0)]).unwrap_err().to_string();
        assert_eq!(
            of((0.0, 5.0)),
            "the cells of the flow reach from 0 to 4 m along x, the domain from 0 to 5 m; the flow must cover the domain"
        );
        assert!(of((-1.0, 4.0)).contains("the domain from -1 to 4 m"));
        assert_eq!(
            of((0.0, 2.4)),
            "the domain has an end at x = 2.4 m, within a cell of the flow; let it begin or end where a cell does, \
             such as at 2 m"
        );
        assert!(of((0.1, 0.2)).contains("within a cell"));
    }

    #[test]
    fn a_section_lies_along_x_and_z() {
        let section = placed(flow(), &[(0, 0.0, 4.0), (2, 0.0, 6.0)]).unwrap();
        assert_eq!(section.cells.n(), [4, 1, 3]);
        assert_eq!((section.flux[2][1], section.flux[1].len()), (101.0, 24));
    }
}
