//! What can stop a run, in words that name the step, the particle and the component.
//!
//! Owns the run's errors. May use nothing else of the crate. It deliberately holds no spans: a plan
//! has none.

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
    NonFinitePosition {
        step: u64,
        particle: u64,
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
    OutOfMemory {
        bytes: u64,
    },
    Threads(String),
    Cancelled,
    /// Whoever takes the snapshots refused one.
    Sink(String),
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plan(what) => write!(f, "the plan is not sound: {what}"),
            Self::NonFiniteInitial { component, particle, position } => write!(
                f,
                "the initial value of `{component}` is not a finite number for particle {particle} at {position:?} m"
            ),
            Self::NonFinitePosition { step, particle } => {
                write!(f, "step {step}: the position of particle {particle} is not a finite number")
            }
            Self::NonFiniteConcentration { step, particle, component } => {
                write!(f, "step {step}: `{component}` of particle {particle} is not a finite number")
            }
            Self::NegativeConcentration { step: 0, particle, component, value } => {
                write!(
                    f,
                    "the initial concentration of `{component}` is negative for particle {particle} ({value:e})"
                )
            }
            Self::NegativeConcentration { step, particle, component, value } => {
                write!(f, "step {step}: `{component}` of particle {particle} became negative ({value:e})")
            }
            Self::MassLost { step, component, defect } if !defect.is_finite() => {
                write!(f, "step {step}: the amount of `{component}` is not a finite number")
            }
            Self::MassLost { step, component, defect } => {
                write!(f, "step {step}: the amount of `{component}` changed by {defect:e} of itself")
            }
            Self::OutOfMemory { bytes } => write!(f, "no memory for {bytes} bytes of particles"),
            Self::Threads(what) => write!(f, "the threads could not be started: {what}"),
            Self::Cancelled => write!(f, "the run was cancelled"),
            Self::Sink(what) => write!(f, "{what}"),
        }
    }
}

impl std::error::Error for RunError {}
