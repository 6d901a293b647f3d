//! Nanoseconds per particle and step of the engine beside the floor of the same loop.

#![allow(clippy::print_stdout)]

#[path = "../tests/support/mod.rs"]
mod support;

use lamella::engine::Settings;

fn main() {
    let every: Vec<f64> = (0..=151).map(|k| 10.0 * k as f64).collect();
    for threads in [1, 2] {
        for with_outputs in [false, true] {
            let mut plan = support::front(1_000_000, 300, 300.0, 2.0);
            if with_outputs {
                plan.outputs = support::front_outputs(
                    300,
                    vec![],
                    every.iter().copied().filter(|t| *t <= 300.0).collect(),
                );
            }
            let settings = Settings { threads: Some(threads), ..Settings::default() };
            let mut best = f64::INFINITY;
            for _ in 0..3 {
                let (outcome, _) = support::run_with(&plan, &settings).unwrap();
                best = best.min(outcome.cpu / 1e6 / 150.0 * 1e9);
            }
            println!("{threads} threads, outputs {with_outputs}: {best:.2} ns");
        }
    }
}
