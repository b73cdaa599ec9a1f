//! Cells: a cause at a place in every shape that it may have, or a motion of a place over a variable that no cause of the list has.

use crate::criteria::cells::{
    BENDING, BENT, EACH, FEW, LENGTHS, MARGIN, ONE_DIRECTION, ROUGHLY, STEPS,
};
use crate::effect::{
    Basis, Form, Law, Motion, Place, Polar, Survey, Term, Unknown, Variable, is_own_table, names,
};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::f64::consts::PI;

/// A cause at a place, whatever its shape.
pub(super) struct CauseCell {
    /// Canonical name of the cause, `unknown` of a cell without a name.
    pub(crate) name: Cow<'static, str>,
    pub(crate) place: Place,
    /// What tells it from other cells of the recording.
    pub(crate) key: String,
    /// ln of its prior odds.
    pub(crate) log_prior: f64,
    pub(crate) shapes: Shapes,
    /// Its usual sizes, m, where other robots say so.
    pub(crate) between: Option<[f64; 2]>,
}

/// The shapes of a cell.
pub(super) enum Shapes {
    /// As they are listed.
    Listed(Vec<ShapeGroup>),
    /// A motion over a variable: any curve, a line, or a step.
    Free(FreeShape),
}

/// Forms whose columns are looked at together, in one or several shapes.
#[derive(Clone)]
pub(super) struct ShapeGroup {
    pub(crate) forms: Vec<Form>,
    pub(crate) shapes: Vec<CellShape>,
    /// Whether coefficients are positive.
    pub(crate) positive: bool,
    /// The largest coefficient that makes sense, SI.
    pub(crate) largest: f64,
}

/// A shape: how the prior variance is shared among the columns of a group.
#[derive(Clone)]
pub(super) struct CellShape {
    /// One for each column; their sum is 1. Empty: alike.
    pub(crate) shares: Vec<f64>,
    /// ln of the weight of the shape within its cell.
    pub(crate) log_weight: f64,
    /// Whether it has further numbers in addition to the plain shapes of its cell.
    pub(crate) is_bent: bool,
}

/// A motion over a variable, or over two.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct FreeShape {
    pub(crate) motion: Motion,
    pub(crate) variable: Variable,
    pub(crate) over: Over,
}

/// In which shapes a motion follows its variable.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Over {
    /// A line or a curve of so many cosines, fewer at first; down to this many of the correlation lengths.
    Curve {
        count: usize,
        first: usize,
        lengths: usize,
    },
    /// A line alone.
    Line,
    /// A step at any time between rows.
    Step,
    /// Any function of both variables.
    Product(Variable),
}

impl CauseCell {
    /// Its groups of shapes; all of them if `closely`.
    pub(crate) fn groups(
        &self,
        survey: &Survey,
        values: &dyn Fn(Variable) -> Option<Vec<f64>>,
        closely: bool,
    ) -> Vec<ShapeGroup> {
        match &self.shapes {
            Shapes::Listed(groups) if closely => with_all_steps(groups, survey),
            Shapes::Listed(groups) => groups.clone(),
            Shapes::Free(free) => free.groups(survey, values, closely),
        }
    }

    /// Whether it has more shapes than are asked at first.
    pub(crate) fn is_coarse(&self) -> bool {
        match &self.shapes {
            Shapes::Free(_) => true,
            Shapes::Listed(groups) => groups.iter().all(|group| group.forms.iter().all(steps)),
        }
    }

    pub(crate) fn is_named(&self) -> bool {
        self.name != names::UNKNOWN
    }

    /// Its motion and variable, where it is one over the other.
    pub(crate) fn free(&self) -> Option<&FreeShape> {
        match &self.shapes {
            Shapes::Free(free) => Some(free),
            Shapes::Listed(_) => None,
        }
    }
}

impl ShapeGroup {
    /// Forms in some shapes, whose coefficients may be anything.
    pub(crate) fn new(forms: Vec<Form>, shapes: Vec<CellShape>) -> Self {
        Self {
            forms,
            shapes,
            positive: false,
            largest: f64::INFINITY,
        }
    }

    /// A single form, all of its columns alike.
    pub(crate) fn of(form: Form, log_weight: f64) -> Self {
        Self::new(vec![form], vec![CellShape::new(Vec::new(), log_weight)])
    }
}

impl CellShape {
    /// A plain shape.
    pub(crate) fn new(shares: Vec<f64>, log_weight: f64) -> Self {
        Self {
            shares,
            log_weight,
            is_bent: false,
        }
    }

    /// A shape of further numbers.
    pub(crate) fn bent(shares: Vec<f64>, log_weight: f64) -> Self {
        Self {
            is_bent: true,
            ..Self::new(shares, log_weight)
        }
    }
}

impl FreeShape {
    pub(crate) fn term(&self, law: Law) -> Form {
        Term::new(&Unknown, self.motion, law).into()
    }

    /// The same with other numbers in its variables (a time, a limit, a direction); steps halve with the level. Empty where they have none.
    pub(crate) fn near(&self, level: i32) -> Vec<Self> {
        let first = near(self.variable, level)
            .into_iter()
            .map(|variable| Self { variable, ..*self });
        let Over::Product(other) = self.over else {
            return first.collect();
        };
        first
            .chain(near(other, level).into_iter().map(|other| Self {
                over: Over::Product(other),
                ..*self
            }))
            .filter(|one| !one.is_square())
            .collect()
    }

    /// Whether the numbers of its variables are those of another one but for rounding.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let over = match (self.over, other.over) {
            (Over::Product(a), Over::Product(b)) => same_numbers(a, b),
            (a, b) => a == b,
        };
        over && self.motion == other.motion && same_numbers(self.variable, other.variable)
    }

    pub(super) fn is_product(&self) -> bool {
        matches!(self.over, Over::Product(_))
    }

    pub(super) fn is_curve(&self) -> bool {
        matches!(self.over, Over::Curve { .. })
    }

    /// Whether a joint follows any curve of its own angle, the same to both sides of its approach or not.
    pub(super) fn is_own_table(&self) -> bool {
        let variables = match self.over {
            Over::Curve { .. } => vec![self.variable],
            Over::Product(other) => vec![self.variable, other],
            Over::Line | Over::Step => return false,
        };
        is_own_table(self.motion, &variables)
    }

    /// Whether it is a product of one variable with itself.
    pub(super) fn is_square(&self) -> bool {
        matches!(self.over, Over::Product(other) if is_square(self.variable, other))
    }

    /// Its curves over some values at all correlation lengths, each of such a weight.
    pub(crate) fn curves(&self, values: &[f64], log_weight: f64) -> Vec<ShapeGroup> {
        let Over::Curve { count, lengths, .. } = self.over else {
            return Vec::new();
        };
        let law = Law::new(self.variable, self.cosines(support(values), count));
        let shapes = self.smooth(count, lengths).into_iter();
        let shapes = shapes.map(|shares| CellShape::new(shares, log_weight));
        vec![ShapeGroup::new(vec![self.term(law)], shapes.collect())]
    }

    /// Whether a constant of its motion is neither geometry nor a place of the instrument, so that its curves have a mean.
    fn has_mean(&self) -> bool {
        matches!(
            self.motion,
            Motion::Instrument {
                reading: Polar::Elevation | Polar::Range,
                ..
            }
        )
    }

    /// The same, or a curve of one of two variables, which is multiplied.
    fn curves_have_mean(&self) -> bool {
        self.has_mean() || self.is_product()
    }

    /// A line over values of its variable.
    pub(super) fn line(&self, values: &[f64]) -> Option<Basis> {
        match line(values)? {
            Basis::Linear { zero, per } if self.curves_have_mean() => {
                Some(Basis::Straight { zero, per })
            }
            line => Some(line),
        }
    }

    /// So many cosines over a range of its variable.
    pub(super) fn cosines(&self, [low, high]: [f64; 2], count: usize) -> Basis {
        if self.curves_have_mean() {
            let count = count + 1;
            Basis::Series { low, high, count }
        } else {
            Basis::Cosines { low, high, count }
        }
    }

    /// Shares of its cosines, half of all for the mean where it has one, for every direction of its motion alike.
    fn shares(&self, cosines: Vec<f64>) -> Vec<f64> {
        let functions = match self.curves_have_mean() {
            true => with_mean(cosines),
            false => cosines,
        };
        over_fields(functions, self.motion, fields(self.motion))
    }

    /// Shares of a smooth curve, one list a correlation length.
    pub(super) fn smooth(&self, count: usize, lengths: usize) -> Vec<Vec<f64>> {
        let lengths = LENGTHS[..lengths.min(LENGTHS.len())].iter();
        lengths
            .map(|length| self.shares(density(count, *length)))
            .collect()
    }

    /// Shares of a curve with corners.
    pub(super) fn rough(&self, count: usize) -> Vec<f64> {
        self.shares(cornered(count))
    }

    pub(crate) fn groups(
        &self,
        survey: &Survey,
        values: &dyn Fn(Variable) -> Option<Vec<f64>>,
        closely: bool,
    ) -> Vec<ShapeGroup> {
        let form = |basis| self.term(Law::new(self.variable, basis));
        if self.over == Over::Step {
            let times: Vec<f64> = match closely {
                true => survey.boundaries.clone(),
                false => survey.changes(*STEPS).collect(),
            };
            let log_weight = -(times.len().max(1) as f64).ln();
            let step = |at| ShapeGroup::of(form(Basis::After { at }), log_weight);
            return times.into_iter().map(step).collect();
        }
        let Some(of_first) = values(self.variable) else {
            return Vec::new();
        };
        let group = match self.over {
            Over::Product(other) => {
                values(other).and_then(|second| self.product(&of_first, (other, &second), closely))
            }
            over => self.line(&of_first).map(|line| match over {
                Over::Curve {
                    count,
                    first,
                    lengths,
                } if !has_few(&of_first) => {
                    let count = if closely { count } else { first };
                    let lengths = if closely { lengths } else { lengths.min(2) };
                    let rough = (closely && lengths > 3).then(|| self.rough(count));
                    let straight = fields(self.motion) * line.count();
                    let curve = self.cosines(support(&of_first), count);
                    let shapes = line_and_curve(straight, &self.smooth(count, lengths), rough);
                    ShapeGroup::new(vec![form(line), form(curve)], shapes)
                }
                _ => ShapeGroup::of(form(line), 0.0),
            }),
        };
        group.into_iter().collect()
    }

    /// Any function of its variable times any of another one; none where either hardly varies.
    fn product(
        &self,
        first: &[f64],
        (other, second): (Variable, &[f64]),
        closely: bool,
    ) -> Option<ShapeGroup> {
        let fields = fields(self.motion);
        let count = match closely {
            true => EACH[fields.clamp(1, 3) - 1],
            false => *ROUGHLY,
        };
        let (a, b) = (factor(first, count)?, factor(second, count)?);
        let spectrum = |basis: Basis, length: f64| match basis {
            Basis::Straight { .. } => vec![0.5, 0.5],
            basis => with_mean(density(basis.count() - 1, length)),
        };
        let lengths = &LENGTHS[..2];
        let shape = |length: &f64| {
            let [first, second] = [a, b].map(|basis| spectrum(basis, *length));
            let products = |x: &f64| second.iter().map(|y| x * y).collect::<Vec<_>>();
            let mut shares: Vec<f64> = first.iter().flat_map(products).collect();
            if !self.has_mean() {
                shares[0] = 0.0;
            }
            CellShape::new(
                over_fields(normalised(shares), self.motion, fields),
                -(lengths.len() as f64).ln(),
            )
        };
        let form = self.term(Law::new(self.variable, a).times(other, b));
        let shapes = lengths.iter().map(shape).collect();
        Some(ShapeGroup::new(vec![form], shapes))
    }
}

/// Whether a product of both is one of a variable with itself; two directions in space are two variables where they differ.
pub(super) fn is_square(a: Variable, b: Variable) -> bool {
    match (a, b) {
        (Variable::Position { along: a }, Variable::Position { along: b })
        | (Variable::Sighted { along: a }, Variable::Sighted { along: b }) => {
            Vector3::from(a).dot(&Vector3::from(b)).abs() > *ONE_DIRECTION
        }
        _ => a == b || a.is_alike(b),
    }
}

/// Whether two variables are one but for rounding.
fn same_numbers(a: Variable, b: Variable) -> bool {
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs();
    let one = |a: [f64; 3], b: [f64; 3]| (Vector3::from(a) - Vector3::from(b)).norm() < 1e-9;
    match (a, b) {
        (Variable::Recent { time: a, .. }, Variable::Recent { time: b, .. })
        | (Variable::Stretch { limit: a, .. }, Variable::Stretch { limit: b, .. })
            if !same(a, b) =>
        {
            false
        }
        (Variable::Position { along: a }, Variable::Position { along: b })
        | (Variable::Sighted { along: a }, Variable::Sighted { along: b }) => one(a, b),
        _ => a == b || a.is_alike(b),
    }
}

/// A variable with other numbers.
fn near(variable: Variable, level: i32) -> Vec<Variable> {
    let step = libm::exp2(-f64::from(level));
    let scales = [libm::exp2(step), libm::exp2(-step)];
    let turned = |along: [f64; 3]| {
        let along = Vector3::from(along);
        let across = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize();
        let angle = 0.4 * step;
        [across, along.cross(&across)]
            .into_iter()
            .flat_map(move |across| {
                [angle, -angle].map(|angle| {
                    (along * libm::cos(angle) + across * libm::sin(angle))
                        .normalize()
                        .into()
                })
            })
    };
    match variable {
        Variable::Recent { joint, time } => scales
            .map(|scale| time * scale)
            .map(|time| Variable::Recent { joint, time })
            .to_vec(),
        Variable::Stretch { joint, limit } => scales
            .map(|scale| limit * scale)
            .map(|limit| Variable::Stretch { joint, limit })
            .to_vec(),
        Variable::Position { along } => turned(along)
            .map(|along| Variable::Position { along })
            .collect(),
        Variable::Sighted { along } => turned(along)
            .map(|along| Variable::Sighted { along })
            .collect(),
        _ => Vec::new(),
    }
}

/// Whether a form steps at a time.
fn steps(form: &Form) -> bool {
    matches!(form.term().map(Term::basis), Some(Basis::After { .. }))
        && form.variables() == [Variable::Time]
}

/// Groups with their steps at every time between rows.
fn with_all_steps(groups: &[ShapeGroup], survey: &Survey) -> Vec<ShapeGroup> {
    if !groups.iter().all(|group| group.forms.iter().all(steps)) {
        return groups.to_vec();
    }
    let mut out: Vec<ShapeGroup> = groups.to_vec();
    let mut known: Vec<Form> = groups
        .iter()
        .flat_map(|group| group.forms.iter().cloned())
        .collect();
    for group in groups {
        for near in group.forms[0]
            .near(survey, 0)
            .into_iter()
            .filter(|near| !known.contains(near))
            .collect::<Vec<_>>()
        {
            out.push(ShapeGroup {
                forms: vec![near.clone()],
                ..group.clone()
            });
            known.push(near);
        }
    }
    let more = (groups.len() as f64 / out.len() as f64).ln();
    out.iter_mut()
        .flat_map(|group| &mut group.shapes)
        .for_each(|shape| shape.log_weight += more);
    out
}

/// A cause's line and a curve over the same variable, as one physics: a line, or one that is not quite straight.
pub(super) fn not_quite_straight(
    line: Form,
    motion: Motion,
    variable: Variable,
    values: &[f64],
) -> Option<ShapeGroup> {
    if has_few(values) {
        return None;
    }
    let ([low, high], count) = (support(values), *BENDING);
    let law = Law::new(variable, Basis::Cosines { low, high, count });
    let fields = fields(motion);
    let mut shapes = Vec::new();
    for length in &LENGTHS[..3] {
        let curve = over_fields(density(count, *length), motion, fields);
        shapes.extend(BENT.map(|share| bent(fields, &curve, share, -6.0_f64.ln())));
    }
    let curve = Term::new(&Unknown, motion, law).into();
    Some(ShapeGroup::new(vec![line, curve], shapes))
}

/// A line of so many columns with a curve that has a share of it.
fn bent(line: usize, curve: &[f64], share: f64, log_weight: f64) -> CellShape {
    let all = 1.0 + share * share;
    let straight = std::iter::repeat_n(1.0 / (line as f64 * all), line);
    let curve = curve.iter().map(|part| part * share * share / all);
    CellShape::bent(straight.chain(curve).collect(), log_weight)
}

/// A line of so many columns, curves of some correlation lengths, lines that are not quite straight, and a curve with corners.
pub(super) fn line_and_curve(
    line: usize,
    lengths: &[Vec<f64>],
    rough: Option<Vec<f64>>,
) -> Vec<CellShape> {
    let plain = |straight: f64, curve: &[f64], log_weight: f64| {
        let straight = std::iter::repeat_n(straight, line);
        CellShape::new(straight.chain(curve.iter().copied()).collect(), log_weight)
    };
    let half = 0.5_f64.ln();
    let none = vec![0.0; lengths[0].len()];
    let mut out = vec![plain(1.0 / line as f64, &none, half)];
    let count = (lengths.len() as f64).ln();
    for curve in lengths {
        out.push(plain(0.0, curve, half - count));
        let log_weight = half - count - 2.0_f64.ln();
        out.extend(BENT.map(|share| bent(line, curve, share, log_weight)));
    }
    out.extend(rough.map(|rough| plain(0.0, &rough, half - count)));
    out
}

/// The directions of a motion.
pub(super) fn fields(motion: Motion) -> usize {
    match motion {
        Motion::Axis { about: None, .. }
        | Motion::Slide { along: false, .. }
        | Motion::Bend { .. } => 2,
        Motion::Base { axes } | Motion::Tool { axes } | Motion::Tracker { axes } => axes.count(),
        _ => 1,
    }
}

/// Whether the directions of a motion alternate in its coefficients, as the axes of a frame do; else all functions of one follow each other.
pub(super) fn alternates(motion: Motion) -> bool {
    matches!(
        motion,
        Motion::Base { .. } | Motion::Tool { .. } | Motion::Tracker { .. }
    )
}

/// Shares of functions, for every direction of a motion alike, in the order of its coefficients.
pub(super) fn over_fields(shares: Vec<f64>, motion: Motion, fields: usize) -> Vec<f64> {
    let scaled = |share: &f64| share / fields as f64;
    if alternates(motion) {
        shares
            .iter()
            .flat_map(|share| std::iter::repeat_n(scaled(share), fields))
            .collect()
    } else {
        (0..fields)
            .flat_map(|_| shares.iter().map(scaled))
            .collect()
    }
}

/// Shares of cosines: the spectral density of a Matern kernel with smoothness 3/2 (Rasmussen and Williams, 2006, ch. 4).
pub(super) fn density(count: usize, length: f64) -> Vec<f64> {
    let at_order = |k: usize| {
        let wave = PI * k as f64 * length / (1.0 + 2.0 * *MARGIN);
        (3.0 + wave * wave).powi(-2)
    };
    normalised((1..=count).map(at_order).collect())
}

/// The same of a curve with corners: the spectral density of an exponential kernel.
pub(super) fn cornered(count: usize) -> Vec<f64> {
    let at_order = |k: usize| 1.0 / (1.0 + (PI * k as f64 * 0.3).powi(2));
    normalised((1..=count).map(at_order).collect())
}

/// Shares of a sum of one.
fn normalised(shares: Vec<f64>) -> Vec<f64> {
    let sum: f64 = shares.iter().sum();
    shares.into_iter().map(|share| share / sum).collect()
}

/// Shares of a curve with a mean, which has half of all.
pub(super) fn with_mean(curve: Vec<f64>) -> Vec<f64> {
    let curve = curve.into_iter().map(|share| 0.5 * share);
    std::iter::once(0.5).chain(curve).collect()
}

/// The lowest and highest of some values.
fn range(values: &[f64]) -> [f64; 2] {
    values
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], u| {
            [low.min(*u), high.max(*u)]
        })
}

/// The support of cosines over some values.
pub(super) fn support(values: &[f64]) -> [f64; 2] {
    let [low, high] = range(values);
    [low - *MARGIN * (high - low), high + *MARGIN * (high - low)]
}

/// From -1 to 1 over some values; none where they hardly vary.
pub(super) fn line(values: &[f64]) -> Option<Basis> {
    let [low, high] = range(values);
    let span = high - low;
    let varies = span > 1e-9 * high.abs().max(low.abs()) && span > 1e-12;
    varies.then_some(Basis::Linear {
        zero: 0.5 * (low + high),
        per: 0.5 * span,
    })
}

/// Functions of one of two variables, a constant among them.
fn factor(values: &[f64], count: usize) -> Option<Basis> {
    let Basis::Linear { zero, per } = line(values)? else {
        return None;
    };
    if has_few(values) {
        return Some(Basis::Straight { zero, per });
    }
    let [low, high] = support(values);
    Some(Basis::Series { low, high, count })
}

/// Whether values are so few that they bear no curve.
pub(super) fn has_few(values: &[f64]) -> bool {
    let [low, high] = range(values);
    let mut distinct: Vec<f64> = Vec::new();
    for value in values {
        if !distinct
            .iter()
            .any(|other| (other - value).abs() < 1e-9 * (high - low))
        {
            distinct.push(*value);
        }
        if distinct.len() > *FEW {
            return false;
        }
    }
    true
}
