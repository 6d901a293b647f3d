//! Seconds, iterations and memory of random media and their flow: a million cells, variance 4.

#![allow(clippy::print_stdout)]

use lamella::flow::Cells;
use lamella::flow::darcy::{Problem, Side, solve};
use lamella::flow::random_field::{Covariance, RandomField, lognormal};
use std::time::Instant;

/// The most memory that the program had, MiB; zero where the system does not tell.
fn peak_mib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok()).unwrap_or(0) / 1024
}

fn measure(n: [usize; 3], variance: f64, across: f64) {
    let Some(cells) = Cells::equal([0.0; 3], n.map(|n| n as f64), n) else { return };
    let n_cells = cells.n_cells();
    let start = Instant::now();
    let field = RandomField { covariance: Covariance::Exponential, variance, lengths: [8.0; 3], seed: 1 };
    let sample = match field.realise(&cells) {
        Ok(sample) => sample,
        Err(error) => return println!("{n:?}: {error}"),
    };
    let conductivity = lognormal(1.0, &sample);
    let seconds = start.elapsed().as_secs_f64();
    println!("{n:?} variance {variance}: field {seconds:.2} s, box {:?}", sample.embedded);
    let problem = Problem {
        cells,
        conductivity,
        anisotropy: [1.0, across, across],
        porosity: vec![0.3; n_cells],
        sides: [[Side::Head(1.0), Side::Head(0.0)], [Side::NoFlow; 2], [Side::NoFlow; 2]],
        wells: Vec::new(),
    };
    let start = Instant::now();
    match solve(problem) {
        Ok(solution) => println!(
            "    flow {:.2} s, {} iterations, worst imbalance {:.1e} of the through-flow, {} MiB at most so far",
            start.elapsed().as_secs_f64(),
            solution.iterations,
            solution.worst_imbalance,
            peak_mib()
        ),
        Err(error) => println!("    {error}"),
    }
}

fn main() {
    for edge in [250, 500, 1000] {
        measure([edge, edge, 1], 4.0, 1.0);
    }
    for edge in [25, 50, 100] {
        measure([edge, edge, edge], 4.0, 1.0);
    }
    measure([1000, 1000, 1], 4.0, 0.01);
    measure([100, 100, 100], 4.0, 0.01);
}
