//! Mistakes of a recording are found, named and set aside; heavy tails, missing physics and clean recordings are left alone.

use crate::fixture::{self, rms};
use crate::identify::model;
use calib::description::RobotDescription;
use calib::estimate::{Model, Screening, SuspectKind, align, fit_screened};
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::spatial::{Pose, Twist};
use nalgebra::Vector3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use std::collections::BTreeMap;

const SIGMA: f64 = 1e-5;
const EFFECTS: [&str; 5] = [
    "base_frame",
    "tool_offset",
    "joint_offset",
    "link_geometry",
    "reduction_ratio",
];

fn normal(dice: &mut ChaCha8Rng) -> f64 {
    let (radius, angle): (f64, f64) = (dice.random(), dice.random());
    (-2.0 * (1.0 - radius).ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}

fn student_3(dice: &mut ChaCha8Rng) -> f64 {
    let chi2: f64 = (0..3).map(|_| normal(dice).powi(2)).sum();
    normal(dice) / (chi2 / 3.0).sqrt()
}

fn direction(dice: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(dice)).normalize()
}

/// A robot with errors everywhere, measured with noise; every fourth row is held out.
struct Trial {
    description: RobotDescription,
    data: Measurements,
    truth: Model,
    dice: ChaCha8Rng,
}

impl Trial {
    fn new(
        description: RobotDescription,
        rows: usize,
        seed: u64,
        noise: fn(&mut ChaCha8Rng) -> f64,
    ) -> Self {
        let mut dice = ChaCha8Rng::seed_from_u64(seed);
        let robot = RobotModel::new(description.clone());
        let mut truth = model(
            &robot,
            Pose::exp(&Twist::new(3.0, -1.5, 0.4, 0.05, -0.1, 2.2)),
            &EFFECTS,
        );
        for (k, spec) in truth.stack.specs().to_vec().iter().enumerate() {
            let size = if spec.name.starts_with("base_frame") {
                0.0
            } else {
                4e-4
            };
            truth.x[k] = size * normal(&mut dice);
        }
        let mut data = Measurements {
            joints: robot.joints(),
            q: fixture::poses(&description, rows),
            points: PointReadings::new(vec![Vector3::zeros(); rows], SIGMA),
            payload: vec![0.0; rows],
            ..Measurements::default()
        };
        data.points.position = truth.predict(&data);
        for point in &mut data.points.position {
            *point += Vector3::from_fn(|_, _| SIGMA * noise(&mut dice));
        }
        Self {
            description,
            data,
            truth,
            dice,
        }
    }

    fn rows(&self) -> usize {
        self.data.rows()
    }

    fn fit_rows(&self) -> Vec<usize> {
        (0..self.rows()).filter(|row| row % 4 != 3).collect()
    }

    fn start(&self) -> Model {
        let robot = RobotModel::new(self.description.clone());
        let base = align(&robot, &self.data, &self.fit_rows());
        model(&robot, base, &EFFECTS)
    }

    fn screen(&self) -> (Model, Screening) {
        let set = |row| usize::from(row % 4 == 3);
        self.fit(Some(&(0..self.rows()).map(set).collect::<Vec<_>>()))
    }

    /// With rows screened by their sets, or all kept.
    fn fit(&self, set: Option<&[usize]>) -> (Model, Screening) {
        let (start, rows) = (self.start(), self.fit_rows());
        let all: Vec<usize> = (0..start.x.len()).collect();
        let (model, _, screening) = fit_screened(&start, &self.data, &rows, &all, set);
        (model, screening)
    }

    fn aside(&self) -> Vec<usize> {
        self.screen().1.set_aside().collect()
    }

    /// Root mean square distance (m) of the model's points from the true ones.
    fn off(&self, model: &Model) -> f64 {
        let pairs = model.predict(&self.data).into_iter();
        rms(pairs
            .zip(self.truth.predict(&self.data))
            .map(|(a, b)| (a - b).norm()))
    }

    /// `count` different rows.
    fn draw(&mut self, count: usize) -> Vec<usize> {
        let mut rows: Vec<usize> = (0..self.rows()).collect();
        for k in 0..count {
            let other = self.dice.random_range(k..rows.len());
            rows.swap(k, other);
        }
        rows.truncate(count);
        rows
    }
}

/// Rows that were spoilt, with the name of what was done.
type Spoilt = BTreeMap<usize, &'static str>;

fn outliers(trial: &mut Trial, share: f64) -> Spoilt {
    let rows = trial.draw((share * trial.rows() as f64).round() as usize);
    let mut plain = Spoilt::new();
    for &row in &rows {
        let size = 0.3e-3 * (500.0f64 / 0.3).powf(trial.dice.random::<f64>());
        trial.data.points.position[row] += size * direction(&mut trial.dice);
        // Held-out rows without a repeat are set aside only where no arm can be so far off.
        if row % 4 != 3 || size > 20e-3 {
            plain.insert(row, "outlier");
        }
    }
    plain
}

fn exchanges(trial: &mut Trial, pairs: usize) -> Spoilt {
    let rows = trial.draw(2 * pairs);
    for pair in rows.chunks(2) {
        trial.data.points.position.swap(pair[0], pair[1]);
    }
    rows.into_iter().map(|row| (row, "exchanged")).collect()
}

fn zeros(trial: &mut Trial) -> Spoilt {
    let rows = trial.draw(5);
    for &row in &rows {
        trial.data.points.position[row] = Vector3::zeros();
    }
    rows.into_iter().map(|row| (row, "zero")).collect()
}

fn slips(trial: &mut Trial) -> Spoilt {
    let rows = trial.draw(4);
    for (&row, factor) in rows.iter().zip([1000.0, 1e-3, 25.4, 1.0 / 25.4]) {
        trial.data.points.position[row] *= factor;
    }
    rows.into_iter().map(|row| (row, "unit_slip")).collect()
}

/// Thirty consecutive rows in metres.
fn slipped_block(trial: &mut Trial) -> Spoilt {
    let first = trial.dice.random_range(0..trial.rows() - 30);
    for row in first..first + 30 {
        trial.data.points.position[row] *= 1e-3;
    }
    (first..first + 30).map(|row| (row, "unit_slip")).collect()
}

/// Points of twenty rows moved up by one; the last takes the first's.
fn shifted_block(trial: &mut Trial) -> Spoilt {
    let first = trial.dice.random_range(0..trial.rows() - 20);
    trial.data.points.position[first..first + 20].rotate_left(1);
    (first..first + 20)
        .map(|row| (row, "shifted_block"))
        .collect()
}

/// Three points that changed names in a circle.
fn circle(trial: &mut Trial) -> Spoilt {
    let rows = trial.draw(3);
    trial.data.points.position.swap(rows[0], rows[1]);
    trial.data.points.position.swap(rows[1], rows[2]);
    rows.into_iter().map(|row| (row, "mislabelled")).collect()
}

fn name(kind: SuspectKind) -> &'static str {
    match kind {
        SuspectKind::Exchanged => "exchanged",
        SuspectKind::Mislabelled => "mislabelled",
        SuspectKind::ShiftedBlock(_) => "shifted_block",
        SuspectKind::UnitSlip(_) => "unit_slip",
        SuspectKind::Zero => "zero",
        SuspectKind::Outlier => "outlier",
        SuspectKind::Event => "event",
    }
}

#[derive(Default)]
struct Score {
    spoilt: f64,
    flagged: f64,
    named: f64,
    with_faults: f64,
    clean: f64,
}

impl Score {
    fn add(
        &mut self,
        description: RobotDescription,
        rows: usize,
        seed: u64,
        spoil: &dyn Fn(&mut Trial) -> Spoilt,
    ) {
        let mut trial = Trial::new(description, rows, seed, normal);
        self.clean += trial.off(&trial.fit(None).0).powi(2);
        let spoilt = spoil(&mut trial);
        let (model, screening) = trial.screen();
        self.with_faults += trial.off(&model).powi(2);
        self.spoilt += spoilt.len() as f64;
        self.flagged += screening.suspects.len() as f64;
        for suspect in &screening.suspects {
            let right = spoilt.get(&suspect.row) == Some(&name(suspect.kind));
            self.named += f64::from(right);
            if !right {
                println!(
                    "seed {seed}: {suspect:?}, in truth {:?}",
                    spoilt.get(&suspect.row)
                );
            }
        }
        for (row, kind) in &spoilt {
            if !screening.suspects.iter().any(|suspect| suspect.row == *row) {
                println!("seed {seed}: {kind} in row {row} was missed");
            }
        }
    }

    fn precision(&self) -> f64 {
        self.named / self.flagged.max(1.0)
    }
    fn recall(&self) -> f64 {
        self.named / self.spoilt
    }
    /// Error of the model against the truth, with the faults over without.
    fn harm(&self) -> f64 {
        (self.with_faults / self.clean).sqrt()
    }
}

#[test]
fn mistakes_are_found_and_named_and_the_fit_is_as_good_as_without_them() {
    type Spoil = Box<dyn Fn(&mut Trial) -> Spoilt>;
    let mut suite: Vec<(String, Spoil)> = Vec::new();
    let mut add = |what: String, spoil: Spoil| suite.push((what, spoil));
    for share in [0.01, 0.05, 0.1] {
        let spoil = move |trial: &mut Trial| outliers(trial, share);
        add(format!("{} % outliers", 100.0 * share), Box::new(spoil));
    }
    for pairs in 1..=5 {
        let spoil = move |trial: &mut Trial| exchanges(trial, pairs);
        add(format!("{pairs} exchanged pairs"), Box::new(spoil));
    }
    add("zeros".into(), Box::new(zeros));
    add("unit slips".into(), Box::new(slips));
    add("a block in metres".into(), Box::new(slipped_block));
    add("a shifted block".into(), Box::new(shifted_block));
    add("a circle of labels".into(), Box::new(circle));
    let mut all = Score::default();
    let mut worst: f64 = 0.0;
    for (k, (what, spoil)) in suite.iter().enumerate() {
        let mut score = Score::default();
        for (robot, description) in fixture::all().into_iter().enumerate() {
            score.add(
                description,
                160 + 20 * robot,
                100 * k as u64 + robot as u64,
                spoil,
            );
        }
        let (precision, recall, harm) = (score.precision(), score.recall(), score.harm());
        println!(
            "{what}: precision {precision:.3}, recall {recall:.3}, error {harm:.2} of the clean fit's"
        );
        worst = worst.max(score.harm());
        all.spoilt += score.spoilt;
        all.flagged += score.flagged;
        all.named += score.named;
    }
    assert!(worst < 1.2, "error {worst:.2} of the clean fit's");
    assert!(all.precision() >= 0.98, "precision {:.4}", all.precision());
    assert!(all.recall() >= 0.98, "recall {:.4}", all.recall());
}

#[test]
fn a_held_out_row_is_set_aside_only_by_evidence_beside_the_model() {
    let off = Vector3::new(0.0, 3e-3, 0.0);
    let trial = || Trial::new(fixture::all().remove(0), 160, 4411, normal);
    let mut held_out = trial();
    held_out.data.points.position[43] += off;
    let screening = held_out.screen().1;
    assert_eq!(
        (screening.suspects.len(), screening.crowd),
        (0, 1),
        "3 mm off where the model is the only witness"
    );
    let mut fitted = trial();
    fitted.data.points.position[42] += off;
    assert_eq!(fitted.aside(), [42]);
    // The same pose again, measured where the model predicts it.
    let mut again = trial();
    let joints = again.data.joints;
    again
        .data
        .q
        .copy_within(43 * joints..44 * joints, 51 * joints);
    again.data.points.position[51] = again.data.points.position[43] + Vector3::repeat(1e-6);
    again.data.points.position[43] += off;
    assert_eq!(again.aside(), [43]);
}

#[test]
fn clean_recordings_keep_their_rows_also_with_heavy_tails() {
    for (what, noise) in [
        ("normal", normal as fn(&mut ChaCha8Rng) -> f64),
        ("Student's t, 3", student_3),
    ] {
        let (mut rows, mut flagged) = (0, 0);
        for seed in 0..10 {
            for (robot, description) in fixture::all().into_iter().enumerate() {
                let trial = Trial::new(description, 200, 5000 + 10 * seed + robot as u64, noise);
                let (_, screening) = trial.screen();
                rows += trial.rows();
                flagged += screening.suspects.len();
            }
        }
        println!("{what}: {flagged} of {rows} clean rows flagged");
        assert!(
            1000 * flagged <= rows,
            "{what}: {flagged} of {rows} clean rows flagged"
        );
    }
}

/// From row `from` on, the joints of a row are those of the row `slip` before it.
fn slip_log(trial: &mut Trial, from: usize, slip: usize) {
    let joints = trial.data.joints;
    let whole = trial.data.q.clone();
    for row in from.max(slip)..trial.rows() {
        trial.data.q[row * joints..(row + 1) * joints]
            .copy_from_slice(&whole[(row - slip) * joints..(row - slip + 1) * joints]);
    }
}

#[test]
fn a_joint_log_that_slips_in_the_middle_is_told_by_its_rows_and_the_rest_is_fitted() {
    for (seed, description) in fixture::all().into_iter().enumerate() {
        let mut trial = Trial::new(description, 300, 40 + seed as u64, normal);
        let whole = trial.data.clone();
        slip_log(&mut trial, 180, 30);
        let (model, screening) = trial.screen();
        assert_eq!(screening.apart, None, "arm {seed}");
        let shifted = screening
            .suspects
            .iter()
            .filter(|suspect| suspect.kind == SuspectKind::ShiftedBlock(30));
        // The last 30 points have lost their joints.
        let shifted = shifted.filter(|suspect| suspect.row >= 180).count();
        assert!(shifted >= 118, "arm {seed}: {shifted} of 120");
        let kept: Vec<usize> = screening
            .kept
            .iter()
            .copied()
            .filter(|row| *row >= 180)
            .collect();
        assert!(kept.is_empty(), "arm {seed}: {kept:?}");
        trial.data = whole;
        assert!(
            trial.off(&model) < 2.0 * SIGMA,
            "arm {seed}: {}",
            trial.off(&model)
        );
    }
}

#[test]
fn a_slip_is_told_in_a_robot_that_has_more_errors_than_its_model() {
    for (seed, description) in fixture::all().into_iter().enumerate() {
        let mut trial = Trial::new(description, 2000, 60 + seed as u64, normal);
        // Two waves of a joint that no effect in this model follows, far above the noise.
        for row in 0..trial.rows() {
            let angle = 2.0 * trial.data.q[row * trial.data.joints];
            trial.data.points.position[row] +=
                40.0 * SIGMA * Vector3::new(angle.cos(), angle.sin(), (3.0 * angle).sin());
        }
        slip_log(&mut trial, 1203, 30);
        let screening = trial.screen().1;
        let shifted = screening
            .suspects
            .iter()
            .filter(|suspect| suspect.kind == SuspectKind::ShiftedBlock(30));
        assert_eq!(
            shifted.map(|suspect| suspect.row).collect::<Vec<_>>(),
            (1203..2000).collect::<Vec<_>>(),
            "arm {seed}"
        );
        assert!(
            screening
                .suspects
                .iter()
                .all(|suspect| suspect.partner.is_none_or(|row| row < 2000)),
            "arm {seed}"
        );
        assert!(screening.kept.iter().all(|row| *row < 1203), "arm {seed}");
    }
}

#[test]
fn a_joint_log_that_slipped_throughout_is_told_by_how_many_rows() {
    for (seed, description) in fixture::all().into_iter().enumerate() {
        let mut trial = Trial::new(description, 200, 50 + seed as u64, normal);
        assert_eq!(trial.screen().1.apart, None, "arm {seed}");
        slip_log(&mut trial, 0, 7);
        assert_eq!(trial.screen().1.apart, Some(7), "arm {seed}");
    }
}

/// A grid of two joints whose lines are straight for the first of them: a step along a line is a turn about its axis, which a base of one's
/// own follows as if two logs had slipped by a row, where a row with wrong joints falls out at the end of a stretch.
#[test]
fn rows_beside_a_wrong_one_in_a_dense_grid_are_not_apart() {
    for (seed, description) in [fixture::spherical(), fixture::offset_wrist()]
        .into_iter()
        .enumerate()
    {
        let mut trial = Trial::new(description, 600, 80 + seed as u64, normal);
        let joints = trial.data.joints;
        // All other joints follow the line: each line is one stiff arm that turns about its foot.
        let wrist: Vec<f64> = trial.data.q.clone();
        for row in 0..trial.rows() {
            let (line, along) = (row / 30, row % 30);
            for joint in 1..joints {
                trial.data.q[row * joints + joint] = wrist[line * joints + joint];
            }
            trial.data.q[row * joints] = 0.026 * along as f64 - 0.4;
        }
        trial.data.points.position = trial.truth.predict(&trial.data);
        for point in &mut trial.data.points.position {
            *point += Vector3::from_fn(|_, _| SIGMA * normal(&mut trial.dice));
        }
        let wrong = [67, 215, 341, 460];
        for row in wrong {
            trial.data.q[row * joints + 1] += 0.1;
        }
        assert_eq!(trial.aside(), wrong, "arm {seed}");
    }
}
