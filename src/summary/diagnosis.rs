//! A diagnosis of positions or torques, made once of its tables: one document, which `--json` prints and the templates of the terminal and of
//! the page show.

use super::diagnosis_head::{
    head_of_drives, head_of_positions, head_of_torques, verdict_of_drives, verdict_of_positions,
    verdict_of_torques,
};
use super::effect_file::declared_in_yaml;
use super::estimate::length;
use super::found::{Found, FoundRival, ShortFinding, words};
use super::screen::{self, NextStep};
use super::{labelled, robot_of};
use crate::diagnose::{VerdictKind, advised};
use crate::effect::names;
use crate::error::{Error, Result};
use crate::pipeline::StageReport;
use crate::report::{Page, PageLanguage, diagnosed_page, result};
use crate::shell::typed;
use crate::stage::{DeclaredStage, Diagnose, DiagnoseDrives, DiagnoseTorques};
use crate::store::Store;
use crate::table::{
    CauseGrid, Cells, ContactRow, Contacts, DriveVerdict, FindingNumbers, FindingRow, Findings,
    FormRow, Forms, JointDrives, JointTorques, Rivals, ShareRow, Shares, Suspects, SuspectsRow,
    Table, TablesByKind, TorqueFindings, TorqueNumbers, TorqueRivals, TorqueVerdict, Verdict,
    VerdictSentences, VerdictTopic, is_separable_by_poses, of_kind, picked, picked_of,
};
use crate::text::filled;
use minijinja::value::Serde;
use serde::Deserialize;
use serde_json::{Value, json};

/// A diagnosis by its tables.
#[derive(Default)]
pub struct DiagnosisSummary {
    run: String,
    step: String,
    /// Whether it is of torques.
    of_torques: bool,
    /// Whether it is of commands and responses.
    of_drives: bool,
    is_wrong_setup: bool,
    /// What shows the noise, where it is inferred.
    advice: Option<&'static str>,
    /// What was measured, and the errors before and after, as lines.
    head: String,
    /// The verdict in at most twelve words.
    pub(super) verdict: String,
    /// What `--json` has of it, but for what to measure next.
    document: Value,
    /// What the templates show: rows of its tables, findings with numbers, rivals and formulas.
    shown: Value,
    found: Vec<Found>,
    /// The findings in a few words each, as the table has them.
    pub(super) in_few_words: Vec<ShortFinding>,
    /// Where sizes of findings are, in words.
    at: &'static str,
    /// Rows that are not fitted, the worst first.
    aside: Vec<SuspectsRow>,
    forms: Forms,
    not_observable: Vec<String>,
    next: Vec<String>,
}

/// What was diagnosed.
#[derive(Default)]
pub(crate) struct Subject {
    /// The run that commands name.
    pub(crate) run: String,
    pub(crate) robot: Option<String>,
    /// Rows of the recording.
    pub(crate) rows: u64,
}

/// Rivals of a finding that poses are offered for.
const ASKED: usize = 2;
/// Places and variables that are shown.
const SHOWN: usize = 5;

/// A table of a diagnosis; empty where it was not written.
fn table<T: Table + Default>(tables: &TablesByKind) -> Result<T> {
    Ok(of_kind(tables)?.unwrap_or_default())
}

fn the_verdict<R>(rows: Vec<R>) -> Result<R> {
    let first = rows.into_iter().next();
    first.ok_or_else(|| Error::Bug("a diagnosis without a verdict".into()))
}

impl DiagnosisSummary {
    /// What a stage of a run that diagnoses wrote. Fails where a table has left the store.
    pub fn read(run: &str, stage: &StageReport, store: &Store) -> Result<Self> {
        let load = |kind: &str| {
            let record = stage.outputs.iter().find(|output| output.kind == kind);
            record.map(|output| store.load(&output.table)).transpose()
        };
        let recording = stage.inputs.iter().find(|input| input.port == "recording");
        let subject = Subject {
            run: run.into(),
            robot: robot_of(stage, store)?,
            rows: recording.map_or(0, |input| input.table.rows),
        };
        match &*stage.uses {
            DiagnoseTorques::NAME => Self::of_torques(subject, &load),
            DiagnoseDrives::NAME => Self::of_drives(subject, &load),
            _ => Self::of_positions(subject, &load),
        }
    }

    /// What a stage `diagnose` says by its tables.
    pub(crate) fn of_positions(subject: Subject, tables: &TablesByKind) -> Result<Self> {
        let v = the_verdict(table::<Verdict>(tables)?.0)?;
        let (Findings(rows), numbers, rivals): (_, FindingNumbers, Rivals) =
            (table(tables)?, table(tables)?, table(tables)?);
        let (cells, forms, Shares(shares)): (Cells, Forms, _) =
            (table(tables)?, table(tables)?, table(tables)?);
        let mut aside = table::<Suspects>(tables)?.0;
        aside.retain(|row| !row.used);
        let mut findings = result::findings(&rows, &numbers.0, &rivals.0);
        for (finding, row) in findings.iter_mut().zip(&rows) {
            finding["formulas"] = result::formulas([&forms], row.rank);
        }
        let located = json!({ "places": located(&shares, "place"), "variables": located(&shares, "variable") });
        let mut document = picked(
            &v,
            "verdict statement noise_floor_mm noise_basis held_out clock",
        );
        let columns = "validate_mean_mm=before_mean_mm validate_rms_mm=before_rms_mm validate_max_mm=before_max_mm";
        document["before"] = picked(&v, columns);
        document["after"] = picked(&v, &columns.replace("before", "after"));
        document["located"] = located.clone();
        let columns = "rms_mm=leftover_rms_mm chi_square p_value=p_after signature";
        document["leftover"] = picked(&v, columns);
        document["set_aside"] = picked_of(&aside, "point_id set kind size_mm");
        document["noise"] = picked(&v, "repeatability_rad repeats");
        let ranges = rows.iter().map(FindingRow::valid_range);
        let ranges = ranges.map(|range| match range {
            Some((joint, range, unit)) => json!({ format!("q{joint}_{unit}"): range }),
            None => json!({}),
        });
        aside.sort_by(|a, b| b.size_mm.total_cmp(&a.size_mm));
        let grid = CauseGrid::of(&cells, &Findings(rows.clone()));
        let shown = json!({
            "v": v, "title": subject.robot.as_deref().unwrap_or("diagnosis"), "assumed": v.is_noise_assumed(), "located": located,
            "shares": !shares.is_empty(), "grid": grid.text(), "causes_found": grid, "aside": aside, "joints": [],
        });
        let summary = Self {
            advice: v
                .statement
                .as_deref()
                .filter(|_| v.is_noise_inferred())
                .and_then(advised),
            head: head_of_positions(&subject, &v, rows.len()),
            verdict: verdict_of_positions(&v, &rows),
            at: match v.leftover_rms_mm {
                Some(_) => " at the tool",
                None => " rms",
            },
            aside,
            forms,
            ..Self::default()
        };
        let evidence = "f_statistic p_value delta_bic heldout_gain_mm effect_rms_mm";
        let step = (v.step.clone(), table(tables)?);
        summary.with(
            subject,
            step,
            (document, shown),
            findings,
            evidence,
            ranges.collect(),
        )
    }

    /// What a stage `diagnose_torques` says by its tables.
    fn of_torques(subject: Subject, tables: &TablesByKind) -> Result<Self> {
        let v = the_verdict(table::<TorqueVerdict>(tables)?.0)?;
        let (TorqueFindings(rows), numbers, rivals): (_, TorqueNumbers, TorqueRivals) =
            (table(tables)?, table(tables)?, table(tables)?);
        let (JointTorques(joints), contacts): (_, Contacts) = (table(tables)?, table(tables)?);
        let mut findings = result::findings(&rows, &numbers.0, &rivals.0);
        for rivals in findings
            .iter_mut()
            .filter_map(|finding| finding["rivals"].as_array_mut())
        {
            let chance = |rival: &Value| rival["probability"].as_f64().unwrap_or_default();
            rivals.sort_by(|a, b| chance(b).total_cmp(&chance(a)));
        }
        let columns =
            "verdict statement inertials base_parameters signal cutoff_hz rate_hz held_out";
        let mut document = picked(&v, columns);
        let columns = "joint rms_nm=before_rms_nm nrmse=before_nrmse moving_rms_nm=before_moving_rms_nm rest_rms_nm=before_rest_rms_nm";
        for (when, nrmse) in [("before", v.before_nrmse), ("after", v.after_nrmse)] {
            let joints = picked_of(&joints, &columns.replace("before", when));
            document[when] = json!({ "validate_nrmse": nrmse, "joints": joints });
        }
        let contact = |row: &ContactRow| {
            let mut contact = picked(row, "start_s end_s joints");
            contact["force_n"] = json!([row.force_x_n, row.force_y_n, row.force_z_n]);
            contact["sigma_n"] = json!([row.sigma_x_n, row.sigma_y_n, row.sigma_z_n]);
            contact
        };
        document["contacts"] = contacts.0.iter().map(contact).collect();
        document["noise"] = picked_of(&joints, "joint sigma_nm=noise_nm autocorrelation");
        let columns = "joint rms_nm=leftover_rms_nm over_noise=leftover_over_noise signature";
        document["leftover"] = picked_of(&joints, columns);
        let shown = json!({ "v": v, "joints": joints, "aside": [] });
        let summary = Self {
            of_torques: true,
            head: head_of_torques(&subject, &v, rows.len()),
            verdict: verdict_of_torques(&v, &joints),
            at: " rms",
            ..Self::default()
        };
        let evidence = "gain f_statistic p_value delta_bic heldout_gain_nm effect_rms_nm";
        let step = (v.step.clone(), table(tables)?);
        let ranges = vec![json!({}); rows.len()];
        summary.with(subject, step, (document, shown), findings, evidence, ranges)
    }

    /// What a stage `diagnose_drives` says by its tables.
    fn of_drives(subject: Subject, tables: &TablesByKind) -> Result<Self> {
        let v = the_verdict(table::<DriveVerdict>(tables)?.0)?;
        let (Findings(rows), numbers, rivals): (_, FindingNumbers, Rivals) =
            (table(tables)?, table(tables)?, table(tables)?);
        let JointDrives(joints) = table(tables)?;
        let mut findings = result::findings(&rows, &numbers.0, &rivals.0);
        let mrad = |rad: f64| 1e3 * rad;
        for (finding, row) in findings.iter_mut().zip(&rows) {
            finding["effect_rms_mrad"] = row.effect_rms_rad.map(mrad).into();
        }
        let mut document = picked(&v, "verdict statement rows held_out");
        document["noise_mrad"] = mrad(v.noise_rad).into();
        for (when, rms, fitted) in [
            ("before", v.before_rms_rad, v.before_fitted_rms_rad),
            ("after", v.after_rms_rad, v.after_fitted_rms_rad),
        ] {
            let joints = joints.iter().map(|row| {
                let rms = if when == "before" {
                    row.before_rms_rad
                } else {
                    row.after_rms_rad
                };
                json!({ "joint": row.joint, "rms_mrad": mrad(rms) })
            });
            document[when] = json!({
                "validate_rms_mrad": mrad(rms), "fit_rms_mrad": mrad(fitted), "joints": joints.collect::<Vec<Value>>(),
            });
        }
        document["leftover"] = picked_of(&joints, "joint over_noise=leftover_over_noise");
        let shown = json!({ "v": v, "drives": joints, "joints": [], "aside": [] });
        let summary = Self {
            of_torques: true,
            of_drives: true,
            head: head_of_drives(&subject, &v, rows.len()),
            verdict: verdict_of_drives(&v),
            at: " rms",
            ..Self::default()
        };
        let evidence = "delta_bic effect_rms_mrad";
        let step = (v.step.clone(), table(tables)?);
        let ranges = vec![json!({}); rows.len()];
        summary.with(subject, step, (document, shown), findings, evidence, ranges)
    }

    /// The same with what both have: sentences and findings.
    fn with(
        mut self,
        subject: Subject,
        (step, sentences): (String, VerdictSentences),
        (mut document, mut shown): (Value, Value),
        findings: Vec<Value>,
        evidence: &str,
        ranges: Vec<Value>,
    ) -> Result<Self> {
        let about = |topic| -> Vec<String> {
            let all = sentences.about(&step, topic).into_iter();
            all.map(String::from).collect()
        };
        let remarks = about(VerdictTopic::Remark);
        self.not_observable = about(VerdictTopic::NotObservable);
        self.next = about(VerdictTopic::NextMeasurement);
        if self.of_torques {
            document["remarks"] = json!(remarks);
        }
        document["not_observable"] = json!(self.not_observable);
        let documents = findings.iter().zip(ranges).map(|(finding, range)| {
            let mut document = result::document(finding, evidence);
            document["parameters"] = document["numbers"].take();
            document["valid_range"] = range;
            document
                .as_object_mut()
                .map(|document| document.remove("numbers"));
            document
        });
        document["findings"] = documents.collect();
        let found: serde_json::Result<_> = findings.iter().map(Found::deserialize).collect();
        self.found = found.map_err(|error| Error::Bug(error.to_string()))?;
        let by_rows = document["clock"] == "row";
        let short = |found: &Found| ShortFinding::of(found, by_rows);
        self.in_few_words = self.found.iter().map(short).collect();
        self.is_wrong_setup = document["verdict"] == VerdictKind::WrongSetup.name();
        for (name, value) in [
            ("torques", self.of_torques.into()),
            ("run", json!(subject.run)),
            ("findings", findings.into()),
            ("not_observable", json!(self.not_observable)),
            ("remarks", remarks.into()),
        ] {
            shown[name] = value;
        }
        Ok(Self {
            run: subject.run,
            step,
            document,
            shown,
            ..self
        })
    }

    /// Whether the files do not belong together as they are read.
    pub(crate) fn is_wrong_setup(&self) -> bool {
        self.is_wrong_setup
    }

    /// The proposed formula of a finding, of the first one that has one where none is named, as a file that declares it.
    pub(crate) fn effect_file(&self, finding: Option<i64>) -> Result<String> {
        let fault = |message| Error::spec("--export-effect", message);
        if self.of_torques {
            return Err(fault(
                "findings on torques and drives have no formula of their own".into(),
            ));
        }
        let is_asked = |row: &&FormRow| row.proposed && finding.is_none_or(|rank| row.rank == rank);
        let row = self.forms.0.iter().find(is_asked).ok_or_else(|| {
            let which = finding.map_or("no finding has a formula".to_string(), |rank| {
                format!("finding {rank} has no formula")
            });
            fault(format!(
                "{which} that does what its curve does; findings without a name may have one"
            ))
        })?;
        let found = self.found.iter().find(|found| found.rank == row.rank);
        let (effect, place) = found.map_or(("-", "-"), |found| (&found.effect, &found.place));
        let run = &self.run;
        declared_in_yaml(
            &row.declaration,
            &format!("a formula for {effect} at {place}, found in run {run}"),
        )
    }

    /// What to type for poses that tell findings from their closest rivals; `store` as in [`Self::document`].
    fn poses(&self, store: &str) -> Vec<(&Found, &FoundRival, String)> {
        let run = &self.run;
        let step = match self.step == Diagnose::NAME {
            true => String::new(),
            false => format!(" --step {}", typed(&self.step)),
        };
        let mut poses = Vec::new();
        let asked = self.found.iter().filter(|_| !self.next.is_empty());
        for found in asked.filter(|found| is_separable_by_poses(&found.effect)) {
            // Without a name and without a difference: another place of the same motion.
            let is_one_motion = |rival: &FoundRival| {
                [&*found.effect, &*rival.effect] == [names::UNKNOWN; 2] && rival.delta_bic == 0.0
            };
            let is_asked =
                |rival: &&FoundRival| is_separable_by_poses(&rival.effect) && !is_one_motion(rival);
            let mut rivals: Vec<&FoundRival> = found.rivals.iter().filter(is_asked).collect();
            rivals.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
            for rival in rivals.into_iter().take(ASKED) {
                let name = typed(&format!("{}@{}", rival.effect, rival.place));
                let rank = found.rank;
                let command =
                    format!("calib poses --run {run}{step}{store} --separate {rank} {name}");
                poses.push((found, rival, command));
            }
        }
        poses
    }

    /// What to measure next, a sentence each, then what to type for poses; of torques it is in what is not observable.
    fn next(&self, store: &str) -> Vec<String> {
        let poses = self
            .poses(store)
            .into_iter()
            .map(|(found, rival, command)| {
                let (rank, effect, place) = (found.rank, &rival.effect, &rival.place);
                format!("poses for finding {rank} or {effect} at {place}: {command}")
            });
        let sentences = self.next.iter().cloned();
        sentences.chain(poses).collect()
    }

    /// The diagnosis as one document; `store` is where the run is, as one types it.
    pub fn document(&self, store: &str) -> Value {
        let mut document = self.document.clone();
        if !self.of_torques {
            let next = Some(self.next(store)).filter(|next| !next.is_empty());
            document["next_measurements"] = json!(next);
        }
        document
    }

    /// What the templates take; `store` as in [`Self::document`].
    fn shown(&self, store: &str) -> Value {
        let mut shown = self.shown.clone();
        shown["next"] = match self.of_torques {
            true => json!([]),
            false => self.next(store).into(),
        };
        shown
    }

    /// A diagnosis of positions as one HTML file; `store` as in [`Self::document`].
    pub fn page(&self, store: &str, language: PageLanguage) -> Result<Page> {
        diagnosed_page(self.shown(store), language)
    }

    /// All of the diagnosis, as `calib diagnose --details` prints it; `store` is the `--store` of the commands that it proposes.
    pub fn text(&self, store: &str) -> String {
        let about = Serde(self.shown(store)).into();
        filled(include_str!("text/diagnosis.txt"), about)
    }

    /// In ten lines, with the largest findings alone.
    pub(super) fn in_short(&self, width: usize, store: &str) -> String {
        let next = self.next_step("HEAD", store);
        self.head.clone()
            + &screen::found(&self.in_few_words, width)
            + &labelled("verdict", &self.verdict)
            + &next.map_or_else(String::new, |step| step.text(width))
    }

    /// What `calib diagnose` prints unless all is asked for: the verdict and a line a finding.
    pub fn short(&self, store: &str, columns: Option<usize>) -> String {
        let (width, wrong) = (
            screen::width(columns),
            self.is_wrong_setup && !self.of_torques,
        );
        let mut text = self.head.clone() + &labelled("verdict", &self.verdict);
        for (short, found) in self.in_few_words.iter().zip(&self.found) {
            text += &match wrong {
                true => screen::sentence(&format!("{:>3}.", found.rank), &found.statement, width),
                false => screen::ranked(found.rank, short, self.at, width),
            };
        }
        if let Some(statement) = self.document["statement"].as_str().filter(|_| wrong)
            && self.found.is_empty()
        {
            text += &screen::sentence("", statement, width);
        }
        let aside = self.aside.iter();
        let aside = aside.map(|row| format!("{} ({})", row.point_id, length(row.size_mm)));
        text += &screen::names("set aside", &Vec::from_iter(aside), width);
        // By the names alone that begin its sentences.
        let name = |line: &String| {
            let name = line
                .split_once(": ")
                .map_or(line.as_str(), |(name, _)| name);
            name.replace('_', " ")
        };
        let not_seen = self.not_observable.iter().map(name);
        text += &screen::names("not seen", &Vec::from_iter(not_seen), width);
        let next = self
            .next_step(&self.run, store)
            .or_else(|| (!wrong && !self.of_drives).then(|| NextStep::correct(&self.run, store)));
        text += &next.map_or_else(String::new, |step| step.text(width));
        let more = match self.of_torques {
            false => "--details prints numbers, places, formulas, reasons and every rival",
            true => "--details prints numbers, joints, noise and all that was decided",
        };
        text + &labelled("more", more)
    }

    /// What to do next, where the diagnosis says so: what decides the largest finding whose name is not certain; else what shows a joint that was
    /// not seen.
    pub(super) fn next_step(&self, run: &str, store: &str) -> Option<NextStep> {
        let step = |what: String, command: Option<String>| Some(NextStep { what, command });
        if self.of_drives {
            return None;
        }
        if self.of_torques {
            let command = format!("calib compensate {run} motion.csv --torque{store}");
            return step("feed torques forward".into(), Some(command));
        }
        let found = self.in_few_words.iter().zip(&self.found);
        let mut undecided: Vec<_> = found.filter(|(short, _)| short.instead.is_some()).collect();
        undecided.sort_by(|a, b| b.0.magnitude().total_cmp(&a.0.magnitude()));
        let poses = self.poses(store);
        for (short, found) in undecided {
            let is_of_finding = |(asked, ..): &&(&Found, _, _)| asked.rank == found.rank;
            if let Some((_, rival, command)) = poses.iter().find(is_of_finding) {
                let rival = words(&rival.effect, &rival.place);
                let what = format!("measure poses to decide: {}, or {rival}", short.own);
                return step(what, Some(command.clone()));
            }
        }
        if let Some(advice) = self.advice {
            return step(advice.into(), None);
        }
        let mut lines = self.not_observable.iter();
        let joint = lines.find(|line| line.starts_with("joint "))?;
        let (joint, why) = joint.split_once(": ")?;
        let why = why.rsplit("; ").next().unwrap_or(why);
        step(format!("{joint}: {why}"), None)
    }
}

/// What could explain the most of the residual before the findings, more than chance, largest first.
fn located(shares: &[ShareRow], by: &str) -> Value {
    let of = |row: &&ShareRow| row.moment == "before" && row.by == by && row.delta_bic > 0.0;
    let mut all: Vec<&ShareRow> = shares.iter().filter(of).collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    picked_of(all.into_iter().take(SHOWN), "name share delta_bic")
}
