//! Which step stands for a run: the diagnosed model with what was learned on it, without a diagnosis the last step; never a step that is
//! worse on held-out points than one before it.
//!
//! Held-out points are a guard here and choose nothing else: a step that they find worse is withdrawn, the step before it stands, and
//! every figure of the withdrawn one is said to be of a withdrawn step.

use super::{Frame, Prediction};
use crate::error::Result;
use crate::estimate::autocorrelation_time;
use std::collections::BTreeMap;
use std::fmt;

/// A step is worse where its held-out rms is larger by this share, and its squares by so many standard errors.
const WORSE: f64 = 0.03;
const CLEARLY: f64 = 2.0;
/// Fewer points than this say nothing.
const FEWEST: usize = 5;

/// Errors (mm) of the whole points that a step did not see, its suspects apart, by row of the recording.
#[derive(Debug, Clone, Default)]
pub struct HeldOut(BTreeMap<i64, f64>);

/// A step that predicts.
pub struct Step {
    pub id: String,
    /// Whether it has a model of its own; else it learned on the step before it that has.
    pub own: bool,
    pub held_out: HeldOut,
}

/// The step that stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Standing {
    pub step: String,
    /// The step whose parameters it rests on: itself, or the one that it learned on.
    pub model: String,
    /// Later steps that were worse.
    pub withdrawn: Vec<Withdrawn>,
}

/// A step that was worse than one before it, rms of the same held-out points.
#[derive(Debug, Clone, PartialEq)]
pub struct Withdrawn {
    pub step: String,
    pub rms_mm: f64,
    pub than: String,
    pub than_rms_mm: f64,
    pub points: usize,
}

impl fmt::Display for Withdrawn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { step, rms_mm, than, than_rms_mm, points } = self;
        write!(
            f,
            "`{step}` is withdrawn, `{than}` stands: {rms_mm:.3} mm rms after `{step}`, {than_rms_mm:.3} mm after `{than}` at the same {points} held-out points"
        )
    }
}

impl HeldOut {
    pub fn of(prediction: &Prediction) -> Self {
        let rows = prediction.0.iter().filter(|row| row.held_out && !row.suspect && row.measured.is_none());
        Self(rows.map(|row| (row.sequence, row.error_mm)).collect())
    }

    /// The same from a table `prediction` of which nothing else is read.
    pub fn of_frame(frame: &Frame) -> Result<Self> {
        let (sequence, error) = (frame.read::<i64>("sequence")?, frame.read::<f64>("error_mm")?);
        let (held_out, suspect) = (frame.read::<bool>("held_out")?, frame.read::<bool>("suspect")?);
        let measured = frame.read::<Option<String>>("measured")?;
        let counts = |row: &usize| held_out[*row] && !suspect[*row] && measured[*row].is_none();
        Ok(Self((0..sequence.len()).filter(counts).map(|row| (sequence[row], error[row])).collect()))
    }

    /// Rms of both at the points that both have, and how many, where this one is worse.
    fn worse_than(&self, other: &Self) -> Option<(f64, f64, usize)> {
        let pairs: Vec<(f64, f64)> =
            self.0.iter().filter_map(|(row, own)| Some((own * own, other.0.get(row).map(|error| error * error)?))).collect();
        if pairs.len() < FEWEST {
            return None;
        }
        let count = pairs.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
        let (own, theirs) = (mean(|pair| pair.0), mean(|pair| pair.1));
        let off: Vec<f64> = pairs.iter().map(|(own_square, square)| own_square - square - (own - theirs)).collect();
        let variance = off.iter().map(|value| value * value).sum::<f64>() / (count - 1.0);
        // Points along a path are not as many opinions as there are points.
        let error = (variance * autocorrelation_time(&off, 1) / count).sqrt();
        let is_worse = own.sqrt() > theirs.sqrt() * (1.0 + WORSE) && own - theirs > CLEARLY * error;
        is_worse.then(|| (own.sqrt(), theirs.sqrt(), pairs.len()))
    }
}

/// The step that stands for a run of `steps`, in the order of the pipeline, with the last diagnosis `diagnosed` where there is one.
/// None where nothing predicts.
pub fn standing(steps: &[Step], diagnosed: Option<&str>) -> Option<Standing> {
    let end = match diagnosed.and_then(|id| steps.iter().position(|step| step.id == id)) {
        Some(own) => own + 1 + steps[own + 1..].iter().take_while(|step| !step.own).count(),
        None => steps.len(),
    };
    let mut stands = 0;
    let mut withdrawn: Vec<Withdrawn> = Vec::new();
    for (at, step) in steps.iter().enumerate().take(end).skip(1) {
        match step.held_out.worse_than(&steps[stands].held_out) {
            Some((rms_mm, than_rms_mm, points)) => {
                let than = steps[stands].id.clone();
                withdrawn.push(Withdrawn { step: step.id.clone(), rms_mm, than, than_rms_mm, points });
            }
            None => {
                stands = at;
                // What stands after them makes up for what was worse before.
                withdrawn.clear();
            }
        }
    }
    let model = steps[..end].get(..=stands)?.iter().rfind(|step| step.own).unwrap_or(&steps[stands]);
    Some(Standing { step: steps[stands].id.clone(), model: model.id.clone(), withdrawn })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps with a model of their own or without, each with one error at all points but for a little scatter; `first` points are not
    /// held out.
    fn steps(all: &[(&str, bool, f64, i64)]) -> Vec<Step> {
        let errors = |mean: f64, first: i64| (first..40).map(move |row| (row, mean * (1.0 + 0.1 * f64::from((row % 3) as i32))));
        let step = |(id, own, mean, first): &(&str, bool, f64, i64)| Step {
            id: (*id).into(),
            own: *own,
            held_out: HeldOut(errors(*mean, *first).collect()),
        };
        all.iter().map(step).collect()
    }

    #[test]
    fn a_diagnosis_stands_with_what_was_learned_on_it_and_not_with_another_model() {
        let all = steps(&[
            ("nominal", true, 0.9, 0),
            ("network", false, 0.8, 0),
            ("diagnose", true, 0.1, 0),
            ("on_top", false, 0.08, 0),
            ("joint", true, 0.07, 0),
            ("more", false, 0.06, 0),
        ]);
        let of = |diagnosed| standing(&all, diagnosed).map(|s| (s.step, s.model));
        assert_eq!(of(Some("diagnose")), Some(("on_top".into(), "diagnose".into())));
        assert_eq!(of(Some("joint")), Some(("more".into(), "joint".into())));
        assert_eq!(of(Some("nominal")), Some(("network".into(), "nominal".into())));
        assert_eq!(of(None), Some(("more".into(), "joint".into())));
        assert_eq!(standing(&[], None), None);
    }

    #[test]
    fn a_step_that_is_worse_on_the_same_held_out_points_is_withdrawn() {
        let worse = steps(&[("geometry", true, 0.232, 0), ("diagnose", true, 0.498, 0)]);
        let found = standing(&worse, Some("diagnose")).expect("a step");
        assert_eq!((found.step.as_str(), found.model.as_str()), ("geometry", "geometry"));
        let [gone] = found.withdrawn.as_slice() else { panic!("{:?}", found.withdrawn) };
        assert_eq!((gone.step.as_str(), gone.than.as_str(), gone.points), ("diagnose", "geometry", 40));
        // Of errors m (1, 1.1, 1.2) in turn, 14, 13 and 13 of them, the mean square is 1.21125 m2.
        assert!(
            (gone.rms_mm - 0.498 * 1.21125f64.sqrt()).abs() < 1e-9
                && (gone.than_rms_mm / gone.rms_mm - 0.232 / 0.498).abs() < 1e-9
        );
        // What was learned on it and is no worse stands all the same.
        let mended = steps(&[("geometry", true, 0.232, 0), ("diagnose", true, 0.498, 0), ("network", false, 0.2, 0)]);
        let found = standing(&mended, Some("diagnose")).expect("a step");
        assert_eq!((found.step, found.model, found.withdrawn), ("network".into(), "diagnose".into(), Vec::new()));
        // Points that only one of them did not see say nothing.
        let apart = steps(&[("geometry", true, 0.232, 38), ("diagnose", true, 0.498, 0)]);
        assert_eq!(standing(&apart, Some("diagnose")).map(|s| s.step), Some("diagnose".into()));
        // A share that does not matter is none.
        let close = steps(&[("geometry", true, 0.232, 0), ("diagnose", true, 0.236, 0)]);
        assert_eq!(standing(&close, Some("diagnose")).map(|s| s.step), Some("diagnose".into()));
    }
}
