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
use network::Network;
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
    println!("{name:<40} {per:8.2} ns  ({:.2} sub-steps)", work.steps as f64 / N as f64);
}

/// Five acceptors that one donor and one biomass use after each other, each inhibited by the better ones.
pub fn chain() -> Network {
    let mut network = Network::new(5);
    for (acceptor, rate) in [(1, 2e-5), (2, 1e-5), (3, 5e-6)] {
        let (donor, own, scale) = (network.monod(0, 0.1), network.monod(acceptor, 0.01), network.k(rate));
        let biomass = network.c(4);
        let mut rate = network.times(donor, own);
        rate = network.times(rate, scale);
        rate = network.times(rate, biomass);
        for better in 1..acceptor {
            let (c, k) = (network.c(better), network.k(0.02));
            let sum = network.binary(lamella::maths::operator::Binary::Add, k, c);
            let inhibition = network.binary(lamella::maths::operator::Binary::Divide, k, sum);
            rate = network.times(rate, inhibition);
        }
        network.reaction(&[(0, -1.0), (acceptor, -0.8), (4, 0.1)], rate);
    }
    network.mass_action(1e-7, &[(4, 1.0)], &[(4, -1.0)]);
    network
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
                let reactor = chain().reactor(method, tolerance, 1e-6);
                network(&format!("Monod chain {name} {tolerance} {method:?}"), &reactor, &start, dt, 5);
            }
        }
    }
}
