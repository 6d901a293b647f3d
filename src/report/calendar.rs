//! Moments as people and other programs read them.
//!
//! Owns the calendar. May use nothing. It deliberately asks no clock.

/// A date and an hour, UTC.
struct Moment {
    year: i64,
    month: i64,
    day: i64,
    /// Of the day.
    second: i64,
    /// Of the second.
    millisecond: i64,
}

impl Moment {
    /// From microseconds since 1970.
    ///
    /// Source: the civil calendar from days, Neri and Schneider, Softw. Pract. Exper. 53 (2023) 937, in the
    /// plain form of eras of 400 years
    fn new(microseconds: i64) -> Self {
        let seconds = microseconds.div_euclid(1_000_000);
        let (days, second) = (seconds.div_euclid(86_400), seconds.rem_euclid(86_400));
        // Years begin in March, so that the leap day is the last of one.
        let since = days + 719_468;
        let (era, day) = (since.div_euclid(146_097), since.rem_euclid(146_097));
        let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
        let day = day - (365 * year + year / 4 - year / 100);
        let month = (5 * day + 2) / 153;
        let (day, month) = (day - (153 * month + 2) / 5 + 1, if month < 10 { month + 3 } else { month - 9 });
        let year = era * 400 + year + i64::from(month <= 2);
        Self { year, month, day, second, millisecond: microseconds.rem_euclid(1_000_000) / 1000 }
    }

    fn date(&self) -> String {
        format!("{:04}-{:02}-{:02}", self.year, self.month, self.day)
    }

    fn hour(&self) -> String {
        format!("{:02}:{:02}:{:02}", self.second / 3600, self.second / 60 % 60, self.second % 60)
    }
}

/// `2026-01-14 12:00:00 UTC`, of microseconds since 1970.
pub fn moment(microseconds: i64) -> String {
    let moment = Moment::new(microseconds);
    format!("{} {} UTC", moment.date(), moment.hour())
}

/// `2026-01-14T12:00:00.000+00:00`, after ISO 8601, in the one form that the validator of crates takes.
pub fn iso_moment(microseconds: i64) -> String {
    let moment = Moment::new(microseconds);
    format!("{}T{}.{:03}+00:00", moment.date(), moment.hour(), moment.millisecond)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_calendar() {
        assert_eq!(moment(1_768_392_000_000_000), "2026-01-14 12:00:00 UTC");
        assert_eq!(moment(951_782_399_000_000), "2000-02-28 23:59:59 UTC");
        assert_eq!(moment(951_782_400_000_000), "2000-02-29 00:00:00 UTC");
        assert_eq!(moment(-1), "1969-12-31 23:59:59 UTC");
        assert_eq!(iso_moment(951_782_400_012_345), "2000-02-29T00:00:00.012+00:00");
        assert_eq!(iso_moment(-1), "1969-12-31T23:59:59.999+00:00");
    }
}
