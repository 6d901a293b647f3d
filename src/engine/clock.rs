//! Wall and processor time of a run.
//!
//! Owns the reading of clocks. May use nothing else of the crate. It deliberately never reaches a
//! snapshot: times are facts of a run, not results.

use std::time::{Duration, Instant};

/// Wall and processor time since a start, less the time that others took meanwhile.
pub struct Clock {
    start: Instant,
    cpu_start: Option<Duration>,
    away: Duration,
    cpu_away: Duration,
}

impl Clock {
    pub fn start() -> Self {
        Self {
            start: Instant::now(),
            cpu_start: processor_time(),
            away: Duration::ZERO,
            cpu_away: Duration::ZERO,
        }
    }

    /// Does something that is not counted: neither its wall time nor what is computed meanwhile.
    pub fn away<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let (start, cpu_start) = (Instant::now(), processor_time());
        let result = work();
        self.away += start.elapsed();
        self.cpu_away += since(cpu_start).unwrap_or_default();
        result
    }

    /// Wall seconds.
    pub fn wall(&self) -> f64 {
        self.start.elapsed().saturating_sub(self.away).as_secs_f64()
    }

    /// Processor seconds; wall seconds where the system does not tell.
    pub fn cpu(&self) -> f64 {
        since(self.cpu_start)
            .map_or_else(|| self.wall(), |cpu| cpu.saturating_sub(self.cpu_away).as_secs_f64())
    }
}

/// Processor time since an earlier reading.
fn since(start: Option<Duration>) -> Option<Duration> {
    Some(processor_time()?.saturating_sub(start?))
}

/// User and system time: of this thread if the engine has no other, so that runs side by side do not
/// count each other, and of all threads of the process if it has.
#[cfg(unix)]
fn processor_time() -> Option<Duration> {
    use rustix::time::{ClockId, clock_gettime};
    let is_alone = rayon::current_num_threads() == 1;
    let time = clock_gettime(if is_alone { ClockId::ThreadCPUTime } else { ClockId::ProcessCPUTime });
    Some(Duration::new(u64::try_from(time.tv_sec).ok()?, u32::try_from(time.tv_nsec).ok()?))
}

#[cfg(not(unix))]
fn processor_time() -> Option<Duration> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    /// Computes until the process has used that much.
    fn compute(wanted: Duration) {
        let start = processor_time();
        while since(start) < Some(wanted) {
            std::hint::black_box((0..1000).map(f64::from).sum::<f64>());
        }
    }

    /// What other tests compute meanwhile counts in both clocks: `whole` starts first and is read last, so
    /// that it holds all that `clock` holds and what `clock` leaves out.
    #[test]
    fn processor_time_of_others_is_not_counted() {
        let whole = Clock::start();
        let mut clock = Clock::start();
        clock.away(|| compute(Duration::from_millis(40)));
        let counted = clock.cpu();
        assert!(whole.cpu() - counted >= 0.04, "{counted}");
    }

    #[test]
    fn wall_time_of_others_is_not_counted() {
        let whole = Clock::start();
        let mut clock = Clock::start();
        clock.away(|| std::thread::sleep(Duration::from_millis(30)));
        let counted = clock.wall();
        assert!(whole.wall() - counted >= 0.03, "{counted}");
    }

    /// Ticks of a hundredth of a second would hide runs that take less.
    #[test]
    fn processor_time_is_finer_than_a_millisecond() {
        let clock = Clock::start();
        let mut readings = vec![clock.cpu()];
        while readings.len() < 50 {
            let now = clock.cpu();
            if now > readings[readings.len() - 1] {
                readings.push(now);
            }
        }
        let smallest = readings.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        assert!(smallest < 1e-3, "{smallest}");
    }
}
