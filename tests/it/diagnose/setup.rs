//! Set-up errors come before physics: twenty wrong set-ups of three arms, sound recordings, and a robot file of another arm.

use super::{CASE, case_with, concealed, diagnosis, rewritten};
use crate::answer::{self, has, read, starts_with};
use crate::fixture;
use crate::recorded::{Recorded, made, settings};
use calib::description::RobotDescription;
use calib::error::Error;
use calib::estimate::align;
use calib::robot::RobotModel;
use calib::stage::{Simulate, SimulateReads};
use calib::table::{FindingRow, Findings, Recording, Robot};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, PI};

/// A small 6R arm with a lateral shoulder, an elbow beside it and a spherical wrist.
fn shouldered() -> RobotDescription {
    let mut out = fixture::spherical();
    let points = [
        [0.0; 3],
        [50.0, 0.0, 0.0],
        [50.0, 50.0, 425.0],
        [50.0, 50.0, 425.0],
        [50.0, 50.0, 850.0],
        [50.0, 50.0, 850.0],
    ];
    let axes = [
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    for ((joint, point), axis) in out.joints.iter_mut().zip(points).zip(axes) {
        (joint.point, joint.axis) = (point.map(|value| value * 1e-3), axis);
        (joint.mass, joint.centre) = (joint.mass.map(|mass| 0.05 * mass), Some(joint.point));
    }
    (out.name, out.couplings) = ("shouldered".into(), Vec::new());
    (out.tool, out.payload_mass, out.payload_centre) = ([0.11, 0.09, 1.0], 2.0, [0.05, 0.05, 1.0]);
    out
}

fn arms() -> [RobotDescription; 3] {
    [fixture::spherical(), fixture::offset_wrist(), shouldered()]
}

#[derive(Clone)]
struct Inputs {
    robot: RobotDescription,
    recording: Recording,
}

/// Seventy-two points of the twin of an arm: zeros, lengths, gears and the tool differ as they do in a real one, and `effects`.
fn recorded(robot: &RobotDescription, seed: u64, effects: Value) -> Inputs {
    let range = json!([
        [-110, 120],
        [-70, 65],
        [-60, 75],
        [-130, 140],
        [-100, 95],
        [-150, 160]
    ]);
    let twin = json!({
        "truth": {
            "offset_deg": [0.1, -0.12, 0.2, 0.08, -0.15, 0.3],
            "links": [
                {"link": 1, "shift_mm": [0.4, -0.3, 0.2]}, {"link": 2, "shift_mm": [-0.5, 0.3, 0.6], "tilt_arcsec": [60.0, 0.0, -80.0]},
                {"link": 3, "shift_mm": [0.3, 0.4, -0.2]}, {"link": 6, "shift_mm": [14.0, -9.0, 6.0]},
            ],
        },
        "effects": effects,
        "poses": {"range_deg": range, "floor_mm": -5000.0, "clearance_mm": 0.0},
        "blocks": [{"usage": "fit", "points": 48}, {"usage": "validate", "points": 24}],
        "seed": seed,
    });
    let reads = SimulateReads {
        robot: Robot::from_description(robot),
    };
    Inputs {
        robot: robot.clone(),
        recording: made(&settings::<Simulate>(twin), reads).get(),
    }
}

struct Diagnosed {
    verdict: String,
    statement: String,
    findings: Vec<FindingRow>,
    warnings: Vec<String>,
}

impl Diagnosed {
    /// The first thing that is wrong with the set-up, and no physical cause with it.
    #[track_caller]
    fn wrong(&self) -> &str {
        assert_eq!(self.verdict, "wrong_setup", "{}", self.statement);
        let is_setup = |finding: &FindingRow| finding.effect == "setup" && finding.forms == "[]";
        assert!(self.findings.iter().all(is_setup), "{}", self.statement);
        &self.findings[0].statement
    }

    /// Residual (mm) without it, as stated.
    #[track_caller]
    fn left_mm(&self) -> f64 {
        let after = self.wrong().split("without it ").nth(1);
        after
            .and_then(|text| text.split(" mm").next()?.parse().ok())
            .unwrap()
    }

    #[track_caller]
    fn warns(&self, start: &str) {
        let is_there = self.warnings.iter().any(|line| line.starts_with(start));
        assert!(is_there, "{start}: {:?}", self.warnings);
    }
}

fn diagnosed(inputs: &Inputs) -> Result<Diagnosed, Error> {
    let (robot, recording) = (Robot::from_description(&inputs.robot), &inputs.recording);
    let set = |row: usize| recording.usage[row].as_deref().unwrap_or("fit");
    let made = Recorded::dealt(robot, recording.clone(), set).diagnose_by(&settings(json!({})))?;
    let verdict = made.verdict();
    Ok(Diagnosed {
        verdict: verdict.verdict,
        statement: verdict.statement.unwrap_or_default(),
        findings: made.get::<Findings>().0,
        warnings: made.warnings.lines().map(Into::into).collect(),
    })
}

/// Sets the joints of every row anew.
fn joints(inputs: &mut Inputs, change: impl Fn(&mut [f64])) {
    inputs
        .recording
        .q
        .chunks_mut(inputs.robot.joints.len())
        .for_each(change);
}

fn points(inputs: &mut Inputs, change: impl Fn([f64; 3]) -> [f64; 3]) {
    inputs
        .recording
        .position
        .iter_mut()
        .for_each(|point| *point = change(*point));
}

/// Gives every row the point of another one.
fn paired(inputs: &mut Inputs, partner: impl Fn(usize) -> usize) {
    let all = inputs.recording.position.clone();
    inputs
        .recording
        .position
        .iter_mut()
        .enumerate()
        .for_each(|(row, point)| *point = all[partner(row)]);
}

/// What is done wrong, what the first finding is to say of it, and how it is done.
type Wrong = (&'static str, &'static str, fn(&mut Inputs));

/// The frozen cases. Positions are what `mm` and `deg` of the settings make of what stands in the files.
const WRONG: [Wrong; 20] = [
    ("points in inches", "unit: in}", |i| {
        points(i, |p| p.map(|x| x / 25.4))
    }),
    ("points in metres", "unit: m}", |i| {
        points(i, |p| p.map(|x| x / 1000.0))
    }),
    ("points in micrometres", "unit: um}", |i| {
        points(i, |p| p.map(|x| x * 1000.0))
    }),
    ("joints in rad", "unit: rad", |i| {
        joints(i, |q| q.iter_mut().for_each(|q| *q *= PI / 180.0))
    }),
    ("sign of joint 3", "joint 3 turns the other way", |i| {
        joints(i, |q| q[2] = -q[2])
    }),
    ("sign of joint 5", "joint 5 turns the other way", |i| {
        joints(i, |q| q[4] = -q[4])
    }),
    (
        "signs of joints 1, 4 and 6",
        "joints 1, 4, 6 turn the other way",
        |i| joints(i, |q| [0, 3, 5].into_iter().for_each(|k| q[k] = -q[k])),
    ),
    (
        "signs of joints 2 and 3",
        "joints 2, 3 turn the other way",
        |i| joints(i, |q| (q[1], q[2]) = (-q[1], -q[2])),
    ),
    (
        "signs of all joints",
        "joints 1, 2, 3, 4, 5, 6 turn the other way",
        |i| joints(i, |q| q.iter_mut().for_each(|q| *q = -*q)),
    ),
    (
        "zeros of joints 2 and 3 against each other",
        "90 deg at the zero of joint 2 and ",
        |i| {
            joints(i, |q| (q[1], q[2]) = (q[1] - FRAC_PI_2, q[2] + FRAC_PI_2));
        },
    ),
    (
        "points in metres and sign of joint 3",
        "joint 3 turns the other way",
        |i| {
            points(i, |p| p.map(|x| x / 1000.0));
            joints(i, |q| q[2] = -q[2]);
        },
    ),
    (
        "joints 4 and 5 exchanged",
        "joints 4 and 5 are exchanged",
        |i| joints(i, |q| q.swap(3, 4)),
    ),
    (
        "zero of joint 2 at 90 deg",
        "90 deg at the zero of joint 2",
        |i| joints(i, |q| q[1] += FRAC_PI_2),
    ),
    (
        "zero of joint 4 at 180 deg",
        "180 deg at the zero of joint 4",
        |i| joints(i, |q| q[3] += PI),
    ),
    (
        "joint 3 less joint 2",
        "joint 3 is reported minus the angle of joint 2",
        |i| joints(i, |q| q[2] -= q[1]),
    ),
    (
        "joint 3 plus joint 2",
        "joint 3 is reported plus the angle of joint 2",
        |i| joints(i, |q| q[2] += q[1]),
    ),
    ("x and y exchanged", "mirror image", |i| {
        points(i, |[x, y, z]| [y, x, z])
    }),
    ("points two rows late", "2 rows behind", |i| {
        paired(i, |row| (row + 70) % 72)
    }),
    (
        "points sorted by name as text",
        "sorted by name as text",
        |i| {
            let mut names: Vec<usize> = (1..=72).collect();
            names.sort_by_key(usize::to_string);
            paired(i, move |row| names[row] - 1)
        },
    ),
    ("a link 100 mm short", "from joint 2 to joint 3", |i| {
        // The upper arm: all behind it stands 100 mm too near.
        let [from, to] = [1, 2].map(|joint| i.robot.joints[joint].point);
        let along: [f64; 3] = std::array::from_fn(|k| to[k] - from[k]);
        let axis = (0..3)
            .max_by(|a, b| along[*a].abs().total_cmp(&along[*b].abs()))
            .unwrap();
        let by = 0.1 * along[axis].signum();
        i.robot.joints[2..]
            .iter_mut()
            .for_each(|joint| joint.point[axis] -= by);
        i.robot.tool[axis] -= by;
    }),
];

#[test]
fn twenty_wrong_set_ups_of_three_arms_are_named_before_any_physics() {
    let (mut right, mut lines) = (0, Vec::new());
    for (robot, seed) in arms().iter().zip([11, 22, 33]) {
        let sound = recorded(robot, seed, json!([]));
        for (name, text, make) in &WRONG {
            let mut inputs = sound.clone();
            make(&mut inputs);
            let diagnosis = diagnosed(&inputs);
            // Whatever is said first: nothing physical has a size, and nothing is explained.
            if let Ok(diagnosis) = &diagnosis {
                let is_setup = |finding: &FindingRow| finding.effect == "setup";
                assert_eq!(diagnosis.verdict, "wrong_setup", "{}: {name}", robot.name);
                assert!(
                    diagnosis.findings.iter().all(is_setup),
                    "{}: {name}",
                    robot.name
                );
                has(&diagnosis.warnings.join("\n"), "set-up");
                has(&diagnosis.statement, "set-up");
            }
            let first = diagnosis.as_ref().ok().and_then(|one| one.findings.first());
            assert!(first.is_none_or(|first| first.forms == "[]"));
            // What explains as well does not count.
            let said_first = first.and_then(|first| {
                let mut parts = first
                    .statement
                    .split("These data are explained equally well");
                parts.next()
            });
            let named = said_first.is_some_and(|statement| statement.contains(text));
            right += usize::from(named);
            let heard = match &diagnosis {
                Ok(_) => first.map_or("-", |first| &first.statement).to_string(),
                Err(error) => format!("code {}: {error}", error.exit_code()),
            };
            lines.push(format!(
                "{} {:14} {name:30} {heard}",
                if named { "ok   " } else { "WRONG" },
                robot.name
            ));
        }
    }
    println!("{}\n{right} of {}", lines.join("\n"), 3 * WRONG.len());
    assert!(right >= 56, "{right} of 60\n{}", lines.join("\n"));
}

#[test]
fn sound_recordings_say_nothing_of_the_set_up() {
    let [heavy, cobot, small] = arms();
    let outliers = |mut inputs: Inputs| {
        for (row, by) in [(3, 0.4), (17, 0.05), (30, 0.9), (41, 0.012)] {
            inputs.recording.position[row][row % 3] += by;
        }
        inputs
    };
    let gear =
        json!([{"gear_cyclic": {"joint": 2, "order": 3, "amplitude_arcsec": 60, "phase_deg": 30}}]);
    let wound_up = json!([{"joint_compliance": {"joint": 2, "rad_per_nm": 4e-7}}, {"joint_compliance": {"joint": 3, "rad_per_nm": 8e-7}}]);
    for (name, inputs) in [
        ("nothing, spherical wrist", recorded(&heavy, 101, json!([]))),
        ("nothing, offset wrist", recorded(&cobot, 102, json!([]))),
        ("a gear", recorded(&cobot, 103, gear)),
        ("wind-up", recorded(&heavy, 104, wound_up)),
        ("outliers", outliers(recorded(&small, 105, json!([])))),
    ] {
        let diagnosis = diagnosed(&inputs).expect(name);
        assert_ne!(
            diagnosis.verdict, "wrong_setup",
            "{name}: {}",
            diagnosis.statement
        );
        let is_setup = |finding: &FindingRow| finding.effect == "setup";
        assert!(!diagnosis.findings.iter().any(is_setup), "{name}");
        let warnings = diagnosis.warnings.join("\n");
        assert!(
            !warnings.contains("rounded") && !warnings.contains("payload"),
            "{warnings}"
        );
    }
}

#[test]
fn a_rounded_log_is_named_with_its_step_and_what_it_makes() {
    let rounded = |value: f64, step: f64| (value / step).round() * step;
    let diagnosed_with = |seed, deg: Option<f64>, metres: Option<f64>| {
        let mut inputs = recorded(&fixture::spherical(), seed, json!([]));
        if let Some(deg) = deg {
            let round = |q: &mut f64| *q = rounded(q.to_degrees(), deg).to_radians();
            joints(&mut inputs, |q| q.iter_mut().for_each(round));
        }
        if let Some(metres) = metres {
            points(&mut inputs, |p| p.map(|x| rounded(x, metres)));
        }
        diagnosed(&inputs).unwrap()
    };
    let coarse = diagnosed_with(48, Some(0.1), None);
    let start = "joint positions are rounded to 0.1 deg, which makes up to ";
    let mut lines = coarse.warnings.iter();
    let up_to = lines.find_map(|line| {
        let text = line.strip_prefix(start)?.split(" mm").next()?;
        text.parse::<f64>().ok()
    });
    // Half a step of every joint at once, at an arm of some 2.5 m: a few millimetres.
    assert!(
        up_to.is_some_and(|mm| (1.0..15.0).contains(&mm)),
        "{:?}",
        coarse.warnings
    );
    has(&coarse.statement, "rounded to 0.1 deg");
    diagnosed_with(49, None, Some(1e-3))
        .warns("measured points are rounded to 1 mm, which makes up to 0.87 mm");
    // Digits that are finer than the noise cost nothing.
    let fine = diagnosed_with(50, Some(1e-4), Some(1e-6));
    assert!(
        !fine.warnings.join("\n").contains("rounded"),
        "{:?}",
        fine.warnings
    );
}

#[test]
fn a_payload_column_that_is_never_or_seldom_filled_is_said() {
    let sound = recorded(&fixture::spherical(), 51, json!([]));
    let message_of = |filled: fn(usize) -> f64| {
        let mut inputs = sound.clone();
        inputs.recording.payload = Some((0..72).map(filled).collect());
        diagnosed(&inputs).unwrap().warnings.join("\n")
    };
    let empty = message_of(|_| f64::NAN);
    has(&empty, "the payload column is empty in all 72 rows");
    let half = message_of(|row| if row % 2 == 0 { 10.0 } else { f64::NAN });
    has(&half, "the payload column is empty in 36 of 72 rows");
    assert!(!message_of(|_| 0.0).contains("payload column"));
}

#[test]
fn two_set_up_errors_are_named_together_and_two_reflectors_hide_none() {
    let mut both = recorded(&fixture::offset_wrist(), 44, json!([]));
    joints(&mut both, |q| (q[1], q[3]) = (-q[1], -q[3]));
    let diagnosis = diagnosed(&both).unwrap();
    starts_with(diagnosis.wrong(), "joints 2, 4 turn the other way");
    has(diagnosis.wrong(), "sign: [1, -1, 1, -1, 1, 1]");
    // Two of different kinds.
    let mut both = recorded(&fixture::offset_wrist(), 44, json!([]));
    joints(&mut both, |q| (q[2], q[4]) = (-q[2], q[4] + FRAC_PI_2));
    has(
        diagnosed(&both).unwrap().wrong(),
        [
            "joint 3 turns the other way",
            "90 deg at the zero of joint 5",
        ],
    );
    let mut named = recorded(&shouldered(), 45, json!([]));
    let target = |row: usize| Some(if row.is_multiple_of(2) { "A" } else { "B" }.to_string());
    named.recording.target = Some((0..72).map(target).collect());
    joints(&mut named, |q| q[2] = -q[2]);
    starts_with(
        diagnosed(&named).unwrap().wrong(),
        "joint 3 turns the other way",
    );
}

#[test]
fn a_length_by_which_no_arm_is_made_is_an_error_of_the_robot_file() {
    let mut short = recorded(&fixture::spherical(), 46, json!([]));
    let mut shorten = |from: usize, axis: usize, by: f64| {
        let moved = short.robot.joints[from..].iter_mut();
        moved.for_each(|joint| joint.point[axis] -= by);
        short.robot.tool[axis] -= by;
        diagnosed(&short).unwrap()
    };
    starts_with(
        shorten(2, 2, 0.03).wrong(),
        "a length in the robot file from joint 2 to joint 3 is wrong",
    );
    // Two of them at once, of which no one explains the other: each is named as the identified robot has it.
    has(shorten(4, 0, 0.04).wrong(), "link_geometry.l");
}

#[test]
fn a_robot_file_in_another_unit_is_blamed_and_not_the_points() {
    let mut inputs = recorded(&fixture::offset_wrist(), 47, json!([]));
    let small = |point: [f64; 3]| point.map(|value| value * 1e-3);
    inputs.robot.joints.iter_mut().for_each(|joint| {
        (joint.point, joint.centre) = (small(joint.point), joint.centre.map(small))
    });
    inputs.robot.tool = small(inputs.robot.tool);
    let diagnosis = diagnosed(&inputs).unwrap();
    starts_with(
        diagnosis.wrong(),
        "the lengths of the robot file are in metres and were read in millimetres",
    );
    assert!(
        (0.3..3.0).contains(&diagnosis.left_mm()),
        "{}",
        diagnosis.wrong()
    );
}

#[test]
fn a_robot_file_of_another_arm_is_refused_with_what_to_look_at() {
    let mut inputs = recorded(&fixture::offset_wrist(), 7, json!([]));
    inputs.robot = fixture::spherical();
    let error = diagnosed(&inputs).err().unwrap();
    assert_eq!(error.exit_code(), 10, "{error}");
    let printed = error.to_string();
    has(&printed, ["% of its reach", "REPLACE", "robot file"]);
}

#[test]
fn points_in_inches_are_not_accepted_and_the_line_that_is_named_mends_them() {
    let folder = concealed("zero_shift", "923", "60");
    let here = folder.path();
    rewritten(here, "tracker.csv", |_, cells| {
        for cell in cells {
            if let Ok(mm) = cell.parse::<f64>() {
                *cell = (mm / 25.4).to_string();
            }
        }
    });
    case_with(here, &[]);
    let printed = answer::calib(here, &format!("run p.yaml {CASE}"))
        .code(10)
        .out;
    has(
        &printed,
        ["verdict   wrong set-up", "the points are in inches"],
    );
    assert!(
        !printed.lines().any(|line| line.starts_with("after")),
        "{printed}"
    );
    let wrong = "the set-up is wrong: the points are in inches";
    // A step that is asked for by its name is refused as well; one who insists is told what it warned of when it ran.
    let step = "export HEAD --step joint --format json --quiet";
    for (words, code, message) in [
        ("compensate HEAD p.yaml", 10, wrong.to_string()),
        (step, 10, format!("refused: {wrong}")),
        (
            &format!("{step} --force"),
            0,
            format!("warning: joint: {wrong}"),
        ),
    ] {
        has(&answer::calib(here, words).code(code).err, &*message);
    }
    let answer = answer::calib(here, "diagnose HEAD --json").json();
    assert_eq!(
        (&answer["verdict"], &answer["findings"][0]["effect"]),
        (&"wrong_setup".into(), &"setup".into())
    );
    let run = answer::calib(here, &format!("run p.yaml --json --quiet {CASE}"))
        .code(10)
        .json();
    let page = read(here.join(run["report"].as_str().unwrap()));
    assert!(
        page.contains("Not accepted: the set-up is wrong")
            && !page.contains("The mean position error fell"),
        "what is said first"
    );
    let unit = |axis: &str, unit: &str| format!("column: {axis}_mm, unit: {unit}");
    let axes = ["x", "y", "z"].map(|axis| [unit(axis, "mm"), unit(axis, "in")]);
    let axes = axes.each_ref().map(|[from, to]| (&**from, &**to));
    case_with(here, &axes);
    let mended = diagnosis(here);
    assert_eq!(mended["findings"][0]["effect"], "zero_shift", "{mended:#}");
}

#[test]
fn without_link_masses_a_loaded_recording_says_what_is_lost() {
    let mut inputs = recorded(&fixture::spherical(), 5, json!([]));
    let known = diagnosed(&inputs).unwrap();
    assert!(
        !known.statement.contains("link masses") && known.warnings.is_empty(),
        "{:?}",
        known.warnings
    );
    let links = inputs.robot.joints.iter_mut();
    links.for_each(|joint| joint.mass = None);
    let payload = (0..72).map(|row| if row % 2 == 0 { 10.0 } else { 0.0 });
    inputs.recording.payload = Some(payload.collect());
    let diagnosis = diagnosed(&inputs).unwrap();
    let lost = "the robot file gives no link masses, yet gravity loads joints in these poses (24 rows of 48 carry a payload)";
    has(&diagnosis.statement, lost);
    diagnosis.warns(lost);
}

#[test]
fn two_set_ups_in_one_recording_are_named_with_the_rows_of_each() {
    let sound = recorded(&fixture::spherical(), 52, json!([]));
    let message_of = |other: fn(usize) -> bool, first: &str, second: &str| {
        let mut inputs = sound.clone();
        let points = inputs.recording.position.iter_mut().enumerate();
        for (_, point) in points.filter(|(row, _)| other(*row)) {
            // Half a metre aside, and turned by 40 deg.
            let (sin, cos) = 0.7f64.sin_cos();
            *point = [
                cos * point[0] - sin * point[1] + 0.5,
                sin * point[0] + cos * point[1],
                point[2],
            ];
        }
        let diagnosis = diagnosed(&inputs).unwrap();
        starts_with(diagnosis.wrong(), "two set-ups are in one recording");
        has(diagnosis.wrong(), [first, second]);
    };
    message_of(|row| row >= 30, "1 to 30 (30 rows)", "31 to 72 (42 rows)");
    message_of(
        |row| row % 2 == 1,
        "1, 3, 5, 7, ... (36 rows)",
        "2, 4, 6, 8, ... (36 rows)",
    );
}

#[test]
fn a_tool_that_was_taken_off_twice_is_named_twice_with_its_rows() {
    let mut inputs = recorded(&fixture::spherical(), 52, json!([]));
    let data = inputs.recording.measurements();
    let robot = RobotModel::new(inputs.robot.clone());
    let rows: Vec<usize> = (0..data.rows()).collect();
    let base = align(&robot, &data, &rows);
    for row in 18..data.rows() {
        let moved = match row < 36 {
            true => Vector3::new(0.0, 0.4e-3, 0.2e-3),
            false => Vector3::new(0.3e-3, -0.3e-3, 0.0),
        };
        let moved = base.rotation * (robot.forward(data.q(row)).rotation * moved);
        let point = &mut inputs.recording.position[row];
        *point = (Vector3::from(*point) + moved).into();
    }
    let findings = diagnosed(&inputs).unwrap().findings;
    let found: Vec<(&str, &str)> = findings
        .iter()
        .map(|row| (&*row.effect, &*row.place))
        .collect();
    assert_eq!(found, [("tool_shift", "tool"); 2], "{findings:#?}");
}

/// A maker's counting: signs, what is shown at the robot file's zeros in quarters of a turn, and whether joint 3 holds joint 2's angle; what is
/// said of it where no other counting is the same by kinematics.
type MakersCounting = (
    &'static str,
    [f64; 6],
    [f64; 6],
    f64,
    &'static [&'static str],
);

#[test]
fn a_makers_counting_is_found_whole_and_no_healthy_joint_is_mastered_again() {
    let countings: [MakersCounting; 4] = [
        (
            "signs of 2, 3 and 5, 90 deg at 2",
            [1.0, -1.0, -1.0, 1.0, -1.0, 1.0],
            [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            0.0,
            &["sign: [1, -1, -1, 1, -1, 1]", "zero: [0, 90, 0, 0, 0, 0]"],
        ),
        (
            "signs of 1, 4 and 6, zeros of 2 and 3",
            [-1.0, 1.0, 1.0, -1.0, 1.0, -1.0],
            [0.0, -1.0, 1.0, 0.0, 0.0, 0.0],
            0.0,
            &[],
        ),
        (
            "sign of 3, joint 3 plus joint 2",
            [1.0, 1.0, -1.0, 1.0, 1.0, 1.0],
            [0.0; 6],
            1.0,
            &[],
        ),
        (
            "zeros of 2, 3 and 5",
            [1.0; 6],
            [0.0, 1.0, 2.0, 0.0, -1.0, 0.0],
            0.0,
            &[],
        ),
    ];
    for (robot, seed) in arms().iter().zip([61, 62, 63]) {
        let sound = recorded(robot, seed, json!([]));
        for (name, sign, zero, coupled, texts) in &countings {
            let mut inputs = sound.clone();
            joints(&mut inputs, |q| {
                q[2] += coupled * q[1];
                q.iter_mut()
                    .zip(sign.iter().zip(zero))
                    .for_each(|(q, (sign, zero))| *q = sign * *q + zero * FRAC_PI_2);
            });
            // Two wrong points of 72 change nothing.
            inputs.recording.position[5][0] += 0.4;
            inputs.recording.position[30][2] -= 0.9;
            let diagnosis =
                diagnosed(&inputs).unwrap_or_else(|error| panic!("{} {name}: {error}", robot.name));
            let statement = diagnosis.wrong();
            println!("{} {name}: {statement}", robot.name);
            texts.iter().for_each(|text| has(statement, text));
            assert!(
                !statement.contains("master") && diagnosis.left_mm() < 12.0,
                "{} {name}: {statement}",
                robot.name
            );
        }
    }
}

#[test]
fn a_wrong_unit_does_not_hide_how_a_controller_counts_its_joints() {
    let sound = recorded(&fixture::spherical(), 61, json!([]));
    let units: [(&str, f64, f64); 3] = [
        (
            "the points are in inches and were read in millimetres",
            1.0 / 25.4,
            1.0,
        ),
        (
            "the points are in metres and were read in millimetres",
            1e-3,
            1.0,
        ),
        (
            "the joints are in rad and were read in deg",
            1.0,
            PI / 180.0,
        ),
    ];
    for (unit, length, angle) in units {
        let mut inputs = sound.clone();
        let sign = [1.0, -1.0, -1.0, 1.0, -1.0, 1.0];
        joints(&mut inputs, |q| {
            q.iter_mut().zip(sign).for_each(|(q, sign)| *q *= sign);
            q[1] += FRAC_PI_2;
            q.iter_mut().for_each(|q| *q *= angle);
        });
        points(&mut inputs, |point| point.map(|x| x * length));
        let diagnosis = diagnosed(&inputs).unwrap_or_else(|error| panic!("{unit}: {error}"));
        has(
            diagnosis.wrong(),
            [
                unit,
                "sign: [1, -1, -1, 1, -1, 1]",
                "zero: [0, 90, 0, 0, 0, 0]",
            ],
        );
    }
}

#[test]
fn the_order_of_the_columns_of_joints_is_named_and_given_as_yaml() {
    let orders: [([usize; 6], &str, &str); 3] = [
        // As simulators list joints by breadth.
        ([0, 3, 1, 4, 2, 5], "1, 4, 2, 5, 3, 6", "1 3 5 2 4 6"),
        ([5, 4, 3, 2, 1, 0], "6, 5, 4, 3, 2, 1", "6 5 4 3 2 1"),
        ([1, 2, 0, 3, 4, 5], "2, 3, 1, 4, 5, 6", "3 1 2 4 5 6"),
    ];
    for (robot, (order, holds, columns)) in arms().iter().zip(orders) {
        let mut inputs = recorded(robot, 61, json!([]));
        joints(&mut inputs, |q| {
            let all = q.to_vec();
            order.iter().zip(q).for_each(|(joint, q)| *q = all[*joint]);
        });
        let diagnosis = diagnosed(&inputs).unwrap();
        let columns: Vec<String> = columns
            .split(' ')
            .map(|column| format!("<joint {column}>"))
            .collect();
        has(
            diagnosis.wrong(),
            [
                format!("one after another they hold joints {holds};").as_str(),
                format!("columns: [{}]}}", columns.join(", ")).as_str(),
            ],
        );
        assert!(diagnosis.left_mm() < 10.0, "{}", diagnosis.wrong());
    }
}
