//! Functions of one variable, linear in their coefficients, with few shape numbers (in the variable's SI unit).

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

/// A function of one variable, or a few.
#[expect(missing_docs, reason = "a field is documented with its function")]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// (u - zero) / per.
    Linear { zero: f64, per: f64 },
    /// 1, and (u - zero) / per.
    Straight { zero: f64, per: f64 },
    /// sin(order u) and cos(order u), and with an overtone those of twice the order.
    Wave { order: u32, overtone: bool },
    /// Sine and cosine of a period.
    Sway { period: f64 },
    /// cos(k pi (u - low) / (high - low)), k = 1..=count, held at either end: a curve without its mean.
    Cosines { low: f64, high: f64, count: usize },
    /// The same with its mean: k = 0..count.
    Series { low: f64, high: f64, count: usize },
    /// One function: the sum of `weights` times those of a [`Basis::Series`] of as many.
    Curve {
        low: f64,
        high: f64,
        weights: [f64; Self::CURVE],
    },
    /// tanh((u - centre) / width): one level below, another above.
    Rise { centre: f64, width: f64 },
    /// 1 above `at`, else 0.
    After { at: f64 },
    /// 1 above each of the first `count` of these, else 0: what jumps between levels.
    Steps {
        at: [f64; Self::STEPS],
        count: usize,
    },
    /// -1 or 1.
    Sign,
    /// The power of the share of the way from `start` to `end`, odd about `start`.
    Power { start: f64, end: f64, exponent: f64 },
    /// The same from `start` on; 1 later than `CREEPING` times the way.
    Creep { start: f64, end: f64, exponent: f64 },
    /// 1 - exp(-(u - start) / constant) from `start` on.
    Settling { start: f64, constant: f64 },
}

/// Lengths of the recording, from its start, over which a creep is believed to go on.
const CREEPING: f64 = 2.0;

impl Basis {
    /// How many functions make up a [`Basis::Curve`].
    pub const CURVE: usize = 16;
    /// How many steps a [`Basis::Steps`] has at most.
    pub const STEPS: usize = 6;

    /// The variable itself.
    pub const PROPORTIONAL: Self = Self::Linear {
        zero: 0.0,
        per: 1.0,
    };

    /// How many functions it has.
    pub fn count(&self) -> usize {
        match self {
            Self::Straight { .. } => 2,
            Self::Wave { overtone, .. } => 2 + 2 * usize::from(*overtone),
            Self::Sway { .. } => 2,
            Self::Cosines { count, .. }
            | Self::Series { count, .. }
            | Self::Steps { count, .. } => *count,
            _ => 1,
        }
    }

    /// Whether it is a free curve.
    pub(crate) fn is_curve(&self) -> bool {
        matches!(
            self,
            Self::Cosines { .. } | Self::Series { .. } | Self::Curve { .. } | Self::Steps { .. }
        )
    }

    /// What a function may be off (one standard deviation, for a coefficient of 1) where the variable is `off` beyond the fitted range, which
    /// is `share` of that, and the function has `value`.
    ///
    /// A curve is held at the end of its range: a smooth one of its spectrum departs from that by p sqrt(1 - cos(k pi off / width)) up to where
    /// it knows nothing of it. All else may be off by its own value, one range beyond.
    pub(super) fn off(&self, k: usize, value: f64, off: f64, share: f64) -> f64 {
        match *self {
            Self::Cosines { low, high, .. } => departure(k + 1, off / (high - low)),
            Self::Series { low, high, .. } => departure(k, off / (high - low)),
            Self::Curve { low, high, weights } => {
                let of_k = |(k, weight): (usize, &f64)| weight * departure(k, off / (high - low));
                let squares = weights.iter().enumerate().map(|one| of_k(one).powi(2));
                squares.sum::<f64>().sqrt()
            }
            // Sine and cosine together are their size whatever the phase.
            Self::Wave { .. } | Self::Sway { .. } => share * FRAC_1_SQRT_2,
            Self::Straight { .. } if k == 0 => 0.0,
            _ => share * value.abs(),
        }
    }

    /// The values of its functions at `u`, numbered.
    pub fn at(&self, u: f64, each: &mut dyn FnMut(usize, f64)) {
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
            Self::Cosines { low, high, count } => cosines(u, [low, high], count)
                .enumerate()
                .for_each(|(k, value)| each(k, value)),
            Self::Series { low, high, count } => {
                each(0, 1.0);
                cosines(u, [low, high], count.saturating_sub(1))
                    .enumerate()
                    .for_each(|(k, value)| each(k + 1, value));
            }
            Self::Curve { low, high, weights } => {
                let others = cosines(u, [low, high], weights.len() - 1).zip(&weights[1..]);
                let sum: f64 = others.map(|(value, weight)| value * weight).sum();
                each(0, weights[0] + sum);
            }
            Self::Rise { centre, width } => each(0, libm::tanh((u - centre) / width)),
            Self::After { at } => each(0, f64::from(u > at)),
            Self::Steps { at, count } => at
                .iter()
                .take(count)
                .enumerate()
                .for_each(|(k, at)| each(k, f64::from(u > *at))),
            Self::Sign => each(0, u.signum()),
            Self::Power {
                start,
                end,
                exponent,
            } => {
                let share = (u - start) / (end - start);
                each(0, libm::copysign(libm::pow(share.abs(), exponent), share));
            }
            Self::Creep {
                start,
                end,
                exponent,
            } => {
                let share = (u - start) / (end - start);
                // Long after the recording what was seen last holds.
                each(
                    0,
                    libm::pow(
                        if share > CREEPING {
                            1.0
                        } else {
                            share.max(0.0)
                        },
                        exponent,
                    ),
                );
            }
            Self::Settling { start, constant } => {
                each(0, 1.0 - libm::exp(-(u - start).max(0.0) / constant))
            }
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
    std::iter::successors(Some((cosine, sine)), turned)
        .take(count)
        .map(|(c, _)| c)
}

/// A number divided and multiplied by a step that shrinks from `first` towards 1 with the level, kept within bounds; the number
/// itself is none of them.
pub(super) fn around(
    value: f64,
    first: f64,
    pace: f64,
    level: i32,
    [low, high]: [f64; 2],
) -> impl Iterator<Item = f64> {
    let step = libm::pow(first, libm::exp2(-pace * f64::from(level)));
    [value * step, value / step]
        .map(|other| other.clamp(low, high))
        .into_iter()
        .filter(move |other| *other != value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosines_of_high_orders_are_those_of_the_library() {
        for (u, order) in [(0.3, 1), (1.7, 40), (2.9, 180), (3.0, 200)] {
            let value = cosines(u, [0.0, PI], order).last().expect("one");
            assert!(
                (value - libm::cos(order as f64 * u)).abs() < 1e-13,
                "{u} {order}"
            );
        }
    }

    #[test]
    fn beyond_its_range_a_rough_curve_knows_nothing_soon_and_a_smooth_one_later() {
        let curve = Basis::Cosines {
            low: 0.0,
            high: 2.0,
            count: 6,
        };
        let off =
            |basis: Basis, k: usize, value: f64, off: f64| basis.off(k, value, off, 0.5 * off);
        // A quarter of the support: sqrt(1 - cos 45 deg); the fourth cosine is at a right angle already.
        assert!((off(curve, 0, 0.3, 0.5) - 0.541_196_1).abs() < 1e-7);
        let near = |values: &[f64], wanted: &[f64]| {
            values
                .iter()
                .zip(wanted)
                .all(|(value, wanted)| (value - wanted).abs() < 1e-12)
        };
        assert!(near(
            &[
                off(curve, 3, 0.3, 0.5),
                off(curve, 5, 0.0, 9.0),
                off(curve, 0, 0.3, 0.0)
            ],
            &[1.0, 1.0, 0.0]
        ));
        let series = Basis::Series {
            low: 0.0,
            high: 2.0,
            count: 6,
        };
        assert!(near(
            &[off(series, 0, 1.0, 9.0), off(series, 4, 0.0, 0.5)],
            &[0.0, 1.0]
        ));
        assert!(
            (off(
                Basis::Wave {
                    order: 3,
                    overtone: false
                },
                1,
                0.0,
                1.0
            ) - 0.5 * FRAC_1_SQRT_2)
                .abs()
                < 1e-12
        );
        assert!((off(Basis::PROPORTIONAL, 0, -2.0, 0.6) - 0.6).abs() < 1e-12);
    }
}
