//! Nanoseconds of processor time per parcel and step of exchange, by neighbours, dimensions, kernels and sizes.

#![allow(clippy::print_stdout)] // What a bench is for.

#[path = "../tests/support/mod.rs"]
mod support;

use lamella::engine::Settings;
use lamella::plan::exchange::{Cutoff, Exchange, Integration, Kernel, Normalisation};
use lamella::plan::{Placement, Plan, Side, Stage};

/// A square or a cube of parcels with so many neighbours, each.
fn plan(d: usize, n: u64, kernel: &str, neighbours: f64, n_steps: u64) -> Plan {
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
    plan.stages = vec![Stage::Exchange];
    plan
}

fn measure(d: usize, n: u64, kernel: &str, neighbours: f64, threads: usize) {
    let n_steps = (4_000_000 / n).clamp(2, 40);
    let plan = plan(d, n, kernel, neighbours, n_steps);
    let settings = Settings { threads: Some(threads), ..Settings::default() };
    let (mut wall, mut cpu) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..3 {
        let (outcome, _) = support::run_with(&plan, &settings).unwrap();
        let per_step = 1e9 / (n * n_steps) as f64;
        wall = wall.min(outcome.loop_wall * per_step);
        cpu = cpu.min(outcome.cpu * per_step);
    }
    println!(
        "{d}-D {n:>9} parcels, {kernel:<14} {neighbours:>5} neighbours, {threads} threads: wall {wall:7.1}, processor {cpu:7.1} ns"
    );
}

fn main() {
    if let Some(only) = std::env::args().nth(1).and_then(|d| d.parse().ok()) {
        measure(only, 100_000, "gaussian", 30.0, 1);
        measure(only, 100_000, "wendland_c2", 30.0, 1);
        return;
    }
    for d in 1..=3 {
        for kernel in ["gaussian", "wendland_c2", "cubic_spline"] {
            measure(d, 100_000, kernel, 30.0, 1);
        }
    }
    measure(2, 100_000, "gaussian", 113.0, 1);
    measure(3, 100_000, "gaussian", 113.0, 1);
    for n in [100_000, 1_000_000, 10_000_000] {
        measure(2, n, "gaussian", 30.0, 1);
        measure(2, n, "gaussian", 30.0, 2);
    }
}
