//! Words that findings share: figures that never round to nothing, and moments on the recording's clock or in its rows.

use super::Variable;
use crate::robot::Measurements;

/// A number with its usual decimals, and with more where these would leave less than two digits of it.
pub fn figure(value: f64, decimals: usize) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() {
        return format!("{value:.decimals$}");
    }
    if size < SMALL {
        return format!("{value:.1e}");
    }
    // The next power of ten counts from where two digits round up to it.
    let power = (size * 1.005).log10().floor();
    let digits = (1.0 - power).max(0.0) as usize;
    format!("{value:.*}", digits.max(decimals))
}

/// Below this, zeros are hard to count.
const SMALL: f64 = 1e-4;

/// A clock that shows more than this (s, a year) counts since an epoch, not since the recording began.
const EPOCH: f64 = 3e7;

/// What counts time in a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Clock {
    /// What the clock shows at the recording's first row.
    Seconds {
        /// Time of the first row, s.
        first: f64,
    },
    /// No time was recorded: the order of the rows stands for it.
    Rows,
}

impl Clock {
    /// The clock of a recording.
    pub fn of(data: &Measurements) -> Self {
        let times = data
            .time
            .iter()
            .flatten()
            .copied()
            .filter(|time| time.is_finite());
        times
            .reduce(f64::min)
            .map_or(Self::Rows, |first| Self::Seconds { first })
    }

    /// What time is called: `time`, or `row`.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Seconds { .. } => "time",
            Self::Rows => "row",
        }
    }

    /// What a variable is called.
    pub fn named(self, variable: Variable) -> String {
        if variable == Variable::Time {
            self.name().into()
        } else {
            variable.to_string()
        }
    }

    /// When something changed for good: ` at 447 s`, of a clock that counts since an epoch after the first row, or the first row (from 1)
    /// after it.
    pub(crate) fn since(self, time: f64) -> String {
        match self {
            Self::Seconds { first } if first.abs() > EPOCH => {
                format!(" {} s after the first row", figure(time - first, 0))
            }
            Self::Seconds { .. } => format!(" at {} s", figure(time, 0)),
            Self::Rows => format!(" from row {:.0}", time.floor() + 2.0),
        }
    }

    /// A length of time.
    pub(crate) fn span(self, length: f64) -> String {
        match self {
            Self::Seconds { .. } => format!("{} s", figure(length, 0)),
            Self::Rows => format!("{} rows", figure(length, 0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_figure_but_zero_reads_as_zero() {
        let read: Vec<String> = [0.0, 447.2, 15.4, 9.96, 6.31, 0.42, -0.004, 3e-9]
            .map(|value| figure(value, 0))
            .into();
        assert_eq!(
            read,
            ["0", "447", "15", "10", "6.3", "0.42", "-0.0040", "3.0e-9"]
        );
        assert_eq!([figure(12.344, 2), figure(0.004, 2)], ["12.34", "0.0040"]);
    }

    #[test]
    fn rows_count_where_no_clock_ran() {
        // Between the 290th and the 291st row, which are numbers 289 and 290 from 0.
        assert_eq!(Clock::Rows.since(289.5), " from row 291");
        let clock = Clock::Seconds { first: 12.0 };
        assert_eq!(clock.since(289.5), " at 290 s");
        assert_eq!(
            [Clock::Rows.span(173.2), clock.span(3.21)],
            ["173 rows", "3.2 s"]
        );
        assert_eq!(
            Clock::Seconds {
                first: 1_709_564_908.0
            }
            .since(1_709_565_355.2),
            " 447 s after the first row"
        );
    }
}
