//! Numbers in messages.
//!
//! Owns how many figures a reader gets to see. May use nothing else. It deliberately knows no unit.

/// A number as people read it: few digits, no exponent where it is short without.
pub fn number(value: f64) -> String {
    let magnitude = value.abs();
    if !value.is_finite() {
        return value.to_string();
    }
    // Zero has no sign for a reader.
    let value = if value == 0.0 { 0.0 } else { value };
    if value == 0.0 || (1e-3..1e6).contains(&magnitude) {
        let text = format!("{value:.6}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        text.to_owned()
    } else {
        let text = format!("{value:.4e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{}e{exponent}", mantissa.trim_end_matches('0').trim_end_matches('.'))
    }
}

/// As [`number`] with twelve figures: a value just beyond a limit must not read like the limit.
pub fn precise(value: f64) -> String {
    let rounded = format!("{value:.11e}").parse().unwrap_or(value);
    let magnitude = f64::abs(rounded);
    if rounded == 0.0 {
        "0".to_owned()
    } else if !rounded.is_finite() || (1e-4..1e9).contains(&magnitude) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_they_can_be_read() {
        assert_eq!(number(-0.0), "0");
        let shown = [0.0, 1.5, 1000.0, 1.16e-5, 2e6, 1e300, -5e-324].map(number);
        assert_eq!(shown, ["0", "1.5", "1000", "1.16e-5", "2e6", "1e300", "-4.9407e-324"]);
        let shown = [0.0, -0.0, -1.0, 1.0 - 1.2, 1.0 + 1e-9, 7000.0, 1e8, 1e11, 1e300, -1e-30].map(precise);
        let want = ["0", "0", "-1", "-0.2", "1.000000001", "7000", "100000000", "1e11", "1e300", "-1e-30"];
        assert_eq!(shown, want);
        assert_eq!([f64::INFINITY, f64::NEG_INFINITY, f64::NAN].map(number), ["inf", "-inf", "NaN"]);
        assert_eq!([f64::INFINITY, f64::NAN, f64::MAX].map(precise), ["inf", "NaN", "1.79769313486e308"]);
    }
}
