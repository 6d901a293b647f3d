//! Numbers with their units as a page shows them.
//!
//! Owns the shapes of texts. May use `display`. It deliberately rounds: tables beside the page hold
//! all digits.

use super::super::display::{self, Shown};
use super::super::scale::{power_of_ten, superscript};
use crate::maths::scalar::log10;

/// How values up to `largest` of an SI unit are shown.
pub fn shown(unit: &str, largest: f64) -> Shown {
    match unit {
        "s" => display::time(largest),
        "m" => display::length(largest),
        "" | "1" => Shown { factor: 1.0, text: "–".to_owned() },
        other => display::of_unit(other, largest),
    }
}

/// `wall time (s)`, `particles (–)`.
pub fn label(what: &str, shown: &Shown) -> String {
    format!("{what} ({})", shown.text)
}

/// `0.25 s`; no unit for plain numbers.
pub fn with_unit(value: f64, unit: &str) -> String {
    let shown = shown(unit, value.abs());
    let number = number(value / shown.factor);
    if shown.text == "–" { number } else { format!("{number} {}", shown.text) }
}

/// Four digits: `0.25`, `1000`, `2.5·10⁶`, `10⁻⁷`.
pub fn number(value: f64) -> String {
    digits(value, 4)
}

/// A number with some digits, without zeros at its end.
pub fn digits(value: f64, n: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "–".to_owned();
    }
    let written = format!("{:.*e}", n - 1, value);
    let (mantissa, exponent) = written.split_once('e').unwrap_or((&written, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |text: &str| -> String {
        let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text };
        short.replace('-', "−")
    };
    if (-4..6).contains(&exponent) {
        let decimals = (n as i32 - 1 - exponent).max(0) as usize;
        return trimmed(&format!("{value:.decimals$}"));
    }
    match trimmed(mantissa).as_str() {
        "1" => format!("10{}", superscript(exponent)),
        "−1" => format!("−10{}", superscript(exponent)),
        mantissa => format!("{mantissa}·10{}", superscript(exponent)),
    }
}

/// A value and the half width of its interval, to the interval's second digit: `−0.512 ± 0.034`.
pub fn interval(value: f64, half_width: Option<f64>) -> String {
    let Some(half) = half_width.filter(|half| half.is_finite()) else { return number(value) };
    let decimals = if half > 0.0 { (1 - log10(half).floor() as i32).clamp(0, 4) as usize } else { 4 };
    let rounds_to_zero = half < 0.5 * power_of_ten(-(decimals as i32));
    let half = if rounds_to_zero { "0".to_owned() } else { format!("{half:.decimals$}") };
    let written = format!("{value:.decimals$}");
    // What rounds to zero has no sign.
    let is_zero = written.chars().all(|c| matches!(c, '-' | '0' | '.'));
    let written = if is_zero { written.trim_start_matches('-').to_owned() } else { written };
    format!("{written} ± {half}").replace('-', "−")
}

/// A duration of a run: `0.24 s`, `12 min 5 s`, `3 h 20 min`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round().min(1e15) as u64;
    let (hours, minutes, rest) = (whole / 3600, whole / 60 % 60, whole % 60);
    match (hours, minutes) {
        _ if !seconds.is_finite() => "–".to_owned(),
        (0, 0) => format!("{} s", digits(seconds, 3)),
        (0, _) => format!("{minutes} min {rest} s"),
        _ => format!("{hours} h {minutes} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        let texts = [0.25, 1000.0, 2.5e6, 1e-7, -1e6, 0.333_333, 12.0, 99_999.9].map(number);
        assert_eq!(texts, ["0.25", "1000", "2.5·10⁶", "10⁻⁷", "−10⁶", "0.3333", "12", "100000"]);
        assert_eq!(with_unit(0.25, "s"), "0.25 s");
        assert_eq!(with_unit(0.075, "m"), "7.5 cm");
        assert_eq!(with_unit(3.0, "m^2/s"), "3 m²/s");
        assert_eq!(interval(-0.512_34, Some(0.034_4)), "−0.512 ± 0.034");
        assert_eq!(interval(-0.5, Some(1e-16)), "−0.5000 ± 0");
        assert_eq!(interval(-0.001, Some(0.16)), "0.00 ± 0.16");
        assert_eq!(interval(2.0, None), "2");
    }
}
