//! `masses`: the robot with the masses and the dry friction that its torques show, so that what depends on gravity, and on which side a
//! joint comes to rest, rests on them from here on.

use crate::dynamic_arm::dynamic_arm;
use crate::dynamics::LinkFromTorques;
use crate::error::Result;
use crate::table::{Robot, TorqueParameters};
use crate::{Context, Stage};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// kg: mass of a link of which the robot file declares none; its centre follows, gravity does not depend on it.
const NOTIONAL: f64 = 10.0;

/// Has no settings: `reads` names the model of torques, where there are several.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Masses {}

crate::stage! {
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
        let masses = robot.joints.iter().map(|joint| declared(joint.mass));
        let masses: Vec<f64> = masses.collect();
        let links = model.links(&arm, &masses);
        robot.inertias.links.resize(links.len(), None);
        for (index, (joint, link)) in robot.joints.iter_mut().zip(&links).enumerate() {
            context.note(change_text(index, joint.mass, joint.centre, link));
            joint.mass = Some(link.mass);
            joint.centre = Some(link.centre.into());
            if let Some(i) = &link.inertia {
                let moments = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
                robot.inertias.links[index] = Some(moments.map(|place| i[place]));
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
    let shown = |friction: &Option<f64>| match friction {
        None => "none found".into(),
        Some(friction) => format!("{friction:.3} Nm"),
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
        let apart = centre.iter().zip(link.centre.iter());
        let off: f64 = apart.map(|(a, b)| (a - b).powi(2)).sum();
        let off = 1e3 * off.sqrt();
        format!(", its centre {off:.1} mm off the declared one")
    });
    let (number, mass) = (index + 1, link.mass);
    format!("link {number}: {before} declared, {mass:.3} kg by the torques{moved}")
}
