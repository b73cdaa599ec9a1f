//! Findings that the last fit leaves without size, or that make held-out rows worse, are taken back, and the model is fitted
//! without them: the search judges a linear picture of each, the fit the whole model.

use super::group::{Groups, groups, ranges};
use super::judge::{HeldOut, Worth};
use super::pool::Pool;
use super::{Chosen, Course, Question, start_of};
use crate::effect::{Effect, Survey};
use crate::estimate::Fate;
use crate::robot::Measurements;

/// What a judgement rests on.
pub(crate) struct Court<'a, 'b> {
    pub pool: &'b Pool<'a>,
    pub survey: &'b Survey<'a>,
    pub data: &'b Measurements,
    pub question: &'b Question<'b>,
    /// Fits the model of a course anew with these causes.
    pub refit: &'b dyn Fn(&Course, &[Chosen]) -> Course,
}

/// The fit without findings that cannot stand, and a sentence for each of these; `set` holds the chosen causes' positions in the pool
/// in their order, `worths` what held-out rows say of them.
pub(crate) fn withdraw(
    mut now: Course,
    set: &mut Vec<usize>,
    worths: &mut Vec<Worth>,
    court: &Court,
) -> (Course, Vec<String>) {
    let mut said = Vec::new();
    if now.screening.apart.is_some() {
        return (now, said);
    }
    while let Some((gone, sentence, course)) = empty(&now, set, court).or_else(|| harmful(&now, set, worths, court)) {
        let kept = |i: &usize| !gone.contains(i);
        *set = (0..set.len()).filter(kept).map(|i| set[i]).collect();
        said.push(sentence);
        now = course;
    }
    (now, said)
}

/// The finding that was not estimated, else the weakest of those that are smaller than their own uncertainty.
fn empty(now: &Course, set: &[usize], court: &Court) -> Option<(Vec<usize>, String, Course)> {
    let ranges = ranges(now);
    let strength = |members: &[usize]| -> Option<f64> {
        let own = members.iter().flat_map(|i| ranges[*i].clone());
        let free: Vec<usize> = own.filter(|k| matches!(now.fitted.fates[*k], Fate::Free(_))).collect();
        if free.is_empty() {
            return Some(0.0);
        }
        let values: Vec<f64> = free.iter().map(|k| now.model.x[*k]).collect();
        let square = now.fitted.covariance.as_ref()?.distance(&free, &values)?;
        Some(square / free.len() as f64)
    };
    let groups = groups(now, set, court.pool, court.survey);
    let weak = groups.into_iter().filter_map(|(key, members)| Some((strength(&members)?, key, members)));
    let (size, (effect, place), members) = weak.filter(|(size, ..)| *size < 1.0).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let why = if size == 0.0 {
        "these data do not tell it from the rest of the model"
    } else {
        "in the whole model it is smaller than its own uncertainty"
    };
    let course = without(now, &members, court);
    Some((members, format!("{effect} at {place}: {why}"), course))
}

/// The finding without which held-out rows are better beyond their scatter, of those that do no good there or were not asked alone.
fn harmful(now: &Course, set: &[usize], worths: &mut Vec<Worth>, court: &Court) -> Option<(Vec<usize>, String, Course)> {
    let seen = HeldOut::of(now, court.data, court.question)?;
    let groups: Groups = groups(now, set, court.pool, court.survey);
    for ((effect, place), members) in groups {
        let names: Vec<&'static str> = members.iter().map(|i| court.name(set[*i])).collect();
        let alike = names.iter().all(|name| *name == names[0]);
        let known = worths.iter_mut().find(|worth| alike && worth.effect == names[0] && worth.place == place);
        if known.as_ref().is_some_and(|worth| worth.gain >= 0.0) {
            continue;
        }
        let course = without(now, &members, court);
        let bare = HeldOut::of(&course, court.data, court.question)?;
        if bare.is_beyond_doubt_better_than(&seen) {
            return Some((members, format!("{effect} at {place}: held-out points are better without it"), course));
        }
        match known {
            Some(worth) => worth.gain = bare.rms() - seen.rms(),
            None if alike => worths.push(Worth { effect: names[0], place, gain: bare.rms() - seen.rms() }),
            None => (),
        }
    }
    None
}

impl Court<'_, '_> {
    fn name(&self, k: usize) -> &'static str {
        self.pool.hypotheses[k].form.name()
    }
}

/// The fit without some of the chosen causes.
fn without(now: &Course, members: &[usize], court: &Court) -> Course {
    let all = start_of(now).into_iter().enumerate();
    let rest: Vec<Chosen> = all.filter(|(i, _)| !members.contains(i)).map(|(_, cause)| cause).collect();
    (court.refit)(now, &rest)
}
