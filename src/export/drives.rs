//! The simulation of a diagnosis of drives, to run where it is simulated: MuJoCo's model, Isaac Lab's actuator settings, JSON.

use super::body::{document, numbers};
use crate::drives::physics::{LOAD_LAG, Over, ROTOR_SHARE, SAG_LAG};
use crate::error::{Error, Result, one_line};
use crate::identified::IdentifiedDrives;
use crate::table::{FindingRow, Table};
use minijinja::context;
use serde_json::{Map, json};

/// A way to write a simulation of drives down.
pub(crate) struct DriveFormat {
    /// What `--format` calls it.
    pub(crate) name: &'static str,
    /// What it is, in one line.
    pub(crate) help: &'static str,
    /// Causes that it holds.
    carries: &'static str,
    text: fn(&DriveExport) -> Result<String>,
}

/// All formats.
pub(crate) const DRIVE_FORMATS: &[DriveFormat] = &[
    DriveFormat {
        name: "mjcf",
        help: "MuJoCo model: gains, damping, armature, friction, limits, delay, elasticity",
        carries: "command_delay command_offset drive_gain drive_damping torque_limit \
            viscous_friction coulomb_friction cable_stiffness rotor_inertia joint_elasticity backlash payload_error link_mass \
            link_com gravity_direction",
        text: mjcf,
    },
    DriveFormat {
        name: "mjcf_control",
        help: "Python next to the MJCF of diagnosed drives: what MuJoCo's model cannot hold, put in before every step",
        carries: "",
        text: control,
    },
    DriveFormat {
        name: "isaac",
        help: "Isaac Lab's actuators of diagnosed drives: gains, armature, friction, limits, delay in steps",
        carries: "command_delay drive_gain drive_damping torque_limit viscous_friction \
            coulomb_friction stribeck_friction rotor_inertia",
        text: isaac,
    },
    DriveFormat {
        name: "json",
        help: "Everything",
        carries: "",
        text: everything,
    },
];

/// s, MuJoCo's steps: Runge and Kutta's of half a millisecond follow stiff gains.
const STEP: f64 = 5e-4;
/// s, a step of Isaac Lab's physics as its examples have it.
const ISAAC_STEP: f64 = 5e-3;
/// Digits of the hash of a model.
const DIGITS: usize = 16;
/// s, by which MuJoCo's Runge and Kutta takes delayed controls too early: it interpolates between those of two steps.
const EARLY: f64 = 0.5 * STEP;

/// What is exported.
pub(crate) struct DriveExport {
    drives: IdentifiedDrives,
    format: &'static DriveFormat,
}

impl DriveExport {
    pub(crate) fn of(drives: IdentifiedDrives, format: &'static DriveFormat) -> Self {
        Self { drives, format }
    }

    /// The whole file.
    pub(crate) fn text(&self) -> Result<String> {
        (self.format.text)(self)
    }

    /// What its reader must know, a sentence a line: each cause that is left out, with its size.
    pub(crate) fn remarks(&self) -> Result<Vec<String>> {
        let hash = self.drives.simulation.to_frame()?.table_hash();
        let hash = blake3::hash(hash.as_str().as_bytes()).to_hex();
        let model = &hash[..DIGITS];
        let v = &self.drives.verdict;
        let mut lines = vec![
            format!(
                "calib export: format {}, model {model}, robot serial not stated",
                self.format.name
            ),
            format!("drives of {}", self.drives.origin),
            format!(
                "measured minus simulated angle, {}: {:.3} mrad rms before, {:.3} mrad with all that was found",
                if v.held_out {
                    "held-out trajectories"
                } else {
                    "fitted trajectories"
                },
                1e3 * v.before_rms_rad,
                1e3 * v.after_rms_rad
            ),
        ];
        lines.extend(self.left_out().map(|finding| {
            let size = 1e3 * finding.effect_rms_rad.unwrap_or_default();
            format!(
                "not carried: {} at {}, {size:.3} mrad rms",
                finding.effect, finding.place
            )
        }));
        if self.format.name == "mjcf" && self.left_out().next().is_some() {
            lines.push("what is not carried is in the Python of `--format mjcf_control`".into());
        }
        Ok(lines)
    }

    fn left_out(&self) -> impl Iterator<Item = &FindingRow> {
        let all = self.format.carries;
        self.drives.findings.iter().filter(|finding| {
            let carried = all.is_empty() || all.split(' ').any(|cause| cause == finding.effect);
            !carried || (self.format.name == "mjcf" && self.is_seen_on_the_link(finding))
        })
    }

    /// MuJoCo's actuators see the rotor of a joint whose gear yields.
    fn is_seen_on_the_link(&self, finding: &FindingRow) -> bool {
        let joints = 1..=self.joints();
        ["backlash", "joint_elasticity"].contains(&finding.effect.as_str())
            && joints
                .filter(|joint| finding.place == format!("joint {joint}"))
                .any(|joint| self.joint(joint, "gear_encoder_on_link") > 0.0)
    }

    fn joints(&self) -> usize {
        self.drives.simulation.joints().len()
    }

    /// A number of a joint (from 1), 0 where it is not there.
    fn joint(&self, joint: usize, quantity: &str) -> f64 {
        let value = self.drives.simulation.value("joint", joint, quantity);
        value.unwrap_or(0.0)
    }

    fn three(&self, part: &str, number: usize, quantities: [&str; 3]) -> [f64; 3] {
        quantities.map(|name| {
            self.drives
                .simulation
                .value(part, number, name)
                .unwrap_or(0.0)
        })
    }

    fn limit(&self, joint: usize) -> Option<f64> {
        self.drives.simulation.value("joint", joint, "torque_limit")
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn mjcf(export: &DriveExport) -> Result<String> {
    const POINT: [&str; 3] = ["point_x", "point_y", "point_z"];
    let mut before = [0.0; 3];
    let mut joints = Vec::new();
    let mut remarks = export.remarks()?;
    for (index, name) in export.drives.simulation.joints().iter().enumerate() {
        let number = index + 1;
        let of = |quantity: &str| export.joint(number, quantity);
        let point = export.three("joint", number, POINT);
        let centre = export.three("link", number, ["centre_x", "centre_y", "centre_z"]);
        let diagonal = export.three("link", number, ["ixx", "iyy", "izz"]);
        let products = export.three("link", number, ["ixy", "ixz", "iyz"]);
        let geared = of("gear_stiffness") > 0.0;
        // Of a gear that yields the rest moves with the link.
        let armature = of("armature") * if geared { ROTOR_SHARE } else { 1.0 };
        let mut attributes = vec![
            ("damping", of("damping")),
            ("frictionloss", of("friction")),
            ("armature", armature),
            ("stiffness", of("spring_stiffness")),
            ("springref", of("spring_reference")),
        ];
        attributes.retain(|(_, value)| *value != 0.0);
        let mut attributes: Vec<(&str, String)> = attributes
            .into_iter()
            .map(|(name, value)| (name, numbers([value])))
            .collect();
        // Of all drives of the joint together.
        attributes.extend(
            export
                .limit(number)
                .map(|limit| ("actuatorfrcrange", numbers([-limit, limit]))),
        );
        let gear = geared.then(|| {
            let half = 0.5 * of("gear_play");
            let mut gear = vec![
                ("stiffness", numbers([of("gear_stiffness")])),
                ("damping", numbers([of("gear_damping")])),
            ];
            if half > 0.0 {
                gear.remove(0);
                gear.push(("range", numbers([-half, half])));
                gear.push(("limited", "true".into()));
                remarks.push(format!(
                    "backlash at joint {number}: the gear is a hinge that moves freely within {half:.5} rad; its flanks are MuJoCo's contacts, \
                     not a spring of {:.0} Nm/rad",
                    of("gear_stiffness")
                ));
            }
            gear
        });
        let (kp, kd) = (of("kp"), of("kd"));
        let on_error = of("kd_on_error") > 0.0;
        if on_error {
            remarks.push(format!(
                "joint {number} has a second actuator, whose control is the commanded speed in rad/s"
            ));
        }
        let delay = of("command_delay");
        let delay = match delay > 0.0 {
            true => {
                let delay = delay + EARLY;
                let samples = (delay / STEP).ceil() + 2.0;
                format!(" delay=\"{delay:?}\" nsample=\"{samples}\" interp=\"linear\"")
            }
            false => String::new(),
        };
        let speed_on_angle = if on_error { 0.0 } else { -kd };
        joints.push(context! {
            name => one_line(name), gear, attributes, link_armature => numbers([of("armature") - armature]),
            kind => if of("slides") > 0.0 { "slide" } else { "hinge" },
            offset => numbers(minus(point, before)),
            axis => numbers(export.three("joint", number, ["axis_x", "axis_y", "axis_z"])),
            reference => numbers([of("reference")]),
            centre => numbers(minus(centre, point)),
            mass => numbers(export.drives.simulation.value("link", number, "mass")),
            inertia => numbers([diagonal, products].concat()),
            kp => numbers([kp]),
            bias => numbers([kp * of("command_offset"), -kp, speed_on_angle]),
            speed_gain => on_error.then(|| numbers([kd])), delay,
        });
        before = point;
    }
    if joints.iter().any(|joint| {
        joint
            .get_attr("delay")
            .is_ok_and(|delay| !delay.to_string().is_empty())
    }) {
        remarks.push("the delay of actuators needs MuJoCo 3.5 or newer; controls of before the beginning are 0 until mj_step has run for that long".into());
    }
    let tool = export.three("arm", 0, ["tool_x", "tool_y", "tool_z"]);
    let values = context! {
        joints, step => numbers([STEP]), tool => numbers(minus(tool, before)),
        gravity => numbers(export.three("arm", 0, ["gravity_x", "gravity_y", "gravity_z"])),
    };
    document(&remarks, include_str!("drives.xml"), values)
}

/// Numbers of a joint that the controller reads.
const CONTROLLED: &str = "kp kd kd_on_error torque_limit command_offset command_delay dead_band \
    speed_limit integral_gain integral_limit integral_start damping friction stribeck_friction stribeck_speed \
    load_friction_driving load_friction_back gear_friction_driving gear_friction_back presliding warm_up_share \
    warm_up_share_viscous warm_up_time spring_stiffness spring_reference gear_stiffness gear_damping gear_play \
    gear_encoder_on_link";

/// A list as Python reads it.
fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().collect();
    format!("[{}]", items.join(", "))
}

fn control(export: &DriveExport) -> Result<String> {
    let simulation = &export.drives.simulation;
    let joints = || 1..=export.joints();
    let float = |value: f64| format!("{value:?}");
    let drive: String = CONTROLLED
        .split(' ')
        .map(|name| {
            let of = |joint: usize| match name {
                "torque_limit" | "speed_limit" => simulation.value("joint", joint, name),
                _ => Some(export.joint(joint, name)),
            };
            let values = joints().map(|joint| of(joint).map_or("None".into(), float));
            format!("    {name:?}: {},\n", list(values))
        })
        .collect();
    let arm = ["command_rate", "command_hold", "voltage_sag"].map(|name| {
        let value = simulation.value("arm", 0, name).unwrap_or(0.0);
        format!("{name:?}: {value:?}")
    });
    let ripples = |joint| {
        list(
            simulation
                .ripples(joint)
                .into_iter()
                .map(|wave| list(wave.map(float))),
        )
    };
    let couplings = |joint| {
        let all = simulation.couplings(joint).into_iter();
        list(all.map(|(by, share)| format!("({by}, {share:?})")))
    };
    let curves = |joint| {
        let all = simulation.curves(joint).into_iter();
        list(all.map(|curve| {
            let (over, of) = match curve.over {
                Over::Angle(by) => ("angle", by),
                Over::Speed(by) => ("speed", by),
                Over::Velocity(by) => ("velocity", by),
                Over::Acceleration(by) => ("acceleration", by),
                Over::Time => ("time", 0),
            };
            let dry = if curve.dry { "True" } else { "False" };
            let [first, step] = curve.knots;
            let values = list(curve.values.into_iter().map(float));
            format!("({over:?}, {of}, {dry}, {first:?}, {step:?}, {values})")
        }))
    };
    let head = export.remarks()?;
    let head = head.iter().map(|line| format!("# {}\n", one_line(line)));
    let values = context! {
        names => list(simulation.joints().into_iter().map(quoted)),
        arm => format!("{{{}}}", arm.join(", ")),
        drive => format!("{{\n{drive}}}"),
        ripples => list(joints().map(ripples)), couplings => list(joints().map(couplings)), curves => list(joints().map(curves)),
        lags => format!("{SAG_LAG:?}, {LOAD_LAG:?}"),
    };
    let body = crate::text::environment()
        .render_str(include_str!("drives_control.py"), values)
        .map_err(|error| Error::Bug(error.to_string()))?;
    Ok(head.collect::<String>() + &body)
}

/// A text in quotes, as YAML and JSON read it.
fn quoted(text: &str) -> String {
    json!(text).to_string()
}

fn isaac(export: &DriveExport) -> Result<String> {
    let mut lines: Vec<String> = export.remarks()?;
    lines.push("numbers of isaaclab.actuators.DelayedPDActuatorCfg, one actuator a joint; friction in Nm, as Isaac Sim 5 reads it".into());
    let mut text: String = lines
        .iter()
        .map(|line| format!("# {}\n", one_line(line)))
        .collect();
    text += &format!(
        "physics_dt: {ISAAC_STEP:?}  # s; delays are counted in these steps\nactuators:\n"
    );
    for (index, name) in export.drives.simulation.joints().iter().enumerate() {
        let joint = index + 1;
        let of = |quantity: &str| export.joint(joint, quantity);
        let name = quoted(name);
        text += &format!("  {name}:\n    joint_names_expr: [{name}]\n");
        let dry = of("friction");
        let mut put = |key: &str, value: f64| text += &format!("    {key}: {value:?}\n");
        if let Some(limit) = export.limit(joint) {
            put("effort_limit", limit);
        }
        put("stiffness", of("kp"));
        put("damping", of("kd"));
        put("armature", of("armature"));
        put("friction", dry + of("stribeck_friction").max(0.0));
        put("dynamic_friction", dry);
        put("viscous_friction", of("damping"));
        let delay = of("command_delay");
        let steps = (delay / ISAAC_STEP).round();
        let said = match delay > 0.0 {
            true => format!("  # of {:.2} ms", 1e3 * delay),
            false => String::new(),
        };
        text += &format!("    min_delay: {steps}{said}\n    max_delay: {steps}{said}\n");
    }
    Ok(text)
}

fn everything(export: &DriveExport) -> Result<String> {
    let drives = &export.drives;
    let mut parts: Map<String, serde_json::Value> = Map::new();
    for row in &drives.simulation.0 {
        let key = match row.number {
            0 => row.part.clone(),
            number => format!("{} {number}", row.part),
        };
        let part = parts
            .entry(key)
            .or_insert_with(|| json!({ "name": row.name }));
        part[&row.quantity] =
            json!({ "believed": row.believed, "value": row.value, "unit": row.unit });
    }
    let findings = drives.findings.iter().map(|finding| {
        let numbers = drives.numbers.iter().filter(|number| number.rank == finding.rank);
        let numbers = numbers.map(|number| {
            json!({ "name": number.name, "value": number.value, "sigma": number.sigma, "unit": number.unit })
        });
        json!({
            "effect": finding.effect, "where": finding.place, "statement": finding.statement, "probability": finding.probability,
            "effect_rms_mrad": finding.effect_rms_rad.map(|rad| 1e3 * rad), "numbers": numbers.collect::<Vec<_>>(),
        })
    });
    let remarks = export.remarks()?;
    let document = json!({
        "calib_drives": 1,
        "mark": remarks[0],
        "origin": drives.origin,
        "conventions": "SI; axes, points and bodies in the world frame with all joints at `reference`; null is no limit",
        "before_rms_mrad": 1e3 * drives.verdict.before_rms_rad,
        "after_rms_mrad": 1e3 * drives.verdict.after_rms_rad,
        "held_out": drives.verdict.held_out,
        "simulation": parts,
        "findings": findings.collect::<Vec<_>>(),
    });
    let text = serde_json::to_string_pretty(&document);
    text.map(|text| text + "\n")
        .map_err(|error| Error::Bug(error.to_string()))
}
