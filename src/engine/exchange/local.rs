//! Kernels that differ from parcel to parcel, where dispersion varies with the place.
//!
//! Owns their metrics and shares. May use the media of `track`, the plan and `parallel`. It deliberately looks for no
//! neighbours: `near` does.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::control::Settings;
use super::super::error::RunError;
use super::super::mass::media::{InMedium, Media, flow_of, in_medium};
use super::super::mass::world::Site;
use super::super::parallel;
use super::super::program::unsound;
use super::super::track::lanes::LANES;
use super::super::track::medium::{Carrier, Medium};
use super::crowd::Sorted;
use super::matrix::{determinant, inverse};
use crate::maths::scalar::pow;
use crate::maths::wide::Width;
use crate::plan::Plan;
use crate::plan::exchange::{Exchange, Sizes};
use crate::plan::tape::Tape;
use crate::plan::transport::Transport;
use crate::state::particles::Block;
use std::sync::Arc;

/// Where nothing disperses a kernel has this part of the distance of parcels: it reaches nobody.
const NOTHING: f64 = 1e-6;

/// Of a dispersion, m²/s: what may be below zero by rounding.
const ROUNDING: f64 = 1e-12;

/// Dispersion at the places of parcels.
trait Tensors<const D: usize>: Send + Sync {
    /// Lower triangles, an array per entry, m²/s.
    fn of_block(&self, block: &Block<D>, width: Width, triangle: &mut [Vec<f64>]);
}

struct Field<M>(M);

impl<const D: usize, M: Medium<D> + Send + 'static> Tensors<D> for Field<M> {
    fn of_block(&self, block: &Block<D>, width: Width, triangle: &mut [Vec<f64>]) {
        width.run(OnBlock { medium: &self.0, block, triangle });
    }
}

/// One block, to be dispatched to wide or narrow code.
struct OnBlock<'a, const D: usize, M> {
    medium: &'a M,
    block: &'a Block<D>,
    triangle: &'a mut [Vec<f64>],
}

impl<const D: usize, M: Medium<D>> pulp::NullaryFnOnce for OnBlock<'_, D, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { medium, block, triangle } = self;
        let mut look = medium.blank();
        let mut places = [[0.0; LANES]; D];
        for first in (0..block.n_particles).step_by(LANES) {
            let n = LANES.min(block.n_particles - first);
            for axis in 0..D {
                places[axis][..n].copy_from_slice(&block.positions[axis][first..first + n]);
            }
            medium.look(&Carrier::WATER, &places, &mut look);
            for lane in 0..n {
                let mut tensor = medium.tensor(&look, lane);
                // Roots of a tensor that is no number are none; its slopes, which the drift has, tell.
                for axis in 0..D {
                    if !medium.drift(&look, axis, lane).is_finite() {
                        tensor[axis][axis] = f64::NAN;
                    }
                }
                for row in 0..D {
                    for column in 0..=row {
                        triangle[row * (row + 1) / 2 + column][first + lane] = tensor[row][column];
                    }
                }
            }
        }
    }
}

struct Make;

impl<const D: usize> InMedium<D> for Make {
    type Output = Arc<dyn Tensors<D>>;

    fn go<M: Medium<D> + Send + 'static>(
        self,
        _: &Site<D>,
        media: Media<M>,
    ) -> Result<Self::Output, RunError> {
        Ok(Arc::new(Field(media(0)?)))
    }
}

/// The kernels of all parcels.
pub struct Local<const D: usize> {
    tensors: Arc<dyn Tensors<D>>,
    rule: Rule,
    /// By block: half of each entry of the metric, and the share.
    blocks: Vec<Vec<Vec<f64>>>,
    /// The same in the order of cells.
    columns: Vec<Vec<f64>>,
}

/// How a dispersion becomes a kernel.
#[derive(Debug, Clone)]
struct Rule {
    bandwidth: Tape,
    spacing: f64,
    /// Collocation length over `√(2 D Δt)`.
    collocation: f64,
    /// Largest `2 D Δt/h²` that a step bears.
    most: f64,
    /// What is given back for the end of the kernel.
    given_back: f64,
}

/// Metrics as the search for neighbours reads them.
#[derive(Clone, Copy)]
pub struct Metrics<'a> {
    /// `½ H⁻¹`, lower triangle, an array per entry, 1/m².
    pub halves: &'a [Vec<f64>],
    /// `2 D Δt/h²`
    pub shares: &'a [f64],
}

impl<const D: usize> Local<D> {
    /// Nothing where the dispersion by exchange is the same everywhere.
    pub fn new(plan: &Plan, planned: &Exchange, settings: &Settings) -> Result<Option<Self>, RunError> {
        let (Some(spreading), Some(transport)) = (&planned.spreading, &plan.transport) else {
            return Ok(None);
        };
        let flow = flow_of(plan, settings)?;
        let mut own = plan.clone();
        own.transport =
            Some(Transport { dispersion: spreading.clone(), interfaces: Vec::new(), ..transport.clone() });
        let site = Site::<D>::new(&own, flow)?;
        let tensors = in_medium(&site, Make)?;
        let dt = plan.time.step.min(plan.time.duration);
        let sizes = planned.sizes(plan, dt);
        Ok(Some(Self {
            tensors,
            rule: Rule::new(planned, &sizes, dt),
            blocks: Vec::new(),
            columns: Vec::new(),
        }))
    }

    /// The same, to go another way from here.
    pub fn copy(&self) -> Self {
        let (tensors, rule) = (self.tensors.clone(), self.rule.clone());
        Self { tensors, rule, blocks: Vec::new(), columns: Vec::new() }
    }

    /// Works out the kernels of all parcels for steps of `dt_of_bandwidth`, of which one of `dt` is taken; half the mean
    /// extent of a kernel of the radius along each axis is handed back, and half the largest.
    pub fn look(
        &mut self,
        blocks: &[Block<D>],
        (dt_of_bandwidth, dt): (f64, f64),
        (radius, width): (f64, Width),
    ) -> Result<([f64; D], [f64; D]), RunError> {
        let n_entries = D * (D + 1) / 2;
        self.blocks.resize_with(blocks.len(), Vec::new);
        let mut tasks: Vec<_> =
            self.blocks.iter_mut().zip(blocks).map(|(own, block)| (own, block, [[0.0_f64; D]; 2])).collect();
        let (tensors, rule) = (&self.tensors, &self.rule);
        parallel::for_each(&mut tasks, &|_, (own, block, extents)| {
            own.resize_with(n_entries + 1, Vec::new);
            own.iter_mut().for_each(|column| column.resize(block.n_particles, 0.0));
            tensors.of_block(block, width, own);
            *extents = rule.fill::<D>(own, (dt_of_bandwidth, dt));
        });
        let (mut sum, mut widest) = ([0.0_f64; D], [0.0_f64; D]);
        for (.., [own, largest]) in &tasks {
            for axis in 0..D {
                sum[axis] += own[axis];
                widest[axis] = widest[axis].max(largest[axis]);
            }
        }
        if !sum.iter().all(|extent| extent.is_finite()) {
            return Err(unsound("a dispersion by exchange that is no number where a parcel is"));
        }
        let n: usize = blocks.iter().map(|block| block.n_particles).sum();
        Ok((sum.map(|extent| radius * extent / n.max(1) as f64), widest.map(|extent| radius * extent)))
    }

    /// Brings them into the order of cells.
    pub fn sort(&mut self, sorted: &Sorted) {
        self.columns.resize_with(D * (D + 1) / 2 + 1, Vec::new);
        let blocks = &self.blocks;
        for (idx, column) in self.columns.iter_mut().enumerate() {
            sorted.bring(&|block| &blocks[block][idx], column);
        }
    }

    pub fn metrics(&self) -> Option<Metrics<'_>> {
        let (shares, halves) = self.columns.split_last()?;
        Some(Metrics { halves, shares })
    }
}

impl Rule {
    fn new(planned: &Exchange, sizes: &Sizes, dt: f64) -> Self {
        let ell = (2.0 * sizes.diffusion * dt).sqrt();
        let given_back = if planned.is_compensated { 1.0 / sizes.fidelity } else { 1.0 };
        let beta = (ell / sizes.bandwidth) * (ell / sizes.bandwidth);
        Self {
            bandwidth: planned.bandwidth.clone(),
            spacing: sizes.spacing,
            collocation: sizes.collocation / ell,
            // What one exchanges hangs on the profile by the same factor everywhere.
            most: planned.integration.most() * beta / sizes.share,
            given_back,
        }
    }

    /// Triangles of dispersion become halves of metrics, and shares behind them.
    ///
    /// - Equation: `H = h² D/(det D)^{1/d}`, `½ H⁻¹`; `2 (det D)^{1/d} Δt/h²`; h at least what a step bears.
    /// - Symbols: `h` bandwidth by the rule of the scene, with the collocation length of the place.
    /// - Range: where there is no dispersion along some direction nothing is exchanged.
    /// - Source: methods, section 6.4; halves, as a pair has `½ (H_i⁻¹ + H_j⁻¹)`.
    /// - Shape: in place; sums of half extents along each axis are handed back, and the largest, in m.
    fn fill<const D: usize>(
        &self,
        columns: &mut [Vec<f64>],
        (dt_of_bandwidth, dt): (f64, f64),
    ) -> [[f64; D]; 2] {
        let [mut extents, mut widest] = [[0.0; D]; 2];
        let n_entries = D * (D + 1) / 2;
        let n = columns[n_entries].len();
        let mut tensor = [0.0; 6];
        for idx in 0..n {
            for entry in 0..n_entries {
                tensor[entry] = columns[entry][idx];
            }
            let det = determinant::<D>(&tensor);
            let mean = match D {
                1 => det,
                2 => det.max(0.0).sqrt(),
                _ => pow(det.max(0.0), 1.0 / 3.0),
            };
            let step = 2.0 * mean * dt_of_bandwidth;
            let is_there = mean > 0.0 && step > 0.0;
            let (width, share, inverse) = if is_there {
                let root = step.sqrt();
                let wanted = self.bandwidth.evaluate(&[self.collocation * root, self.spacing]);
                let width = wanted.max(root / self.most.sqrt());
                (width, 2.0 * mean * dt / (width * width) * self.given_back, inverse::<D>(&tensor, det))
            } else {
                (NOTHING * self.spacing, 0.0, identity::<D>())
            };
            let size = if is_there { mean } else { 1.0 };
            let square = width * width / size;
            for entry in 0..n_entries {
                columns[entry][idx] = 0.5 * inverse[entry] / square;
            }
            for axis in 0..D {
                let own = tensor[axis * (axis + 1) / 2 + axis];
                // What is no dispersion is found by its sum; rounding may leave a little less than nothing.
                let is_one = own >= -ROUNDING * size && own.is_finite() && det.is_finite();
                let half = if is_there { (square * own).sqrt() } else { 0.0 };
                extents[axis] += if is_one { half } else { f64::NAN };
                widest[axis] = if half > widest[axis] { half } else { widest[axis] };
            }
            columns[n_entries][idx] = share;
        }
        [extents, widest]
    }
}

fn identity<const D: usize>() -> [f64; 6] {
    let mut all = [0.0; 6];
    (0..D).for_each(|row| all[row * (row + 1) / 2 + row] = 1.0);
    all
}
