//! The scenes of exchange between parcels in `experiments/`, held to closed forms.

#[path = "support/scene.rs"]
mod scene;

use lamella::scenario::Settings;
use scene::{Finished, run, run_with, tell};

const LINE: &str = include_str!("../experiments/exchange_point/line.lam");
const PLANE: &str = include_str!("../experiments/exchange_point/plane.lam");
const CUTOFF: &str = include_str!("../experiments/exchange_theory/cutoff.lam");
const STEP_LINE: &str = include_str!("../experiments/exchange_heaviside/line.lam");
const STEP_PLANE: &str = include_str!("../experiments/exchange_heaviside/plane.lam");
const STUDY: &str = include_str!("../experiments/kernel_size_study/line.lam");
const STUDY_PLANE: &str = include_str!("../experiments/kernel_size_study/plane.lam");
const BOTH: &str = include_str!("../experiments/exchange_work_precision/exchange_work_precision.lam");

fn with(text: &str, set: &[(&str, &str)], seed: u64) -> Finished {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    run_with(text, &Settings { set, seed: Some(seed), ..Settings::default() })
}

/// Root mean square of a measure over seeds.
fn of_seeds(text: &str, set: &[(&str, &str)], measure: &str) -> f64 {
    const SEEDS: std::ops::RangeInclusive<u64> = 1..=4;
    let squares: f64 = SEEDS.map(|seed| with(text, set, seed).measure(measure).powi(2)).sum();
    (squares / 4.0).sqrt()
}

/// P4-d and P4-h.
#[test]
fn a_point_spreads_to_rounding_and_makes_the_entropy_of_a_gaussian() {
    let line = run(LINE);
    assert!(line.measure("rms") < 1e-14);
    assert!((line.measure("dilution") - 1.0).abs() < 1e-3);
    let plane = run(PLANE);
    assert!(plane.measure("rms") < 1e-3);
    assert!(line.measure("leak") < 1e-13 && plane.measure("leak") < 1e-13);
}

/// P4-a: three ways through a step, each with the error that its theory says.
#[test]
fn the_error_of_ordered_parcels_is_the_one_foretold() {
    for text in [
        include_str!("../experiments/exchange_theory/explicit.lam"),
        include_str!("../experiments/exchange_theory/implicit.lam"),
        include_str!("../experiments/exchange_theory/exponential.lam"),
    ] {
        let told = with(text, &[("ratio", "1.5"), ("dt", "0.125s")], 1).measure("told");
        assert!((told - 1.0).abs() < 0.05);
    }
    let explicit = include_str!("../experiments/exchange_theory/explicit.lam");
    assert!(with(explicit, &[("ratio", "1")], 1).measure("err") < 1e-8);
}

/// P4-g.
#[test]
fn a_cut_off_takes_what_the_closed_form_says() {
    let told = with(CUTOFF, &[("cut", "4")], 1).measure("told");
    assert!((told - 1.0).abs() < 0.02);
}

/// P4-c: a step below the least one leaves nothing of the dispersion.
#[test]
fn a_step_front_needs_kernels_that_reach_the_next_parcel() {
    let error = |long: &str| with(STEP_LINE, &[("long", long)], 1).measure("err");
    let (below, at, above) = (error("0.1"), error("1"), error("4"));
    assert!(below > 0.03 && at < 1e-3 && above < 1e-3);
    let error =
        |long: &str| with(STEP_PLANE, &[("n", "51"), ("Dy", "0.2m^2/s"), ("long", long)], 1).measure("err");
    assert!(error("0.2") > 0.02 && error("1") < 5e-4);
}

/// P4-b: at 0.25 of the collocation length parcels at rest in disorder want wider kernels; dense ones that walk want the
/// collocation length, and a wide kernel is then worse than it by more than their scatter.
#[test]
fn the_best_kernel_size_moves_with_disorder_and_density() {
    let error = |n: &str, part: &str, disorder: &str, ratio: &str| {
        let set = [("n", n), ("part", part), ("disorder", disorder), ("ratio", ratio)];
        of_seeds(STUDY, &set, "err")
    };
    let resting = [error("120", "1", "100", "1"), error("120", "1", "100", "3")];
    let walking = [error("1920", "0.5", "100", "1"), error("1920", "0.5", "100", "4")];
    let ordered = [error("480", "1", "0", "1"), error("480", "1", "0", "1.5")];
    tell(&format!("resting {resting:.3?}, walking {walking:.3?}, ordered {ordered:?}"));
    assert!(resting[1] < 0.7 * resting[0]);
    assert!(walking[1] > 1.3 * walking[0]);
    assert!(ordered[0] < 1e-6 && ordered[1] > 1e-3);
}

/// The same in a plane: parcels at rest in disorder, one to a collocation length, want wider kernels; two of them that walk
/// want none wider; ordered ones are exact at the collocation length and at no other.
#[test]
fn the_best_kernel_size_moves_in_a_plane_as_on_a_line() {
    let error = |per_axis: &str, part: &str, disorder: &str, ratio: &str| {
        let sizes = [("step", "0.125s"), ("per_axis", per_axis), ("ratio", ratio)];
        let set: Vec<_> = sizes.into_iter().chain([("part", part), ("disorder", disorder)]).collect();
        of_seeds(STUDY_PLANE, &set, "err")
    };
    let resting = [error("48", "1", "100", "1"), error("48", "1", "100", "1.5")];
    let walking = [error("96", "0.5", "100", "1"), error("96", "0.5", "100", "2")];
    let ordered = [error("48", "1", "0", "1"), error("48", "1", "0", "1.5")];
    tell(&format!("resting {resting:.3?}, walking {walking:.3?}, ordered {ordered:?}"));
    assert!(resting[1] < 0.8 * resting[0]);
    assert!(walking[1] > 1.5 * walking[0]);
    assert!(ordered[0] < 1e-5 && ordered[1] > 1e-2);
}

/// One statement is a walk, an exchange, or both: nothing is lost, and all come to the plume, walking parcels only as fast as
/// chance does.
#[test]
fn a_plume_is_the_same_by_walk_and_exchange() {
    for (n, part, most) in [("60000", "0", 0.09), ("6000", "0.5", 0.03), ("6000", "1", 1e-3)] {
        let finished = with(BOTH, &[("n", n), ("part", part)], 1);
        assert!(finished.measure("err") < most);
        assert!(finished.measure("leak") < 1e-12);
    }
}
