//! Whether a tape may be evaluated.
//!
//! Owns the test of registers and inputs. May use the tape's types. It deliberately judges no values.

use super::{Operation, Tape};

impl Tape {
    /// Says what is wrong with the tape, if anything: it is empty, too long, reads a register that is
    /// not yet written, or an input that does not exist.
    pub fn check(&self, n_inputs: usize) -> Result<(), String> {
        if self.operations.is_empty() {
            return Err("an expression without operations".to_owned());
        }
        if self.operations.len() > usize::from(u16::MAX) {
            return Err(format!(
                "an expression of {} operations; at most 65535 are possible",
                self.operations.len()
            ));
        }
        self.operations
            .iter()
            .enumerate()
            .try_for_each(|(idx, operation)| check_one(idx, operation, n_inputs))
    }
}

fn check_one(idx: usize, operation: &Operation, n_inputs: usize) -> Result<(), String> {
    let written = |registers: &[u16]| match registers.iter().find(|&&register| usize::from(register) >= idx) {
        Some(register) => Err(format!("operation {idx} reads register {register}, which is not yet written")),
        None => Ok(()),
    };
    match *operation {
        Operation::Constant(_) => Ok(()),
        Operation::Input(input) if usize::from(input) < n_inputs => Ok(()),
        Operation::Input(input) => Err(format!("operation {idx} reads input {input} of {n_inputs}")),
        Operation::Unary(_, a) => written(&[a]),
        Operation::Binary(_, a, b) => written(&[a, b]),
        Operation::Select(a, b, c) => written(&[a, b, c]),
        Operation::Table(ref lookup) => written(lookup.reads()),
    }
}
