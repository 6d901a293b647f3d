//! Tests that every function gets by being in the list.

use super::{ALL, Item, Mismatch, Step, find};
use crate::maths::operator::{Binary, Unary};
use crate::units::Dimension;

/// SI values of the argument of that name, none at a place where the function is special.
fn samples(name: &str) -> &'static [f64] {
    match name {
        "c" | "I" => &[1e-6, 0.3, 2.0, 450.0],
        "K" | "Ki" => &[0.02, 1.5, 30.0],
        "A" => &[1e-3, 4e9],
        "Ea" => &[2e4, 9e4],
        "T" => &[278.15, 298.15, 350.0],
        "z" => &[-2.0, 1.0, 3.0],
        other => panic!("give the argument `{other}` values for tests"),
    }
}

/// All combinations of the samples.
fn points(item: &Item) -> Vec<Vec<f64>> {
    item.arguments.iter().fold(vec![Vec::new()], |points, (name, _)| {
        let with = |point: &Vec<f64>, value: f64| [point.as_slice(), &[value]].concat();
        points.iter().flat_map(|point| samples(name).iter().map(move |value| with(point, *value))).collect()
    })
}

fn dimensions(item: &Item) -> Vec<Option<Dimension>> {
    let of = |name: &str| match name {
        "c" | "K" | "Ki" | "I" => Dimension::MOLAR_CONCENTRATION,
        "A" => Dimension::RATE,
        "Ea" => Dimension::new(2, 1, -2, -1),
        "T" => Dimension::TEMPERATURE,
        _ => Dimension::NONE,
    };
    item.arguments.iter().map(|(name, _)| Some(of(name))).collect()
}

/// A number with its derivative.
type Dual = (f64, f64);

fn unary(operator: Unary, (a, da): Dual) -> Dual {
    let value = operator.apply(a);
    let slope = match operator {
        Unary::Negate => -1.0,
        Unary::Exp => value,
        Unary::Sqrt => 0.5 / value,
        other => panic!("give {other:?} a derivative"),
    };
    (value, slope * da)
}

fn binary(operator: Binary, (a, da): Dual, (b, db): Dual) -> Dual {
    let value = operator.apply(a, b);
    let slope = match operator {
        Binary::Add => da + db,
        Binary::Subtract => da - db,
        Binary::Multiply => da * b + a * db,
        Binary::Divide => (da - value * db) / b,
        // The base of all powers here is a constant.
        Binary::Power => value * crate::maths::scalar::ln(a) * db,
        other => panic!("give {other:?} a derivative"),
    };
    (value, slope)
}

#[test]
fn every_function_is_described_and_cites_its_source() {
    for (idx, item) in ALL.iter().enumerate() {
        assert!(item.source.len() > 20 && item.source.chars().any(|c| c.is_ascii_digit()), "{}", item.name);
        assert!(item.summary.len() > 15 && item.equation.len() > 5, "{}", item.name);
        assert_eq!(ALL.iter().position(|other| other.name == item.name), Some(idx), "{} twice", item.name);
        assert_eq!(find(item.name).map(|found| found.equation), Some(item.equation));
        assert!(item.arguments.iter().all(|(_, doc)| doc.len() > 10), "{}", item.name);
    }
    assert!(find("no_such_function").is_none());
}

#[test]
fn every_formula_takes_just_its_arguments() {
    for item in ALL {
        let used = |idx: usize| item.formula.contains(&Step::Argument(idx));
        assert!((0..item.arguments.len()).all(used), "{} leaves an argument out", item.name);
        assert!(!used(item.arguments.len()), "{} takes one more", item.name);
        let n_taken = |step: &Step| match step {
            Step::Argument(_) | Step::Number(_) => 0_i32,
            Step::Unary(_) => 1,
            Step::Binary(_) => 2,
        };
        let left = item.formula.iter().fold(0, |n, step| n - n_taken(step) + 1);
        assert_eq!(left, 1, "{} leaves {left} values", item.name);
        assert!(item.value(&[]).is_none(), "{}", item.name);
    }
}

#[test]
fn every_dimension_is_checked() {
    for item in ALL {
        let right = dimensions(item);
        let value = (item.dimension)(&right).expect(item.name);
        let zeros = vec![None; right.len()];
        assert!((item.dimension)(&zeros).is_ok(), "{}: the literal zero fits anything", item.name);
        for idx in 0..right.len() {
            let mut wrong = right.clone();
            wrong[idx] = Some(Dimension::LENGTH);
            match (item.dimension)(&wrong) {
                Ok(other) => assert_ne!(other, value, "{}: argument {idx} may be anything", item.name),
                Err(Mismatch { argument, expected }) => {
                    assert!(wrong[argument] != Some(expected), "{}: blames {argument}", item.name);
                }
            }
        }
    }
}

#[test]
fn every_derivative_is_that_of_finite_differences() {
    for item in ALL {
        for point in points(item) {
            for idx in 0..point.len() {
                let seeded: Vec<Dual> = point
                    .iter()
                    .enumerate()
                    .map(|(k, value)| (*value, f64::from(u8::from(k == idx))))
                    .collect();
                let (_, slope) = item.follow(&seeded, |value| (value, 0.0), unary, binary).expect(item.name);
                let h = 1e-5 * point[idx].abs();
                let moved = |by: f64| {
                    let mut point = point.clone();
                    point[idx] += by;
                    item.value(&point).expect(item.name)
                };
                let difference = (moved(h) - moved(-h)) / (2.0 * h);
                // Central differences: h² of the third derivative, and the rounding of values over h.
                let allowed = 1e-6 * slope.abs() + 4.0 * f64::EPSILON * moved(0.0).abs() / h;
                assert!(
                    (difference - slope).abs() <= allowed,
                    "{}{point:?}: {difference} {slope}",
                    item.name
                );
            }
        }
    }
}

#[test]
fn every_value_is_finite_and_not_negative() {
    for item in ALL {
        for point in points(item) {
            for idx in 0..point.len() {
                for extreme in [0.0, 1e-300, 1e12] {
                    let mut point = point.clone();
                    let name = item.arguments[idx].0;
                    // No temperature is zero; charges and ionic strengths of water are no 1e12.
                    if (name == "T" && extreme < 1.0) || (matches!(name, "z" | "I") && extreme > 1.0) {
                        continue;
                    }
                    point[idx] = extreme;
                    let value = item.value(&point).expect(item.name);
                    assert!(value.is_finite() && value >= 0.0, "{}{point:?} = {value}", item.name);
                }
            }
        }
    }
}

/// Values worked out by hand from the equations in the sources.
#[test]
fn known_values() {
    let value =
        |name: &str, arguments: &[f64]| find(name).and_then(|item| item.value(arguments)).expect(name);
    assert_eq!(value("monod", &[3.0, 1.0]), 0.75);
    assert_eq!(value("inhibit", &[3.0, 1.0]), 0.25);
    assert_eq!(value("haldane", &[2.0, 1.0, 4.0]), 0.5);
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12 * b.abs(), "{a} {b}");
    // Ea = R · 1000 K, so that the exponent is −1000/T.
    close(value("arrhenius", &[2.0, 8_314.462_618_153_24, 500.0]), 2.0 * 0.135_335_283_236_612_7);
    // √I = 0.1: 10^(−0.5085 · 4 · 0.1) and 10^(−0.5085 · 4 · (0.1/1.1 − 0.003)).
    close(value("debye_huckel", &[2.0, 10.0]), 0.626_036_997_672_642_9);
    close(value("davies", &[-2.0, 10.0]), 0.662_510_718_722_476_4);
}
