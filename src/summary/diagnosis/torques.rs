//! A diagnosis of torques: its verdict, the errors of each joint, pushes on the arm.

use crate::diagnose::VerdictKind;
use crate::effect::figure;
use crate::error::{Error, Result};
use crate::summary::run::filled;
use crate::summary::short_finding::Found;
use crate::summary::{labelled, screen};
use crate::table::{
    ContactRow, Contacts, FindingNumberRow, FindingNumbers, JointTorqueRow, JointTorques, RivalRow,
    Rivals, TablesByKind, TorqueFindingRow, TorqueFindings, TorqueVerdict, TorqueVerdictRow,
    of_kind, picked, picked_of,
};
use minijinja::context;
use minijinja::value::Serde;
use serde_json::{Value, json};

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

    /// What is left at each joint, a line each.
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
