//! A diagnosis of torques from its tables, as text and as JSON.

use super::screen::{self, NextStep};
use super::short_finding::{FindingNumber, FoundCause, NamedRival, ShortFinding};
use super::{labelled, robot_of};
use crate::diagnose::VerdictKind;
use crate::effect::figure;
use crate::error::{Error, Result};
use crate::pipeline::StageReport;
use crate::store::Store;
use crate::table::{
    ContactRow, Contacts, JointTorqueRow, JointTorques, Table, TorqueFindingRow, TorqueFindings,
    TorqueNumberRow, TorqueNumbers, TorqueRivalRow, TorqueRivals, TorqueVerdict, TorqueVerdictRow,
    VerdictSentences, VerdictTopic,
};
use serde_json::{Value, json};

/// The tables of a diagnosis of torques.
pub struct TorqueSummary {
    verdict: TorqueVerdictRow,
    sentences: VerdictSentences,
    findings: Vec<TorqueFindingRow>,
    numbers: Vec<TorqueNumberRow>,
    rivals: Vec<TorqueRivalRow>,
    joints: Vec<JointTorqueRow>,
    contacts: Vec<ContactRow>,
    /// Its name.
    robot: Option<String>,
    run: String,
}

impl TorqueSummary {
    /// What a stage `diagnose_torques` of a run wrote. Fails where a table has left the store.
    pub fn read(run: &str, stage: &StageReport, store: &Store) -> Result<Self> {
        fn table<T: Table>(stage: &StageReport, store: &Store) -> Result<T> {
            let own = stage.outputs.iter().find(|output| output.kind == T::KIND);
            let own = own.ok_or_else(|| {
                Error::Bug(format!(
                    "a diagnosis of torques without its table {}",
                    T::KIND
                ))
            })?;
            T::from_frame(&store.load(&own.table)?)
        }
        let verdict: TorqueVerdict = table(stage, store)?;
        let verdict = verdict
            .0
            .into_iter()
            .next()
            .ok_or_else(|| Error::Bug("a diagnosis without a verdict".into()))?;
        Ok(Self {
            verdict,
            sentences: table(stage, store)?,
            findings: table::<TorqueFindings>(stage, store)?.0,
            numbers: table::<TorqueNumbers>(stage, store)?.0,
            rivals: table::<TorqueRivals>(stage, store)?.0,
            joints: table::<JointTorques>(stage, store)?.0,
            contacts: table::<Contacts>(stage, store)?.0,
            robot: robot_of(stage, store)?,
            run: run.into(),
        })
    }

    /// Whether files and robot do not belong together as they are read.
    pub fn is_wrong_setup(&self) -> bool {
        self.verdict.is_wrong_setup()
    }

    /// The verdict in at most twelve words.
    pub fn verdict(&self) -> String {
        let worst = self
            .joints
            .iter()
            .max_by(|a, b| a.leftover_over_noise.total_cmp(&b.leftover_over_noise));
        let is = |kind: VerdictKind| self.verdict.verdict == kind.name();
        match worst {
            _ if is(VerdictKind::WrongSetup) => {
                "wrong set-up: correct it first; nothing was identified".into()
            }
            _ if is(VerdictKind::NothingMissing) => {
                "nothing missing: the rigid arm explains the torques".into()
            }
            _ if is(VerdictKind::Explained) => "explained: noise alone remains".into(),
            Some(row) if is(VerdictKind::Unexplained) => {
                format!(
                    "unexplained: {:.1} times the noise remains at joint {}",
                    row.leftover_over_noise, row.joint
                )
            }
            _ => self.verdict.verdict.replace('_', " "),
        }
    }

    /// The findings in a few words each, as the table has them.
    pub(super) fn found(&self) -> Vec<ShortFinding> {
        self.findings
            .iter()
            .map(|finding| ShortFinding::of(self.cause(finding), false))
            .collect()
    }

    fn cause<'a>(&'a self, finding: &'a TorqueFindingRow) -> FoundCause<'a> {
        let numbers = self
            .numbers
            .iter()
            .filter(|number| number.rank == finding.rank);
        let rival = |rival: &'a TorqueRivalRow| NamedRival {
            effect: &rival.effect,
            place: &rival.place,
            probability: rival.probability,
        };
        let size = Some(finding.effect_rms_nm).filter(|nm| *nm > 0.0);
        FoundCause {
            effect: &finding.effect,
            place: &finding.place,
            statement: &finding.statement,
            forms: "",
            numbers: numbers
                .map(|n| FindingNumber {
                    name: &n.name,
                    value: n.value,
                    unit: &n.unit,
                    sigma: n.sigma,
                })
                .collect(),
            probability: Some(finding.probability),
            rivals: self
                .rivals_of(finding.rank)
                .into_iter()
                .map(rival)
                .collect(),
            none: finding.none_probability,
            size: size.map(|nm| (nm, format!("{} Nm", figure(nm, 1)))),
        }
    }

    /// What was measured, and the errors before and after.
    pub(super) fn head(&self) -> String {
        let v = &self.verdict;
        let rows = format!(
            "{} rows at {:.0} Hz, low-pass {:.1} Hz",
            v.rows, v.rate_hz, v.cutoff_hz
        );
        let rows = screen::measured(self.robot.as_deref(), &rows, None);
        let of = if v.held_out {
            "held out"
        } else {
            "fitted rows: flattered"
        };
        let line = |label: &str, share: f64, what: &str| {
            labelled(
                label,
                &format!(
                    "{:>7.2} % of the torques' rms, mean over joints  {what}",
                    100.0 * share
                ),
            )
        };
        rows + &line("before", v.before_nrmse, &format!("rigid arm, {of}"))
            + &line(
                "after",
                v.after_nrmse,
                screen::with_findings(self.findings.len()),
            )
    }

    fn rivals_of(&self, rank: i64) -> Vec<&TorqueRivalRow> {
        let mut own: Vec<&TorqueRivalRow> = self
            .rivals
            .iter()
            .filter(|rival| rival.rank == rank)
            .collect();
        own.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        own
    }

    fn said(&self, topic: VerdictTopic) -> Vec<&str> {
        self.sentences.about(&self.verdict.step, topic)
    }

    /// The diagnosis as one document.
    pub fn document(&self) -> Value {
        let v = &self.verdict;
        let findings = self.findings.iter().map(|finding| {
            let numbers = self.numbers.iter().filter(|number| number.rank == finding.rank);
            let numbers = numbers.map(|n| json!({ "name": n.name, "value": n.value, "unit": n.unit, "sigma": n.sigma }));
            let rivals = self.rivals_of(finding.rank).into_iter().map(|rival| {
                json!({ "effect": rival.effect, "where": rival.place, "delta_bic": rival.delta_bic, "probability": rival.probability })
            });
            json!({
                "effect": finding.effect, "where": finding.place, "statement": finding.statement,
                "probability": finding.probability, "place_probability": finding.place_probability,
                "none_probability": finding.none_probability,
                "parameters": numbers.collect::<Vec<_>>(),
                "evidence": {
                    "gain": finding.gain, "f_statistic": finding.f_statistic, "p_value": finding.p_value,
                    "delta_bic": finding.delta_bic, "heldout_gain_nm": finding.heldout_gain_nm,
                    "effect_rms_nm": finding.effect_rms_nm,
                },
                "rivals": rivals.collect::<Vec<_>>(), "valid_range": {},
            })
        });
        let errors = |nrmse: f64, of: fn(&JointTorqueRow) -> [Option<f64>; 4]| {
            let each = self.joints.iter().map(|row| {
                let [rms, nrmse, moving, rest] = of(row);
                json!({ "joint": row.joint, "rms_nm": rms, "nrmse": nrmse, "moving_rms_nm": moving, "rest_rms_nm": rest })
            });
            json!({ "validate_nrmse": nrmse, "joints": each.collect::<Vec<_>>() })
        };
        let before = errors(v.before_nrmse, |row| {
            [
                Some(row.before_rms_nm),
                Some(row.before_nrmse),
                row.before_moving_rms_nm,
                row.before_rest_rms_nm,
            ]
        });
        let after = errors(v.after_nrmse, |row| {
            [
                Some(row.after_rms_nm),
                Some(row.after_nrmse),
                row.after_moving_rms_nm,
                row.after_rest_rms_nm,
            ]
        });
        let noise = self
            .joints
            .iter()
            .map(|row| json!({ "joint": row.joint, "sigma_nm": row.noise_nm, "autocorrelation": row.autocorrelation }));
        let leftover = self.joints.iter().map(|row| {
            json!({
                "joint": row.joint, "rms_nm": row.leftover_rms_nm, "over_noise": row.leftover_over_noise, "signature": row.signature,
            })
        });
        let contacts = self.contacts.iter().map(|row| {
            json!({
                "start_s": row.start_s, "end_s": row.end_s, "joints": row.joints,
                "force_n": [row.force_x_n, row.force_y_n, row.force_z_n], "sigma_n": [row.sigma_x_n, row.sigma_y_n, row.sigma_z_n],
            })
        });
        json!({
            "verdict": v.verdict, "statement": v.statement,
            "inertials": v.inertials, "base_parameters": v.base_parameters, "signal": v.signal,
            "cutoff_hz": v.cutoff_hz, "rate_hz": v.rate_hz, "held_out": v.held_out,
            "before": before, "after": after,
            "findings": findings.collect::<Vec<_>>(),
            "contacts": contacts.collect::<Vec<_>>(),
            "withdrawn": self.said(VerdictTopic::Withdrawn),
            "not_observable": self.said(VerdictTopic::NotObservable),
            "noise": noise.collect::<Vec<_>>(),
            "leftover": leftover.collect::<Vec<_>>(),
            "remarks": self.said(VerdictTopic::Remark),
        })
    }

    fn errors(&self) -> String {
        let v = &self.verdict;
        let rows = if v.held_out {
            "held-out rows"
        } else {
            "fitted rows (none are held out: flattered)"
        };
        format!(
            "{:.3} -> {:.3} of the torques' own rms, mean over joints; {rows}, {} at {:.1} Hz, low-pass {:.1} Hz",
            v.before_nrmse, v.after_nrmse, v.rows, v.rate_hz, v.cutoff_hz
        )
    }

    /// Torques to be fed forward by the model of a run.
    pub(super) fn next_step(run: &str, store: &str) -> NextStep {
        let command = format!("calib compensate {run} motion.csv --torque{store}");
        NextStep {
            what: "feed torques forward".into(),
            command: Some(command),
        }
    }

    /// What `calib diagnose` prints unless all is asked for.
    pub fn short(&self, store: &str, width: usize) -> String {
        let mut text = self.head() + &labelled("verdict", &self.verdict());
        for (finding, row) in self.found().iter().zip(&self.findings) {
            text.push_str(&screen::ranked(row.rank, finding, " rms", width));
        }
        text.push_str(&screen::withdrawn(self.said(VerdictTopic::Withdrawn).len()));
        text.push_str(&screen::not_seen(
            &self.said(VerdictTopic::NotObservable),
            width,
        ));
        text.push_str(&Self::next_step(&self.run, store).text(width));
        text + &labelled(
            "more",
            "--details prints numbers, joints, noise and all that was decided",
        )
    }

    /// All of the diagnosis, as `calib diagnose --details` prints it.
    pub fn text(&self) -> String {
        let v = &self.verdict;
        let mut text = format!(
            "{}: {}\n\nerror: {}\n",
            v.verdict.replace('_', " "),
            v.statement,
            self.errors()
        );
        text.push_str(
            "joint   rms before   after   moving   resting   noise  (Nm)  autocorrelation\n",
        );
        let nm =
            |value: Option<f64>| value.map_or_else(|| "-".into(), |value| format!("{value:.3}"));
        for row in &self.joints {
            text.push_str(&format!(
                "{:>5}   {:>10} {:>7}  {:>7}   {:>7} {:>7}        {:.1}\n",
                row.joint,
                nm(Some(row.before_rms_nm)),
                nm(Some(row.after_rms_nm)),
                nm(row.after_moving_rms_nm),
                nm(row.after_rest_rms_nm),
                nm(Some(row.noise_nm)),
                row.autocorrelation
            ));
        }
        text.push('\n');
        for finding in &self.findings {
            text.push_str(&format!("{}. {}\n", finding.rank, finding.statement));
            text.push_str(&format!(
                "   probability: {} {:.2}, at {} {:.2}, none of the names {:.2}\n",
                finding.effect,
                finding.probability,
                finding.place,
                finding.place_probability,
                finding.none_probability
            ));
            for number in self
                .numbers
                .iter()
                .filter(|number| number.rank == finding.rank)
            {
                let sigma = number
                    .sigma
                    .map_or_else(String::new, |sigma| format!(" +- {sigma:.3}"));
                text.push_str(&format!(
                    "   {} {:.4}{sigma} {}\n",
                    number.name, number.value, number.unit
                ));
            }
            let rivals: Vec<String> = self
                .rivals_of(finding.rank)
                .iter()
                .map(|rival| {
                    format!(
                        "{} at {} {:.2}",
                        rival.effect, rival.place, rival.probability
                    )
                })
                .collect();
            if !rivals.is_empty() {
                text.push_str(&format!(
                    "   these data cannot separate it from: {}\n",
                    rivals.join(", ")
                ));
            }
        }
        for (label, topic) in [
            ("withdrawn", VerdictTopic::Withdrawn),
            ("not observable", VerdictTopic::NotObservable),
        ] {
            self.said(topic)
                .into_iter()
                .for_each(|line| text.push_str(&format!("{label}: {line}\n")));
        }
        for row in &self.joints {
            text.extend(
                row.signature
                    .iter()
                    .map(|left| format!("what is left at joint {}: {left}\n", row.joint)),
            );
        }
        self.said(VerdictTopic::Remark)
            .into_iter()
            .for_each(|line| text.push_str(&format!("{line}\n")));
        text
    }
}
