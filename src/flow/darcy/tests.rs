//! Closed forms, and the statistics of random media.

use super::*;
use crate::flow::random_field::{Covariance, RandomField, lognormal};
use crate::maths::scalar::{exp, ln};

mod random;

/// Unit fall of the head along x, nothing through the other sides.
fn along_x(cells: Cells, conductivity: Vec<f64>) -> Problem {
    let n_cells = cells.n_cells();
    Problem {
        cells,
        conductivity,
        anisotropy: [1.0; 3],
        porosity: vec![0.3; n_cells],
        sides: [[Side::Head(1.0), Side::Head(0.0)], [Side::NoFlow; 2], [Side::NoFlow; 2]],
        wells: Vec::new(),
    }
}

fn unit_cells(n: [usize; 3]) -> Cells {
    Cells::equal([0.0; 3], n.map(|n| n as f64), n).unwrap()
}

/// Conductivity whose logarithm is a field of exponential covariance, 8 cells long.
fn random_medium(n: [usize; 3], variance: f64, seed: u64) -> Problem {
    let cells = unit_cells(n);
    let field = RandomField { covariance: Covariance::Exponential, variance, lengths: [8.0; 3], seed };
    let conductivity = lognormal(1.0, &field.realise(&cells).unwrap());
    along_x(cells, conductivity)
}

/// Edges whose distances grow and shrink.
fn uneven(n: usize) -> Vec<f64> {
    let mut edges = vec![-3.0];
    for k in 0..n {
        edges.push(edges[k] + 0.2 + ((k * 7) % 5) as f64);
    }
    edges
}

fn close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{found:e} is not {expected:e}");
}

/// Heads are linear and all fluxes are `K a ΔH/L`, whatever the cells, the axis and the datum: rounding only.
#[test]
fn constant_conductivity_is_exact() {
    let cells = Cells::new([uneven(12), uneven(7), uneven(9)]).unwrap();
    for axis in 0..3 {
        let mut problem = along_x(cells.clone(), vec![2e-5; cells.n_cells()]);
        problem.anisotropy = [1.0, 0.3, 0.01];
        problem.sides = [[Side::NoFlow; 2]; 3];
        problem.sides[axis] = [Side::Head(1000.5), Side::Head(999.75)];
        let flow = solve(problem.clone()).unwrap().flow;
        let edges = &cells.edges()[axis];
        let gradient = 0.75 / (edges[edges.len() - 1] - edges[0]);
        for flux in &flow.flux[axis] {
            close(*flux, 2e-5 * problem.anisotropy[axis] * gradient, 1e-12);
        }
        for (cell, head) in flow.head.unwrap().into_iter().enumerate() {
            let along = cells.centre(cells.place(cell))[axis] - edges[0];
            assert!((head - (1000.5 - gradient * along)).abs() < 1e-12 * 1000.0);
        }
    }
}

/// Layers along the flow: each has its own flux, and heads do not notice.
#[test]
fn layers_along_the_flow_share_its_gradient() {
    let cells = Cells::new([uneven(10), uneven(16), vec![0.0, 1.0]]).unwrap();
    let of_layer = |j: usize| exp(((j * 5) % 16) as f64 - 8.0);
    let conductivity = (0..cells.n_cells()).map(|cell| of_layer(cells.place(cell)[1])).collect();
    let edges = &cells.edges()[0];
    let gradient = 1.0 / (edges[10] - edges[0]);
    let flow = solve(along_x(cells.clone(), conductivity)).unwrap().flow;
    for (face, flux) in flow.flux[0].iter().enumerate() {
        close(*flux, of_layer(face % 16) * gradient, 1e-11);
    }
}

/// Layers across the flow: one flux, from the harmonic mean weighted by thickness.
#[test]
fn layers_across_the_flow_give_the_harmonic_mean() {
    let cells = Cells::new([uneven(40), uneven(3), vec![0.0, 1.0]]).unwrap();
    let of_layer = |i: usize| exp(((i * 11) % 17) as f64 - 8.0);
    let conductivity: Vec<f64> = (0..cells.n_cells()).map(|cell| of_layer(cells.place(cell)[0])).collect();
    let resistance: f64 = (0..40).map(|i| cells.width(0, i) / of_layer(i)).sum();
    let solution = solve(along_x(cells.clone(), conductivity.clone())).unwrap();
    for flux in &solution.flow.flux[0] {
        close(*flux, 1.0 / resistance, 1e-11);
    }
    // The same water as an inflow: the head it needs is the one that was fixed.
    let mut problem = along_x(cells, conductivity);
    problem.sides[0][0] = Side::Inflow(1.0 / resistance);
    let again = solve(problem).unwrap();
    for (head, fixed) in again.flow.head.unwrap().into_iter().zip(solution.flow.head.unwrap()) {
        close(head, fixed, 1e-10);
    }
}

/// Thiem's drawdown `Q/(2πK) ln(r₂/r₁)` around a well 200 cells from the sides, and Peaceman's radius of the cell
/// itself: for the five-point grid `e^{−γ}/√8` cells. The grid errs by `cos 4θ/(12 r²)` of the factor, 2e-4 at 20
/// cells; the square of fixed heads by `(r/200)⁴`, 6e-4 at 30.
#[test]
fn the_drawdown_of_a_well_is_that_of_thiem() {
    let n = 401;
    let cells = unit_cells([n, n, 1]);
    let mut problem = along_x(cells.clone(), vec![1.0; n * n]);
    problem.sides = [[Side::Head(10.0); 2], [Side::Head(10.0); 2], [Side::NoFlow; 2]];
    problem.wells =
        wells(&cells, &problem.conductivity, [200.5, 200.5, 0.5], [200.5, 200.5, 0.5], -0.5).unwrap();
    let flow = solve(problem).unwrap().flow;
    let head = flow.head.as_ref().unwrap();
    let at = |i: usize, j: usize| head[cells.cell([200 + i, 200 + j, 0])];
    let factor = 0.5 / std::f64::consts::TAU;
    close(at(30, 0) - at(15, 0), factor * ln(2.0), 2e-3);
    close(at(16, 12) - at(8, 6), factor * ln(2.0), 2e-3);
    const PEACEMAN: f64 = 0.198_506;
    close(at(20, 0) - at(0, 0), factor * ln(20.0 / PEACEMAN), 1e-3);
    let sink = crate::flow::Sink { cell: cells.cell([200, 200, 0]), rate: 0.5, owner: 0 };
    assert_eq!(flow.sinks, [sink]);
    close(flow.through_flow(), 0.5, 1e-12);
}

/// The parts of a screen share its rate as `K l`, and parts of cells count as parts.
#[test]
fn a_screen_shares_its_rate_by_transmissivity() {
    let cells = Cells::new([vec![0.0, 1.0], vec![0.0, 1.0], vec![0.0, 2.0, 3.0, 7.0]]).unwrap();
    let found = wells(&cells, &[1.0, 4.0, 0.5], [0.5, 0.5, 1.0], [0.5, 0.5, 5.0], -3.0).unwrap();
    let expected = [(0, -0.5), (1, -2.0), (2, -0.5)];
    assert_eq!(found.len(), 3);
    for (well, (cell, rate)) in found.iter().zip(expected) {
        assert_eq!(well.cell, cell);
        close(well.rate, rate, 1e-15);
    }
    let outside = wells(&cells, &[1.0; 3], [0.5, 0.5, 1.0], [0.5, 0.5, 7.1], -3.0);
    assert!(matches!(outside, Err(DarcyError::WellOutside { .. })));
}

/// A periodic medium that is turned by some cells gives the flow turned by as many.
#[test]
fn periodic_sides_have_no_place_of_their_own() {
    let n = [24, 18, 1];
    let base = random_medium(n, 1.0, 3);
    let turned = |by: [usize; 2]| {
        let mut problem = base.clone();
        let cells = &base.cells;
        problem.sides[0] = [Side::Periodic { fall: 2.0 }; 2];
        problem.sides[1] = [Side::Periodic { fall: 0.0 }; 2];
        for (cell, value) in problem.conductivity.iter_mut().enumerate() {
            let [i, j, _] = cells.place(cell);
            *value = base.conductivity[cells.cell([(i + by[0]) % n[0], (j + by[1]) % n[1], 0])];
        }
        solve(problem).unwrap()
    };
    let (first, second) = (turned([0, 0]), turned([7, 11]));
    for i in 0..n[0] {
        for j in 0..n[1] {
            let other = [(i + 24 - 7) % 24, (j + 18 - 11) % 18, 0];
            for axis in 0..2 {
                let (face, _) = base.cells.faces(axis, [i, j, 0]);
                let (other, _) = base.cells.faces(axis, other);
                let difference = first.flow.flux[axis][face] - second.flow.flux[axis][other];
                assert!(difference.abs() < 1e-11, "{difference}");
            }
        }
    }
    // One cell around itself: the fall alone.
    let mut problem = along_x(unit_cells([1, 3, 1]), vec![2.0; 3]);
    problem.sides[0] = [Side::Periodic { fall: 0.5 }; 2];
    assert_eq!(solve(problem).unwrap().flow.flux[0], [1.0; 6]);
}

/// Without a fixed head what flows in must flow out; then heads are those of the pair, less that of the first cell.
#[test]
fn without_a_fixed_head_flows_must_add_up() {
    let mut problem = random_medium([30, 20, 1], 1.0, 5);
    problem.sides[0] = [Side::Inflow(1e-6), Side::NoFlow];
    problem.wells = vec![Well { cell: 333, rate: -2e-5 }];
    let solution = solve(problem.clone()).unwrap();
    assert!(solution.worst_imbalance < 1e-12);
    assert!(solution.flow.head.unwrap()[0].abs() < 1e-12);
    problem.wells[0].rate = -2.1e-5;
    assert!(matches!(solve(problem), Err(DarcyError::NoFixedHead { .. })));
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    let sound = random_medium([8, 4, 2], 1.0, 5);
    let error = |change: &dyn Fn(&mut Problem)| {
        let mut problem = sound.clone();
        change(&mut problem);
        solve(problem).unwrap_err()
    };
    let place = error(&|problem| problem.conductivity[13] = 0.0);
    assert_eq!(place, DarcyError::Conductivity { place: [1, 2, 1], centre: [1.5, 2.5, 1.5], value: 0.0 });
    assert!(matches!(
        error(&|problem| problem.conductivity[0] = f64::NAN),
        DarcyError::Conductivity { place: [0, 0, 0], .. }
    ));
    assert_eq!(
        error(&|problem| problem.anisotropy[2] = -1.0),
        DarcyError::Anisotropy { axis: 2, value: -1.0 }
    );
    assert_eq!(
        error(&|problem| problem.sides[1][1] = Side::Head(f64::INFINITY)),
        DarcyError::Side { axis: 1, upper: true }
    );
    assert_eq!(
        error(&|problem| problem.sides[1][1] = Side::Periodic { fall: 0.0 }),
        DarcyError::Periodic { axis: 1 }
    );
    assert_eq!(
        error(&|problem| problem.wells = vec![Well { cell: 64, rate: 1.0 }]),
        DarcyError::WellCell { well: 0, cell: 64 }
    );
    assert!(matches!(error(&|problem| problem.porosity.truncate(63)), DarcyError::Length { found: 63, .. }));
}

/// Nothing drives, nothing flows.
#[test]
fn still_water_stays_still() {
    let mut problem = random_medium([8, 4, 2], 4.0, 5);
    problem.sides[0] = [Side::Head(3.0); 2];
    let solution = solve(problem).unwrap();
    assert!(solution.flow.flux.iter().flatten().all(|&flux| flux == 0.0));
    assert!(solution.flow.head.unwrap().iter().all(|&head| head == 3.0));
}
