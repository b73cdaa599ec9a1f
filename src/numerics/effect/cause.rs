//! Causes of error: everything that the project knows of one stands in the file that implements [`Cause`], and every cause in one list.

use super::*;

/// What a cause is: in words, and in what diagnosis asks of every cause.
#[derive(Debug, Clone, Copy)]
pub struct CauseDescription {
    /// Canonical name.
    pub name: &'static str,
    /// Where it sits.
    pub place: &'static str,
    /// q: joint position, dq/dt: its velocity, t: load torque of a joint, s: direction of approach, T: temperature; d: turn of the joint.
    pub formula: &'static str,
    /// On industrial arms.
    pub size: &'static str,
    /// Effects that do nearly the same where a recording is poor.
    pub confounded: &'static str,
    /// Columns of the recording and entries of the robot file without which it cannot be told.
    pub needs: &'static str,
    /// Whether it belongs to one measurement and not to the arm.
    pub of_the_measurement: bool,
    /// Whether more poses may separate it from other causes: steps and drifts have had their time, faults of rows have none.
    pub separable_by_poses: bool,
    /// What separates it from others beside more poses.
    pub measure: Option<Measure>,
    /// The effect of the whole arm, for causes that are identified, not searched for.
    pub arm_effect: Option<ArmEffectOf>,
    /// Reads its forms, where they are no [`Term`], as [`Placed::body`] wrote them.
    pub read: Option<fn(&serde_json::Value) -> serde_json::Result<Form>>,
}

impl CauseDescription {
    /// What most causes are, without words.
    pub const PLAIN: Self = Self {
        name: "",
        place: "",
        formula: "",
        size: "",
        confounded: "",
        needs: "",
        of_the_measurement: false,
        separable_by_poses: true,
        measure: None,
        arm_effect: None,
        read: None,
    };
}

/// Writes what a cause is, [`Cause::about`](crate::effect::Cause::about): `about! { name: "backlash", place: "joint" }`. What it does not say is
/// as of most causes, [`CauseDescription::PLAIN`](crate::effect::CauseDescription::PLAIN).
#[macro_export]
macro_rules! about {
    ($($field:ident: $value:expr),+ $(,)?) => {
        fn about(&self) -> &'static $crate::effect::CauseDescription {
            &$crate::effect::CauseDescription { $($field: $value,)+ ..$crate::effect::CauseDescription::PLAIN }
        }
    };
}

/// The effect of the whole arm in a setting.
pub type ArmEffectOf = fn(&EffectContext) -> Box<dyn Effect>;

/// A measurement that is no pose and separates a cause from others; of two causes the one of lower rank says what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Measure {
    /// The lower, the earlier it is proposed.
    pub rank: u8,
    /// What to measure, as an order.
    pub advice: &'static str,
}

/// Name, unit and one sigma of what is known before any measurement (SI), of a coefficient.
pub type NumberSpec = (String, Unit, f64);

/// A cause of error.
pub trait Cause: Sync {
    /// What it is.
    fn about(&self) -> &'static CauseDescription;

    /// Its canonical name.
    fn name(&self) -> &'static str {
        self.about().name
    }

    /// See [`CauseDescription::arm_effect`].
    fn arm_effect(&self, setting: &EffectContext) -> Option<Box<dyn Effect>> {
        self.about().arm_effect.map(|make| make(setting))
    }

    /// Every hypothesis that the recording can speak of; those of one place are the shapes of one cell of a diagnosis.
    fn propose(&self, _survey: &Survey) -> Vec<Hypothesis> {
        Vec::new()
    }

    /// What a mechanic is told of a finding, without its size at the tool.
    fn sentence(&self, summary: &Summary) -> String {
        format!("{} at {}", self.name(), summary.place)
    }

    /// Whether its forms describe something that is in no list.
    fn is_nameless(&self) -> bool {
        false
    }

    /// What a finding that is made of forms of this cause is in the fitted model as a whole.
    fn in_the_model(&self, _fitted: &FittedForms) -> Option<ModelledFinding> {
        None
    }

    /// How large a form that was not found may be where geometry takes up most of what it does.
    fn hidden(&self, _form: &Form, _robot: &RobotModel) -> Option<HiddenSize> {
        None
    }

    /// Other causes that do the same as a term of this one, in a finding of the name `called`, in whatever data: identities of kinematics and statics.
    fn identities(&self, _term: &Term, _called: &str) -> Vec<(&'static str, Place)> {
        Vec::new()
    }

    /// The coefficients of a term of this cause; those of a frame's motion unless it says others.
    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        term.motion().frame_numbers(str::to_string)
    }

    /// See [`Placed::near`]; laws that step, settle or lag have the same neighbours whatever their cause.
    fn near(&self, term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
        match term.basis() {
            Basis::After { .. } => change::near(term, survey),
            _ => warmth::near(term, survey, level),
        }
    }

    /// See [`Placed::variant`]; that of a wave is its order.
    fn variant(&self, term: &Term) -> String {
        orders::variant(term)
    }

    /// Why a term with coefficients `p` (SI) cannot be this cause, as a clause: a number beyond what its physics allows, or beyond what the
    /// recording holds. Beyond `error` (SI, by coefficient) a coefficient is firmly on its side of zero.
    fn impossible(&self, _term: &Term, _p: &[f64], _error: &dyn Fn(usize) -> f64, _survey: &Survey) -> Option<String> {
        None
    }
}

/// Every cause, in the order in which a model is built up. Where two parameters do the same, the one whose cause comes first is kept.
pub const CAUSES: &[&dyn Cause] = &[
    &anchor::AnchorShift,
    &base_frame::BaseFrame,
    &tool_offset::ToolOffset,
    &joint_offset::JointOffset,
    &link_geometry::LinkGeometry,
    &reduction_ratio::ReductionRatio,
    &coupling_ratio::CouplingRatio,
    &joint_compliance::JointCompliance,
    &joint_hardening::JointHardening,
    &link_compliance::LinkCompliance,
    &base_compliance::BaseCompliance,
    &gear_cyclic::GearCyclic,
    &gear_motor_cyclic::GearMotorCyclic,
    &gear_flank::GearFlank,
    &gear_load::GearLoad,
    &joint_table::JointTable,
    &backlash::Backlash,
    &presliding::Presliding,
    &thermal_growth::ThermalGrowth,
    &joint_warming::JointWarming,
    &counterbalance::Counterbalance,
    &cable_drag::CableDrag,
    &link_mass::LinkMass,
    &payload_error::PayloadError,
    &axis_wobble::AxisWobble,
    &viscous_windup::ViscousWindup,
    &zero_shift::ZeroShift,
    &tool_shift::ToolShift,
    &base_shift::BaseShift,
    &tracker_drift::TrackerDrift,
    &tracker_scale::TrackerScale,
    &tracker_circle::TrackerCircle,
    &tracker_elevation::TrackerElevation,
    &tracker_offset::TrackerOffset,
    &tracker_refraction::TrackerRefraction,
    &joint_log_lag::JointLogLag,
    &wrong_point::Outlier,
    &wrong_point::MislabelledPoint,
    &unknown::Unknown,
];

/// The cause of a canonical name.
pub fn cause(name: &str) -> Option<&'static dyn Cause> {
    CAUSES.iter().copied().find(|cause| cause.name() == name)
}

/// The effect of the whole arm of a name, if there is one.
pub fn arm_effect(name: &str, setting: &EffectContext) -> Option<Box<dyn Effect>> {
    cause(name)?.arm_effect(setting)
}

/// Causes that are effects of the whole arm, which are identified; all others are searched for.
pub fn identified() -> impl Iterator<Item = &'static dyn Cause> {
    let setting = EffectContext { base: Pose::identity(), load: Load::GravityTorque };
    CAUSES.iter().copied().filter(move |cause| cause.arm_effect(&setting).is_some())
}
