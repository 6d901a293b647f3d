//! Answers that several askers share.
//!
//! Owns who works an answer out and how many are kept. May use nothing of the crate. It deliberately keeps nothing
//! beyond the life of the program.

use serde::Serialize;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What an answer is known by.
pub type Key = [u8; 32];

/// BLAKE3 of everything that an answer follows from.
pub fn key(of: &impl Serialize) -> Key {
    let text = serde_json::to_string(of).expect("plans are described by finite numbers, lists and names");
    *blake3::hash(text.as_bytes()).as_bytes()
}

/// Answers by their keys, the one asked for last at the end.
#[derive(Debug)]
pub struct Memo<V> {
    slots: Mutex<Vec<(Key, Arc<OnceLock<V>>)>>,
    /// Bytes that are kept; one answer always is.
    most_bytes: usize,
}

impl<V: Clone> Memo<V> {
    pub fn new(most_bytes: usize) -> Self {
        Self { slots: Mutex::default(), most_bytes }
    }

    /// The answer of a key. Whoever asks first works it out; others who ask meanwhile wait for it.
    pub fn get(&self, key: Key, size: fn(&V) -> usize, work_out: impl FnOnce() -> V) -> V {
        let slot = {
            let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
            let slot = match slots.iter().position(|(own, _)| *own == key) {
                Some(idx) => slots.remove(idx),
                None => (key, Arc::default()),
            };
            let cell = slot.1.clone();
            slots.push(slot);
            cell
        };
        let value = slot.get_or_init(work_out).clone();
        self.forget(size);
        value
    }

    /// Drops the oldest answers until the others fit.
    fn forget(&self, size: fn(&V) -> usize) {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let bytes = |slot: &(Key, Arc<OnceLock<V>>)| slot.1.get().map_or(0, size);
        let mut sum: usize = slots.iter().map(bytes).sum();
        while sum > self.most_bytes && slots.len() > 1 {
            sum -= bytes(&slots.remove(0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn one_asker_works_and_all_others_wait() {
        let memo: Memo<usize> = Memo::new(100);
        let count = AtomicUsize::new(0);
        let ask = || {
            memo.get(
                [1; 32],
                |_| 1,
                || {
                    std::thread::sleep(std::time::Duration::from_millis(20));
                    count.fetch_add(1, Ordering::Relaxed) + 41
                },
            )
        };
        std::thread::scope(|scope| {
            let askers: Vec<_> = (0..8).map(|_| scope.spawn(ask)).collect();
            assert!(askers.into_iter().all(|asker| asker.join().unwrap() == 41));
        });
        assert_eq!(count.into_inner(), 1);
    }

    #[test]
    fn what_does_not_fit_is_forgotten_oldest_first() {
        let memo: Memo<usize> = Memo::new(25);
        let ask = |key: u8, value: usize| memo.get([key; 32], |_| 10, || value);
        assert_eq!((ask(1, 1), ask(2, 2), ask(1, 9)), (1, 2, 1));
        // The third pushes out the second, which was asked for longest ago.
        assert_eq!((ask(3, 3), ask(1, 9), ask(2, 8)), (3, 1, 8));
        let small: Memo<usize> = Memo::new(1);
        assert_eq!((small.get([1; 32], |_| 10, || 5), small.get([1; 32], |_| 10, || 6)), (5, 5));
    }
}
