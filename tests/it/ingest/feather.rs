//! Feather files are read as text is: the same recording, the same diagnosis; what is damaged or compressed otherwise is refused.

use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use arrow_ipc::CompressionType;
use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
use calib::table::{Recording, from_file};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;

/// A delimited file as columns of numbers, of texts where one of its cells is none, in batches of 50 rows.
fn feather(text: &str, compression: Option<CompressionType>) -> Vec<u8> {
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let (names, rows) = (lines.next().unwrap(), lines.collect::<Vec<_>>());
    let column = |k: usize| -> ArrayRef {
        let cells = || rows.iter().map(|row| row[k]);
        match cells().map(|cell| if cell.is_empty() { Ok(None) } else { cell.parse().map(Some) }).collect::<Result<Vec<_>, _>>() {
            Ok(numbers) => Arc::new(Float64Array::from(numbers)),
            Err(_) => Arc::new(StringArray::from_iter_values(cells())),
        }
    };
    let batch = RecordBatch::try_from_iter(names.iter().enumerate().map(|(k, name)| (*name, column(k)))).unwrap();
    let options = IpcWriteOptions::default().try_with_compression(compression).unwrap();
    let mut writer = FileWriter::try_new_with_options(Vec::new(), &batch.schema(), options).unwrap();
    (0..batch.num_rows()).step_by(50).for_each(|row| writer.write(&batch.slice(row, 50.min(batch.num_rows() - row))).unwrap());
    writer.into_inner().unwrap()
}

fn calib(here: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calib"))
        .args(arguments)
        .args(["--store", "s", "--quiet"])
        .current_dir(here)
        .output()
        .unwrap()
}

/// The first example of cases, its files in another format.
fn case(here: &Path, written: impl Fn(&str) -> Vec<u8>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/case");
    let example = root.join("example/r01");
    std::fs::copy(example.join("robot.json"), here.join("robot.json")).unwrap();
    for name in ["controller", "tracker"] {
        let text = std::fs::read_to_string(example.join(name).with_extension("csv")).unwrap();
        std::fs::write(here.join(name).with_extension("feather"), written(&text)).unwrap();
    }
    let pipeline = std::fs::read_to_string(root.join("pipeline.yaml")).unwrap().replace(".csv", ".feather");
    std::fs::write(here.join("p.yaml"), pipeline.replace("example/r01", ".")).unwrap();
}

#[test]
fn a_recording_in_feather_files_is_diagnosed_as_its_text_is() {
    let said = |compression: Option<Option<CompressionType>>| {
        let folder = tempfile::tempdir().unwrap();
        case(folder.path(), |text| compression.map_or_else(|| text.into(), |compression| feather(text, compression)));
        let run = calib(folder.path(), &["run", "p.yaml", "--until", "split"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let recording = from_file::<Recording>(&folder.path().join("s/tables/case/ingest.recording.parquet")).unwrap().table;
        let output = calib(folder.path(), &["diagnose", "p.yaml", "--json"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut said: Value = serde_json::from_slice(&output.stdout).unwrap();
        (recording, said["findings"].take())
    };
    let (text, plain) = (said(None), said(Some(None)));
    assert!(text.1.as_array().is_some_and(|findings| !findings.is_empty()), "{:#}", text.1);
    assert!(text == plain && text == said(Some(Some(CompressionType::ZSTD))));
}

#[test]
fn a_feather_file_that_cannot_be_read_is_refused_with_a_reason() {
    let refused = |written: &dyn Fn(Vec<u8>) -> Vec<u8>| {
        let folder = tempfile::tempdir().unwrap();
        case(folder.path(), |text| written(feather(text, None)));
        let output = calib(folder.path(), &["run", "p.yaml"]);
        assert!(!output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let said = refused(&|bytes| bytes[..bytes.len() / 2].to_vec());
    assert!(said.contains("controller.feather: is a Feather file that cannot be read: "), "{said}");
    let said = refused(&|bytes| [b"FEA1", &bytes[4..]].concat());
    assert!(said.contains("is a Feather file of version 1; allowed: version 2"), "{said}");
}
