//! Where tables bend or jump.
//!
//! Owns the way from rows of a table back to the input that it is read at. May use the tape. It deliberately knows
//! only inputs that are shifted and scaled on their way: through anything else no place can be told.

use super::{Binary, Operation, Tape, Unary};

/// `scale · input + shift`
#[derive(Clone, Copy)]
struct Affine {
    scale: f64,
    shift: f64,
}

impl Tape {
    /// Whether a table of numbers is read.
    pub fn reads_tables(&self) -> bool {
        self.operations.iter().any(|operation| matches!(operation, Operation::Table(_)))
    }

    /// The values of an input at which a table that is read along it has a row, in rising order, each once: kinks of
    /// linear tables, jumps of steps. Input 3 is the time.
    ///
    /// - Equation: `input = (row − shift)/scale`.
    /// - Symbols: the table is read at `scale · input + shift`.
    /// - Range: tables whose coordinate follows from this input alone, shifted and scaled by constants.
    /// - Source: definition.
    /// - Shape: as many numbers as rows.
    pub fn kinks(&self, input: u16) -> Vec<f64> {
        let forms = self.forms(input);
        let mut list = Vec::new();
        for lookup in self.operations.iter().filter_map(|operation| match operation {
            Operation::Table(lookup) => Some(lookup),
            _ => None,
        }) {
            for (axis, &register) in lookup.reads().iter().enumerate() {
                let Some(form) = forms[usize::from(register)].filter(|form| form.scale != 0.0) else {
                    continue;
                };
                list.extend(lookup.table.axes()[axis].iter().map(|row| (row - form.shift) / form.scale));
            }
        }
        list.retain(|place: &f64| place.is_finite());
        list.sort_by(f64::total_cmp);
        list.dedup();
        list
    }

    /// What each register is of the input; nothing where it is not affine in it.
    fn forms(&self, input: u16) -> Vec<Option<Affine>> {
        let mut forms: Vec<Option<Affine>> = Vec::with_capacity(self.operations.len());
        for operation in &self.operations {
            let of = |register: u16| forms[usize::from(register)];
            forms.push(match *operation {
                Operation::Constant(shift) => Some(Affine { scale: 0.0, shift }),
                Operation::Input(own) => (own == input).then_some(Affine { scale: 1.0, shift: 0.0 }),
                Operation::Unary(Unary::Negate, a) => of(a).map(|a| a.times(-1.0)),
                Operation::Binary(operator, a, b) => {
                    of(a).zip(of(b)).and_then(|(a, b)| a.joined(operator, b))
                }
                Operation::Unary(..) | Operation::Select(..) | Operation::Table(_) => None,
            });
        }
        forms
    }
}

impl Affine {
    fn times(self, factor: f64) -> Self {
        Self { scale: self.scale * factor, shift: self.shift * factor }
    }

    fn joined(self, operator: Binary, other: Self) -> Option<Self> {
        let sum = |other: Self| Self { scale: self.scale + other.scale, shift: self.shift + other.shift };
        match operator {
            Binary::Add => Some(sum(other)),
            Binary::Subtract => Some(sum(other.times(-1.0))),
            Binary::Multiply if other.scale == 0.0 => Some(self.times(other.shift)),
            Binary::Multiply if self.scale == 0.0 => Some(other.times(self.shift)),
            Binary::Divide if other.scale == 0.0 => {
                Some(Self { scale: self.scale / other.shift, shift: self.shift / other.shift })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Lookup;
    use super::*;
    use crate::data::{Beyond, Rule, Table};
    use std::sync::Arc;

    fn tape(head: Vec<Operation>) -> Tape {
        let table =
            Table::new(vec![vec![0.0, 2.0, 6.0]], vec![1.0, 5.0, 3.0], Rule::Linear).expect("a table");
        let register = head.len() as u16 - 1;
        let lookup = Lookup { table: Arc::new(table), at: [register; 3], beyond: Beyond::Hold };
        Tape { operations: [head, vec![Operation::Table(lookup)]].concat() }
    }

    #[test]
    fn rows_are_found_behind_shifts_and_scales() {
        assert_eq!(tape(vec![Operation::Input(3)]).kinks(3), [0.0, 2.0, 6.0]);
        assert_eq!(tape(vec![Operation::Input(3)]).kinks(0), [0.0; 0]);
        let shifted = vec![
            Operation::Input(3),
            Operation::Constant(2.0),
            Operation::Binary(Binary::Multiply, 1, 0),
            Operation::Binary(Binary::Subtract, 1, 2),
        ];
        // 2 − 2 t = 0, 2, 6
        assert_eq!(tape(shifted).kinks(3), [-2.0, 0.0, 1.0]);
        let bent = vec![Operation::Input(3), Operation::Binary(Binary::Multiply, 0, 0)];
        assert_eq!(tape(bent).kinks(3), [0.0; 0]);
    }
}
