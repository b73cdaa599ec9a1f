//! Laws of two variables at a joint that no cause of the list has: what it turns by, times what it follows beside.

use super::{Basis, Law, Survey, Variable};

/// Cosines of a smooth function of an angle or of a move, and of a slow course.
const CURVE: usize = 8;
const SLOW: usize = 3;
/// Moves (quantiles of theirs) within which a joint's error may depend on how far it came.
const STARTS: [f64; 2] = [0.2, 0.5];

/// The laws, and of how many of its kind each is one.
pub(super) fn at_joint(survey: &Survey, joint: usize) -> Vec<(Law, usize)> {
    let [low, high] = survey.range[joint];
    let (load, approach) = (Variable::Load { joint }, Variable::Approach { joint });
    let (loaded, both) = (survey.is_loaded(joint), survey.both_directions(joint));
    let followed = || [(load, loaded), (approach, both)].into_iter().filter(|(_, there)| *there).map(|(of, _)| of);
    let own = Law::new(Variable::Angle { joint }, Basis::Cosines { low, high, count: CURVE });
    let mut out: Vec<(Law, usize)> = followed().map(|of| (own.times(of, Basis::PROPORTIONAL), 1)).collect();
    for reach in STARTS.into_iter().filter(|_| both).map(|share| move_of(survey, joint, share)).filter(|reach| *reach > 0.0) {
        let from_rest = Basis::Cosines { low: -reach, high: reach, count: CURVE };
        out.push((Law::new(Variable::Move { joint }, from_rest), STARTS.len()));
    }
    for (of, slow) in slowly(survey) {
        let slow = Law::new(of, slow);
        out.extend((of == Variable::Temperature).then_some((slow, 1)));
        let followed = std::iter::once(Variable::Angle { joint }).chain(followed());
        out.extend(followed.map(|times| (slow.times(times, Basis::PROPORTIONAL), 2)));
    }
    out
}

/// Slow curves of time and of the recorded temperature.
pub(super) fn slowly(survey: &Survey) -> Vec<(Variable, Basis)> {
    let ranges = slow(survey).into_iter();
    ranges.map(|(of, [low, high])| (of, Basis::Cosines { low, high, count: SLOW })).collect()
}

/// Time and the recorded temperature with their ranges, where they change.
pub(super) fn slow(survey: &Survey) -> Vec<(Variable, [f64; 2])> {
    let temperatures = survey.rows.iter().filter_map(|row| survey.data.temperature(*row));
    let warm = temperatures.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], now| [low.min(now), high.max(now)]);
    let ranges = [(Variable::Time, survey.time), (Variable::Temperature, warm)].into_iter();
    ranges.filter(|(_, [low, high])| high > low).collect()
}

/// A quantile of how far a joint moved from stop to stop, where it did.
pub(super) fn move_of(survey: &Survey, joint: usize, share: f64) -> f64 {
    let moves = survey.rows.iter().map(|row| survey.data.last_move(*row, joint).abs()).filter(|moved| *moved > 0.0);
    let mut moves: Vec<f64> = moves.collect();
    moves.sort_by(f64::total_cmp);
    moves.get((share * moves.len() as f64) as usize).copied().unwrap_or(0.0)
}
