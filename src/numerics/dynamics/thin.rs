//! A long recording in memory that does not grow with it. A first reading tells whether it can be used, how fast rows come and how fast joints
//! come and go; then it goes block by block through a low-pass, of which every k-th row is kept.
//!
//! A course that is filtered before its rows are thinned keeps what is slow. Blocks overlap by what the filter remembers, so that it does not
//! matter where they end.

use super::check::{TorqueExtremes, none_of, row_faults};
use super::filter::ZeroPhase;
use super::recording::{
    Bridged, ClockPace, MotionPace, RecordingClock, TorqueRecording, TorqueSource, by_joint,
};
use crate::error::Result;
use crate::statistics::nearest;
use std::ops::Range;

/// The rate of kept rows over the cut-off, at least: far from both, friction that turns with the direction is still sampled well.
const RATE_OVER_CUTOFF: f64 = 10.0;
/// The low-pass before thinning, as a share of the rate of kept rows.
const BAND: f64 = 0.4;
/// Rows that the low-pass remembers, as a share of rate over cut-off.
const MEMORY: f64 = 20.0;
/// Rows of a span: a recording that is still too long keeps some spans and leaves out others, evenly.
const SPAN: usize = 1 << 15;
/// Rows before and after a gap that say what was lost in it.
const CONTEXT: usize = 4;

/// Which rows of a long recording are kept.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ThinningPlan {
    /// One of so many rows is kept.
    pub(crate) every: usize,
    /// Spans of the recording, and how many of them are kept.
    pub(crate) spans: [usize; 2],
}

impl ThinningPlan {
    /// For at most `most` rows (and some more where rows were lost), with a cut-off that will be at `cutoff` Hz.
    pub(crate) fn new(rows: usize, rate: f64, cutoff: f64, most: usize) -> Self {
        let every = rows
            .div_ceil(most)
            .min((rate / (RATE_OVER_CUTOFF * cutoff)) as usize)
            .max(1);
        let all = rows.div_ceil(SPAN);
        let kept = match rows.div_ceil(every) > most {
            true => (most * every / SPAN).clamp(1, all),
            false => all,
        };
        Self {
            every,
            spans: [all, kept],
        }
    }

    /// Whether a recorded row lies in a span that is kept.
    fn keeps(&self, row: usize) -> bool {
        let [all, kept] = self.spans;
        let before = |span: usize| span * kept / all;
        before(row / SPAN + 1) > before(row / SPAN)
    }
}

/// Keeps some rows of a recording as its blocks come.
pub(super) struct Thinner {
    plan: ThinningPlan,
    pace: ClockPace,
    filter: ZeroPhase,
    /// Rows beyond which the filter does not feel its neighbours.
    margin: usize,
    /// The last rows as they were recorded, of which the first `passed` have gone on.
    recorded: TorqueRecording,
    passed: usize,
    /// Recorded row of the first of these.
    first: usize,
    /// The present stretch: rows without gaps, of which those before `begun` are already gone; with their origins.
    stretch: TorqueRecording,
    origins: Vec<usize>,
    begun: usize,
    /// The next row of the stretch to keep.
    next: usize,
    pub(crate) kept: TorqueRecording,
    /// The recorded row of each.
    pub(crate) origin: Vec<usize>,
    /// Kept rows without a gap.
    pub(crate) stretches: Vec<Range<usize>>,
    /// Rows that were made up where some were lost.
    pub(crate) made_up: usize,
    /// Recorded rows before which clock or joints jump, and s since the row before.
    pub(crate) tears: Vec<(usize, f64)>,
}

impl Thinner {
    /// Reads all rows once more.
    pub(crate) fn read(
        source: &dyn TorqueSource,
        survey: &RecordingSurvey,
        plan: &ThinningPlan,
    ) -> Result<Self> {
        let mut thinner: Option<Self> = None;
        let new = |like: &TorqueRecording| Self::new(like, survey.pace.clone(), plan.clone());
        source.blocks(&mut |block| {
            thinner.get_or_insert_with(|| new(block)).push(block);
            Ok(())
        })?;
        let nothing = || TorqueRecording::of_motion(source.joints(), Vec::new(), Vec::new());
        let mut thinner = thinner.unwrap_or_else(|| new(&nothing()));
        thinner.pass_on(0);
        thinner.end_stretch();
        Ok(thinner)
    }

    fn new(like: &TorqueRecording, pace: ClockPace, plan: ThinningPlan) -> Self {
        // Rates are shares of that of kept rows, whatever the clock: what the filter does depends on nothing that blocks measure.
        let rate = plan.every as f64;
        let filter = ZeroPhase::new(rate, if plan.every > 1 { BAND } else { rate });
        let nothing = || TorqueRecording::like(like);
        Self {
            margin: match plan.every > 1 {
                true => (MEMORY * rate / BAND) as usize,
                false => 0,
            },
            filter,
            plan,
            pace,
            recorded: nothing(),
            passed: 0,
            first: 0,
            stretch: nothing(),
            origins: Vec::new(),
            begun: 0,
            next: 0,
            kept: nothing(),
            origin: Vec::new(),
            stretches: Vec::new(),
            made_up: 0,
            tears: Vec::new(),
        }
    }

    fn push(&mut self, block: &TorqueRecording) {
        self.recorded.extend(block, 0..block.rows());
        self.pass_on(CONTEXT);
        self.keep(false);
    }

    /// Passes recorded rows on to the stretch, but the last `waiting` ones, with those that were lost between them.
    fn pass_on(&mut self, waiting: usize) {
        let end = self
            .recorded
            .rows()
            .saturating_sub(waiting)
            .max(self.passed);
        let like = TorqueRecording::like(&self.recorded);
        let recorded = std::mem::replace(&mut self.recorded, like);
        let bridged = Bridged::by_steps(recorded, self.pace.usual);
        let mut now = bridged.origin.partition_point(|row| *row < self.passed);
        let last = bridged.origin.partition_point(|row| *row < end);
        self.made_up += (last - now) - (end - self.passed);
        while now < last {
            let row = self.first + bridged.origin[now];
            let torn = now > 0 && self.pace.is_torn(&bridged.recording, now);
            if torn {
                let time = &bridged.recording.time;
                self.tears.push((row, time[now] - time[now - 1]));
            }
            if torn || !self.plan.keeps(row) {
                self.end_stretch();
            }
            // To the next tear or border of a span.
            let goes_on = |next: &usize| {
                let origin = self.first + bridged.origin[*next];
                origin / SPAN == row / SPAN && !self.pace.is_torn(&bridged.recording, *next)
            };
            let until = (now + 1..last).take_while(goes_on).last().unwrap_or(now) + 1;
            if self.plan.keeps(row) {
                self.stretch.extend(&bridged.recording, now..until);
                let origins = bridged.origin[now..until].iter();
                self.origins.extend(origins.map(|row| self.first + row));
            }
            now = until;
        }
        // What is kept of the recorded rows: some that show what is lost next to them, those that wait, and none that was made up.
        let from = end.saturating_sub(CONTEXT);
        let mut tail = TorqueRecording::like(&bridged.recording);
        let recorded = |at: &usize| *at == 0 || bridged.origin[*at] != bridged.origin[*at - 1];
        let all = bridged.origin.partition_point(|row| *row < from)..bridged.origin.len();
        all.filter(recorded)
            .for_each(|at| tail.extend(&bridged.recording, at..at + 1));
        self.recorded = tail;
        self.first += from;
        self.passed = end - from;
    }

    /// Keeps every k-th row of the stretch, as far as the filter knows it.
    fn keep(&mut self, ends: bool) {
        let rows = self.stretch.rows();
        let known = rows.saturating_sub(if ends { 0 } else { self.margin });
        let chosen = (self.next - self.begun..known).step_by(self.plan.every);
        let chosen: Vec<usize> = chosen.collect();
        if !chosen.is_empty() {
            let number = self.stretches.len() as u32 + 1;
            let thinned = |values: &[f64]| -> Vec<f64> {
                let mut courses = by_joint(values, self.stretch.joints);
                self.filter.apply(&mut courses);
                let rows = chosen.iter();
                rows.flat_map(|row| courses.iter().map(|course| course[*row]))
                    .collect()
            };
            let picked = |values: &[f64]| chosen.iter().map(|row| values[*row]).collect();
            let stretch = &self.stretch;
            let block = TorqueRecording {
                time: picked(&stretch.time),
                position: thinned(&stretch.position),
                velocity: stretch.velocity.as_deref().map(thinned),
                torque: thinned(&stretch.torque),
                simulated: stretch.simulated.as_deref().map(thinned),
                temperature: stretch.temperature.as_deref().map(picked),
                trajectory: vec![number; chosen.len()],
                held_out: chosen.iter().map(|row| stretch.held_out[*row]).collect(),
                ..TorqueRecording::like(stretch)
            };
            self.kept.extend(&block, 0..chosen.len());
            let origins = chosen.iter().map(|row| self.origins[*row]);
            self.origin.extend(origins);
            self.next += chosen.len() * self.plan.every;
        }
        let spent = (self.next - self.begun)
            .saturating_sub(self.margin)
            .min(rows);
        self.stretch.forget(spent);
        self.origins.drain(..spent);
        self.begun += spent;
    }

    fn end_stretch(&mut self) {
        self.keep(true);
        let first = self.stretches.last().map_or(0, |stretch| stretch.end);
        if self.kept.rows() > first {
            self.stretches.push(first..self.kept.rows());
        }
        self.stretch.forget(self.stretch.rows());
        self.origins.clear();
        (self.begun, self.next) = (0, 0);
    }
}

/// What is known of a long recording before it is thinned.
pub(super) struct RecordingSurvey {
    /// Median over blocks of their usual step; of each joint the largest of their steps.
    pub(crate) pace: ClockPace,
    /// Hz, as it will be chosen for the recording or a little above.
    pub(crate) cutoff: f64,
}

impl RecordingSurvey {
    /// Reads all rows. Fails where one of them, or a column as a whole, cannot be used.
    pub(crate) fn of(source: &dyn TorqueSource) -> Result<Self> {
        let n = source.joints();
        // The row before a block, to see whether its stretch goes on.
        let mut last = TorqueRecording::of_motion(n, Vec::new(), Vec::new());
        let (mut first, mut before) = (0, None);
        let (mut usual, mut fastest) = (Vec::new(), vec![0.0_f64; n]);
        let (mut motion, mut extremes) = (MotionPace::new(n), TorqueExtremes::new(n));
        source.blocks(&mut |block| {
            none_of(row_faults(block, first, before))?;
            first += block.rows();
            let stamp = block.time.last().copied();
            before = stamp.zip(block.trajectory.last().copied()).or(before);
            extremes.push(&block.torque);
            if block.rows() > 1 {
                let pace = ClockPace::of(block);
                let mut border = TorqueRecording::like(block);
                border.extend(&last, 0..last.rows());
                border.extend(block, 0..1);
                let continues = last.rows() > 0 && !pace.is_torn(&border, 1);
                motion.push(block, &RecordingClock::paced(block, &pace), continues);
                last = TorqueRecording::like(block);
                last.extend(block, block.rows() - 1..block.rows());
                for (most, value) in fastest.iter_mut().zip(&pace.fastest) {
                    *most = most.max(*value);
                }
                usual.push(pace.usual);
            }
            Ok(())
        })?;
        none_of(extremes.faults())?;
        let usual = nearest(&mut usual, 0.5).unwrap_or(1.0);
        Ok(Self {
            pace: ClockPace { usual, fastest },
            cutoff: motion.cutoff(1.0 / usual),
        })
    }
}
