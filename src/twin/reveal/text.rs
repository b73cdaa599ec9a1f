//! The scoreboard for people and for programs.

use super::board::{BINS, Board, Company, Counts, NEAR_BOUND};
use super::both_worlds::{MixedBin, UNLISTED};
use super::left_out::LeftOutShares;
use super::mark::{Case, DUE};
use super::reliability::{Reliability, Subject};
use super::share::Share;
use crate::reveal::mark::GIVEN;
use calib_foundation::statistics::quantile;
use serde_json::{Value, json};
use std::fmt::Write;

/// Whether the library has the formula by which the twin makes an effect.
const FORMULAS: [(&str, bool); 2] = [
    ("formulas that the library has", true),
    ("formulas that it has not", false),
];

/// Whether the held-out error tells that a cause is left out.
const TOLD: [(&str, bool); 2] = [
    ("where the data can tell", true),
    ("where it cannot", false),
];

const SUBJECTS: [Subject; 2] = [Subject::Name, Subject::Place];
const UNTOLD: &str = "names where the data cannot tell";

impl Board {
    /// The scoreboard as text, mm and percent.
    pub fn text(&self) -> String {
        let mut out = format!(
            "{} recordings judged, {} without a verdict\n",
            self.cases.len(),
            self.missing.len()
        );
        self.write_strengths(&mut out);
        let by_effect = self.by_effect();
        if !by_effect.is_empty() {
            let _ = writeln!(
                out,
                "\neffects with L of {DUE} or more\n  effect                     n  exact  in set  wrong  silent   exact"
            );
            for (effect, counts) in by_effect {
                let _ = writeln!(out, "  {effect:<22}{}", line(&counts));
            }
        }
        self.write_places(&mut out);
        for (title, shared) in FORMULAS {
            let (counts, mean) = self.by_formula(shared);
            if counts.all() > 0 {
                let mean = mean
                    .map(|mean| format!(", mean probability of the true name {mean:.3}"))
                    .unwrap_or_default();
                let _ = writeln!(
                    out,
                    "{title}: {} exact, {} in the set{mean}",
                    percent(&counts.exactly()),
                    counts.in_set
                );
            }
        }
        let confusion = self.confusion();
        if !confusion.is_empty() {
            let _ = writeln!(out, "\ncalled (`=` rightly, `-` nothing)");
            for (effect, called) in confusion {
                let called: Vec<String> = called
                    .iter()
                    .map(|(name, count)| format!("{name} {count}"))
                    .collect();
                let _ = writeln!(out, "  {effect:<22}{}", called.join(", "));
            }
        }
        out.push('\n');
        for (title, share) in self.shares() {
            if share.of > 0 {
                let _ = writeln!(out, "{title}: {}", percent(&share));
            }
        }
        for (effect, share) in self.intervals() {
            let _ = writeln!(
                out,
                "95 % intervals that hold the truth, {effect}: {}",
                percent(&share)
            );
        }
        let [due, null] = self.ratios();
        for (title, ratios) in [
            (format!("with an L of {DUE} or more"), due),
            ("without an effect".into(), null),
        ] {
            if let (Some(median), Some(late)) = (quantile(&ratios, 0.5), quantile(&ratios, 0.9)) {
                let within = Share::of(ratios.iter().map(|ratio| *ratio <= 1.1));
                let within = percent(&within);
                let _ = writeln!(
                    out,
                    "held-out rms over its bound, {title}: median {median:.3}, 90th percentile {late:.3}, within 1.1: {within}"
                );
            }
        }
        if let Some(median) = quantile(&self.explained(), 0.5) {
            let _ = writeln!(
                out,
                "explained share of the held-out error: median {median:.4}"
            );
        }
        for subject in SUBJECTS {
            write_reliability(&mut out, subject.name(), &self.reliability(subject));
        }
        self.write_left_out(&mut out);
        for ((content, verdict), count) in self.verdicts() {
            let _ = writeln!(out, "{content}: {verdict} {count}");
        }
        let failures: Vec<String> = self.failures().map(failure).collect();
        if !failures.is_empty() {
            let _ = writeln!(
                out,
                "\nnot right ({})\n{}",
                failures.len(),
                failures.join("\n")
            );
        }
        for (case, why) in &self.missing {
            let _ = writeln!(out, "no verdict: {case}: {why}");
        }
        out
    }

    /// Effects by how strong they are, alone in their recording and beside others.
    fn write_strengths(&self, out: &mut String) {
        for (title, company) in [
            ("alone in its recording", Company::Alone),
            ("beside others", Company::Beside),
        ] {
            let bins = self.by_strength(company);
            if bins.iter().all(|counts| counts.all() == 0) {
                continue;
            }
            let _ = writeln!(
                out,
                "\neffects {title}\n  L             n  exact  in set  wrong  silent   exact"
            );
            for (bin, counts) in bins.iter().enumerate() {
                let _ = writeln!(out, "  {:<9}{}", range(bin), line(counts));
            }
        }
    }

    /// Places and names of due effects, and their recordings' held-out errors.
    fn write_places(&self, out: &mut String) {
        let (all, by_effect) = self.places();
        if all.place.of == 0 {
            return;
        }
        let _ = writeln!(
            out,
            "\nplaces and names of effects with L of {DUE} or more\n  effect                     n  place  name or unknown  wrong name"
        );
        for (effect, of) in by_effect {
            let counts = [of.place, of.name_or_unknown, of.wrong_name].map(|share| share.count);
            let [place, name, wrong] = counts;
            let n = of.place.of;
            let _ = writeln!(out, "  {effect:<22}{n:>6}{place:>7}{name:>17}{wrong:>12}");
        }
        for (title, share) in all.titled() {
            let _ = writeln!(out, "{title}: {}", percent(&share));
        }
        let near = self.near_bound();
        if near.of > 0 {
            let _ = writeln!(
                out,
                "held-out rms within {NEAR_BOUND} of its bound: {}",
                percent(&near)
            );
            let _ = writeln!(
                out,
                "held-out rms larger than before: {}",
                percent(&self.worse())
            );
            let _ = writeln!(
                out,
                "held-out rms larger than before and than its bound: {}",
                percent(&self.worse_than_bound())
            );
        }
    }

    /// Recordings without their causes.
    fn write_left_out(&self, out: &mut String) {
        for (title, tells) in TOLD.into_iter().filter(|_| !self.left_out.is_empty()) {
            let shares = LeftOutShares::of(&self.left_out, tells);
            let _ = writeln!(
                out,
                "\ncauses of L {DUE} or more left out of the list, {title}: {} recordings",
                shares.wrong.of
            );
            for (what, share) in shares.titled() {
                let _ = writeln!(out, "  {what}: {}", percent(&share));
            }
            for one in self
                .left_out
                .iter()
                .filter(|one| one.tells == tells && one.strength >= DUE)
            {
                if let Some((name, probability)) = one
                    .wrong
                    .as_ref()
                    .filter(|(_, probability)| *probability >= GIVEN)
                {
                    let _ = writeln!(
                        out,
                        "    {}: {} is called {name} with {probability:.2}",
                        one.name, one.effect
                    );
                }
            }
        }
        if !self.left_out.is_empty() {
            write_reliability(out, UNTOLD, &self.untold_reliability());
            for unlisted in UNLISTED {
                let _ = writeln!(
                    out,
                    "\nstated probabilities of names where {unlisted} of all causes are in no list"
                );
                let _ = writeln!(
                    out,
                    "  from  to    stated  right   statements with the whole list, and without the cause"
                );
                for bin in self.mixed_reliability(unlisted) {
                    let (listed, without) = (bin.statements_whole_list, bin.statements_left_out);
                    let MixedBin {
                        from,
                        to,
                        stated,
                        right,
                        ..
                    } = bin;
                    let _ = writeln!(
                        out,
                        "  {from:<4}  {to:<4}  {stated:.3}   {right:.3}   {listed:>4}  {without:>4}"
                    );
                }
            }
        }
    }

    fn shares(&self) -> Vec<(String, Share)> {
        let [pairs, strongest] = self.whole("pair");
        let mut out = vec![
            (
                "false alarms in recordings without an effect".to_string(),
                self.alarms(),
            ),
            (
                "recordings with effects in which something was named that is not there".into(),
                self.strays(),
            ),
            (
                format!("two effects of L {DUE} or more, both named and nothing else"),
                pairs,
            ),
            ("  the stronger one named".into(), strongest),
        ];
        out.extend(
            self.tampered()
                .into_iter()
                .map(|(kind, share)| (format!("{kind} named"), share)),
        );
        out
    }

    /// The scoreboard as JSON.
    pub fn document(&self) -> Value {
        let bins = |company| {
            let bins = self.by_strength(company).into_iter().enumerate();
            bins.map(|(bin, of)| json!({ "L": range(bin), "outcomes": of }))
                .collect::<Vec<_>>()
        };
        let by_formula = FORMULAS.map(|(_, shared)| {
            let (of, mean) = self.by_formula(shared);
            json!({ "shared": shared, "outcomes": of, "mean_probability": mean })
        });
        let reliable = |of: &str, Reliability { bins, brier, auc }| json!({ "of": of, "brier": brier, "auc": auc, "bins": bins });
        let listed = |shares: &[(String, Share)]| {
            let shares = shares.iter();
            let shares = shares.map(|(what, of)| json!({ "what": what.trim(), "share": of }));
            shares.collect::<Vec<_>>()
        };
        let left_out = TOLD.map(|(title, tells)| {
            let shares = LeftOutShares::of(&self.left_out, tells).titled();
            json!({ "which": title, "shares": listed(&shares) })
        });
        let mixed = UNLISTED.map(
            |unlisted| json!({ "unlisted": unlisted, "bins": self.mixed_reliability(unlisted) }),
        );
        let (placed, placed_by_effect) = self.places();
        let [due, null] = self.ratios();
        let spread = |sorted: &[f64]| json!({ "n": sorted.len(), "median": quantile(sorted, 0.5), "p90": quantile(sorted, 0.9) });
        let missing = self.missing.iter();
        json!({
            "recordings": self.cases.len(),
            "without_verdict": missing.map(|(case, why)| json!({ "case": case, "why": why })).collect::<Vec<_>>(),
            "alone": bins(Company::Alone),
            "beside": bins(Company::Beside),
            "by_effect": self.by_effect(),
            "by_formula": by_formula,
            "places": { "all": placed, "by_effect": placed_by_effect },
            "confusion": self.confusion(),
            "reliability": SUBJECTS.map(|subject| reliable(subject.name(), self.reliability(subject))),
            "shares": listed(&self.shares()),
            "intervals": self.intervals(),
            "held_out_over_bound": { "due": spread(&due), "null": spread(&null), "due_within_1.15": self.near_bound(),
                "due_worse": self.worse(), "due_worse_than_bound": self.worse_than_bound() },
            "left_out": { "recordings": self.left_out.len(), "worlds": left_out,
                "reliability": reliable(UNTOLD, self.untold_reliability()), "both_worlds": mixed },
            "explained_share": spread(&self.explained()),
            "failures": self.failures().map(failure).collect::<Vec<_>>(),
        })
    }
}

/// Stated probabilities against what was true.
fn write_reliability(out: &mut String, of: &str, Reliability { bins, brier, auc }: &Reliability) {
    if let Some(brier) = brier {
        let auc = auc
            .map(|auc| format!(", area under the ROC curve {auc:.3}"))
            .unwrap_or_default();
        let _ = writeln!(
            out,
            "\nstated probabilities of {of}: Brier score {brier:.4}{auc}"
        );
        let _ = writeln!(out, "  from  to    stated  right");
    }
    for bin in bins {
        let (from, to, stated) = (bin.from, bin.to, bin.stated);
        let right = percent(&bin.right);
        let _ = writeln!(out, "  {from:<4}  {to:<4}  {stated:.3}   {right}");
    }
}

/// E.g. `15-50`.
fn range(bin: usize) -> String {
    match BINS.get(bin + 1) {
        Some(upper) => format!("{}-{upper}", BINS[bin]),
        None => format!("> {}", BINS[bin]),
    }
}

fn line(counts: &Counts) -> String {
    let Counts {
        exact,
        in_set,
        wrong,
        silent,
    } = counts;
    format!(
        "{:>6}{exact:>7}{in_set:>8}{wrong:>7}{silent:>8}   {}",
        counts.all(),
        percent(&counts.exactly())
    )
}

/// E.g. `39 of 40 = 97.5 % (87.1 to 99.6)`, in brackets the 95 % limits.
fn percent(share: &Share) -> String {
    let [low, high] = share.limits().map(|limit| 100.0 * limit);
    match share.value() {
        Some(value) => format!(
            "{} of {} = {:.1} % ({low:.1} to {high:.1})",
            share.count,
            share.of,
            100.0 * value
        ),
        None => "-".into(),
    }
}

fn failure(case: &Case) -> String {
    let wanted = case.causes.iter().map(|cause| {
        format!(
            "{} at {} [{}, L {:.0}: {}]",
            cause.effect,
            cause.place,
            cause.form,
            cause.strength,
            cause.outcome.name()
        )
    });
    let wanted: Vec<String> = wanted.collect();
    let wanted = if wanted.is_empty() {
        "nothing".into()
    } else {
        wanted.join(", ")
    };
    let strays = if case.strays.is_empty() {
        "nothing else".into()
    } else {
        case.strays.join(", ")
    };
    format!(
        "  {} ({}, {} points): {wanted}; said besides: {strays}",
        case.name, case.robot, case.points
    )
}
