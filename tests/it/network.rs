//! The perceptron, its gradient, its training, its valid range and the judge of whether it helps.

use crate::answer::{has, read, root};
use crate::fixture::robot_of;
use calib::estimate::network::arm::ScrewArm;
use calib::estimate::network::correction::{Body, NetworkScaling, Networks, Scaling, features};
use calib::estimate::network::loss::{Batch, Loss, LossBuffers};
use calib::estimate::network::region::Region;
use calib::estimate::network::rivals::{RivalComparison, RivalContest, learn};
use calib::estimate::network::{
    Activation, Correction, LayerSizes, Recipe, Rival, TrainingSamples, TrainingStart, compare,
    train,
};
use calib::estimate::swarm::Algorithm;
use calib::robot::RobotModel;
use calib::spatial::Pose;
use calib::table::{Network, Table};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

fn recipe(joints: usize) -> Recipe {
    Recipe {
        joints,
        features: features(&vec![false; joints], false, false),
        through: None,
        hidden: 12,
        activation: Activation::Sigmoid,
        start: TrainingStart::Swarm(Algorithm::Bso),
        beetles: 20,
        generations: 30,
        iterations: 200,
        decay: 1.0,
        members: 4,
        keep_back: 0.1,
        seed: 7,
        jobs: 2,
    }
}

/// Training that takes a moment.
fn cheap(iterations: usize, members: usize) -> Recipe {
    Recipe {
        generations: 5,
        iterations,
        members,
        ..recipe(6)
    }
}

/// Normal enough: the sum of twelve uniform numbers.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

/// Poses of a six-joint arm with a smooth remainder of about 0.9 mm (times `signal`) and noise of `noise` m per axis.
fn arm(rows: usize, signal: f64, noise: f64, seed: u64) -> TrainingSamples {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut samples = TrainingSamples::default();
    for _ in 0..rows {
        let q: Vec<f64> = (0..6).map(|_| rng.random_range(-1.2..1.2)).collect();
        let reach = (q[1] + 0.3).sin() + (q[1] + q[2]).cos();
        let lift = 0.5e-3 * (2.0 * q[1]).sin()
            + 0.4e-3 * reach * (q[2]).cos()
            + 0.2e-3 * q[4].sin() * q[3].cos();
        let turn = 0.45e-3 * (2.0 * q[0] + 0.4).sin() + 0.2e-3 * q[3].sin();
        let clean = [
            q[0].cos() * lift - q[0].sin() * turn,
            q[0].sin() * lift + q[0].cos() * turn,
            1.2 * lift - 0.2e-3 * q[4],
        ];
        samples
            .residual
            .push(clean.map(|r| signal * r + noise * normal(&mut rng)));
        samples.sources.push(q);
    }
    samples
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

fn mean_error(samples: &TrainingSamples, correction: Option<&Correction>) -> f64 {
    let left = samples.sources.iter().zip(&samples.residual).map(|(q, r)| {
        let delta = correction.map_or([0.0; 3], |correction| correction.at(q).delta);
        length(std::array::from_fn(|k| r[k] - delta[k]))
    });
    left.sum::<f64>() / samples.rows() as f64
}

#[test]
fn activations_are_those_of_the_textbook_for_any_number() {
    for k in -4000..=4000 {
        let z = f64::from(k) * 0.01 + 1e-5;
        let (sigmoid, tanh) = (1.0 / (1.0 + (-z).exp()), z.tanh());
        assert!(
            (Activation::Sigmoid.value(z) / sigmoid - 1.0).abs() < 5e-15 * z.abs().max(1.0),
            "{z}"
        );
        assert!((Activation::Tanh.value(z) - tanh).abs() < 2e-15, "{z}");
    }
    for (z, limit) in [
        (700.0, 1.0),
        (1e300, 1.0),
        (f64::INFINITY, 1.0),
        (-1e300, 0.0),
        (f64::NEG_INFINITY, 0.0),
    ] {
        assert!((Activation::Sigmoid.value(z) - limit).abs() < 1e-300, "{z}");
    }
    assert!(Activation::Sigmoid.value(f64::NAN).is_nan());
}

#[test]
fn the_gradient_is_that_of_central_differences() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (activation, outputs) in [
        (Activation::Sigmoid, 3),
        (Activation::Tanh, 3),
        (Activation::Sigmoid, 6),
    ] {
        // 150 rows: a full block, and another that is not full.
        let x: Vec<Vec<f64>> = (0..150)
            .map(|_| (0..7).map(|_| rng.random_range(-2.0..2.0)).collect())
            .collect();
        let y: Vec<[f64; 3]> = (0..150)
            .map(|_| std::array::from_fn(|_| rng.random_range(-2.0..2.0)))
            .collect();
        let mut way = || std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        let ways: Vec<Vec<[f64; 3]>> = (0..150)
            .map(|_| (0..outputs).map(|_| way()).collect())
            .collect();
        let batch = Batch::new(&x, &y);
        let batch = if outputs == 3 {
            batch
        } else {
            batch.through(&ways)
        };
        let shape = LayerSizes {
            inputs: 7,
            hidden: 5,
            outputs,
            activation,
        };
        let loss = Loss {
            shape,
            batch: &batch,
            decay: 0.7,
        };
        let mut scratch = LossBuffers::new(shape);
        let mut w: Vec<f64> = (0..shape.parameters())
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        let mut gradient = vec![0.0; w.len()];
        let (value, squares) = loss.gradient(&w, &mut gradient, &mut scratch);
        assert_eq!(
            squares.map(|s| (s * 1e9).round()),
            loss.mean_squares(&w, &mut scratch)
                .map(|s| (s * 1e9).round())
        );
        assert!((value - loss.value(&w, &mut scratch)).abs() < 1e-14);
        for i in 0..w.len() {
            let step = 1e-5;
            let at = w[i];
            w[i] = at + step;
            let up = loss.value(&w, &mut scratch);
            w[i] = at - step;
            let down = loss.value(&w, &mut scratch);
            w[i] = at;
            let difference = (up - down) / (2.0 * step);
            assert!(
                (difference - gradient[i]).abs() < 1e-9,
                "{activation:?} {i}: {difference} {}",
                gradient[i]
            );
        }
        // The single-row function and the batched one are the same network.
        let mut squares = 0.0;
        for ((x, y), ways) in x.iter().zip(&y).zip(&ways) {
            let out = shape.at(&w, x);
            for k in 0..3 {
                let at = if outputs == 3 {
                    out[k]
                } else {
                    out.iter().zip(ways).map(|(o, way)| o * way[k]).sum()
                };
                squares += (at - y[k]).powi(2);
            }
        }
        assert!(
            (squares / 150.0 - loss.mean_squares(&w, &mut scratch).iter().sum::<f64>()).abs()
                < 1e-12
        );
    }
}

/// The SR210D, its base turned and shifted in the tracker's frame.
fn sr210d() -> ScrewArm {
    let text = read(root("pipelines/sr210d/robot.yaml"));
    let robot = RobotModel::new(robot_of(&text));
    ScrewArm::of(
        &robot,
        &Pose::from_rotation_vector([0.02, -0.03, 2.0].into(), [4.5, -1.8, 0.9].into()),
    )
}

/// Poses of that arm whose joints 1 and 2 have encoders with waves of 90 and 60 urad, plus `noise` m per axis.
fn waves(rows: usize, arm: &ScrewArm, noise: f64, seed: u64) -> TrainingSamples {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut samples = TrainingSamples::default();
    for _ in 0..rows {
        let q: Vec<f64> = (0..6).map(|_| rng.random_range(-1.2..1.2)).collect();
        let stance = arm.stance(&q);
        let moved = stance.turn(0) * (90e-6 * (11.0 * q[0] + 0.4).sin())
            + stance.turn(1) * (60e-6 * (5.0 * q[1]).cos());
        samples
            .residual
            .push(std::array::from_fn(|k| moved[k] + noise * normal(&mut rng)));
        samples.sources.push(q);
    }
    samples
}

fn contest<'a>(
    arm: Option<&'a ScrewArm>,
    rivals: &[Rival],
    cheap: &Recipe,
    folds: usize,
) -> RivalContest<'a> {
    RivalContest {
        rivals: rivals.to_vec(),
        arm,
        prismatic: &[false; 6],
        recipe: cheap.clone(),
        trial: Recipe {
            members: 2,
            ..cheap.clone()
        },
        decays: vec![0.5, 5.0],
        hidden: vec![8],
        folds,
    }
}

const ALL: [Rival; 6] = [
    Rival::Ridge,
    Rival::Process,
    Rival::Curves,
    Rival::Network(TrainingStart::Random),
    Rival::Network(TrainingStart::Swarm(Algorithm::Bso)),
    Rival::JointNetwork(TrainingStart::Random),
];

fn error(comparison: &RivalComparison, rival: Rival) -> f64 {
    comparison
        .judged
        .iter()
        .find(|judged| judged.rival == Some(rival))
        .unwrap()
        .mean()
}

#[test]
fn training_is_the_same_on_one_thread_and_on_three() {
    let samples = arm(90, 1.0, 0.2e-3, 3);
    for start in [
        TrainingStart::Random,
        TrainingStart::Swarm(Algorithm::Bas),
        TrainingStart::Swarm(Algorithm::Bso),
        TrainingStart::Swarm(Algorithm::Abc),
    ] {
        let on = |jobs| {
            train(
                &samples,
                &Recipe {
                    jobs,
                    start,
                    ..recipe(6)
                },
                &mut |_| {},
            )
        };
        assert_eq!(on(1), on(3), "{start:?}");
    }
    let tool = sr210d();
    let judged = |jobs| {
        let contest = contest(
            Some(&tool),
            &ALL,
            &Recipe {
                jobs,
                ..cheap(40, 4)
            },
            3,
        );
        let comparison = compare(&samples, &contest, &|_, _| {});
        let learnt: Vec<_> = comparison
            .judged
            .iter()
            .map(|judged| learn(&samples, &contest, judged, &mut |_| {}))
            .collect();
        (comparison, learnt)
    };
    assert_eq!(judged(1), judged(3));
}

#[test]
fn joint_curves_find_waves_that_no_other_rival_can_see() {
    let tool = sr210d();
    let (training, unseen) = (waves(300, &tool, 20e-6, 1), waves(300, &tool, 20e-6, 2));
    let contest = contest(Some(&tool), &ALL, &cheap(60, 4), 4);
    let comparison = compare(&training, &contest, &|_, _| {});
    let before = mean_error(&unseen, None);
    let best = &comparison.judged[comparison.chosen];
    assert_eq!(best.rival, Some(Rival::Curves));
    assert!(
        ALL.iter()
            .all(|rival| *rival == Rival::Curves || error(&comparison, *rival) > 1.2 * best.mean())
    );
    let (correction, _) = learn(&training, &contest, best, &mut |_| {}).unwrap();
    let after = mean_error(&unseen, Some(&correction));
    // Noise alone is 1.596 * 20 um.
    assert!(
        after > 30e-6 && after < 45e-6 && after < 0.3 * before,
        "{before} {after}"
    );
    // What is stated of it is what is left.
    let spread = correction.at(&unseen.sources[0]).spread.unwrap();
    assert!((15e-6..35e-6).contains(&spread), "{spread}");
}

/// 40 deg of joint 1 that no row visited: what was learnt there is as small as beside it, and known to be in doubt.
#[test]
fn a_joint_curve_does_not_swing_where_no_row_was_and_says_its_doubt() {
    let tool = sr210d();
    let in_gap = |q: &[f64]| q[0].abs() < 0.35;
    let (all, unseen) = (waves(900, &tool, 20e-6, 3), waves(600, &tool, 20e-6, 4));
    let visited: Vec<usize> = (0..all.rows())
        .filter(|row| !in_gap(&all.sources[*row]))
        .collect();
    let training = all.pick(&visited);
    let contest = contest(Some(&tool), &[Rival::Curves], &recipe(6), 4);
    let comparison = compare(&training, &contest, &|_, _| {});
    let (correction, _) = learn(
        &training,
        &contest,
        &comparison.judged[comparison.chosen],
        &mut |_| {},
    )
    .unwrap();
    let (mut largest, mut spread, mut covered, mut rows) =
        ([0.0f64; 2], [0.0; 2], [0.0; 2], [0.0; 2]);
    for (q, residual) in unseen.sources.iter().zip(&unseen.residual) {
        let (applied, at) = (correction.at(q), usize::from(in_gap(q)));
        let Some(doubt) = applied.spread else {
            continue;
        };
        let left = std::array::from_fn(|k| residual[k] - applied.delta[k]);
        largest[at] = largest[at].max(length(applied.delta));
        spread[at] += doubt;
        // Three axes of one sigma: 2.8 of them hold 95 %.
        covered[at] += f64::from(u8::from(length(left) < 2.8 * doubt));
        rows[at] += 1.0;
    }
    let mean = |sums: [f64; 2]| [sums[0] / rows[0], sums[1] / rows[1]];
    let (spread, covered) = (mean(spread), mean(covered));
    assert!(rows[0] > 200.0 && rows[1] > 50.0, "{rows:?}");
    assert!(largest[1] < 1.2 * largest[0], "{largest:?}");
    assert!(spread[1] > spread[0], "{spread:?}");
    assert!(covered[0] > 0.9 && covered[1] > 0.85, "{covered:?}");
}

/// The paper's Fig. 2: errors that are made in the joints are learnt from fewer numbers where the Jacobian is known.
#[test]
fn a_network_of_joint_motions_learns_what_joints_do_better_than_one_of_displacements() {
    let tool = sr210d();
    let slow = |rows: usize, seed: u64| {
        let mut samples = waves(rows, &tool, 20e-6, seed);
        for (q, r) in samples.sources.iter().zip(&mut samples.residual) {
            let stance = tool.stance(q);
            let moved = stance.turn(1) * (0.4e-3 * (q[1] + q[2]).cos())
                + stance.turn(4) * (1e-3 * q[4].sin() * q[3].cos());
            *r = std::array::from_fn(|k| r[k] + moved[k]);
        }
        samples
    };
    let (training, unseen) = (slow(200, 11), slow(300, 12));
    let left = |through: Option<ScrewArm>| {
        let (correction, _) = train(
            &training,
            &Recipe {
                through,
                ..cheap(100, 4)
            },
            &mut |_| {},
        );
        mean_error(&unseen, Some(&correction)) / mean_error(&unseen, None)
    };
    let (point, joints) = (left(None), left(Some(tool.clone())));
    assert!(joints < 0.8 * point && joints > 0.02, "{joints} {point}");
}

#[test]
fn the_judge_keeps_what_helps_and_refuses_what_was_learnt_from_noise() {
    let tool = sr210d();
    let smooth = compare(
        &arm(150, 1.0, 0.2e-3, 4),
        &contest(Some(&tool), &ALL, &cheap(60, 2), 5),
        &|_, _| {},
    );
    let best = &smooth.judged[smooth.chosen];
    assert!(
        best.helps() && best.mean() < 0.8 * smooth.judged[0].mean(),
        "{smooth:?}"
    );
    let refused = (0..20).filter(|seed| {
        let recipe = Recipe {
            seed: *seed,
            ..cheap(60, 2)
        };
        let rivals = [
            Rival::Ridge,
            Rival::Process,
            Rival::Network(TrainingStart::Random),
        ];
        compare(
            &arm(120, 0.0, 0.5e-3, 200 + seed),
            &contest(None, &rivals, &recipe, 4),
            &|_, _| {},
        )
        .chosen
            == 0
    });
    let refused = refused.count();
    assert!(
        refused >= 18,
        "useless corrections pass: {refused} of 20 refused"
    );
}

/// A recording that goes through its poses once for each of three targets: what each pose adds is the same for all of them.
#[test]
fn targets_of_one_pose_do_not_vouch_for_each_other() {
    let once = arm(60, 0.0, 0.5e-3, 77);
    let mut rng = ChaCha8Rng::seed_from_u64(78);
    let mut thrice = TrainingSamples::default();
    for _target in 0..3 {
        thrice.sources.extend(once.sources.iter().cloned());
        thrice.residual.extend(
            once.residual
                .iter()
                .map(|r| r.map(|value| value + 0.02e-3 * normal(&mut rng))),
        );
    }
    assert_eq!(
        thrice.poses(),
        (0..180).map(|row| row % 60).collect::<Vec<_>>()
    );
    let comparison = compare(
        &thrice,
        &contest(None, &[Rival::Ridge, Rival::Process], &cheap(60, 2), 5),
        &|_, _| {},
    );
    assert_eq!(comparison.chosen, 0, "nothing carries over to another pose");
    // Of rows that share a pose with trained ones a Gaussian process leaves next to nothing.
    assert!(error(&comparison, Rival::Process) > 0.8 * comparison.judged[0].mean());
}

#[test]
fn outside_the_range_it_saw_the_correction_fades_to_nothing() {
    let (correction, _) = train(&arm(120, 1.0, 0.1e-3, 5), &recipe(6), &mut |_| {});
    let mut q = vec![0.1; 6];
    let range = correction.region.ranges[1];
    q[1] = range.upper;
    let edge = correction.at(&q);
    assert!(edge.share == 1.0 && edge.spread.is_some());
    let margin = range.margin;
    assert!((margin - 0.1 * (range.upper - range.lower)).abs() < 1e-15);
    let mut last = edge;
    for step in 1..=20 {
        q[1] = range.upper + margin * f64::from(step) / 20.0;
        let now = correction.at(&q);
        assert!(
            now.share < last.share && length(now.delta) <= length(last.delta),
            "step {step}"
        );
        // No jump: the smoothstep falls by at most 1.5/20 a step.
        assert!(last.share - now.share < 0.08);
        last = now;
    }
    assert_eq!((last.share, last.delta, last.spread), (0.0, [0.0; 3], None));
    // Every joint within its range, but all at once at their ends: no such posture was seen.
    let corner: Vec<f64> = correction
        .region
        .ranges
        .iter()
        .map(|range| range.upper)
        .collect();
    assert!(correction.region.jointly.is_some() && correction.at(&corner).share < 1.0);
    q[1] = f64::NAN;
    assert_eq!(correction.at(&q).share, 0.0);
    assert_eq!(correction.at(&q[..3]).share, 0.0);
}

/// A correction read from its table, and the table.
fn back(correction: &Correction, prismatic: &[bool]) -> (Correction, Network) {
    let table = Network::of(correction, prismatic);
    let read = Network::from_frame(&table.to_frame().unwrap()).unwrap();
    (read.correction(prismatic).unwrap().unwrap(), table)
}

/// mm and m differ in the last bit only.
fn alike(there: &Correction, here: &Correction, q: &[f64]) {
    let (there, here) = (there.at(q), here.at(q));
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-12;
    assert!(
        (0..3).all(|k| near(there.delta[k], here.delta[k])) && near(there.share, here.share),
        "{there:?} {here:?}"
    );
    let [there, here] = [there, here].map(|applied| applied.spread);
    assert_eq!(there.is_some(), here.is_some());
    assert!(near(there.unwrap_or_default(), here.unwrap_or_default()));
}

#[test]
fn a_correction_comes_back_from_its_table() {
    let prismatic = [true, false, false];
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let features = features(&prismatic, true, true);
    let shape = LayerSizes {
        inputs: features.len(),
        hidden: 4,
        outputs: 3,
        activation: Activation::Tanh,
    };
    let mut number = |from: f64, to: f64| rng.random_range(from..to);
    let mut scaling = || Scaling {
        mean: number(-1.0, 1.0),
        scale: number(0.1, 2.0),
    };
    let dress = NetworkScaling {
        inputs: features.iter().map(|_| scaling()).collect(),
        outputs: [scaling(), scaling(), scaling()],
        features,
    };
    assert_eq!(dress.features.len(), 6);
    let members = (0..3)
        .map(|_| (0..shape.parameters()).map(|_| number(-3.0, 3.0)).collect())
        .collect();
    let sources: Vec<Vec<f64>> = (0..40)
        .map(|_| (0..4).map(|_| number(-1.5, 1.5)).collect())
        .collect();
    let region = Region::of(&sources, 3);
    let correction = Correction {
        body: Body::Networks(
            dress,
            Networks {
                shape,
                joints: None,
                members,
            },
        ),
        region,
        left: 1e-4,
    };
    let (read, mut table) = back(&correction, &prismatic);
    // Lengths are stored in mm, their factors per mm.
    let stored = |part: &str, place: [i64; 3]| {
        let mut rows = table.0.iter().filter(|row| row.member == 0);
        let found = rows.find(|row| row.part == part && [row.layer, row.to, row.from] == place);
        found.unwrap().value
    };
    let valid = correction.region.ranges[0].upper;
    let factor = &correction.region.jointly.as_ref().unwrap().factor[1];
    let Body::Networks(scaling, _) = &correction.body else {
        unreachable!()
    };
    let (input, output) = (scaling.inputs[0].scale, scaling.outputs[2].mean);
    for (part, place, value) in [
        ("left", [0, 0, 0], 0.1),
        ("valid_upper", [0, 1, 0], valid * 1e3),
        ("joint_factor", [0, 2, 1], factor[0] / 1e3),
        ("joint_factor", [0, 2, 2], factor[1]),
        ("input_scale", [0, 1, 0], input * 1e3),
        ("output_mean", [0, 3, 0], output * 1e3),
    ] {
        assert_eq!(stored(part, place), value, "{part}");
    }
    for _ in 0..100 {
        let q: Vec<f64> = (0..4).map(|_| number(-2.5, 2.5)).collect();
        alike(&correction, &read, &q);
    }
    let empty = Network::from_frame(&Network(Vec::new()).to_frame().unwrap()).unwrap();
    assert!(empty.correction(&prismatic).unwrap().is_none());
    let hole = (2, "bias", 1, 3);
    table
        .0
        .retain(|row| (row.member, &*row.part, row.layer, row.to) != hole);
    let message = table.correction(&prismatic).unwrap_err().to_string();
    has(&message, "bias");
}

#[test]
fn every_kind_of_correction_comes_back_from_its_table() {
    let tool = sr210d();
    let samples = waves(120, &tool, 50e-6, 7);
    let contest = contest(Some(&tool), &ALL, &cheap(20, 4), 2);
    let comparison = compare(&samples, &contest, &|_, _| {});
    for judged in &comparison.judged[1..] {
        let (correction, _) = learn(&samples, &contest, judged, &mut |_| {}).unwrap();
        let (read, mut twice) = back(&correction, &[false; 6]);
        for q in &samples.sources {
            alike(&correction, &read, q);
        }
        twice.0.push(twice.0[0].clone());
        let message = twice.correction(&[false; 6]).unwrap_err().to_string();
        has(&message, "twice");
    }
}
