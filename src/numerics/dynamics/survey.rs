//! A first reading of a long recording, block by block: whether it can be used, how fast rows come and how fast joints come and go.

use super::check::row_faults;
use super::clock::{ClockPace, RecordingClock};
use super::cutoff::MotionPace;
use super::extremes::TorqueExtremes;
use super::recording::TorqueRecording;
use super::source::TorqueSource;
use crate::error::{Error, Result};
use crate::statistics::nearest;

/// What is known of a long recording before it is thinned.
pub(super) struct RecordingSurvey {
    /// Median over blocks of their usual step; of each joint the largest of their steps.
    pub pace: ClockPace,
    /// Hz, as it will be chosen for the recording or a little above.
    pub cutoff: f64,
}

impl RecordingSurvey {
    /// Reads all rows. Fails where one of them, or a column as a whole, cannot be used.
    pub fn of(source: &dyn TorqueSource) -> Result<Self> {
        let n = source.joints();
        // The row before a block, to see whether its stretch goes on.
        let mut last = TorqueRecording::of_motion(n, Vec::new(), Vec::new());
        let (mut first, mut before) = (0, None);
        let (mut usual, mut fastest) = (Vec::new(), vec![0.0_f64; n]);
        let (mut motion, mut extremes) = (MotionPace::new(n), TorqueExtremes::new(n));
        source.blocks(&mut |block| {
            let faults = row_faults(block, first, before);
            if !faults.is_empty() {
                return Err(Error::Data(faults));
            }
            first += block.rows();
            before = block
                .time
                .last()
                .copied()
                .zip(block.trajectory.last().copied())
                .or(before);
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
                fastest
                    .iter_mut()
                    .zip(&pace.fastest)
                    .for_each(|(most, own)| *most = most.max(*own));
                usual.push(pace.usual);
            }
            Ok(())
        })?;
        let faults = extremes.faults();
        if !faults.is_empty() {
            return Err(Error::Data(faults));
        }
        let usual = nearest(&mut usual, 0.5).unwrap_or(1.0);
        Ok(Self {
            pace: ClockPace { usual, fastest },
            cutoff: motion.cutoff(1.0 / usual),
        })
    }
}
