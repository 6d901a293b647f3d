//! Speciation of the carbonate system, one core: cold, and warm from totals that differ by a per cent.

#![allow(clippy::print_stdout)]

use lamella::chemistry::equilibrium::{Speciation, Totals};
use lamella::maths::wide::Width;
use lamella::plan::chemistry::{Activity, Equilibrium, Mineral, Primary, Secondary};
use std::time::Instant;

const N: usize = 4096;
const REPEATS: usize = 40;

fn primary(species: usize, charge: f64) -> Primary {
    Primary { species, charge, ion_size: 5e-10, constant: 0.0, terms: vec![(species, 1.0)] }
}

fn secondary(species: usize, charge: f64, log_k: f64, coefficients: &[(usize, f64)]) -> Secondary {
    let order: f64 = coefficients.iter().map(|(_, nu)| nu).sum();
    let ln_constant = (log_k + 3.0 * (1.0 - order)) * std::f64::consts::LN_10;
    Secondary { species, charge, ion_size: 5e-10, ln_constant, coefficients: coefficients.to_vec() }
}

/// H⁺, CO₃²⁻, Ca²⁺; OH⁻, HCO₃⁻, CO₂, CaCO₃(aq), CaHCO₃⁺, CaOH⁺; calcite.
fn carbonate(activity: Activity, with_calcite: bool) -> Equilibrium {
    let ln_solubility = (-8.48 + 6.0) * std::f64::consts::LN_10;
    let calcite = Mineral { species: 9, ln_solubility, coefficients: vec![(1, 1.0), (2, 1.0)] };
    Equilibrium {
        primaries: vec![primary(0, 1.0), primary(1, -2.0), primary(2, 2.0)],
        secondaries: vec![
            secondary(3, -1.0, -14.0, &[(0, -1.0)]),
            secondary(4, -1.0, 10.329, &[(0, 1.0), (1, 1.0)]),
            secondary(5, 0.0, 16.681, &[(0, 2.0), (1, 1.0)]),
            secondary(6, 0.0, 3.224, &[(1, 1.0), (2, 1.0)]),
            secondary(7, 1.0, 11.435, &[(0, 1.0), (1, 1.0), (2, 1.0)]),
            secondary(8, 1.0, -12.78, &[(0, -1.0), (2, 1.0)]),
        ],
        minerals: if with_calcite { vec![calcite] } else { Vec::new() },
        activity,
    }
}

/// Totals along a mixing line of two waters, with a ripple that changes from call to call.
fn totals(round: usize, change: f64) -> Vec<Vec<f64>> {
    let ends = [[2.4, 1.9], [2.2, 2.0], [0.3, 1.8]];
    let ripple = |idx: usize| 1.0 + change * (((idx * 7919 + round * 104_729) % 1000) as f64 / 500.0 - 1.0);
    let mix = |end: [f64; 2], idx: usize| end[0] + (end[1] - end[0]) * idx as f64 / N as f64;
    ends.map(|end| (0..N).map(|idx| mix(end, idx) * ripple(idx)).collect()).to_vec()
}

fn measure(name: &str, equilibrium: &Equilibrium, width: Width, change: f64, is_warm: bool) {
    let speciation = Speciation::new(equilibrium).unwrap_or_else(|why| panic!("{why}"));
    let mut workspace = speciation.workspace();
    let mut memory = vec![vec![f64::NAN; N]; speciation.n_memory()];
    let mut found = vec![vec![0.0; N]; speciation.species().len()];
    let (mut best, mut evaluations, mut hard) = (f64::MAX, 0, 0);
    for round in 0..REPEATS {
        if !is_warm {
            memory.iter_mut().for_each(|column| column.fill(f64::NAN));
        }
        let given = totals(round, change);
        let given: Vec<&[f64]> = given.iter().map(Vec::as_slice).collect();
        let mut memory: Vec<&mut [f64]> = memory.iter_mut().map(Vec::as_mut_slice).collect();
        let mut found: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
        let columns = Totals { totals: &given, memory: &mut memory, concentrations: &mut found };
        let start = Instant::now();
        let effort = speciation.solve(width, columns, &mut workspace);
        let elapsed = start.elapsed().as_secs_f64();
        let effort = effort.unwrap_or_else(|refused| panic!("{refused:?}"));
        if round > 0 || !is_warm {
            best = elapsed.min(best);
            evaluations = effort.evaluations;
            hard = effort.hard;
        }
    }
    let each = best / N as f64;
    let per = evaluations as f64 / N as f64;
    println!("{name:<44} {:7.3} µs {:9.0} /s {per:5.2} evaluations {hard} slow", each * 1e6, 1.0 / each);
}

fn main() {
    let wide = Width::widest();
    measure("ideal, warm 1 %", &carbonate(Activity::Ideal, false), wide, 0.01, true);
    measure("ideal, warm 0.1 %", &carbonate(Activity::Ideal, false), wide, 0.001, true);
    measure("ideal, warm 1 %, narrow", &carbonate(Activity::Ideal, false), Width::baseline(), 0.01, true);
    measure("ideal, cold", &carbonate(Activity::Ideal, false), wide, 0.01, false);
    measure("Davies, warm 1 %", &carbonate(Activity::Davies, false), wide, 0.01, true);
    measure("Davies, warm 0.1 %", &carbonate(Activity::Davies, false), wide, 0.001, true);
    measure("Davies, cold", &carbonate(Activity::Davies, false), wide, 0.01, false);
    measure(
        "extended Debye–Hückel, warm 1 %",
        &carbonate(Activity::ExtendedDebyeHuckel, false),
        wide,
        0.01,
        true,
    );
    measure("ideal and calcite, warm 1 %", &carbonate(Activity::Ideal, true), wide, 0.01, true);
    measure("Davies and calcite, warm 1 %", &carbonate(Activity::Davies, true), wide, 0.01, true);
    measure("Davies and calcite, cold", &carbonate(Activity::Davies, true), wide, 0.01, false);
}
