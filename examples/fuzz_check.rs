//! Feeds numbered texts to `check`: `cargo run --release --example fuzz_check -- [how many] [from]`.
//!
//! Prints each text that makes it panic or takes longer than a second, and the slowest one. A number
//! always gives the same text, so `-- 1 NUMBER` repeats a find.
#![allow(clippy::print_stdout)]

#[path = "../tests/damage/mod.rs"]
mod damage;

use damage::noise::Noise;
use damage::{LIMIT, shipped_scenes, time_of_check};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// What one worker met.
#[derive(Default)]
struct Met {
    /// Number of each text with what is wrong about it.
    wrong: Vec<(u64, String)>,
    slowest: (Duration, u64),
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1).map(|argument| argument.parse::<u64>());
    let (n_texts, first) = match (arguments.next(), arguments.next()) {
        (None, None) => (100_000, 0),
        (Some(Ok(n_texts)), None) => (n_texts, 0),
        (Some(Ok(n_texts)), Some(Ok(first))) => (n_texts, first),
        _ => {
            println!("usage: fuzz_check [how many] [from which number]");
            return ExitCode::from(2);
        }
    };
    let noise = Noise::new(shipped_scenes().into_iter().map(|(_, text)| text));
    let start = Instant::now();
    let all = feed(&noise, first, first.saturating_add(n_texts));
    let n_wrong: usize = all.iter().map(|met| met.wrong.len()).sum();
    for (number, what) in all.iter().flat_map(|met| &met.wrong) {
        println!("text {number}: {what}\n{}\n", noise.text(*number));
    }
    let (slowest, number) = all.iter().map(|met| met.slowest).max().unwrap_or_default();
    println!("{n_texts} texts in {:.1} s, {n_wrong} wrong", start.elapsed().as_secs_f64());
    println!("slowest: text {number} in {:.1} ms", slowest.as_secs_f64() * 1e3);
    if n_wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// All texts from `first` up to `end`, each by the next worker that is free.
fn feed(noise: &Noise, first: u64, end: u64) -> Vec<Met> {
    let next = AtomicU64::new(first);
    let n_workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        let work = || {
            let mut met = Met::default();
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= end {
                    return met;
                }
                judge(noise, number, &mut met);
            }
        };
        let workers: Vec<_> = (0..n_workers).map(|_| scope.spawn(work)).collect();
        workers.into_iter().map(|worker| worker.join().expect("panics are caught")).collect()
    })
}

fn judge(noise: &Noise, number: u64, met: &mut Met) {
    let text = noise.text(number);
    let Some(elapsed) = time_of_check(&text) else {
        met.wrong.push((number, "panic".to_owned()));
        return;
    };
    if elapsed > LIMIT {
        met.wrong.push((number, format!("takes {elapsed:?}")));
    }
    met.slowest = met.slowest.max((elapsed, number));
}
