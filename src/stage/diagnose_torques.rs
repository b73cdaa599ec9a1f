//! `diagnose_torques`: which physics the rigid inverse dynamics of the robot file lacks while the arm moves.

use crate::declared_effects::declared_effects;
use crate::diagnose::must_be_a_prior;
use crate::dynamic_arm::{HeldOut, RecordedTorques, dynamic_arm, must_be_bodies};
use crate::dynamics::{DynamicArm, TorqueQuestion, diagnose, is_cause};
use crate::effect::{DeclarationFault, DeclaredTorque, EffectDeclaration};
use crate::error::{Error, Place, Result, counted};
use crate::table::{
    ArmMotion, BodyConsistencies, Contacts, FrictionCurves, Inertials, JointTorques, Robot,
    TorqueCourse, TorqueCovariance, TorqueFindings, TorqueNumbers, TorqueParameters, TorqueRivals,
    TorqueVerdict, VerdictSentences,
};
use crate::{Chunks, Context, RawFile, Stage};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Settings of `diagnose_torques`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiagnoseTorques {
    /// Labels of the recording's `usage` to fit; all other rows judge.
    #[serde(default = "crate::fit_set")]
    pub on: Vec<String>,
    /// Rows that are held out instead of those that `usage` labels otherwise; by default the last 30 %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hold_out: Option<HoldOut>,
    /// Whether masses are free within their tolerance, or identified without regard to what is declared.
    #[serde(default)]
    pub inertials: InertialSetting,
    /// Whether it is reported that no body has a link's inertial numbers, or the nearest of bodies are taken (in the metric of their
    /// covariance), which needs declared masses.
    #[serde(default)]
    pub consistency: ConsistencySetting,
    /// Hz, of the low-pass that measured and simulated torque have in common; by default from 10 Hz to a tenth of the rate, by how fast the
    /// joints come and go.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cutoff_hz: Option<f64>,
    /// Names that are not given: what such a cause explains is `unknown` at its place.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Prior probability that what acts somewhere is no cause of the list: 0.1 for an arm like many, 0.5 where little is known of it. Its odds
    /// scale those of causes without a name.
    #[serde(default = "crate::diagnose::open_world")]
    pub open_world: f64,
    /// Files with laws of torque of your own, which are compared with those of the library.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<RawFile>,
}

/// Which rows are held out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum HoldOut {
    /// So large a share at the end of the recording, between 0 and 1.
    Last(f64),
    /// These stretches of the recording, from 1.
    Trajectories(Vec<i64>),
    /// Every k-th second of the recording, k from 2: with 3 the third, the sixth and so on.
    EverySecond(u32),
}

/// What masses rest on.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InertialSetting {
    /// Declared, free within their tolerance; identified where the robot file lacks some.
    #[default]
    Declared,
    /// Identified: errors of payload, links and torque constants vanish in them.
    Free,
}

/// What is done where no body has a link's numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConsistencySetting {
    /// The table `consistency` says so.
    #[default]
    Report,
    /// The nearest numbers that bodies have are taken.
    Enforce,
}

/// Share of the rows that is held out where nothing is said.
const LAST: f64 = 0.3;

crate::stage! {
    DiagnoseTorques, "diagnose_torques", 28, "names the physics that the simulated torques of a moving arm lack",
        DiagnoseTorquesReads {
            robot: Robot,
            motion: Chunks<ArmMotion>,
        } -> DiagnoseTorquesWrites {
            verdict: TorqueVerdict,
            sentences: VerdictSentences,
            findings: TorqueFindings,
            numbers: TorqueNumbers,
            rivals: TorqueRivals,
            joints: JointTorques,
            course: TorqueCourse,
            friction: FrictionCurves,
            inertials: Inertials,
            contacts: Contacts,
            consistency: BodyConsistencies,
            parameters: TorqueParameters,
            covariance: TorqueCovariance,
        }
}

impl Stage for DiagnoseTorques {
    fn files(&self) -> Vec<(String, RawFile)> {
        let files = self.effects.iter().enumerate();
        files
            .map(|(k, file)| (format!("effects[{k}]"), file.clone()))
            .collect()
    }

    fn faults(&self, at: &mut Place) {
        crate::must_name_sets(&self.on, "fit", at);
        match &self.hold_out {
            Some(HoldOut::Last(share)) => at
                .at("hold_out.last")
                .must(*share > 0.0 && *share < 1.0, "allowed: above 0 and below 1"),
            Some(HoldOut::Trajectories(all)) => at
                .at("hold_out.trajectories")
                .must(!all.is_empty(), "name at least one, e.g. [4]"),
            Some(HoldOut::EverySecond(n)) => at
                .at("hold_out.every_second")
                .must(*n >= 2, "allowed: 2 and above"),
            None => {}
        }
        let possible = self.cutoff_hz.is_none_or(|hz| hz > 0.0 && hz.is_finite());
        at.at("cutoff_hz")
            .must(possible, "expected a frequency above 0, Hz");
        must_be_a_prior(self.open_world, at);
        at.at("consistency").must(
            self.consistency == ConsistencySetting::Report || self.inertials == InertialSetting::Declared,
            "`enforce` needs declared masses: base parameters stand for many arms, of which some are bodies; allowed with \
             `inertials: free`: report",
        );
    }

    fn look(
        &self,
        _reads: Option<DiagnoseTorquesReads>,
        context: &Context,
    ) -> Result<Option<DiagnoseTorquesWrites>> {
        declared_effects(&self.effects, law, context).map(|_| None)
    }

    fn run(&self, reads: DiagnoseTorquesReads, context: &Context) -> Result<DiagnoseTorquesWrites> {
        let (arm, recording, question) = self.asked(&reads, context)?;
        let mut tell = context.searching("looking for what the torques lack");
        let diagnosis = diagnose(&arm, &recording, &question, &mut tell)?;
        for remark in &diagnosis.remarks {
            context.note(remark);
        }
        let robot = reads.robot.to_description()?;
        let sequence = sequences(&reads.motion, &diagnosis.courses.row)?;
        Ok(DiagnoseTorquesWrites {
            verdict: TorqueVerdict::of(context.id, &diagnosis, recording.is_current()),
            sentences: VerdictSentences::of_torques(context.id, &diagnosis),
            findings: TorqueFindings::of(&diagnosis),
            numbers: TorqueNumbers::of(&diagnosis),
            rivals: TorqueRivals::of(&diagnosis),
            joints: JointTorques::of(&diagnosis),
            course: TorqueCourse::of(&diagnosis, &arm.prismatic, &sequence),
            friction: FrictionCurves::of(&diagnosis),
            inertials: Inertials::of(&diagnosis),
            contacts: Contacts::of(&diagnosis),
            consistency: BodyConsistencies::of(&diagnosis),
            parameters: TorqueParameters::of(&diagnosis.model)?.of_robot(&robot),
            covariance: TorqueCovariance::of(&diagnosis.model)?,
        })
    }
}

/// A law of a user's own, under a name that the library of torques does not have.
fn law(
    declaration: &EffectDeclaration,
) -> std::result::Result<DeclaredTorque, Vec<DeclarationFault>> {
    if is_cause(&declaration.name) {
        let message = format!(
            "`{}` is a cause of calib's own library; give yours another name",
            declaration.name
        );
        let path = "name".into();
        return Err(vec![DeclarationFault { path, message }]);
    }
    DeclaredTorque::of(declaration)
}

impl DiagnoseTorques {
    /// The arm, its recording, and what is asked of it.
    pub(super) fn asked<'r>(
        &'r self,
        reads: &'r DiagnoseTorquesReads,
        context: &Context,
    ) -> Result<(DynamicArm, RecordedTorques<'r>, TorqueQuestion)> {
        let robot = reads.robot.to_description()?;
        must_be_bodies(&robot)?;
        let (mut arm, notes) = dynamic_arm(&robot)?;
        notes.into_iter().for_each(|note| context.note(note));
        let free = self.inertials == InertialSetting::Free;
        if free {
            arm.links = None;
        }
        let held_out = self.held_out(&reads.motion, context)?;
        let recording = RecordedTorques::of(&reads.motion, &robot)?.holding_out(held_out);
        let enforce_bodies = self.consistency == ConsistencySetting::Enforce;
        if enforce_bodies && arm.links.is_none() {
            let message = "`enforce` needs declared masses, and the robot file lacks some: base parameters stand for many arms";
            return Err(Error::data("with.consistency", message));
        }
        let question = TorqueQuestion {
            free_inertials: free,
            cutoff: self.cutoff_hz,
            without: self.without.clone(),
            open_world: self.open_world,
            effects: declared_effects(&self.effects, law, context)?,
            enforce_bodies,
        };
        Ok((arm, recording, question))
    }
}

/// What is known of a motion before its rows are held out.
#[derive(Default)]
struct MotionLabels {
    /// s, of the first row.
    start: f64,
    labelled: bool,
    /// Labels of what rows are for.
    usages: Vec<String>,
    stretches: BTreeSet<i64>,
}

impl MotionLabels {
    fn of(motion: &Chunks<ArmMotion>) -> Result<Self> {
        let (mut labels, mut first) = (Self::default(), true);
        motion.each(|chunk| {
            if std::mem::take(&mut first) {
                labels.start = chunk.time.first().copied().unwrap_or_default();
            }
            labels.labelled |= chunk.usage.iter().any(Option::is_some);
            for label in chunk.usages {
                if !labels.usages.contains(&label) {
                    labels.usages.push(label);
                }
            }
            labels.stretches.extend(&chunk.trajectory);
            Ok(())
        })?;
        Ok(labels)
    }
}

/// Numbers of some rows, which ascend, in the table of motion.
fn sequences(motion: &Chunks<ArmMotion>, rows: &[usize]) -> Result<Vec<i64>> {
    let (mut first, mut sequences) = (0, Vec::with_capacity(rows.len()));
    motion.each(|chunk| {
        let here = &rows[sequences.len()..];
        let here = &here[..here.partition_point(|row| *row < first + chunk.rows())];
        sequences.extend(here.iter().map(|row| chunk.sequence[row - first]));
        first += chunk.rows();
        Ok(())
    })?;
    Ok(sequences)
}

impl DiagnoseTorques {
    /// Which rows judge in the end. Fails where none is left to fit.
    fn held_out(&self, motion: &Chunks<ArmMotion>, context: &Context) -> Result<Box<HeldOut<'_>>> {
        let (rows, labels) = (motion.rows(), MotionLabels::of(motion)?);
        let last = |share: f64| -> Box<HeldOut<'_>> {
            let held_from = rows - (share * rows as f64).round() as usize;
            Box::new(move |_, first, row| first + row >= held_from)
        };
        let held_out: Box<HeldOut<'_>> = match &self.hold_out {
            Some(HoldOut::Last(share)) => last(*share),
            Some(HoldOut::Trajectories(all)) => {
                if let Some(missing) = all.iter().find(|one| !labels.stretches.contains(one)) {
                    let most = labels.stretches.last().copied().unwrap_or_default();
                    let message =
                        format!("there is no stretch {missing}; the recording has 1 to {most}");
                    return Err(Error::data("with.hold_out.trajectories", message));
                }
                Box::new(|chunk, _, row| all.contains(&chunk.trajectory[row]))
            }
            Some(HoldOut::EverySecond(n)) => {
                let (start, n) = (labels.start, f64::from(*n));
                Box::new(move |chunk, _, row| (chunk.time[row] - start).rem_euclid(n) >= n - 1.0)
            }
            None if labels.labelled => Box::new(|chunk, _, row| {
                let label = chunk.usage[row].and_then(|usage| chunk.usages.get(usize::from(usage)));
                !label.is_some_and(|label| self.on.contains(label))
            }),
            None => {
                context.note(format!(
                    "no row is labelled with its use: the last {:.0} % are held out (`hold_out`)",
                    100.0 * LAST
                ));
                last(LAST)
            }
        };
        let (mut judging, mut first) = (0, 0);
        motion.each(|chunk| {
            let rows = (0..chunk.rows()).filter(|row| held_out(&chunk, first, *row));
            judging += rows.count();
            first += chunk.rows();
            Ok(())
        })?;
        if judging == rows {
            let message = format!(
                "no row is left to fit; labels of the recording: {}; to fit: {}",
                labels.usages.join(", "),
                self.on.join(", ")
            );
            return Err(Error::data("with.on", message));
        }
        context.note(format!(
            "{} to fit, {judging} held out",
            counted((rows - judging) as u64, "row")
        ));
        Ok(held_out)
    }
}
