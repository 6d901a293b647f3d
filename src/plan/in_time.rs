//! What an expression does over time at one place.
//!
//! Owns bounds over intervals of time, the times at which an expression switches, and the expression at one time.
//! May use tapes and `maths`. It deliberately samples nothing: bounds show where a switch can be, however short what
//! it switches on is.

use super::tape::{Binary, Lookup, Operation, Tape, Unary};
use crate::data::{Lookup as Ask, Rule};
use crate::maths::interval::Interval;
use crate::maths::scalar::{cos, sin};
use std::collections::VecDeque;

/// The input of tapes that is the time.
const TIME: u16 = 3;
/// Intervals that are looked at in the search for switches.
const MOST_LOOKS: usize = 100_000;
/// Switches as near as this, as a part of the time looked at, are one: comparisons are undecided at a few numbers
/// next to each other.
const NEAR: f64 = 1e-13;
/// Rows of tables at most.
const MOST_ROWS: usize = 20_000;

/// Whether a tape reads the time.
pub fn is_timed(tape: &Tape) -> bool {
    tape.operations.contains(&Operation::Input(TIME))
}

/// The tape at one time; one constant where it reads nothing else.
pub fn at_time(tape: &Tape, t: f64) -> Tape {
    let mut operations = tape.operations.clone();
    for idx in 0..operations.len() {
        let constant = |register: u16| match operations[usize::from(register)] {
            Operation::Constant(value) => Some(value),
            _ => None,
        };
        let folded = match &operations[idx] {
            Operation::Input(TIME) => Some(t),
            Operation::Unary(unary, a) => constant(*a).map(|a| unary.apply(a)),
            Operation::Binary(binary, a, b) => {
                constant(*a).and_then(|a| constant(*b).map(|b| binary.apply(a, b)))
            }
            Operation::Select(condition, then, otherwise) => match constant(*condition) {
                Some(condition) => constant(if condition != 0.0 { *then } else { *otherwise }),
                None => None,
            },
            Operation::Table(lookup) => {
                let mut at = [0.0; 3];
                let known = lookup
                    .reads()
                    .iter()
                    .zip(&mut at)
                    .all(|(&register, at)| constant(register).inspect(|value| *at = *value).is_some());
                known.then(|| lookup.table.look(Ask::Value, at, lookup.beyond))
            }
            Operation::Constant(_) | Operation::Input(_) => None,
        };
        if let Some(value) = folded {
            operations[idx] = Operation::Constant(value);
        }
    }
    match operations.last() {
        Some(&Operation::Constant(value)) => Tape { operations: vec![Operation::Constant(value)] },
        _ => Tape { operations },
    }
}

/// Bounds of every register over an interval of time.
///
/// - Equation: interval arithmetic; `sin` and `cos` of `m ± w` lie within `sin m ± w` and `cos m ± w`.
/// - Symbols: `m` middle and `w` half width.
/// - Range: any; bounds may be too wide, never too narrow.
/// - Source: R. E. Moore, Interval Analysis (1966); the slope of `sin` is 1 at most.
/// - Shape: one interval per operation.
fn registers(tape: &Tape, place: [f64; 3], time: Interval) -> Vec<Interval> {
    let mut list: Vec<Interval> = Vec::with_capacity(tape.operations.len());
    for operation in &tape.operations {
        let at = |register: u16| list[usize::from(register)];
        list.push(match operation {
            Operation::Constant(value) => Interval::of(*value),
            Operation::Input(TIME) => time,
            Operation::Input(input) => {
                place.get(usize::from(*input)).map_or(Interval::ANY, |&x| Interval::of(x))
            }
            Operation::Unary(unary @ (Unary::Sin | Unary::Cos), a) => wave(*unary, at(*a)),
            Operation::Unary(unary, a) => Interval::unary(*unary, at(*a)),
            Operation::Binary(binary, a, b) => Interval::binary(*binary, at(*a), at(*b)),
            Operation::Select(condition, then, otherwise) => {
                Interval::select(at(*condition), at(*then), at(*otherwise))
            }
            Operation::Table(lookup) => {
                let coordinates: Vec<Interval> =
                    lookup.reads().iter().map(|&register| at(register)).collect();
                between_rows(lookup, &coordinates)
            }
        });
    }
    list
}

fn wave(unary: Unary, a: Interval) -> Interval {
    let (middle, half) = (0.5 * (a.low + a.high), 0.5 * (a.high - a.low));
    let value = if unary == Unary::Sin { sin(middle) } else { cos(middle) };
    // A little wider, for what is rounded.
    let reach = half * (1.0 + 1e-12) + 1e-15;
    Interval::new((value - reach).max(-1.0), (value + reach).min(1.0))
}

/// Bounds of a table: those of its values at the ends and at the rows between, if one coordinate alone varies.
fn between_rows(lookup: &Lookup, coordinates: &[Interval]) -> Interval {
    let varying: Vec<usize> =
        (0..coordinates.len()).filter(|&axis| coordinates[axis].low != coordinates[axis].high).collect();
    let table = &lookup.table;
    let (lowest, highest) = table.range();
    let [axis] = varying[..] else {
        if varying.is_empty() {
            return Interval::of(table.look(Ask::Value, corner(coordinates, None), lookup.beyond));
        }
        return Interval::new(lowest, highest);
    };
    let Interval { low, high } = coordinates[axis];
    let rows = &table.axes()[axis];
    let within = &rows[rows.partition_point(|&x| x <= low)..rows.partition_point(|&x| x < high)];
    let mut bounds = Interval { low: f64::INFINITY, high: f64::NEG_INFINITY };
    for &x in within.iter().chain([&low, &high]) {
        let value = table.look(Ask::Value, corner(coordinates, Some((axis, x))), lookup.beyond);
        if value.is_nan() {
            return Interval::ANY;
        }
        bounds = Interval { low: bounds.low.min(value), high: bounds.high.max(value) };
    }
    bounds
}

/// Coordinates that are known, with one in place of its own.
fn corner(coordinates: &[Interval], own: Option<(usize, f64)>) -> [f64; 3] {
    let mut at = [0.0; 3];
    coordinates.iter().zip(&mut at).for_each(|(of, at)| *at = of.low);
    if let Some((axis, x)) = own {
        at[axis] = x;
    }
    at
}

/// Whether a table of steps has a row between two coordinates.
fn steps_between(lookup: &Lookup, of: Interval) -> bool {
    let rows = &lookup.table.axes()[0];
    let first = rows.partition_point(|&x| x <= of.low);
    lookup.table.rule() == Rule::Steps && rows.get(first).is_some_and(|&x| x <= of.high)
}

/// Times between two others at which a tape bends, as at the rows of a table.
pub fn kinks(tape: &Tape, from: f64, to: f64) -> Vec<f64> {
    let mut found = tape.kinks(TIME);
    found.retain(|&t| from < t && t < to);
    found.truncate(MOST_ROWS);
    found
}

/// Bounds of a tape at a place over an interval of time.
pub fn bounds(tape: &Tape, place: [f64; 3], from: f64, to: f64) -> Interval {
    registers(tape, place, Interval::new(from, to)).last().copied().unwrap_or(Interval::ZERO)
}

/// Whether all comparisons that the result hangs on, and all steps of tables, are the same all the time.
fn is_decided(tape: &Tape, place: [f64; 3], from: f64, to: f64) -> bool {
    let list = registers(tape, place, Interval::new(from, to));
    let is_open = |register: u16| {
        let of = list[usize::from(register)];
        of.low <= 0.0 && of.high >= 0.0 && of.low != of.high
    };
    let mut is_read = vec![false; tape.operations.len()];
    if let Some(last) = is_read.last_mut() {
        *last = true;
    }
    for (idx, operation) in tape.operations.iter().enumerate().rev() {
        if !is_read[idx] {
            continue;
        }
        match operation {
            Operation::Constant(_) | Operation::Input(_) => {}
            Operation::Unary(_, a) => is_read[usize::from(*a)] = true,
            Operation::Binary(binary, a, b) => {
                if is_comparison(*binary) && list[idx].low != list[idx].high {
                    return false;
                }
                is_read[usize::from(*a)] = true;
                is_read[usize::from(*b)] = true;
            }
            Operation::Table(lookup) => {
                let reads = lookup.reads();
                if reads.first().is_some_and(|&first| steps_between(lookup, list[usize::from(first)])) {
                    return false;
                }
                reads.iter().for_each(|&register| is_read[usize::from(register)] = true);
            }
            &Operation::Select(condition, then, otherwise) => {
                is_read[usize::from(condition)] = true;
                // What is not chosen does not matter.
                let always = !is_open(condition) && list[usize::from(condition)] != Interval::ZERO;
                let never = list[usize::from(condition)] == Interval::ZERO;
                is_read[usize::from(then)] |= !never;
                is_read[usize::from(otherwise)] |= !always;
            }
        }
    }
    true
}

fn is_comparison(binary: Binary) -> bool {
    matches!(
        binary,
        Binary::Less
            | Binary::LessEqual
            | Binary::Greater
            | Binary::GreaterEqual
            | Binary::Equal
            | Binary::NotEqual
    )
}

/// Times between two others at which a comparison in a tape changes, rising; the widest intervals are looked at
/// first, so that what is left over of very many lies close together.
pub fn switches(tape: &Tape, place: [f64; 3], from: f64, to: f64) -> Vec<f64> {
    if !is_timed(tape) || from >= to {
        return Vec::new();
    }
    let mut open = VecDeque::from([(from, to)]);
    let mut found = Vec::new();
    let mut looks = 0;
    while let Some((low, high)) = open.pop_front() {
        looks += 1;
        if is_decided(tape, place, low, high) {
            continue;
        }
        let middle = 0.5 * (low + high);
        if looks >= MOST_LOOKS || !(low < middle && middle < high) {
            found.push(high);
            continue;
        }
        open.extend([(low, middle), (middle, high)]);
    }
    found.sort_by(f64::total_cmp);
    let near = NEAR * (to - from).max(to.abs());
    found.dedup_by(|next, last| *next - *last <= near);
    found.retain(|&t| t > from && t < to);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tape(operations: Vec<Operation>) -> Tape {
        Tape { operations }
    }

    /// `if a <= t and t < b then 1 else 0`
    fn pulse(a: f64, b: f64) -> Tape {
        tape(vec![
            Operation::Input(3),
            Operation::Constant(a),
            Operation::Constant(b),
            Operation::Binary(Binary::LessEqual, 1, 0),
            Operation::Binary(Binary::Less, 0, 2),
            Operation::Binary(Binary::And, 3, 4),
            Operation::Constant(1.0),
            Operation::Constant(0.0),
            Operation::Select(5, 6, 7),
        ])
    }

    #[test]
    fn a_short_pulse_in_a_long_time_is_found() {
        let (day, a) = (86_400.0, 4_321_234.5);
        let found = switches(&pulse(a, a + 600.0), [0.0; 3], 0.0, 100.0 * day);
        assert_eq!(found.len(), 2);
        assert!((found[0] - a).abs() < 1e-8 && (found[1] - a - 600.0).abs() < 1e-8, "{found:?}");
        assert!(switches(&pulse(1.0, 2.0), [0.0; 3], 3.0, 9.0).is_empty());
    }

    #[test]
    fn waves_switch_at_their_zeros() {
        let wave = tape(vec![
            Operation::Input(3),
            Operation::Unary(Unary::Sin, 0),
            Operation::Constant(0.0),
            Operation::Binary(Binary::Greater, 1, 2),
        ]);
        let found = switches(&wave, [0.0; 3], 0.5, 20.0);
        assert_eq!(found.len(), 6);
        for (k, t) in found.iter().enumerate() {
            assert!((t - std::f64::consts::PI * (k + 1) as f64).abs() < 1e-11, "{found:?}");
        }
    }

    #[test]
    fn the_place_decides_when_a_front_passes() {
        // x < 2 t
        let front = tape(vec![
            Operation::Input(0),
            Operation::Input(3),
            Operation::Constant(2.0),
            Operation::Binary(Binary::Multiply, 1, 2),
            Operation::Binary(Binary::Less, 0, 3),
        ]);
        let found = switches(&front, [5.0, 0.0, 0.0], 0.0, 10.0);
        assert!(found.len() == 1 && (found[0] - 2.5).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn at_one_time_nothing_of_the_time_is_left() {
        assert_eq!(at_time(&pulse(1.0, 2.0), 1.5).operations, [Operation::Constant(1.0)]);
        assert_eq!(at_time(&pulse(1.0, 2.0), 2.5).operations, [Operation::Constant(0.0)]);
        let mixed =
            tape(vec![Operation::Input(0), Operation::Input(3), Operation::Binary(Binary::Multiply, 0, 1)]);
        let fixed = at_time(&mixed, 4.0);
        assert!(!is_timed(&fixed));
        assert_eq!(fixed.evaluate(&[3.0, 0.0, 0.0, 9.0]), 12.0);
        assert_eq!(bounds(&mixed, [2.0, 0.0, 0.0], 1.0, 3.0), Interval { low: 2.0, high: 6.0 });
    }
}
