//! Wall and processor time of a run.
//!
//! Owns the reading of clocks. May use nothing else of the crate. It deliberately never reaches a
//! snapshot: times are facts of a run, not results.

use std::time::{Duration, Instant};

/// Time since a start, less the time that others took meanwhile.
pub struct Clock {
    start: Instant,
    cpu_start: Option<f64>,
    away: Duration,
}

impl Clock {
    pub fn start() -> Self {
        Self { start: Instant::now(), cpu_start: process_seconds(), away: Duration::ZERO }
    }

    /// Does something that is not counted as wall time.
    pub fn away<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.away += start.elapsed();
        result
    }

    /// Wall seconds.
    pub fn wall(&self) -> f64 {
        self.start.elapsed().saturating_sub(self.away).as_secs_f64()
    }

    /// Processor seconds of all threads of the process; wall seconds where the system does not tell.
    pub fn cpu(&self) -> f64 {
        match (self.cpu_start, process_seconds()) {
            (Some(start), Some(now)) => now - start,
            _ => self.wall(),
        }
    }
}

/// User and system time from `/proc/self/stat`, whose unit is 1/100 s on every Linux.
fn process_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let after_name = &stat[stat.rfind(')')? + 1..];
    let mut fields = after_name.split_whitespace().skip(11);
    let user: f64 = fields.next()?.parse().ok()?;
    let system: f64 = fields.next()?.parse().ok()?;
    Some((user + system) / 100.0)
}
