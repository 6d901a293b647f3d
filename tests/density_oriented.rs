//! Kernels along directions: methods 3.4 and 10.2, P2-c. What is expected follows from closed forms and from symmetries; bounds
//! of noise from the scatter between samples.

#[path = "support/draws.rs"]
mod draws;

use draws::Draws;
use lamella::engine::density::*;
use lamella::maths::scalar::{cos, exp, sin};
use lamella::maths::wide::Width;
use std::f64::consts::PI;

const CLOSED: [End; 2] = [End::Mirror; 2];
const RING: [End; 2] = [End::Wrap; 2];

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard error of a mean.
fn scatter(values: &[f64]) -> f64 {
    let own = mean(values);
    let square: f64 = values.iter().map(|value| (value - own) * (value - own)).sum();
    (square / (values.len() * (values.len() - 1)) as f64).sqrt()
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}

/// A direction in a plane, by its angle.
fn towards(angle: f64) -> Orientation {
    Orientation::All([0.0, cos(angle), sin(angle)])
}

/// A normal cloud of standard deviations 20 and 5 whose long axis is turned: relative L2 errors by sample. The same draws at any
/// angle.
fn errors(angle: f64, orientation: &Orientation) -> Vec<f64> {
    const N: usize = 10_000;
    const CELLS: [usize; 2] = [200, 200];
    let (c, s) = (cos(angle), sin(angle));
    let of_sample = |sample: u64| {
        let lattice = Lattice::new(&CELLS.map(|n| (n, 1.0, CLOSED))).unwrap();
        let mut draws = Draws(7919 * sample + 5);
        let mut x = [Vec::new(), Vec::new()];
        for _ in 0..N {
            let (along, across) = (20.0 * draws.normal(), 5.0 * draws.normal());
            x[0].push(100.0 + c * along - s * across);
            x[1].push(100.0 + s * along + c * across);
        }
        let tally = Tally::of(&lattice, &[0.0, 0.0], &[&x[0], &x[1]], None);
        let adaptive = Adaptive { tolerance: 1e-3, orientation: orientation.clone(), ..Adaptive::default() };
        let found = estimate(&lattice, &tally, &adaptive, Width::widest());
        let truth = |cell: usize| {
            let (x, y) = ((cell / CELLS[1]) as f64 - 99.5, (cell % CELLS[1]) as f64 - 99.5);
            let (along, across) = ((c * x + s * y) / 20.0, (c * y - s * x) / 5.0);
            N as f64 * exp(-0.5 * (along * along + across * across)) / (2.0 * PI * 100.0)
        };
        let error = norm(found.density.iter().enumerate().map(|(cell, own)| own - truth(cell)));
        error / norm((0..found.density.len()).map(truth))
    };
    (0..12).map(of_sample).collect()
}

/// P2-c: a turned cloud is as right with kernels that follow it as one along an axis, and worse with kernels along axes.
#[test]
fn a_turned_cloud_is_as_right_as_one_along_an_axis() {
    let along_axis = errors(0.0, &Orientation::Axes);
    let angle = PI / 6.0;
    let (turned, untold) = (errors(angle, &towards(angle)), errors(angle, &Orientation::Axes));
    let noise = (scatter(&along_axis) * scatter(&along_axis) + scatter(&turned) * scatter(&turned)).sqrt();
    let change = mean(&turned) - mean(&along_axis);
    assert!(change.abs() < 2.0 * noise, "{} for {} ± {noise}", mean(&turned), mean(&along_axis));
    let pairs = || turned.iter().zip(&untold);
    assert!(pairs().all(|(own, other)| other > own), "{turned:?}, {untold:?}");
    assert!(mean(&untold) > 1.15 * mean(&turned), "{} for {}", mean(&untold), mean(&turned));
}

/// The error of a cloud and of kernels that are turned together hangs on no angle.
#[test]
fn no_direction_is_preferred() {
    let of = |angle: f64| errors(angle, &towards(angle));
    let along_axis = of(0.0);
    for degrees in [45.0, 90.0, 155.0] {
        let own = of(degrees * PI / 180.0);
        let change: Vec<f64> = own.iter().zip(&along_axis).map(|(own, other)| own - other).collect();
        // The same particles: cells alone differ.
        assert!(mean(&change).abs() < 0.03 * mean(&along_axis), "{degrees}: {change:?}");
    }
}

/// In space a cloud that is long along (2, 2, 1) is as right with kernels that follow it as one along an axis is with those.
#[test]
fn in_space_a_turned_cloud_is_as_right_as_one_along_an_axis() {
    const N: usize = 10_000;
    const CELLS: usize = 56;
    let of = |axes: [[f64; 3]; 3], orientation: Orientation, sample: u64| {
        let lattice = Lattice::new(&[(CELLS, 1.0, CLOSED); 3]).unwrap();
        let (mut draws, middle) = (Draws(31 * sample + 1), 0.5 * CELLS as f64);
        let mut x = [Vec::new(), Vec::new(), Vec::new()];
        for _ in 0..N {
            let own = [8.0 * draws.normal(), 3.0 * draws.normal(), 3.0 * draws.normal()];
            for (i, x) in x.iter_mut().enumerate() {
                x.push(middle + (0..3).map(|k| own[k] * axes[k][i]).sum::<f64>());
            }
        }
        let tally = Tally::of(&lattice, &[0.0; 3], &[&x[0], &x[1], &x[2]], None);
        let found =
            estimate(&lattice, &tally, &Adaptive { orientation, ..Adaptive::default() }, Width::widest());
        let truth = |idx: usize| {
            let place = lattice.cell(idx).map(|at| at as f64 + 0.5 - middle);
            let square = |k: usize, deviation: f64| {
                let own = (0..3).map(|i| place[i] * axes[k][i]).sum::<f64>() / deviation;
                own * own
            };
            let all = square(0, 8.0) + square(1, 3.0) + square(2, 3.0);
            N as f64 * exp(-0.5 * all) / ((2.0 * PI) * (2.0 * PI).sqrt() * 72.0)
        };
        norm(found.density.iter().enumerate().map(|(idx, own)| own - truth(idx)))
            / norm((0..found.density.len()).map(truth))
    };
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let turned =
        [[2.0, 2.0, 1.0], [-2.0, 1.0, 2.0], [1.0, -2.0, 2.0]].map(|axis| axis.map(|part| part / 3.0));
    for sample in 0..2 {
        let along_axis = of(unit, Orientation::Axes, sample);
        let own = of(turned, Orientation::All([2.0, 2.0, 1.0]), sample);
        let untold = of(turned, Orientation::Axes, sample);
        assert!((own / along_axis - 1.0).abs() < 0.05, "{own} for {along_axis}");
        assert!(untold > 1.1 * own, "{untold} for {own}");
    }
}

/// Clouds that lean on walls, in a plane or in space, with a bend.
fn cloud(d: usize, n: usize, ends: [End; 2], edges: [f64; 3]) -> (Lattice, Tally) {
    let cells = [[1, 1, 1], [90, 70, 1], [40, 36, 24]][d - 1];
    let axes: Vec<(usize, f64, [End; 2])> = (0..d).map(|axis| (cells[axis], edges[axis], ends)).collect();
    let lattice = Lattice::new(&axes).unwrap();
    let mut draws = Draws(n as u64);
    let mut positions = vec![Vec::new(); d];
    for particle in 0..n {
        let wide = if particle % 3 == 0 { 2.0 } else { 1.0 };
        for axis in 0..d {
            let length = cells[axis] as f64 * edges[axis];
            positions[axis].push((length * (0.25 + [0.11, 0.05, 0.07][axis] * wide * draws.normal())).abs());
        }
    }
    let positions: Vec<&[f64]> = positions.iter().map(|own| &own[..]).collect();
    let tally = Tally::of(&lattice, &[0.0; 3][..d], &positions, None);
    (lattice, tally)
}

/// A direction per cell that turns from cell to cell; every seventh has none.
fn turning(lattice: &Lattice, tally: &Tally) -> Orientation {
    let of = |(at, &idx): (usize, &u32)| {
        let [x, y, z] = lattice.cell(idx as usize);
        let angle = 0.05 * (x + y) as f64 + 0.02 * z as f64;
        let up = if lattice.d == 3 { 0.3 } else { 0.0 };
        let direction =
            if lattice.d == 3 { [cos(angle), sin(angle), up] } else { [0.0, cos(angle), sin(angle)] };
        if at % 7 == 0 { [0.0; 3] } else { direction.map(|part| 1e-5 * part) }
    };
    Orientation::Each(tally.cells.iter().enumerate().map(of).collect())
}

/// Between walls, and where ends are joined, nothing is lost.
#[test]
fn mass_stays() {
    for (d, n) in [(2, 5_000), (3, 3_000)] {
        for (ends, edges) in
            [(CLOSED, [1.0; 3]), (RING, [1.0; 3]), (CLOSED, [1.0, 0.2, 0.5]), (RING, [0.3, 1.0, 2.0])]
        {
            let (lattice, tally) = cloud(d, n, ends, edges);
            for is_fast in if d == 2 { &[true, false][..] } else { &[true] } {
                let orientation = turning(&lattice, &tally);
                let adaptive =
                    Adaptive { is_fast: *is_fast, most_loops: 3, orientation, ..Adaptive::default() };
                let found = estimate(&lattice, &tally, &adaptive, Width::widest());
                let total = found.density.iter().sum::<f64>() * lattice.volume();
                let mass = tally.mass();
                assert!((total / mass - 1.0).abs() < 1e-12, "{d}-D, {ends:?}, {edges:?}: {total} of {mass}");
                let is_sound = |value: &f64| value.is_finite() && *value >= 0.0;
                assert!(found.density.iter().chain(&found.standard_error).all(is_sound));
            }
        }
    }
}

/// Along an axis kernels are those of the axes, but for curvatures that are found with kernels of another shape: a density
/// changes by less than a fifth of what it scatters by, which would add 2 % to its error.
#[test]
fn along_axes_it_is_the_same() {
    for (d, n, edges) in [
        (2, 20_000, [1.0; 3]),
        (2, 20_000, [1.0, 0.05, 1.0]),
        (2, 1_000, [1.0; 3]),
        (3, 20_000, [1.0; 3]),
        (3, 20_000, [1.0, 1.0, 0.1]),
    ] {
        let (lattice, tally) = cloud(d, n, CLOSED, edges);
        for is_fast in [true, false] {
            if d == 3 && !is_fast {
                continue;
            }
            let of = |orientation: Orientation| {
                let adaptive =
                    Adaptive { orientation, is_fast, tolerance: 0.0, most_loops: 6, ..Adaptive::default() };
                estimate(&lattice, &tally, &adaptive, Width::widest())
            };
            let expected = of(Orientation::Axes);
            for axis in lattice.axes() {
                let mut direction = [0.0; 3];
                direction[axis] = -3.0;
                let found = of(Orientation::All(direction));
                let pairs = || found.density.iter().zip(&expected.density);
                let change = norm(pairs().map(|(own, other)| own - other))
                    / norm(expected.standard_error.iter().copied());
                assert!(change < 0.2, "{d}-D, {n}, {edges:?}, fast {is_fast}, axis {axis}: {change}");
            }
        }
    }
}

/// A quarter turn, and a mirror, of everything.
#[test]
fn turned_and_mirrored_clouds_have_turned_and_mirrored_densities() {
    const N: usize = 80;
    let mut draws = Draws(3);
    let points: Vec<[f64; 2]> = (0..3000)
        .map(|_| {
            let (along, across) = (12.0 * draws.normal(), 4.0 * draws.normal());
            [(0.9 * along - 0.4 * across).clamp(-39.9, 39.9), (0.4 * along + 0.9 * across).clamp(-39.9, 39.9)]
        })
        .collect();
    let of = |turn: &dyn Fn([f64; 2]) -> [f64; 2], is_fast: bool| {
        let lattice = Lattice::new(&[(N, 1.0, CLOSED), (N, 1.0, CLOSED)]).unwrap();
        let points: Vec<[f64; 2]> = points.iter().map(|point| turn(*point)).collect();
        let x = [0, 1].map(|axis| points.iter().map(|point| point[axis]).collect::<Vec<f64>>());
        let tally = Tally::of(&lattice, &[-40.0, -40.0], &[&x[0], &x[1]], None);
        let [y, z] = turn([0.9, 0.4]);
        let orientation = Orientation::All([0.0, y, z]);
        let adaptive =
            Adaptive { orientation, is_fast, tolerance: 0.0, most_loops: 4, ..Adaptive::default() };
        estimate(&lattice, &tally, &adaptive, Width::widest()).density
    };
    for is_fast in [false, true] {
        let expected = of(&|point| point, is_fast);
        let most = expected.iter().fold(0.0, |most: f64, own| most.max(*own));
        let quarter = of(&|[x, y]| [-y, x], is_fast);
        let mirrored = of(&|[x, y]| [x, -y], is_fast);
        for (cell, density) in expected.iter().enumerate() {
            let (x, y) = (cell / N, cell % N);
            for own in [quarter[(N - 1 - y) * N + x], mirrored[x * N + N - 1 - y]] {
                assert!((own - density).abs() < 1e-9 * most, "fast {is_fast}, {x}, {y}: {own} for {density}");
            }
        }
    }
}

/// A wall is as good as a mirrored cloud behind it, whose directions are mirrored, too.
#[test]
fn walls_mirror_clouds_and_directions() {
    // Deep enough that the other axis bounds all widths.
    const HALF: usize = 100;
    let mut draws = Draws(9);
    let points: Vec<[f64; 2]> = (0..2000)
        .map(|_| {
            let (along, across) = (9.0 * draws.normal(), 2.0 * draws.normal());
            let (x, y) = (9.0 + 0.8 * along - 0.6 * across, 40.0 + 0.6 * along + 0.8 * across);
            [x.abs(), y.clamp(1.0, 79.0)]
        })
        .collect();
    let of = |is_doubled: bool| {
        let cells = if is_doubled { 2 * HALF } else { HALF };
        let lattice = Lattice::new(&[(cells, 1.0, CLOSED), (80, 1.0, CLOSED)]).unwrap();
        let mut x = [Vec::new(), Vec::new()];
        for [distance, y] in &points {
            let sides: &[f64] = if is_doubled { &[1.0, -1.0] } else { &[1.0] };
            for side in sides {
                x[0].push(side * distance);
                x[1].push(*y);
            }
        }
        let low = if is_doubled { -(HALF as f64) } else { 0.0 };
        let tally = Tally::of(&lattice, &[low, 0.0], &[&x[0], &x[1]], None);
        let direction = |&idx: &u32| {
            let is_behind = is_doubled && (lattice.cell(idx as usize)[1]) < HALF;
            [0.0, if is_behind { -0.8 } else { 0.8 }, 0.6]
        };
        let orientation = Orientation::Each(tally.cells.iter().map(direction).collect());
        let start = Start::Bandwidth(1.5);
        let adaptive = Adaptive {
            orientation,
            start,
            is_fast: false,
            tolerance: 0.0,
            most_loops: 4,
            ..Adaptive::default()
        };
        let bounds = Some([0.4, 20.0]);
        estimate(&lattice, &tally, &Adaptive { bounds, ..adaptive }, Width::widest())
    };
    let (wall, doubled) = (of(false), of(true));
    let most = wall.density.iter().fold(0.0, |most: f64, own| most.max(*own));
    for (cell, density) in wall.density.iter().enumerate() {
        let expected = doubled.density[cell + HALF * 80];
        assert!((density - expected).abs() < 1e-9 * most, "{cell}: {density} for {expected}");
    }
    // Somewhere kernels are longer than wide, and not along an axis.
    let is_turned = |cell: &Cell| cell.s[1] > 1.3 * cell.s[2] && cell.matrix()[1][2] > 1.0;
    assert!(wall.cells.iter().any(is_turned));
}

/// What is told of kernels is what the density is made of: a sum of Gaussians with their covariance, as wide as cells more. The
/// rest is what is beyond three standard deviations.
#[test]
fn a_density_is_the_sum_of_the_kernels_that_are_told() {
    for edges in [[1.0, 1.0], [1.0, 0.25], [0.2, 3.0]] {
        let lattice = Lattice::new(&[(60, edges[0], CLOSED), (60, edges[1], CLOSED)]).unwrap();
        let mut draws = Draws(21);
        let mut x = [Vec::new(), Vec::new()];
        for _ in 0..400 {
            let (along, across) = (6.0 * draws.normal(), 3.0 * draws.normal());
            x[0].push(edges[0] * (30.0 + along));
            x[1].push(edges[1] * (30.0 + 0.5 * along + across));
        }
        let tally = Tally::of(&lattice, &[0.0, 0.0], &[&x[0], &x[1]], None);
        let direction = [0.0, edges[0], 0.5 * edges[1]];
        let adaptive = Adaptive { orientation: Orientation::All(direction), ..Adaptive::default() };
        let found = estimate(&lattice, &tally, &adaptive, Width::widest());
        let mut expected = vec![0.0; found.density.len()];
        for (cell, count) in found.cells.iter().zip(&tally.counts) {
            let along = cell.axes[1][1] * direction[1] + cell.axes[1][2] * direction[2];
            assert!(
                (along * along / (direction[1] * direction[1] + direction[2] * direction[2]) - 1.0).abs()
                    < 1e-12
            );
            let [_, [_, mut a, b], [_, _, mut c]] = cell.matrix();
            a += edges[0] * edges[0] / 12.0;
            c += edges[1] * edges[1] / 12.0;
            let determinant = a * c - b * b;
            for (idx, sum) in expected.iter_mut().enumerate() {
                let [_, i, j] = lattice.cell(idx);
                let x = edges[0] * (i as f64 - cell.at[1] as f64);
                let y = edges[1] * (j as f64 - cell.at[2] as f64);
                let square = (c * x * x - 2.0 * b * x * y + a * y * y) / determinant;
                *sum += count * exp(-0.5 * square) / (2.0 * PI * determinant.sqrt());
            }
        }
        let change = norm(found.density.iter().zip(&expected).map(|(own, other)| own - other));
        assert!(
            change < 0.01 * norm(expected.iter().copied()),
            "{edges:?}: {}",
            change / norm(expected.into_iter())
        );
    }
}

/// An axis of one cell is left out, and the part of a direction along it; what is told is told on the axes that there are.
#[test]
fn an_axis_of_one_cell_is_left_out() {
    let mut draws = Draws(4);
    let x: Vec<f64> = (0..2000).map(|_| 20.0 + 5.0 * draws.normal()).collect();
    let z: Vec<f64> = x.iter().map(|x| 4.0 + 0.1 * x + 1.0 * draws.normal()).collect();
    let half = vec![0.5; x.len()];
    let adaptive = |orientation: Orientation| Adaptive { orientation, ..Adaptive::default() };
    let plane = Lattice::new(&[(40, 1.0, CLOSED), (30, 0.4, CLOSED)]).unwrap();
    let tally = Tally::of(&plane, &[0.0, 0.0], &[&x, &z], None);
    let along = Orientation::All([0.0, 1.0, 0.1]);
    let expected = estimate(&plane, &tally, &adaptive(along), Width::widest());
    let space = Lattice::new(&[(40, 1.0, CLOSED), (1, 7.0, CLOSED), (30, 0.4, CLOSED)]).unwrap();
    let tally = Tally::of(&space, &[0.0; 3], &[&x, &half, &z], None);
    let found = estimate(&space, &tally, &adaptive(Orientation::All([1.0, 9.0, 0.1])), Width::widest());
    for (own, expected) in found.density.iter().zip(&expected.density) {
        assert!((7.0 * own - expected).abs() <= 1e-12 * expected, "{own} for {expected}");
    }
    for (own, expected) in found.cells.iter().zip(&expected.cells) {
        assert_eq!(own.axes[1], [0.0; 3]);
        let (own, expected) = (own.matrix(), expected.matrix());
        let pairs = [(own[0][0], expected[1][1]), (own[0][2], expected[1][2]), (own[2][2], expected[2][2])];
        let (most, none) = (expected[1][1], own[1]);
        assert!(pairs.iter().all(|(own, other)| (own - other).abs() < 1e-12 * most), "{pairs:?}");
        assert_eq!(none, [0.0; 3]);
    }
    assert!(expected.cells.iter().any(|cell| cell.matrix()[1][2] > 0.1));
}

/// Without a direction kernels are round: those of a cloud without any are those of round kernels, but for how curvatures are
/// found; and cells with and without stand side by side.
#[test]
fn stagnant_cells_have_round_kernels() {
    let (lattice, tally) = cloud(2, 20_000, CLOSED, [1.0; 3]);
    let of = |adaptive: Adaptive| {
        let adaptive = Adaptive { tolerance: 0.0, most_loops: 6, ..adaptive };
        estimate(&lattice, &tally, &adaptive, Width::widest())
    };
    let round = of(Adaptive { shape: Shape::Round, ..Adaptive::default() });
    for none in [[0.0; 3], [0.0, f64::NAN, 1.0], [0.0, f64::INFINITY, 0.0], [5.0, 0.0, 0.0]] {
        let found = of(Adaptive { orientation: Orientation::All(none), ..Adaptive::default() });
        assert!(found.cells.iter().all(|cell| cell.is_stagnant && cell.s == [1.0; 3]), "{none:?}");
        let pairs = || found.density.iter().zip(&round.density);
        let change =
            norm(pairs().map(|(own, other)| own - other)) / norm(round.standard_error.iter().copied());
        assert!(change < 0.2, "{none:?}: {change}");
    }
    let orientation = turning(&lattice, &tally);
    let found = of(Adaptive { orientation, ..Adaptive::default() });
    for (at, cell) in found.cells.iter().enumerate() {
        assert_eq!(cell.is_stagnant, at % 7 == 0);
        assert!(!cell.is_stagnant || cell.s == [1.0; 3]);
    }
    assert!(found.cells.iter().any(|cell| cell.s[1] > 1.3 * cell.s[2]));
}

/// One, two and three threads, wide code and narrow.
#[test]
fn bits_hang_neither_on_threads_nor_on_vectors() {
    for (d, ends) in [(2, CLOSED), (3, RING), (2, [End::Sink, End::Mirror])] {
        let (lattice, tally) = cloud(d, 3_000, ends, [1.0, 0.7, 0.4]);
        for is_fast in [true, false] {
            let bits = |threads: usize, width: Width| -> Vec<u64> {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                let orientation = turning(&lattice, &tally);
                let adaptive =
                    Adaptive { is_fast, orientation, most_loops: 2, tolerance: 0.0, ..Adaptive::default() };
                let found = pool.install(|| estimate(&lattice, &tally, &adaptive, width));
                assert!(found.density.iter().all(|own| own.is_finite() && *own >= 0.0));
                found.density.iter().chain(&found.standard_error).map(|value| value.to_bits()).collect()
            };
            let one = bits(1, Width::widest());
            for (threads, width) in [(2, Width::widest()), (3, Width::widest()), (2, Width::baseline())] {
                assert!(
                    one == bits(threads, width),
                    "{d}-D, fast {is_fast}, {threads} threads, {}",
                    width.name()
                );
            }
        }
    }
}
