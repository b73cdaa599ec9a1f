//! What a diagnosis found, its numbers, and what would explain the data as well: three tables linked by the finding's rank.

use crate::diagnose::{Diagnosis, ErrorLengths, Located, VerdictKind};
use crate::dynamics::TorqueDiagnosis;
use crate::effect::cause;
use crate::observation::Dimension;
use crate::{
    CellRow, Cells, FindingNumberRow, FindingNumbers, FindingRow, Findings, FormRow, Forms,
    RivalRow, Rivals, ShareRow, Shares, Spectrum, SpectrumRow, Verdict, VerdictRow,
    VerdictSentenceRow, VerdictSentences,
};
use calib_foundation::named;
use calib_numerics::robot::NoiseBasis;

impl FindingRow {
    /// The joint (from 1) whose range bounds it, that range as people read it, and the range's unit.
    pub fn valid_range(&self) -> Option<(i64, [f64; 2], &'static str)> {
        let joint = self.valid_joint?;
        match (
            self.valid_from_rad.zip(self.valid_to_rad),
            self.valid_from_mm.zip(self.valid_to_mm),
        ) {
            (Some((from, to)), _) => Some((joint, [from.to_degrees(), to.to_degrees()], "deg")),
            (None, Some((from, to))) => Some((joint, [from, to], "mm")),
            (None, None) => None,
        }
    }
}

/// Whether more poses may separate an effect of these tables from others.
pub fn is_separable_by_poses(effect: &str) -> bool {
    cause(effect).is_none_or(|cause| cause.separable_by_poses)
}

pub(super) fn ranked<F>(findings: &[F]) -> impl Iterator<Item = (i64, &F)> {
    (1..).zip(findings)
}

/// Of two probabilities, those that are known.
pub(super) fn sum<P: From<f64> + Into<Option<f64>>>(one: P, other: P) -> P {
    P::from(one.into().unwrap_or(0.0) + other.into().unwrap_or(0.0))
}

/// The tables of a diagnosis that stand beside its findings: their numbers, and their rivals.
macro_rules! beside_findings {
    ($diagnosis:ty => $numbers:ident::$of:ident of $number_row:ident, $rivals:ident::$rivals_of:ident of $rival_row:ident) => {
        impl $numbers {
            /// A row for each number of each finding.
            pub fn $of(diagnosis: &$diagnosis) -> Self {
                let rows =
                    $crate::findings::ranked(&diagnosis.findings).flat_map(|(rank, finding)| {
                        finding.parameters.iter().map(move |number| $number_row {
                            rank,
                            name: number.name.clone(),
                            value: number.value,
                            unit: number.unit.into(),
                            sigma: number.sigma.filter(|sigma| sigma.is_finite()),
                        })
                    });
                Self(rows.collect())
            }
        }

        impl $rivals {
            /// A row for each rival of each finding.
            pub fn $rivals_of(diagnosis: &$diagnosis) -> Self {
                let rows =
                    $crate::findings::ranked(&diagnosis.findings).flat_map(|(rank, finding)| {
                        finding.rivals.iter().map(move |rival| $rival_row {
                            rank,
                            effect: rival.effect.clone().into(),
                            place: rival.place.to_string(),
                            delta_bic: rival.delta_bic,
                            probability: rival.probability.into(),
                        })
                    });
                let mut rows: Vec<$rival_row> = rows.collect();
                rows.sort_by(|a, b| {
                    (a.rank, &a.effect, &a.place).cmp(&(b.rank, &b.effect, &b.place))
                });
                // Several names of one finding may have one rival.
                rows.dedup_by(|next, kept| {
                    let same = (next.rank, &next.effect, &next.place)
                        == (kept.rank, &kept.effect, &kept.place);
                    if same {
                        kept.delta_bic = kept.delta_bic.min(next.delta_bic);
                        kept.probability =
                            $crate::findings::sum(kept.probability, next.probability);
                    }
                    same
                });
                Self(rows)
            }
        }
    };
}
pub(super) use beside_findings;

beside_findings! { Diagnosis => FindingNumbers::of of FindingNumberRow, Rivals::of of RivalRow }

impl Findings {
    /// A row for each finding.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let lengths = diagnosis.dimension == Dimension::Length;
        let mm = |size: Option<f64>| size.filter(|_| lengths).map(|size| size * 1e3);
        let rad = |size: Option<f64>| size.filter(|_| !lengths);
        let rows = ranked(&diagnosis.findings).map(|(rank, finding)| {
            let evidence = finding.evidence;
            let gain = evidence.and_then(|e| e.heldout_gain);
            let effect_rms = evidence.map(|e| e.effect_rms);
            let (turned, slid) = match finding.valid {
                Some((joint, range)) if diagnosis.model.robot.is_revolute(joint) => {
                    (range.map(Some), [None; 2])
                }
                Some((_, range)) => ([None; 2], range.map(|q| Some(1e3 * q))),
                None => ([None; 2], [None; 2]),
            };
            FindingRow {
                rank,
                effect: finding.effect.clone().into(),
                place: finding.place.to_string(),
                follows: finding
                    .forms
                    .first()
                    .map(|form| form.follows(finding.place).into()),
                statement: finding.statement.clone(),
                f_statistic: evidence.map(|e| e.f_statistic),
                p_value: evidence.map(|e| e.p_value),
                delta_bic: evidence.map(|e| e.delta_bic),
                heldout_gain_mm: mm(gain),
                effect_rms_mm: mm(effect_rms),
                heldout_gain_rad: rad(gain),
                effect_rms_rad: rad(effect_rms),
                probability: Some(finding.probabilities.name),
                place_probability: Some(finding.probabilities.place),
                none_probability: Some(finding.probabilities.none),
                valid_joint: finding.valid.map(|(joint, _)| joint as i64 + 1),
                valid_from_rad: turned[0],
                valid_to_rad: turned[1],
                valid_from_mm: slid[0],
                valid_to_mm: slid[1],
                forms: serde_json::to_string(&finding.forms).expect("numbers and names serialise"),
            }
        });
        Self(rows.collect())
    }
}

fn moments(diagnosis: &Diagnosis) -> [(&'static str, &Located); 2] {
    [
        ("after", &diagnosis.located_after),
        ("before", &diagnosis.located_before),
    ]
}

impl Shares {
    /// A row for each place and variable, before and after.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let rows = moments(diagnosis)
            .into_iter()
            .flat_map(|(moment, located)| {
                located.shares.iter().map(move |share| ShareRow {
                    moment: moment.into(),
                    by: share.by.into(),
                    name: share.name.clone(),
                    share: share.share,
                    numbers: share.parameters as i64,
                    delta_bic: share.delta_bic,
                    effect: share.effect.clone().into(),
                })
            });
        Self(rows.collect())
    }
}

impl Cells {
    /// A row for each place and kind of variable, before and after.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let lengths = diagnosis.dimension == Dimension::Length;
        let rows = moments(diagnosis)
            .into_iter()
            .flat_map(|(moment, located)| {
                located.cells.iter().map(move |cell| CellRow {
                    moment: moment.into(),
                    place: cell.place.to_string(),
                    follows: cell.follows.into(),
                    explains_mm: lengths.then_some(1e3 * cell.explains),
                    delta_bic: cell.delta_bic,
                    effect: cell.effect.clone().into(),
                })
            });
        Self(rows.collect())
    }
}

impl Spectrum {
    /// A row for each order of each joint.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let rows = moments(diagnosis)
            .into_iter()
            .flat_map(|(moment, located)| {
                located.spectrum.iter().map(move |line| SpectrumRow {
                    moment: moment.into(),
                    joint: line.joint as i64 + 1,
                    of: if line.motor { "motor" } else { "joint" }.into(),
                    order: i64::from(line.order),
                    share: line.share,
                })
            });
        Self(rows.collect())
    }
}

impl Forms {
    /// The formulas of a diagnosis.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let (mut rows, mut last, mut form) = (Vec::new(), None, 0);
        for one in &diagnosis.formulas {
            form = if last == Some(one.finding) {
                form + 1
            } else {
                1
            };
            last = Some(one.finding);
            let declaration =
                serde_json::to_string(&one.declaration).expect("numbers and texts serialise");
            rows.extend(one.numbers.iter().map(|number| FormRow {
                rank: one.finding as i64 + 1,
                form,
                number: number.name.clone(),
                formula: one.declaration.law.0.join("; "),
                price: one.price as i64,
                folds_rms_mm: one.folds * 1e3,
                curve_rms_mm: one.curve * 1e3,
                without_rms_mm: one.without.map(|without| without * 1e3),
                proposed: one.chosen,
                value: number.value,
                unit: number.unit.into(),
                sigma: number.sigma.filter(|sigma| sigma.is_finite()),
                declaration: declaration.clone(),
            }));
        }
        Self(rows)
    }

    /// Formulas of a finding, each as its rows, cheapest first.
    pub fn of_finding(&self, rank: i64) -> impl Iterator<Item = &[FormRow]> {
        let is_of_rank = move |rows: &&[FormRow]| rows.first().is_some_and(|row| row.rank == rank);
        self.0
            .chunk_by(|a, b| (a.rank, a.form) == (b.rank, b.form))
            .filter(is_of_rank)
    }
}

/// A formula with its numbers in words: `exp(-((q - centre) / width)^2): centre = 0.71 +- 0.02 rad, c1 = 53 +- 2 arcsec`.
pub fn formula_in_words(rows: &[FormRow]) -> String {
    let Some(first) = rows.first() else {
        return String::new();
    };
    let number = |row: &FormRow| {
        let sigma = row
            .sigma
            .map(|sigma| format!(" +- {}", brief(sigma)))
            .unwrap_or_default();
        let unit = if row.unit == "1" || row.unit == "SI" {
            String::new()
        } else {
            format!(" {}", row.unit)
        };
        format!("{} = {}{sigma}{unit}", row.number, brief(row.value))
    };
    format!(
        "{}: {}",
        first.formula,
        rows.iter().map(number).collect::<Vec<_>>().join(", ")
    )
}

fn brief(value: f64) -> String {
    let power = if value == 0.0 {
        0.0
    } else {
        value.abs().log10().floor()
    };
    if (-4.0..6.0).contains(&power) {
        format!("{value:.*}", (2.0 - power).max(0.0) as usize)
    } else {
        format!("{value:.2e}")
    }
}

impl VerdictRow {
    /// Whether something is left that neither a finding nor noise explains.
    pub fn is_unexplained(&self) -> bool {
        self.verdict == VerdictKind::Unexplained.name()
    }

    /// Whether nothing is known of the noise: neither was it stated nor measured, nor is it what the joints scatter by.
    pub fn is_noise_assumed(&self) -> bool {
        self.is_noise_inferred() && self.repeatability_rad == 0.0
    }

    /// Whether the noise was neither stated nor measured.
    pub fn is_noise_inferred(&self) -> bool {
        self.noise_basis.as_deref() == Some(NoiseBasis::Inferred.name())
    }
}

impl Verdict {
    /// What is wrong with the set-up, where a diagnosis says so: `findings` are its own.
    pub fn wrong_setup(&self, findings: &Findings) -> Option<String> {
        let wrong = self
            .0
            .iter()
            .any(|row| row.verdict == VerdictKind::WrongSetup.name());
        let first = findings
            .0
            .first()
            .map(|finding| finding.statement.as_str())
            .unwrap_or_default();
        wrong.then(|| {
            format!("the set-up is wrong: {first}")
                .trim_end_matches('.')
                .to_string()
        })
    }

    /// The verdict of the stage `step`.
    pub fn of(step: &str, diagnosis: &Diagnosis) -> Self {
        let lengths = diagnosis.dimension == Dimension::Length;
        let in_mm = |size: f64| lengths.then_some(size * 1e3);
        let in_rad = |size: f64| (!lengths).then_some(size);
        let mm = |errors: Option<ErrorLengths>, value_of: fn(ErrorLengths) -> f64| {
            errors.and_then(|errors| in_mm(value_of(errors)))
        };
        let rms_rad = |errors: Option<ErrorLengths>| errors.and_then(|errors| in_rad(errors.rms));
        Self(vec![VerdictRow {
            step: step.into(),
            verdict: diagnosis.verdict.name().into(),
            statement: Some(diagnosis.statement.clone()),
            noise_basis: Some(diagnosis.noise_basis.name().into()),
            noise_floor_mm: in_mm(diagnosis.noise_floor),
            held_out: diagnosis.held_out,
            before_mean_mm: mm(diagnosis.before, |e| e.mean),
            before_rms_mm: mm(diagnosis.before, |e| e.rms),
            before_max_mm: mm(diagnosis.before, |e| e.max),
            after_mean_mm: mm(diagnosis.after, |e| e.mean),
            after_rms_mm: mm(diagnosis.after, |e| e.rms),
            after_max_mm: mm(diagnosis.after, |e| e.max),
            leftover_rms_mm: in_mm(diagnosis.leftover_rms),
            noise_floor_rad: in_rad(diagnosis.noise_floor),
            before_rms_rad: rms_rad(diagnosis.before),
            after_rms_rad: rms_rad(diagnosis.after),
            leftover_rms_rad: in_rad(diagnosis.leftover_rms),
            chi_square: diagnosis.chi_square,
            p_before: diagnosis.gate_first,
            p_after: diagnosis.gate_last,
            repeatability_rad: diagnosis.repeatability.sigma,
            repeats: diagnosis.repeatability.repeats as i64,
            points: diagnosis.kept.len() as i64,
            signature: diagnosis.signature.clone(),
            clock: Some(if diagnosis.clock { "s" } else { "row" }.into()),
        }])
    }
}

named! {
    /// What a sentence is about.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum VerdictTopic {
        /// What the data cannot show.
        NotObservable "not_observable",
        /// What to measure next.
        NextMeasurement "next_measurement",
        /// What is odd about the recording.
        Remark "remark",
    }
}

impl VerdictSentences {
    /// The sentences of the stage `step`, in their order.
    pub fn of(step: &str, topics: &[(VerdictTopic, &[String])]) -> Self {
        let row = |topic: VerdictTopic, number, sentence: &String| VerdictSentenceRow {
            step: step.into(),
            about: topic.name().into(),
            number,
            sentence: sentence.clone(),
        };
        let rows = topics.iter().flat_map(|(topic, all)| {
            (1..)
                .zip(*all)
                .map(|(number, text)| row(*topic, number, text))
        });
        Self(rows.collect())
    }

    /// What a diagnosis of positions says, of the stage `step`.
    pub fn of_positions(step: &str, diagnosis: &Diagnosis) -> Self {
        let unseen = (VerdictTopic::NotObservable, &diagnosis.not_observable[..]);
        let next = (
            VerdictTopic::NextMeasurement,
            &diagnosis.next_measurements[..],
        );
        Self::of(step, &[unseen, next])
    }

    /// The same of a diagnosis of torques.
    pub fn of_torques(step: &str, diagnosis: &TorqueDiagnosis) -> Self {
        let unseen = (VerdictTopic::NotObservable, &diagnosis.not_observable[..]);
        let remarks = (VerdictTopic::Remark, &diagnosis.remarks[..]);
        Self::of(step, &[unseen, remarks])
    }

    /// What the stage `step` says of a topic, in its order.
    pub fn about(&self, step: &str, topic: VerdictTopic) -> Vec<&str> {
        let sentences = self
            .0
            .iter()
            .filter(|row| row.step == step && row.about == topic.name());
        sentences.map(|row| row.sentence.as_str()).collect()
    }
}
