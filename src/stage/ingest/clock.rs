//! ClockColumn times as text: a time of day, or a date with a time (ISO 8601, a blank for its T too).

use jiff::Timestamp;
use jiff::civil::{DateTime, Time};
use jiff::tz::TimeZone;

/// The word that stands for a unit where times are clock times.
pub(super) const CLOCK: &str = "clock";
/// What may stand in such a column, for people.
pub(super) const ALLOWED: &str = "a time of day (08:15:03.25) or a date with a time (2026-11-22T08:15:03, with or without its zone)";

/// Whether text is a clock time that [`Ingest`](super::Ingest) reads with the unit `clock`.
pub fn is_clock_time(text: &str) -> bool {
    ClockTime::parse(text.as_bytes()).is_some()
}

const DAY: f64 = 86_400.0;

/// Reads one column of clock times.
#[derive(Debug, Clone, Default)]
pub(super) struct ClockColumn {
    /// The last time of day, s, and the midnights since the first.
    last: f64,
    midnights: f64,
}

impl ClockColumn {
    /// Seconds: since 1970 where a date stands, else since the midnight before the first row. A time of day that falls by more than half a
    /// day is one of the next day.
    pub fn read(&mut self, cell: &[u8]) -> Option<f64> {
        Some(match ClockTime::parse(cell)? {
            ClockTime::Dated(seconds) => seconds,
            ClockTime::OfDay(seconds) => {
                if self.last - seconds > 0.5 * DAY {
                    self.midnights += 1.0;
                }
                self.last = seconds;
                self.midnights * DAY + seconds
            }
        })
    }
}

/// A clock time, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ClockTime {
    /// Since midnight.
    OfDay(f64),
    /// Since 1970; without a zone as if it were UTC.
    Dated(f64),
}

impl ClockTime {
    /// None of other text. Some trackers write a quote before the time, so that spreadsheets leave it alone.
    pub fn parse(cell: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(cell)
            .ok()?
            .trim_matches(['\'', '"', ' ']);
        if let Ok(time) = text.parse::<Timestamp>() {
            return Some(Self::Dated(time.as_duration().as_secs_f64()));
        }
        if !text.contains(':') {
            return None;
        }
        let day = text.contains('-');
        if day {
            let time = text
                .parse::<DateTime>()
                .ok()?
                .to_zoned(TimeZone::UTC)
                .ok()?;
            return Some(Self::Dated(time.timestamp().as_duration().as_secs_f64()));
        }
        let time: Time = text.parse().ok()?;
        Some(Self::OfDay(
            time.duration_since(Time::midnight()).as_secs_f64(),
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_day_and_dates_are_seconds_and_other_text_is_nothing() {
        let parsed = |text: &str| ClockTime::parse(text.as_bytes());
        assert_eq!(
            parsed("08:15:03.25"),
            Some(ClockTime::OfDay(8.0 * 3600.0 + 15.0 * 60.0 + 3.25))
        );
        assert_eq!(parsed("'08:15:03,250"), Some(ClockTime::OfDay(29_703.25)));
        assert_eq!(parsed("00:00"), Some(ClockTime::OfDay(0.0)));
        // 2024-02-29 is day 19,782 after 1970-01-01.
        let noon = 19_782.0 * DAY + 43_200.0;
        for text in [
            "2024-02-29T12:00:00Z",
            "2024-02-29 12:00:00",
            "2024-02-29T13:00:00+01:00",
            "2024-02-29T12:00:00.000",
        ] {
            assert_eq!(parsed(text), Some(ClockTime::Dated(noon)), "{text}");
        }
        for text in [
            "",
            "12",
            "12.5",
            "29.02.2024 12:00:00",
            "25:00:00",
            "noon",
            "2024-02-29",
        ] {
            assert_eq!(parsed(text), None, "{text}");
        }
    }
}
