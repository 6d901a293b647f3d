//! Bandwidths against sums over pairs of particles where they are.

use super::*;

/// `(−1)^s φ^{(2s)}(z)` of a normal density: what two particles have together of the square of an s-th derivative.
fn derivative(s: i32, z: f64, deviation: f64) -> f64 {
    let u = z / deviation;
    // Hermite's polynomials.
    let (mut before, mut own) = (1.0, u);
    for k in 1..2 * s {
        (before, own) = (own, u * own - f64::from(k) * before);
    }
    let value = if s == 0 { 1.0 } else { own };
    let sign = if s % 2 == 0 { 1.0 } else { -1.0 };
    sign * value * bell(z, deviation) / deviation.powi(2 * s)
}

/// Images of a place on a line from 0 to a length, with their signs, as far as any kernel can reach.
fn images(x: f64, length: f64, ends: [End; 2]) -> Vec<(f64, f64)> {
    if ends == [End::Wrap; 2] {
        return (-3..=3).map(|k| (x + f64::from(k) * length, 1.0)).collect();
    }
    let sign = |end: End| if end == End::Sink { -1.0 } else { 1.0 };
    let mut images = vec![(x, 1.0)];
    for first in [0, 1] {
        let (mut place, mut own) = (x, 1.0);
        for k in 0..4 {
            let end = (first + k) % 2;
            place = if end == 0 { -place } else { 2.0 * length - place };
            own *= sign(ends[end]);
            images.push((place, own));
        }
    }
    images
}

/// The integral of a squared derivative of kernels in places, by pairs.
fn of_pairs(s: i32, g: f64, places: &[f64], length: f64, ends: [End; 2]) -> f64 {
    let mut sum = 0.0;
    for &x in places {
        for &y in places {
            for (image, sign) in images(y, length, ends) {
                sum += sign * derivative(s, x - image, 2.0_f64.sqrt() * g);
            }
        }
    }
    sum
}

const ENDS: [[End; 2]; 5] =
    [CLOSED, [End::Wrap; 2], [End::Sink; 2], [End::Mirror, End::Sink], [End::Sink, End::Mirror]];

/// Three hundred particles, a part of them near one end, in a line of odd numbers of cells.
fn places(seed: u64) -> Vec<f64> {
    let mut random = Random(seed);
    (0..300)
        .map(|k| if k % 3 == 0 { 0.8 * random.normal().abs() } else { 5.0 + 0.7 * random.normal() })
        .map(|x| x.clamp(0.0, 9.99))
        .collect()
}

/// What iterations may leave: a change of 1e-4, when each loop leaves two thirds of what was missing.
const MISSING: f64 = 3e-4;

/// What a rule finds over what pairs of particles have, where they are, by seed: near one on fine cells, where each has its own
/// place but for rounding; on coarse cells by chance, as places are rounded, by much less
/// than it differs from sample to sample.
fn compare((rule, coarse): (Rule, usize), expected: impl Fn(f64, &[f64], [End; 2]) -> f64) {
    for ends in ENDS {
        for (cells, n_seeds) in [(4999, 3), (coarse, 10)] {
            // Against other ends the half of a bell is a cliff, which the highest derivatives see in every cell.
            if cells == coarse && ends != CLOSED {
                continue;
            }
            let lattice = line(cells, 10.0 / cells as f64, ends);
            let of_seed = |seed| {
                let x = places(seed);
                let found = density(&lattice, &Tally::of(&lattice, &[0.0], &[&x], None), rule);
                assert!(found.is_settled && found.n_loops < 150);
                found.bandwidths[2] / expected(found.bandwidths[2], &x, ends)
            };
            let ratios: Vec<f64> = (0..n_seeds).map(of_seed).collect();
            let (mean, deviation) = spread(&ratios);
            let tolerance = MISSING + 3.0 * deviation / f64::from(n_seeds as u32).sqrt();
            assert!((mean - 1.0).abs() < tolerance, "{ends:?}, {cells}: {mean} within {tolerance}");
            let most = if cells > coarse { 0.0005 } else { 0.01 };
            assert!(deviation < most, "{ends:?}, {cells}: {deviation}");
        }
    }
}

#[test]
fn the_plug_in_is_that_of_pairs() {
    compare((Rule::PlugIn(Shape::Round), 100), |h, x, ends| {
        let roughness = of_pairs(2, h * pow(300.0, 0.1), x, 10.0, ends);
        pow(300.0 / (2.0 * PI.sqrt() * roughness), 0.2)
    });
}

#[test]
fn the_fixed_point_is_that_of_pairs() {
    compare((Rule::Botev, 250), |h, x, ends| {
        let n = 300.0;
        let mut roughness = of_pairs(7, h, x, 10.0, ends) / (n * n);
        for s in [6, 5, 4, 3, 2] {
            let odd: f64 = (1..=s).map(|k| f64::from(2 * k - 1)).product();
            let per = (2.0 * PI).sqrt() * n * roughness;
            let factor = 2.0 * (1.0 + pow(2.0, -f64::from(s) - 0.5)) / 3.0;
            let t = pow(factor * odd / per, 2.0 / (3.0 + 2.0 * f64::from(s)));
            roughness = of_pairs(s, t.sqrt(), x, 10.0, ends) / (n * n);
        }
        pow(2.0 * n * PI.sqrt() * roughness, -0.2)
    });
}

/// In a plane and in space, with all axes of other lengths and other ends.
#[test]
fn plug_ins_of_planes_and_space_are_those_of_pairs() {
    let (lengths, all_ends) = ([10.0, 6.0, 8.0], [CLOSED, [End::Wrap; 2], [End::Mirror, End::Sink]]);
    for (d, cells, n_seeds) in [(2, [1201, 707, 0], 3), (2, [101, 77, 0], 12), (3, [67, 50, 64], 6)] {
        let axes: Vec<_> =
            (0..d).map(|axis| (cells[axis], lengths[axis] / cells[axis] as f64, all_ends[axis])).collect();
        let lattice = Lattice::new(&axes).unwrap();
        for shape in [Shape::Round, Shape::Stretched] {
            let mut ratios = vec![Vec::new(); d];
            for seed in 0..n_seeds {
                let mut random = Random(seed);
                let place = |axis: usize, random: &mut Random| {
                    (3.0 + [1.5, 0.6, 0.9][axis] * random.normal()).clamp(0.0, 0.999 * lengths[axis])
                };
                let x: Vec<Vec<f64>> =
                    (0..d).map(|axis| (0..200).map(|_| place(axis, &mut random)).collect()).collect();
                let slices: Vec<&[f64]> = x.iter().map(|own| &own[..]).collect();
                let tally = Tally::of(&lattice, &vec![0.0; d], &slices, None);
                let found = density(&lattice, &tally, Rule::PlugIn(shape));
                assert!(found.is_settled && found.n_loops < 40);
                let h = &found.bandwidths[3 - d..];
                for (axis, expected) in
                    best_of_pairs(&x, h, (&lengths, &all_ends), shape).into_iter().enumerate()
                {
                    ratios[axis].push(h[axis] / expected);
                }
            }
            for ratios in ratios {
                let (mean, deviation) = spread(&ratios);
                let tolerance = MISSING + 3.0 * deviation / f64::from(n_seeds as u32).sqrt();
                assert!((mean - 1.0).abs() < tolerance, "{d}, {shape:?}: {mean} within {tolerance}");
                let most = if cells[0] > 1000 { 0.001 } else { 0.01 };
                assert!(deviation < most, "{d}, {shape:?}: {deviation}");
            }
        }
    }
}

/// The best bandwidths by pairs of particles with the ones that there are.
fn best_of_pairs(
    x: &[Vec<f64>],
    h: &[f64],
    (lengths, all_ends): (&[f64; 3], &[[End; 2]; 3]),
    shape: Shape,
) -> Vec<f64> {
    let (d, n) = (x.len(), x[0].len());
    let size = d as f64;
    let inflation = pow(n as f64, 2.0 / ((size + 4.0) * (size + 6.0)));
    // By pairs and orders of derivatives along an axis.
    let of_axis = |axis: usize| -> Vec<[f64; 3]> {
        let deviation = 2.0_f64.sqrt() * inflation * h[axis];
        let pair = |k: usize| {
            let all = images(x[axis][k % n], lengths[axis], all_ends[axis]);
            let of = |s: i32| {
                all.iter().map(|(image, sign)| sign * derivative(s, x[axis][k / n] - image, deviation)).sum()
            };
            [of(0), of(1), of(2)]
        };
        (0..n * n).map(pair).collect()
    };
    let table: Vec<Vec<[f64; 3]>> = (0..d).map(of_axis).collect();
    let psi = |i: usize, j: usize| -> f64 {
        let order = |axis: usize| usize::from(axis == i) + usize::from(axis == j);
        (0..n * n).map(|k| (0..d).map(|axis| table[axis][k][order(axis)]).product::<f64>()).sum()
    };
    let mean: f64 = (0..d).map(|axis| psi(axis, axis)).product();
    let stretch = |axis: usize| match shape {
        Shape::Round => 1.0,
        Shape::Stretched => pow(psi(axis, axis), -0.25) * pow(mean, 0.25 / size),
    };
    let s: Vec<f64> = (0..d).map(stretch).collect();
    let mut roughness = 0.0;
    for i in 0..d {
        for j in 0..d {
            roughness += s[i] * s[i] * s[j] * s[j] * psi(i, j);
        }
    }
    let all = pow(size * n as f64 / (pow(4.0 * PI, 0.5 * size) * roughness), 1.0 / (size + 4.0));
    s.iter().map(|own| all * own).collect()
}
