//! What a rigid arm lacks: each cause in a file of its own, one line each in [`TORQUE_CAUSES`].
//!
//! A cause proposes forms: itself at a place with shape numbers. A form is a group of columns, torques at joints that enter linearly.

mod asymmetric;
mod balancer;
mod coulomb;
mod elasticity;
mod gravity_direction;
mod link_com;
mod link_inertia;
mod link_mass;
mod load;
mod offset;
mod payload;
mod presliding;
mod ripple;
mod rotor;
mod spikes;
mod spring;
mod stribeck;
mod torque_constant;
mod unknown;
mod unnamed_angle;
mod unnamed_drag;
mod unnamed_friction;
mod unnamed_hysteresis;
mod viscous;
mod warmup;
mod wrist_coupling;

use super::inertials::DeclaredInertials;
use super::newton_euler::INERTIAL_NUMBERS;
use super::scene::DynamicScene;
use super::types::TorqueParameter;
use crate::criteria::torque::AT_END;
use crate::effect::Place;
pub use coulomb::COULOMB;
pub(super) use offset::OFFSET;
pub(super) use rotor::ROTOR;
pub(super) use torque_constant::TORQUE_CONSTANT;
pub(super) use unknown::UNKNOWN;
pub(super) use viscous::VISCOUS;
pub(super) use viscous::line_of_power;

/// All causes with columns; latency and contacts are looked for before.
pub(super) const TORQUE_CAUSES: [&dyn TorqueCause; 27] = [
    &viscous::Viscous,
    &coulomb::Coulomb,
    &offset::Offset,
    &asymmetric::Asymmetric,
    &stribeck::Stribeck,
    &presliding::PreslidingFriction,
    &load::LoadFriction,
    &warmup::Warmup,
    &rotor::Rotor,
    &torque_constant::TorqueConstant,
    &spring::SPRING_BALANCE,
    &balancer::Balancer,
    &spring::CABLE_STIFFNESS,
    &ripple::Ripple,
    &elasticity::Elasticity,
    &spikes::Spikes,
    &wrist_coupling::WristCoupling,
    &payload::Payload,
    &link_mass::HeavierLink,
    &link_com::WrongLinkCentre,
    &link_inertia::WrongLinkInertia,
    &gravity_direction::GravityDirection,
    &unknown::Unnamed,
    &unnamed_angle::UnnamedAngle,
    &unnamed_friction::UnnamedFriction,
    &unnamed_drag::UnnamedDrag,
    &unnamed_hysteresis::UnnamedHysteresis,
];

/// A shape number that is refined.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShapeSpan {
    /// As the cause's parameters call it.
    pub name: &'static str,
    pub unit: &'static str,
    /// Position in the form's shape.
    pub index: usize,
    pub least: f64,
    pub most: f64,
    /// Refined by ratios instead of differences.
    pub by_ratio: bool,
    /// What it is unless the data are worth another number.
    pub usual: Option<f64>,
}

impl ShapeSpan {
    /// Whether a number is at an end of what is looked for.
    fn ends_at(&self, value: f64) -> bool {
        let near = |end: f64| (value / end).ln().abs() < *AT_END;
        near(self.least) || near(self.most)
    }
}

/// What a cause is, whatever its form.
pub(super) struct TorqueCauseDescription {
    /// Canonical.
    pub name: &'static str,
    /// What its coefficients are called in a model, and their units; wrong masses, which are in the inertial numbers, have none.
    pub coefficients: &'static [CoefficientName],
    /// -2 ln of how common it is beside a common one.
    pub price: f64,
    /// Frictions of the same joint that it modifies, and without which it is none.
    pub modifies: &'static [&'static str],
    /// Whether it is part of the rich model, which noise is taken from.
    pub rich: bool,
    /// Whether its coefficients can only be positive: a friction that falls with speed, a rotor.
    pub positive: bool,
    /// Whether it brakes, so that its coefficient is positive unless a curve of speed without a name stands beside it, with which it is a sum.
    pub brakes: bool,
    /// Whether it is, like others of its kind, a torque over its joint's angle: one curve looks like several of others.
    pub of_angle: bool,
    /// Whether it is, like others of its kind, a wrong mass, drive or mounting: one such error looks like several of others.
    pub inertial: bool,
    /// Whether its columns are the same at whatever joint it acts.
    pub alike_at_joints: bool,
    /// Whether its columns are made of the rigid torque.
    pub of_rigid: bool,
    /// Whether its columns are made of the smoothed sign of a velocity.
    pub of_sign: bool,
    /// Whether several forms of it may stand at a place.
    pub may_repeat: bool,
}

/// What most causes are.
const PLAIN: TorqueCauseDescription = TorqueCauseDescription {
    name: "",
    coefficients: &[],
    price: 6.0,
    modifies: &[],
    rich: false,
    positive: false,
    brakes: false,
    of_angle: false,
    inertial: false,
    alike_at_joints: false,
    of_rigid: false,
    of_sign: false,
    may_repeat: false,
};

/// Writes what a cause is: what it does not say is as of most causes.
macro_rules! about {
    ($($field:ident: $value:expr),+ $(,)?) => {
        fn about(&self) -> &'static $crate::dynamics::cause::TorqueCauseDescription {
            &$crate::dynamics::cause::TorqueCauseDescription { $($field: $value,)+ ..$crate::dynamics::cause::PLAIN }
        }
    };
}
use about;

/// A physical reason why measured torques differ from those of the rigid arm.
pub(super) trait TorqueCause: Sync {
    /// What it is.
    fn about(&self) -> &'static TorqueCauseDescription;
    /// Its canonical name.
    fn name(&self) -> &'static str {
        self.about().name
    }
    /// All that are tried on a recording.
    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm>;
    /// -2 ln of how common it is beside a common one.
    fn price(&self, _form: &TorqueForm) -> f64 {
        self.about().price
    }
    /// Joints whose torque it changes: its own, and those that carry its link or the tool and the base.
    fn acts_on(&self, form: &TorqueForm, joints: usize) -> Vec<usize> {
        match form.place {
            Place::Joint(joint) => vec![joint],
            Place::Links(link, _) => (0..=link).collect(),
            _ => (0..joints).collect(),
        }
    }
    /// Writes a column of the torque at a joint (Nm per unit of its coefficient), rows as recorded; zero of what is a change of masses alone.
    fn write(
        &self,
        _form: &TorqueForm,
        _scene: &DynamicScene,
        _joint: usize,
        _column: usize,
        out: &mut [f64],
    ) {
        out.fill(0.0);
    }
    /// Link and change of its numbers per coefficient, for causes that are wrong masses: these write nothing.
    fn inertial(
        &self,
        _form: &TorqueForm,
        _declared: &DeclaredInertials,
    ) -> Option<Vec<(usize, [f64; INERTIAL_NUMBERS])>> {
        None
    }
    /// What tells its cells at a place from each other.
    fn cell(&self, _form: &TorqueForm) -> [usize; 2] {
        [0; 2]
    }
    /// Whether the form is part of the rich model, which noise is taken from.
    fn is_rich(&self, _form: &TorqueForm) -> bool {
        self.about().rich
    }
    /// Whether its coefficients are ones that an arm can have: no link weighs less than nothing.
    fn is_possible(&self, _form: &TorqueForm, _values: &[f64]) -> bool {
        true
    }
    /// Whether its shape numbers are still those of this cause and not at an end where it is another's torque.
    fn is_itself(&self, _form: &TorqueForm, _scene: &DynamicScene) -> bool {
        true
    }
    /// Shape numbers that are refined once it is found.
    fn spans(&self, _form: &TorqueForm) -> Vec<ShapeSpan> {
        Vec::new()
    }
    /// Torque per coefficient of a column at a velocity and its smoothed sign, for causes that are friction over velocity.
    fn friction(
        &self,
        _form: &TorqueForm,
        _column: usize,
        _velocity: f64,
        _sign: f64,
    ) -> Option<f64> {
        None
    }
    /// Whether it is a curve of speed, neither proportional to it nor of one size: one without a name stands for all of them.
    fn bends(&self, _form: &TorqueForm) -> bool {
        false
    }
    /// Whether its forms have such shape numbers, by which causes of one name are known from each other.
    fn has_shape(&self, _shape: &[f64]) -> bool {
        true
    }
    /// Whether a number of it that is counted, as an order, is the last that is tried.
    fn has_ends(&self, _form: &TorqueForm) -> bool {
        false
    }
    /// Its numbers as people read them: its coefficients and shape numbers unless it has others.
    fn parameters(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let coefficients = self.about().coefficients.iter().zip(fitted);
        let coefficients = coefficients.map(|((name, unit), number)| plain(name, *number, unit));
        let shapes = form
            .shape_numbers()
            .into_iter()
            .map(|span| shape(span.name, form.shape[span.index], span.unit));
        coefficients.chain(shapes).collect()
    }
    /// A sentence without a full stop, with its size.
    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String;
}

/// Quantity and unit of a coefficient.
pub(super) type CoefficientName = (&'static str, &'static str);

/// A coefficient and its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedNumber {
    /// SI.
    pub value: f64,
    /// The same unit.
    pub sigma: f64,
}

/// A cause at a place with its shape numbers.
#[derive(Clone)]
pub(super) struct TorqueForm {
    pub cause: &'static dyn TorqueCause,
    pub place: Place,
    /// Further joints (from 0) or an order, as the cause reads them.
    pub with: [usize; 2],
    pub shape: Vec<f64>,
    /// Columns.
    pub width: usize,
}

impl TorqueForm {
    /// A form at a joint, without shape numbers.
    pub fn at_joint(cause: &'static dyn TorqueCause, joint: usize, width: usize) -> Self {
        Self {
            cause,
            place: Place::Joint(joint),
            with: [0; 2],
            shape: Vec::new(),
            width,
        }
    }

    /// The same with shape numbers.
    pub fn shaped(mut self, shape: &[f64]) -> Self {
        self.shape = shape.to_vec();
        self
    }

    /// Its joint, from 0; that of its link elsewhere.
    pub fn joint(&self) -> usize {
        match self.place {
            Place::Joint(joint) => joint,
            Place::Links(link, _) => link,
            _ => 0,
        }
    }

    /// Its link, from 0.
    pub fn link(&self) -> usize {
        self.joint()
    }

    /// Whether it is a curve of speed without a name, which viscous and Coulomb friction of its joint are parts of.
    pub fn is_nameless_curve(&self) -> bool {
        self.cause.name() == UNKNOWN && self.cause.bends(self)
    }

    /// Whether a curve without a name and another curve of speed would be one sum at one joint.
    pub fn is_one_curve_with(&self, other: &Self) -> bool {
        let [one, two] = [self, other].map(|form| form.cause.bends(form));
        self.place == other.place
            && one
            && two
            && (self.is_nameless_curve() || other.is_nameless_curve())
    }

    /// The same with the numbers that are at an end of their search as they usually are; none where one of them has nothing usual. What is
    /// best at an end would be better beyond it.
    pub fn within_ends(&self) -> Option<Self> {
        let mut within = self.clone();
        for span in self
            .shape_numbers()
            .into_iter()
            .filter(|span| span.ends_at(self.shape[span.index]))
        {
            within.shape[span.index] = span.usual?;
        }
        (!self.cause.has_ends(self)).then_some(within)
    }

    /// Whether it modifies the friction that another form is.
    pub fn modifies(&self, friction: &Self) -> bool {
        self.place == friction.place && self.cause.about().modifies.contains(&friction.cause.name())
    }

    /// Whether both are the same cause at the same place.
    pub fn is_called_as(&self, other: &Self) -> bool {
        self.cause.name() == other.cause.name() && self.place == other.place
    }

    /// Whether both are called the same, and what has no name is a function of the same.
    pub fn is_of_kind(&self, other: &Self) -> bool {
        let kind = |form: &Self| {
            form.cause
                .about()
                .coefficients
                .first()
                .map(|(name, _)| *name)
        };
        self.is_called_as(other) && (self.cause.name() != UNKNOWN || kind(self) == kind(other))
    }

    /// Shape numbers that are found from the data, each once.
    pub fn shape_numbers(&self) -> Vec<ShapeSpan> {
        let mut numbers: Vec<ShapeSpan> = Vec::new();
        for span in self.cause.spans(self) {
            let is_found = span.usual != Some(self.shape[span.index]);
            if is_found && !numbers.iter().any(|known| known.index == span.index) {
                numbers.push(span);
            }
        }
        numbers
    }

    /// The same with a shape number moved.
    pub fn with_shape(&self, index: usize, value: f64) -> Self {
        let mut moved = self.clone();
        moved.shape[index] = value;
        moved
    }

    /// What its coefficients are called, one a column, with their units.
    pub fn coefficient_names(&self) -> Vec<(String, &'static str)> {
        let known = self.cause.about().coefficients;
        let name = |column: usize| match known.get(column) {
            Some((quantity, unit)) => ((*quantity).to_string(), *unit),
            None => (format!("coefficient_{}", column + 1), "1"),
        };
        (0..self.width).map(name).collect()
    }
}

/// Friction of the joints (Nm, `[joint][row]`) by those of some forms that are friction of one joint, with their coefficients.
pub(super) fn friction_of<'f>(
    forms: impl Iterator<Item = (&'f TorqueForm, &'f [f64])>,
    scene: &DynamicScene,
) -> Vec<Vec<f64>> {
    let mut friction = vec![vec![0.0; scene.rows()]; scene.joints()];
    let mut course = vec![0.0; scene.rows()];
    for (form, coefficients) in forms {
        let about = form.cause.about();
        let Place::Joint(joint) = form.place else {
            continue;
        };
        if !(about.of_sign || about.brakes) {
            continue;
        }
        for (column, coefficient) in coefficients.iter().enumerate() {
            form.cause.write(form, scene, joint, column, &mut course);
            let sums = friction[joint].iter_mut().zip(&course);
            sums.for_each(|(sum, value)| *sum += coefficient * value);
        }
    }
    friction
}

/// A parameter that is one coefficient.
fn plain(name: &str, fitted: FittedNumber, unit: &'static str) -> TorqueParameter {
    TorqueParameter {
        name: name.into(),
        value: fitted.value,
        unit,
        sigma: Some(fitted.sigma),
    }
}

/// A shape number.
fn shape(name: &str, value: f64, unit: &'static str) -> TorqueParameter {
    TorqueParameter {
        name: name.into(),
        value,
        unit,
        sigma: None,
    }
}

/// The forms of a cause that sits at each joint.
fn at_each_joint(
    cause: &'static dyn TorqueCause,
    scene: &DynamicScene,
    width: usize,
) -> Vec<TorqueForm> {
    (0..scene.joints())
        .map(|joint| TorqueForm::at_joint(cause, joint, width))
        .collect()
}

/// The forms of a cause that sits at each link of declared masses.
fn at_each_link(
    cause: &'static dyn TorqueCause,
    scene: &DynamicScene,
    width: usize,
) -> Vec<TorqueForm> {
    let links = if scene.declared.is_some() {
        scene.joints()
    } else {
        0
    };
    let form = |link| TorqueForm {
        place: Place::Links(link, link),
        ..TorqueForm::at_joint(cause, link, width)
    };
    (0..links).map(form).collect()
}

/// The forms of a cause at each joint with each of some shape numbers.
fn at_each_joint_with(
    cause: &'static dyn TorqueCause,
    scene: &DynamicScene,
    width: usize,
    shapes: &[&[f64]],
) -> Vec<TorqueForm> {
    let of = |joint| {
        shapes
            .iter()
            .map(move |shape| TorqueForm::at_joint(cause, joint, width).shaped(shape))
    };
    (0..scene.joints()).flat_map(of).collect()
}

/// Writes a function of the row.
fn fill(out: &mut [f64], of: impl Fn(usize) -> f64) {
    out.iter_mut()
        .enumerate()
        .for_each(|(row, value)| *value = of(row));
}
