//! The verdict in a sentence that claims no more than its noise does: known by repeats, stated by the instrument, or inferred.

use crate::diagnose::types::VerdictKind;
use crate::error::counted;
use crate::observation::Dimension;
use crate::robot::NoiseBasis;

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
        let statement_of =
            |basis, instrument| statement(VerdictKind::NothingMissing, &ground(basis, instrument));
        assert_eq!(
            statement_of(NoiseBasis::Repeats, Some(17e-6)),
            "nothing found; the residual agrees with the noise that 24 repeats show, 31 um"
        );
        assert_eq!(
            statement_of(NoiseBasis::Instrument, Some(17e-6)),
            "nothing found; the residual agrees with the noise that the instrument states, 31 um"
        );
        assert_eq!(
            statement_of(NoiseBasis::Inferred, Some(17e-6)),
            "nothing found; 31 um scatter at random, of which the instrument explains 17: measure ten poses twice"
        );
        assert_eq!(
            statement_of(NoiseBasis::Inferred, None),
            "nothing found; 32 um scatter at random, and no instrument is stated that explains any of it: state `instrument` in \
             `ingest`, and measure ten poses twice"
        );
    }

    #[test]
    fn findings_and_what_they_leave_say_what_their_noise_rests_on() {
        let statement_of = |verdict, basis| statement(verdict, &ground(basis, Some(8.2e-6)));
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
            assert_eq!(statement_of(verdict, basis), sentence);
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
                let text = statement(verdict, &ground(NoiseBasis::Inferred, instrument));
                assert!(
                    text.contains("scatter at random") && !text.contains("nothing is missing"),
                    "{text}"
                );
            }
        }
    }
}
