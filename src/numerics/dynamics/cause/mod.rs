//! What a rigid arm lacks: each cause a row of [`TORQUE_CAUSES`].
//!
//! A cause proposes forms: itself at a place with shape numbers. A form is a group of columns, torques at joints that enter linearly. Most
//! columns are functions of a row; what remembers rows before writes whole courses.

mod angle;
mod declared;
mod friction;
mod generated;
mod masses;
mod memory;

use super::arm::{DeclaredInertials, INERTIAL_NUMBERS};
use super::recording::add;
use super::scene::DynamicScene;
use super::sliding::UnitAt;
use crate::criteria::torque::AT_END;
use crate::effect::{DeclaredTorque, Place};
pub(super) use angle::{CURRENT_OFFSET, OFFSET, UNKNOWN};
use calib_numerics::figures::measured;
pub(super) use declared::{DECLARED, declared};
pub use friction::COULOMB;
pub(super) use friction::{
    COULOMB_FRICTION, LOAD_FRICTION, VISCOUS, VISCOUS_FRICTION, line_of_power, of_greatest_load,
};
pub(super) use masses::{ADDED_MASS, CENTRE, PAYLOAD, ROTOR, TORQUE_CONSTANT, masses_on_links};
use std::borrow::Cow;
use std::sync::Arc;

/// A fitted number of a finding.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueParameter {
    /// E.g. `viscous`, `travel`, `mass`.
    pub name: String,
    /// In `unit`.
    pub value: f64,
    /// As people read it.
    pub unit: &'static str,
    /// One standard deviation with autocorrelation, where it was estimated.
    pub sigma: Option<f64>,
}

/// All causes with columns; latency and contacts are looked for before. What has no name comes last.
pub(super) static TORQUE_CAUSES: [&TorqueCause; 30] = [
    &friction::VISCOUS_FRICTION,
    &friction::COULOMB_FRICTION,
    &angle::CURRENT_OFFSET,
    &friction::ASYMMETRIC,
    &friction::STRIBECK,
    &memory::PRESLIDING,
    &friction::LOAD,
    &friction::WARMUP,
    &masses::ROTOR_INERTIA,
    &masses::WRONG_CONSTANT,
    &angle::SPRING_BALANCE,
    &angle::BALANCER,
    &angle::CABLE_STIFFNESS,
    &angle::RIPPLE,
    &memory::ELASTICITY,
    &memory::SPIKES,
    &memory::PLAY,
    &friction::WRIST_COUPLING,
    &masses::PAYLOAD,
    &masses::LINK_MASS,
    &masses::LINK_CENTRE,
    &masses::LINK_INERTIA,
    &masses::GRAVITY_DIRECTION,
    &angle::TWO_ANGLES,
    &angle::ONE_ANGLE,
    &friction::BY_SPEED,
    &friction::BY_ANGLE,
    &memory::HYSTERESIS,
    &generated::OVER_ROWS,
    &generated::DRY_OVER_TEMPERATURE,
];

/// Whether a cause of the library has a name.
pub fn is_cause(name: &str) -> bool {
    TORQUE_CAUSES.iter().any(|cause| cause.name == name)
}

/// A shape number that is refined.
#[derive(Debug, Clone)]
pub(super) struct ShapeSpan {
    /// As the cause's parameters call it.
    pub(crate) name: Cow<'static, str>,
    pub(crate) unit: &'static str,
    /// Position in the form's shape.
    pub(crate) index: usize,
    pub(crate) least: f64,
    pub(crate) most: f64,
    /// Refined by ratios instead of differences.
    pub(crate) by_ratio: bool,
    /// What it is unless the data are worth another number.
    pub(crate) usual: Option<f64>,
}

impl ShapeSpan {
    /// The size of a number by which it is moved: of one that goes in differences, which may be nothing, at least a share of the search.
    pub(crate) fn size(&self, value: f64) -> f64 {
        match self.by_ratio {
            true => value.abs(),
            false => value.abs().max(LITTLE * (self.most - self.least)),
        }
    }

    /// Whether a number is at an end of what is looked for.
    fn ends_at(&self, value: f64) -> bool {
        let near = |end: f64| match self.by_ratio {
            true => (value / end).ln().abs() < *AT_END,
            false => (value - end).abs() < *AT_END * self.size(end),
        };
        near(self.least) || near(self.most)
    }
}

/// Relative step of a shape number for a finite difference.
pub(super) const SHARE: f64 = 0.03;

/// The slope of a function of a shape number.
pub(super) fn slope(size: f64, function: impl Fn(f64) -> f64) -> f64 {
    (function(size * (1.0 + SHARE)) - function(size * (1.0 - SHARE))) / (2.0 * SHARE * size)
}

/// A physical reason why measured torques differ from those of the rigid arm.
pub(super) struct TorqueCause {
    /// Canonical; none of declared laws, which have names of their own.
    pub(crate) name: &'static str,
    /// The kind of variable that it follows.
    pub(crate) follows: fn(&TorqueForm) -> &'static str,
    /// What its coefficients are called in a model, and their units; wrong masses, which are in the inertial numbers, have none.
    pub(crate) coefficients: &'static [CoefficientName],
    /// -2 ln of the prior odds of a form of it, relative to a common one.
    pub(crate) price: fn(&TorqueForm) -> f64,
    /// Frictions of the same joint that it modifies, and without which it is none.
    pub(crate) modifies: &'static [&'static str],
    /// Whether a form is part of the rich model, which noise is taken from.
    pub(crate) rich: fn(&TorqueForm) -> bool,
    /// Whether its coefficients can only be positive: a friction that falls with speed, a rotor.
    pub(crate) positive: bool,
    /// Whether it brakes, so that its coefficient is positive unless a curve of speed without a name is in the model too, with which it is a sum.
    pub(crate) brakes: bool,
    /// Whether it is, like others of its kind, a wrong mass, drive or mounting: one such error looks like several of others.
    pub(crate) inertial: bool,
    /// Whether it is made by turning: no joint that slides has it.
    pub(crate) of_turn: bool,
    /// Whether its columns are the same at whatever joint it acts.
    pub(crate) alike_at_joints: bool,
    /// Whether its columns are made of the rigid torque.
    pub(crate) of_rigid: bool,
    /// Whether its columns are made of the smoothed sign of a velocity.
    pub(crate) of_sign: bool,
    /// Whether several forms of it may stand at a place.
    pub(crate) may_repeat: bool,
    /// Whether it is a curve of speed, neither proportional to it nor of one size: one without a name stands for all of them.
    pub(crate) bends: bool,
    /// Lengths of the shapes that its forms have, by which causes of one name are known from each other; whatever length where there are none.
    pub(crate) lengths: &'static [usize],
    /// All that are tried on a recording.
    pub(crate) forms: fn(&'static TorqueCause, &DynamicScene) -> Vec<TorqueForm>,
    /// A further joint whose torque it changes: neither its place nor one that carries its link, or the tool and the base.
    pub(crate) and_on: fn(&TorqueForm) -> Option<usize>,
    /// Its torque, Nm per unit of a coefficient.
    pub(crate) torque: ColumnTorque,
    /// Link and change of its numbers per coefficient, for causes that are wrong masses.
    pub(crate) changes: Option<fn(&TorqueForm, &DeclaredInertials) -> InertialChanges>,
    /// What distinguishes its cells at a place.
    pub(crate) cell: fn(&TorqueForm) -> [usize; 2],
    /// Whether its coefficients are ones that an arm can have: no link weighs less than nothing.
    pub(crate) is_possible: fn(&TorqueForm, &[f64]) -> bool,
    /// Whether its shape numbers are still those of this cause and not at an end where it is another's torque.
    pub(crate) is_itself: fn(&TorqueForm, &DynamicScene) -> bool,
    /// Shape numbers that are refined once it is found.
    pub(crate) spans: fn(&TorqueForm) -> Vec<ShapeSpan>,
    /// Whether a number of it that is counted, as an order, is the last that is tried.
    pub(crate) has_ends: fn(&TorqueForm) -> bool,
    /// Its numbers as people read them: its coefficients and shape numbers unless it has others.
    pub(crate) parameters: fn(&TorqueForm, &[FittedNumber]) -> Vec<TorqueParameter>,
    /// A sentence without a full stop, with its size, in units of a joint that slides or turns by those of one that turns.
    pub(crate) statement: fn(&TorqueForm, &[FittedNumber], UnitAt) -> String,
}

/// Torque per coefficient of a form's column at a velocity and its smoothed sign.
pub(super) type FrictionLaw = fn(&TorqueForm, usize, f64, f64) -> f64;

/// Links and changes of their numbers.
pub(super) type InertialChanges = Vec<(usize, [f64; INERTIAL_NUMBERS])>;

/// How a column is made.
pub(super) enum ColumnTorque {
    /// By each row.
    Row(fn(&ColumnOf, usize) -> f64),
    /// Of what is friction over velocity.
    Friction(FrictionLaw),
    /// All rows as recorded, from zeros.
    Course(fn(&ColumnOf, &mut [f64])),
    /// A change of masses alone.
    Masses,
}

/// A column of a form at a joint.
pub(super) struct ColumnOf<'a> {
    pub(crate) form: &'a TorqueForm,
    pub(crate) scene: &'a DynamicScene<'a>,
    pub(crate) joint: usize,
    pub(crate) column: usize,
}

impl ColumnOf<'_> {
    /// rad, of the form's joint.
    fn angle(&self, row: usize) -> f64 {
        self.scene.position[self.form.joint()][row]
    }

    /// rad/s, of the form's joint.
    fn velocity(&self, row: usize) -> f64 {
        self.scene.velocity[self.form.joint()][row]
    }

    /// The smoothed sign of the form's joint's velocity.
    fn direction(&self, row: usize) -> f64 {
        self.scene.direction(self.form.joint(), row)
    }
}

/// What most causes are.
const PLAIN: TorqueCause = TorqueCause {
    name: "",
    follows: |_| "",
    coefficients: &[],
    price: |_| 6.0,
    modifies: &[],
    rich: |_| false,
    positive: false,
    brakes: false,
    inertial: false,
    of_turn: false,
    alike_at_joints: false,
    of_rigid: false,
    of_sign: false,
    may_repeat: false,
    bends: false,
    lengths: &[],
    forms: |cause, scene| at_each_joint(cause, scene, cause.coefficients.len(), &[&[]]),
    and_on: |_| None,
    torque: ColumnTorque::Masses,
    changes: None,
    cell: |_| [0; 2],
    is_possible: |_, _| true,
    is_itself: |_, _| true,
    spans: |_| Vec::new(),
    has_ends: |_| false,
    parameters: plain_parameters,
    statement: |form, _, _| form.place.to_string(),
};

impl TorqueCause {
    /// Whether its forms have such shape numbers.
    pub(crate) fn has_shape(&self, shape: &[f64]) -> bool {
        self.lengths.is_empty() || self.lengths.contains(&shape.len())
    }
}

/// Coefficients by their names, then shape numbers.
fn plain_parameters(form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
    let coefficients = form.cause.coefficients.iter().zip(fitted);
    let coefficients = coefficients.map(|((name, unit), number)| plain(name, *number, unit));
    coefficients.chain(form.shape_parameters()).collect()
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

/// A number is seen whose standard deviation is below this share of it.
const SEEN: f64 = 0.5;

impl FittedNumber {
    /// With the digits that its standard deviation tells.
    pub(crate) fn rounded(&self) -> String {
        measured(self.value, Some(self.sigma))
    }

    /// Its size alone.
    pub(crate) fn size(&self) -> Self {
        Self {
            value: self.value.abs(),
            ..*self
        }
    }

    /// Whether its rows show it.
    pub(crate) fn is_seen(&self) -> bool {
        self.sigma > 0.0 && self.sigma < SEEN * self.value.abs()
    }
}

/// A cause at a place with its shape numbers.
#[derive(Clone)]
pub(super) struct TorqueForm {
    pub(crate) cause: &'static TorqueCause,
    /// The law that a user has declared; none of a cause of the library.
    pub(crate) law: Option<Arc<DeclaredTorque>>,
    pub(crate) place: Place,
    /// Further joints (from 0) or an order, as the cause reads them.
    pub(crate) with: [usize; 2],
    pub(crate) shape: Vec<f64>,
    /// Columns.
    pub(crate) width: usize,
}

impl TorqueForm {
    /// A form at a joint, without shape numbers.
    pub(crate) fn at_joint(cause: &'static TorqueCause, joint: usize, width: usize) -> Self {
        Self {
            cause,
            law: None,
            place: Place::Joint(joint),
            with: [0; 2],
            shape: Vec::new(),
            width,
        }
    }

    /// The same with shape numbers.
    pub(crate) fn shaped(mut self, shape: &[f64]) -> Self {
        self.shape = shape.to_vec();
        self
    }

    /// The name of its cause.
    pub(crate) fn name(&self) -> &str {
        let law = self.law.as_ref();
        law.map_or(self.cause.name, |law| &law.declaration().name)
    }

    /// Whether its coefficients can only be positive.
    pub(crate) fn is_positive(&self) -> bool {
        let law = self.law.as_ref();
        law.map_or(self.cause.positive, |law| law.declaration().positive)
    }

    /// Whether its columns are made of the rigid torque.
    pub(crate) fn is_of_rigid(&self) -> bool {
        let law = self.law.as_ref();
        law.map_or(self.cause.of_rigid, |law| law.asks_load())
    }

    /// Its joint, from 0; that of its link elsewhere.
    pub(crate) fn joint(&self) -> usize {
        match self.place {
            Place::Joint(joint) => joint,
            Place::Links(link, _) => link,
            _ => 0,
        }
    }

    /// Its link, from 0.
    pub(crate) fn link(&self) -> usize {
        self.joint()
    }

    /// Joints whose torque it changes: its own, and those that carry its link or the tool and the base.
    pub(crate) fn acts_on(&self, joints: usize) -> Vec<usize> {
        match self.place {
            Place::Joint(joint) => [joint]
                .into_iter()
                .chain((self.cause.and_on)(self))
                .collect(),
            Place::Links(link, _) => (0..=link).collect(),
            _ => (0..joints).collect(),
        }
    }

    /// Whether it needs a joint to turn that slides.
    pub(crate) fn needs_turn(&self, prismatic: &[bool]) -> bool {
        let slides = |joint: usize| prismatic.get(joint) == Some(&true);
        let also = || (self.cause.and_on)(self);
        self.cause.of_turn && (slides(self.joint()) || also().is_some_and(slides))
    }

    /// Whether it acts at a joint that slides.
    pub(crate) fn slides(&self, prismatic: &[bool]) -> bool {
        matches!(self.place, Place::Joint(joint) if prismatic.get(joint) == Some(&true))
    }

    /// Links and changes of their numbers per coefficient; none of what is no wrong mass, or where no masses are declared.
    pub(crate) fn inertial(&self, scene: &DynamicScene) -> Option<InertialChanges> {
        Some((self.cause.changes?)(self, scene.declared.as_ref()?))
    }

    /// Torque per coefficient of a column at a velocity and its smoothed sign, of what is friction over velocity.
    pub(crate) fn friction(&self, column: usize, velocity: f64, sign: f64) -> Option<f64> {
        match self.cause.torque {
            ColumnTorque::Friction(law) => Some(law(self, column, velocity, sign)),
            _ => None,
        }
    }

    /// Writes a column of the torque at a joint (Nm per unit of its coefficient), rows as recorded; zero of what is a change of masses alone.
    pub(crate) fn write(&self, scene: &DynamicScene, joint: usize, column: usize, out: &mut [f64]) {
        let column = ColumnOf {
            form: self,
            scene,
            joint,
            column,
        };
        match self.cause.torque {
            ColumnTorque::Row(function) => {
                let rows = out.iter_mut().enumerate();
                rows.for_each(|(row, value)| *value = function(&column, row));
            }
            ColumnTorque::Friction(law) => {
                for (row, value) in out.iter_mut().enumerate() {
                    let (velocity, sign) = (column.velocity(row), column.direction(row));
                    *value = law(self, column.column, velocity, sign);
                }
            }
            ColumnTorque::Course(function) => {
                out.fill(0.0);
                function(&column, out);
            }
            ColumnTorque::Masses => out.fill(0.0),
        }
    }

    /// Whether it is a curve of speed without a name, which viscous and Coulomb friction of its joint are parts of.
    pub(crate) fn is_nameless_curve(&self) -> bool {
        self.cause.name == UNKNOWN && self.cause.bends
    }

    /// Whether a curve without a name and another curve of speed would be one sum at one joint.
    pub(crate) fn is_one_curve_with(&self, other: &Self) -> bool {
        let [one, two] = [self, other].map(|form| form.cause.bends);
        self.place == other.place
            && one
            && two
            && (self.is_nameless_curve() || other.is_nameless_curve())
    }

    /// The same with the numbers that are at an end of their search as they usually are; none where one of them has nothing usual. What is
    /// best at an end would be better beyond it.
    pub(crate) fn within_ends(&self) -> Option<Self> {
        let mut within = self.clone();
        for span in self
            .shape_numbers()
            .into_iter()
            .filter(|span| span.ends_at(self.shape[span.index]))
        {
            within.shape[span.index] = span.usual?;
        }
        (!(self.cause.has_ends)(self)).then_some(within)
    }

    /// Whether it is a cause of a name at a place.
    pub(crate) fn is_called(&self, name: &str, place: Place) -> bool {
        self.name() == name && self.place == place
    }

    /// Whether both are the same cause at the same place.
    pub(crate) fn is_called_as(&self, other: &Self) -> bool {
        self.is_called(other.name(), other.place)
    }

    /// What it is a function of, among those that have no name: what its first coefficient is called.
    pub(crate) fn kind(&self) -> &'static str {
        let first = self.cause.coefficients.first();
        first.map_or("", |(name, _)| *name)
    }

    /// Whether both are called the same, and what has no name is a function of the same.
    pub(crate) fn is_of_kind(&self, other: &Self) -> bool {
        self.is_called_as(other) && (self.cause.name != UNKNOWN || self.kind() == other.kind())
    }

    /// Shape numbers that are found from the data, each once.
    pub(crate) fn shape_numbers(&self) -> Vec<ShapeSpan> {
        let mut numbers: Vec<ShapeSpan> = Vec::new();
        for span in (self.cause.spans)(self) {
            let is_found = span.usual != Some(self.shape[span.index]);
            if is_found && !numbers.iter().any(|known| known.index == span.index) {
                numbers.push(span);
            }
        }
        numbers
    }

    /// Whether it is its cause in the usual shape, with one coefficient.
    pub(crate) fn is_plain(&self) -> bool {
        self.width == 1 && self.shape_numbers().is_empty()
    }

    /// Shape numbers that are found, as people read them.
    pub(crate) fn shape_parameters(&self) -> impl Iterator<Item = TorqueParameter> + '_ {
        let found = self.shape_numbers().into_iter();
        found.map(|span| shape(&span.name, self.shape[span.index], span.unit))
    }

    /// The same with a shape number moved.
    pub(crate) fn with_shape(&self, index: usize, value: f64) -> Self {
        let mut moved = self.clone();
        moved.shape[index] = value;
        moved
    }

    /// What its coefficients are called, one a column, with their units.
    pub(crate) fn coefficient_names(&self) -> Vec<(String, &'static str)> {
        let known = self.cause.coefficients;
        let unit = self.law.as_ref().map_or("1", |_| "Nm");
        let name = |column: usize| match known.get(column) {
            Some((quantity, unit)) => ((*quantity).to_string(), *unit),
            None if self.width == 1 => ("coefficient".to_string(), unit),
            None => (format!("coefficient_{}", column + 1), unit),
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
        let about = form.cause;
        let Place::Joint(joint) = form.place else {
            continue;
        };
        if !(about.of_sign || about.brakes) {
            continue;
        }
        for (column, coefficient) in coefficients.iter().enumerate() {
            form.write(scene, joint, column, &mut course);
            add(&mut friction[joint], *coefficient, &course);
        }
    }
    friction
}

/// A parameter that is one coefficient.
pub(super) fn plain(name: &str, fitted: FittedNumber, unit: &'static str) -> TorqueParameter {
    TorqueParameter {
        sigma: Some(fitted.sigma),
        ..shape(name, fitted.value, unit)
    }
}

/// A shape number.
pub(super) fn shape(name: &str, value: f64, unit: &'static str) -> TorqueParameter {
    TorqueParameter {
        name: name.into(),
        value,
        unit,
        sigma: None,
    }
}

/// The forms of a cause at each joint with each of some shape numbers.
fn at_each_joint(
    cause: &'static TorqueCause,
    scene: &DynamicScene,
    width: usize,
    shapes: &[&[f64]],
) -> Vec<TorqueForm> {
    let shaped = |joint| {
        let shapes = shapes.iter();
        shapes.map(move |shape| TorqueForm::at_joint(cause, joint, width).shaped(shape))
    };
    (0..scene.joints()).flat_map(shaped).collect()
}

/// Share of the recording: what warms up for longer is friction, or a zero, that stays.
const LASTING: f64 = 0.45;
/// Share of the recording at which the search for a time ends: what is best there is not known.
const LAST: f64 = 0.9;

/// The forms of two columns of a cause that fades over some times, s, at each joint. Shape: the time, and the end of its search.
fn warming(cause: &'static TorqueCause, scene: &DynamicScene, times: &[f64]) -> Vec<TorqueForm> {
    let lasting = times
        .iter()
        .filter(|time| **time <= LASTING * scene.duration());
    let shapes: Vec<[f64; 2]> = lasting
        .map(|time| [*time, LAST * scene.duration()])
        .collect();
    let shapes: Vec<&[f64]> = shapes.iter().map(|shape| &shape[..]).collect();
    at_each_joint(cause, scene, 2, &shapes)
}

/// The forms of a cause at some joints, in some numbers of columns, each with the shape numbers of its joint.
fn at_joints<S: AsRef<[f64]>>(
    cause: &'static TorqueCause,
    joints: impl IntoIterator<Item = usize>,
    widths: &[usize],
    shape: impl Fn(usize) -> S,
) -> Vec<TorqueForm> {
    let mut forms = Vec::new();
    for joint in joints {
        let shape = shape(joint);
        let of_width = |width| TorqueForm::at_joint(cause, joint, width).shaped(shape.as_ref());
        forms.extend(widths.iter().copied().map(of_width));
    }
    forms
}

/// The wave of a column, cosine and sine in turn.
fn wave(column: usize, phase: f64) -> f64 {
    match column.is_multiple_of(2) {
        true => phase.cos(),
        false => phase.sin(),
    }
}

/// The forms of a cause that sits at each link of declared masses.
fn at_each_link(
    cause: &'static TorqueCause,
    scene: &DynamicScene,
    width: usize,
) -> Vec<TorqueForm> {
    let links = scene.declared.as_ref().map_or(0, |_| scene.joints());
    let form = |link| TorqueForm {
        place: Place::Links(link, link),
        ..TorqueForm::at_joint(cause, link, width)
    };
    (0..links).map(form).collect()
}

/// Share of a search's width below which a number is as good as nothing.
const LITTLE: f64 = 0.2;

/// A shape number that is refined by ratios between two ends.
fn span(name: &'static str, unit: &'static str, [least, most]: [f64; 2]) -> ShapeSpan {
    ShapeSpan {
        name: name.into(),
        unit,
        index: 0,
        least,
        most,
        by_ratio: true,
        usual: None,
    }
}

/// A number times a factor.
fn scaled(number: &FittedNumber, by: f64) -> FittedNumber {
    FittedNumber {
        value: by * number.value,
        sigma: by * number.sigma,
    }
}

/// The size of two coefficients, with its standard deviation.
fn size_of_two(fitted: &[FittedNumber]) -> FittedNumber {
    let value = fitted[0].value.hypot(fitted[1].value);
    let weighted = (fitted[0].value * fitted[0].sigma).hypot(fitted[1].value * fitted[1].sigma);
    FittedNumber {
        value,
        sigma: weighted / value.max(f64::MIN_POSITIVE),
    }
}
