//! Which work a step has: stages without effect go, the rest becomes one pass over memory.

use super::Draft;
use crate::plan::{Plan, Stage, ZoneRate};

pub(super) fn run(draft: &mut Draft) {
    let plan = &draft.plan;
    let moves = plan.walk.drift.iter().chain(&plan.walk.spread).any(|entry| *entry != 0.0);
    let mixes = exchanges(plan);
    let observes = !plan.outputs.is_empty();
    let mut notes = Vec::new();
    if plan.mixing.is_none() {
        notes.push(("mixing and averages in a step", "no mixing zones"));
    } else if !mixes {
        notes.push((
            "mixing and averages in a step",
            "no zone with a finite rate: means are taken at outputs only",
        ));
    }
    if !moves {
        notes.push(("moving particles", "neither flow in the frame nor dispersion"));
    }
    if !observes {
        notes.push(("observation", "no outputs"));
    }
    if plan.reactions.is_empty() {
        notes.push(("reaction", "no reactions"));
    } else {
        notes.push((
            "reaction in a step",
            "instant: particles carry conserved totals, products are worked out at outputs",
        ));
    }
    notes.push(("neighbour search", "no kernel interaction"));
    let mut stages = match (moves, mixes) {
        (true, true) => vec![Stage::FusedStep],
        (true, false) => vec![Stage::Move, Stage::Bound],
        (false, true) => vec![Stage::Mix],
        (false, false) => vec![],
    };
    if observes {
        stages.push(Stage::Observe);
    }
    draft.plan.stages = stages;
    for (what, why) in notes {
        draft.leave_out(what, why);
    }
}

/// Whether any zone moves towards the mean at a finite rate.
fn exchanges(plan: &Plan) -> bool {
    let Some(mixing) = &plan.mixing else { return false };
    mixing.zones.iter().any(|zone| matches!(zone.rate, ZoneRate::Finite(rate) if rate > 0.0))
}
