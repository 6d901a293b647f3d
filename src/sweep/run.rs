//! Running the points: large ones alone on all cores, small ones side by side.
//!
//! Owns the schedule and the threads. May use the queue, the journal and the engine. It deliberately
//! lets no result hang on the schedule: keys, seeds and counts are fixed before.

use super::frame::Replicate;
use super::points::Points;
use super::queue::Series;
use super::replicate::{Task, refresh};
use super::{Journal, JournalError, Scene};
use crate::engine::Control;
use crate::plan::compile::Compiled;
use crate::scenario::Scenario;
use crate::table::Status;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// What a sweep is told of the world around it.
pub struct Surroundings {
    pub version: String,
    pub host: String,
    /// Microseconds since 1970, UTC.
    pub now: fn() -> i64,
    /// Bytes.
    pub peak_memory: fn() -> Option<u64>,
    /// Makes about one replicate in so many fail, for tests.
    pub fault_every: Option<u64>,
}

/// How to run; none of it changes a byte of the data tables.
#[derive(Debug, Clone)]
pub struct Settings {
    pub threads: usize,
    /// Bytes that all running points together may use.
    pub memory: Option<u64>,
    pub is_fail_fast: bool,
    /// Runs again what failed, and nothing else.
    pub is_retry_only: bool,
    /// Shard `k` of `n`: the points whose number leaves `k` when divided by `n`.
    pub shard: (u32, u32),
}

/// Where results are kept: the journal that is written, and those of other shards, which are looked into.
pub struct Store<'a> {
    pub journal: &'a Mutex<Journal>,
    pub others: &'a [Journal],
}

/// How far a sweep is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    pub n_total: u64,
    /// Run now and ended well, run now and failed, known from before.
    pub n_done: u64,
    pub n_failed: u64,
    pub n_reused: u64,
    /// Left alone, as only what failed was asked for.
    pub n_left: u64,
    /// Processor seconds by the cost model: of what was run now, and of what is left of the minimum.
    pub cost_done: f64,
    pub cost_left: f64,
}

/// Whoever follows a sweep.
pub trait Watch: Sync {
    fn is_cancelled(&self) -> bool;
    fn replicate_ended(&self, tally: &Tally);
    /// A replicate failed: the point's number, what it is called, and its row.
    fn replicate_failed(&self, number: u32, replicate: &Replicate);
}

/// How it ended.
#[derive(Debug)]
pub enum Ending {
    Complete,
    Interrupted,
    /// With `is_fail_fast`.
    Failed,
}

/// Runs what is not in the journal yet.
pub fn run(
    scene: &Scene,
    points: &Points,
    store: &Store,
    session: u32,
    settings: &Settings,
    around: &Surroundings,
    watch: &dyn Watch,
) -> Result<(Ending, Tally), JournalError> {
    let (shard, n_shards) = settings.shard;
    let order: Vec<u32> = points.by_cost().into_iter().filter(|number| number % n_shards == shard).collect();
    let least = scene.sweep.replicates.least;
    let cost: f64 = order.iter().map(|&number| points.list[number as usize].cost * f64::from(least)).sum();
    let tally = Tally { n_total: order.len() as u64 * u64::from(least), cost_left: cost, ..Tally::default() };
    let is_large = |number: &u32| {
        let point = &points.list[*number as usize];
        let share = settings.memory.unwrap_or(u64::MAX) / settings.threads.max(1) as u64;
        point.bytes > share || point.cost > cost / f64::from(least) / (2.0 * settings.threads as f64)
    };
    let (large, small): (Vec<u32>, Vec<u32>) = order.into_iter().partition(is_large);
    let mut runner = Runner {
        scene,
        points,
        store,
        session,
        settings,
        around,
        watch,
        state: Mutex::new(State { tally, ..State::default() }),
        changed: Condvar::new(),
    };
    runner.drain(large, 1, settings.threads);
    runner.drain(small, settings.threads, 1);
    let state = runner.state.get_mut().unwrap_or_else(PoisonError::into_inner);
    if let Some(error) = state.error.take() {
        return Err(error);
    }
    let ending = match state {
        _ if watch.is_cancelled() => Ending::Interrupted,
        State { is_stopped: true, .. } => Ending::Failed,
        _ => Ending::Complete,
    };
    let tally = state.tally;
    store.journal.lock().unwrap_or_else(PoisonError::into_inner).sync()?;
    Ok((ending, tally))
}

/// One replicate of a point.
type Item = (u32, u32);

#[derive(Default)]
struct State {
    order: Vec<u32>,
    /// Next of `order`, and next replicate of it.
    position: usize,
    replicate: u32,
    /// Replicates beyond the least that a point turned out to need.
    extra: Vec<Item>,
    open: HashMap<u32, Open>,
    n_running: usize,
    tally: Tally,
    is_stopped: bool,
    error: Option<JournalError>,
}

/// A point whose number of replicates is not known yet.
#[derive(Default)]
struct Open {
    series: Series,
    n_handed: u32,
    n_ended: u32,
}

struct Runner<'a> {
    scene: &'a Scene,
    points: &'a Points,
    store: &'a Store<'a>,
    session: u32,
    settings: &'a Settings,
    around: &'a Surroundings,
    watch: &'a dyn Watch,
    state: Mutex<State>,
    changed: Condvar,
}

/// The plan of the point that a worker is at.
struct Current {
    number: u32,
    scenario: Scenario,
    compiled: Compiled,
    compile_wall: f64,
}

impl Runner<'_> {
    /// Runs all of `order` on `n_workers` threads, each replicate on `threads`.
    fn drain(&self, order: Vec<u32>, n_workers: usize, threads: usize) {
        if order.is_empty() {
            return;
        }
        {
            let mut state = self.lock();
            (state.order, state.position, state.replicate) = (order, 0, 0);
        }
        std::thread::scope(|scope| {
            for _ in 0..n_workers.max(1) {
                scope.spawn(|| self.work(threads));
            }
        });
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// One worker: the engine runs on this thread unless it is given several.
    fn work(&self, threads: usize) {
        let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build() else {
            return;
        };
        pool.install(|| {
            let mut current: Option<Current> = None;
            while let Some((number, replicate)) = self.next() {
                let work = || self.end_to_end(&mut current, number, replicate, threads);
                // A worker that panics must not let the others wait for it.
                let value = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
                    let what = panic.downcast_ref::<String>().cloned().unwrap_or_default();
                    self.stop(JournalError::Worker(format!("point {number}, replicate {replicate}: {what}")));
                    f64::NAN
                });
                self.ended(number, replicate, value);
            }
        });
    }

    /// The next item, waiting while others may still bring one.
    fn next(&self) -> Option<Item> {
        let mut state = self.lock();
        loop {
            if state.is_stopped || state.error.is_some() || self.watch.is_cancelled() {
                return None;
            }
            let least = self.scene.sweep.replicates.least;
            let item = state.extra.pop().or_else(|| {
                let item = (*state.order.get(state.position)?, state.replicate);
                state.replicate += 1;
                if state.replicate >= least {
                    (state.position, state.replicate) = (state.position + 1, 0);
                }
                Some(item)
            });
            if item.is_some() {
                state.n_running += 1;
                return item;
            }
            if state.n_running == 0 {
                return None;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Notes an end; asks for more replicates where they are needed. A value is that of the criterion.
    fn ended(&self, number: u32, replicate: u32, value: f64) {
        let replicates = &self.scene.sweep.replicates;
        let mut state = self.lock();
        state.n_running -= 1;
        if replicates.until.is_some() && !self.settings.is_retry_only {
            let open = state.open.entry(number).or_default();
            open.n_handed = open.n_handed.max(replicates.least);
            open.series.set(replicate, value);
            open.n_ended += 1;
            if open.n_ended == open.n_handed {
                let (needed, _) = open.series.needed(replicates);
                let more = open.n_handed..needed;
                open.n_handed = open.n_handed.max(needed);
                if more.is_empty() {
                    state.open.remove(&number);
                } else {
                    let cost = self.points.list[number as usize].cost;
                    state.tally.n_total += more.len() as u64;
                    state.tally.cost_left += more.len() as f64 * cost;
                    state.extra.extend(more.map(|replicate| (number, replicate)));
                }
            }
        }
        self.changed.notify_all();
    }

    /// Runs a replicate unless the journal has it; the value of the criterion.
    fn end_to_end(&self, current: &mut Option<Current>, number: u32, replicate: u32, threads: usize) -> f64 {
        let combination = self.points.list[number as usize].combination;
        if current.as_ref().is_none_or(|current| current.number != number) {
            let begin = Instant::now();
            // It compiled when the points were made, so that it does again.
            let Ok((scenario, compiled)) = self.scene.compile(combination) else { return f64::NAN };
            let compile_wall = begin.elapsed().as_secs_f64();
            *current = Some(Current { number, scenario, compiled, compile_wall });
        }
        let Some(Current { scenario, compiled, compile_wall, .. }) = current.as_ref() else {
            return f64::NAN;
        };
        let (plan, key) = self.scene.replicate(&compiled.plan, combination, replicate);
        let entry = self.journal().entry(&key);
        let elsewhere = self.store.others.iter().find_map(|journal| Some((journal, journal.entry(&key)?)));
        let is_done = entry.is_some_and(|entry| entry.is_done());
        let is_done_elsewhere = elsewhere.is_some_and(|(_, entry)| entry.is_done());
        if is_done || is_done_elsewhere {
            self.tell(number, |tally| tally.n_reused += 1, false);
            if self.scene.sweep.replicates.until.is_none() {
                return f64::NAN;
            }
            let recorded = match (entry.filter(|entry| entry.is_done()), elsewhere) {
                (Some(entry), _) => self.journal().replicate(entry),
                (None, Some((journal, entry))) => journal.replicate(entry),
                (None, None) => return f64::NAN,
            };
            return match recorded {
                Ok(mut recorded) => {
                    refresh(&mut recorded, scenario, compiled);
                    self.criterion(&recorded)
                }
                Err(error) => {
                    self.stop(error);
                    f64::NAN
                }
            };
        }
        if self.settings.is_retry_only && entry.is_none() && elsewhere.is_none() {
            self.tell(number, |tally| tally.n_left += 1, false);
            return f64::NAN;
        }
        let task = Task {
            scene: self.scene,
            scenario,
            compiled,
            plan,
            key,
            combination,
            replicate,
            session: self.session,
            compile_wall: *compile_wall,
            memory: self.settings.memory,
        };
        let control = Cancel(self.watch);
        let Some(ended) = task.run(&control, threads, self.around) else { return f64::NAN };
        let has_failed = ended.row.status != Status::Done;
        let added = self.journal().add(&ended);
        if let Err(error) = added {
            self.stop(error);
            return f64::NAN;
        }
        if has_failed {
            self.watch.replicate_failed(number, &ended);
            self.lock().is_stopped |= self.settings.is_fail_fast;
        }
        let count = |tally: &mut Tally| if has_failed { tally.n_failed += 1 } else { tally.n_done += 1 };
        self.tell(number, count, true);
        self.criterion(&ended)
    }

    fn criterion(&self, replicate: &Replicate) -> f64 {
        let Some(until) = &self.scene.sweep.replicates.until else { return f64::NAN };
        let found = replicate.row.values.iter().find(|value| value.name == until.measure);
        found.and_then(|value| value.value).unwrap_or(f64::NAN)
    }

    fn journal(&self) -> MutexGuard<'_, Journal> {
        self.store.journal.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn stop(&self, error: JournalError) {
        self.lock().error.get_or_insert(error);
    }

    fn tell(&self, number: u32, count: impl FnOnce(&mut Tally), was_run: bool) {
        let cost = self.points.list[number as usize].cost;
        let tally = {
            let mut state = self.lock();
            count(&mut state.tally);
            state.tally.cost_left = (state.tally.cost_left - cost).max(0.0);
            if was_run {
                state.tally.cost_done += cost;
            }
            state.tally
        };
        self.watch.replicate_ended(&tally);
    }
}

/// The engine asks between steps whether to go on.
struct Cancel<'a>(&'a dyn Watch);

impl Control for Cancel<'_> {
    fn step_done(&self, _step: u64, _n_steps: u64) {}

    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}
