//! Breakthrough and first passage at planes, sides, parts of these, wells and boxes, in one to three dimensions.
//!
//! Reference: water of one concentration that flows through a place, of which every place sees that concentration,
//! however unevenly it flows. Masses are known to the square root of the number of particles that passed, and four
//! times that is the bound. Where cells of 1 m differ much, parts of planes are wrong by the step (in proportion to it:
//! 2.7 % at `courant <= 0.1`, 1.1 % at 0.03, ln K of variance 0.5 and 1 m of correlation); fields here differ less.

use lamella::engine::snapshot::{Outcome, Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::plan::compile::Options;
use lamella::plan::{OutputKind, Plan};
use lamella::scenario::Settings;
use lamella::source::Sources;

struct Finished {
    plan: Plan,
    snapshots: Vec<Snapshot>,
    outcome: Outcome,
}

fn run(text: &str) -> Finished {
    let sources = Sources::single("scene.lam", text);
    let checked = lamella::check(sources, &Settings::default(), &Options::default());
    let plan = checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics)).plan;
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let outcome = lamella::engine::run(&plan, &EngineSettings::default(), &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })
    .expect("the scene runs");
    Finished { plan, snapshots, outcome }
}

impl Finished {
    /// The numbers of the first species of an output, time by time.
    fn course(&self, output_idx: usize) -> Vec<Vec<f64>> {
        let own = self.snapshots.iter().filter(|snapshot| snapshot.output_idx == output_idx);
        own.map(|snapshot| {
            let Values::Rows(rows) = &snapshot.values else { panic!("{:?}", snapshot.values) };
            rows[0][0].numbers.clone()
        })
        .collect()
    }

    fn last(&self, output_idx: usize) -> Vec<f64> {
        self.course(output_idx).pop().expect("an output at the end")
    }

    /// Mass of one particle: all are equal up to the rounding of their number.
    fn unit(&self) -> f64 {
        let budget = self.plan.outputs.iter().position(|output| output.kind == OutputKind::Budget);
        let snapshot = self.snapshots.iter().rfind(|snapshot| Some(snapshot.output_idx) == budget);
        let Some(Values::Rows(rows)) = snapshot.map(|snapshot| &snapshot.values) else {
            panic!("the scene has no budget")
        };
        let entered: f64 = rows[0].iter().map(|row| row.numbers[1]).filter(|mass| mass.is_finite()).sum();
        entered / self.plan.transport.as_ref().expect("masses").populations[0].count as f64
    }

    /// Every breakthrough has the concentration of the water, 8 g/m³, over the whole time `t`.
    fn has_one_concentration_everywhere(&self, t: f64) {
        let (c, unit) = (8e-3, self.unit());
        let mut n_seen = 0;
        for (idx, output) in self.plan.outputs.iter().enumerate() {
            if output.kind != OutputKind::Breakthrough {
                continue;
            }
            n_seen += 1;
            let places = self.plan.places(output);
            let numbers = self.last(idx);
            if places[0] == "box" {
                let (found, n) = (numbers[0], numbers[3]);
                assert!((found / c - 1.0).abs() < 4.0 / n.sqrt(), "{places:?}: {found} from {n} particles");
                continue;
            }
            // The mean over the run: bins in between are as right, and noisier.
            let water: f64 = numbers[1] / numbers[0];
            let (found, expected) = (numbers[2], c * water * t);
            let bound = 4.0 * (expected.abs() * unit).sqrt();
            assert!(expected.abs() > 20.0 * unit, "{places:?}: nothing goes through");
            assert!((found - expected).abs() < bound, "{places:?}: {found} of {expected} +- {bound}");
        }
        assert!(n_seen > 3);
        let worst = self.outcome.mass_defect.iter().fold(0.0, |worst: f64, defect| worst.max(*defect));
        assert!(worst < 1e-12, "{worst:e}");
    }
}

#[test]
fn on_a_line_every_place_sees_the_water_of_the_source() {
    run("lamella 1
species A
domain line x = 0 .. 20 m
medium porosity 0.25
flow darcy {
  head left 12 m, right 10 m
  conductivity 10 m/d
  well pump at 12.3 m rate -0.5 m/d
  grid 20
}
dispersion longitudinal 0.1 m, transverse 0.01 m, molecular 1e-4 m^2/d
boundary left inflow A = 8 mg/L
boundary right outflow
initial A = 8 mg/L
particles mass 100_000
run to 8 d, step auto(courant <= 0.05, dispersion <= 0.02)
output breakthrough A at x = 7 m at t = 8 d
output breakthrough A at x = 7.4 m resident on 10 at t = 8 d
output breakthrough A at left at t = 8 d
output breakthrough A at right at t = 8 d
output breakthrough A at well pump at t = 8 d
output breakthrough A in box(3 m .. 9 m) at t = 8 d
output budget A at t = 8 d
")
    .has_one_concentration_everywhere(8.0 * 86_400.0);
}

const PLAIN: &str = "lamella 1
species A
domain rect x = 0 .. 20 m, y = 0 .. 8 m
medium porosity 0.25
flow darcy {
  head left 12 m, right 10 m
  no_flow bottom, top
  conductivity lognormal(geometric_mean = 10 m/d, variance = 0.5, covariance = exponential(3 m))
  well pump at (12.3 m, 4.6 m) rate -1.5 m^2/d
  grid 20 x 8
}
dispersion longitudinal 0.2 m, transverse 0.02 m, molecular 1e-4 m^2/d
boundary left inflow A = 8 mg/L
boundary right outflow
boundary bottom, top reflect
initial A = 8 mg/L
particles mass 200_000 stratified
run to 8 d, step auto(courant <= 0.05, dispersion <= 0.01)
output breakthrough A at x = 5 m at t = 8 d
output breakthrough A at x = 5 m, y = 1.3 m .. 4.6 m at t = 8 d
output breakthrough A at x = 5.5 m, y = 1 m .. 4 m resident on 10 at t = 8 d
output breakthrough A at left y = 2 m .. 5.5 m at t = 8 d
output breakthrough A at right y = 0 m .. 3 m at t = 8 d
output breakthrough A at right at t = 8 d
output breakthrough A at well pump at t = 8 d
output breakthrough A in box(3 m .. 9 m, 2 m .. 6 m) at t = 8 d
output budget A at t = 8 d
";

#[test]
fn in_a_plane_every_place_sees_the_water_of_the_source() {
    run(PLAIN).has_one_concentration_everywhere(8.0 * 86_400.0);
}

#[test]
fn in_space_every_place_sees_the_water_of_the_source() {
    run("lamella 1
species A
domain box x = 0 .. 12 m, y = 0 .. 6 m, z = 0 .. 4 m
medium porosity 0.25
flow darcy {
  head left 12 m, right 10 m
  no_flow front, back, bottom, top
  conductivity lognormal(geometric_mean = 10 m/d, variance = 0.2, covariance = exponential(3 m, 3 m, 2 m))
  well pump at (8.3 m, 2.6 m) screen 1 m .. 3 m rate -6 m^3/d
  grid 12 x 6 x 4
}
dispersion longitudinal 0.2 m, transverse 0.02 m, molecular 1e-4 m^2/d
boundary left inflow A = 8 mg/L
boundary right outflow
boundary front, back, bottom, top reflect
initial A = 8 mg/L
particles mass 100_000 stratified
run to 3 d, step auto(courant <= 0.05, dispersion <= 0.01)
output breakthrough A at x = 5 m at t = 3 d
output breakthrough A at x = 5 m, y = 1.3 m .. 4.6 m, z = 2 m .. 4 m at t = 3 d
output breakthrough A at x = 5.5 m, y = 1 m .. 4 m resident on 10 at t = 3 d
output breakthrough A at left y = 2 m .. 5.5 m, z = 0 m .. 1.5 m at t = 3 d
output breakthrough A at right z = 1 m .. 3 m at t = 3 d
output breakthrough A at well pump at t = 3 d
output breakthrough A in box(3 m .. 9 m, 2 m .. 5 m, 1 m .. 3 m) at t = 3 d
output budget A at t = 3 d
")
    .has_one_concentration_everywhere(3.0 * 86_400.0);
}

/// Parts that cover a plane or a side let through what it lets through, particle by particle; and what leaves through a
/// well has its first passage there once.
#[test]
fn parts_add_up_to_the_whole() {
    let head = PLAIN.split("output").next().expect("a scene");
    let finished = run(&format!(
        "{head}
output breakthrough A at x = 5 m every 2 d
output breakthrough A at x = 5 m, y = 0 m .. 1.7 m every 2 d
output breakthrough A at x = 5 m, y = 1.7 m .. 8 m every 2 d
output breakthrough A at right every 2 d
output breakthrough A at right y = 0 m .. 3.3 m every 2 d
output breakthrough A at right y = 3.3 m .. 8 m every 2 d
output breakthrough A at left every 2 d
output breakthrough A at left y = 0 m .. 3.3 m every 2 d
output breakthrough A at left y = 3.3 m .. 8 m every 2 d
output breakthrough A at well pump every 2 d
output first_passage A at well pump every 2 d
output budget A every 2 d
"
    ));
    for first in [0, 3, 6] {
        let parts = finished.course(first + 1).into_iter().zip(finished.course(first + 2));
        for (whole, (lower, upper)) in finished.course(first).into_iter().zip(parts) {
            assert!((whole[2] - lower[2] - upper[2]).abs() <= 1e-12 * whole[2].abs());
            assert_eq!(whole[3], lower[3] + upper[3]);
            if whole[1].is_finite() {
                // Water adds up, too.
                let [all, a, b] = [&whole, &lower, &upper].map(|numbers| numbers[1] / numbers[0]);
                assert!((all - a - b).abs() < 1e-9 * all.abs(), "{all} {a} {b}");
            }
        }
    }
    let (taken, passed) = (finished.course(9), finished.course(10));
    assert!(taken.len() == 5 && taken[4][2] > 0.0);
    for (taken, passed) in taken.iter().zip(&passed) {
        assert_eq!((taken[2], taken[3]), (passed[0], passed[2]));
    }
}

/// A plume in the lower half of a column passes the lower half of planes, and spreads into the upper one as a
/// diffusion from a band does: the flux through `y > h/2` of a wide column far from its sides is
/// `½ erfc((y − a)/√(4 D_T x/v))` over the part, with the longitudinal direction long in balance.
#[test]
fn a_plume_passes_the_part_where_it_is() {
    let finished = run("lamella 1
species A
domain rect x = 0 .. 40 m, y = -10 .. 10 m
medium porosity 0.25
flow uniform (1 m/d, 0 m/d)
dispersion longitudinal 0.05 m, transverse 0.02 m, molecular 1e-9 m^2/d
boundary left y = -10 .. 0 m inflow A = 8 mg/L
boundary left inflow A = 0 mg/L
boundary right outflow
boundary bottom, top reflect
particles mass 200_000
run to 60 d, step 0.5 d
output breakthrough A at x = 25 m, y = 0 m .. 0.5 m at t = 40 d, 60 d
output breakthrough A at x = 25 m, y = 0.5 m .. 10 m at t = 40 d, 60 d
output breakthrough A at x = 25 m, y = -10 m .. -0.5 m at t = 40 d, 60 d
output budget A at t = 60 d
");
    // 8 g/m³, 0.25 m/d, over 20 d, per metre; deviation across √(2 · 0.02 m · 25 m) = 1 m.
    let whole = 8e-3 * 0.25 * 20.0;
    // ∫ ½ erfc(y/√2 s) dy from a to b with s = 1 m, from Φ and the normal density.
    let above = |a: f64| {
        let density = (-0.5 * a * a).exp() / (2.0 * std::f64::consts::PI).sqrt();
        density - 0.5 * a * lamella::maths::scalar::erfc(a / 2.0_f64.sqrt())
    };
    let expected = [above(0.0) - above(0.5), above(0.5), 9.5 - above(0.5)].map(|width| width * whole);
    for (idx, expected) in expected.into_iter().enumerate() {
        let course = finished.course(idx);
        let found = course[1][2] - course[0][2];
        let bound = 4.0 * (expected * finished.unit()).sqrt();
        assert!((found - expected).abs() < bound, "{idx}: {found} {expected} +- {bound}");
    }
}
