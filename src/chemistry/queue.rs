//! Whose turn it is, and how a particle comes into a lane.
//!
//! Owns the order of particles, their columns on the way in, and those that wait with their slopes. May use the
//! driver of steps. It deliberately ends no particle.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::integrate::{IDLE, Lanes, Network, Stepper, Task};
use super::laws::{LANES, Lane};

/// Whose turn it is.
pub(super) struct Queue {
    /// The next of the chosen particles.
    pub next: usize,
    pub n_chosen: usize,
    /// The next of those that wait with their slopes.
    pub place: usize,
}

impl Queue {
    pub fn particle(&mut self, task: &Task<'_, '_>) -> Option<u32> {
        let is_over = task.ends_at_failure && !task.failures.is_empty();
        if self.next >= self.n_chosen || is_over {
            return None;
        }
        self.next += 1;
        Some(task.chosen.map_or((self.next - 1) as u32, |chosen| chosen[self.next - 1]))
    }

    /// Lets as many particles wait as there are lanes, with their slopes: these are found together.
    #[inline(always)]
    fn call<S: Stepper>(
        &mut self,
        network: &Network,
        stepper: &S,
        waiting: &mut Lanes,
        task: &mut Task<'_, '_>,
    ) {
        let mut n_new = 0;
        for l in 0..LANES {
            waiting.particle[l] = IDLE;
            if let Some(particle) = self.particle(task) {
                load(network, waiting, task, l, particle);
                n_new += 1;
            }
        }
        if n_new == 0 {
            return;
        }
        self.place = 0;
        stepper.begin(waiting);
        task.work.rates += n_new * stepper.start(waiting, task.dt);
        waiting.is_fresh = [false; LANES];
    }

    /// Gives lanes that are free the next particles.
    #[inline(always)]
    pub fn admit<S: Stepper>(
        &mut self,
        network: &Network,
        stepper: &S,
        (waiting, lanes): (&mut Lanes, &mut Lanes),
        task: &mut Task<'_, '_>,
    ) {
        if self.place == LANES && lanes.particle == [IDLE; LANES] {
            self.call(network, stepper, waiting, task);
            std::mem::swap(waiting, lanes);
            self.place = LANES;
            return;
        }
        for l in 0..LANES {
            if lanes.particle[l] != IDLE {
                continue;
            }
            if self.place == LANES {
                self.call(network, stepper, waiting, task);
            }
            let is_over = task.ends_at_failure && !task.failures.is_empty();
            if self.place == LANES || is_over {
                return;
            }
            take(waiting, self.place, lanes, l);
            self.place += 1;
            if self.place < LANES && waiting.particle[self.place] == IDLE {
                self.place = LANES;
            }
        }
    }
}

/// Moves a particle that has waited to a lane where it is integrated.
#[inline(always)]
fn take(waiting: &Lanes, from: usize, lanes: &mut Lanes, to: usize) {
    let columns = |lanes: &mut [Lane], waiting: &[Lane]| {
        lanes.iter_mut().zip(waiting).for_each(|(lane, waiting)| lane[to] = waiting[from]);
    };
    columns(&mut lanes.y, &waiting.y);
    columns(&mut lanes.slopes, &waiting.slopes);
    columns(&mut lanes.totals, &waiting.totals);
    columns(&mut lanes.positions, &waiting.positions);
    lanes.wanted[to] = waiting.wanted[from];
    lanes.particle[to] = waiting.particle[from];
    lanes.elapsed[to] = 0.0;
    lanes.count[to] = 0;
    lanes.reach[to] = 0.0;
    lanes.is_fresh[to] = false;
    lanes.was_rejected[to] = 0.0;
}

/// Puts a particle into a lane.
pub(super) fn load(network: &Network, lanes: &mut Lanes, task: &Task<'_, '_>, l: usize, particle: u32) {
    let at = particle as usize;
    for (component, value) in lanes.column.iter_mut().enumerate() {
        let carried = task.components[component][at];
        let is_below = network.system.is_positive[component] && carried < 0.0;
        *value = if is_below { 0.0 } else { carried };
        lanes.y[component][l] = *value;
    }
    network.invariants.totals(&lanes.column, &mut lanes.column_totals);
    for (total, value) in lanes.totals.iter_mut().zip(&lanes.column_totals) {
        total[l] = *value;
    }
    for (lane, column) in lanes.positions.iter_mut().zip(task.positions) {
        lane[l] = column.get(at).copied().unwrap_or(0.0);
    }
    let remembered = task.memory.get(at).copied().unwrap_or(0.0);
    lanes.wanted[l] = if remembered > 0.0 { f64::from(remembered) } else { 0.0 };
    lanes.elapsed[l] = 0.0;
    lanes.particle[l] = particle;
    lanes.count[l] = 0;
    lanes.reach[l] = 0.0;
    lanes.is_fresh[l] = lanes.wanted[l] == 0.0;
    lanes.was_rejected[l] = 0.0;
}
