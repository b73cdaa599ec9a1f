//! Diagnosis of recordings with concealed effects: what was hidden is named and placed, and nothing else.

mod flanks;
mod foreign;
mod kinds;
mod left_out;
mod own_curve;
mod possible;
mod scrambled;
mod sentences;
mod setup;
mod tool_mass;
mod weight;
mod without;

use crate::answer::{self, has, put, read, root};
use crate::desk::shared;
use crate::recorded::Example;
use calib::effect::{Form, Load};
use calib::estimate::choose::{Site, median};
use calib::estimate::{Model, fit};
use calib::robot::{Measurements, PointReadings, RobotModel};
use calib::table::{ParameterRow, Parameters, Prediction, Recording, Robot};
use nalgebra::Vector3;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

type Named = BTreeSet<(String, String)>;

fn wanted(value: &Value) -> Named {
    let text = |entry: &Value, key: &str| entry[key].as_str().unwrap().to_string();
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|entry| (text(entry, "effect"), text(entry, "where")))
        .collect()
}

#[test]
fn the_practice_cases_are_solved() {
    let Some(folder) = shared("practice") else {
        return;
    };
    let mut wrong = Vec::new();
    for case in std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
    {
        let Ok(want) = std::fs::read_to_string(case.join("want.json")) else {
            continue;
        };
        let want: Value = serde_json::from_str(&want).unwrap();
        let example = Example::new("case", &[("case", &case.display().to_string())]);
        let recorded = example.ingested();
        let robot = RobotModel::new(recorded.robot.to_description().unwrap());
        let data = recorded.recording.measurements();
        let made = recorded.diagnose_by(&example.with("diagnose")).unwrap();
        let (found, row) = (made.named(), made.verdict());
        // Held-out rows come down to what a complete model of so many parameters leaves.
        let (after, floor) = (row.after_rms_mm.unwrap(), row.noise_floor_mm.unwrap());
        let wanted = wanted(&want["effects"]);
        let is = |(effect, place): &(String, String), found: &(String, String)| {
            effect
                .trim_start_matches('?')
                .split('|')
                .any(|name| name == found.0)
                && *place == found.1
        };
        let missing = wanted
            .iter()
            .any(|want| !want.0.starts_with('?') && !found.iter().any(|found| is(want, found)));
        let false_ones = found
            .iter()
            .any(|found| !wanted.iter().any(|want| is(want, found)));
        if missing || false_ones {
            wrong.push(format!(
                "{}: {found:?}, after {after:.4}, floor {floor:.4}",
                case.display()
            ));
            continue;
        }
        // Wrong points among the held-out rows are off whatever the model.
        assert!(
            after < 1.35 * floor || !found.iter().all(|found| found.1 != "recording"),
            "{}: {after} {floor}",
            case.display()
        );
        let predictions: Prediction = made.get();
        assert!(predictions.0.len() >= 160);
        // The table of parameters alone is the corrected model, but for products of small motions of the base.
        let parameters: Parameters = made.get();
        let model = parameters.model(robot, &[], Load::GravityTorque).unwrap();
        for (point, row) in model.predict(&data).iter().zip(&predictions.0) {
            let apart = (point * 1e3 - Vector3::new(row.x_mm, row.y_mm, row.z_mm)).norm();
            assert!(
                apart < 1e-5,
                "{}: {apart} mm at row {}",
                case.display(),
                row.sequence
            );
        }
    }
    // An elevation that errs is also what a base does that follows the place of the tool (p23).
    assert!(wrong.len() <= 1, "{}", wrong.join("\n"));
}

fn calib(words: &str, folder: &Path) -> String {
    answer::calib(folder, words).ok()
}

/// The error output of a command that is refused as a misuse.
#[track_caller]
fn refused(words: &str, folder: &Path) -> String {
    answer::calib(folder, words).code(2).err
}

/// A recording of the twin's compact arm in `sealed/recordings/c0001` of a new folder.
fn conceal(words: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let made = "simulate conceal --out sealed --cases 1 --robot compact6 --faulty 0";
    calib(&format!("{made} {words}"), folder.path());
    folder
}

fn concealed(family: &str, seed: &str, points: &str) -> tempfile::TempDir {
    conceal(&format!(
        "--seed {seed} --points {points} --family {family}"
    ))
}

const CASE: &str = "--set case=sealed/recordings/c0001";

/// What a pipeline says of the recording of a folder.
fn diagnosis_by(pipeline: impl std::fmt::Display, folder: &Path) -> Value {
    answer::calib(
        folder,
        &format!("diagnose {pipeline} --quiet --json {CASE}"),
    )
    .json()
}

/// The same of the pipeline that `case_with` wrote.
fn diagnosis(folder: &Path) -> Value {
    diagnosis_by("p.yaml", folder)
}

/// The pipeline of cases, with one text in place of another.
fn case_with(folder: &Path, changes: &[(&str, &str)]) {
    let text = read(root("pipelines/case/pipeline.yaml"));
    let text = changes.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    put(folder, "p.yaml", text);
}

/// Rewrites the cells of a file of the recording, line by line, the head first.
fn rewritten(folder: &Path, file: &str, mut change: impl FnMut(usize, &mut Vec<String>)) {
    let file = folder.join("sealed/recordings/c0001").join(file);
    let mut line = |(row, line): (usize, &str)| {
        let mut cells: Vec<String> = line.split(',').map(String::from).collect();
        change(row, &mut cells);
        cells.join(",") + "\n"
    };
    let text: String = read(&file).lines().enumerate().map(&mut line).collect();
    std::fs::write(&file, text).unwrap();
}

/// Rms errors (mm) of held-out points that a diagnosis states.
fn rms(answer: &Value, when: &str) -> f64 {
    answer[when]["validate_rms_mm"].as_f64().unwrap()
}

/// Diagnoses a concealed recording of the twin: the document, and what the seal holds.
fn blind(family: &str, seed: &str) -> (Value, Value) {
    let hidden = match family {
        "nothing" => "--nulls 1".into(),
        "wandering" => "--nulls 1 --scatter wandering".into(),
        family => format!("--family {family}"),
    };
    let folder = conceal(&format!("--seed {seed} --points 120 {hidden}"));
    let pipeline = root("pipelines/case/pipeline.yaml");
    let answer = diagnosis_by(pipeline.display(), folder.path());
    let truth = read(folder.path().join("sealed/sealed/c0001.json"));
    (answer, serde_json::from_str(&truth).unwrap())
}

#[test]
fn a_recording_without_a_missing_effect_has_no_findings() {
    let (answer, _) = blind("nothing", "901");
    assert_eq!(answer["verdict"], "nothing_missing");
    assert_eq!(answer["findings"], serde_json::json!([]));
    assert!(
        answer["not_observable"]
            .as_array()
            .unwrap()
            .iter()
            .any(|line| line.as_str().unwrap().contains("tracker scale"))
    );
}

#[test]
fn a_tracker_that_wanders_is_no_cause() {
    let (answer, _) = blind("wandering", "2");
    assert_eq!(answer["findings"], serde_json::json!([]), "{answer:#}");
}

#[test]
fn effects_of_the_twin_are_named_and_placed() {
    for (family, seed) in [
        ("zero_shift", "923"),
        ("thermal_growth", "922"),
        ("joint_log_lag", "922"),
        ("base_compliance", "925"),
    ] {
        let (answer, truth) = blind(family, seed);
        let found = wanted(&answer["findings"]);
        assert_eq!(found, wanted(&truth["want"]), "{family}: {answer:#}");
        let [before, after] = ["before", "after"].map(|when| rms(&answer, when));
        let floor = answer["noise_floor_mm"].as_f64().unwrap();
        // What is hardly larger than the noise may gain nothing on some fifty points.
        let is_visible = before > 1.2 * floor;
        assert!(
            (!is_visible || after < before) && after < 1.4 * floor,
            "{family}: {before} to {after}, noise {floor}"
        );
    }
}

/// What `diagnose` says of a recording that the twin makes of a concealed robot with one more effect, given in YAML; `fitted` points
/// to fit, 40 held out.
fn simulated(effect: &str, seed: u64, fitted: usize) -> Value {
    let pipeline = format!(
        "
calib: 1
name: simulated
seed: {seed}
stages:
  - uses: robot
    with: {{file: sealed/recordings/c0001/robot.json, format: case}}
  - uses: simulate
    with:
      truth: {{offset_deg: [0.02, -0.01, 0.03, 0, 0.01, 0]}}
      effects: [{effect}]
      poses: {{range_deg: [[-90, 90], [-140, -40], [-55, 95], [-120, 120], [-75, 75], [-160, 160]]}}
      blocks: [{{usage: fit, points: {fitted}}}, {{usage: validate, points: 40}}]
  - uses: split
    with: {{by: usage}}
  - uses: diagnose
"
    );
    let folder = concealed("backlash", "31", "40");
    put(folder.path(), "p.yaml", pipeline);
    answer::calib(folder.path(), "diagnose p.yaml --json --quiet").json()
}

#[test]
fn lost_motion_that_heavy_loads_decide_is_one_cause_with_its_gap_and_its_torque() {
    let answer = simulated(
        "{backlash: {joint: 3, gap_arcsec: 60, closing_nm: 12}}",
        3,
        120,
    );
    let findings = answer["findings"].as_array().unwrap();
    assert_eq!(
        wanted(&answer["findings"]),
        Named::from([("backlash".into(), "joint 3".into())]),
        "{answer:#}"
    );
    let gap = &findings[0]["parameters"][0];
    let (value, sigma) = (
        gap["value"].as_f64().unwrap(),
        gap["sigma"].as_f64().unwrap(),
    );
    assert!((value - 30.0).abs() < 3.0 * sigma && sigma < 3.0, "{gap}");
    let statement = findings[0]["statement"].as_str().unwrap();
    let torque: f64 = statement
        .split(" Nm")
        .next()
        .and_then(|text| text.rsplit(' ').next())
        .unwrap()
        .parse()
        .unwrap();
    assert!((9.0..=15.0).contains(&torque), "{statement}");
}

#[test]
fn a_joint_of_the_wrong_sign_is_named_with_the_line_that_mends_it() {
    let folder = conceal("--seed 901 --points 120 --nulls 1");
    let here = folder.path();
    let mut column = None;
    rewritten(here, "controller.csv", |row, cells| {
        let column = *column.get_or_insert_with(|| position(cells, "q4_deg"));
        if row > 0 {
            cells[column] = (-cells[column].parse::<f64>().unwrap()).to_string();
        }
    });
    case_with(here, &[]);
    let asked = format!("diagnose p.yaml --json --quiet {CASE}");
    let answer = answer::calib(here, &asked).code(10).json();
    let findings = answer["findings"].as_array().unwrap();
    assert_eq!(findings.len(), 1, "{answer:#}");
    assert_eq!(
        (&answer["verdict"], &findings[0]["effect"]),
        (&"wrong_setup".into(), &"setup".into())
    );
    let sign = "sign: [1, 1, 1, -1, 1, 1]";
    assert!(
        findings[0]["statement"].as_str().unwrap().contains(sign),
        "{answer:#}"
    );
    // The line of YAML mends it, and physics is asked.
    let from = "unit: deg, linear_unit: mm}";
    let to = format!("unit: deg, linear_unit: mm, {sign}}}");
    case_with(here, &[(from, &to)]);
    let mended = diagnosis(here);
    assert_eq!(
        (&mended["verdict"], &mended["findings"]),
        (&"nothing_missing".into(), &serde_json::json!([])),
        "{mended:#}"
    );
}

/// The column of a name.
fn position(cells: &[String], name: &str) -> usize {
    cells.iter().position(|cell| cell == name).unwrap()
}

#[test]
fn what_another_simulation_knows_is_not_missing_from_it() {
    let folder = concealed("joint_compliance", "931", "120");
    let case = folder.path().join("sealed/recordings/c0001");
    let example = Example::new("case", &[("case", &case.display().to_string())]);
    let recorded = example.ingested();
    let data = recorded.recording.measurements();
    let diagnosed = |simulated: Option<Vec<[f64; 3]>>| {
        let mut recorded = recorded.clone();
        recorded.recording.simulated = simulated;
        let made = recorded.diagnose_by(&example.with("diagnose")).unwrap();
        let robot = RobotModel::new(recorded.robot.to_description().unwrap());
        let parameters: Parameters = made.get();
        (
            Named::from_iter(made.named()),
            parameters.model(robot, &[], Load::GravityTorque).unwrap(),
        )
    };
    let (alone, mut model) = diagnosed(None);
    let truth = read(folder.path().join("sealed/sealed/c0001.json"));
    let truth: Value = serde_json::from_str(&truth).unwrap();
    assert_eq!(alone, wanted(&truth["want"]));
    // Beside a rigid arm in a frame of its own the same is missing.
    let rigid = |row: usize| model.robot.forward(data.q(row)).translation;
    let turned = |p: Vector3<f64>| [p.y + 3.0, -p.x, p.z - 1.0];
    let (with_neighbour, ..) = diagnosed(Some(
        (0..data.rows()).map(|row| turned(rigid(row))).collect(),
    ));
    assert_eq!(with_neighbour, alone);
    // A simulation of the nominal geometry that knows the compliance leaves the errors of geometry alone.
    let specs = model.stack.specs().to_vec();
    for (x, _) in model
        .x
        .iter_mut()
        .zip(&specs)
        .filter(|(_, spec)| !spec.name.starts_with("joint_compliance"))
    {
        *x = 0.0;
    }
    let (left, ..) = diagnosed(Some(
        model
            .predict(&data)
            .into_iter()
            .map(<[f64; 3]>::from)
            .collect(),
    ));
    assert_eq!(left, Named::new());
}

/// The last run of a folder's store, whatever it was for.
fn newest(folder: &Path) -> String {
    let runs = std::fs::read_dir(folder.join(".calib/runs")).unwrap();
    runs.map(|run| run.unwrap().file_name().into_string().unwrap())
        .max()
        .unwrap()
}

#[test]
fn a_diagnosis_is_shown_again_from_its_run_as_it_was_printed() {
    let folder = concealed("zero_shift", "923", "60");
    let here = folder.path();
    let twice = (
        "  - uses: validate\n",
        "  - {id: again, uses: diagnose}\n\n  - uses: validate\n",
    );
    case_with(here, &[]);
    let printed = calib(&format!("diagnose p.yaml --quiet {CASE}"), here);
    let made = [
        printed,
        calib(&format!("diagnose {} --json", newest(here)), here),
    ];
    let runs = std::fs::read_dir(here.join(".calib/runs")).unwrap().count();
    assert_eq!(calib(&format!("diagnose {}", newest(here)), here), made[0]);
    // Nothing was run, and nothing was computed anew.
    assert_eq!(
        std::fs::read_dir(here.join(".calib/runs")).unwrap().count(),
        runs
    );
    assert_eq!(
        calib(&format!("diagnose p.yaml --quiet --json {CASE}"), here),
        made[1]
    );
    calib(&format!("tag {} found", newest(here)), here);
    calib(
        &format!("run p.yaml --quiet --until geometry --set seed=9 {CASE}"),
        here,
    );
    let message = refused(&format!("diagnose {}", newest(here)), here);
    has(&message, "never came to its stage `diagnose`");
    has(
        &message,
        "calib diagnose p.yaml --set seed=9 --set case=sealed/recordings/c0001",
    );
    assert_eq!(calib("diagnose found --json", here), made[1]);
    case_with(here, &[("  - uses: diagnose\n", "")]);
    calib(&format!("run p.yaml --quiet --until geometry {CASE}"), here);
    let message = refused(&format!("diagnose {}", newest(here)), here);
    has(
        &message,
        "has no stage `diagnose`: put `- uses: diagnose` after the split of p.yaml",
    );
    case_with(here, &[twice]);
    calib(&format!("run p.yaml --quiet --until again {CASE}"), here);
    let run = newest(here);
    for place in [run.clone(), format!("p.yaml {CASE}")] {
        let message = refused(&format!("diagnose {place}"), here);
        has(
            &message,
            "has several diagnoses; say which with --step: diagnose, again",
        );
    }
    assert_eq!(
        calib(&format!("diagnose {run}/again --json"), here),
        calib(&format!("diagnose {run} --step again --json"), here)
    );
    let message = refused(&format!("diagnose {run} --set seed=2"), here);
    has(&message, "a finished run cannot be changed");
}

#[test]
fn parameters_that_correct_an_outside_simulation_are_not_taken_for_the_robots_own() {
    let folder = concealed("joint_compliance", "931", "60");
    let here = folder.path();
    let mut column = None;
    rewritten(here, "tracker.csv", |row, cells| {
        let column = *column.get_or_insert_with(|| position(cells, "x_mm"));
        let near = |k: usize| {
            let value: f64 = cells[column + k].parse().unwrap();
            (value + 0.05 * (row as f64 * (k + 1) as f64).sin()).to_string()
        };
        let more = match row {
            0 => ["sx", "sy", "sz"].map(String::from),
            _ => [0, 1, 2].map(near),
        };
        cells.extend(more);
    });
    let z = "            z: {column: z_mm, unit: mm}\n";
    let simulated = ["x", "y", "z"]
        .map(|axis| format!("            sim_{axis}: {{column: s{axis}, unit: mm}}\n"))
        .concat();
    case_with(here, &[(z, &format!("{z}{simulated}"))]);
    calib(&format!("diagnose p.yaml --quiet {CASE}"), here);
    put(here, "t.csv", "x_mm,y_mm,z_mm\n600,0,700\n");
    let table = ".calib/tables/case/diagnose.parameters.parquet";
    let robot = "sealed/recordings/c0001/robot.json";
    let run = newest(here);
    for verb in [
        format!("compensate {run} t.csv"),
        format!("export {run} --format json"),
        format!("export {table} --robot {robot} --format json"),
    ] {
        has(
            &refused(&verb, here),
            ["correct the simulation of sim_x, sim_y, sim_z", "--step"],
        );
    }
    calib(&format!("run p.yaml --quiet --until geometry {CASE}"), here);
    calib(
        &format!(
            "export {} --step geometry --format json --quiet",
            newest(here)
        ),
        here,
    );
}

/// A table that a run of the pipeline of cases wrote.
fn table_of<T: calib::table::Table>(folder: &Path, name: &str) -> T {
    let path = folder.join(".calib/tables/case").join(name);
    calib::table::from_parquet(name, std::fs::read(path).unwrap())
        .unwrap()
        .table
}

/// What is left, squared and over the noise, of points that `truth` makes where `other` is fitted to them in all that is `free`.
fn left(truth: &Model, other: &Model, free: &[usize], data: &Measurements) -> f64 {
    let mut data = data.clone();
    data.points.position = truth.predict(&data);
    let rows: Vec<usize> = (0..data.rows()).collect();
    let (fitted, _) = fit(other, &data, &rows, free);
    let off = fitted
        .predict(&data)
        .into_iter()
        .zip(&data.points.position)
        .zip(&data.points.sigma);
    off.map(|((model, point), sigma)| (model - point).component_div(sigma).norm_squared())
        .sum()
}

/// Rows of a recording followed by some more.
fn joined(data: &Measurements, rows: &[usize], more: &Measurements, sigma: f64) -> Measurements {
    let q = rows
        .iter()
        .flat_map(|row| data.q(*row))
        .chain(&more.q)
        .copied()
        .collect();
    let payload: Vec<f64> = rows
        .iter()
        .map(|row| data.payload[*row])
        .chain(more.payload.iter().copied())
        .collect();
    let count = payload.len();
    let position = vec![Vector3::zeros(); count];
    Measurements {
        joints: data.joints,
        q,
        payload,
        points: PointReadings::new(position, sigma),
        ..Measurements::default()
    }
}

#[test]
fn proposed_poses_tell_a_finding_from_its_rival_three_times_better_than_random_ones() {
    const COUNT: usize = 50;
    let folder = concealed("base_compliance", "14", "60");
    let here = folder.path();
    case_with(here, &[]);
    let printed = calib(&format!("diagnose p.yaml --quiet {CASE}"), here);
    // The command is printed as it is to be typed.
    let command = printed
        .lines()
        .find_map(|line| line.trim_start().strip_prefix("calib "))
        .unwrap();
    assert!(
        command.ends_with("--separate 1 'link_compliance@link 1'"),
        "{printed}"
    );
    let answer: Value =
        serde_json::from_str(&calib(&format!("{command} --count 50 --json"), here)).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let sides = answer["separation"].as_array().unwrap();
    assert_eq!(sides[0]["if"], "base_compliance at base");
    for side in sides {
        assert!(
            number(&side["proposed"]) > 25.0
                && number(&side["proposed"]) > number(&side["recorded"]),
            "{answer:#}"
        );
    }
    // Measured: recordings without noise, made by the diagnosed model at these poses, and the rival fitted to them with all else.
    let robot = table_of::<Robot>(here, "robot.robot.parquet")
        .to_description()
        .unwrap();
    let parameters: Parameters = table_of(here, "diagnose.parameters.parquet");
    let truth = parameters
        .model(RobotModel::new(robot.clone()), &[], Load::GravityTorque)
        .unwrap();
    let data = table_of::<Recording>(here, "ingest.recording.parquet").measurements();
    let prediction: Prediction = table_of(here, "diagnose.prediction.parquet");
    let rows: Vec<usize> = (0..data.rows())
        .filter(|row| !prediction.0[*row].held_out && !prediction.0[*row].suspect)
        .collect();
    let form = answer["rival"]["form"].to_string();
    let parsed: Form = serde_json::from_str(&form).unwrap();
    let mut table = parameters.clone();
    let own_value = table
        .0
        .iter()
        .position(|row| row.effect == "base_compliance")
        .unwrap();
    let row = table.0.remove(own_value);
    table.0.retain(|row| row.effect != "base_compliance");
    for spec in parsed.parameters(&RobotModel::new(robot.clone())) {
        let more = ParameterRow {
            name: spec.name,
            form: Some(form.clone()),
            value: 0.0,
            ..row.clone()
        };
        table.0.push(ParameterRow {
            effect: "link_compliance".into(),
            unit: spec.unit.symbol().into(),
            ..more
        });
    }
    let other = table
        .model(RobotModel::new(robot.clone()), &[], Load::GravityTorque)
        .unwrap();
    let estimated = |name: &String| {
        table
            .0
            .iter()
            .any(|row| row.name == *name && row.status == "free")
    };
    let free: Vec<usize> = (0..other.x.len())
        .filter(|k| estimated(&other.stack.specs()[*k].name))
        .collect();
    let sigma = number(&answer["sigma_mm"]) * 1e-3;
    let measured =
        |more: &Measurements| left(&truth, &other, &free, &joined(&data, &rows, more, sigma));
    let mut proposed = Measurements {
        joints: 6,
        ..Measurements::default()
    };
    for pose in answer["poses"].as_array().unwrap() {
        proposed
            .q
            .extend((1..=6).map(|joint| number(&pose[format!("q{joint}_deg")]).to_radians()));
        proposed.payload.push(number(&pose["payload_kg"]));
    }
    assert_eq!(proposed.payload.len(), COUNT);
    // The robot file says no limits: joints keep to where they were.
    let ranges = (0..6).map(|joint| {
        let all = rows.iter().map(|row| data.q(*row)[joint]);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
            [low.min(q), high.max(q)]
        })
    });
    let mut payloads: Vec<f64> = proposed.payload.clone();
    payloads.sort_by(f64::total_cmp);
    payloads.dedup();
    let bounds = [[f64::NEG_INFINITY, f64::INFINITY]; 3];
    let site = Site {
        ranges: ranges.collect(),
        bounds,
        floor: f64::NEG_INFINITY,
        payloads,
    };
    let random = (0..9).map(|seed| {
        let mut drawn = site.draw(&truth.robot, COUNT, sigma, 70 + seed).unwrap();
        // One payload a pose.
        let count = site.payloads.len();
        let kept: Vec<usize> = (0..COUNT).map(|k| k * count + k % count).collect();
        drawn = Measurements {
            q: kept.iter().flat_map(|row| drawn.q(*row)).copied().collect(),
            payload: kept.iter().map(|row| drawn.payload[*row]).collect(),
            ..Measurements {
                joints: 6,
                ..Measurements::default()
            }
        };
        measured(&drawn)
    });
    let (ours, theirs) = (measured(&proposed), median(random.collect()));
    println!(
        "L with {COUNT} proposed poses {ours:.1}, with random ones {theirs:.1}; predicted {}",
        sides[0]["proposed"]
    );
    assert!(
        ours >= 3.0 * theirs,
        "{ours:.1}, with random poses {theirs:.1}"
    );
    assert!(
        (ours / number(&sides[0]["proposed"]) - 1.0).abs() < 0.2,
        "{ours:.1}: {answer:#}"
    );
}

#[test]
fn what_no_pose_tells_apart_is_said_with_what_would() {
    let folder = concealed("gear_cyclic", "5", "60");
    let here = folder.path();
    case_with(here, &[]);
    // A balancer at a joint of unknown stiffness is a gear error of order 1.
    assert_eq!(
        diagnosis(here)["findings"][0]["rivals"][0]["effect"],
        "counterbalance"
    );
    let printed = calib(
        &format!(
            "poses --run {} --separate gear_cyclic counterbalance@j4",
            newest(here)
        ),
        here,
    );
    has(
        &printed,
        "no pose separates gear_cyclic at joint 4 from counterbalance at joint 4",
    );
    has(&printed, "instead: log motor currents at rest");
    let folder = concealed("zero_shift", "9", "60");
    let here = folder.path();
    case_with(here, &[]);
    // A step of the first joint is one turn of the base.
    assert_eq!(
        diagnosis(here)["findings"][0]["rivals"][0]["effect"],
        "base_shift"
    );
    let printed = calib(&format!("poses --run {} --separate", newest(here)), here);
    has(
        &printed,
        "base_shift at base can imitate zero_shift at joint 1 completely",
    );
    has(&printed, "instead: return to a few anchor poses");
    for (names, wanted) in [
        ("9", "`9` matches no finding of run"),
        ("'zero_shift@joint 7'", "matches no finding of run"),
        ("1 'gear_cyclc@joint 1'", "did you mean `gear_cyclic`?"),
        (
            "1 'gear_cyclic@joint 9'",
            "gear_cyclic has no place `joint 9` here; allowed: joint 1, joint 2",
        ),
        ("1 gear_cyclic", "say where, e.g. 'gear_cyclic@"),
    ] {
        let words = format!("poses --run {} --separate {names}", newest(here));
        has(&refused(&words, here), wanted);
    }
}

#[test]
fn of_few_rows_no_law_takes_a_size_that_no_gear_has() {
    // 51 rows of an arm with four soft joints and a wrong mass, 34 parameters of the base: gears of 2700 arcsec explained as much of them.
    let folder = tempfile::tempdir().unwrap();
    case_with(folder.path(), &[]);
    let rows = format!(
        "case={}/tests/it/diagnose/few_rows",
        env!("CARGO_MANIFEST_DIR")
    );
    let words = format!("diagnose p.yaml --set {rows} --json --quiet");
    let answer = answer::calib(folder.path(), &words).json();
    let mut found = wanted(&answer["findings"]);
    found.retain(|(effect, _)| effect != "outlier");
    let is_soft = |place: &str| found.contains(&("joint_compliance".into(), place.into()));
    let is_of_loads = |(effect, _): &(String, String)| {
        effect.starts_with("joint_compliance") || effect.starts_with("link_mass")
    };
    assert!(
        is_soft("joint 2") && is_soft("joint 3") && found.iter().all(is_of_loads),
        "{found:?}"
    );
    // The instrument's noise is 0.017 mm.
    assert!(rms(&answer, "after") < 0.03, "{}", answer["after"]);
}
