//! What one recording carries that another does not: a body on the last link, by its ten numbers, or a point mass on a link before it; and
//! what the torques see of it. A mass that they do not see is no number: its moment about the joint is, and what mass that would be where.

use super::arm::{DynamicArm, INERTIAL_NUMBERS, inertia_matrix, unit_number};
use super::cause::{ADDED_MASS, CENTRE, PAYLOAD, TorqueForm, masses_on_links};
use super::columns::TorqueColumn;
use super::problem::TorqueProblem;
use crate::effect::Place;
use nalgebra::{DMatrix, DVector, Vector3};

/// kg: what is heavier is carried by no arm as a surprise.
const HEAVIEST: f64 = 1e3;
/// m: reach of an arm without any length.
const SHORTEST: f64 = 0.1;
/// kg: less is nothing to have a centre.
const LIGHTEST: f64 = 0.05;
/// A number is seen whose standard deviation is below this share of it.
const SEEN: f64 = 0.5;
/// Shares of a place beyond which no mass is at a place.
const PRECISE: f64 = 0.2;

/// What is carried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Carried {
    /// On the last link, with the tool: ten numbers.
    OnTool,
    /// A point mass on a link before it: its mass, moment and inertia along the link.
    OnLink,
}

impl Carried {
    /// What a form carries, if it does.
    pub(crate) fn of(form: &TorqueForm) -> Option<Self> {
        match form.place {
            Place::Tool => Some(Self::OnTool),
            _ if form.name() == ADDED_MASS.name => Some(Self::OnLink),
            _ => None,
        }
    }

    /// What it is called.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::OnTool => "payload",
            Self::OnLink => ADDED_MASS.name,
        }
    }

    /// What the names of its numbers begin with.
    pub(crate) fn tag(self, form: &TorqueForm) -> String {
        match self {
            Self::OnTool => self.name().into(),
            Self::OnLink => format!("{}.{}", self.name(), form.place.tag()),
        }
    }
}

/// A form, its columns, and what its coefficients may be at most.
pub(super) type CarriedForm = (TorqueForm, Vec<TorqueColumn>, Vec<f64>);

/// All that the arm of a recording may carry.
pub(super) fn carried(problem: &TorqueProblem) -> Vec<CarriedForm> {
    let (arm, last) = (problem.scene.arm, problem.joints() - 1);
    let far = reach(arm);
    let scale = |number: usize| match number {
        0 => HEAVIEST,
        1..=3 => HEAVIEST * far,
        _ => HEAVIEST * far * far,
    };
    let payload = TorqueForm {
        place: Place::Tool,
        ..TorqueForm::at_joint(&PAYLOAD, last, INERTIAL_NUMBERS)
    };
    let changes = (0..INERTIAL_NUMBERS).map(|number| (last, unit_number(number)));
    let columns = problem.regressor.columns(&changes.collect());
    let mut all = vec![(payload, columns, (0..INERTIAL_NUMBERS).map(scale).collect())];
    for (form, changes) in masses_on_links(&ADDED_MASS, arm) {
        if form.link() < last {
            let columns = problem.regressor.columns(&changes);
            all.push((form, columns, [0, 1, 4].map(scale).to_vec()));
        }
    }
    all
}

/// The largest distance of the tool or a joint from another one, m.
pub(super) fn reach(arm: &DynamicArm) -> f64 {
    let points = || arm.points.iter().chain([&arm.tool]);
    let far = points().flat_map(|a| points().map(move |b| (a - b).norm()));
    far.fold(SHORTEST, f64::max)
}

/// A number of what is carried.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SeenNumber {
    pub(crate) name: String,
    pub(crate) unit: &'static str,
    pub(crate) value: f64,
    pub(crate) sigma: f64,
}

/// Numbers with their covariance.
struct Fitted {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Fitted {
    /// A function of the numbers by its value and its slopes.
    fn number(
        &self,
        name: &str,
        unit: &'static str,
        value: f64,
        slope: &DVector<f64>,
    ) -> SeenNumber {
        let variance = slope.dot(&(&self.covariance * slope));
        SeenNumber {
            name: name.into(),
            unit,
            value,
            sigma: variance.max(0.0).sqrt(),
        }
    }
}

fn is_seen(number: &SeenNumber) -> bool {
    number.sigma < SEEN * number.value.abs()
}

/// What is seen of a form's coefficients (with their covariance, row-major).
pub(super) fn seen_numbers(
    what: Carried,
    arm: &DynamicArm,
    form: &TorqueForm,
    values: &[f64],
    covariance: &[f64],
) -> Vec<SeenNumber> {
    let count = values.len();
    let fitted = Fitted {
        values: DVector::from_row_slice(values),
        covariance: DMatrix::from_row_slice(count, count, covariance),
    };
    match what {
        Carried::OnTool => on_tool(arm, &fitted),
        Carried::OnLink => on_link(form, &fitted),
    }
}

fn on_tool(arm: &DynamicArm, fitted: &Fitted) -> Vec<SeenNumber> {
    let last = arm.joints() - 1;
    let (axis, point, values) = (arm.axes[last], arm.points[last].coords, &fitted.values);
    let unit =
        |number: usize| DVector::from_fn(INERTIAL_NUMBERS, |k, _| f64::from(u8::from(k == number)));
    let mass = fitted.number("mass", "kg", values[0], &unit(0));
    let moment = Vector3::new(values[1], values[2], values[3]);
    let (about, lever) = about_axis(arm, moment);
    let along = DVector::from_fn(INERTIAL_NUMBERS, |k, _| match k {
        1..=3 => about[k - 1],
        _ => 0.0,
    });
    let joint = format!("j{}", last + 1);
    let size = fitted.number(
        &format!("moment_{joint}"),
        "kg m",
        moment.dot(&about),
        &along,
    );
    // A mass that is small where its moment is large has moved, and is seen.
    let is_small = mass.sigma * lever.max(SHORTEST) < SEEN * size.value.abs();
    if is_seen(&mass) || is_small || !is_seen(&size) {
        let mut all = vec![mass];
        let mass = values[0];
        if mass.abs() > LIGHTEST {
            for (axis, name) in CENTRE.into_iter().enumerate() {
                // The slope of moment over mass.
                let moment = values[1 + axis];
                let mut slope = unit(1 + axis) / mass;
                slope[0] = -moment / (mass * mass);
                let centre = point[axis] + moment / mass;
                let centre = fitted.number(name, "m", centre, &slope);
                // A coordinate that is not seen is no number.
                if centre.sigma < f64::max(SHORTEST, SEEN * (moment / mass).abs()) {
                    all.push(centre);
                }
            }
        }
        return if all[0].sigma < HEAVIEST * SEEN {
            all
        } else {
            Vec::new()
        };
    }
    let inertia = inertia_matrix(&values.as_slice()[4..]);
    let entries: Vec<f64> = (4..INERTIAL_NUMBERS)
        .map(|number| {
            let mut six = [0.0; 6];
            six[number - 4] = 1.0;
            axis.dot(&(inertia_matrix(&six) * axis))
        })
        .collect();
    let turning = DVector::from_fn(INERTIAL_NUMBERS, |k, _| match k {
        0..=3 => 0.0,
        _ => entries[k - 4],
    });
    let inertia = axis.dot(&(inertia * axis));
    let inertia = fitted.number(&format!("inertia_{joint}"), "kg m2", inertia, &turning);
    as_a_point(fitted, size, along, inertia, turning, lever)
}

/// The direction of a moment across the last axis, as far as it points to the tool, and the distance of the tool from that axis, m.
fn about_axis(arm: &DynamicArm, moment: Vector3<f64>) -> (Vector3<f64>, f64) {
    let last = arm.joints() - 1;
    let axis = arm.axes[last];
    let across = |vector: Vector3<f64>| vector - axis * axis.dot(&vector);
    let (moment, tool) = (across(moment), across(arm.tool - arm.points[last]));
    let direction = moment.try_normalize(0.0).unwrap_or(tool);
    let sign = if direction.dot(&tool) < 0.0 {
        -1.0
    } else {
        1.0
    };
    (sign * direction, tool.norm())
}

/// Moment, inertia about its joint, and the point mass that would have both; where the inertia is not seen, that of the place of the tool.
fn as_a_point(
    fitted: &Fitted,
    moment: SeenNumber,
    along: DVector<f64>,
    inertia: SeenNumber,
    turning: DVector<f64>,
    lever: f64,
) -> Vec<SeenNumber> {
    let (m, i) = (moment.value, inertia.value);
    let mut all = vec![moment];
    let turns = is_seen(&inertia);
    if turns {
        all.push(inertia);
    }
    let place = i / m;
    let place = fitted.number(
        "point_distance",
        "m",
        place,
        &(&turning / m - &along * (i / (m * m))),
    );
    let is_precise = turns && place.value > 0.0 && place.sigma < PRECISE * place.value.abs();
    if is_precise {
        let mass = m * m / i;
        let slope = &along * (2.0 * m / i) - &turning * (m * m / (i * i));
        all.push(fitted.number("point_mass", "kg", mass, &slope));
        all.push(place);
    } else if lever > 0.0 {
        all.push(fitted.number("mass_at_tool", "kg", m / lever, &(along / lever)));
    }
    all
}

fn on_link(form: &TorqueForm, fitted: &Fitted) -> Vec<SeenNumber> {
    let values = &fitted.values;
    let unit = |number: usize| DVector::from_fn(3, |k, _| f64::from(u8::from(k == number)));
    let length = Vector3::from_row_slice(&form.shape).norm();
    let mass = fitted.number("mass", "kg", values[0], &unit(0));
    let moment = fitted.number("moment", "kg m", values[1], &unit(1));
    // What is hardly seen of a mass says less of it than its moment and inertia do.
    let is_known = mass.sigma < PRECISE * mass.value.abs();
    if is_known || !is_seen(&moment) {
        let m = values[0];
        let place = unit(1) / m - unit(0) * (values[1] / (m * m));
        let place = fitted.number("distance", "m", values[1] / m, &place);
        let is_precise = place.sigma < SEEN * length;
        return [mass]
            .into_iter()
            .chain(is_precise.then_some(place))
            .collect();
    }
    let inertia = fitted.number("inertia", "kg m2", values[2], &unit(2));
    as_a_point(fitted, moment, unit(1), inertia, unit(2), length)
}
