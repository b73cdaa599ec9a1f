//! `masses`: the robot with the masses and the dry friction that its torques show, so that what depends on gravity, and on which side a
//! joint comes to rest, rests on them from here on.

use crate::dynamics::LinkFromTorques;
use crate::error::Result;
use crate::stage::dynamic_arm::dynamic_arm;
use crate::stage::{Context, Stage};
use crate::table::{Robot, TorqueParameters};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// kg: mass of a link of which the robot file declares none; its centre follows, gravity does not depend on it.
const NOTIONAL: f64 = 10.0;

/// Has no settings: `reads` names the model of torques, where there are several.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Masses {}

crate::stage::stage! {
    Masses, "masses", 3, "gives the robot of later stages the masses, centres and dry friction that its torques show",
        MassesReads {
            robot: Robot,
            parameters: TorqueParameters,
        } -> MassesWrites {
            robot: Robot,
        }
}

impl Stage for Masses {
    fn run(&self, reads: MassesReads, context: &Context) -> Result<MassesWrites> {
        let mut robot = reads.robot.to_description()?;
        let (arm, _) = dynamic_arm(&robot)?;
        let model = reads.parameters.to_model()?;
        let declared = |mass: Option<f64>| mass.filter(|mass| *mass > 0.0).unwrap_or(NOTIONAL);
        let masses: Vec<f64> = robot
            .joints
            .iter()
            .map(|joint| declared(joint.mass))
            .collect();
        let links = model.links(&arm, &masses);
        robot.inertias.links.resize(links.len(), None);
        for (index, (joint, link)) in robot.joints.iter_mut().zip(&links).enumerate() {
            context.note(change_text(index, joint.mass, joint.centre, link));
            joint.mass = Some(link.mass);
            joint.centre = Some(link.centre.into());
            if let Some(i) = &link.inertia {
                robot.inertias.links[index] = Some([
                    i[(0, 0)],
                    i[(0, 1)],
                    i[(0, 2)],
                    i[(1, 1)],
                    i[(1, 2)],
                    i[(2, 2)],
                ]);
            }
        }
        let friction = reads.parameters.dry_friction(links.len());
        context.note(friction_text(&friction));
        for (joint, friction) in robot.joints.iter_mut().zip(friction) {
            joint.coulomb = friction;
        }
        if !(0..links.len()).all(|link| model.is_whole(link)) {
            context.note(
                "base parameters alone were identified: masses stay as declared, centres are where gravity needs them; inertias stay as declared",
            );
        }
        context.note("what the tool carried beyond the declared payload is part of the last link from here on");
        Ok(MassesWrites {
            robot: Robot::from_description(&robot),
        })
    }
}

fn friction_text(friction: &[Option<f64>]) -> String {
    let shown = |friction: &Option<f64>| {
        friction.map_or_else(
            || "none found".into(),
            |friction| format!("{friction:.3} Nm"),
        )
    };
    let all: Vec<String> = friction.iter().map(shown).collect();
    format!(
        "dry friction of joints 1 to {} by the torques: {}; below it approach decides on which side a joint rests",
        all.len(),
        all.join(", ")
    )
}

/// What changes of a link.
fn change_text(
    index: usize,
    mass: Option<f64>,
    centre: Option<[f64; 3]>,
    link: &LinkFromTorques,
) -> String {
    let before = mass.map_or_else(|| "no mass".into(), |mass| format!("{mass:.3} kg"));
    let moved = centre.map_or_else(String::new, |centre| {
        let off: f64 = centre
            .iter()
            .zip(link.centre.iter())
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        format!(
            ", its centre {:.1} mm off the declared one",
            1e3 * off.sqrt()
        )
    });
    format!(
        "link {}: {before} declared, {:.3} kg by the torques{moved}",
        index + 1,
        link.mass
    )
}
