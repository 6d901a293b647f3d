//! Kernels that concentrations are found by, in words.
//!
//! Owns these lines of `lamella plan`. May use the plan. It deliberately decides nothing.

use super::Plan;
use super::kernels::{FOURTH, Reacting};
use crate::diagnostic::number;

/// How concentrations are found of particles that carry mass, and densities of parcels.
pub(super) fn lines(plan: &Plan) -> Vec<String> {
    let Some(kernels) = &plan.kernels else { return Vec::new() };
    let cells: Vec<String> = kernels.cells.iter().map(usize::to_string).collect();
    let mut lines = vec![format!("kernel {} on {} cells", kernels.manner.words(), cells.join(" x "))];
    match kernels.bandwidth {
        Some([low, high]) if low == high => lines.push(format!("bandwidth {} m", number(low))),
        Some([low, high]) => lines.push(format!("bandwidths from {} to {} m", number(low), number(high))),
        None if kernels.searches() => lines.push("bandwidths as the cells and the domain allow".into()),
        None => {}
    }
    if kernels.searches() {
        let shape = if kernels.is_stretched { "may be longer along one axis" } else { "are round" };
        lines.push(format!(
            "kernels {shape}; mass stays inside of walls; at most {} loops, to a change of {}",
            kernels.loops,
            number(kernels.tolerance)
        ));
    }
    if kernels.is_oriented {
        let others = if kernels.reacting.is_some() { "; those that react lie along the axes" } else { "" };
        lines.push(format!("densities that are shown: kernels along the flow{others}"));
    }
    if kernels.order == FOURTH {
        lines.push(
            "densities that are shown: of the fourth order, by kernels 1.6 times as wide, put right by the particles; of the second where a side absorbs or holds a concentration".into(),
        );
    }
    match kernels.reacting {
        None => {}
        Some(Reacting::Masses) => {
            lines.push(
                "reactions: masses of particles change, by what reacts in the cells of their kernels".into(),
            );
            if kernels.searches() {
                lines.push(format!(
                    "kernels that react are {} as wide, or hold four particles; found again after {} steps, or when the number of particles has changed by 5 %",
                    number(kernels.narrowing),
                    kernels.refresh
                ));
            }
        }
        Some(Reacting::Pairs) => {
            lines
                .push("reactions: pairs of particles meet, each with its chance, and become products".into());
        }
    }
    lines
}
