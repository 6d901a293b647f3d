//! Solutions that results are held against.
//!
//! Owns closed forms, quadratures and the front limit; each is one file and one line in [`ALL`].
//! May use the words. It deliberately reads no result: `measure` compares.

mod arguments;
mod decaying_inflow;
mod front;
mod front_covariance;
mod front_gamma;
mod front_limit;
mod gaussian_closure;
mod gaussian_pulse;
mod inflow;
mod macrodispersion;
#[cfg(test)]
mod manual;
mod michaelis_menten;
mod pulse_covariance;
mod pulse_gamma;
mod solutions;
mod step_front;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod values;
mod well_mixed;

use crate::units::Dimension;

/// Every reference that a scene can name.
pub const ALL: &[Item] = &[
    step_front::ITEM,
    well_mixed::FRONT,
    well_mixed::TOTAL,
    front_limit::FRONT,
    front_limit::TOTAL,
    front_covariance::ITEM,
    front_covariance::MULTIRATE,
    front_gamma::ITEM,
    front_gamma::MULTIRATE,
    gaussian_closure::ITEM,
    gaussian_pulse::ITEM,
    pulse_covariance::ITEM,
    pulse_gamma::ITEM,
    inflow::OGATA_BANKS,
    inflow::CAUCHY_INFLOW,
    decaying_inflow::FIXED_CONCENTRATION,
    decaying_inflow::FIXED_FLUX,
    michaelis_menten::ITEM,
    macrodispersion::ALONG,
    macrodispersion::ACROSS,
];

/// The item of that name.
pub fn find(name: &str) -> Option<&'static Item> {
    ALL.iter().find(|item| item.name == name)
}

/// An argument of a catalogue item.
#[derive(Debug, Clone, Copy)]
pub struct Argument {
    pub name: &'static str,
    pub dimension: ArgumentDimension,
    /// Value if the user leaves it out; `None` makes it required.
    pub default: Option<f64>,
    /// Range of valid SI values, both ends inclusive.
    pub range: (f64, f64),
    pub doc: &'static str,
}

/// The dimension a slot asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArgumentDimension {
    Fixed(Dimension),
    /// mol/volume or mass/volume: whichever the species has.
    Concentration,
    /// The same per time.
    ConcentrationPerTime,
}

/// What a reference predicts, and thereby which output it is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Predicts {
    /// Mean concentration at a point: `profile` and `map`.
    Concentration,
    /// Covariance of the pair at a point: `covariance`.
    Covariance,
    /// γ of the pair: `mixing`.
    Gamma,
    /// Amount: `total`.
    Total,
    /// A second moment: `xx`, `yy` or `zz` of `moments`.
    Moment,
}

/// One item of the catalogue.
#[derive(Clone, Copy)]
pub struct Item {
    pub name: &'static str,
    pub predicts: Predicts,
    pub arguments: &'static [Argument],
    /// As in the item's own documentation; docs/references.md shows it.
    pub equation: &'static str,
    /// One line for the language reference.
    pub summary: &'static str,
    /// Author, year, equation, DOI.
    pub source: &'static str,
    /// Builds the solution from SI arguments in the order of `arguments`; an error is one sentence
    /// about the arguments.
    pub build: fn(&[f64]) -> Built,
}

/// A solution, or one sentence on what is wrong with its arguments.
pub type Built = Result<Box<dyn Solution>, String>;

/// A solution ready to be evaluated.
pub trait Solution: Send + Sync {
    /// Fills `out[p]` at time `t` (s) and position `positions[axis][p]` (m, frame coordinates);
    /// `positions` always has three axes, zero where the scene has fewer. For γ and totals there
    /// is one point, the origin.
    fn fill(&self, t: f64, positions: [&[f64]; 3], out: &mut [f64]);
}
