//! What reaches a robot is what was identified: tables with a changed bit are refused, or change nothing.

use crate::answer::{fed, has, put, starts_with};
use crate::compensate::cell;
use calib::identified::{Files, IdentifiedModel};
use calib::pipeline::{Manifest, find_run};
use calib::store::Store;
use calib::table::{Parameters, Table, from_file};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use std::fs::File;
use std::path::{Path, PathBuf};

const PARAMETERS: &str = "identify.parameters.parquet";
const ROBOT: &str = "robot.robot.parquet";
const TARGETS: &str =
    "A1_deg,A2_deg,A3_deg,A4_deg,A5_deg,A6_deg\n10,20,-30,5,40,0\n-10,20.25,30,5,40,1\n";

/// A folder with the two tables of the cell, as somebody takes them along.
fn taken_along() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in [PARAMETERS, ROBOT] {
        let bytes = std::fs::read(cell().join(".calib/tables/small").join(name)).unwrap();
        put(folder.path(), name, bytes);
    }
    folder
}

fn files(folder: &Path) -> Files {
    Files {
        parameters: folder.join(PARAMETERS),
        robot: folder.join(ROBOT),
        unchecked: false,
    }
}

fn compensated(folder: &Path, more: &str) -> (Option<i32>, String, String) {
    let verb = &format!("compensate {PARAMETERS} --robot {ROBOT} --no-sigma --quiet");
    let output = fed(folder, &format!("{verb} {more}"), TARGETS);
    (output.code, output.out, output.err)
}

/// `bits` bits of a file, each as the file with that one changed.
fn flips(path: &Path, bits: usize, seed: u64) -> impl Iterator<Item = (usize, Vec<u8>)> {
    let whole = std::fs::read(path).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..bits).map(move |_| {
        let bit = random.random_range(0..whole.len() * 8);
        let mut flipped = whole.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        (bit, flipped)
    })
}

/// All that a robot is moved by, digit by digit.
fn numbers(identified: &IdentifiedModel) -> String {
    format!(
        "{:?} {:?} {:?}",
        identified.robot, identified.parameters, identified.model.x
    )
}

#[test]
fn a_changed_bit_of_a_table_is_refused_or_changes_no_number() {
    let folder = taken_along();
    let sound = numbers(
        &IdentifiedModel::of_files(&files(folder.path())).unwrap_or_else(|error| panic!("{error}")),
    );
    let mut refused = 0;
    for (name, seed) in [(PARAMETERS, 4), (ROBOT, 5)] {
        let path = folder.path().join(name);
        let whole = std::fs::read(&path).unwrap();
        for (bit, flipped) in flips(&path, 400, seed) {
            std::fs::write(&path, flipped).unwrap();
            match IdentifiedModel::of_files(&files(folder.path())) {
                Ok(found) => assert_eq!(numbers(&found), sound, "bit {bit} of {name}"),
                Err(error) => {
                    assert_eq!(
                        (error.exit_code(), error.to_string().contains(name)),
                        (10, true),
                        "bit {bit} of {name}: {error}"
                    );
                    refused += 1;
                }
            }
        }
        std::fs::write(&path, whole).unwrap();
    }
    // The others fall into what no number is read from: statistics, descriptions for other programs.
    assert!(refused > 200, "{refused} of 800");
}

#[test]
fn the_verb_refuses_a_changed_table_with_code_10_and_writes_no_target() {
    let folder = taken_along();
    let path = folder.path().join(PARAMETERS);
    let (code, sound, printed) = compensated(folder.path(), "");
    assert_eq!(code, Some(0), "{printed}");
    for (bit, flipped) in flips(&path, 40, 6) {
        std::fs::write(&path, flipped).unwrap();
        let (code, written, printed) = compensated(folder.path(), "");
        let kept = code == Some(0) && written == sound;
        assert!(
            kept || (code == Some(10) && written.is_empty() && printed.contains(PARAMETERS)),
            "bit {bit}: {code:?} {written} {printed}"
        );
    }
}

/// Writes a table as another program does: the columns alone, with the value of one cell changed by `by`.
fn written_anew(path: &Path, by: f64, metadata: bool) {
    let builder = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap();
    let pairs = builder
        .metadata()
        .file_metadata()
        .key_value_metadata()
        .cloned();
    let batch = builder.build().unwrap().next().unwrap().unwrap();
    let table = from_file::<Parameters>(path).unwrap().table;
    let mut rows = table.0;
    rows[0].value += by;
    let changed = Parameters(rows).to_frame().unwrap().batch().clone();
    assert_eq!(changed.num_rows(), batch.num_rows());
    let properties = parquet::file::properties::WriterProperties::builder()
        .set_key_value_metadata(if metadata {
            pairs.map(|pairs| {
                pairs
                    .into_iter()
                    .filter(|pair| pair.key != "ARROW:schema")
                    .collect()
            })
        } else {
            None
        })
        .build();
    let mut writer = ArrowWriter::try_new(
        File::create(path).unwrap(),
        changed.schema(),
        Some(properties),
    )
    .unwrap();
    writer.write(&changed).unwrap();
    writer.close().unwrap();
}

#[test]
fn a_table_of_another_program_is_taken_only_where_that_is_said() {
    let folder = taken_along();
    let path = folder.path().join(PARAMETERS);
    let (_, sound, _) = compensated(folder.path(), "");
    written_anew(&path, 0.0, true);
    assert_eq!(
        compensated(folder.path(), ""),
        (Some(0), sound.clone(), String::new()),
        "the same content, written anew"
    );
    let whole = std::fs::read(&path).unwrap();
    written_anew(&path, 0.0, false);
    let (code, written, printed) = compensated(folder.path(), "");
    assert_eq!((code, written), (Some(10), String::new()));
    has(
        &printed,
        [PARAMETERS, "carries no content hash", "--unchecked"],
    );
    let (code, written, printed) = compensated(folder.path(), "--unchecked");
    assert_eq!((code, written), (Some(0), sound));
    starts_with(&printed, "warning: ");
    has(&printed, "its numbers cannot be verified");
    std::fs::write(&path, whole).unwrap();
    written_anew(&path, 1e-4, true);
    for more in ["", "--unchecked"] {
        let (code, written, printed) = compensated(folder.path(), more);
        assert_eq!((code, written), (Some(10), String::new()));
        has(&printed, ["does not match its numbers", "calib run"]);
    }
}

fn copied(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from)
        .unwrap()
        .map(|entry| entry.unwrap().path())
    {
        let place = to.join(entry.file_name().unwrap());
        if entry.is_dir() {
            copied(&entry, &place)
        } else {
            std::fs::write(&place, std::fs::read(&entry).unwrap()).unwrap()
        }
    }
}

#[test]
fn a_changed_bit_in_the_store_is_refused_or_changes_no_number() {
    let folder = tempfile::tempdir().unwrap();
    copied(&cell().join(".calib"), folder.path());
    let store = Store::open(folder.path()).unwrap();
    let manifest = Manifest::of(&store, &find_run(&store, "HEAD").unwrap()).unwrap();
    let sound = numbers(
        &IdentifiedModel::of_run(&store, &manifest, None).unwrap_or_else(|error| panic!("{error}")),
    );
    let read = ["parameters", "robot", "recording"];
    let outputs = manifest
        .stages
        .iter()
        .flat_map(|stage| &stage.outputs)
        .filter(|output| read.contains(&output.kind.as_str()));
    let objects: Vec<PathBuf> = outputs
        .map(|output| store.object_path(&output.table))
        .collect();
    assert_eq!(objects.len(), read.len());
    for path in objects {
        let whole = std::fs::read(&path).unwrap();
        for (bit, flipped) in flips(&path, 100, 7) {
            std::fs::write(&path, flipped).unwrap();
            match IdentifiedModel::of_run(&store, &manifest, None) {
                Ok(found) => assert_eq!(numbers(&found), sound, "bit {bit} of {}", path.display()),
                Err(error) => {
                    let printed = error.to_string();
                    assert_eq!(error.exit_code(), 10, "{printed}");
                    assert!(
                        printed.contains(path.to_str().unwrap())
                            && printed.contains("calib run pipeline.yaml"),
                        "{printed}"
                    );
                }
            }
        }
        std::fs::write(&path, whole).unwrap();
    }
    assert_eq!(
        numbers(&IdentifiedModel::of_run(&store, &manifest, None).unwrap()),
        sound
    );
}
