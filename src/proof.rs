//! The proof of a diagnosis: sets of concealed recordings written and sealed, and diagnoses held against the truth once it is opened.

use crate::description::RobotDescription;
use crate::error::{Error, Fault, Result};
use crate::estimate::threads::in_order;
use crate::raw;
use crate::table::{Recording, Scoreboard, ScoreboardRow, Table, Truth};
use crate::twin::conceal;
use crate::twin::conceal::design::Design;
use crate::twin::drive::DriveCase;
use crate::twin::folder::{self, Decimals, File, Log};
use crate::twin::reveal::board::Board;
use crate::twin::reveal::mark::{Case, Marked, NAMELESS, left_out, mark};
use crate::twin::reveal::paper;
use crate::twin::torque::TorqueCase;
use parquet::arrow::ArrowWriter;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs;
use std::io::ErrorKind;
use std::path::{Component, Path};

/// Writes the recordings, their truths and the seal; gives the number of rows. No byte depends on the number of threads.
pub fn conceal(folder: &Path, design: &Design, threads: usize) -> Result<usize> {
    let contents = design.contents();
    let made = in_order(threads, design.cases, |number| -> Result<Written, String> {
        if design.drives {
            let case = DriveCase::draw(design, number);
            let files = case.recording().into();
            return Ok((case.name.clone(), files, case.sealed()));
        }
        if design.dynamics {
            let case = TorqueCase::draw(design, number);
            let files = case.recording().into();
            return Ok((case.name.clone(), files, case.sealed()));
        }
        let case = conceal::case::Case::make(design, number, contents[number])?;
        Ok((case.name.clone(), case.recording()?.into(), case.sealed()))
    });
    let mut seal = Seal::new(design);
    let mut rows = 0;
    for case in made {
        let (name, files, sealed) = case.map_err(|message| Error::spec("conceal", message))?;
        for (file, text) in &files {
            seal.write(folder, format!("{RECORDINGS}/{name}/{file}"), text)?;
        }
        // The last file has a line of titles.
        rows += files.last().map_or(0, |(_, text)| text.lines().count() - 1);
        seal.write(folder, format!("{SEALED}/{name}.json"), &sealed)?;
    }
    seal.close(folder)?;
    Ok(rows)
}

/// A case as it goes to the disk: its name, the files of its recording, its truth.
type Written = (String, Vec<File>, String);

/// Nothing is overwritten: the folder is new or empty.
pub fn vacant(folder: &Path) -> Result<()> {
    let place = folder.display().to_string();
    match fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
        true => Err(Error::spec(place, "is not empty; name a new folder")),
        false => Ok(()),
    }
}

/// The format of this file.
const FORMAT: u32 = 1;
const HASH: &str = "SHA-256";
/// Where what belongs to a set lies in its folder.
pub const SEAL: &str = "seal.json";
/// Folder of what is diagnosed.
pub const RECORDINGS: &str = "recordings";
/// Folder of the truths.
pub const SEALED: &str = "sealed";

/// Hashes by path below the folder of the set, with `/`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seal {
    calib_seal: u32,
    hash: String,
    /// Hash of the design that the set was drawn from: who goes on with a set can tell that it is the same, and nothing else.
    #[serde(default)]
    design: String,
    files: BTreeMap<String, String>,
}

impl Seal {
    fn new(design: &Design) -> Seal {
        Seal {
            calib_seal: FORMAT,
            hash: HASH.into(),
            design: digest(format!("{design:?}").as_bytes()),
            files: BTreeMap::new(),
        }
    }

    /// Whether the set was drawn from this design.
    pub(crate) fn is_of(&self, design: &Design) -> bool {
        self.design == Seal::new(design).design
    }

    /// Writes a file of the set below `folder` and takes its hash in.
    fn write(&mut self, folder: &Path, name: String, text: &str) -> Result<()> {
        let path = folder.join(&name);
        let parent = path.parent().unwrap_or(folder);
        let written = fs::create_dir_all(parent).and_then(|()| fs::write(&path, text));
        written.map_err(|error| Error::store(path.display().to_string(), error.to_string()))?;
        self.files.insert(name, digest(text.as_bytes()));
        Ok(())
    }

    /// Reads the seal of a set.
    pub fn read(folder: &Path) -> Result<Seal> {
        let path = folder.join(SEAL);
        let place = path.display().to_string();
        let text = raw::text(&path).map_err(|error| Error::data(&place, error.to_string()))?;
        let seal: Seal =
            serde_json::from_str(&text).map_err(|error| Error::data(&place, error.to_string()))?;
        if seal.calib_seal != FORMAT || seal.hash != HASH {
            let message = format!("is no seal of format {FORMAT} with {HASH}");
            return Err(Error::data(place, message));
        }
        Ok(seal)
    }

    /// Holds every file of the set in `folder` against its hash; fails with all that are missing or changed. Gives
    /// their paths.
    pub(crate) fn check(folder: &Path) -> Result<Vec<String>> {
        let seal = Seal::read(folder)?;
        let mut faults = Vec::new();
        for (name, hash) in &seal.files {
            // A seal comes from a file: it may not lead out of its folder.
            let mut parts = Path::new(name).components();
            let inside = parts.all(|part| matches!(part, Component::Normal(_)));
            let bytes = match inside {
                true => raw::bytes(&folder.join(name)),
                false => Err(ErrorKind::InvalidFilename.into()),
            };
            let message = match bytes {
                Ok(bytes) if digest(&bytes) == *hash => continue,
                Ok(_) => "was changed since it was sealed".to_string(),
                Err(error) => format!("was sealed, but cannot be read: {error}"),
            };
            faults.push(Fault::new(name, message));
        }
        Error::if_data(faults)?;
        Ok(seal.files.into_keys().collect())
    }

    /// Writes the seal itself.
    fn close(&self, folder: &Path) -> Result<()> {
        let path = folder.join(SEAL);
        let text = serde_json::to_string_pretty(self);
        let text = text.map_err(|error| Error::Bug(error.to_string()))?;
        fs::write(&path, text + "\n")
            .map_err(|error| Error::store(path.display().to_string(), error.to_string()))
    }
}

/// SHA-256 in hexadecimal digits.
fn digest(bytes: &[u8]) -> String {
    let hash = Sha256::digest(bytes);
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// 1e-9 deg is 0.00005 um at 3 m.
const DECIMALS: Decimals = Decimals {
    angle: 9,
    length: 9,
    time: 2,
};
/// Decimals for a moving arm: a microsecond counts.
const MOVING: Decimals = Decimals {
    time: 6,
    ..DECIMALS
};

/// The files by their names; of an arm that `moves` times are finer. Fails with a sentence where the layout cannot hold the robot.
pub fn recorded(
    robot: &RobotDescription,
    recording: Recording,
    truth: &Truth,
    moves: bool,
) -> Result<Vec<(String, String)>, String> {
    let decimals = if moves { MOVING } else { DECIMALS };
    let description = folder::robot(robot)?;
    let touched = touched(&recording);
    let log = log(recording, moves);
    let mut numbers = "name,effect,where,unit,value\n".to_string();
    for row in &truth.0 {
        let [name, effect, place, unit] = [&row.name, &row.effect, &row.place, &row.unit];
        numbers += &format!("{name},{effect},{place},{unit},{}\n", row.value);
    }
    let file = |name: &str, text: String| (name.to_string(), text);
    let mut files = vec![file("robot.json", description), file("truth.csv", numbers)];
    if touched.is_empty() {
        files.extend([
            file("controller.csv", log.controller(decimals)),
            file("tracker.csv", log.tracker(decimals)),
        ]);
    }
    files.extend(touched);
    Ok(files)
}

/// The joints of a recording at each fixture, rad (m of a prismatic joint), a file without a header under the fixture's name.
fn touched(recording: &Recording) -> BTreeMap<String, String> {
    let mut files: BTreeMap<String, String> = BTreeMap::new();
    for row in 0..recording.rows() {
        if let Some(name) = recording.contact(row) {
            let joints = recording.q(row).iter().map(|q| format!("{q:.12}"));
            let line = joints.collect::<Vec<String>>().join(",") + "\n";
            *files.entry(format!("{name}.csv")).or_default() += &line;
        }
    }
    files
}

/// The recording as a log; what is not known in a row of it is 0, which the twin never leaves unknown.
fn log(recording: Recording, at_once: bool) -> Log {
    let rows = recording.rows();
    let usage = recording.usage.into_iter().map(Option::unwrap_or_default);
    Log {
        joints: recording.joints,
        time_s: recording.time,
        usage: usage.collect(),
        payload_kg: recording.payload.unwrap_or_else(|| vec![0.0; rows]),
        q: recording.q,
        current: recording.current,
        direction: recording.direction,
        velocity: recording.velocity,
        at_once,
        temperature_c: recording.temperature,
        position: recording.position,
        id: recording.point_id,
    }
}

/// Folder, within that of the verdicts, of diagnoses without the causes of their recordings.
pub const LEFT_OUT: &str = "left_out";

/// All sealed cases of the set, marked; `files` are the paths that the seal holds. Of those that were diagnosed without their causes, too,
/// which name was given instead.
pub fn board(folder: &Path, files: &[String], verdicts: &Path) -> Result<Board> {
    let mut board = Board::default();
    let is_sealed = |name: &&String| Path::new(name).starts_with(SEALED);
    for name in files.iter().filter(is_sealed) {
        let path = folder.join(name);
        let truth = truth_at(&path)?;
        let file = path.file_name().unwrap_or_default();
        match read::<paper::Answer>(&verdicts.join(file)) {
            Ok(answer) => {
                let without = read::<paper::Answer>(&verdicts.join(LEFT_OUT).join(file)).ok();
                let without = without.and_then(|without| left_out(&truth, &answer, &without));
                board.left_out.extend(without);
                board.cases.push(mark(&truth, &answer));
            }
            Err(why) => board.missing.push((truth.case, why)),
        }
    }
    Ok(board)
}

/// The cause to leave out of a recording whose truth lies at `path`; none where no single cause of the list is concealed.
pub fn single_cause(path: &Path) -> Result<Option<String>> {
    let truth = truth_at(path)?;
    let is_listed = truth.effects.iter().all(|cause| cause.effect != NAMELESS);
    let mut effects = truth.effects.into_iter();
    let wanted = effects.find(|cause| cause.wanted).map(|cause| cause.effect);
    Ok(wanted.filter(|_| truth.content == "single" && is_listed))
}

fn truth_at(path: &Path) -> Result<paper::Truth> {
    read(path).map_err(|why| Error::data(path.display().to_string(), why))
}

fn read<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, String> {
    let text = raw::text(path).map_err(|error| error.to_string())?;
    serde_json::from_str(&text).map_err(|error| error.to_string())
}

fn rows(case: &Case) -> Vec<ScoreboardRow> {
    let row = |number: usize, effect: Option<String>| ScoreboardRow {
        case: case.name.clone(),
        number: number as i64,
        content: case.content.clone(),
        robot: case.robot.clone(),
        points: case.points as i64,
        effect,
        said: case.strays.first().cloned(),
        strays: case.strays.len() as i64,
        verdict: case.verdict.clone(),
        heldout_before_mm: case.held_out.map(|held_out| held_out.before),
        heldout_after_mm: case.held_out.map(|held_out| held_out.after),
        heldout_bound_mm: case.held_out.map(|held_out| held_out.bound),
        ..Default::default()
    };
    if case.causes.is_empty() {
        return vec![row(0, None)];
    }
    let of_cause = |(number, cause): (usize, &Marked)| ScoreboardRow {
        place: Some(cause.place.clone()),
        form: Some(cause.form.clone()),
        visibility: Some(cause.strength),
        outcome: Some(cause.outcome.name().into()),
        place_right: Some(cause.placed.place),
        name_or_unknown: Some(cause.placed.name_or_unknown),
        wrong_name: Some(cause.placed.wrong_name),
        ..row(number, Some(cause.effect.clone()))
    };
    case.causes.iter().enumerate().map(of_cause).collect()
}

/// One row per concealed effect, as Parquet.
pub fn write_scoreboard(path: &Path, board: &Board) -> Result<()> {
    let frame = Scoreboard(board.cases.iter().flat_map(rows).collect()).to_frame()?;
    let fault = |error: &dyn Display| {
        let message = format!("cannot be written: {error}");
        Error::store(path.display().to_string(), message)
    };
    let file = std::fs::File::create(path).map_err(|error| fault(&error))?;
    let written =
        ArrowWriter::try_new(file, frame.batch().schema(), None).and_then(|mut writer| {
            writer.write(frame.batch())?;
            writer.close()
        });
    written.map(drop).map_err(|error| fault(&error))
}
