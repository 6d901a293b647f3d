//! Walls at which a density is held at a value: methods 4.7 and 10.3, P3-d. Profiles that are expected are those that points were
//! drawn from.

#[path = "support/draws.rs"]
mod draws;

use draws::Draws;
use lamella::engine::density::*;
use lamella::maths::wide::Width;

const CLOSED: [End; 2] = [End::Mirror; 2];

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Places on [0, 1] whose density is `low + 2 (1 − low) x`, by the inverse of its integral.
fn of_line(low: f64, draws: &mut Draws) -> f64 {
    let slope = 2.0 * (1.0 - low);
    ((low * low + 2.0 * slope * draws.uniform()).sqrt() - low) / slope
}

/// P3-d: between walls that hold both ends of a line the line is found, in cells at the walls to 3 % of the density there (the bar of
/// walls that mirror). Mirrors make it level there, and are off by several times what it changes by within a cell.
#[test]
fn a_line_between_walls_is_found() {
    const N: usize = 100_000;
    const CELLS: usize = 200;
    let per_cell = 1.0 / CELLS as f64;
    for low in [0.1, 0.5] {
        let slope = 2.0 * (1.0 - low);
        let within = slope * per_cell;
        for is_fast in [true, false] {
            let (mut of_mirrors, mut rests) = (Vec::new(), [Vec::new(), Vec::new()]);
            for sample in 1..7 {
                let mut draws = Draws(sample);
                let x: Vec<f64> = (0..N).map(|_| of_line(low, &mut draws)).collect();
                let held = [low, 2.0 - low].map(|value| End::Held(value * N as f64));
                for (place, ends) in [held, CLOSED].into_iter().enumerate() {
                    let lattice = Lattice::new(&[(CELLS, per_cell, ends)]).unwrap();
                    let tally = Tally::of(&lattice, &[0.0], &[&x], None);
                    let adaptive = Adaptive { is_fast, ..Adaptive::default() };
                    let found = estimate(&lattice, &tally, &adaptive, Width::widest());
                    let off = |cell: usize| {
                        found.density[cell] / N as f64 - low - slope * per_cell * (cell as f64 + 0.5)
                    };
                    // About a bandwidth.
                    let near = (0..10).chain(CELLS - 10..CELLS);
                    rests[place].push(near.map(|cell| off(cell) * off(cell)).sum::<f64>());
                    let at_walls = [off(0), off(CELLS - 1)].map(f64::abs);
                    match place {
                        0 => {
                            let bars = [low, 2.0 - low].map(|wall| 0.03 * wall);
                            assert!(
                                at_walls.iter().zip(bars).all(|(off, bar)| *off < bar),
                                "{low}, {is_fast}: {at_walls:?}"
                            )
                        }
                        _ => of_mirrors.extend(at_walls),
                    }
                }
            }
            assert!(mean(&of_mirrors) > 2.0 * within, "{low}, fast {is_fast}: {of_mirrors:?}, {within}");
            assert!(mean(&rests[0]) < mean(&rests[1]), "{low}, fast {is_fast}: {rests:?}");
        }
    }
}

/// In a plane, with kernels along axes and along a direction that meets the walls aslant.
#[test]
fn a_slope_between_walls_is_found_in_a_plane() {
    const N: usize = 50_000;
    const CELLS: [usize; 2] = [60, 40];
    let (low, slope) = (0.4, 1.2);
    let mut draws = Draws(5);
    let x: Vec<f64> = (0..N).map(|_| of_line(low, &mut draws)).collect();
    let y: Vec<f64> = (0..N).map(|_| 0.7 * draws.uniform()).collect();
    let unit = N as f64 / 0.7;
    let off_by = |ends: [End; 2], orientation: Orientation| {
        let lattice = Lattice::new(&[(CELLS[0], 1.0 / 60.0, ends), (CELLS[1], 0.7 / 40.0, CLOSED)]).unwrap();
        let tally = Tally::of(&lattice, &[0.0, 0.0], &[&x, &y], None);
        let adaptive = Adaptive { orientation, ..Adaptive::default() };
        let found = estimate(&lattice, &tally, &adaptive, Width::widest());
        let of_row = |row: usize| {
            let truth = low + slope * (row as f64 + 0.5) / 60.0;
            let offs =
                found.density[row * CELLS[1]..(row + 1) * CELLS[1]].iter().map(|own| own / unit - truth);
            mean(&offs.collect::<Vec<f64>>()).abs()
        };
        [of_row(0), of_row(CELLS[0] - 1)]
    };
    let held = [low, low + slope].map(|value| End::Held(value * unit));
    for orientation in [Orientation::Axes, Orientation::All([0.0, 0.8, 0.6]), Orientation::All([0.0; 3])] {
        let (own, other) = (off_by(held, orientation.clone()), off_by(CLOSED, orientation.clone()));
        // Half a cell, as on a line.
        assert!(own.iter().all(|off| *off < 0.5 * slope / 60.0), "{orientation:?}: {own:?}");
        assert!(mean(&other) > 2.0 * mean(&own), "{orientation:?}: {own:?}, {other:?}");
    }
}

/// A uniform density is held on all sides: in corners, too, by as much as it scatters within.
#[test]
fn corners_are_held() {
    const N: usize = 40_000;
    let mut draws = Draws(8);
    let x: Vec<f64> = (0..N).map(|_| draws.uniform()).collect();
    let y: Vec<f64> = (0..N).map(|_| draws.uniform()).collect();
    let held = [End::Held(N as f64); 2];
    let lattice = Lattice::new(&[(50, 0.02, held), (50, 0.02, held)]).unwrap();
    let tally = Tally::of(&lattice, &[0.0, 0.0], &[&x, &y], None);
    for orientation in [Orientation::Axes, Orientation::All([0.0, 1.0, 1.0])] {
        let adaptive = Adaptive { orientation, ..Adaptive::default() };
        let found = estimate(&lattice, &tally, &adaptive, Width::widest());
        let middle = found.standard_error[25 * 50 + 25] / N as f64;
        for [i, j] in [[0, 0], [0, 49], [49, 0], [49, 49], [0, 25], [25, 0]] {
            let off = found.density[i * 50 + j] / N as f64 - 1.0;
            assert!(off.abs() < middle, "{i}, {j}: {off}, {middle}");
        }
    }
}

/// What masses and lengths are measured in, and what counts where they differ, changes nothing.
#[test]
fn values_are_densities_of_mass() {
    const N: usize = 4_000;
    let mut draws = Draws(2);
    let x: Vec<f64> = (0..N).map(|_| of_line(0.3, &mut draws)).collect();
    let y: Vec<f64> = (0..N).map(|_| draws.uniform()).collect();
    let of = |mass: f64, thin: f64, weighing: Weighing, direction: Option<[f64; 2]>| {
        let held = [0.3, 1.7].map(|value| End::Held(value * N as f64 * mass / thin));
        let lattice = Lattice::new(&[(34, 1.0 / 34.0, held), (34, thin / 34.0, CLOSED)]).unwrap();
        let y: Vec<f64> = y.iter().map(|y| thin * y).collect();
        let tally = Tally::of(&lattice, &[0.0, 0.0], &[&x, &y], Some(&vec![mass; N]));
        let orientation = direction.map_or(Orientation::Axes, |[x, y]| Orientation::All([0.0, x, thin * y]));
        // In full, and with bounds of bandwidths that are no whole cells: rounding may fall to the other side.
        let adaptive =
            Adaptive { weighing, orientation, is_fast: false, most_loops: 4, ..Adaptive::default() };
        let found = estimate(&lattice, &tally, &adaptive, Width::widest());
        found.density.into_iter().map(|own| own * thin / mass).collect::<Vec<f64>>()
    };
    for direction in [None, Some([1.0, 0.0])] {
        let expected = of(1.0, 1.0, Weighing::OfAll, direction);
        let cases = [
            (3e-7, 1.0, Weighing::OfAll),
            (5.0, 1.0, Weighing::Mean),
            (5.0, 1.0, Weighing::Number),
            (5.0, 1.0, Weighing::OfCell),
            (2.0, 1e-3, Weighing::OfAll),
        ];
        for (mass, thin, weighing) in cases {
            let found = of(mass, thin, weighing, direction);
            for (own, expected) in found.iter().zip(&expected) {
                assert!(
                    (own / expected - 1.0).abs() < 1e-9,
                    "{mass}, {thin}, {weighing:?}: {own} for {expected}"
                );
            }
        }
    }
}

/// Bits hang on no thread; densities are never below zero, whatever walls hold beside whatever cloud.
#[test]
fn clouds_beside_walls_have_densities() {
    for (n, value) in [(1, 1e-3), (1, 1e3), (500, 0.0), (500, 0.1), (500, 1e4)] {
        let mut draws = Draws(n as u64);
        let x: Vec<f64> = (0..n).map(|_| (0.2 + 0.1 * draws.normal()).abs()).collect();
        let y: Vec<f64> = (0..n).map(|_| (0.5 + 0.1 * draws.normal()).clamp(0.0, 1.0)).collect();
        let lattice = Lattice::new(&[
            (40, 0.025, [End::Held(value), End::Sink]),
            (30, 1.0 / 30.0, [End::Mirror, End::Held(2.0 * value)]),
        ])
        .unwrap();
        let tally = Tally::of(&lattice, &[0.0, 0.0], &[&x, &y], None);
        for orientation in [Orientation::Axes, Orientation::All([0.0, 1.0, 2.0])] {
            for is_fast in [true, false] {
                let adaptive = Adaptive {
                    is_fast,
                    orientation: orientation.clone(),
                    most_loops: 4,
                    ..Adaptive::default()
                };
                let of = |threads: usize, width: Width| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                    pool.install(|| estimate(&lattice, &tally, &adaptive, width)).density
                };
                let one = of(1, Width::widest());
                assert!(
                    one.iter().all(|own| own.is_finite() && *own >= 0.0),
                    "{n}, {value}, {orientation:?}"
                );
                for (threads, width) in [(2, Width::widest()), (3, Width::baseline())] {
                    let same = of(threads, width)
                        .iter()
                        .zip(&one)
                        .all(|(own, other)| own.to_bits() == other.to_bits());
                    assert!(same, "{n}, {value}, {orientation:?}, {threads} threads");
                }
            }
        }
    }
}

/// A wall holds no density below zero and none that is no number; kernels of one size do not know of such walls.
#[test]
fn what_cannot_be_held_is_refused() {
    for value in [-1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(Lattice::new(&[(10, 0.1, [End::Held(value), End::Mirror])]), None);
    }
    let lattice = Lattice::new(&[(10, 0.1, [End::Held(1.0), End::Mirror])]).unwrap();
    let tally = Tally::of(&lattice, &[0.0], &[&[0.5, 0.6]], None);
    let found = global(&lattice, &tally, Rule::NormalReference, Weighing::OfAll, Width::widest());
    assert_eq!(found, Err(Trouble::Held));
}
