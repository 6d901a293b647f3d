//! One panel: axes, marks, its own key.
//!
//! Owns how a panel is drawn inside its box. May use `canvas`, `scale`, `color`, `heat`. It
//! deliberately knows no species: texts and numbers come ready.

use super::canvas::{Canvas, Lettering, Pattern, Pen, text_width};
use super::clip;
use super::color::{GRID, INK, Rgb, WHITE};
use super::heat::Heat;
use super::notes::{self, Note};
use super::scale::{Scale, Spacing};
use plotters::style::text_anchor::{HPos, VPos};

/// How the points of a mark are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Look {
    Dots,
    Line(Pattern),
    /// Shapes, so that series are told apart without colour, too.
    Marker(Shape),
    /// Error bars: each pair of points is the low and the high end of one.
    Bars,
    /// A filled area; the points are its outline.
    Band,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    /// Around another one, to point it out; no shape of a series.
    Ring,
}

impl Shape {
    pub const ALL: [Self; 4] = [Self::Circle, Self::Square, Self::Triangle, Self::Diamond];

    fn draw(self, canvas: &mut Canvas, (x, y): (f64, f64), pen: Pen) {
        match self {
            Self::Circle => canvas.dot((x, y), 3.2, pen),
            Self::Square => canvas.rectangle((x - 2.9, y - 2.9), (x + 2.9, y + 2.9), pen),
            Self::Triangle => canvas.area(&[(x, y - 4.0), (x + 3.8, y + 2.8), (x - 3.8, y + 2.8)], pen),
            Self::Ring => {
                // Twelve corners of a circle of 6 pixels.
                const CORNERS: [(f64, f64); 4] = [(6.0, 0.0), (5.196, 3.0), (3.0, 5.196), (0.0, 6.0)];
                let quarter = |turn: fn((f64, f64)) -> (f64, f64)| CORNERS.map(turn);
                let circle = [
                    quarter(|(a, b)| (a, b)),
                    quarter(|(a, b)| (-b, a)),
                    quarter(|(a, b)| (-a, -b)),
                    quarter(|(a, b)| (b, -a)),
                ];
                let points: Vec<(f64, f64)> =
                    circle.concat().iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
                canvas.line(&points, Pen { width: 1.2, ..pen });
            }
            Self::Diamond => canvas.area(&[(x, y - 4.3), (x + 4.3, y), (x, y + 4.3), (x - 4.3, y)], pen),
        }
    }
}

/// A series in the units of the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    pub points: Vec<(f64, f64)>,
    pub color: Rgb,
    pub look: Look,
}

/// A sample with its text.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyEntry {
    pub text: String,
    pub color: Rgb,
    pub look: Look,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    pub title: String,
    pub x_label: String,
    pub y_label: String,
    pub x: Scale,
    pub y: Scale,
    pub marks: Vec<Mark>,
    pub heat: Option<Heat>,
    /// Only where the page's key does not tell the series apart.
    pub key: Vec<KeyEntry>,
    /// Texts beside points; those for which there is no room are left out, the last first.
    pub notes: Vec<Note>,
}

/// Left, top, right, bottom on the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Frame {
    /// Whether a place lies inside, or not far outside; false for what is no number.
    fn reaches(&self, at: (f64, f64)) -> bool {
        let is_near = |place: f64, low: f64, high: f64| place > 2.0 * low - high && place < 2.0 * high - low;
        is_near(at.0, self.left, self.right) && is_near(at.1, self.top, self.bottom)
    }

    pub fn place(&self, x: &Scale, y: &Scale, point: (f64, f64)) -> (f64, f64) {
        (
            self.left + x.fraction(point.0) * (self.right - self.left),
            self.bottom - y.fraction(point.1) * (self.bottom - self.top),
        )
    }
}

pub const SMALL: f64 = 11.0;
const MIDDLE: f64 = 12.0;
/// Part of a panel that a map to scale has to fill.
const NARROWEST: f64 = 0.25;

/// Letters in the ink of axes.
pub fn lettering(size: f64, horizontal: HPos, vertical: VPos) -> Lettering {
    Lettering { size, color: INK, horizontal, vertical, is_upright: false }
}

/// Draws a panel into its box.
pub fn draw(canvas: &mut Canvas, panel: &Panel, outer: Frame) {
    let color_bar = if panel.heat.is_some() { 58.0 } else { 0.0 };
    let y_ticks = panel.y.ticks(5);
    let inner = Frame {
        left: outer.left + left_margin(&y_ticks),
        top: outer.top + if panel.title.is_empty() { 12.0 } else { 28.0 },
        right: outer.right - 14.0 - color_bar,
        bottom: outer.bottom - 44.0,
    };
    let inner = if panel.heat.is_some() { to_scale(panel, inner) } else { inner };
    let title = Lettering { size: 13.0, ..lettering(13.0, HPos::Left, VPos::Bottom) };
    canvas.letters(&panel.title, (inner.left, inner.top - 4.0), title);
    let ticks = Ticks { x: x_ticks(panel, inner), y: y_ticks };
    grid(canvas, panel, &ticks, inner);
    if let Some(heat) = &panel.heat {
        heat.draw(canvas, inner);
    }
    for mark in &panel.marks {
        draw_mark(canvas, panel, mark, inner);
    }
    axes(canvas, panel, &ticks, inner);
    labels(canvas, panel, inner, outer);
    notes::draw(canvas, panel, inner);
    key(canvas, panel, inner);
}

/// The part of a frame in which a metre of either axis has one length; all of it for a map that would be a stripe.
fn to_scale(panel: &Panel, frame: Frame) -> Frame {
    let (width, height) = (frame.right - frame.left, frame.bottom - frame.top);
    let (x, y) = (panel.x.high - panel.x.low, panel.y.high - panel.y.low);
    let unit = (width / x).min(height / y);
    let (wide, high) = (unit * x, unit * y);
    if !unit.is_finite() || wide < NARROWEST * width || high < NARROWEST * height {
        return frame;
    }
    Frame { right: frame.left + wide, bottom: frame.top + high, ..frame }
}

/// Room for the axis label and the widest text of the ticks; the same in all panels unless one needs more.
fn left_margin(ticks: &[(f64, String)]) -> f64 {
    let is_narrow = |c: char| matches!(c, '.' | '·' | '⁻' | '¹' | '²' | '³' | '⁰' | '⁴'..='⁹');
    let width = |text: &String| {
        let n_narrow = text.chars().filter(|&c| is_narrow(c)).count();
        text_width(text, SMALL) - 0.22 * SMALL * n_narrow as f64
    };
    ticks.iter().map(|(_, text)| width(text) + 24.0).fold(62.0, f64::max)
}

/// Places and texts along both axes.
struct Ticks {
    x: Vec<(f64, String)>,
    y: Vec<(f64, String)>,
}

/// As many as stand beside each other with a gap.
fn x_ticks(panel: &Panel, frame: Frame) -> Vec<(f64, String)> {
    let room = |ticks: &[(f64, String)]| -> f64 {
        let named = ticks.iter().filter(|(_, text)| !text.is_empty());
        named.map(|(_, text)| text_width(text, SMALL) + 14.0).sum()
    };
    let fits = |ticks: &Vec<(f64, String)>| room(ticks) <= frame.right - frame.left;
    let mut choices = (2..=6).rev().map(|wanted| panel.x.ticks(wanted));
    choices.find(fits).unwrap_or_else(|| panel.x.ticks(1))
}

/// Lines behind the marks at the named ticks.
fn grid(canvas: &mut Canvas, panel: &Panel, ticks: &Ticks, frame: Frame) {
    if panel.heat.is_some() {
        return;
    }
    let pen = Pen::new(GRID, 0.6);
    for (value, _) in ticks.x.iter().filter(|(_, text)| !text.is_empty()) {
        let (x, _) = frame.place(&panel.x, &panel.y, (*value, panel.y.low));
        canvas.line(&[(x, frame.top), (x, frame.bottom)], pen);
    }
    for (value, _) in ticks.y.iter().filter(|(_, text)| !text.is_empty()) {
        let (_, y) = frame.place(&panel.x, &panel.y, (panel.x.low, *value));
        canvas.line(&[(frame.left, y), (frame.right, y)], pen);
    }
}

fn draw_mark(canvas: &mut Canvas, panel: &Panel, mark: &Mark, frame: Frame) {
    let place = |point: &(f64, f64)| frame.place(&panel.x, &panel.y, *point);
    let is_drawable = |point: &(f64, f64)| frame.reaches(*point);
    match mark.look {
        Look::Dots => {
            // Many dots shine through, so that their density shows; few are larger and full.
            let is_dense = mark.points.len() > 80;
            let (radius, opacity) = if is_dense { (1.5, 0.5) } else { (2.4, 1.0) };
            let pen = Pen { opacity, ..Pen::new(mark.color, 0.0) };
            for point in mark.points.iter().map(place).filter(is_drawable) {
                canvas.dot(point, radius, pen);
            }
        }
        Look::Line(pattern) => {
            let mut points: Vec<_> = mark.points.iter().map(place).collect();
            // A straight line may point out of the panel; a curve is covered by its scale.
            if let [a, b] = points[..] {
                points = clip::segment(a, b, frame).to_vec();
            }
            // A value that is missing or that a log axis cannot show interrupts the line.
            for piece in points.split(|point| !is_drawable(point)) {
                canvas.broken_line(piece, pattern, Pen::new(mark.color, 1.3));
            }
        }
        Look::Marker(shape) => {
            for point in mark.points.iter().map(place).filter(is_drawable) {
                shape.draw(canvas, point, Pen::new(mark.color, 0.0));
            }
        }
        Look::Bars => {
            for bar in mark.points.chunks_exact(2) {
                draw_bar(canvas, place(&bar[0]), place(&bar[1]), mark.color, frame);
            }
        }
        Look::Band => {
            let outline: Vec<_> = mark.points.iter().map(place).collect();
            canvas.area(&clip::area(&outline, frame), Pen { opacity: 0.2, ..Pen::new(mark.color, 0.0) });
        }
    }
}

/// From the low to the high end, with caps; a low end that a log axis cannot show lies on the axis.
fn draw_bar(canvas: &mut Canvas, low: (f64, f64), high: (f64, f64), color: Rgb, frame: Frame) {
    if !frame.reaches(high) {
        return;
    }
    let pen = Pen::new(color, 1.0);
    let is_cut = !(low.1.is_finite() && low.1 <= frame.bottom);
    let bottom = if is_cut { frame.bottom } else { low.1 };
    canvas.line(&[(high.0, bottom), (high.0, high.1)], pen);
    canvas.line(&[(high.0 - 3.0, high.1), (high.0 + 3.0, high.1)], pen);
    if !is_cut {
        canvas.line(&[(high.0 - 3.0, bottom), (high.0 + 3.0, bottom)], pen);
    }
}

fn axes(canvas: &mut Canvas, panel: &Panel, ticks: &Ticks, frame: Frame) {
    let pen = Pen::new(INK, 0.9);
    let Frame { left, top, right, bottom } = frame;
    canvas.line(&[(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], pen);
    for (value, text) in &ticks.x {
        let (x, _) = frame.place(&panel.x, &panel.y, (*value, panel.y.low));
        let length = if text.is_empty() { 2.5 } else { 4.0 };
        canvas.line(&[(x, bottom), (x, bottom + length)], pen);
        canvas.letters(text, (x, bottom + 6.0), lettering(SMALL, HPos::Center, VPos::Top));
    }
    for (value, text) in &ticks.y {
        let (_, y) = frame.place(&panel.x, &panel.y, (panel.x.low, *value));
        let length = if text.is_empty() { 2.5 } else { 4.0 };
        canvas.line(&[(left - length, y), (left, y)], pen);
        canvas.letters(text, (left - 6.0, y), lettering(SMALL, HPos::Right, VPos::Center));
    }
}

fn labels(canvas: &mut Canvas, panel: &Panel, inner: Frame, outer: Frame) {
    let middle = (0.5 * (inner.left + inner.right), 0.5 * (inner.top + inner.bottom));
    let below = lettering(MIDDLE, HPos::Center, VPos::Top);
    canvas.letters(&panel.x_label, (middle.0, inner.bottom + 23.0), below);
    let beside = Lettering { is_upright: true, ..lettering(MIDDLE, HPos::Center, VPos::Top) };
    // Numbers of a log axis are long: its name moves into the margin.
    let shift = if panel.y.spacing == Spacing::Log { -4.0 } else { 4.0 };
    canvas.letters(&panel.y_label, (outer.left + shift, middle.1), beside);
}

/// Where the panel holds the fewest points.
fn key(canvas: &mut Canvas, panel: &Panel, frame: Frame) {
    if panel.key.is_empty() {
        return;
    }
    let width = panel.key.iter().map(|entry| text_width(&entry.text, SMALL)).fold(0.0, f64::max) + 36.0;
    let height = 16.0 * panel.key.len() as f64 + 6.0;
    let (left, top) = emptiest_place(panel, frame, width, height);
    let paper = Pen { opacity: 0.85, ..Pen::new(WHITE, 0.0) };
    canvas.rectangle((left, top), (left + width, top + height), paper);
    for (row, entry) in panel.key.iter().enumerate() {
        draw_entry(canvas, entry, (left + 6.0, top + 11.0 + 16.0 * row as f64));
    }
}

/// A corner, or a place between the corners if all of these cover points.
fn emptiest_place(panel: &Panel, frame: Frame, width: f64, height: f64) -> (f64, f64) {
    let (left, right) = (frame.left + 5.0, frame.right - width - 5.0);
    let (top, bottom) = (frame.top + 5.0, frame.bottom - height - 5.0);
    let n_inside = |corner: (f64, f64)| {
        let points = panel.marks.iter().flat_map(|mark| &mark.points);
        let places = points.map(|point| frame.place(&panel.x, &panel.y, *point));
        // A dot reaches over its place.
        let (across, along) =
            (corner.0 - 3.0..corner.0 + width + 3.0, corner.1 - 3.0..corner.1 + height + 3.0);
        places.filter(|(x, y)| across.contains(x) && along.contains(y)).count()
    };
    let mut candidates = vec![(right, top), (left, top), (right, bottom), (left, bottom)];
    let between = |low: f64, high: f64, k: u32| low + (high - low) * f64::from(k) / 8.0;
    candidates.extend((0..81).map(|k| (between(left, right, k % 9), between(top, bottom, k / 9))));
    candidates.into_iter().min_by_key(|corner| n_inside(*corner)).unwrap_or((right, top))
}

/// A sample and its text, `at` the middle of its left edge. Returns the width it takes.
pub fn draw_entry(canvas: &mut Canvas, entry: &KeyEntry, at: (f64, f64)) -> f64 {
    let sample = match entry.look {
        Look::Dots => {
            canvas.dot((at.0 + 6.0, at.1), 3.2, Pen::new(entry.color, 0.0));
            14.0
        }
        Look::Line(pattern) => {
            canvas.broken_line(&[at, (at.0 + 24.0, at.1)], pattern, Pen::new(entry.color, 1.5));
            29.0
        }
        Look::Marker(shape) => {
            shape.draw(canvas, (at.0 + 6.0, at.1), Pen::new(entry.color, 0.0));
            14.0
        }
        Look::Bars => {
            let (x, color) = (at.0 + 6.0, entry.color);
            canvas.line(&[(x, at.1 - 6.0), (x, at.1 + 6.0)], Pen::new(color, 1.0));
            canvas.line(&[(x - 3.0, at.1 - 6.0), (x + 3.0, at.1 - 6.0)], Pen::new(color, 1.0));
            canvas.line(&[(x - 3.0, at.1 + 6.0), (x + 3.0, at.1 + 6.0)], Pen::new(color, 1.0));
            14.0
        }
        Look::Band => {
            let pen = Pen { opacity: 0.2, ..Pen::new(entry.color, 0.0) };
            canvas.rectangle((at.0, at.1 - 5.0), (at.0 + 24.0, at.1 + 5.0), pen);
            29.0
        }
    };
    canvas.letters(&entry.text, (at.0 + sample, at.1), lettering(SMALL, HPos::Left, VPos::Center));
    entry_width(entry)
}

/// The room of a sample with its text and the gap after it.
pub fn entry_width(entry: &KeyEntry) -> f64 {
    let sample = match entry.look {
        Look::Dots | Look::Marker(_) | Look::Bars => 14.0,
        Look::Line(_) | Look::Band => 29.0,
    };
    sample + text_width(&entry.text, SMALL) + 16.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_labels_have_room_beside_the_name_of_the_axis() {
        let margin = |text: &str| left_margin(&[(1.0, "0".to_owned()), (2.0, text.to_owned())]);
        assert_eq!((margin("0.05"), margin("1.5·10⁶")), (62.0, 62.0));
        for text in ["123.456", "1.4995·10⁻⁷", "−0.29985"] {
            // Two thirds of what a common face needs for each character, beside the 16 of the name.
            let needed = text.chars().count() as f64 * SMALL * 0.37 + 6.0 + 16.0;
            assert!(margin(text) > 62.0 && margin(text) > needed, "{text}: {}", margin(text));
        }
    }
}
