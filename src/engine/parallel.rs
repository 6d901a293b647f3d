//! Work on many items at once.
//!
//! Owns the one parallel loop of the engine and the pool of scratch memory. May use nothing else of
//! the crate. It deliberately merges nothing: results stand in the order of items, whoever made them.

use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Calls `work` for `0..n` on the threads of the current pool. Not generic, so that it is compiled once.
///
/// Items begin in their order: whoever puts the dearest first has no thread left alone with one at the end.
fn for_each_idx(n: usize, work: &(dyn Fn(usize) + Sync)) {
    let next = AtomicUsize::new(0);
    (0..n).into_par_iter().with_max_len(1).for_each(|_| work(next.fetch_add(1, Ordering::Relaxed)));
}

/// Calls `work` with each item.
pub fn for_each<T: Send>(items: &mut [T], work: &(dyn Fn(usize, &mut T) + Sync)) {
    let cells: Vec<Mutex<&mut T>> = items.iter_mut().map(Mutex::new).collect();
    for_each_idx(cells.len(), &|idx| {
        let mut item = cells[idx].lock().unwrap_or_else(PoisonError::into_inner);
        work(idx, &mut item);
    });
}

/// How many threads the current pool has.
pub fn n_threads() -> usize {
    rayon::current_num_threads()
}

/// Results for `0..n`, in order.
pub fn map<R: Send>(n: usize, work: &(dyn Fn(usize) -> R + Sync)) -> Vec<R> {
    let mut results: Vec<Option<R>> = (0..n).map(|_| None).collect();
    for_each(&mut results, &|idx, result| *result = Some(work(idx)));
    results.into_iter().flatten().collect()
}

/// Scratch memory that threads take in turn: as many as threads that worked at once.
pub struct Pool<T> {
    idle: Mutex<Vec<Box<T>>>,
}

impl<T> Pool<T> {
    pub fn new() -> Self {
        Self { idle: Mutex::new(Vec::new()) }
    }

    /// Lends an idle item, or a new one. Its content is whatever the last borrower left.
    pub fn lend<R>(&self, new: impl FnOnce() -> Box<T>, work: impl FnOnce(&mut T) -> R) -> R {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut item = idle.unwrap_or_else(new);
        let result = work(&mut item);
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(item);
        result
    }
}
