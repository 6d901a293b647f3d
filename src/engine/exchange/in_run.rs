//! The exchanges of a step of a run: of parcels with those around them, and of zones with means over these.
//!
//! Owns what becomes of a value that is wrong. May use the run. It deliberately does nothing where parcels exchange nothing.

use super::super::control::Settings;
use super::super::error::RunError;
use super::super::program::{Program, Work};
use super::super::run::Run;
use super::{Exchange, Wrong};

/// What a run has of them.
pub struct Exchanges<const D: usize> {
    dispersion: Option<Exchange<D>>,
    means: Option<Exchange<D>>,
}

impl<const D: usize> Exchanges<D> {
    pub fn new(program: &Program<D>, settings: &Settings) -> Result<Self, RunError> {
        Ok(Self {
            dispersion: Exchange::new(program, settings)?,
            means: Exchange::of_means(program, settings)?,
        })
    }

    /// The same, to go another way from here.
    pub fn copy(&self) -> Self {
        Self {
            dispersion: self.dispersion.as_ref().map(Exchange::copy),
            means: self.means.as_ref().map(Exchange::copy),
        }
    }

    pub fn are_none(&self) -> bool {
        self.dispersion.is_none() && self.means.is_none()
    }
}

impl<const D: usize> Run<'_, D> {
    /// Both over `dt`, as in a step, at the positions reached.
    pub fn exchange_all(&mut self, step: u64, dt: f64) -> Result<(), RunError> {
        self.exchange(Work { exchanges: true, ..Work::default() }, step, dt)?;
        self.exchange(Work { blends: true, ..Work::default() }, step, dt)
    }

    /// The means that parcels see before anything happens.
    pub fn take_means(&mut self) -> Result<(), RunError> {
        if self.program.mean_slot().is_none() {
            return Ok(());
        }
        self.exchange(Work { blends: true, ..Work::default() }, 0, 0.0)
    }

    /// What the work asks for, over `dt` at the positions reached.
    pub fn exchange(&mut self, work: Work, step: u64, dt: f64) -> Result<(), RunError> {
        let size = (dt, self.width);
        let wrong = match (&mut self.exchanges, work.blends) {
            (Exchanges { means: Some(means), .. }, true) => {
                means.blend(&self.program, &mut self.blocks, size, &self.limits)?
            }
            (Exchanges { dispersion: Some(exchange), .. }, false) => {
                exchange.step(&self.program, &mut self.blocks, size, &self.limits)?
            }
            _ => return Ok(()),
        };
        self.is_averaged = false;
        let Some(Wrong { column, block, at }) = wrong else { return Ok(()) };
        let component = self.program.plan.components[column / self.program.roles.len()].name.clone();
        let block = &self.blocks[block];
        let (particle, value) = (block.number(at), block.columns[column][at]);
        let step = step + 1;
        Err(if value.is_finite() {
            RunError::NegativeConcentration { step, particle, component, value }
        } else {
            RunError::NonFiniteConcentration { step, particle, component }
        })
    }
}
