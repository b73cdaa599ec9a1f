//! The groups of the free form of a place: one motion there, smooth over one variable of the recording, or stepping once.

use super::frame::{ProjectedColumns, ProjectedRows};
use crate::criteria::open_world::{
    COARSE, EACH, FADING, FINE, FINEST, LENGTHS, LIMITS, MARGIN, NEGLIGIBLE, NUMBERS, SKETCH, STEPS, TOLD, TOLD_BY,
};
use crate::effect::{Axes, Basis, Factor, Hypothesis, Law, Motion, Place, Polar, Survey, Term, Unknown, Variable, names};
use nalgebra::{DMatrix, DVector, Vector3};
use std::f64::consts::PI;

/// Directions of the tool's position that are tried: axes, diagonals of faces and of the cube.
const ARROWS: [[i8; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [-1, 1, 1],
];
/// Shorter links (m) have no free form of their own.
const SHORT: f64 = 1e-3;

/// What passes with a recording, and is often changed together.
pub(super) const PASSING: [Variable; 3] = [Variable::Time, Variable::Temperature, Variable::Payload];

/// A motion, and functions of the recording's variables that it follows.
#[derive(Debug, Clone, Copy)]
pub(super) struct FreeGroup {
    pub motion: Motion,
    pub law: Law,
    /// How many of its kind it is one of, as steps or products; 1 for what is tried by itself.
    pub of: usize,
}

impl FreeGroup {
    pub fn place(&self) -> Place {
        self.motion.place()
    }

    /// How many of its factors are curves.
    pub fn curves(&self) -> usize {
        self.law.factors().filter(|factor| factor.basis.is_curve()).count()
    }

    /// Whether time is one of its variables: later rows are beyond all that was seen.
    pub fn drifts(&self) -> bool {
        self.law.factors().any(|factor| factor.of == Variable::Time)
    }

    /// As what may join the model: a law without a name.
    pub fn hypothesis(&self) -> Hypothesis {
        Hypothesis::new(Term::new(&Unknown, self.motion, self.law), 1)
    }

    /// Whether it is a law of the list, some names left out: no free form then.
    pub fn is_listed(&self, without: &[String]) -> bool {
        name_of(self).is_some_and(|name| without.iter().all(|out| out != name))
    }

    /// Prior variances of its functions, one list a length.
    fn spectra(&self) -> Vec<Vec<f64>> {
        let factors: Vec<Vec<Vec<f64>>> = self.law.factors().map(|factor| spectra(&factor.basis)).collect();
        match factors.as_slice() {
            [first, second] => first
                .iter()
                .zip(second.iter().cycle())
                .map(|(a, b)| a.iter().flat_map(|x| b.iter().map(move |y| x * y)).collect())
                .collect(),
            _ => factors.into_iter().next().unwrap_or_default(),
        }
    }

    /// Without the waves that hardly vary at one of its lengths.
    pub fn without_idle_waves(&self, length: usize) -> Self {
        let trimmed = |factor: Factor| {
            let Basis::Cosines { low, high, .. } = factor.basis else { return factor };
            let all = spectra(&factor.basis);
            let own = &all[length % all.len()];
            let most = own.iter().copied().fold(0.0, f64::max);
            let count = own.iter().rposition(|variance| *variance > *NEGLIGIBLE * most).map_or(own.len(), |last| last + 1);
            Factor::new(factor.of, Basis::Cosines { low, high, count })
        };
        Self { law: Law { first: trimmed(self.law.first), times: self.law.times.map(trimmed) }, ..*self }
    }

    /// Prior variances of the block's columns, of unit mean square at the tool; a list a length.
    pub fn variances(&self, block: &ProjectedColumns) -> Vec<Vec<f64>> {
        let functions = self.law.count();
        let one = |spectrum: Vec<f64>| {
            let all: Vec<f64> = (0..block.square.len()).map(|k| spectrum[k % functions]).collect();
            let size: f64 = all.iter().zip(&block.square).map(|(variance, square)| variance * square).sum();
            all.into_iter().map(|variance| variance / size.max(f64::MIN_POSITIVE)).collect()
        };
        self.spectra().into_iter().map(one).collect()
    }
}

/// Prior variances of a basis' functions: for every length the spectral density of a Matern kernel with smoothness 3/2.
fn spectra(basis: &Basis) -> Vec<Vec<f64>> {
    let Basis::Cosines { count, .. } = *basis else { return vec![vec![1.0; basis.count()]] };
    let lengths = match count {
        _ if count >= *FINEST => &LENGTHS[..],
        _ if count >= *FINE => &LENGTHS[..4],
        _ if count >= *COARSE => &LENGTHS[..3],
        _ => &LENGTHS[..2],
    };
    let density = |length: f64| {
        let of = |k: usize| {
            let wave = PI * k as f64 * length / (1.0 + 2.0 * *MARGIN);
            1.0 / (3.0 + wave * wave).powi(2)
        };
        let all: Vec<f64> = (1..=count).map(of).collect();
        let sum: f64 = all.iter().sum();
        all.into_iter().map(|density| density / sum).collect()
    };
    lengths.iter().copied().map(density).collect()
}

/// Directions of motions and values of variables at every row, computed once.
pub(super) struct GroupColumns<'f, 'a> {
    pub frame: &'f ProjectedRows<'a>,
    pub survey: &'f Survey<'f>,
    directions: Vec<(Motion, Vec<Vec<f64>>)>,
    values: Vec<(Variable, Option<Vec<f64>>)>,
}

impl<'f, 'a> GroupColumns<'f, 'a> {
    pub fn new(frame: &'f ProjectedRows<'a>, survey: &'f Survey<'f>) -> Self {
        Self { frame, survey, directions: Vec::new(), values: Vec::new() }
    }

    /// A variable at every row, where every row tells it.
    pub fn values(&mut self, of: Variable) -> Option<&[f64]> {
        if !self.values.iter().any(|(other, _)| *other == of) {
            self.values.push((of, self.frame.values(of)));
        }
        self.values.iter().find(|(other, _)| *other == of).and_then(|(_, values)| values.as_deref())
    }

    /// Columns of a group before geometry is projected off; none where some row does not tell its variables.
    pub fn raw(&mut self, group: &FreeGroup) -> Option<Vec<f64>> {
        let mut functions: Vec<Vec<f64>> = vec![vec![1.0; self.frame.view.problem.rows.len()]];
        for factor in group.law.factors() {
            let own = self.at_rows(factor.of, &factor.basis)?;
            let times = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(x, y)| x * y).collect();
            functions = functions.iter().flat_map(|a| own.iter().map(move |b| times(a, b))).collect();
        }
        Some(self.along(group.motion, &functions))
    }

    /// Columns of a motion along some functions of the rows, before geometry is projected off.
    pub fn along(&mut self, motion: Motion, functions: &[Vec<f64>]) -> Vec<f64> {
        let known = self.directions.iter().position(|(other, _)| *other == motion);
        let at = known.unwrap_or_else(|| {
            self.directions.push((motion, self.frame.directions(motion)));
            self.directions.len() - 1
        });
        self.frame.free(&self.directions[at].1, functions)
    }

    /// A smooth function, or a straight one of what has few values; none of what hardly varies.
    pub fn basis(&mut self, of: Variable, count: usize) -> Option<Basis> {
        let values = self.values(of)?;
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), u| (low.min(*u), high.max(*u)));
        let span = high - low;
        if !(span > 1e-9 * high.abs().max(low.abs()) && span > 1e-12) {
            return None;
        }
        let mut distinct: Vec<f64> = Vec::new();
        for value in values {
            if !distinct.iter().any(|other| (other - value).abs() < 1e-9 * span) {
                distinct.push(*value);
            }
            if distinct.len() > *NUMBERS {
                return Some(Basis::Cosines { low: low - *MARGIN * span, high: high + *MARGIN * span, count });
            }
        }
        Some(Basis::Linear { zero: 0.5 * (low + high), per: 0.5 * span })
    }

    /// The same in a product: what has few values multiplies the other variable's function in one of them and need not in another.
    pub fn factor(&mut self, of: Variable, count: usize) -> Option<Basis> {
        Some(match self.basis(of, count)? {
            Basis::Linear { zero, per } => Basis::Straight { zero, per },
            curve => curve,
        })
    }

    /// The share of a variable's variance that a smooth function of another one tells.
    fn follows(&mut self, of: Variable, by: Variable) -> f64 {
        let Some(told) = self.functions(by, *TOLD_BY) else { return 0.0 };
        let Some(values) = self.values(of).map(DVector::from_column_slice) else { return 0.0 };
        let columns = told.iter().map(|column| DVector::from_column_slice(column));
        let ones = std::iter::once(DVector::from_element(values.len(), 1.0));
        let told = DMatrix::from_columns(&ones.chain(columns).collect::<Vec<_>>()).qr().q();
        let centred = values.add_scalar(-values.mean());
        told.tr_mul(&centred).norm_squared() / centred.norm_squared().max(f64::MIN_POSITIVE)
    }

    /// The first functions of a variable at every row, function by function; none of what hardly varies.
    pub fn functions(&mut self, of: Variable, count: usize) -> Option<Vec<Vec<f64>>> {
        let basis = self.basis(of, count)?;
        self.at_rows(of, &basis)
    }

    /// Functions of a variable at every row, function by function; none where some row does not tell it.
    pub fn at_rows(&mut self, of: Variable, basis: &Basis) -> Option<Vec<Vec<f64>>> {
        let values = self.values(of)?;
        let mut out = vec![vec![0.0; values.len()]; basis.count()];
        values.iter().enumerate().for_each(|(row, u)| basis.at(*u, &mut |k, value| out[k][row] = value));
        Some(out)
    }

    /// All groups of a place.
    pub fn of(&mut self, place: Place) -> Vec<FreeGroup> {
        let (mut out, survey) = (Vec::new(), self.survey);
        for (motion, variables) in motions(place, survey) {
            for (of, count) in variables {
                if let Some(basis) = self.basis(of, count) {
                    out.push(FreeGroup { motion, law: Law::new(of, basis), of: alike(of) });
                }
            }
            if steps(motion) {
                let own = |at: &f64| matches!(motion, Motion::Base { .. }) || !survey.is_payload_change(*at);
                let all: Vec<f64> = survey.changes(*STEPS).filter(own).collect();
                let step =
                    |at: &f64| FreeGroup { motion, law: Law::new(Variable::Time, Basis::After { at: *at }), of: all.len() };
                out.extend(all.iter().map(step));
            }
        }
        out
    }

    /// Products of a group that shows with every other variable of its motion: an interaction is looked for where a factor of it helps.
    pub fn products(&mut self, group: &FreeGroup) -> Vec<FreeGroup> {
        if group.law.times.is_some() || matches!(group.law.first.basis, Basis::After { .. }) {
            return Vec::new();
        }
        let of = group.law.first.of;
        let all = motions(group.place(), self.survey);
        let others = all.into_iter().filter(|(motion, _)| *motion == group.motion).flat_map(|(_, variables)| variables);
        // What has a number of its own to be found is no second factor.
        let single: Vec<Variable> = others.map(|(other, _)| other).filter(|other| *other != of && alike(*other) == 1).collect();
        single.into_iter().filter_map(|other| self.product(group.motion, [of, other], group.of)).collect()
    }

    /// The product of two variables, where the rows show one: neither follows the other.
    pub fn product(&mut self, motion: Motion, [first, second]: [Variable; 2], of: usize) -> Option<FreeGroup> {
        let law = Law::new(first, self.factor(first, *EACH)?).times(second, self.factor(second, *EACH)?);
        let told = self.follows(first, second).max(self.follows(second, first));
        (told <= *TOLD).then_some(FreeGroup { motion, law, of })
    }
}

/// How many variables like this one are tried, one choice together.
pub(super) fn alike(of: Variable) -> usize {
    match of {
        Variable::Position { .. } | Variable::Sighted { .. } => ARROWS.len(),
        Variable::Stretch { .. } => LIMITS.len(),
        Variable::Recent { .. } => FADING.len(),
        _ => 1,
    }
}

/// Directions of the tool's position.
pub(super) fn arrows() -> impl Iterator<Item = [f64; 3]> {
    ARROWS.iter().map(|arrow| Vector3::from(*arrow).map(f64::from).normalize().into())
}

/// Whether what moves so may step at a time.
fn steps(motion: Motion) -> bool {
    matches!(motion, Motion::Joint { .. } | Motion::Base { .. } | Motion::Tool { .. })
}

/// Places with a free form.
pub(super) fn places(survey: &Survey) -> Vec<Place> {
    let joints = 0..survey.joints();
    let links = joints.clone().filter(|link| link + 1 < survey.joints() && length(survey, *link) > SHORT);
    let all = joints.map(Place::Joint).chain(links.map(|link| Place::Links(link, link)));
    let instrument = survey.seen_from_outside().then_some(Place::Tracker);
    all.chain([Place::Base, Place::Tool]).chain(instrument).collect()
}

fn length(survey: &Survey, link: usize) -> f64 {
    (survey.robot.point(link + 1) - survey.robot.point(link)).norm()
}

/// The motions of a place, and what each may follow with how many cosines.
pub(super) fn motions(place: Place, survey: &Survey) -> Vec<(Motion, Vec<(Variable, usize)>)> {
    let joints = survey.joints();
    let angles =
        |own: usize| (0..joints).map(move |joint| (Variable::Angle { joint }, if joint == own { *FINE } else { *COARSE }));
    let passing = || PASSING.map(|of| (of, if of == Variable::Time { *FINE } else { *COARSE })).into_iter();
    let sides = || (0..joints).map(|joint| (Variable::Approach { joint }, 1));
    let loads = |own: [usize; 2]| {
        let of = move |joint: usize| (Variable::Load { joint }, if own.contains(&joint) { *COARSE } else { *SKETCH });
        (0..joints).filter(|joint| survey.is_loaded(*joint)).map(of)
    };
    let moved = |joint: usize| {
        let own = moved(joint, survey).map(|of| (of, if alike(of) > 1 { *SKETCH } else { *COARSE }));
        own.chain(others(joint, survey))
    };
    let space = || arrows().map(|along| (Variable::Position { along }, *SKETCH));
    match place {
        Place::Joint(joint) => {
            let own: Vec<_> = angles(joint)
                .chain(passing())
                .chain(sides())
                .chain(loads([joint; 2]))
                .chain(moved(joint))
                .chain(space())
                .collect();
            let finest = own.iter().map(|(of, count)| (*of, if *of == (Variable::Angle { joint }) { *FINEST } else { *count }));
            let mut out = vec![(Motion::Joint { joint }, finest.collect())];
            if survey.robot.is_revolute(joint) {
                out.push((Motion::Axis { joint, about: None, turning: false }, own.clone()));
                out.push((Motion::Slide { joint, along: true }, own.clone()));
                out.push((Motion::Slide { joint, along: false }, own));
            }
            out
        }
        Place::Links(link, _) => {
            let loads = loads([link, link + 1]);
            let own: Vec<_> =
                angles(joints).chain(passing()).chain(sides()).chain(loads).chain(moved(link)).chain(space()).collect();
            vec![(Motion::Links { first: link, last: link }, own.clone()), (Motion::Bend { link }, own)]
        }
        Place::Tracker => {
            let sight = [Variable::Azimuth, Variable::Elevation, Variable::Range].map(|of| (of, *FINE));
            let space = arrows().map(|along| (Variable::Sighted { along }, *SKETCH));
            let moves = others(joints, survey);
            let own: Vec<_> =
                sight.into_iter().chain(passing()).chain(angles(joints)).chain(sides()).chain(moves).chain(space).collect();
            [Polar::Range, Polar::Azimuth, Polar::Elevation].map(|of| (Motion::Instrument { of }, own.clone())).to_vec()
        }
        Place::Tool => {
            let gravity = (0..3).map(|axis| (Variable::Gravity { axis: Some(axis) }, *COARSE));
            let last = joints.saturating_sub(1);
            let gravity = gravity.chain(loads([last; 2]));
            let own: Vec<_> =
                angles(last).chain(passing()).chain(sides()).chain(gravity).chain(moved(last)).chain(space()).collect();
            vec![(Motion::Tool { axes: Axes::Place }, own)]
        }
        _ => {
            let loads = loads([0, 1]);
            let own: Vec<_> = angles(0).chain(passing()).chain(sides()).chain(loads).chain(moved(0)).chain(space()).collect();
            [Axes::Place, Axes::Rotation].map(|axes| (Motion::Base { axes }, own.clone())).to_vec()
        }
    }
}

/// What a joint's travel may leave behind.
pub(super) fn moved(joint: usize, survey: &Survey) -> impl Iterator<Item = Variable> {
    let sticks = LIMITS.map(|share| Variable::Stretch { joint, limit: share * survey.travel(joint) });
    let fades = FADING.map(|time| Variable::Recent { joint, time });
    let clocked = survey.data.has_clock();
    sticks.into_iter().chain(fades.into_iter().filter(move |_| clocked)).chain([Variable::Move { joint }])
}

/// The last moves of the other joints: what else they leave behind is asked of those that show.
fn others(joint: usize, survey: &Survey) -> impl Iterator<Item = (Variable, usize)> {
    (0..survey.joints()).filter(move |other| *other != joint).map(|joint| (Variable::Move { joint }, *SKETCH))
}

/// The cause of the list that a group of the free form is: while it is in the list, the group is that law and no free form.
fn name_of(group: &FreeGroup) -> Option<&'static str> {
    let first = group.law.first;
    match (group.motion, first.of, group.law.times) {
        (Motion::Joint { joint }, Variable::Approach { joint: by }, None) if by == joint => Some(names::BACKLASH),
        (Motion::Joint { .. }, Variable::Time, None) if group.of > 1 => Some(names::ZERO_SHIFT),
        (Motion::Base { .. }, Variable::Time, None) if group.of > 1 => Some(names::BASE_SHIFT),
        (Motion::Tool { .. }, Variable::Time, None) if group.of > 1 => Some(names::TOOL_SHIFT),
        (Motion::Joint { joint }, Variable::Angle { joint: a }, Some(times)) => {
            let Variable::Angle { joint: b } = times.of else { return None };
            ((a == joint || b == joint) && a.abs_diff(b) == 1).then_some(names::CABLE_DRAG)
        }
        _ => None,
    }
}
