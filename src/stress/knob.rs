//! What is turned in a stress test, and by how much.
//!
//! Owns the changes of a plan. May use the plan. It deliberately leaves the text of the scene alone: what
//! is refused is refused at the lines as they stand.

use crate::plan::Plan;
use crate::plan::compile::before_passes;
use crate::plan::tape::{Binary, Operation, Register};
use crate::plan::transport::Transport;
use crate::plan::{Time, ZoneRate, chemistry};
use crate::scenario::Scenario;

/// A quantity of a scene that is multiplied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Knob {
    /// All rates of reactions.
    Rates,
    /// All initial concentrations.
    Concentrations,
    /// Half-saturation constants: K in `c / (K + c)` and the like.
    HalfSaturation,
    /// Equilibrium constants.
    Equilibrium,
    /// Advection against dispersion: the dispersion is divided.
    Peclet,
    /// Reaction against transport: flow, dispersion and exchange are divided.
    Damkohler,
    /// The step.
    Step,
    /// The bandwidth of an exchange.
    Bandwidth,
    /// The dispersion by exchange, and with it the share of a step; what walks stays.
    Exchange,
}

impl Knob {
    pub const ALL: [Self; 9] = [
        Self::Rates,
        Self::Concentrations,
        Self::HalfSaturation,
        Self::Equilibrium,
        Self::Peclet,
        Self::Damkohler,
        Self::Step,
        Self::Bandwidth,
        Self::Exchange,
    ];

    /// As it is written on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rates => "rates",
            Self::Concentrations => "concentrations",
            Self::HalfSaturation => "half_saturation",
            Self::Equilibrium => "equilibrium",
            Self::Peclet => "peclet",
            Self::Damkohler => "damkohler",
            Self::Step => "step",
            Self::Bandwidth => "bandwidth",
            Self::Exchange => "exchange",
        }
    }

    /// All that a scene has. What a pass folds into constants is turned before it is folded, so the plan is
    /// looked at as it was lowered.
    pub fn of(scenario: &Scenario) -> Vec<Self> {
        let Some(plan) = before_passes(scenario) else { return Vec::new() };
        Self::ALL.into_iter().filter(|knob| knob.is_in(&plan)).collect()
    }

    /// Whether the plan has anything to turn.
    fn is_in(self, plan: &Plan) -> bool {
        let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
        let equilibrium = plan.chemistry.as_ref().and_then(|chemistry| chemistry.equilibrium.as_ref());
        let is_moving = plan.exchange.is_some() || plan.moves();
        match self {
            Self::Rates => kinetics.is_some() || plan.transport.iter().any(|it| it.decay.is_some()),
            Self::Concentrations => !plan.components.is_empty(),
            Self::HalfSaturation => {
                kinetics.is_some_and(|kinetics| !half_saturations(&kinetics.laws.operations).is_empty())
            }
            Self::Equilibrium => equilibrium.is_some(),
            Self::Peclet => plan.exchange.is_some() || plan.walk.spread.iter().any(|entry| *entry != 0.0),
            Self::Damkohler => {
                (kinetics.is_some() || equilibrium.is_some()) && (is_moving || exchanges(plan))
            }
            Self::Step => true,
            Self::Bandwidth | Self::Exchange => plan.exchange.is_some(),
        }
    }

    /// Multiplies the quantity in a plan that was lowered and not yet passed on.
    pub fn turn(self, plan: &mut Plan, factor: f64) {
        match self {
            Self::Rates => multiply_rates(plan, factor),
            Self::Concentrations => {
                plan.components.iter_mut().for_each(|component| component.initial.scale(factor));
                let transport = plan.transport.iter_mut();
                transport.flat_map(Transport::carried_mut).for_each(|tape| tape.scale(factor));
                if let Some(chemistry) = &mut plan.chemistry {
                    chemistry.floors.iter_mut().for_each(|floor| *floor *= factor);
                }
            }
            Self::HalfSaturation => multiply_half_saturations(plan, factor),
            Self::Equilibrium => {
                let equilibrium =
                    plan.chemistry.as_mut().and_then(|chemistry| chemistry.equilibrium.as_mut());
                let Some(equilibrium) = equilibrium else { return };
                let shift = crate::maths::scalar::ln(factor);
                equilibrium.secondaries.iter_mut().for_each(|secondary| secondary.ln_constant += shift);
                equilibrium.minerals.iter_mut().for_each(|mineral| mineral.ln_solubility += shift);
            }
            Self::Peclet => {
                let root = factor.sqrt();
                plan.walk.spread.iter_mut().for_each(|entry| *entry /= root);
                divide_exchange(plan, factor);
            }
            Self::Damkohler => {
                let root = factor.sqrt();
                plan.walk.drift.iter_mut().for_each(|entry| *entry /= factor);
                plan.walk.spread.iter_mut().for_each(|entry| *entry /= root);
                divide_exchange(plan, factor);
                for zone in plan.mixing.iter_mut().flat_map(|mixing| &mut mixing.zones) {
                    if let ZoneRate::Finite(rate) = &mut zone.rate {
                        *rate /= factor;
                    }
                }
            }
            Self::Step => {
                let duration = plan.time.duration;
                plan.time = Time::new(duration, (plan.time.step * factor).min(duration));
            }
            Self::Bandwidth => {
                plan.exchange.iter_mut().for_each(|exchange| exchange.bandwidth.scale(factor));
            }
            Self::Exchange => divide_exchange(plan, 1.0 / factor),
        }
    }
}

fn exchanges(plan: &Plan) -> bool {
    let mut zones = plan.mixing.iter().flat_map(|mixing| &mixing.zones);
    zones.any(|zone| matches!(zone.rate, ZoneRate::Finite(rate) if rate > 0.0))
}

fn divide_exchange(plan: &mut Plan, factor: f64) {
    let n_axes = plan.axes.len();
    let Some(exchange) = &mut plan.exchange else { return };
    exchange.diffusion.iter_mut().for_each(|entry| *entry /= factor);
    exchange.spreading = exchange.spreading.take().map(|spreading| spreading.times(1.0 / factor, n_axes));
}

fn multiply_rates(plan: &mut Plan, factor: f64) {
    let decay = plan.transport.iter_mut().flat_map(|transport| &mut transport.decay);
    for turn in decay.flat_map(|decay| &mut decay.reactions) {
        turn.rate = (turn.rate * factor).min(f64::MAX);
    }
    let Some(kinetics) = plan.chemistry.as_mut().and_then(|chemistry| chemistry.kinetics.as_mut()) else {
        return;
    };
    let operations = &mut kinetics.laws.operations;
    let multiplier = operations.len() as Register;
    operations.push(Operation::Constant(factor));
    for rate in &mut kinetics.laws.rates {
        let result = operations.len() as Register;
        operations.push(Operation::Binary(Binary::Multiply, *rate, multiplier));
        *rate = result;
    }
    for reaction in &mut kinetics.reactions {
        match &mut reaction.law {
            chemistry::Law::MassAction { constant, .. } => *constant *= factor,
            chemistry::Law::Saturation { maximum, .. } => *maximum *= factor,
            chemistry::Law::Expression => {}
        }
    }
}

/// Constants that are added to something in a denominator.
fn half_saturations(operations: &[Operation]) -> Vec<usize> {
    let is_constant =
        |register: Register| matches!(operations[usize::from(register)], Operation::Constant(_));
    let mut found = Vec::new();
    for operation in operations {
        let Operation::Binary(Binary::Divide, _, below) = *operation else { continue };
        let Operation::Binary(Binary::Add, a, b) = operations[usize::from(below)] else { continue };
        let own = [a, b].into_iter().filter(|&register| is_constant(register)).map(usize::from);
        found.extend(own.filter(|&register| match operations[register] {
            Operation::Constant(value) => value > 0.0,
            _ => false,
        }));
    }
    found.sort_unstable();
    found.dedup();
    found
}

fn multiply_half_saturations(plan: &mut Plan, factor: f64) {
    let Some(kinetics) = plan.chemistry.as_mut().and_then(|chemistry| chemistry.kinetics.as_mut()) else {
        return;
    };
    for register in half_saturations(&kinetics.laws.operations) {
        if let Operation::Constant(value) = &mut kinetics.laws.operations[register] {
            *value *= factor;
        }
    }
    for reaction in &mut kinetics.reactions {
        if let chemistry::Law::Saturation { half, .. } = &mut reaction.law {
            *half *= factor;
        }
    }
}
