//! Densities of what parcels carry, by kernels.
//!
//! Owns points with a mass each in place of parcels of water. May use the kernels of masses and the plan. It deliberately
//! weighs no parcel by those around it: where they lie shows, as it does with particles that carry mass.

use super::super::error::RunError;
use super::super::mass::kernels::{Finder, Found};
use super::super::mass::world::Site;
use super::super::program::unsound;
use super::super::run::Run;
use super::super::snapshot::Values;
use super::tally;
use crate::plan::{Output, OutputKind};
use crate::state::grid::Grid;

/// Kernels of one time, found when an output first asks for a species.
pub struct ByKernels<'a, const D: usize> {
    run: &'a Run<'a, D>,
    finder: Finder,
    grid: Grid<D>,
    /// Water per volume, by cell.
    water: Vec<f64>,
    found: Vec<(usize, Found)>,
}

impl<'a, const D: usize> ByKernels<'a, D> {
    pub fn new(run: &'a Run<'a, D>, t: f64) -> Result<Self, RunError> {
        let (program, plan) = (&run.program, run.program.plan);
        let site = run.water.as_ref().map(|water| Site::<D>::new(plan, water.flow())).transpose()?;
        let flows = site.as_ref().map(|site| site.transport.flows());
        let velocity = |place: [f64; D]| match (&site, &flows) {
            (Some(site), Some(flows)) => site.velocity(flows, &place, t),
            _ => std::array::from_fn(|axis| plan.walk.drift[axis]),
        };
        let finder = Finder::of_water(plan, site.as_ref(), run.width)?.asked(velocity);
        let grid = finder.grid().ok_or_else(|| unsound("cells of kernels that are none"))?;
        let extent: f64 = plan.axes.iter().map(|axis| axis.high - axis.low).product();
        let even = program.volume * plan.particles.count as f64 / extent;
        let water = match &site {
            Some(site) => site.porosity_of_bins(&grid),
            None => vec![even; grid.n_bins()],
        };
        Ok(Self { run, finder, grid, water, found: Vec::new() })
    }

    /// Values of an output from positions, and the concentrations of its species.
    ///
    /// - Equation: kernels of points with masses `m_i = c_i V`.
    /// - Symbols: `c_i` concentration of a parcel, `V` its water.
    /// - Range: concentrations that are not negative; beyond open sides there are no cells.
    /// - Source: methods, section 4.6, weights.
    /// - Shape: rows per species, as with particles that carry mass.
    pub fn values(&mut self, output: &Output, seen: &Values) -> Result<Values, RunError> {
        let Values::Particles { positions, concentrations } = seen else {
            return Err(unsound("a density without particles"));
        };
        let positions: Vec<&[f64]> = positions.iter().map(|axis| &axis[..]).collect();
        let mut all = Vec::new();
        for (species, concentrations) in tally::species(output).into_iter().zip(concentrations) {
            let known = self.found.iter().position(|(own, _)| *own == species);
            let idx = match known {
                Some(idx) => idx,
                None => {
                    let volume = self.run.program.volume;
                    let masses: Vec<f64> = concentrations.iter().map(|c| c * volume).collect();
                    self.found.push((species, self.finder.find_at(&positions, &masses, None)?));
                    self.found.len() - 1
                }
            };
            let found = &self.found[idx].1;
            all.push(match output.kind {
                OutputKind::Kernels => vec![Found::size_row(Some(found))],
                _ => found.rows(&self.run.program.plan.axes, &self.grid, &self.water),
            });
        }
        Ok(Values::Rows(all))
    }
}
