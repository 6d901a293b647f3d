//! The plan: what changes its hash, what is left out and why, and what passes may not change.

use lamella::plan::compile::{Compiled, Options, Selection};
use lamella::plan::{Stage, document};
use lamella::scenario::Settings;
use lamella::source::Sources;

const COLUMN: &str = include_str!("../experiments/gramling/gramling.lam");

fn compile_with(text: &str, settings: &Settings, options: &Options) -> Compiled {
    let checked = lamella::check(Sources::single("scene.lam", text), settings, options);
    let messages: Vec<String> = checked
        .diagnostics
        .iter()
        .map(|diagnostic| format!("{}: {}", diagnostic.code, diagnostic.message))
        .collect();
    checked.compiled.unwrap_or_else(|| panic!("no plan: {messages:#?}"))
}

fn compile(text: &str) -> Compiled {
    compile_with(text, &Settings::default(), &Options::default())
}

fn without_passes(text: &str) -> Compiled {
    compile_with(text, &Settings::default(), &Options { passes: Selection::None, memory: None })
}

/// The column with one piece of text replaced; the piece must be there.
fn edited(from: &str, to: &str) -> String {
    assert!(COLUMN.contains(from), "the column has no `{from}`");
    COLUMN.replace(from, to)
}

#[test]
fn reactions_are_timed_where_they_are_fast() {
    let scene = "lamella 1
species A, B
initial A = 1 mmol/L
reaction near_the_end: A -> B @ if x > 0.9 m then 4 /d else 0 /d
domain line x = 0 m .. 1 m
boundary left, right reflect
particles fluid 100 ordered
run to 5 d, step 0.1 d
output total A at t = 5 d
";
    let compiled = compile(scene);
    let limit = |name: &str| {
        let found = compiled.limits.iter().find(|limit| limit.name.starts_with(name));
        found.map(|limit| limit.value).unwrap_or_else(|| panic!("no {name} among {:#?}", compiled.limits))
    };
    let time = limit("shortest time of reaction `near_the_end`");
    assert!((time / (86_400.0 / 4.0) - 1.0).abs() < 1e-12, "{time}");
    assert!((limit("fastest reaction per step") / 0.4 - 1.0).abs() < 1e-12);
}

#[test]
fn units_layout_comments_and_order_do_not_change_the_hash() {
    let hash = compile(COLUMN).hash;
    let in_metres = COLUMN
        .replace("-7.5 cm .. 7.5 cm", "-0.075 m .. 75 mm")
        .replace("1.3e-3 cm^2/s", "1.3e-7 m^2/s")
        .replace("1.21e-2 cm/s", "0.121 mm/s")
        .replace("0.02 mol/L", "20 mol/m^3");
    assert_eq!(compile(&in_metres).hash, hash, "units");
    let mut lines: Vec<&str> = COLUMN.lines().collect();
    let edition = lines.remove(0);
    let zones = lines.iter().position(|line| line.starts_with("mixing")).expect("zones");
    let block: Vec<&str> = lines.splice(zones..zones + 4, []).collect();
    // Outputs keep their order among themselves: it numbers the tables' rows.
    let (outputs, mut rest): (Vec<&str>, Vec<&str>) =
        lines.into_iter().partition(|line| line.starts_with("output"));
    let (species, mut others): (Vec<&str>, Vec<&str>) =
        rest.drain(..).partition(|line| line.starts_with("species"));
    others.reverse();
    let shuffled = [vec![edition], block, outputs, others, species].concat().join("\n");
    assert_eq!(compile(&shuffled).hash, hash, "order");
    let file = lamella::syntax::parse(lamella::source::FileId(0), COLUMN).0;
    assert_eq!(compile(&lamella::syntax::format(&file, COLUMN)).hash, hash, "layout");
    assert_eq!(compile(&edited("param D   =", "let D =")).hash, hash, "a parameter that became a constant");
    assert_eq!(
        compile(
            &COLUMN
                .replace("chi", "exchange_rate")
                .replace("exchange_rate = exchange_rate)", "chi = exchange_rate)")
        )
        .hash,
        hash,
        "a renamed parameter"
    );
}

#[test]
fn physics_and_seed_change_the_hash() {
    let hash = compile(COLUMN).hash;
    for (from, to) in [
        ("1.3e-3 cm^2/s", "1.4e-3 cm^2/s"),
        ("seed 42", "seed 43"),
        ("step 2 s", "step 1 s"),
        ("bins 300", "bins 301"),
        ("reflect", "open"),
        ("stratified", "random"),
        ("eta = 0.5", "eta = 0.4"),
        ("step 2 s", "step 2 s, normals double"),
    ] {
        assert_ne!(compile(&edited(from, to)).hash, hash, "{from} -> {to}");
    }
}

#[test]
fn settings_of_the_command_line_are_held_to_the_same_checks() {
    let set = |name: &str, value: &str| Settings {
        set: vec![(name.to_owned(), value.to_owned())],
        ..Settings::default()
    };
    let by_hand = compile(&edited("chi = 1e-3 /s ", "chi = 2e-3 /s ")).hash;
    assert_eq!(compile_with(COLUMN, &set("chi", "2e-3 /s"), &Options::default()).hash, by_hand);
    let code = |settings: &Settings| {
        let checked = lamella::check(Sources::single("scene.lam", COLUMN), settings, &Options::default());
        assert!(checked.compiled.is_none());
        checked.diagnostics[0].code.0
    };
    assert_eq!(code(&set("chii", "2e-3 /s")), "P001");
    assert_eq!(code(&set("chi", "2 /s")), "P002");
    assert_eq!(code(&set("eta", "1 m")), "U104");
}

#[test]
fn sizes_of_the_command_line_stand_in_place_of_the_scenes() {
    let set = |list: &[(&str, &str)]| Settings {
        set: list.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect(),
        ..Settings::default()
    };
    let hash = |text: &str, list: &[(&str, &str)]| compile_with(text, &set(list), &Options::default()).hash;
    let by_hand = edited("fluid 1_000_000", "fluid 100_000")
        .replace("step 2 s", "step 1 s")
        .replace("average bins 300", "average bins 200");
    let all = [("particles", "1e5"), ("step", "1000 ms"), ("bins", "200")];
    assert_eq!(hash(COLUMN, &all), compile(&by_hand).hash);
    assert_ne!(hash(COLUMN, &all[..2]), compile(&by_hand).hash, "all three count");
    // Of two the last one counts, whatever stands between them.
    let twice = [("step", "4 s"), ("particles", "1e5"), ("bins", "200"), ("step", "1 s")];
    assert_eq!(hash(COLUMN, &twice), compile(&by_hand).hash);
    // A parameter of that name comes first.
    let own = edited("param chi = 1e-3 /s", "param step = 1e-3 /s")
        .replace("rate chi", "rate step")
        .replace("chi = chi", "chi = step");
    assert_eq!(hash(&own, &[("step", "2e-3 /s")]), compile(&own.replace("1e-3 /s", "2e-3 /s")).hash);
    let code = |text: &str, name: &str, value: &str| {
        let checked =
            lamella::check(Sources::single("scene.lam", text), &set(&[(name, value)]), &Options::default());
        checked.diagnostics[0].code.0
    };
    assert_eq!(code(COLUMN, "step", "2 m"), "U104");
    assert_eq!(code(COLUMN, "particles", "2.5"), "M005");
    assert_eq!(code(COLUMN, "bins", "(10, 10)"), "D009");
}

#[test]
fn the_column_carries_one_field_in_one_zone_and_says_why() {
    let compiled = compile(COLUMN);
    assert_eq!(compiled.plan.components.len(), 1);
    assert_eq!(lamella::plan::cost::n_stored_values(&compiled.plan), 1);
    assert_eq!(compiled.plan.stages, [Stage::FusedStep, Stage::Observe]);
    let b = compiled.plan.species.iter().find(|species| species.name == "B").expect("species B");
    assert_eq!((b.constant, b.terms.as_slice()), (20.0, &[(0, -1.0)][..]), "B = c0 - A");
    for what in ["zone `fast`", "species `B`", "neighbour search", "reaction in a step"] {
        assert!(
            compiled.left_out.iter().any(|item| item.what.contains(what)),
            "{what}: {:?}",
            compiled.left_out
        );
    }
}

#[test]
fn relations_are_found_however_they_are_written() {
    for initial in
        ["if x < 0 cm then 0 else c0", "if x >= 0 cm then c0 else 0", "c0 - (if x < 0 cm then c0 else 0)"]
    {
        let compiled = compile(&edited("initial B = c0 - A", &format!("initial B = {initial}")));
        assert_eq!(compiled.plan.components.len(), 1, "{initial}");
    }
    let compiled = compile(&edited("initial B = c0 - A", "initial B = if x < 1 cm then 0 else c0"));
    assert_eq!(compiled.plan.components.len(), 2, "another interface is another field");
}

#[test]
fn what_nobody_reads_leaves_the_plan_as_it_was() {
    let plain = compile(COLUMN);
    let with_species =
        edited("species AB", "species C, E \"never read\"\nspecies AB") + "initial C = 3 * A\n";
    assert_eq!(compile(&with_species).hash, plain.hash);
    let with_twin = format!("{COLUMN}output total AB every 10 s\n");
    assert_eq!(compile(&with_twin).hash, plain.hash, "an output twice");
    let with_empty_zone = edited("  slow:", "  none: fraction 0, rate 3e-4 /s\n  slow:");
    assert_eq!(compile(&with_empty_zone).hash, plain.hash, "a zone of nothing");
    let halves = edited(
        "  slow: fraction eta,     rate chi",
        "  slow: fraction eta / 2, rate chi\n  more: fraction eta / 2, rate chi",
    );
    assert_eq!(compile(&halves).plan.mixing.expect("zones").zones.len(), 2, "equal rates are one zone");
    let wide = edited(
        "domain line x = -7.5 cm .. 7.5 cm, frame moving v",
        "domain rect x = -7.5 cm .. 7.5 cm, y = 0 cm .. 1 cm, frame moving (v, 0 m/s)",
    )
    .replace("boundary left, right reflect", "boundary left, right, bottom, top reflect")
    .replace("flow uniform v", "flow uniform (v, 0 m/s)")
    .replace("average bins 300", "average bins 300 x 1");
    let wide = compile(&wide);
    assert_eq!(wide.plan.axes.len(), 1, "an axis without gradient");
    assert_eq!(wide.plan.walk.spread, plain.plan.walk.spread);
}

#[test]
fn stages_follow_from_what_is_left() {
    let still = edited("dispersion D\n", "").replace("param D", "let D");
    let still = compile(&still.replace("reference well_mixed", "# ").replace("reference limit", "# "));
    assert!(!still.plan.stages.contains(&Stage::FusedStep) && !still.plan.stages.contains(&Stage::Move));
    let never = compile(&edited("rate chi", "rate 0 /s"));
    assert_eq!(never.plan.stages, [Stage::Move, Stage::Bound, Stage::Observe], "no zone exchanges in a step");
    let literal = without_passes(COLUMN);
    assert_eq!(literal.plan.stages, [Stage::Mix, Stage::Move, Stage::Bound, Stage::Average, Stage::Observe]);
    assert_eq!(literal.plan.components.len(), 3, "nothing is left out without passes");
    assert!(literal.left_out.is_empty());
}

#[test]
fn a_plan_document_reads_back_and_notices_changes() {
    let compiled = compile(COLUMN);
    let sources = Sources::single("scene.lam", COLUMN);
    let checked = lamella::check(sources, &Settings::default(), &Options::default());
    let scenario = checked.scenario.expect("the scene is right");
    let sources = [document::EmbeddedSource::new("scene.lam", COLUMN)];
    let text = document::write(&compiled, &scenario, &sources, &[]);
    let (plan, evaluation) = document::read(&text).expect("the document reads back");
    assert_eq!(plan, compiled.plan);
    assert_eq!(evaluation, compiled.evaluation);
    let changed = text.replacen("step: 2.0", "step: 3.0", 1);
    assert_ne!(changed, text);
    assert!(document::read(&changed).expect_err("changed by hand").contains("hash"));
}

#[test]
fn limits_refuse_at_the_line_with_what_would_work() {
    let messages = |text: &str| {
        lamella::check(Sources::single("scene.lam", text), &Settings::default(), &Options::default())
    };
    let coarse = edited("step 2 s", "step 3000 s").replace("run to 1510 s", "run to 6000 s");
    let checked = messages(&coarse);
    let refusal = checked.diagnostics.iter().find(|d| d.code.0 == "N202").expect("refused");
    let span = refusal.primary_span().expect("a place");
    assert_eq!(checked.sources.slice(span), "3000 s");
    assert!(refusal.help[0].contains("step 200 s"), "{:?}", refusal.help);
    let works = messages(&coarse.replace("step 3000 s", "step 200 s"));
    assert!(works.compiled.is_some(), "the step of the help works: {:?}", works.diagnostics);
    let few = messages(&edited("1_000_000", "500"));
    assert!(few.diagnostics.iter().any(|d| d.code.0 == "N201"), "{:?}", few.diagnostics);
    let large = lamella::check(
        Sources::single("scene.lam", edited("1_000_000", "1e10")),
        &Settings::default(),
        &Options { passes: Selection::All, memory: Some(1 << 30) },
    );
    assert!(large.compiled.is_none() && large.diagnostics.iter().any(|d| d.code.0 == "N301"));
}

/// A front whose bins disperse, with one dispersion coefficient, number of bins and of particles.
fn bins_scene(dispersion: &str, bins: &str, particles: &str) -> String {
    format!(
        "lamella 1
species A
domain line x = -1 m .. 1 m
boundary left, right reflect
dispersion {dispersion} m^2/s
mixing zones {{
  fast: fraction 0.5, rate instant
  slow: fraction 0.5, rate 1e-4 /s
}}
average bins {bins}
initial A = if x < 0 cm then 1 mol/L else 0
particles fluid {particles} stratified
run to 48 h, step 0.5 h
output profile A at t = 24 h, 48 h
"
    )
}

#[test]
fn the_help_about_bins_names_what_works() {
    let messages = |text: &str| {
        lamella::check(Sources::single("scene.lam", text), &Settings::default(), &Options::default())
            .diagnostics
    };
    let help = |text: &str| {
        let all = messages(text);
        let message = all.iter().find(|d| ["N103", "N203"].contains(&d.code.0));
        message.unwrap_or_else(|| panic!("{all:?}")).help[0].clone()
    };
    let after = |text: &str, mark: &str| {
        let rest = text.split_once(mark).unwrap_or_else(|| panic!("`{mark}` in {text}")).1;
        rest.split_whitespace().next().expect("a number").to_owned()
    };
    // More bins, which the particles of the scene fill.
    let bins = after(&help(&bins_scene("1e-6", "20", "1e6")), "at least ");
    assert_eq!(messages(&bins_scene("1e-6", &bins, "1e6")), []);
    // More bins and more particles.
    let both = help(&bins_scene("1e-10", "20", "1e5"));
    let (bins, particles) = (after(&both, "at least "), after(&both, "and "));
    assert_eq!(messages(&bins_scene("1e-10", &bins, &particles)), []);
    // More bins than there can be: another coefficient, or another rate.
    let none = help(&bins_scene("1e-24", "20", "1e5"));
    assert!(none.contains("no number of bins"), "{none}");
    assert_eq!(messages(&bins_scene(&after(&none, "coefficient of "), "20", "1e5")), []);
    assert_eq!(messages(&bins_scene("1e-24", "20", "1e5").replace("rate 1e-4 /s", "rate instant")), []);
}
