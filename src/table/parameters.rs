//! The identified model: every parameter by name, with its status.

use super::prediction::joined;
use super::{CovarianceRow, CovarianceTable, ParameterRow, Parameters};
use crate::effect::{
    AnchorShift, Effect, EffectContext, EffectStack, Form, Load, ParameterSpec, ToolOffset,
    arm_effect, identified, names,
};
use crate::error::{Error, Result};
use crate::estimate::{
    CONFLICT, Covariance, Determined, Fitted, Model, ParameterStatus, PriorCheck, beyond_tolerance,
};
use crate::spatial::Pose;
use crate::units::Unit;
use calib_numerics::robot::{Anchor, MeasurementSetup, RobotModel, Shape, Target};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// Pairs more correlated than this are worth a word: neither is known well alone.
const CORRELATED: f64 = 0.9;
/// The same of those of which one is not determined.
const CONFOUNDED: f64 = 0.5;

/// What parameters correct.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Corrected {
    /// The arm of the robot file.
    RobotFile,
    /// What stood in `sim_x`, `sim_y`, `sim_z`.
    OutsideSimulation,
}

impl Corrected {
    /// As the column holds what does not correct the robot file.
    const OUTSIDE: &str = "outside_simulation";
    /// What people read of it.
    const REMARK: &str = "corrects the outside simulation, not the robot file's model";
}

/// Data that know a parameter this many times worse than its prior add nothing to it: half a per cent of the sigma.
const SILENT: f64 = 10.0;

fn read_form(text: &str) -> Result<Form> {
    serde_json::from_str(text).map_err(|error| {
        Error::data(
            "table parameters",
            format!("`{text}` is no form of an effect: {error}; where an earlier calib wrote it, run its pipeline again"),
        )
    })
}

impl Parameters {
    /// The whole model after a fit. Rows of parameters that the fit kept are taken over from `earlier`.
    pub fn of(
        step: &str,
        model: &Model,
        fitted: &Fitted,
        held: &[usize],
        earlier: Option<&Parameters>,
    ) -> Self {
        let specs = model.stack.specs();
        let mut rows = Vec::with_capacity(specs.len());
        for (effect, range) in model.stack.effects() {
            let form = effect
                .form()
                .map(|form| serde_json::to_string(form).expect("numbers and names serialise"));
            for k in range.clone() {
                let spec = &specs[k];
                let before =
                    earlier.and_then(|table| table.0.iter().find(|row| row.name == spec.name));
                if let (ParameterStatus::Kept, Some(before)) = (&fitted.statuses[k], before) {
                    let status = if before.status == "free" {
                        "earlier".to_string()
                    } else {
                        before.status.clone()
                    };
                    rows.push(ParameterRow {
                        status,
                        ..before.clone()
                    });
                    continue;
                }
                let (nominal, value) = model.standing(k);
                let determined = fitted.determined(model, k);
                let tolerance = determined.map(|_| model.prior(k).sigma);
                let (status, sigma, remark) = match &fitted.statuses[k] {
                    ParameterStatus::Free(sigma) => {
                        let closest = fitted
                            .covariance
                            .as_ref()
                            .and_then(|covariance| covariance.closest(k));
                        let is_open = determined != Some(Determined::Determined);
                        let least = if is_open { CONFOUNDED } else { CORRELATED };
                        let pair = closest.filter(|(_, correlation)| correlation.abs() > least);
                        let pair = pair.map(|(other, c)| {
                            format!("moves with {} (correlation {c:+.2})", specs[other].name)
                        });
                        let of_prior = fitted
                            .prior_checks
                            .get(&k)
                            .and_then(|check| against_prior(check, spec.unit));
                        let beyond = beyond_tolerance(model, k)
                            .map(|times| format!("{times:.1} times its tolerance"));
                        (
                            "free",
                            Some(spec.unit.from_si(*sigma)),
                            joined([of_prior, beyond, pair]),
                        )
                    }
                    ParameterStatus::Bound(wanted) => {
                        let end = if *wanted > model.x[k] {
                            "upper"
                        } else {
                            "lower"
                        };
                        let wanted = spec.unit.from_si(*wanted);
                        (
                            "bound",
                            None,
                            Some(format!(
                                "stopped by its {end} bound; the data would have it at {wanted:.4e}"
                            )),
                        )
                    }
                    ParameterStatus::Kept if held.contains(&k) => (
                        "held",
                        None,
                        Some("held at nominal by the pipeline".to_string()),
                    ),
                    ParameterStatus::Kept => ("held", None, None),
                };
                let (nominal, value) = (spec.unit.from_si(nominal), spec.unit.from_si(value));
                rows.push(ParameterRow {
                    name: spec.name.clone(),
                    effect: effect.name().into(),
                    place: spec.place.to_string(),
                    unit: spec.unit.symbol().into(),
                    nominal,
                    value,
                    change: value - nominal,
                    sigma: sigma.filter(|sigma| sigma.is_finite()),
                    status: status.into(),
                    tolerance: tolerance.map(|tolerance| spec.unit.from_si(tolerance)),
                    determined: determined.map(|known| known.name().into()),
                    step: step.into(),
                    remark,
                    form: form.clone(),
                    ..ParameterRow::default()
                });
            }
        }
        Self(rows).of_robot(model.robot.description())
    }

    /// The same with what would show a parameter (by name) added to its remark.
    pub fn with_advice(mut self, advice: &BTreeMap<String, String>) -> Self {
        for row in &mut self.0 {
            row.remark = joined([row.remark.take(), advice.get(&row.name).cloned()]);
        }
        self
    }

    /// The same, with what they correct, which their remarks tell people.
    pub fn correcting(mut self, corrected: Corrected) -> Self {
        if corrected == Corrected::OutsideSimulation {
            for row in &mut self.0 {
                row.corrects = Some(Corrected::OUTSIDE.into());
                row.remark = joined([Some(Corrected::REMARK.into()), row.remark.take()]);
            }
        }
        self
    }

    /// What these correct: of an outside simulation they say nothing of the robot file's model.
    pub fn corrected(&self) -> Corrected {
        // Tables before version 1.2 say it in their remarks alone, and must not correct commands.
        let is_stated = |row: &ParameterRow| {
            row.remark
                .as_deref()
                .is_some_and(|remark| remark.starts_with(Corrected::REMARK))
        };
        let outside = self
            .0
            .iter()
            .any(|row| row.corrects.as_deref() == Some(Corrected::OUTSIDE) || is_stated(row));
        if outside {
            Corrected::OutsideSimulation
        } else {
            Corrected::RobotFile
        }
    }

    /// The effects of the whole arm in this model, in the registry's order.
    pub fn effects(&self) -> Vec<&'static str> {
        let has = |name: &&str| {
            self.0
                .iter()
                .any(|row| row.effect == *name && row.form.is_none())
        };
        identified().map(|cause| cause.name()).filter(has).collect()
    }

    /// Effects at a place, in the order of their parameters. Fails where a form cannot be read.
    fn forms(&self) -> Result<Vec<Form>> {
        let texts: BTreeSet<&str> = self
            .0
            .iter()
            .filter_map(|row| row.form.as_deref())
            .collect();
        texts.into_iter().map(read_form).collect()
    }

    /// The model that these parameters make of `robot`, with all effects that a diagnosis added, and `more` effects of the whole arm
    /// at zero. Fails where a row names an unknown effect or parameter, or the table is the model of another robot.
    pub fn model(&self, robot: RobotModel, more: &[&str], load: Load) -> Result<Model> {
        self.model_standing(self.base_pose(), robot, more, load)
    }

    /// What belongs to the arm and not to the measurement by which it was identified. Fails where a form cannot be read.
    pub fn of_the_arm(&self) -> Result<Self> {
        let mut rows = Vec::with_capacity(self.0.len());
        for row in &self.0 {
            let form = row.form.as_deref().map(read_form).transpose()?;
            if !form.is_some_and(|form| form.is_of_the_measurement()) {
                rows.push(row.clone());
            }
        }
        Ok(Self(rows))
    }

    /// [`Parameters::model`] of a robot whose base stands elsewhere.
    pub fn model_standing(
        &self,
        base: Pose,
        robot: RobotModel,
        more: &[&str],
        load: Load,
    ) -> Result<Model> {
        self.must_be_of(robot.description())?;
        // Factors per ampere and per newton metre are different parameters of one name: the table's unit decides.
        let compliance = self
            .0
            .iter()
            .find(|row| row.effect == names::JOINT_COMPLIANCE && row.form.is_none());
        let load = compliance
            .and_then(|row| Load::of_compliance(Unit::parse(&row.unit)?))
            .unwrap_or(load);
        let robot = self.with_setup(robot);
        let setting = EffectContext { base, load };
        let names = identified().map(|cause| cause.name());
        let chosen: Vec<&str> = names
            .filter(|name| self.effects().contains(name) || more.contains(name))
            .collect();
        let whole = chosen.iter().filter_map(|name| arm_effect(name, &setting));
        let placed = self
            .forms()?
            .into_iter()
            .map(|form| Box::new(form) as Box<dyn Effect>);
        let effects = whole.chain(placed).collect();
        let mut model = Model::nominal(robot.clone(), EffectStack::new(&robot, base, effects));
        let targets = !robot.setup().targets.is_empty();
        // Where these stand is their start: nothing is left to correct.
        let stands = |row: &ParameterRow| match row.effect.as_str() {
            names::BASE_FRAME | names::ANCHOR => true,
            effect => targets && effect == names::TOOL_OFFSET,
        };
        for row in self.0.iter().filter(|row| !stands(row)) {
            let position = model
                .stack
                .specs()
                .iter()
                .position(|spec| spec.name == row.name);
            let (Some(k), Some(unit)) = (position, Unit::parse(&row.unit)) else {
                return Err(Error::data(
                    "table parameters",
                    format!(
                        "`{}` in {} is no parameter of this robot",
                        row.name, row.unit
                    ),
                ));
            };
            model.x[k] = unit.to_si(row.value);
        }
        Ok(model)
    }

    /// The robot with the targets and anchors that the parameters place.
    fn with_setup(&self, robot: RobotModel) -> RobotModel {
        let home = *robot.home();
        let anchors = self
            .placed(names::ANCHOR)
            .into_iter()
            .map(|(name, stand)| self.anchor(name, &stand));
        let mut setup = MeasurementSetup {
            targets: Vec::new(),
            anchors: anchors.collect(),
        };
        let turned = |name: &str| {
            let rx = format!("{}rx", ToolOffset::prefix(name));
            self.0.iter().any(|row| row.name == rx)
        };
        let targets = self.placed(names::TOOL_OFFSET);
        if targets.keys().any(|name| !name.is_empty()) || turned("") {
            let target = |(name, stand): (String, Pose)| Target {
                mounting: Pose::new(
                    stand.rotation * home.rotation,
                    stand.translation + home.translation,
                ),
                oriented: turned(&name),
                name,
            };
            setup.targets = targets.into_iter().map(target).collect();
        }
        robot.measured_by(setup)
    }

    /// An anchor by its name, and where it stands: with a radius a sphere, with an offset a plane.
    fn anchor(&self, name: String, stand: &Pose) -> Anchor {
        let of_ending = |ending: &str| {
            let full = format!("{}{ending}", AnchorShift::prefix(&name));
            self.0
                .iter()
                .find(|row| row.name == full)
                .map(|row| Unit::Millimetre.to_si(row.value))
        };
        let (place, shape) = match (of_ending("offset"), of_ending("radius")) {
            (Some(offset), _) => {
                let turned = stand.rotation_vector();
                let normal = Anchor::normal([turned.x, turned.y]);
                (normal * offset, Shape::Plane(normal))
            }
            (None, Some(radius)) => (stand.translation, Shape::Sphere(radius)),
            (None, None) => (stand.translation, Shape::Point),
        };
        Anchor { name, place, shape }
    }

    /// Named things of an effect with their translation and rotation vector.
    fn placed(&self, effect: &str) -> BTreeMap<String, Pose> {
        let mut parts: BTreeMap<String, [f64; 6]> = BTreeMap::new();
        for row in self.0.iter().filter(|row| row.effect == effect) {
            let suffix = row.name.strip_prefix(effect).unwrap_or_default();
            let (name, axis) = suffix.rsplit_once('.').unwrap_or_default();
            let axis = ["x", "y", "z", "rx", "ry", "rz"]
                .iter()
                .position(|known| *known == axis);
            if let (Some(axis), Some(unit)) = (axis, Unit::parse(&row.unit)) {
                parts
                    .entry(name.trim_start_matches('.').into())
                    .or_default()[axis] = unit.to_si(row.value);
            }
        }
        let pose = |[x, y, z, rx, ry, rz]: [f64; 6]| {
            Pose::from_rotation_vector(Vector3::new(rx, ry, rz), Vector3::new(x, y, z))
        };
        parts
            .into_iter()
            .map(|(name, part)| (name, pose(part)))
            .collect()
    }

    /// The same of a robot whose base stands elsewhere in the tracker's frame.
    pub fn standing_at(mut self, base: &Pose) -> Self {
        let (translation, rotation) = (base.translation, base.rotation_vector());
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            for (ending, value, unit) in [
                ("", translation[axis], Unit::Millimetre),
                ("r", rotation[axis], Unit::Radian),
            ] {
                let name = format!("{}.{ending}{name}", names::BASE_FRAME);
                self.0
                    .iter_mut()
                    .filter(|row| row.name == name)
                    .for_each(|row| row.value = unit.from_si(value));
            }
        }
        self
    }

    /// Where the base stands in the tracker's frame; the identity without `base_frame`.
    pub fn base_pose(&self) -> Pose {
        let value = |axis: &str, unit: Unit| {
            let name = format!("{}.{axis}", names::BASE_FRAME);
            self.0
                .iter()
                .find(|row| row.name == name)
                .map_or(0.0, |row| unit.to_si(row.value))
        };
        let translation = ["x", "y", "z"].map(|axis| value(axis, Unit::Millimetre));
        let rotation = ["rx", "ry", "rz"].map(|axis| value(axis, Unit::Radian));
        Pose::from_rotation_vector(Vector3::from(rotation), Vector3::from(translation))
    }
}

/// What a prior did to a parameter, where that is worth a word.
fn against_prior(check: &PriorCheck, unit: Unit) -> Option<String> {
    match check.without {
        Some((without, sigma)) if check.conflict > CONFLICT => {
            let [mean, prior, without, sigma] =
                [check.prior.mean, check.prior.sigma, without, sigma]
                    .map(|value| unit.from_si(value));
            let apart = check.conflict;
            Some(format!(
                "prior {mean:.4e} +- {prior:.1e} and data {without:.4e} +- {sigma:.1e} contradict each other ({apart:.1} sigma)"
            ))
        }
        Some((_, sigma)) if sigma < SILENT * check.prior.sigma => {
            let [mean, prior] =
                [check.prior.mean, check.prior.sigma].map(|value| unit.from_si(value));
            Some(format!("prior {mean} +- {prior}"))
        }
        _ => Some("known from its prior alone: the data add nothing".into()),
    }
}

impl CovarianceTable {
    /// The covariance of a fit. Parameters that it kept are taken over from `earlier`: what was estimated on top is held to be independent.
    pub fn of(model: &Model, fitted: &Fitted, earlier: Option<&Self>) -> Self {
        let specs = model.stack.specs();
        let pairs = fitted
            .covariance
            .iter()
            .flat_map(|covariance| covariance.pairs());
        let mut rows: Vec<CovarianceRow> = pairs
            .map(|(a, b, value, correlation)| row(&specs[a], &specs[b], value, correlation))
            .collect();
        let new: BTreeSet<String> = rows.iter().map(|row| row.parameter.clone()).collect();
        let known: BTreeSet<&str> = specs.iter().map(|spec| spec.name.as_str()).collect();
        let kept = |name: &String| known.contains(name.as_str()) && !new.contains(name);
        let before = earlier.iter().flat_map(|table| &table.0);
        rows.extend(
            before
                .filter(|row| kept(&row.parameter) && kept(&row.other))
                .cloned(),
        );
        Self(rows)
    }

    /// The covariance of the parameters of `model`, SI; `None` where the table is empty, or says nothing of one of its own.
    pub fn of_model(&self, model: &Model) -> Option<Covariance> {
        let specs = model.stack.specs();
        let position: BTreeMap<&str, usize> = specs
            .iter()
            .enumerate()
            .map(|(k, spec)| (spec.name.as_str(), k))
            .collect();
        let mut values = BTreeMap::new();
        for row in &self.0 {
            let (a, b) = (
                *position.get(row.parameter.as_str())?,
                *position.get(row.other.as_str())?,
            );
            values.insert(
                (a.min(b), a.max(b)),
                row.covariance * specs[a].unit.to_si(1.0) * specs[b].unit.to_si(1.0),
            );
        }
        Covariance::of_pairs(&values)
    }
}

fn row(a: &ParameterSpec, b: &ParameterSpec, value: f64, correlation: f64) -> CovarianceRow {
    let (a, b) = if a.name <= b.name { (a, b) } else { (b, a) };
    CovarianceRow {
        parameter: a.name.clone(),
        other: b.name.clone(),
        covariance: a.unit.from_si(1.0) * b.unit.from_si(1.0) * value,
        unit: format!("{} {}", a.unit.symbol(), b.unit.symbol()),
        correlation,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_corrected_is_a_column_and_what_older_tables_say_first() {
        let row = |remark: Option<&str>| ParameterRow {
            name: "joint_offset.j2".into(),
            effect: "joint_offset".into(),
            place: "joint 2".into(),
            unit: "rad".into(),
            nominal: 0.0,
            value: 1e-3,
            change: 1e-3,
            sigma: Some(1e-5),
            status: "free".into(),
            step: "diagnose".into(),
            remark: remark.map(String::from),
            ..ParameterRow::default()
        };
        let advice = BTreeMap::from([("joint_offset.j2".to_string(), "measure more".to_string())]);
        for remark in [None, Some("moves with another")] {
            let bare = Parameters(vec![row(remark)]);
            assert_eq!(bare.corrected(), Corrected::RobotFile);
            assert_eq!(bare.clone().correcting(Corrected::RobotFile), bare);
            let outside = bare.correcting(Corrected::OutsideSimulation);
            assert_eq!(
                outside.with_advice(&advice).corrected(),
                Corrected::OutsideSimulation
            );
        }
        let mentioned = format!("not so: {}", Corrected::REMARK);
        assert_eq!(
            Parameters(vec![row(Some(&mentioned))]).corrected(),
            Corrected::RobotFile
        );
        assert_eq!(
            Parameters(vec![row(Some(Corrected::REMARK))]).corrected(),
            Corrected::OutsideSimulation
        );
    }
}
