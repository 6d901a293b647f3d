//! The exchange of a step of a run.
//!
//! Owns what becomes of a value that is wrong. May use the run. It deliberately does nothing where parcels exchange nothing.

use super::super::error::RunError;
use super::super::run::Run;
use super::Wrong;

impl<const D: usize> Run<'_, D> {
    /// Exchange over `dt` at the positions reached.
    pub fn exchange(&mut self, step: u64, dt: f64) -> Result<(), RunError> {
        let Some(exchange) = &mut self.exchange else { return Ok(()) };
        let size = (dt, self.width);
        let wrong = exchange.step(&self.program, &mut self.blocks, size, &self.limits)?;
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
