//! Nanoseconds of processor time per parcel and step of exchange, by neighbours, dimensions, kernels and sizes, and the floor
//! of the same sums.
//!
//! A step of parcels that walk sorts them and sums twice over neighbours; of parcels at rest it sums once.

#![allow(clippy::print_stdout)] // What a bench is for.

mod floor;
#[path = "../../tests/support/mod.rs"]
mod support;

use floor::{Floor, GAUSSIAN, POLYNOMIAL};
use lamella::engine::Settings;
use lamella::plan::exchange::{Cutoff, Exchange, Integration, Kernel, Normalisation};
use lamella::plan::{Placement, Plan, Side, Stage};

/// A square or a cube of parcels with so many neighbours, each.
fn plan(d: usize, n: u64, kernel: &str, neighbours: f64, walks: bool) -> Plan {
    let n_steps = (4_000_000 / n).clamp(2, 40);
    let axes = (0..d).map(|idx| support::axis(idx, 0.0, 1.0, Side::Periodic, 1)).collect();
    let ball = [2.0, std::f64::consts::PI, 4.0 / 3.0 * std::f64::consts::PI][d - 1];
    let reach = (neighbours / (ball * n as f64)).powf(1.0 / d as f64);
    let support = lamella::catalog::kernel::find(kernel).map_or(f64::INFINITY, |item| item.support);
    let radius = if support.is_finite() { support } else { 6.0 };
    let h = reach / radius;
    let dt = 0.25 * h * h;
    let mut plan = support::plain(axes, support::walk(d, 0.0), n, n_steps as f64 * dt, dt);
    plan.particles.placement = Placement::Stratified;
    plan.components[0].initial = support::step_down(0);
    plan.exchange = Some(Exchange {
        kernel: Kernel::Catalogue(kernel.to_owned()),
        bandwidth: support::constant(h),
        diffusion: (0..d)
            .flat_map(|row| (0..=row).map(move |column| f64::from(u8::from(row == column))))
            .collect(),
        spreading: None,
        cutoff: if support.is_finite() { Cutoff::default() } else { Cutoff::Radius(radius) },
        is_compensated: true,
        normalisation: Normalisation::Arithmetic,
        integration: Integration::Explicit,
    });
    // The same share for all kernels: above one, weights are cut down in a sum of its own.
    let share = plan.exchange.as_ref().map_or(1.0, |exchange| exchange.sizes(&plan, dt).share);
    plan.time.step = dt * 0.25 / share;
    plan.time.duration = n_steps as f64 * plan.time.step;
    if walks {
        plan.walk = support::walk(d, 1e-3);
        plan.stages = vec![Stage::Move, Stage::Bound, Stage::Exchange];
    } else {
        plan.stages = vec![Stage::Exchange];
    }
    plan
}

/// Least of some runs per parcel and step, ns.
fn measure(plan: &Plan, threads: usize) -> (f64, f64) {
    let settings = Settings { threads: Some(threads), ..Settings::default() };
    let (mut wall, mut cpu) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..3 {
        let (outcome, _) = support::run_with(plan, &settings).unwrap();
        let per_step = 1e9 / (plan.particles.count * plan.time.n_steps) as f64;
        wall = wall.min(outcome.loop_wall * per_step);
        cpu = cpu.min(outcome.cpu * per_step);
    }
    (wall, cpu)
}

fn tell(d: usize, n: u64, kernel: &str, neighbours: f64, threads: usize) {
    let (wall, cpu) = measure(&plan(d, n, kernel, neighbours, true), threads);
    let (_, still) = measure(&plan(d, n, kernel, neighbours, false), threads);
    println!(
        "{d}-D {n:>9} parcels, {kernel:<14} {neighbours:>5} neighbours, {threads} threads: wall {wall:7.1}, processor \
         {cpu:7.1} ns; at rest {still:7.1} ns"
    );
}

/// The floor and the engine side by side.
fn compare<const D: usize>(neighbours: f64) {
    const N: u64 = 100_000;
    let mut floor = Floor::<D>::new(N as usize, neighbours);
    let floors = [floor.measure::<GAUSSIAN>(5), floor.measure::<POLYNOMIAL>(5)];
    for (kernel, floor) in [("gaussian", floors[0]), ("wendland_c2", floors[1])] {
        let (_, walking) = measure(&plan(D, N, kernel, neighbours, true), 1);
        let (_, still) = measure(&plan(D, N, kernel, neighbours, false), 1);
        println!(
            "{D}-D {neighbours:>5} neighbours, {kernel:<14} floor {floor:7.1} ns; half a step {:7.1} ns, {:.2} times it; \
             a step at rest {still:7.1} ns, {:.2} times it",
            0.5 * walking,
            0.5 * walking / floor,
            still / floor
        );
    }
}

/// In a plane, in space.
fn compare_all(in_plane: bool, in_space: bool) {
    for neighbours in [30.0, 113.0] {
        if in_plane {
            compare::<2>(neighbours);
        }
        if in_space {
            compare::<3>(neighbours);
        }
    }
}

fn main() {
    let has = |word: &str| std::env::args().any(|argument| argument == word);
    if has("sizes") {
        return sizes();
    }
    compare_all(!has("space"), !has("plane"));
    if has("space") || has("plane") {
        return;
    }
    for d in 1..=3 {
        for item in lamella::catalog::kernel::ALL {
            tell(d, 100_000, item.name, 30.0, 1);
        }
    }
    sizes();
}

/// Of all sizes, or of those that are given as numbers.
fn sizes() {
    let given: Vec<u64> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let all = [100_000, 1_000_000, 10_000_000];
    for &n in if given.is_empty() { &all[..] } else { &given } {
        for neighbours in [30.0, 113.0] {
            tell(2, n, "gaussian", neighbours, 1);
            tell(2, n, "gaussian", neighbours, 2);
        }
    }
}
