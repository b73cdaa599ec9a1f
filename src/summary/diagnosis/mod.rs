//! A diagnosis of positions or torques from its tables, as text and as JSON.

mod positions;

use super::screen::{self, NextStep, declared_in_yaml};
use super::short_finding::{Found, ShortFinding, words};
use super::{labelled, robot_of};
use crate::diagnose::VerdictKind;
use crate::effect::names;
use crate::error::{Error, Result};
use crate::pipeline::StageReport;
use crate::report::diagnosed_page;
use crate::shell::typed;
use crate::stage::{DeclaredStage, Diagnose, DiagnoseTorques};
use crate::store::Store;
use crate::summary::estimate::length;
use crate::table::{
    FindingNumbers, RivalRow, Rivals, Table, TablesByKind, TorqueNumbers, TorqueRivals, VerdictRow,
    VerdictSentences, VerdictTopic, is_separable_by_poses, of_kind,
};
use positions::{Positions, Torques};
use serde_json::{Value, json};

/// A diagnosis by its tables.
pub struct DiagnosisSummary {
    run: String,
    step: String,
    sentences: VerdictSentences,
    /// As the table has them.
    found: Vec<Found>,
    kind: Kind,
    robot: Option<String>,
    rows: u64,
}

/// By which stage it was made.
enum Kind {
    Positions(Box<Positions>),
    Torques(Box<Torques>),
}

/// Rivals of a finding that poses are offered for.
const ASKED: usize = 2;

impl DiagnosisSummary {
    /// What a stage of a run that diagnoses wrote. Fails where a table has left the store.
    pub fn read(run: &str, stage: &StageReport, store: &Store) -> Result<Self> {
        let load = |kind: &str| {
            let record = stage.outputs.iter().find(|output| output.kind == kind);
            record.map(|output| store.load(&output.table)).transpose()
        };
        let recording = stage.inputs.iter().find(|input| input.port == "recording");
        let diagnosis = if stage.uses == DiagnoseTorques::NAME {
            let (torques, numbers, rivals) = (
                Torques::read(&load)?,
                // The same columns as those of positions.
                load(TorqueNumbers::KIND)?.map(|frame| FindingNumbers::from_frame(&frame)),
                load(TorqueRivals::KIND)?.map(|frame| Rivals::from_frame(&frame)),
            );
            let (numbers, rivals) = (numbers.transpose()?, rivals.transpose()?);
            let found = torques.found(&numbers.unwrap_or_default(), &rivals.unwrap_or_default());
            Self {
                run: run.into(),
                step: torques.verdict.step.clone(),
                sentences: of_kind(&load)?.unwrap_or_default(),
                found,
                kind: Kind::Torques(Box::new(torques)),
                robot: None,
                rows: 0,
            }
        } else {
            Self::of_tables(run, &load)?
        };
        Ok(Self {
            robot: robot_of(stage, store)?,
            rows: recording.map_or(0, |input| input.table.rows),
            ..diagnosis
        })
    }

    /// What a stage `diagnose` says by its tables; the robot's name and the rows of the recording are not in them.
    pub(crate) fn of_tables(run: &str, tables: &TablesByKind) -> Result<Self> {
        let positions = Positions::read(tables)?;
        let numbers: FindingNumbers = of_kind(tables)?.unwrap_or_default();
        Ok(Self {
            run: run.into(),
            step: positions.verdict.step.clone(),
            sentences: of_kind(tables)?.unwrap_or_default(),
            found: positions.found(&numbers, &of_kind(tables)?.unwrap_or_default()),
            kind: Kind::Positions(Box::new(positions)),
            robot: None,
            rows: 0,
        })
    }

    /// The same of a robot and a recording with so many rows.
    pub(crate) fn with_subject(self, robot: &str, rows: u64) -> Self {
        Self {
            robot: Some(robot.into()),
            rows,
            ..self
        }
    }

    /// Whether the files do not belong together as they are read.
    pub(crate) fn is_wrong_setup(&self) -> bool {
        match &self.kind {
            Kind::Positions(diagnosis) => {
                diagnosis.verdict.verdict == VerdictKind::WrongSetup.name()
            }
            Kind::Torques(diagnosis) => diagnosis.verdict.is_wrong_setup(),
        }
    }

    /// The proposed formula of a finding, of the first one that has one where none is named, as a file that declares it.
    pub(crate) fn effect_file(&self, finding: Option<i64>) -> Result<String> {
        let Kind::Positions(positions) = &self.kind else {
            return Err(Error::spec(
                "--export-effect",
                "findings on torques have no formula of their own",
            ));
        };
        let mut all = positions
            .forms
            .0
            .iter()
            .filter(|row| row.proposed && finding.is_none_or(|rank| row.rank == rank));
        let row = all.next().ok_or_else(|| {
            let which = finding.map_or("no finding has a formula".to_string(), |rank| {
                format!("finding {rank} has no formula")
            });
            Error::spec(
                "--export-effect",
                format!(
                    "{which} that does what its curve does; findings without a name may have one"
                ),
            )
        })?;
        let found = self.found.iter().find(|found| found.rank == row.rank);
        let (effect, place) = found.map_or(("-", "-"), |found| (&found.effect, &found.place));
        let diagnosis = format!(
            "a formula for {effect} at {place}, found in run {}",
            self.run
        );
        declared_in_yaml(&row.declaration, &diagnosis)
    }

    fn statements(&self, topic: VerdictTopic) -> Vec<&str> {
        self.sentences.about(&self.step, topic)
    }

    /// What to type for poses that tell findings from their closest rivals; `store` as in [`Self::document`].
    fn poses(&self, store: &str) -> Vec<(&Found, &RivalRow, String)> {
        let run = &self.run;
        let step = match self.step == Diagnose::NAME {
            true => String::new(),
            false => format!(" --step {}", typed(&self.step)),
        };
        if self.statements(VerdictTopic::NextMeasurement).is_empty() {
            return Vec::new();
        }
        let findings = self.found.iter();
        let findings = findings.filter(|finding| is_separable_by_poses(&finding.effect));
        let rivals = findings.flat_map(|finding| {
            let rivals = finding.rivals.iter();
            // Without a name and without a difference: another place of the same motion.
            let is_one_motion = |rival: &&RivalRow| {
                [&*finding.effect, &*rival.effect] == [names::UNKNOWN; 2] && rival.delta_bic == 0.0
            };
            let rivals = rivals
                .filter(|rival| is_separable_by_poses(&rival.effect) && !is_one_motion(rival));
            let mut rivals: Vec<&RivalRow> = rivals.collect();
            rivals.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
            rivals
                .into_iter()
                .take(ASKED)
                .map(move |rival| (finding, rival))
        });
        let command = |finding: &Found, rival: &RivalRow| {
            let name = typed(&format!("{}@{}", rival.effect, rival.place));
            let rank = finding.rank;
            format!("calib poses --run {run}{step}{store} --separate {rank} {name}")
        };
        rivals
            .map(|(finding, rival)| (finding, rival, command(finding, rival)))
            .collect()
    }

    /// What to measure next, a sentence each, then what to type for poses.
    fn next(&self, store: &str) -> Option<Vec<String>> {
        let sentences = self.statements(VerdictTopic::NextMeasurement);
        let poses = self
            .poses(store)
            .into_iter()
            .map(|(finding, rival, command)| {
                let (rank, effect, place) = (finding.rank, &rival.effect, &rival.place);
                format!("poses for finding {rank} or {effect} at {place}: {command}")
            });
        let lines = || sentences.iter().map(|line| line.to_string()).chain(poses);
        (!sentences.is_empty()).then(|| lines().collect())
    }

    /// The diagnosis as one document; `store` is where the run is, as one types it.
    pub fn document(&self, store: &str) -> Value {
        let mut document = match &self.kind {
            Kind::Positions(diagnosis) => {
                let mut document = diagnosis.document();
                document["next_measurements"] = json!(self.next(store));
                document
            }
            Kind::Torques(diagnosis) => {
                let mut document = diagnosis.document();
                document["remarks"] = json!(self.statements(VerdictTopic::Remark));
                document
            }
        };
        document["findings"] = self.found.iter().map(Found::document).collect();
        document["not_observable"] = json!(self.statements(VerdictTopic::NotObservable));
        document
    }

    /// The diagnosis as one HTML file; `store` as in [`Self::document`], of torques it is in the report.
    pub fn page(&self, store: &str) -> Result<String> {
        let Kind::Positions(positions) = &self.kind else {
            return Err(Error::spec(
                "--html",
                "of torques the page is the pipeline's report: put `- uses: report` last",
            ));
        };
        let title = self.robot.as_deref().unwrap_or("diagnosis");
        let causes = (&positions.cells, &positions.findings);
        let next = self.next(store).unwrap_or_default();
        diagnosed_page(title, &self.run, &positions.verdict, causes, &next)
    }

    /// All of the diagnosis, as `calib diagnose --details` prints it; `store` is the `--store` of the commands that it proposes.
    pub fn text(&self, store: &str) -> String {
        let mut text = match &self.kind {
            Kind::Positions(diagnosis) => diagnosis.text(),
            Kind::Torques(diagnosis) => diagnosis.text(),
        };
        text.extend(self.found.iter().map(|found| match &self.kind {
            Kind::Positions(diagnosis) => {
                found.details(&diagnosis.formulas(found.rank), RivalRow::is_inseparable)
            }
            Kind::Torques(_) => found.details(&positions::numbers(found), |_| true),
        }));
        let lines = |label: &str, lines: &[&str]| -> String {
            lines
                .iter()
                .map(|line| format!("{label}{line}\n"))
                .collect()
        };
        text += &lines(
            "not observable: ",
            &self.statements(VerdictTopic::NotObservable),
        );
        match &self.kind {
            Kind::Positions(diagnosis) => {
                text += &lines(
                    "residual: ",
                    &Vec::from_iter(diagnosis.verdict.signature.as_deref()),
                );
                text += &lines(
                    "set aside: ",
                    &Vec::from_iter(diagnosis.set_aside().as_deref()),
                );
                for line in self.next(store).into_iter().flatten() {
                    text.push_str(&format!("measure next: {line}\n"));
                }
            }
            Kind::Torques(diagnosis) => text += &diagnosis.left(),
        }
        text + &lines("", &self.statements(VerdictTopic::Remark))
    }

    /// What was measured, and the errors before and after.
    fn head(&self) -> String {
        let robot = self.robot.as_deref();
        match &self.kind {
            Kind::Positions(diagnosis) => diagnosis.head(robot, self.rows),
            Kind::Torques(diagnosis) => diagnosis.head(robot, self.found.len()),
        }
    }

    /// The verdict in at most twelve words.
    pub(crate) fn verdict(&self) -> String {
        match &self.kind {
            Kind::Positions(diagnosis) => diagnosis.verdict(),
            Kind::Torques(diagnosis) => diagnosis.verdict(),
        }
    }

    /// The findings in a few words each, as the table has them.
    pub(super) fn in_few_words(&self) -> Vec<ShortFinding> {
        let rows = match &self.kind {
            Kind::Positions(diagnosis) => diagnosis.verdict.clock.as_deref() == Some("row"),
            Kind::Torques(_) => false,
        };
        self.found
            .iter()
            .map(|found| ShortFinding::of(found, rows))
            .collect()
    }

    /// In ten lines, with the largest findings alone.
    pub(super) fn in_short(&self, width: usize, store: &str) -> String {
        let next = self.next_step("HEAD", store);
        self.head()
            + &screen::found(self.in_few_words(), width)
            + &labelled("verdict", &self.verdict())
            + &next.map_or_else(String::new, |step| step.text(width))
    }

    /// What `calib diagnose` prints unless all is asked for: the verdict and a line a finding.
    pub fn short(&self, store: &str, columns: Option<usize>) -> String {
        let width = screen::width(columns);
        let mut text = self.head() + &labelled("verdict", &self.verdict());
        let (positions, wrong) = match &self.kind {
            Kind::Positions(diagnosis) => (Some(diagnosis), self.is_wrong_setup()),
            Kind::Torques(_) => (None, false),
        };
        let at = match positions {
            Some(diagnosis) if diagnosis.verdict.leftover_rms_mm.is_some() => " at the tool",
            _ => " rms",
        };
        for (short, found) in self.in_few_words().iter().zip(&self.found) {
            let label = format!("{:>3}.", found.rank);
            text.push_str(&match wrong {
                true => screen::sentence(&label, &found.statement, width),
                false => screen::ranked(found.rank, short, at, width),
            });
        }
        if let Some(diagnosis) = positions {
            if let Some(statement) = diagnosis.verdict.statement.as_ref().filter(|_| wrong)
                && self.found.is_empty()
            {
                text.push_str(&screen::sentence("", statement, width));
            }
            let aside = diagnosis.worst_aside();
            let aside = aside
                .iter()
                .map(|row| format!("{} ({})", row.point_id, length(row.size_mm)));
            text.push_str(&screen::names("set aside", &Vec::from_iter(aside), width));
        }
        let not_seen = self.statements(VerdictTopic::NotObservable);
        text.push_str(&screen::not_seen(&not_seen, width));
        let next = self
            .next_step(&self.run, store)
            .or_else(|| (!wrong).then(|| NextStep::correct(&self.run, store)));
        text.push_str(&next.map_or_else(String::new, |step| step.text(width)));
        let more = match positions {
            Some(_) => "--details prints numbers, places, formulas, reasons and every rival",
            None => "--details prints numbers, joints, noise and all that was decided",
        };
        text + &labelled("more", more)
    }

    /// What to do next, where the diagnosis says so.
    pub(super) fn next_step(&self, run: &str, store: &str) -> Option<NextStep> {
        match &self.kind {
            Kind::Positions(diagnosis) => self.next_of_positions(&diagnosis.verdict, store),
            Kind::Torques(_) => Some(NextStep {
                what: "feed torques forward".into(),
                command: Some(format!("calib compensate {run} motion.csv --torque{store}")),
            }),
        }
    }

    /// What decides the largest finding whose name is not certain; else what shows a joint that was not seen.
    fn next_of_positions(&self, verdict: &VerdictRow, store: &str) -> Option<NextStep> {
        let size = |short: &ShortFinding| short.size.as_ref().map_or(0.0, |(size, _)| *size);
        let found = self.in_few_words();
        let undecided = found
            .iter()
            .zip(&self.found)
            .filter(|(short, _)| short.instead.is_some());
        let mut undecided: Vec<(&ShortFinding, &Found)> = undecided.collect();
        undecided.sort_by(|a, b| size(b.0).total_cmp(&size(a.0)));
        let poses = self.poses(store);
        for (short, finding) in undecided {
            let of_finding =
                |(asked, ..): &&(&Found, &RivalRow, String)| asked.rank == finding.rank;
            if let Some((_, rival, command)) = poses.iter().find(of_finding) {
                let rival = words(&rival.effect, &rival.place);
                return Some(NextStep {
                    what: format!("measure poses to decide: {}, or {rival}", short.what),
                    command: Some(command.clone()),
                });
            }
        }
        if verdict.is_noise_inferred() {
            return Some(NextStep {
                what: "state `instrument` in `ingest`, and measure ten poses twice".into(),
                command: None,
            });
        }
        let joint = self
            .statements(VerdictTopic::NotObservable)
            .into_iter()
            .find(|line| line.starts_with("joint "))?;
        let (joint, why) = joint.split_once(": ")?;
        Some(NextStep {
            what: format!("{joint}: {}", why.rsplit("; ").next().unwrap_or(why)),
            command: None,
        })
    }
}
