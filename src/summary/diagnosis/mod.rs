//! A diagnosis from its tables, as text and as JSON.

mod in_short;

use super::own_effect::declared_in_yaml;
use super::robot_of;
use crate::diagnose::VerdictKind;
use crate::error::{Error, Result, counted};
use crate::pipeline::StageReport;
use crate::report::{DiagnosedTables, diagnosed_page};
use crate::shell::typed;
use crate::stage::{Diagnose, Stage};
use crate::store::Store;
use crate::table::{
    CauseGrid, Cells, FindingNumbers, Findings, FormRow, Forms, RivalRow, Rivals, ShareRow, Shares,
    Suspects, SuspectsRow, Table, TablesByKind, Verdict, VerdictRow, VerdictSentences,
    VerdictTopic, formula_in_words, is_separable_by_poses, of_kind,
};
use serde_json::{Value, json};

/// The tables of a diagnosis.
pub struct DiagnosisSummary {
    run: String,
    step: String,
    verdict: VerdictRow,
    sentences: VerdictSentences,
    findings: Findings,
    numbers: FindingNumbers,
    rivals: Rivals,
    shares: Shares,
    cells: Cells,
    forms: Forms,
    suspects: Suspects,
    /// Its name.
    robot: Option<String>,
    /// Rows of the recording.
    rows: u64,
}

/// Rivals of a finding that poses are offered for.
const ASKED: usize = 2;

/// Rows set aside that are named.
const ASIDE: usize = 4;

/// Places and variables that are shown.
const SHOWN: usize = 5;

fn table<T: Table + Default>(tables: &TablesByKind) -> Result<T> {
    Ok(of_kind(tables)?.unwrap_or_default())
}

fn rival_words(rival: &RivalRow) -> String {
    let probability = rival
        .probability
        .map(|value| format!(" {value:.2}"))
        .unwrap_or_default();
    format!("{} at {}{probability}", rival.effect, rival.place)
}

fn form_json(rows: &[FormRow]) -> Value {
    let numbers = rows.iter().map(|row| json!({ "name": row.number, "value": row.value, "unit": row.unit, "sigma": row.sigma }));
    let numbers: Vec<Value> = numbers.collect();
    rows.first().map_or(Value::Null, |row| {
        json!({
            "formula": row.formula, "price": row.price, "proposed": row.proposed, "numbers": numbers,
            "folds_rms_mm": row.folds_rms_mm, "curve_rms_mm": row.curve_rms_mm, "without_rms_mm": row.without_rms_mm,
        })
    })
}

impl DiagnosisSummary {
    /// Whether the files do not belong together as they are read.
    pub fn is_wrong_setup(&self) -> bool {
        self.verdict.verdict == VerdictKind::WrongSetup.name()
    }

    /// The proposed formula of a finding, of the first one that has one where none is named, as a file that declares it.
    pub fn effect_file(&self, finding: Option<i64>) -> Result<String> {
        let mut all = self
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
        let told = format!(
            "a formula for {} at {}, found in run {}",
            self.effect_of(row.rank),
            self.place_of(row.rank),
            self.run
        );
        declared_in_yaml(&row.declaration, &told)
    }

    fn effect_of(&self, rank: i64) -> &str {
        self.findings
            .0
            .iter()
            .find(|finding| finding.rank == rank)
            .map_or("-", |finding| &finding.effect)
    }

    fn place_of(&self, rank: i64) -> &str {
        self.findings
            .0
            .iter()
            .find(|finding| finding.rank == rank)
            .map_or("-", |finding| &finding.place)
    }

    /// What a stage `diagnose` of a run wrote. Fails where a table has left the store.
    pub fn read(run: &str, stage: &StageReport, store: &Store) -> Result<Self> {
        let load = |kind: &str| {
            let own = stage.outputs.iter().find(|output| output.kind == kind);
            own.map(|output| store.load(&output.table)).transpose()
        };
        let recording = stage.inputs.iter().find(|input| input.port == "recording");
        Ok(Self {
            robot: robot_of(stage, store)?,
            rows: recording.map_or(0, |input| input.table.rows),
            ..Self::of_tables(run, &stage.id, &load)?
        })
    }

    /// What a stage `diagnose` says by its tables; the robot's name and the rows of the recording are not in them.
    pub fn of_tables(run: &str, step: &str, tables: &TablesByKind) -> Result<Self> {
        let verdict: Verdict = table(tables)?;
        let verdict = verdict.0.into_iter().next();
        let verdict = verdict.ok_or_else(|| Error::Bug("a diagnosis without a verdict".into()))?;
        Ok(Self {
            run: run.into(),
            step: step.into(),
            verdict,
            sentences: table(tables)?,
            findings: table(tables)?,
            numbers: table(tables)?,
            rivals: table(tables)?,
            shares: table(tables)?,
            cells: table(tables)?,
            forms: table(tables)?,
            suspects: table(tables)?,
            robot: None,
            rows: 0,
        })
    }

    /// The same of a robot and a recording with so many rows.
    pub fn with_subject(self, robot: &str, rows: u64) -> Self {
        Self {
            robot: Some(robot.into()),
            rows,
            ..self
        }
    }

    fn said(&self, topic: VerdictTopic) -> Vec<&str> {
        self.sentences.about(&self.verdict.step, topic)
    }

    /// What to measure next, a sentence each, then what to type for poses that tell findings from their closest rivals.
    fn next(&self, store: &str) -> Option<Vec<String>> {
        let mut lines: Vec<String> = self
            .said(VerdictTopic::NextMeasurement)
            .into_iter()
            .map(String::from)
            .collect();
        if lines.is_empty() {
            return None;
        }
        let step = if self.step == Diagnose::NAME {
            String::new()
        } else {
            format!(" --step {}", typed(&self.step))
        };
        for finding in self
            .findings
            .0
            .iter()
            .filter(|finding| is_separable_by_poses(&finding.effect))
        {
            let mut own: Vec<&RivalRow> = self
                .rivals
                .0
                .iter()
                .filter(|rival| rival.rank == finding.rank)
                .collect();
            own.retain(|rival| is_separable_by_poses(&rival.effect));
            own.sort_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic));
            for rival in own.iter().take(ASKED) {
                let name = format!("{}@{}", rival.effect, rival.place);
                lines.push(format!(
                    "poses for finding {} or {} at {}: calib poses --run {}{step}{store} --separate {} {}",
                    finding.rank,
                    rival.effect,
                    rival.place,
                    self.run,
                    finding.rank,
                    typed(&name)
                ));
            }
        }
        Some(lines)
    }

    /// What could explain the most of the residual before the findings, more than chance, largest first.
    fn located(&self, by: &str) -> Vec<&ShareRow> {
        let all = self
            .shares
            .0
            .iter()
            .filter(|row| row.moment == "before" && row.by == by && row.delta_bic > 0.0);
        let mut all: Vec<&ShareRow> = all.collect();
        all.sort_by(|a, b| b.share.total_cmp(&a.share));
        all.truncate(SHOWN);
        all
    }

    /// `store` is where the run is, as one types it.
    pub fn document(&self, store: &str) -> Value {
        let v = &self.verdict;
        let errors = |mean: Option<f64>, rms: Option<f64>, max: Option<f64>| json!({ "validate_mean_mm": mean, "validate_rms_mm": rms, "validate_max_mm": max });
        let findings = self.findings.0.iter().map(|finding| {
            let numbers = self.numbers.0.iter().filter(|number| number.rank == finding.rank);
            let numbers = numbers.map(|n| json!({ "name": n.name, "value": n.value, "unit": n.unit, "sigma": n.sigma }));
            let rivals = self.rivals.0.iter().filter(|rival| rival.rank == finding.rank);
            let rivals =
                rivals.map(|rival| json!({ "effect": rival.effect, "where": rival.place, "delta_bic": rival.delta_bic, "probability": rival.probability }));
            let valid = match finding.valid_range() {
                Some((joint, range, unit)) => json!({ format!("q{joint}_{unit}"): range }),
                None => json!({}),
            };
            json!({
                "effect": finding.effect, "where": finding.place, "statement": finding.statement,
                "probability": finding.probability, "place_probability": finding.place_probability,
                "none_probability": finding.none_probability,
                "parameters": numbers.collect::<Vec<_>>(),
                "evidence": {
                    "f_statistic": finding.f_statistic, "p_value": finding.p_value, "delta_bic": finding.delta_bic,
                    "heldout_gain_mm": finding.heldout_gain_mm, "effect_rms_mm": finding.effect_rms_mm,
                },
                "forms": self.forms.of_finding(finding.rank).map(form_json).collect::<Vec<_>>(),
                "rivals": rivals.collect::<Vec<_>>(), "valid_range": valid,
            })
        });
        json!({
            "verdict": v.verdict,
            "statement": v.statement,
            "noise_floor_mm": v.noise_floor_mm,
            "noise_basis": v.noise_basis,
            "before": errors(v.before_mean_mm, v.before_rms_mm, v.before_max_mm),
            "after": errors(v.after_mean_mm, v.after_rms_mm, v.after_max_mm),
            "held_out": v.held_out,
            "clock": v.clock,
            "located": { "places": self.located_json("place"), "variables": self.located_json("variable") },
            "findings": findings.collect::<Vec<_>>(),
            "not_observable": self.said(VerdictTopic::NotObservable),
            "leftover": {
                "rms_mm": v.leftover_rms_mm, "chi_square": v.chi_square, "p_value": v.p_after, "signature": v.signature,
            },
            "next_measurements": self.next(store),
            "set_aside": self.aside().map(|row| json!({ "point_id": row.point_id, "set": row.set, "kind": row.kind, "size_mm": row.size_mm }))
                .collect::<Vec<_>>(),
            "noise": { "repeatability_rad": v.repeatability_rad, "repeats": v.repeats },
        })
    }

    /// Rows that are not fitted.
    fn aside(&self) -> impl Iterator<Item = &SuspectsRow> {
        self.suspects.0.iter().filter(|row| !row.used)
    }

    /// The same, the worst first.
    fn worst_aside(&self) -> Vec<&SuspectsRow> {
        let mut all: Vec<&SuspectsRow> = self.aside().collect();
        all.sort_by(|a, b| b.size_mm.total_cmp(&a.size_mm));
        all
    }

    /// How many rows are not fitted, and the worst of them by name.
    fn set_aside(&self) -> Option<String> {
        let all = self.worst_aside();
        let named: Vec<String> = all
            .iter()
            .take(ASIDE)
            .map(|row| {
                format!(
                    "{} of set {} {:.3} mm off",
                    row.point_id, row.set, row.size_mm
                )
            })
            .collect();
        let more = if all.len() > ASIDE {
            ", the worst of them"
        } else {
            ""
        };
        let which = counted(all.len(), "row");
        (!all.is_empty()).then(|| {
            format!(
                "{which} (not fitted; figures include those that are held out){more}: {}",
                named.join(", ")
            )
        })
    }

    fn located_json(&self, by: &str) -> Vec<Value> {
        let one = |row: &&ShareRow| json!({ "name": row.name, "share": row.share, "delta_bic": row.delta_bic });
        self.located(by).iter().map(one).collect()
    }

    /// The diagnosis as one HTML file; `store` as in [`Self::document`].
    pub fn page(&self, store: &str) -> Result<String> {
        let v = &self.verdict;
        let mm =
            |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.3}"));
        diagnosed_page(&DiagnosedTables {
            title: self.robot.as_deref().unwrap_or("diagnosis"),
            origin: [&self.run, &self.step],
            verdict: (
                v.verdict == VerdictKind::Explained.name(),
                v.statement
                    .clone()
                    .unwrap_or_else(|| v.verdict.replace('_', " ")),
            ),
            errors: vec![
                [
                    "before".into(),
                    mm(v.before_mean_mm),
                    mm(v.before_rms_mm),
                    mm(v.before_max_mm),
                ],
                [
                    "after".into(),
                    mm(v.after_mean_mm),
                    mm(v.after_rms_mm),
                    mm(v.after_max_mm),
                ],
                ["noise".into(), "-".into(), mm(v.noise_floor_mm), "-".into()],
            ],
            cells: &self.cells,
            findings: &self.findings,
            next: self.next(store).unwrap_or_default(),
        })
    }

    /// All of the diagnosis, as `calib diagnose --details` prints it; `store` is the `--store` of the commands that it proposes.
    pub fn text(&self, store: &str) -> String {
        let v = &self.verdict;
        let mm =
            |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.3}"));
        let rows = if v.held_out {
            "held-out points"
        } else {
            "fitted points (none are held out: flattered)"
        };
        let basis = v
            .noise_basis
            .as_ref()
            .map(|basis| format!(" (noise basis: {basis})"))
            .unwrap_or_default();
        let mut text = format!("{}{basis}\n", v.verdict.replace('_', " "));
        v.statement
            .iter()
            .for_each(|statement| text.push_str(&format!("{statement}\n")));
        text.push('\n');
        text.push_str(&format!("error in mm, {rows}: mean / rms / max\n"));
        for (name, mean, rms, max) in [
            ("before", v.before_mean_mm, v.before_rms_mm, v.before_max_mm),
            ("after", v.after_mean_mm, v.after_rms_mm, v.after_max_mm),
        ] {
            text.push_str(&format!(
                "  {name:6}  {:>8}  {:>8}  {:>8}\n",
                mm(mean),
                mm(rms),
                mm(max)
            ));
        }
        let assumed = if v.is_noise_assumed() {
            "  assumed: none is recorded, and no `instrument` is stated"
        } else {
            ""
        };
        text.push_str(&format!(
            "  noise   {:>8}  {:>8}{assumed}\n\n",
            "",
            mm(v.noise_floor_mm)
        ));
        for (by, what) in [("place", "where"), ("variable", "depends on")] {
            let all = self.located(by);
            let all: Vec<String> = all
                .iter()
                .map(|row| format!("{} {:.0} %", row.name, row.share * 100.0))
                .collect();
            if !all.is_empty() {
                text.push_str(&format!("{what:10}  {}\n", all.join(", ")));
            }
        }
        if !self.shares.0.is_empty() {
            text.push_str("            (of the squared residual, what one cause there could explain at most)\n\n");
        }
        let grid = CauseGrid::of(&self.cells, &self.findings).text();
        if !grid.is_empty() {
            text.push_str(&format!("{grid}            (rms at the tool of the findings, by place and kind of variable)\n\n"));
        }
        for finding in &self.findings.0 {
            text.push_str(&format!("{}. {}\n", finding.rank, finding.statement));
            if let (Some(name), Some(place), Some(none)) = (
                finding.probability,
                finding.place_probability,
                finding.none_probability,
            ) {
                let (effect, at) = (&finding.effect, &finding.place);
                text.push_str(&format!("   probability: {effect} {name:.2}, at {at} {place:.2}, none of the names {none:.2}\n"));
            }
            for rows in self.forms.of_finding(finding.rank) {
                let proposed = if rows.iter().any(|row| row.proposed) {
                    ", proposed"
                } else {
                    ""
                };
                let (price, folds) = rows
                    .first()
                    .map_or((0, 0.0), |row| (row.price, row.folds_rms_mm));
                let words = formula_in_words(rows);
                text.push_str(&format!(
                    "   formula: {words} ({price} parts, {folds:.4} mm cross-validated{proposed})\n"
                ));
            }
            let rivals: Vec<String> = self.rivals_of(finding).map(rival_words).collect();
            if !rivals.is_empty() {
                text.push_str(&format!(
                    "   these data cannot separate it from: {}\n",
                    rivals.join(", ")
                ));
            }
        }
        for line in self.said(VerdictTopic::NotObservable) {
            text.push_str(&format!("not observable: {line}\n"));
        }
        text.extend(
            v.signature
                .iter()
                .map(|signature| format!("what is left: {signature}\n")),
        );
        text.extend(self.set_aside().map(|rows| format!("set aside: {rows}\n")));
        for line in self.next(store).into_iter().flatten() {
            text.push_str(&format!("measure next: {line}\n"));
        }
        text
    }
}
