//! Numbers of candidates: which of eight are near, and what those that are have, side by side.
//!
//! Owns their form, 16 bits each in the order of bytes, so that four are a word. May use nothing but the lanes of a sum. It
//! deliberately keeps no list.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::near::LANES;

/// Candidates copied together at once: what fits beside each other in the nearest cache.
pub const ROOM: usize = 1024;

/// Numbers of candidates in a word.
const FOUR: usize = 4;

/// Four numbers of 16 bits that are one.
pub const ONES: u64 = 0x0001_0001_0001_0001;

/// By the bits of a mask: which of eight are set, one after the other, in 16 bits each.
pub static SETS: [[u64; 2]; 1 << LANES] = sets();

const fn sets() -> [[u64; 2]; 1 << LANES] {
    let mut sets = [[0; 2]; 1 << LANES];
    let mut mask = 0;
    while mask < sets.len() {
        let (mut bit, mut n) = (0, 0);
        while bit < LANES {
            if mask >> bit & 1 == 1 {
                sets[mask][n / 4] |= (bit as u64) << (16 * (n % 4));
                n += 1;
            }
            bit += 1;
        }
        mask += 1;
    }
    sets
}

/// What those that are near have, side by side: four of them at once, whose numbers are in one word.
#[inline(always)]
pub fn pick(source: &[f64; ROOM], found: &[u8; 2 * ROOM], target: &mut [f64]) {
    let (target, _) = target.as_chunks_mut::<FOUR>();
    let (found, _) = found.as_chunks::<{ 2 * FOUR }>();
    for piece in 0..target.len().min(found.len()) {
        let bits = u64::from_le_bytes(found[piece]);
        for k in 0..FOUR {
            target[piece][k] = source[(bits >> (16 * k)) as usize % ROOM];
        }
    }
}

/// The same of two sources.
#[inline(always)]
pub fn pick_two(
    (source, other_source): (&[f64; ROOM], &[f64; ROOM]),
    found: &[u8],
    target: &mut [f64],
    other_target: &mut [f64],
) {
    let (target, _) = target.as_chunks_mut::<FOUR>();
    let (other_target, _) = other_target.as_chunks_mut::<FOUR>();
    let (found, _) = found.as_chunks::<{ 2 * FOUR }>();
    for piece in 0..target.len().min(found.len()).min(other_target.len()) {
        let bits = u64::from_le_bytes(found[piece]);
        for k in 0..FOUR {
            let idx = (bits >> (16 * k)) as usize % ROOM;
            target[piece][k] = source[idx];
            other_target[piece][k] = other_source[idx];
        }
    }
}
