//! Which forms the recording asks for: forward by the largest gain beyond its penalty, exchanges, merges and removals.

use super::bootstrap::beats_chance;
use super::choice::{CauseChoice, backward};
use crate::effect::Place;

/// Forms of a set, at most.
const MOST: usize = 60;
/// Above it no bootstrap is asked.
const CLEAR: f64 = 60.0;
/// What an exchange must gain.
const EXCHANGE: f64 = 2.0;

/// The best set that steps from `start` lead to.
pub(super) fn search(choice: &CauseChoice, start: Vec<usize>) -> Vec<usize> {
    let mut set = start;
    while set.len() < MOST {
        let sweep = choice.base.with(&set);
        let worths: Vec<f64> = (0..choice.open)
            .map(|number| if choice.may_join(number, &set) { choice.worth(&sweep, number) } else { f64::NEG_INFINITY })
            .collect();
        let Some(best) = (0..choice.open).max_by(|a, b| worths[*a].total_cmp(&worths[*b])) else { break };
        let near = worths[best] < CLEAR;
        if worths[best] <= 0.0 || (near && !beats_chance(choice, &set, &sweep, worths[best])) {
            break;
        }
        set.push(best);
        exchange(choice, &mut set, Some(best));
        merge(choice, &mut set);
    }
    settle(choice, &mut set);
    set
}

/// Puts better forms in the place of those that compete with `newest`, or of all.
fn exchange(choice: &CauseChoice, set: &mut Vec<usize>, newest: Option<usize>) {
    for number in set.clone() {
        let concerned = newest.is_none_or(|newest| choice.compete(newest, number));
        let Some(place) = set.iter().position(|one| *one == number).filter(|_| concerned) else { continue };
        let mut rest = set.clone();
        rest.remove(place);
        let sweep = choice.base.with(&rest);
        let own = choice.worth(&sweep, number);
        let others =
            (0..choice.open).filter(|other| *other != number && choice.compete(*other, number) && choice.may_join(*other, &rest));
        let worths = others.map(|other| (other, choice.worth(&sweep, other)));
        let Some((best, worth)) = worths.max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
        if worth <= own + EXCHANGE {
            continue;
        }
        rest.insert(place, best);
        if choice.is_whole(&rest) {
            *set = rest;
        }
    }
}

/// One wrong mass, drive or mounting instead of several; one curve over a joint's angle instead of two.
fn merge(choice: &CauseChoice, set: &mut Vec<usize>) {
    let is_inertial = |number: &usize| choice.form(*number).cause.about().inertial;
    let inertial: Vec<usize> = set.iter().copied().filter(is_inertial).collect();
    let mut groups = pairs(&inertial);
    if inertial.len() > 1 {
        groups.push(inertial);
    }
    merge_groups(choice, set, &groups, &is_inertial);
    let mut places: Vec<Place> = set.iter().map(|number| choice.form(*number).place).collect();
    places.dedup();
    for place in places {
        let is_curve = |number: &usize| choice.form(*number).cause.about().of_angle && choice.form(*number).place == place;
        let curves: Vec<usize> = set.iter().copied().filter(is_curve).collect();
        merge_groups(choice, set, &pairs(&curves), &is_curve);
    }
}

/// Two of some forms.
fn pairs(forms: &[usize]) -> Vec<Vec<usize>> {
    let with =
        |(place, first): (usize, &usize)| forms[place + 1..].iter().map(|second| vec![*first, *second]).collect::<Vec<_>>();
    forms.iter().enumerate().flat_map(with).collect()
}

/// The best of replacing one group by one form of those that `may` stand for it.
fn merge_groups(choice: &CauseChoice, set: &mut Vec<usize>, groups: &[Vec<usize>], may: &dyn Fn(&usize) -> bool) {
    if groups.is_empty() {
        return;
    }
    let mut best = (choice.criterion(set), set.clone());
    for group in groups {
        let rest: Vec<usize> = set.iter().copied().filter(|number| !group.contains(number)).collect();
        let sweep = choice.base.with(&rest);
        let others = (0..choice.open).filter(|number| may(number) && choice.may_join(*number, &rest));
        let one = others.map(|number| (choice.worth(&sweep, number), number)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, one)) = one else { continue };
        let merged: Vec<usize> = rest.iter().copied().chain([one]).collect();
        let criterion = choice.criterion(&merged);
        if criterion < best.0 {
            best = (criterion, merged);
        }
    }
    *set = best.1;
}

/// Brings a set to rest under a new noise: exchanges, merges and removals, no further forms.
pub(super) fn settle(choice: &CauseChoice, set: &mut Vec<usize>) {
    backward(choice, set);
    exchange(choice, set, None);
    merge(choice, set);
    backward(choice, set);
}
