//! Stops in the middle of a run. No plan that is accepted leads to them, so the state is spoilt by hand
//! between two steps.

use super::*;
use crate::plan::tape::{Operation, Tape};
use crate::plan::{Compiled, Options, Stage, Time};
use crate::scenario;
use crate::source::Sources;
use crate::state::particles::BLOCK;

/// Two conservative fields in two zones that relax, on several blocks; every step is one fused pass
/// unless the stages are changed.
const SCENE: &str = "lamella 1
species A, B
domain line x = 0 m .. 1 m
boundary left, right reflect
flow uniform 0 m/s
dispersion 1e-4 m^2/s
mixing zones {
  fast: fraction 0.5, rate instant
  slow: fraction 0.3, rate 0.1 /s
  slower: fraction 0.2, rate 0.01 /s
}
average bins 10
initial A = if x < 0.5 m then 2 mol/m^3 else 1 mol/m^3
initial B = if x < 0.25 m then 0 mol/m^3 else 4 mol/m^3
particles fluid 20_000
run to 10 s, step 1 s
seed 1
output total A, B every 10 s
";

fn compiled() -> Compiled {
    let sources = Sources::single("scene.lam", SCENE);
    let checked = crate::check(sources, &scenario::Settings::default(), &Options::default());
    checked.compiled.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics))
}

/// The particle that is spoilt: not in the first block, chunk or place.
const PARTICLE: u64 = 2 * BLOCK as u64 + 1234;

/// Four good steps, the spoiling, and what the fifth says. The fields are `A` and `B`, two columns each.
fn fifth_step(plan: &Plan, spoil: fn(&mut Block<1>, usize)) -> Result<(), RunError> {
    let mut run = Run::<1>::new(plan, &Settings::default(), &mut Vec::new())?;
    assert_eq!((run.program.n_components(), run.program.n_columns()), (2, 4));
    for step in 0..4 {
        run.step(step)?;
    }
    spoil(&mut run.blocks[(PARTICLE / BLOCK as u64) as usize], (PARTICLE % BLOCK as u64) as usize);
    run.step(4)
}

#[test]
fn a_run_that_nobody_spoils_goes_on() {
    assert_eq!(fifth_step(&compiled().plan, |_, _| {}), Ok(()));
}

#[test]
fn a_position_that_is_no_number_names_step_and_particle() {
    let error = fifth_step(&compiled().plan, |block, idx| block.positions[0][idx] = f64::NAN).unwrap_err();
    assert_eq!(error, RunError::NonFinitePosition { step: 5, particle: PARTICLE });
    assert_eq!(
        error.to_string(),
        format!("step 5: the position of particle {PARTICLE} is not a finite number")
    );
}

/// The bin's mean is no number then, and with it soon all particles of the bin: the step that meets the
/// first one names it before it spreads.
#[test]
fn a_concentration_that_is_no_number_names_step_particle_and_species() {
    let spoilt: [fn(&mut Block<1>, usize); 2] =
        [|block, idx| block.columns[3][idx] = f64::NAN, |block, idx| block.columns[3][idx] = f64::INFINITY];
    for spoil in spoilt {
        let error = fifth_step(&compiled().plan, spoil).unwrap_err();
        let component = "B".to_owned();
        assert_eq!(error, RunError::NonFiniteConcentration { step: 5, particle: PARTICLE, component });
        let expected = format!("step 5: `B` of particle {PARTICLE} is not a finite number");
        assert_eq!(error.to_string(), expected);
    }
}

/// What a fused pass relaxes belongs to the step before; with a pass of its own it is the fifth step.
#[test]
fn a_negative_concentration_names_step_particle_and_species() {
    // Another particle gets what this one loses: no mass is lost.
    let spoil = |block: &mut Block<1>, idx: usize| {
        let column = &mut block.columns[1];
        column[idx + 1] += column[idx] + 5.0;
        column[idx] = -5.0;
    };
    let mut plan = compiled().plan;
    assert!(plan.stages.contains(&Stage::FusedStep));
    let separate = vec![Stage::Move, Stage::Bound, Stage::Average, Stage::Mix, Stage::Observe];
    for (stages, expected) in [(plan.stages.clone(), 4), (separate, 5)] {
        plan.stages = stages;
        match fifth_step(&plan, spoil).unwrap_err() {
            RunError::NegativeConcentration { step, particle, component, value } => {
                assert_eq!((step, particle, component.as_str()), (expected, PARTICLE, "A"));
                assert!((-5.0..-4.0).contains(&value), "relaxed for one step: {value}");
            }
            other => panic!("{other}"),
        }
    }
}

/// The amount of `B` in its second zone is 6 · 10⁴, counted in particles; a change of 1e-9 of it is allowed.
#[test]
fn lost_mass_names_step_and_species() {
    let plan = compiled().plan;
    let spoilt: [fn(&mut Block<1>, usize); 2] =
        [|block, idx| block.columns[3][idx] += 1.2e-4, |block, idx| block.columns[3][idx] -= 1.2e-4];
    for spoil in spoilt {
        match fifth_step(&plan, spoil).unwrap_err() {
            RunError::MassLost { step, component, defect } => {
                assert_eq!((step, component.as_str()), (5, "B"));
                assert!((defect / 2e-9 - 1.0).abs() < 0.01, "{defect}");
            }
            other => panic!("{other}"),
        }
    }
    assert_eq!(fifth_step(&plan, |block, idx| block.columns[3][idx] += 3e-5), Ok(()));
}

/// A run that ends between two averages tells the defect in its outcome.
#[test]
fn the_defect_at_the_end_is_told() {
    let plan = compiled().plan;
    let mut run = Run::<1>::new(&plan, &Settings::default(), &mut Vec::new()).unwrap();
    (0..4).for_each(|step| run.step(step).unwrap());
    let defects = run.finish().unwrap();
    assert!(defects.iter().all(|&defect| defect < 1e-13), "{defects:?}");
    run.blocks[0].columns[0][7] += 0.3;
    let defects = run.finish().unwrap();
    assert!((defects[0] / 1e-5 - 1.0).abs() < 0.01 && defects[1] < 1e-13, "{defects:?}");
}

/// Values near the end of the range of numbers are finite, and their sum is not.
#[test]
fn an_amount_beyond_the_range_of_numbers_names_the_species() {
    let mut plan = compiled().plan;
    plan.components[1].initial = Tape { operations: vec![Operation::Constant(1e306)] };
    let mut run = Run::<1>::new(&plan, &Settings::default(), &mut Vec::new()).unwrap();
    let error = run.step(0).unwrap_err();
    assert_eq!(error.to_string(), "step 1: the amount of `B` is not a finite number");
}

/// The last step is then longer than the others by all that rounding has left.
#[test]
fn durations_that_are_multiples_up_to_rounding_can_run() {
    for (duration, step) in
        [(10.0, 1.0 - 5e-10), (3_456_000.0, 172_800.0 * 1e-6), (360_000.0, 18_000.0 * 1e-6)]
    {
        let mut plan = compiled().plan;
        plan.outputs.clear();
        plan.time = Time::new(duration, step);
        assert_eq!(plan.time.n_steps as f64, (duration / step).round());
        assert!(
            Run::<1>::new(&plan, &Settings::default(), &mut Vec::new()).is_ok(),
            "{duration} s in steps of {step} s"
        );
        plan.time.n_steps -= 1;
        assert!(
            Run::<1>::new(&plan, &Settings::default(), &mut Vec::new()).is_err(),
            "a step is missing of {duration} s"
        );
    }
}
