//! Laws of frames that no cause of the list has: the base, the tool and the axes of joints, by what a recording offers.

use super::interactions::slow;
use super::{Axes, AxisPoint, Basis, Law, Motion, Survey, Variable};
use crate::criteria::effect::RARE;

/// Cosines of a slow course.
const SLOW: usize = 3;

/// The motions, laws, of how many of its kind each is one, and penalties.
pub(super) fn laws(survey: &Survey) -> Vec<(Motion, Law, usize, f64)> {
    let mut out = Vec::new();
    let (tool, base) = (Motion::Tool { axes: Axes::Place }, Motion::Base { axes: Axes::Both });
    for (of, [low, high]) in slow(survey) {
        let straight = Law::new(of, Basis::Linear { zero: low, per: high - low });
        let course = Law::new(of, Basis::Cosines { low, high, count: SLOW });
        out.extend([straight, course].map(|law| (tool, law, 4, *RARE)));
        if of == Variable::Temperature {
            out.push((base, straight, 1, *RARE));
        }
    }
    let joints = survey.joints();
    let revolute = || survey.revolute();
    for joint in revolute().filter(|joint| survey.both_directions(*joint)) {
        let side = Law::of(Variable::Approach { joint });
        out.push((tool, side, joints, *RARE));
        out.extend([Axes::Place, Axes::Rotation].map(|axes| (Motion::Base { axes }, side, 2 * joints, *RARE)));
    }
    for joint in revolute().filter(|joint| joint + 1 < joints) {
        for turning in [true, false] {
            let motion = Motion::Axis { joint, about: None, turning, at: AxisPoint::Own };
            let loaded = survey
                .is_loaded(joint)
                .then(|| Law::new(Variable::Load { joint }, Basis::Linear { zero: 0.0, per: survey.load(joint) }));
            let side = survey.both_directions(joint).then(|| Law::of(Variable::Approach { joint }));
            out.extend(loaded.into_iter().chain(side).map(|law| (motion, law, 4, *RARE)));
        }
    }
    out
}
