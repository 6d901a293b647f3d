//! Outputs that repeat another one, or are never due, are not written twice, or at all.

use super::Draft;
use crate::plan::Output;
use crate::plan::evaluation::Scalar;

pub(super) fn run(draft: &mut Draft) {
    let mut kept: Vec<Output> = Vec::new();
    let mut places = Vec::new();
    for output in std::mem::take(&mut draft.plan.outputs) {
        let name = format!("output `{}`", output.kind.word());
        let same = kept.iter().position(|other| *other == output);
        if output.times.is_empty() || output.quantities.is_empty() {
            draft.leave_out(name, "it is never due");
            // No output has this number: a measure on it has no value, and says so.
            places.push(usize::MAX);
        } else if let Some(same) = same {
            draft.leave_out(name, "another output is the same");
            places.push(same);
        } else {
            places.push(kept.len());
            kept.push(output);
        }
    }
    draft.plan.outputs = kept;
    for measure in &mut draft.evaluation.measures {
        renumber(&mut measure.value, &places);
    }
}

/// Norms keep the output they are taken on, or its twin.
fn renumber(scalar: &mut Scalar, places: &[usize]) {
    match scalar {
        Scalar::Number(_) | Scalar::Fact(_) | Scalar::Measure(_) => {}
        Scalar::Norm(_, output_idx, _) => *output_idx = places[*output_idx],
        Scalar::Unary(_, a) => renumber(a, places),
        Scalar::Binary(_, a, b) => {
            renumber(a, places);
            renumber(b, places);
        }
    }
}
