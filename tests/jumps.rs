//! Masses beside planes at which velocity, dispersion and porosity jump, written as expressions.
//!
//! References: what is uniform stays uniform where the flux φv goes on, at any step; steady columns of two layers by
//! their closed form; a pulse against the equation in finite volumes.

use lamella::engine::snapshot::{Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::maths::scalar::exp;
use lamella::plan::Plan;
use lamella::plan::compile::Options;
use lamella::scenario::Settings;
use lamella::source::Sources;

fn plan(text: &str) -> Plan {
    let checked =
        lamella::check(Sources::single("scene.lam", text), &Settings::default(), &Options::default());
    checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}\n{text}", checked.diagnostics)).plan
}

fn run(plan: &Plan) -> Vec<Snapshot> {
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let outcome = lamella::engine::run(plan, &EngineSettings::default(), &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    });
    assert!(outcome.expect("the scene runs").worst_defect() < 1e-12);
    snapshots
}

/// Means of the last profile or map, with their standard errors.
fn bins(text: &str) -> Vec<(f64, f64)> {
    let snapshots = run(&plan(text));
    let Some(Values::Binned { mean, standard_error, .. }) = snapshots.last().map(|last| &last.values) else {
        panic!("no bins")
    };
    mean[0].iter().copied().zip(standard_error[0].iter().copied()).collect()
}

/// χ² per bin of what should be 1 everywhere, below four standard deviations above its mean.
fn is_uniform(bins: &[(f64, f64)], what: &str) {
    let n = bins.len() as f64;
    let chi = bins.iter().map(|(mean, error)| ((mean - 1.0) / error).powi(2)).sum::<f64>() / n;
    let worst = bins.iter().map(|(mean, error)| (mean - 1.0) / error).fold(0.0_f64, |a, b| a.max(b.abs()));
    assert!(chi < 1.0 + 4.0 * (2.0 / n).sqrt() && worst < 5.0, "{what}: χ² {chi}, worst {worst} in {bins:?}");
}

const STEPS: [(&str, &str); 5] = [
    // Courant numbers of the faster side and bins of 0.25 m: 0.1, 1, 3, 16.
    ("0.00625 d", "0.075 d"),
    ("0.0625 d", "0.375 d"),
    ("0.1875 d", "0.75 d"),
    ("1 d", "2 d"),
    ("auto(courant <= 0.25, dispersion <= 0.1)", "0.1 d"),
];

/// One line around a period, so that there are a plane at 4 m and one where the ends meet.
#[test]
fn what_is_uniform_stays_so_beside_any_jump_at_any_step() {
    let cases = [
        // φ, v and D on both sides: all jump; D or φ alone; φ and v with one D; no dispersion on one side.
        ([0.1, 0.4], [4.0, 1.0], [1.0, 0.01]),
        ([0.1, 0.4], [-4.0, -1.0], [1.0, 0.01]),
        ([0.1, 0.4], [4.0, 1.0], [0.01, 1.0]),
        ([0.3, 0.3], [4.0, 4.0], [1.0, 0.04]),
        ([0.1, 0.4], [0.0, 0.0], [0.5, 0.5]),
        ([0.1, 0.4], [-4.0, -1.0], [0.2, 0.2]),
        ([0.1, 0.4], [4.0, 1.0], [0.5, 0.0]),
        ([0.1, 0.4], [4.0, 1.0], [0.0, 0.0]),
    ];
    for (porosity, velocity, dispersion) in cases {
        for (step, duration) in STEPS {
            let text = format!(
                "lamella 1\nspecies A\ninitial A = 1 mol/m^3\ndomain line x = 0 .. 10 m\n\
                 boundary left, right periodic\n\
                 medium porosity if x < 4 m then {} else {}\n\
                 flow velocity = if x < 4 m then {} m/d else {} m/d\n\
                 dispersion if x < 4 m then {} m^2/d else {} m^2/d\n\
                 particles mass 50_000\nrun to {duration}, step {step}\nseed 5\n\
                 output profile A at t = {duration} on 40\n",
                porosity[0], porosity[1], velocity[0], velocity[1], dispersion[0], dispersion[1]
            );
            is_uniform(&bins(&text), &format!("φ {porosity:?} v {velocity:?} D {dispersion:?} step {step}"));
        }
    }
}

/// Flow across and along a jump at x = 2 m, dispersion that follows it, so that its tensors have other axes on either
/// side; along y nothing changes, and y is a period.
#[test]
fn what_is_uniform_stays_so_where_flow_is_refracted() {
    for sign in [1, -1] {
        for (step, duration) in [("0.02 d", "0.2 d"), ("0.3 d", "1.5 d"), STEPS[4]] {
            let text = format!(
                "lamella 1\nspecies A\ninitial A = 1 mol/m^3\n\
                 domain rect x = 0 .. 4 m, y = 0 .. 4 m\n\
                 boundary left, right, bottom, top periodic\n\
                 medium porosity if x < 2 m then 0.1 else 0.4\n\
                 flow velocity = (if x < 2 m then {} m/d else {} m/d, if x < 2 m then 1 m/d else 3 m/d)\n\
                 dispersion longitudinal 0.2 m, transverse 0.02 m, molecular 0\n\
                 particles mass 40_000\nrun to {duration}, step {step}\nseed 5\n\
                 output map A at t = {duration} on 16 x 8\n",
                4 * sign,
                sign
            );
            is_uniform(&bins(&text), &format!("sign {sign} step {step}"));
        }
    }
}

/// What is let in over one half of the period along y spreads as on its side alone would: with one tensor and flow on both
/// sides the plane is not there, and a stripe has the law of a normal variable whose mean and variance are `v_y t` and
/// `2 D_yy t`. Bounds: four sampling errors.
#[test]
fn a_plane_without_a_jump_changes_nothing() {
    let text = "lamella 1\nspecies A\ndomain rect x = 0 .. 4 m, y = -20 .. 20 m\n\
        boundary left, right periodic\nboundary bottom, top open\n\
        medium porosity if x < 2 m then 0.3 else 0.3\n\
        flow velocity = (if x < 2 m then 3 m/d else 3 m/d, 1.5 m/d)\n\
        dispersion longitudinal 0.3 m, transverse 0.03 m, molecular 0\n\
        source s: A = 1 mol/m at point(1 m, 0 m)\n\
        particles mass 100_000\nrun to 2 d, step 0.5 d\nseed 5\noutput particles A at t = 2 d\n";
    let snapshots = run(&plan(text));
    let Some(Values::Particles { positions, .. }) = snapshots.last().map(|last| &last.values) else {
        panic!()
    };
    let n = positions[1].len() as f64;
    let mean = positions[1].iter().sum::<f64>() / n;
    let variance = positions[1].iter().map(|y| (y - mean).powi(2)).sum::<f64>() / n;
    let speed = (9.0_f64 + 2.25).sqrt();
    let exact = 2.0 * 2.0 * (0.03 * speed + 0.27 * 2.25 / speed);
    assert!((mean - 3.0).abs() < 4.0 * (exact / n).sqrt(), "{mean}");
    assert!((variance / exact - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{variance} {exact}");
}

/// Steady columns of two layers: water of one concentration comes in, and is taken to zero at the other end.
///
/// - Equation: `J = q c − φ D c'`; `c₂ = c₀ (1 − e^{v₂(x − L)/D₂})`, `c₁ = c₀ + (c₂(g) − c₀) e^{v₁(x − g)/D₁}`.
/// - Symbols: `g` the plane, `L` the end of the column, `c₀` what comes in.
/// - Range: flow from layer 1 to layer 2; the mirror image for the other direction.
/// - Source: integration.
/// - Shape: one number per place.
#[test]
fn steady_columns_of_two_layers_have_the_profile_of_the_closed_form() {
    let (g, l, n) = (2.0, 4.0, 20_usize);
    for (phi, v, d) in [([0.2, 0.4], [1.0, 0.5], [0.7, 0.2]), ([0.2, 0.2], [1.0, 1.0], [0.2, 1.0])] {
        let second = |x: f64| 1.0 - exp(v[1] * (x - l) / d[1]);
        let exact = |x: f64| match x < g {
            true => 1.0 + (second(g) - 1.0) * exp(v[0] * (x - g) / d[0]),
            false => second(x),
        };
        for is_mirrored in [false, true] {
            for step in ["0.4 d", "0.05 d"] {
                let (sign, a, b) = if is_mirrored { ("-", 1, 0) } else { ("", 0, 1) };
                let (inlet, outlet) = if is_mirrored { ("right", "left") } else { ("left", "right") };
                let text = format!(
                    "lamella 1\nspecies A\ninitial A = 0 mol/m^3\ndomain line x = 0 .. 4 m\n\
                     boundary {inlet} inflow A = 1 mol/m^3\nboundary {outlet} absorb\n\
                     medium porosity if x < 2 m then {} else {}\n\
                     flow velocity = if x < 2 m then {sign}{} m/d else {sign}{} m/d\n\
                     dispersion if x < 2 m then {} m^2/d else {} m^2/d\n\
                     particles mass 40_000\nrun to 10 d, step {step}\nseed 5\n\
                     output profile A at t = 10 d on {n}\n",
                    phi[a], phi[b], v[a], v[b], d[a], d[b]
                );
                let mut found = bins(&text);
                if is_mirrored {
                    found.reverse();
                }
                for (bin, (mean, error)) in found.iter().enumerate() {
                    let (width, parts) = (l / n as f64, 50);
                    let at = |k: usize| (bin as f64 + (k as f64 + 0.5) / f64::from(50)) * width;
                    let exact = (0..parts).map(|k| exact(at(k))).sum::<f64>() / parts as f64;
                    let off = (mean - exact) / error.max(1e-3);
                    assert!(
                        off.abs() < 4.5,
                        "{phi:?} {v:?} {d:?} {outlet} step {step} bin {bin}: {mean} ± {error}, {exact}"
                    );
                }
            }
        }
    }
}

/// A pulse at −1 m after 0.5 d, by explicit finite volumes of 2 cm with fluxes `q (c₁ + c₂)/2 − G (c₂ − c₁)`, `G` the harmonic
/// mean of φD over 2 cm; their error is 10⁻³ of the largest value.
fn by_volumes(porosity: [f64; 2], velocity: [f64; 2], dispersion: [f64; 2]) -> Vec<f64> {
    let (width, n, end) = (0.02, 800_usize, 0.5);
    let side = |cell: usize| usize::from(cell >= n / 2);
    let spread = |cell: usize| porosity[side(cell)] * dispersion[side(cell)];
    let between: Vec<f64> = (1..n).map(|k| 2.0 / (1.0 / spread(k - 1) + 1.0 / spread(k)) / width).collect();
    let mut c = vec![0.0; n];
    for cell in [n / 2 - 51, n / 2 - 50] {
        c[cell] = 0.5 / (width * porosity[0]);
    }
    let steps = 10_000;
    let flux = porosity[0] * velocity[0];
    for _ in 0..steps {
        let mut through = vec![0.0; n + 1];
        for k in 1..n {
            through[k] = 0.5 * flux * (c[k - 1] + c[k]) - between[k - 1] * (c[k] - c[k - 1]);
        }
        for k in 0..n {
            c[k] -= end / f64::from(steps) / (width * porosity[side(k)]) * (through[k + 1] - through[k]);
        }
    }
    c.chunks(25).map(|cells| cells.iter().sum::<f64>() / 25.0).collect()
}

#[test]
fn a_pulse_goes_through_a_jump_as_by_finite_volumes() {
    for (porosity, velocity, dispersion) in
        [([0.1, 0.4], [4.0, 1.0], [1.0, 0.1]), ([0.4, 0.1], [1.0, 4.0], [0.2, 1.0])]
    {
        let exact = by_volumes(porosity, velocity, dispersion);
        let largest = exact.iter().fold(0.0_f64, |a, b| a.max(*b));
        for step in ["0.5 d", "0.1 d"] {
            let text = format!(
                "lamella 1\nspecies A\ndomain line x = -8 .. 8 m\nboundary left, right open\n\
                 medium porosity if x < 0 m then {} else {}\n\
                 flow velocity = if x < 0 m then {} m/d else {} m/d\n\
                 dispersion if x < 0 m then {} m^2/d else {} m^2/d\n\
                 source s: A = 1 mol/m^2 at point(-1 m)\n\
                 particles mass 100_000\nrun to 0.5 d, step {step}\nseed 5\n\
                 output profile A at t = 0.5 d on 32\n",
                porosity[0], porosity[1], velocity[0], velocity[1], dispersion[0], dispersion[1]
            );
            for (bin, ((mean, error), exact)) in bins(&text).iter().zip(&exact).enumerate() {
                let bound = 4.5 * error + 2e-3 * largest;
                assert!((mean - exact).abs() < bound, "{velocity:?} step {step} bin {bin}: {mean} {exact}");
            }
        }
    }
}
