//! Laws: a basis of a variable, or the product of two.

use super::{ArmState, Basis, Variable};
use crate::robot::RobotModel;
use serde::{Deserialize, Serialize};

/// Share of its fitted range by which a law of few numbers goes on beyond it.
const FURTHER: f64 = 0.5;

/// Functions of one variable; the same whatever the rows that they were fitted to.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Factor {
    /// What they are functions of.
    #[serde(rename = "of")]
    pub variable: Variable,
    /// Which functions of it.
    pub basis: Basis,
    /// What the fitted rows have of the variable (SI): curves hold their values at its ends, other functions half of it beyond. None while
    /// the law is sought.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) within: Option<[f64; 2]>,
}

impl PartialEq for Factor {
    fn eq(&self, other: &Self) -> bool {
        (self.variable, self.basis) == (other.variable, other.basis)
    }
}

impl Factor {
    /// Functions of a variable, wherever it is.
    pub(crate) const fn new(variable: Variable, basis: Basis) -> Self {
        Self {
            variable,
            basis,
            within: None,
        }
    }

    /// The same, fitted to rows of this range; a variable of several numbers has none.
    pub(crate) fn held_within(self, [low, high]: [f64; 2]) -> Self {
        let held = self.variable.components() == 1 && low <= high;
        Self {
            within: held.then_some([low, high]),
            ..self
        }
    }

    /// The variable, where nothing more was seen at the place where the functions are held. A law of few numbers goes on for a while, but
    /// not to a time that nobody states: what was seen last is the best that is known of that.
    fn held(&self, u: f64) -> f64 {
        let Some([low, high]) = self.within else {
            return u;
        };
        let ends = self.basis.is_curve() || u.is_infinite();
        let further = if ends { 0.0 } else { FURTHER * (high - low) };
        u.clamp(low - further, high + further)
    }

    /// By how much the variable is beyond the fitted range in a row, or from the `nearest` value that was seen, SI and as a share of that range,
    /// at most 1; none inside.
    fn beyond(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        nearest: Option<f64>,
    ) -> Option<(f64, f64)> {
        let ([low, high], u) = (self.within?, self.variable.value(0, robot, state)?);
        let off = nearest.map_or((low - u).max(u - high).max(0.0), |nearest| {
            (u - nearest).abs()
        });
        let share = match self.basis {
            // A step has happened.
            Basis::After { .. } => 0.0,
            // What had not yet settled when the recording ended.
            Basis::Settling { start, constant } if u > high => {
                libm::exp(-(high - start).max(0.0) / constant)
            }
            _ if off == 0.0 => 0.0,
            _ => (off / (high - low)).min(1.0),
        };
        (share > 0.0).then_some((off, share))
    }

    /// The values of its functions in a row; zeros where the row does not tell.
    fn all(&self, robot: &RobotModel, state: &ArmState, nearest: Option<f64>) -> Vec<f64> {
        let mut out = vec![0.0; self.count()];
        self.values(robot, state, nearest, &mut |k, value| out[k] = value);
        out
    }

    /// What each function may be off there, one standard deviation, and the share of its range by which the variable is beyond; none inside.
    fn off(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        nearest: Option<f64>,
    ) -> Option<(Vec<f64>, f64)> {
        let (off, share) = self.beyond(robot, state, nearest)?;
        let values = self.all(robot, state, nearest).into_iter().enumerate();
        Some((
            values
                .map(|(k, value)| self.basis.off(k, value, off, share))
                .collect(),
            share,
        ))
    }

    /// How many functions it has.
    pub(crate) fn count(&self) -> usize {
        self.variable.components() * self.basis.count()
    }

    /// The values of its functions in a row, those at `nearest` where that is given.
    fn values(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        nearest: Option<f64>,
        each: &mut dyn FnMut(usize, f64),
    ) {
        for component in 0..self.variable.components() {
            if let Some(u) = self.variable.value(component, robot, state) {
                let u = nearest.unwrap_or_else(|| self.held(u));
                // Long after the recording a function without a limit counts for nothing.
                let mut counted = |k: usize, value: f64| {
                    each(
                        component * self.basis.count() + k,
                        if value.is_finite() { value } else { 0.0 },
                    )
                };
                self.basis.at(u, &mut counted);
            }
        }
    }
}

/// Functions of a second factor that are kept while those of the first are gone through.
const INNER: usize = 48;

/// Parts of each variable's range in which pairs of values are counted.
const PARTS: usize = 8;

/// Which values of two variables the fitted rows have together: one bit for each of `PARTS` x `PARTS` parts of their ranges, set where a row
/// has it or one next to it.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct SeenTogether(u64);

impl SeenTogether {
    /// By the shares (0 to 1) of both ranges that rows have.
    fn of(shares: impl Iterator<Item = [f64; 2]>) -> Self {
        let mut bits = 0;
        for [a, b] in shares.map(|shares| shares.map(part)) {
            for i in a.saturating_sub(1)..=(a + 1).min(PARTS - 1) {
                for j in b.saturating_sub(1)..=(b + 1).min(PARTS - 1) {
                    bits |= 1 << (PARTS * i + j);
                }
            }
        }
        Self(bits)
    }

    fn has(self, i: usize, j: usize) -> bool {
        self.0 >> (PARTS * i + j) & 1 == 1
    }

    /// The nearest shares that were seen together; none where these were, or nothing was.
    fn nearest(self, shares: [f64; 2]) -> Option<[f64; 2]> {
        let [a, b] = shares.map(part);
        if self.has(a, b) {
            return None;
        }
        let held = |share: f64, part: usize| {
            let width = (PARTS as f64).recip();
            share.clamp(part as f64 * width, (part + 1) as f64 * width)
        };
        (0..PARTS * PARTS)
            .map(|k| (k / PARTS, k % PARTS))
            .filter(|(i, j)| self.has(*i, *j))
            .map(|(i, j)| [held(shares[0], i), held(shares[1], j)])
            .min_by(|x, y| {
                let square =
                    |at: &[f64; 2]| (at[0] - shares[0]).powi(2) + (at[1] - shares[1]).powi(2);
                square(x).total_cmp(&square(y))
            })
    }
}

/// The part of its range in which a share of it lies.
fn part(share: f64) -> usize {
    ((share * PARTS as f64).max(0.0) as usize).min(PARTS - 1)
}

/// Functions of one or two variables: all products of a function of the first and one of the second.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Law {
    /// The variable that the cause is about.
    #[serde(flatten)]
    pub first: Factor,
    /// What multiplies it, if anything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<Factor>,
    /// What the fitted rows have of both together: a free product holds the values at the nearest of it. None while the law is sought.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) seen: Option<SeenTogether>,
}

impl PartialEq for Law {
    fn eq(&self, other: &Self) -> bool {
        (self.first, self.times) == (other.first, other.times)
    }
}

/// What functions of a law, by their numbers, may be off: groups that are independent of each other.
pub(super) type Departures = Vec<Vec<(usize, f64)>>;

impl Law {
    /// Functions of one variable.
    pub const fn new(variable: Variable, basis: Basis) -> Self {
        Self {
            first: Factor::new(variable, basis),
            times: None,
            seen: None,
        }
    }

    /// In proportion to a variable.
    pub const fn of(of: Variable) -> Self {
        Self::new(of, Basis::PROPORTIONAL)
    }

    /// Multiplied by functions of another variable.
    pub const fn times(self, variable: Variable, basis: Basis) -> Self {
        Self {
            times: Some(Factor::new(variable, basis)),
            ..self
        }
    }

    /// With another basis of the first variable.
    pub(crate) fn with(self, basis: Basis) -> Self {
        Self {
            first: Factor {
                basis,
                ..self.first
            },
            ..self
        }
    }

    /// With another first variable.
    pub(crate) fn by(self, variable: Variable) -> Self {
        Self {
            first: Factor::new(variable, self.first.basis),
            ..self
        }
    }

    /// The same, fitted to rows with these ranges and pairs of its variables.
    pub(super) fn held_within(self, ranges: &[Option<[f64; 2]>], pairs: &[[f64; 2]]) -> Self {
        let held = |factor: Factor, k: usize| {
            let range = ranges.get(k).copied().flatten();
            range.map_or(factor, |range| factor.held_within(range))
        };
        let mut out = Self {
            first: held(self.first, 0),
            times: self.times.map(|times| held(times, 1)),
            seen: None,
        };
        let is_free = |times: &Factor| self.first.basis.is_curve() || times.basis.is_curve();
        if self.times.as_ref().is_some_and(is_free) && !pairs.is_empty() {
            let shares = pairs.iter().filter_map(|pair| out.shares(*pair));
            out.seen = Some(SeenTogether::of(shares));
        }
        out
    }

    /// Two values of its variables as shares of their fitted ranges.
    fn shares(&self, [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        let share = |factor: &Factor, u: f64| {
            let [low, high] = factor.within.filter(|[low, high]| low < high)?;
            Some(((u - low) / (high - low)).clamp(0.0, 1.0))
        };
        Some([share(&self.first, u)?, share(self.times.as_ref()?, v)?])
    }

    /// The nearest values of both variables that the fitted rows have together; none where they have those of the row.
    fn nearest(&self, robot: &RobotModel, state: &ArmState) -> Option<[f64; 2]> {
        let (seen, times) = (self.seen?, self.times.as_ref()?);
        let values = [&self.first, times].map(|factor| factor.variable.value(0, robot, state));
        let [Some(u), Some(v)] = values else {
            return None;
        };
        let [a, b] = seen.nearest(self.shares([u, v])?)?;
        let value = |factor: &Factor, share: f64| {
            factor.within.map(|[low, high]| low + share * (high - low))
        };
        Some([value(&self.first, a)?, value(times, b)?])
    }

    /// How many functions it has.
    pub fn count(&self) -> usize {
        self.factors().map(Factor::count).product()
    }

    /// One or two.
    pub fn factors(&self) -> impl Iterator<Item = &Factor> {
        std::iter::once(&self.first).chain(&self.times)
    }

    /// What it depends on.
    pub fn variables(&self) -> Vec<Variable> {
        self.factors().map(|factor| factor.variable).collect()
    }

    /// In a row beyond the fitted range of a variable: that variable, and what the law may be off, groups of (function, by how much) that
    /// are independent of each other, one standard deviation each. None inside.
    pub(super) fn beyond(
        &self,
        robot: &RobotModel,
        state: &ArmState,
    ) -> Option<(Variable, Departures)> {
        let nearest = self.nearest(robot, state);
        let [of_first, of_times] = [0, 1].map(|k| nearest.map(|nearest| nearest[k]));
        let first = self.first.off(robot, state, of_first);
        let Some(times) = &self.times else {
            let (off, _) = first?;
            return Some((
                self.first.variable,
                off.into_iter().enumerate().map(|one| vec![one]).collect(),
            ));
        };
        let second = times.off(robot, state, of_times);
        let share = |off: &Option<(Vec<f64>, f64)>| off.as_ref().map_or(0.0, |(_, share)| *share);
        let (a, b) = (share(&first), share(&second));
        let most = if a >= b {
            self.first.variable
        } else {
            times.variable
        };
        let inner = times.count();
        if a + b == 0.0 {
            return None;
        }
        let of_first = self.first.all(robot, state, of_first);
        let of_times = times.all(robot, state, of_times);
        let by_first = first.into_iter().flat_map(|(off, _)| off).enumerate();
        let by_first = by_first.map(|(i, off)| {
            let others = of_times.iter().enumerate();
            others
                .map(|(k, value)| (inner * i + k, off * value))
                .collect()
        });
        let by_times = second.into_iter().flat_map(|(off, _)| off).enumerate();
        let by_times = by_times.map(|(k, off)| {
            let others = of_first.iter().enumerate();
            others
                .map(|(i, value)| (inner * i + k, off * value))
                .collect()
        });
        Some((most, by_first.chain(by_times).collect()))
    }

    /// The values of its functions in a row, numbered; zeros where the row does not tell.
    pub(super) fn values(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        each: &mut dyn FnMut(usize, f64),
    ) {
        match &self.times {
            None => self.first.values(robot, state, None, each),
            Some(times) => {
                let nearest = self.nearest(robot, state);
                let [of_first, of_times] = [0, 1].map(|k| nearest.map(|nearest| nearest[k]));
                let inner = times.count();
                // The functions of one factor once, not once for each of the other's.
                let mut of_inner = [0.0; INNER];
                if let Some(of_inner) = of_inner.get_mut(..inner) {
                    times.values(robot, state, of_times, &mut |k, y| of_inner[k] = y);
                    self.first.values(robot, state, of_first, &mut |i, x| {
                        let values = of_inner.iter().enumerate();
                        values.for_each(|(k, y)| each(inner * i + k, x * y));
                    });
                    return;
                }
                self.first.values(robot, state, of_first, &mut |i, x| {
                    times.values(robot, state, of_times, &mut |k, y| {
                        each(inner * i + k, x * y)
                    })
                });
            }
        }
    }
}

impl From<Factor> for Law {
    fn from(first: Factor) -> Self {
        Self {
            first,
            times: None,
            seen: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Measurements, PointReadings, Posture, small_arm};
    use nalgebra::Vector3;

    /// What is asked at one row.
    fn at_row<T>(
        angle: f64,
        [payload, temperature, time]: [f64; 3],
        ask: impl FnOnce(&RobotModel, &ArmState) -> T,
    ) -> T {
        let robot = small_arm();
        let data = Measurements {
            joints: 2,
            q: vec![angle; 2],
            points: PointReadings::new(vec![Vector3::new(2.0 + payload, 0.0, 0.0)], 1e-5),
            payload: vec![payload],
            temperature: Some(vec![temperature]),
            time: Some(vec![time]),
            long_after: time.is_infinite(),
            ..Measurements::default()
        };
        let posture = Posture::as_stated(&robot, data.q(0), payload);
        let state = ArmState::new(&data, 0, &posture, Vector3::new(2.0 + payload, 0.0, 0.0));
        ask(&robot, &state)
    }

    /// The sum of a factor's functions at one row, and its share beyond the fitted range.
    fn at(factor: &Factor, angle: f64, circumstances: [f64; 3]) -> (f64, f64) {
        at_row(angle, circumstances, |robot, state| {
            let mut sum = 0.0;
            factor.values(robot, state, None, &mut |_, value| sum += value);
            let beyond = factor.beyond(robot, state, None);
            (sum, beyond.map_or(0.0, |(_, share)| share))
        })
    }

    #[test]
    fn every_law_holds_at_the_ends_of_what_was_fitted_and_says_how_far_beyond_it_is() {
        let curve = |[low, high]: [f64; 2]| Basis::Cosines {
            low,
            high,
            count: 6,
        };
        let line = |_: [f64; 2]| Basis::PROPORTIONAL;
        /// Angle, and payload, temperature and time, of a row at a value of the variable.
        type Row = fn(f64) -> (f64, [f64; 3]);
        let variables: [(Variable, [f64; 2], Row); 5] = [
            (Variable::Angle { joint: 1 }, [-0.4, 0.6], |u| (u, [0.0; 3])),
            (Variable::Payload, [1.0, 9.0], |u| (0.0, [u, 0.0, 0.0])),
            (Variable::Temperature, [20.0, 30.0], |u| {
                (0.0, [0.0, u, 0.0])
            }),
            (Variable::Time, [0.0, 1000.0], |u| (0.0, [0.0, 0.0, u])),
            (Variable::Range, [2.0, 4.0], |u| (0.0, [u - 2.0, 0.0, 0.0])),
        ];
        for (variable, within, row) in variables {
            let span = within[1] - within[0];
            for (basis, further) in [(curve(within), 0.0), (line(within), FURTHER)] {
                let factor = Factor::new(variable, basis).held_within(within);
                let see = |u: f64| {
                    let (angle, others) = row(u);
                    at(&factor, angle, others)
                };
                assert_eq!(see(within[0] + 0.3 * span).1, 0.0, "{variable}");
                let end = see(within[1] + further * span);
                let (far, share) = see(within[1] + 0.8 * span);
                assert!((far - end.0).abs() < 1e-9, "{variable}: {far} {}", end.0);
                assert!((share - 0.8).abs() < 1e-9, "{variable}: {share}");
                assert_eq!(see(within[1] + 5.0 * span).1, 1.0, "{variable}");
            }
        }
    }

    #[test]
    fn a_free_product_holds_at_the_nearest_values_that_rows_have_together() {
        // The first half of a session without a payload, the second with one.
        let halves = |k: usize| [f64::from(k >= 20), k as f64 / 39.0];
        let seen = SeenTogether::of((0..40).map(halves));
        assert_eq!(seen.nearest([0.0, 0.1]), None, "seen");
        assert_eq!(seen.nearest([1.0, 0.9]), None, "seen");
        assert_eq!(seen.nearest([0.0, 0.45]), None, "next to what was seen");
        assert_eq!(seen.nearest([0.0, 1.0]), Some([0.0, 0.625]));
        assert_eq!(SeenTogether::of(std::iter::empty()).nearest([0.0; 2]), None);

        let series = |count| Basis::Series {
            low: -0.2,
            high: 1.2,
            count,
        };
        let (angle, time) = (Variable::Angle { joint: 1 }, Variable::Time);
        let pairs: Vec<[f64; 2]> = (0..40).map(halves).collect();
        let ranges = [Some([0.0, 1.0]); 2];
        let product = |first: Basis| {
            let law = Law::new(angle, first).times(time, series(5));
            law.held_within(&ranges, &pairs)
        };
        let sum = |law: &Law, [angle, time]: [f64; 2]| {
            at_row(angle, [0.0, 0.0, time], |robot, state| {
                let mut sum = 0.0;
                law.values(robot, state, &mut |k, value| sum += (k + 1) as f64 * value);
                (sum, law.beyond(robot, state).is_some())
            })
        };
        let free = product(series(4));
        let (value, is_beyond) = sum(&free, [0.0, 1.0]);
        assert_eq!((value, false), sum(&free, [0.0, 0.625]));
        assert!(is_beyond, "and says that it was not seen");
        assert!(!sum(&free, [0.0, 0.3]).1 && !sum(&free, [1.0, 0.8]).1);
    }

    #[test]
    fn what_has_settled_or_stepped_stays_and_what_had_not_is_unknown_later() {
        let share = |basis: Basis| {
            at(
                &Factor::new(Variable::Time, basis).held_within([0.0, 1000.0]),
                0.0,
                [0.0, 0.0, 9000.0],
            )
            .1
        };
        assert_eq!(share(Basis::After { at: 500.0 }), 0.0);
        assert!(
            (share(Basis::Settling {
                start: 0.0,
                constant: 200.0
            }) - (-5.0f64).exp())
            .abs()
                < 1e-12
        );
        assert!(
            share(Basis::Settling {
                start: 0.0,
                constant: 2000.0
            }) > 0.6
        );
        let drift = Factor::new(Variable::Time, Basis::PROPORTIONAL).held_within([0.0, 1000.0]);
        let long_after = |factor: &Factor| at(factor, 0.0, [0.0, 0.0, f64::INFINITY]);
        assert_eq!(
            long_after(&drift),
            (at(&drift, 0.0, [0.0, 0.0, 1000.0]).0, 1.0)
        );
        let limit = |basis: Basis| long_after(&Factor::new(Variable::Time, basis)).0;
        assert_eq!(limit(Basis::After { at: 500.0 }), 1.0);
        assert_eq!(
            limit(Basis::Settling {
                start: 0.0,
                constant: 200.0
            }),
            1.0
        );
        assert_eq!(limit(Basis::PROPORTIONAL), 0.0, "without a limit");
    }
}
