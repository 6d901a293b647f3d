//! A map as coloured cells with its colour bar.
//!
//! Owns the thinning of large maps and the drawing. May use `canvas`, `color`, `scale`. It
//! deliberately keeps bins without particles apart from zero.

use super::canvas::{Canvas, Pen};
use super::color::{EMPTY, INK, Rgb, viridis};
use super::panel::{Frame, lettering};
use super::scale::{Scale, Spacing};
use plotters::style::text_anchor::{HPos, VPos};

/// More cells along an axis are averaged to at most this many.
const MOST_CELLS: usize = 150;
/// Colours told apart; neighbours of one colour are drawn as one.
const N_LEVELS: f64 = 80.0;
/// Page units by which a cell reaches under its neighbours.
const OVERLAP: f64 = 1.0;

/// Cells of a map, first axis to the right, second upwards; first axis slowest.
#[derive(Debug, Clone, PartialEq)]
pub struct Heat {
    pub n: (usize, usize),
    pub cells: Vec<Option<f64>>,
    pub unit: String,
}

impl Heat {
    /// Averages blocks of cells, each weighted by its particles, until the map is small enough.
    pub fn new(n: (usize, usize), cell: impl Fn(usize, usize) -> (f64, u64), unit: String) -> Self {
        let blocks = (n.0.div_ceil(MOST_CELLS).max(1), n.1.div_ceil(MOST_CELLS).max(1));
        let small = (n.0.div_ceil(blocks.0), n.1.div_ceil(blocks.1));
        let average = |i: usize, j: usize| {
            let (mut sum, mut weight) = (0.0, 0);
            for a in i * blocks.0..n.0.min((i + 1) * blocks.0) {
                for b in j * blocks.1..n.1.min((j + 1) * blocks.1) {
                    let (value, n_particles) = cell(a, b);
                    if n_particles > 0 && value.is_finite() {
                        sum += value * n_particles as f64;
                        weight += n_particles;
                    }
                }
            }
            (weight > 0).then(|| sum / weight as f64)
        };
        let cells = (0..small.0).flat_map(|i| (0..small.1).map(move |j| (i, j))).map(|(i, j)| average(i, j));
        Self { n: small, cells: cells.collect(), unit }
    }

    fn scale(&self) -> Scale {
        let values = self.cells.iter().flatten().copied();
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        let low = if low > 0.0 && low < 0.5 * high { 0.0 } else { low };
        if low < high {
            Scale { low, high, spacing: Spacing::Linear }
        } else {
            let low = if low.is_finite() { low } else { 0.0 };
            Scale { low, high: low + 1.0, spacing: Spacing::Linear }
        }
    }

    pub fn draw(&self, canvas: &mut Canvas, frame: Frame) {
        let scale = self.scale();
        let color = |cell: Option<f64>| cell.map_or(EMPTY, |value| level(scale.fraction(value)));
        let step =
            ((frame.right - frame.left) / self.n.0 as f64, (frame.bottom - frame.top) / self.n.1 as f64);
        for row in 0..self.n.1 {
            let cells = (0..self.n.0).map(|column| color(self.cells[column * self.n.1 + row]));
            let bottom = frame.bottom - step.1 * row as f64;
            for (start, end, color) in runs(cells) {
                let left = frame.left + step.0 * start as f64;
                // Over its far edges, where later cells cover it: no seam of paper shows between cells.
                let right = (frame.left + step.0 * end as f64 + OVERLAP).min(frame.right);
                let top = (bottom - step.1 - OVERLAP).max(frame.top);
                canvas.rectangle((left, top), (right, bottom), Pen::new(color, 0.0));
            }
        }
        self.color_bar(canvas, frame, &scale);
    }

    fn color_bar(&self, canvas: &mut Canvas, frame: Frame, scale: &Scale) {
        let (left, right) = (frame.right + 10.0, frame.right + 22.0);
        let n = N_LEVELS as usize;
        let step = (frame.bottom - frame.top) / n as f64;
        for k in 0..n {
            let bottom = frame.bottom - step * k as f64;
            let color = level((k as f64 + 0.5) / N_LEVELS);
            let top = (bottom - step - OVERLAP).max(frame.top);
            canvas.rectangle((left, top), (right, bottom), Pen::new(color, 0.0));
        }
        let pen = Pen::new(INK, 0.7);
        let Frame { top, bottom, .. } = frame;
        canvas.line(&[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], pen);
        for (value, text) in scale.ticks(5) {
            let y = frame.bottom - scale.fraction(value) * (frame.bottom - frame.top);
            canvas.line(&[(right, y), (right + 3.0, y)], pen);
            canvas.letters(&text, (right + 5.0, y), lettering(10.0, HPos::Left, VPos::Center));
        }
        canvas.letters(
            &self.unit,
            (right + 34.0, frame.top - 6.0),
            lettering(11.0, HPos::Right, VPos::Bottom),
        );
    }
}

fn level(fraction: f64) -> Rgb {
    viridis(((fraction * N_LEVELS).floor() + 0.5).clamp(0.5, N_LEVELS - 0.5) / N_LEVELS)
}

/// Neighbours of one colour as `(start, end, colour)`.
fn runs(cells: impl Iterator<Item = Rgb>) -> Vec<(usize, usize, Rgb)> {
    let mut runs: Vec<(usize, usize, Rgb)> = Vec::new();
    for (place, color) in cells.enumerate() {
        match runs.last_mut() {
            Some((_, end, last)) if *last == color => *end = place + 1,
            _ => runs.push((place, place + 1, color)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_maps_are_averaged_by_particles_and_empty_cells_stay_empty() {
        // 300 columns become 150 pairs: values 1 and 3 with weights 1 and 3 give 2.5.
        let cell = |i: usize, j: usize| {
            (1.0 + 2.0 * (i % 2) as f64, if j == 0 { 1 + 2 * (i as u64 % 2) } else { 0 })
        };
        let heat = Heat::new((300, 2), cell, String::new());
        assert_eq!(heat.n, (150, 2));
        assert_eq!((heat.cells[0], heat.cells[1]), (Some(2.5), None));
    }

    #[test]
    fn neighbours_of_one_colour_are_one_run() {
        let (a, b) = (Rgb(1, 1, 1), Rgb(2, 2, 2));
        assert_eq!(runs([a, a, b, a].into_iter()), [(0, 2, a), (2, 3, b), (3, 4, a)]);
    }
}
