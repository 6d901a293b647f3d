//! What a scene leaves out of its medium, or gives its flow without being able to show it.
//!
//! Owns these warnings (M001, N113). May use `scenario` for the places. It deliberately refuses nothing: both may be meant.

use super::Plan;
use super::limits::axis_name;
use crate::diagnostic::codes::{M001, N113};
use crate::diagnostic::{Diagnostic, number};
use crate::scenario::Scenario;
use crate::scenario::transport::flow_file::FileForm;
use crate::scenario::transport::{Conductivity, Darcy, Flow};

/// Warns of a porosity that nobody gave, and of random fields that are finer than their cells.
pub(super) fn check(scenario: &Scenario, plan: &Plan) -> Vec<Diagnostic> {
    let darcy = match scenario.flow.as_ref().map(|flow| &flow.value) {
        Some(Flow::Darcy(darcy)) => Some(&**darcy),
        _ => None,
    };
    porosity(scenario).into_iter().chain(darcy.and_then(|darcy| too_fine(darcy, plan))).collect()
}

/// Discharge is turned into velocity by the porosity, which is 1 where nobody says another one.
fn porosity(scenario: &Scenario) -> Option<Diagnostic> {
    let flow = scenario.flow.as_ref().filter(|_| scenario.medium.is_none())?;
    let needs_it = match &flow.value {
        Flow::Uniform(_) | Flow::Expression(..) => false,
        Flow::Darcy(_) => true,
        Flow::File(file) => match &file.file.form {
            FileForm::Table(form) => form.is_discharge && form.porosity.is_none(),
            FileForm::Arrays(form) => form.is_discharge,
            FileForm::Modflow(_) => true,
        },
    };
    if !needs_it {
        return None;
    }
    let message = Diagnostic::warning(M001, "nothing says how much of the medium is pores")
        .at(flow.span, "what flows through the medium is taken for the velocity of the water")
        .found("no `medium`: a porosity of 1")
        .expected("a porosity")
        .help(
            "add for example `medium porosity 0.3`; `medium porosity 1` says that there is nothing but water",
        );
    Some(message)
}

fn too_fine(darcy: &Darcy, plan: &Plan) -> Option<Diagnostic> {
    let Conductivity::Lognormal { lengths, variance, .. } = &darcy.conductivity else { return None };
    let widths =
        plan.axes.iter().zip(&darcy.cells).map(|(axis, &n)| (axis.high - axis.low) / n.max(1) as f64);
    let mut all = widths.zip(lengths).enumerate();
    let (axis, (width, length)) = all.find(|(_, (width, length))| *length < width && *variance > 0.0)?;
    let name = axis_name(plan.axes[axis].index);
    let n = ((plan.axes[axis].high - plan.axes[axis].low) / length).ceil();
    let message =
        Diagnostic::warning(N113, "the cells of the flow are larger than what the random field varies over")
            .at(
                darcy.conductivity_span,
                format!("a correlation length of {} m along {name}", number(*length)),
            )
            .also(darcy.cells_span, format!("cells of {} m along {name}", number(width)))
            .found(format!("{} of a cell", number(length / width)))
            .expected("a correlation length of several cells")
            .help(format!("write {} cells or more along {name}, or a longer correlation length", number(n)));
    Some(message)
}
