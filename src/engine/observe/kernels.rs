//! Densities of what parcels carry, by kernels.
//!
//! Owns points with a mass each in place of parcels of water. May use the kernels of masses and the plan. It deliberately keeps
//! nothing beyond a time.

use super::super::density::{Lattice, Tally};
use super::super::error::RunError;
use super::super::mass::fields::Binned;
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
    /// Numbers of parcels by cell.
    parcels: Option<Tally>,
    found: Vec<(usize, Found)>,
}

impl<'a, const D: usize> ByKernels<'a, D> {
    pub fn new(run: &'a Run<'a, D>, t: f64) -> Result<Self, RunError> {
        let plan = run.program.plan;
        let site = run.water.as_ref().map(|water| Site::<D>::new(plan, water.flow())).transpose()?;
        let flows = site.as_ref().map(|site| site.transport.flows());
        let velocity = |place: [f64; D]| match (&site, &flows) {
            (Some(site), Some(flows)) => site.velocity(flows, &place, t),
            _ => std::array::from_fn(|axis| plan.walk.drift[axis]),
        };
        let finder = Finder::of_water(plan, site.as_ref(), run.width)?.asked(velocity);
        let grid = finder.grid().ok_or_else(|| unsound("cells of kernels that are none"))?;
        Ok(Self { run, finder, grid, parcels: None, found: Vec::new() })
    }

    /// Values of an output from positions, and the concentrations of its species.
    ///
    /// - Equation: density by kernels of points with masses `m_i = c_i V`; concentration over what the same kernels find of water.
    /// - Symbols: `c_i` concentration of a parcel, `V` its water.
    /// - Range: concentrations that are not negative; beyond open sides there are no cells.
    /// - Source: methods, section 4.6, weights.
    /// - Shape: rows per species, as with particles that carry mass.
    pub fn values(&mut self, output: &Output, seen: &Values) -> Result<Values, RunError> {
        let Values::Particles { positions, concentrations } = seen else {
            return Err(unsound("a density without particles"));
        };
        let positions: Vec<&[f64]> = positions.iter().map(|axis| &axis[..]).collect();
        let finder = &self.finder;
        let parcels = self.parcels.get_or_insert_with(|| finder.tally(&positions, None));
        let (plan, volume) = (self.run.program.plan, self.run.program.volume);
        let mut all = Vec::new();
        for (species, concentrations) in tally::species(output).into_iter().zip(concentrations) {
            let idx = match self.found.iter().position(|(own, _)| *own == species) {
                Some(idx) => idx,
                None => {
                    let masses: Vec<f64> = concentrations.iter().map(|c| c * volume).collect();
                    self.found.push((species, finder.find_at(&positions, &masses, None)?));
                    self.found.len() - 1
                }
            };
            let found = &self.found[idx].1;
            all.push(match output.kind {
                OutputKind::Kernels => vec![Found::size_row(Some(found))],
                _ => found.rows(&plan.axes, &self.grid, &per_water(&finder.lattice, found, parcels, volume)),
            });
        }
        Ok(Values::Rows(all))
    }
}

/// Concentrations in cells, and their standard errors.
///
/// - Equation: `ĉ = F[m]/F[v]`, `s² = (Q[m²] − 2 ĉ Q[m v] + ĉ² Q[v²])/F[v]²`.
/// - Symbols: `F` sums over parcels with the kernel of the cell that is looked at, `Q` with squared ones; `m` mass and `v` water.
/// - Range: where there is water within a kernel; where parcels lie does not show, only how much they differ.
/// - Source: E. A. Nadaraya 1964, On estimating regression, Theory Probab. Appl. 9, 141; linearised errors of a ratio.
/// - Shape: one value per cell of the lattice.
fn per_water(lattice: &Lattice, found: &Found, parcels: &Tally, volume: f64) -> Binned {
    let (kernels, tally) = (&found.projection, &found.tally);
    let n = lattice.n_cells();
    let all: Vec<u32> = (0..n as u32).collect();
    let sums = |cells: &[u32], values: &[f64], scale: f64| -> Vec<f64> {
        let mut field = vec![0.0; n];
        cells.iter().zip(values).for_each(|(&cell, value)| field[cell as usize] = scale * value);
        kernels.gather(&all, field)
    };
    let mass = sums(&tally.cells, &tally.masses, 1.0);
    let numbers = sums(&parcels.cells, &parcels.counts, 1.0);
    let squares = sums(&tally.cells, &tally.squares, tally.largest * tally.largest);
    let (mut mean, mut standard_error) = (vec![0.0; n], vec![0.0; n]);
    for cell in (0..n).filter(|&cell| numbers[cell] > 0.0) {
        let water = volume * numbers[cell];
        let c = mass[cell] / water;
        let square = squares[cell] - 2.0 * c * volume * mass[cell] + c * c * volume * water;
        mean[cell] = c;
        standard_error[cell] = (kernels.squared(cell) * square.max(0.0)).sqrt() / water;
    }
    Binned { mean, standard_error }
}
