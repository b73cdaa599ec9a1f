//! The identified model of an arm's torques as data: inertial numbers of the links, and the causes that add torque at joints.

use super::arm::{INERTIAL_NUMBERS, inertial_name, inertial_unit};
use super::cause::{
    COULOMB, DECLARED, FittedNumber, TORQUE_CAUSES, TorqueCause, TorqueForm, VISCOUS,
    line_of_power, slope,
};
use super::sliding::unit_at;
use crate::effect::{DeclaredTorque, Place};
use crate::error::{Error, Result};
use std::sync::Arc;

/// A cause that adds torque at joints, with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueTerm {
    /// Canonical name of the cause.
    pub effect: String,
    /// Where it acts.
    pub place: Place,
    /// The law of a user's own that it is.
    pub declared: Option<DeclaredTorque>,
    /// Further joints (from 0) or an order, as the cause reads them.
    pub with: [usize; 2],
    /// Numbers that enter nonlinearly, SI.
    pub shape: Vec<f64>,
    /// Numbers that enter linearly, SI; names by [`TorqueTerm::names`].
    pub coefficients: Vec<f64>,
    /// Rms of its torque over the recording, Nm, over the joints that it acts on.
    pub rms: f64,
}

/// What the judged rows visited at a joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointRange {
    /// Least and greatest, rad.
    pub position: [f64; 2],
    /// rad/s.
    pub speed: f64,
    /// rad/s^2.
    pub acceleration: f64,
    /// Nm, of the rigid arm.
    pub load: f64,
    /// Nm, one standard deviation: what held-out rows leave beyond noise and the covariance of the model's numbers.
    pub misfit: f64,
    /// Nm, 95 %: what is usual for the model's torque there, by the covariance and the misfit.
    pub usual: f64,
    /// rad/s over which the sign of its velocity turns: the model's, but where friction leads.
    pub sign_width: f64,
    /// Whether it slides: m and N in the place of rad and Nm.
    pub slides: bool,
}

/// The identified model of an arm's torques.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TorqueModel {
    /// 10 n, as the regressor counts them, payload on the last link; 0 where [`TorqueModel::identified`] is false.
    pub inertials: Vec<f64>,
    /// 10 n: all where masses were declared, else the base parameters, which stand for others too.
    pub identified: Vec<bool>,
    /// All causes that add torque at joints: findings, and of viscous and Coulomb friction the one that is too small to be named next to the
    /// other.
    pub terms: Vec<TorqueTerm>,
    /// Covariance of identified inertials, of all coefficients, of the numbers of shapes that were found, term after term, and of the width of a
    /// sign, row-major; with the noise's autocorrelation. Empty where it is not known.
    pub covariance: Vec<f64>,
    /// rad/s over which the sign of a velocity turns.
    pub sign_width: f64,
    /// s by which friction turns before the velocity does.
    pub friction_lead: f64,
    /// s by which the recording's torques came late; they do not when they are commanded.
    pub latency: f64,
    /// Hz, of the low-pass of the recording.
    pub cutoff: f64,
    /// Per joint.
    pub range: Vec<JointRange>,
    /// Least and greatest of the recording, C; `None` where it was not recorded.
    pub temperature: Option<[f64; 2]>,
}

impl TorqueModel {
    /// Number of joints n.
    pub fn joints(&self) -> usize {
        self.range.len()
    }

    /// The beginning of the names of a term's numbers.
    pub fn prefix(&self, term: usize) -> String {
        let TorqueTerm { effect, place, .. } = &self.terms[term];
        let alike = |other: &&TorqueTerm| other.effect == *effect && other.place == *place;
        let before = self.terms[..term].iter().filter(alike).count();
        let tag = place.tag();
        match before {
            0 => format!("{effect}.{tag}"),
            _ => format!("{effect}.{tag}.{}", before + 1),
        }
    }

    /// Whether every inertial number of a link is identified, not only what base parameters stand for.
    pub fn is_whole(&self, link: usize) -> bool {
        self.identified[INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)]
            .iter()
            .all(|known| *known)
    }
}

// Terms of a model as forms of causes, and what all numbers of a model are called.

/// Name of the width of a sign among the numbers of a model.
const SIGN_WIDTH: &str = "recording.sign_width";

impl TorqueTerm {
    /// Its form. Fails where no cause has its name or its numbers are too few.
    pub(super) fn form(&self) -> Result<TorqueForm> {
        let fits = |cause: &&TorqueCause| cause.name == self.effect && cause.has_shape(&self.shape);
        let law = self.declared.as_ref();
        let law = law.filter(|law| law.declaration().name == self.effect);
        let cause = match law {
            Some(_) => Some(&DECLARED),
            None => TORQUE_CAUSES.into_iter().find(fits),
        };
        let cause = cause.ok_or_else(|| {
            Error::data(
                "torque model",
                format!("`{}` is no cause that adds torque", self.effect),
            )
        })?;
        Ok(TorqueForm {
            cause,
            law: law.cloned().map(Arc::new),
            place: self.place,
            with: self.with,
            shape: self.shape.clone(),
            width: self.coefficients.len(),
        })
    }

    /// Values of the shape numbers that were found from the data. Fails where no cause has its name.
    pub fn shape_numbers(&self) -> Result<Vec<f64>> {
        let form = self.form()?;
        let spans = form.shape_numbers().into_iter();
        Ok(spans.map(|span| form.shape[span.index]).collect())
    }

    /// Quantity and unit of each coefficient. Fails where no cause has its name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        self.form().map(|form| form.coefficient_names())
    }
}

impl TorqueModel {
    /// Name of each number of the covariance, in its order: `rigid_body.l3.mass`, `viscous_friction.j2.viscous`; a second cause of a name
    /// at a place is `torque_ripple.j2.2.sine`. Fails where no cause has a term's name.
    pub fn names(&self) -> Result<Vec<(String, &'static str)>> {
        let inertials = (0..self.inertials.len()).filter(|number| self.identified[*number]);
        let inertials = inertials.map(|number| (inertial_name(number), inertial_unit(number)));
        let mut names: Vec<(String, &'static str)> = inertials.collect();
        let mut shapes = Vec::new();
        let prismatic: Vec<bool> = self.range.iter().map(|range| range.slides).collect();
        for (place, term) in self.terms.iter().enumerate() {
            let (prefix, form) = (self.prefix(place), term.form()?);
            let slides = form.slides(&prismatic);
            let named = |name: &str, unit: &'static str| {
                (format!("{prefix}.{name}"), unit_at(slides, unit))
            };
            let coefficients = form.coefficient_names().into_iter();
            names.extend(coefficients.map(|(name, unit)| named(&name, unit)));
            let spans = form.shape_numbers().into_iter();
            shapes.extend(spans.map(|span| named(&span.name, span.unit)));
        }
        names.extend(shapes);
        names.push((SIGN_WIDTH.into(), "rad/s"));
        Ok(names)
    }
}

/// Where the numbers of terms stand in the covariance.
pub(super) struct CovariancePlaces {
    /// Forms of the terms.
    pub(super) forms: Vec<TorqueForm>,
    /// The first coefficient, and the first number of a shape, of each.
    pub(super) coefficients: Vec<usize>,
    pub(super) shapes: Vec<usize>,
    /// Numbers in all; the width of a sign is the last.
    pub(super) width: usize,
}

impl TorqueModel {
    /// Whether a torque of it follows time, so that it depends on how long ago the arm began to move.
    pub fn follows_time(&self) -> bool {
        let forms = self.terms.iter().filter_map(|term| term.form().ok());
        let mut follow = forms.map(|form| (form.cause.follows)(&form));
        follow.any(|variable| variable == "time")
    }

    /// Where the numbers of its terms stand in the covariance. Fails where no cause has a term's name.
    pub(super) fn places(&self) -> Result<CovariancePlaces> {
        let forms = self.terms.iter().map(|term| term.form());
        let forms: Vec<TorqueForm> = forms.collect::<Result<_>>()?;
        let mut next = self.identified.iter().filter(|known| **known).count();
        let mut first = |count: usize| {
            next += count;
            next - count
        };
        let coefficients = forms.iter().map(|form| first(form.width)).collect();
        let shapes = forms.iter().map(|form| first(form.shape_numbers().len()));
        let shapes = shapes.collect();
        Ok(CovariancePlaces {
            coefficients,
            shapes,
            width: first(1) + 1,
            forms,
        })
    }

    /// The covariance of so many numbers; none where it is not known.
    pub(super) fn covariance_of_all(&self, width: usize) -> Option<&[f64]> {
        (self.covariance.len() == width * width).then_some(&self.covariance[..])
    }
}

/// 95 % of a normal distribution lie within so many standard deviations.
pub(super) const COVERAGE: f64 = 1.96;

/// Velocities on either side of zero.
const POINTS: i32 = 30;

/// Torque of friction over velocity, as found.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionCurve {
    /// From 0.
    pub joint: usize,
    /// rad/s, ascending, over the range of the recording.
    pub velocity: Vec<f64>,
    /// Nm.
    pub torque: Vec<f64>,
    /// One standard deviation, Nm.
    pub sigma: Vec<f64>,
}

/// A law of friction of a joint: its form, coefficients, and where these and its shape numbers stand in the covariance.
struct FrictionLaw<'a> {
    form: &'a TorqueForm,
    coefficients: &'a [f64],
    first: usize,
    shapes: usize,
}

impl FrictionLaw<'_> {
    /// Nm at a velocity whose sign turns over a width.
    fn torque(&self, form: &TorqueForm, velocity: f64, width: f64) -> f64 {
        let sign = (velocity / width).tanh();
        let of_column = |(column, value): (usize, &f64)| {
            form.friction(column, velocity, sign).unwrap_or(0.0) * value
        };
        self.coefficients.iter().enumerate().map(of_column).sum()
    }
}

impl TorqueModel {
    /// The curve of every joint that has friction, over the speeds of the recording; standard deviations are 0 where the model carries no
    /// covariance. Fails where no cause has a term's name.
    pub fn friction_curves(&self) -> Result<Vec<FrictionCurve>> {
        let places = self.places()?;
        let curve = |joint: usize| {
            let laws = self.laws(&places, joint);
            (!laws.is_empty()).then(|| self.friction_curve(joint, &laws, places.width))
        };
        Ok((0..self.joints()).filter_map(curve).collect())
    }

    /// Viscous and Coulomb friction of a joint whose viscous friction grows with another power of speed than the first: those of the straight
    /// line of both over the recorded speeds, Nm s/rad and Nm, each with its standard deviation, 0 where the model carries no covariance.
    /// None where speed enters by its first power. Fails where no cause has a term's name.
    pub fn friction_line(&self, joint: usize) -> Result<Option<[FittedNumber; 2]>> {
        let places = self.places()?;
        let laws = self.laws(&places, joint);
        let of_name = |name: &str| laws.iter().find(|law| law.form.name() == name);
        let exponent = |law: &FrictionLaw| law.form.shape.first().copied();
        let power = of_name(VISCOUS).map(|law| (law, exponent(law).unwrap_or(1.0)));
        let Some((power, exponent)) = power.filter(|(_, exponent)| *exponent != 1.0) else {
            return Ok(None);
        };
        let (value, fastest) = (power.coefficients[0], self.range[joint].speed);
        Ok(Some([1, 0].map(|part| {
            let of_line = |exponent: f64| line_of_power(exponent, fastest)[part];
            let coulomb = of_name(COULOMB).filter(|_| part == 0);
            let mut along = vec![(power.first, of_line(exponent))];
            let is_found = !power.form.shape_numbers().is_empty();
            along.extend(is_found.then(|| (power.shapes, value * slope(exponent, of_line))));
            along.extend(coulomb.map(|law| (law.first, 1.0)));
            FittedNumber {
                value: value * of_line(exponent) + coulomb.map_or(0.0, |law| law.coefficients[0]),
                sigma: self.sigma(&along, places.width),
            }
        })))
    }

    /// The laws of friction of a joint.
    fn laws<'a>(&'a self, places: &'a CovariancePlaces, joint: usize) -> Vec<FrictionLaw<'a>> {
        let law = |term: usize| {
            let form = &places.forms[term];
            form.friction(0, 0.0, 0.0)
                .filter(|_| form.place == Place::Joint(joint))?;
            Some(FrictionLaw {
                form,
                coefficients: &self.terms[term].coefficients,
                first: places.coefficients[term],
                shapes: places.shapes[term],
            })
        };
        (0..self.terms.len()).filter_map(law).collect()
    }

    /// The standard deviation of a sum of numbers, by their rows in the covariance of all; 0 where it is not known.
    fn sigma(&self, along: &[(usize, f64)], width: usize) -> f64 {
        let Some(covariance) = self.covariance_of_all(width) else {
            return 0.0;
        };
        let with = |(row, left): &(usize, f64)| -> f64 {
            let parts = along.iter();
            parts
                .map(|(column, right)| left * right * covariance[row * width + column])
                .sum()
        };
        along.iter().map(with).sum::<f64>().max(0.0).sqrt()
    }

    fn friction_curve(&self, joint: usize, laws: &[FrictionLaw], width: usize) -> FrictionCurve {
        let range = &self.range[joint];
        let share = range.sign_width / self.sign_width;
        let points = (-POINTS..=POINTS).map(f64::from);
        let mut curve = FrictionCurve {
            joint,
            velocity: points
                .map(|point| range.speed * point / f64::from(POINTS))
                .collect(),
            torque: Vec::new(),
            sigma: Vec::new(),
        };
        for velocity in curve.velocity.iter().copied() {
            let sum = |width: f64| {
                let torques = laws.iter().map(|law| law.torque(law.form, velocity, width));
                torques.sum::<f64>()
            };
            let turned = slope(self.sign_width, |width| sum(share * width));
            let mut along = vec![(width - 1, turned)];
            let sign = (velocity / range.sign_width).tanh();
            for law in laws {
                let of_column = |column| law.form.friction(column, velocity, sign).unwrap_or(0.0);
                let columns = 0..law.coefficients.len();
                along.extend(columns.map(|column| (law.first + column, of_column(column))));
                for (place, span) in (law.shapes..).zip(law.form.shape_numbers()) {
                    let moved = |size: f64| {
                        let form = law.form.with_shape(span.index, size);
                        law.torque(&form, velocity, range.sign_width)
                    };
                    along.push((place, slope(law.form.shape[span.index], moved)));
                }
            }
            curve.torque.push(sum(range.sign_width));
            curve.sigma.push(self.sigma(&along, width));
        }
        curve
    }
}

#[cfg(test)]
mod tests {
    use super::super::cases::{arm, scene};
    use super::*;

    #[test]
    fn every_form_is_read_back_as_one_of_its_own_cause_and_names_its_coefficients() {
        let position = (0..400)
            .map(|k| libm::sin(0.05 * f64::from(k / 4) + f64::from(k % 4)))
            .collect();
        let arm = arm();
        let scene = scene(&arm, position);
        let mut tried = 0;
        for cause in TORQUE_CAUSES {
            for form in (cause.forms)(cause, &scene)
                .into_iter()
                .filter(|_| !cause.coefficients.is_empty())
            {
                let term = TorqueTerm {
                    declared: None,
                    effect: cause.name.into(),
                    place: form.place,
                    with: form.with,
                    shape: form.shape.clone(),
                    coefficients: vec![1.0; form.width],
                    rms: 0.0,
                };
                let read = term.form().expect("a cause");
                assert!(
                    std::ptr::eq(read.cause.coefficients, cause.coefficients),
                    "{}",
                    cause.name
                );
                assert_eq!(read.width, form.width, "{}", cause.name);
                assert!(
                    read.cause.coefficients.len() >= form.width,
                    "{}",
                    cause.name
                );
                tried += 1;
            }
        }
        assert!(tried > 100, "{tried}");
    }

    #[test]
    fn friction_that_grows_with_another_power_of_speed_has_the_numbers_of_the_line_of_both() {
        let term = |effect: &str, shape: &[f64], value: f64| TorqueTerm {
            declared: None,
            effect: effect.into(),
            place: Place::Joint(0),
            with: [0; 2],
            shape: shape.to_vec(),
            coefficients: vec![value],
            rms: 1.0,
        };
        let seen = JointRange {
            speed: 2.0,
            sign_width: 0.01,
            ..JointRange::default()
        };
        let model = |exponent: f64| TorqueModel {
            inertials: vec![0.0; INERTIAL_NUMBERS],
            identified: vec![false; INERTIAL_NUMBERS],
            terms: vec![term(VISCOUS, &[exponent], 4.0), term(COULOMB, &[], 1.0)],
            // Of both coefficients, of the exponent and of the width of the sign.
            covariance: [
                [0.01, 0.0, 0.0, 0.0],
                [0.0, 0.04, 0.0, 0.0],
                [0.0; 4],
                [0.0; 4],
            ]
            .concat(),
            sign_width: 0.01,
            range: vec![seen],
            ..TorqueModel::default()
        };
        // 4 |v|^0.8 up to 2 rad/s: the line through 2000 points of it, by plain least squares, rises by 3.3164 and begins at 0.5527.
        let [viscous, coulomb] = model(0.8).friction_line(0).unwrap().expect("a line");
        assert!(
            (viscous.value - 3.3164).abs() < 1e-3
                && (viscous.sigma - 0.1 * 3.3164 / 4.0).abs() < 1e-4,
            "{viscous:?}"
        );
        let sigma = f64::hypot(0.2, 0.1 * 0.5527 / 4.0);
        assert!(
            (coulomb.value - 1.5527).abs() < 1e-3 && (coulomb.sigma - sigma).abs() < 1e-4,
            "{coulomb:?}"
        );
        assert_eq!(model(1.0).friction_line(0).unwrap(), None);
    }
}
