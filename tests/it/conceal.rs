//! Concealed recordings: what they hide is there, nulls hide nothing, and a seed gives the same bytes whoever works on it.

use crate::answer::{calib, has, put, read};
use calib::effect::CAUSES;
use calib::twin::conceal::case::Case;
use calib::twin::conceal::design::{Content, Design};
use calib::twin::conceal::family::FAMILIES;
use calib::twin::conceal::points::Layout;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

fn is_a_place(place: &str) -> bool {
    let number = |text: &str| {
        text.parse::<usize>()
            .is_ok_and(|number| (1..=9).contains(&number))
    };
    match place.split_once(' ') {
        None => ["base", "tool", "tracker", "recording"].contains(&place),
        Some(("joint", tail)) => number(tail),
        Some(("link", tail)) => tail
            .split_once('-')
            .map_or_else(|| number(tail), |(a, b)| number(a) && number(b) && a < b),
        Some(_) => false,
    }
}

/// Recordings of so many points without faults.
fn sound(seed: u64, points: usize) -> Design {
    Design {
        seed,
        points: Some(points),
        faulty: 0.0,
        ..Design::default()
    }
}

/// One effect of this name.
fn single(name: &str) -> Content {
    let row = FAMILIES.iter().position(|family| family.name == name);
    Content::Single(row.unwrap())
}

#[test]
fn every_family_moves_the_tool_and_is_wanted_by_a_canonical_name() {
    for (row, family) in FAMILIES.iter().enumerate() {
        for other_forms in [0.0, 1.0] {
            let design = Design {
                other_forms,
                ..sound(5, 40)
            };
            let case = Case::make(&design, row, Content::Single(row)).unwrap();
            let form = case.concealed.first().map_or("", |one| one.cause.form);
            let name = format!("{} ({form})", family.name);
            let mut effects = case.concealed.iter().map(|one| one.cause.effect);
            assert!(
                effects.any(|effect| effect == family.name),
                "{name} hides something else"
            );
            for one in &case.concealed {
                assert!(
                    one.raw_mm > 1e-5,
                    "{name} moves the tool by {} mm",
                    one.raw_mm
                );
                let is_less = one.strength <= one.strength_alone * (1.0 + 1e-9);
                assert!(is_less && one.visible_mm <= one.raw_mm, "{name}");
            }
            for (effect, place) in case.want() {
                let is_known = effect == "unknown" || CAUSES.iter().any(|one| one.name == effect);
                assert!(is_known && is_a_place(&place), "{effect} at {place}");
            }
        }
    }
}

/// Of single effects that are sized, most are as visible as drawn: the strength is that of the differences between two recordings.
#[test]
fn an_effect_is_as_visible_as_the_seal_says() {
    let design = Design {
        natural: 0.0,
        other_forms: 0.0,
        ..sound(3, 120)
    };
    let case = Case::make(&design, 0, single("gear_cyclic")).unwrap();
    let one = &case.concealed[0];
    let from_sizes = 3.0 * 120.0 * (one.visible_mm / case.noise_mm[0]).powi(2);
    let strength = one.strength;
    assert!(
        (strength / from_sizes - 1.0).abs() < 1e-9,
        "{strength} against {from_sizes}"
    );
    assert!((0.9..=5100.0).contains(&strength), "{strength}");
    // 6 joints with 4 numbers each and 3 of the tool, ratios, one coupling on the big robot; the rank does not hang on rounding.
    let joints = case.robot.joints.len();
    let rank = 4 * joints + 3 + joints + case.robot.couplings.len();
    assert_eq!(case.geometry_rank, rank);
}

/// All that a wrong metre does is what a larger robot does.
#[test]
fn a_wrong_metre_is_there_and_cannot_be_seen() {
    for number in 0..3 {
        let case = Case::make(&sound(6, 60), number, single("tracker_scale")).unwrap();
        let one = &case.concealed[0];
        assert!(one.raw_mm > 1e-3 && one.strength < 0.01, "{one:?}");
    }
}

#[test]
fn a_null_hides_nothing_and_wants_nothing() {
    for number in 0..4 {
        let case = Case::make(&sound(2, 40), number, Content::Null).unwrap();
        assert!(case.concealed.is_empty() && case.want().is_empty() && case.tampered.is_empty());
    }
}

#[test]
fn shares_are_kept_and_pairs_sit_in_two_places() {
    let design = Design {
        seed: 4,
        cases: 40,
        nulls: 0.25,
        pairs: 0.2,
        open: 0.1,
        points: Some(30),
        ..Design::default()
    };
    let contents = design.contents();
    let count = |what: fn(&&Content) -> bool| contents.iter().filter(what).count();
    let open = |content: &&Content| matches!(content, Content::Single(row) if FAMILIES[*row].name == "unknown");
    let pair = |content: &&Content| matches!(content, Content::Pair(..));
    let null = |content: &&Content| **content == Content::Null;
    assert_eq!([count(null), count(pair), count(open)], [10, 8, 4]);
    let contents = contents.iter().enumerate();
    for (number, content) in contents.filter(|(_, content)| pair(content)) {
        let case = Case::make(&design, number, *content).unwrap();
        let places = case.concealed.iter().map(|one| one.cause.place.as_str());
        let places: Vec<&str> = places.collect();
        assert!(places.len() == 2 && places[0] != places[1], "{places:?}");
    }
}

/// The hash of every file is in the seal.
#[test]
fn a_seed_gives_the_same_bytes_on_one_and_two_threads() {
    let root = tempfile::tempdir().unwrap();
    for (kind, files, options) in [
        ("points", 4 * 4, "--cases 4 --points 30"),
        (
            "torques",
            3 * 3,
            "--dynamics --cases 3 --seconds 16 --rate 20 --open 0.4",
        ),
    ] {
        let seals = ["1", "2"].map(|jobs| {
            let out = root.path().join(format!("{kind}{jobs}"));
            let words = format!(
                "simulate conceal --out {} {options} --jobs {jobs}",
                out.display()
            );
            calib(".", &words).code(0);
            read(out.join("seal.json"))
        });
        let seal: Value = serde_json::from_str(&seals[0]).unwrap();
        assert_eq!(
            seal["files"].as_object().map(|all| all.len()),
            Some(files),
            "{kind}"
        );
        assert_eq!(seals[0], seals[1], "{kind}");
    }
}

/// Recordings with single effects, pairs, open ones and nulls, and verdicts that say what `say` makes of each truth.
fn judged(root: &Path, say: impl Fn(&Value) -> Vec<Value>) -> (PathBuf, PathBuf) {
    let (set, verdicts) = (root.join("set"), root.join("verdicts"));
    calib(
        ".",
        &format!(
            "simulate conceal --out {} --cases 12 --points 30 --nulls 0.25 --pairs 0.25 --open 0.1",
            set.display()
        ),
    )
    .code(0);
    std::fs::create_dir(&verdicts).unwrap();
    for entry in std::fs::read_dir(set.join("sealed")).unwrap() {
        let path = entry.unwrap().path();
        let truth: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let findings = say(&truth);
        let verdict = if findings.is_empty() {
            "nothing_missing"
        } else {
            "explained"
        };
        let answer = json!({ "verdict": verdict, "findings": findings });
        put(&verdicts, path.file_name().unwrap(), answer.to_string());
    }
    (set, verdicts)
}

fn wanted(truth: &Value) -> Vec<Value> {
    truth["want"].as_array().unwrap().clone()
}

/// The scoreboard as JSON, and as a table with a row for each effect, and for each of three nulls.
fn score(set: &Path, verdicts: &Path) -> Value {
    let out = set.with_extension("parquet");
    let (set, verdicts, table) = (set.display(), verdicts.display(), out.display());
    let words = format!("simulate reveal {set} --verdicts {verdicts} --out {table} --json");
    let board = calib(".", &words).code(0).json();
    let file = std::fs::File::open(&out).unwrap();
    let rows = ParquetRecordBatchReaderBuilder::try_new(file).unwrap();
    let rows = rows.build().unwrap().map(|batch| batch.unwrap().num_rows());
    assert_eq!(rows.sum::<usize>() as u64, total(&board, "n") + 3);
    board
}

fn total(board: &Value, outcome: &str) -> u64 {
    let bins = ["alone", "beside"]
        .into_iter()
        .flat_map(|company| board[company].as_array().unwrap().clone());
    bins.map(|bin| bin["outcomes"][outcome].as_u64().unwrap())
        .sum()
}

/// The scoreboard of who says what `say` makes of each truth.
fn score_of(say: impl Fn(&Value) -> Vec<Value>) -> Value {
    let root = tempfile::tempdir().unwrap();
    let (set, verdicts) = judged(root.path(), say);
    score(&set, &verdicts)
}

/// Something that no recording conceals.
fn false_name() -> Value {
    json!({ "effect": "joint_table", "where": "joint 9" })
}

/// What is wanted, under another name with the true one for a rival.
fn renamed(effect: &str, place: Option<&str>, truth: &Value) -> Vec<Value> {
    let renamed = |name: &Value| {
        let place = place.or(name["where"].as_str());
        json!({ "effect": effect, "where": place, "rivals": [name] })
    };
    wanted(truth).iter().map(renamed).collect()
}

#[test]
fn outcomes_are_those_of_what_is_said() {
    let of_all = |board: &Value, outcome| {
        assert_eq!(total(board, outcome), total(board, "n"), "{outcome}");
        [0, 1].map(|share| board["shares"][share]["share"]["count"].as_u64().unwrap())
    };
    let board = score_of(wanted);
    of_all(&board, "exact");
    assert_eq!(
        (&board["recordings"], &board["failures"]),
        (&json!(12), &json!([]))
    );
    assert!(total(&board, "exact") >= 9);
    let [alarms, _] = of_all(&score_of(|_| vec![]), "silent");
    assert_eq!(alarms, 0, "no false alarm");
    let [alarms, _] = of_all(&score_of(|_| vec![false_name()]), "wrong");
    assert_eq!(alarms, 3, "one in each null");
    // Named with the truth it changes no outcome, but no recording is right.
    let board = score_of(|truth| [wanted(truth), vec![false_name()]].concat());
    of_all(&board, "exact");
    assert_eq!(board["failures"].as_array().map(Vec::len), Some(12));
    let rivals = score_of(|truth| renamed("joint_table", Some("joint 9"), truth));
    let [_, strays] = of_all(&rivals, "in_set");
    assert_eq!(strays, 0, "what has the truth for a rival is no stray");
}

#[test]
fn the_place_counts_apart_from_the_name_and_unknown_is_no_wrong_name() {
    let placed = |say: &dyn Fn(&Value) -> Vec<Value>| {
        let board = score_of(say);
        let [place, name, wrong] = ["place", "name_or_unknown", "wrong_name"].map(|what| {
            let share = &board["places"]["all"][what];
            let all = share["of"].as_u64().unwrap();
            assert!(all >= 4, "{share}");
            // All of them, or none.
            match share["count"].as_u64().unwrap() {
                count if count == all => Some(true),
                0 => Some(false),
                _ => None,
            }
        });
        [place, name, wrong]
    };
    let elsewhere = |effect: &str| vec![json!({ "effect": effect, "where": "joint 9" })];
    let all_right = [true, true, false].map(Some);
    assert_eq!(placed(&wanted), all_right);
    assert_eq!(placed(&|truth| renamed("unknown", None, truth)), all_right);
    // The true name for a rival saves the place and not the name.
    let named = placed(&|truth| renamed("no_such_effect", None, truth));
    assert_eq!(named, [true, false, true].map(Some));
    assert_eq!(
        placed(&|_| elsewhere("no_such_effect")),
        [false, false, true].map(Some)
    );
    assert_eq!(placed(&|_| elsewhere("unknown")), [Some(false); 3]);
    // Faults of points have no place.
    let fault = json!({ "effect": "outlier", "where": "recording" });
    let found = placed(&|truth| [vec![fault.clone()], wanted(truth)].concat());
    assert_eq!(found[..2], all_right[..2]);
}

#[test]
fn one_changed_byte_breaks_the_seal() {
    let root = tempfile::tempdir().unwrap();
    let (set, verdicts) = judged(root.path(), wanted);
    let reveal = format!(
        "simulate reveal {} --verdicts {}",
        set.display(),
        verdicts.display()
    );
    for name in ["sealed/c0003.json", "recordings/c0002/tracker.csv"] {
        let path = set.join(name);
        let before = std::fs::read(&path).unwrap();
        let mut after = before.clone();
        let last = after.iter().rposition(u8::is_ascii_digit).unwrap();
        after[last] = if after[last] == b'1' { b'2' } else { b'1' };
        std::fs::write(&path, after).unwrap();
        let done = calib(".", &reveal);
        let printed = done.err.clone();
        assert_eq!(done.code, Some(10), "{printed}");
        assert!(
            printed.contains(&format!("{name}: was changed since it was sealed"))
                && done.out.is_empty(),
            "{printed}"
        );
        std::fs::write(&path, before).unwrap();
    }
    std::fs::remove_file(set.join("recordings/c0001/robot.json")).unwrap();
    let done = calib(".", &reveal);
    assert!(
        done.err
            .contains("recordings/c0001/robot.json: was sealed, but cannot be read")
    );
}

/// What is diagnosed already is not diagnosed again: with all verdicts at hand a proof reveals at once.
#[test]
fn an_interrupted_proof_goes_on_where_it_stood_and_only_with_the_same_set() {
    let root = tempfile::tempdir().unwrap();
    let (set, verdicts) = judged(root.path(), wanted);
    std::fs::rename(verdicts, set.join("verdicts")).unwrap();
    let pipeline = concat!(env!("CARGO_MANIFEST_DIR"), "/pipelines/case/pipeline.yaml");
    let prove = |cases: &str| {
        calib(
            ".",
            &format!(
                "simulate prove --out {} --cases {cases} --points 30 --nulls 0.25 --pairs 0.25 --open 0.1 --pipeline {pipeline} --json",
                set.display()
            ),
        )
    };
    let done = prove("12");
    let printed = done.err.clone();
    assert!(
        done.code == Some(0) && printed.matches("diagnosed before").count() == 12,
        "{printed}"
    );
    let board: Value = done.json();
    assert_eq!(
        (&board["recordings"], &board["failures"]),
        (&json!(12), &json!([]))
    );
    let other = prove("11").code(2);
    has(&other.err, "holds a set made with other options");
}

const STATED: &str = "
calib: 1
name: stated
seed: 3
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: simulate
    with:
      truth: {ratio: [1, 1.0013, 1, 1, 0.9996, 1], offset_deg: [0.02, -0.01, 0.03, 0, 0.01, 0]}
      effects: [{backlash: {joint: 2, gap_arcsec: 60}}]
      poses: {range_deg: [[-90, 90], [-40, 60], [-55, 55], [-120, 120], [-75, 75], [-160, 160]]}
      blocks: [{usage: fit, points: 60}, {usage: validate, points: 40}]
";

/// Without its effect the estimator fits the written twin to the noise, with it to what backlash leaves: the files say what was
/// simulated.
#[test]
fn a_stated_twin_is_written_as_a_case_folder_that_the_estimator_reads() {
    let root = tempfile::tempdir().unwrap();
    let path = |name: &str| root.path().join(name).to_string_lossy().into_owned();
    let pipelines = concat!(env!("CARGO_MANIFEST_DIR"), "/pipelines");
    std::fs::copy(format!("{pipelines}/sr210d/robot.yaml"), path("robot.yaml")).unwrap();
    std::fs::write(path("stated.yaml"), STATED).unwrap();
    let record = |out: &str, remainder: &str| {
        let set = format!("--set simulate.remainder={remainder} --store store --quiet");
        let words = format!("simulate record stated.yaml --out {out} {set}");
        calib(root.path(), &words)
    };
    let held_out = |out: &str| {
        let words = format!(
            "run {pipelines}/case/pipeline.yaml --set case={} --store store --until validate --json --quiet",
            path(out)
        );
        let done = calib(root.path(), &words).code(0);
        let document: Value = done.json();
        let rows = document["statistics"].as_array().unwrap().clone();
        let row = rows
            .iter()
            .find(|row| row["step"] == "geometry" && row["set"] == "validate")
            .unwrap()
            .clone();
        row["rms_mm"].as_f64().unwrap() / row["noise_rms_mm"].as_f64().unwrap()
    };
    for (out, remainder) in [("bare", "none"), ("worn", "all")] {
        record(out, remainder).code(0);
    }
    // 60 points leave the 34 numbers of geometry uncertain by a quarter of the noise; 30 arcsec at 2 m are 0.3 mm.
    let (bare, worn) = (held_out("bare"), held_out("worn"));
    assert!((0.85..1.35).contains(&bare), "{bare}");
    assert!(worn > 5.0 * bare, "{worn} against {bare}");

    let truth = read(root.path().join("worn/truth.csv"));
    has(&truth, "\nbacklash.j2.gap,backlash,joint 2,arcsec,60\n");
    let again = record("worn", "all");
    assert!(again.code == Some(2) && again.err.contains("is not empty"));
}

#[test]
fn a_path_and_its_shuffled_rows_have_the_same_poses_and_only_the_path_is_smooth() {
    let poses = |layout| {
        let design = Design {
            layout,
            ..sound(31, 120)
        };
        let case = Case::make(&design, 0, Content::Null).unwrap();
        case.shots
            .iter()
            .take(case.fit)
            .map(|shot| shot.q.clone())
            .collect::<Vec<Vec<f64>>>()
    };
    let step = |poses: &[Vec<f64>]| {
        let apart = |pair: &[Vec<f64>]| {
            pair[0]
                .iter()
                .zip(&pair[1])
                .map(|(a, b)| (a - b).powi(2))
                .sum::<f64>()
                .sqrt()
        };
        poses.windows(2).map(apart).sum::<f64>() / (poses.len() - 1) as f64
    };
    let (mut path, mut shuffled) = (poses(Layout::Path), poses(Layout::Shuffled));
    assert!(
        step(&path) < 0.35 * step(&shuffled),
        "{} and {} rad",
        step(&path),
        step(&shuffled)
    );
    let order = |a: &Vec<f64>, b: &Vec<f64>| a.partial_cmp(b).unwrap();
    path.sort_by(order);
    shuffled.sort_by(order);
    assert_eq!(path, shuffled);
}
