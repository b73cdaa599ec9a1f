//! Dry friction that torques show says on which side of a gap a joint comes to rest: both recordings of an arm in one pipeline.

use super::masses::table;
use super::results::{Solved, arm, calib};
use super::write;
use calib::table::{Document, FindingNumbers, Findings, VerdictSentences};
use calib::twin::torque::TorqueCase;
use std::path::Path;
use std::sync::OnceLock;

/// Joint that has lost motion, from 1, and its whole gap, arcsec.
const JOINT: usize = 3;
const GAP: f64 = 16.0;

const PIPELINE: &str = r#"
calib: 1
name: friction
seed: 3
stages:
  - id: truth
    uses: robot
    with: {file: case/robot.json, format: case}
  - uses: ingest_torques
    with:
      files:
        - file: case/recording.csv
          columns:
            time: {column: time_s, unit: s}
            trajectory: {column: traj}
            usage: {column: use}
            q: {column: "q{j}_deg", unit: deg}
            current: {column: "i{j}_a", unit: A}
  - uses: diagnose_torques
  - uses: masses
  - uses: simulate
    reads: {robot: truth}
    with:
      effects: [{backlash: {joint: 3, gap_arcsec: GAP, closing_nm: FRICTION}}]
      tracker: {position_mm: [2500, -900, 601], noise_um: 10, noise_um_per_m: 2.5, coverage: 2}
      poses: {range_deg: [[-90, 90], [-140, -40], [-55, 95], [-120, 120], [-80, 80], [-160, 160]]}
      blocks: [{usage: fit, points: 71}, {usage: validate, points: 40}]
  - uses: split
    with: {by: usage}
  - id: alone
    uses: diagnose
    reads: {robot: truth}
  - id: together
    uses: diagnose
  - uses: validate
  - uses: report
  - uses: report_torques
"#;

/// What a diagnosis says of the gap; half of it with its standard deviation, arcsec.
fn gap(store: &Path, stage: &str) -> (String, [f64; 2]) {
    let Findings(rows) = table(store, &format!("{stage}/findings"));
    let FindingNumbers(numbers) = table(store, &format!("{stage}/finding_numbers"));
    let place = format!("joint {JOINT}");
    let named: Vec<String> = rows.iter().map(|row| row.statement.clone()).collect();
    let found = rows
        .into_iter()
        .find(|row| row.effect == "backlash" && row.place == place);
    let found = found.unwrap_or_else(|| panic!("no gap but {named:?}"));
    let half = numbers
        .into_iter()
        .find(|number| number.rank == found.rank)
        .unwrap();
    (found.statement, [half.value, half.sigma.unwrap()])
}

/// The arm, and the pipeline that was run on it.
fn solved() -> &'static Solved {
    static SOLVED: OnceLock<Solved> = OnceLock::new();
    SOLVED.get_or_init(|| {
        let solved = Solved {
            folder: tempfile::tempdir().unwrap(),
            case: arm(),
        };
        write(&solved.path("case"), &solved.case.recording());
        let text = PIPELINE
            .replace("GAP", &GAP.to_string())
            .replace("FRICTION", &friction(&solved.case).to_string());
        std::fs::write(solved.path("pipeline.yaml"), text).unwrap();
        calib(
            &format!("run --quiet {}", solved.path("pipeline.yaml").display()),
            &solved.path("store"),
        )
        .code(0);
        solved
    })
}

/// Nm.
fn friction(case: &TorqueCase) -> f64 {
    case.plain_friction()[JOINT - 1][1].unwrap()
}

#[test]
fn a_gap_whose_side_the_loads_seem_to_decide_is_left_to_approach_below_the_friction_of_the_torques()
{
    let (store, friction) = (solved().path("store"), friction(&solved().case));
    let [(alone, before), (together, after)] =
        ["alone", "together"].map(|stage| gap(&store, stage));
    println!(
        "friction {friction:.2} Nm; alone: {alone} {before:.2?}; together: {together} {after:.2?}"
    );
    assert!(!alone.contains("approach"), "{alone}");
    let printed = together
        .split(" Nm")
        .next()
        .and_then(|text| text.rsplit(' ').next())
        .unwrap();
    assert!(
        (printed.parse::<f64>().unwrap() / friction - 1.0).abs() < 0.03,
        "{together}"
    );
    let [half, sigma] = after;
    assert!(
        (half - 0.5 * GAP).abs() < 3.0 * sigma && sigma <= before[1],
        "{after:?}, {before:?}"
    );
}

#[test]
fn each_page_of_a_pipeline_says_what_its_own_diagnosis_says() {
    let store = solved().path("store");
    let message_of = |stage: &str| -> Vec<String> {
        let VerdictSentences(rows) = table(&store, &format!("{stage}/sentences"));
        assert!(rows.iter().all(|row| row.step == stage), "{stage}");
        rows.into_iter().map(|row| row.sentence).collect()
    };
    let page = |stage: &str| -> String {
        let Document(rows) = table(&store, &format!("{stage}/document"));
        let page = rows
            .into_iter()
            .find(|row| row.name.ends_with(".html"))
            .unwrap();
        [
            ("&#x27;", "'"),
            ("&#x2f;", "/"),
            ("&lt;", "<"),
            ("&gt;", ">"),
        ]
        .iter()
        .fold(page.content, |text, (a, b)| text.replace(a, b))
    };
    let (points, torques) = (message_of("together"), message_of("diagnose_torques"));
    println!("points: {points:#?}\ntorques: {torques:#?}");
    assert!(!points.is_empty() && !torques.is_empty());
    let (of_points, of_torques) = (page("report"), page("report_torques"));
    for sentence in &torques {
        assert!(
            of_torques.contains(sentence),
            "{sentence} is not on its page"
        );
        assert!(
            points.contains(sentence) || !of_points.contains(sentence),
            "{sentence} is on the page of the points"
        );
    }
    let shown = |sentence: &&String| of_points.contains(sentence.as_str());
    assert!(
        points.iter().any(|sentence| shown(&sentence)),
        "nothing of {points:?} is on its page"
    );
    for sentence in points.iter().filter(|sentence| !torques.contains(sentence)) {
        assert!(
            !of_torques.contains(sentence),
            "{sentence} is on the page of the torques"
        );
    }
}
