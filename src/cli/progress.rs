//! How far a run is: a bar on a terminal, now and then a line elsewhere, nothing with `--quiet`.

use super::Terminal;
use super::text::{duration, with_prefix};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

const BAR_PERIOD: Duration = Duration::from_millis(100);
const LINE_PERIOD: Duration = Duration::from_secs(10);

/// Shows the steps of one run.
pub(crate) struct Progress<'a> {
    terminal: &'a Terminal,
    bar: Option<ProgressBar>,
    n_steps: u64,
    n_particles: u64,
    started: Instant,
    shown: Mutex<Instant>,
}

impl<'a> Progress<'a> {
    pub(crate) fn new(terminal: &'a Terminal, n_particles: u64, n_steps: u64) -> Self {
        let has_bar = !terminal.is_quiet() && !terminal.is_json() && std::io::stderr().is_terminal();
        let started = Instant::now();
        Self {
            terminal,
            bar: has_bar.then(|| bar(n_steps)),
            n_steps,
            n_particles,
            started,
            shown: Mutex::new(started),
        }
    }

    /// To be called after each step; costs next to nothing unless something is due to be shown.
    pub(crate) fn step_done(&self, n_done: u64) {
        let period = if self.bar.is_some() { BAR_PERIOD } else { LINE_PERIOD };
        let now = Instant::now();
        let Ok(mut shown) = self.shown.try_lock() else { return };
        if now.duration_since(*shown) < period {
            return;
        }
        *shown = now;
        let state =
            state(now.duration_since(self.started).as_secs_f64(), n_done, self.n_steps, self.n_particles);
        match &self.bar {
            Some(bar) => {
                bar.set_position(n_done);
                bar.set_message(state);
            }
            None => {
                let percent = 100 * n_done / self.n_steps.max(1);
                self.terminal.remark(&format!("step {n_done} of {} ({percent} %)  {state}", self.n_steps));
            }
        }
    }

    /// Takes the bar away, so that the summary stands alone.
    pub(crate) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn bar(n_steps: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(n_steps), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}") {
        bar.set_style(style.progress_chars("━╸ "));
    }
    bar
}

fn state(elapsed: f64, n_done: u64, n_steps: u64, n_particles: u64) -> String {
    let particle_steps = n_done as f64 * n_particles as f64;
    if particle_steps == 0.0 || elapsed <= 0.0 {
        return String::new();
    }
    let left = elapsed / n_done as f64 * n_steps.saturating_sub(n_done) as f64;
    format!(
        "{} particle-steps/s  {:.1} ns each  {} left",
        with_prefix(particle_steps / elapsed),
        1e9 * elapsed / particle_steps,
        duration(left)
    )
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_state_gives_rate_cost_and_time_left() {
        let shown = super::state(2.0, 200, 755, 1_000_000);
        assert_eq!(shown, "100 M particle-steps/s  10.0 ns each  5.55 s left");
        assert_eq!(super::state(2.0, 0, 755, 1_000_000), "");
    }
}
