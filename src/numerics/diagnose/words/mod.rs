//! The words for what a diagnosis has decided: progress in a line each, findings and the verdict in a sentence each.
//!
//! Findings in a sentence that a mechanic understands.
//!
//! The verdict in a sentence that claims no more than its noise does: known by repeats, stated by the instrument, or inferred.

use crate::criteria::words::NAMED;
use crate::effect::{Form, HiddenSize, Summary, figure};
use crate::error::counted;
use crate::observation::Dimension;
use crate::robot::NoiseBasis;
use crate::round::{FitState, Fitter};
use crate::types::VerdictKind;
use crate::whitened::AutocorrelatedNoise;

/// The base model in a line.
pub(crate) fn of_the_base(now: &FitState, fitter: &Fitter) -> String {
    format!(
        "{}, {} of the base model estimated",
        counted(now.screening.kept.len(), "row"),
        counted(fitter.free().len(), "parameter")
    )
}

/// What the noise does from point to point.
pub(crate) fn of_the_correlation(fitter: &Fitter) -> String {
    match fitter.correlated {
        _ if fitter.causes_of_the_arm_first() => {
            "rows follow a path, on which what changes with the pose looks like noise that is correlated from point to point: causes that do \
             not follow time are tried first"
                .into()
        }
        Some(AutocorrelatedNoise { correlation, share }) => format!(
            "noise is correlated from point to point: {:.0} % of its variance by {correlation:.2}; slow causes are judged against it",
            100.0 * share
        ),
        None => "noise is not correlated from point to point".into(),
    }
}

/// A round in a line.
pub(crate) fn of_a_round<'f>(
    round: usize,
    cells: usize,
    forms: impl Iterator<Item = &'f Form>,
) -> String {
    let mut names: Vec<String> = forms
        .map(|form| format!("{} at {}", form.name(), form.place()))
        .collect();
    names.dedup();
    let causes = counted(names.len(), "cause");
    let mut shown = names
        .iter()
        .take(*NAMED)
        .cloned()
        .collect::<Vec<_>>()
        .join(", ");
    if names.len() > *NAMED {
        shown.push_str(", ...");
    }
    let shown = if shown.is_empty() {
        shown
    } else {
        format!(" ({shown})")
    };
    format!("round {round}: {cells} possible causes compared, {causes}{shown}")
}

/// What follows the last round in a line.
pub(crate) fn of_the_conclusions(found: &FitState) -> String {
    format!(
        "{} in the model; probabilities and formulas follow, the last step",
        counted(found.causes.len(), "cause")
    )
}

/// A size in the small unit of its dimension, e.g. `31 um`.
pub(crate) fn small(size: f64, of: Dimension) -> String {
    format!(
        "{} {}",
        figure(of.small().from_si(size), 0),
        of.small().symbol()
    )
}

/// The sentence of a finding; `rms` is the size of the whole effect in what was measured.
pub(crate) fn sentence(effect: &str, summary: &Summary, rms: &str) -> String {
    let text = summary
        .cause(effect)
        .map_or_else(String::new, |cause| cause.sentence(summary));
    with_size(&text, rms)
}

/// A sentence of a finding as it is in the whole model.
pub(crate) fn with_size(text: &str, rms: &str) -> String {
    format!("{text} ({rms} rms at the tool).")
}

/// The sentence of a finding whose numbers no such effect can have.
pub(crate) fn not_so(effect: &str, summary: &Summary, why: &str, rms: &str) -> String {
    let text = summary
        .cause(effect)
        .map_or_else(String::new, |cause| cause.sentence(summary));
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
    let by = if by.is_empty() {
        String::new()
    } else {
        format!(" and depends on {}", by.join(" and "))
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
pub(crate) fn hidden(name: &str, subjects: &str, of: &HiddenSize, limit: f64) -> String {
    let size = if limit.is_finite() {
        format!("by up to {:.1} {}", of.unit.from_si(limit), of.unit)
    } else {
        "by any amount".into()
    };
    let advice =
        "geometry absorbs it on this path: measure longer, faster, over the joints' whole range";
    format!("{name}: {subjects} {} {size}; {advice}", of.may)
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
    /// What is left at fitted rows.
    pub(crate) left: f64,
    /// Whether what is left is no more than the noise gives.
    pub(crate) agrees: bool,
    /// What is left of held-out points, where they are off by more than what was fitted and the noise allow.
    pub(crate) not_carried: Option<f64>,
    /// Whether only causes without a name were found.
    pub(crate) nameless: bool,
    /// Whether some of what was found, which reproduces the error, has no name.
    pub(crate) partly_nameless: bool,
    /// Whether the arm moved while it was measured: no pose can be measured twice.
    pub(crate) in_motion: bool,
    /// Whether nothing was read but joints with the target brought to places: what is stated is how well that closes.
    pub(crate) contacts_only: bool,
}

impl Ground {
    /// Names the noise with its size and where that is from.
    fn of_noise(&self) -> String {
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

    /// What is left beside the noise, after all that was found.
    fn of_the_rest(&self) -> String {
        match self.agrees {
            true => format!("the residual agrees with {}", self.of_noise()),
            false => format!(
                "{} remain, against {}",
                self.small(self.left),
                self.of_noise()
            ),
        }
    }

    /// Why the error is not explained.
    fn of_what_is_missing(&self) -> String {
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

    /// Without a stated instrument the noise is but a weight: what is left is what scatters.
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
        match (self.instrument.is_some(), self.in_motion) {
            (true, _) if self.contacts_only => "close ten postures twice",
            (true, false) => "measure ten poses twice",
            (true, true) => "measure ten poses twice with the arm at rest",
            (false, false) => "state `instrument` in `ingest`, and measure ten poses twice",
            (false, true) => "state `instrument` in `ingest`",
        }
    }
}

/// The verdict in a sentence without its full stop.
pub(crate) fn statement(verdict: VerdictKind, ground: &Ground) -> String {
    let inferred = ground.basis == NoiseBasis::Inferred;
    match verdict {
        VerdictKind::NothingMissing if inferred => format!("nothing found; {}", ground.of_noise()),
        VerdictKind::NothingMissing => format!("nothing found; {}", ground.of_the_rest()),
        VerdictKind::Explained if inferred => format!(
            "the findings explain the error except for noise; {}",
            ground.of_noise()
        ),
        VerdictKind::Explained => {
            format!("the findings explain the error; {}", ground.of_the_rest())
        }
        VerdictKind::Unexplained if inferred => {
            format!("{}; {}", ground.of_what_is_missing(), ground.of_noise())
        }
        VerdictKind::Unexplained => format!(
            "{}, against {}",
            ground.of_what_is_missing(),
            ground.of_noise()
        ),
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
    fn where_joints_alone_were_recorded_the_noise_is_how_well_it_closes() {
        let ground = Ground {
            contacts_only: true,
            ..ground(NoiseBasis::Instrument, Some(17e-6))
        };
        assert_eq!(
            statement(VerdictKind::Explained, &ground),
            "the findings explain the error; the residual agrees with the stated repeatability of closing, 31 um"
        );
        assert_eq!(
            statement(
                VerdictKind::NothingMissing,
                &Ground {
                    basis: NoiseBasis::Inferred,
                    ..ground
                }
            ),
            "nothing found; 31 um scatter at random, of which the stated repeatability of closing explains 17: close ten postures twice"
        );
    }

    #[test]
    fn nothing_found_says_what_its_noise_rests_on() {
        let said =
            |basis, instrument| statement(VerdictKind::NothingMissing, &ground(basis, instrument));
        assert_eq!(
            said(NoiseBasis::Repeats, Some(17e-6)),
            "nothing found; the residual agrees with the noise that 24 repeats show, 31 um"
        );
        assert_eq!(
            said(NoiseBasis::Instrument, Some(17e-6)),
            "nothing found; the residual agrees with the noise that the instrument states, 31 um"
        );
        assert_eq!(
            said(NoiseBasis::Inferred, Some(17e-6)),
            "nothing found; 31 um scatter at random, of which the instrument explains 17: measure ten poses twice"
        );
        assert_eq!(
            said(NoiseBasis::Inferred, None),
            "nothing found; 32 um scatter at random, and no instrument is stated that explains any of it: state `instrument` in \
             `ingest`, and measure ten poses twice"
        );
    }

    #[test]
    fn findings_and_what_they_leave_say_what_their_noise_rests_on() {
        let said = |verdict, basis| statement(verdict, &ground(basis, Some(8.2e-6)));
        for (verdict, basis, sentence) in [
            (
                VerdictKind::Explained,
                NoiseBasis::Repeats,
                "the findings explain the error; the residual agrees with the noise that 24 repeats show, 31 um",
            ),
            (
                VerdictKind::Explained,
                NoiseBasis::Instrument,
                "the findings explain the error; the residual agrees with the noise that the instrument states, 31 um",
            ),
            (
                VerdictKind::Explained,
                NoiseBasis::Inferred,
                "the findings explain the error except for noise; 31 um scatter at random, of which the instrument explains 8.2: \
                 measure ten poses twice",
            ),
            (
                VerdictKind::Unexplained,
                NoiseBasis::Repeats,
                "the findings do not explain everything: 32 um remain, against the noise that 24 repeats show, 31 um",
            ),
            (
                VerdictKind::Unexplained,
                NoiseBasis::Instrument,
                "the findings do not explain everything: 32 um remain, against the noise that the instrument states, 31 um",
            ),
            (
                VerdictKind::Unexplained,
                NoiseBasis::Inferred,
                "the findings do not explain everything: 32 um remain; 31 um scatter at random, of which the instrument explains 8.2: \
                 measure ten poses twice",
            ),
        ] {
            assert_eq!(said(verdict, basis), sentence);
        }
    }

    #[test]
    fn what_is_left_agrees_with_the_noise_only_where_it_does_and_says_of_which_points_it_is() {
        let ground = ground(NoiseBasis::Repeats, Some(17e-6));
        assert_eq!(
            statement(
                VerdictKind::NothingMissing,
                &Ground {
                    agrees: false,
                    left: 46e-6,
                    ..ground
                }
            ),
            "nothing found; 46 um remain, against the noise that 24 repeats show, 31 um"
        );
        assert_eq!(
            statement(
                VerdictKind::Unexplained,
                &Ground {
                    not_carried: Some(80e-6),
                    ..ground
                }
            ),
            "the findings do not explain everything: 80 um remain of held-out points, 32 um of fitted ones, against the noise that 24 \
             repeats show, 31 um"
        );
        assert_eq!(
            statement(
                VerdictKind::Unexplained,
                &Ground {
                    partly_nameless: true,
                    ..ground
                }
            ),
            "the findings reproduce the error, but a part of it has no name: 32 um remain, against the noise that 24 repeats show, 31 um"
        );
        assert_eq!(
            statement(
                VerdictKind::Unexplained,
                &Ground {
                    nameless: true,
                    ..ground
                }
            ),
            "the findings reproduce the error, but none has a name: 32 um remain, against the noise that 24 repeats show, 31 um"
        );
    }

    #[test]
    fn with_an_inferred_noise_nothing_is_ever_said_to_be_complete() {
        for verdict in [
            VerdictKind::NothingMissing,
            VerdictKind::Explained,
            VerdictKind::Unexplained,
        ] {
            for instrument in [None, Some(17e-6)] {
                let said = statement(verdict, &ground(NoiseBasis::Inferred, instrument));
                assert!(
                    said.contains("scatter at random") && !said.contains("nothing is missing"),
                    "{said}"
                );
            }
        }
    }
}
