//! Nanoseconds per particle of chemistry: functions, closed forms and integrated networks.

#![allow(clippy::print_stdout)]

#[allow(dead_code)]
#[path = "../tests/kinetics/network.rs"]
mod network;
#[path = "../tests/support/mod.rs"]
mod support;

use lamella::chemistry::{Batch, Reactor, Scratch, Work};
use lamella::maths::vector;
use lamella::maths::wide::Width;
use lamella::plan::chemistry::Method;
use network::{Network, redox_chain};
use std::time::Instant;

const N: usize = 512;

#[derive(Clone, Copy)]
enum Kind {
    Exp,
    Ln,
    Pow,
}

struct Each<'a>(&'a [f64], &'a mut [f64], Kind);

impl pulp::NullaryFnOnce for Each<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        // Plain loops: a closure is not compiled wide.
        let Self(x, y, kind) = self;
        for idx in 0..x.len().min(y.len()) {
            y[idx] = match kind {
                Kind::Exp => vector::exp(-x[idx]),
                Kind::Ln => vector::ln(x[idx]),
                Kind::Pow => vector::pow(x[idx], 0.7),
            };
        }
    }
}

fn functions() {
    let x: Vec<f64> = (0..N).map(|k| 0.01 + 0.02 * k as f64).collect();
    let mut y = vec![0.0; N];
    for (name, kind) in [("exp", Kind::Exp), ("ln", Kind::Ln), ("pow", Kind::Pow)] {
        for width in [Width::widest(), Width::baseline()] {
            let per = best(200, || width.run(Each(&x, &mut y, kind))) / N as f64;
            println!("{name:<40} {per:8.2} ns");
        }
    }
}

/// Nanoseconds of the fastest of a few runs.
fn best(repeats: u32, mut run: impl FnMut()) -> f64 {
    (0..7).fold(f64::INFINITY, |least, _| {
        let start = Instant::now();
        (0..repeats).for_each(|_| run());
        least.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(repeats))
    })
}

/// The same step again and again from the same values; with memory, as in a run.
fn network(name: &str, reactor: &Reactor, start: &[Vec<f64>], dt: f64, repeats: u32) {
    let mut columns = start.to_vec();
    let mut memory = vec![0.0_f32; N];
    let mut scratch = Scratch::default();
    let mut work = Work::default();
    let per = best(repeats, || {
        columns.iter_mut().zip(start).for_each(|(column, start)| column.copy_from_slice(start));
        let mut components: Vec<&mut [f64]> = columns.iter_mut().map(|column| &mut column[..]).collect();
        let batch =
            Batch { positions: [&[]; 3], t: 0.0, dt, components: &mut components, memory: &mut memory };
        work = reactor.react(batch, &mut scratch).unwrap_or_default();
    }) / N as f64;
    let each = |count: u64| count as f64 / N as f64;
    let (steps, rejected) = (each(work.steps), each(work.rejected));
    println!("{name:<40} {per:8.2} ns  ({steps:.2} sub-steps, {rejected:.2} rejected)");
}

fn main() {
    functions();
    let column = |low: f64, high: f64| (0..N).map(|k| low + (high - low) * k as f64 / N as f64).collect();
    let mut pair = Network::new(3);
    pair.mass_action(1e-3, &[(0, 1.0), (1, 1.0)], &[(0, -1.0), (1, -1.0), (2, 1.0)]);
    let start = [column(0.0, 1.0), column(1.0, 0.0), column(0.0, 0.0)];
    network("A + B, closed form", &pair.reactor(Method::Pair, 1e-6, 1e-9), &start, 100.0, 500);
    network("A + B, explicit", &pair.reactor(Method::Explicit, 1e-6, 1e-9), &start, 100.0, 50);
    network("A + B, Rosenbrock", &pair.reactor(Method::Rosenbrock, 1e-6, 1e-9), &start, 100.0, 50);
    let start = [column(0.2, 1.0), column(0.3, 0.0), column(0.5, 0.4), column(0.1, 1.0), column(0.1, 1.0)];
    for tolerance in [1e-4, 1e-6] {
        for (name, dt) in [("one hour", 3600.0), ("one day", 86400.0)] {
            for method in [Method::Rosenbrock, Method::Explicit] {
                let reactor = redox_chain().reactor(method, tolerance, 1e-6);
                network(&format!("Monod chain {name} {tolerance} {method:?}"), &reactor, &start, dt, 5);
            }
        }
    }
}
