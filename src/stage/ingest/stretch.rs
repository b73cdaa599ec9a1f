//! The clock of an arm that moves: stretches without a gap, and faults of the clock.

use jiff::Timestamp;
use jiff::civil::{Date, DateTime, Time};
use jiff::tz::TimeZone;

/// A gap is longer than so many steps of the clock.
const GAP: f64 = 20.0;
/// Steps that the usual one is known by.
const STEPS: usize = 64;
/// How near joints must come to where their velocity takes them in one step for the clock to have jumped, as a share of that step.
const NEAR: f64 = 0.4;
/// A step of a joint that shows that it moves, rad or m.
const MOVES: f64 = 2e-4;

/// Stretches of rows, numbered from 1.
#[derive(Default)]
pub(super) struct Stretches {
    number: i64,
    name: Option<String>,
    last: Option<(f64, Vec<f64>)>,
    /// What each joint moves in a step, by the last two rows of the stretch.
    step: Option<Vec<f64>>,
    /// The first steps of the clock, sorted, s.
    usual: Vec<f64>,
    gap: Option<(u64, f64)>,
    warned: u64,
}

/// Gaps that are told one by one.
const LISTED: u64 = 5;

impl Stretches {
    /// Rows of another file follow: another stretch.
    pub(super) fn begin(&mut self) {
        (self.name, self.last, self.step) = (None, None, None);
    }

    pub(super) fn count(&self) -> i64 {
        self.number
    }

    /// The stretch of the next row, of the trajectory `name`. Fails with what is wrong with the clock.
    pub(super) fn next(
        &mut self,
        name: &str,
        time: f64,
        q: &[f64],
        line: u64,
    ) -> Result<i64, String> {
        let last = self.last.take();
        let goes_on = self.name.as_deref() == Some(name);
        if let (Some((before, from)), true) = (&last, goes_on) {
            let step = time - before;
            if step <= 0.0 {
                let how = if step < 0.0 { "goes back" } else { "stands" };
                return Err(format!(
                    "the clock {how}: {time} s after {before} s; allowed: ascending times within a trajectory (`trajectory` maps \
                     where one ends)"
                ));
            }
            let moved: Vec<f64> = q.iter().zip(from).map(|(to, from)| to - from).collect();
            if self.is_gap(step) {
                if self.went_on(&moved) {
                    return Err(format!(
                        "the clock jumps by {step:.3} s ({before} s to {time} s) while the joints go on as in one step of {:.4} s",
                        self.usual_step().unwrap_or_default()
                    ));
                }
                self.gap = Some((line, step));
                self.start(name);
            } else {
                self.learn(step);
                self.step = Some(moved);
            }
        } else {
            self.start(name);
        }
        self.last = Some((time, q.to_vec()));
        Ok(self.number)
    }

    fn start(&mut self, name: &str) {
        self.number += 1;
        self.name = Some(name.into());
        self.step = None;
    }

    fn learn(&mut self, step: f64) {
        if self.usual.len() < STEPS {
            let at = self.usual.partition_point(|other| *other < step);
            self.usual.insert(at, step);
        }
    }

    fn usual_step(&self) -> Option<f64> {
        self.usual.get(self.usual.len() / 2).copied()
    }

    fn is_gap(&self, step: f64) -> bool {
        self.usual.len() >= STEPS / 8 && self.usual_step().is_some_and(|usual| step > GAP * usual)
    }

    /// Whether joints that move are where one step of the clock takes them.
    fn went_on(&self, moved: &[f64]) -> bool {
        let Some(step) = &self.step else { return false };
        let size = step.iter().fold(0.0, |most: f64, one| most.max(one.abs()));
        let mut both = moved.iter().zip(step);
        size > MOVES && both.all(|(moved, step)| (moved - step).abs() < NEAR * size)
    }

    /// What a person should know of a gap that was just met.
    pub(super) fn warning(&mut self, label: &str) -> Option<String> {
        let (line, gap) = self.gap.take()?;
        self.warned += 1;
        let more = match self.warned {
            1..LISTED => "another stretch begins",
            LISTED => "further gaps are not listed",
            _ => return None,
        };
        Some(format!("{label}:{line}: no rows for {gap:.3} s; {more}"))
    }
}

/// The word that stands for a unit where times are clock times.
pub(super) const CLOCK: &str = "clock";
/// What may stand in such a column, for people.
pub(super) const ALLOWED: &str = "a time of day (08:15:03.25) or a date with a time (2026-11-22T08:15:03, with or without its zone; \
    22.11.2026 08:15:03; 11/22/2026 8:15:03 AM, the month first)";

/// The clock times of a column, s, in the order of its cells.
pub fn clock_seconds<'t>(cells: impl Iterator<Item = &'t str>) -> Vec<f64> {
    let mut column = ClockColumn::default();
    cells
        .filter_map(|cell| column.read(cell.as_bytes()))
        .collect()
}

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
    OfDay(f64),
    /// Since 1970; without a zone as if it were UTC.
    Dated(f64),
}

impl ClockTime {
    /// None of other text. Some trackers write a quote before the time, so that spreadsheets leave it alone.
    pub fn parse(cell: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(cell).ok()?;
        let text = text.trim_matches(['\'', '"', ' ']);
        if let Ok(time) = text.parse::<Timestamp>() {
            return Some(Self::Dated(time.as_duration().as_secs_f64()));
        }
        if !text.contains(':') {
            return None;
        }
        if let Some((date, of_day)) = text
            .split_once([' ', 'T'])
            .filter(|(date, _)| date.contains(['.', '/']))
        {
            let day = written_day(date.trim_end_matches(','))?;
            let time = day.to_datetime(written_time(of_day)?);
            let time = time.to_zoned(TimeZone::UTC).ok()?.timestamp();
            return Some(Self::Dated(time.as_duration().as_secs_f64()));
        }
        if text.contains('-') {
            let time: DateTime = text.parse().ok()?;
            let time = time.to_zoned(TimeZone::UTC).ok()?.timestamp();
            return Some(Self::Dated(time.as_duration().as_secs_f64()));
        }
        let time = written_time(text)?;
        let of_day = time.duration_since(Time::midnight());
        Some(Self::OfDay(of_day.as_secs_f64()))
    }
}

/// `20.11.2026`, the day first; `11/20/2026`, the month first; `2026/11/20`.
fn written_day(text: &str) -> Option<Date> {
    let mark = if text.contains('.') { '.' } else { '/' };
    let parts: Vec<&str> = text.split(mark).collect();
    let [a, b, c] = parts[..] else { return None };
    let [year, month, day] = match (mark, a.len()) {
        (_, 4) => [a, b, c],
        ('.', _) => [c, b, a],
        _ => [c, a, b],
    };
    (year.len() == 4).then_some(())?;
    Date::new(year.parse().ok()?, month.parse().ok()?, day.parse().ok()?).ok()
}

/// `08:15:03.25`, `8:15:03 PM`.
fn written_time(text: &str) -> Option<Time> {
    let text = text.trim();
    let lower = text.to_ascii_lowercase();
    let half = [("am", false), ("pm", true)].into_iter();
    let mut half = half.filter_map(|(word, is_late)| Some((lower.strip_suffix(word)?, is_late)));
    let half = half.next();
    let clock = half.map_or(text, |(clock, _)| clock.trim());
    let padded = match clock.find(':') {
        Some(1) => format!("0{clock}"),
        _ => clock.to_string(),
    };
    let time: Time = padded.parse().ok()?;
    let Some((_, is_late)) = half else {
        return Some(time);
    };
    let hour = match (time.hour(), is_late) {
        (1..=11, true) => time.hour() + 12,
        (12, false) => 0,
        (1..=12, _) => time.hour(),
        _ => return None,
    };
    time.with().hour(hour).build().ok()
}

#[cfg(test)]
mod tests {
    use super::Stretches;

    fn rows(
        stretches: &mut Stretches,
        rows: std::ops::Range<i32>,
        later: f64,
        ahead: f64,
    ) -> Result<i64, String> {
        let row = |k: i32| (0.01 * f64::from(k) + later, 0.003 * f64::from(k) + ahead);
        rows.map(row)
            .try_fold(0, |_, (time, q)| stretches.next("1", time, &[q, 0.0], 7))
    }

    #[test]
    fn a_pause_begins_a_stretch_and_a_clock_that_jumps_is_refused() {
        let mut paused = Stretches::default();
        assert_eq!(rows(&mut paused, 0..50, 0.0, 0.0), Ok(1));
        assert_eq!(rows(&mut paused, 50..90, 3.0, 0.9), Ok(2));
        assert!(
            paused
                .warning("a.csv")
                .expect("a gap")
                .starts_with("a.csv:7: no rows for 3.010 s")
        );
        let mut jumps = Stretches::default();
        assert_eq!(rows(&mut jumps, 0..50, 0.0, 0.0), Ok(1));
        assert!(
            rows(&mut jumps, 50..90, 3.0, 0.0)
                .unwrap_err()
                .starts_with("the clock jumps by 3.010 s")
        );
        let mut back = Stretches::default();
        assert_eq!(rows(&mut back, 0..50, 0.0, 0.0), Ok(1));
        assert!(
            rows(&mut back, 20..21, 0.0, 0.0)
                .unwrap_err()
                .starts_with("the clock goes back")
        );
    }

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
            "29.02.2024 12:00:00",
            "29.2.2024 12:00:00,000",
            "02/29/2024 12:00:00 PM",
            "2/29/2024 12:00",
            "2024/02/29 12:00:00",
        ] {
            assert_eq!(parsed(text), Some(ClockTime::Dated(noon)), "{text}");
        }
        for text in [
            "",
            "12",
            "12.5",
            "29/02/2024 12:00:00",
            "25:00:00",
            "noon",
            "2024-02-29",
        ] {
            assert_eq!(parsed(text), None, "{text}");
        }
    }
}
