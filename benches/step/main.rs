//! Nanoseconds of processor time per particle and step: the engine, its parts, and the floor of the
//! same loop.

#![allow(clippy::print_stdout)]

mod floor;
#[path = "../../tests/support/mod.rs"]
mod support;

use lamella::engine::Settings;
use lamella::maths::wide::Width;
use lamella::plan::{Plan, Stage};
use std::time::Instant;

const N_PARTICLES: u64 = 1_000_000;
const N_STEPS: u64 = 60;

fn measure(name: &str, plan: &Plan, threads: usize) {
    let settings = Settings { threads: Some(threads), ..Settings::default() };
    let (mut wall, mut cpu) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..4 {
        let (outcome, _) = support::run_with(plan, &settings).unwrap();
        let per_step = 1e9 / (N_PARTICLES * N_STEPS) as f64;
        wall = wall.min(outcome.loop_wall * per_step);
        cpu = cpu.min(outcome.cpu * per_step);
    }
    println!("{name:<40} {threads} threads: wall {wall:6.2} ns, processor {cpu:6.2} ns");
}

/// The floor on one core.
fn measure_floor() {
    let mut floor = floor::Floor::new(N_PARTICLES as usize, 300);
    let width = Width::widest();
    let mut wall = f64::INFINITY;
    for _ in 0..4 {
        let start = Instant::now();
        (0..N_STEPS).for_each(|_| floor.step(width));
        wall = wall.min(start.elapsed().as_secs_f64() * 1e9 / (N_PARTICLES * N_STEPS) as f64);
    }
    println!("{:<40} 1 threads: wall {wall:6.2} ns", "floor");
}

fn main() {
    measure_floor();
    let duration = 2.0 * N_STEPS as f64;
    let front = support::front(N_PARTICLES, 300, duration, 2.0);
    measure("fused", &front, 1);
    let stages = [Stage::Move, Stage::Bound, Stage::Average, Stage::Mix];
    // Mix alone has nothing to do: its means come from an average.
    for stage in [Stage::Move, Stage::Bound, Stage::Average] {
        let mut plan = front.clone();
        plan.stages = vec![stage];
        measure(&format!("{stage:?} alone"), &plan, 1);
    }
    let mut plan = front.clone();
    plan.stages = stages.to_vec();
    measure("separate passes", &plan, 1);
    let mut plan = front.clone();
    plan.outputs = support::front_outputs(
        300,
        vec![],
        (0..=12).map(|k| 10.0 * k as f64).filter(|&t| t <= duration).collect(),
    );
    measure("fused, total and mixing every 5 steps", &plan, 1);
    measure("fused", &front, 2);
    measure_floor();
    measure("fused", &front, 1);
}
