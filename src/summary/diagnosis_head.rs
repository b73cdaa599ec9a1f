//! The first lines of a diagnosis: what was measured, the errors before and after, and the verdict in a few words.
//!
//! One function a kind, since each has its own measure of an error: positions a length at held-out points, torques a share of what was measured
//! (joints of an arm differ by a factor of a hundred), drives the angle by which a roll-out goes astray.

use super::diagnosis::Subject;
use super::estimate::{angle, length};
use super::labelled;
use super::screen;
use crate::diagnose::VerdictKind;
use crate::effect::names;
use crate::table::{DriveVerdictRow, FindingRow, JointTorqueRow, TorqueVerdictRow, VerdictRow};
use crate::units::Unit;

/// A length, or an angle where no length was measured.
fn size(mm: Option<f64>, rad: Option<f64>) -> Option<String> {
    mm.map(length).or_else(|| rad.map(angle))
}

/// The verdict in at most twelve words.
pub(super) fn verdict_of_positions(v: &VerdictRow, findings: &[FindingRow]) -> String {
    let left = size(v.leftover_rms_mm, v.leftover_rms_rad).unwrap_or_default();
    let noise = size(v.noise_floor_mm, v.noise_floor_rad).unwrap_or_default();
    let noise = match v.noise_basis.as_deref() {
        Some("repeats") => format!("repeats show {noise}"),
        Some("instrument") => format!("the noise is {noise}"),
        _ => "the noise is not known".into(),
    };
    let is = |kind: VerdictKind| v.verdict == kind.name();
    let is_nameless = |finding: &&FindingRow| finding.effect == names::UNKNOWN;
    let nameless = findings.iter().filter(is_nameless).count();
    match v.after_rms_mm.filter(|_| v.held_out) {
        _ if is(VerdictKind::WrongSetup) => {
            "wrong set-up: correct it first; nothing was calibrated".into()
        }
        _ if is(VerdictKind::NotAsked) => "not asked: too few points were fitted".into(),
        _ if is(VerdictKind::NothingMissing) => {
            format!("nothing missing: {left} rms remain, {noise}")
        }
        _ if is(VerdictKind::Explained) => format!("explained: {left} rms remain, {noise}"),
        _ if nameless > 0 => format!(
            "unexplained in part: {left} rms remain, {nameless} of {} causes unnamed",
            findings.len()
        ),
        Some(held_out) => format!(
            "unexplained: {left} rms remain at fitted points, {} at held-out ones",
            length(held_out)
        ),
        None => format!("unexplained: {left} rms remain, {noise}"),
    }
}

/// The same of torques.
pub(super) fn verdict_of_torques(v: &TorqueVerdictRow, joints: &[JointTorqueRow]) -> String {
    let by_noise = |a: &&JointTorqueRow, b: &&JointTorqueRow| {
        a.leftover_over_noise.total_cmp(&b.leftover_over_noise)
    };
    let is = |kind: VerdictKind| v.verdict == kind.name();
    match joints.iter().max_by(by_noise) {
        _ if is(VerdictKind::WrongSetup) => {
            "wrong set-up: correct it first; nothing was identified".into()
        }
        _ if is(VerdictKind::NothingMissing) => {
            "nothing missing: the rigid arm explains the torques".into()
        }
        _ if is(VerdictKind::Explained) => "explained: noise alone remains".into(),
        Some(row) if is(VerdictKind::Unexplained) => format!(
            "unexplained: {:.1} times the noise remains at joint {}",
            row.leftover_over_noise, row.joint
        ),
        _ => v.verdict.replace('_', " "),
    }
}

/// What the errors after a diagnosis are of.
fn with_findings(count: usize) -> &'static str {
    match count {
        0 => "nothing found",
        _ => "with the findings",
    }
}

/// What was measured, and the errors before and after.
pub(super) fn head_of_positions(subject: &Subject, v: &VerdictRow, found: usize) -> String {
    let noise = size(v.noise_floor_mm, v.noise_floor_rad);
    let noise = noise.map(|size| screen::noise(&size, v.noise_basis.as_deref()));
    let rows = format!("{} points, {} fitted", subject.rows, v.points);
    let mut text = screen::measured(subject.robot.as_deref(), &rows, noise.as_deref());
    let rows = match v.held_out {
        true => "held out",
        false => "fitted points: flattered",
    };
    let before = format!("geometry identified, {rows}");
    let all = [
        (
            "before",
            before.as_str(),
            v.before_mean_mm,
            v.before_max_mm,
            v.before_rms_rad,
        ),
        (
            "after",
            with_findings(found),
            v.after_mean_mm,
            v.after_max_mm,
            v.after_rms_rad,
        ),
    ];
    let lengths = all.map(|(label, what, mean, max, _)| Some((label, what, [mean?, max?])));
    if let [Some(first), Some(last)] = lengths {
        let least = first.2[0].min(last.2[0]);
        let lines = [first, last];
        text.extend(lines.map(|(label, what, mm)| screen::errors(label, mm, least, what)));
    }
    let angles = all.map(|(label, what, _, _, rad)| Some((label, what, rad?)));
    if let [Some(first), Some(last)] = angles {
        text.extend([first, last].map(|(label, what, rad)| {
            let arcsec = Unit::Arcsecond.from_si(rad);
            labelled(label, &format!("{arcsec:>7.1} arcsec rms  {what}"))
        }));
    }
    text
}

/// The same of drives, in mrad.
pub(super) fn head_of_drives(subject: &Subject, v: &DriveVerdictRow, found: usize) -> String {
    let noise = format!("{:.3} mrad", 1e3 * v.noise_rad);
    let rows = screen::measured(
        subject.robot.as_deref(),
        &format!("{} rows of commands and angles fitted", v.rows),
        Some(&screen::noise(&noise, None)),
    );
    let held_out = match v.held_out {
        true => "held out",
        false => "fitted rows: flattered",
    };
    let line = |label: &str, rad: f64, what: &str| {
        let mrad = 1e3 * rad;
        labelled(label, &format!("{mrad:>8.3} mrad rms, rolled out  {what}"))
    };
    let simulated = format!("simulation as it is, {held_out}");
    rows + &line("before", v.before_rms_rad, &simulated)
        + &line("after", v.after_rms_rad, with_findings(found))
}

/// The same of drives.
pub(super) fn verdict_of_drives(v: &DriveVerdictRow) -> String {
    let (left, noise) = (1e3 * v.after_fitted_rms_rad, 1e3 * v.noise_rad);
    let is = |kind: VerdictKind| v.verdict == kind.name();
    match () {
        () if is(VerdictKind::NothingMissing) => {
            format!("nothing missing: {left:.3} mrad remain, the noise is {noise:.3} mrad")
        }
        () if is(VerdictKind::Explained) => {
            format!("explained: {left:.3} mrad remain, the noise is {noise:.3} mrad")
        }
        () => format!("unexplained: {left:.3} mrad remain, the noise is {noise:.3} mrad"),
    }
}

/// The same of torques, as shares of their rms.
pub(super) fn head_of_torques(subject: &Subject, v: &TorqueVerdictRow, found: usize) -> String {
    let (rows, rate, cutoff) = (v.rows, v.rate_hz, v.cutoff_hz);
    let rows = format!("{rows} rows at {rate:.0} Hz, low-pass {cutoff:.1} Hz");
    let rows = screen::measured(subject.robot.as_deref(), &rows, None);
    let held_out = match v.held_out {
        true => "held out",
        false => "fitted rows: flattered",
    };
    let line = |label: &str, share: f64, what: &str| {
        let percent = 100.0 * share;
        let text = format!("{percent:>7.2} % of the torques' rms, mean over joints  {what}");
        labelled(label, &text)
    };
    rows + &line("before", v.before_nrmse, &format!("rigid arm, {held_out}"))
        + &line("after", v.after_nrmse, with_findings(found))
}
