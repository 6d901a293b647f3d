//! Lines and areas cut at the edges of a panel.
//!
//! Owns the geometry of the cut. May use `panel`. It deliberately draws nothing.

use super::panel::Frame;

type Point = (f64, f64);

/// The part of a segment inside; nothing if there is none.
pub fn segment(a: Point, b: Point, frame: Frame) -> Segment {
    if a == b {
        return Segment { ends: Some([a, b]) };
    }
    // Places along the segment, 0 at a and 1 at b, where it crosses the edges.
    let (mut enter, mut leave) = (0.0, 1.0);
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let edges =
        [(-dx, a.0 - frame.left), (dx, frame.right - a.0), (-dy, a.1 - frame.top), (dy, frame.bottom - a.1)];
    for (speed, room) in edges {
        if speed == 0.0 && room < 0.0 {
            return Segment { ends: None };
        }
        let crossing = room / speed;
        if speed < 0.0 {
            enter = crossing.max(enter);
        } else if speed > 0.0 {
            leave = crossing.min(leave);
        }
    }
    let at = |place: f64| (a.0 + place * dx, a.1 + place * dy);
    let is_inside = enter <= leave && dx.is_finite() && dy.is_finite();
    Segment { ends: is_inside.then(|| [at(enter), at(leave)]) }
}

/// What a cut leaves of a segment.
pub struct Segment {
    ends: Option<[Point; 2]>,
}

impl Segment {
    pub fn to_vec(&self) -> Vec<Point> {
        self.ends.iter().flatten().copied().collect()
    }
}

/// The part of an area inside, edge by edge; what a log axis cannot show lies at its low end.
///
/// Source: Sutherland and Hodgman, Commun. ACM 17 (1974) 32
pub fn area(outline: &[Point], frame: Frame) -> Vec<Point> {
    let shown = |point: &Point| (point.0, if point.1.is_nan() { frame.bottom } else { point.1 });
    let far = |value: f64| value.clamp(-1e6, 1e6);
    let mut points: Vec<Point> =
        outline.iter().map(shown).filter(|p| !p.0.is_nan()).map(|p| (far(p.0), far(p.1))).collect();
    // Distance inside of each edge.
    let edges: [&dyn Fn(Point) -> f64; 4] =
        [&|p| p.0 - frame.left, &|p| frame.right - p.0, &|p| p.1 - frame.top, &|p| frame.bottom - p.1];
    for depth in edges {
        let before = std::mem::take(&mut points);
        for (idx, &to) in before.iter().enumerate() {
            let from = before[(idx + before.len() - 1) % before.len()];
            let (a, b) = (depth(from), depth(to));
            if (a < 0.0) != (b < 0.0) {
                let place = a / (a - b);
                points.push((from.0 + place * (to.0 - from.0), from.1 + place * (to.1 - from.1)));
            }
            if b >= 0.0 {
                points.push(to);
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Frame = Frame { left: 0.0, top: 0.0, right: 10.0, bottom: 10.0 };

    #[test]
    fn segments_end_at_the_edges() {
        assert_eq!(segment((-5.0, 5.0), (15.0, 5.0), FRAME).to_vec(), [(0.0, 5.0), (10.0, 5.0)]);
        assert_eq!(segment((1.0, 1.0), (2.0, 3.0), FRAME).to_vec(), [(1.0, 1.0), (2.0, 3.0)]);
        assert_eq!(segment((5.0, -5.0), (15.0, 5.0), FRAME).to_vec(), [(10.0, 0.0), (10.0, 0.0)]);
        assert!(segment((-5.0, 11.0), (15.0, 12.0), FRAME).to_vec().is_empty());
        assert!(segment((f64::NAN, 1.0), (5.0, 2.0), FRAME).to_vec().is_empty());
    }

    #[test]
    fn areas_end_at_the_edges() {
        let cut = area(&[(5.0, -5.0), (8.0, 5.0), (2.0, 5.0)], FRAME);
        assert_eq!(cut, [(3.5, 0.0), (6.5, 0.0), (8.0, 5.0), (2.0, 5.0)]);
        assert!(area(&[(20.0, 1.0), (30.0, 1.0), (30.0, 5.0)], FRAME).is_empty());
        assert!(area(&[], FRAME).is_empty());
    }
}
