//! From values to places along an axis, and the numbers written beside it.
//!
//! Owns ticks and their text. May use `maths`. It deliberately knows no page.

use crate::maths::scalar::log10;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    Linear,
    Log,
}

/// Beyond these, sums and ratios of values leave the range of numbers; such values are not shown.
const LARGEST: f64 = 1e300;
const SMALLEST: f64 = 1e-290;

/// Values that differ by less than this part of themselves are one value and its rounding.
const ROUNDING: f64 = 1e-9;

/// Least part of the largest value that a linear axis covers: with less, its labels differ only in digits
/// that nobody reads, and have no room beside it.
const LEAST_SPAN: f64 = 1e-3;

/// A range of values with its spacing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    pub low: f64,
    pub high: f64,
    pub spacing: Spacing,
}

impl Scale {
    /// Covers the values with a margin; zero is kept as an end if the values reach it. Log spacing
    /// if asked for and possible.
    pub fn covering(values: impl Iterator<Item = f64>, spacing: Spacing) -> Self {
        let is_usable =
            |value: &f64| value.abs() <= LARGEST && (spacing == Spacing::Linear || *value > SMALLEST);
        let ends = values.filter(is_usable).fold(None, |ends: Option<(f64, f64)>, value| {
            Some(ends.map_or((value, value), |(low, high)| (low.min(value), high.max(value))))
        });
        match (ends, spacing) {
            (None, _) => Self { low: 0.0, high: 1.0, spacing: Spacing::Linear },
            (Some((low, high)), Spacing::Log) => Self { low: low / 1.15, high: high * 1.15, spacing },
            (Some((low, high)), Spacing::Linear) if high - low > SMALLEST || high.abs() > SMALLEST => {
                Self::padded(low, high)
            }
            (Some(_), Spacing::Linear) => Self { low: 0.0, high: 1.0, spacing },
        }
    }

    fn padded(low: f64, high: f64) -> Self {
        let size = low.abs().max(high.abs());
        let is_one_value = high - low <= ROUNDING * size;
        let span = if is_one_value { size } else { (high - low).max(LEAST_SPAN * size) };
        let missing = if is_one_value { 0.0 } else { 0.5 * (span - (high - low)) };
        let (low, high) = (low - missing, high + missing);
        // Noise below zero of less than a fiftieth of the range does not move the end from zero by more.
        let low = if low >= 0.0 && low < 0.5 * high { 0.0 } else { low - 0.06 * span };
        let high = if high <= 0.0 && high > 0.5 * low { 0.0 } else { high + 0.06 * span };
        Self { low, high, spacing: Spacing::Linear }
    }

    /// 0 at the low end, 1 at the high end; not finite for what a log axis cannot show.
    pub fn fraction(&self, value: f64) -> f64 {
        match self.spacing {
            Spacing::Linear => (value - self.low) / (self.high - self.low),
            Spacing::Log if value > 0.0 => log10(value / self.low) / log10(self.high / self.low),
            Spacing::Log => f64::NAN,
        }
    }

    /// Places and texts of the ticks, about `wanted` of them; a log axis has unnamed ones between.
    pub fn ticks(&self, wanted: usize) -> Vec<(f64, String)> {
        match self.spacing {
            Spacing::Linear => linear_ticks(self.low, self.high, wanted),
            Spacing::Log => {
                let is_readable =
                    |ticks: &[(f64, String)]| ticks.iter().filter(|(_, text)| !text.is_empty()).count() > 1;
                let named = log_ticks(self.low, self.high, false);
                if is_readable(&named) {
                    return named;
                }
                // Less than a decade: all its digits have names, or round numbers between two of them.
                let all = log_ticks(self.low, self.high, true);
                if is_readable(&all) { all } else { linear_ticks(self.low, self.high, wanted) }
            }
        }
    }
}

/// 10^k, rounded correctly.
pub fn power_of_ten(exponent: i32) -> f64 {
    format!("1e{exponent}").parse().unwrap_or(f64::INFINITY)
}

fn linear_ticks(low: f64, high: f64, wanted: usize) -> Vec<(f64, String)> {
    let rough = (high - low) / wanted.max(1) as f64;
    let exponent = log10(rough).floor() as i32;
    let unit = power_of_ten(exponent);
    if !(unit > 0.0 && unit.is_finite()) {
        return Vec::new();
    }
    // The nearest of 1, 2, 5, 10 by ratio: limits at √2, √10 and √50.
    let multiple = match rough / unit {
        ratio if ratio < 1.414 => 1.0,
        ratio if ratio < 3.162 => 2.0,
        ratio if ratio < 7.071 => 5.0,
        _ => 10.0,
    };
    let step = multiple * unit;
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    let step_exponent = if multiple == 10.0 { exponent + 1 } else { exponent };
    let largest = low.abs().max(high.abs());
    (first..=last.min(first.saturating_add(50)))
        .map(|k| (k as f64 * step, number(k as f64 * step, step_exponent, largest)))
        .collect()
}

/// Decimal digits down to the step; powers of ten beyond what reads well.
fn number(value: f64, step_exponent: i32, largest: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if largest >= 1e5 || step_exponent < -4 && largest < 1e-2 {
        let exponent = log10(value.abs()).floor() as i32;
        let digits = (exponent - step_exponent).clamp(0, 6) as usize;
        let mantissa = format!("{:.digits$}", value / power_of_ten(exponent));
        return format!("{}·10{}", minus(&mantissa), superscript(exponent));
    }
    let digits = (-step_exponent).max(0) as usize;
    minus(&format!("{value:.digits$}"))
}

fn minus(text: &str) -> String {
    text.replace('-', "−")
}

fn log_ticks(low: f64, high: f64, are_all_named: bool) -> Vec<(f64, String)> {
    let (first, last) = (log10(low).floor() as i32, log10(high).ceil() as i32);
    let n_decades = last - first;
    let every = (n_decades / 6 + 1).max(1);
    let is_narrow = log10(high / low) < 1.6;
    let mut ticks = Vec::new();
    for exponent in first..=last {
        for digit in 1..10 {
            let value = f64::from(digit) * power_of_ten(exponent);
            if value < low || value > high {
                continue;
            }
            let is_named =
                digit == 1 && exponent.rem_euclid(every) == 0 || is_narrow && matches!(digit, 2 | 5);
            let is_named = is_named || are_all_named;
            ticks.push((value, if is_named { short(value, exponent) } else { String::new() }));
        }
    }
    ticks
}

fn short(value: f64, exponent: i32) -> String {
    match exponent {
        0..=3 => format!("{value:.0}"),
        -3..=-1 => format!("{value:.*}", exponent.unsigned_abs() as usize),
        _ if value / power_of_ten(exponent) < 1.5 => format!("10{}", superscript(exponent)),
        _ => format!("{:.0}·10{}", value / power_of_ten(exponent), superscript(exponent)),
    }
}

/// An exponent in raised digits.
pub fn superscript(exponent: i32) -> String {
    let raised = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        other => char::from_u32('⁴' as u32 + other as u32 - '4' as u32).unwrap_or(other),
    };
    exponent.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(low: f64, high: f64, spacing: Spacing) -> Vec<String> {
        let ticks = Scale { low, high, spacing }.ticks(6);
        ticks.into_iter().map(|(_, text)| text).filter(|text| !text.is_empty()).collect()
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(texts(-7.5, 7.5, Spacing::Linear), ["−6", "−4", "−2", "0", "2", "4", "6"]);
        assert_eq!(texts(0.0, 0.21, Spacing::Linear), ["0.00", "0.05", "0.10", "0.15", "0.20"].map(zero));
        assert_eq!(texts(0.0, 2.1e6, Spacing::Linear), ["0", "5·10⁵", "1.0·10⁶", "1.5·10⁶", "2.0·10⁶"]);
        assert_eq!(texts(0.02, 40.0, Spacing::Log), ["0.1", "1", "10"]);
        assert_eq!(texts(0.055, 0.13, Spacing::Log), ["0.06", "0.07", "0.08", "0.09", "0.1"]);
        assert_eq!(
            texts(0.21, 0.24, Spacing::Log),
            ["0.210", "0.215", "0.220", "0.225", "0.230", "0.235", "0.240"]
        );
        assert_eq!(texts(1e-9, 1e-6, Spacing::Log), ["10⁻⁹", "10⁻⁸", "10⁻⁷", "10⁻⁶"]);
    }

    fn zero(text: &str) -> String {
        if text == "0.00" { "0".to_owned() } else { text.to_owned() }
    }

    /// Noise of rounding is a flat line on the axis of its value; a drift of 1e-5 is seen as a small one.
    #[test]
    fn rounding_does_not_fill_a_panel() {
        for value in [1.5e-7, 0.3, -0.3, 123.4, 7.5e8] {
            let exact = Scale::covering([value].into_iter(), Spacing::Linear);
            for (change, largest_share) in [(2e-16, 1e-14), (1e-10, 1e-8), (1e-5, 0.02)] {
                let values = [value, value * (1.0 + change), value * (1.0 - change)];
                let scale = Scale::covering(values.into_iter(), Spacing::Linear);
                let places = values.map(|value| scale.fraction(value));
                let share = (places[1] - places[2]).abs();
                assert!(share <= largest_share, "{value}, {change}: {share} of the panel");
                assert!(places.iter().all(|place| (0.01..0.99).contains(place)), "{places:?}");
                let texts: Vec<_> = scale.ticks(5).into_iter().map(|(_, text)| text).collect();
                let is_distinct = texts.windows(2).all(|pair| pair[0] != pair[1]);
                let is_short = texts.iter().all(|text| text.chars().count() <= 11);
                assert!(texts.len() >= 3 && is_distinct && is_short, "{texts:?}");
                if change < ROUNDING {
                    assert!((scale.low / exact.low - 1.0).abs() < 1e-8, "{scale:?} {exact:?}");
                }
            }
        }
        let wide = Scale::covering([1.0, 3.0].into_iter(), Spacing::Linear);
        assert_eq!((wide.low, wide.high), (0.0, 3.12), "wider ranges are what they were");
    }

    #[test]
    fn hostile_ranges_give_no_endless_ticks() {
        for (low, high) in [(0.0, 5e-324), (-1e308, 1e308), (1.0, 1.0), (f64::NAN, 1.0)] {
            assert!(Scale { low, high, spacing: Spacing::Linear }.ticks(5).len() < 60);
        }
        let none = Scale::covering([f64::NAN].into_iter(), Spacing::Log);
        assert_eq!((none.low, none.high), (0.0, 1.0));
    }
}
