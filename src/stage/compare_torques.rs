//! `compare_torques`: what changed between recordings of one arm's torques: what is on the tool or a link, friction, drives. Of more than two:
//! which of them agree, and in what the others differ.

use crate::description::RobotDescription;
use crate::dynamic_arm::{RecordedTorques, dynamic_arm};
use crate::dynamics::{
    ContactEvent, DiagnosedRecording, DynamicArm, TorqueChange, TorqueChanges, TorqueModel, changes,
};
use crate::error::{Error, Result, counted, listed};
use crate::table::{ArmMotion, Contacts, Robot, TorqueChangeTable, TorqueParameters};
use crate::{Chunks, Context, Labelled, Stage};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Has no settings. The earlier recordings are all that are read before the last one, unless `reads` names them, each with its model and its
/// contacts in the same order.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CompareTorques {}

crate::stage! {
    CompareTorques, "compare_torques", 8, "tests what changed between recordings of an arm's torques: what it carries, friction, offsets",
        CompareTorquesReads {
            robot: Robot,
            motion: Labelled<Chunks<ArmMotion>>,
            parameters: TorqueParameters,
            contacts: Contacts,
            earlier_motion: Vec<Labelled<Chunks<ArmMotion>>>,
            earlier_parameters: Vec<Labelled<TorqueParameters>>,
            earlier_contacts: Vec<Labelled<Contacts>>,
        } -> CompareTorquesWrites {
            changes: TorqueChangeTable,
        }
}

impl Stage for CompareTorques {
    fn run(&self, reads: CompareTorquesReads, context: &Context) -> Result<CompareTorquesWrites> {
        let recordings = recordings(&reads)?;
        let robot = reads.robot.to_description()?;
        let mut compared = Compared::of(&robot, recordings, context)?;
        let reference = compared.reference()?;
        let mut table = TorqueChangeTable::default();
        let names: Vec<&str> = compared.all.iter().map(|one| one.name).collect();
        let mut agreeing = vec![names[reference]];
        for (other, name) in names
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != reference)
        {
            let found = &compared.changes(reference, other)?.clone();
            if agree(found) {
                agreeing.push(*name);
            }
            tell(found, [*name, names[reference]], names.len() > 2, context);
            let parameters = compared.all[reference].parameters;
            let previous = |name: &str| {
                let mut rows = parameters.0.iter();
                Some(rows.find(|row| row.name == name)?.value)
            };
            table.extend([*name, names[reference]], found, previous);
        }
        if names.len() > 2 {
            context.note(match agreeing.len() {
                1 => format!("no two of {} recordings agree", names.len()),
                all if all == names.len() => "all recordings agree".into(),
                _ => format!("{} agree", listed(agreeing)),
            });
        }
        Ok(CompareTorquesWrites { changes: table })
    }
}

/// A recording with what its diagnosis says of it.
struct OneRecording<'r> {
    name: &'r str,
    motion: &'r Chunks<ArmMotion>,
    parameters: &'r TorqueParameters,
    contacts: &'r Contacts,
}

/// The earlier recordings, then the last one. Fails where models or contacts are not one a recording, or two recordings are one.
fn recordings(reads: &CompareTorquesReads) -> Result<Vec<OneRecording<'_>>> {
    let counts = [
        reads.earlier_motion.len(),
        reads.earlier_parameters.len(),
        reads.earlier_contacts.len(),
    ];
    if counts.iter().any(|count| *count != counts[0]) {
        let message = format!(
            "{} have {} and {}; expected one of each for every recording, in the same order, e.g. `reads: {{earlier_motion: [before, after], \
             earlier_parameters: [first, second], earlier_contacts: [first, second]}}`",
            counted(counts[0] as u64, "earlier recording"),
            counted(counts[1] as u64, "model"),
            counted(counts[2] as u64, "contact table"),
        );
        return Err(Error::spec("reads", message));
    }
    let earlier = reads.earlier_motion.iter().zip(&reads.earlier_parameters);
    let earlier = earlier.zip(&reads.earlier_contacts);
    let earlier = earlier.map(|((motion, parameters), contacts)| OneRecording {
        name: &motion.stage,
        motion: &motion.table,
        parameters: &parameters.table,
        contacts: &contacts.table,
    });
    let last = OneRecording {
        name: &reads.motion.stage,
        motion: &reads.motion.table,
        parameters: &reads.parameters,
        contacts: &reads.contacts,
    };
    let mut all: Vec<OneRecording> = earlier.filter(|one| one.name != last.name).collect();
    all.push(last);
    for (number, one) in all.iter().enumerate() {
        for other in &all[..number] {
            if same_motion(one.motion, other.motion)? {
                let message = format!(
                    "recordings {} and {} are the same: name the earlier ones' stages, e.g. `reads: {{earlier_motion: before, \
                     earlier_parameters: first, earlier_contacts: first}}`",
                    other.name, one.name
                );
                return Err(Error::spec("reads", message));
            }
        }
    }
    match all.len() {
        1 => Err(Error::spec(
            "reads",
            "one recording alone; expected two or more, each read by its `ingest_torques` and diagnosed by its `diagnose_torques`",
        )),
        _ => Ok(all),
    }
}

/// Recordings of one arm, and what changed from one to another, each pair once.
struct Compared<'r> {
    arm: DynamicArm,
    robot: &'r RobotDescription,
    all: Vec<OneRecording<'r>>,
    models: Vec<TorqueModel>,
    found: Vec<([usize; 2], TorqueChanges)>,
}

impl<'r> Compared<'r> {
    fn of(
        robot: &'r RobotDescription,
        all: Vec<OneRecording<'r>>,
        context: &Context,
    ) -> Result<Self> {
        let (mut arm, _) = dynamic_arm(robot)?;
        let models = all.iter().map(|one| {
            one.parameters.must_be_of(robot)?;
            one.parameters.to_model()
        });
        let models: Vec<TorqueModel> = models.collect::<Result<_>>()?;
        let whole = |model: &TorqueModel| (0..model.joints()).all(|link| model.is_whole(link));
        if !models.iter().all(whole) {
            arm.links = None;
            context
                .note("masses are identified, not declared: of what is carried the change is seen");
        }
        Ok(Self {
            arm,
            robot,
            all,
            models,
            found: Vec::new(),
        })
    }

    /// The recording that most others agree with, the first of several such.
    fn reference(&mut self) -> Result<usize> {
        let count = self.all.len();
        let mut best = (0, 0);
        for one in 0..count {
            let mut agreeing = 0;
            for other in (0..count).filter(|other| *other != one) {
                agreeing += usize::from(agree(self.changes(one, other)?));
            }
            if one == 0 || agreeing > best.1 {
                best = (one, agreeing);
            }
            // Of two no one is odd, and a majority has no rival.
            if count == 2 || 2 * (agreeing + 1) > count {
                break;
            }
        }
        Ok(best.0)
    }

    /// What changed from one recording to another.
    fn changes(&mut self, from: usize, to: usize) -> Result<&TorqueChanges> {
        let known = self.found.iter().position(|(pair, _)| *pair == [from, to]);
        let at = match known {
            Some(at) => at,
            None => {
                let torques =
                    [from, to].map(|one| RecordedTorques::of(self.all[one].motion, self.robot));
                let [first, second] = torques;
                let (first, second) = (first?, second?);
                let events = [from, to].map(|one| events(self.all[one].contacts));
                let diagnosed = |recording, place: usize, one: usize| DiagnosedRecording {
                    recording,
                    model: &self.models[one],
                    events: &events[place],
                };
                let found = changes(
                    &self.arm,
                    &diagnosed(&first, 0, from),
                    &diagnosed(&second, 1, to),
                )?;
                self.found.push(([from, to], found));
                self.found.len() - 1
            }
        };
        Ok(&self.found[at].1)
    }
}

/// Whether nothing changed.
fn agree(found: &TorqueChanges) -> bool {
    found.changes.iter().all(|change| change.rank.is_none())
}

/// Notes of a pair.
fn tell(found: &TorqueChanges, [name, reference]: [&str; 2], of_several: bool, context: &Context) {
    let about = match of_several {
        true => format!("{name} against {reference}: "),
        false => String::new(),
    };
    let (ranked, unchanged): (Vec<&TorqueChange>, Vec<&TorqueChange>) =
        (found.changes.iter()).partition(|change| change.rank.is_some());
    for change in &ranked {
        context.note(about.clone() + &sentence(change));
    }
    if ranked.is_empty() {
        context.note(about.clone() + "nothing changed beyond noise");
    }
    for (joint, [before, after]) in (1..=found.rms.len()).zip(&found.rms) {
        context.note(format!(
            "{about}joint {joint}: {before:.3} Nm rms are left where nothing changed, {after:.3} Nm with the changes"
        ));
    }
    let unchanged = counted(unchanged.len() as u64, "number");
    context.note(format!("{about}{unchanged} held to be unchanged"));
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

fn events(contacts: &Contacts) -> Vec<ContactEvent> {
    let event = |row: &crate::table::ContactRow| ContactEvent {
        start: row.start_s,
        end: row.end_s,
        joints: Vec::new(),
        force: [row.force_x_n, row.force_y_n, row.force_z_n],
        sigma: [row.sigma_x_n, row.sigma_y_n, row.sigma_z_n],
        gain: 0.0,
    };
    contacts.0.iter().map(event).collect()
}
