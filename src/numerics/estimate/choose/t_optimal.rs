//! Poses that tell two explanations of one recording apart, each at the size that it would have there.
//!
//! L of an explanation is the squared residual, in standard deviations, that is left where the other and all else is fitted in its
//! place: over the recorded rows and the new ones together (T-optimality, Atkinson and Fedorov 1975). Poses make the sum of both
//! ln(1 + L) as large as possible.

use super::exchange::{Criterion, DesignTerm};
use super::point_jacobian::{PointJacobian, factor, gather};
use super::site::{Circumstances, Site};
use super::{DesignRequest, enough, median, random_sets, subset, visit_order};
use crate::estimate::factor::TriangularFactor;
use crate::estimate::model::Model;
use crate::robot::Measurements;
use faer::Mat;
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use rayon::prelude::*;

/// Two explanations in one model.
pub struct DiscriminationProblem {
    /// With both; what is estimated has its values, the second explanation may stand at zero.
    pub model: Model,
    /// Positions in the stack of what is estimated whichever is true.
    pub nuisances: Vec<usize>,
    /// The finding and its rival.
    pub sides: [Alternative; 2],
}

/// An explanation: its parameters' positions in the stack, and their values, SI.
#[derive(Debug, Clone)]
pub struct Alternative {
    /// Positions in the stack.
    pub parameters: Vec<usize>,
    /// Their sizes, SI.
    pub sizes: Vec<f64>,
}

/// What poses would tell; of each pair the first is L where the first explanation is true.
pub struct Discrimination {
    /// L of the recorded rows alone.
    pub before: [f64; 2],
    /// Whether the other does the same at every allowed pose.
    pub alike: [bool; 2],
    /// None where both do.
    pub proposed: Option<Proposed>,
}

/// Poses in the order of driving.
pub struct Proposed {
    /// Positions are the nominal robot's, in its base frame.
    pub poses: Measurements,
    /// Side from which each joint comes to rest, +1 or -1, row-major.
    pub direction: Vec<f64>,
    /// Least share, over the joints, of an error by direction of approach that nothing imitates.
    pub approach_seen: f64,
    /// With the recorded rows; median of random sets of as many poses.
    pub after: [f64; 2],
    /// The same of random sets of as many poses, their median.
    pub random: [f64; 2],
}

/// Explanations whose L is below this cannot be separated.
pub const MIN_SEPARATION_L: f64 = 25.0;

/// What is left of a squared effect below this share is rounding and second order.
const NOTHING: f64 = 1e-6;

/// One explanation as the truth, the other fitted.
struct View {
    jacobian: PointJacobian,
    /// The same without the true one's column.
    others: PointJacobian,
    known: TriangularFactor,
}

impl View {
    fn of(
        problem: &DiscriminationProblem,
        truth: usize,
        data: &Measurements,
        rows: &[usize],
    ) -> Self {
        let (side, other) = (&problem.sides[truth], &problem.sides[1 - truth]);
        let more = other
            .parameters
            .iter()
            .filter(|k| !problem.nuisances.contains(k));
        let free: Vec<usize> = problem.nuisances.iter().chain(more).copied().collect();
        let sized = side
            .parameters
            .iter()
            .copied()
            .zip(side.sizes.iter().copied())
            .collect();
        let jacobian = PointJacobian::given(&problem.model, free.clone(), sized);
        let seen = gather(&jacobian.rows(&problem.model, data), rows);
        // One prior sigma of every parameter, and one of L, keep what no row tells apart from being nothing.
        let known = factor(&stacked(&Mat::identity(seen.ncols(), seen.ncols()), &seen));
        Self {
            jacobian,
            others: PointJacobian::given(&problem.model, free, Vec::new()),
            known,
        }
    }

    /// L of the recorded rows and these.
    fn separation(&self, rows: &Mat<f64>) -> f64 {
        let size = self.known.parameters();
        let known = Mat::from_fn(size, size, |i, j| {
            if i <= j { self.known.column(j)[i] } else { 0.0 }
        });
        let last = factor(&stacked(&known, rows)).column(size - 1)[size - 1];
        (last * last - 1.0).max(0.0)
    }

    /// The two terms whose sum is ln(1 + L).
    fn terms(&self) -> Option<[DesignTerm; 2]> {
        let all: Vec<usize> = (0..self.known.parameters() - 1).collect();
        let others = self.known.select(&all);
        Some([
            DesignTerm::given(1.0, self.jacobian.clone(), &self.known)?,
            DesignTerm::given(-1.0, self.others.clone(), &others)?,
        ])
    }
}

/// Proposes poses that tell the explanations apart, measured in the same set-up as rows `rows` of `data`, whose sigma is that of the fit.
/// Fails with a sentence when no pose is allowed.
pub fn tell(
    problem: &DiscriminationProblem,
    (data, rows): (&Measurements, &[usize]),
    (site, circumstances): (&Site, &Circumstances),
    wish: &DesignRequest,
) -> Result<Discrimination, String> {
    let model = &problem.model;
    let mut draw = ChaCha8Rng::seed_from_u64(wish.seed.wrapping_add(1));
    let mut drawn = site.draw(&model.robot, wish.candidates, wish.sigma, wish.seed)?;
    enough(&drawn, wish)?;
    circumstances.complete(&mut drawn, &mut draw);
    let views = [0, 1].map(|truth| View::of(problem, truth, data, rows));
    let all: Vec<Mat<f64>> = views
        .iter()
        .map(|view| view.jacobian.rows(model, &drawn))
        .collect();
    let before = [0, 1].map(|truth| views[truth].separation(&Mat::zeros(0, all[truth].ncols())));
    let alike = [0, 1].map(|truth| {
        let whole = |rows: &Mat<f64>| rows.col(rows.ncols() - 1).squared_norm_l2();
        let seen = gather(&views[truth].jacobian.rows(model, data), rows);
        before[truth] < MIN_SEPARATION_L
            && views[truth].separation(&all[truth]) <= NOTHING * (whole(&all[truth]) + whole(&seen))
    });
    if alike == [true; 2] {
        return Ok(Discrimination {
            before,
            alike,
            proposed: None,
        });
    }
    let terms = views
        .iter()
        .zip(alike)
        .filter(|(_, alike)| !alike)
        .map(|(view, _)| view.terms());
    let terms: Option<Vec<[DesignTerm; 2]>> = terms.collect();
    let terms = terms.ok_or("the recording leaves the parameters undefined")?;
    let criterion = Criterion {
        terms: terms.into_iter().flatten().collect(),
    };
    let around = |poses: &Measurements, step| {
        let mut pool = site.around(&model.robot, poses, step, &mut draw);
        circumstances.complete(&mut pool, &mut draw);
        pool
    };
    let mut poses = criterion.choose(model, &drawn, wish.count, around);
    poses = subset(&poses, &visit_order::order(&poses, &site.ranges));
    let separations = |poses: &Measurements| {
        [0, 1].map(|k: usize| views[k].separation(&views[k].jacobian.rows(model, poses)))
    };
    let mut after = separations(&poses);
    // Where the side of approach says nothing of the two, it is chosen so that it may say something of others.
    let seen = PointJacobian::of(model, &drawn, &problem.nuisances);
    let (direction, approach_seen) = visit_order::approach(model, &seen, &poses, wish.seed);
    let turned = Measurements {
        direction: Some(direction),
        ..poses.clone()
    };
    let other = separations(&turned);
    if (0..2).all(|k| other[k] >= after[k] * (1.0 - NOTHING)) {
        (poses, after) = (turned, other);
    }
    let sets = random_sets(&drawn, wish.count, wish.seed);
    let random = [0, 1].map(|k| {
        median(
            sets.par_iter()
                .map(|set| views[k].separation(&gather(&all[k], set)))
                .collect(),
        )
    });
    let direction = poses.direction.clone().unwrap_or_default();
    Ok(Discrimination {
        before,
        alike,
        proposed: Some(Proposed {
            poses,
            direction,
            approach_seen,
            after,
            random,
        }),
    })
}

fn stacked(above: &Mat<f64>, below: &Mat<f64>) -> Mat<f64> {
    let mut out = Mat::zeros(above.nrows() + below.nrows(), above.ncols());
    out.as_mut().subrows_mut(0, above.nrows()).copy_from(above);
    out.as_mut()
        .subrows_mut(above.nrows(), below.nrows())
        .copy_from(below);
    out
}
