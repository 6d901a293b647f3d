//! What stopped a run, as a message at the line that it comes from.
//!
//! Owns the way from an error of the engine to its code, its place in the scene and what would work instead.
//! May use the scenario, the plan and the engine. It deliberately runs nothing and shows nothing.

use crate::chemistry::Why;
use crate::diagnostic::codes::{F103, R101, R102, R103, R104, R106, R107, R108};
use crate::diagnostic::{Code, Diagnostic, precise};
use crate::engine::RunError;
use crate::plan::chemistry::Integrator;
use crate::plan::limits::{round_down, short};
use crate::plan::time_scales::TimeScales;
use crate::plan::{OutputKind, Plan};
use crate::scenario::{MAX_STEPS, Rate, Reaction, Scenario, Species};
use crate::source::Span;

/// Reactions that one message shows.
const SHOWN: usize = 3;

/// The pace at which a step is given up, against the slowest at which the rest of it may go on.
const MARGIN: f64 = 0.5;

/// The code of a run's error.
pub fn code(error: &RunError) -> Code {
    match error {
        RunError::Cancelled => R101,
        RunError::NonFiniteInitial { .. }
        | RunError::WrongInBin { .. }
        | RunError::NonFinitePosition { .. }
        | RunError::NonFiniteConcentration { .. }
        | RunError::NegativeConcentration { .. }
        | RunError::NonFiniteOutput { .. }
        | RunError::MassLost { .. } => R102,
        RunError::Chemistry { why: Why::TooManySteps { .. }, .. } => R106,
        RunError::Chemistry { .. } => R107,
        RunError::TooManySubSteps { .. } => R106,
        RunError::OutOfMemory { .. } | RunError::Threads(_) => R103,
        RunError::Flow(_) | RunError::Leak { .. } => R108,
        RunError::Plan(_) => R104,
        RunError::Sink(_) => F103,
    }
}

/// The message of a run's error. What the scene has no part in has no place.
pub fn message(error: &RunError, scenario: &Scenario, plan: &Plan) -> Diagnostic {
    let message = Diagnostic::error(code(error), error.to_string());
    let place = Place { scenario, plan };
    match error {
        RunError::NonFiniteInitial { component, .. } => message
            .at(place.initial(component), "no finite number there")
            .help("look for a division by zero, a logarithm of zero or an exponential that is too large"),
        RunError::WrongInBin { component, .. }
        | RunError::NegativeConcentration { step: 0, component, .. } => message
            .at(place.initial(component), "below zero there, or no number")
            .help("`max(…, 0 mol/L)` keeps it from falling below zero"),
        RunError::NonFinitePosition { .. } => message
            .at(place.motion(), "this carries it away")
            .help("use a shorter `step`, or look for a number that is far from the others: `lamella plan` shows all in SI"),
        RunError::NonFiniteConcentration { component, .. } => place
            .reactions_of(message.at(place.species(component), "no number any more"), component)
            .help("look for a number that is far from the others: `lamella plan` shows all in SI"),
        RunError::NegativeConcentration { component, .. } => place
            .reactions_of(message.at(place.species(component), "below zero"), component)
            .help("use a shorter `step`, or a smaller `chemistry tolerance`"),
        RunError::MassLost { component, defect, .. } => {
            let message = place.reactions_of(message.at(place.species(component), "this one"), component);
            if defect.is_finite() {
                return message.help("this is a mistake in Lamella: please report the scene and the seed");
            }
            message.help("concentrations whose sum over all particles is below 1.8e308 in SI work")
        }
        RunError::NonFiniteOutput { kind, quantity, .. } => message
            .at(place.output(*kind, quantity), "too large here")
            .help("concentrations whose sums and products are below 1.8e308 in SI work"),
        RunError::Chemistry { why, .. } => place.chemistry(message, *why),
        RunError::OutOfMemory { .. } => {
            message.at(scenario.particles.count_span, "so many particles").help("use fewer particles")
        }
        RunError::TooManySubSteps { .. } => message
            .at(scenario.run.step_span, "within one step")
            .help("use a shorter `step`, or larger numbers in `step auto(…)`"),
        RunError::Flow(_) => message.at(place.motion(), "this flow").help(
            "bound a `conductivity` that varies by many decades with `max` and `min`; give a random one shorter correlation lengths, or fewer cells in `grid`",
        ),
        RunError::Leak { side, .. } => message.at(place.side(*side), "nothing says what this water carries").help(
            "parcels of water go with it: let the side be `inflow` (alone for clean water), `concentration`, or `outflow` where it only goes out",
        ),
        RunError::Cancelled => message.note("no table was written; the same scene gives the same bytes again"),
        RunError::Plan(_) | RunError::Threads(_) | RunError::Sink(_) => message,
    }
}

/// Where things of a plan stand in its scene.
struct Place<'a> {
    scenario: &'a Scenario,
    plan: &'a Plan,
}

impl Place<'_> {
    fn named(&self, name: &str) -> Option<&Species> {
        self.scenario.species.iter().find(|species| species.name == name)
    }

    fn side(&self, side: usize) -> Span {
        let axis = self.scenario.domain.axes.get(side / 2);
        axis.map_or(self.scenario.domain.span, |axis| [axis.low_side_span, axis.high_side_span][side % 2])
    }

    fn species(&self, name: &str) -> Span {
        self.named(name).map_or(self.scenario.run.span, |species| species.span)
    }

    fn initial(&self, name: &str) -> Span {
        self.named(name).map_or(self.scenario.run.span, |species| species.initial.span)
    }

    fn motion(&self) -> Span {
        let (flow, dispersion) = (&self.scenario.flow, &self.scenario.dispersion);
        let flow = flow.as_ref().map(|flow| flow.span);
        flow.or(dispersion.as_ref().map(|spread| spread.span)).unwrap_or(self.scenario.run.step_span)
    }

    /// The output of a kind that lists a species or a pair.
    fn output(&self, kind: OutputKind, quantity: &str) -> Span {
        let of_kind = || self.scenario.outputs.iter().filter(move |output| output.kind == kind);
        let name = |idx: usize| self.scenario.species.get(idx).map_or("", |species| species.name.as_str());
        let lists = |output: &&crate::scenario::Output| {
            quantity.split(", ").all(|part| output.species.iter().any(|&idx| name(idx) == part))
        };
        let found = of_kind().find(lists).or_else(|| of_kind().next());
        found.map_or(self.scenario.run.span, |output| output.span)
    }

    /// Reactions at finite rates that change a component of the plan, as they are written.
    fn changing(&self, component: usize) -> Vec<&Reaction> {
        let kinetics = self.plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
        let all = kinetics.iter().flat_map(|kinetics| &kinetics.reactions);
        let own =
            all.filter(|reaction| reaction.changes.iter().any(|&(idx, nu)| idx == component && nu != 0.0));
        let mut found: Vec<&Reaction> = Vec::new();
        for written in own.filter_map(|reaction| self.scenario.reaction(&reaction.name)) {
            if !found.iter().any(|other| other.span == written.span) {
                found.push(written);
            }
        }
        found
    }

    /// Shows the reactions of a component beside its own place.
    fn reactions_of(&self, message: Diagnostic, name: &str) -> Diagnostic {
        let component = self.plan.components.iter().position(|component| component.name == name);
        let reactions = component.map(|component| self.changing(component)).unwrap_or_default();
        let also = |message: Diagnostic, reaction: &&Reaction| {
            message.also(reaction.span, "changed by this reaction")
        };
        reactions.iter().take(SHOWN).fold(message, also)
    }

    fn chemistry(&self, message: Diagnostic, why: Why) -> Diagnostic {
        match why {
            Why::TooManySteps { tried, share, .. } => self.too_many(message, tried, share),
            Why::StepTooSmall { component, t, .. } => {
                let message = self.at_rates(message, component, "changes it too fast to be followed");
                let name = self.component(component);
                message
                    .help(format!("use a larger `chemistry tolerance`, or a `floor` below which `{name}` is none"))
                    .help(format!("if `{name}` grows without bound, the run has to end before {} s", precise(t)))
            }
            Why::NotFinite { component, .. } => self
                .at_rates(message, component, "no finite number at what the run has come to")
                .help("look for a division by what may be zero, for a root or a logarithm of what may be negative, for a negative order, and for numbers far from the others"),
            Why::Negative { component, .. } => self
                .at_rates(message, component, "takes more than there is")
                .help("use a smaller `chemistry tolerance`"),
            Why::Impossible => self
                .at_equilibria(message, "in equilibrium with what the particle carries")
                .help("initial concentrations from which the reactions can go one way or the other work: no total may be below what its species can take"),
            Why::Endless => self
                .at_equilibria(message, "in equilibrium with what the particle carries")
                .help("some minerals dissolve to the same species as others, and their constants do not go together: take one of them out, or make its constant larger"),
            Why::NoEquilibrium { .. } => self
                .at_equilibria(message, "in equilibrium with what the particle carries")
                .help("use equilibrium constants and concentrations that lie nearer to each other"),
            Why::TooSalty { .. } => {
                let message = match self.scenario.chemistry.span {
                    Some(span) => message.at(span, "the activities are chosen here"),
                    None => self.at_equilibria(message, "in equilibrium"),
                };
                message.help("write `activity ideal`, or use smaller concentrations of ions")
            }
        }
    }

    fn component(&self, idx: usize) -> &str {
        self.plan.components.get(idx).map_or("?", |component| &component.name)
    }

    /// Points at the rates that change a component.
    fn at_rates(&self, message: Diagnostic, component: usize, text: &str) -> Diagnostic {
        let reactions = self.changing(component);
        let Some((first, others)) = reactions.split_first() else {
            return message.at(self.species(self.component(component)), text);
        };
        let message = message.at(first.rate_span, text);
        others
            .iter()
            .take(SHOWN - 1)
            .fold(message, |message, other| message.also(other.rate_span, "or this one"))
    }

    fn at_equilibria(&self, message: Diagnostic, text: &str) -> Diagnostic {
        let mut found =
            self.scenario.reactions.iter().filter(|reaction| matches!(reaction.rate, Rate::Equilibrium(_)));
        let Some(first) = found.next() else { return message.at(self.scenario.run.span, text) };
        found
            .take(SHOWN - 1)
            .fold(message.at(first.span, text), |message, other| message.also(other.span, "and this one"))
    }

    /// A step that is as short as what was done of this one, with a margin, needs no more sub-steps than one
    /// step may take, as long as they do not get shorter still.
    fn too_many(&self, message: Diagnostic, tried: u32, share: f64) -> Diagnostic {
        let time = &self.plan.time;
        let step = time.step.min(time.duration);
        let mut message = message
            .at(self.scenario.run.step_span, format!("{} of this step is done", percent(share)))
            .found(format!("{tried} sub-steps for {} s", short(share * step)))
            .expected(format!("at most {tried} for a step of {} s", short(step)));
        if let Some(scales) = TimeScales::of(self.plan) {
            let name = self
                .plan
                .chemistry
                .as_ref()
                .and_then(|c| c.kinetics.as_ref())
                .map(|k| &k.reactions[scales.fastest].name);
            if let Some(reaction) = name.and_then(|name| self.scenario.reaction(name)) {
                let text = format!("the fastest reaction: 1/k = {} s", short(1.0 / scales.fastest_rate()));
                message = message.also(reaction.span, text);
            }
        }
        let asked = self.plan.chemistry.as_ref().map(|chemistry| chemistry.integrator);
        if asked == Some(Integrator::Explicit) {
            message = message.help(
                "write `chemistry integrator rosenbrock`, or leave it to `auto`: what is stiff takes an explicit integrator ever more sub-steps",
            );
        }
        let needed = MARGIN * share * step;
        let n_steps = time.duration / needed;
        if n_steps <= MAX_STEPS {
            message = message.help(format!(
                "use `step {}` or less: about {} steps",
                round_down(needed),
                short(n_steps.ceil())
            ));
        } else {
            message = message.help("no step is short enough: use slower reactions, or a shorter run");
        }
        message.help("a larger `chemistry tolerance` needs fewer sub-steps")
    }
}

fn percent(share: f64) -> String {
    format!("{} %", short(100.0 * share))
}
