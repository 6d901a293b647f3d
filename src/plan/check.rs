//! Whether a plan is well-formed: every index in range, every list of the right length.
//!
//! Passes are held to this, and so is a plan that was read from a file.

use super::tape::{Operation, Tape};
use super::{Output, Plan, Quantity, Side, ZoneRate, station};

impl Plan {
    /// One sentence about the first thing that is wrong.
    pub fn check(&self) -> Result<(), String> {
        self.check_geometry()?;
        self.check_fields()?;
        self.check_chemistry()?;
        self.check_mixing()?;
        self.exchange.as_ref().map_or(Ok(()), |exchange| exchange.check(self.axes.len()))?;
        let varies = self.exchange.as_ref().is_some_and(|exchange| exchange.spreading.is_some());
        require(!varies || self.transport.is_some(), || {
            "dispersion by exchange that varies is in no flow".into()
        })?;
        self.check_transport()?;
        self.outputs.iter().try_for_each(|output| self.check_output(output))
    }

    fn check_geometry(&self) -> Result<(), String> {
        let n_axes = self.axes.len();
        require((1..=3).contains(&n_axes), || format!("{n_axes} axes: 1 to 3 are possible"))?;
        require(self.walk.drift.len() == n_axes, || "one drift per axis is needed".into())?;
        require(self.walk.spread.len() == n_axes * (n_axes + 1) / 2, || {
            "the spread is no lower triangle".into()
        })?;
        let entries = self.walk.drift.iter().chain(&self.walk.spread);
        require(entries.copied().all(f64::is_finite), || "the walk has entries that are no numbers".into())?;
        for (idx, axis) in self.axes.iter().enumerate() {
            require(axis.index < 3, || format!("axis {} is no axis", axis.index))?;
            require(idx == 0 || self.axes[idx - 1].index < axis.index, || "axes are not in order".into())?;
            let extent = axis.high - axis.low;
            require(extent.is_finite() && extent > 0.0, || "an axis has no extent".into())?;
            require(axis.bins >= 1, || "an axis has no bins".into())?;
            let n_periodic =
                [axis.low_side, axis.high_side].iter().filter(|side| **side == Side::Periodic).count();
            require(n_periodic != 1, || "a periodic side has no partner".into())?;
        }
        require(self.particles.count >= 1, || "no particles".into())?;
        require(self.particles.volume > 0.0, || "particles have no volume".into())?;
        let time = &self.time;
        require(time.step > 0.0 && time.duration > 0.0 && time.n_steps >= 1, || {
            "the run has no extent".into()
        })
    }

    fn check_fields(&self) -> Result<(), String> {
        for component in &self.components {
            check_tape(&component.initial)
                .map_err(|reason| format!("component `{}`: {reason}", component.name))?;
        }
        for species in &self.species {
            let is_right = species.terms.iter().all(|(component, _)| *component < self.components.len());
            require(is_right, || format!("species `{}` names a component that is not there", species.name))?;
        }
        for reaction in &self.reactions {
            let all = reaction.reactants.iter().chain(&reaction.products);
            let is_right = all.clone().all(|(species, nu)| *species < self.species.len() && *nu > 0.0);
            require(is_right, || format!("reaction `{}` is not well-formed", reaction.name))?;
            require(!reaction.reactants.is_empty(), || {
                format!("reaction `{}` has no reactant", reaction.name)
            })?;
        }
        Ok(())
    }

    fn check_mixing(&self) -> Result<(), String> {
        let Some(mixing) = &self.mixing else { return Ok(()) };
        require(!mixing.zones.is_empty(), || "mixing without zones".into())?;
        for zone in &mixing.zones {
            let is_right = zone.fraction >= 0.0 && zone.fraction <= 1.0 + 1e-9;
            require(is_right, || format!("zone `{}` has the fraction {}", zone.name, zone.fraction))?;
            if let ZoneRate::Finite(rate) = zone.rate {
                let is_right = rate >= 0.0 && rate.is_finite() && zone.is_stored;
                require(is_right, || format!("zone `{}` must be stored and have a rate", zone.name))?;
            }
        }
        let has_finite = mixing.zones.iter().any(|zone| zone.rate != ZoneRate::Instant);
        require(has_finite != mixing.is_well_mixed, || "`is_well_mixed` contradicts the zones".into())
    }

    fn check_output(&self, output: &Output) -> Result<(), String> {
        let n_species = self.species.len();
        let wants_pairs = output.kind.is_of_pairs();
        for quantity in &output.quantities {
            let is_right = match *quantity {
                Quantity::Species(a) => !wants_pairs && a < n_species,
                Quantity::Pair(a, b) => wants_pairs && a < n_species && b < n_species,
            };
            require(is_right, || format!("an output `{}` names what is not there", output.kind.word()))?;
        }
        let wants_bins = output.kind.has_bins();
        let has_station = output.station.is_some() == output.kind.has_station();
        let is_right =
            has_station && output.station.as_ref().is_none_or(|station| station::fits(station, self));
        require(is_right, || format!("an output `{}` is taken at no place", output.kind.word()))?;
        let is_counted = self.transport.is_some() || !output.kind.counts_passages();
        let is_right = is_counted && (self.carries_mass() || !output.kind.needs_masses());
        require(is_right, || format!("an output `{}` needs particles with mass", output.kind.word()))?;
        let n_bins = if wants_bins { self.axes.len() } else { 0 };
        let is_right = output.bins.len() == n_bins && output.bins.iter().all(|bins| *bins >= 1);
        require(is_right, || format!("an output `{}` has wrong bins", output.kind.word()))?;
        let mut last = -1.0;
        for &time in &output.times {
            require(time > last && time <= self.time.duration, || "output times are not in order".into())?;
            last = time;
        }
        Ok(())
    }
}

pub(super) fn require(is_right: bool, otherwise: impl FnOnce() -> String) -> Result<(), String> {
    if is_right { Ok(()) } else { Err(otherwise()) }
}

/// Registers point backwards; inputs are x, y, z, t.
pub(super) fn check_tape(tape: &Tape) -> Result<(), String> {
    check_operations(&tape.operations, usize::from(super::build_tape::TIME_INPUT) + 1)
}

/// Registers point backwards, inputs to one of so many columns.
pub(super) fn check_operations(operations: &[Operation], n_inputs: usize) -> Result<(), String> {
    require(!operations.is_empty(), || "an empty tape".into())?;
    for (idx, operation) in operations.iter().enumerate() {
        let is_before = |register: u16| usize::from(register) < idx;
        let is_right = match *operation {
            Operation::Constant(_) => true,
            Operation::Input(column) => usize::from(column) < n_inputs,
            Operation::Unary(_, a) => is_before(a),
            Operation::Binary(_, a, b) => is_before(a) && is_before(b),
            Operation::Select(a, b, c) => is_before(a) && is_before(b) && is_before(c),
            Operation::Table(ref lookup) => lookup.at.iter().all(|&register| is_before(register)),
        };
        require(is_right, || format!("operation {idx} of a tape reads what is not there"))?;
    }
    Ok(())
}
