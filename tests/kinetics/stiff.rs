//! Stiff problems of the literature within ten tolerances.

use super::network::{Network, step};
use lamella::plan::chemistry::Method;

const TOLERANCES: [f64; 4] = [1e-3, 1e-4, 1e-6, 1e-8];

/// Integrates and compares all components above the floor. The references hold ten digits or more.
fn check(network: &Network, floor: f64, start: &[f64], t: f64, right: &[f64]) {
    for tolerance in TOLERANCES {
        let (y, _) = step(&network.reactor(Method::Rosenbrock, tolerance, floor), start, 0.0, t).unwrap();
        let mut worst = 0.0_f64;
        for (found, right) in y.iter().zip(right) {
            assert!(*found >= 0.0, "{found}");
            worst = worst.max((found - right).abs() / right.abs().max(floor) / tolerance);
        }
        assert!(worst <= 10.0, "{tolerance}: {worst} tolerances off");
    }
}

/// H. H. Robertson 1966: A → B, 2 B → B + C, B + C → A + C.
fn robertson() -> Network {
    let mut network = Network::new(3);
    network.mass_action(0.04, &[(0, 1.0)], &[(0, -1.0), (1, 1.0)]);
    network.mass_action(3e7, &[(1, 2.0)], &[(1, -1.0), (2, 1.0)]);
    network.mass_action(1e4, &[(1, 1.0), (2, 1.0)], &[(0, 1.0), (1, -1.0)]);
    network
}

/// At 40 from the implicit method Radau IIA at 3e-13; at 1e11 from F. Mazzia and C. Magherini 2008, Test Set
/// for Initial Value Problem Solvers 2.4.
#[test]
fn robertson_to_the_end() {
    let early = [0.7158270687194085, 9.18553476455792e-6, 0.2841637457458238];
    let late = [2.083_340_149_701_255e-8, 8.333_360_770_334_713e-14, 0.999_999_979_166_505];
    check(&robertson(), 1e-14, &[1.0, 0.0, 0.0], 40.0, &early);
    check(&robertson(), 1e-14, &[1.0, 0.0, 0.0], 1e11, &late);
    for tolerance in TOLERANCES {
        let reactor = robertson().reactor(Method::Rosenbrock, tolerance, 1e-14);
        let (y, _) = step(&reactor, &[1.0, 0.0, 0.0], 0.0, 4e11).unwrap();
        assert!(y.iter().all(|value| *value > 0.0));
        assert!((y.iter().sum::<f64>() - 1.0).abs() < 1e-13, "{y:?}");
        // A falls like 1/t: a quarter of its value at 1e11, up to 1e-6.
        let bound = if tolerance > 1e-4 { 10.0 * tolerance } else { 1e-5 };
        assert!((4.0 * y[0] / late[0] - 1.0).abs() < bound, "{y:?}");
    }
}

/// Test Set for Initial Value Problem Solvers 2.4: eight reactants of photomorphogenesis.
#[test]
fn hires() {
    let mut network = Network::new(8);
    let first = |network: &mut Network, k: f64, from: usize, changes: &[(usize, f64)]| {
        network.mass_action(k, &[(from, 1.0)], changes);
    };
    first(&mut network, 1.71, 0, &[(0, -1.0), (1, 1.0)]);
    first(&mut network, 0.43, 1, &[(0, 1.0), (1, -1.0)]);
    first(&mut network, 8.32, 1, &[(1, -1.0), (3, 1.0)]);
    first(&mut network, 8.32, 2, &[(0, 1.0), (2, -1.0)]);
    first(&mut network, 1.71, 2, &[(2, -1.0), (3, 1.0)]);
    first(&mut network, 0.43, 3, &[(2, 1.0), (3, -1.0)]);
    first(&mut network, 0.69, 3, &[(3, -1.0), (5, 1.0)]);
    first(&mut network, 0.035, 4, &[(2, 1.0), (4, -1.0)]);
    first(&mut network, 1.71, 4, &[(4, -1.0), (5, 1.0)]);
    first(&mut network, 0.43, 5, &[(4, 1.0), (5, -1.0)]);
    first(&mut network, 0.43, 6, &[(4, 1.0), (6, -1.0), (7, 1.0)]);
    first(&mut network, 0.69, 6, &[(5, 1.0), (6, -1.0), (7, 1.0)]);
    first(&mut network, 0.69, 6, &[(6, -1.0), (7, 1.0)]);
    network.mass_action(280.0, &[(5, 1.0), (7, 1.0)], &[(5, -1.0), (6, 1.0), (7, -1.0)]);
    network.mass_action(0.0007, &[], &[(0, 1.0)]);
    let right = [
        0.737_131_257_332_566_8e-3,
        0.144_248_572_631_618_5e-3,
        0.588_872_974_096_757_5e-4,
        0.117_565_134_328_314_9e-2,
        0.238_635_619_883_133_1e-2,
        0.623_896_825_274_279_6e-2,
        0.284_999_839_518_576_9e-2,
        0.285_000_160_481_423_1e-2,
    ];
    check(&network, 1e-4, &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057], 321.8122, &right);
}

/// Test Set for Initial Value Problem Solvers 2.4: the Oregonator, over one and a bit of its jumps.
#[test]
fn orego() {
    let mut network = Network::new(3);
    let (fast, slow) = (77.27, 1.0 / 77.27);
    network.mass_action(fast, &[(1, 1.0)], &[(0, 1.0)]);
    network.mass_action(fast, &[(0, 1.0)], &[(0, 1.0)]);
    network.mass_action(fast * 8.375e-6, &[(0, 2.0)], &[(0, -1.0)]);
    network.mass_action(fast, &[(0, 1.0), (1, 1.0)], &[(0, -1.0)]);
    network.mass_action(slow, &[(2, 1.0)], &[(1, 1.0)]);
    network.mass_action(slow, &[(1, 1.0)], &[(1, -1.0)]);
    network.mass_action(slow, &[(0, 1.0), (1, 1.0)], &[(1, -1.0)]);
    network.mass_action(0.161, &[(0, 1.0)], &[(2, 1.0)]);
    network.mass_action(0.161, &[(2, 1.0)], &[(2, -1.0)]);
    let right = [1.000_814_870_318_523, 1_228.178_521_549_917, 132.055_494_284_670_6];
    check(&network, 1e-3, &[1.0, 2.0, 3.0], 360.0, &right);
}

/// A limit cycle; reference: an explicit method of order 8 at 1e-13 (scipy 1.17, DOP853).
#[test]
fn brusselator() {
    let mut network = Network::new(2);
    network.mass_action(1.0, &[], &[(0, 1.0)]);
    network.mass_action(1.0, &[(0, 2.0), (1, 1.0)], &[(0, 1.0), (1, -1.0)]);
    network.mass_action(3.0, &[(0, 1.0)], &[(0, -1.0), (1, 1.0)]);
    network.mass_action(1.0, &[(0, 1.0)], &[(0, -1.0)]);
    check(&network, 1e-3, &[1.5, 3.0], 20.0, &[0.4986370712683345, 4.596780349451996]);
}

/// Test Set for Initial Value Problem Solvers 2.4: 20 species and 25 reactions of polluted air. Species
/// count from 1, as there; `(k, reactants, changes)`.
#[test]
fn pollu() {
    type Row = (f64, &'static [usize], &'static [(usize, f64)]);
    const REACTIONS: [Row; 25] = [
        (0.35, &[1], &[(1, -1.0), (2, 1.0), (3, 1.0)]),
        (26.6, &[2, 4], &[(1, 1.0), (2, -1.0), (4, -1.0)]),
        (12300.0, &[5, 2], &[(1, 1.0), (2, -1.0), (5, -1.0), (6, 1.0)]),
        (0.00086, &[7], &[(5, 2.0), (7, -1.0), (8, 1.0)]),
        (0.00082, &[7], &[(7, -1.0), (8, 1.0)]),
        (15000.0, &[7, 6], &[(5, 1.0), (6, -1.0), (7, -1.0), (8, 1.0)]),
        (0.00013, &[9], &[(5, 1.0), (8, 1.0), (9, -1.0), (10, 1.0)]),
        (24000.0, &[9, 6], &[(6, -1.0), (9, -1.0), (11, 1.0)]),
        (16500.0, &[11, 2], &[(1, 1.0), (2, -1.0), (10, 1.0), (11, -1.0), (12, 1.0)]),
        (9000.0, &[11, 1], &[(1, -1.0), (11, -1.0), (13, 1.0)]),
        (0.022, &[13], &[(1, 1.0), (11, 1.0), (13, -1.0)]),
        (12000.0, &[10, 2], &[(1, 1.0), (2, -1.0), (10, -1.0), (14, 1.0)]),
        (1.88, &[14], &[(5, 1.0), (7, 1.0), (14, -1.0)]),
        (16300.0, &[1, 6], &[(1, -1.0), (6, -1.0), (15, 1.0)]),
        (4_800_000.0, &[3], &[(3, -1.0), (4, 1.0)]),
        (0.00035, &[4], &[(4, -1.0), (16, 1.0)]),
        (0.0175, &[4], &[(3, 1.0), (4, -1.0)]),
        (1e8, &[16], &[(6, 2.0), (16, -1.0)]),
        (4.44e11, &[16], &[(3, 1.0), (16, -1.0)]),
        (1240.0, &[17, 6], &[(5, 1.0), (6, -1.0), (17, -1.0), (18, 1.0)]),
        (2.1, &[19], &[(2, 1.0), (19, -1.0)]),
        (5.78, &[19], &[(1, 1.0), (3, 1.0), (19, -1.0)]),
        (0.0474, &[1, 4], &[(1, -1.0), (4, -1.0), (19, 1.0)]),
        (1780.0, &[19, 1], &[(1, -1.0), (19, -1.0), (20, 1.0)]),
        (3.12, &[20], &[(1, 1.0), (19, 1.0), (20, -1.0)]),
    ];
    let mut network = Network::new(20);
    for (k, reactants, changes) in REACTIONS {
        let orders: Vec<(usize, f64)> = reactants.iter().map(|species| (species - 1, 1.0)).collect();
        let changes: Vec<(usize, f64)> = changes.iter().map(|&(species, nu)| (species - 1, nu)).collect();
        network.mass_action(k, &orders, &changes);
    }
    let mut start = [0.0; 20];
    for (species, value) in [(2, 0.2), (4, 0.04), (7, 0.1), (8, 0.3), (9, 0.01), (17, 0.007)] {
        start[species - 1] = value;
    }
    // Radau IIA at 1e-11 (scipy 1.17); the digits shown by the test set are the same.
    let right = [
        0.05646255480022716,
        0.1342484130422341,
        4.1397343310993886e-09,
        0.005523140207484519,
        2.018977262302266e-07,
        1.4645418634940308e-07,
        0.0778424911899792,
        0.32450753533960075,
        0.007494013383880349,
        1.62229315730161e-08,
        1.1358638332571095e-08,
        0.002230505975721337,
        0.0002087162882798601,
        1.396921016840478e-05,
        0.008964884856898244,
        4.35284636933023e-18,
        0.006899219696263402,
        0.00010078030373659417,
        1.7721465139699849e-06,
        5.6829432923163777e-05,
    ];
    check(&network, 1e-9, &start, 60.0, &right);
}
