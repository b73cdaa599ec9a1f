//! How certain a compensated position is: the covariance of the parameters, carried to the point.

use crate::compensate::arm::{BeyondFitted, IdentifiedArm, Reach};
use crate::effect::{Place, names};
use crate::estimate::choose::median;
use crate::estimate::{Covariance, columns};
use crate::robot::Measurements;
use crate::statistics::radius_95;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// How the arm scatters about the model, whatever its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scatter {
    /// Standard deviation per axis of what the model leaves unexplained, m.
    pub unexplained: f64,
    /// Standard deviation of every revolute joint that comes back to a pose, rad.
    pub repeatability: f64,
}

/// How far a position may be off, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionUncertainty {
    /// One-sigma length by the parameters' covariance alone: root of the summed variances.
    pub sigma: f64,
    /// Radius of the sphere about the target that holds the tool with 95 %: parameters, scatter, and laws beyond the rows that they were
    /// fitted to.
    pub u95: f64,
}

/// An effect at a place, and its own parameters in the covariance.
struct Source {
    name: String,
    parameters: Vec<usize>,
}

/// What the rows that were fitted leave open of the parameters, and how the arm scatters.
pub struct Uncertainty {
    covariance: Covariance,
    scatter: Scatter,
    /// Row of each parameter of the stack in the covariance.
    row: Vec<Option<usize>>,
    /// Effects at places, those of the arm.
    sources: Vec<Source>,
    /// Names of the stack's parameters.
    names: Vec<String>,
    /// m, 95 %: what is usual at the recorded poses.
    usual: f64,
    /// m: length of one standard deviation of the instrument there, rms over the rows.
    instrument: f64,
    /// m, 95 %: how far points may be off in the robot's own base, where that is known no better than by tolerances; usual at the recorded poses.
    pub own_base: f64,
}

impl Uncertainty {
    /// The uncertainty that the parameters of `arm` have; what belonged to the measurement alone does not blur the arm.
    pub fn new(arm: &IdentifiedArm, covariance: Covariance, scatter: Scatter) -> Self {
        let mut row = columns(arm.model(), covariance.parameters());
        for parameter in arm.of_the_measurement() {
            row[*parameter] = None;
        }
        let specs = arm.model().stack.specs();
        let mut names = vec![String::new(); specs.len()];
        let mut sources: Vec<Source> = Vec::new();
        for (effect, range) in arm.model().stack.effects() {
            for k in range {
                names[k] = format!("{} at {}", effect.name(), specs[k].place);
                let Some(row) = row[k] else { continue };
                match sources.iter_mut().find(|source| source.name == names[k]) {
                    Some(source) => source.parameters.push(row),
                    None => sources.push(Source {
                        name: names[k].clone(),
                        parameters: vec![row],
                    }),
                }
            }
        }
        Self {
            covariance,
            scatter,
            row,
            sources,
            names,
            usual: 0.0,
            instrument: 0.0,
            own_base: 0.0,
        }
    }

    /// The same with what is usual at the poses of a recording (95 % along any direction), and what its instrument leaves open.
    pub fn with_recording(mut self, arm: &IdentifiedArm, data: &Measurements) -> Self {
        let (rows, mut reach) = (data.rows(), arm.reach());
        let finite = |value: &f64| value.is_finite();
        let mut along =
            |row| COVERAGE * (self.of_parameters(&mut reach, data.q(row)).trace() / 3.0).sqrt();
        let some = (0..rows).step_by(rows.div_ceil(POSES).max(1));
        let usual: Vec<f64> = some.map(&mut along).filter(finite).collect();
        let squares = (0..rows).map(|row| data.noise(row).powi(2)).filter(finite);
        self.instrument = (squares.sum::<f64>() / rows.max(1) as f64).sqrt();
        self.usual = if usual.is_empty() { 0.0 } else { median(usual) };
        // What moves base and links together shows in no measured point, but in those of the robot's own base.
        let own = self.against_own_base(arm);
        let some = (0..rows).step_by(rows.div_ceil(POSES).max(1));
        let radius = |row| {
            let jacobian = self.jacobian(&mut reach, data.q(row));
            let rates = DMatrix::from_fn(3, jacobian.len(), |axis, k| jacobian[k][axis]);
            let all = &rates * &own * rates.transpose();
            radius_95(all.trace(), all.norm_squared())
        };
        let radii: Vec<f64> = some.map(radius).filter(finite).collect();
        self.own_base = if radii.is_empty() { 0.0 } else { median(radii) };
        self
    }

    /// Covariance of the parameters but for where the base stands. The zero of joint 1 is what the base is turned by: it is no error there.
    fn against_own_base(&self, arm: &IdentifiedArm) -> DMatrix<f64> {
        let parameters = self.covariance.parameters();
        let Some(mut own) = self.covariance.block(parameters) else {
            return DMatrix::zeros(parameters.len(), parameters.len());
        };
        let (stack, specs) = (&arm.model().stack, arm.model().stack.specs());
        let turns = stack.parameters_of(names::JOINT_OFFSET);
        let mut turns = turns.filter(|k| specs[*k].place == Place::Joint(0));
        if let Some(turn) = turns.next().and_then(|k| self.row[k]) {
            let (column, variance) = (own.column(turn).into_owned(), own[(turn, turn)]);
            own -= &column * column.transpose() / variance.max(f64::MIN_POSITIVE);
        }
        for k in stack
            .parameters_of(names::BASE_FRAME)
            .filter_map(|k| self.row[k])
        {
            own.row_mut(k).fill(0.0);
            own.column_mut(k).fill(0.0);
        }
        own
    }

    fn jacobian(&self, reach: &mut Reach, q: &[f64]) -> Vec<Vector3<f64>> {
        let mut jacobian = vec![Vector3::zeros(); self.covariance.parameters().len()];
        reach.derivatives(q, |parameter, derivative| {
            if let Some(k) = self.row[parameter] {
                jacobian[k] += derivative;
            }
        });
        jacobian
    }

    /// Covariance (m2, tracker frame) of the point at command `q` by the parameters.
    fn of_parameters(&self, reach: &mut Reach, q: &[f64]) -> Matrix3<f64> {
        self.covariance.of_point(&self.jacobian(reach, q))
    }

    /// At command `q`, under the circumstances that `reach` is set to.
    pub fn at(&self, reach: &mut Reach, q: &[f64]) -> PositionUncertainty {
        let parameters = self.of_parameters(reach, q);
        let Scatter {
            unexplained,
            repeatability,
        } = self.scatter;
        let mut all = parameters + Matrix3::from_diagonal_element(unexplained * unexplained);
        for law in reach.beyond_fitted(q) {
            all += law.covariance;
        }
        if repeatability > 0.0 {
            all += reach.joint_scatter(q) * (repeatability * repeatability);
        }
        PositionUncertainty {
            sigma: parameters.trace().sqrt(),
            u95: radius_95(all.trace(), all.norm_squared()),
        }
    }
}

/// 95 % of a normal distribution lie within so many standard deviations.
const COVERAGE: f64 = 1.96;
/// Recorded poses at which the usual uncertainty is asked, at most.
const POSES: usize = 60;
/// m: a smaller correction is rounding and has no direction.
const NOTHING: f64 = 1e-9;
/// A finding is named where it makes at least this share of the whole by itself.
const NAMED: f64 = 0.5;
/// A correction is doubtful from this share of itself on ...
const DOUBTFUL: f64 = 0.5;
/// ... and above so many standard deviations of the instrument.
const SEEN: f64 = 3.0;
/// Below so many times what is usual where the arm was measured, an uncertainty refuses nothing, however small the correction.
const USUAL: f64 = 6.0;

/// How far a correction may be off.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionUncertainty {
    /// m: the correction at the uncorrected command.
    pub(crate) correction: f64,
    /// m, 95 %: along the correction by the parameters, and in any direction by laws that are used beyond the rows that they were fitted to.
    pub(crate) u95: f64,
    /// The effect and place that most of it comes from, where one stands out.
    pub(crate) finding: Option<String>,
    /// Findings that are extrapolated and may be off there by more than the uncertainty of the instrument, each with its variable.
    pub(crate) beyond: Vec<(String, String)>,
    /// m, 95 %: what is usual at the recorded poses; 0 where they are not known.
    pub(crate) usual: f64,
    /// m: length of one standard deviation of the instrument at the recorded poses; 0 where they are not known.
    pub(crate) instrument: f64,
}

impl CorrectionUncertainty {
    /// Whether the correction is doubtful: uncertain by more than half of itself, and by more than the instrument leaves open.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.u95.is_nan() || self.u95 > (DOUBTFUL * self.correction).max(SEEN * self.instrument)
    }

    /// Above this (m) the correction may do more harm than good.
    pub(crate) fn limit(&self) -> f64 {
        self.correction.max(USUAL * self.usual)
    }
}

impl Uncertainty {
    /// Standard uncertainty of the correction (m, tracker frame) that led to the command `q`, under the circumstances that `reach` is set to.
    pub(crate) fn of_correction(
        &self,
        reach: &mut Reach,
        q: &[f64],
        correction: &Vector3<f64>,
    ) -> CorrectionUncertainty {
        let beyond: Vec<BeyondFitted> = reach.beyond_fitted(q);
        let size = correction.norm();
        let along = if size > NOTHING {
            correction / size
        } else {
            Vector3::zeros()
        };
        let jacobian: Vec<f64> = self
            .jacobian(reach, q)
            .iter()
            .map(|derivative| derivative.dot(&along))
            .collect();
        let variance =
            self.covariance.along(&jacobian) + beyond.iter().map(BeyondFitted::square).sum::<f64>();
        let seen = |one: &&BeyondFitted| COVERAGE * one.square().sqrt() > self.instrument;
        let name = |one: &BeyondFitted| self.names[one.parameter].clone();
        let u95 = COVERAGE * variance.sqrt();
        let mut finding = None;
        if u95 > DOUBTFUL * size {
            let fitted = self.sources.iter().map(|source| {
                let share = self.covariance.along_rows(&jacobian, &source.parameters);
                (source.name.clone(), share)
            });
            let shares = fitted.chain(beyond.iter().map(|one| (name(one), one.square())));
            let most = shares.max_by(|a, b| a.1.total_cmp(&b.1));
            finding = most
                .filter(|(_, share)| *share >= NAMED * variance)
                .map(|(name, _)| name);
        }
        let named = |one| (name(one), one.variable.to_string());
        CorrectionUncertainty {
            correction: size,
            u95,
            finding,
            beyond: beyond.iter().filter(seen).map(named).collect(),
            usual: self.usual,
            instrument: self.instrument,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_correction_is_doubtful_above_half_of_itself_and_three_times_the_instrument() {
        let um = |correction: f64, u95: f64| CorrectionUncertainty {
            correction: correction * 1e-6,
            u95: u95 * 1e-6,
            finding: None,
            beyond: Vec::new(),
            usual: 400e-6,
            instrument: 18e-6,
        };
        let doubtful = [(1000.0, 600.0), (1000.0, 400.0), (20.0, 53.0), (20.0, 55.0)]
            .map(|(c, u)| um(c, u).is_doubtful());
        assert_eq!(doubtful, [true, false, false, true]);
    }
}
