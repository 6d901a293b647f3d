//! What parcels of water bring in and take out, counted: budgets by door, breakthroughs at sides, planes, in boxes.

#[path = "support/scene.rs"]
mod scene;

use lamella::plan::OutputKind;
use scene::{Finished, edited, run, tell};

/// A column that water with A goes through; B is there at the start, and A decays to P.
const COLUMN: &str = "lamella 1
species A, B, P
domain line x = 0 .. 10 m
medium porosity 0.25
boundary left  inflow A = 2 mol/m^3
boundary right outflow
flow uniform 1 m/d
dispersion 0.2 m^2/d
initial B = 1 mol/m^3
reaction decay: A -> P @ 0.2 /d
chemistry splitting strang
particles fluid 100_000
run to 30 d, step 0.1 d
output budget       A, B, P every 10 d
output breakthrough A, B, P at right every 2 d
output breakthrough A, P at x = 5 m every 2 d
output breakthrough A, P at x = 5 m resident on 50 every 2 d
output total        A, B, P every 10 d
";

/// Rows of the last budget of a species: `[amount, entered, left]` by place.
fn budget(finished: &Finished, species: usize) -> Vec<(String, Vec<f64>)> {
    let output = finished.plan.outputs.iter().find(|output| output.kind == OutputKind::Budget);
    let places = finished.plan.places(output.expect("a budget"));
    let last = |place: &String| {
        finished.rows(OutputKind::Budget, species, Some(place)).last().expect("a row").1.clone()
    };
    places.iter().map(|place| (place.clone(), last(place))).collect()
}

fn row(rows: &[(String, Vec<f64>)], place: &str) -> Vec<f64> {
    rows.iter().find(|(own, _)| own == place).expect("the place has a row").1.clone()
}

#[test]
fn a_budget_adds_up_by_door_and_reaction() {
    let finished = run(COLUMN);
    finished.keeps_its_books();
    for species in 0..3 {
        let rows = budget(&finished, species);
        let sum: f64 = rows.iter().take(rows.len() - 2).map(|(_, numbers)| numbers[0]).sum();
        let (inside, defect) = (row(&rows, "inside")[0], row(&rows, "defect")[0]);
        tell(&format!("species {species}: {rows:?}"));
        assert!((inside - sum - defect).abs() < 1e-12, "{sum} {inside} {defect}");
        assert!(defect.abs() < 1e-12 * 15.0, "{defect}");
    }
    let (a, b, p) = (budget(&finished, 0), budget(&finished, 1), budget(&finished, 2));
    // 0.25 · 2 mol/m³ · 1 m/d · 30 d come in, up to one parcel of 2.5·10⁻⁵ m.
    assert!((row(&a, "left")[1] - 15.0).abs() < 1e-4);
    assert_eq!(row(&a, "initial")[0], 0.0);
    assert!((row(&b, "initial")[0] - 2.5).abs() < 1e-12);
    // What A loses P gains.
    assert!((row(&a, "reactions")[0] + row(&p, "reactions")[0]).abs() < 1e-9);
    // Three pore volumes take B out.
    assert!((row(&b, "right")[2] - 2.5).abs() < 0.01);
}

/// Steady decay along the column: c = c0 (…) at the places where it is counted.
///
/// Closed form of the resident concentration: c = 2 c0/(1 + g) exp((1 − g) v x / 2D), g = √(1 + 4kD/v²); its flux over v
/// is c − (D/v) c' = c (1 + g)/2. At the end c' = 0 changes the last metre: the flux there is larger by less than 1 %.
#[test]
fn breakthroughs_are_flux_weighted_or_resident() {
    let finished = run(COLUMN);
    let (k, d, v, c0): (f64, f64, f64, f64) = (0.2, 0.2, 1.0, 2.0);
    let g = (1.0 + 4.0 * k * d / (v * v)).sqrt();
    let resident = |x: f64| 2.0 * c0 / (1.0 + g) * ((1.0 - g) * v * x / (2.0 * d)).exp();
    let flux = |x: f64| resident(x) * (1.0 + g) / 2.0;
    let mean = |place: &str, species: usize| {
        let rows = finished.rows(OutputKind::Breakthrough, species, Some(place));
        let late: Vec<f64> = rows.iter().filter(|(t, _)| *t > 20.1).map(|(_, numbers)| numbers[0]).collect();
        late.iter().sum::<f64>() / late.len() as f64
    };
    let (plane, within) = (mean("plane", 0), mean("box", 0));
    tell(&format!("plane {plane:.4} of {:.4}, box {within:.4} of {:.4}", flux(5.0), resident(5.0)));
    // 10 000 parcels a day pass, and some go back: 1 % in ten days.
    assert!((plane / flux(5.0) - 1.0).abs() < 0.02);
    // 2000 parcels in the box at five times.
    assert!((within / resident(5.0) - 1.0).abs() < 0.01);
    let right = mean("right", 0);
    tell(&format!("right {right:.4} of {:.4}", flux(10.0)));
    assert!((right / flux(10.0) - 1.0).abs() < 0.03);
    // All water that leaves has A and P of the water that came in, and P follows A.
    let both = mean("right", 0) + mean("right", 2);
    assert!((both / c0 - 1.0).abs() < 0.02, "{both}");
}

/// What a wall takes out of still water is in its row, and in the breakthrough of the side.
#[test]
fn what_a_wall_takes_is_in_the_books() {
    let text = "lamella 1
species A
domain line x = 0 .. 12 m
boundary left absorb
boundary right reflect
dispersion 1 m^2/d
initial A = 1 mol/m^3
particles fluid 100_000
run to 1 d, step 0.25 d
output budget A at t = 1 d
output breakthrough A at left at t = 0 d, 1 d
";
    let finished = run(text);
    finished.keeps_its_books();
    let rows = budget(&finished, 0);
    // 2 √(Dt/π)
    let expected = 2.0 / std::f64::consts::PI.sqrt();
    let left = row(&rows, "left");
    tell(&format!("taken {} of {expected}", left[2]));
    assert!((left[2] / expected - 1.0).abs() < 0.02 && left[1] == 0.0);
    let passed = finished.rows(OutputKind::Breakthrough, 0, Some("left")).last().expect("a row").1[2];
    assert!((passed - left[2]).abs() < 1e-9 * expected, "{passed} {left:?}");
}

/// A and B that meet at once: water that leaves carries what is left of one, and their product.
#[test]
fn a_product_that_is_worked_out_when_somebody_looks_leaves_too() {
    let text = edited(COLUMN, "reaction decay: A -> P @ 0.2 /d\nchemistry splitting strang\n", "");
    let text =
        edited(&text, "species A, B, P\n", "species A, B, P\nreaction meeting: A + B -> P @ instant\n");
    let text = edited(&text, "output budget       A, B, P every 10 d\n", "");
    let text = edited(
        &text,
        "dispersion",
        "mixing zones { all: fraction 1, rate 5 /d }\naverage bins 100\ndispersion",
    );
    let text = edited(&text, "step 0.1 d", "step 0.04 d");
    let finished = run(&text);
    finished.keeps_its_books();
    let last = |place: &str, species: usize| {
        finished.rows(OutputKind::Breakthrough, species, Some(place)).last().expect("a row").1.clone()
    };
    let passed: Vec<f64> = (0..3).map(|species| last("right", species)[2]).collect();
    tell(&format!("A, B, P that left: {passed:?}"));
    // B was 2.5 mol; it left as it was, or as P.
    assert!(passed[2] > 0.05, "they meet");
    assert!((passed[1] + passed[2] - 2.5).abs() < 0.01);
    // 7.5 m of the 10 m column's inflow of A have left after 30 d, less what is inside.
    assert!((passed[0] + passed[2] - 0.5 * (30.0 - 10.0)).abs() < 0.1);
}
