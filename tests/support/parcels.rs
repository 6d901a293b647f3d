//! Clouds of parcels that exchange, and what became of them.

use lamella::engine::Settings;
use lamella::engine::snapshot::Values;
use lamella::plan::exchange::{Cutoff, Exchange, Integration, Kernel, Normalisation};
use lamella::plan::tape::{Binary, Operation, Tape, Unary};
use lamella::plan::*;

/// A multiple of ℓ.
pub fn times_collocation(factor: f64) -> Tape {
    Tape {
        operations: vec![
            Operation::Input(0),
            Operation::Constant(factor),
            Operation::Binary(Binary::Multiply, 0, 1),
        ],
    }
}

pub fn gaussian(diffusion: Vec<f64>, bandwidth: Tape) -> Exchange {
    Exchange {
        kernel: Kernel::Catalogue("gaussian".to_owned()),
        bandwidth,
        diffusion,
        spreading: None,
        cutoff: Cutoff::Radius(6.0),
        is_compensated: true,
        normalisation: Normalisation::Arithmetic,
        integration: Integration::Explicit,
    }
}

/// `exp(−(x − c)²/(2 v))`
pub fn bell(centre: f64, variance: f64) -> Tape {
    let operations = vec![
        Operation::Input(0),
        Operation::Constant(centre),
        Operation::Binary(Binary::Subtract, 0, 1),
        Operation::Binary(Binary::Multiply, 2, 2),
        Operation::Constant(-0.5 / variance),
        Operation::Binary(Binary::Multiply, 3, 4),
        Operation::Unary(Unary::Exp, 5),
    ];
    Tape { operations }
}

/// The study of methods, section 6.9: [0, 60], D = 1, T = 10, a Gaussian of variance 1 in the middle.
pub fn study(n: u64, dt: f64, exchange: Exchange, walk_share: f64) -> Plan {
    let axes = vec![super::axis(0, 0.0, 60.0, Side::Reflect, 1)];
    let mut plan = super::plain(axes, super::walk(1, walk_share), n, 10.0, dt);
    plan.particles.placement = Placement::Ordered;
    plan.components[0].initial = bell(30.0, 1.0);
    plan.exchange = Some(exchange);
    plan.stages = vec![Stage::Move, Stage::Bound, Stage::Exchange, Stage::Observe];
    plan.outputs = vec![super::all_particles(&plan, vec![10.0])];
    plan
}

pub fn particles(plan: &Plan) -> (Vec<Vec<f64>>, Vec<f64>) {
    let (_, snapshots) = super::run_with(plan, &Settings::default()).unwrap();
    let Values::Particles { positions, concentrations } = &snapshots.last().unwrap().values else {
        panic!("no particles")
    };
    (positions.clone(), concentrations[0].clone())
}

/// Relative error, in the norm of squares, against the Gaussian that a unit of variance 1 has become.
pub fn error(plan: &Plan) -> f64 {
    let (positions, values) = particles(plan);
    let exact = |x: f64| (-(x - 30.0) * (x - 30.0) / 42.0).exp() / 21_f64.sqrt();
    let (mut over, mut under) = (0.0, 0.0);
    for (x, c) in positions[0].iter().zip(&values) {
        over += (c - exact(*x)) * (c - exact(*x));
        under += exact(*x) * exact(*x);
    }
    (over / under).sqrt()
}

/// A box of random parcels that do not walk, with values between 0 and 1 that look random.
pub fn cloud(sides: &[Side], n: u64, exchange: Exchange, dt: f64) -> Plan {
    let axes = sides.iter().enumerate();
    let axes = axes.map(|(idx, &side)| super::axis(idx, -0.5, 1.0 + 0.25 * idx as f64, side, 1)).collect();
    let mut plan = super::plain(axes, super::walk(sides.len(), 0.0), n, dt, dt);
    plan.particles.placement = Placement::Random;
    // 1 + sin(40 x + 23 y + 31 z)
    let mut operations = vec![Operation::Constant(0.0)];
    let mut sum = 0;
    for (axis, factor) in [40.0, 23.0, 31.0].into_iter().enumerate().take(sides.len()) {
        let first = operations.len() as u16;
        operations.push(Operation::Input(axis as u16));
        operations.push(Operation::Constant(factor));
        operations.push(Operation::Binary(Binary::Multiply, first, first + 1));
        operations.push(Operation::Binary(Binary::Add, sum, first + 2));
        sum = first + 3;
    }
    operations.push(Operation::Unary(Unary::Sin, sum));
    operations.push(Operation::Constant(1.0));
    operations.push(Operation::Binary(Binary::Add, sum + 1, sum + 2));
    plan.components[0].initial = Tape { operations };
    plan.exchange = Some(exchange);
    plan.stages = vec![Stage::Exchange, Stage::Observe];
    plan.outputs = vec![super::all_particles(&plan, vec![0.0, dt])];
    plan
}

/// Positions, values before and values after.
pub fn before_and_after(plan: &Plan, settings: &Settings) -> (Vec<Vec<f64>>, Vec<f64>, Vec<f64>) {
    let (_, snapshots) = super::run_with(plan, settings).unwrap();
    let of = |idx: usize| match &snapshots[idx].values {
        Values::Particles { positions, concentrations } => (positions.clone(), concentrations[0].clone()),
        _ => panic!("no particles"),
    };
    let ((positions, before), (_, after)) = (of(0), of(1));
    (positions, before, after)
}

pub fn worst(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()))
}
