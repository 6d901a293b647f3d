//! Nanoseconds per particle of chemistry: functions, closed forms and integrated networks. They are those of
//! the processor, so that what else the machine does counts less.

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
use rustix::time::{ClockId, clock_gettime};

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
        let start = processor_time();
        (0..repeats).for_each(|_| run());
        least.min((processor_time() - start) / f64::from(repeats))
    })
}

/// Nanoseconds of this thread.
fn processor_time() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e9 + time.tv_nsec as f64
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

/// What a sub-step costs with either method, in networks of some sizes: chains, where a component meets few
/// others, and rates that all components slow down.
fn sizes() {
    for n in [3, 5, 10, 20] {
        for is_dense in [false, true] {
            let mut chain = Network::new(n);
            for from in 0..n - 1 {
                let mut rate = chain.monod(from, 0.1);
                if is_dense {
                    let mut sum = chain.k(1.0);
                    for other in 0..n {
                        let c = chain.c(other);
                        sum = chain.binary(lamella::maths::operator::Binary::Add, sum, c);
                    }
                    rate = chain.binary(lamella::maths::operator::Binary::Divide, rate, sum);
                }
                chain.reaction(&[(from, -1.0), (from + 1, 1.0)], rate);
            }
            let start: Vec<Vec<f64>> = (0..n)
                .map(|k| (0..N).map(|idx| 0.1 + ((idx * (k + 3)) % 17) as f64 / 17.0).collect())
                .collect();
            let shape = if is_dense { "dense" } else { "chain" };
            for method in [Method::Rosenbrock, Method::Explicit] {
                let reactor = chain.reactor(method, 1e-6, 1e-6);
                network(&format!("{n} components, {shape}, {method:?}"), &reactor, &start, 3.0, 5);
            }
        }
    }
}

fn main() {
    functions();
    let column = |low: f64, high: f64| (0..N).map(|k| low + (high - low) * k as f64 / N as f64).collect();
    let mut pair = Network::new(3);
    pair.mass_action(1e-3, &[(0, 1.0), (1, 1.0)], &[(0, -1.0), (1, -1.0), (2, 1.0)]);
    let start = [column(0.0, 1.0), column(1.0, 0.0), column(0.0, 0.0)];
    sizes();
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
