//! Forms: effects at a place and in a shape, linear in their coefficients. One line each in [`Form`].
//!
//! A form is what diagnosis tries, what a model is refitted with, and what a table of parameters keeps as JSON.

use super::{ArmState, Deflection, Effect, ParameterSpec, Place, Survey};
use crate::robot::{Burden, Measurements, RobotModel};
use serde::{Deserialize, Serialize};

/// An effect with a place.
pub trait Placed: Effect {
    fn place(&self) -> Place;
    /// Forms like this one with other shapes around its own, closer with every level; empty where there is nothing to refine.
    fn near(&self, _survey: &Survey, _level: i32) -> Vec<Form> {
        Vec::new()
    }
    /// Of forms with one effect, place and variant only one is in a set; others may stand together, e.g. two orders of a gear.
    fn variant(&self) -> String {
        String::new()
    }
}

macro_rules! forms {
    ($( $name:ident($form:path), )+) => {
        /// An effect at a place and in a shape.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Form { $( $name($form), )+ }
        impl Form {
            fn inner(&self) -> &dyn Placed {
                match self { $( Form::$name(form) => form, )+ }
            }
        }
        $( impl From<$form> for Form {
            fn from(form: $form) -> Self {
                Form::$name(form)
            }
        } )+
    };
}

forms! {
    JointCompliance(super::joint_compliance::JointCompliance),
    JointHardening(super::joint_hardening::JointHardening),
    LinkCompliance(super::link_compliance::LinkCompliance),
    BaseCompliance(super::base_compliance::BaseCompliance),
    GearCyclic(super::gear_cyclic::GearCyclic),
    GearMotorCyclic(super::gear_motor_cyclic::GearMotorCyclic),
    JointTable(super::joint_table::JointTable),
    Backlash(super::backlash::Backlash),
    ThermalGrowth(super::thermal_growth::ThermalGrowth),
    Counterbalance(super::counterbalance::Counterbalance),
    LinkMass(super::link_mass::LinkMass),
    PayloadError(super::payload_error::PayloadError),
    AxisWobble(super::axis_wobble::AxisWobble),
    ZeroShift(super::zero_shift::ZeroShift),
    FrameShift(super::frame_shift::FrameShift),
    TrackerDrift(super::tracker_drift::TrackerDrift),
    CouplingRatio(super::coupling_ratio::PairRatio),
    JointLogLag(super::joint_log_lag::JointLogLag),
    ViscousWindup(super::viscous_windup::ViscousWindup),
    Unknown(super::unknown::Unknown),
}

impl Form {
    /// Effect, place and variant: see [`Placed::variant`].
    pub fn key(&self) -> String {
        format!("{}@{}#{}", self.name(), self.place(), self.variant())
    }
}

/// Whether an effect belongs to one measurement and not to the arm: it says nothing of another recording, and a command need not
/// make up for it.
pub fn is_of_the_measurement(effect: &str, place: &str, form: Option<&Form>) -> bool {
    matches!(effect, "tracker_drift" | "tracker_scale" | "joint_log_lag" | "base_shift" | "outlier" | "mislabelled_point")
        || matches!(place, "tracker" | "recording")
        || matches!(form, Some(Form::Unknown(unknown)) if unknown.is_passing())
}

impl Effect for Form {
    fn name(&self) -> &'static str {
        self.inner().name()
    }
    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        self.inner().parameters(robot)
    }
    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        self.inner().deflect(robot, state, p, out);
    }
    fn needs_torque(&self) -> bool {
        self.inner().needs_torque()
    }
    fn burden(&self, q: &[f64], payload: f64, p: &[f64], out: &mut Burden) {
        self.inner().burden(q, payload, p, out);
    }
    fn form(&self) -> Option<&Form> {
        Some(self)
    }
    fn missing(&self, robot: &RobotModel, data: &Measurements) -> Option<String> {
        self.inner().missing(robot, data)
    }
}

impl Placed for Form {
    fn place(&self) -> Place {
        self.inner().place()
    }
    fn near(&self, survey: &Survey, level: i32) -> Vec<Form> {
        self.inner().near(survey, level)
    }
    fn variant(&self) -> String {
        self.inner().variant()
    }
}

/// Parameters of a placed effect: `effect.tag.number`.
pub(super) fn parameters<'a>(
    form: &impl Placed,
    numbers: impl IntoIterator<Item = (&'a str, crate::units::Unit, f64)>,
) -> Vec<ParameterSpec> {
    let (name, place) = (form.name(), form.place());
    let variant = form.variant();
    let middle = if variant.is_empty() { place.tag() } else { format!("{}.{variant}", place.tag()) };
    numbers
        .into_iter()
        .map(|(number, unit, prior_sigma)| ParameterSpec {
            name: if number.is_empty() { format!("{name}.{middle}") } else { format!("{name}.{middle}.{number}") },
            place: place.to_string(),
            unit,
            prior_sigma,
        })
        .collect()
}

/// Functions cos(k pi (u - low) / (high - low)), k = 1..=count, of `u` held within the range: a curve without its mean.
pub(super) fn cosines(u: f64, [low, high]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let phase = std::f64::consts::PI * ((u - low) / (high - low).max(1e-12)).clamp(0.0, 1.0);
    (1..=count).map(move |k| libm::cos(k as f64 * phase))
}
