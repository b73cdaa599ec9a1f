//! A diagnosis in a few lines: what was measured, errors before and after, the verdict, a line a finding, what to measure next.

use super::DiagnosisSummary;
use crate::diagnose::VerdictKind;
use crate::effect::names;
use crate::summary::estimate::{angle, length};
use crate::summary::labelled;
use crate::summary::screen::{self, NextStep};
use crate::summary::short_finding::{FindingNumber, FoundCause, NamedRival, ShortFinding, words};
use crate::table::{FindingRow, RivalRow, VerdictTopic};
use crate::units::Unit;

impl DiagnosisSummary {
    /// The verdict in at most twelve words.
    pub fn verdict(&self) -> String {
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

    /// The findings in a few words each, as the table has them.
    pub(in crate::summary) fn found(&self) -> Vec<ShortFinding> {
        let rows = self.verdict.clock.as_deref() == Some("row");
        self.findings
            .0
            .iter()
            .map(|finding| ShortFinding::of(self.cause(finding), rows))
            .collect()
    }

    fn cause<'a>(&'a self, finding: &'a FindingRow) -> FoundCause<'a> {
        let numbers = self
            .numbers
            .0
            .iter()
            .filter(|number| number.rank == finding.rank);
        let rivals = self
            .rivals
            .0
            .iter()
            .filter(|rival| rival.rank == finding.rank);
        let by_length = finding.effect_rms_mm.map(|mm| (mm, length(mm)));
        FoundCause {
            effect: &finding.effect,
            place: &finding.place,
            statement: &finding.statement,
            forms: &finding.forms,
            numbers: numbers
                .map(|n| FindingNumber {
                    name: &n.name,
                    value: n.value,
                    unit: &n.unit,
                    sigma: n.sigma,
                })
                .collect(),
            probability: finding.probability.filter(|_| finding.delta_bic.is_some()),
            rivals: rivals
                .map(|rival| NamedRival {
                    effect: &rival.effect,
                    place: &rival.place,
                    probability: rival.probability.unwrap_or_default(),
                })
                .collect(),
            none: finding.none_probability.unwrap_or_default(),
            size: by_length.or_else(|| finding.effect_rms_rad.map(|rad| (rad, angle(rad)))),
        }
    }

    /// What was measured, and the errors before and after.
    pub(in crate::summary) fn head(&self) -> String {
        let v = &self.verdict;
        let mut text = screen::measured(
            self.robot.as_deref(),
            &format!("{} points, {} fitted", self.rows, v.points),
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
            for (label, rad, of) in [("before", first, &before), ("after", last, &after)] {
                text.push_str(&labelled(
                    label,
                    &format!("{:>7.1} arcsec rms  {of}", Unit::Arcsecond.from_si(rad)),
                ));
            }
        }
        text
    }

    /// What `calib diagnose` prints unless all is asked for; `store` is the `--store` of the commands that it proposes.
    pub fn short(&self, store: &str, width: usize) -> String {
        let mut text = self.head() + &labelled("verdict", &self.verdict());
        let at = if self.verdict.leftover_rms_mm.is_some() {
            " at the tool"
        } else {
            " rms"
        };
        for (finding, row) in self.found().iter().zip(&self.findings.0) {
            text.push_str(&match self.is_wrong_setup() {
                true => screen::sentence(&format!("{:>3}.", row.rank), &row.statement, width),
                false => screen::ranked(row.rank, finding, at, width),
            });
        }
        if let Some(statement) = self
            .verdict
            .statement
            .as_ref()
            .filter(|_| self.is_wrong_setup() && self.findings.0.is_empty())
        {
            text.push_str(&screen::sentence("", statement, width));
        }
        let aside: Vec<String> = self
            .worst_aside()
            .iter()
            .map(|row| format!("{} ({})", row.point_id, length(row.size_mm)))
            .collect();
        text.push_str(&screen::names("set aside", &aside, width));
        text.push_str(&screen::not_seen(
            &self.said(VerdictTopic::NotObservable),
            width,
        ));
        let next = self
            .next_step(store)
            .or_else(|| (!self.is_wrong_setup()).then(|| NextStep::correct(&self.run, store)));
        text.push_str(&next.map_or_else(String::new, |step| step.text(width)));
        text + &labelled(
            "more",
            "--details prints numbers, places, formulas, reasons and every rival",
        )
    }

    /// The rivals of a finding that these data do not exclude.
    pub(super) fn rivals_of<'a>(
        &'a self,
        finding: &'a FindingRow,
    ) -> impl Iterator<Item = &'a RivalRow> {
        self.rivals
            .0
            .iter()
            .filter(|rival| rival.rank == finding.rank && rival.is_inseparable())
    }

    /// What decides the largest finding whose name is not certain; else what shows a joint that was not seen.
    pub(in crate::summary) fn next_step(&self, store: &str) -> Option<NextStep> {
        let size = |short: &ShortFinding| short.size.as_ref().map_or(0.0, |(size, _)| *size);
        let found = self.found();
        let undecided = found
            .iter()
            .zip(&self.findings.0)
            .filter(|(short, _)| short.instead.is_some());
        let mut undecided: Vec<(&ShortFinding, &FindingRow)> = undecided.collect();
        undecided.sort_by(|a, b| size(b.0).total_cmp(&size(a.0)));
        let lines = self.next(store).unwrap_or_default();
        let poses = undecided.into_iter().find_map(|(short, finding)| {
            let start = format!("poses for finding {} or ", finding.rank);
            let (rival, command) = lines
                .iter()
                .find_map(|line| line.strip_prefix(&start))?
                .split_once(": ")?;
            let (effect, place) = rival.split_once(" at ")?;
            let what = format!(
                "measure poses to decide: {}, or {}",
                short.what,
                words(effect, place)
            );
            Some(NextStep {
                what,
                command: Some(command.into()),
            })
        });
        if poses.is_some() {
            return poses;
        }
        if self.verdict.is_noise_inferred() {
            return Some(NextStep {
                what: "state `instrument` in `ingest`, and measure ten poses twice".into(),
                command: None,
            });
        }
        let joint = self
            .said(VerdictTopic::NotObservable)
            .into_iter()
            .find(|line| line.starts_with("joint "))?;
        let (joint, why) = joint.split_once(": ")?;
        Some(NextStep {
            what: format!("{joint}: {}", why.rsplit("; ").next().unwrap_or(why)),
            command: None,
        })
    }
}
