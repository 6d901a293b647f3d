//! Runs that stop: the code, the line, and what would work does work.

use crate::program::Folder;
use serde_json::Value;

/// A batch of one parcel, from line 5 on.
fn batch(chemistry: &str, initial: &str, run: &str, output: &str) -> String {
    format!(
        "lamella 1\ndomain line x = 0 m .. 1 m\nboundary left, right reflect\nparticles fluid 1\n{chemistry}\n\
         initial {initial}\n{run}\noutput total {output}\n"
    )
}

/// The error that a run ends with.
#[track_caller]
fn stop(folder: &Folder) -> Value {
    let finished = folder.lamella(&["run", "s.lam", "--out", "out", "--message-format", "json"]).exits(1);
    let messages = finished.messages();
    messages.into_iter().find(|message| message["severity"] == "error").expect("an error is told")
}

/// The line and the text of the first label.
fn place(message: &Value) -> (u64, &str) {
    let label = &message["labels"][0];
    assert_eq!(label["primary"], true, "{message}");
    (label["line"].as_u64().expect("a line"), label["text"].as_str().expect("a text"))
}

fn help(message: &Value) -> &str {
    message["help"][0].as_str().expect("a help")
}

const OSCILLATOR: &str = "species X, Y
reaction feed:       -> X    @ 1e3 mol/L/s
reaction turn:     X -> Y    @ 3e3 /s
reaction grow: 2 X + Y -> 3 X @ 1e3 L^2/mol^2/s
reaction decay:    X ->      @ 1e3 /s";

#[test]
fn a_step_with_too_many_sub_steps_names_one_that_works() {
    let folder = Folder::new();
    let scene = batch(OSCILLATOR, "X = 1 mol/L, Y = 1 mol/L", "run to 20 s, step 20 s", "X at t = 20 s");
    folder.write("s.lam", &scene);
    let message = stop(&folder);
    assert_eq!(message["code"], "R106", "{message}");
    assert_eq!(place(&message).0, 11, "{message}");
    // The fastest reaction is shown beside it.
    assert!(message["labels"].as_array().is_some_and(|labels| labels.len() == 2), "{message}");
    let step = help(&message).split('`').nth(1).expect("a step is named");
    let step = step.strip_prefix("step ").expect("a step is named").replace(' ', "");
    folder.lamella(&["run", "s.lam", "--out", "out", "--set", &format!("step={step}")]).exits(0);
    // It is not shorter than it need be: four times as long is too long.
    let seconds: f64 = step.strip_suffix('s').and_then(|number| number.parse().ok()).expect("seconds");
    let longer = format!("step={}s", 4.0 * seconds);
    folder.lamella(&["run", "s.lam", "--out", "out", "--set", &longer]).exits(1).says("[R106]");
    // The same under stress is a row with code and line.
    let trials =
        ["stress", "s.lam", "--knobs", "rates", "--decades", "0", "--out", "st", "--message-format", "json"];
    let row: Value = serde_json::from_str(folder.lamella(&trials).exits(0).stdout.trim()).expect("a row");
    assert_eq!((&row["fate"], &row["code"], &row["line"]), (&"stopped".into(), &"R106".into(), &11.into()));
}

/// An explicit integrator that was asked for and cannot do it names the one that can.
#[test]
fn a_stiff_network_with_an_explicit_integrator_names_the_other() {
    let folder = Folder::new();
    let chemistry = |integrator: &str| {
        format!(
            "species A, B, C\nreaction both: A <-> B @ forward 1e3 /s, backward 1e3 /s\n\
             reaction end: 2 B -> C @ 1 L/mol/s\nchemistry integrator {integrator}"
        )
    };
    let scene = |integrator| {
        batch(&chemistry(integrator), "A = 1 mol/L", "run to 20 s, step 20 s", "A, B, C at t = 20 s")
    };
    folder.write("s.lam", scene("explicit"));
    let message = stop(&folder);
    assert_eq!(message["code"], "R106", "{message}");
    assert!(help(&message).contains("`chemistry integrator rosenbrock`"), "{message}");
    for integrator in ["rosenbrock", "auto"] {
        folder.write("s.lam", scene(integrator));
        folder.lamella(&["run", "s.lam", "--out", integrator]).exits(0);
    }
}

#[test]
fn reactions_that_cannot_be_followed_show_the_line_of_their_rate() {
    let cases = [
        // 1/A = 1 mol/L - t: infinite at 1 s.
        (
            "species A, B\nreaction slow: B -> A @ 1e-9 /s\nreaction growth: 2 A -> 3 A @ 1 L/mol/s",
            "A = 1 mol/L",
            [6, 7],
        ),
        ("species A, B\nreaction odd: A -> B @ 1 mol^2/L^2/s / B", "A = 1 mol/L", [6, 6]),
    ];
    for (chemistry, initial, lines) in cases {
        let folder = Folder::new();
        folder.write("s.lam", batch(chemistry, initial, "run to 10 s, step 10 s", "A, B at t = 10 s"));
        let message = stop(&folder);
        assert_eq!(message["code"], "R107", "{message}");
        let (line, text) = place(&message);
        assert!(lines.contains(&line) && !text.is_empty(), "{message}");
        assert!(!help(&message).is_empty(), "{message}");
        // All reactions that change the species are shown.
        let shown: Vec<u64> = message["labels"]
            .as_array()
            .expect("labels")
            .iter()
            .filter_map(|label| label["line"].as_u64())
            .collect();
        assert!(lines.iter().all(|line| shown.contains(line)), "{message}");
    }
}

/// A flow that cannot be solved for is shown at its block; with the bounds that the help asks for it runs.
#[test]
fn a_flow_without_a_solution_shows_its_block() {
    let scene = |conductivity: &str| {
        format!(
            "lamella 1\nspecies A\ndomain rect x = 0 .. 100 m, y = 0 .. 40 m\nboundary left inflow A = 1 mol/m^3\n\
             boundary right outflow\nboundary bottom, top reflect\nflow darcy {{\n  head left 101 m, right 100 m\n  \
             no_flow bottom, top\n  conductivity {conductivity}\n  grid 100 x 40\n}}\n\
             dispersion longitudinal 0.1 m, transverse 0.01 m, molecular 1e-9 m^2/s\nparticles mass 1000\n\
             run to 1 d, step 0.5 d\noutput total A at t = 1 d\n"
        )
    };
    let field = |length: &str| {
        format!("lognormal(geometric_mean = 10 m/d, variance = 1, covariance = gaussian({length}, {length}))")
    };
    let decades = |low: &str| format!("if x > 50 m then {low} else 1e8 m/d");
    let cases = [
        (decades("1e-12 m/d"), "did not converge", decades("max(1e-12 m/d, 1e6 m/d)")),
        (field("1e6 m"), "periodic box", field("5 m")),
    ];
    for (wrong, why, right) in cases {
        let folder = Folder::new();
        folder.write("s.lam", scene(&wrong));
        let message = stop(&folder);
        assert_eq!(message["code"], "R108", "{message}");
        assert!(message["message"].as_str().is_some_and(|text| text.contains(why)), "{message}");
        assert_eq!(place(&message), (7, "this flow"));
        assert!(help(&message).contains("`max` and `min`"), "{message}");
        folder.write("s.lam", scene(&right));
        folder.lamella(&["run", "s.lam", "--out", "right"]).exits(0);
    }
}

/// Parcels of water need to know what the water through a side carries: the side is shown, and what would do runs.
#[test]
fn water_through_a_side_that_does_not_say_so_shows_the_side() {
    let scene = |right: &str| {
        format!(
            "lamella 1\nspecies A\ndomain line x = 0 .. 10 m\nboundary left inflow A = 1 mol/m^3\nboundary right {right}\n\
             flow uniform 1 m/d\ndispersion 0.1 m^2/d\nparticles fluid 1000\nrun to 1 d, step 0.5 d\n\
             output total A at t = 1 d\n"
        )
    };
    let folder = Folder::new();
    folder.write("s.lam", scene("reflect"));
    let message = stop(&folder);
    assert_eq!(message["code"], "R108", "{message}");
    let text = message["message"].as_str().unwrap_or_default();
    assert!(text.contains("`right`") && text.contains("reflects"), "{message}");
    assert_eq!(place(&message), (5, "nothing says what this water carries"));
    assert!(help(&message).contains("`inflow`"), "{message}");
    folder.write("s.lam", scene("outflow"));
    folder.lamella(&["run", "s.lam", "--out", "right"]).exits(0);
}
