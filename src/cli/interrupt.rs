//! Ctrl-C as a flag that the run looks at between steps.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Set by Ctrl-C and by the signals that ask a program to end.
#[derive(Clone, Default)]
pub(crate) struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Starts to listen. Where no handler can be set, Ctrl-C ends the program as it always does.
    /// A program has one handler: who listens later hears the same.
    pub(crate) fn listen() -> Self {
        static FLAG: OnceLock<Interrupt> = OnceLock::new();
        let set = || {
            let interrupt = Self::default();
            let flag = interrupt.clone();
            let _ = ctrlc::set_handler(move || flag.0.store(true, Ordering::Relaxed));
            interrupt
        };
        FLAG.get_or_init(set).clone()
    }

    pub(crate) fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
