//! Tests that every item gets by being in the list.

use super::{ALL, ArgumentDimension, Item, Solution, find};

/// Values inside every range: defaults, else by the argument's name.
pub(super) fn sample(item: &Item) -> Vec<f64> {
    item.arguments
        .iter()
        .map(|argument| argument.default.unwrap_or_else(|| plain_value(argument.name)))
        .collect()
}

fn plain_value(name: &str) -> f64 {
    match name {
        "c0" | "inlet" => 2.0,
        "D" | "dispersion" => 1.3e-7,
        "eta" => 0.5,
        "eta1" => 0.3,
        "chi" | "chi1" | "rate" => 1e-3,
        "velocity" => 1e-4,
        "width" => 0.01,
        "V" => 1e-3,
        "K" => 0.4,
        "variance" => 0.25,
        "length" => 0.05,
        other => panic!("give the argument `{other}` a value for tests"),
    }
}

fn values_on_grid(solution: &dyn Solution, t: f64) -> Vec<f64> {
    let x: Vec<f64> = (-200..=200).map(|idx| f64::from(idx) * 1e-3).collect();
    let zero = vec![0.0; x.len()];
    let mut out = vec![f64::NAN; x.len()];
    solution.fill(t, [&x, &zero, &zero], &mut out);
    out
}

#[test]
fn every_item_is_described() {
    for (idx, item) in ALL.iter().enumerate() {
        assert!(item.source.len() > 20 && item.source.chars().any(|c| c.is_ascii_digit()), "{}", item.name);
        assert!(item.summary.len() > 20, "{}", item.name);
        assert!(item.name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'_'));
        assert_eq!(
            ALL.iter().position(|other| other.name == item.name),
            Some(idx),
            "two are called {}",
            item.name
        );
        assert_eq!(find(item.name).expect("listed").summary, item.summary);
        for argument in item.arguments {
            assert!(argument.doc.len() > 10, "{}({})", item.name, argument.name);
            assert!(argument.range.0 < argument.range.1);
            assert!(
                argument.default.is_none_or(|value| argument.range.0 <= value && value <= argument.range.1)
            );
            assert_eq!(item.arguments.iter().filter(|other| other.name == argument.name).count(), 1);
        }
    }
    assert!(find("no_such_reference").is_none());
}

#[test]
fn every_item_is_finite_from_the_first_moment_on() {
    for item in ALL {
        let solution = (item.build)(&sample(item)).expect(item.name);
        for t in [0.0, 1e-300, 1e-12, 1.0, 619.0, 1510.0, 1e6] {
            for value in values_on_grid(solution.as_ref(), t) {
                assert!(value.is_finite(), "{} at {t} s", item.name);
            }
        }
    }
}

#[test]
fn extreme_arguments_give_numbers() {
    for item in ALL {
        for varied in 0..item.arguments.len() {
            for size in [0.0_f64, 1e-12, 1e-6, 1e6, 1e12] {
                let mut values = sample(item);
                let (low, high) = item.arguments[varied].range;
                values[varied] = size.clamp(low, high);
                // An item may refuse a value (no width, no dispersion) with a sentence.
                let Ok(solution) = (item.build)(&values) else { continue };
                for t in [0.0, 1e-12, 1.0, 1e3, 1e12] {
                    let all_finite =
                        values_on_grid(solution.as_ref(), t).iter().all(|value| value.is_finite());
                    assert!(all_finite, "{}({} = {size}) at {t} s", item.name, item.arguments[varied].name);
                }
            }
        }
    }
}

#[test]
fn wrong_arguments_are_answered_with_a_sentence() {
    let is_sentence = |text: &str| text.ends_with('.') && text.len() > 20;
    for item in ALL {
        let expect_sentence = |values: &[f64]| match (item.build)(values) {
            Ok(_) => panic!("{} accepts {values:?}", item.name),
            Err(text) => assert!(is_sentence(&text), "{}: {text}", item.name),
        };
        expect_sentence(&[]);
        for (idx, argument) in item.arguments.iter().enumerate() {
            let mut wrong = vec![f64::NAN, f64::INFINITY];
            if argument.range.0 > -f64::MAX {
                wrong.push(argument.range.0 - 1.0);
            }
            if argument.range.1 < f64::MAX {
                wrong.push(argument.range.1 + 1.0);
            }
            for value in wrong {
                let mut values = sample(item);
                values[idx] = value;
                expect_sentence(&values);
            }
        }
    }
}

#[test]
fn concentrations_scale_with_the_concentration() {
    for item in ALL {
        let powers = match item.predicts {
            super::Predicts::Concentration | super::Predicts::Total => 1,
            super::Predicts::Moment => 0,
            super::Predicts::Covariance => 2,
            super::Predicts::Gamma => continue,
        };
        let mut scaled = sample(item);
        for (value, argument) in scaled.iter_mut().zip(item.arguments) {
            let of_concentration =
                [ArgumentDimension::Concentration, ArgumentDimension::ConcentrationPerTime];
            if of_concentration.contains(&argument.dimension) {
                *value *= 4.0;
            }
        }
        let plain = values_on_grid((item.build)(&sample(item)).expect(item.name).as_ref(), 619.0);
        let scaled = values_on_grid((item.build)(&scaled).expect(item.name).as_ref(), 619.0);
        for (plain, scaled) in plain.iter().zip(scaled) {
            // Powers of two scale exactly.
            assert_eq!(plain * f64::powi(4.0, powers), scaled, "{}", item.name);
        }
    }
}
