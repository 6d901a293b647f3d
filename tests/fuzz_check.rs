//! Texts that nobody would write go through `check`: it never panics and never hangs. A bounded number
//! of them here; the example `fuzz_check` takes as many as it is told.

mod damage;

use damage::noise::Noise;
use damage::{messages, shipped_scenes};
use std::time::{Duration, Instant};

const N_TEXTS: u64 = 4_000;
/// A guard against hanging, hundreds of times what the slowest of these texts needs.
const LIMIT: Duration = Duration::from_secs(1);

#[test]
fn no_text_makes_the_checker_panic_or_hang() {
    let noise = Noise::new(shipped_scenes().into_iter().map(|(_, text)| text));
    for number in 0..N_TEXTS {
        let text = noise.text(number);
        let start = Instant::now();
        let said = std::panic::catch_unwind(|| messages(&text));
        assert!(said.is_ok(), "text {number} makes the checker panic:\n{text}");
        assert!(start.elapsed() < LIMIT, "text {number} takes {:?}:\n{text}", start.elapsed());
    }
}

#[test]
fn a_number_always_gives_the_same_text() {
    let noise = Noise::new(shipped_scenes().into_iter().map(|(_, text)| text));
    for number in [0, 1, 99_999, u64::MAX] {
        assert_eq!(noise.text(number), noise.text(number));
    }
}
