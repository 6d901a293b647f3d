//! Scenario to frozen plan: lowering, passes, limits, hash.

use super::cost::{self, Cost};
use super::evaluation::Evaluation;
use super::limits::{self, Limit};
use super::passes::{self, Draft, LeftOut};
use super::time_scales::TimeScales;
use super::{Plan, integrator, lower};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{L010, M005};
use crate::scenario::Scenario;

/// How to compile.
#[derive(Debug, Clone, Default)]
pub struct Options {
    pub passes: Selection,
    /// Bytes that a run may use; `None` leaves memory unchecked.
    pub memory: Option<u64>,
}

/// Which passes run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Selection {
    #[default]
    All,
    /// Those that only drop and fuse: the tables are the same, byte by byte.
    KeepingBytes,
    /// None: everything that the scene says is run as it is said.
    None,
}

impl Selection {
    fn takes(self, pass: &passes::Pass) -> bool {
        match self {
            Selection::All => true,
            Selection::KeepingBytes => pass.keeps_bytes,
            Selection::None => false,
        }
    }
}

/// A frozen plan and what can be told about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Compiled {
    pub plan: Plan,
    pub evaluation: Evaluation,
    /// BLAKE3 of the canonical plan, 64 hexadecimal digits.
    pub hash: String,
    pub left_out: Vec<LeftOut>,
    pub limits: Vec<Limit>,
    pub cost: Cost,
}

/// Compiles a scenario. The plan is absent if a limit refuses it.
pub fn compile(scenario: &Scenario, options: &Options) -> (Option<Compiled>, Vec<Diagnostic>) {
    compile_from(scenario, options, None)
}

/// The plan of a scenario before anything is left out of it or folded.
pub fn before_passes(scenario: &Scenario) -> Option<Plan> {
    lower::lower(scenario).ok().map(|(plan, ..)| plan)
}

/// A change of a plan.
pub type Edit<'e> = &'e dyn Fn(&mut Plan);

/// The same with a change of the plan before anything is decided from it. An edit that leaves numbers
/// which are none is refused.
pub fn compile_edited(
    scenario: &Scenario,
    options: &Options,
    edit: Edit<'_>,
) -> (Option<Compiled>, Vec<Diagnostic>) {
    compile_from(scenario, options, Some(edit))
}

fn compile_from(
    scenario: &Scenario,
    options: &Options,
    edit: Option<Edit<'_>>,
) -> (Option<Compiled>, Vec<Diagnostic>) {
    let (mut plan, evaluation, warnings) = match lower::lower(scenario) {
        Ok(lowered) => lowered,
        Err(problems) => return (None, problems),
    };
    if let Some(edit) = edit {
        edit(&mut plan);
        if let Err(reason) = plan.check() {
            let message = Diagnostic::refused(M005, "a number of the plan is out of range")
                .at(scenario.run.step_span, "with the quantities of this run")
                .found(reason)
                .expected("sizes that numbers can hold");
            return (None, vec![message]);
        }
    }
    let scales = TimeScales::of(&plan);
    let mut draft = Draft { plan, evaluation, left_out: Vec::new() };
    if scenario.exchange.as_ref().is_some_and(|exchange| exchange.mixing_fraction == 0.0) {
        draft.leave_out(
            "exchange between parcels",
            "none of the dispersion is exchange: mixing_fraction is 0",
        );
    }
    if scenario.estimation.is_some() && draft.plan.kernels.is_none() {
        draft.leave_out("kernels of particles with mass", "parcels of fluid carry concentrations");
    }
    if let Err(reason) = draft.plan.check() {
        panic!("lowering made a plan that is not well-formed: {reason}");
    }
    passes::run(&mut draft, |pass| options.passes.takes(pass));
    integrator::choose(&mut draft.plan, scales.as_ref());
    let cost = cost::estimate(&draft.plan, scales.as_ref());
    let (limits, found) = limits::check(scenario, &draft, scales.as_ref(), &cost, options.memory);
    let diagnostics = [warnings, found].concat();
    if crate::diagnostic::any_fatal(&diagnostics) {
        return (None, diagnostics);
    }
    let hash = hash(&draft.plan);
    let Draft { plan, evaluation, left_out } = draft;
    (Some(Compiled { plan, evaluation, hash, left_out, limits, cost }), diagnostics)
}

/// BLAKE3 over the canonical text of a plan: JSON with fields in the order of their definition and
/// numbers in their shortest form that reads back to the same bits.
pub fn hash(plan: &Plan) -> String {
    hash_of(plan).to_hex().to_string()
}

/// The same as bytes.
pub fn hash_of(plan: &Plan) -> blake3::Hash {
    let text = serde_json::to_string(plan).expect("plans hold finite numbers, lists and names only");
    blake3::hash(text.as_bytes())
}

impl Compiled {
    /// What was left out, as one message.
    pub fn left_out_note(&self) -> Diagnostic {
        let list: Vec<String> =
            self.left_out.iter().map(|item| format!("{} ({})", item.what, item.why)).collect();
        Diagnostic::remark(L010, format!("left out of this run: {}", list.join(", ")))
    }
}
