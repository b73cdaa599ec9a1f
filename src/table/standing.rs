//! Which step stands for a run: the diagnosed model with what was learned on it, without a diagnosis the last step; never a step that is
//! worse than one before it on points that neither has seen.
//!
//! The points that judge are those of the fit, each as the folds of its step predict it, or as a step does that was not fitted to it.
//! Points that no step was fitted to choose nothing: where they contradict the choice, that is said.

use super::{Frame, Prediction};
use crate::error::Result;
use crate::estimate::{autocorrelation_time, tail};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// A step is worse where its rms is larger by this share, and its squares by so many standard errors.
const WORSE: f64 = 0.03;
const CLEARLY: f64 = 2.0;
/// Held-out points contradict a choice where an earlier step, of however many, is so much better by chance in one of so many runs.
const CONTRADICTED: f64 = 1e-3;
/// Fewer points than this say nothing.
const FEWEST: usize = 5;

/// Errors (mm) by row of the recording.
type ErrorsByRow = BTreeMap<i64, f64>;

/// Errors of the whole points that a step did not see, its suspects apart.
#[derive(Debug, Clone, Default)]
pub struct Unseen {
    /// Errors of rows that it was fitted to, by fits without their folds.
    folds: ErrorsByRow,
    /// Errors of all other rows.
    held_out: ErrorsByRow,
    /// Rows that it, or a step before it, was fitted to.
    fitted: BTreeSet<i64>,
}

/// A step that predicts.
pub struct Step {
    /// Its id in the pipeline.
    pub id: String,
    /// Whether it has a model of its own; else it learned on the step before it that has.
    pub is_identified: bool,
    /// Its errors at rows that its fits have not seen.
    pub unseen: Unseen,
}

/// The step that stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// Id of the stage that stands for the run.
    pub step: String,
    /// The step whose parameters it rests on: itself, or the one that it learned on.
    pub model: String,
    /// Later steps that were worse.
    pub withdrawn: Vec<Withdrawn>,
    /// An earlier step that is better at points that no step was fitted to.
    pub contradicted: Option<Contradicted>,
}

/// A step that was worse than one before it, rms of the same points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Withdrawn {
    /// Id of the stage that is withdrawn.
    pub step: String,
    /// Its rms at the points that both predict without having seen them.
    pub rms_mm: f64,
    /// Id of the earlier stage.
    pub than: String,
    /// The rms of that one at the same points.
    pub than_rms_mm: f64,
    /// Number of these points.
    pub points: usize,
}

/// The same of the step that stands, at points that choose nothing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contradicted(pub Withdrawn);

impl fmt::Display for Withdrawn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (step, than, points) = (&self.step, &self.than, self.points);
        let (rms_mm, than_rms_mm) = (self.rms_mm, self.than_rms_mm);
        write!(
            f,
            "`{step}` is withdrawn and `{than}` used instead: {rms_mm:.3} mm rms after `{step}`, {than_rms_mm:.3} mm after `{than}` at the same {points} points, predicted by fits without them"
        )
    }
}

impl fmt::Display for Contradicted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (step, than, points) = (&self.0.step, &self.0.than, self.0.points);
        let (rms_mm, than_rms_mm) = (self.0.rms_mm, self.0.than_rms_mm);
        write!(
            f,
            "the {points} held-out points contradict the choice of `{step}`: {rms_mm:.3} mm rms after `{step}`, {than_rms_mm:.3} mm after `{than}`. Held-out points judge a step and never choose one: something differs there that the fitted points do not show"
        )
    }
}

impl Standing {
    /// What a person must know of the choice, a sentence each.
    pub fn warnings(&self) -> impl Iterator<Item = String> + '_ {
        self.withdrawn
            .iter()
            .map(ToString::to_string)
            .chain(self.contradicted.iter().map(ToString::to_string))
    }
}

impl Unseen {
    /// Errors of a step at rows that its fits have not seen.
    pub fn of(prediction: &Prediction) -> Self {
        let mut out = Self::default();
        for row in prediction
            .0
            .iter()
            .filter(|row| !row.suspect && row.measured.is_none())
        {
            out.add(row.sequence, row.error_mm, row.held_out, row.fold_error_mm);
        }
        out
    }

    /// The same from a table `prediction` of which nothing else is read.
    pub fn of_frame(frame: &Frame) -> Result<Self> {
        let (sequence, error) = (
            frame.read::<i64>("sequence")?,
            frame.read::<f64>("error_mm")?,
        );
        let (held_out, suspect) = (
            frame.read::<bool>("held_out")?,
            frame.read::<bool>("suspect")?,
        );
        let (measured, fold) = (
            frame.read::<Option<String>>("measured")?,
            frame.read::<Option<f64>>("fold_error_mm")?,
        );
        let mut out = Self::default();
        for row in (0..sequence.len()).filter(|row| !suspect[*row] && measured[*row].is_none()) {
            out.add(sequence[row], error[row], held_out[row], fold[row]);
        }
        Ok(out)
    }

    fn add(&mut self, row: i64, error: f64, held_out: bool, fold: Option<f64>) {
        if !held_out {
            self.fitted.insert(row);
        }
        match fold {
            Some(fold) => self.folds.insert(row, fold),
            None if held_out => self.held_out.insert(row, error),
            None => None,
        };
    }
}

/// Rms of both at the points that both have, and how many, where the first is worse.
struct StepComparison {
    rms: [f64; 2],
    points: usize,
    /// Difference of the mean squares in its standard errors, and how many points the scatter counts as.
    clearly: f64,
    independent: f64,
}

/// The comparison of two steps, where the first is worse by more than does not matter.
fn worse(one: &ErrorsByRow, other: &ErrorsByRow) -> Option<StepComparison> {
    let pairs: Vec<(f64, f64)> = one
        .iter()
        .filter_map(|(row, left)| Some((left * left, other.get(row).map(|error| error * error)?)))
        .collect();
    if pairs.len() < FEWEST {
        return None;
    }
    let count = pairs.len() as f64;
    let mean = |value_of: fn(&(f64, f64)) -> f64| pairs.iter().map(value_of).sum::<f64>() / count;
    let (ours, theirs) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let off: Vec<f64> = pairs
        .iter()
        .map(|(own_square, square)| own_square - square - (ours - theirs))
        .collect();
    let variance = off.iter().map(|value| value * value).sum::<f64>() / (count - 1.0);
    // Points along a path are not as many opinions as there are points.
    let independent = count / autocorrelation_time(&off, 1);
    let clearly = (ours - theirs) / (variance / independent).sqrt();
    let is_worse = ours.sqrt() > theirs.sqrt() * (1.0 + WORSE) && clearly > CLEARLY;
    is_worse.then(|| StepComparison {
        rms: [ours.sqrt(), theirs.sqrt()],
        points: pairs.len(),
        clearly,
        independent,
    })
}

impl StepComparison {
    /// Whether the least of so many comparisons has it by chance as seldom as a contradiction may be (Student's t; Bonferroni).
    fn contradicts(&self, comparisons: usize) -> bool {
        let chance = 0.5 * tail(self.clearly.powi(2), 1.0, (self.independent - 1.0).max(1.0));
        chance * (comparisons as f64) < CONTRADICTED
    }
}

/// The step that stands for a run of `steps`, in the order of the pipeline, with the last diagnosis `diagnosed` where there is one.
/// None where nothing predicts.
pub fn standing(steps: &[Step], diagnosed: Option<&str>) -> Option<Standing> {
    let end = match diagnosed.and_then(|id| steps.iter().position(|step| step.id == id)) {
        Some(before) => {
            before
                + 1
                + steps[before + 1..]
                    .iter()
                    .take_while(|step| !step.is_identified)
                    .count()
        }
        None => steps.len(),
    };
    let never = never_fitted(steps);
    let judged = |step: &Step| -> ErrorsByRow {
        let others = step
            .unseen
            .held_out
            .iter()
            .filter(|(row, _)| !never.contains(row));
        step.unseen
            .folds
            .iter()
            .chain(others)
            .map(|(row, error)| (*row, *error))
            .collect()
    };
    let compared = |a: &Step, b: &Step, found: Option<StepComparison>| {
        let StepComparison {
            rms: [rms_mm, than_rms_mm],
            points,
            ..
        } = found?;
        Some(Withdrawn {
            step: a.id.clone(),
            rms_mm,
            than: b.id.clone(),
            than_rms_mm,
            points,
        })
    };
    let mut stands = 0;
    let mut withdrawn: Vec<Withdrawn> = Vec::new();
    for (at, step) in steps.iter().enumerate().take(end).skip(1) {
        match compared(
            step,
            &steps[stands],
            worse(&judged(step), &judged(&steps[stands])),
        ) {
            Some(gone) => withdrawn.push(gone),
            None => {
                stands = at;
                // What stands after them makes up for what was worse before.
                withdrawn.clear();
            }
        }
    }
    let model = steps[..end]
        .get(..=stands)?
        .iter()
        .rfind(|step| step.is_identified)
        .unwrap_or(&steps[stands]);
    let chosen = &steps[stands];
    let guard = |step: &Step| -> ErrorsByRow {
        step.unseen
            .held_out
            .iter()
            .filter(|(row, _)| never.contains(row))
            .map(|(row, error)| (*row, *error))
            .collect()
    };
    let against =
        |step: &Step| worse(&guard(chosen), &guard(step)).filter(|found| found.contradicts(stands));
    let better = steps[..stands]
        .iter()
        .filter_map(|step| compared(chosen, step, against(step)));
    let contradicted = better
        .min_by(|a, b| a.than_rms_mm.total_cmp(&b.than_rms_mm))
        .map(Contradicted);
    Some(Standing {
        step: chosen.id.clone(),
        model: model.id.clone(),
        withdrawn,
        contradicted,
    })
}

/// Rows that no step was fitted to.
fn never_fitted(steps: &[Step]) -> BTreeSet<i64> {
    let rows: BTreeSet<i64> = steps
        .iter()
        .flat_map(|step| step.unseen.held_out.keys().copied())
        .collect();
    let fitted: BTreeSet<i64> = steps
        .iter()
        .flat_map(|step| step.unseen.fitted.iter().copied())
        .collect();
    rows.difference(&fitted).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps by name, error in folds and held-out error, `~` before one without a model of its own; errors are the same at all points but for
    /// a little scatter. The first so many points are folds of a fit to them, all others are held out.
    fn steps(all: &str, folds: i64) -> Vec<Step> {
        let scattered =
            |mean: f64, row: i64| (row, mean * (1.0 + 0.1 * f64::from((row % 3) as i32)));
        let step = |words: &str| {
            let words: Vec<&str> = words.split_whitespace().collect();
            let [fold, held_out] = [words[1], words[2]].map(|word| word.parse().unwrap());
            Step {
                id: words[0].trim_start_matches('~').into(),
                is_identified: !words[0].starts_with('~'),
                unseen: Unseen {
                    folds: (0..folds).map(|row| scattered(fold, row)).collect(),
                    held_out: (folds..80).map(|row| scattered(held_out, row)).collect(),
                    fitted: (0..folds).collect(),
                },
            }
        };
        all.split(',').map(step).collect()
    }

    fn stands(all: &str, folds: i64) -> Standing {
        standing(&steps(all, folds), Some("diagnose")).expect("a step")
    }

    #[test]
    fn a_diagnosis_stands_with_what_was_learned_on_it_and_not_with_another_model() {
        let all = "nominal 0.9 0.9, ~network 0.8 0.8, diagnose 0.1 0.1, ~on_top 0.08 0.08, joint 0.07 0.07, ~more 0.06 0.06";
        let all = steps(all, 40);
        let of_diagnosed = |diagnosed| standing(&all, diagnosed).map(|s| (s.step, s.model));
        assert_eq!(
            of_diagnosed(Some("diagnose")),
            Some(("on_top".into(), "diagnose".into()))
        );
        assert_eq!(
            of_diagnosed(Some("joint")),
            Some(("more".into(), "joint".into()))
        );
        assert_eq!(
            of_diagnosed(Some("nominal")),
            Some(("network".into(), "nominal".into()))
        );
        assert_eq!(of_diagnosed(None), Some(("more".into(), "joint".into())));
        assert_eq!(standing(&[], None), None);
    }

    #[test]
    fn a_step_that_is_worse_at_points_that_it_did_not_see_is_withdrawn() {
        let worse = "geometry 0.232 0.2, diagnose 0.498 0.2";
        let found = stands(worse, 40);
        assert_eq!(
            (found.step.as_str(), found.model.as_str()),
            ("geometry", "geometry")
        );
        let [gone] = found.withdrawn.as_slice() else {
            panic!("{:?}", found.withdrawn)
        };
        assert_eq!(
            (gone.step.as_str(), gone.than.as_str(), gone.points),
            ("diagnose", "geometry", 40)
        );
        // The mean square of errors m (1, 1.1, 1.2) in turn, 14, 13 and 13 of them, is 1.21125 m2.
        assert!(
            (gone.rms_mm - 0.498 * 1.21125f64.sqrt()).abs() < 1e-9
                && (gone.than_rms_mm / gone.rms_mm - 0.232 / 0.498).abs() < 1e-9
        );
        assert_eq!(found.contradicted, None);
        // What was learned on it and is no worse stands all the same.
        let found = stands(&format!("{worse}, ~network 0.2 0.2"), 40);
        assert_eq!(
            (found.step, found.model, found.withdrawn),
            ("network".into(), "diagnose".into(), Vec::new())
        );
        // Fewer points than five say nothing.
        assert_eq!(stands(worse, 4).step, "diagnose");
        // A share that does not matter is none.
        let close = stands("geometry 0.232 0.2, diagnose 0.236 0.2", 40);
        assert_eq!(close.step, "diagnose");
    }

    #[test]
    fn points_that_no_step_was_fitted_to_choose_nothing_and_are_heard() {
        let with = |held_out| stands(&format!("geometry 0.232 0.25, diagnose 0.1 {held_out}"), 40);
        let [agreed, against] = ["0.12", "0.9"].map(with);
        assert_eq!([&agreed.step, &against.step], ["diagnose"; 2]);
        assert_eq!(
            (agreed.contradicted, &against.withdrawn),
            (None, &Vec::new())
        );
        let Contradicted(found) = against.contradicted.expect("a contradiction");
        assert_eq!(
            (found.step.as_str(), found.than.as_str(), found.points),
            ("diagnose", "geometry", 40)
        );
    }

    #[test]
    fn steps_that_differ_by_chance_are_contradicted_once_in_a_thousand_runs() {
        // Three steps as good as each other at 25 points: noise of 18 um and 4 um of what each fit made of it, a step its own.
        let mut state = 7_u64;
        let mut even = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut normal = move || (0..12).map(|_| even()).sum::<f64>() - 6.0;
        let runs = 4000;
        let mut contradicted = 0;
        for _ in 0..runs {
            let mut all = steps("nominal 0.3 0, geometry 0.2 0, diagnose 0.1 0", 55);
            for row in 55..80 {
                let noise = [0.018, 0.018, 0.018].map(|sigma| sigma * normal());
                for step in &mut all {
                    let square: f64 = noise
                        .iter()
                        .map(|noise| (noise + 0.004 * normal()).powi(2))
                        .sum();
                    step.unseen.held_out.insert(row, square.sqrt());
                }
            }
            contradicted += usize::from(
                standing(&all, Some("diagnose")).is_some_and(|found| found.contradicted.is_some()),
            );
        }
        assert!(contradicted <= 8, "{contradicted} of {runs}");
    }

    #[test]
    fn rows_that_a_later_step_was_fitted_to_judge_by_its_folds_and_by_the_earlier_step_as_it_is() {
        let all = steps("geometry 0.1 0.2, stiffness 0.5 0.2", 40);
        let [mut geometry, stiffness] = <[Step; 2]>::try_from(all).ok().expect("two steps");
        // The first step was fitted to none of the rows.
        geometry.unseen.held_out.append(&mut geometry.unseen.folds);
        geometry.unseen.fitted.clear();
        let found = standing(&[geometry, stiffness], None).expect("a step");
        assert_eq!(
            (found.step.as_str(), found.withdrawn[0].points),
            ("geometry", 40)
        );
    }
}
