//! Directions of kernels, as `lamella density` is told of them.
//!
//! Owns the words of `--direction` and `--velocity`, and what is written of them. May use the engine's densities. It deliberately
//! estimates nothing.

use super::Stopped;
use super::density::{Arguments, wrong};
use lamella::engine::density::{Cell, Lattice, Orientation};
use lamella::maths::scalar::{cos, sin};
use std::f64::consts::PI;

/// Axes of all lattices.
const AXES: usize = 3;

/// Of the fastest mean velocity of a cell, what is taken for none.
const STAGNANT: f64 = 1e-6;

pub(super) fn is_asked_for(arguments: &Arguments) -> bool {
    !(arguments.direction.is_empty() && arguments.velocity.is_empty())
}

/// Which way kernels are stretched; `means` gives the mean velocity of each cell with particles.
pub(super) fn orientation(
    arguments: &Arguments,
    lattice: &Lattice,
    means: impl FnOnce() -> Vec<[f64; AXES]>,
) -> Result<Orientation, Stopped> {
    if !is_asked_for(arguments) {
        return Ok(Orientation::Axes);
    }
    if lattice.axes().filter(|&axis| lattice.cells[axis] > 1).count() < 2 {
        return Err(wrong(
            "on a line there is one direction: --direction and --velocity need two axes of several cells",
        ));
    }
    let d = lattice.d;
    if arguments.velocity.is_empty() {
        return direction(&arguments.direction, d).map(Orientation::All);
    }
    if arguments.velocity.len() != d {
        return Err(wrong(&format!("--velocity has {} columns for {d} axes", arguments.velocity.len())));
    }
    let mut means = means();
    let size = |mean: &[f64; AXES]| mean.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
    let fastest = means.iter().map(size).fold(0.0, f64::max);
    means.iter_mut().filter(|mean| size(mean) <= STAGNANT * fastest).for_each(|mean| *mean = [0.0; AXES]);
    Ok(Orientation::Each(means))
}

/// An angle in a plane, or components.
fn direction(words: &[String], d: usize) -> Result<[f64; AXES], Stopped> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    let mut direction = [0.0; AXES];
    if let ([word], 2) = (words, d) {
        let word = word.trim();
        let degrees = word.strip_suffix("deg").or(word.strip_suffix('°')).and_then(number);
        let angle = degrees.map(|own| own * PI / 180.0).or_else(|| word.strip_suffix("rad").and_then(number));
        let Some(angle) = angle else {
            return Err(wrong(&format!(
                "`{word}` is no angle such as 30deg or 0.5rad, and no direction such as 1,0.5"
            )));
        };
        (direction[1], direction[2]) = (cos(angle), sin(angle));
        return Ok(direction);
    }
    if words.len() != d {
        return Err(wrong(&format!("--direction has {} components for {d} axes", words.len())));
    }
    for (part, word) in direction[AXES - d..].iter_mut().zip(words) {
        *part = number(word)
            .ok_or_else(|| wrong(&format!("`{}` is no component of a direction", word.trim())))?;
    }
    if direction == [0.0; AXES] {
        return Err(wrong("a direction of zero length is none"));
    }
    Ok(direction)
}

/// Bandwidths by axis of the lattice, or the one along a direction first; zero where there is none.
pub(super) fn bandwidths(arguments: &Arguments, lattice: &Lattice, cell: &Cell) -> Vec<f64> {
    let mut bandwidths: Vec<f64> = lattice.axes().map(|axis| cell.h * cell.s[axis]).collect();
    // The first axis of several cells has it.
    if is_asked_for(arguments)
        && bandwidths.len() > 1
        && lattice.axes().next().is_some_and(|axis| lattice.cells[axis] == 1)
    {
        bandwidths.swap(0, 1);
    }
    bandwidths
}

/// The direction of a kernel, if it has one.
pub(super) fn of_cell(lattice: &Lattice, cell: &Cell) -> Vec<f64> {
    let first = lattice.axes().find(|&axis| lattice.cells[axis] > 1).filter(|_| !cell.is_stagnant);
    first.map_or_else(Vec::new, |first| lattice.axes().map(|axis| cell.axes[first][axis]).collect())
}

/// Where directions come from.
pub(super) fn note(arguments: &Arguments, notes: &mut serde_json::Value) {
    if !arguments.direction.is_empty() {
        notes["direction"] = serde_json::json!(arguments.direction);
    }
    if !arguments.velocity.is_empty() {
        notes["velocity"] = serde_json::json!(arguments.velocity);
    }
}
