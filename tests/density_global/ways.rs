//! Mass, walls, axes, units, weights, and whatever may come in.

use super::*;

const RULES: [Rule; 5] = [
    Rule::Fixed(0.07),
    Rule::NormalReference,
    Rule::PlugIn(Shape::Round),
    Rule::PlugIn(Shape::Stretched),
    Rule::Botev,
];

/// Boxes of unit length along each axis.
fn boxes() -> [Lattice; 3] {
    [
        line(301, 1.0 / 301.0, CLOSED),
        Lattice::new(&[(80, 1.0 / 80.0, CLOSED), (67, 1.0 / 67.0, CLOSED)]).unwrap(),
        Lattice::new(&[(31, 1.0 / 31.0, CLOSED), (24, 1.0 / 24.0, CLOSED), (40, 1.0 / 40.0, CLOSED)])
            .unwrap(),
    ]
}

fn inside(lattice: &Lattice, seed: u64, n: usize, masses: Option<&[f64]>) -> Tally {
    let mut random = Random(seed);
    let x: Vec<Vec<f64>> =
        (0..lattice.d).map(|_| (0..n).map(|_| random.uniform() * random.uniform()).collect()).collect();
    Tally::of(lattice, &vec![0.0; lattice.d], &x.iter().map(|own| &own[..]).collect::<Vec<_>>(), masses)
}

#[test]
fn mass_stays_between_mirrors_and_where_ends_meet() {
    let masses: Vec<f64> = (0..5000).map(|k| 1.0 + f64::from(k % 7)).collect();
    let wrap = line(50, 0.02, [End::Wrap; 2]);
    // Bandwidths at both bounds, too, and axes of few cells.
    let short = Lattice::new(&[(1, 1.0, CLOSED), (2, 0.5, CLOSED), (5, 0.2, [End::Wrap; 2])]).unwrap();
    for lattice in boxes().iter().chain([&wrap, &short]) {
        let tally = inside(lattice, 1, 5000, Some(&masses));
        for rule in RULES.into_iter().chain([Rule::Fixed(1e-9), Rule::Fixed(1e9)]) {
            if rule == Rule::Botev && lattice.axes().filter(|&axis| lattice.cells[axis] > 1).count() > 1 {
                continue;
            }
            let found = density(lattice, &tally, rule);
            let mass = found.density.iter().sum::<f64>() * lattice.volume();
            assert!((mass / tally.mass() - 1.0).abs() < 1e-12, "{rule:?}, {:?}: {mass}", lattice.cells);
            assert!((tally.mass() / masses.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(found.density.iter().all(|&value| value >= 0.0));
        }
        let (values, _) = histogram(lattice, &tally);
        let mass = values.iter().sum::<f64>() * lattice.volume();
        assert!((mass / tally.mass() - 1.0).abs() < 1e-12, "{mass}");
    }
    // Sinks take what reaches over them.
    let sink = line(100, 0.01, [End::Sink; 2]);
    let tally = inside(&sink, 1, 5000, None);
    let found = density(&sink, &tally, Rule::Fixed(0.05));
    assert!(found.density.iter().sum::<f64>() * 0.01 < 0.95 * tally.mass());
    assert!(found.density[0] < 0.15 * found.density[15], "{} {}", found.density[0], found.density[15]);
}

/// Deviations of a density of so many particles with a bandwidth of 0.1: at walls, where kernels overlap with their images,
/// `√(2/(2 √π h N))` = 0.0053; with one of 0.1 in a plane twice, `√(4/(4π h² N))` = 0.0056 of a million.
#[test]
fn uniform_densities_are_uniform_at_walls() {
    for (d, n) in [(1, 200_000), (2, 1_000_000)] {
        let lattice = Lattice::new(&vec![(64, 1.0 / 64.0, CLOSED); d]).unwrap();
        let mut random = Random(9);
        let x: Vec<Vec<f64>> = (0..d).map(|_| (0..n).map(|_| random.uniform()).collect()).collect();
        let slices: Vec<&[f64]> = x.iter().map(|own| &own[..]).collect();
        let tally = Tally::of(&lattice, &vec![0.0; d], &slices, None);
        for rule in RULES {
            if rule == Rule::Botev && d > 1 || rule == Rule::NormalReference {
                continue;
            }
            let rule = if let Rule::Fixed(_) = rule { Rule::Fixed(0.1) } else { rule };
            let found = density(&lattice, &tally, rule);
            for (value, error) in found.density.iter().zip(&found.standard_error) {
                assert!((value / n as f64 - 1.0).abs() < 0.03, "{rule:?}: {}", value / n as f64);
                assert!((value - n as f64).abs() < 5.0 * error, "{rule:?}: {value} ± {error}");
            }
        }
    }
}

#[test]
fn axes_may_be_exchanged() {
    let mut random = Random(4);
    let (x, y) = (random.normals(3000, 1.5), random.normals(3000, 0.4));
    let ends = [[End::Mirror, End::Sink], [End::Wrap; 2]];
    let one = Lattice::new(&[(90, 0.1, ends[0]), (70, 0.08, ends[1])]).unwrap();
    let other = Lattice::new(&[(70, 0.08, ends[1]), (90, 0.1, ends[0])]).unwrap();
    let tallies =
        [Tally::of(&one, &[-4.5, -2.8], &[&x, &y], None), Tally::of(&other, &[-2.8, -4.5], &[&y, &x], None)];
    for rule in &RULES[..4] {
        let [a, b] = [(&one, &tallies[0]), (&other, &tallies[1])]
            .map(|(lattice, tally)| density(lattice, tally, *rule));
        for (h, swapped) in [(a.bandwidths[1], b.bandwidths[2]), (a.bandwidths[2], b.bandwidths[1])] {
            assert!((h / swapped - 1.0).abs() < 1e-11, "{rule:?}: {h} and {swapped}");
        }
        for i in 0..90 {
            for j in 0..70 {
                let (value, swapped) = (a.density[i * 70 + j], b.density[j * 90 + i]);
                assert!(
                    (value - swapped).abs() < 1e-9 * (1.0 + value.abs()),
                    "{rule:?}: {value} and {swapped}"
                );
                let (value, swapped) = (a.standard_error[i * 70 + j], b.standard_error[j * 90 + i]);
                assert!(
                    (value - swapped).abs() < 1e-6 * (1.0 + value.abs()),
                    "{rule:?}: {value} and {swapped}"
                );
            }
        }
    }
    // A stretched cloud has kernels that are as much longer.
    let found = density(&one, &tallies[0], Rule::PlugIn(Shape::Stretched));
    let ratio = found.bandwidths[1] / found.bandwidths[2];
    assert!((ratio / (1.5 / 0.4) - 1.0).abs() < 0.15, "{ratio}");
    let found = density(&one, &tallies[0], Rule::PlugIn(Shape::Round));
    assert_eq!(found.bandwidths[1], found.bandwidths[2]);
}

/// What a unit of length or of mass is does not matter.
#[test]
fn units_do_not_matter() {
    let mut random = Random(8);
    let x = random.normals(2000, 1.0);
    let lattice = line(200, 0.05, CLOSED);
    let tally = Tally::of(&lattice, &[-5.0], &[&x], None);
    for (length, mass) in [(1024.0, 1.0), (0.5_f64.powi(40), 8.0), (1.0, 0.5_f64.powi(30))] {
        let scaled = line(200, 0.05 * length, CLOSED);
        let places: Vec<f64> = x.iter().map(|x| x * length).collect();
        let other = Tally::of(&scaled, &[-5.0 * length], &[&places], Some(&vec![mass; 2000]));
        for rule in &RULES[1..] {
            let [a, b] = [(&lattice, &tally), (&scaled, &other)]
                .map(|(lattice, tally)| density(lattice, tally, *rule));
            let ratio = b.bandwidths[2] / (a.bandwidths[2] * length);
            assert!((ratio - 1.0).abs() < 1e-9, "{rule:?}: {ratio}");
            for (a, b) in a.density.iter().zip(&b.density) {
                assert!((b * length / mass - a).abs() < 1e-6 * (1.0 + a), "{rule:?}: {a} and {b}");
            }
        }
    }
}

/// Bandwidths go by the number that each way of weighing has; what hardly weighs does not count where masses do.
#[test]
fn weights_count_as_they_should() {
    let cloud = Cloud::new(1, 6.0, 240);
    let mut random = Random(2);
    let x = vec![random.normals(4000, 1.0)];
    let masses: Vec<f64> = (0..4000).map(|k| if k % 4 == 0 { 5.0 } else { 1.0 }).collect();
    let tally = cloud.tally(&x, Some(&masses));
    let (sum, squares) = (8000.0_f64, 1000.0 * 25.0 + 3000.0);
    let of_cell: f64 =
        (0..tally.cells.len()).map(|at| (tally.masses[at] / tally.largest).powi(2) / tally.squares[at]).sum();
    let numbers = [
        (Weighing::OfAll, sum * sum / squares),
        (Weighing::Mean, 4000.0),
        (Weighing::Number, 4000.0),
        (Weighing::OfCell, of_cell),
    ];
    for (weighing, n) in numbers {
        let of_rule = |rule| global(&cloud.lattice, &tally, rule, weighing, Width::widest()).unwrap();
        let found = of_rule(Rule::NormalReference);
        let expected = tally.deviations()[2] * pow(4.0 / (3.0 * n), 0.2);
        assert!((found.bandwidths[2] / expected - 1.0).abs() < 1e-12, "{weighing:?}");
        for rule in &RULES {
            let mass = of_rule(*rule).density.iter().sum::<f64>() * cloud.lattice.volume();
            assert!((mass / sum - 1.0).abs() < 1e-12, "{weighing:?}: {mass}");
        }
    }
    // Every second one weighs next to nothing: as if there were but the others, where masses count.
    let half: Vec<f64> = x[0].iter().copied().step_by(2).collect();
    let masses: Vec<f64> = (0..4000).map(|k| if k % 2 == 0 { 2.0 } else { 1e-12 }).collect();
    let (all, alone) = (cloud.tally(&x, Some(&masses)), cloud.tally(&[half], None));
    for rule in &RULES {
        let [all, alone] = [&all, &alone].map(|tally| density(&cloud.lattice, tally, *rule));
        assert!((all.bandwidths[2] / alone.bandwidths[2] - 1.0).abs() < 1e-8, "{rule:?}");
        for (all, alone) in all.density.iter().zip(&alone.density) {
            assert!((all - 2.0 * alone).abs() < 1e-5 * (1.0 + alone), "{rule:?}: {all}, {alone}");
        }
    }
    // Particles of other masses have the bandwidth, by chance, of as many as they effectively are, of one mass.
    for rule in [Rule::PlugIn(Shape::Round), Rule::Botev] {
        let of = |seed: u64, n: usize, masses: Option<&[f64]>| {
            let x = Random(seed).normals(n, 1.0);
            density(&cloud.lattice, &cloud.tally(&[x], masses), rule).bandwidths[2]
        };
        let masses: Vec<f64> = (0..4000).map(|k| if k % 4 == 0 { 5.0 } else { 1.0 }).collect();
        let n = (sum * sum / squares).round() as usize;
        let (weighed, deviation) =
            spread(&(0..160).map(|seed| of(seed, 4000, Some(&masses))).collect::<Vec<_>>());
        let (single, other) = spread(&(200..360).map(|seed| of(seed, n, None)).collect::<Vec<_>>());
        let tolerance = 3.0 * ((deviation * deviation + other * other) / 160.0).sqrt();
        assert!((weighed - single).abs() < tolerance, "{rule:?}: {weighed} for {single} within {tolerance}");
        assert!(tolerance < 0.02 * single);
    }
}

/// Whatever there is, there is a density or a reason.
#[test]
fn nothing_is_too_odd() {
    let flat = line(1, 1.0, CLOSED);
    let sinks = line(40, 0.025, [End::Sink; 2]);
    let wrap = Lattice::new(&[(1, 1.0, [End::Wrap; 2]), (2, 0.5, [End::Sink; 2])]).unwrap();
    for lattice in boxes().iter().chain([&flat, &sinks, &wrap]) {
        let of = |x: &[f64], masses: Option<&[f64]>| {
            Tally::of(lattice, &vec![0.0; lattice.d], &vec![x; lattice.d], masses)
        };
        let sound = [
            of(&[], None),
            of(&[0.3], None),
            of(&[0.3, 0.9], None),
            of(&[0.3; 1000], None),
            of(&[0.0; 1000], None),
            of(&[0.3, f64::NAN, f64::INFINITY, -1.0, 7.0], None),
            of(&[f64::NAN], None),
            of(&[0.3, 0.9], Some(&[0.0, 0.0])),
            of(&[0.3, 0.9], Some(&[1.0, -1.0])),
            of(&[0.3, 0.9, 0.5], Some(&[1.0, -1.0, 0.5])),
            of(&[0.3, 0.9], Some(&[1e-300, 1e-300])),
            of(&[0.3, 0.9], Some(&[1e150, 1.0])),
            of(&[0.3], Some(&[1e300])),
        ];
        let odd = [
            of(&[0.3, 0.9], Some(&[f64::NAN, 1.0])),
            of(&[0.3], Some(&[f64::INFINITY])),
            of(&[0.3, 0.3], Some(&[1.7e308, 1.7e308])),
        ];
        for weighing in [Weighing::OfAll, Weighing::Mean, Weighing::Number, Weighing::OfCell] {
            for rule in RULES {
                for (at, tally) in sound.iter().enumerate() {
                    let found = global(lattice, tally, rule, weighing, Width::widest());
                    if rule == Rule::Botev
                        && lattice.axes().filter(|&axis| lattice.cells[axis] > 1).count() > 1
                    {
                        assert_eq!(found, Err(Trouble::OnlyOnALine));
                        continue;
                    }
                    let found = found.unwrap();
                    let what =
                        format!("{rule:?}, {weighing:?}, {:?}, {at}: {:?}", lattice.cells, found.bandwidths);
                    assert!(
                        found.density.iter().chain(&found.standard_error).all(|value| value.is_finite()),
                        "{what}"
                    );
                    // An axis of one cell has none beside others.
                    let is_long = |axis: &usize| lattice.cells[*axis] > 1;
                    assert!(
                        lattice.axes().filter(is_long).all(|axis| found.bandwidths[axis] > 0.0),
                        "{what}"
                    );
                    assert!(found.bandwidths.iter().all(|h| h.is_finite()), "{what}");
                    assert!(found.n_loops <= 400, "{what}");
                    assert_eq!(found.density.len(), lattice.n_cells());
                }
                for tally in &odd {
                    assert_eq!(global(lattice, tally, rule, weighing, Width::widest()), Err(Trouble::Masses));
                }
            }
            for h in [0.0, -1.0, f64::NAN, f64::INFINITY] {
                let found = global(lattice, &sound[1], Rule::Fixed(h), weighing, Width::widest());
                assert_eq!(found, Err(Trouble::Bandwidth));
            }
        }
    }
    let other = Tally::of(&sinks, &[0.0], &[&[0.9]], None);
    let found = global(&flat, &other, Rule::NormalReference, Weighing::OfAll, Width::widest());
    assert_eq!(found, Err(Trouble::OtherCells));
    assert_eq!(histogram(&flat, &other), (vec![0.0], vec![0.0]));
}

#[test]
fn any_number_of_threads_and_any_code_give_the_same_bits() {
    for lattice in boxes() {
        let tally = inside(&lattice, 6, 20_000, None);
        for rule in &RULES[..if lattice.d == 1 { 5 } else { 4 }] {
            let with = |n_threads: usize, width: Width| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
                let found = pool.install(|| global(&lattice, &tally, *rule, Weighing::OfAll, width)).unwrap();
                let values = found.density.iter().chain(&found.standard_error).chain(&found.bandwidths);
                values.map(|value| value.to_bits()).collect::<Vec<u64>>()
            };
            let one = with(1, Width::widest());
            assert!(one == with(3, Width::widest()), "{rule:?}: threads");
            assert!(one == with(2, Width::baseline()), "{rule:?}: code");
        }
    }
}
