//! Concealed recordings: what they hide is there, nulls hide nothing, and a seed gives the same bytes whoever works on it.

use calib::twin::conceal::case::Case;
use calib::twin::conceal::design::{Content, Design};
use calib::twin::conceal::family::FAMILIES;
use std::path::Path;
use std::process::{Command, Output};

/// Names of the list of effects that a diagnosis may use.
const NAMES: [&str; 19] = [
    "joint_compliance",
    "joint_hardening",
    "link_compliance",
    "base_compliance",
    "gear_cyclic",
    "gear_motor_cyclic",
    "backlash",
    "thermal_growth",
    "counterbalance",
    "link_mass",
    "payload_error",
    "cable_drag",
    "axis_wobble",
    "zero_shift",
    "tool_shift",
    "base_shift",
    "tracker_drift",
    "joint_log_lag",
    "unknown",
];

fn is_a_place(place: &str) -> bool {
    let number = |text: &str| text.parse::<usize>().is_ok_and(|number| (1..=9).contains(&number));
    match place.split_once(' ') {
        None => ["base", "tool", "tracker", "recording"].contains(&place),
        Some(("joint", rest)) => number(rest),
        Some(("link", rest)) => rest.split_once('-').map_or_else(|| number(rest), |(a, b)| number(a) && number(b) && a < b),
        Some(_) => false,
    }
}

#[test]
fn every_family_moves_the_tool_and_is_wanted_by_a_canonical_name() {
    for (row, family) in FAMILIES.iter().enumerate() {
        for other_forms in [0.0, 1.0] {
            let design = Design { seed: 5, cases: 1, points: Some(40), other_forms, faulty: 0.0, ..Design::default() };
            let case = Case::make(&design, row, Content::Single(row)).expect("a case");
            let name = format!("{} ({})", family.name, case.concealed.first().map_or("", |one| one.form));
            assert!(!case.concealed.is_empty(), "{name} hides nothing");
            assert!(case.concealed.iter().any(|one| one.cause.effect == family.name), "{name} hides something else");
            for one in &case.concealed {
                assert!(one.raw_mm > 1e-5, "{name} moves the tool by {} mm", one.raw_mm);
                assert!(one.visible_mm <= one.raw_mm && one.strength <= one.strength_alone * (1.0 + 1e-9), "{name}");
            }
            for (effect, place) in case.want() {
                assert!(NAMES.contains(&effect) && is_a_place(&place), "{effect} at {place}");
            }
        }
    }
}

/// Of single effects that are sized, most are as visible as drawn: the strength is that of the differences between two recordings.
#[test]
fn an_effect_is_as_visible_as_the_seal_says() {
    let row = FAMILIES.iter().position(|family| family.name == "gear_cyclic").expect("a family");
    let design = Design { seed: 3, points: Some(120), natural: 0.0, faulty: 0.0, other_forms: 0.0, ..Design::default() };
    let case = Case::make(&design, 0, Content::Single(row)).expect("a case");
    let one = &case.concealed[0];
    let from_sizes = 3.0 * 120.0 * (one.visible_mm / case.noise_mm[0]).powi(2);
    assert!((one.strength / from_sizes - 1.0).abs() < 1e-9, "{} against {from_sizes}", one.strength);
    assert!((0.9..=5100.0).contains(&one.strength), "{}", one.strength);
    // 6 joints with 4 numbers each and 3 of the tool, ratios, one coupling on the big robot; the rank does not hang on rounding.
    let joints = case.robot.joints.len();
    assert_eq!(case.geometry_rank, 4 * joints + 3 + joints + case.robot.couplings.len());
}

#[test]
fn a_null_hides_nothing_and_wants_nothing() {
    let design = Design { seed: 2, points: Some(40), faulty: 0.0, ..Design::default() };
    for number in 0..4 {
        let case = Case::make(&design, number, Content::Null).expect("a case");
        assert!(case.concealed.is_empty() && case.want().is_empty() && case.tampered.is_empty());
    }
}

#[test]
fn shares_are_kept_and_pairs_sit_in_two_places() {
    let design = Design { seed: 4, cases: 40, nulls: 0.25, pairs: 0.2, open: 0.1, points: Some(30), ..Design::default() };
    let contents = design.contents();
    let count = |what: fn(&Content) -> bool| contents.iter().filter(|content| what(content)).count();
    assert_eq!(count(|content| matches!(content, Content::Null)), 10);
    assert_eq!(count(|content| matches!(content, Content::Pair(..))), 8);
    let open = count(|content| matches!(content, Content::Single(row) if FAMILIES[*row].name == "unknown"));
    assert_eq!(open, 4);
    for (number, content) in contents.iter().enumerate().filter(|(_, content)| matches!(content, Content::Pair(..))) {
        let case = Case::make(&design, number, *content).expect("a case");
        let places: Vec<&str> = case.concealed.iter().map(|one| one.cause.place.as_str()).collect();
        assert!(places.len() == 2 && places[0] != places[1], "{places:?}");
    }
}

fn calib(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calib")).args(arguments).output().expect("the binary")
}

fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut out = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below").to_string_lossy().into_owned();
                out.push((name, std::fs::read(&path).expect("a file")));
            }
        }
    }
    out.sort();
    out
}

#[test]
fn a_seed_gives_the_same_bytes_on_one_and_two_threads() {
    let root = tempfile::tempdir().expect("a folder");
    let made: Vec<Vec<(String, Vec<u8>)>> = ["1", "2"]
        .map(|jobs| {
            let out = root.path().join(jobs);
            let text = out.to_string_lossy().into_owned();
            let done = calib(&["simulate", "conceal", "--out", &text, "--cases", "4", "--points", "30", "--jobs", jobs]);
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
            files(&out)
        })
        .into();
    assert_eq!(made[0].len(), 4 * 4 + 1);
    assert_eq!(made[0], made[1]);
}
