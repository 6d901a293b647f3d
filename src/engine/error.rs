//! What can stop a run, in words that name the step, the particle and the component.
//!
//! Owns the run's errors. May use the numbers of `diagnostic`, the kinds of outputs and the
//! reasons of `chemistry`. It deliberately holds no spans: a plan has none, and `crate::stop` finds them.

use crate::chemistry::Why;
use crate::diagnostic::precise;
use crate::plan::OutputKind;
use std::fmt;

/// Why a run stopped. Steps count from 1, as the first step leads from time 0 to the first time;
/// step 0 is the initial state. Particles count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum RunError {
    /// The plan contradicts itself; only a plan that was edited by hand can.
    Plan(String),
    NonFiniteInitial {
        component: String,
        particle: u64,
        position: Vec<f64>,
    },
    /// The initial value of something immobile, negative or no number.
    WrongInBin {
        component: String,
        position: Vec<f64>,
        value: f64,
    },
    NonFinitePosition {
        step: u64,
        particle: u64,
    },
    /// Laws that cannot be integrated over a step, or that have no equilibrium.
    Chemistry {
        step: u64,
        particle: u64,
        what: String,
        why: Why,
    },
    NonFiniteConcentration {
        step: u64,
        particle: u64,
        component: String,
    },
    NegativeConcentration {
        step: u64,
        particle: u64,
        component: String,
        value: f64,
    },
    MassLost {
        step: u64,
        component: String,
        /// Not finite if the values are numbers and their sum is none.
        defect: f64,
    },
    /// An amount, a mean or a product that numbers cannot hold, of values that are numbers.
    NonFiniteOutput {
        t: f64,
        kind: OutputKind,
        /// The species, or the pair.
        quantity: String,
    },
    /// The flow could not be solved for.
    Flow(String),
    /// Water goes through a side that says nothing of what it carries.
    Leak {
        /// Twice the active axis, plus one at its upper end, and its word.
        side: usize,
        name: &'static str,
        /// What the water does, and what the side does.
        way: &'static str,
        kind: &'static str,
        /// m³/s, or per what is missing of three axes.
        rate: f64,
    },
    /// A particle would need more sub-steps than a step may have.
    TooManySubSteps {
        step: u64,
        particle: u64,
    },
    OutOfMemory {
        bytes: u64,
    },
    Threads(String),
    Cancelled,
    /// Whoever takes the snapshots refused one.
    Sink(String),
}

impl RunError {
    /// The number where no particle is meant.
    pub const OF_NO_PARTICLE: u64 = u64::MAX;
}

/// Of a particle, or in a cell of a lattice, which the reason names.
fn chemistry(f: &mut fmt::Formatter<'_>, step: u64, particle: u64, what: &str) -> fmt::Result {
    match particle {
        RunError::OF_NO_PARTICLE => write!(f, "step {step}: the chemistry cannot be solved {what}"),
        _ => write!(f, "step {step}: the chemistry of particle {particle} cannot be solved: {what}"),
    }
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plan(what) => write!(f, "the plan is not sound: {what}"),
            Self::NonFiniteInitial { component, particle, position } => write!(
                f,
                "the initial value of `{component}` is not a finite number for particle {particle} at {} m",
                place(position)
            ),
            Self::WrongInBin { component, position, value } => write!(
                f,
                "the initial value of `{component}` at {} m is {}; zero or more is possible",
                place(position),
                precise(*value)
            ),
            Self::Chemistry { step, particle, what, .. } => chemistry(f, *step, *particle, what),
            Self::NonFinitePosition { step, particle } => {
                write!(f, "step {step}: the position of particle {particle} is not a finite number")
            }
            Self::NonFiniteConcentration { step, particle, component } => {
                write!(f, "step {step}: `{component}` of particle {particle} is not a finite number")
            }
            Self::NegativeConcentration { step: 0, particle, component, value } => {
                write!(
                    f,
                    "the initial concentration of `{component}` is negative for particle {particle} ({})",
                    precise(*value)
                )
            }
            Self::NegativeConcentration { step, particle, component, value } => {
                write!(
                    f,
                    "step {step}: `{component}` of particle {particle} became negative ({})",
                    precise(*value)
                )
            }
            Self::MassLost { step, component, defect } if !defect.is_finite() => {
                write!(f, "step {step}: the amount of `{component}` is not a finite number")
            }
            Self::MassLost { step, component, defect } => {
                write!(
                    f,
                    "step {step}: the amount of `{component}` changed by {} of itself",
                    precise(*defect)
                )
            }
            Self::NonFiniteOutput { t, kind, quantity } => {
                let (kind, t) = (kind.word(), precise(*t));
                write!(f, "`{kind} {quantity}` at {t} s is larger than numbers can hold (1.8e308 in SI)")
            }
            Self::Flow(what) => write!(f, "the flow: {what}"),
            Self::Leak { name, way, kind, rate, .. } => {
                let rate = precise(*rate);
                write!(
                    f,
                    "water {way} through side `{name}`, which {kind} ({rate} m³/s, per m of missing axes)"
                )
            }
            Self::TooManySubSteps { step, particle } => {
                write!(f, "step {step}: particle {particle} would need more than 16,384 sub-steps")
            }
            Self::OutOfMemory { bytes } => write!(f, "no memory for {bytes} bytes of particles"),
            Self::Threads(what) => write!(f, "the threads could not be started: {what}"),
            Self::Cancelled => write!(f, "the run was cancelled"),
            Self::Sink(what) => write!(f, "{what}"),
        }
    }
}

/// One coordinate, or several in brackets.
fn place(position: &[f64]) -> String {
    let list: Vec<String> = position.iter().map(|&x| precise(x)).collect();
    if let [only] = &list[..] { only.clone() } else { format!("({})", list.join(", ")) }
}

impl std::error::Error for RunError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_values_read_like_numbers() {
        let at = |position: &[f64]| {
            RunError::NonFiniteInitial { component: "A".into(), particle: 7, position: position.to_vec() }
                .to_string()
        };
        assert!(at(&[1.11]).ends_with("for particle 7 at 1.11 m"), "{}", at(&[1.11]));
        assert!(at(&[1.11, 2e300]).ends_with("at (1.11, 2e300) m"), "{}", at(&[1.11, 2e300]));
        let negative =
            RunError::NegativeConcentration { step: 3, particle: 7, component: "A".into(), value: -1.0 };
        assert!(negative.to_string().ends_with("became negative (-1)"), "{negative}");
    }
}
