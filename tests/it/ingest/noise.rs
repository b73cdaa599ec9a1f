//! The noise of a recording is its own: recorded, by uncertainty, by instrument, or said to be inferred.

use super::{faults_of, rr, take};
use crate::answer::starts_with;
use crate::desk::Desk;
use crate::workbook::workbook;
use calib::robot::{INSTRUMENTS, NoiseBasis, SigmaSource};
use calib::table::{Recording, Table};

/// Three rows at 5 m, and beside the point two columns more.
fn taken(more: &str, instrument: &str) -> (Recording, Vec<String>) {
    let text = "id,q1,q2,x,y,z,u,v\nP1,10,20,3000,4000,0,0.06,0.08\nP2,11,21,3000,0,4000,,\nP3,12,22,0,3000,4000,0,0\n";
    let desk = Desk::default().with("a.csv", text);
    let yaml = format!("{}      {more}\n{instrument}\n", super::TWO);
    let recording = take(&desk, &yaml, rr()).unwrap().recording;
    let notes = desk.notes.lock().unwrap().clone();
    (
        Recording::from_frame(&recording.to_frame().unwrap()).unwrap(),
        notes,
    )
}

fn faults(more: &str, instrument: &str) -> Vec<String> {
    let yaml = format!("{}      {more}\n{instrument}\n", super::TWO);
    faults_of(&yaml)
}

fn sigmas_um(recording: &Recording) -> Vec<[f64; 3]> {
    let all = recording.position_sigma.as_ref().unwrap();
    all.iter()
        .map(|row| row.map(|sigma| (sigma * 1e9).round() / 1e3))
        .collect()
}

fn is_near(found: &[[f64; 3]], expected: &[[f64; 3]]) {
    let same = found
        .as_flattened()
        .iter()
        .zip(expected.as_flattened())
        .all(|(a, b)| (a - b).abs() < 1e-3);
    assert!(same && found.len() == expected.len(), "{found:?}");
}

#[test]
fn half_of_a_recorded_u95_is_the_standard_deviation() {
    let (recording, _) = taken("u95: {column: u, unit: mm, optional: true}", "");
    // Where the cell is blank, or zero as no measurement is, 10 um + 2.5 um/m over two are the weight to start from.
    is_near(&sigmas_um(&recording), &[[30.0; 3], [11.25; 3], [11.25; 3]]);
    let sources = [
        SigmaSource::Recorded,
        SigmaSource::Inferred,
        SigmaSource::Inferred,
    ];
    assert_eq!(recording.sigma_source.as_deref(), Some(&sources[..]));
    let (recording, _) = taken(
        "u95: {column: v, unit: mm, coverage_factor: 2.8, optional: true}",
        "instrument: leica_at960",
    );
    is_near(&sigmas_um(&recording)[..1], &[[80.0 / 2.8; 3]]);
    let (recording, _) = taken(
        "u95_x: {column: u, unit: mm, optional: true}\n      u95_y: {column: v, unit: mm, optional: true}\n      u95_z: {value: 50, unit: um}",
        "",
    );
    is_near(&sigmas_um(&recording)[..1], &[[30.0, 40.0, 25.0]]);
}

#[test]
fn a_standard_uncertainty_is_the_standard_deviation_unless_a_factor_is_given() {
    let (recording, notes) = taken("u: {value: 0.02, unit: mm}", "");
    is_near(&sigmas_um(&recording), &[[20.0; 3]; 3]);
    assert!(
        !notes.iter().any(|note| note.contains("inferred")),
        "{notes:?}"
    );
    assert_eq!(recording.measurements().noise_basis, NoiseBasis::Instrument);
    let (recording, _) = taken("u: {value: 0.02, unit: mm, coverage_factor: 4}", "");
    is_near(&sigmas_um(&recording), &[[5.0; 3]; 3]);
}

#[test]
fn an_instrument_is_named_or_given_in_numbers() {
    // Its manual's maximum permissible error, 15 um + 6 um/m, halved; at 5 m.
    let (recording, _) = taken("", "instrument: leica_at500");
    is_near(&sigmas_um(&recording), &[[22.5; 3]; 3]);
    assert_eq!(
        recording.sigma_source.as_deref(),
        Some(&[SigmaSource::Instrument; 3][..])
    );
    assert_eq!(recording.measurements().noise_basis, NoiseBasis::Instrument);
    let (recording, _) = taken(
        "",
        "instrument: {constant_um: 40, per_metre_um: 0, coverage: 4}",
    );
    is_near(&sigmas_um(&recording), &[[10.0; 3]; 3]);
    for known in INSTRUMENTS {
        assert!(
            known.figures.fault().is_none() && !known.source.is_empty(),
            "{}",
            known.name
        );
        assert!(
            faults("", &format!("instrument: {}", known.name)).is_empty(),
            "{}",
            known.name
        );
    }
}

#[test]
fn recorded_standard_deviations_replace_the_instrument_row_by_row() {
    let columns = "sigma_x: {column: u, unit: mm, optional: true}\n      sigma_y: {column: u, unit: mm, optional: true}\n      \
                   sigma_z: {column: v, unit: mm, optional: true}";
    let (recording, _) = taken(columns, "instrument: {constant_um: 10, coverage: 1}");
    is_near(
        &sigmas_um(&recording),
        &[[60.0, 60.0, 80.0], [10.0; 3], [10.0; 3]],
    );
    let sources = [
        SigmaSource::Recorded,
        SigmaSource::Instrument,
        SigmaSource::Instrument,
    ];
    assert_eq!(recording.sigma_source.as_deref(), Some(&sources[..]));
    let data = recording.measurements();
    assert!(
        (data.points.sigma[0].z - 80e-6).abs() < 1e-12,
        "{}",
        data.points.sigma[0]
    );
}

#[test]
fn without_a_statement_the_noise_is_inferred_and_said_to_be() {
    let (recording, notes) = taken("", "");
    is_near(&sigmas_um(&recording), &[[11.25; 3]; 3]);
    assert_eq!(recording.measurements().noise_basis, NoiseBasis::Inferred);
    let weighted = "3 rows without a stated noise: weighted as 10 um + 2.5 um/m";
    assert!(
        notes.iter().any(|note| note.starts_with(weighted)),
        "{notes:?}"
    );
}

#[test]
fn a_noise_is_stated_once_and_in_a_way_that_is_known() {
    for (columns, expected) in [
        (
            "u95: {column: u, unit: mm}\n      u: {column: v, unit: mm}",
            ".u: states the standard deviation that `u95` states already; map one of them",
        ),
        (
            "u95_x: {column: u, unit: mm}",
            ": map all of u95_x, u95_y, u95_z, or none",
        ),
        (
            "u95: {column: u, unit: mm, coverage_factor: 0}",
            ".u95.coverage_factor: allowed: above 0, e.g. 2 for 95 %",
        ),
    ] {
        assert_eq!(faults(columns, ""), [format!("files[0].columns{expected}")]);
    }
    let none = faults(
        "",
        "instrument: {constant_um: 0, per_metre_um: 0, coverage: 2}",
    );
    starts_with(&none[0], "instrument: expected a noise above zero");
}

#[test]
fn a_coordinate_of_exactly_zero_keeps_its_stated_uncertainty() {
    let columns = "u95_x: {column: a, unit: um}\n      u95_y: {column: b, unit: um}\n      u95_z: {column: c, unit: um}";
    let text = "id,q1,q2,x,y,z,a,b,c\nP1,10,20,3000,0,0,20,30,40\nP2,11,21,0,-0.0,4000,22,32,42\nP3,12,22,0,3000,0.000,24,34,44\n";
    let expected = [[10.0, 15.0, 20.0], [11.0, 16.0, 21.0], [12.0, 17.0, 22.0]];
    let yaml = format!("{}      {columns}\n", super::TWO);
    let rows: Vec<String> = text.lines().map(|line| line.replace(',', "|")).collect();
    // Text, a sheet, and the point in a file of its own.
    let (joints, points): (Vec<String>, Vec<String>) = (text.lines())
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            (
                cells[..3].join(","),
                [&cells[..1], &cells[3..]].concat().join(","),
            )
        })
        .unzip();
    let desk = Desk::default()
        .with("a.csv", joints.join("\n"))
        .with("b.csv", points.join("\n"));
    let apart = yaml.replace(
        "      x:",
        "  - file: b.csv\n    columns:\n      point_id: {column: id}\n      x:",
    );
    for (desk, yaml) in [
        (Desk::default().with("a.csv", text), yaml.clone()),
        (
            Desk::default().with("a.csv", workbook(&[("Data", &rows.join("\n"))])),
            yaml,
        ),
        (desk, format!("{apart}join: {{by: id}}\n")),
    ] {
        let recording = take(&desk, &yaml, rr()).unwrap().recording;
        let recording = Recording::from_frame(&recording.to_frame().unwrap()).unwrap();
        is_near(&sigmas_um(&recording), &expected);
        assert_eq!(
            recording.sigma_source.as_deref(),
            Some(&[SigmaSource::Recorded; 3][..])
        );
        let data = recording.measurements();
        assert_eq!(data.noise_basis, NoiseBasis::Instrument);
        let ours: Vec<[f64; 3]> = data
            .points
            .sigma
            .iter()
            .map(|sigma| (sigma * 1e6).into())
            .collect();
        is_near(&ours, &expected);
    }
}
