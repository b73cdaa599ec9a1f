//! Fabricated tables of a whole pipeline: an arm whose error each step makes smaller, with files, fits and a training.

use super::validate;
use crate::recorded::labelled;
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
        ..Default::default()
    }
}

/// Noise and a smooth remainder that each step makes smaller.
fn predictions(points: usize) -> Vec<Prediction> {
    let mut random = ChaCha8Rng::seed_from_u64(20200116);
    let mut normal = move || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let steps = [
        ("nominal", 2.0, 0.6),
        ("geometry", 0.55, 0.3),
        ("stiffness", 0.25, 0.16),
        ("network", 0.05, 0.1),
    ];
    let places: Vec<[f64; 3]> = (0..points)
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
        ..Default::default()
    }
}

fn parameters() -> Parameters {
    let mut rows = Vec::new();
    let mut add = |effect: &str,
                   stage_id: &str,
                   [place, unit]: [&str; 2],
                   numbers: [f64; 3],
                   [status, remark]: [&str; 2]| {
        let remark = Some(remark).filter(|remark| !remark.is_empty());
        let name = format!("{effect}.{stage_id}");
        rows.push(parameter(
            &name, effect, place, unit, numbers, status, remark,
        ));
    };
    let free = ["free", ""];
    for (axis, value) in [("x", 12.412), ("y", -3.207), ("z", 880.114)] {
        add(
            "base_frame",
            axis,
            ["base", "mm"],
            [0.0, value, 0.0113],
            free,
        );
    }
    add(
        "base_frame",
        "rz",
        ["base", "rad"],
        [0.0, 0.002_341_7, 8.1e-6],
        free,
    );
    let last = ["unseen", "the measured point lies on the axis of joint 6"];
    for (j, value) in (1..).zip([3.1e-4, -1.2e-3, 7.7e-4, -2.0e-4, 1.1e-3, 0.0]) {
        let (sigma, says) = if j == 6 {
            (0.0, last)
        } else {
            (9e-6 * f64::from(j), ["earlier", ""])
        };
        let place = format!("joint {j}");
        add(
            "joint_offset",
            &format!("j{j}"),
            [&place, "rad"],
            [0.0, value, sigma],
            says,
        );
    }
    let same = [
        "redundant",
        "does the same as link_geometry.l2.z with joint_offset.j2",
    ];
    for (j, axis) in [(2, "x"), (2, "z"), (3, "x"), (3, "z"), (4, "y")] {
        let (numbers, says) = if (j, axis) == (3, "z") {
            ([0.0; 3], same)
        } else {
            ([0.0, 0.31 * f64::from(j) - 0.9, 0.021], free)
        };
        add(
            "link_geometry",
            &format!("l{j}.{axis}"),
            [&format!("link {j}"), "mm"],
            numbers,
            says,
        );
    }
    for j in 1..=6 {
        let numbers = [1.0, 1.0 + 1.3e-4 * (f64::from(j) - 3.2), 6e-6];
        add(
            "reduction_ratio",
            &format!("j{j}"),
            [&format!("joint {j}"), "1"],
            numbers,
            free,
        );
    }
    for j in 2..=3 {
        let numbers = [0.0, 4.1e-7 * f64::from(j), 1.2e-8];
        add(
            "joint_compliance",
            &format!("j{j}"),
            [&format!("joint {j}"), "rad/Nm"],
            numbers,
            free,
        );
    }
    Parameters(rows)
}

fn of<T>(stage: &str, table: T) -> Vec<Labelled<T>> {
    vec![labelled(stage, table)]
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
        chi_square: 1.02,
        p_before: Some(1e-12),
        p_after: Some(0.4),
        repeatability_rad: 2e-6,
        repeats: 0,
        points: 300,
        clock: Some("s".into()),
        ..Default::default()
    }])
}

fn sentences() -> VerdictSentences {
    let unseen = [
        "temperature: none was recorded",
        "tracker scale: <measure> a scale bar",
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
        probability: Some(0.85),
        place_probability: Some(0.95),
        none_probability: Some(0.05),
        valid_joint: Some(2),
        valid_from_rad: Some(-0.8),
        valid_to_rad: Some(1.1),
        forms: "[]".into(),
        ..Default::default()
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
        mass_kg: (kind == "tool").then_some(210.0),
        gravity_m_s2: (kind == "base").then_some(9.81),
        centre_x_mm: (kind == "tool").then_some(1954.0),
        centre_y_mm: (kind == "tool").then_some(60.0),
        centre_z_mm: (kind == "tool").then_some(1400.0),
        orientation_w: (kind == "tool").then_some(1.0),
        orientation_x: (kind == "tool").then_some(0.0),
        orientation_y: (kind == "tool").then_some(0.0),
        orientation_z: (kind == "tool").then_some(0.0),
        ..Default::default()
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
        labelled(step, Fit(rows.collect()))
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
    of("geometry", Observability(rows))
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
    of("network", Training(rows))
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
            "mlp_random",
            None,
            false,
            "it could not be fitted to these rows",
        ),
    ];
    of("network", Corrections(rows))
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
    of("ingest", Rejected((0..rows).map(row).collect()))
}

/// The tables of a whole pipeline of a robot with this name.
pub fn tables(name: &str) -> ReportReads {
    tables_of(name, 500)
}

/// The same of so many points.
pub fn tables_of(name: &str, points: usize) -> ReportReads {
    let prediction = predictions(points);
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
            .map(|table| labelled("identify", table))
            .collect(),
        parameters: parameters(),
        robot: robot(name),
        recording,
        convention: vec![],
        split: Split(split),
        intake: of("ingest", Intake(vec![intake])),
        rejected: rejected(61),
        fit: fits(),
        observability: observability(),
        training: training(),
        corrections: corrections(),
        models: Vec::new(),
        verdict: of("diagnose", verdict()),
        sentences: of("diagnose", sentences()),
        findings: of("diagnose", findings()),
        finding_numbers: of("diagnose", numbers()),
        rivals: of("diagnose", rivals()),
        forms: of("diagnose", formulas()),
        cells: of("diagnose", cells()),
        suspects: Vec::new(),
    }
}
