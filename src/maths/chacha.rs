//! ChaCha8 in vertical lanes: 64 blocks of the cipher side by side, so that the compiler vectorises.
//!
//! Owns the generator of raw words. May use nothing else of the crate. It deliberately holds no
//! position: callers name the key, the stream and the draw, and get the same words for ever.

/// Blocks of the cipher that one draw computes side by side.
pub const LANES: usize = 64;

/// 32-bit words of one draw.
pub const DRAW: usize = 16 * LANES;

/// The words of one draw. Word `i` of the cipher's block `j` stands at `64·i + j`.
pub type Words = [u32; DRAW];

const CONSTANTS: [u32; 4] = [0x6170_7865, 0x3320_646e, 0x7962_2d32, 0x6b20_6574];

macro_rules! quarter_round {
    ($a:ident, $b:ident, $c:ident, $d:ident) => {
        $a = $a.wrapping_add($b);
        $d = ($d ^ $a).rotate_left(16);
        $c = $c.wrapping_add($d);
        $b = ($b ^ $c).rotate_left(12);
        $a = $a.wrapping_add($b);
        $d = ($d ^ $a).rotate_left(8);
        $c = $c.wrapping_add($d);
        $b = ($b ^ $c).rotate_left(7);
    };
}

/// Fills `words` with draw number `draw` of a stream: cipher blocks `64·draw … 64·draw + 63`.
///
/// - Equation: ChaCha with 8 rounds, 64-bit counter, 64-bit stream number (the original layout).
/// - Symbols: `key` eight words; `stream` the nonce; `draw` the counter in units of 64.
/// - Range: any key and stream; `draw < 2^58`.
/// - Source: D. J. Bernstein, "ChaCha, a variant of Salsa20" (2008).
/// - Shape: 1024 words per call; the inner loop over lanes has no branch.
#[inline(always)]
pub fn draw(key: &[u32; 8], stream: u64, draw: u64, words: &mut Words) {
    let counter = draw * LANES as u64;
    let (low, high) = (counter as u32, (counter >> 32) as u32);
    blocks(key, stream, |lane| (low.wrapping_add(lane as u32), high), words);
}

/// Fills `words` with the cipher block of each counter: lane `j` has the words of `counters[j]`.
///
/// Equation, symbols, range, source and shape are those of [`draw`]; the counters may be any.
#[inline(always)]
pub fn draw_each(key: &[u32; 8], stream: u64, counters: &[u64; LANES], words: &mut Words) {
    // Halves apart, as a loop is as narrow as its widest number.
    let (mut low, mut high) = ([0; LANES], [0; LANES]);
    for ((low, high), counter) in low.iter_mut().zip(&mut high).zip(counters) {
        (*low, *high) = (*counter as u32, (counter >> 32) as u32);
    }
    blocks(key, stream, |lane| (low[lane], high[lane]), words);
}

/// The sixteen words of one cipher block.
pub fn block(key: &[u32; 8], stream: u64, counter: u64) -> [u32; 16] {
    let [mut x0, mut x1, mut x2, mut x3] = CONSTANTS;
    let [mut x4, mut x5, mut x6, mut x7, mut x8, mut x9, mut x10, mut x11] = *key;
    let last = [counter as u32, (counter >> 32) as u32, stream as u32, (stream >> 32) as u32];
    let [mut x12, mut x13, mut x14, mut x15] = last;
    for _ in 0..4 {
        quarter_round!(x0, x4, x8, x12);
        quarter_round!(x1, x5, x9, x13);
        quarter_round!(x2, x6, x10, x14);
        quarter_round!(x3, x7, x11, x15);
        quarter_round!(x0, x5, x10, x15);
        quarter_round!(x1, x6, x11, x12);
        quarter_round!(x2, x7, x8, x13);
        quarter_round!(x3, x4, x9, x14);
    }
    let mixed = [x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12, x13, x14, x15];
    let start = |idx: usize| match idx {
        0..4 => CONSTANTS[idx],
        4..12 => key[idx - 4],
        _ => last[idx - 12],
    };
    std::array::from_fn(|idx| mixed[idx].wrapping_add(start(idx)))
}

/// One cipher block per lane.
#[inline(always)]
fn blocks(key: &[u32; 8], stream: u64, counter: impl Fn(usize) -> (u32, u32), words: &mut Words) {
    let (stream_low, stream_high) = (stream as u32, (stream >> 32) as u32);
    let (rows, _) = words.as_chunks_mut::<LANES>();
    let [r0, r1, r2, r3, r4, r5, r6, r7, r8, r9, r10, r11, r12, r13, r14, r15] = rows else { return };
    for lane in 0..LANES {
        let (count, high) = counter(lane);
        let [mut x0, mut x1, mut x2, mut x3] = CONSTANTS;
        let [mut x4, mut x5, mut x6, mut x7, mut x8, mut x9, mut x10, mut x11] = *key;
        let (mut x12, mut x13, mut x14, mut x15) = (count, high, stream_low, stream_high);
        macro_rules! double_round {
            () => {
                quarter_round!(x0, x4, x8, x12);
                quarter_round!(x1, x5, x9, x13);
                quarter_round!(x2, x6, x10, x14);
                quarter_round!(x3, x7, x11, x15);
                quarter_round!(x0, x5, x10, x15);
                quarter_round!(x1, x6, x11, x12);
                quarter_round!(x2, x7, x8, x13);
                quarter_round!(x3, x4, x9, x14);
            };
        }
        double_round!();
        double_round!();
        double_round!();
        double_round!();
        r0[lane] = x0.wrapping_add(CONSTANTS[0]);
        r1[lane] = x1.wrapping_add(CONSTANTS[1]);
        r2[lane] = x2.wrapping_add(CONSTANTS[2]);
        r3[lane] = x3.wrapping_add(CONSTANTS[3]);
        r4[lane] = x4.wrapping_add(key[0]);
        r5[lane] = x5.wrapping_add(key[1]);
        r6[lane] = x6.wrapping_add(key[2]);
        r7[lane] = x7.wrapping_add(key[3]);
        r8[lane] = x8.wrapping_add(key[4]);
        r9[lane] = x9.wrapping_add(key[5]);
        r10[lane] = x10.wrapping_add(key[6]);
        r11[lane] = x11.wrapping_add(key[7]);
        r12[lane] = x12.wrapping_add(count);
        r13[lane] = x13.wrapping_add(high);
        r14[lane] = x14.wrapping_add(stream_low);
        r15[lane] = x15.wrapping_add(stream_high);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_core::{Rng, SeedableRng};

    const KEY: [u32; 8] = [1, 2, 3, 0xffff_ffff, 5, 6, 7, 8];

    /// Expected values: the independent implementation of the crate `rand_chacha`.
    #[test]
    fn words_equal_an_independent_chacha8() {
        let mut bytes = [0; 32];
        for (chunk, word) in bytes.chunks_mut(4).zip(KEY) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        for (stream, number) in [(0, 0), (7, 3), (u64::MAX - 1, (1 << 26) - 1), (1 << 33, 1 << 40)] {
            let mut reference = ChaCha8Rng::from_seed(bytes);
            reference.set_stream(stream);
            reference.set_word_pos(u128::from(number) * DRAW as u128);
            let mut words = [0; DRAW];
            draw(&KEY, stream, number, &mut words);
            for block in 0..LANES {
                for word in 0..16 {
                    assert_eq!(
                        words[LANES * word + block],
                        reference.next_u32(),
                        "{stream} {number} {block} {word}"
                    );
                }
            }
        }
    }

    #[test]
    fn single_blocks_are_those_of_a_draw() {
        let counters = std::array::from_fn(|lane| 3 * DRAW as u64 / 16 + lane as u64);
        let (mut together, mut each) = ([0; DRAW], [0; DRAW]);
        draw(&KEY, 7, 3, &mut together);
        draw_each(&KEY, 7, &counters, &mut each);
        assert_eq!(together, each);
        for (lane, &counter) in counters.iter().enumerate() {
            let single: Vec<u32> = each.iter().skip(lane).step_by(LANES).copied().collect();
            assert_eq!(block(&KEY, 7, counter)[..], single);
        }
        draw_each(&KEY, 7, &[u64::MAX; LANES], &mut each);
        assert!(each.chunks(LANES).all(|row| row.iter().all(|word| *word == row[0])));
    }

    #[test]
    fn wide_lanes_give_the_same_words() {
        let (mut plain, mut wide) = ([0; DRAW], [0; DRAW]);
        draw(&KEY, 5, 9, &mut plain);
        pulp::Arch::new().dispatch(|| draw(&KEY, 5, 9, &mut wide));
        assert_eq!(plain, wide);
    }
}
