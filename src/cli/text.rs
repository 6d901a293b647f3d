//! Numbers and tables as people read them.

/// A duration: `0.24 s`, `41 s`, `12 min 5 s`, `3 h 20 min`, `2 d 4 h`.
pub(crate) fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return "unknown".to_owned();
    }
    if seconds < 9.995 {
        return format!("{} s", significant(seconds, 3));
    }
    if seconds < 99.5 {
        return format!("{seconds:.0} s");
    }
    let whole = seconds.round().min(1e15) as u64;
    let (days, hours, minutes, seconds) = (whole / 86_400, whole / 3600 % 24, whole / 60 % 60, whole % 60);
    match (days, hours) {
        (0, 0) => format!("{minutes} min {seconds} s"),
        (0, _) => format!("{hours} h {minutes} min"),
        _ => format!("{days} d {hours} h"),
    }
}

/// A number of bytes: `640 bytes`, `15 kB`, `16 MB`.
pub(crate) fn bytes(n: u64) -> String {
    if n < 1000 { format!("{n} bytes") } else { format!("{}B", with_prefix(n as f64)) }
}

/// A large number with an SI prefix and three digits: `214 M`.
pub(crate) fn with_prefix(value: f64) -> String {
    let prefixes = ["", "k", "M", "G", "T", "P"];
    let mut scaled = value;
    let mut idx = 0;
    while scaled.abs() >= 999.5 && idx + 1 < prefixes.len() {
        scaled /= 1000.0;
        idx += 1;
    }
    format!("{} {}", significant(scaled, 3), prefixes[idx]).trim_end().to_owned()
}

/// `1234567` as `1 234 567`.
/// Microseconds since 1970 as date and time, UTC: `2026-11-23 23:15`.
pub(crate) fn date(micros: i64) -> String {
    let minutes = micros.div_euclid(60_000_000);
    let (days, minute) = (minutes.div_euclid(1440), minutes.rem_euclid(1440));
    // Civil calendar from days since 1970: years that begin in March, eras of 400 of them.
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02} {:02}:{:02}", minute / 60, minute % 60)
}

pub(crate) fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (idx, digit) in digits.chars().enumerate() {
        if idx > 0 && (digits.len() - idx).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}

/// A number with so many significant digits, in plain notation where that is short.
pub(crate) fn significant(value: f64, n_digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return value.to_string();
    }
    let scientific = format!("{value:.*e}", n_digits.saturating_sub(1));
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..n_digits as i32).contains(&exponent) {
        let n_decimals = (n_digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.n_decimals$}")
    } else {
        format!("{mantissa}e{exponent}")
    }
}

/// How a column of a table stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Right,
}

/// A table in plain text: two spaces between columns, a line under the header.
pub(crate) fn table(header: &[(&str, Align)], rows: &[Vec<String>]) -> String {
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count());
        cells.chain([header[column].0.chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let line = |cells: &[String]| {
        let padded = cells.iter().zip(header).zip(&widths).map(|((cell, (_, align)), width)| match align {
            Align::Left => format!("{cell:<width$}"),
            Align::Right => format!("{cell:>width$}"),
        });
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    let titles: Vec<String> = header.iter().map(|(title, _)| (*title).to_owned()).collect();
    let rule = "─".repeat(widths.iter().sum::<usize>() + 2 * widths.len().saturating_sub(1));
    let body: String = rows.iter().map(|row| line(row)).collect();
    format!("{}{rule}\n{body}", line(&titles))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(date(0), "1970-01-01 00:00");
        assert_eq!(date(951_782_399_999_999), "2000-02-28 23:59");
        assert_eq!(date(951_782_400_000_000), "2000-02-29 00:00");
        assert_eq!(date(1_795_475_700_000_000), "2026-11-23 23:15");
    }

    #[test]
    fn durations_read_well_at_every_scale() {
        let shown: Vec<String> =
            [0.0, 0.0242, 0.24, 9.99, 9.999, 41.2, 99.6, 725.0, 12_000.0, 187_200.0].map(duration).to_vec();
        let want = [
            "0 s",
            "0.0242 s",
            "0.240 s",
            "9.99 s",
            "10 s",
            "41 s",
            "1 min 40 s",
            "12 min 5 s",
            "3 h 20 min",
            "2 d 4 h",
        ];
        assert_eq!(shown, want);
        assert_eq!(duration(f64::NAN), "unknown");
        assert_eq!(duration(f64::INFINITY), "unknown");
    }

    #[test]
    fn numbers_keep_their_significant_digits() {
        let shown =
            [1.0, 214.0, 0.001234, 0.0001234, 123_456.0, -4.996, 9.996].map(|value| significant(value, 3));
        assert_eq!(shown, ["1.00", "214", "0.00123", "1.23e-4", "1.23e5", "-5.00", "10.0"]);
        assert_eq!(with_prefix(2.14e8), "214 M");
        assert_eq!(with_prefix(999_600.0), "1.00 M");
        assert_eq!(grouped(1_234_567), "1 234 567");
        assert_eq!(grouped(12), "12");
        assert_eq!(bytes(16_000_000), "16.0 MB");
    }

    #[test]
    fn a_table_is_aligned_by_characters() {
        let rows = vec![vec!["µ".to_owned(), "1".to_owned()], vec!["long".to_owned(), "12.5".to_owned()]];
        let shown = table(&[("name", Align::Left), ("L∞", Align::Right)], &rows);
        assert_eq!(shown, "name    L∞\n──────────\nµ        1\nlong  12.5\n");
    }
}
