//! The rows of a recording that a diagnosis works on: all of them, or of a long recording those that memory has room for.

use super::arm::DynamicArm;
use super::check;
use super::even::EvenSource;
use super::recording::{Bridged, RecordingClock, TorqueRecording, TorqueSource, bridged_remark};
use super::thin::{RecordingSurvey, Thinner, ThinningPlan};
use crate::error::Result;

/// Rows that are used as they were recorded; of longer recordings about so many are kept, however long they are.
const LIMIT: usize = 1 << 17;

/// Checked rows with their clock.
pub(super) struct UsedRecording {
    pub(crate) recording: TorqueRecording,
    pub(crate) clock: RecordingClock,
    /// The recorded row of each, or the one before it where it is made up.
    pub(crate) origin: Vec<usize>,
    /// What is odd about it, a sentence each.
    pub(crate) remarks: Vec<String>,
}

impl UsedRecording {
    /// What is used of a recording whose cut-off will be at so many Hz, or is not known yet. Fails where it cannot be used.
    pub(crate) fn of(
        arm: &DynamicArm,
        source: &dyn TorqueSource,
        cutoff: Option<f64>,
    ) -> Result<Self> {
        Self::within(arm, source, cutoff, LIMIT)
    }

    /// The same with room for another number of rows.
    pub(crate) fn within(
        arm: &DynamicArm,
        source: &dyn TorqueSource,
        cutoff: Option<f64>,
        most: usize,
    ) -> Result<Self> {
        let even = EvenSource::of(source)?;
        let source = even.as_ref().map_or(source, |even| even);
        let mut used = match source.rows() > most {
            true => Self::thinned(arm, source, cutoff, most)?,
            false => Self::whole(arm, source)?,
        };
        if let Some(even) = even {
            used.remarks.insert(0, even.remark);
        }
        Ok(used)
    }

    fn whole(arm: &DynamicArm, source: &dyn TorqueSource) -> Result<Self> {
        let mut whole: Option<TorqueRecording> = None;
        source.blocks(&mut |block| {
            match &mut whole {
                Some(whole) => whole.extend(block, 0..block.rows()),
                None => whole = Some(block.clone()),
            }
            Ok(())
        })?;
        let whole = whole
            .unwrap_or_else(|| TorqueRecording::of_motion(source.joints(), Vec::new(), Vec::new()));
        check::check(arm, &whole)?;
        let recorded = whole.rows();
        let Bridged { recording, origin } = Bridged::of(whole);
        let origin = source.recorded(&origin)?;
        let clock = RecordingClock::of(&recording);
        let mut remarks = check::remarks(&recording, &origin, &clock);
        remarks.extend(bridged_remark(recording.rows() - recorded));
        Ok(Self {
            recording,
            clock,
            origin,
            remarks,
        })
    }

    fn thinned(
        arm: &DynamicArm,
        source: &dyn TorqueSource,
        cutoff: Option<f64>,
        most: usize,
    ) -> Result<Self> {
        let survey = RecordingSurvey::of(source)?;
        let rate = 1.0 / survey.pace.usual;
        let plan = ThinningPlan::new(source.rows(), rate, cutoff.unwrap_or(survey.cutoff), most);
        let thinner = Thinner::read(source, &survey, &plan)?;
        let recording = thinner.kept;
        let clock = RecordingClock {
            rate: 1.0 / (survey.pace.usual * plan.every as f64),
            stretches: thinner.stretches,
        };
        check::check(arm, &recording)?;
        let rows = source.rows();
        let mut remarks = vec![thinning_remark(rows, &recording, &plan, clock.rate)];
        let (rows, lasted): (Vec<usize>, Vec<f64>) = thinner.tears.into_iter().unzip();
        let tears = source.recorded(&rows)?.into_iter().zip(lasted);
        remarks.extend(check::few(
            tears.map(|(row, lasted)| check::torn_at(row, lasted, survey.pace.usual)),
        ));
        remarks.extend(check::of_sets(&recording));
        remarks.extend(bridged_remark(thinner.made_up));
        Ok(Self {
            recording,
            clock,
            origin: source.recorded(&thinner.origin)?,
            remarks,
        })
    }
}

/// What was kept of a long recording.
fn thinning_remark(rows: usize, kept: &TorqueRecording, plan: &ThinningPlan, rate: f64) -> String {
    let [all, used] = plan.spans;
    let spans = if used < all {
        format!(" of {used} of {all} equal spans")
    } else {
        String::new()
    };
    format!(
        "{rows} rows are more than are held at once: {} are used, every {}th{spans} after a low-pass without delay, {rate:.1} Hz",
        kept.rows(),
        plan.every
    )
}

#[cfg(test)]
mod tests {
    use super::super::cases::{Blocks, arm, found, record_at};
    use super::super::diagnose_used;
    use super::super::recording::{add, column, largest};
    use super::super::types::TorqueQuestion;
    use super::*;

    /// 40 s at 2 kHz with friction in two joints.
    fn long() -> TorqueRecording {
        record_at(
            &arm(),
            2000.0,
            0.0,
            &|(joint, _, _, velocity, _, _)| match joint {
                1 => 6.0 * (velocity / 0.01).tanh() + 9.0 * velocity,
                2 => 3.0 * (velocity / 0.01).tanh(),
                _ => 0.0,
            },
        )
    }

    #[test]
    fn a_thinned_recording_tells_what_the_whole_one_does() {
        let recording = Blocks(long(), 7001);
        let diagnosed = |most: usize| {
            let used = UsedRecording::within(&arm(), &recording, None, most).unwrap();
            let (rows, question) = (used.recording.rows(), TorqueQuestion::default());
            (
                rows,
                diagnose_used(&arm(), used, &question, &mut |_| ()).unwrap(),
            )
        };
        let ((all, whole), (few, thinned)) = (diagnosed(usize::MAX), diagnosed(10_000));
        assert!(all == 80_000 && few == 10_000, "{all} {few}");
        assert_eq!(found(&whole), found(&thinned));
        for (one, other) in whole.findings.iter().zip(&thinned.findings) {
            for (a, b) in one.parameters.iter().zip(&other.parameters) {
                let near = (a.value - b.value).abs() < 0.5 * a.sigma.unwrap_or(0.0);
                assert!(near, "{}: {a:?} {b:?}", one.effect);
            }
        }
        assert!((whole.after.nrmse_mean / thinned.after.nrmse_mean - 1.0).abs() < 0.05);
        assert!(
            thinned.remarks[0].starts_with(
                "80000 rows are more than are held at once: 10000 are used, every 8th"
            )
        );
    }

    #[test]
    fn it_does_not_matter_where_blocks_end() {
        let recording = long();
        let thinned = |block: usize| {
            UsedRecording::within(&arm(), &Blocks(recording.clone(), block), None, 10_000).unwrap()
        };
        let (one, other) = (thinned(80_000), thinned(1500));
        assert_eq!(one.origin, other.origin);
        assert_eq!(one.recording.time, other.recording.time);
        let [mut one, other] = [one.recording, other.recording];
        add(&mut one.position, -1.0, &other.position);
        add(&mut one.torque, -1.0, &other.torque);
        let [far, torque] = [&one.position, &one.torque].map(largest);
        assert!(far < 1e-9 && torque < 1e-6, "{far} {torque}");
    }

    #[test]
    fn spans_are_left_out_evenly_and_gaps_are_seen_where_they_were() {
        let plan = ThinningPlan::new(10_000_000, 500.0, 10.0, LIMIT);
        assert_eq!((plan.every, plan.spans), (5, [306, 20]));
        let mut recording = long();
        let later = recording.time[30_001..].iter_mut();
        later.for_each(|time| *time += 0.5);
        // Three rows are lost.
        let mut lost = TorqueRecording::like(&recording);
        lost.extend(&recording, 0..50_000);
        lost.extend(&recording, 50_003..80_000);
        let used = UsedRecording::within(&arm(), &Blocks(lost, 4000), None, 10_000).unwrap();
        assert_eq!(used.clock.stretches.len(), 2);
        assert_eq!(used.origin[used.clock.stretches[1].start], 30_001);
        let remarks = used.remarks.join("; ");
        assert!(
            remarks.contains("row 30002: the clock jumps by 0.501 s")
                && remarks.contains("3 steps of the clock"),
            "{remarks}"
        );
        assert!((used.recording.time.last().unwrap() - 40.5).abs() < 0.005);
    }

    #[test]
    fn a_saturated_torque_and_a_clock_that_goes_back_are_seen_before_rows_are_thinned() {
        let refused = |spoilt: &dyn Fn(&mut TorqueRecording)| {
            let mut recording = long();
            spoilt(&mut recording);
            let used = UsedRecording::within(&arm(), &Blocks(recording, 9000), None, 10_000);
            used.err().expect("a fault").to_string()
        };
        let saturated = refused(&|recording| {
            let mut sorted = column(&recording.torque, 4, 1);
            sorted.sort_by(f64::total_cmp);
            let torques = recording.torque.iter_mut().skip(1).step_by(4);
            torques.for_each(|torque| *torque = torque.min(sorted[70_000]));
        });
        assert!(
            saturated.contains("joint 2") && saturated.contains("cut off"),
            "{saturated}"
        );
        let back = refused(&|recording| recording.time[18_000] = 1.0);
        assert!(back.contains("row 18001: the clock goes from"), "{back}");
        assert!(
            refused(&|recording| recording.torque[4 * 20_000] = f64::NAN)
                .contains("row 20001: not a finite number")
        );
    }
}
