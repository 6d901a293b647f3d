//! What a medium has to say of a place: drift and dispersion.
//!
//! Owns the trait that the walk is generic over. May use lanes. It deliberately names no medium: each has
//! its own file and its own compiled loop.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::lanes::{LANES, Lane, Lanes, Narrow};
use super::paths::Paths;
use super::walls::Stride;

/// What of a population changes its walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carrier {
    /// 1/R: the share of the time that is spent in the water.
    pub mobility: f64,
    /// Molecular diffusion, m²/s, before division by R; that of the medium if absent.
    pub molecular: Option<f64>,
}

impl Carrier {
    /// What moves as the water does.
    pub const WATER: Self = Self { mobility: 1.0, molecular: None };
}

/// Lengths of time of a displacement: one per particle.
#[derive(Debug, Clone)]
pub struct Leap {
    /// s
    pub time: Lane,
    /// √s
    pub root: Lane,
    pub narrow_time: Narrow,
    pub narrow_root: Narrow,
}

impl Leap {
    pub fn new(dt: f64) -> Self {
        let root = dt.sqrt();
        Self {
            time: [dt; LANES],
            root: [root; LANES],
            narrow_time: [dt as f32; LANES],
            narrow_root: [root as f32; LANES],
        }
    }

    /// Takes the times from their lane.
    #[inline(always)]
    pub fn assign(&mut self, time: &Lane) {
        self.time = *time;
        for lane in 0..LANES {
            self.root[lane] = time[lane].sqrt();
            self.narrow_time[lane] = time[lane] as f32;
            self.narrow_root[lane] = self.root[lane] as f32;
        }
    }
}

/// Criteria of sub-steps: the largest share of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Criteria {
    /// Σ |v_i| Δt / Δx_i
    pub courant: f64,
    /// Σ D_ii Δt / Δx_i²
    pub dispersion: f64,
}

/// Drift and dispersion over the place.
///
/// A look at a place gives coefficients that are frozen for one displacement
/// `X ← X + A Δt + B ξ √Δt`, `B Bᵀ = 2D`.
pub trait Medium<const D: usize>: Sync {
    /// Coefficients of 64 particles.
    type Look: Clone + Send;

    /// Coefficients of nowhere, to be written over.
    fn blank(&self) -> Self::Look;

    /// Coefficients at the places.
    fn look(&self, carrier: &Carrier, positions: &[Lane; D], look: &mut Self::Look);

    /// Adds the displacements.
    fn displace(&self, look: &Self::Look, leap: &Leap, normals: [&Lane; D], positions: &mut [Lane; D]);

    /// Exact paths of a carrier that does not spread, where the medium knows them.
    #[inline(always)]
    fn paths(&self, _: &Carrier) -> Option<&Paths<D>> {
        None
    }

    /// Mends displacements that went over a jump of the coefficients; a medium without jumps has none.
    #[inline(always)]
    fn settle(&self, _: &Stride<D, Self>, _: &mut Lanes<D>)
    where
        Self: Sized,
    {
    }

    /// `2 D_nn` normal to an axis, m²/s.
    fn spread_along(&self, look: &Self::Look, axis: usize, spread: &mut Lane);

    /// Longest times that the criteria allow, s.
    fn longest(&self, look: &Self::Look, criteria: &Criteria, time: &mut Lane);

    /// Drift `A` of one particle along an axis, m/s.
    fn drift(&self, look: &Self::Look, axis: usize, lane: usize) -> f64;

    /// Dispersion tensor of one particle, over R, m²/s.
    fn tensor(&self, look: &Self::Look, lane: usize) -> [[f64; D]; D];

    /// Porosity at one place, up to a factor that is the same everywhere.
    fn porosity(&self, place: [f64; D]) -> f64;

    /// The same at 64 places.
    fn porosities(&self, places: &[Lane; D], porosity: &mut Lane) {
        for lane in 0..LANES {
            porosity[lane] = self.porosity(std::array::from_fn(|axis| places[axis][lane]));
        }
    }

    /// Velocity of the water along an axis at one place, m/s.
    fn velocity(&self, place: [f64; D], axis: usize) -> f64;
}

/// `2 D_nn` of a carrier normal to an axis at one place, m²/s.
pub fn spread_at<const D: usize, M: Medium<D>>(
    medium: &M,
    carrier: &Carrier,
    place: [f64; D],
    axis: usize,
) -> f64 {
    let lanes = place.map(|x| [x; LANES]);
    let mut look = medium.blank();
    medium.look(carrier, &lanes, &mut look);
    let mut spread = [0.0; LANES];
    medium.spread_along(&look, axis, &mut spread);
    spread[0]
}
