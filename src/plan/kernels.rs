//! How a plan finds concentrations of particles that carry mass, how these react, and densities of parcels of water.
//!
//! Owns the type, its lowering from the scene, and what a particle weighs that a reaction makes. May use the scenario. It
//! deliberately finds no bandwidth: that hangs on particles.

use super::build_tape::SPECIES_INPUT;
use super::chemistry::{Chemistry, Kinetic, Kinetics, Law};
use super::tape::{Binary, Operation, Register, Tape};
use super::transport::Transport;
use super::{Axis, InstantReaction, Output, Plan, Quantity, shares};
use crate::scenario::estimation::Estimation;
pub use crate::scenario::estimation::{FOURTH, Manner, Reacting, Rule, Weighing};
use crate::scenario::transport::Shares;
use crate::scenario::{OutputKind, Rate, Scenario};
use serde::{Deserialize, Serialize};

/// Cells along the longest axis of a scene that says nothing of them, by the number of axes.
const USUAL_CELLS: [f64; 3] = [512.0, 160.0, 48.0];

/// Kernels on a lattice over the domain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kernels {
    pub manner: Manner,
    /// Cells along each active axis.
    pub cells: Vec<usize>,
    /// Bounds of bandwidths, m; one size twice.
    pub bandwidth: Option<[f64; 2]>,
    pub is_stretched: bool,
    /// Kernels lie along the flow.
    pub is_oriented: bool,
    /// Of which power of bandwidths the bias of densities is that are shown: 2 or 4.
    pub order: u8,
    pub rule: Rule,
    pub weighing: Weighing,
    /// Relative change of a loop that ends the search for bandwidths, and most loops.
    pub tolerance: f64,
    pub loops: u32,
    /// Steps from one search to the next.
    pub refresh: u64,
    /// Kernels that react are so much of those that are best for the density.
    pub narrowing: f64,
    /// Whether profiles and maps are by kernels; else their bins are counted.
    pub shows: bool,
    /// What reactions do to particles; none where nothing reacts by kernels.
    pub reacting: Option<Reacting>,
}

impl Kernels {
    pub fn n_cells(&self) -> usize {
        self.cells.iter().product()
    }

    /// Whether a search for bandwidths goes on in steps.
    pub fn searches(&self) -> bool {
        matches!(self.manner, Manner::Adaptive | Manner::Global)
    }
}

/// Whether reactions of a scene with masses are those of whole particles, each by itself, and nothing asks for more.
pub(super) fn are_asked_for(scenario: &Scenario) -> bool {
    scenario.estimation.as_ref().is_some_and(|estimation| estimation.reacting.is_some())
}

/// The kernels of a scene, and what particles weigh that its reactions make.
pub(super) fn lower(
    scenario: &Scenario,
    axes: &[Axis],
    transport: &mut Option<Transport>,
    (reacts, chemistry, instant): (bool, Option<&Chemistry>, &[InstantReaction]),
) -> Option<Kernels> {
    let kernels = kernels(scenario, axes, reacts)?;
    if let (true, Some(transport)) = (reacts, transport) {
        weigh_products(scenario, axes, transport, (chemistry.and_then(|it| it.kinetics.as_ref()), instant));
    }
    Some(kernels)
}

/// The kernels of a scene: with masses if it has the statement, or reactions that need them; with fluid if outputs show them.
fn kernels(scenario: &Scenario, axes: &[Axis], reacts: bool) -> Option<Kernels> {
    let carries_mass = scenario.particles.shares.is_some();
    let is_shown = scenario.outputs.iter().any(|output| output.kind.is_by_kernels());
    let usual = Estimation::usual(scenario.particles.span);
    let written = match &scenario.estimation {
        Some(written) if carries_mass || is_shown => written,
        _ if (reacts && carries_mass) || is_shown => &usual,
        _ => return None,
    };
    let reacts = reacts && carries_mass;
    let reacting = match (reacts, &written.reacting) {
        (false, _) => None,
        (true, Some(asked)) => Some(asked.value),
        (true, None) if written.manner == Manner::Collocation => Some(Reacting::Pairs),
        (true, None) => Some(Reacting::Masses),
    };
    Some(Kernels {
        manner: written.manner,
        cells: written.cells.as_ref().map_or_else(|| usual_cells(axes), |cells| cells.value.clone()),
        bandwidth: written.bandwidth.as_ref().map(|bandwidth| bandwidth.value),
        is_stretched: written.is_stretched,
        is_oriented: written.is_oriented,
        order: written.order,
        rule: written.rule,
        weighing: written.weighing,
        tolerance: written.tolerance,
        loops: written.loops,
        refresh: written.refresh,
        narrowing: written.narrowing,
        shows: reacts || (carries_mass && scenario.estimation.is_some()),
        reacting,
    })
}

/// The sizes of kernels beside the profiles and maps that are by them, where the scene does not ask for these itself.
pub(super) fn shown(plan: &Plan) -> Option<Output> {
    plan.kernels.as_ref().filter(|kernels| kernels.shows && kernels.searches())?;
    if plan.outputs.iter().any(|output| output.kind == OutputKind::Kernels) {
        return None;
    }
    let is_by_kernels = |output: &&Output| matches!(output.kind, OutputKind::Profile | OutputKind::Map);
    let shown: Vec<&Output> = plan.outputs.iter().filter(is_by_kernels).collect();
    let mut quantities: Vec<Quantity> = Vec::new();
    let mut times: Vec<f64> = shown.iter().flat_map(|output| output.times.iter().copied()).collect();
    for quantity in shown.iter().flat_map(|output| &output.quantities) {
        if !quantities.contains(quantity) {
            quantities.push(*quantity);
        }
    }
    times.sort_unstable_by(f64::total_cmp);
    times.dedup();
    let is_any = !quantities.is_empty() && !times.is_empty();
    is_any.then(|| Output {
        kind: OutputKind::Kernels,
        quantities,
        times,
        bins: Vec::new(),
        unit: None,
        station: None,
    })
}

/// What cells hold of a species is what is dissolved and what is sorbed; rates hang on the former.
///
/// - Equation: `R dc/dt = ν r(c)`, so `u = R c` changes by `ν r(u/R)`; by `ν R r` where single particles turn at a rate of first
///   order, which they do whether they are sorbed or not.
/// - Symbols: `R` retardation, `c` concentration in the water, `u` of both per volume of water.
/// - Range: linear sorption.
/// - Source: methods, (0.1), section 1.7.
/// - Shape: all components of a plan.
pub(super) fn retard(plan: &mut Plan) {
    let Some(transport) = &plan.transport else { return };
    let retardations: Vec<(usize, f64)> = (transport.populations.iter())
        .filter(|population| population.retardation != 1.0)
        .map(|population| (population.species, population.retardation))
        .collect();
    for (species, retardation) in retardations {
        let Some((component, share)) = plan.species[species].terms.first_mut() else { continue };
        *share = 1.0 / retardation;
        let component = *component;
        plan.components[component].initial.scale(retardation);
        let kinetics = plan.chemistry.as_mut().and_then(|chemistry| chemistry.kinetics.as_mut());
        let Some(Kinetics { reactions, laws, .. }) = kinetics else { continue };
        for (reaction, rate) in reactions.iter_mut().zip(&mut laws.rates) {
            let mut taken = reaction.changes.iter().filter(|(_, change)| *change < 0.0);
            let is_alone = taken.next().is_some_and(|(own, _)| *own == component) && taken.next().is_none();
            let Law::MassAction { constant, orders } = &mut reaction.law else { continue };
            if !is_alone || orders[..] != [(species, 1.0)] {
                continue;
            }
            *constant *= retardation;
            let first = laws.operations.len() as Register;
            laws.operations.push(Operation::Constant(retardation));
            laws.operations.push(Operation::Binary(Binary::Multiply, *rate, first));
            *rate = first + 1;
        }
    }
}

/// Equal edges, as nearly as whole numbers allow.
fn usual_cells(axes: &[Axis]) -> Vec<usize> {
    let extents: Vec<f64> = axes.iter().map(|axis| axis.high - axis.low).collect();
    let longest = extents.iter().fold(0.0, |a: f64, &b| a.max(b));
    let edge = longest / USUAL_CELLS[axes.len().clamp(1, 3) - 1];
    extents.iter().map(|extent| (extent / edge).round().max(1.0) as usize).collect()
}

/// What particles weigh that a reaction makes, where nothing else of their species is there or comes in.
///
/// - Equation: `u = P/n`, `P_s = M_s + Σ_k ν_sk min_r P_r/ν_rk`.
/// - Symbols: `M` mass that is there or comes in, `ν` coefficients, `n` number of particles of the scene; where masses share
///   one number, `u` is that of all.
/// - Range: each reaction counted once: cycles do not grow.
/// - Source: the most that can be made.
/// - Shape: one per population; none where it has mass of its own.
fn weigh_products(
    scenario: &Scenario,
    axes: &[Axis],
    transport: &mut Transport,
    (kinetics, instant): (Option<&Kinetics>, &[InstantReaction]),
) {
    let masses = shares::all_masses(scenario, axes, transport);
    let potential = potentials(&masses, &equations(scenario, kinetics, instant));
    let whole: f64 = masses.iter().sum();
    let n: f64 = transport.populations.iter().map(|it| it.count as f64).sum();
    for (idx, population) in transport.populations.iter_mut().enumerate() {
        let is_made = potential[idx] > 1.001 * masses[idx];
        let own = match &scenario.particles.shares {
            _ if !is_made => continue,
            Some(Shares::ByMass) if whole > 0.0 => whole / n,
            _ => potential[idx] / population.count as f64,
        };
        population.made = Some(own).filter(|own| own.is_finite() && *own > 0.0);
    }
}

/// Net coefficients by species of every reaction.
fn equations(
    scenario: &Scenario,
    kinetics: Option<&Kinetics>,
    instant: &[InstantReaction],
) -> Vec<Vec<(usize, f64)>> {
    let written = scenario.reactions.iter().filter(|reaction| {
        let is_kinetic = kinetics.is_some() && !matches!(reaction.rate, Rate::Instant);
        is_kinetic || !instant.is_empty()
    });
    written.map(super::lower_chemistry::net).collect()
}

fn potentials(masses: &[f64], equations: &[Vec<(usize, f64)>]) -> Vec<f64> {
    let mut potential = masses.to_vec();
    let mut is_counted = vec![false; equations.len()];
    // As many rounds as a chain of reactions can be long.
    for _ in 0..equations.len() {
        for (equation, is_counted) in equations.iter().zip(&mut is_counted) {
            let taken = equation.iter().filter(|(_, nu)| *nu < 0.0);
            let extent = taken.map(|&(species, nu)| potential[species] / -nu).fold(f64::INFINITY, f64::min);
            if *is_counted || !(extent > 0.0 && extent.is_finite()) {
                continue;
            }
            *is_counted = true;
            for &(species, nu) in equation.iter().filter(|(_, nu)| *nu > 0.0) {
                potential[species] += nu * extent;
            }
        }
    }
    potential
}

impl Plan {
    /// How particles that carry mass react by kernels, if they do.
    pub fn reacting(&self) -> Option<Reacting> {
        self.kernels.as_ref().and_then(|kernels| kernels.reacting)
    }

    /// The species that a component is.
    pub fn species_of(&self, component: usize) -> Option<usize> {
        self.species.iter().position(|species| matches!(species.terms[..], [(own, _)] if own == component))
    }

    /// Whether reactions change a species, or their rates hang on it.
    pub fn takes_part(&self, species: usize) -> bool {
        let instant = self.reactions.iter().flat_map(|it| it.reactants.iter().chain(&it.products));
        let is_in_instant = instant.into_iter().any(|(own, _)| *own == species);
        let kinetics = self.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
        is_in_instant
            || kinetics.is_some_and(|kinetics| {
                let is_read = |operation: &Operation| *operation == Operation::Input(input(species));
                let changes = kinetics.reactions.iter().flat_map(|reaction| &reaction.changes);
                changes.into_iter().any(|(item, _)| self.is_of(*item, species))
                    || kinetics.laws.operations.iter().any(is_read)
            })
    }

    fn is_of(&self, component: usize, species: usize) -> bool {
        self.species[species].terms.iter().any(|(own, _)| *own == component)
    }

    /// Whether no reaction makes a species where there is none of it: what makes it stops without it.
    pub fn grows_by_itself(&self, species: usize) -> bool {
        let instant = self.reactions.iter().flat_map(|reaction| &reaction.products);
        if instant.into_iter().any(|(own, _)| *own == species) {
            return false;
        }
        let kinetics = self.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
        let Some(kinetics) = kinetics else { return true };
        let makes = |reaction: &Kinetic| {
            reaction.changes.iter().any(|&(item, change)| change > 0.0 && self.is_of(item, species))
        };
        let makers = kinetics.reactions.iter().enumerate().filter(|(_, reaction)| makes(reaction));
        let mut tapes = makers.map(|(idx, _)| kinetics.laws.tape(idx));
        tapes.all(|tape| PROBES.iter().all(|&probe| self.rate(&tape, species, probe) == 0.0))
    }

    /// A rate without a species, where all others have some concentration.
    fn rate(&self, tape: &Tape, species: usize, probe: f64) -> f64 {
        let mut inputs = vec![0.0; usize::from(SPECIES_INPUT)];
        for axis in &self.axes {
            inputs[axis.index] = axis.low + 0.37 * (axis.high - axis.low);
        }
        inputs.extend((0..self.species.len()).map(|own| if own == species { 0.0 } else { probe }));
        tape.evaluate(&inputs)
    }
}

/// Concentrations at which rates are looked at, mol/m³ or kg/m³.
const PROBES: [f64; 3] = [1e-6, 0.7, 1e5];

fn input(species: usize) -> u16 {
    SPECIES_INPUT + species as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_can_be_as_much_as_the_scarcest_reactant_allows() {
        // A + 2 B -> 3 C, C -> D, D -> C.
        let equations =
            [vec![(0, -1.0), (1, -2.0), (2, 3.0)], vec![(2, -1.0), (3, 1.0)], vec![(3, -1.0), (2, 1.0)]];
        assert_eq!(potentials(&[5.0, 4.0, 0.0, 0.0], &equations), [5.0, 4.0, 12.0, 6.0]);
    }
}
