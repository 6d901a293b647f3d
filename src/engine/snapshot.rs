//! What the engine hands out: numbers at a time, nothing of files.
//!
//! Owns the shapes of observations. May use `plan` and the counts of `chemistry`. It deliberately knows no Arrow.

use crate::chemistry::Work;
use crate::flow::statistics::Statistics;

/// One observation of one output at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Snapshot {
    /// Index into `plan.outputs`.
    pub output_idx: usize,
    /// s
    pub t: f64,
    pub values: Values,
}

/// The values of an observation; columns follow `plan.outputs[output_idx].quantities`.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Per quantity a column over the bins (first active axis slowest): mean and its standard error. Particles are
    /// counted per bin, or per bin of one quantity after the other where each has particles of its own. The mean of
    /// a bin without fluid particles is NaN; where there is no particle with mass it is 0.
    Binned { mean: Vec<Vec<f64>>, standard_error: Vec<Vec<f64>>, n_particles: Vec<u64> },
    /// Per pair a column over the bins.
    Covariance { covariance: Vec<Vec<f64>>, n_particles: Vec<u64> },
    /// Per species the amount in the domain and outside of open sides, mol or kg (per m², m for
    /// fewer axes than three).
    Total { amount: Vec<f64> },
    /// Per pair.
    Mixing(Vec<MixingState>),
    /// Positions per active axis and concentrations per species, in the order of particles.
    Particles { positions: Vec<Vec<f64>>, concentrations: Vec<Vec<f64>> },
    /// Per species one row or several of the numbers that the output's kind lists.
    Rows(Vec<Vec<Row>>),
}

/// Numbers of one place; one that is none is unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Index into the places of the output.
    pub place: u16,
    pub numbers: Vec<f64>,
}

impl Values {
    /// The first column with a value beyond all numbers. What is undefined, as the mean of an empty bin,
    /// is no overflow.
    pub fn overflow(&self) -> Option<usize> {
        match self {
            Self::Binned { mean, n_particles, .. } => {
                let is_broken = |(q, column): (usize, &Vec<f64>)| {
                    let mut bins = column.iter().zip(counts(n_particles, column.len(), q));
                    bins.any(|(value, &n)| value.is_infinite() || (n > 0 && value.is_nan()))
                };
                mean.iter().enumerate().position(is_broken)
            }
            Self::Covariance { covariance, n_particles } => covariance.iter().position(|column| {
                column.iter().zip(n_particles).any(|(value, &n)| n > 1 && !value.is_finite())
            }),
            Self::Total { amount } => amount.iter().position(|value| !value.is_finite()),
            Self::Mixing(states) => states.iter().position(|state| {
                [state.m, state.m_mean, state.m_cov].iter().any(|value| value.is_infinite())
            }),
            Self::Particles { concentrations, .. } => {
                concentrations.iter().position(|column| column.iter().any(|value| !value.is_finite()))
            }
            Self::Rows(rows) => rows
                .iter()
                .position(|rows| rows.iter().any(|row| row.numbers.iter().any(|value| value.is_infinite()))),
        }
    }
}

/// The particles of one quantity in each of `n_bins`, of all or of its own.
pub fn counts(n_particles: &[u64], n_bins: usize, quantity: usize) -> &[u64] {
    let own = n_particles.get(quantity * n_bins..(quantity + 1) * n_bins).unwrap_or_default();
    if n_particles.len() == n_bins { n_particles } else { own }
}

/// M = M_mean + M_cov and γ = M_cov / M_mean of one pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MixingState {
    pub m: f64,
    pub m_mean: f64,
    pub m_cov: f64,
    pub gamma: f64,
}

/// What a finished run says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    pub n_steps: u64,
    pub n_particles: u64,
    /// Per component: |final − initial| / max(|initial|, Σ|values|) of the carried amount, apart from what
    /// reactions added; and how far these missed what they conserve.
    pub mass_defect: Vec<f64>,
    /// Sub-steps and evaluations of what is integrated.
    pub labour: Work,
    /// Wall and CPU seconds of the step loop and of everything the engine did.
    pub loop_wall: f64,
    pub wall: f64,
    pub cpu: f64,
    /// Bytes of particle state.
    pub state_bytes: u64,
    /// Of a flow in cells.
    pub flow: Option<Statistics>,
}

impl Outcome {
    /// Accepted sub-steps; `None` if nothing is integrated.
    pub fn sub_steps(&self) -> Option<u64> {
        (self.labour.steps > 0).then_some(self.labour.steps)
    }

    /// The largest defect of all components; not a number if one of them is none.
    pub fn worst_defect(&self) -> f64 {
        self.mass_defect.iter().copied().fold(0.0, super::amount::worse)
    }
}
