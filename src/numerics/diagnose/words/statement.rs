//! Findings in a sentence that a mechanic understands; the verdict in one that claims no more than its noise does: known by repeats, stated
//! by the instrument, or inferred.

use crate::diagnose::types::VerdictKind;
use crate::diagnose::whitened::AutocorrelatedNoise;
use crate::effect::{HiddenSize, Summary, figure};
use crate::error::counted;
use crate::observation::Dimension;
use crate::robot::NoiseBasis;

/// A size in the small unit of its dimension, e.g. `31 um`.
pub(crate) fn small(size: f64, dimension: Dimension) -> String {
    format!(
        "{} {}",
        figure(dimension.small().from_si(size), 0),
        dimension.small().symbol()
    )
}

/// The sentence of a finding; `rms` is the size of the whole effect in what was measured.
pub(crate) fn sentence(effect: &str, summary: &Summary, rms: &str) -> String {
    with_size(&text_of(effect, summary), rms)
}

fn text_of(effect: &str, summary: &Summary) -> String {
    let cause = summary.cause(effect);
    cause.map_or_else(String::new, |cause| cause.sentence(summary))
}

/// A sentence of a finding as it is in the whole model.
pub(crate) fn with_size(text: &str, rms: &str) -> String {
    format!("{text} ({rms} rms at the tool).")
}

/// The sentence of a finding whose numbers no such effect can have.
pub(crate) fn not_so(effect: &str, summary: &Summary, why: &str, rms: &str) -> String {
    let text = text_of(effect, summary);
    format!(
        "something unknown acts at {}: {effect} fits best ({text}), but {why} ({rms} rms at the tool).",
        summary.place
    )
}

/// The sentence of a finding whose name the user has excluded.
pub(crate) fn left_out(summary: &Summary, rms: &str) -> String {
    let mut by: Vec<String> = Vec::new();
    for variable in summary.forms.iter().flat_map(|form| form.variables()) {
        let name = summary.clock.named(variable);
        if !by.contains(&name) {
            by.push(name);
        }
    }
    let by = match by.is_empty() {
        true => String::new(),
        false => format!(" and depends on {}", by.join(" and ")),
    };
    format!(
        "something unknown acts at {}{by}; the name that it would have is left out by `without` ({rms} rms at the tool).",
        summary.place
    )
}

/// What noise that is correlated from point to point hides.
pub(crate) fn slower_than_noise(noise: AutocorrelatedNoise) -> String {
    format!(
        "small slow causes (drift, steps, warm-up): noise is correlated from point to point ({:.2}), as moving air or a tripod leaves \
         it; measure a fixed target every few poses",
        noise.correlation
    )
}

/// How large a cause may be that a path is too short or too slow to show; `limit` in SI.
pub(crate) fn hidden(name: &str, subjects: &str, hides: &HiddenSize, limit: f64) -> String {
    let size = if limit.is_finite() {
        format!("by up to {:.1} {}", hides.unit.from_si(limit), hides.unit)
    } else {
        "by any amount".into()
    };
    let advice =
        "geometry absorbs it on this path: measure longer, faster, over the joints' whole range";
    format!("{name}: {subjects} {} {size}; {advice}", hides.may)
}

/// What a verdict rests on; rms sizes of a row's error, m or rad.
#[derive(Clone, Copy)]
pub(crate) struct Ground {
    pub(crate) dimension: Dimension,
    pub(crate) basis: NoiseBasis,
    /// Repeats that the noise was learnt from.
    pub(crate) repeats: usize,
    /// The noise of all that moves a point at random.
    pub(crate) noise: f64,
    /// What the instrument explains of it; none where neither it nor standard deviations were stated.
    pub(crate) instrument: Option<f64>,
    /// Residual of fitted rows.
    pub(crate) left: f64,
    /// Whether the residual is no larger than the noise.
    pub(crate) agrees: bool,
    /// Residual of held-out points, where they are off by more than what was fitted and the noise allow.
    pub(crate) not_carried: Option<f64>,
    /// Whether only causes without a name were found.
    pub(crate) nameless: bool,
    /// Whether some of what was found, which reproduces the error, has no name.
    pub(crate) partly_nameless: bool,
    /// Whether the arm moved while it was measured: no pose can be measured twice.
    pub(crate) in_motion: bool,
    /// Whether nothing was read but joints with the target in contact: what is stated is the closing error.
    pub(crate) contacts_only: bool,
}

impl Ground {
    /// Names the noise with its size and where that is from.
    fn noise_text(&self) -> String {
        match self.basis {
            NoiseBasis::Repeats => format!(
                "the noise that {} show, {}",
                counted(self.repeats, "repeat"),
                self.small(self.noise)
            ),
            NoiseBasis::Instrument if self.contacts_only => format!(
                "the stated repeatability of closing, {}",
                self.small(self.noise)
            ),
            NoiseBasis::Instrument => format!(
                "the noise that the instrument states, {}",
                self.small(self.noise)
            ),
            NoiseBasis::Inferred => format!("{}: {}", self.at_random(), self.advice()),
        }
    }

    /// Residual beyond the noise, after all findings.
    fn leftover_text(&self) -> String {
        match self.agrees {
            true => format!("the residual agrees with {}", self.noise_text()),
            false => format!(
                "{} remain, against {}",
                self.small(self.left),
                self.noise_text()
            ),
        }
    }

    /// Why the error is not explained.
    fn missing_text(&self) -> String {
        let left = self.small(self.left);
        let points = if self.dimension == Dimension::Length {
            "points"
        } else {
            "rows"
        };
        match self.not_carried {
            Some(held_out) => format!(
                "the findings do not explain everything: {} remain of held-out {points}, {left} of fitted ones",
                self.small(held_out)
            ),
            None if self.nameless => {
                format!("the findings reproduce the error, but none has a name: {left} remain")
            }
            None if self.partly_nameless => {
                format!(
                    "the findings reproduce the error, but a part of it has no name: {left} remain"
                )
            }
            None => format!("the findings do not explain everything: {left} remain"),
        }
    }

    /// What scatters without a reason that was measured or stated.
    fn at_random(&self) -> String {
        let scatter = self.small(self.scatter());
        match self.instrument {
            Some(closing) if self.contacts_only => {
                format!(
                    "{scatter} scatter at random, of which the stated repeatability of closing explains {}",
                    self.number(closing)
                )
            }
            Some(instrument) => {
                format!(
                    "{scatter} scatter at random, of which the instrument explains {}",
                    self.number(instrument)
                )
            }
            None => format!(
                "{scatter} scatter at random, and no instrument is stated that explains any of it"
            ),
        }
    }

    /// Without a stated instrument the noise is but a weight: the residual is the scatter.
    fn scatter(&self) -> f64 {
        if self.instrument.is_some() {
            self.noise
        } else {
            self.left
        }
    }

    /// In the small unit of its dimension, with a decimal where there are few.
    fn number(&self, size: f64) -> String {
        let count = self.dimension.small().from_si(size);
        if count < 9.95 {
            format!("{count:.1}")
        } else {
            format!("{count:.0}")
        }
    }

    fn small(&self, size: f64) -> String {
        format!("{} {}", self.number(size), self.dimension.small().symbol())
    }

    fn advice(&self) -> &'static str {
        let at = match (self.instrument.is_some(), self.in_motion) {
            (true, _) if self.contacts_only => 0,
            (true, false) => 1,
            (true, true) => 2,
            (false, false) => 3,
            (false, true) => 4,
        };
        ADVICE[at]
    }
}

/// What shows the noise where neither repeats nor the instrument do.
const ADVICE: [&str; 5] = [
    "close ten postures twice",
    "measure ten poses twice",
    "measure ten poses twice with the arm at rest",
    "state `instrument` in `ingest`, and measure ten poses twice",
    "state `instrument` in `ingest`",
];

/// What a statement advises, so that the noise is known; the longest that it says.
pub fn advised(statement: &str) -> Option<&'static str> {
    let said = ADVICE.iter().filter(|advice| statement.contains(**advice));
    said.max_by_key(|advice| advice.len()).copied()
}

/// The verdict in a sentence without its full stop.
pub(crate) fn statement(verdict: VerdictKind, ground: &Ground) -> String {
    let inferred = ground.basis == NoiseBasis::Inferred;
    match verdict {
        VerdictKind::NothingMissing if inferred => {
            format!("nothing found; {}", ground.noise_text())
        }
        VerdictKind::NothingMissing => format!("nothing found; {}", ground.leftover_text()),
        VerdictKind::Explained if inferred => format!(
            "the findings explain the error except for noise; {}",
            ground.noise_text()
        ),
        VerdictKind::Explained => {
            format!("the findings explain the error; {}", ground.leftover_text())
        }
        VerdictKind::Unexplained if inferred => {
            format!("{}; {}", ground.missing_text(), ground.noise_text())
        }
        VerdictKind::Unexplained => {
            format!("{}, against {}", ground.missing_text(), ground.noise_text())
        }
        VerdictKind::WrongSetup => {
            "the set-up is wrong: correct it first; no physical cause was tested".into()
        }
        VerdictKind::NotAsked => {
            "too few rows were fitted to determine what the simulation lacks".into()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground(basis: NoiseBasis, instrument: Option<f64>) -> Ground {
        Ground {
            dimension: Dimension::Length,
            basis,
            repeats: 24,
            noise: 31e-6,
            instrument,
            left: 32e-6,
            agrees: true,
            not_carried: None,
            nameless: false,
            partly_nameless: false,
            in_motion: false,
            contacts_only: false,
        }
    }

    #[test]
    fn what_is_advised_is_what_the_statement_says() {
        let stated = "21 um remain; 21 um scatter at random, of which the instrument explains 17: measure ten poses twice";
        assert_eq!(super::advised(stated), Some("measure ten poses twice"));
        let longest = "state `instrument` in `ingest`, and measure ten poses twice";
        assert_eq!(super::advised(&format!("31 um: {longest}")), Some(longest));
        assert_eq!(super::advised("nothing found"), None);
    }

    #[test]
    fn a_verdict_says_what_its_noise_rests_on_and_claims_no_more() {
        use NoiseBasis::{Inferred, Instrument, Repeats};
        use VerdictKind::{Explained, NothingMissing, Unexplained};
        let fine = Some(8.2e-6);
        let coarse = Some(17e-6);
        let contacts = |basis| Ground {
            contacts_only: true,
            ..ground(basis, coarse)
        };
        let repeats = ground(Repeats, coarse);
        for (verdict, ground, sentence) in [
            (
                Explained,
                contacts(Instrument),
                "the findings explain the error; the residual agrees with the stated repeatability of closing, 31 um",
            ),
            (
                NothingMissing,
                contacts(Inferred),
                "nothing found; 31 um scatter at random, of which the stated repeatability of closing explains 17: close ten postures twice",
            ),
            (
                NothingMissing,
                repeats,
                "nothing found; the residual agrees with the noise that 24 repeats show, 31 um",
            ),
            (
                NothingMissing,
                ground(Instrument, coarse),
                "nothing found; the residual agrees with the noise that the instrument states, 31 um",
            ),
            (
                NothingMissing,
                ground(Inferred, coarse),
                "nothing found; 31 um scatter at random, of which the instrument explains 17: measure ten poses twice",
            ),
            (
                NothingMissing,
                ground(Inferred, None),
                "nothing found; 32 um scatter at random, and no instrument is stated that explains any of it: state `instrument` in \
                 `ingest`, and measure ten poses twice",
            ),
            (
                Explained,
                ground(Repeats, fine),
                "the findings explain the error; the residual agrees with the noise that 24 repeats show, 31 um",
            ),
            (
                Explained,
                ground(Instrument, fine),
                "the findings explain the error; the residual agrees with the noise that the instrument states, 31 um",
            ),
            (
                Explained,
                ground(Inferred, fine),
                "the findings explain the error except for noise; 31 um scatter at random, of which the instrument explains 8.2: \
                 measure ten poses twice",
            ),
            (
                Unexplained,
                ground(Repeats, fine),
                "the findings do not explain everything: 32 um remain, against the noise that 24 repeats show, 31 um",
            ),
            (
                Unexplained,
                ground(Instrument, fine),
                "the findings do not explain everything: 32 um remain, against the noise that the instrument states, 31 um",
            ),
            (
                Unexplained,
                ground(Inferred, fine),
                "the findings do not explain everything: 32 um remain; 31 um scatter at random, of which the instrument explains 8.2: \
                 measure ten poses twice",
            ),
            (
                Unexplained,
                ground(Inferred, None),
                "the findings do not explain everything: 32 um remain; 32 um scatter at random, and no instrument is stated that \
                 explains any of it: state `instrument` in `ingest`, and measure ten poses twice",
            ),
            // It agrees with the noise only where it does, and says of which points it is.
            (
                NothingMissing,
                Ground {
                    agrees: false,
                    left: 46e-6,
                    ..repeats
                },
                "nothing found; 46 um remain, against the noise that 24 repeats show, 31 um",
            ),
            (
                Unexplained,
                Ground {
                    not_carried: Some(80e-6),
                    ..repeats
                },
                "the findings do not explain everything: 80 um remain of held-out points, 32 um of fitted ones, against the noise that 24 \
                 repeats show, 31 um",
            ),
            (
                Unexplained,
                Ground {
                    partly_nameless: true,
                    ..repeats
                },
                "the findings reproduce the error, but a part of it has no name: 32 um remain, against the noise that 24 repeats show, 31 um",
            ),
            (
                Unexplained,
                Ground {
                    nameless: true,
                    ..repeats
                },
                "the findings reproduce the error, but none has a name: 32 um remain, against the noise that 24 repeats show, 31 um",
            ),
        ] {
            assert_eq!(statement(verdict, &ground), sentence);
            // Where the noise is inferred nothing is ever complete.
            assert!(ground.basis != Inferred || sentence.contains("scatter at random"));
        }
    }
}
