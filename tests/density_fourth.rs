//! Densities of the fourth order: methods 10.2 and 10.3 (P3-a). What is expected follows from closed forms; bounds of noise from
//! the scatter between samples.

#[path = "support/draws.rs"]
mod draws;

use draws::Draws;
use lamella::engine::density::*;
use lamella::maths::scalar::{exp, sin};
use lamella::maths::wide::Width;
use std::f64::consts::PI;

const CLOSED: [End; 2] = [End::Mirror; 2];
const ORDERS: [Order; 2] = [Order::Second, Order::Fourth];

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}

fn bell(x: f64) -> f64 {
    exp(-0.5 * x * x) / (2.0 * PI).sqrt()
}

fn found(lattice: &Lattice, tally: &Tally, order: Order) -> Estimate {
    let adaptive = Adaptive { order, tolerance: 1e-3, ..Adaptive::default() };
    estimate(lattice, tally, &adaptive, Width::widest())
}

/// P3-a: standard normal samples are no more wrong than the published table says, which has kernels of the second order; ten
/// samples there, 24 here, that scatter by a quarter each.
#[test]
fn normal_samples_are_less_wrong_than_in_the_published_table() {
    for (n, published) in [(1000, 0.0091), (10_000, 0.00354), (100_000, 0.00144)] {
        let lattice = Lattice::new(&[(240, 0.05, CLOSED)]).unwrap();
        let error = |sample: u64| {
            let x = Draws(31 * sample + n as u64).normals(n);
            let tally = Tally::of(&lattice, &[-6.0], &[&x], None);
            let own = found(&lattice, &tally, Order::Fourth).density;
            let off = |(cell, own): (usize, &f64)| own / n as f64 - bell(0.05 * (cell as f64 + 0.5) - 6.0);
            norm(own.iter().enumerate().map(off)) / 240.0_f64.sqrt()
        };
        let mean = (0..24).map(error).sum::<f64>() / 24.0;
        assert!(mean < published, "{n}: {mean}, {published}");
    }
}

/// A bent cloud in a plane: a fifth less wrong, by the same particles, and the standard error says no less of it.
#[test]
fn a_bent_cloud_is_less_wrong() {
    const N: usize = 20_000;
    let lattice = Lattice::new(&[(200, 2.0, CLOSED), (200, 1.0, CLOSED)]).unwrap();
    let truth: Vec<f64> = (0..200 * 200)
        .map(|cell| {
            let (x, y) = (2.0 * (cell / 200) as f64 + 1.0, (cell % 200) as f64 + 0.5);
            N as f64 * bell((x - 200.0) / 25.0) / 25.0 * bell((y - 100.0 - 10.0 * sin(0.05 * x)) / 10.0)
                / 10.0
        })
        .collect();
    let size = norm(truth.iter().copied());
    let (mut errors, mut predicted) = ([0.0; 2], [0.0; 2]);
    for sample in 0..4 {
        let mut draws = Draws(sample + 50);
        let mut places = [Vec::new(), Vec::new()];
        for _ in 0..N {
            let x = (200.0 + 25.0 * draws.normal()).clamp(0.0, 400.0);
            places[0].push(x);
            places[1].push((100.0 + 10.0 * sin(0.05 * x) + 10.0 * draws.normal()).clamp(0.0, 200.0));
        }
        let tally = Tally::of(&lattice, &[0.0; 2], &[&places[0], &places[1]], None);
        for (k, order) in ORDERS.into_iter().enumerate() {
            let own = found(&lattice, &tally, order);
            errors[k] += norm(own.density.iter().zip(&truth).map(|(own, truth)| own - truth)) / size / 4.0;
            predicted[k] += norm(own.standard_error.iter().copied()) / size / 4.0;
        }
    }
    assert!(errors[1] < 0.85 * errors[0], "{errors:?}");
    assert!(
        errors.iter().zip(predicted).all(|(error, own)| own > 0.7 * error && own < *error),
        "{errors:?}, {predicted:?}"
    );
}

/// All of the mass stays, whatever weighs and whatever the ends are; no density is below zero; and the bits hang on no thread.
#[test]
fn mass_stays() {
    for (d, ends) in (1..=3).flat_map(|d| [CLOSED, [End::Wrap; 2]].map(|ends| (d, ends))) {
        let cells = [[300, 1, 1], [60, 50, 1], [24, 20, 16]][d - 1];
        let axes: Vec<(usize, f64, [End; 2])> = (0..d).map(|axis| (cells[axis], 0.5, ends)).collect();
        let lattice = Lattice::new(&axes).unwrap();
        let mut draws = Draws(d as u64);
        let mut places = vec![Vec::new(); d];
        let mut masses = Vec::new();
        for _ in 0..4000 {
            for axis in 0..d {
                let length = 0.5 * cells[axis] as f64;
                places[axis].push((length * (0.2 + 0.1 * draws.normal())).abs().min(length));
            }
            masses.push(exp(0.5 * draws.normal()));
        }
        let places: Vec<&[f64]> = places.iter().map(|own| &own[..]).collect();
        let tally = Tally::of(&lattice, &[0.0; 3][..d], &places, Some(&masses));
        for weighing in [Weighing::OfAll, Weighing::Mean, Weighing::Number, Weighing::OfCell] {
            let of = |order: Order, threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                // Those of the mean along a direction.
                let is_turned = weighing == Weighing::Mean;
                let orientation =
                    if is_turned { Orientation::All([0.3, 1.0, 0.4]) } else { Orientation::Axes };
                let adaptive = Adaptive { order, weighing, orientation, ..Adaptive::default() };
                pool.install(|| estimate(&lattice, &tally, &adaptive, Width::widest()))
            };
            let (fourth, again) = (of(Order::Fourth, 1), of(Order::Fourth, 3));
            assert!(fourth.density == again.density && fourth.standard_error == again.standard_error);
            assert!(fourth.density != of(Order::Second, 1).density);
            assert!(fourth.density.iter().all(|own| *own >= 0.0));
            let total = fourth.density.iter().sum::<f64>() * lattice.volume() / tally.mass();
            assert!((total - 1.0).abs() < 1e-12, "{d}-D, {ends:?}, {weighing:?}: {total}");
        }
    }
}

/// A cloud, and one heavy particle far from it: each keeps its own.
#[test]
fn clouds_apart_keep_their_mass() {
    let lattice = Lattice::new(&[(1400, 0.05, CLOSED)]).unwrap();
    let mut x = Draws(3).normals(5000);
    let mut masses = vec![1.0; x.len()];
    x.push(50.0);
    masses.push(1000.0);
    let tally = Tally::of(&lattice, &[-10.0], &[&x], Some(&masses));
    let adaptive = Adaptive { order: Order::Fourth, weighing: Weighing::Mean, ..Adaptive::default() };
    let own = estimate(&lattice, &tally, &adaptive, Width::widest());
    let cloud: f64 = own.density[..800].iter().sum::<f64>() * 0.05;
    let second = Adaptive { order: Order::Second, ..adaptive };
    let second = estimate(&lattice, &tally, &second, Width::widest());
    let before: f64 = second.density[..800].iter().sum::<f64>() * 0.05;
    assert!((cloud / 5000.0 - 1.0).abs() < 1e-9, "{cloud}, {before}");
}

/// Beside ends that turn signs over densities are of the second order.
#[test]
fn ends_that_absorb_have_the_second_order() {
    let mut draws = Draws(9);
    let x: Vec<f64> = (0..20_000).map(|_| draws.uniform().sqrt()).collect();
    for end in [End::Sink, End::Held(100.0)] {
        let lattice = Lattice::new(&[(200, 0.005, [end, End::Mirror])]).unwrap();
        let tally = Tally::of(&lattice, &[0.0], &[&x], None);
        let [second, fourth] = ORDERS.map(|order| found(&lattice, &tally, order).density);
        assert!(second == fourth, "{end:?}");
    }
}

/// Whole cells twice as long are found on even numbers of cells alone; with odd ones the last would be half empty.
#[test]
fn even_points_have_an_even_density_on_any_number_of_cells() {
    let x: Vec<f64> = (0..20_000).map(|k| (k as f64 + 0.5) / 20_000.0).collect();
    for n in [300, 301, 512, 513, 514, 1025] {
        let lattice = Lattice::new(&[(n, 1.0 / n as f64, CLOSED)]).unwrap();
        let tally = Tally::of(&lattice, &[0.0], &[&x], None);
        let own = estimate(&lattice, &tally, &Adaptive::default(), Width::widest()).density;
        let worst = own.iter().fold(0.0_f64, |worst, own| worst.max((own / 20_000.0 - 1.0).abs()));
        assert!(worst < 0.01, "{n} cells: {worst}");
    }
}
