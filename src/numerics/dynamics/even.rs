//! Rows whose stamps are uneven, on an even clock.
//!
//! Filters and derivatives take rows as even. Where joints move by the stamps, rows are interpolated by these; where joints move from row to
//! row as by an even clock, it is the stamps that err, and rows get even ones. A pause ends a stretch either way.

use super::check::row_faults;
use super::recording::{TorqueRecording, TorqueSource};
use crate::criteria::torque::{PAUSE, UNEVEN, UNEVEN_ROWS};
use crate::error::Result;
use crate::statistics::nearest;

/// Steps that tell what is usual, at most.
const STEPS: usize = 1 << 16;
/// Rounds in which the mean step and what is no pause find each other.
const ROUNDS: usize = 4;

/// A recording of uneven stamps as one of even steps.
pub(super) struct EvenSource<'a> {
    source: &'a dyn TorqueSource,
    /// s, of a step.
    period: f64,
    /// Longer steps are pauses, s.
    pause: f64,
    by_stamps: bool,
    rows: usize,
    /// What was found and done.
    pub(crate) remark: String,
}

/// What is known of the steps of a clock.
#[derive(Default)]
struct ClockSteps {
    /// s, ascending.
    sorted: Vec<f64>,
    uneven: usize,
    /// Squares of what neighbours leave of a row's angles, by stamps and by rows; each over the mean square of its joint's steps.
    apart: [f64; 2],
}

impl<'a> EvenSource<'a> {
    /// The recording by an even clock; none where its steps are even, or a row cannot be used, which others say.
    pub(crate) fn of(source: &'a dyn TorqueSource) -> Result<Option<Self>> {
        let Some(steps) = ClockSteps::of(source)? else {
            return Ok(None);
        };
        let (Some(first), Some(last)) = (steps.sorted.first(), steps.sorted.last()) else {
            return Ok(None);
        };
        if (steps.uneven as f64) < *UNEVEN_ROWS * steps.sorted.len() as f64 {
            return Ok(None);
        }
        let period = steps.period();
        let pause = *PAUSE * period;
        let bridged = steps
            .sorted
            .iter()
            .rfind(|step| **step <= pause)
            .unwrap_or(first);
        let by_stamps = steps.apart[0] <= steps.apart[1];
        let done = match by_stamps {
            true => "rows are interpolated by their stamps to",
            false => {
                "joints move from row to row as by an even clock, so that the stamps err: rows are taken as"
            }
        };
        let remark = format!(
            "the clock is uneven, steps of {:.1} to {:.1} ms: {done} even steps of {:.2} ms; the longest gap bridged has {:.1} ms, longer \
             ones than {:.1} ms end a stretch",
            1e3 * first,
            1e3 * last,
            1e3 * period,
            1e3 * bridged,
            1e3 * pause
        );
        let mut even = Self {
            source,
            period,
            pause,
            by_stamps,
            rows: 0,
            remark,
        };
        let mut rows = 0;
        even.each(&mut |block, _| {
            rows += block.rows();
            Ok(())
        })?;
        even.rows = rows;
        Ok(Some(even))
    }

    /// Hands on even rows, each with the recorded row that it is or comes after.
    fn each(&self, take: &mut dyn FnMut(&TorqueRecording, &[usize]) -> Result<()>) -> Result<()> {
        let mut resampler: Option<Resampler> = None;
        self.source.blocks(&mut |block| {
            let resampler = resampler.get_or_insert_with(|| {
                Resampler::new([self.period, self.pause], self.by_stamps, block)
            });
            resampler.held.extend(block, 0..block.rows());
            resampler.advance(false);
            resampler.hand_on(take)
        })?;
        let Some(mut resampler) = resampler else {
            return Ok(());
        };
        resampler.advance(true);
        resampler.hand_on(take)
    }
}

impl TorqueSource for EvenSource<'_> {
    fn joints(&self) -> usize {
        self.source.joints()
    }

    fn rows(&self) -> usize {
        self.rows
    }

    fn blocks(&self, take: &mut dyn FnMut(&TorqueRecording) -> Result<()>) -> Result<()> {
        self.each(&mut |block, _| take(block))
    }

    fn recorded(&self, rows: &[usize]) -> Result<Vec<usize>> {
        let (mut first, mut recorded) = (0, Vec::with_capacity(rows.len()));
        self.each(&mut |block, origin| {
            let tail = &rows[recorded.len()..];
            let tail = &tail[..tail.partition_point(|row| *row < first + block.rows())];
            recorded.extend(tail.iter().map(|row| origin[row - first]));
            first += block.rows();
            Ok(())
        })?;
        Ok(recorded)
    }
}

impl ClockSteps {
    /// None where a row cannot be used.
    fn of(source: &dyn TorqueSource) -> Result<Option<Self>> {
        let (mut all, mut apart, mut moved) = (Vec::new(), [Vec::new(), Vec::new()], Vec::new());
        let mut sound = true;
        source.blocks(&mut |block| {
            sound &= is_sound(block, source.joints());
            if sound && all.len() < STEPS {
                all.extend(
                    block
                        .time
                        .windows(2)
                        .map(|pair| pair[1] - pair[0])
                        .filter(|step| *step > 0.0),
                );
                gather(block, &mut apart, &mut moved);
            }
            Ok(())
        })?;
        if !sound {
            return Ok(None);
        }
        all.sort_by(f64::total_cmp);
        let usual = nearest(&mut all.clone(), 0.5).unwrap_or(1.0);
        let off = |step: &f64| {
            let steps = (step / usual).round();
            // Rows that are lost are bridged as they are of any clock.
            !(1.0..=*PAUSE).contains(&steps) || (step - steps * usual).abs() > *UNEVEN * usual
        };
        let long = all.iter().filter(|step| **step > 1.5 * usual).count();
        // A clock of few ticks: most steps are some of them.
        let is_coarse = long as f64 > *UNEVEN * all.len() as f64;
        let uneven = if is_coarse {
            all.len()
        } else {
            all.iter().filter(|step| off(step)).count()
        };
        let over = |square: &[f64]| {
            square
                .iter()
                .zip(&moved)
                .map(|(value, scale)| value / f64::max(*scale, f64::MIN_POSITIVE))
                .sum()
        };
        Ok(Some(Self {
            uneven,
            apart: [over(&apart[0]), over(&apart[1])],
            sorted: all,
        }))
    }

    /// s, mean of the steps that are no pauses.
    fn period(&self) -> f64 {
        let mean = |steps: &[f64]| steps.iter().sum::<f64>() / steps.len().max(1) as f64;
        (0..ROUNDS).fold(mean(&self.sorted), |period, _| {
            mean(&self.sorted[..self.sorted.partition_point(|step| *step <= *PAUSE * period)])
        })
    }
}

/// Whether lists have their lengths and numbers are numbers that ascend.
fn is_sound(block: &TorqueRecording, joints: usize) -> bool {
    let rows = block.rows();
    let mut columns = block.columns().into_iter();
    let is_long =
        |(all, wide): (Option<&Vec<f64>>, usize)| all.is_none_or(|all| all.len() == wide * rows);
    block.joints == joints
        && columns.all(is_long)
        && [block.trajectory.len(), block.held_out.len()] == [rows; 2]
        && row_faults(block, 0, None).is_empty()
}

/// Adds, joint by joint, squares of steps and of what the straight line between the neighbouring rows leaves of a row, by stamps and by rows.
fn gather(block: &TorqueRecording, apart: &mut [Vec<f64>; 2], moved: &mut Vec<f64>) {
    let n = block.joints;
    apart.iter_mut().for_each(|all| all.resize(n, 0.0));
    let [by_stamps, by_rows] = apart;
    moved.resize(n, 0.0);
    let (time, angles) = (&block.time, &block.position);
    for row in 1..block.rows().saturating_sub(1) {
        let share = (time[row] - time[row - 1]) / (time[row + 1] - time[row - 1]);
        if !(0.0..=1.0).contains(&share) {
            continue;
        }
        for joint in 0..n {
            let [before, here, after] = [row - 1, row, row + 1].map(|row| angles[row * n + joint]);
            by_stamps[joint] += (here - before - share * (after - before)).powi(2);
            by_rows[joint] += (here - 0.5 * (before + after)).powi(2);
            moved[joint] += (after - before).powi(2);
        }
    }
}

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
        let mut slope = |weight: f64, columns: [usize; 2], neighbour: Option<(f64, [usize; 2])>| {
            let (mine, other) = neighbour.map_or((1.0, 0.0), |(length, _)| {
                (length / (step + length), step / (step + length))
            });
            weights[columns[0]] -= weight * mine;
            weights[columns[1]] += weight * mine;
            if let Some((length, places)) = neighbour {
                weights[places[0]] -= weight * other * step / length;
                weights[places[1]] += weight * other * step / length;
            }
        };
        slope(leaving, [1, 2], before.map(|length| (length, [0, 1])));
        slope(arriving, [1, 2], after.map(|length| (length, [2, 3])));
        self.out.extend(&self.held, row..row + 1);
        self.out.each(&self.held, |out, held, wide| {
            let first = out.len() - wide;
            for entry in 0..wide {
                let places = (0..4).filter(|place| weights[*place] != 0.0);
                out[first + entry] = places
                    .map(|place| weights[place] * held[(row + place - 1) * wide + entry])
                    .sum();
            }
        });
        self.came(row, time);
    }
}

#[cfg(test)]
mod tests {
    use super::super::cases::{Blocks, bare};
    use super::super::used::UsedRecording;
    use super::*;
    use rand::rngs::ChaCha8Rng;
    use rand::{RngExt, SeedableRng};

    /// Hz of the mean clock.
    const RATE: f64 = 200.0;

    /// A motion of four joints, rad, with its torque, Nm.
    fn moved(time: f64, joint: usize) -> [f64; 2] {
        let turn = 2.0 * time + joint as f64;
        [0.5 * turn.sin(), 20.0 * turn.cos()]
    }

    /// Rows at some times, stamped at others; a blank of 2 s after row 2000.
    fn rows(times: &[f64], stamps: &[f64]) -> TorqueRecording {
        let all = |part: usize| {
            times
                .iter()
                .flat_map(|time| (0..4).map(move |joint| moved(*time, joint)[part]))
                .collect()
        };
        let after = |time: &f64| time + if *time > 10.0 { 2.0 } else { 0.0 };
        let stamps = stamps.iter().map(after).collect();
        TorqueRecording {
            torque: all(1),
            ..TorqueRecording::of_motion(4, stamps, all(0))
        }
    }

    /// Steps of 0.7 to 9.3 ms in disorder.
    fn uneven() -> Vec<f64> {
        let mut dice = ChaCha8Rng::seed_from_u64(5);
        let mut time = 0.0;
        let step = || {
            time += (0.7 + 8.6 * dice.random::<f64>()) / 1e3;
            time
        };
        std::iter::repeat_with(step).take(4000).collect()
    }

    #[test]
    fn rows_of_uneven_stamps_are_those_of_an_even_clock_and_a_pause_ends_a_stretch() {
        let times = uneven();
        let recording = rows(&times, &times);
        let used = UsedRecording::of(&bare(), &recording, None).unwrap();
        assert!(
            used.remarks[0].starts_with("the clock is uneven, steps of 0.7 to ")
                && used.remarks[0].contains("by their stamps")
        );
        assert_eq!(used.clock.stretches.len(), 2, "{:?}", used.remarks);
        assert!(
            (used.clock.rate / RATE - 1.0).abs() < 0.02,
            "{}",
            used.clock.rate
        );
        let mut worst = [0.0_f64; 2];
        for (row, time) in used.recording.time.iter().enumerate() {
            let time = if *time > 11.0 { time - 2.0 } else { *time };
            for joint in 0..4 {
                let [angle, torque] = moved(time, joint);
                worst[0] = worst[0].max((used.recording.position[4 * row + joint] - angle).abs());
                worst[1] = worst[1].max((used.recording.torque[4 * row + joint] - torque).abs());
            }
            // The recorded row that it comes after.
            let origin = used.origin[row];
            assert!(recording.time[origin] <= used.recording.time[row] + 1e-9);
            assert!(
                recording
                    .time
                    .get(origin + 1)
                    .is_none_or(|next| *next > used.recording.time[row] - 1e-9)
            );
        }
        assert!(worst[0] < 1e-5 && worst[1] < 1e-3, "{worst:?}");
    }

    #[test]
    fn it_does_not_matter_where_blocks_of_uneven_rows_end() {
        let times = uneven();
        let even = |block: usize| {
            let source = Blocks(rows(&times, &times), block);
            let even = EvenSource::of(&source).unwrap().expect("uneven");
            // The same steps whatever the blocks: those at their borders are not counted.
            let even = EvenSource {
                period: 0.005,
                pause: 0.03,
                ..even
            };
            let (mut all, mut from) = (TorqueRecording::like(&source.0), Vec::new());
            even.each(&mut |block, origin| {
                all.extend(block, 0..block.rows());
                from.extend_from_slice(origin);
                Ok(())
            })
            .unwrap();
            let asked: Vec<usize> = (0..from.len()).step_by(97).collect();
            assert_eq!(
                even.recorded(&asked).unwrap(),
                asked.iter().map(|row| from[*row]).collect::<Vec<usize>>()
            );
            (all, from)
        };
        assert_eq!(even(4000), even(7));
    }

    #[test]
    fn stamps_that_err_over_rows_of_an_even_clock_are_not_believed() {
        let mut dice = ChaCha8Rng::seed_from_u64(9);
        let times: Vec<f64> = (0..4000).map(|row| f64::from(row) / RATE).collect();
        let stamps: Vec<f64> = times
            .iter()
            .map(|time| time + 0.004 * dice.random::<f64>())
            .collect();
        let used = UsedRecording::of(&bare(), &rows(&times, &stamps), None).unwrap();
        assert!(
            used.remarks[0].contains("the stamps err"),
            "{}",
            used.remarks[0]
        );
        assert_eq!(used.recording.position, rows(&times, &stamps).position);
        let first = &used.recording.time[..2000];
        assert!(
            first
                .iter()
                .zip(&times)
                .all(|(made, time)| (made - time).abs() < 0.006)
        );
    }
}
