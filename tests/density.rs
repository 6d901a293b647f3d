//! Densities by kernels on a lattice: numbers of the literature and of independent computations.

use lamella::engine::density::*;
use lamella::maths::wide::Width;
use std::f64::consts::PI;

/// The inverse of the standard normal distribution, by bisection of the distribution itself.
fn quantile(p: f64) -> f64 {
    let below = |x: f64| 0.5 * lamella::maths::scalar::erfc(-x / 2.0_f64.sqrt());
    let (mut low, mut high) = (-9.0, 9.0);
    while high - low > 1e-15 * (1.0 + f64::abs(low)) {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        *(if below(middle) < p { &mut low } else { &mut high }) = middle;
    }
    0.5 * (low + high)
}

fn exact(variant: Variant, start: Start, most_loops: usize) -> Adaptive {
    Adaptive { variant, start, most_loops, tolerance: 0.0, is_fast: false, ..Adaptive::default() }
}

const CLOSED: [End; 2] = [End::Mirror; 2];

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < tolerance, "{what}: {found} for {expected}");
}

/// A thousand quantiles of a normal density. Numbers: methods 10.3, P3-b, of an independent program that matches the released
/// one.
#[test]
fn a_line_has_the_bandwidths_of_an_independent_program() {
    let lattice = Lattice::new(&[(240, 0.05, CLOSED)]).unwrap();
    let x: Vec<f64> = (1..=1000).map(|i| quantile((f64::from(i) - 0.5) / 1000.0)).collect();
    let tally = Tally::of(&lattice, &[-6.0], &[&x], None);
    assert_eq!(tally.cells.len(), 112);
    let cases = [
        (
            Variant::Released,
            [5.317838047, 5.725058190, 5.720191494, 5.757752350, 5.775695295, 5.781120181, 5.784250009],
            [0.3840246008, 0.2353148143, 0.0202428537],
            [0.2886722977, 1.0856503718, 0.4389160692, 265.7560693, 3.7398373527e4],
        ),
        (
            Variant::Corrected,
            [5.317838047, 5.724221956, 5.722114295, 5.760065725, 5.777310266, 5.782834444, 5.786048651],
            [0.3839796896, 0.2353243774, 0.0202471209],
            [0.2889871113, 1.0866536069, 0.4393908180, 265.6231734, 3.7176513651e4],
        ),
    ];
    for (variant, history, densities, of_cell) in cases {
        let found = estimate(&lattice, &tally, &exact(variant, Start::NormalReference, 6), Width::widest());
        for (loops, (h, expected)) in found.history.iter().zip(history).enumerate() {
            close(h / 0.05, expected, 1e-8, &format!("{variant:?}, mean bandwidth of loop {loops}"));
        }
        for (cell, expected) in [120, 140, 170].into_iter().zip(densities) {
            close(
                found.density[cell] / 1000.0,
                expected,
                1e-8,
                &format!("{variant:?}, density of cell {cell}"),
            );
        }
        let cell = found.cells.iter().find(|cell| cell.at[2] == 120).unwrap();
        let numbers = [cell.h, cell.sigma, cell.g[2], cell.n, cell.roughness];
        for (number, expected) in numbers.into_iter().zip(of_cell) {
            close(number, expected, 1e-8, &format!("{variant:?}, cell 120"));
        }
    }
}

/// Two thousand places of a normal density in a plane. Numbers: methods 10.3, P3-c.
#[test]
fn a_plane_has_the_bandwidths_of_an_independent_program() {
    let lattice = Lattice::new(&[(80, 0.5, CLOSED), (48, 0.5, CLOSED)]).unwrap();
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    let x: Vec<f64> = (1..=2000).map(|i| 20.0 + 4.0 * quantile((f64::from(i) - 0.5) / 2000.0)).collect();
    let y: Vec<f64> = (1..=2000).map(|i| 12.0 + 2.0 * quantile((f64::from(i) * golden).fract())).collect();
    let tally = Tally::of(&lattice, &[0.0, 0.0], &[&x, &y], None);
    assert_eq!(tally.cells.len(), 654);
    let cases = [
        (
            Variant::Released,
            [2.0, 2.059823673, 1.935674536, 1.929788125, 1.920540430, 1.922148445],
            [0.0178478927, 0.0104400511, 0.0102989830],
            0.0733,
        ),
        (
            Variant::Corrected,
            [2.0, 1.877173441, 1.766496625, 1.763649692, 1.752516430, 1.753114374],
            [0.0183677569, 0.0105457264, 0.0103740699],
            0.0562,
        ),
    ];
    for (variant, history, densities, error) in cases {
        let found = estimate(&lattice, &tally, &exact(variant, Start::Bandwidth(1.0), 5), Width::widest());
        for (loops, (h, expected)) in found.history.iter().zip(history).enumerate() {
            close(h / 0.5, expected, 1e-8, &format!("{variant:?}, mean bandwidth of loop {loops}"));
        }
        for ([i, j], expected) in [[40, 24], [48, 24], [40, 28]].into_iter().zip(densities) {
            close(
                found.density[i * 48 + j] / 2000.0,
                expected,
                1e-8,
                &format!("{variant:?}, density at {i}, {j}"),
            );
        }
        let mass: f64 = found.density.iter().sum::<f64>() * 0.25;
        close(mass, 2000.0, 1e-12, "mass");
        let (mut square, mut all) = (0.0, 0.0);
        for (idx, density) in found.density.iter().enumerate() {
            let (x, y) = (0.5 * (idx / 48) as f64 + 0.25 - 20.0, 0.5 * (idx % 48) as f64 + 0.25 - 12.0);
            let truth = lamella::maths::scalar::exp(-x * x / 32.0 - y * y / 8.0) / (2.0 * PI * 8.0);
            square += (density / 2000.0 - truth).powi(2);
            all += truth * truth;
        }
        assert!(((square / all).sqrt() - error).abs() < 6e-5, "{variant:?}: {}", (square / all).sqrt());
    }
}
