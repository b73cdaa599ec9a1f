//! Fabricated tables of a whole pipeline: an arm whose error each step makes smaller, with files, fits and a training.

use super::validate;
use calib::stage::{Labelled, ReportReads};
use calib::table::*;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};

pub fn point(
    sequence: i64,
    step: &str,
    set: &str,
    held_out: bool,
    residual: [f64; 3],
) -> PredictionRow {
    let [dx_mm, dy_mm, dz_mm] = residual;
    PredictionRow {
        sequence,
        point_id: format!("P{sequence}"),
        set: set.into(),
        step: step.into(),
        held_out,
        suspect: false,
        x_mm: 1000.0 + 10.0 * sequence as f64,
        y_mm: -500.0,
        z_mm: 800.0,
        dx_mm,
        dy_mm,
        dz_mm,
        error_mm: (dx_mm * dx_mm + dy_mm * dy_mm + dz_mm * dz_mm).sqrt(),
        noise_mm: 0.03 + 0.01 * (sequence % 2) as f64,
        noise_basis: None,
        sigma_mm: None,
        fold_error_mm: None,
        block_error_mm: None,
        weight: None,
        measured: None,
        turn_rad: None,
        remark: None,
    }
}

/// Noise and a smooth remainder that each step makes smaller.
fn predictions() -> Vec<Prediction> {
    let mut random = ChaCha8Rng::seed_from_u64(20200116);
    let mut normal = move || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let steps = [
        ("nominal", 2.0, 0.6),
        ("geometry", 0.55, 0.3),
        ("stiffness", 0.25, 0.16),
        ("network", 0.05, 0.1),
    ];
    let places: Vec<[f64; 3]> = (0..500)
        .map(|_| {
            [
                1900.0 + 420.0 * normal(),
                600.0 * normal(),
                1100.0 + 330.0 * normal(),
            ]
        })
        .collect();
    let step = |(name, smooth, rough): (&str, f64, f64), normal: &mut dyn FnMut() -> f64| {
        let rows = places.iter().zip(0..).map(|([x, y, z], k)| {
            let set = [
                "unloaded_fit",
                "unloaded_check",
                "loaded",
                "learn",
                "learn",
                "check",
                "check",
                "check",
                "learn",
                "learn",
            ];
            let set = set[(k % 10) as usize];
            let fitted = match set {
                "unloaded_fit" => name != "nominal",
                "loaded" => name == "stiffness" || name == "network",
                "learn" => name == "network",
                _ => false,
            };
            let residual = [
                smooth * (y / 700.0).sin() + rough * 0.6 * normal(),
                smooth * 0.7 * (x / 500.0).cos() + rough * 0.6 * normal(),
                -smooth * (0.4 + (x - 1900.0) / 1200.0) + rough * 0.6 * normal(),
            ];
            PredictionRow {
                x_mm: *x,
                y_mm: *y,
                z_mm: *z,
                ..point(k, name, set, !fitted, residual)
            }
        });
        Prediction(rows.collect())
    };
    steps.into_iter().map(|s| step(s, &mut normal)).collect()
}

fn parameter(
    name: &str,
    effect: &str,
    place: &str,
    unit: &str,
    numbers: [f64; 3],
    status: &str,
    remark: Option<&str>,
) -> ParameterRow {
    let [nominal, value, sigma] = numbers;
    ParameterRow {
        name: name.into(),
        effect: effect.into(),
        place: place.into(),
        unit: unit.into(),
        nominal,
        value,
        change: value - nominal,
        sigma: (sigma > 0.0).then_some(sigma),
        status: status.into(),
        step: if effect == "joint_compliance" {
            "stiffness"
        } else {
            "geometry"
        }
        .into(),
        remark: remark.map(str::to_owned),
        form: None,
        corrects: None,
        robot: None,
        kinematics: None,
    }
}

fn parameters() -> Parameters {
    let mut rows = Vec::new();
    for (axis, value) in ["x", "y", "z"].into_iter().zip([12.412, -3.207, 880.114]) {
        let name = format!("base_frame.{axis}");
        rows.push(parameter(
            &name,
            "base_frame",
            "base",
            "mm",
            [0.0, value, 0.0113],
            "free",
            None,
        ));
    }
    rows.push(parameter(
        "base_frame.rz",
        "base_frame",
        "base",
        "rad",
        [0.0, 0.002_341_7, 8.1e-6],
        "free",
        None,
    ));
    for j in 1..=6 {
        let value = [3.1e-4, -1.2e-3, 7.7e-4, -2.0e-4, 1.1e-3, 0.0][j - 1];
        let status = if j == 6 { "unseen" } else { "earlier" };
        let sigma = if j == 6 { 0.0 } else { 9e-6 * j as f64 };
        let remark = (j == 6).then_some("the measured point lies on the axis of joint 6");
        let name = format!("joint_offset.j{j}");
        rows.push(parameter(
            &name,
            "joint_offset",
            &format!("joint {j}"),
            "rad",
            [0.0, value, sigma],
            status,
            remark,
        ));
    }
    for (j, axis) in [(2, "x"), (2, "z"), (3, "x"), (3, "z"), (4, "y")] {
        let redundant = (j, axis) == (3, "z");
        let numbers = if redundant {
            [0.0; 3]
        } else {
            [0.0, 0.31 * j as f64 - 0.9, 0.021]
        };
        let remark =
            redundant.then_some("does the same as link_geometry.l2.z with joint_offset.j2");
        let status = if redundant { "redundant" } else { "free" };
        let name = format!("link_geometry.l{j}.{axis}");
        rows.push(parameter(
            &name,
            "link_geometry",
            &format!("link {j}"),
            "mm",
            numbers,
            status,
            remark,
        ));
    }
    for j in 1..=6 {
        let numbers = [1.0, 1.0 + 1.3e-4 * (j as f64 - 3.2), 6e-6];
        rows.push(parameter(
            &format!("reduction_ratio.j{j}"),
            "reduction_ratio",
            &format!("joint {j}"),
            "1",
            numbers,
            "free",
            None,
        ));
    }
    for j in 2..=3 {
        let numbers = [0.0, 4.1e-7 * j as f64, 1.2e-8];
        let name = format!("joint_compliance.j{j}");
        rows.push(parameter(
            &name,
            "joint_compliance",
            &format!("joint {j}"),
            "rad/Nm",
            numbers,
            "free",
            None,
        ));
    }
    Parameters(rows)
}

fn diagnosed<T>(table: T) -> Vec<Labelled<T>> {
    vec![Labelled {
        stage: "diagnose".into(),
        table,
    }]
}

fn verdict() -> Verdict {
    Verdict(vec![VerdictRow {
        step: "diagnose".into(),
        verdict: "explained".into(),
        statement: None,
        noise_basis: Some("repeats".into()),
        noise_floor_mm: Some(0.035),
        held_out: true,
        before_mean_mm: Some(0.31),
        before_rms_mm: Some(0.36),
        before_max_mm: Some(0.9),
        after_mean_mm: Some(0.034),
        after_rms_mm: Some(0.037),
        after_max_mm: Some(0.08),
        leftover_rms_mm: Some(0.034),
        noise_floor_rad: None,
        before_rms_rad: None,
        after_rms_rad: None,
        leftover_rms_rad: None,
        chi_square: 1.02,
        p_before: Some(1e-12),
        p_after: Some(0.4),
        repeatability_rad: 2e-6,
        repeats: 0,
        points: 300,
        signature: None,
        clock: Some("s".into()),
    }])
}

fn sentences() -> VerdictSentences {
    let unseen = [
        "temperature: none was recorded",
        "tracker_scale: <measure> a scale bar",
    ]
    .map(String::from);
    VerdictSentences::of("diagnose", &[(VerdictTopic::NotObservable, &unseen)])
}

/// Joint 2 is asked twice and has a finding by its angle; of its load something is left, of a coupling to it nothing.
pub fn cells() -> Cells {
    let row = |moment: &str, place: &str, follows: &str, explains: f64, delta_bic: f64| CellRow {
        moment: moment.into(),
        place: place.into(),
        follows: follows.into(),
        explains_mm: Some(explains),
        delta_bic,
        effect: "unknown".into(),
    };
    Cells(vec![
        row("after", "base", "time", 0.001, -9.0),
        row("after", "joint 1->2", "other angle", 0.001, -9.0),
        row("after", "joint 2", "load", 0.012, 4.0),
        row("after", "joint 2", "own angle", 0.001, -9.0),
        row("after", "link 1-2", "temperature", 0.001, -9.0),
    ])
}

pub fn findings() -> Findings {
    Findings(vec![FindingRow {
        rank: 1,
        effect: "gear_cyclic".into(),
        place: "joint 2".into(),
        follows: Some("own angle".into()),
        statement: "joint 2 turns unevenly, twice a turn by 25 arcsec <b>".into(),
        f_statistic: Some(812.0),
        p_value: Some(1e-40),
        delta_bic: Some(330.0),
        heldout_gain_mm: Some(0.3),
        effect_rms_mm: Some(0.28),
        heldout_gain_rad: None,
        effect_rms_rad: None,
        probability: Some(0.85),
        place_probability: Some(0.95),
        none_probability: Some(0.05),
        valid_joint: Some(2),
        valid_from_rad: Some(-0.8),
        valid_to_rad: Some(1.1),
        valid_from_mm: None,
        valid_to_mm: None,
        forms: "[]".into(),
    }])
}

fn numbers() -> FindingNumbers {
    let number = |name: &str, value| FindingNumberRow {
        rank: 1,
        name: name.into(),
        value,
        unit: "arcsec".into(),
        sigma: Some(0.4),
    };
    FindingNumbers(vec![number("amplitude", 25.1), number("phase", 3.2)])
}

fn rivals() -> Rivals {
    Rivals(vec![RivalRow {
        rank: 1,
        effect: "joint_table".into(),
        place: "joint 2".into(),
        delta_bic: 4.0,
        probability: Some(0.1),
    }])
}

fn formulas() -> Forms {
    let number = |number: &str, value, unit: &str| FormRow {
        rank: 1,
        form: 1,
        number: number.into(),
        formula: "exp(-((q - centre) / width)^2)".into(),
        price: 10,
        folds_rms_mm: 0.021,
        curve_rms_mm: 0.022,
        without_rms_mm: Some(0.055),
        proposed: true,
        value,
        unit: unit.into(),
        sigma: Some(0.02),
        declaration: "{}".into(),
    };
    Forms(vec![
        number("c1", 53.2, "arcsec"),
        number("centre", -0.71, "rad"),
        number("width", 0.6, "rad"),
    ])
}

fn robot(name: &str) -> Robot {
    let body = |body: i64, name: &str, kind: &str, axis: [f64; 3], point: [f64; 3]| RobotRow {
        body,
        name: name.into(),
        kind: kind.into(),
        axis_x: Some(axis[0]).filter(|_| kind != "tool"),
        axis_y: Some(axis[1]).filter(|_| kind != "tool"),
        axis_z: Some(axis[2]).filter(|_| kind != "tool"),
        point_x_mm: Some(point[0]),
        point_y_mm: Some(point[1]),
        point_z_mm: Some(point[2]),
        lower_rad: (kind == "revolute").then_some(-2.5),
        upper_rad: (kind == "revolute").then_some(2.5),
        lower_mm: None,
        upper_mm: None,
        reduction_ratio: None,
        motor_constant_nm_a: None,
        mass_kg: (kind == "tool").then_some(210.0),
        centre_x_mm: None,
        centre_y_mm: None,
        centre_z_mm: None,
        orientation_w: None,
        orientation_x: None,
        orientation_y: None,
        orientation_z: None,
        gravity_m_s2: None,
        couplings: None,
        inertia_xx_kg_m2: None,
        inertia_xy_kg_m2: None,
        inertia_xz_kg_m2: None,
        inertia_yy_kg_m2: None,
        inertia_yz_kg_m2: None,
        inertia_zz_kg_m2: None,
        tolerance_mass: None,
        tolerance_centre_mm: None,
        tolerance_inertia: None,
        coulomb_nm: None,
    };
    let axes = [
        ([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
        ([0.0, -1.0, 0.0], [312.0, 0.0, 670.0]),
        ([0.0, -1.0, 0.0], [312.0, 0.0, 1745.0]),
    ];
    let mut rows = vec![body(0, name, "base", [0.0, 0.0, -1.0], [0.0; 3])];
    rows.extend(
        axes.iter()
            .zip(1..)
            .map(|((axis, at), j)| body(j, &format!("A{j}"), "revolute", *axis, *at)),
    );
    rows.push(body(4, "flange", "tool", [0.0; 3], [1954.0, 60.0, 1400.0]));
    Robot(rows)
}

fn fits() -> Vec<Labelled<Fit>> {
    let fit = |step: &str, start: f64, end: f64| {
        let rows = (0..8).map(|k| {
            let rms_mm = end + (start - end) * 0.12f64.powi(k as i32);
            FitRow {
                step: step.into(),
                iteration: k,
                cost: rms_mm * rms_mm * 5e4,
                rms_mm,
                gradient: 10f64.powi(2 - k as i32),
                step_norm: 10f64.powi(-(k as i32)),
                damping: 1e-3,
                stop: (k == 7).then(|| "converged: gradient".into()),
            }
        });
        Labelled {
            stage: step.into(),
            table: Fit(rows.collect()),
        }
    };
    vec![fit("geometry", 2.4, 0.31), fit("stiffness", 1.5, 0.22)]
}

fn observability() -> Vec<Labelled<Observability>> {
    let row = |quantity: &str, index: i64, value: f64, meaning: &str| ObservabilityRow {
        step: "geometry".into(),
        quantity: quantity.into(),
        index,
        value,
        meaning: meaning.into(),
    };
    let mut rows = vec![
        row(
            "rank",
            0,
            27.0,
            "directions of the parameters that the data see",
        ),
        row(
            "rank_expected",
            0,
            27.0,
            "directions that this kind of robot can show",
        ),
        row(
            "condition",
            0,
            812.4,
            "largest over smallest seen singular value",
        ),
        row(
            "O1",
            0,
            0.0183,
            "root of the product of the singular values over the root of the rows",
        ),
    ];
    rows.extend((1..=35).map(|k| {
        let value = 12_000.0 * 0.79f64.powi(k as i32);
        row(
            "singular_value",
            k,
            value,
            "of the whitened Jacobian, columns scaled to unit prior sigma",
        )
    }));
    vec![Labelled {
        stage: "geometry".into(),
        table: Observability(rows),
    }]
}

fn training() -> Vec<Labelled<Training>> {
    let phase = |phase: &str, count: i64, start: f64, end: f64| {
        let phase = phase.to_owned();
        (0..count).map(move |g| {
            let train_rms_mm = end + (start - end) * (-6.0 * g as f64 / count as f64).exp();
            TrainingRow {
                step: "network".into(),
                phase: phase.clone(),
                member: i64::from(phase == "gradient"),
                generation: g,
                best: train_rms_mm * 0.5,
                train_rms_mm,
                check_rms_mm: Some(train_rms_mm * 1.12 + 0.01),
                evaluations: (g + 1) * 60,
            }
        })
    };
    let rows = phase("swarm", 400, 0.62, 0.3)
        .chain(phase("gradient", 120, 0.3, 0.17))
        .collect();
    vec![Labelled {
        stage: "network".into(),
        table: Training(rows),
    }]
}

fn corrections() -> Vec<Labelled<Corrections>> {
    let row = |rival: &str, mean: Option<f64>, chosen: bool, reason: &str| CorrectionsRow {
        step: "network".into(),
        rival: rival.into(),
        chosen,
        reason: reason.into(),
        before_mm: 0.81,
        mean_mm: mean,
        rms_mm: mean.map(|mean| 1.1 * mean),
        max_mm: mean.map(|mean| 3.0 * mean),
        gain_mm: mean.map(|mean| 0.81 - mean),
        gain_sigma_mm: mean.map(|_| 0.021),
        numbers: if rival == "none" { 0 } else { 123 },
        evaluations: 7,
        hidden: rival.starts_with("mlp").then_some(12),
        decay: rival.starts_with("mlp").then_some(3.0),
    };
    let rows = vec![
        row("none", Some(0.81), false, "a correction gains 0.260 mm"),
        row("ridge", Some(0.62), false, "0.070 mm behind mlp_bso <b>"),
        row(
            "mlp_bso",
            Some(0.55),
            true,
            "smallest error of those that help: gains 0.260 +- 0.021 mm",
        ),
        row(
            "curves",
            None,
            false,
            "it could not be fitted to these rows",
        ),
    ];
    vec![Labelled {
        stage: "network".into(),
        table: Corrections(rows),
    }]
}

fn rejected(rows: i64) -> Vec<Labelled<Rejected>> {
    let row = |k: i64| RejectedRow {
        file: "tracker.csv".into(),
        line: 17 + 9 * k,
        point_id: (k % 2 == 0).then(|| format!("P{k:04}")),
        reason: ["not_a_number", "lost_beam", "duplicate_id"][(k % 3) as usize].into(),
        detail: "column `x`: `--` is no number; a decimal number in mm is expected".into(),
        text: format!(
            "P{k:04};--;-512.003;1093.442;2026-11-02T09:14:{:02}.120",
            k % 60
        ),
    };
    vec![Labelled {
        stage: "ingest".into(),
        table: Rejected((0..rows).map(row).collect()),
    }]
}

/// The tables of a whole pipeline of a robot with this name.
pub fn tables(name: &str) -> ReportReads {
    let prediction = predictions();
    let last = &prediction[3].0;
    let split = last
        .iter()
        .map(|r| SplitRow {
            sequence: r.sequence,
            point_id: r.point_id.clone(),
            set: r.set.clone(),
        })
        .collect();
    let recording = Recording {
        joints: 3,
        prismatic: vec![false; 3],
        sequence: last.iter().map(|r| r.sequence).collect(),
        point_id: last.iter().map(|r| r.point_id.clone()).collect(),
        usage: last.iter().map(|r| Some(r.set.clone())).collect(),
        q: (0..3 * last.len())
            .map(|k| (0.37 * k as f64).sin())
            .collect(),
        position: last
            .iter()
            .map(|r| [r.x_mm, r.y_mm, r.z_mm].map(|mm| mm / 1e3))
            .collect(),
        payload: Some(vec![210.0; last.len()]),
        current: Some(vec![1.0; 3 * last.len()]),
        ..Recording::default()
    };
    let intake = IntakeRow {
        file: "tracker.csv".into(),
        lines: 564,
        read: 561,
        accepted: 500,
        rejected: 61,
    };
    ReportReads {
        statistics: validate(prediction.clone()),
        prediction: prediction
            .into_iter()
            .map(|table| Labelled {
                stage: "identify".into(),
                table,
            })
            .collect(),
        parameters: parameters(),
        robot: robot(name),
        recording,
        convention: vec![],
        split: Split(split),
        intake: vec![Labelled {
            stage: "ingest".into(),
            table: Intake(vec![intake]),
        }],
        rejected: rejected(61),
        fit: fits(),
        observability: observability(),
        training: training(),
        corrections: corrections(),
        models: Vec::new(),
        verdict: diagnosed(verdict()),
        sentences: diagnosed(sentences()),
        findings: diagnosed(findings()),
        finding_numbers: diagnosed(numbers()),
        rivals: diagnosed(rivals()),
        forms: diagnosed(formulas()),
        cells: diagnosed(cells()),
        suspects: Vec::new(),
    }
}
