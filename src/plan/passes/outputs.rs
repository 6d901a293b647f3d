//! Outputs that repeat another one, or are never due, are not written twice, or at all.

use super::Draft;
use crate::plan::Output;

pub(super) fn run(draft: &mut Draft) {
    let mut kept: Vec<Output> = Vec::new();
    for output in std::mem::take(&mut draft.plan.outputs) {
        let name = format!("output `{}`", output.kind.word());
        if output.times.is_empty() || output.quantities.is_empty() {
            draft.leave_out(name, "it is never due");
        } else if kept.contains(&output) {
            draft.leave_out(name, "another output is the same");
        } else {
            kept.push(output);
        }
    }
    draft.plan.outputs = kept;
}
