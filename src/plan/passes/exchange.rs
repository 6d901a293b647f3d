//! An exchange of nothing goes: where all concentrations are the same everywhere, parcels have nothing to exchange.

use super::Draft;
use crate::plan::Stage;

pub(super) fn run(draft: &mut Draft) {
    let carries = draft.plan.components.iter().any(|component| !component.is_immobile);
    if carries {
        return;
    }
    if draft.plan.exchange.take().is_some() {
        draft.plan.stages.retain(|stage| *stage != Stage::Exchange);
        draft.leave_out("exchange between parcels", "they carry nothing that differs from place to place");
    }
    if draft.plan.has_kernel_mean() {
        draft.plan.mixing = None;
        draft.plan.stages.retain(|stage| *stage != Stage::KernelMean);
        draft.leave_out(
            "means over the parcels around",
            "they carry nothing that differs from place to place",
        );
    }
}
