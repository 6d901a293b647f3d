//! Faces at which the porosity jumps.
//!
//! Owns the law of a face, exact for coefficients that are constant on either side. May use lanes, draws and rulers.
//! It deliberately looks at one face per axis and displacement: sub-steps keep displacements below a cell.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::super::lanes::{LANES, Lanes};
use super::super::medium::Medium;
use super::super::walls::Stride;
use super::UnevenMedium;
use super::around::Around;
use super::records::{place, strides};
use crate::maths::scalar::exp;

/// `−ln` of the chance that a face was touched, beyond which nobody asks.
const FAR: f64 = 37.0;
/// The draws of jumps, beside those of walls, drains and interfaces.
const WHAT: u64 = 12;

/// Where the porosity of neighbours differs.
#[derive(Debug, Clone, PartialEq)]
pub struct Jumps {
    /// Per cell a bit for each face: twice the axis, plus one at its upper end.
    marks: Vec<u8>,
}

/// What displacements do by chance.
pub struct Chance<'a, const D: usize> {
    /// Dispersion tensor of a lane, over R, m²/s.
    pub tensor: &'a dyn Fn(usize) -> [[f64; D]; D],
    /// What of D is the same on both sides of a face, over R, m²/s: the molecular part. The rest goes on through it
    /// as φD. All of it is, where there is no number.
    pub even: Option<f64>,
}

/// A particle on its way through the axes of a displacement.
struct Walker<const D: usize> {
    cell: usize,
    place: [usize; D],
    porosity: f64,
}

/// One axis of a displacement.
#[derive(Debug, Clone, Copy)]
struct Way {
    from: f64,
    kick: f64,
    drift: f64,
    time: f64,
    uniforms: [f64; 2],
}

/// What is on one side of a face.
#[derive(Debug, Clone, Copy)]
struct Side {
    porosity: f64,
    /// D normal to the face, over R, m²/s.
    dispersion: f64,
}

impl Side {
    fn weight(self) -> f64 {
        self.porosity * self.dispersion.sqrt()
    }
}

impl Jumps {
    pub fn new<const D: usize>(n: [usize; D], porosity: &[f64]) -> Option<Self> {
        let strides = strides(n);
        let mark = |cell: usize| {
            let place = place(n, cell);
            let mut mark = 0_u8;
            for axis in 0..D {
                let is_other = |neighbour: usize| porosity[neighbour] != porosity[cell];
                let low = place[axis] > 0 && is_other(cell - strides[axis]);
                let high = place[axis] + 1 < n[axis] && is_other(cell + strides[axis]);
                mark |= u8::from(low) << (2 * axis) | u8::from(high) << (2 * axis + 1);
            }
            mark
        };
        let marks: Vec<u8> = (0..porosity.len()).map(mark).collect();
        marks.iter().any(|&mark| mark != 0).then_some(Self { marks })
    }

    /// Mends all displacements that may have touched a marked face.
    #[inline(always)]
    pub fn settle<const D: usize, M: Medium<D>>(
        &self,
        (medium, around): (&UnevenMedium<D>, &Around<D>),
        stride: &Stride<D, M>,
        chance: &Chance<D>,
        lanes: &mut Lanes<D>,
    ) {
        let mut near = 0_u64;
        for axis in 0..D {
            let mut spread = [0.0; LANES];
            stride.medium.spread_along(stride.look, axis, &mut spread);
            for lane in 0..LANES {
                let mark = self.marks[around.index[lane] as usize] >> (2 * axis);
                if mark & 3 == 0 {
                    continue;
                }
                let [low, high] = medium.rulers[axis].ends(around.place[axis][lane] as usize);
                let (before, after) = (stride.before[axis][lane], lanes.positions[axis][lane]);
                let far = FAR * spread[lane] * stride.leap.time[lane];
                let is_near = |from: f64, to: f64| to < 0.0 || 2.0 * from * to < far;
                let below = mark & 1 != 0 && is_near(before - low, after - low);
                let above = mark & 2 != 0 && is_near(high - before, high - after);
                near |= u64::from(below || above) << lane;
            }
        }
        near &= lanes.occupied() & !lanes.gone;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            self.settle_one((medium, around), stride, chance, lanes, lane);
        }
    }

    /// One displacement, axis by axis: each in the cell that the one before led to.
    #[cold]
    #[inline(never)]
    fn settle_one<const D: usize, M: Medium<D>>(
        &self,
        (medium, around): (&UnevenMedium<D>, &Around<D>),
        stride: &Stride<D, M>,
        chance: &Chance<D>,
        lanes: &mut Lanes<D>,
        lane: usize,
    ) {
        let cell = around.index[lane] as usize;
        let own = medium.porosity[cell];
        if own <= 0.0 {
            return;
        }
        let place = std::array::from_fn(|axis| around.place[axis][lane] as usize);
        let mut walker = Walker { cell, place, porosity: own };
        let uniforms = stride.draws.uniforms(lanes.ids[lane], stride.step, WHAT);
        let time = stride.leap.time[lane];
        let tensor = (chance.tensor)(lane);
        let drift: [f64; D] = std::array::from_fn(|axis| stride.medium.drift(stride.look, axis, lane) * time);
        // What is left to go by chance along each axis.
        let mut kick: [f64; D] =
            std::array::from_fn(|axis| lanes.positions[axis][lane] - stride.before[axis][lane] - drift[axis]);
        // Of what is not yet known.
        let mut rest = tensor;
        for axis in 0..D {
            let from = stride.before[axis][lane];
            let whole = tensor[axis][axis];
            let even = chance.even.map_or(whole, |even| even.min(whole));
            let of_flow = (whole - even) * own;
            let side = |porosity: f64| Side { porosity, dispersion: of_flow / porosity.max(1e-300) + even };
            let here = side(walker.porosity);
            let scale = if whole > 0.0 { (here.dispersion / whole).sqrt() } else { 0.0 };
            let way = Way {
                from,
                kick: kick[axis] * scale,
                drift: drift[axis] * own / walker.porosity,
                time,
                uniforms: [uniforms[2 * axis], uniforms[2 * axis + 1]],
            };
            let (by_chance, to) = match self.face(medium, &walker, axis, way, here) {
                Some((at, is_above, other)) => way.over(at, is_above, [here, side(other)]),
                None => (way.kick, way.from + way.kick + way.drift),
            };
            if rest[axis][axis] > 0.0 {
                // What goes with it along the other axes turns with it.
                for other in axis + 1..D {
                    kick[other] += rest[axis][other] / rest[axis][axis] * (by_chance - kick[axis]);
                }
                rest = without(rest, axis);
            }
            walker.go(medium, axis, to);
            lanes.positions[axis][lane] = to;
            if walker.porosity <= 0.0 {
                // Beyond a cell that has water lies one that has none: it stays where it was.
                walker.go(medium, axis, from);
                lanes.positions[axis][lane] = from;
            }
        }
    }

    /// The marked face of the walker's cell that a way touches rather than the other: its place, whether it is
    /// the upper one, and the porosity beyond.
    fn face<const D: usize>(
        &self,
        medium: &UnevenMedium<D>,
        walker: &Walker<D>,
        axis: usize,
        way: Way,
        here: Side,
    ) -> Option<(f64, bool, f64)> {
        let ends = medium.rulers[axis].ends(walker.place[axis]);
        let mut found: Option<(f64, (f64, bool, f64))> = None;
        for (end, at) in ends.into_iter().enumerate() {
            if self.marks[walker.cell] >> (2 * axis + end) & 1 == 0 {
                continue;
            }
            let stride = medium.strides[axis];
            let (sign, neighbour) =
                if end == 0 { (1.0, walker.cell - stride) } else { (-1.0, walker.cell + stride) };
            let from = (sign * (way.from - at)).max(0.0);
            let to = (from + sign * way.kick).min(from + sign * (way.kick + way.drift));
            let nearness = from * to;
            let is_near = to <= 0.0 || 2.0 * nearness < FAR * 2.0 * here.dispersion * way.time;
            if is_near && found.is_none_or(|(other, _)| nearness < other) {
                found = Some((nearness, (at, end == 1, medium.porosity[neighbour])));
            }
        }
        found.map(|(_, face)| face)
    }
}

/// Covariances once those with one axis are known.
fn without<const D: usize>(tensor: [[f64; D]; D], axis: usize) -> [[f64; D]; D] {
    let pivot = tensor[axis][axis];
    std::array::from_fn(|i| std::array::from_fn(|j| tensor[i][j] - tensor[i][axis] * tensor[axis][j] / pivot))
}

impl<const D: usize> Walker<D> {
    fn go(&mut self, medium: &UnevenMedium<D>, axis: usize, to: f64) {
        self.place[axis] = medium.rulers[axis].cell(to);
        self.cell = (0..D).map(|axis| self.place[axis] * medium.strides[axis]).sum();
        self.porosity = medium.porosity[self.cell];
    }
}

impl Way {
    /// The end of a way near a face between the walker's side and the other.
    ///
    /// - Equation: `u = (x − g)/√D`, `u* = u + √(2Δt) ξ`; if the face is touched, `u* ← |u*|` on the other side with
    ///   the chance `p = φ₂√D₂/(φ₁√D₁ + φ₂√D₂)`; `x = g ± u* √D`. It is touched if `u u* ≤ 0`, or with the chance
    ///   `e^{−u u*/Δt}`. Then the drift `A φ₁/φ` of the side, and what of it goes over the face times `φ/φ'`.
    /// - Symbols: `g` the face; `A` drift on the walker's side.
    /// - Range: any step; exact for coefficients that are constant on either side, so that the density stays
    ///   proportional to porosity. Where there is no water beyond, everything is thrown back.
    /// - Source: methods, section 1.3; skew Brownian motion (A. Lejay 2006, doi:10.1214/154957807000000013).
    /// - Shape: one particle, one axis: what it went by chance, and where it is.
    fn over(self, at: f64, is_above: bool, [here, beyond]: [Side; 2]) -> (f64, f64) {
        // Distances from the face, positive on the walker's side.
        let sign = if is_above { -1.0 } else { 1.0 };
        let from = (sign * (self.from - at)).max(0.0);
        let mut to = from + sign * self.kick;
        let mut is_over = false;
        let own = here.dispersion;
        if own > 0.0 {
            let is_touched = to <= 0.0 || self.uniforms[0] < exp(-from * to / (own * self.time));
            if is_touched {
                is_over = self.uniforms[1] * (here.weight() + beyond.weight()) < beyond.weight();
                to = if is_over { -to.abs() * (beyond.dispersion / own).sqrt() } else { to.abs() };
            }
        }
        let (side, other) = if is_over { (beyond, here) } else { (here, beyond) };
        let end = to + sign * self.drift * here.porosity / side.porosity;
        let is_further = if is_over { end > 0.0 } else { end < 0.0 };
        let end = match is_further {
            true if other.porosity > 0.0 => end * side.porosity / other.porosity,
            true => to,
            false => end,
        };
        (sign * (to - from), at + sign * end)
    }
}
