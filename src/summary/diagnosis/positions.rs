//! A diagnosis of positions: its verdict, errors and where they are, rows set aside.
//!
//! A diagnosis of torques: its verdict, the errors of each joint, pushes on the arm.

use crate::diagnose::VerdictKind;
use crate::effect::{figure, names};
use crate::error::{Error, Result, counted};
use crate::summary::estimate::{angle, length};
use crate::summary::short_finding::Found;
use crate::summary::{labelled, screen};
use crate::table::{
    CauseGrid, Cells, ContactRow, Contacts, FindingNumberRow, FindingNumbers, FindingRow, Findings,
    FormRow, Forms, JointTorqueRow, JointTorques, RivalRow, Rivals, ShareRow, Shares, Suspects,
    SuspectsRow, TablesByKind, TorqueFindingRow, TorqueFindings, TorqueVerdict, TorqueVerdictRow,
    Verdict, VerdictRow, formula_in_words, of_kind, picked, picked_of,
};
use crate::text::filled;
use crate::units::Unit;
use minijinja::context;
use minijinja::value::Serde;
use serde_json::{Value, json};

/// Rows set aside that are named.
const ASIDE: usize = 4;

/// Places and variables that are shown.
const SHOWN: usize = 5;

/// Tables of a diagnosis of positions but findings and sentences.
pub(super) struct Positions {
    pub(crate) verdict: VerdictRow,
    pub(crate) findings: Findings,
    pub(crate) cells: Cells,
    pub(crate) forms: Forms,
    shares: Shares,
    suspects: Suspects,
}

impl Positions {
    pub fn read(tables: &TablesByKind) -> Result<Self> {
        let verdict: Option<Verdict> = of_kind(tables)?;
        let verdict = verdict.and_then(|verdict| verdict.0.into_iter().next());
        Ok(Self {
            verdict: verdict.ok_or_else(|| Error::Bug("a diagnosis without a verdict".into()))?,
            findings: of_kind(tables)?.unwrap_or_default(),
            cells: of_kind(tables)?.unwrap_or_default(),
            forms: of_kind(tables)?.unwrap_or_default(),
            shares: of_kind(tables)?.unwrap_or_default(),
            suspects: of_kind(tables)?.unwrap_or_default(),
        })
    }

    pub(crate) fn found(&self, numbers: &FindingNumbers, rivals: &Rivals) -> Vec<Found> {
        let one = |row: &FindingRow| {
            let evidence = "f_statistic p_value delta_bic heldout_gain_mm effect_rms_mm";
            let mut found = Found::of(row, evidence, numbers, rivals);
            found.document["forms"] = json!(self.forms.document(row.rank));
            if let Some((joint, range, unit)) = row.valid_range() {
                found.document["valid_range"] = json!({ format!("q{joint}_{unit}"): range });
            }
            found.forms = serde_json::from_str(&row.forms).unwrap_or_default();
            let by_length = row.effect_rms_mm.map(|mm| (mm, length(mm)));
            found.size = by_length.or_else(|| row.effect_rms_rad.map(|rad| (rad, angle(rad))));
            found
        };
        self.findings.0.iter().map(one).collect()
    }

    /// The verdict in at most twelve words.
    pub(crate) fn verdict(&self) -> String {
        let v = &self.verdict;
        let size = |mm: Option<f64>, rad: Option<f64>| {
            mm.map(length)
                .or_else(|| rad.map(angle))
                .unwrap_or_default()
        };
        let left = size(v.leftover_rms_mm, v.leftover_rms_rad);
        let noise = size(v.noise_floor_mm, v.noise_floor_rad);
        let noise = match v.noise_basis.as_deref() {
            Some("repeats") => format!("repeats show {noise}"),
            Some("instrument") => format!("the noise is {noise}"),
            _ => "the noise is not known".into(),
        };
        let is = |kind: VerdictKind| v.verdict == kind.name();
        let nameless = self
            .findings
            .0
            .iter()
            .filter(|finding| finding.effect == names::UNKNOWN)
            .count();
        match v.after_rms_mm.filter(|_| v.held_out) {
            _ if is(VerdictKind::WrongSetup) => {
                "wrong set-up: correct it first; nothing was calibrated".into()
            }
            _ if is(VerdictKind::NotAsked) => "not asked: too few points were fitted".into(),
            _ if is(VerdictKind::NothingMissing) => {
                format!("nothing missing: {left} rms remain, {noise}")
            }
            _ if is(VerdictKind::Explained) => format!("explained: {left} rms remain, {noise}"),
            _ if nameless > 0 => {
                format!(
                    "unexplained in part: {left} rms remain, {nameless} of {} causes unnamed",
                    self.findings.0.len()
                )
            }
            Some(held_out) => format!(
                "unexplained: {left} rms remain at fitted points, {} at held-out ones",
                length(held_out)
            ),
            None => format!("unexplained: {left} rms remain, {noise}"),
        }
    }

    /// What was measured, and the errors before and after.
    pub(crate) fn head(&self, robot: Option<&str>, rows: u64) -> String {
        let v = &self.verdict;
        let mut text = screen::measured(
            robot,
            &format!("{rows} points, {} fitted", v.points),
            v.noise_floor_mm
                .map(length)
                .or_else(|| v.noise_floor_rad.map(angle))
                .map(|size| screen::noise(&size, v.noise_basis.as_deref()))
                .as_deref(),
        );
        let rows = if v.held_out {
            "held out"
        } else {
            "fitted points: flattered"
        };
        let [before, after] = [
            format!("geometry identified, {rows}"),
            screen::with_findings(self.findings.0.len()).to_string(),
        ];
        let pair = |mean: Option<f64>, max: Option<f64>| Some([mean?, max?]);
        if let (Some(first), Some(last)) = (
            pair(v.before_mean_mm, v.before_max_mm),
            pair(v.after_mean_mm, v.after_max_mm),
        ) {
            let least = first[0].min(last[0]);
            text.push_str(&screen::errors("before", first, least, &before));
            text.push_str(&screen::errors("after", last, least, &after));
        }
        if let (Some(first), Some(last)) = (v.before_rms_rad, v.after_rms_rad) {
            for (label, rad, noun) in [("before", first, &before), ("after", last, &after)] {
                text.push_str(&labelled(
                    label,
                    &format!("{:>7.1} arcsec rms  {noun}", Unit::Arcsecond.from_si(rad)),
                ));
            }
        }
        text
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

    /// What `--json` has of it.
    pub(crate) fn document(&self) -> Value {
        let v = &self.verdict;
        let columns = "verdict statement noise_floor_mm noise_basis held_out clock";
        let mut document = picked(v, columns);
        let columns = "validate_mean_mm=before_mean_mm validate_rms_mm=before_rms_mm validate_max_mm=before_max_mm";
        document["before"] = picked(v, columns);
        document["after"] = picked(v, &columns.replace("before", "after"));
        let located = |by: &str| picked_of(self.located(by), "name share delta_bic");
        document["located"] =
            json!({ "places": located("place"), "variables": located("variable") });
        let columns = "rms_mm=leftover_rms_mm chi_square p_value=p_after signature";
        document["leftover"] = picked(v, columns);
        document["set_aside"] = picked_of(self.aside(), "point_id set kind size_mm");
        document["noise"] = picked(v, "repeatability_rad repeats");
        document
    }

    /// Rows that are not fitted.
    fn aside(&self) -> impl Iterator<Item = &SuspectsRow> {
        self.suspects.0.iter().filter(|row| !row.used)
    }

    /// The same, the worst first.
    pub(crate) fn worst_aside(&self) -> Vec<&SuspectsRow> {
        let mut all: Vec<&SuspectsRow> = self.aside().collect();
        all.sort_by(|a, b| b.size_mm.total_cmp(&a.size_mm));
        all
    }

    /// How many rows are not fitted, and the worst of them by name.
    pub(crate) fn set_aside(&self) -> Option<String> {
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

    /// Verdict, errors and where they are, as `calib diagnose --details` prints them before the findings.
    pub fn text(&self) -> String {
        let located = [("place", "where"), ("variable", "depends on")]
            .map(|(by, what)| (what, self.located(by)));
        let about = context! {
            v => Serde(&self.verdict), assumed => self.verdict.is_noise_assumed(), located => Serde(located),
            shares => !self.shares.0.is_empty(), grid => CauseGrid::of(&self.cells, &self.findings).text(),
        };
        filled(include_str!("../text/positions.txt"), about)
    }

    /// The formulas of a finding, a line each.
    pub(crate) fn formulas(&self, rank: i64) -> String {
        let line = |rows: &[FormRow]| {
            let proposed = if rows.iter().any(|row| row.proposed) {
                ", proposed"
            } else {
                ""
            };
            let words = formula_in_words(rows);
            let (price, folds) = (rows[0].price, rows[0].folds_rms_mm);
            format!(
                "   formula: {words} ({price} parts, {folds:.4} mm cross-validated{proposed})\n"
            )
        };
        self.forms.of_finding(rank).map(line).collect()
    }
}

/// Tables of a diagnosis of torques but findings and sentences.
pub(super) struct Torques {
    pub(crate) verdict: TorqueVerdictRow,
    findings: TorqueFindings,
    joints: Vec<JointTorqueRow>,
    contacts: Contacts,
}

impl Torques {
    pub fn read(tables: &TablesByKind) -> Result<Self> {
        let verdict: Option<TorqueVerdict> = of_kind(tables)?;
        let verdict = verdict.and_then(|verdict| verdict.0.into_iter().next());
        let joints: JointTorques = of_kind(tables)?.unwrap_or_default();
        Ok(Self {
            verdict: verdict.ok_or_else(|| Error::Bug("a diagnosis without a verdict".into()))?,
            findings: of_kind(tables)?.unwrap_or_default(),
            joints: joints.0,
            contacts: of_kind(tables)?.unwrap_or_default(),
        })
    }

    pub(crate) fn found(&self, numbers: &FindingNumbers, rivals: &Rivals) -> Vec<Found> {
        let one = |row: &TorqueFindingRow| {
            let evidence = "gain f_statistic p_value delta_bic heldout_gain_nm effect_rms_nm";
            let mut found = Found::of(row, evidence, numbers, rivals);
            let chance = |rival: &RivalRow| rival.probability.unwrap_or_default();
            let by_chance = |a: &RivalRow, b: &RivalRow| chance(b).total_cmp(&chance(a));
            found.rivals.sort_by(by_chance);
            let size = Some(row.effect_rms_nm).filter(|nm| *nm > 0.0);
            found.size = size.map(|nm| (nm, format!("{} Nm", figure(nm, 1))));
            found
        };
        self.findings.0.iter().map(one).collect()
    }

    /// The verdict in at most twelve words.
    pub(crate) fn verdict(&self) -> String {
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

    /// What was measured, and the errors before and after.
    pub(crate) fn head(&self, robot: Option<&str>, found: usize) -> String {
        let v = &self.verdict;
        let rows = format!(
            "{} rows at {:.0} Hz, low-pass {:.1} Hz",
            v.rows, v.rate_hz, v.cutoff_hz
        );
        let rows = screen::measured(robot, &rows, None);
        let subject = if v.held_out {
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
        rows + &line("before", v.before_nrmse, &format!("rigid arm, {subject}"))
            + &line("after", v.after_nrmse, screen::with_findings(found))
    }

    /// What `--json` has of it.
    pub(crate) fn document(&self) -> Value {
        let v = &self.verdict;
        let columns =
            "verdict statement inertials base_parameters signal cutoff_hz rate_hz held_out";
        let mut document = picked(v, columns);
        let columns = "joint rms_nm=before_rms_nm nrmse=before_nrmse moving_rms_nm=before_moving_rms_nm rest_rms_nm=before_rest_rms_nm";
        for (when, nrmse) in [("before", v.before_nrmse), ("after", v.after_nrmse)] {
            let joints = picked_of(&self.joints, &columns.replace("before", when));
            document[when] = json!({ "validate_nrmse": nrmse, "joints": joints });
        }
        let contact = |row: &ContactRow| {
            let mut contact = picked(row, "start_s end_s joints");
            contact["force_n"] = json!([row.force_x_n, row.force_y_n, row.force_z_n]);
            contact["sigma_n"] = json!([row.sigma_x_n, row.sigma_y_n, row.sigma_z_n]);
            contact
        };
        document["contacts"] = self.contacts.0.iter().map(contact).collect();
        document["noise"] = picked_of(&self.joints, "joint sigma_nm=noise_nm autocorrelation");
        let columns = "joint rms_nm=leftover_rms_nm over_noise=leftover_over_noise signature";
        document["leftover"] = picked_of(&self.joints, columns);
        document
    }

    /// Verdict and errors, as `calib diagnose --details` prints them before the findings.
    pub fn text(&self) -> String {
        let about = context! { v => Serde(&self.verdict), joints => Serde(&self.joints) };
        filled(include_str!("../text/torques.txt"), about)
    }

    /// The residual at each joint, a line each.
    pub(crate) fn left(&self) -> String {
        let line = |row: &JointTorqueRow| {
            let left = row.signature.as_ref()?;
            Some(format!("residual at joint {}: {left}\n", row.joint))
        };
        self.joints.iter().filter_map(line).collect()
    }
}

/// The numbers of a finding, a line each.
pub(super) fn numbers(found: &Found) -> String {
    let line = |number: &FindingNumberRow| {
        let sigma = number.sigma.map(|sigma| format!(" +- {sigma:.3}"));
        let sigma = sigma.unwrap_or_default();
        format!(
            "   {} {:.4}{sigma} {}\n",
            number.name, number.value, number.unit
        )
    };
    found.numbers.iter().map(line).collect()
}
