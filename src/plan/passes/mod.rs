//! The passes: what a scene does not need is left out, in a fixed order, each with its reason.
//!
//! Owns the order, the driver and the record of what was left out. May use `plan`. It deliberately
//! never changes what the outputs mean: the driver checks that after each pass.

mod axes;
mod exchange;
mod kernels;
mod network;
mod order;
mod outputs;
mod relations;
mod species;
mod stages;
mod zones;

use super::Plan;
use super::evaluation::Evaluation;
use serde::Serialize;

/// Something that a scene has, or could have, and that its run does without.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    pub what: String,
    pub why: String,
}

/// A plan on its way through the passes.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    pub plan: Plan,
    pub evaluation: Evaluation,
    pub left_out: Vec<LeftOut>,
}

impl Draft {
    pub(super) fn leave_out(&mut self, what: impl Into<String>, why: impl Into<String>) {
        self.left_out.push(LeftOut { what: what.into(), why: why.into() });
    }
}

/// A pass: its name in messages and tests, and whether it keeps every byte of the tables.
pub struct Pass {
    pub name: &'static str,
    pub run: fn(&mut Draft),
    /// False where arithmetic is replaced by an equivalent; a test bounds the difference.
    pub keeps_bytes: bool,
}

/// All passes in the order they run.
pub const PASSES: &[Pass] = &[
    // First, because everything below lives only as long as some output reads it.
    Pass { name: "outputs", run: outputs::run, keeps_bytes: true },
    // Before relations: a species that nobody reads must not become the one that others derive from.
    Pass { name: "species", run: species::run, keeps_bytes: true },
    // Before relations, too. Fewer reactions are integrated together with other steps: other last digits.
    Pass { name: "reactions", run: network::run, keeps_bytes: false },
    // Before stages, which asks whether any zone still exchanges.
    Pass { name: "zones", run: zones::run, keeps_bytes: true },
    // Merging sums fractions before multiplying: the last bit may differ.
    Pass { name: "equal zones", run: zones::merge_equal, keeps_bytes: false },
    // After species: only what is carried can be derived from one another.
    Pass { name: "relations", run: relations::run, keeps_bytes: false },
    // After reactions: what nothing reacts by, or is seen by, is not found.
    Pass { name: "kernels", run: kernels::run, keeps_bytes: true },
    // After relations: what nobody carries nobody exchanges. Before axes, which an exchange needs all of.
    Pass { name: "exchange", run: exchange::run, keeps_bytes: true },
    // After relations: fewer fields, fewer gradients. Other particles are drawn: equal in law only.
    Pass { name: "axes", run: axes::run, keeps_bytes: false },
    // Where particles lie in memory hangs on the flow alone.
    Pass { name: "order", run: order::run, keeps_bytes: true },
    // Last: decides from what is left which work a step has, and joins it into one pass over memory.
    Pass { name: "stages", run: stages::run, keeps_bytes: true },
];

/// Runs the passes that `wanted` selects.
///
/// # Panics
/// If a pass leaves a plan that is not well-formed, or changes what is observed: our own mistake.
pub fn run(draft: &mut Draft, wanted: impl Fn(&Pass) -> bool) {
    for pass in PASSES.iter().filter(|pass| wanted(pass)) {
        let before = observed(&draft.plan);
        (pass.run)(draft);
        if let Err(reason) = draft.plan.check() {
            panic!("pass `{}` broke the plan: {reason}", pass.name);
        }
        let after = observed(&draft.plan);
        assert!(
            pass.name == "outputs" || before == after,
            "pass `{}` changed what is observed: {before:?} to {after:?}",
            pass.name
        );
    }
}

/// What the outputs observe, in names: equal before and after every pass but the first.
fn observed(plan: &Plan) -> Vec<String> {
    let name = |idx: usize| plan.species[idx].name.as_str();
    let describe = |output: &super::Output| {
        let quantities: Vec<String> = output
            .quantities
            .iter()
            .map(|quantity| match *quantity {
                super::Quantity::Species(a) => name(a).to_owned(),
                super::Quantity::Pair(a, b) => format!("{}×{}", name(a), name(b)),
            })
            .collect();
        format!("{:?} {} at {} times", output.kind, quantities.join(", "), output.times.len())
    };
    plan.outputs.iter().map(describe).collect()
}
