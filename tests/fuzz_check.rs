//! Texts that nobody would write go through `check`: it never panics and never hangs. A bounded number
//! of them here; the example `fuzz_check` takes as many as it is told.

mod damage;

use damage::noise::Noise;
use damage::{LIMIT, shipped_scenes, time_of_check};

const N_TEXTS: u64 = 4_000;

#[test]
fn no_text_makes_the_checker_panic_or_hang() {
    let noise = Noise::new(shipped_scenes().into_iter().map(|(_, text)| text));
    for number in 0..N_TEXTS {
        let text = noise.text(number);
        match time_of_check(&text) {
            None => panic!("text {number} makes the checker panic:\n{text}"),
            Some(time) => assert!(time <= LIMIT, "text {number} takes {time:?}:\n{text}"),
        }
    }
}

#[test]
fn a_number_always_gives_the_same_text() {
    let noise = Noise::new(shipped_scenes().into_iter().map(|(_, text)| text));
    for number in [0, 1, 99_999, u64::MAX] {
        assert_eq!(noise.text(number), noise.text(number));
    }
}
