//! What an instrument may err by, beyond its own effects of the list: each reading as a function of what it sees, or of time.

use super::interactions::slowly;
use super::{Basis, Law, Polar, Survey, Variable};
use crate::criteria::effect::{RARE, UNCOMMON};

/// Cosines of a function of the elevation or range.
const SEEN: usize = 5;

/// The laws of each reading, of how many of its kind each is one, and its penalty; `sways` are periods as shares of the recording.
pub(super) fn laws(survey: &Survey, sways: &[f64]) -> Vec<(Polar, Law, usize, f64)> {
    if !survey.seen_from_outside() {
        return Vec::new();
    }
    let [start, end] = survey.time;
    let mut out = Vec::new();
    for share in sways.iter().filter(|_| end > start) {
        let swing = Law::new(Variable::Time, Basis::Sway { period: share * (end - start) });
        out.extend([Polar::Azimuth, Polar::Elevation].map(|of| (of, swing, 2 * sways.len(), *UNCOMMON)));
    }
    let scaled = |(of, slow)| Law::new(of, slow).times(Variable::Range, Basis::PROPORTIONAL);
    out.extend(slowly(survey).into_iter().map(|slow| (Polar::Range, scaled(slow), 2, *RARE)));
    let curve = |of, [low, high]: [f64; 2]| (Law::new(of, Basis::Cosines { low, high, count: SEEN }), 1);
    let [elevations, ranges] = survey.seen();
    let periodic = |order, tried| (Law::new(Variable::Azimuth, Basis::Wave { order, overtone: false }), tried);
    let seen = [
        (Polar::Range, curve(Variable::Range, ranges)),
        (Polar::Range, curve(Variable::Elevation, elevations)),
        (Polar::Range, periodic(1, 2)),
        (Polar::Range, periodic(2, 2)),
        (Polar::Elevation, curve(Variable::Elevation, elevations)),
        (Polar::Elevation, curve(Variable::Range, ranges)),
        (Polar::Elevation, periodic(2, 1)),
        (Polar::Azimuth, curve(Variable::Elevation, elevations)),
        (Polar::Azimuth, curve(Variable::Range, ranges)),
        (Polar::Azimuth, periodic(3, 2)),
        (Polar::Azimuth, periodic(4, 2)),
    ];
    out.extend(seen.map(|(of, (law, tried))| (of, law, tried, *RARE)));
    out
}
