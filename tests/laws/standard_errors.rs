//! Standard errors of bin means against the scatter of replicates: the one independent witness.

use crate::support::*;
use lamella::engine::snapshot::Values;
use lamella::plan::*;

const N_SEEDS: u64 = 80;
const N_BINS: usize = 60;

/// Root mean squares over the bins near the front: of the standard errors, and of the scatter over seeds.
fn both(mixing: Option<Mixing>, species: usize) -> (f64, f64) {
    let mut plan = front(20_000, N_BINS, 600.0, 20.0);
    plan.particles.placement = Placement::Random;
    plan.mixing = mixing;
    plan.outputs =
        vec![output(OutputKind::Profile, vec![Quantity::Species(species)], vec![N_BINS], vec![600.0])];
    let (mut squares, mut means) = (0.0, vec![Vec::new(); N_BINS]);
    // |x| < 2.5 cm: some 2.5 deviations of the front.
    let near = 20..40;
    for seed in 0..N_SEEDS {
        plan.seed = seed;
        let (_, snapshots) = run(&plan);
        let Values::Binned { mean, standard_error, .. } = &snapshots[0].values else { panic!("no profile") };
        for bin in near.clone() {
            squares += standard_error[0][bin].powi(2);
            means[bin].push(mean[0][bin]);
        }
    }
    let variance = |values: &Vec<f64>| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64
    };
    let n_bins = near.len() as f64;
    let scatter = near.map(|bin| variance(&means[bin])).sum::<f64>() / n_bins;
    ((squares / (n_bins * N_SEEDS as f64)).sqrt(), scatter.sqrt())
}

/// The root mean square of 20 variances, each of 80 replicates, scatters by √(2/79/20)/2 = 1.8 %, more as
/// neighbours are correlated. Exchange with noisy means leaves noise that a single run cannot see; at
/// χt = 0.12 it is small.
#[test]
fn standard_errors_are_the_scatter_of_replicates() {
    let well_mixed =
        Mixing { zones: vec![zone("all", 1.0, ZoneRate::Instant)], is_well_mixed: true, averaging: None };
    let cases = [
        ("no zones, A", None, 0),
        ("no zones, AB", None, 2),
        ("half slow, A", dual_rate(0.5, 2e-4), 0),
        ("half slow, AB", dual_rate(0.5, 2e-4), 2),
        ("well mixed, A", Some(well_mixed.clone()), 0),
        ("well mixed, AB", Some(well_mixed), 2),
    ];
    for (name, mixing, species) in cases {
        let (told, found) = both(mixing, species);
        println!("{name}: told {told:.3e}, found {found:.3e}");
        // A segregated pair makes no product at all: nothing to tell.
        if name == "no zones, AB" {
            assert_eq!((told, found), (0.0, 0.0));
        } else {
            assert!((told / found - 1.0).abs() < 0.08, "{name}: told {told}, found {found}");
        }
    }
}
