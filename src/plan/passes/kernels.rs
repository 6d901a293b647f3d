//! Kernels that nothing is found by.

use super::Draft;
use crate::plan::{OutputKind, Stage};

pub(super) fn run(draft: &mut Draft) {
    let plan = &mut draft.plan;
    let reacts = plan.chemistry.is_some() || !plan.reactions.is_empty();
    let Some(kernels) = &mut plan.kernels else { return };
    if kernels.reacting.is_some() && !reacts {
        kernels.reacting = None;
        plan.stages.retain(|stage| !matches!(stage, Stage::Estimate | Stage::React));
    }
    let shows = kernels.shows;
    let is_read = |kind: OutputKind| match kind {
        OutputKind::Profile | OutputKind::Map => shows,
        _ => kind.is_by_kernels(),
    };
    let is_needed = kernels.reacting.is_some() || plan.outputs.iter().any(|output| is_read(output.kind));
    if !is_needed {
        plan.kernels = None;
        draft.leave_out("kernels", "nothing reacts by them, and no output shows them");
    }
}
