//! A medium in which what does not spread follows its exact path.
//!
//! Owns the choice by carrier. May use media. It deliberately changes nothing for carriers that spread.

use super::super::lanes::{Lane, Lanes};
use super::super::medium::{Carrier, Criteria, Leap, Medium};
use super::super::walls::Stride;
use super::Paths;

/// A medium without dispersivities, whose molecular diffusion may be zero for some carriers.
#[derive(Debug, Clone, PartialEq)]
pub struct Pathed<const D: usize, M> {
    pub medium: M,
    pub paths: Paths<D>,
    /// m²/s, of carriers that have none of their own.
    pub molecular: f64,
}

impl<const D: usize, M: Medium<D>> Medium<D> for Pathed<D, M> {
    type Look = M::Look;

    fn blank(&self) -> M::Look {
        self.medium.blank()
    }

    fn paths(&self, carrier: &Carrier) -> Option<&Paths<D>> {
        (carrier.molecular.unwrap_or(self.molecular) == 0.0).then_some(&self.paths)
    }

    #[inline(always)]
    fn look(&self, carrier: &Carrier, positions: &[Lane; D], look: &mut M::Look) {
        self.medium.look(carrier, positions, look);
    }

    #[inline(always)]
    fn displace(&self, look: &M::Look, leap: &Leap, normals: [&Lane; D], positions: &mut [Lane; D]) {
        self.medium.displace(look, leap, normals, positions);
    }

    #[inline(always)]
    fn settle(&self, stride: &Stride<D, Self>, lanes: &mut Lanes<D>) {
        let Stride { look, carrier, leap, before, draws, step, .. } = *stride;
        self.medium.settle(&Stride { medium: &self.medium, look, carrier, leap, before, draws, step }, lanes);
    }

    #[inline(always)]
    fn spread_along(&self, look: &M::Look, axis: usize, spread: &mut Lane) {
        self.medium.spread_along(look, axis, spread);
    }

    #[inline(always)]
    fn longest(&self, look: &M::Look, criteria: &Criteria, time: &mut Lane) {
        self.medium.longest(look, criteria, time);
    }

    fn drift(&self, look: &M::Look, axis: usize, lane: usize) -> f64 {
        self.medium.drift(look, axis, lane)
    }

    fn tensor(&self, look: &M::Look, lane: usize) -> [[f64; D]; D] {
        self.medium.tensor(look, lane)
    }

    fn porosity(&self, place: [f64; D]) -> f64 {
        self.medium.porosity(place)
    }

    fn velocity(&self, place: [f64; D], axis: usize) -> f64 {
        self.medium.velocity(place, axis)
    }
}
