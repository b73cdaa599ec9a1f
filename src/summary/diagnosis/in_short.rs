//! A diagnosis in a few lines: the verdict, a line a finding, what to measure next.

use super::{DiagnosisSummary, rival_words};
use crate::error::counted;
use crate::summary::labelled;
use crate::table::{FindingRow, RivalRow, VerdictTopic, is_separable_by_poses};
use crate::units::Unit;

/// Findings that a run names in its one line.
const NAMED: usize = 3;

impl DiagnosisSummary {
    /// The verdict and what it rests on, in one sentence.
    pub fn verdict(&self) -> String {
        let verdict = self.verdict.verdict.replace('_', " ");
        match &self.verdict.statement {
            Some(statement) => format!("{verdict}: {statement}"),
            None => verdict,
        }
    }

    /// The strongest findings by name, place and size; nothing where nothing was found. The size of one that zero or ratio make up for may be
    /// large, whatever the data say of it: it puts none first.
    pub fn strongest(&self) -> Option<String> {
        let all: Vec<&FindingRow> = self.findings.0.iter().collect();
        let told = |row: &FindingRow| match (row.effect_rms_mm, row.effect_rms_rad) {
            (Some(mm), _) => format!(" ({:.0} um rms)", 1000.0 * mm),
            (None, Some(angle)) => format!(" ({:.0} arcsec rms)", Unit::Arcsecond.from_si(angle)),
            (None, None) => String::new(),
        };
        let named = |row: &&FindingRow| format!("{} at {}{}", row.effect, row.place, told(row));
        let named: Vec<String> = all.iter().take(NAMED).map(named).collect();
        let more = all.len().saturating_sub(NAMED);
        let more = if more > 0 { format!(", and {more} more") } else { String::new() };
        (!named.is_empty()).then(|| format!("{}{more}", named.join(", ")))
    }

    /// What `calib diagnose` prints unless all is asked for; `store` is the `--store` of the commands that it proposes.
    pub fn short(&self, store: &str) -> String {
        let v = &self.verdict;
        let mut text = labelled("verdict", &self.verdict());
        let change = |before: Option<f64>, after: Option<f64>| Some(format!("{:.3} -> {:.3} mm", before?, after?));
        if let (Some(mean), Some(max)) = (change(v.before_mean_mm, v.after_mean_mm), change(v.before_max_mm, v.after_max_mm)) {
            let rows = if v.held_out { "held-out points" } else { "fitted points (none are held out: flattered)" };
            let assumed = if v.is_noise_assumed() { "assumed " } else { "" };
            let noise = format!("{assumed}noise {:.3} mm rms", v.noise_floor_mm.unwrap_or_default());
            text.push_str(&labelled("error", &format!("mean {mean}, max {max}, {rows}; {noise}")));
        }
        if let (Some(before), Some(after), Some(noise)) = (v.before_rms_rad, v.after_rms_rad, v.noise_floor_rad) {
            let [before, after, noise] = [before, after, noise].map(|angle| Unit::Arcsecond.from_si(angle));
            let rows = if v.held_out { "held-out rows" } else { "fitted rows (none are held out: flattered)" };
            text.push_str(&labelled(
                "error",
                &format!("rms {before:.1} -> {after:.1} arcsec, {rows}; noise {noise:.1} arcsec rms"),
            ));
        }
        for finding in &self.findings.0 {
            text.push_str(&labelled(&format!("{:>3}.", finding.rank), &self.finding_in_a_line(finding)));
        }
        for line in self.said(VerdictTopic::Withdrawn) {
            text.push_str(&labelled("withdrawn", line));
        }
        text.extend(v.signature.iter().map(|signature| labelled("left", signature)));
        text.extend(self.set_aside().map(|rows| labelled("set aside", &rows)));
        let unseen: Vec<&str> = self
            .said(VerdictTopic::NotObservable)
            .into_iter()
            .map(|line| line.split_once(": ").map_or(line, |(what, _)| what))
            .collect();
        if !unseen.is_empty() {
            text.push_str(&labelled("limits", &format!("not observable from these data: {}", unseen.join(", "))));
        }
        text.push_str(&self.next_in_short(store));
        text + &labelled("more", "--details prints places, numbers, formulas, reasons and every rival")
    }

    fn finding_in_a_line(&self, finding: &FindingRow) -> String {
        let statement = finding.statement.trim_end_matches('.');
        let Some(probability) = finding.probability else { return statement.into() };
        let rivals: String = self.rivals_of(finding).map(|rival| format!(", of {}", rival_words(rival))).collect();
        format!("{statement}; probability of {} {probability:.2}{rivals}", finding.effect)
    }

    /// The rivals of a finding that these data do not exclude.
    pub(super) fn rivals_of<'a>(&'a self, finding: &'a FindingRow) -> impl Iterator<Item = &'a RivalRow> {
        self.rivals.0.iter().filter(|rival| rival.rank == finding.rank && rival.is_inseparable())
    }

    /// What decides the least certain finding, and what decides others, counted.
    fn next_in_short(&self, store: &str) -> String {
        let lines = self.next(store).unwrap_or_default();
        let undecided = self.findings.0.iter().filter(|finding| {
            is_separable_by_poses(&finding.effect) && self.rivals_of(finding).any(|rival| is_separable_by_poses(&rival.effect))
        });
        let least = undecided.min_by(|a, b| a.probability.unwrap_or(1.0).total_cmp(&b.probability.unwrap_or(1.0)));
        let about = least.map_or_else(Vec::new, |finding| {
            [format!("{} at {} or ", finding.effect, finding.place), format!("poses for finding {} or ", finding.rank)].into()
        });
        let mut shown: Vec<&String> =
            about.iter().filter_map(|start| lines.iter().find(|line| line.starts_with(start))).collect();
        if shown.is_empty() {
            shown.extend(lines.first());
        }
        let line = |line: &&String| match line.split_once(": calib ") {
            Some((what, command)) => format!("{}{}", labelled("next", what), labelled("", &format!("calib {command}"))),
            None => labelled("next", line),
        };
        let mut text: String = shown.iter().map(line).collect();
        if lines.len() > shown.len() {
            text.push_str(&labelled("", &format!("{}: --details", counted(lines.len() - shown.len(), "more proposal"))));
        }
        text
    }
}
