//! Sweeps of `experiments`, made small, as a user runs them: what they expect of themselves holds, or the program
//! ends with 1.
//!
//! Bounds stand in the scenes, with their reasons in the README beside each; here are fewer replicates only, and where
//! that widens a bound it is said.

use crate::program::Folder;

/// A scene of `experiments` with pieces replaced that must be there.
fn edited(path: &str, edits: &[(&str, &str)]) -> String {
    let path = format!("{}/experiments/{path}", env!("CARGO_MANIFEST_DIR"));
    let mut text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    for (from, to) in edits {
        assert!(text.contains(from), "{path} has no `{from}`");
        text = text.replace(from, to);
    }
    text
}

/// Runs a sweep of a scene to its end; what it expects must hold.
#[track_caller]
fn holds(text: &str, sweep: &str) {
    let folder = Folder::new();
    folder.write("scene.lam", text);
    folder.lamella(&["sweep", "scene.lam", sweep, "--out", "out"]).exits(0);
}

/// The strain scene: errors of the step are 1.5 % to 12 %, noise is 0.2 %.
#[test]
fn steps_in_a_flow_that_stretches_are_of_first_order() {
    holds(&edited("weak_order/strain.lam", &[("particles mass 1e5", "particles mass 5e4")]), "steps");
}

/// With a fifth of the particles the noise of the smallest error, 0.4 %, is a sixth of it.
#[test]
fn steps_where_dispersion_varies_are_of_first_order() {
    holds(&edited("weak_order/varying.lam", &[("particles  1e6", "particles  2e5")]), "steps");
}

/// The slope over two decades of N is known to 0.01 from 40 replicates.
#[test]
fn errors_fall_with_the_root_of_the_number_of_particles() {
    holds(&edited("weak_order/varying.lam", &[]), "numbers");
}

/// The smallest error of the centre is 0.2 %, its noise 0.05 % with fewer particles.
#[test]
fn steps_of_each_particle_s_own_in_an_aquifer_are_of_first_order() {
    holds(
        &edited("weak_order/aquifer.lam", &[("particles mass 100_000", "particles mass 20_000")]),
        "criteria",
    );
}

#[test]
fn flows_in_random_fields_have_their_statistics() {
    holds(&edited("flow_statistics/flow_statistics.lam", &[]), "fields");
}

/// Twenty fields of 2 000 particles; bounds allow for the scatter of fields, which does not hang on particles.
#[test]
fn an_ensemble_of_fields_spreads_as_theory_says() {
    let edits = [("particles mass 10_000", "particles mass 2_000"), ("replicates 24", "replicates 20")];
    holds(&edited("macrodispersion_ensemble/macrodispersion_ensemble.lam", &edits), "ensemble");
}
