//! A run that cannot be right stops, and says where.

use crate::support::*;
use lamella::engine::{self, Control, RunError, Settings};
use lamella::plan::tape::{Operation, Tape, Unary};
use lamella::plan::*;

fn failure(plan: &Plan) -> RunError {
    run_with(plan, &Settings::default()).unwrap_err()
}

#[test]
fn an_initial_value_that_is_not_a_number_names_the_particle() {
    let mut plan = front(10_000, 10, 10.0, 1.0);
    plan.components[0].initial =
        Tape { operations: vec![Operation::Input(0), Operation::Unary(Unary::Sqrt, 0)] };
    match failure(&plan) {
        RunError::NonFiniteInitial { component, particle, position } => {
            assert_eq!((component.as_str(), particle), ("A", 0));
            assert!(position[0] < 0.0);
        }
        other => panic!("{other}"),
    }
}

#[test]
fn an_overflow_of_positions_names_the_step() {
    let mut plan = front(10_000, 10, 10.0, 1.0);
    plan.walk.drift[0] = 1e308;
    plan.axes[0].low_side = Side::Open;
    plan.axes[0].high_side = Side::Open;
    assert_eq!(failure(&plan), RunError::NonFinitePosition { step: 2, particle: 0 });
}

/// Every value is a number, the amount of all particles is none.
#[test]
fn an_overflow_of_an_amount_names_the_species() {
    let mut plan = front(1000, 10, 10.0, 1.0);
    plan.outputs = front_outputs(10, vec![5.0], vec![5.0, 10.0]);
    plan.particles.volume = f64::MAX;
    let quantity = plan.species[2].name.clone();
    assert_eq!(failure(&plan), RunError::NonFiniteOutput { t: 5.0, kind: OutputKind::Total, quantity });
}

#[test]
fn plans_that_contradict_themselves_are_refused() {
    let spoil: [fn(&mut Plan); 14] = [
        |plan| plan.axes[0].bins = 0,
        |plan| plan.axes[0].high = f64::NAN,
        |plan| plan.axes[0].low_side = Side::Periodic,
        |plan| plan.axes[0].index = 7,
        |plan| plan.walk.spread.push(1.0),
        |plan| plan.walk.drift[0] = f64::INFINITY,
        |plan| plan.particles.count = 0,
        |plan| plan.particles.volume = 0.0,
        |plan| plan.species[0].terms[0].0 = 3,
        |plan| plan.reactions[0].reactants[0].0 = 9,
        |plan| plan.time.n_steps = 3,
        |plan| plan.outputs[0].bins = vec![2, 2],
        |plan| plan.outputs[0].times = vec![11.0],
        |plan| plan.mixing.as_mut().unwrap().is_well_mixed = true,
    ];
    for (idx, spoil) in spoil.iter().enumerate() {
        let mut plan = front(1000, 10, 10.0, 1.0);
        plan.outputs = front_outputs(10, vec![5.0], vec![10.0]);
        spoil(&mut plan);
        assert!(matches!(failure(&plan), RunError::Plan(_)), "{idx}");
    }
}

/// Cancelled in the third step; a sink that refuses stops the run with its words.
#[test]
fn callers_can_stop_a_run() {
    struct Impatient;
    impl Control for Impatient {
        fn step_done(&self, step: u64, _n_steps: u64) {
            assert!(step <= 3);
            CALLS.store(step, std::sync::atomic::Ordering::Relaxed);
        }
        fn is_cancelled(&self) -> bool {
            CALLS.load(std::sync::atomic::Ordering::Relaxed) == 3
        }
    }
    static CALLS: std::sync::atomic::AtomicU64 = std::sync::atomic::AtomicU64::new(0);
    let mut plan = front(1000, 10, 10.0, 1.0);
    let result = engine::run(&plan, &Settings::default(), &Impatient, &mut |_| Ok(()));
    assert_eq!(result.unwrap_err(), RunError::Cancelled);
    plan.outputs = front_outputs(10, vec![5.0], vec![10.0]);
    let refuse = |_| Err(RunError::Sink("the disk is full".to_owned()));
    let result = engine::run(&plan, &Settings::default(), &engine::Unattended, &mut { refuse });
    assert_eq!(result.unwrap_err().to_string(), "the disk is full");
}
