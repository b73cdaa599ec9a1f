//! `diagnose`: where the recording and the robot as its user believes it differ, what physics was left out, and the gain of it.

use crate::declared_effects::declared_effects;
use crate::doubtful::{self, KnownModel};
use crate::effect::{CAUSES, DeclaredCause, names};
use crate::error::{Error, Place, Result, instead};
use crate::estimate::{Session, gauge};
use crate::observation::values;
use crate::remarks::{
    WeightlessLinks, blank_payload, misplaced_tool, must_move, rounded_logs, weightless_links,
};
use crate::table::{
    Cells, Corrected, CovarianceTable, FindingNumbers, Findings, Forms, Parameters, Prediction,
    Recording, Rivals, Robot, Shares, Spectrum, Split, Suspects, Verdict, VerdictSentences,
};
use crate::{Context, RawFile, Stage, contact};
use calib_diagnose::{
    Diagnosis, KnownCell, Question, VerdictKind, against_simulation, diagnose, wrong_setup,
};
use calib_numerics::robot::{Measurements, RobotModel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Settings of `diagnose`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Diagnose {
    /// Sets of the split to fit; all others are predicted in the end and choose nothing.
    #[serde(default = "crate::fit_set")]
    pub on: Vec<String>,
    /// By what ln of the odds of rare causes against common ones is multiplied: 0.5 or 2 shows how much a diagnosis rests on them.
    #[serde(default = "as_believed")]
    pub prior_weight: f64,
    /// Prior probability that what acts somewhere is no cause of the list: 0.1 for an arm like many, 0.5 where little is known of it. Its odds
    /// scale those of causes without a name, products of two variables apart.
    #[serde(default = "open_world")]
    pub open_world: f64,
    /// Causes that are never named: what an arm cannot have, or what a test of the library leaves out. What looks like one all the same is
    /// `unknown` at its place; of geometry and ratios the numbers of the robot file stay.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// What other robots of the model say of causes: cells of the table `fleet_findings` with the share of robots that have each and their
    /// sizes. `prior: {fleet: F, stage: diagnose, by: causes}` of a fleet's file fills it in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prior: Vec<CellPrior>,
    /// Files with effects of your own, which are compared with those of the library.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<RawFile>,
}

/// What other robots of the model say of a cause.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CellPrior {
    /// Key of the cell, e.g. `backlash@joint 3`.
    pub cell: String,
    /// Share of the robots that have it, 0 to 1.
    pub share: f64,
    /// Usual rms motion at the tool, mm.
    pub size_mm: f64,
    /// Its standard deviation from robot to robot, mm.
    #[serde(default)]
    pub spread_mm: f64,
}

impl CellPrior {
    /// Poses and payloads differ as well: sizes of three times more or less stay possible.
    fn known(&self) -> KnownCell {
        let [low, high] = [self.size_mm / 3.0, 3.0 * self.size_mm];
        KnownCell {
            cell: self.cell.clone(),
            probability: self.share,
            between: [
                1e-3 * low.min(self.size_mm - 2.0 * self.spread_mm).max(0.0),
                1e-3 * high.max(self.size_mm + 2.0 * self.spread_mm),
            ],
        }
    }
}

fn as_believed() -> f64 {
    1.0
}

pub(super) fn open_world() -> f64 {
    0.3
}

/// No prior is worth more times its own weight.
const HEAVIEST: f64 = 10.0;

/// Priors between which evidence still decides.
const MOST_CLOSED: f64 = 0.001;
const MOST_OPEN: f64 = 0.999;

/// Says it where a prior of what nobody listed is one that no evidence moves.
pub(super) fn must_be_a_prior(open_world: f64, at: &mut Place) {
    at.at("open_world").must(
        (MOST_CLOSED..=MOST_OPEN).contains(&open_world),
        format!("expected a probability from {MOST_CLOSED} to {MOST_OPEN}"),
    );
}

crate::stage! {
    Diagnose, "diagnose", 57, "locates where simulation and recording differ, and names the physics that the model leaves out",
        DiagnoseReads {
            robot: Robot,
            recording: Recording,
            split: Split,
        } -> DiagnoseWrites {
            verdict: Verdict,
            sentences: VerdictSentences,
            findings: Findings,
            finding_numbers: FindingNumbers,
            rivals: Rivals,
            forms: Forms,
            shares: Shares,
            cells: Cells,
            spectrum: Spectrum,
            parameters: Parameters,
            covariance: CovarianceTable,
            prediction: Prediction,
            suspects: Suspects,
        }
}

impl Stage for Diagnose {
    fn faults(&self, at: &mut Place) {
        crate::must_name_sets(&self.on, "fit", at);
        at.at("prior_weight").must(
            (0.0..=HEAVIEST).contains(&self.prior_weight),
            format!("expected a number from 0 to {HEAVIEST}"),
        );
        must_be_a_prior(self.open_world, at);
        for (k, prior) in self.prior.iter().enumerate() {
            let sizes = [prior.size_mm, prior.size_mm + prior.spread_mm];
            let possible =
                sizes.iter().all(|size| (1e-3..=30.0).contains(size)) && prior.spread_mm >= 0.0;
            let mut at = at.at(format!("prior[{k}]"));
            at.at("share").must(
                (0.0..=1.0).contains(&prior.share),
                "expected a share from 0 to 1",
            );
            at.at("size_mm").must(
                possible,
                "expected sizes from 0.001 to 30 mm and a spread_mm of 0 or more",
            );
        }
        let named = CAUSES.iter().filter(|cause| !cause.is_nameless());
        let allowed: Vec<&str> = named.map(|cause| cause.name()).collect();
        for (k, name) in self.without.iter().enumerate() {
            let mut at = at.at(format!("without[{k}]"));
            at.must(
                allowed.contains(&name.as_str()),
                format!("`{name}` is no cause{}", instead(name, &allowed)),
            );
            at.must(name != names::BASE_FRAME, "`base_frame` places the robot before the instrument: without it nothing can be diagnosed");
        }
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        let files = self.effects.iter().enumerate();
        files
            .map(|(k, file)| (format!("effects[{k}]"), file.clone()))
            .collect()
    }

    fn look(
        &self,
        _reads: Option<DiagnoseReads>,
        context: &Context,
    ) -> Result<Option<DiagnoseWrites>> {
        declared_effects(&self.effects, DeclaredCause::of, context).map(|_| None)
    }

    fn sets_named(&self) -> Vec<(String, String)> {
        crate::on(&self.on)
    }

    fn run(&self, reads: DiagnoseReads, context: &Context) -> Result<DiagnoseWrites> {
        let asked = AskedRows::of(self, &reads, context)?;
        let question = asked.question(self, context.seed);
        let (data, corrected) = (&asked.data, asked.corrected);
        let tell = context.searching("looking for what the model lacks");
        let diagnosis = wrong_setup(&question).unwrap_or_else(|| diagnose(&question, tell));
        let mut diagnosis = with_remarks(diagnosis, &question, context)?;
        context.warn_each(blank_payload(&reads.recording));
        if !matches!(
            diagnosis.verdict,
            VerdictKind::WrongSetup | VerdictKind::NotAsked
        ) {
            remark(&mut diagnosis, data, &reads.recording, context);
        }
        let step = context.id;
        let mut held_out = vec![true; data.rows()];
        asked.fit.iter().for_each(|row| held_out[*row] = false);
        let parameters = Parameters::of(step, &diagnosis.model, &diagnosis.fitted, &[], None);
        let covariance = diagnosis.fitted.covariance.as_ref();
        let kept = &diagnosis.kept;
        let folds = diagnosis.folds.iter();
        let errors = folds.flat_map(|all| kept.iter().zip(all.random.iter().zip(&all.blocks)));
        let unseen: Vec<usize> = (0..data.rows()).filter(|row| held_out[*row]).collect();
        let known = covariance.filter(|_| {
            corrected == Corrected::RobotFile && diagnosis.verdict != VerdictKind::WrongSetup
        });
        let doubtful = KnownModel {
            model: &diagnosis.model,
            covariance: known,
            measured: data,
        };
        let (recording, split) = (&reads.recording, &reads.split);
        let prediction = Prediction::of(
            step,
            &diagnosis.model,
            data,
            recording,
            split,
            &held_out,
            covariance,
        )
        .with_suspects(&diagnosis.screening)
        .with_weights(&diagnosis.kept, &diagnosis.fitted)
        .with_folds(errors)
        .with_remarks(doubtful.remarks(data, &unseen));
        if let Some(line) = doubtful::sentence(&prediction) {
            diagnosis.statement.push_str(&format!("; {line}"));
        }
        Ok(DiagnoseWrites {
            verdict: Verdict::of(step, &diagnosis),
            sentences: VerdictSentences::of_positions(step, &diagnosis),
            findings: Findings::of(&diagnosis),
            finding_numbers: FindingNumbers::of(&diagnosis),
            rivals: Rivals::of(&diagnosis),
            forms: Forms::of(&diagnosis),
            shares: Shares::of(&diagnosis),
            cells: Cells::of(&diagnosis),
            spectrum: Spectrum::of(&diagnosis),
            parameters: parameters.correcting(corrected),
            covariance: CovarianceTable::of(&diagnosis.model, &diagnosis.fitted, None),
            prediction,
            suspects: Suspects::of(step, &diagnosis.screening, recording, split),
        })
    }
}

/// What a diagnosed recording shows in addition to its findings: rounded logs and events at contacts in the statement too, a tool out of place as a warning.
fn remark(
    diagnosis: &mut Diagnosis,
    data: &Measurements,
    recording: &Recording,
    context: &Context,
) {
    let kept = diagnosis.kept.iter().copied();
    let points: Vec<usize> = kept.filter(|row| data.has_point(*row)).collect();
    let rounded = rounded_logs(&diagnosis.model, data, &points);
    let session = Session {
        data,
        rows: &diagnosis.kept,
        model: &diagnosis.model,
        fitted: &diagnosis.fitted,
    };
    let events = contact::events(&session, recording);
    for line in rounded.into_iter().chain(events) {
        diagnosis.statement.push_str(&format!("; {line}"));
        context.warn(line);
    }
    context.warn_each(misplaced_tool(&diagnosis.model, &diagnosis.fitted));
}

/// Tells a person at once what must not be read past: a wrong set-up, too few rows, and what cannot be known without masses.
fn with_remarks(
    mut diagnosis: Diagnosis,
    question: &Question,
    context: &Context,
) -> Result<Diagnosis> {
    match diagnosis.verdict {
        VerdictKind::NotAsked => context.warn(diagnosis.not_observable.join("; ")),
        VerdictKind::WrongSetup => match diagnosis.findings.first() {
            Some(finding) => context.warn(format!("the set-up is wrong: {}", finding.statement)),
            None => return Err(Error::data("table recording", diagnosis.statement)),
        },
        _ => {
            if let Some(WeightlessLinks { missing, warning }) =
                weightless_links(question.robot, question.data, question.fit)
            {
                diagnosis.statement.push_str(&format!("; {missing}"));
                context.warn(warning);
            }
        }
    }
    Ok(diagnosis)
}

/// Fewest rows that place a robot before the tracker; what is missing takes more of them.
const FEWEST: usize = 3;

const SORTED_OTHERWISE: &str = "rows stand in another order than their times (sorted by name?): approach, lag and drift follow the times";

/// The rows that a diagnosis is asked of, and the robot that they belong to.
pub(super) struct AskedRows {
    declared: Vec<Arc<DeclaredCause>>,
    known: Vec<KnownCell>,
    pub data: Measurements,
    pub corrected: Corrected,
    pub fit: Vec<usize>,
    validate: Vec<usize>,
    robot: RobotModel,
    set: Vec<usize>,
}

impl AskedRows {
    /// Of the tables of a stage with these settings; fails where they do not place the robot.
    pub fn of(settings: &Diagnose, reads: &DiagnoseReads, context: &Context) -> Result<Self> {
        let declared = declared_effects(&settings.effects, DeclaredCause::of, context)?;
        let asked = reads.split.rows(&reads.recording, &settings.on)?;
        let (data, corrected) = mismatch(reads, &asked, context)?;
        if data.sequence.is_some() {
            context.warn(SORTED_OTHERWISE);
        }
        let measured = |row: &usize| values(&data, *row) > 0;
        let fit: Vec<usize> = asked.iter().copied().filter(measured).collect();
        if fit.len() < FEWEST {
            let message = format!(
                "{} measured rows to fit do not even place the robot: at least {FEWEST} are needed",
                fit.len()
            );
            return Err(Error::data("table recording", message));
        }
        must_move(&data, &fit)?;
        let others = (0..data.rows()).filter(|row| asked.binary_search(row).is_err());
        let validate: Vec<usize> = others.filter(measured).collect();
        let robot = RobotModel::new(reads.robot.to_description()?);
        let (robot, _) = gauge(robot, &data, &fit, &BTreeMap::new())
            .map_err(|message| Error::data("table recording", message))?;
        let set = doubtful::numbered(&reads.split);
        Ok(Self {
            declared,
            known: settings.prior.iter().map(CellPrior::known).collect(),
            data,
            corrected,
            fit,
            validate,
            robot,
            set,
        })
    }

    /// What is asked of them.
    pub fn question<'a>(&'a self, settings: &'a Diagnose, seed: u64) -> Question<'a> {
        Question {
            robot: &self.robot,
            data: &self.data,
            fit: &self.fit,
            validate: &self.validate,
            set: &self.set,
            prior_weight: settings.prior_weight,
            open_world: settings.open_world,
            without: &settings.without,
            declared: &self.declared,
            beside_simulation: self.corrected == Corrected::OutsideSimulation,
            known: &self.known,
            seed,
        }
    }
}

/// What is diagnosed, and what its parameters correct: the measurements, or what they differ by from an outside simulation.
fn mismatch(
    reads: &DiagnoseReads,
    asked: &[usize],
    context: &Context,
) -> Result<(Measurements, Corrected)> {
    let data = reads.recording.measurements();
    let Some(simulated) = &reads.recording.simulated else {
        return Ok((data, Corrected::RobotFile));
    };
    let robot = RobotModel::new(reads.robot.to_description()?);
    let message = "aligning simulation and recording needs three rows to fit with sim_x, sim_y, sim_z and a measured point";
    let data = against_simulation(&robot, &data, simulated, asked)
        .ok_or_else(|| Error::data("table recording", message))?;
    context.note("the mismatch is measured minus simulated (sim_x, sim_y, sim_z)");
    context.warn("parameters correct that simulation: they are not the robot file's");
    Ok((data, Corrected::OutsideSimulation))
}
