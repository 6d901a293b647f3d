//! Whether the transport of a plan is well-formed.

use super::Plan;
use super::check::{check_tape, require};
use super::tape::Tape;
use super::transport::{
    Changed, Conductivity, Darcy, Decay, Dispersion, Flow, FlowFacts, Patch, Region, SideRule, Source,
    Strength, Transport, Turn,
};

impl Plan {
    pub(super) fn check_transport(&self) -> Result<(), String> {
        let Some(transport) = &self.transport else { return Ok(()) };
        let n_axes = self.axes.len();
        check_flow(&transport.flow, n_axes)?;
        check_changes(transport, n_axes)?;
        check_dispersion(&transport.dispersion, n_axes)?;
        tape(&transport.porosity, "the porosity")?;
        require(transport.sides.len() == n_axes, || "an axis has no sides of transport".into())?;
        for patches in transport.sides.iter().flatten() {
            require(!patches.is_empty(), || "a side has no rule".into())?;
            patches.iter().try_for_each(|patch| self.check_patch(patch))?;
        }
        transport.sources.iter().try_for_each(|source| self.check_source(source))?;
        self.check_populations(transport)?;
        let is_right = transport.interfaces.iter().all(|it| it.axis < n_axes && it.at.is_finite());
        require(is_right, || "an interface lies on no axis".into())?;
        let is_right = transport.order.as_ref().is_none_or(|order| {
            let n = order.tiles.iter().try_fold(1_usize, |n, &along| n.checked_mul(along));
            order.tiles.len() == n_axes && n.is_some_and(|n| (1..=usize::from(u16::MAX)).contains(&n))
        });
        require(is_right, || "tiles do not fit the axes".into())?;
        let criteria = transport.sub_steps.map_or([1.0; 2], |sub| [sub.courant, sub.dispersion]);
        require(criteria.iter().all(|c| *c > 0.0 && c.is_finite()), || {
            "a criterion of sub-steps is none".into()
        })
    }

    fn check_patch(&self, patch: &Patch) -> Result<(), String> {
        let n_axes = self.axes.len();
        require(patch.low.len() == n_axes && patch.high.len() == n_axes, || {
            "a part of a side has limits of other axes".into()
        })?;
        match &patch.rule {
            SideRule::Inflow(tapes) | SideRule::Held(tapes) => {
                let n = if self.carries_mass() { self.species.len() } else { self.components.len() };
                require(tapes.len() == n, || "a side carries other species".into())?;
                tapes.iter().try_for_each(|it| tape(it, "a side"))
            }
            SideRule::Partial(rate) => {
                require(*rate >= 0.0 && rate.is_finite(), || "a side absorbs at no rate".into())
            }
            _ => Ok(()),
        }
    }

    fn check_source(&self, source: &Source) -> Result<(), String> {
        let n_axes = self.axes.len();
        let wrong = || format!("source `{}` is not well-formed", source.name);
        let is_right = match &source.region {
            Region::Point(at) => at.len() == n_axes,
            Region::Line(a, b) | Region::Box(a, b) | Region::Gaussian(a, b) => {
                a.len() == n_axes && b.len() == n_axes
            }
            Region::Table(cloud) => cloud.n_axes() == n_axes,
        };
        require(is_right && source.species < self.species.len(), wrong)?;
        let value = match &source.strength {
            Strength::Pulse(value) | Strength::Rate(value) | Strength::Held(value) => *value,
            Strength::RateInTime(it) | Strength::HeldInTime(it) => {
                tape(it, "a source")?;
                0.0
            }
        };
        let (from, to) = source.during;
        let is_right = value.is_finite() && value >= 0.0 && from.is_finite() && from <= to;
        require(is_right, wrong)
    }

    fn check_populations(&self, transport: &Transport) -> Result<(), String> {
        let is_right = !transport.is_of_fluid || transport.populations.is_empty();
        require(is_right, || "fluid has no populations".into())?;
        for population in &transport.populations {
            let wrong = || "a population is not well-formed".to_owned();
            require(population.species < self.species.len() && population.count >= 1, wrong)?;
            require(population.retardation >= 1.0 && population.retardation.is_finite(), wrong)?;
            require(population.molecular.is_none_or(|d| d >= 0.0 && d.is_finite()), wrong)?;
            tape(&population.initial, "an initial concentration")?;
        }
        transport.decay.as_ref().map_or(Ok(()), |decay| check_decay(decay, transport.populations.len()))
    }
}

fn check_decay(decay: &Decay, n: usize) -> Result<(), String> {
    let is_weight = |weight: &f64| *weight > 0.0 && weight.is_finite();
    require(decay.weights.len() == n && decay.weights.iter().all(is_weight), || {
        "a population has no weight".into()
    })?;
    let is_right = |turn: &Turn| {
        let chances: f64 = turn.outcomes.iter().map(|(_, chance)| chance).sum();
        turn.population < n
            && turn.rate >= 0.0
            && turn.rate.is_finite()
            && turn.outcomes.iter().all(|(to, chance)| *to < n && *chance >= 0.0)
            && chances <= 1.0 + 1e-12
    };
    match decay.reactions.iter().find(|turn| !is_right(turn)) {
        Some(turn) => Err(format!("reaction `{}` is not well-formed", turn.name)),
        None => Ok(()),
    }
}

fn tape(of: &Tape, what: &str) -> Result<(), String> {
    check_tape(of).map_err(|reason| format!("{what}: {reason}"))
}

fn check_flow(flow: &Flow, n_axes: usize) -> Result<(), String> {
    match flow {
        Flow::Uniform(velocity) => {
            let is_right = velocity.len() == n_axes && velocity.iter().all(|v| v.is_finite());
            require(is_right, || "a velocity does not fit the axes".into())
        }
        Flow::Expression(tapes) => {
            require(tapes.len() == n_axes, || "a velocity does not fit the axes".into())?;
            tapes.iter().try_for_each(|it| tape(it, "the velocity"))
        }
        Flow::Darcy(darcy) => check_darcy(darcy, n_axes),
        Flow::File(flow) => {
            let FlowFacts { cells, speed, .. } = &flow.facts;
            let is_right = cells.len() == n_axes && cells.iter().all(|n| *n >= 1);
            require(is_right && speed.is_finite() && *speed >= 0.0, || {
                "a flow from files does not fit the axes".into()
            })
        }
    }
}

/// New flows are of the kind of the first, in rising order of time.
fn check_changes(transport: &Transport, n_axes: usize) -> Result<(), String> {
    let starts = transport.starts();
    let is_rising = starts.windows(2).all(|pair| pair[0] < pair[1]) && starts.iter().all(|t| t.is_finite());
    require(is_rising, || "new flows do not follow one another".into())?;
    for change in &transport.changes {
        let is_right = match (&change.flow, &transport.flow) {
            (Changed::Uniform(_) | Changed::Expression(_), Flow::Uniform(_) | Flow::Expression(_)) => true,
            (Changed::Darcy { sides, rates }, Flow::Darcy(darcy)) => {
                sides.len() == darcy.sides.len() && rates.len() == darcy.wells.len()
            }
            _ => false,
        };
        require(is_right, || "a new flow is of another kind than the first".into())?;
    }
    transport.flows().iter().skip(1).try_for_each(|flow| check_flow(flow, n_axes))
}

fn check_darcy(darcy: &Darcy, n_axes: usize) -> Result<(), String> {
    let lengths = [darcy.cells.len(), darcy.sides.len(), darcy.anisotropy.len()];
    require(lengths == [n_axes; 3], || "a Darcy flow does not fit the axes".into())?;
    require(darcy.cells.iter().all(|n| *n >= 1), || "a Darcy flow has no cells".into())?;
    let wells = darcy.wells.iter().all(|well| well.low.len() == n_axes && well.high.len() == n_axes);
    require(wells, || "a well does not fit the axes".into())?;
    darcy.wells.iter().flat_map(|well| &well.carrying).try_for_each(|it| tape(it, "a well"))?;
    match &darcy.conductivity {
        Conductivity::Expression(it) => tape(it, "the conductivity"),
        Conductivity::Lognormal { lengths, .. } => {
            require(lengths.len() == n_axes, || "a random field does not fit the axes".into())
        }
    }
}

pub(super) fn check_dispersion(dispersion: &Dispersion, n_axes: usize) -> Result<(), String> {
    match dispersion {
        Dispersion::Constant(triangle) => {
            let is_right =
                triangle.len() == n_axes * (n_axes + 1) / 2 && triangle.iter().all(|d| d.is_finite());
            require(is_right, || "the dispersion does not fit the axes".into())
        }
        Dispersion::Isotropic(it) => tape(it, "the dispersion"),
        Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular } => {
            let all = [longitudinal, transverse, transverse_vertical, molecular];
            require(all.iter().all(|d| **d >= 0.0 && d.is_finite()), || "the dispersion is negative".into())
        }
    }
}
