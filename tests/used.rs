//! Scenes that use others: what they are put together from, and that they run as if written in one file.

use lamella::Checked;
use lamella::plan::compile::Options;
use lamella::scenario::Settings;
use lamella::source::Sources;
use lamella::syntax::tree::{File, StatementKind};

const COLUMN: &str = r#"lamella 1
title "A column"
param v  = 1e-5 m/s
param D  = 1e-9 m^2/s
param C0 = 1 mol/m^3
species A "tracer"
domain line x = 0 m .. 1 m, frame moving v
boundary left, right reflect
flow uniform v
dispersion D
average bins 10
initial A = if x < 0.5 m then C0 else 0
particles fluid 1000 stratified
run to 10 s, step 1 s
output profile A at t = 10 s
measure mass = integral(profile.A)
sweep own { step 1 s, 2 s }
"#;

/// What is written about the column, with and without its alias.
const STUDY: &str = r#"
reference exact for ALIAS.A = 0.5 * ALIAS.C0 * erfc((x - 0.5 m) / (2 * sqrt(ALIAS.D * t)))
measure err = l2(ALIAS.profile.A - exact) / l2(exact) over x = 0.1 m .. 0.9 m
"#;

fn check_with(scene: &str, used: &[(&str, &str)], settings: &Settings) -> Checked {
    let mut sources = Sources::single("study/scene.lam", scene);
    for (name, text) in used {
        sources.add(format!("study/{name}"), *text);
    }
    lamella::check(sources, settings, &Options::default())
}

#[track_caller]
fn check(scene: &str, used: &[(&str, &str)]) -> Checked {
    let checked = check_with(scene, used, &Settings::default());
    let told: Vec<_> = checked.diagnostics.iter().map(|it| format!("{}: {}", it.code, it.message)).collect();
    assert!(checked.compiled.is_some(), "{told:#?}");
    assert!(!told.iter().any(|message| message.starts_with('D')), "{told:#?}");
    checked
}

fn hash(checked: &Checked) -> &str {
    &checked.compiled.as_ref().expect("a plan").hash
}

fn in_one_file(column: &str) -> String {
    let column = column.lines().filter(|line| !line.starts_with("sweep")).collect::<Vec<_>>().join("\n");
    format!("{column}\n{}", STUDY.replace("ALIAS.", ""))
}

#[test]
fn a_used_scene_runs_as_if_it_were_written_in_place() {
    let scene = format!("lamella 1\nuse \"column.lam\" as column\n{}", STUDY.replace("ALIAS", "column"));
    let used = check(&scene, &[("column.lam", COLUMN)]);
    let written = check(&in_one_file(COLUMN), &[]);
    assert_eq!(hash(&used), hash(&written));
    let evaluation = |checked: &Checked| {
        serde_json::to_string(&checked.compiled.as_ref().expect("a plan").evaluation).expect("JSON")
    };
    assert_eq!(evaluation(&used), evaluation(&written), "references and measures");
    let scenario = used.scenario.expect("a scene");
    assert_eq!(scenario.title.as_deref(), Some("A column"));
    assert!(scenario.sweeps.is_empty(), "the sweeps of a used scene are its own");
    // A title of the file that uses it comes first.
    let titled = check(&format!("{scene}\ntitle \"A study\"\n"), &[("column.lam", COLUMN)]);
    assert_eq!(titled.scenario.expect("a scene").title.as_deref(), Some("A study"));
    // The only reference may be called so.
    let short =
        STUDY.replace("ALIAS", "column").replace("- exact", "- reference").replace("(exact)", "(reference)");
    let short =
        check(&format!("lamella 1\nuse \"column.lam\" as column\n{short}"), &[("column.lam", COLUMN)]);
    assert_eq!(evaluation(&short), evaluation(&written));
    // Settings reach the parameters of the used scene.
    let set = Settings { set: vec![("D".to_owned(), "2e-9 m^2/s".to_owned())], ..Settings::default() };
    let set = check_with(&scene, &[("column.lam", COLUMN)], &set);
    let edited = COLUMN.replace("param D  = 1e-9", "param D  = 2e-9");
    assert_eq!(hash(&set), hash(&check(&in_one_file(&edited), &[])));
}

fn two_scenes(first: &str, second: &str) -> String {
    let study = |alias: &str| {
        STUDY
            .replace("ALIAS", alias)
            .replace("exact", &format!("exact_{alias}"))
            .replace("err", &format!("err_{alias}"))
    };
    format!(
        "lamella 1\nuse \"coarse.lam\" as coarse\nuse \"sub/fine.lam\" as fine\n{}{}\n\
         let half = 0.5 * fine.D\n\
         measure spread = half * 1 s / (1 m^2)\n\
         let least = 2\n\
         sweep one of {first} {{ {first}.D 1e-9 m^2/s, 3e-9 m^2/s\n replicates least }}\n\
         sweep two of {second} {{ bins 10, 20\n expect err_{second} < 1 }}\n\
         report convergence err_{first} against D\n\
         report convergence err_{second} against bins\n",
        study("coarse"),
        study("fine")
    )
}

#[test]
fn each_of_two_used_scenes_has_its_own_statements() {
    let fine = COLUMN.replace("average bins 10", "average bins 20").replace("C0", "inlet");
    let used = [("coarse.lam", COLUMN), ("sub/fine.lam", &fine)];
    let scene = two_scenes("coarse", "fine").replace("fine.C0", "fine.inlet");
    let coarse = check(&scene, &used);
    assert_eq!(hash(&coarse), hash(&check(&in_one_file(COLUMN), &[])));
    let names = |checked: &Checked| -> Vec<String> {
        checked.scenario.iter().flat_map(|it| &it.measures).map(|it| it.name.clone()).collect()
    };
    assert_eq!(names(&coarse), ["mass", "err_coarse"]);
    let sweeps = |checked: &Checked| -> Vec<(String, usize)> {
        let scenario = checked.scenario.as_ref().expect("a scene");
        scenario.sweeps.iter().map(|sweep| (sweep.name.clone(), scenario.reports.len())).collect()
    };
    assert_eq!(sweeps(&coarse), [("one".to_owned(), 1)]);
    // The first sweep says which scene is run.
    let swapped = two_scenes("fine", "coarse").replace("fine.C0", "fine.inlet");
    let other = check(&swapped, &used);
    assert_eq!(names(&other), ["mass", "err_fine", "spread"]);
    assert_eq!(sweeps(&other), [("one".to_owned(), 1)]);
    assert_eq!(other.scenario.expect("a scene").bins.expect("bins").value, [20]);
    // The tree of each can be had by its alias.
    let base = |alias: Option<&str>| lamella::base(&coarse.file, &coarse.sources, alias);
    assert_eq!(base(None), base(Some("coarse")));
    assert_eq!(measures(&base(Some("fine"))), ["mass", "err_fine", "spread"]);
    assert_eq!(measures(&base(Some("coarse"))), ["mass", "err_coarse"]);
}

fn measures(file: &File) -> Vec<&str> {
    let of_measures = file.statements.iter().filter_map(|statement| match &statement.kind {
        StatementKind::Measure(measure) => Some(measure.name.value.as_str()),
        _ => None,
    });
    of_measures.collect()
}

/// A mistake in the scene of the second sweep stops the whole, once.
#[test]
fn all_used_scenes_are_checked() {
    let fine = COLUMN.replace("dispersion D", "dispersion v");
    let scene = two_scenes("coarse", "fine");
    let checked =
        check_with(&scene, &[("coarse.lam", COLUMN), ("sub/fine.lam", &fine)], &Settings::default());
    assert!(checked.scenario.is_none());
    let codes: Vec<&str> = checked.diagnostics.iter().map(|message| message.code.0).collect();
    assert_eq!(codes, ["U104"]);
    let place = checked.diagnostics[0].primary_span().expect("a place");
    assert_eq!(checked.sources.file(place.file).name, "study/sub/fine.lam");
    assert_eq!(checked.sources.slice(place), "v");
}

#[test]
fn places_stay_in_their_files() {
    let scene = format!("lamella 1\nuse \"column.lam\" as column\n{}", STUDY.replace("ALIAS", "column"));
    let checked = check(&scene, &[("column.lam", COLUMN)]);
    let base = lamella::base(&checked.file, &checked.sources, Some("column"));
    for statement in &base.statements {
        let keyword = checked.sources.slice(statement.keyword);
        assert!(lamella::syntax::STATEMENT_KEYWORDS.contains(&keyword), "{keyword}");
        if let StatementKind::Reference(reference) = &statement.kind {
            assert_eq!(reference.target.species[0].value, "A");
            assert_eq!(checked.sources.slice(reference.target.species[0].span), "A");
        }
    }
}
