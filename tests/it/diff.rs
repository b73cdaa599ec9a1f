//! `calib diff` of two files: classes of rows, units, angles, rotations, duplicates, exit codes.

use crate::answer::{Answer, calib, read};
use arrow::array::{ArrayRef, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow::datatypes::{Field, Schema};
use parquet::arrow::ArrowWriter;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A column with its unit and semantic.
struct Col(
    &'static str,
    ArrayRef,
    &'static [(&'static str, &'static str)],
);

fn real(name: &'static str, values: &[f64], about: &'static [(&'static str, &'static str)]) -> Col {
    Col(name, Arc::new(Float64Array::from(values.to_vec())), about)
}
fn optional(name: &'static str, values: &[Option<f64>]) -> Col {
    Col(name, Arc::new(Float64Array::from(values.to_vec())), &[])
}
fn whole(name: &'static str, values: &[i64]) -> Col {
    Col(name, Arc::new(Int64Array::from(values.to_vec())), &[])
}
fn text(name: &'static str, values: &[&str]) -> Col {
    Col(name, Arc::new(StringArray::from(values.to_vec())), &[])
}
/// Writes a file of a foreign program.
fn file(folder: &Path, name: &str, columns: Vec<Col>) -> PathBuf {
    let field = |Col(name, array, about): &Col| {
        let about = about
            .iter()
            .map(|(key, value)| (key.to_string(), value.to_string()))
            .collect();
        Field::new(*name, array.data_type().clone(), true).with_metadata(about)
    };
    let schema = Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<_>>()));
    let batch = RecordBatch::try_new(
        schema.clone(),
        columns.into_iter().map(|column| column.1).collect(),
    )
    .unwrap();
    let path = folder.join(name);
    let mut writer =
        ArrowWriter::try_new(std::fs::File::create(&path).unwrap(), schema, None).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    path
}
fn diff(a: &Path, b: &Path, words: &[&str]) -> Answer {
    let files = [a, b].map(|path| path.to_str().unwrap());
    calib(".", &[&["diff"], &files[..], words].concat())
}
#[test]
fn every_class_of_row_is_counted_whatever_the_order() {
    let folder = tempfile::tempdir().unwrap();
    let a = file(
        folder.path(),
        "a.parquet",
        vec![
            text("robot", &["r1", "r1", "r1", "r2", "r2", "r3"]),
            whole("pose", &[1, 2, 3, 1, 2, 7]),
            real("x", &[1.0, 2.0, 3.0, 4.0, 5.0, -0.0], &[("unit", "mm")]),
            optional(
                "t",
                &[None, Some(1.0), Some(1.0), None, Some(2.0), Some(3.0)],
            ),
            text("remark", &["", "", "", "", "", "α"]),
        ],
    );
    let b = file(
        folder.path(),
        "b.parquet",
        vec![
            text("remark", &["", "α", "", "", "", ""]),
            real("x", &[5.5, 0.0, 1.0, 2.0005, 3.0, 9.0], &[("unit", "mm")]),
            optional("t", &[Some(2.0), Some(3.0), None, Some(1.0), None, None]),
            whole("pose", &[2, 7, 1, 2, 3, 9]),
            text("robot", &["r2", "r3", "r1", "r1", "r1", "r9"]),
        ],
    );
    let output = diff(
        &a,
        &b,
        &["--key", "robot,pose", "--atol", "x=0.1um", "--json"],
    );
    assert_eq!(output.code, Some(1), "{}", output.both());
    let found = output.json();
    // r1/1 and r3/7 same; r1/2 and r2/2 by x; r1/3 by a null; r2/1 only in A; r9/9 only in B.
    let rows = &found["rows"];
    assert_eq!(
        [
            &rows["same"],
            &rows["within_tolerance"],
            &rows["changed"],
            &rows["only_a"],
            &rows["only_b"]
        ],
        [2, 0, 3, 1, 1]
    );
    assert_eq!(
        found["worst"][0]["key"], "robot r1, pose 3",
        "a value that vanished comes first"
    );
    assert_eq!(found["worst"][1]["key"], "robot r2, pose 2");
    assert_eq!(found["examples"]["only_b"][0], "robot r9, pose 9");
    let x = found["columns"]
        .as_array()
        .unwrap()
        .iter()
        .find(|column| column["name"] == "x")
        .unwrap();
    assert_eq!(
        (&x["pairs"], &x["changed"], &x["unit"]),
        (&5.into(), &2.into(), &"mm".into())
    );
    assert_eq!(
        (&x["statistics"]["max"], &x["worst_key"]),
        (&0.5.into(), &"robot r2, pose 2".into())
    );
    assert!((x["statistics"]["bias"].as_f64().unwrap() - 0.5005 / 5.0).abs() < 1e-12);
    let within = diff(
        &a,
        &b,
        &[
            "--key",
            "robot,pose",
            "--atol",
            "x=0.001",
            "--rtol",
            "0.2",
            "--json",
        ],
    )
    .json();
    assert_eq!(
        [
            &within["rows"]["within_tolerance"],
            &within["rows"]["changed"]
        ],
        [2, 1]
    );
    let back = diff(
        &b,
        &a,
        &["--key", "robot,pose", "--atol", "x=0.1um", "--json"],
    )
    .json();
    assert_eq!(
        [
            &back["rows"]["changed"],
            &back["rows"]["only_a"],
            &back["rows"]["only_b"]
        ],
        [3, 1, 1]
    );
    assert_eq!(diff(&a, &a, &["--key", "robot,pose"]).code, Some(0));
    assert_eq!(
        diff(&a, &b, &["--key", "robot,pose", "--exit-zero"]).code,
        Some(0)
    );
}

#[test]
fn angles_wrap_and_a_rotation_has_two_quaternions() {
    let folder = tempfile::tempdir().unwrap();
    let degrees = &[("unit", "deg"), ("semantic", "angle")];
    let side = |name: &str, angle: f64, sign: f64| {
        let q = [0.5_f64.sqrt() * sign, 0.0, 0.5_f64.sqrt() * sign, 0.0];
        let columns = vec![
            whole("pose", &[1]),
            real("rz", &[angle], degrees),
            real("qw", &[q[0]], &[]),
            real("qx", &[q[1]], &[]),
            real("qy", &[q[2]], &[]),
            real("qz", &[q[3]], &[]),
        ];
        file(folder.path(), name, columns)
    };
    let (a, b) = (
        side("a.parquet", 179.9999, 1.0),
        side("b.parquet", -180.0, -1.0),
    );
    assert_eq!(
        diff(&a, &b, &["--key", "pose", "--atol", "rz=0.0002"]).code,
        Some(0)
    );
    let exact = diff(&a, &b, &["--key", "pose", "--json"]).json();
    let angle = exact["columns"]
        .as_array()
        .unwrap()
        .iter()
        .find(|column| column["name"] == "rz")
        .unwrap();
    let max = angle["statistics"]["max"].as_f64().unwrap();
    assert!((max - 0.0001).abs() < 1e-9, "{max}");
    let rotation = exact["columns"]
        .as_array()
        .unwrap()
        .iter()
        .find(|column| column["name"] == "qw,qx,qy,qz")
        .unwrap();
    assert_eq!(
        (&rotation["changed"], &rotation["unit"]),
        (&0.into(), &"rad".into())
    );
    // A quarter turn about y against none: pi/2.
    let c = file(
        folder.path(),
        "c.parquet",
        vec![
            whole("pose", &[1]),
            real("rz", &[-180.0], degrees),
            real("qw", &[1.0], &[]),
            real("qx", &[0.0], &[]),
            real("qy", &[0.0], &[]),
            real("qz", &[0.0], &[]),
        ],
    );
    let turned = diff(&b, &c, &["--key", "pose", "--json"]).json();
    let turn = turned["worst"][0]["cells"][0]["difference"]
        .as_f64()
        .unwrap();
    assert!((turn - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{turn}");
}

#[test]
fn a_copy_is_the_same_byte_by_byte_and_one_flipped_bit_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let values: Vec<f64> = (0..400_000).map(|n| f64::from(n).sqrt()).collect();
    let keys: Vec<i64> = (0..400_000).collect();
    let a = file(
        folder.path(),
        "a.parquet",
        vec![whole("pose", &keys), real("x", &values, &[])],
    );
    let b = folder.path().join("b.parquet");
    std::fs::copy(&a, &b).unwrap();
    let output = diff(&a, &b, &["--key", "pose"]);
    assert_eq!(
        (output.code, output.both()),
        (
            Some(0),
            "same: 400000 rows, equal byte by byte\n".to_string()
        )
    );
    let reread = diff(&a, &b, &["--key", "pose", "--json", "--reread"]).json();
    assert_eq!(
        (&reread["equal"], &reread["rows"]["same"]),
        (&Value::Null, &400_000.into())
    );
    let mut bytes = std::fs::read(&b).unwrap();
    let place = bytes
        .windows(8)
        .position(|window| window == values[300_000].to_le_bytes())
        .unwrap();
    bytes[place] ^= 1;
    std::fs::write(&b, bytes).unwrap();
    let changed = diff(&a, &b, &["--key", "pose", "--json"]).json();
    assert_eq!(
        (&changed["rows"]["changed"], &changed["rows"]["same"]),
        (&1.into(), &399_999.into())
    );
}

#[test]
fn another_unit_is_one_finding_and_not_a_change_of_every_value() {
    let folder = tempfile::tempdir().unwrap();
    let values: Vec<f64> = (0..1000).map(|i| f64::from(i) * 0.7 + 0.1).collect();
    let metres: Vec<f64> = values.iter().map(|x| x / 1000.0).collect();
    let rows: Vec<i64> = (0..1000).collect();
    let a = file(
        folder.path(),
        "a.parquet",
        vec![whole("row", &rows), real("x_mm", &values, &[])],
    );
    let b = file(
        folder.path(),
        "b.parquet",
        vec![whole("row", &rows), real("x_m", &metres, &[])],
    );
    let c = file(
        folder.path(),
        "c.parquet",
        vec![whole("row", &rows), real("x_mm", &metres, &[("unit", "m")])],
    );
    for other in [b, c] {
        let output = diff(&a, &other, &["--key", "row", "--json"]);
        let found = output.json();
        assert_eq!(output.code, Some(1));
        assert_eq!(found["findings"].as_array().unwrap().len(), 1, "{found}");
        assert_eq!(found["findings"][0]["what"], "unit");
        assert_eq!(found["rows"]["changed"], 0, "{found}");
    }
}

#[test]
fn equal_keys_are_reported_unless_told_how_to_pair_them() {
    let folder = tempfile::tempdir().unwrap();
    let a = file(
        folder.path(),
        "a.parquet",
        vec![
            whole("pose", &[1, 2, 2, 3]),
            real("x", &[1.0, 2.0, 3.0, 4.0], &[]),
        ],
    );
    let b = file(
        folder.path(),
        "b.parquet",
        vec![
            whole("pose", &[3, 2, 2, 1]),
            real("x", &[4.0, 2.0, 3.0, 1.0], &[]),
        ],
    );
    let output = diff(&a, &b, &["--key", "pose"]);
    assert_eq!(output.code, Some(2), "{}", output.both());
    assert!(
        output
            .both()
            .contains("duplicate keys: 1 key, 2 rows of A, 2 of B"),
        "{}",
        output.both()
    );
    assert_eq!(
        diff(&a, &b, &["--key", "pose", "--exit-zero"]).code,
        Some(2)
    );
    assert_eq!(
        diff(&a, &b, &["--key", "pose", "--occurrence"]).code,
        Some(0)
    );
}

#[test]
fn differences_beyond_what_a_float_can_tell_are_seen() {
    let folder = tempfile::tempdir().unwrap();
    let big = 1_i64 << 53;
    let a = file(
        folder.path(),
        "a.parquet",
        vec![whole("row", &[0]), whole("n", &[big])],
    );
    let b = file(
        folder.path(),
        "b.parquet",
        vec![whole("row", &[0]), whole("n", &[big + 1])],
    );
    assert_eq!(
        diff(&a, &b, &["--key", "row", "--json"]).json()["worst"][0]["cells"][0]["difference"],
        1.0
    );
}

#[test]
fn what_cannot_be_compared_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let a = file(
        folder.path(),
        "a.parquet",
        vec![whole("pose", &[1]), text("x", &["1"])],
    );
    let torn = folder.path().join("torn.parquet");
    std::fs::write(&torn, &std::fs::read(&a).unwrap()[..40]).unwrap();
    for (b, arguments, says) in [
        (&a, &[][..], "name them with --key, of: pose, x"),
        (
            &a,
            &["--key", "poes"],
            "no key column `poes`; its columns: pose, x",
        ),
        (
            &a,
            &["--key", "pose", "--ignore", "y"],
            "--ignore: no column `y` in either",
        ),
        (
            &a,
            &["--key", "pose", "--atol", "x=1furlong"],
            "expected a number not below 0",
        ),
        (&torn, &["--key", "pose"], "not a readable Parquet file"),
        (
            &folder.path().join("none.parquet"),
            &["--key", "pose"],
            "cannot be read",
        ),
    ] {
        let output = diff(&a, b, arguments);
        assert_eq!(output.code, Some(2), "{arguments:?}: {}", output.both());
        assert!(
            output.both().contains(says),
            "{arguments:?}: {}",
            output.both()
        );
    }
}

#[test]
fn the_page_escapes_names_and_the_table_of_cells_has_a_row_for_each() {
    let folder = tempfile::tempdir().unwrap();
    let hostile = "<script>alert(1)</script>";
    let a = file(
        folder.path(),
        "a.parquet",
        vec![
            text("id", &[hostile, "b", "c"]),
            real("x", &[1.0, 2.0, 3.0], &[]),
        ],
    );
    let b = file(
        folder.path(),
        "b.parquet",
        vec![
            text("id", &[hostile, "b", "d"]),
            real("x", &[1.5, 2.0, 3.0], &[]),
        ],
    );
    let (page, cells) = (
        folder.path().join("diff.html"),
        folder.path().join("cells.parquet"),
    );
    let arguments = [
        "--key",
        "id",
        "--html",
        page.to_str().unwrap(),
        "--out",
        cells.to_str().unwrap(),
    ];
    let output = diff(&a, &b, &arguments);
    assert_eq!(output.code, Some(1), "{}", output.both());
    let html = read(&page);
    assert!(
        html.contains("&lt;script&gt;") && !html.contains("<script>"),
        "{html}"
    );
    let reader = parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder::try_new(
        std::fs::File::open(&cells).unwrap(),
    );
    let batch = reader.unwrap().build().unwrap().next().unwrap().unwrap();
    assert_eq!(batch.num_rows(), 3, "only in A, only in B, changed");
    let refused = diff(&a, &b, &["--key", "id", "--out", a.to_str().unwrap()]);
    assert_eq!(refused.code, Some(2), "{}", refused.both());
}
