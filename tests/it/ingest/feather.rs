//! Feather files are read as text is: the same recording, the same diagnosis; what is damaged or compressed otherwise is refused.

use crate::answer::{self, Answer, has, put, read};
use arrow::array::{ArrayRef, Float64Array, RecordBatch, StringArray};
use arrow_ipc::CompressionType;
use arrow_ipc::writer::{FileWriter, IpcWriteOptions};
use calib::table::{Recording, from_file};
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;

/// A delimited file as columns of numbers, of texts where one of its cells is none, in batches of 50 rows.
fn feather(text: &str, compression: Option<CompressionType>) -> Vec<u8> {
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let (names, rows) = (lines.next().unwrap(), lines.collect::<Vec<_>>());
    let column = |k: usize| -> ArrayRef {
        let cells = || rows.iter().map(|row| row[k]);
        match cells()
            .map(|cell| {
                if cell.is_empty() {
                    Ok(None)
                } else {
                    cell.parse().map(Some)
                }
            })
            .collect::<Result<Vec<_>, _>>()
        {
            Ok(numbers) => Arc::new(Float64Array::from(numbers)),
            Err(_) => Arc::new(StringArray::from_iter_values(cells())),
        }
    };
    let batch =
        RecordBatch::try_from_iter(names.iter().enumerate().map(|(k, name)| (*name, column(k))))
            .unwrap();
    let options = IpcWriteOptions::default()
        .try_with_compression(compression)
        .unwrap();
    let mut writer =
        FileWriter::try_new_with_options(Vec::new(), &batch.schema(), options).unwrap();
    (0..batch.num_rows()).step_by(50).for_each(|row| {
        writer
            .write(&batch.slice(row, 50.min(batch.num_rows() - row)))
            .unwrap()
    });
    writer.into_inner().unwrap()
}

fn calib(here: &Path, words: &str) -> Answer {
    answer::calib(here, &format!("{words} --store s --quiet"))
}

/// The first example of cases, its files in another format.
fn case(here: &Path, written: impl Fn(&str) -> Vec<u8>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/case");
    let example = root.join("example/r01");
    std::fs::copy(example.join("robot.json"), here.join("robot.json")).unwrap();
    for name in ["controller", "tracker"] {
        let text = read(example.join(name).with_extension("csv"));
        std::fs::write(here.join(name).with_extension("feather"), written(&text)).unwrap();
    }
    let pipeline = read(root.join("pipeline.yaml")).replace(".csv", ".feather");
    put(here, "p.yaml", pipeline.replace("example/r01", "."));
}

#[test]
fn a_recording_in_feather_files_is_diagnosed_as_its_text_is() {
    let answer_of = |compression: Option<Option<CompressionType>>| {
        let folder = tempfile::tempdir().unwrap();
        case(folder.path(), |text| {
            compression.map_or_else(|| text.into(), |compression| feather(text, compression))
        });
        calib(folder.path(), "run p.yaml --until split").code(0);
        let recording =
            from_file::<Recording>(&folder.path().join("s/tables/case/ingest.recording.parquet"))
                .unwrap()
                .table;
        let output = calib(folder.path(), "diagnose p.yaml --json").code(0);
        let mut answer: Value = output.json();
        (recording, answer["findings"].take())
    };
    let (text, plain) = (answer_of(None), answer_of(Some(None)));
    assert!(
        text.1
            .as_array()
            .is_some_and(|findings| !findings.is_empty()),
        "{:#}",
        text.1
    );
    assert!(text == plain && text == answer_of(Some(Some(CompressionType::ZSTD))));
}

#[test]
fn a_feather_file_that_cannot_be_read_is_refused_with_a_reason() {
    let refused_of = |compression, written: &dyn Fn(Vec<u8>) -> Vec<u8>| {
        let folder = tempfile::tempdir().unwrap();
        case(folder.path(), |text| written(feather(text, compression)));
        let output = calib(folder.path(), "run p.yaml");
        assert_ne!(output.code, Some(0));
        output.err
    };
    let refused = |written: &dyn Fn(Vec<u8>) -> Vec<u8>| refused_of(None, written);
    let printed = refused(&|bytes| bytes[..bytes.len() / 2].to_vec());
    has(
        &printed,
        "controller.feather: is a Feather file that cannot be read: ",
    );
    let printed = refused(&|bytes| [b"FEA1", &bytes[4..]].concat());
    has(
        &printed,
        "is a Feather file of version 1; allowed: version 2",
    );
    // Before each frame of zstd stands how many bytes it unpacks to: numbers that no machine can hold, and none can have.
    // The message before them may be damaged, too: the end of the file says where its columns are.
    for (length, is_alone) in [
        (1_i64 << 60, true),
        (1 << 40, true),
        (i64::MIN, true),
        (1 << 40, false),
    ] {
        let printed = refused_of(Some(CompressionType::ZSTD), &|mut bytes| {
            let frame = bytes
                .windows(4)
                .position(|at| at == 0xfd2f_b528_u32.to_le_bytes());
            let at = frame.unwrap() - 8;
            bytes[at..at + 8].copy_from_slice(&length.to_le_bytes());
            if !is_alone {
                bytes[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
            }
            bytes
        });
        has(
            &printed,
            "is a Feather file that cannot be read: a column unpacks to ",
        );
    }
}

/// An array of NumPy, version 1, as `numpy.save` writes it.
fn npy(kind: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let length = (head.len() + 11).next_multiple_of(64) - 10;
    head = format!("{head:<0$}\n", length - 1);
    [
        b"\x93NUMPY\x01\x00",
        &(length as u16).to_le_bytes()[..],
        head.as_bytes(),
        data,
    ]
    .concat()
}

#[test]
fn a_stream_of_arrow_and_arrays_of_numpy_are_read_as_columns() {
    use calib::raw::{ColumnRows, Record, RecordReader, has_columns, is_workbook};
    use std::io::Write;
    let rows = |bytes: &[u8]| {
        assert!(has_columns(bytes) && !is_workbook(bytes));
        let (mut reader, mut record, mut rows) = (
            ColumnRows::open(bytes, "run").unwrap(),
            Record::default(),
            Vec::new(),
        );
        while reader.next(&mut record).unwrap() {
            rows.push(record.cells());
        }
        (rows, reader.remark())
    };
    let batch = RecordBatch::try_from_iter([(
        "q",
        Arc::new(Float64Array::from(vec![0.5, -1.25])) as ArrayRef,
    )])
    .unwrap();
    let mut stream = arrow_ipc::writer::StreamWriter::try_new(Vec::new(), &batch.schema()).unwrap();
    stream.write(&batch).unwrap();
    let stream = stream.into_inner().unwrap();
    assert_eq!(rows(&stream).0, [["q"], ["0.5"], ["-1.25"]]);

    let floats = |numbers: &[f64]| {
        numbers
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let names: Vec<u8> = ["P1", "P\u{e4}2"]
        .iter()
        .flat_map(|name| {
            name.chars()
                .chain(std::iter::repeat('\0'))
                .take(3)
                .flat_map(|letter| (letter as u32).to_le_bytes())
        })
        .collect();
    let big: Vec<u8> = [7i32, -2]
        .iter()
        .flat_map(|number| number.to_be_bytes())
        .collect();
    for (name, array) in [
        (
            "q",
            npy("<f8", "(2, 3)", &floats(&[0.1, 0.2, 0.3, 1.1, 1.2, 1.3])),
        ),
        (
            "time_ns",
            npy(
                "<i8",
                "(2,)",
                &[1_700_000_000_123_456_789i64, -1]
                    .map(i64::to_le_bytes)
                    .concat(),
            ),
        ),
        ("name", npy("<U3", "(2,)", &names)),
        ("count", npy(">i4", "(2,)", &big)),
        ("rate", npy("<f8", "()", &floats(&[125.0]))),
    ] {
        archive
            .start_file(
                format!("{name}.npy"),
                zip::write::SimpleFileOptions::default(),
            )
            .unwrap();
        archive.write_all(&array).unwrap();
    }
    let bytes = archive.finish().unwrap().into_inner();
    let (found, remark) = rows(&bytes);
    assert_eq!(
        found[0],
        ["q[1]", "q[2]", "q[3]", "time_ns", "name", "count"]
    );
    assert_eq!(
        found[1],
        ["0.1", "0.2", "0.3", "1700000000123456789", "P1", "7"]
    );
    assert_eq!(found[2], ["1.1", "1.2", "1.3", "-1", "P\u{e4}2", "-2"]);
    assert_eq!(
        remark.as_deref(),
        Some("arrays of another length than 2 left out: `rate` (0 rows)")
    );
    // Damaged bytes are a fault of the file.
    for at in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[at] ^= 0x5a;
        let _ = ColumnRows::open(&changed[..], "run")
            .map(|mut reader| reader.next(&mut Record::default()));
    }
}
