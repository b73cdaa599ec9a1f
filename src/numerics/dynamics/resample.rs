//! Even rows of uneven ones, as these come: interpolated by their stamps, or with even stamps.

use super::recording::TorqueRecording;
use crate::error::Result;

/// Makes even rows of recorded ones as they come.
pub(super) struct Resampler {
    period: f64,
    pause: f64,
    by_stamps: bool,
    /// Recorded rows from `first` on, of which those before `done` are no longer needed as beginnings of a step.
    pub(crate) held: TorqueRecording,
    first: usize,
    done: usize,
    /// s, where the present stretch begins, and rows made of it.
    begun: f64,
    made: usize,
    /// s, of the row made last.
    last: f64,
    out: TorqueRecording,
    origin: Vec<usize>,
}

impl Resampler {
    /// For rows that have the columns of others; `by_stamps` tells whether they are interpolated by their stamps.
    pub(crate) fn new([period, pause]: [f64; 2], by_stamps: bool, like: &TorqueRecording) -> Self {
        let nothing = || TorqueRecording::like(like);
        Self {
            period,
            pause,
            by_stamps,
            held: nothing(),
            first: 0,
            done: 0,
            begun: 0.0,
            made: 0,
            last: f64::NEG_INFINITY,
            out: nothing(),
            origin: Vec::new(),
        }
    }

    /// Hands on what was made, each row with the recorded one that it is or comes after.
    pub(crate) fn hand_on(
        &mut self,
        take: &mut dyn FnMut(&TorqueRecording, &[usize]) -> Result<()>,
    ) -> Result<()> {
        if !self.origin.is_empty() {
            take(&self.out, &self.origin)?;
        }
        self.out = TorqueRecording::like(&self.held);
        self.origin.clear();
        Ok(())
    }

    /// Whether a stretch ends before a held row, which is not the first one.
    fn is_torn(&self, row: usize) -> bool {
        let step = self.held.time[row] - self.held.time[row - 1];
        step <= 0.0 || step > self.pause
    }

    /// Makes the rows of all steps whose surroundings are known.
    pub(crate) fn advance(&mut self, ends: bool) {
        let rows = self.held.rows();
        while self.done + 2 < rows || (ends && self.done < rows) {
            let row = self.done;
            if row + self.first == 0 || self.is_torn(row) {
                self.begun = self.held.time[row].max(if self.by_stamps {
                    f64::NEG_INFINITY
                } else {
                    self.last + self.period + self.pause
                });
                self.made = 0;
                self.push(row, self.begun);
            }
            self.done += 1;
            if row + 1 == rows || self.is_torn(row + 1) {
                continue;
            }
            if !self.by_stamps {
                self.push(row + 1, self.begun + self.made as f64 * self.period);
                continue;
            }
            loop {
                let time = self.begun + self.made as f64 * self.period;
                if time > self.held.time[row + 1] {
                    break;
                }
                self.interpolate(row, time);
            }
        }
        // A row before and all that wait.
        let spent = self.done.saturating_sub(1).min(rows);
        self.held.forget(spent);
        self.first += spent;
        self.done -= spent;
    }

    /// A recorded row at another time.
    fn push(&mut self, row: usize, time: f64) {
        self.out.extend(&self.held, row..row + 1);
        self.came(row, time);
    }

    fn came(&mut self, row: usize, time: f64) {
        if let Some(last) = self.out.time.last_mut() {
            *last = time;
        }
        self.origin.push(self.first + row);
        self.last = time;
        self.made += 1;
    }

    /// A row between a held one and the next: cubic, with the slopes of parabolas through the neighbouring rows.
    fn interpolate(&mut self, row: usize, time: f64) {
        let stamps = &self.held.time;
        let (from, step) = (stamps[row], stamps[row + 1] - stamps[row]);
        let share = (time - from) / step;
        let before = (row > 0 && !self.is_torn(row)).then(|| stamps[row] - stamps[row - 1]);
        let after = (row + 2 < stamps.len() && !self.is_torn(row + 2))
            .then(|| stamps[row + 2] - stamps[row + 1]);
        let left = share * share;
        let [start, end] = [
            1.0 - 3.0 * left + 2.0 * left * share,
            3.0 * left - 2.0 * left * share,
        ];
        let [leaving, arriving] = [share - 2.0 * left + left * share, left * share - left];
        // Weights of the rows before, here, next and after it.
        let mut weights = [0.0, start, end, 0.0];
        // Slopes times the step: of what this step alone has, and of what the neighbouring one has.
        let mut slope = |weight: f64, own: [usize; 2], neighbour: Option<(f64, [usize; 2])>| {
            let (mine, other) = neighbour.map_or((1.0, 0.0), |(length, _)| {
                (length / (step + length), step / (step + length))
            });
            weights[own[0]] -= weight * mine;
            weights[own[1]] += weight * mine;
            if let Some((length, places)) = neighbour {
                weights[places[0]] -= weight * other * step / length;
                weights[places[1]] += weight * other * step / length;
            }
        };
        slope(leaving, [1, 2], before.map(|length| (length, [0, 1])));
        slope(arriving, [1, 2], after.map(|length| (length, [2, 3])));
        self.out.extend(&self.held, row..row + 1);
        let at = |values: &[f64], width: usize, entry: usize| -> f64 {
            let places = (0..4).filter(|place| weights[*place] != 0.0);
            places
                .map(|place| weights[place] * values[(row + place - 1) * width + entry])
                .sum()
        };
        let n = self.held.joints;
        let rewrite = |out: &mut Vec<f64>, values: &[f64], width: usize| {
            let first = out.len() - width;
            (0..width).for_each(|entry| out[first + entry] = at(values, width, entry));
        };
        rewrite(&mut self.out.position, &self.held.position, n);
        rewrite(&mut self.out.torque, &self.held.torque, n);
        for (out, held, width) in [
            (&mut self.out.velocity, &self.held.velocity, n),
            (&mut self.out.temperature, &self.held.temperature, 1),
        ] {
            out.iter_mut()
                .zip(held)
                .for_each(|(out, held)| rewrite(out, held, width));
        }
        self.came(row, time);
    }
}
