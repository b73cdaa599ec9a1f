//! Headers as controllers, trackers and spreadsheets write them: `init` maps them right or asks, and what it wrote runs.

use crate::answer::{calib, has, put, read};
use std::fmt::Write;
use std::path::Path;
use tempfile::TempDir;

/// A joint's angle (deg) and a coordinate (mm) of a row.
fn angle(row: usize, joint: usize) -> f64 {
    80.0 * ((row * 7 + joint * 3) as f64).sin()
}

fn coordinate(row: usize, axis: usize) -> f64 {
    [1500.0, -200.0, 900.0][axis] + 300.0 * ((row * 5 + axis * 11) as f64).cos()
}

/// So many cells of a row, joined by `delimiter`.
pub(super) fn cells(count: usize, delimiter: &str, cell: impl Fn(usize) -> String) -> String {
    (0..count).map(cell).collect::<Vec<_>>().join(delimiter)
}

pub(super) fn joints(row: usize, delimiter: &str) -> String {
    cells(6, delimiter, |joint| format!("{:.4}", angle(row, joint)))
}

pub(super) fn point(row: usize, delimiter: &str) -> String {
    cells(3, delimiter, |axis| format!("{:.4}", coordinate(row, axis)))
}

/// A header and thirty rows.
pub(super) fn table(header: &str, row: impl Fn(usize) -> String) -> String {
    let mut text = format!("{header}\n");
    (0..30).for_each(|k| writeln!(text, "{}", row(k)).unwrap());
    text
}

fn comma(text: &str) -> String {
    text.replace('.', ",")
}

/// Windows-1252 of what fits into Latin-1.
fn latin(text: &str) -> Vec<u8> {
    text.chars()
        .map(|letter| u8::try_from(u32::from(letter)).unwrap())
        .collect()
}

/// What `init` made of files.
pub(super) struct Made {
    pub folder: TempDir,
    pub pipeline: String,
    pub printed: String,
}

pub(super) fn made(files: &[(&str, Vec<u8>)]) -> Made {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        put(folder.path(), name, content);
    }
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    let output = calib(
        folder.path(),
        &[&["init", ".", "--data"], names.as_slice()].concat(),
    );
    // 1 where nothing was understood: the files to fill in are written all the same.
    assert!(output.code.is_some_and(|code| code <= 1), "{}", output.err);
    let pipeline = read(folder.path().join("pipeline.yaml"));
    assert!(folder.path().join("robot.yaml").is_file());
    Made {
        folder,
        pipeline,
        printed: output.out.clone(),
    }
}

fn one(text: impl Into<Vec<u8>>) -> Made {
    made(&[("data.csv", text.into())])
}

fn two(controller: impl Into<Vec<u8>>, tracker: impl Into<Vec<u8>>) -> Made {
    made(&[
        ("controller.csv", controller.into()),
        ("tracker.txt", tracker.into()),
    ])
}

impl Made {
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
    /// Whether each of these stands in a line that counts, or none.
    fn counts(&self, parts: &[&str], wanted: bool) -> &Self {
        let lines = self.pipeline.lines();
        let lines: Vec<&str> = lines
            .filter(|line| !line.trim_start().starts_with('#'))
            .collect();
        for part in parts {
            let there = lines.iter().any(|line| line.contains(part));
            assert!(there == wanted, "{part} in\n{}", self.pipeline);
        }
        self
    }
    /// The pipeline holds these, and each in a line that counts.
    pub fn has(&self, parts: &[&str]) -> &Self {
        self.counts(parts, true)
    }
    /// No line that counts holds one of these.
    pub fn lacks(&self, parts: &[&str]) -> &Self {
        self.counts(parts, false)
    }
    pub fn says(&self, parts: &[&str]) -> &Self {
        for part in parts {
            assert!(self.pipeline.contains(part), "{part} in\n{}", self.pipeline);
        }
        self
    }
    /// `check` finds nothing wrong, and the recording has so many rows.
    pub fn runs(&self, rows: usize) -> &Self {
        let check = calib(self.path(), "check pipeline.yaml");
        let printed = check.err.clone();
        assert!(check.code == Some(0), "{printed}\n{}", self.pipeline);
        let words = "run pipeline.yaml --until split --json --quiet";
        let run: serde_json::Value = calib(self.path(), words).code(0).json();
        let named = |list: &serde_json::Value, key: &str, name: &str| {
            let mut all = list.as_array().unwrap().iter();
            all.find(|one| one[key] == name).unwrap().clone()
        };
        let ingest = named(&run["stages"], "id", "ingest");
        let recording = named(&ingest["outputs"], "port", "recording");
        assert_eq!(recording["rows"], rows, "{}", self.pipeline);
        self
    }
}

#[test]
fn a_german_controller_in_latin_1_joins_a_spatial_analyzer_export_by_its_points() {
    let header = "Punktname;J1 [Grad];J2 [Grad];J3 [Grad];J4 [Grad];J5 [Grad];J6 [Grad];Nutzlast [kg];Temperatur [\u{b0}C];Bemerkung (gepr\u{fc}ft)";
    let controller = table(header, |k| {
        format!(
            "M\u{fc}-{k};{};{};21,5;ok",
            comma(&joints(k, ";")),
            if k % 2 == 0 { "0" } else { "165" }
        )
    });
    let mut tracker =
        "// SpatialAnalyzer, Einheit mm\n// Collection Group Target X Y Z\n".to_string();
    for k in (0..30).rev() {
        writeln!(tracker, "A Main M\u{fc}-{k}   {}", point(k, "  ")).unwrap();
        if k == 15 {
            tracker.push_str("// Group of the afternoon\n");
        }
    }
    let made = two(latin(&controller.replace('\n', "\r\n")), latin(&tracker));
    made.has(&[
        "point_id: {column: \"Punktname\"}",
        "q: {column: \"J{j} [Grad]\", unit: deg}",
        "payload: {column: \"Nutzlast [kg]\", unit: kg}",
        "temperature: {column: \"Temperatur [\u{b0}C]\", unit: C}",
        "delimiter: whitespace",
        "comment: \"//\"",
        "point_id: {column: \"Target\"}",
        "x: {column: \"X\", unit: mm}",
        "join: {by: id}",
    ]);
    made.says(&["not used: \"Bemerkung (gepr\u{fc}ft)\""])
        .runs(30);
}

#[test]
fn a_spatial_analyzer_export_with_commas_is_understood_too() {
    let controller = table("pt,A1,A2,A3,A4,A5,A6", |k| {
        format!("P{k},{}", joints(k, ","))
    });
    let mut tracker = table("// Collection, Group, Target, X, Y, Z", |k| {
        format!("A, Main, P{k}, {}", point(k, ", "))
    });
    tracker.push_str("// end\n// of the export\n");
    let made = two(controller, tracker);
    made.has(&[
        "point_id: {column: \"pt\"}",
        "point_id: {column: \"Target\"}",
        "comment: \"//\"",
        "join: {by: id}",
    ]);
    made.lacks(&["// Collection"]).runs(30);
    let words = "run pipeline.yaml --until split --json --quiet";
    let again: serde_json::Value = calib(made.path(), words).json();
    assert_eq!(again["rejected_rows"], 0, "a line of remarks is no row");
}

#[test]
fn two_time_columns_are_joined_by_time() {
    let controller = table("t [s],q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg", |k| {
        format!("{:.2},{}", 12.0 * k as f64, joints(k, ","))
    });
    let tracker = table("Zeit [s];X [mm];Y [mm];Z [mm]", |k| {
        format!("{:.2};{}", 12.0 * k as f64 + 0.4, point(k, ";"))
    });
    let made = two(controller, tracker);
    made.has(&[
        "time: {column: \"t [s]\", unit: s}",
        "time: {column: \"Zeit [s]\", unit: s}",
        "join: {by: time, tolerance_s: ",
    ]);
    made.lacks(&["by: order"]).says(&["CHECK"]).runs(30);
}

#[test]
fn clock_times_are_times() {
    let head = "Timestamp,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm";
    for date in ["", "2026-11-22T", "2026-11-22 "] {
        let time = |k: usize| format!("{date}08:{:02}:{:02}.5", 15 + k / 5, 12 * (k % 5));
        let made = one(table(head, |k| {
            format!("{},{},{}", time(k), joints(k, ","), point(k, ","))
        }));
        made.has(&["time: {column: \"Timestamp\", unit: clock}"])
            .runs(30);
    }
}

#[test]
fn a_fast_log_beside_few_points_runs() {
    let controller = {
        let mut text = "time_s,A1,A2,A3,A4,A5,A6\n".to_string();
        (0..2000).for_each(|k| writeln!(text, "{:.3},{}", 0.1 * k as f64, joints(k, ",")).unwrap());
        text
    };
    let tracker = table("time_s,x,y,z", |k| {
        format!("{:.3},{}", 6.02 * k as f64 + 0.01, point(k, ","))
    });
    two(controller, tracker)
        .has(&["join: {by: time", "max_rejected_fraction: "])
        .runs(30);
}

#[test]
fn names_of_points_are_found_by_their_values_whatever_the_header() {
    for (left, right) in [
        ("Bezeichnung", "pt"),
        ("Nom", "Punktname"),
        ("Foo", "Bar"),
        ("Denominaci\u{f3}n", "Messung"),
    ] {
        let controller = table(
            &format!("{left};Axe 1;Axe 2;Axe 3;Axe 4;Axe 5;Axe 6;operator"),
            |k| format!("N{k:03};{};Smith", joints(k, ";")),
        );
        let tracker = table(&format!("count;{right};x;y;z"), |k| {
            format!("{};N{:03};{}", k + 1, 29 - k, point(k, ";"))
        });
        let made = two(controller, tracker);
        made.has(&[
            &format!("point_id: {{column: \"{left}\"}}"),
            &format!("point_id: {{column: \"{right}\"}}"),
            "join: {by: id}",
        ]);
        made.runs(30);
    }
}

#[test]
fn of_two_columns_that_name_points_alike_both_are_listed() {
    let controller = table("Name;Label;A1;A2;A3;A4;A5;A6", |k| {
        format!("N{k};N{k};{}", joints(k, ";"))
    });
    let tracker = table("Target;X;Y;Z", |k| format!("N{k};{}", point(k, ";")));
    let made = two(controller, tracker);
    made.has(&["point_id: {column: \"Name\"}   # CHECK"])
        .says(&["# point_id: {column: \"Label\"}   # CHECK"])
        .runs(30);
}

#[test]
fn running_numbers_of_files_of_unequal_length_are_asked_about() {
    let controller = table("Nr;A1;A2;A3;A4;A5;A6", |k| {
        format!("{};{}", k + 1, joints(k, ";"))
    });
    let tracker =
        table("Index;X;Y;Z", |k| format!("{};{}", k + 1, point(k, ";"))) + "31;1500,0;1;2\n";
    let tracker = tracker.replace("31;1500,0", "31;1500.0");
    let made = two(controller, tracker);
    made.lacks(&["by: order"])
        .says(&["running numbers"])
        .runs(30);
}

#[test]
fn rows_of_unequal_number_are_never_joined_by_order_in_silence() {
    let controller = table("A1,A2,A3,A4,A5,A6", |k| joints(k, ","));
    let tracker = table("x,y,z", |k| point(k, ",")) + "1,2,3\n";
    let made = two(controller.clone(), tracker);
    made.says(&["join: {by: order}", "REPLACE", "30 and 31 rows"]);
    let check = calib(made.path(), "run pipeline.yaml --until split --quiet").code(10);
    let printed = check.err.clone();
    has(&printed, "31 data rows, controller.csv has 30");
    let equal = two(controller, table("x,y,z", |k| point(k, ",")));
    equal.says(&["join: {by: order}", "CHECK"]).runs(30);
}

#[test]
fn a_target_with_its_difference_is_never_the_measured_point() {
    let header =
        "step_order,x_t,y_t,z_t,x_dif,y_dif,z_dif,joint_1,joint_2,joint_3,joint_4,joint_5,joint_6";
    let made = one(table(header, |k| {
        format!("{k},{},0.12,-0.3,0.05,{}", point(k, ","), joints(k, ","))
    }));
    made.has(&[
        "x: {column: \"x_t\", minus: \"x_dif\", unit: mm}   # CHECK",
        "z: {column: \"z_t\", minus: \"z_dif\", unit: mm}",
    ]);
    made.has(&["q: {column: \"joint_{j}\", unit: deg}"])
        .runs(30);
    let plain = one(table("x,y,z,dx,dy,dz,q1,q2,q3,q4,q5,q6", |k| {
        format!("{},0.1,0.2,0.3,{}", point(k, ","), joints(k, ","))
    }));
    plain
        .has(&["x: {column: \"x\", unit: mm}   # CHECK"])
        .says(&["# x: {column: \"x\", plus: \"dx\", unit: mm}"])
        .runs(30);
}

#[test]
fn goals_and_urdf_joints_are_told_from_what_was_measured() {
    let header = "Timestamp;Goal x;Goal y;Goal z;Goal roll;Goal pitch;Goal yaw;shoulder_pan_joint;shoulder_lift_joint;elbow_joint;\
                  wrist_1_joint;wrist_2_joint;wrist_3_joint;measurement_temperature;measurement_x;measurement_std_x;measurement_y;\
                  measurement_std_y;measurement_z;measurement_std_z;measurement_rx;measurement_ry;measurement_rz";
    let made = one(table(header, |k| {
        let radians = cells(6, ";", |joint| {
            format!("{:.6}", angle(k, joint).to_radians())
        });
        let measured = cells(3, ";", |axis| format!("{:.4};0.02", coordinate(k, axis)));
        comma(&format!(
            "2.02011E+13;0.1;0.2;0.3;1.5;1.5;1.5;{radians};21.7;{measured};-90.1;1.2;3.4"
        ))
    }));
    made.has(&[
        "q: {columns: [\"shoulder_pan_joint\", \"shoulder_lift_joint\", \"elbow_joint\", \"wrist_1_joint\", \"wrist_2_joint\", \"wrist_3_joint\"], unit: rad}",
        "x: {column: \"measurement_x\", unit: mm}",
        "temperature: {column: \"measurement_temperature\", unit: C}",
    ]);
    made.lacks(&["Goal", "point_id", "time:"]).runs(30);
    let in_order = one(table("Goal x,Goal y,Goal z,x,y,z,J1,J2,J3,J4,J5,J6", |k| {
        format!("{},{},{}", point(k + 1, ","), point(k, ","), joints(k, ","))
    }));
    in_order
        .has(&["x: {column: \"x\", unit: mm}"])
        .lacks(&["Goal"])
        .runs(30);
}

#[test]
fn nominal_and_actual_points_are_told_apart_in_every_order() {
    for (header, measured) in [
        ("x_nom,y_nom,z_nom,x_act,y_act,z_act", "x_act"),
        ("X Ist,Y Ist,Z Ist,X Soll,Y Soll,Z Soll", "X Ist"),
        ("x_mes,y_mes,z_mes,x_theo,y_theo,z_theo", "x_mes"),
        ("xt,yt,zt,X [mm],Y [mm],Z [mm]", "X [mm]"),
        ("x_t,y_t,z_t,x,y,z", "x"),
    ] {
        let made = one(table(
            &format!("Axis_1,Axis_2,Axis_3,Axis_4,Axis_5,Axis_6,{header}"),
            |k| format!("{},{},{}", joints(k, ","), point(k, ","), point(k, ",")),
        ));
        made.has(&[
            &format!("x: {{column: \"{measured}\", unit: mm}}"),
            "q: {column: \"Axis_{j}\", unit: deg}",
        ])
        .runs(30);
    }
    let targets = one(table("A1,A2,A3,A4,A5,A6,x_soll,y_soll,z_soll", |k| {
        format!("{},{}", joints(k, ","), point(k, ","))
    }));
    targets
        .lacks(&["x_soll"])
        .says(&["REPLACE", "only a target is there, no measured point"]);
}

#[test]
fn of_two_points_that_fit_alike_both_are_listed() {
    let two = |header: &str| {
        let row = |k: usize| format!("{},{},{}", joints(k, ","), point(k, ","), point(k + 3, ","));
        one(table(&format!("A1,A2,A3,A4,A5,A6,{header}"), row))
    };
    let made = two("before_x,before_y,before_z,after_x,after_y,after_z");
    made.has(&["x: {column: \"before_x\", unit: mm}   # CHECK"])
        .says(&["# x: {column: \"after_x\", unit: mm}   # CHECK"])
        .runs(30);
    let made = two("smrA_x,smrA_y,smrA_z,smrB_x,smrB_y,smrB_z");
    let both = "{smra: [\"smrA_x\", \"smrA_y\", \"smrA_z\"], smrb: [\"smrB_x\", \"smrB_y\", \"smrB_z\"]}}   # CHECK";
    made.has(&[&format!("targets: {{unit: mm, columns: {both}")])
        .says(&["# x: {column: \"smrB_x\", unit: mm}   # CHECK"])
        .runs(60);
    let numbered =
        "{target_1: [\"X1\", \"Y1\", \"Z1\"], target_2: [\"X2\", \"Y2\", \"Z2\"]}}   # CHECK";
    two("X1,Y1,Z1,X2,Y2,Z2").has(&[&format!("targets: {{unit: mm, columns: {numbered}")]);
    two("SMR 1 x,SMR 1 y,SMR 1 z,SMR 2 x,SMR 2 y,SMR 2 z")
        .has(&["targets: {unit: mm, columns: {smr1: "]);
    two("X,Y,Z,X,Y,Z")
        .has(&["x: {column: 7, unit: m"])
        .says(&["# x: {column: 10, unit: m"]);
}

#[test]
fn the_sixth_axis_of_a_yaskawa_is_no_time() {
    let made = one(table("No,S,L,U,R,B,T,X,Y,Z", |k| {
        format!("{k},{},{}", joints(k, ","), point(k, ","))
    }));
    made.has(&["q: {columns: [\"S\", \"L\", \"U\", \"R\", \"B\", \"T\"], unit: deg}"])
        .lacks(&["time:"])
        .runs(30);
    let falling = one(table("T,A1,A2,A3,A4,A5,A6,X,Y,Z", |k| {
        format!(
            "{:.1},{},{}",
            21.0 + (k as f64).sin(),
            joints(k, ","),
            point(k, ",")
        )
    }));
    falling.lacks(&["time:", "point_id"]).runs(30);
}

#[test]
fn a_file_without_a_header_gets_both_files_with_what_was_seen() {
    let bare: String = (0..30)
        .map(|k| format!("{},{}\n", joints(k, ","), point(k, ",")))
        .collect();
    let made = one(bare);
    made.has(&[
        "header: false",
        "q: {columns: [1, 2, 3, 4, 5, 6], unit: deg}   # REPLACE",
    ]);
    made.says(&["column 7: ", " to "]);
    let sheet = one(&b"PK\x03\x04\x14\x00\x06\x00binary"[..]);
    sheet.says(&["REPLACE", "saved as CSV"]);
    let prose = one("nothing\nto see\n");
    prose.says(&["REPLACE", "nothing", "to see"]);
    has(&prose.printed, "no header found");
}

#[test]
fn units_in_a_row_of_their_own_and_micrometres_in_latin_1_are_read() {
    let below = one(table(
        "Point,A1,A2,A3,A4,A5,A6,X,Y,Z\n,deg,deg,deg,deg,deg,deg,m,m,m",
        |k| {
            let metres = cells(3, ",", |axis| format!("{:.7}", coordinate(k, axis) * 1e-3));
            format!("P{k},{},{metres}", joints(k, ","))
        },
    ));
    below
        .has(&[
            "skip_below_header: 1",
            "q: {column: \"A{j}\", unit: deg}",
            "x: {column: \"X\", unit: m}",
        ])
        .runs(30);
    let micro = table(
        "Point;A1 [\u{b0}];A2 [\u{b0}];A3 [\u{b0}];A4 [\u{b0}];A5 [\u{b0}];A6 [\u{b0}];X [\u{b5}m];Y [\u{b5}m];Z [\u{b5}m]",
        |k| {
            let micrometres = cells(3, ";", |axis| format!("{:.1}", coordinate(k, axis) * 1e3));
            format!("P{k};{};{micrometres}", joints(k, ";"))
        },
    );
    one(latin(&micro))
        .has(&[
            "q: {column: \"A{j} [\u{b0}]\", unit: deg}",
            "x: {column: \"X [\u{b5}m]\", unit: um}",
        ])
        .runs(30);
}

#[test]
fn french_and_spanish_headers_are_read() {
    let french = table(
        "Nom;Axe1 (deg);Axe2 (deg);Axe3 (deg);Axe4 (deg);Axe5 (deg);Axe6 (deg);Charge utile (kg);Temp\u{e9}rature (\u{b0}C);Temps (s);X mesur\u{e9};Y mesur\u{e9};Z mesur\u{e9}",
        |k| {
            comma(&format!(
                "P{k};{};10.5;20.1;{k};{}",
                joints(k, ";"),
                point(k, ";")
            ))
        },
    );
    one(latin(&french))
        .has(&[
            "point_id: {column: \"Nom\"}",
            "payload: {column: \"Charge utile (kg)\", unit: kg}",
            "temperature: {column: \"Temp\u{e9}rature (\u{b0}C)\", unit: C}",
            "time: {column: \"Temps (s)\", unit: s}",
            "x: {column: \"X mesur\u{e9}\", unit: mm}",
        ])
        .runs(30);
    let spanish = table(
        "Nombre,Eje 1,Eje 2,Eje 3,Eje 4,Eje 5,Eje 6,Carga [kg],Tiempo [s],X medido,Y medido,Z medido",
        |k| format!("P{k},{},5,{k},{}", joints(k, ","), point(k, ",")),
    );
    one(spanish)
        .has(&[
            "point_id: {column: \"Nombre\"}",
            "payload: {column: \"Carga [kg]\", unit: kg}",
        ])
        .runs(30);
}

#[test]
fn the_controllers_own_point_is_not_taken_beside_the_trackers() {
    let header = "Name;A1;A2;A3;A4;A5;A6;X;Y;Z;A;B;C;Last [kg]";
    let controller = table(header, |k| {
        format!("P{k};{};{};1;2;3;10", joints(k, ";"), point(k + 1, ";"))
    });
    let tracker = table("Name;Time;X;Y;Z;Temp", |k| {
        format!("P{k};{k};{};20.5", point(k, ";"))
    });
    let made = two(controller, tracker);
    let places: Vec<&str> = made
        .pipeline
        .lines()
        .filter(|line| line.trim_start().starts_with("x: {column"))
        .collect();
    assert_eq!(places.len(), 1, "{}", made.pipeline);
    let joints = made.pipeline.find("q: {column").unwrap();
    assert!(
        made.pipeline.find(places[0]).unwrap() > joints,
        "{}",
        made.pipeline
    );
    made.runs(30);
}

#[test]
fn the_identity_that_init_comments_out_is_nobodys() {
    let made = one(table("Point,A1,A2,A3,A4,A5,A6,X,Y,Z", |k| {
        format!("P{k},{},{}", joints(k, ","), point(k, ","))
    }));
    assert!(
        !made.pipeline.contains("A. Meier") && !made.pipeline.contains("AT960"),
        "{}",
        made.pipeline
    );
    let identified = made.pipeline.replace("# identity:", "identity:");
    put(made.path(), "pipeline.yaml", identified);
    let check = calib(made.path(), "check pipeline.yaml").code(0);
    let printed = check.out.clone();
    has(&printed, ["replace   ", "          pipeline.yaml:"]);
}
