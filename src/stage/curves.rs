//! Findings as curves, from the corrected model: each effect is taken out once, and what the residual then shows is put over the
//! quantity that reveals it. A joint's effect is shown as an angle about the joint (residual along its motion over its lever), all
//! others as millimetres along their own displacement.

use crate::effect::{Effect, Form, Place, PointMotion, Variable};
use crate::error::{Error, Result};
use crate::estimate::Model;
use crate::table::{CurveRow, Curves, FindingRow, Findings, Parameters, Prediction, Recording};
use crate::units::Unit;
use calib_numerics::robot::{Measurements, RobotModel};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use std::collections::BTreeMap;

/// m: a joint whose lever is shorter turns the point too little to be seen.
const LEVER: f64 = 0.05;

/// Share of the largest displacement below which a row's own direction is noise.
const SMALL: f64 = 0.05;

/// The curves of all findings that a model has; `prediction` is that of the same step.
pub(super) fn curves(
    findings: &Findings,
    parameters: &Parameters,
    model: &Model,
    recording: &Recording,
    data: &Measurements,
    prediction: &Prediction,
) -> Result<Curves> {
    let specs = model.stack.specs();
    let named = sigmas(parameters);
    let sigma = specs
        .iter()
        .map(|spec| named.get(spec.name.as_str()).copied());
    let sigma: Vec<Option<f64>> = sigma.collect();
    let shown = 0..data.rows().min(prediction.0.len());
    let shown = shown.filter(|row| !prediction.0[*row].suspect);
    let whole = model.predict(data);
    let mut traced = Vec::new();
    for finding in &findings.0 {
        let forms = forms(finding)?;
        // A finding's forms are its identity: what it is called need not be any of theirs. A cause of the whole arm has none.
        let is_of_finding = |effect: &dyn Effect, k: usize| match effect.form() {
            Some(form) => forms.contains(form),
            None => {
                forms.is_empty()
                    && effect.name() == finding.effect
                    && specs[k].place.to_string() == finding.place
            }
        };
        let effects = model.stack.effects();
        let of_finding: Vec<usize> = effects
            .flat_map(|(effect, range)| range.filter(move |k| is_of_finding(effect, *k)))
            .collect();
        if !of_finding.is_empty() {
            let points = (data, &whole[..]);
            traced.push(TracedFinding::of(finding, forms, of_finding, model, points));
        }
    }
    // All derivatives of a row come at once: each row is placed once for all findings.
    let mut rows: Vec<Vec<CurveRow>> = vec![Vec::new(); traced.len()];
    let mut scratch = model.stack.scratch(&model.robot);
    let mut derivatives = vec![Vector3::zeros(); specs.len()];
    for row in shown {
        // A curve is drawn along the displacement of a point.
        let Some(measured) = data.point(row) else {
            continue;
        };
        derivatives.fill(Vector3::zeros());
        model.stack.derivatives(
            &model.robot,
            data,
            row,
            &model.x,
            &mut scratch,
            |k, derivative| derivatives[k] += derivative,
        );
        let motion = model
            .stack
            .point_motion(&model.robot, data, row, &model.x, &mut scratch);
        let residual = measured - whole[row];
        for (finding, out) in traced.iter().zip(&mut rows) {
            let Some((direction, scale)) = finding.direction(row, &motion, model) else {
                continue;
            };
            let along = |v: &Vector3<f64>| direction.dot(v) * scale;
            let variance: Option<f64> = (finding.parameters.iter())
                .map(|k| Some((sigma[*k]? * along(&derivatives[*k])).powi(2)))
                .sum();
            let (over, x_unit, x) = abscissa(
                (&finding.forms, finding.joint),
                data,
                row,
                &motion.posture.torque,
                &model.robot,
            );
            let fitted = along(&finding.shift[row]);
            out.push(CurveRow {
                rank: finding.rank,
                sequence: recording.sequence[row],
                over,
                x_unit: x_unit.map_or(ROW, Unit::symbol).into(),
                x: x_unit.map_or(x, |unit| unit.from_si(x)),
                unit: ["mm", "rad"][usize::from(finding.turns(model))].into(),
                without: along(&residual) + fitted,
                with: along(&residual),
                fitted,
                band: variance.map(f64::sqrt).filter(|band| band.is_finite()),
                held_out: prediction.0[row].held_out,
            });
        }
    }
    Ok(Curves(rows.into_iter().flatten().collect()))
}

/// A finding that the model has, and what it does to every row.
struct TracedFinding {
    rank: i64,
    forms: Vec<Form>,
    /// Positions of its parameters in the stack.
    parameters: Vec<usize>,
    /// The joint at which it acts.
    joint: Option<usize>,
    /// What it moves the point of every row by, m.
    shift: Vec<Vector3<f64>>,
    /// The direction of most of that, and the largest, m.
    principal: Vector3<f64>,
    largest: f64,
}

impl TracedFinding {
    fn of(
        finding: &FindingRow,
        forms: Vec<Form>,
        parameters: Vec<usize>,
        model: &Model,
        (data, whole): (&Measurements, &[Vector3<f64>]),
    ) -> Self {
        let mut without = model.clone();
        parameters.iter().for_each(|k| without.x[*k] = 0.0);
        let bare = without.predict(data);
        let shift: Vec<Vector3<f64>> = whole.iter().zip(&bare).map(|(a, b)| a - b).collect();
        let place = forms.first().map(|form| form.place());
        let place = place.unwrap_or(model.stack.specs()[parameters[0]].place);
        let joint = match place {
            Place::Joint(joint) if joint < data.joints => Some(joint),
            _ => None,
        };
        let largest = shift.iter().map(Vector3::norm).fold(0.0, f64::max);
        Self {
            rank: finding.rank,
            principal: principal(&shift),
            forms,
            parameters,
            joint,
            shift,
            largest,
        }
    }

    /// Whether it is shown as an angle about its joint.
    fn turns(&self, model: &Model) -> bool {
        let joint = self.joint;
        joint.is_some_and(|joint| model.robot.is_revolute(joint))
    }

    /// The direction along which a row shows it, and the factor to the column's unit: rad about the joint, or mm. None where the joint
    /// turns the point too little to be seen.
    fn direction(
        &self,
        row: usize,
        motion: &PointMotion,
        model: &Model,
    ) -> Option<(Vector3<f64>, f64)> {
        if let Some(joint) = self.joint.filter(|_| self.turns(model)) {
            let lever = motion.by_joint[joint];
            return (lever.norm() > LEVER).then(|| (lever / lever.norm_squared(), 1.0));
        }
        let shift = self.shift[row];
        match shift.norm() > SMALL * self.largest {
            true => Some((shift.normalize(), 1e3)),
            false => Some((self.principal, 1e3)),
        }
    }
}

/// One standard deviation (SI) of the parameters that have one, by name.
fn sigmas(parameters: &Parameters) -> BTreeMap<&str, f64> {
    let rows = parameters.0.iter();
    let known =
        rows.filter_map(|row| Some((&*row.name, Unit::parse(&row.unit)?.to_si(row.sigma?))));
    known.collect()
}

/// What counts time where the recording has no clock.
const ROW: &str = "row";

/// The forms of a finding. Fails where they cannot be read.
fn forms(finding: &FindingRow) -> Result<Vec<Form>> {
    serde_json::from_str(&finding.forms).map_err(|error| {
        let message = format!("`{}` are no forms of effects: {error}", finding.forms);
        Error::data("table findings", message)
    })
}

/// What reveals the effect of these forms at this joint, its stored unit (none: a row's number, from 1), and its value in SI.
fn abscissa(
    (forms, joint): (&[Form], Option<usize>),
    data: &Measurements,
    row: usize,
    torque: &[f64],
    robot: &RobotModel,
) -> (String, Option<Unit>, f64) {
    let with = |over: String, unit, x| (over, Some(unit), x);
    let time = || match data.has_clock() {
        true => with("time".into(), Unit::Second, data.time(row)),
        false => ("place in the recording".to_string(), None, row as f64 + 1.0),
    };
    let position = |joint: usize| {
        let unit = match robot.is_revolute(joint) {
            true => Unit::Radian,
            false => Unit::Millimetre,
        };
        with(format!("joint {}", joint + 1), unit, data.q(row)[joint])
    };
    let load = |joint: usize| {
        let over = format!("load torque of joint {}", joint + 1);
        with(over, Unit::NewtonMetre, torque[joint])
    };
    let variables: Vec<Variable> = forms.iter().flat_map(|form| form.variables()).collect();
    let angle = joint.map(|joint| Variable::Angle { joint });
    match angle
        .filter(|angle| variables.contains(angle))
        .or(variables.first().copied())
        .or(angle)
    {
        Some(Variable::Time) => time(),
        Some(Variable::Temperature | Variable::Lagging { .. }) => match data.temperature(row) {
            Some(now) => with("temperature".into(), Unit::Celsius, now),
            None => time(),
        },
        Some(Variable::Payload) => with("payload".into(), Unit::Kilogram, data.payload[row]),
        Some(Variable::Load { joint }) => load(joint),
        Some(
            Variable::Angle { joint }
            | Variable::Motor { joint }
            | Variable::Approach { joint }
            | Variable::Move { joint }
            | Variable::Push { joint, .. }
            | Variable::Velocity { joint }
            | Variable::Slip { joint, .. }
            | Variable::Stretch { joint, .. }
            | Variable::Recent { joint, .. }
            | Variable::Work { joint, .. },
        ) => position(joint),
        // Links and the base bend with the load of the shoulder.
        _ if torque.len() > 1 => load(1),
        _ => time(),
    }
}

/// The direction in which most of the displacement lies.
fn principal(shift: &[Vector3<f64>]) -> Vector3<f64> {
    let sum: Matrix3<f64> = shift.iter().map(|v| v * v.transpose()).sum();
    let eigen = SymmetricEigen::new(sum);
    let direction: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into();
    let sense: f64 = shift.iter().map(|v| v.dot(&direction)).sum();
    if sense < 0.0 { -direction } else { direction }
}
