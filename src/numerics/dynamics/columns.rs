//! Judged rows of the base and of every form, filtered and decimated alike.

use super::arm::INERTIAL_NUMBERS;
use super::cause::{TORQUE_CAUSES, TorqueForm};
use super::reduce::{ReducedRegressor, Reduction, TorqueColumn};
use super::scene::{DynamicScene, largest};
use crate::criteria::torque::FRICTION;
use crate::reduce::base_parameters;

/// Base columns, then those of all forms, form after form.
pub(super) struct TorqueColumns {
    pub(crate) columns: Vec<TorqueColumn>,
    /// Number of base columns.
    pub(crate) base: usize,
    /// Link and change of its numbers per coefficient of the base.
    pub(crate) base_changes: Vec<(usize, [f64; INERTIAL_NUMBERS])>,
    /// 1 / variance beforehand of each coefficient.
    pub(crate) prior: Vec<f64>,
    pub(crate) forms: Vec<TorqueForm>,
    /// Forms that causes list; later ones are trials of a refinement.
    pub(crate) listed: usize,
    /// First column of each form.
    first: Vec<usize>,
    /// Nm, half the range of each joint's torque.
    torque: Vec<f64>,
}

/// 1 / variance, over the squared size of its column, of a coefficient of which nothing is known.
const UNKNOWN_BEFOREHAND: f64 = 1e-9;

impl TorqueColumns {
    /// None.
    pub(crate) fn empty() -> Self {
        Self {
            columns: Vec::new(),
            base: 0,
            base_changes: Vec::new(),
            prior: Vec::new(),
            forms: Vec::new(),
            listed: 0,
            first: Vec::new(),
            torque: Vec::new(),
        }
    }

    /// The base, and all forms of all causes but `without`; `torque` is half the range of each joint's torque, Nm.
    pub(crate) fn new(
        scene: &DynamicScene,
        reduction: &Reduction,
        regressor: &ReducedRegressor,
        without: &[String],
        torque: Vec<f64>,
    ) -> Self {
        let (base_changes, columns, prior) = base_columns(scene, regressor);
        let mut all = Self {
            base: columns.len(),
            base_changes,
            columns,
            prior,
            torque,
            ..Self::empty()
        };
        let causes = TORQUE_CAUSES
            .iter()
            .filter(|cause| without.iter().all(|name| name != cause.name));
        for form in causes.flat_map(|cause| (cause.forms)(cause, scene)) {
            all.push(form, scene, reduction, regressor);
        }
        all.listed = all.forms.len();
        all
    }

    /// Takes another form; its number.
    pub(crate) fn push(
        &mut self,
        form: TorqueForm,
        scene: &DynamicScene,
        reduction: &Reduction,
        regressor: &ReducedRegressor,
    ) -> usize {
        let known = self.forms.iter().position(|known| {
            form.cause.alike_at_joints
                && known.cause.name == form.cause.name
                && known.with == form.with
        });
        let columns = match known {
            Some(known) => {
                let here = |column: &TorqueColumn| TorqueColumn {
                    joints: vec![form.joint()],
                    ..column.clone()
                };
                self.columns[self.of(known)].iter().map(here).collect()
            }
            None => columns_of(&form, scene, reduction, regressor),
        };
        self.take(form, columns)
    }

    /// Takes a form with its columns; its number.
    pub(crate) fn take(&mut self, form: TorqueForm, columns: Vec<TorqueColumn>) -> usize {
        self.first.push(self.columns.len());
        self.prior.resize(self.columns.len(), 0.0);
        let prior: Vec<f64> = columns
            .iter()
            .map(|column| self.friction_prior(&form, column))
            .collect();
        self.prior.extend(prior);
        self.columns.extend(columns);
        self.forms.push(form);
        self.forms.len() - 1
    }

    /// 1 / variance beforehand of a coefficient: a law of friction alone is hardly more than the whole torque of its joint, so that two of them
    /// do not cancel each other.
    fn friction_prior(&self, form: &TorqueForm, column: &TorqueColumn) -> f64 {
        let about = form.cause;
        let Some(most) = self
            .torque
            .get(form.joint())
            .filter(|_| about.of_sign || about.brakes)
        else {
            return 0.0;
        };
        (largest(column.courses.iter().flatten()) / (*FRICTION * most).max(f64::MIN_POSITIVE))
            .powi(2)
    }

    /// Columns of forms that are made of the rigid torque, anew.
    pub(crate) fn renew(
        &mut self,
        scene: &DynamicScene,
        reduction: &Reduction,
        regressor: &ReducedRegressor,
    ) {
        for number in 0..self.forms.len() {
            if self.forms[number].cause.of_rigid {
                let fresh = columns_of(&self.forms[number], scene, reduction, regressor);
                let range = self.of(number);
                self.columns[range].clone_from_slice(&fresh);
            }
        }
    }

    /// Columns of some forms that are made of the sign of a velocity, anew.
    pub(crate) fn renew_signs(
        &mut self,
        forms: &[usize],
        scene: &DynamicScene,
        reduction: &Reduction,
        regressor: &ReducedRegressor,
    ) {
        for number in forms
            .iter()
            .copied()
            .filter(|number| self.forms[*number].cause.of_sign)
            .collect::<Vec<_>>()
        {
            let fresh = columns_of(&self.forms[number], scene, reduction, regressor);
            let range = self.of(number);
            self.columns[range].clone_from_slice(&fresh);
        }
    }

    /// Takes a column of no form; its number.
    pub(crate) fn push_bare(&mut self, column: TorqueColumn) -> usize {
        self.columns.push(column);
        self.prior.resize(self.columns.len(), 0.0);
        self.columns.len() - 1
    }

    /// Rms of a column over half the range of the torque, over the joints that it acts on.
    pub(crate) fn size(&self, column: usize) -> f64 {
        let range = |joint: usize| self.torque.get(joint).copied().unwrap_or(1.0);
        self.rms(column, |joint| range(joint).max(f64::MIN_POSITIVE))
    }

    /// Rms of a column, Nm per unit of its coefficient, over the joints that it acts on.
    pub(crate) fn newton_metres(&self, column: usize) -> f64 {
        self.rms(column, |_| 1.0)
    }

    fn rms(&self, column: usize, unit: impl Fn(usize) -> f64) -> f64 {
        let torque_column = &self.columns[column];
        let of_joint = |(joint, course): (&usize, &Vec<f64>)| {
            let unit = unit(*joint);
            course
                .iter()
                .map(|value| (value / unit).powi(2))
                .sum::<f64>()
                / course.len().max(1) as f64
        };
        let squares = torque_column
            .joints
            .iter()
            .zip(&torque_column.courses)
            .map(of_joint);
        (squares.sum::<f64>() / torque_column.joints.len().max(1) as f64).sqrt()
    }

    /// Columns of a form.
    pub(crate) fn of(&self, form: usize) -> std::ops::Range<usize> {
        self.first[form]..self.first[form] + self.forms[form].width
    }
}

/// A form's columns.
fn columns_of(
    form: &TorqueForm,
    scene: &DynamicScene,
    reduction: &Reduction,
    regressor: &ReducedRegressor,
) -> Vec<TorqueColumn> {
    if let Some(changes) = scene
        .declared
        .as_ref()
        .and_then(|declared| form.cause.inertial(form, declared))
    {
        return changes
            .iter()
            .map(|(link, ten)| regressor.column(*link, ten))
            .collect();
    }
    let joints = form.acts_on(scene.joints());
    let written = |(number, joint): (usize, usize)| {
        let mut whole = vec![0.0; scene.rows()];
        form.write(scene, joint, number, &mut whole);
        whole
    };
    let places =
        (0..form.width).flat_map(|number| joints.iter().map(move |joint| (number, *joint)));
    let mut courses = reduction.reduce(places.map(written).collect()).into_iter();
    let column = |_| TorqueColumn {
        courses: courses.by_ref().take(joints.len()).collect(),
        joints: joints.clone(),
    };
    (0..form.width).map(column).collect()
}

/// Changes of links' numbers with their columns and 1 / variance beforehand.
type Base = (
    Vec<(usize, [f64; INERTIAL_NUMBERS])>,
    Vec<TorqueColumn>,
    Vec<f64>,
);

/// One standard deviation of each declared number, or the base parameters where none are declared.
fn base_columns(scene: &DynamicScene, regressor: &ReducedRegressor) -> Base {
    let unit = |number: usize| {
        std::array::from_fn(|entry| f64::from(u8::from(entry == number % INERTIAL_NUMBERS)))
    };
    let changes: Vec<(usize, [f64; INERTIAL_NUMBERS])> = match &scene.declared {
        Some(declared) => declared
            .tolerance
            .iter()
            .enumerate()
            .flat_map(|(link, all)| all.iter().map(move |ten| (link, *ten)))
            .collect(),
        None => base_parameters(regressor)
            .into_iter()
            .map(|number| (number / INERTIAL_NUMBERS, unit(number)))
            .collect(),
    };
    let columns: Vec<TorqueColumn> = changes
        .iter()
        .map(|(link, ten)| regressor.column(*link, ten))
        .collect();
    let square = |column: &TorqueColumn| {
        column
            .courses
            .iter()
            .flatten()
            .map(|value| value * value)
            .sum::<f64>()
    };
    let of_column = |column: &TorqueColumn| {
        if scene.declared.is_some() {
            1.0
        } else {
            UNKNOWN_BEFOREHAND * square(column)
        }
    };
    let prior = columns.iter().map(of_column).collect();
    (changes, columns, prior)
}
