//! What a well takes out of water of one concentration, at steps that are short and long for the cells around it.

use lamella::engine::snapshot::{Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::plan::compile::Options;
use lamella::scenario::Settings;
use lamella::source::Sources;

fn run(step: &str) -> Vec<Snapshot> {
    let text = format!(
        "lamella 1\nspecies S\ninitial S = 2.5 mg/L\ndomain rect x = 0 .. 20 m, y = 0 .. 10 m\n\
         boundary left, right inflow S = 2.5 mg/L\nboundary bottom, top reflect\n\
         medium porosity 0.25\n\
         flow darcy {{\n  head left 10 m, right 10 m\n  no_flow bottom, top\n  conductivity 10 m/d\n\
         \x20 well pump at (10.5 m, 5.5 m) rate -5 m^2/d\n  grid 20 x 10\n}}\n\
         dispersion longitudinal 0.1 m, transverse 0.01 m, molecular 0\n\
         particles mass 40_000\nrun to 5 d, step {step}\nseed 3\n\
         output breakthrough S at well pump at t = 5 d\n\
         output total S at t = 5 d\n"
    );
    let checked =
        lamella::check(Sources::single("scene.lam", text), &Settings::default(), &Options::default());
    let plan = checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics)).plan;
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let outcome = lamella::engine::run(&plan, &EngineSettings::default(), &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    });
    assert!(outcome.expect("the scene runs").worst_defect() < 1e-12);
    snapshots
}

/// Reference: `Q c t` of water that has one concentration everywhere, 5 m²/d · 2.5 g/m³ · 5 d, and `φ c` times the area as
/// before. Q Δt/(φV) of the well's cell is 0.1, 1, 10 and 100. The bounds are 4 % and 2 %: 8,500 of 60,000 particles leave by
/// the well, and what steps of a quarter of a cell hold back before it is a third of the water of its four neighbours, 1 %.
#[test]
fn a_well_takes_its_share_at_any_step() {
    for step in ["0.005 d", "0.05 d", "0.5 d", "5 d"] {
        let snapshots = run(step);
        let Values::Rows(rows) = &snapshots[0].values else { panic!("{:?}", snapshots[0].values) };
        let taken = 1e3 * rows[0][0].numbers[2];
        assert!((taken / 62.5 - 1.0).abs() < 0.04, "step {step}: {taken} g/m");
        let Values::Total { amount } = &snapshots[1].values else { panic!("{:?}", snapshots[1].values) };
        assert!((1e3 * amount[0] / 125.0 - 1.0).abs() < 0.02, "step {step}: {} g/m", 1e3 * amount[0]);
    }
}
