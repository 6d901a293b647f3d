//! One token of a shipped scene damaged: the first message points at it. One unit replaced by one of
//! another dimension: refused, with what was found and what was expected.
//!
//! Scenario 1 is damaged in every way, the other scenes in a sample of a fixed stride. `LAMELLA_ALL=1`
//! damages all of them in every way.

mod damage;

use damage::mutants::{self, Mutant};
use damage::{messages, messages_of_syntax, shipped_scenes, sources};
use lamella::check;
use lamella::diagnostic::{Diagnostic, any_fatal};
use lamella::plan::compile::Options;
use lamella::scenario::Settings;
use lamella::units::Dimension;

const SCENARIO_1: &str = "experiments/gramling/gramling.lam";
/// The scenes with every entry of a sweep, and with names of a used scene.
const SWEEPS: [&str; 2] = ["tests/scenes/sweeps.lam", "tests/scenes/study.lam"];
/// Co-prime to the few mutants that each character makes, so that every way of damage is met.
const STRIDE: usize = 5;

fn stride(name: &str) -> usize {
    if name == SCENARIO_1 || SWEEPS.contains(&name) || std::env::var_os("LAMELLA_ALL").is_some() {
        1
    } else {
        STRIDE
    }
}

/// How well the first message of an invalid mutant points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Aim {
    Primary,
    Secondary,
    Missed,
}

fn aim(mutant: &Mutant, first: &Diagnostic) -> Aim {
    let touches = |label: &&lamella::diagnostic::Label| {
        let span = label.span.range();
        label.span.file.0 == 0 && span.start <= mutant.place.end && mutant.place.start <= span.end
    };
    let mut touching = first.labels.iter().filter(touches);
    match touching.clone().find(|label| label.is_primary).or(touching.next()) {
        Some(label) if label.is_primary => Aim::Primary,
        Some(_) => Aim::Secondary,
        None => Aim::Missed,
    }
}

#[derive(Default)]
struct Tally {
    n_invalid: usize,
    n_primary: usize,
    n_secondary: usize,
    missed: Vec<String>,
}

impl Tally {
    fn of(name: &str, text: &str, stride: usize, messages: fn(&str) -> Vec<Diagnostic>) -> Self {
        let mut tally = Self::default();
        for mutant in mutants::of_tokens(text).iter().step_by(stride) {
            let said = messages(&mutant.text);
            if !any_fatal(&said) {
                continue;
            }
            tally.n_invalid += 1;
            let first = &said[0];
            match aim(mutant, first) {
                Aim::Primary => tally.n_primary += 1,
                Aim::Secondary => tally.n_secondary += 1,
                Aim::Missed => {}
            }
            if aim(mutant, first) != Aim::Primary {
                tally.missed.push(describe(name, mutant, first));
            }
        }
        tally
    }

    fn share(&self, n: usize) -> f64 {
        100.0 * n as f64 / self.n_invalid as f64
    }
}

fn describe(name: &str, mutant: &Mutant, first: &Diagnostic) -> String {
    let line = mutant.text[..mutant.place.start].bytes().filter(|&byte| byte == b'\n').count() + 1;
    let place = first.primary_span().map(|span| mutant.text.get(span.range()).unwrap_or(""));
    format!("{name}:{line}: {}: {} {} at {place:?}", mutant.what, first.code.0, first.message)
}

/// Shares of two scenes at a time, in the order of the scenes.
fn tallies(scenes: &[(String, String)]) -> Vec<Tally> {
    let (front, back) = scenes.split_at(scenes.len() / 2);
    let work = |part: &[(String, String)]| -> Vec<Tally> {
        part.iter().map(|(name, text)| Tally::of(name, text, stride(name), messages)).collect()
    };
    std::thread::scope(|scope| {
        let other = scope.spawn(|| work(back));
        let mut all = work(front);
        all.extend(other.join().expect("no mutant makes the checker panic"));
        all
    })
}

#[test]
fn the_first_message_points_at_the_damaged_token() {
    let scenes = shipped_scenes();
    assert!(scenes.iter().any(|(name, _)| name == SCENARIO_1));
    let tallies = tallies(&scenes);
    let mut missed = Vec::new();
    let mut is_below = false;
    for ((name, _), tally) in scenes.iter().zip(&tallies) {
        let (primary, any) = (tally.share(tally.n_primary), tally.share(tally.n_primary + tally.n_secondary));
        println!("{name}: {} invalid, {primary:.2} % by the first label, {any:.2} % by any", tally.n_invalid);
        is_below |= primary < 95.0;
        missed.extend(&tally.missed);
    }
    if let Some(path) = std::env::var_os("LAMELLA_MISSED") {
        let lines: Vec<&str> = missed.iter().map(|line| line.as_str()).collect();
        std::fs::write(path, lines.join("\n")).expect("the list can be written");
    }
    assert!(!is_below, "a scene is below 95 %");
}

/// What the syntax finds by itself should be above what all phases together must reach.
#[test]
fn the_first_message_of_the_syntax_points_at_the_damaged_token() {
    let text = include_str!("scenes/gramling_column.lam");
    let tally = Tally::of("gramling_column", text, 1, messages_of_syntax);
    let share = tally.share(tally.n_primary);
    println!("{} with a message, {share:.2} % by the first label", tally.n_invalid);
    assert!(tally.n_invalid > 1500 && share > 97.0, "{share} %\n{}", tally.missed.join("\n"));
}

/// The dimension of all species of a valid scene, if they are counted alike. A scene that gives the dimension of
/// concentrations in one place is right again with the other one there: `mol/L` instead of `mg/L`. In mass a
/// source may give an amount as well as a concentration.
fn measure_of(text: &str) -> Option<Dimension> {
    let scenario = check(sources(text), &Settings::default(), &Options::default()).scenario?;
    let first = scenario.species.first()?.dimension;
    scenario.species.iter().all(|species| species.dimension == first).then_some(first)
}

#[test]
fn a_unit_of_another_dimension_is_refused_with_found_and_expected() {
    let (mut n_mutants, mut n_otherwise) = (0, 0);
    let mut wrong = Vec::new();
    for (name, text) in shipped_scenes() {
        let measure = measure_of(&text);
        for mutant in mutants::of_units(&text) {
            n_mutants += 1;
            let said = messages(&mutant.text);
            let is_otherwise = || {
                let own = measure_of(&mutant.text);
                own.is_some_and(|own| own == Dimension::MASS_CONCENTRATION || Some(own) != measure)
            };
            if !any_fatal(&said) && is_otherwise() {
                n_otherwise += 1;
                continue;
            }
            let first = said.first();
            let is_named = said
                .iter()
                .filter(|message| message.is_fatal())
                .all(|message| message.found.is_some() && message.expected.is_some());
            if !any_fatal(&said) || !is_named {
                let said = first.map_or("nothing", |first| first.message.as_str());
                wrong.push(format!("{name}: {}: {said}", mutant.what));
            }
        }
    }
    println!("{n_mutants} units replaced, {n_otherwise} rightly valid, {} not refused", wrong.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
