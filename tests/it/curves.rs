//! Curves of findings hold what the forms of each finding do, whatever the finding is called.

use crate::fixture;
use crate::recorded::{self, Recorded, made};
use calib::description::{JointKind, RobotDescription};
use calib::effect::{Form, Load};
use calib::robot::RobotModel;
use calib::stage::{Labelled, Report, ReportReads};
use calib::table::*;
use serde_json::json;

const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;
const ROWS: usize = 40;

fn labelled<T>(table: T) -> Vec<Labelled<T>> {
    vec![recorded::labelled("diagnose", table)]
}

fn finding(rank: i64, effect: &str, forms: &serde_json::Value) -> FindingRow {
    FindingRow {
        rank,
        effect: effect.into(),
        place: "joint 3".into(),
        statement: String::new(),
        forms: forms.to_string(),
        ..Default::default()
    }
}

/// A recording of an arm whose whole model are forms with their sizes in stored units, and the curves of its findings.
fn curves_of(
    description: &RobotDescription,
    forms: &[(&serde_json::Value, &[f64])],
    findings: Vec<FindingRow>,
) -> (Recording, Curves) {
    let robot = RobotModel::new(description.clone());
    let mut parameters = Parameters::default();
    for (form, sizes) in forms {
        let parsed: Form = serde_json::from_value((*form).clone()).unwrap();
        let text = serde_json::to_string(&parsed).unwrap();
        for (spec, size) in parsed.parameters(&robot).into_iter().zip(*sizes) {
            parameters.0.push(ParameterRow {
                name: spec.name,
                effect: parsed.name().into(),
                place: spec.place.to_string(),
                unit: spec.unit.symbol().into(),
                nominal: 0.0,
                value: *size,
                change: *size,
                status: "free".into(),
                step: "diagnose".into(),
                form: Some(text.clone()),
                ..Default::default()
            });
        }
    }
    parameters.0.sort_by(|a, b| a.name.cmp(&b.name));
    let model = parameters.model(robot, &[], Load::GravityTorque).unwrap();
    let joints = description.joints.len();
    let mut recording = Recording {
        joints,
        prismatic: description
            .joints
            .iter()
            .map(|joint| joint.kind == JointKind::Prismatic)
            .collect(),
        sequence: (0..ROWS as i64).collect(),
        point_id: (0..ROWS).map(|row| format!("P{row}")).collect(),
        usage: vec![None; ROWS],
        q: fixture::poses(description, ROWS),
        position: vec![[0.0; 3]; ROWS],
        ..Recording::default()
    };
    recording.position = model
        .predict(&recording.measurements())
        .into_iter()
        .map(Into::into)
        .collect();
    let data = recording.measurements();
    let robot = Robot::from_description(description);
    let Recorded { robot, split, .. } = Recorded::dealt(robot, recording.clone(), |_| "validate");
    let prediction = Prediction::of(
        "diagnose",
        &model,
        &data,
        &recording,
        &split,
        &[true; ROWS],
        None,
    );
    let reads = ReportReads {
        statistics: Statistics::default(),
        prediction: labelled(prediction),
        parameters: parameters.clone(),
        robot,
        recording: recording.clone(),
        convention: vec![],
        split,
        intake: Vec::new(),
        rejected: Vec::new(),
        fit: Vec::new(),
        observability: Vec::new(),
        training: Vec::new(),
        corrections: Vec::new(),
        models: labelled(parameters),
        verdict: Vec::new(),
        sentences: Vec::new(),
        findings: labelled(Findings(findings)),
        finding_numbers: Vec::new(),
        rivals: Vec::new(),
        forms: Vec::new(),
        cells: Vec::new(),
        suspects: Vec::new(),
    };
    (recording, made(&Report::default(), reads).get())
}

#[test]
fn a_pull_with_a_gear_error_in_it_and_a_gear_error_beside_it_each_have_their_own_curve() {
    // Joint 3: products of q2 and q3, what goes once a turn, what goes twice.
    let wave = |order: u32| json!({"wave": {"order": order, "overtone": false}});
    let angle = |joint: usize| json!({"angle": {"joint": joint}});
    let motion = json!({"joint": {"joint": 2}});
    let times = json!({"of": angle(2), "basis": wave(1)});
    let pull = json!({"unknown": {"motion": motion, "law": {"of": angle(1), "basis": wave(1), "times": times}}});
    let gear = |order: u32| json!({"gear_cyclic": {"motion": motion, "law": {"of": angle(2), "basis": wave(order)}}});
    let (once, twice) = (gear(1), gear(2));
    let pulled = [9.0, -4.0, 6.0, 3.0].map(|size| size * ARCSEC);
    let [geared, evenly] = [[5.0, -7.0], [-8.0, 2.0]].map(|sizes| sizes.map(|size| size * ARCSEC));
    let findings = vec![
        finding(1, "cable_drag", &json!([pull, once])),
        finding(2, "gear_cyclic", &json!([twice])),
    ];
    let (recording, curves) = curves_of(
        &fixture::spherical(),
        &[(&pull, &pulled), (&once, &geared), (&twice, &evenly)],
        findings,
    );
    assert_eq!(curves.0.len(), 2 * ROWS);
    for point in &curves.0 {
        let q = recording.q(point.sequence as usize);
        let ((s2, c2), (s3, c3)) = (q[1].sin_cos(), q[2].sin_cos());
        let arcsec = match point.rank {
            1 => {
                9.0 * s2 * s3 - 4.0 * s2 * c3 + 6.0 * c2 * s3 + 3.0 * c2 * c3 + 5.0 * s3 - 7.0 * c3
            }
            _ => -8.0 * (2.0 * q[2]).sin() + 2.0 * (2.0 * q[2]).cos(),
        };
        assert_eq!(
            (point.over.as_str(), point.unit.as_str()),
            ("joint 3", "rad")
        );
        assert!((point.x - q[2]).abs() < 1e-12);
        // A chord is the arc to second order.
        assert!(
            (point.fitted / ARCSEC - arcsec).abs() < 0.01,
            "{point:?}: {arcsec} arcsec"
        );
        assert!(
            point.with.abs() < 1e-9 && (point.without - point.fitted).abs() < 1e-9,
            "{point:?}"
        );
    }
}

#[test]
fn what_a_joint_that_slides_errs_by_is_put_over_its_place_in_millimetres() {
    let law =
        json!({"of": {"angle": {"joint": 0}}, "basis": {"rise": {"centre": 1.2, "width": 0.3}}});
    let rise = json!({"unknown": {"motion": {"joint": {"joint": 0}}, "law": law}});
    let one = FindingRow {
        place: "joint 1".into(),
        ..finding(1, "unknown", &json!([rise]))
    };
    let (recording, curves) = curves_of(&fixture::on_track(), &[(&rise, &[0.4])], vec![one]);
    assert_eq!(curves.0.len(), ROWS);
    for point in &curves.0 {
        let q = recording.q(point.sequence as usize)[0];
        assert_eq!(
            (
                point.over.as_str(),
                point.x_unit.as_str(),
                point.unit.as_str()
            ),
            ("joint 1", "mm", "mm")
        );
        assert!((point.x - 1e3 * q).abs() < 1e-9, "{point:?}");
        let mm = 0.4 * ((q - 1.2) / 0.3).tanh();
        // A length has the sign of the direction in which most of it goes.
        assert!(
            (point.fitted.abs() - mm.abs()).abs() < 1e-6,
            "{point:?}: {mm} mm"
        );
    }
}
