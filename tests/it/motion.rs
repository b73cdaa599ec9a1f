//! Recordings of a moving arm: clocks apart and joints that trail are named with their size, and a sound arm has nothing missing,
//! whether the controller logs velocities or they follow from the joints over time.

use crate::answer::{self, has, read, root, starts_with};
use serde_json::Value;
use std::path::PathBuf;

fn calib(words: &str) -> String {
    answer::calib(".", words).ok()
}

/// Something wrong everywhere that a rigid model takes up, and what `effects` and `motion` say besides.
fn twin(seed: u64, effects: &str, motion: &str, more: &str) -> String {
    let robot = root("pipelines/sr210d/robot.yaml");
    let links = (1..=6).map(|link| {
        format!("{{link: {link}, shift_mm: [0.3, -0.2, 0.4], tilt_arcsec: [40, -60, 20]}}")
    });
    format!(
        "calib: 1\nname: moving\nseed: {seed}\nstages:\n  - {{uses: robot, with: {{file: {robot:?}}}}}\n  - uses: simulate\n    with:\n      truth: {{links: [{}], offset_deg: [0, 0.03, -0.02, 0.05, 0.01, 0]}}\n      effects: [{effects}]\n      motion: {{{motion}}}\n{more}      blocks: [{{usage: fit, points: 130}}, {{usage: validate, points: 40}}, {{usage: fit, points: 130}}, {{usage: validate, points: 40}}, {{usage: fit, points: 140}}]\n",
        links.collect::<Vec<_>>().join(", ")
    )
}

struct Case {
    folder: tempfile::TempDir,
}

impl Case {
    fn record(twin: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let case = Self { folder };
        std::fs::write(case.path("twin.yaml"), twin).unwrap();
        let [twin, out, store] =
            ["twin.yaml", "case", "store"].map(|name| case.path(name).display().to_string());
        calib(&format!(
            "simulate record {twin} --out {out} --store {store} --quiet"
        ));
        case
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `more` are lines of `ingest` beyond those of `pipelines/case`.
    fn diagnose(&self, more: &str) -> Value {
        let original = root("pipelines/case/pipeline.yaml");
        let text = read(original).replace(
            "      join: {by: id}\n",
            &format!("      join: {{by: id}}\n{more}"),
        );
        std::fs::write(self.path("pipeline.yaml"), text).unwrap();
        let [pipeline, case, store] =
            ["pipeline.yaml", "case", "store"].map(|name| self.path(name).display().to_string());
        let printed = calib(&format!(
            "diagnose {pipeline} --set case={case} --store {store} --json --quiet"
        ));
        serde_json::from_str(&printed).unwrap()
    }
}

fn names(diagnosis: &Value) -> Vec<(&str, &str)> {
    let findings = diagnosis["findings"].as_array().unwrap().iter();
    findings
        .map(|f| (f["effect"].as_str().unwrap(), f["where"].as_str().unwrap()))
        .collect()
}

/// The first number of the first finding with its sigma.
fn first(diagnosis: &Value) -> (f64, f64) {
    let number = &diagnosis["findings"][0]["parameters"][0];
    (
        number["value"].as_f64().unwrap(),
        number["sigma"].as_f64().unwrap(),
    )
}

#[test]
fn clocks_that_are_apart_are_named_with_their_milliseconds() {
    let case = Case::record(&twin(
        11,
        "{joint_log_lag: {clock_ms: 2}}",
        "rate_hz: 10",
        "",
    ));
    let found = case.diagnose("");
    assert_eq!(names(&found), [("joint_log_lag", "recording")], "{found:#}");
    let (value, sigma) = first(&found);
    assert!(
        (value - 2.0).abs() < 3.0 * sigma && sigma < 0.05,
        "{value} +- {sigma} ms"
    );
    let printed = found["findings"][0]["statement"].as_str().unwrap();
    starts_with(printed, "the tracker's clock is ");
    has(printed, "ms late relative to the controller's");
    assert_eq!(found["verdict"], "explained");
    // Told so, ingest carries the joints there and nothing is left.
    let cured = case.diagnose(&format!("      motion: {{later_s: {}}}\n", 1e-3 * value));
    assert_eq!(names(&cured), [], "{cured:#}");
}

#[test]
fn a_joint_that_trails_for_its_speed_is_named_at_its_place() {
    let effect = "{viscous_windup: {joint: 3, arcsec_per_deg_s: 3}}";
    let found = Case::record(&twin(
        12,
        effect,
        "rate_hz: 10, shape: moves, dwell_s: 0.2",
        "",
    ))
    .diagnose("");
    assert_eq!(names(&found), [("viscous_windup", "joint 3")], "{found:#}");
    let (value, sigma) = first(&found);
    assert!(
        (value - 3.0).abs() < 3.0 * sigma && sigma < 0.2,
        "{value} +- {sigma}"
    );
    assert_eq!(
        found["findings"][0]["parameters"][0]["unit"],
        "arcsec/(deg/s)"
    );
}

#[test]
fn velocities_by_the_joints_over_time_do_as_well() {
    let logged = "rate_hz: 10, log_velocity: false";
    let derive = "      motion: {}\n";
    let late =
        Case::record(&twin(13, "{joint_log_lag: {clock_ms: -2}}", logged, "")).diagnose(derive);
    assert_eq!(names(&late), [("joint_log_lag", "recording")], "{late:#}");
    let (value, sigma) = first(&late);
    assert!(
        (value + 2.0).abs() < 3.0 * sigma && sigma < 0.05,
        "{value} +- {sigma} ms"
    );
    let trailing = Case::record(&twin(
        14,
        "{viscous_windup: {joint: 5, arcsec_per_deg_s: 8}}",
        logged,
        "",
    ))
    .diagnose(derive);
    assert_eq!(
        names(&trailing),
        [("viscous_windup", "joint 5")],
        "{trailing:#}"
    );
}

/// Deviations of the joints last for many rows: what is left then looks like a cause to whoever counts rows. What is above the stated
/// noise is not called noise either.
#[test]
fn nothing_is_named_on_a_way_though_its_noise_lasts_from_row_to_row() {
    let lasting = twin(
        15,
        "",
        "rate_hz: 20, wander_s: 0.1",
        "      repeatability_arcsec: [1, 1, 1, 1, 1, 1]\n",
    );
    for (twin, verdict) in [
        (twin(16, "", "rate_hz: 10", ""), "nothing_missing"),
        (lasting, "unexplained"),
    ] {
        let found = Case::record(&twin).diagnose("");
        assert_eq!(
            (names(&found), found["verdict"].as_str()),
            (vec![], Some(verdict)),
            "{found:#}"
        );
    }
}

/// In four seconds the arm hardly gets anywhere: what depends on its speed depends on its place as well.
#[test]
fn what_too_short_a_way_would_hide_is_said() {
    let hidden = |rate: &str| {
        let found = Case::record(&twin(18, "", rate, "")).diagnose("");
        let entries = found["not_observable"].as_array().unwrap().clone();
        let about = |name: &str| {
            entries
                .iter()
                .any(|line| line.as_str().is_some_and(|line| line.starts_with(name)))
        };
        (about("joint_log_lag"), about("viscous_windup"))
    };
    assert_eq!(hidden("rate_hz: 150"), (true, true));
    assert!(!hidden("rate_hz: 10").0);
}

#[test]
fn what_a_standing_arm_cannot_show_is_refused_in_its_twin() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("twin.yaml");
    let text = twin(
        17,
        "{viscous_windup: {joint: 3, arcsec_per_deg_s: 3}}",
        "",
        "",
    )
    .replace("      motion: {}\n", "");
    std::fs::write(&path, text).unwrap();
    let (path, out) = (
        path.display().to_string(),
        folder.path().join("out").display().to_string(),
    );
    let arguments = &format!("simulate record {path} --out {out} --store {out}-store --quiet");
    let refused = answer::calib(".", arguments).code(2);
    has(&refused.err, ["effects[0]", "moving arm only"]);
}
