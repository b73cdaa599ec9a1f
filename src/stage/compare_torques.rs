//! `compare_torques`: what changed between two recordings of one arm's torques: what is on the tool, friction, drives.

use crate::dynamics::{ContactEvent, DiagnosedRecording, TorqueChange, TorqueModel, changes};
use crate::error::{Error, Result, counted};
use crate::stage::dynamic_arm::{RecordedTorques, dynamic_arm};
use crate::stage::{Chunks, Context, Stage};
use crate::table::{ArmMotion, Contacts, Robot, TorqueChangeTable, TorqueParameters};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Has no settings: `reads` names the earlier recording and its model.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CompareTorques {}

crate::stage::stage! {
    CompareTorques, "compare_torques", 5, "tests what changed between two recordings of an arm's torques: payload, friction, offsets",
        CompareTorquesReads {
            robot: Robot,
            motion: Chunks<ArmMotion>,
            parameters: TorqueParameters,
            contacts: Contacts,
            earlier_motion: Chunks<ArmMotion>,
            earlier_parameters: TorqueParameters,
            earlier_contacts: Contacts,
        } -> CompareTorquesWrites {
            changes: TorqueChangeTable,
        }
}

impl Stage for CompareTorques {
    fn run(&self, reads: CompareTorquesReads, context: &Context) -> Result<CompareTorquesWrites> {
        if same_motion(&reads.motion, &reads.earlier_motion)? {
            let message = "both recordings are the same: name the earlier one's stages, e.g. `reads: {earlier_motion: before, \
                           earlier_parameters: first, earlier_contacts: first}`";
            return Err(Error::spec("reads", message));
        }
        let robot = reads.robot.to_description()?;
        for parameters in [&reads.earlier_parameters, &reads.parameters] {
            parameters.must_be_of(&robot)?;
        }
        let (mut arm, _) = dynamic_arm(&robot)?;
        let (first, second) = (
            reads.earlier_parameters.to_model()?,
            reads.parameters.to_model()?,
        );
        let whole = |model: &TorqueModel| (0..model.joints()).all(|link| model.is_whole(link));
        if !whole(&first) {
            arm.links = None;
        }
        let earlier = RecordedTorques::of(&reads.earlier_motion, &robot)?;
        let later = RecordedTorques::of(&reads.motion, &robot)?;
        let (first_events, second_events) =
            (reads.earlier_contacts.events(), reads.contacts.events());
        let diagnosed = |recording, model, events| DiagnosedRecording {
            recording,
            model,
            events,
        };
        let found = changes(
            &arm,
            &diagnosed(&earlier, &first, &first_events),
            &diagnosed(&later, &second, &second_events),
        )?;
        let strongest = found.changes.iter().filter(|change| change.rank.is_some());
        let ranked: Vec<&TorqueChange> = strongest.collect();
        ranked
            .iter()
            .for_each(|change| context.note(sentence(change)));
        if ranked.is_empty() {
            context.note("nothing changed beyond noise");
        }
        for (joint, [before, after]) in (1..).zip(&found.rms) {
            let joint: usize = joint;
            context.note(format!(
                "joint {joint}: {before:.3} Nm rms are left where nothing changed, {after:.3} Nm with the changes"
            ));
        }
        let unchanged = found
            .changes
            .iter()
            .filter(|change| change.rank.is_none())
            .count();
        context.note(format!(
            "{} held to be unchanged",
            counted(unchanged, "number")
        ));
        let previous = |name: &str| {
            reads
                .earlier_parameters
                .0
                .iter()
                .find(|row| row.name == name)
                .map(|row| row.value)
        };
        Ok(CompareTorquesWrites {
            changes: TorqueChangeTable::of(&found, previous),
        })
    }
}

/// Whether two motions are equal as far as their first chunks go, and as long.
fn same_motion(one: &Chunks<ArmMotion>, other: &Chunks<ArmMotion>) -> Result<bool> {
    let first = |motion: &Chunks<ArmMotion>| {
        let mut first = None;
        motion.each(|chunk| {
            first.get_or_insert((chunk.time, chunk.q));
            Ok(())
        })?;
        Ok::<_, Error>(first)
    };
    Ok(one.rows() == other.rows() && first(one)? == first(other)?)
}

fn sentence(change: &TorqueChange) -> String {
    format!(
        "{}. {}: {:+.4} +- {:.4} {}, probability {:.2}",
        change.rank.unwrap_or_default(),
        change.name,
        change.change,
        change.sigma,
        change.unit,
        change.probability
    )
}

impl Contacts {
    /// Pushes as events.
    fn events(&self) -> Vec<ContactEvent> {
        let event = |row: &crate::table::ContactRow| ContactEvent {
            start: row.start_s,
            end: row.end_s,
            joints: Vec::new(),
            force: [row.force_x_n, row.force_y_n, row.force_z_n],
            sigma: [row.sigma_x_n, row.sigma_y_n, row.sigma_z_n],
            gain: 0.0,
        };
        self.0.iter().map(event).collect()
    }
}
