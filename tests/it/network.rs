//! The perceptron, its gradient, its training, its valid range and the judge of whether it helps.

use crate::answer::has;
use calib::estimate::network::correction::{Body, NetworkScaling, Scaling, features};
use calib::estimate::network::perceptron::Loss;
use calib::estimate::network::region::Region;
use calib::estimate::network::rivals::{RivalComparison, RivalContest, learn};
use calib::estimate::network::{
    Activation, Correction, LayerSizes, Recipe, Rival, TrainingSamples, TrainingStart, compare,
    train,
};
use calib::table::{Network, Table};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

fn recipe(joints: usize) -> Recipe {
    Recipe {
        joints,
        features: features(&vec![false; joints], false, false),
        hidden: 12,
        activation: Activation::Sigmoid,
        start: TrainingStart::Swarm,
        beetles: 20,
        generations: 30,
        iterations: 200,
        decay: 1.0,
        keep_back: 0.1,
        seed: 7,
        jobs: 2,
    }
}

/// Training that takes a moment.
fn cheap(iterations: usize) -> Recipe {
    Recipe {
        generations: 5,
        iterations,
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

#[test]
fn the_gradient_is_that_of_central_differences() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for activation in [Activation::Sigmoid, Activation::Tanh] {
        let x: Vec<Vec<f64>> = (0..150)
            .map(|_| (0..7).map(|_| rng.random_range(-2.0..2.0)).collect())
            .collect();
        let y: Vec<[f64; 3]> = (0..150)
            .map(|_| std::array::from_fn(|_| rng.random_range(-2.0..2.0)))
            .collect();
        let shape = LayerSizes {
            inputs: 7,
            hidden: 5,
            activation,
        };
        let loss = Loss {
            shape,
            x: &x,
            y: &y,
            decay: 0.7,
        };
        let mut w: Vec<f64> = (0..shape.parameters())
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        let mut gradient = vec![0.0; w.len()];
        let (value, squares) = loss.gradient(&w, &mut gradient);
        assert_eq!(squares, loss.mean_squares(&w));
        assert!((value - loss.value(&w)).abs() < 1e-14);
        for i in 0..w.len() {
            let step = 1e-5;
            let at = w[i];
            w[i] = at + step;
            let up = loss.value(&w);
            w[i] = at - step;
            let down = loss.value(&w);
            w[i] = at;
            let difference = (up - down) / (2.0 * step);
            assert!(
                (difference - gradient[i]).abs() < 1e-9,
                "{activation:?} {i}: {difference} {}",
                gradient[i]
            );
        }
    }
}

/// Eqs. 41 and 42 of Wang et al. (2020) by hand: one input, one neuron.
#[test]
fn a_network_is_the_papers_formula() {
    let shape = LayerSizes {
        inputs: 1,
        hidden: 1,
        activation: Activation::Sigmoid,
    };
    // sigmoid(0.5 * ln(3) * 2) = 3/4.
    let outputs = shape.at(
        &[2.0, 0.0, 4.0, 8.0, -4.0, 1.0, 0.0, 0.5],
        &[0.5 * 3f64.ln()],
    );
    for (output, expected) in outputs.into_iter().zip([4.0, 6.0, -2.5]) {
        assert!((output - expected).abs() < 1e-14, "{outputs:?}");
    }
}

fn contest(rivals: &[Rival], cheap: &Recipe, folds: usize) -> RivalContest<'static> {
    RivalContest {
        rivals: rivals.to_vec(),
        prismatic: &[false; 6],
        recipe: cheap.clone(),
        trial: cheap.clone(),
        decays: vec![0.5, 5.0],
        folds,
    }
}

const ALL: [Rival; 4] = [
    Rival::Ridge,
    Rival::Process,
    Rival::Network(TrainingStart::Random),
    Rival::Network(TrainingStart::Swarm),
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
    for start in [TrainingStart::Random, TrainingStart::Swarm] {
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
    let judged = |jobs| {
        let recipe = Recipe { jobs, ..cheap(40) };
        let contest = contest(&ALL, &recipe, 3);
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
fn the_judge_keeps_what_helps_and_refuses_what_was_learnt_from_noise() {
    let smooth = compare(
        &arm(150, 1.0, 0.2e-3, 4),
        &contest(&ALL, &cheap(60), 5),
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
            ..cheap(60)
        };
        let rivals = [
            Rival::Ridge,
            Rival::Process,
            Rival::Network(TrainingStart::Random),
        ];
        compare(
            &arm(120, 0.0, 0.5e-3, 200 + seed),
            &contest(&rivals, &recipe, 4),
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
        &contest(&[Rival::Ridge, Rival::Process], &cheap(60), 5),
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
    let parameters = (0..shape.parameters()).map(|_| number(-3.0, 3.0)).collect();
    let sources: Vec<Vec<f64>> = (0..40)
        .map(|_| (0..4).map(|_| number(-1.5, 1.5)).collect())
        .collect();
    let region = Region::of(&sources, 3);
    let correction = Correction {
        body: Body::Network(dress, shape, parameters),
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
    let Body::Network(scaling, ..) = &correction.body else {
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
    let hole = (1, "bias", 1, 3);
    table
        .0
        .retain(|row| (row.member, &*row.part, row.layer, row.to) != hole);
    let message = table.correction(&prismatic).unwrap_err().to_string();
    has(&message, "bias");
}

#[test]
fn every_kind_of_correction_comes_back_from_its_table() {
    let samples = arm(120, 1.0, 50e-6, 7);
    let contest = contest(&ALL, &cheap(20), 2);
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
