//! Functions of one variable, linear in their coefficients, with few shape numbers (in the variable's SI unit).

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

/// A function of one variable, or a few.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// (u - zero) / per.
    Linear {
        /// Variable at which it is zero.
        zero: f64,
        /// Change of the variable that makes it one.
        per: f64,
    },
    /// 1, and (u - zero) / per.
    Straight {
        /// Variable at which it is zero.
        zero: f64,
        /// Change of the variable that makes it one.
        per: f64,
    },
    /// sin(order u) and cos(order u), and with an overtone those of twice the order.
    Wave {
        /// Periods per turn.
        order: u32,
        /// Whether twice the order belongs to it.
        overtone: bool,
    },
    /// Sine and cosine of a period.
    Sway {
        /// In the unit of the variable.
        period: f64,
    },
    /// cos(k pi (u - low) / (high - low)), k = 1..=count, held at either end: a curve without its mean.
    Cosines {
        /// Lower end of the support.
        low: f64,
        /// Upper end of the support.
        high: f64,
        /// How many cosines.
        count: usize,
    },
    /// The same with its mean: k = 0..count.
    Series {
        /// Lower end of the support.
        low: f64,
        /// Upper end of the support.
        high: f64,
        /// How many functions, the constant among them.
        count: usize,
    },
    /// The cosines, fading out beyond either end within one wave of the highest cosine, and straight across gaps.
    Fading {
        /// Lower end of the support.
        low: f64,
        /// Upper end of the support.
        high: f64,
        /// How many cosines.
        count: usize,
        /// Stretches that no row supports.
        #[serde(default, skip_serializing_if = "Gaps::are_none")]
        gaps: Gaps,
    },
    /// 1 between two knots, else 0; one function for each stretch, below the first knot and above the last, too.
    Steps {
        /// Where it steps.
        knots: Knots,
    },
    /// 1 at a knot and 0 at all others, straight between them and held beyond the first and the last; one function for each knot.
    Corners {
        /// Where straight pieces meet, both ends among them.
        knots: Knots,
    },
    /// exp(-((u - centre) / width)^2).
    Bump {
        /// Its middle.
        centre: f64,
        /// Its scale.
        width: f64,
    },
    /// tanh((u - centre) / width): one level below, another above.
    Rise {
        /// Its middle.
        centre: f64,
        /// Its scale.
        width: f64,
    },
    /// Nothing on one side of `from`, in proportion to the distance on the other.
    Hinge {
        /// Where it begins.
        from: f64,
        /// Whether it grows above, or below.
        upwards: bool,
    },
    /// 1 above `at`, else 0.
    After {
        /// Where it steps.
        at: f64,
    },
    /// -1 or 1.
    Sign,
    /// The power of the share of the way from `start` to `end`, odd about `start`.
    Power {
        /// Where it is zero.
        start: f64,
        /// Where it is one.
        end: f64,
        /// Exponent of the power.
        exponent: f64,
    },
    /// The same from `start` on; 1 later than `CREEPING` times the way.
    Creep {
        /// Where it is zero.
        start: f64,
        /// Where it is one.
        end: f64,
        /// Exponent of the power.
        exponent: f64,
    },
    /// 1 - exp(-(u - start) / constant) from `start` on.
    Settling {
        /// Where it is zero.
        start: f64,
        /// Time constant.
        constant: f64,
    },
}

/// Some values of a variable, ascending.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct Knots {
    at: [f64; Knots::MOST],
    count: usize,
}

impl Knots {
    /// How many there are at most.
    pub const MOST: usize = 6;

    /// The first of some values, ascending.
    pub fn new(values: impl IntoIterator<Item = f64>) -> Self {
        let mut out = Self { at: [0.0; Self::MOST], count: 0 };
        for (to, value) in out.at.iter_mut().zip(values) {
            *to = value;
            out.count += 1;
        }
        out.at[..out.count].sort_by(f64::total_cmp);
        out
    }

    /// All of them.
    pub fn all(&self) -> &[f64] {
        &self.at[..self.count]
    }

    /// Without the first and the last.
    pub fn inner(&self) -> &[f64] {
        self.all().get(1..self.count.saturating_sub(1)).unwrap_or_default()
    }
}

impl TryFrom<Vec<f64>> for Knots {
    type Error = String;

    fn try_from(values: Vec<f64>) -> Result<Self, String> {
        if values.is_empty() || values.len() > Self::MOST {
            return Err(format!("{} knots: from 1 to {} are allowed", values.len(), Self::MOST));
        }
        Ok(Self::new(values))
    }
}

impl From<Knots> for Vec<f64> {
    fn from(knots: Knots) -> Self {
        knots.all().to_vec()
    }
}

/// Stretches of a curve's variable without support; none where both ends are one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Gaps(pub [[f64; 2]; 2]);

impl Gaps {
    fn are_none(&self) -> bool {
        self.0.iter().all(|[low, high]| low == high)
    }

    /// Where a curve is looked at instead of `u`, and with which weights: at both ends of a gap, a straight line between them, which is
    /// the stiffest curve that they allow.
    fn ends(&self, u: f64) -> [(f64, f64); 2] {
        match self.0.iter().find(|[low, high]| u > *low && u < *high) {
            Some([low, high]) => {
                let share = (u - low) / (high - low);
                [(*low, 1.0 - share), (*high, share)]
            }
            None => [(u, 1.0), (u, 0.0)],
        }
    }
}

/// Lengths of the recording, from its start, over which a creep is believed to go on.
const CREEPING: f64 = 2.0;

impl Basis {
    /// The variable itself.
    pub const PROPORTIONAL: Self = Self::Linear { zero: 0.0, per: 1.0 };

    /// How many functions it has.
    pub fn count(&self) -> usize {
        match self {
            Self::Straight { .. } => 2,
            Self::Wave { overtone, .. } => 2 + 2 * usize::from(*overtone),
            Self::Sway { .. } => 2,
            Self::Cosines { count, .. } | Self::Series { count, .. } | Self::Fading { count, .. } => *count,
            Self::Steps { knots } => knots.count + 1,
            Self::Corners { knots } => knots.count,
            _ => 1,
        }
    }

    /// Whether it is a free curve.
    pub fn is_curve(&self) -> bool {
        matches!(
            self,
            Self::Cosines { .. } | Self::Series { .. } | Self::Fading { .. } | Self::Steps { .. } | Self::Corners { .. }
        )
    }

    /// What a function may be off (one standard deviation, for a coefficient of 1) where the variable is `off` beyond the fitted range, which
    /// is `share` of that, and the function has `value`.
    ///
    /// A curve is held at the end of its range: a smooth one of its spectrum departs from that by p sqrt(1 - cos(k pi off / width)) up to where
    /// it knows nothing of it. All else may be off by what it is, one range beyond.
    pub(super) fn off(&self, k: usize, value: f64, off: f64, share: f64) -> f64 {
        match *self {
            Self::Cosines { low, high, .. } | Self::Fading { low, high, .. } => departure(k + 1, off / (high - low)),
            Self::Series { low, high, .. } => departure(k, off / (high - low)),
            // Sine and cosine together are their size whatever the phase.
            Self::Wave { .. } | Self::Sway { .. } => share * FRAC_1_SQRT_2,
            Self::Straight { .. } if k == 0 => 0.0,
            _ => share * value.abs(),
        }
    }

    /// The values of its functions at `u`, numbered.
    pub(crate) fn at(&self, u: f64, each: &mut dyn FnMut(usize, f64)) {
        match *self {
            Self::Linear { zero, per } => each(0, (u - zero) / per),
            Self::Straight { zero, per } => {
                each(0, 1.0);
                each(1, (u - zero) / per);
            }
            Self::Wave { order, overtone } => {
                for k in 0..=usize::from(overtone) {
                    let (sine, cosine) = libm::sincos((k + 1) as f64 * f64::from(order) * u);
                    each(2 * k, sine);
                    each(2 * k + 1, cosine);
                }
            }
            Self::Sway { period } => {
                let (sine, cosine) = libm::sincos(TAU * u / period);
                each(0, sine);
                each(1, cosine);
            }
            Self::Cosines { low, high, count } => {
                cosines(u, [low, high], count).enumerate().for_each(|(k, value)| each(k, value))
            }
            Self::Series { low, high, count } => {
                each(0, 1.0);
                cosines(u, [low, high], count.saturating_sub(1)).enumerate().for_each(|(k, value)| each(k + 1, value));
            }
            Self::Fading { low, high, count, gaps } => {
                let wave = 2.0 * (high - low) / count as f64;
                let beyond = (low - u).max(u - high).clamp(0.0, wave);
                let share = if beyond > 0.0 { 0.5 + 0.5 * libm::cos(PI * beyond / wave) } else { 1.0 };
                let [(a, own), (b, other)] = gaps.ends(u);
                let from = cosines(a, [low, high], count);
                if other == 0.0 {
                    from.enumerate().for_each(|(k, value)| each(k, share * value));
                } else {
                    let straight = from.zip(cosines(b, [low, high], count)).map(|(from, to)| own * from + other * to);
                    straight.enumerate().for_each(|(k, value)| each(k, share * value));
                }
            }
            Self::Steps { knots } => {
                let own = knots.all().iter().filter(|at| u > **at).count();
                (0..=knots.count).for_each(|k| each(k, f64::from(u8::from(k == own))));
            }
            Self::Corners { knots } => {
                let all = knots.all();
                let above = all.partition_point(|at| *at < u).clamp(1, knots.count.max(2) - 1);
                let [low, high] = [above - 1, above].map(|k| all[k.min(knots.count - 1)]);
                let share = ((u - low) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                let value = |k: usize| {
                    if k == above {
                        share
                    } else if k + 1 == above {
                        1.0 - share
                    } else {
                        0.0
                    }
                };
                (0..knots.count).for_each(|k| each(k, value(k)));
            }
            Self::Bump { centre, width } => {
                let distance = (u - centre) / width;
                each(0, libm::exp(-distance * distance));
            }
            Self::Rise { centre, width } => each(0, libm::tanh((u - centre) / width)),
            Self::Hinge { from, upwards } => each(0, if upwards { (u - from).max(0.0) } else { (from - u).max(0.0) }),
            Self::After { at } => each(0, f64::from(u > at)),
            Self::Sign => each(0, u.signum()),
            Self::Power { start, end, exponent } => {
                let share = (u - start) / (end - start);
                each(0, libm::copysign(libm::pow(share.abs(), exponent), share));
            }
            Self::Creep { start, end, exponent } => {
                let share = (u - start) / (end - start);
                // Long after the recording what was seen last holds.
                each(0, libm::pow(if share > CREEPING { 1.0 } else { share.max(0.0) }, exponent));
            }
            Self::Settling { start, constant } => each(0, 1.0 - libm::exp(-(u - start).max(0.0) / constant)),
        }
    }
}

/// Root mean square of what a cosine of a phase that is not known departs from itself over a share of its range, at most 1.
fn departure(order: usize, share: f64) -> f64 {
    if order == 0 {
        return 0.0;
    }
    (1.0 - libm::cos(PI * (order as f64 * share).min(0.5))).sqrt()
}

/// Cosines of `u` held within the range, see [`Basis::Cosines`].
pub(super) fn cosines(u: f64, [low, high]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let phase = PI * ((u - low) / (high - low).max(1e-12)).clamp(0.0, 1.0);
    // Turned on by the phase each time: rounding grows in proportion to the order.
    let (sine, cosine) = libm::sincos(phase);
    let turned = move |(c, s): &(f64, f64)| Some((c * cosine - s * sine, s * cosine + c * sine));
    std::iter::successors(Some((cosine, sine)), turned).take(count).map(|(c, _)| c)
}

/// A number divided and multiplied by a step that shrinks from `first` towards 1 with the level, kept within bounds; the number
/// itself is none of them.
pub(super) fn around(value: f64, first: f64, pace: f64, level: i32, [low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    let step = libm::pow(first, libm::exp2(-pace * f64::from(level)));
    [value * step, value / step].map(|other| other.clamp(low, high)).into_iter().filter(move |other| *other != value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(basis: Basis, u: f64) -> Vec<f64> {
        let mut out = vec![0.0; basis.count()];
        basis.at(u, &mut |k, value| out[k] = value);
        out
    }

    #[test]
    fn cosines_of_high_orders_are_those_of_the_library() {
        for (u, order) in [(0.3, 1), (1.7, 40), (2.9, 180), (3.0, 200)] {
            let value = cosines(u, [0.0, PI], order).last().expect("one");
            assert!((value - libm::cos(order as f64 * u)).abs() < 1e-13, "{u} {order}");
        }
    }

    #[test]
    fn beyond_its_range_a_rough_curve_knows_nothing_soon_and_a_smooth_one_later() {
        let curve = Basis::Cosines { low: 0.0, high: 2.0, count: 6 };
        let off = |basis: Basis, k: usize, value: f64, off: f64| basis.off(k, value, off, 0.5 * off);
        // A quarter of the support: sqrt(1 - cos 45 deg); the fourth cosine is at a right angle already.
        assert!((off(curve, 0, 0.3, 0.5) - 0.541_196_1).abs() < 1e-7);
        assert_eq!([off(curve, 3, 0.3, 0.5), off(curve, 5, 0.0, 9.0), off(curve, 0, 0.3, 0.0)], [1.0, 1.0, 0.0]);
        let series = Basis::Series { low: 0.0, high: 2.0, count: 6 };
        assert_eq!([off(series, 0, 1.0, 9.0), off(series, 4, 0.0, 0.5)], [0.0, 1.0]);
        assert!((off(Basis::Wave { order: 3, overtone: false }, 1, 0.0, 1.0) - 0.5 * FRAC_1_SQRT_2).abs() < 1e-12);
        assert!((off(Basis::PROPORTIONAL, 0, -2.0, 0.6) - 0.6).abs() < 1e-12);
    }

    #[test]
    fn steps_and_corners_are_what_their_knots_say_and_stay_so_in_json() {
        let steps = Basis::Steps { knots: Knots::new([0.5, -0.5]) };
        assert_eq!([-1.0, 0.0, 0.6].map(|u| values(steps, u)), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let corners = Basis::Corners { knots: Knots::new([-1.0, 0.0, 1.0]) };
        let hats = [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.75, 0.25], [0.0, 0.0, 1.0]];
        assert_eq!([-3.0, -0.5, 0.25, 7.0].map(|u| values(corners, u)), hats);
        let inner = |knots: &[f64]| Knots::new(knots.iter().copied()).inner().to_vec();
        assert_eq!([inner(&[1.0]), inner(&[1.0, 2.0]), inner(&[3.0, 1.0, 2.0])], [vec![], vec![], vec![2.0]]);
        for basis in [steps, corners] {
            let text = serde_json::to_string(&basis).expect("JSON");
            assert_eq!(serde_json::from_str::<Basis>(&text).expect("the same"), basis, "{text}");
        }
        let error = serde_json::from_str::<Basis>(r#"{"steps": {"knots": []}}"#).expect_err("no knots");
        assert!(error.to_string().starts_with("0 knots: from 1 to 6 are allowed"), "{error}");
    }

    #[test]
    fn a_curve_is_straight_across_a_gap_and_as_before_beside_it() {
        let (low, high, count) = (-1.0, 2.0, 12);
        let plain = Basis::Fading { low, high, count, gaps: Gaps::default() };
        let bridged = Basis::Fading { low, high, count, gaps: Gaps([[0.25, 0.75], [0.0; 2]]) };
        for u in [-1.2, -0.5, 0.25, 0.75, 1.9, 2.1] {
            assert_eq!(values(bridged, u), values(plain, u), "{u}");
        }
        let (from, to, middle) = (values(plain, 0.25), values(plain, 0.75), values(bridged, 0.5));
        for ((from, to), middle) in from.iter().zip(to).zip(middle) {
            assert!((middle - 0.5 * (from + to)).abs() < 1e-12, "{middle}");
        }
        let text = serde_json::to_string(&plain).expect("JSON");
        assert!(!text.contains("gaps"), "{text}");
        assert_eq!(serde_json::from_str::<Basis>(&text).expect("the same"), plain);
        assert_eq!(serde_json::from_str::<Basis>(&serde_json::to_string(&bridged).expect("JSON")).expect("the same"), bridged);
    }
}
