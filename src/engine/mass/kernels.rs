//! Kernels of populations: found from the particles that are there.
//!
//! Owns the lattice of a population and the search for its kernels. May use `density` and the plan. It deliberately moves
//! nothing.

use super::super::density::{
    Adaptive, Cell, End, Global, Lattice, Order, Orientation, Projection, Shape, Tally, Variant, WIDER,
    estimate, global, histogram,
};
use super::super::density::{Rule as DensityRule, Weighing as DensityWeighing};
use super::super::error::RunError;
use super::super::program::unsound;
use super::flock::Flock;
use super::world::Site;
use crate::maths::vector::pow;
use crate::maths::wide::Width;
use crate::plan::kernels::{FOURTH, Kernels, Manner, Rule, Weighing};
use crate::plan::transport::SideRule;
use crate::plan::{Axis, Plan, Side};

/// Particles that a kernel should hold which reacts.
const FEWEST: f64 = 4.0;

/// By so much of itself what is the same along a side may differ.
const EVEN: f64 = 1e-9;

/// Where and how kernels of one population are found.
#[derive(Debug, Clone)]
pub struct Finder {
    pub lattice: Lattice,
    pub(super) low: Vec<f64>,
    kernels: Kernels,
    width: Width,
    /// Of the flow, by cell of the lattice, if kernels follow it.
    directions: Option<Vec<[f64; 3]>>,
    order: Order,
}

/// Kernels, and the density that they give.
pub struct Found {
    pub projection: Projection,
    /// Mass per m^d and its standard error, by cell of the lattice.
    pub density: Vec<f64>,
    pub standard_error: Vec<f64>,
    pub tally: Tally,
    /// Cells with kernels of their own, in the order of the tally; else one kernel for all, m.
    pub cells: Vec<Cell>,
    pub one: [f64; 3],
    pub n_loops: usize,
}

impl Finder {
    pub fn new<const D: usize>(site: &Site<D>, population: usize, width: Width) -> Result<Self, RunError> {
        let kernels = site.plan.kernels.clone().ok_or_else(|| unsound("no kernels"))?;
        let is_mobile = site.transport.populations[population].is_mobile;
        let axis = |axis: usize| {
            let n = kernels.cells[axis];
            (n, (site.high[axis] - site.low[axis]) / n as f64, ends(site, axis, is_mobile))
        };
        let axes: Vec<(usize, f64, [End; 2])> = (0..D).map(axis).collect();
        Self::on(&axes, site.low.to_vec(), kernels, width)
    }

    /// The same for parcels of water, by what the sides of the plan are to them.
    pub fn of_water<const D: usize>(
        plan: &Plan,
        site: Option<&Site<D>>,
        width: Width,
    ) -> Result<Self, RunError> {
        let mut kernels = plan.kernels.clone().ok_or_else(|| unsound("no kernels"))?;
        // Nothing reacts by them; those that average are best for the second order.
        kernels.narrowing = if kernels.order == FOURTH { 1.0 / WIDER } else { 1.0 };
        let axis = |(idx, (axis, &n)): (usize, (&Axis, &usize))| {
            let is_ring = axis.low_side == Side::Periodic;
            let usual = [if is_ring { End::Wrap } else { End::Mirror }; 2];
            // Water that leaves takes its neighbours' place: its contents do not end there.
            let ends = site.map_or(usual, |site| ends(site, idx, false));
            (n, (axis.high - axis.low) / n as f64, ends)
        };
        let axes: Vec<_> = plan.axes.iter().zip(&kernels.cells).enumerate().map(axis).collect();
        Self::on(&axes, plan.axes.iter().map(|axis| axis.low).collect(), kernels, width)
    }

    fn on(
        axes: &[(usize, f64, [End; 2])],
        low: Vec<f64>,
        kernels: Kernels,
        width: Width,
    ) -> Result<Self, RunError> {
        let lattice = Lattice::new(axes).ok_or_else(|| unsound("cells of kernels that are none"))?;
        Ok(Self { lattice, low, kernels, width, directions: None, order: Order::Second })
    }

    /// The same for densities that are shown at a time: with kernels along the flow and of the order that the plan says.
    pub fn shown<const D: usize>(mut self, site: &Site<D>, population: usize, t: f64) -> Self {
        if self.kernels.manner == Manner::Adaptive {
            self.hold(site, population, t);
        }
        let flows = site.transport.flows();
        self.asked(|place: [f64; D]| site.velocity(&flows, &place, t))
    }

    /// Of the order that the plan says, and along the flow if it says so.
    pub fn asked<const D: usize>(mut self, velocity: impl Fn([f64; D]) -> [f64; D]) -> Self {
        if self.kernels.order == FOURTH {
            self.order = Order::Fourth;
        }
        if self.kernels.is_oriented && D > 1 {
            let first = self.lattice.axes().start;
            let direction = |cell: usize| {
                let mut all = [0.0; 3];
                all[first..].copy_from_slice(&velocity(self.centre(cell)));
                all
            };
            self.directions = Some((0..self.lattice.n_cells()).map(direction).collect());
        }
        self
    }

    fn centre<const D: usize>(&self, cell: usize) -> [f64; D] {
        let (at, first) = (self.lattice.cell(cell), self.lattice.axes().start);
        std::array::from_fn(|axis| {
            self.low[axis] + (at[first + axis] as f64 + 0.5) * self.lattice.edge[first + axis]
        })
    }

    /// Ends that hold a density: sides where a concentration is held, the same all along.
    ///
    /// - Equation: `ρ_w = φ R c`.
    /// - Symbols: `φ` porosity beside the side, `R` retardation, `c` its concentration at the time.
    /// - Range: sides of one patch; where c or φ differ along it the end is a mirror.
    /// - Source: methods, section 4.7.
    /// - Shape: one value per end, mass per m^d.
    fn hold<const D: usize>(&mut self, site: &Site<D>, population: usize, t: f64) {
        let of = &site.transport.populations[population];
        let first = self.lattice.axes().start;
        for axis in (0..D).filter(|_| of.is_mobile) {
            for (end, wall) in [site.low[axis], site.high[axis]].into_iter().enumerate() {
                let [patch] = &site.transport.sides[axis][end][..] else { continue };
                let SideRule::Held(tapes) = &patch.rule else { continue };
                let Some(tape) = tapes.get(of.species) else { continue };
                let beside = if end == 0 { 0 } else { self.lattice.cells[first + axis] - 1 };
                let place = |cell: usize| {
                    let mut place: [f64; D] = self.centre(cell);
                    place[axis] = wall;
                    (self.lattice.cell(cell)[first + axis] == beside).then_some(place)
                };
                let places: Vec<[f64; D]> = (0..self.lattice.n_cells()).filter_map(place).collect();
                let concentrations = site.evaluate(tape, &places, t);
                let water = site.porosity(&places);
                let densities =
                    concentrations.iter().zip(&water).map(|(c, water)| of.retardation * c * water);
                let (least, most) =
                    densities.fold((f64::INFINITY, 0.0_f64), |(a, b), own| (a.min(own), b.max(own)));
                if least >= 0.0 && most.is_finite() && most - least <= EVEN * most {
                    self.lattice.ends[first + axis][end] = End::Held(most);
                }
            }
        }
    }

    /// Kernels of particles where they are.
    pub fn find<const D: usize>(
        &self,
        flocks: &[&Flock<D>],
        units: &[f64],
        start: Option<f64>,
    ) -> Result<Found, RunError> {
        let n: usize = flocks.iter().map(|flock| flock.len()).sum();
        let mut positions: [Vec<f64>; D] = std::array::from_fn(|_| Vec::with_capacity(n));
        let mut masses = Vec::with_capacity(n);
        for flock in flocks {
            positions.iter_mut().zip(&flock.positions).for_each(|(all, own)| all.extend_from_slice(own));
            let weights = flock.weights(units);
            masses.extend((0..flock.len()).map(weights));
        }
        self.find_at(&positions.each_ref().map(|axis| &axis[..]), &masses, start)
    }

    /// Points in cells, with a mass each or one for all.
    pub fn tally(&self, positions: &[&[f64]], masses: Option<&[f64]>) -> Tally {
        Tally::of(&self.lattice, &self.low, positions, masses)
    }

    /// Kernels of points with a mass each.
    pub fn find_at(
        &self,
        positions: &[&[f64]],
        masses: &[f64],
        start: Option<f64>,
    ) -> Result<Found, RunError> {
        let tally = self.tally(positions, Some(masses));
        match self.kernels.manner {
            Manner::Adaptive => Ok(self.adaptive(tally, start)),
            Manner::Global | Manner::Fixed => self.one(tally),
            Manner::Histogram | Manner::Collocation => {
                let (density, standard_error) = histogram(&self.lattice, &tally);
                let projection = Projection::of_cells(self.lattice.clone(), self.width);
                let (cells, one) = (Vec::new(), [0.0; 3]);
                Ok(Found { projection, density, standard_error, tally, cells, one, n_loops: 0 })
            }
        }
    }

    fn adaptive(&self, tally: Tally, start: Option<f64>) -> Found {
        let kernels = &self.kernels;
        let adaptive = Adaptive {
            variant: Variant::Corrected,
            shape: shape(kernels),
            orientation: self.orientation(&tally),
            start: start.map_or_else(Default::default, super::super::density::Start::Bandwidth),
            weighing: weighing(kernels.weighing),
            order: self.order,
            bounds: kernels.bandwidth,
            is_fast: true,
            tolerance: kernels.tolerance,
            most_loops: kernels.loops as usize,
        };
        let found = estimate(&self.lattice, &tally, &adaptive, self.width);
        let part = |cell: &Cell| self.part(cell.h, cell.rho);
        let projection = Projection::of_estimate(self.lattice.clone(), &found, part, self.width);
        let n_loops = found.history.len().saturating_sub(1);
        let (density, standard_error, cells) = (found.density, found.standard_error, found.cells);
        Found { projection, density, standard_error, tally, cells, one: [0.0; 3], n_loops }
    }

    /// Directions of cells with particles, in the order of the tally.
    fn orientation(&self, tally: &Tally) -> Orientation {
        match &self.directions {
            None => Orientation::Axes,
            Some(all) => Orientation::Each(tally.cells.iter().map(|&cell| all[cell as usize]).collect()),
        }
    }

    /// How much narrower kernels are that react than those that densities are shown by.
    ///
    /// - Equation: `p = min(1, max(γ, h_M/h))`, `ρ (2√π h_M)^d = M`.
    /// - Symbols: `h` best bandwidth for the density, `ρ` particles per m^d, `γ` of the plan, `M` particles that a kernel should
    ///   hold, by the variance of what it sums.
    /// - Range: up to one.
    /// - Source: docs/methods.md: smoothing makes reactants meet that do not, by `h²`, step after step; noise does not add up so.
    /// - Shape: one number.
    fn part(&self, h: f64, rho: f64) -> f64 {
        let d = self.lattice.d as f64;
        let few = pow(FEWEST / rho, 1.0 / d) / (2.0 * std::f64::consts::PI.sqrt());
        self.kernels.narrowing.max(few / h).min(1.0)
    }

    fn one(&self, tally: Tally) -> Result<Found, RunError> {
        let kernels = &self.kernels;
        let rule = match (kernels.manner, kernels.bandwidth) {
            (Manner::Fixed, Some([h, _])) => DensityRule::Fixed(h),
            _ => match kernels.rule {
                Rule::NormalReference => DensityRule::NormalReference,
                Rule::Botev if self.lattice.d == 1 => DensityRule::Botev,
                Rule::PlugIn | Rule::Botev => DensityRule::PlugIn(shape(kernels)),
            },
        };
        let found = global(&self.lattice, &tally, rule, weighing(kernels.weighing), self.width);
        let Global { mut bandwidths, density, standard_error, n_loops, .. } =
            found.map_err(|trouble| unsound(&trouble.to_string()))?;
        if let (Some([low, high]), Manner::Global) = (kernels.bandwidth, kernels.manner) {
            bandwidths.iter_mut().filter(|h| **h > 0.0).for_each(|h| *h = h.clamp(low, high));
        }
        let own: Vec<f64> = bandwidths.iter().copied().filter(|h| *h > 0.0).collect();
        let mean = pow(own.iter().product(), 1.0 / own.len().max(1) as f64);
        let (sum, squares) =
            density.iter().fold((0.0, 0.0), |(sum, squares), own| (sum + own, squares + own * own));
        let part = match kernels.manner {
            Manner::Fixed => 1.0,
            _ => self.part(mean, squares / sum * tally.effective() / tally.mass()),
        };
        let projection = Projection::of_one(self.lattice.clone(), bandwidths.map(|h| part * h), self.width);
        Ok(Found { projection, density, standard_error, tally, cells: Vec::new(), one: bandwidths, n_loops })
    }
}

fn shape(kernels: &Kernels) -> Shape {
    if kernels.is_stretched { Shape::Stretched } else { Shape::Round }
}

fn weighing(of: Weighing) -> DensityWeighing {
    match of {
        Weighing::OfAll => DensityWeighing::OfAll,
        Weighing::Mean => DensityWeighing::Mean,
        Weighing::Number => DensityWeighing::Number,
        Weighing::OfCell => DensityWeighing::OfCell,
    }
}

/// What the ends of an axis are to kernels. What rests meets no side.
fn ends<const D: usize>(site: &Site<D>, axis: usize, is_mobile: bool) -> [End; 2] {
    let sides = &site.transport.sides[axis];
    let is = |end: usize, rule: fn(&SideRule) -> bool| sides[end].iter().any(|patch| rule(&patch.rule));
    let is_periodic = |rule: &SideRule| *rule == SideRule::Periodic;
    if is(0, is_periodic) || is(1, is_periodic) {
        return [End::Wrap; 2];
    }
    let end = |end: usize| {
        // A side that absorbs in parts has none of its own sign.
        let absorbs = sides[end].iter().all(|patch| patch.rule == SideRule::Absorb);
        if absorbs && is_mobile { End::Sink } else { End::Mirror }
    };
    [end(0), end(1)]
}
