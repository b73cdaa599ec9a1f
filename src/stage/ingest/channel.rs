//! What is odd about a column of torques or currents as a whole: it never changes, or stands at its largest value.

/// Rows one after the other at the largest value that are no chance.
const RUN: u64 = 5;
/// Share of rows in such runs that is worth a word.
const SHARE: f64 = 0.002;
/// Fewer rows say nothing of a column.
const FEWEST: u64 = 100;

/// One end of a channel's range.
#[derive(Debug, Clone, Copy, Default)]
struct End {
    value: Option<f64>,
    /// Rows at it one after the other, now.
    run: u64,
    /// Rows in runs that are no chance.
    held: u64,
}

impl End {
    /// `beyond` where the value lies further out than the end so far.
    fn push(&mut self, value: f64, beyond: bool) {
        if beyond {
            *self = Self {
                value: Some(value),
                run: 1,
                held: 0,
            };
        } else if self.value == Some(value) {
            self.run += 1;
            self.held += match self.run {
                RUN => RUN,
                run if run > RUN => 1,
                _ => 0,
            };
        } else {
            self.run = 0;
        }
    }
}

/// The torque or current of one joint, row by row.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct TorqueChannel {
    rows: u64,
    low: End,
    high: End,
}

impl TorqueChannel {
    pub(super) fn push(&mut self, value: f64) {
        self.rows += 1;
        self.low
            .push(value, self.low.value.is_none_or(|low| value < low));
        self.high
            .push(value, self.high.value.is_none_or(|high| value > high));
    }

    /// The one value of a channel that never changes.
    pub(super) fn constant(&self) -> Option<f64> {
        self.low
            .value
            .filter(|low| Some(*low) == self.high.value && self.rows >= FEWEST)
    }

    /// Where it stands at the ends of its range, in words.
    pub(super) fn clipped(&self) -> Option<String> {
        let held = self.low.held + self.high.held;
        let (low, high) = self.low.value.zip(self.high.value)?;
        (held as f64 > SHARE * self.rows as f64 && self.rows >= FEWEST).then(|| {
            format!(
                "stands at {low} or {high}, the ends of its range, for {held} of {} rows",
                self.rows
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::TorqueChannel;

    fn of(values: impl Iterator<Item = f64>) -> TorqueChannel {
        let mut channel = TorqueChannel::default();
        values.for_each(|value| channel.push(value));
        channel
    }

    #[test]
    fn a_channel_that_is_cut_off_says_so_and_a_sine_does_not() {
        let sine = |k: i32| 10.0 * (0.05 * f64::from(k)).sin();
        assert_eq!(of((0..2000).map(sine)).clipped(), None);
        let cut = of((0..2000).map(|k| sine(k).clamp(-8.0, 8.0)))
            .clipped()
            .expect("two fifths of the rows are cut off");
        assert!(cut.starts_with("stands at -8 or 8"), "{cut}");
        assert_eq!(
            [
                of((0..200).map(|_| 0.25)).constant(),
                of((0..200).map(sine)).constant()
            ],
            [Some(0.25), None]
        );
    }
}
