//! Which work a step has: stages without effect go, the rest becomes one pass over memory.

use super::Draft;
use crate::plan::chemistry::Method;
use crate::plan::{Plan, Stage, ZoneRate};

pub(super) fn run(draft: &mut Draft) {
    let plan = &draft.plan;
    if plan.carries_mass() {
        // Masses move and are looked at, whatever the scene.
        return;
    }
    let is_tracked = plan.transport.is_some();
    let moves = plan.moves();
    let mixes = exchanges(plan);
    let reacts = plan.reacts_in_steps();
    // Then no particle reacts before the means of all are known.
    let is_coupled = reacts && plan.hangs_on_bins();
    let averages = plan.has_kernel_mean();
    let observes = !plan.outputs.is_empty();
    let mut notes = Vec::new();
    notes.extend(of_means(plan, mixes, is_coupled).map(|why| ("mixing and averages in a step", why)));
    if !moves {
        notes.push(("moving particles", why_still(plan)));
    }
    if !observes {
        notes.push(("observation", "no outputs"));
    }
    if plan.reactions.is_empty() && plan.chemistry.is_none() {
        notes.push(("reaction", "no reactions"));
    } else if !plan.reactions.is_empty() {
        notes.push((
            "reaction in a step",
            "instant: particles carry conserved totals, products are worked out at outputs",
        ));
    }
    let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
    if kinetics.is_some_and(|kinetics| kinetics.method == Method::Observed) {
        let why = "first-order with constant rates: transport and reaction commute, exact for any step";
        notes.push(("reaction in a step", why));
    }
    if plan.exchange.is_none() && !averages {
        notes.push(("neighbour search", "no kernel interaction"));
    }
    let mut stages = match (moves, mixes) {
        _ if plan.exchange.is_some() || averages => with_neighbours(plan, is_coupled),
        // Parcels that come and go are no pass over memory: each stage has its own.
        _ if is_tracked && is_coupled => vec![Stage::FusedReact, Stage::Move, Stage::Average],
        _ if is_tracked && reacts => vec![Stage::React, Stage::Move],
        (_, true) if is_tracked => vec![Stage::Mix, Stage::Move, Stage::Average],
        _ if is_tracked => vec![Stage::Move],
        (true, _) if is_coupled => vec![Stage::FusedReact, Stage::FusedStep],
        (false, _) if is_coupled => vec![Stage::FusedReact, Stage::Average],
        (true, _) if reacts => vec![Stage::FusedStep],
        (false, _) if reacts => vec![Stage::React],
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

/// Why a step takes no means of bins, if it does not.
fn of_means(plan: &Plan, mixes: bool, is_coupled: bool) -> Option<&'static str> {
    match &plan.mixing {
        _ if is_coupled || mixes => None,
        None => Some("no mixing zones"),
        Some(_) if plan.has_kernel_mean() => Some("zones exchange with means over the parcels around"),
        Some(_) => Some("no zone with a finite rate: means are taken at outputs only"),
    }
}

fn why_still(plan: &Plan) -> &'static str {
    match plan.exchange {
        None => "neither flow in the frame nor dispersion",
        Some(_) => "no flow in the frame, and all dispersion is exchange",
    }
}

/// Parcels know their neighbours only when all have moved: nothing is joined with what comes after.
fn with_neighbours(plan: &Plan, is_coupled: bool) -> Vec<Stage> {
    let (mixes, reacts) = (exchanges(plan), plan.reacts_in_steps());
    let mut stages = match (mixes, reacts) {
        (true, true) => vec![Stage::FusedReact],
        _ if is_coupled => vec![Stage::FusedReact],
        (true, false) => vec![Stage::Mix],
        (false, true) => vec![Stage::React],
        (false, false) => vec![],
    };
    if plan.moves() {
        stages.push(Stage::Move);
    }
    if plan.moves() && plan.transport.is_none() {
        stages.push(Stage::Bound);
    }
    stages.extend(plan.exchange.as_ref().map(|_| Stage::Exchange));
    stages.extend(plan.has_kernel_mean().then_some(Stage::KernelMean));
    if mixes || is_coupled {
        stages.push(Stage::Average);
    }
    stages
}

/// Whether any zone moves towards the mean of its bin at a finite rate.
fn exchanges(plan: &Plan) -> bool {
    let Some(mixing) = plan.mixing.as_ref().filter(|_| plan.sees_bins()) else { return false };
    mixing.zones.iter().any(|zone| matches!(zone.rate, ZoneRate::Finite(rate) if rate > 0.0))
}
