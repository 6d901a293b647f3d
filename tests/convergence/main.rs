//! Observed orders of the engine, with bounds from theory.

#[path = "../support/mod.rs"]
mod support;

use lamella::engine::snapshot::Values;
use lamella::plan::*;
use support::*;

/// Integral of the product in cm at 619 s.
fn product(mut plan: Plan) -> f64 {
    plan.outputs = vec![output(OutputKind::Total, vec![Quantity::Species(2)], vec![], vec![619.0])];
    match &run(&plan).1[0].values {
        Values::Total { amount } => amount[0] * 100.0,
        other => panic!("{other:?}"),
    }
}

/// The scatter of ∫c̄_AB falls as N^-½ (section 7.7: 2.0–2.4 N^-½ cm). From 12 seeds a standard
/// deviation is known to a fifth; the order over a factor of 16 to 0.1. Allowed: three of it.
#[test]
fn scatter_falls_with_the_root_of_the_number() {
    let scatter = |n_particles: u64| {
        let values: Vec<f64> = (0..12)
            .map(|seed| product(Plan { seed, ..front(n_particles, 60, 619.0, 619.0 / 60.0) }))
            .collect();
        let mean = values.iter().sum::<f64>() / 12.0;
        (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 11.0).sqrt()
    };
    let order = (scatter(96_000) / scatter(6_000)).ln() / 16_f64.ln();
    assert!((order + 0.5).abs() < 0.3, "{order}");
}

/// Dispersion added by bins grows with their width squared: the product of a front whose only mixing
/// is D + χΔ²/24 with a fast zone. Twice the width, four times the excess, within 25 %.
#[test]
fn error_of_bins_is_of_second_order() {
    let variance = |bins: usize| {
        let axes = vec![axis(0, -10.0, 10.0, Side::Periodic, bins)];
        let mut plan = plain(axes, walk(1, 0.05), 500_000, 6.0, 0.1);
        plan.components[0].initial = step_down(0);
        plan.mixing =
            Some(Mixing { zones: vec![zone("all", 1.0, ZoneRate::Finite(1.0))], is_well_mixed: false });
        plan.outputs = vec![all_particles(&plan, vec![6.0])];
        match &run(&plan).1[0].values {
            // Mean of x over the values: the flux through both fronts is not needed, only what bins add.
            Values::Particles { positions, concentrations } => {
                let inner = positions[0].iter().zip(&concentrations[0]).filter(|(x, _)| x.abs() < 5.0);
                // ∫₀ x c dx + ∫₋ |x| (1 − c) dx = D t for a front: the first moment beyond its place.
                inner.map(|(&x, &c)| if x > 0.0 { x * c } else { -x * (1.0 - c) }).sum::<f64>() * 20.0
                    / 500_000.0
            }
            other => panic!("{other:?}"),
        }
    };
    // ∫|x| |c − H| dx = D t for one front.
    let exact = 0.05 * 6.0;
    let (coarse, fine) = (variance(20) - exact, variance(40) - exact);
    let order = (coarse / fine).ln() / 2_f64.ln();
    assert!((order - 2.0).abs() < 0.5, "{coarse} {fine}: {order}");
}
