//! Strokes and letters on an SVG page.
//!
//! Owns the way from page coordinates to the plotting crate. May use `color`. It deliberately knows
//! no data.

use super::color::{Rgb, WHITE};
use plotters::backend::{DrawingBackend, SVGBackend};
use plotters::prelude::{IntoFont, RGBAColor, ShapeStyle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontTransform, TextStyle};

/// The crate draws on whole pixels; a page this much finer, shown smaller, has smooth curves.
const FINE: f64 = 10.0;

/// The crate divides sizes of fonts by this number.
const FONT_DIVISOR: f64 = 1.24;

pub struct Canvas<'a> {
    backend: SVGBackend<'a>,
}

/// How a line is broken: lengths drawn and left out, in turn.
pub type Pattern = &'static [f64];

#[derive(Debug, Clone, Copy)]
pub struct Pen {
    pub color: Rgb,
    pub width: f64,
    pub opacity: f64,
}

impl Pen {
    pub fn new(color: Rgb, width: f64) -> Self {
        Self { color, width, opacity: 1.0 }
    }

    fn style(self, is_filled: bool) -> ShapeStyle {
        let Rgb(r, g, b) = self.color;
        let color = RGBAColor(r, g, b, self.opacity);
        ShapeStyle { color, filled: is_filled, stroke_width: (self.width * FINE).round() as u32 }
    }
}

#[derive(Clone, Copy)]
pub struct Lettering {
    pub size: f64,
    pub color: Rgb,
    pub horizontal: HPos,
    pub vertical: VPos,
    pub is_upright: bool,
}

/// Draws a page of `size` and returns it as SVG.
pub fn page(size: (f64, f64), draw: impl FnOnce(&mut Canvas)) -> String {
    let mut text = String::new();
    let fine = ((size.0 * FINE) as u32, (size.1 * FINE) as u32);
    {
        let mut canvas = Canvas { backend: SVGBackend::with_string(&mut text, fine) };
        canvas.rectangle((0.0, 0.0), size, Pen::new(WHITE, 0.0));
        draw(&mut canvas);
        canvas.backend.present().expect("a page in memory can be closed");
    }
    let written = format!("<svg width=\"{}\" height=\"{}\"", fine.0, fine.1);
    let shown = format!("<svg width=\"{}\" height=\"{}\"", size.0, size.1);
    text.replacen(&written, &shown, 1)
}

fn fine(point: (f64, f64)) -> (i32, i32) {
    ((point.0 * FINE).round() as i32, (point.1 * FINE).round() as i32)
}

impl Canvas<'_> {
    pub fn line(&mut self, points: &[(f64, f64)], pen: Pen) {
        if points.len() > 1 {
            let path = points.iter().map(|point| fine(*point));
            self.backend.draw_path(path, &pen.style(false)).expect(IN_MEMORY);
        }
    }

    /// A line broken by a pattern; an empty pattern is a whole line.
    pub fn broken_line(&mut self, points: &[(f64, f64)], pattern: Pattern, pen: Pen) {
        if pattern.is_empty() {
            return self.line(points, pen);
        }
        for dash in dashes(points, pattern) {
            self.line(&dash, pen);
        }
    }

    pub fn dot(&mut self, center: (f64, f64), radius: f64, pen: Pen) {
        let radius = (radius * FINE).round() as u32;
        self.backend.draw_circle(fine(center), radius, &pen.style(true), true).expect(IN_MEMORY);
    }

    /// Filled.
    pub fn rectangle(&mut self, corner: (f64, f64), opposite: (f64, f64), pen: Pen) {
        self.backend.draw_rect(fine(corner), fine(opposite), &pen.style(true), true).expect(IN_MEMORY);
    }

    /// A filled area.
    pub fn area(&mut self, corners: &[(f64, f64)], pen: Pen) {
        if corners.len() > 2 {
            let corners = corners.iter().map(|corner| fine(*corner));
            self.backend.fill_polygon(corners, &pen.style(true)).expect(IN_MEMORY);
        }
    }

    pub fn letters(&mut self, text: &str, at: (f64, f64), lettering: Lettering) {
        let Rgb(r, g, b) = lettering.color;
        let turn = if lettering.is_upright { FontTransform::Rotate270 } else { FontTransform::None };
        let font = ("sans-serif", lettering.size * FINE * FONT_DIVISOR).into_font().transform(turn);
        let color = RGBAColor(r, g, b, 1.0);
        let style =
            TextStyle::from(font).color(&color).pos(Pos::new(lettering.horizontal, lettering.vertical));
        self.backend.draw_text(text, &style, fine(at)).expect(IN_MEMORY);
    }
}

/// The page grows in memory; no device can refuse it.
const IN_MEMORY: &str = "a page in memory takes every stroke";

/// Pieces of a line that a pattern leaves to see.
fn dashes(points: &[(f64, f64)], pattern: Pattern) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = Vec::new();
    let mut piece: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    let (mut turn, mut left) = (0, pattern[0]);
    for pair in points.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        loop {
            let length = ((to.0 - from.0) * (to.0 - from.0) + (to.1 - from.1) * (to.1 - from.1)).sqrt();
            if length <= left {
                left -= length;
                piece.push(to);
                break;
            }
            let part = left / length;
            from = (from.0 + (to.0 - from.0) * part, from.1 + (to.1 - from.1) * part);
            piece.push(from);
            if turn % 2 == 0 {
                pieces.push(std::mem::take(&mut piece));
            }
            piece.clear();
            piece.push(from);
            turn += 1;
            left = pattern[turn % pattern.len()];
        }
    }
    if turn % 2 == 0 {
        pieces.push(piece);
    }
    pieces
}

/// Width of a text in a common sans-serif face, roughly.
pub fn text_width(text: &str, size: f64) -> f64 {
    text.chars().count() as f64 * size * 0.56
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_cuts_a_line_into_its_lengths() {
        // 0…3 drawn, 3…5 left out, 5…8 drawn, 8…10 left out; the corner at 4 lies in a gap.
        let pieces = dashes(&[(0.0, 0.0), (4.0, 0.0), (10.0, 0.0)], &[3.0, 2.0]);
        assert_eq!(pieces, [vec![(0.0, 0.0), (3.0, 0.0)], vec![(5.0, 0.0), (8.0, 0.0)]]);
    }
}
