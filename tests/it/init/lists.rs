//! Lists as they come off a tracker's own software: no header, other names than the controller's, UTF-16, marks of thousands, many columns.

use super::layouts::{joints, made, point, table};
use crate::answer::{calib, has, put, starts_with};
use std::fmt::Write;

#[test]
fn a_list_of_points_without_a_header_joins_by_the_numbers_in_its_names() {
    let controller = table("Punkt;A1;A2;A3;A4;A5;A6", |k| {
        format!("Pose {k};{}", joints(k, ";"))
    });
    let mut tracker = String::new();
    (0..30).for_each(|k| writeln!(tracker, "pt_{k:03} {}", point(k, " ")).unwrap());
    let made = made(&[
        ("controller.csv", controller.into()),
        ("tracker.txt", tracker.into()),
    ]);
    made.has(&[
        "point_id: {column: \"Punkt\", match: number}",
        "header: false",
        "point_id: {column: 1, match: number}",
        "x: {column: 2, unit: mm}   # CHECK: no header says so; is it right?",
        "z: {column: 4, unit: mm}",
        "join: {by: id}          # CHECK: by the numbers in the names, of which 100 % stand in both files",
    ]);
    made.runs(30);
}

#[test]
fn a_text_in_utf_16_with_marks_of_thousands_is_read() {
    let german = |k: usize| {
        let number = |axis: usize| {
            let text = format!("{:.2}", 1234.5 + 100.0 * axis as f64 + k as f64);
            format!("{}.{}", &text[..1], text[1..].replace('.', ","))
        };
        format!(
            "P{k};{};{};{};{}",
            joints(k, ";").replace('.', ","),
            number(0),
            number(1),
            number(2)
        )
    };
    let text = table("Punkt;A1;A2;A3;A4;A5;A6;X [mm];Y [mm];Z [mm]", german);
    let bytes: Vec<u8> = std::iter::once(0xfeff)
        .chain(text.encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    let made = made(&[("data.csv", bytes)]);
    made.has(&[
        "decimal: comma",
        "point_id: {column: \"Punkt\"}",
        "x: {column: \"X [mm]\", unit: mm}",
    ]);
    made.runs(30);
}

#[test]
fn what_cannot_be_told_ends_with_code_1_and_a_sentence_and_too_many_files_with_2() {
    let folder = tempfile::tempdir().unwrap();
    put(
        folder.path(),
        "notes.csv",
        "day,weather,mood\nmon,rain,good\ntue,sun,good\n",
    );
    let output = calib(folder.path(), "init . --data notes.csv");
    let printed = output.err.clone();
    assert_eq!(output.code, Some(1), "{printed}");
    starts_with(
        &printed,
        "error: neither joints nor a measured point were recognised in notes.csv",
    );
    let output = calib(
        folder.path(),
        "init more --data notes.csv notes.csv notes.csv",
    );
    let printed = output.err.clone();
    assert_eq!(output.code, Some(2), "{printed}");
    has(
        &printed,
        "--data: 3 files; allowed: one recording, the controller's and the tracker's, the controller's and a list of points in one layout for each of several reflectors, or recordings that have joints and points each",
    );
    assert!(!folder.path().join("more").exists());
}

#[test]
fn a_wide_file_takes_time_in_proportion_to_its_width() {
    let wide = |columns: usize| {
        let mut header = String::from("Punkt,A1,A2,A3,A4,A5,A6,X,Y,Z");
        (0..columns).for_each(|k| write!(header, ",channel {k}").unwrap());
        let blank = ",0.5".repeat(columns);
        let text = table(&header, |k| {
            format!("P{k},{},{}{blank}", joints(k, ","), point(k, ","))
        });
        let begun = std::time::Instant::now();
        made(&[("data.csv", text.into())]).has(&["q: {column: \"A{j}\"", "x: {column: \"X\""]);
        begun.elapsed().as_secs_f64()
    };
    let [narrow, broad] = [2_000, 16_000].map(wide);
    // Eight times the width: 64 times the time would be quadratic.
    assert!(
        broad < 24.0 * narrow.max(0.05),
        "{narrow} s for 2,000 columns, {broad} s for 16,000"
    );
}

#[test]
fn a_grid_and_a_check_set_are_two_recordings_of_which_the_second_judges() {
    let recording = |name: &str| {
        table("Punkt;A1;A2;A3;A4;A5;A6;X;Y;Z", |k| {
            format!("{name}{k};{};{}", joints(k, ";"), point(k, ";"))
        })
    };
    let made = made(&[
        ("grid.csv", recording("G").into()),
        ("check.csv", recording("C").into()),
    ]);
    made.has(&[
        "usage: {value: fit}   # CHECK: every row of this file",
        "usage: {value: validate}   # CHECK: every row of this file",
        "join: {by: append}      # CHECK: separate recordings, one after the other",
        "with: {by: usage, blank: fit}",
        "point_id: {column: \"Punkt\"}",
    ]);
    made.runs(60);
}

#[test]
fn several_reflectors_from_several_files_are_targets_of_the_same_poses() {
    let controller = table("Punkt;A1;A2;A3;A4;A5;A6", |k| {
        format!("P{k};{}", joints(k, ";"))
    });
    let list = |by: usize| table("Punkt;X;Y;Z", |k| format!("P{k};{}", point(k + by, ";")));
    // In any order: which file has the joints is seen.
    let made = made(&[
        ("smr_A.csv", list(0).into()),
        ("controller.csv", controller.into()),
        ("smr_B.csv", list(3).into()),
        ("smr_C.csv", list(7).into()),
    ]);
    made.has(&[
        "target: {value: \"A\"}   # CHECK: which reflector it was, by the file's name",
        "join: {by: id}          # by the point's name",
        "later:                  # CHECK: the other reflectors, measured in the same poses",
        "- {files: [\"controller.csv\", \"smr_B.csv\"], target: \"B\"}",
        "- {files: [\"controller.csv\", \"smr_C.csv\"], target: \"C\"}",
    ]);
    made.runs(90);
}

const CELL: &str = r#"<robot name="cell"><link name="world"/><link name="carriage"/><link name="arm"/><link name="holder"/>
<joint name="rail" type="prismatic"><parent link="world"/><child link="carriage"/><axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
<joint name="turn" type="revolute"><parent link="carriage"/><child link="arm"/><axis xyz="0 0 1"/><limit lower="-3" upper="3"/></joint>
<joint name="fix" type="fixed"><parent link="arm"/><child link="holder"/><origin xyz="0.5 0 0.2"/></joint></robot>"#;

#[test]
fn the_chain_of_a_urdf_is_read_from_its_first_link_with_joints_that_slide() {
    let folder = tempfile::tempdir().unwrap();
    let data = table("Punkt,J1_mm,J2_deg,X,Y,Z", |k| {
        format!("P{k},{},{},{}", 40 * k, 3 * k, point(k, ","))
    });
    put(folder.path(), "data.csv", data);
    put(folder.path(), "cell.urdf", CELL);
    let message_of = |arguments: &str| {
        let output = calib(folder.path(), arguments);
        (output.code, output.err.clone())
    };
    let start = "init . --data data.csv --urdf cell.urdf --tip";
    assert_eq!(
        message_of(&format!("{start} holder")),
        (Some(0), String::new())
    );
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert!(
        read("robot.yaml").contains("urdf: {base: \"world\", tip: \"holder\"}"),
        "{}",
        read("robot.yaml")
    );
    let pipeline = read("pipeline.yaml");
    has(
        &pipeline,
        "q: {columns: [\"J1_mm\", \"J2_deg\"], unit: deg, linear_unit: mm}",
    );
    std::fs::remove_file(folder.path().join("robot.yaml")).unwrap();
    std::fs::remove_file(folder.path().join("pipeline.yaml")).unwrap();
    let (code, printed) = message_of(&format!("{start} carriage"));
    assert_eq!(code, Some(2));
    has(
        &printed,
        "--tip: the chain from `world` to `carriage` has 1 joint, the recording 2",
    );
    let (code, printed) = message_of(&format!("{start} tool0"));
    assert!(
        code == Some(2)
            && printed.contains("no link `tool0`")
            && printed.contains("carriage, holder, world"),
        "{printed}"
    );
}

#[test]
fn quaternions_are_orientations_to_take_in_and_u95_is_two_standard_deviations() {
    let controller = table("Punkt;A1;A2;A3;A4;A5;A6", |k| {
        format!("P{k};{}", joints(k, ";"))
    });
    let list = table("Punkt;X;Y;Z;qw;qx;qy;qz;U95 X;U95 Y;U95 Z", |k| {
        format!("P{k};{};1;0;0;0;0.03;0.03;0.04", point(k, ";"))
    });
    let made = made(&[
        ("controller.csv", controller.into()),
        ("tracker.csv", list.into()),
    ]);
    made.says(&[
        "# orientation: {quaternion: [\"qw\", \"qx\", \"qy\", \"qz\"]}   # CHECK: full poses",
        "# sigma_orientation: {value: 30, unit: arcsec}",
        "# u95_x: {column: \"U95 X\", unit: mm}   # CHECK: two standard deviations, if rows are to be weighted by it",
    ]);
    // The lines taken in are understood.
    let taken = made
        .pipeline
        .replace("# orientation:", "orientation:")
        .replace("# sigma_orientation:", "sigma_orientation:");
    put(made.path(), "pipeline.yaml", taken);
    made.runs(30);
}

#[test]
fn exports_of_metrology_software_are_read_as_they_stand() {
    let controller = || {
        table("name,J1,J2,J3,J4,J5,J6", |k| {
            format!("P{k:03},{}", joints(k, ","))
        })
    };
    let listed =
        |row: &dyn Fn(usize) -> String| -> String { (0..30).map(|k| row(k) + "\n").collect() };
    // Collection, group and point; an inspection report with blank nominal values; points in quotes below a comment.
    let spatial_analyzer = listed(&|k| format!("A   Main   P{k:03}   {}", point(k, "   ")));
    let collections = String::from("// Units: mm\n")
        + &listed(&|k| format!("Tracker::Main::P{k:03}, {}", point(k, ", ")));
    let report =
        String::from("Name\tNominal X\tNominal Y\tNominal Z\tActual X\tActual Y\tActual Z\tRMS\n")
            + &listed(&|k| format!("P{k:03}\t\t\t\t{}\t0.0123", point(k, "\t")));
    let inspector =
        String::from("# point X Y Z\n") + &listed(&|k| format!("\"P{k:03}\" {}", point(k, " ")));
    for (text, lines) in [
        (
            spatial_analyzer,
            ["point_id: {column: 3}", "x: {column: 4, unit: mm}"],
        ),
        (
            collections,
            [
                "point_id: {column: 1, match: number}",
                "x: {column: 2, unit: mm}",
            ],
        ),
        (
            report,
            ["delimiter: tab", "x: {column: \"Actual X\", unit: mm}"],
        ),
        (
            inspector,
            ["header_in_comment: true", "x: {column: \"X\", unit: mm}"],
        ),
    ] {
        let made = made(&[
            ("controller.csv", controller().into()),
            ("tracker.txt", text.into()),
        ]);
        made.has(&lines);
        made.runs(30);
    }
}
