//! Stiff problems of the literature within ten tolerances.

use super::network::{Network, step};
use lamella::plan::chemistry::Method;

/// H. H. Robertson 1966: A → B, 2 B → B + C, B + C → A + C.
fn robertson() -> Network {
    let mut network = Network::new(3);
    network.mass_action(0.04, &[(0, 1.0)], &[(0, -1.0), (1, 1.0)]);
    network.mass_action(3e7, &[(1, 2.0)], &[(1, -1.0), (2, 1.0)]);
    network.mass_action(1e4, &[(1, 1.0), (2, 1.0)], &[(0, 1.0), (1, -1.0)]);
    network
}

/// At 40 from methods 10.6, at 1e11 from F. Mazzia and C. Magherini 2008, Test Set for IVP Solvers 2.4.
#[test]
fn robertson_to_the_end() {
    let late = [2.083_340_149_701_255e-8, 8.333_360_770_334_713e-14, 0.999_999_979_166_505];
    let early = [0.715_827_068_7, 9.185_534_765e-6, 0.284_163_745_7];
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let reactor = robertson().reactor(Method::Rosenbrock, tolerance, 1e-14);
        for (t, right) in [(40.0, early), (1e11, late)] {
            let (y, work) = step(&reactor, &[1.0, 0.0, 0.0], 0.0, t).unwrap();
            println!("{tolerance} {t}: {work:?} {y:?}");
            for (found, right) in y.iter().zip(right) {
                assert!(*found >= 0.0);
                let bound = 10.0 * tolerance * right + 2e-10 * right;
                println!("   {}", (found - right).abs() / right / tolerance);
                assert!((found - right).abs() <= bound, "{t}: {found} {right}");
            }
            let mass: f64 = y.iter().sum();
            assert!((mass - 1.0).abs() < 1e-13, "{mass}");
        }
    }
}
