//! Parcels that come in with the water: through sides, and out of wells.
//!
//! Owns how many, where and with what. May use the plan, releases and `track`. It deliberately moves nothing.

use super::super::error::RunError;
use super::super::mass::place::{Faces, Place};
use super::super::mass::release::{Kind, Release, Sampling};
use super::super::mass::world::Site;
use super::super::track::medium::Medium;
use super::super::track::tracker::Tracker;
use super::composition::Composition;
use crate::plan::transport::SideRule;

/// Parts along an axis that a side is cut into where flow or porosity vary, with one and with two other axes.
const CUTS: [usize; 2] = [1024, 128];
/// Water through a side that lets none through, over the largest discharge times its area.
const LEAK: f64 = 1e-9;
/// Points along each axis at which the largest discharge is looked for.
const POINTS: usize = 24;

/// Water that comes in at one place.
pub struct Inlet<const D: usize> {
    pub release: Release<D>,
    pub composition: Composition,
}

/// A box or a rectangle with the water that comes in there, m³/s.
type Gush<const D: usize> = ([f64; D], [f64; D], f64);

/// All inlets. A parcel is `volume` of water, and carries `n` components.
pub fn inlets<const D: usize, M: Medium<D>>(
    site: &Site<D>,
    tracker: &Tracker<D, M>,
    volume: f64,
    n: usize,
) -> Result<Vec<Inlet<D>>, RunError> {
    let axes: Vec<usize> = site.plan.axes.iter().map(|axis| axis.index).collect();
    let mut inlets = Vec::new();
    let largest = largest_discharge(site, tracker);
    for side in 0..2 * D {
        for (idx, patch) in site.transport.sides[side / 2][side % 2].iter().enumerate() {
            if matches!(patch.rule, SideRule::Open | SideRule::Periodic) {
                continue;
            }
            let flux = discharge(site, tracker, side, idx);
            check(site, &patch.rule, side, &flux, largest)?;
            let inwards: Vec<Gush<D>> =
                flux.into_iter().map(|(low, high, q)| (low, high, q.max(0.0))).collect();
            let composition = Composition::of_side(&patch.rule, n, &axes);
            inlets.extend(inlet(site, inlets.len(), 1 + side, inwards, volume, composition));
        }
    }
    let clean = Composition::new(&[], n, &axes);
    inlets.extend(inlet(site, inlets.len(), 0, injections(site), volume, clean));
    Ok(inlets)
}

/// Parcels of so much water, evenly in time.
///
/// - Equation: `n = Q t / V`, the `k`-th between `k V/Q` and `(k + 1) V/Q`.
/// - Symbols: `Q` water in all, `V` that of a parcel.
/// - Range: any; a parcel that would begin after the end does not.
/// - Source: conservation of water; stratified sampling, as for masses.
/// - Shape: one release.
fn inlet<const D: usize>(
    site: &Site<D>,
    n_before: usize,
    door: usize,
    gushes: Vec<Gush<D>>,
    volume: f64,
    composition: Composition,
) -> Option<Inlet<D>> {
    let faces = Faces::new(gushes);
    let rate = faces.total();
    if rate <= 0.0 {
        return None;
    }
    let n = (rate * site.plan.time.duration / volume).ceil().max(1.0);
    let kind = Kind::Steady { n: n as u64, from: 0.0, to: n * volume / rate, sampling: Sampling::Stratified };
    // What is there at the start is the first origin of all.
    let origin = 1 + n_before;
    let release = Release { door, origin, population: 0, unit: volume, place: Place::Faces(faces), kind };
    Some(Inlet { release, composition })
}

/// Water that comes in through the parts of a patch; what goes out is below zero.
fn discharge<const D: usize, M: Medium<D>>(
    site: &Site<D>,
    tracker: &Tracker<D, M>,
    side: usize,
    idx: usize,
) -> Vec<Gush<D>> {
    let (axis, end) = (side / 2, side % 2);
    let sign = if end == 0 { 1.0 } else { -1.0 };
    let faces = site.faces([axis, end], idx, (&site.transport.porosity, CUTS));
    let gush = |(low, high): ([f64; D], [f64; D])| {
        let centre: [f64; D] = std::array::from_fn(|other| 0.5 * (low[other] + high[other]));
        let others = (0..D).filter(|&other| other != axis);
        let area: f64 = others.map(|other| high[other] - low[other]).product();
        let porosity = site.porosity(&[centre])[0];
        (low, high, sign * porosity * area * tracker.medium.velocity(centre, axis))
    };
    faces.into_iter().map(gush).collect()
}

/// The cells that wells put water into.
fn injections<const D: usize>(site: &Site<D>) -> Vec<Gush<D>> {
    let Some(flow) = site.face_flow(0) else { return Vec::new() };
    let gush = |sink: &crate::flow::Sink| {
        let [low, high] = site.cell(flow, sink.cell);
        (low, high, -sink.rate)
    };
    flow.sinks.iter().filter(|sink| sink.rate < 0.0).map(gush).collect()
}

/// Largest discharge along an axis at points of the domain, m/s.
fn largest_discharge<const D: usize, M: Medium<D>>(site: &Site<D>, tracker: &Tracker<D, M>) -> f64 {
    let mut largest: f64 = 0.0;
    for idx in 0..POINTS.pow(D as u32) {
        let mut rest = idx;
        let place: [f64; D] = std::array::from_fn(|axis| {
            let part = ((rest % POINTS) as f64 + 0.5) / POINTS as f64;
            rest /= POINTS;
            site.low[axis] + part * (site.high[axis] - site.low[axis])
        });
        let porosity = site.porosity(&[place])[0];
        for axis in 0..D {
            largest = largest.max((porosity * tracker.medium.velocity(place, axis)).abs());
        }
    }
    largest
}

/// Sides that say nothing of the water that goes through them have none.
fn check<const D: usize>(
    site: &Site<D>,
    rule: &SideRule,
    side: usize,
    flux: &[Gush<D>],
    largest: f64,
) -> Result<(), RunError> {
    let (way, kind, rate): (&str, &str, f64) = match rule {
        SideRule::Reflect => ("goes", "reflects", flux.iter().map(|gush| gush.2.abs()).sum()),
        SideRule::Partial(_) => ("goes", "absorbs at a rate", flux.iter().map(|gush| gush.2.abs()).sum()),
        SideRule::Outflow => ("comes in", "lets out", flux.iter().map(|gush| gush.2.max(0.0)).sum()),
        _ => return Ok(()),
    };
    let others = (0..D).filter(|&axis| axis != side / 2);
    let area: f64 = others.map(|axis| site.high[axis] - site.low[axis]).product();
    if rate <= LEAK * largest * area {
        return Ok(());
    }
    Err(RunError::Leak { side, name: site.plan.side_name(side), way, kind, rate })
}
