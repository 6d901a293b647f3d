//! Planes at which drift, dispersion or porosity jump.
//!
//! Owns the ways of particles through the planes of one axis. May use lanes, draws and the law of one plane. It
//! deliberately knows no formula of the coefficients: it asks the medium on both sides.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::lanes::{LANES, Lane, Lanes};
use super::medium::{Carrier, Medium};
use super::skew::{FAR, Law, Side, touch};
use super::trips::Numbers;
use super::walls::{Ends, Stride};

/// Distance from a plane at which its sides are looked at, relative to its place and to a displacement.
const BESIDE: f64 = 1e-9;
/// Parts of one way through planes that are followed.
const MOST_PARTS: usize = 1 << 16;
/// A part is so short that what begins halfway between two planes meets both of them once in 10⁵ (in 10³ where drift and
/// dispersion are as large as this allows): of the distance by drift, and of its square by dispersion.
const BY_DRIFT: f64 = 0.25;
const BY_DISPERSION: f64 = 0.025;
/// Parts of a step that end before a side and a plane are met in one.
const MOST_CUTS: f64 = 2048.0;

/// Planes normal to one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Interfaces {
    axis: usize,
    /// In order.
    at: Vec<f64>,
    /// Ends of an axis whose planes are there again and again.
    period: Option<(f64, f64)>,
    /// Places of the sides, where there are some.
    walls: [Option<f64>; 2],
}

/// Coefficients of one particle.
#[derive(Debug, Clone, Copy)]
struct Coefficients<const D: usize> {
    /// m/s
    drift: [f64; D],
    /// m²/s
    tensor: [[f64; D]; D],
    porosity: f64,
}

/// What 64 particles find below and above one plane.
type Beside<const D: usize> = [Vec<Coefficients<D>>; 2];

impl Interfaces {
    /// The planes of each axis that has some. Around a period its end is one of them, as coefficients differ there, too.
    pub fn of_axes<const D: usize>(planes: &[(usize, f64)], ends: &[Ends<D>; D]) -> Vec<Self> {
        let mut all = Vec::new();
        for (axis, ends) in ends.iter().enumerate() {
            let mut at: Vec<f64> =
                planes.iter().filter(|(other, _)| *other == axis).map(|(_, at)| *at).collect();
            if at.is_empty() {
                continue;
            }
            let (period, walls) = match ends {
                Ends::Periodic { low, high } => (Some((*low, *high)), [None; 2]),
                Ends::Walls(walls) => (None, [0, 1].map(|end| walls[end].as_ref().map(|wall| wall.at))),
            };
            at.extend(period.map(|(low, _)| low));
            at.sort_by(f64::total_cmp);
            at.dedup();
            all.push(Self { axis, at, period, walls });
        }
        all
    }

    /// Whether a displacement may meet a side and a plane.
    pub fn are_walled(&self) -> bool {
        self.walls.iter().any(Option::is_some)
    }

    /// The place of a plane by its number, if there is one.
    fn plane(&self, number: isize) -> Option<f64> {
        let n = self.at.len() as isize;
        match self.period {
            None => self.at.get(usize::try_from(number).ok()?).copied(),
            Some((low, high)) => {
                let turns = number.div_euclid(n) as f64;
                Some(self.at[number.rem_euclid(n) as usize] + turns * (high - low))
            }
        }
    }

    /// Number of the first plane above a place.
    fn above(&self, x: f64) -> isize {
        self.at.partition_point(|&at| at <= x) as isize
    }

    /// Applies the planes to all displacements that touched one.
    #[inline(always)]
    pub fn apply<const D: usize, M: Medium<D>>(&self, stride: &Stride<D, M>, lanes: &mut Lanes<D>) {
        let mut near = self.near(stride, lanes) & lanes.occupied() & !lanes.gone;
        if near == 0 {
            return;
        }
        let mut known = vec![None; self.at.len()];
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            self.cross(stride, lanes, lane, &mut known);
        }
    }

    /// One bit per particle that may have touched a plane.
    #[inline(always)]
    fn near<const D: usize, M: Medium<D>>(&self, stride: &Stride<D, M>, lanes: &Lanes<D>) -> u64 {
        let mut spread = [0.0; LANES];
        stride.medium.spread_along(stride.look, self.axis, &mut spread);
        let mut near = 0_u64;
        for lane in 0..LANES {
            let (time, before) = (stride.leap.time[lane], stride.before[self.axis][lane]);
            let after = lanes.positions[self.axis][lane];
            let drift = stride.medium.drift(stride.look, self.axis, lane);
            let above = self.above(before);
            let spread = spread[lane] * time;
            let is_near = |number: isize, sign: f64| {
                let Some(at) = self.plane(number) else { return false };
                let from = sign * (before - at);
                // With and without drift: what of it goes through the plane is not known yet.
                let to = (sign * (after - at)).min(sign * (after - drift * time - at));
                2.0 * from * to < FAR * spread || to <= 0.0
            };
            let gap = self.gap(above, before);
            let is_crowded = gap.is_crowded(drift, 0.5 * spread, time);
            let is_near = is_crowded || is_near(above - 1, 1.0) || is_near(above, -1.0);
            near |= u64::from(is_near && time > 0.0) << lane;
        }
        near
    }

    /// Where a place is between the planes below and above it; `above` is the number of the latter.
    fn gap(&self, above: isize, x: f64) -> Gap {
        let low = self.plane(above - 1).map_or(f64::INFINITY, |at| x - at);
        let high = self.plane(above).map_or(f64::INFINITY, |at| at - x);
        match low < high {
            true => Gap { plane: above - 1, side: 1, near: low.max(0.0), far: high },
            false => Gap { plane: above, side: 0, near: high.max(0.0), far: low },
        }
    }

    /// The end of one displacement.
    #[cold]
    #[inline(never)]
    fn cross<const D: usize, M: Medium<D>>(
        &self,
        stride: &Stride<D, M>,
        lanes: &mut Lanes<D>,
        lane: usize,
        known: &mut [Option<Beside<D>>],
    ) {
        let axis = self.axis;
        let before = stride.before[axis][lane];
        let time = stride.leap.time[lane];
        let own = Coefficients {
            drift: std::array::from_fn(|axis| stride.medium.drift(stride.look, axis, lane)),
            tensor: stride.medium.tensor(stride.look, lane),
            porosity: 1.0,
        };
        let kick = lanes.positions[self.axis][lane] - before - own.drift[self.axis] * time;
        let mut numbers = stride.draws.at_interfaces(lanes.ids[lane], stride.step, self.axis);
        let mut beside = |number: isize| -> [Coefficients<D>; 2] {
            let idx = number.rem_euclid(self.at.len() as isize) as usize;
            let beside = known[idx].get_or_insert_with(|| {
                let ways =
                    std::array::from_fn(|lane| lanes.positions[axis][lane] - stride.before[axis][lane]);
                self.beside(idx, (stride.medium, stride.carrier), stride.before, &ways)
            });
            [beside[0][lane], beside[1][lane]]
        };
        let above = self.above(before);
        let mut way = Way { planes: self, above, x: before, left: time, tally: Tally::new(self.axis) };
        let is_touched = way.begin(&own, kick, &mut beside, &mut numbers);
        if !is_touched {
            return;
        }
        way.go_on(&mut beside, &mut numbers);
        lanes.positions[self.axis][lane] = way.x + way.tally.rest;
        let kicks = way.tally.kicks(&mut numbers);
        for other in (0..D).filter(|&other| other != self.axis) {
            lanes.positions[other][lane] = stride.before[other][lane] + way.tally.shift[other] + kicks[other];
        }
    }

    /// Coefficients below and above a plane, at the places of all lanes along the other axes; `ways` say how far they go.
    fn beside<const D: usize, M: Medium<D>>(
        &self,
        idx: usize,
        (medium, carrier): (&M, &Carrier),
        positions: &[Lane; D],
        ways: &Lane,
    ) -> Beside<D> {
        let (at, axis) = (self.at[idx], self.axis);
        let side = |sign: f64| {
            let mut places: [Lane; D] = *positions;
            for lane in 0..LANES {
                let x = at + sign * (BESIDE * (at.abs() + ways[lane].abs())).max(f64::MIN_POSITIVE);
                places[axis][lane] = match self.period {
                    Some((low, high)) if x < low => x + (high - low),
                    _ => x,
                };
            }
            let mut look = medium.blank();
            medium.look(carrier, &places, &mut look);
            let mut porosity = [0.0; LANES];
            medium.porosities(&places, &mut porosity);
            let of = |lane: usize| Coefficients {
                drift: std::array::from_fn(|axis| medium.drift(&look, axis, lane)),
                tensor: medium.tensor(&look, lane),
                porosity: porosity[lane],
            };
            (0..LANES).map(of).collect()
        };
        [side(-1.0), side(1.0)]
    }

    /// Shortens times so that no displacement meets a side as well as a plane, down to a part of the step `dt`.
    ///
    /// - Equation: `|A| t ≤ d/4`, `D t ≤ d²/40`, `d` the distance to the farther of both; beyond the plane next to a side
    ///   either this with its distance and the coefficients here, or with the layer between and the coefficients there.
    /// - Symbols: `A` drift, `D` dispersion along the axis.
    /// - Range: both are met with a chance of 10⁻³ at most.
    /// - Source: first passage of a Brownian motion.
    /// - Shape: 64 times.
    #[inline(always)]
    pub fn limit<const D: usize, M: Medium<D>>(
        &self,
        (medium, carrier, look): (&M, &Carrier, &M::Look),
        positions: &[Lane; D],
        dt: f64,
        time: &mut Lane,
    ) {
        let axis = self.axis;
        let mut spread = [0.0; LANES];
        medium.spread_along(look, axis, &mut spread);
        for end in 0..2 {
            let Some(wall) = self.walls[end] else { continue };
            let idx = if end == 0 { 0 } else { self.at.len() - 1 };
            let sign = if end == 0 { 1.0 } else { -1.0 };
            let layer = sign * (self.at[idx] - wall);
            let mut beside = None;
            for lane in 0..LANES {
                let way = sign * (positions[axis][lane] - self.at[idx]);
                let far = if way < 0.0 { (-way).max(layer + way) } else { way };
                let mut limit = until(far, medium.drift(look, axis, lane), 0.5 * spread[lane]);
                if limit >= time[lane] {
                    continue;
                }
                if way >= 0.0 {
                    let beside = beside.get_or_insert_with(|| {
                        let ways = positions[axis].map(|x| x - self.at[idx]);
                        self.beside(idx, (medium, carrier), positions, &ways)
                    });
                    let there = &beside[end][lane];
                    limit = limit.max(until(layer, there.drift[axis], there.tensor[axis][axis]));
                }
                time[lane] = time[lane].min(limit.max(dt / MOST_CUTS));
            }
        }
    }
}

/// The planes around a place.
#[derive(Debug, Clone, Copy)]
struct Gap {
    /// Number of the nearer one.
    plane: isize,
    /// On which side of it the place is; 1 is above.
    side: usize,
    /// Distances to it and to the other one, m.
    near: f64,
    far: f64,
}

/// A time in which a plane so far away is not met, s.
fn until(far: f64, drift: f64, dispersion: f64) -> f64 {
    let (by_drift, by_dispersion) = (BY_DRIFT * far / drift.abs(), BY_DISPERSION * far * far / dispersion);
    by_drift.min(by_dispersion)
}

impl Gap {
    /// Whether both planes may be met within a time; `spread` is dispersion times time.
    #[inline(always)]
    fn is_crowded(&self, drift: f64, spread: f64, time: f64) -> bool {
        drift.abs() * time > BY_DRIFT * self.far || spread > BY_DISPERSION * self.far * self.far
    }
}

/// A particle on its way.
struct Way<'a, const D: usize> {
    planes: &'a Interfaces,
    /// Number of the first plane above it.
    above: isize,
    x: f64,
    /// s
    left: f64,
    tally: Tally<D>,
}

impl<const D: usize> Way<'_, D> {
    /// The first part of the way, which ends as it would without planes unless one is touched; whether it was.
    fn begin(
        &mut self,
        own: &Coefficients<D>,
        kick: f64,
        beside: &mut impl FnMut(isize) -> [Coefficients<D>; 2],
        numbers: &mut Numbers,
    ) -> bool {
        let axis = self.planes.axis;
        let gap = self.planes.gap(self.above, self.x);
        let (drift, dispersion) = (own.drift[axis], own.tensor[axis][axis]);
        if gap.is_crowded(drift, dispersion * self.left, self.left) {
            return true;
        }
        let law = law(&beside(gap.plane), axis);
        let away = if gap.side == 1 { 1.0 } else { -1.0 };
        let to = gap.near + away * (law.through[gap.side] * self.left + kick);
        let Some(time) = touch([gap.near, to], dispersion, self.left, numbers) else { return false };
        self.tally.add(own, law.through[gap.side], -away * gap.near, time);
        self.left = (self.left - time).max(0.0);
        self.leave(gap.plane, &law, beside, numbers);
        true
    }

    /// All other parts, until no time is left.
    fn go_on(&mut self, beside: &mut impl FnMut(isize) -> [Coefficients<D>; 2], numbers: &mut Numbers) {
        let axis = self.planes.axis;
        for _ in 0..MOST_PARTS {
            if self.left <= 0.0 {
                return;
            }
            let gap = self.planes.gap(self.above, self.x);
            let sides = beside(gap.plane);
            let law = law(&sides, axis);
            let own = &sides[gap.side];
            let (drift, dispersion) = (law.through[gap.side], own.tensor[axis][axis]);
            let part = self.left.min(until(gap.far, own.drift[axis], dispersion));
            let away = if gap.side == 1 { 1.0 } else { -1.0 };
            let kick = (2.0 * dispersion * part).sqrt() * numbers.normal();
            let to = gap.near + away * drift * part + kick;
            match touch([gap.near, to], dispersion, part, numbers) {
                None => {
                    self.tally.add(own, drift, away * (to - gap.near), part);
                    self.x += away * (to - gap.near);
                    self.left = if part < self.left { self.left - part } else { 0.0 };
                }
                Some(time) => {
                    self.tally.add(own, drift, -away * gap.near, time);
                    self.left = (self.left - time).max(0.0);
                    self.leave(gap.plane, &law, beside, numbers);
                }
            }
        }
    }

    /// From a plane on.
    fn leave(
        &mut self,
        plane: isize,
        law: &Law,
        beside: &mut impl FnMut(isize) -> [Coefficients<D>; 2],
        numbers: &mut Numbers,
    ) {
        let axis = self.planes.axis;
        let Some(at) = self.planes.plane(plane) else { return };
        let sides = beside(plane);
        let mut part = self.left.min(law.longest());
        for (side, other) in [(0, plane - 1), (1, plane + 1)] {
            if let Some(other) = self.planes.plane(other) {
                let own = &sides[side];
                part = part.min(until((other - at).abs(), own.drift[axis], own.tensor[axis][axis]));
            }
        }
        (self.x, self.above) = (at, plane + 1);
        if part <= 0.0 {
            return;
        }
        let stay = law.leave(part, numbers);
        for side in 0..2 {
            let way = match (side == stay.side, side) {
                (false, _) => 0.0,
                (true, 0) => -stay.distance,
                (true, _) => stay.distance,
            };
            self.tally.add(&sides[side], law.through[side], way, stay.times[side]);
            self.x += way;
        }
        self.above = plane + stay.side as isize;
        self.left = if part < self.left { self.left - part } else { 0.0 };
    }
}

/// The law of a plane between two sides.
fn law<const D: usize>(sides: &[Coefficients<D>; 2], axis: usize) -> Law {
    Law::new(sides.map(|own| Side {
        drift: own.drift[axis],
        dispersion: own.tensor[axis][axis],
        porosity: own.porosity,
    }))
}

/// What comes together on a way.
///
/// - Equation: with `β_t = D_tn/D_nn` of a side the coordinates `x_t − β_t (x_n − g)` have no jump and no covariance with
///   `x_n`: drift `A_t − β_t A_n`, dispersion `S_tu = D_tu − D_tn D_un/D_nn`, over the time on that side.
/// - Symbols: `n` normal to the planes, `t`, `u` along them, `g` the plane, `A` drift.
/// - Range: coefficients that are constant along the planes.
/// - Source: change of variables in `∇·φD∇c` with the same flux on both sides.
/// - Shape: one particle.
struct Tally<const D: usize> {
    axis: usize,
    /// Drift that does not go through planes, times time, m.
    rest: f64,
    /// Along the planes, m.
    shift: [f64; D],
    /// `Σ 2 S t`, m²
    cover: [[f64; D]; D],
}

impl<const D: usize> Tally<D> {
    fn new(axis: usize) -> Self {
        Self { axis, rest: 0.0, shift: [0.0; D], cover: [[0.0; D]; D] }
    }

    /// A part of the way on one side.
    fn add(&mut self, own: &Coefficients<D>, through: f64, way: f64, time: f64) {
        let n = self.axis;
        self.rest += (own.drift[n] - through) * time;
        let normal = own.tensor[n][n];
        let slope = |t: usize| if normal > 0.0 { own.tensor[t][n] / normal } else { 0.0 };
        for t in (0..D).filter(|&t| t != n) {
            self.shift[t] += slope(t) * (way - through * time) + own.drift[t] * time;
            for u in (0..D).filter(|&u| u != n) {
                self.cover[t][u] += 2.0 * (own.tensor[t][u] - slope(t) * own.tensor[u][n]) * time;
            }
        }
    }

    /// Numbers with the covariances of what is along the planes.
    fn kicks(&self, numbers: &mut Numbers) -> [f64; D] {
        let mut root = [[0.0; D]; D];
        let mut kicks = [0.0; D];
        let mut normals = [0.0; D];
        for i in (0..D).filter(|&i| i != self.axis) {
            normals[i] = numbers.normal();
            for j in (0..=i).filter(|&j| j != self.axis) {
                let known: f64 = (0..j).map(|k| root[i][k] * root[j][k]).sum();
                let rest = self.cover[i][j] - known;
                root[i][j] = match i == j {
                    true if rest > 1e-14 * self.cover[i][i] => rest.sqrt(),
                    false if root[j][j] > 0.0 => rest / root[j][j],
                    _ => 0.0,
                };
                kicks[i] += root[i][j] * normals[j];
            }
        }
        kicks
    }
}
