//! Identification from the nominal robot: base, tool, geometry, transmission and, if wanted, compliance in one estimation.
//!
//! Sec. 3 of the paper, iterated to convergence on the full model (Eqs. 14-23 with errata).
//!
//! Joint stiffness on top of an identified geometry, which is kept: the second step of the paper's sequence (Sec. 4, Eqs. 24-30).

use crate::doubtful::numbered;
use crate::effect::{Effect, EffectContext, EffectStack, arm_effect, identified, names};
use crate::error::{Error, Place, Result, instead, listed};
use crate::estimate::{
    Fitted, Model, ParameterStatus, Session, determined_directions, fit, gauge, known_places,
    placed_by_left_out,
};
use crate::identified::{Fitting, Identified, LoadSetting, RowsToFit};
use crate::known_cell::{self, KnownCell, KnownDistance, KnownPoint, KnownSphere};
use crate::observation;
use crate::remarks::{must_move, unmoved_remark, weightless_links};
use crate::spatial::Pose;
use crate::table::{CovarianceTable, Parameters, Prediction, Recording, Robot, Split};
use crate::{Context, Stage, contact};
use calib_diagnose::{Question, wrong_setup};
use calib_numerics::robot::{Measurements, RobotModel};
use nalgebra::Vector3;
use std::collections::BTreeMap;

crate::identified::identification! {
    /// Settings of `identify`.
    pub struct Identify {
        /// Sets of the split to fit.
        #[serde(default = "crate::fit_set")]
        pub on: Vec<String>,
        /// Effects to estimate, by canonical name; those that the recording cannot support are left out with a note.
        #[serde(default = "all_effects")]
        pub effects: Vec<String>,
        /// Where targets of the recording sit, mm from the robot's tool point in the axes of its tool frame, as far as it is known:
        /// `{A: [50, 0, 20]}`. A target without an entry is placed by the recording. `tool_offset.A.x` and so on are changes from it.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub targets: BTreeMap<String, [f64; 3]>,
        /// Distances between sockets, planes or spheres that are known from elsewhere: they tell the scale of the arm.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub distances: Vec<KnownDistance>,
        /// Sizes of spheres that are known, by their names in the recording.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub spheres: BTreeMap<String, KnownSphere>,
        /// Places of sockets that are known, by their names in the recording: one fixes where the cell is, two its scale too, three on no line
        /// how it is turned.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        pub points: BTreeMap<String, KnownPoint>,
    }
}

fn all_effects() -> Vec<String> {
    identified().map(|cause| cause.name().to_string()).collect()
}

crate::stage! {
    Identify, "identify", 22, "identifies geometry, transmission and compliance from the nominal robot in one estimation",
        IdentifyReads {
            robot: Robot,
            recording: Recording,
            split: Split,
        } -> Identified
}

impl Stage for Identify {
    fn faults(&self, at: &mut Place) {
        self.shared_faults("fit", at);
        self.known_cell().faults(at);
        for (name, place) in &self.targets {
            let near = place
                .iter()
                .all(|value| value.is_finite() && value.abs() < FARTHEST_TARGET);
            at.at(format!("targets.{name}")).must(
                near,
                "expected [x, y, z] in mm from the tool point, e.g. [50, 0, 20]",
            );
        }
        let known: Vec<&str> = identified().map(|cause| cause.name()).collect();
        for (k, name) in self.effects.iter().enumerate() {
            let message = format!("unknown effect `{name}`{}", instead(name, &known));
            at.at(format!("effects[{k}]"))
                .must(known.contains(&name.as_str()), message);
        }
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        crate::on(&self.on)
    }

    fn run(&self, reads: IdentifyReads, context: &Context) -> Result<Identified> {
        let mut asked = RowsToFit::of(&reads.recording, &reads.split, &self.on)?;
        let RowsToFit { data, rows, .. } = &asked;
        must_move(data, rows)?;
        let robot = RobotModel::new(reads.robot.to_description()?);
        let (robot, base) = self.gauged(robot, data, rows, context)?;
        self.question_setup(&robot, &asked, context);
        let setting = EffectContext {
            base,
            load: self.load.into(),
        };
        let mut effects = Vec::new();
        let wanted =
            identified().filter(|cause| self.effects.iter().any(|name| name == cause.name()));
        for effect in wanted.filter_map(|cause| cause.arm_effect(&setting)) {
            let name = effect.name();
            if name == names::ANCHOR && robot.setup().anchors.is_empty() {
                continue;
            }
            if let Some(reason) = effect.missing(&robot, data) {
                context.note(format!("{name} is left out: {reason}"));
                continue;
            }
            if name == names::JOINT_COMPLIANCE && matches!(self.load, LoadSetting::Gravity) {
                let links = weightless_links(&robot, data, rows);
                context.warn_each(links.map(|links| links.warning));
            }
            effects.push(effect);
        }
        let stack = EffectStack::new(&robot, setting.base, effects);
        let mut model = Model::nominal(robot.clone(), stack);
        let all: Vec<usize> = (0..model.x.len()).collect();
        let (candidates, held) = self.parameter_set().apply(&mut model, &all, context);
        known_cell::apply(&mut model, &self.known_cell(), context)?;
        let mut fit = self.fit(&model, &candidates, &mut asked, context);
        let RowsToFit { data, rows, .. } = &asked;
        let placed;
        (fit.model, placed) = placed_by_left_out(&fit.model, data, rows);
        let fitting = Fitting {
            geometry: geometric_rank(&fit.model, data, rows, &fit.fitted),
            placed,
            ..Fitting::of(&asked, &fit, &held, self.folds)
        };
        contact::note(context, &fitting.session(), &reads.recording);
        question_ratios(&fitting, &setting, context);
        Ok(Identified::of(context, &fitting))
    }
}

/// mm; a target farther from the tool point is no target on the tool.
const FARTHEST_TARGET: f64 = 1e4;

impl Identify {
    /// A warning where robot file, joints and points do not belong together: geometry that is estimated would make up for it.
    fn question_setup(&self, robot: &RobotModel, asked: &RowsToFit, context: &Context) {
        let RowsToFit {
            recording,
            split,
            data,
            rows,
            ..
        } = asked;
        let mut effects = self.effects.iter();
        if !effects.any(|name| GEOMETRY[OF_THE_ARM].contains(&name.as_str())) {
            return;
        }
        context.warn_each(unmoved_remark(robot, data, rows));
        let fit = rows.iter().copied().filter(|row| data.has_point(*row));
        let fit: Vec<usize> = fit.collect();
        let question = Question {
            robot,
            data,
            fit: &fit,
            validate: &[],
            set: &numbered(split),
            prior_weight: 1.0,
            open_world: 0.3,
            without: &[],
            declared: &[],
            beside_simulation: recording.simulated.is_some(),
            known: &[],
            seed: context.seed,
        };
        if let Some(wrong) = wrong_setup(&question) {
            context.warn(match wrong.findings.first().map(|found| &found.statement) {
                Some(found) => format!("the set-up is wrong: {}", found.trim_end_matches('.')),
                None => wrong.statement,
            });
        }
    }

    /// The robot with what it is measured by, and where its base stands at the start.
    fn gauged(
        &self,
        robot: RobotModel,
        data: &Measurements,
        rows: &[usize],
        context: &Context,
    ) -> Result<(RobotModel, Pose)> {
        let known = data.target.as_ref().map_or(&[][..], |named| &named.names);
        if let Some(unknown) = self.targets.keys().find(|name| !known.contains(name)) {
            let named = known
                .iter()
                .map(|name| if name.is_empty() { "(no name)" } else { name });
            let there = match known {
                [] => "none; map a column to `target` in `ingest`".into(),
                _ => listed(named),
            };
            let place = format!("{}.with.targets.{unknown}", context.id);
            let message = format!("the recording has no such target; it has: {there}");
            return Err(Error::spec(place, message));
        }
        let places = self.targets.iter();
        let places = places.map(|(name, place)| (name.clone(), Vector3::from(*place) * 1e-3));
        let stated = places.collect();
        let (robot, base) = gauge(robot, data, rows, &stated)
            .map_err(|message| Error::data("table recording", message))?;
        Ok(known_cell::standing(robot, base, &self.points, data, rows))
    }

    fn known_cell(&self) -> KnownCell<'_> {
        KnownCell {
            distances: &self.distances,
            spheres: &self.spheres,
            points: &self.points,
        }
    }
}

/// Effects that together are the rigid geometry of the arm and of what measures it.
const GEOMETRY: [&str; 5] = [
    "anchor",
    "base_frame",
    "tool_offset",
    "joint_offset",
    "link_geometry",
];
/// Those of them that are the arm's own numbers.
const OF_THE_ARM: std::ops::Range<usize> = 3..5;

/// (found, expected) rank of the geometry, when all of it was asked for and theory has a word on what was measured.
fn geometric_rank(
    model: &Model,
    data: &Measurements,
    rows: &[usize],
    fitted: &Fitted,
) -> Option<(usize, usize)> {
    let anchored = !model.robot.setup().anchors.is_empty();
    let mut needed = GEOMETRY
        .iter()
        .filter(|name| **name != names::ANCHOR || anchored);
    let asked = needed.all(|name| has_effect(model, name));
    let geometry = GEOMETRY
        .iter()
        .flat_map(|name| model.stack.parameters_of(name));
    let geometry: Vec<usize> = geometry.collect();
    let found = determined_directions(model, fitted, &geometry);
    let held = model.stack.specs().len() != fitted.singular_all.len();
    // A prior makes its parameter known whatever the data see.
    let has_prior = model.known.values().any(|known| known.prior.is_some());
    let (has_length, places) = (!model.lengths.is_empty(), known_places(model));
    let expected = observation::rank(&model.robot, data, rows, has_length, places)?;
    (asked && !held && !has_prior).then_some((found, expected))
}

fn has_effect(model: &Model, name: &str) -> bool {
    let mut effects = model.stack.effects();
    effects.any(|(effect, _)| effect.name() == name)
}

/// A ratio is a quotient of tooth counts: errors beyond this are no manufacturing errors.
const PLAUSIBLE_RATIO: f64 = 5e-4;

/// Where ratios are implausible and compliance was not asked for, fits it too and says which explanation the data favour.
fn question_ratios(fitting: &Fitting, setting: &EffectContext, context: &Context) {
    let Session {
        data,
        rows,
        model,
        fitted,
    } = fitting.session();
    let implausible = |model: &Model, fitted: &Fitted| -> Vec<usize> {
        let beyond = |k: &usize| match &fitted.statuses[*k] {
            ParameterStatus::Free(sigma) => model.x[*k].abs() > PLAUSIBLE_RATIO.max(3.0 * sigma),
            _ => false,
        };
        let ratios = model.stack.parameters_of(names::REDUCTION_RATIO);
        ratios.filter(beyond).collect()
    };
    let suspects = implausible(model, fitted);
    let Some(compliance) = arm_effect(names::JOINT_COMPLIANCE, setting) else {
        return;
    };
    if suspects.is_empty() || has_effect(model, names::JOINT_COMPLIANCE) {
        return;
    }
    let list = |model: &Model| -> String {
        let one = |k: &usize| {
            let place = model.stack.specs()[*k].place;
            format!("{place} {:+.1}e-4", model.x[*k] * 1e4)
        };
        listed(suspects.iter().map(one))
    };
    let opening = format!(
        "reduction ratios are quotients of tooth counts, yet {}",
        list(model)
    );
    if let Some(reason) = compliance.missing(&model.robot, data) {
        context.warn(format!(
            "{opening}; compliance under self-weight cannot be tried as the explanation: {reason}"
        ));
        return;
    }
    // Known names first, compliance behind them: numbers of the first model stay valid in the second.
    let effects = model.stack.effects();
    let effects = effects.filter_map(|(effect, _)| arm_effect(effect.name(), setting));
    let effects: Vec<Box<dyn Effect>> = effects.chain([compliance]).collect();
    let stack = EffectStack::new(&model.robot, setting.base, effects);
    let mut rival = Model::nominal(model.robot.clone(), stack);
    rival.known.clone_from(&model.known);
    rival.lengths.clone_from(&model.lengths);
    let candidates: Vec<usize> = (0..rival.stack.specs().len())
        .filter(|k| !fitting.held.contains(k))
        .collect();
    let (rival, refitted) = fit(&rival, data, rows, &candidates);
    let gain = evidence(fitted, data, rows) - evidence(&refitted, data, rows);
    if gain > DECISIVE {
        context.warn(format!(
            "{opening}; with `{}` {}, and {:.3} -> {:.3} mm per axis stays unexplained: the data favour compliance (BIC better \
             by {gain:.0})",
            names::JOINT_COMPLIANCE,
            list(&rival),
            fitted.excess_sigma * 1e3,
            refitted.excess_sigma * 1e3
        ));
    } else {
        context.note(format!(
            "{opening}; compliance under self-weight does not explain it better"
        ));
    }
}

/// A difference of BIC beyond this is very strong evidence (Kass and Raftery, 1995).
const DECISIVE: f64 = 10.0;

/// BIC of a fit from its robust residual scale.
fn evidence(fitted: &Fitted, data: &Measurements, rows: &[usize]) -> f64 {
    let count = rows.len() as f64;
    let noise = |row: &usize| observation::noise(data, *row).powi(2) / 3.0;
    let noise = rows.iter().map(noise).sum::<f64>() / count;
    let values = 3.0 * count;
    values * (noise + fitted.excess_sigma * fitted.excess_sigma).ln()
        + fitted.singular.len() as f64 * values.ln()
}

crate::identified::identification! {
    /// Settings of `stiffness`.
    pub struct Stiffness {
        /// Sets of the split to fit: loaded poses.
        pub on: Vec<String>,
        /// Joints to estimate, from 1; all that the data see if empty.
        #[serde(default)]
        pub joints: Vec<usize>,
    }
}

crate::stage! {
    Stiffness, "stiffness", 21, "identifies joint compliance from loaded poses; everything identified before is kept",
        StiffnessReads {
            robot: Robot,
            recording: Recording,
            split: Split,
            parameters: Parameters,
            covariance: Option<CovarianceTable>,
            prediction: Prediction,
        } -> Identified
}

impl Stage for Stiffness {
    fn faults(&self, at: &mut Place) {
        self.shared_faults("loaded", at);
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        crate::on(&self.on)
    }

    fn run(&self, reads: StiffnessReads, context: &Context) -> Result<Identified> {
        let robot = RobotModel::new(reads.robot.to_description()?);
        let mut asked = RowsToFit::of(&reads.recording, &reads.split, &self.on)?;
        let mut model =
            reads
                .parameters
                .model(robot, &[names::JOINT_COMPLIANCE], self.load.into())?;
        let is_compliance = |effect: &dyn Effect| effect.name() == names::JOINT_COMPLIANCE;
        let missing = model
            .stack
            .effects()
            .find(|(effect, _)| is_compliance(*effect))
            .and_then(|(effect, _)| effect.missing(&model.robot, &asked.data));
        if let Some(reason) = missing {
            let message = format!("no joint load is known: {reason}");
            return Err(Error::data("with.load", message));
        }
        let joints = self.joints.iter();
        let wanted = joints.map(|joint| format!("{}.j{joint}", names::JOINT_COMPLIANCE));
        let wanted: Vec<String> = wanted.collect();
        let specs = model.stack.specs();
        let is_unknown = |name: &&String| specs.iter().all(|spec| spec.name != **name);
        if let Some(unknown) = wanted.iter().find(is_unknown) {
            let message =
                format!("this robot has no `{unknown}`: allowed are its revolute joints, from 1");
            return Err(Error::spec("with.joints", message));
        }
        let chosen = |k: &usize| wanted.is_empty() || wanted.contains(&specs[*k].name);
        let all: Vec<usize> = model.stack.parameters_of(names::JOINT_COMPLIANCE).collect();
        let open: Vec<usize> = all.iter().copied().filter(chosen).collect();
        let (candidates, _) = self.parameter_set().apply(&mut model, &open, context);
        let fit = self.fit(&model, &candidates, &mut asked, context);
        let held = all.into_iter().filter(|k| !candidates.contains(k));
        let held: Vec<usize> = held.collect();
        let seen_before: Vec<bool> = reads.prediction.0.iter().map(|row| !row.held_out).collect();
        let mut fitting = Fitting {
            earlier: Some(&reads.parameters),
            earlier_covariance: reads.covariance.as_ref(),
            ..Fitting::of(&asked, &fit, &held, self.folds)
        };
        fitting.doubtful.retain(|row| !seen_before[*row]);
        fitting.seen_before = seen_before;
        Ok(Identified::of(context, &fitting))
    }
}
