//! One reaction of order zero, to the end of its scarcest reactant.
//!
//! Owns that. May use the plan. It deliberately leaves exactly zero of what is used up.

use super::Changes;
use crate::maths::wide::Width;
use crate::plan::chemistry::{Kinetic, Law};
use pulp::NullaryFnOnce;

/// `r = k` as long as there is something to react.
#[derive(Debug, Clone)]
pub(in crate::chemistry) struct Zero {
    constant: f64,
    changes: Changes,
}

impl Zero {
    pub fn new(reaction: &Kinetic) -> Result<Self, String> {
        match &reaction.law {
            Law::MassAction { constant, orders } if orders.is_empty() => {
                Ok(Self { constant: *constant, changes: reaction.changes.clone() })
            }
            _ => Err(format!("`{}` is not of order zero", reaction.name)),
        }
    }

    pub fn react(&self, width: Width, t: f64, components: &mut [&mut [f64]], extents: &mut Vec<f64>) {
        width.run(React { law: self, t, components, extents });
    }
}

struct React<'a, 'b> {
    law: &'a Zero,
    t: f64,
    components: &'a mut [&'b mut [f64]],
    extents: &'a mut Vec<f64>,
}

impl NullaryFnOnce for React<'_, '_> {
    type Output = ();

    /// `ξ = min(|k| t, min_i c_i/|ν_i|)` over what the direction of the reaction consumes.
    #[inline(always)]
    fn call(self) {
        let Self { law, t, components, extents } = self;
        let n = components.first().map_or(0, |column| column.len());
        let direction = if law.constant < 0.0 { -1.0 } else { 1.0 };
        extents.clear();
        extents.resize(n, (law.constant * t).abs());
        for &(component, coefficient) in law.changes.iter().filter(|(_, nu)| nu * direction < 0.0) {
            let inverse = 1.0 / coefficient.abs();
            for (extent, value) in extents.iter_mut().zip(components[component].iter()) {
                let most = value * inverse;
                let most = if most < 0.0 { 0.0 } else { most };
                // Written so that NaN stays.
                *extent = if *extent <= most { *extent } else { most };
            }
        }
        for &(component, coefficient) in &law.changes {
            let change = coefficient * direction;
            let column = &mut components[component];
            for (value, extent) in column.iter_mut().zip(extents.iter()) {
                let new = *value + change * extent;
                // What is left of rounding is not there.
                let is_gone = change < 0.0 && new < 4.0 * f64::EPSILON * *value;
                *value = if is_gone && *value > 0.0 { 0.0 } else { new };
            }
        }
    }
}
