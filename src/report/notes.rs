//! Texts beside points, none over another.
//!
//! Owns the choice of their places. May use `panel` and `canvas`. It deliberately leaves out a text
//! that finds no room: tables hold them all.

use super::canvas::{Canvas, text_width};
use super::panel::{Frame, Look, Panel, SMALL, lettering};
use plotters::style::text_anchor::{HPos, VPos};

/// A text for a point, in the units of the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    pub at: (f64, f64),
    pub text: String,
}

const SIZE: f64 = SMALL - 1.0;
/// From the middle of a marker to its text.
const GAP: f64 = 6.0;

/// Left, top, right, bottom.
type Box4 = (f64, f64, f64, f64);

pub fn draw(canvas: &mut Canvas, panel: &Panel, frame: Frame) {
    for (at, text) in placed(panel, frame) {
        canvas.letters(&text, at, lettering(SIZE, HPos::Left, VPos::Center));
    }
}

/// Middle of the left edge of each text that finds room, in the order of the notes.
fn placed(panel: &Panel, frame: Frame) -> Vec<((f64, f64), String)> {
    let place = |point: &(f64, f64)| frame.place(&panel.x, &panel.y, *point);
    let markers = panel.marks.iter().filter(|mark| matches!(mark.look, Look::Marker(_) | Look::Dots));
    let mut taken: Vec<Box4> = markers
        .flat_map(|mark| mark.points.iter().map(place))
        .map(|(x, y)| (x - 4.0, y - 4.0, x + 4.0, y + 4.0))
        .collect();
    let strokes = strokes(panel, frame);
    let mut found = Vec::new();
    for note in &panel.notes {
        let (x, y) = place(&note.at);
        if !(x.is_finite() && y.is_finite()) {
            continue;
        }
        let (width, half) = (text_width(&note.text, SIZE), 0.55 * SIZE);
        let (right, left) = (x + GAP, x - GAP - width);
        let (above, below) = (y - GAP - half, y + GAP + half);
        let middle = x - 0.5 * width;
        let places = [
            (right, y),
            (middle, above),
            (middle, below),
            (left, y),
            (right, above),
            (right, below),
            (left, above),
            (left, below),
        ];
        let around = |(left, middle): (f64, f64)| (left, middle - half, left + width, middle + half);
        let is_free = |own: &Box4| {
            let is_inside =
                own.0 > frame.left && own.2 < frame.right && own.1 > frame.top && own.3 < frame.bottom;
            is_inside && !taken.iter().any(|other| overlap(own, other))
        };
        let is_clear = |own: &Box4| is_free(own) && !strokes.iter().any(|stroke| overlap(own, stroke));
        // Rather over a line than nowhere.
        let clear = places.into_iter().find(|at| is_clear(&around(*at)));
        if let Some(at) = clear.or_else(|| places.into_iter().find(|at| is_free(&around(*at)))) {
            taken.push(around(at));
            found.push((at, note.text.clone()));
        }
    }
    found
}

/// Small boxes along whole lines and error bars.
fn strokes(panel: &Panel, frame: Frame) -> Vec<Box4> {
    const STRIDE: f64 = 5.0;
    let mut boxes = Vec::new();
    for mark in &panel.marks {
        let (size, n) = match mark.look {
            Look::Line([]) => (2, 1),
            Look::Bars => (2, 2),
            _ => continue,
        };
        let points: Vec<_> =
            mark.points.iter().map(|point| frame.place(&panel.x, &panel.y, *point)).collect();
        for pair in points.windows(size).step_by(n) {
            let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
            let n_steps = ((dx.abs() + dy.abs()) / STRIDE).clamp(1.0, 400.0).ceil() as usize;
            boxes.extend((0..=n_steps).map(|k| {
                let part = k as f64 / n_steps as f64;
                let (x, y) = (pair[0].0 + part * dx, pair[0].1 + part * dy);
                (x - 1.5, y - 1.5, x + 1.5, y + 1.5)
            }));
        }
    }
    boxes
}

fn overlap(a: &Box4, b: &Box4) -> bool {
    a.0 < b.2 && b.0 < a.2 && a.1 < b.3 && b.1 < a.3
}

#[cfg(test)]
mod tests {
    use super::super::scale::{Scale, Spacing};
    use super::*;

    #[test]
    fn no_text_lies_over_another() {
        let scale = Scale { low: 0.0, high: 1.0, spacing: Spacing::Linear };
        let note = |k: usize| Note { at: (0.5 + 1e-3 * k as f64, 0.5), text: format!("point {k}") };
        let panel = Panel {
            title: String::new(),
            x_label: String::new(),
            y_label: String::new(),
            x: scale,
            y: scale,
            marks: Vec::new(),
            heat: None,
            key: Vec::new(),
            notes: (0..40).map(note).collect(),
        };
        let frame = Frame { left: 0.0, top: 0.0, right: 300.0, bottom: 200.0 };
        let found = placed(&panel, frame);
        assert!(found.len() > 3 && found.len() < 40, "{}", found.len());
        assert_eq!(found[0].1, "point 0");
        let boxes: Vec<Box4> =
            found.iter().map(|((x, y), text)| (*x, y - 5.0, x + text_width(text, SIZE), y + 5.0)).collect();
        for (idx, one) in boxes.iter().enumerate() {
            assert!(!boxes[..idx].iter().any(|other| overlap(one, other)), "{:?}", found[idx]);
        }
    }
}
