//! A recording of commands and measured angles, with the MJCF that is simulated: which columns are which, the rate, the encoder's steps, and
//! the files that `diagnose_drives` takes.

use super::lerobot::{self, DataSet};
use super::names::lists;
use super::pipeline::{from_folder, name_of};
use super::sheet::{self, Sheet, number};
use crate::drives::mjcf::{self, MjcfArm, MjcfText};
use crate::error::{Error, Result, listed};
use crate::raw::{self, ColumnRows, Record, RecordReader};
use crate::stage::short;
use crate::yaml::quoted;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What `init` writes for drives.
pub(crate) struct DriveStart {
    pub(crate) pipeline: String,
    /// Text of `drives.json`.
    pub(crate) drives: String,
    /// What was found, a sentence each.
    pub(crate) accounts: Vec<String>,
    /// What a person should know, a sentence each.
    pub(crate) notes: Vec<String>,
}

const COMMANDED: &str = "cmd command commands commanded target targets desired des ref goal setpoint \
    action actions control soll sollwert vorgabe";
const MEASURED: &str = "q pos position positions angle angles measured meas actual state observation \
    joint ist istwert";
/// Words of columns that are neither.
const OTHERS: &str = "dq qd vel velocity velocities speed torque torques tau effort current currents \
    temp temperature acc voltage";
const CLOCKS: &str = "time timestamp t stamp clock timestamps zeit";
/// Words of a column that tells trajectories apart.
const TRAJECTORIES: &str = "traj trajectory episode run segment trial fahrt lauf bahn";
/// Rows a trajectory at least: what changes more often is something else.
const SHORTEST: usize = 20;
/// What the stage takes without being told.
const DEFAULT_TRAJECTORY: &str = "traj";
/// Rows that are looked at.
const LOOKED_AT: usize = 5_000;
/// rad beyond which angles are taken to be degrees.
const DEGREES: f64 = 7.0;

/// A file with its head and some of its rows.
struct Table {
    path: PathBuf,
    label: String,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Lines of `text` in the YAML, of what is not written as most texts are.
    text: Vec<String>,
}

/// A quantity of all joints: the name in the YAML, and its values row by row.
struct Found {
    column: String,
    values: Vec<Vec<f64>>,
}

fn words(text: &str) -> Vec<String> {
    let parts = text.split(|c: char| !c.is_ascii_alphabetic());
    let parts = parts.filter(|part| !part.is_empty());
    parts.map(str::to_ascii_lowercase).collect()
}

fn has(text: &str, list: &str) -> bool {
    words(text).iter().any(|word| lists(list, word))
}

impl Table {
    fn read(path: &Path) -> Result<Self> {
        match raw::ending(path).as_str() {
            "parquet" => Self::of_columns(path),
            _ => Self::of_text(path),
        }
    }

    /// A Parquet file; its lists are a column for each number.
    fn of_columns(path: &Path) -> Result<Self> {
        let label = path.display().to_string();
        let file = raw::open(path).map_err(|error| Error::unreadable(&label, &error))?;
        let mut reader = ColumnRows::open(file, &label)?;
        let mut record = Record::default();
        let mut lines: Vec<Vec<String>> = Vec::new();
        while lines.len() <= LOOKED_AT && reader.next(&mut record)? {
            let cells = (0..record.len()).map(|k| String::from_utf8_lossy(record.field(k)).into());
            lines.push(cells.collect());
        }
        let mut lines = lines.into_iter();
        Ok(Self {
            path: path.to_path_buf(),
            label,
            head: lines.next().unwrap_or_default(),
            rows: lines.collect(),
            text: Vec::new(),
        })
    }

    fn of_text(path: &Path) -> Result<Self> {
        let label = path.display().to_string();
        // A table of lists is none of numbers, and read below.
        let sheets = sheet::tables(path, 1)?.into_iter();
        if let Some(sheet) = sheets.last().filter(is_of_numbers) {
            return Ok(Self::of_sheet(path, label, sheet));
        }
        let text = raw::text(path).map_err(|error| Error::unreadable(&label, &error))?;
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let fail = |error: csv::Error| Error::data(&label, error.to_string());
        let head = reader.headers().map_err(fail)?.iter().map(String::from);
        let head = head.collect();
        let mut rows = Vec::new();
        for record in reader.records().take(LOOKED_AT) {
            rows.push(record.map_err(fail)?.iter().map(String::from).collect());
        }
        Ok(Self {
            path: path.to_path_buf(),
            label,
            head,
            rows,
            text: Vec::new(),
        })
    }

    /// A text that is written in a way of its own; its numbers as all others are.
    fn of_sheet(path: &Path, label: String, sheet: Sheet) -> Self {
        let mut text = Vec::new();
        match sheet.delimiter {
            ',' => (),
            ' ' => text.push("delimiter: whitespace".into()),
            '\t' => text.push("delimiter: tab".into()),
            other => text.push(format!("delimiter: {}", quoted(&other.to_string()))),
        }
        if sheet.comma {
            text.push("decimal: comma".into());
        }
        if sheet.skip > 0 {
            text.push(format!("skip: {}   # lines above the header", sheet.skip));
        }
        if sheet.unit_row {
            text.push("skip_below_header: 1   # a row of units".into());
        }
        if let Some(mark) = sheet.comment {
            text.push(format!("comment: {}", quoted(mark)));
        }
        let plain = |cell: String| number(&cell).map_or(cell, |value| value.to_string());
        let rows = sheet.rows.into_iter().take(LOOKED_AT);
        Self {
            path: path.to_path_buf(),
            label,
            head: sheet.names,
            rows: rows
                .map(|row| row.into_iter().map(plain).collect())
                .collect(),
            text,
        }
    }

    /// The column that tells trajectories apart, by its name and by how seldom it changes.
    fn trajectory(&self) -> Option<&String> {
        let changes = |at: usize| {
            let pairs = self.rows.windows(2);
            pairs.filter(|pair| pair[0][at] != pair[1][at]).count()
        };
        let named = self.head.iter().enumerate();
        let mut named = named.filter(|(_, column)| has(column, TRAJECTORIES));
        named
            .find(|(at, _)| changes(*at) * SHORTEST < self.rows.len())
            .map(|(_, column)| column)
    }

    fn numbers(&self, column: usize) -> Option<Vec<f64>> {
        let cells = self.rows.iter().map(|row| row[column].parse().ok());
        cells.collect()
    }

    /// Columns that are there for every joint of `names`, by their pattern, and lists that are as long.
    fn quantities(&self, names: &[String]) -> Vec<Found> {
        let mut found = Vec::new();
        let mut patterns: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (k, name) in names.iter().enumerate() {
            for (at, column) in self.head.iter().enumerate() {
                let mut called = [name.as_str(), short(name)].into_iter();
                let called = called.find(|name| column.contains(name));
                let by_name = called.map(|name| column.replacen(name, "{name}", 1));
                let number = (k + 1).to_string();
                let by_number = column.match_indices(&number).find(|(from, text)| {
                    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
                    !digit(column[..*from].chars().next_back())
                        && !digit(column[from + text.len()..].chars().next())
                });
                let by_number = by_number.map(|(from, text)| {
                    format!("{}{{j}}{}", &column[..from], &column[from + text.len()..])
                });
                for pattern in by_name.into_iter().chain(by_number) {
                    let columns = patterns.entry(pattern).or_default();
                    if columns.len() == k {
                        columns.push(at);
                    }
                }
            }
        }
        for (column, at) in patterns
            .into_iter()
            .filter(|(_, at)| at.len() == names.len())
        {
            let all: Option<Vec<Vec<f64>>> = at.iter().map(|at| self.numbers(*at)).collect();
            if let Some(all) = all {
                let rows = 0..self.rows.len();
                let values = rows
                    .map(|row| all.iter().map(|one| one[row]).collect())
                    .collect();
                found.push(Found { column, values });
            }
        }
        for (at, column) in self.head.iter().enumerate() {
            let list = |row: &Vec<String>| -> Option<Vec<f64>> {
                let cell = row[at].strip_prefix('[')?.strip_suffix(']')?;
                let parts = cell.split([',', ' ']).filter(|part| !part.is_empty());
                parts.map(|part| part.parse().ok()).collect()
            };
            let values: Option<Vec<Vec<f64>>> = self.rows.iter().map(list).collect();
            let is_whole = |rows: &Vec<Vec<f64>>| rows.iter().all(|row| row.len() >= names.len());
            if let Some(values) = values.filter(is_whole).filter(|rows| !rows.is_empty()) {
                found.push(Found {
                    column: column.clone(),
                    values,
                });
            }
        }
        found
    }

    /// The column of time, its unit, and s between two rows.
    fn clock(&self) -> Option<(String, &'static str, f64)> {
        let is_clock = |column: &&String| has(column, CLOCKS);
        let column = self.head.iter().find(is_clock)?;
        let at = self.head.iter().position(|one| one == column)?;
        let time = self.numbers(at)?;
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let step = *steps.get(steps.len() / 2)?;
        // Joints are commanded at 2 Hz to 10 kHz.
        let (unit, by) = match words(column).last().map(String::as_str) {
            Some("s") => ("s", 1.0),
            Some("ms") => ("ms", 1e-3),
            Some("us") => ("us", 1e-6),
            Some("ns") => ("ns", 1e-9),
            _ if step < 0.5 => ("s", 1.0),
            _ if step < 500.0 => ("ms", 1e-3),
            _ if step < 5e5 => ("us", 1e-6),
            _ => ("ns", 1e-9),
        };
        Some((column.clone(), unit, by * step))
    }
}

/// The chain of these joints of an MJCF, or of the first that are one, in its order; the names of all, and the files that it includes.
pub(crate) fn chain(
    path: &Path,
    wanted: &[String],
) -> Result<(MjcfArm, Vec<String>, Vec<PathBuf>)> {
    let label = path.display().to_string();
    let read = |path: &Path| {
        let label = path.display().to_string();
        let text = raw::text(path).map_err(|error| Error::unreadable(&label, &error));
        text.map(|text| (label, text))
    };
    let (_, text) = read(path)?;
    let in_its_folder = |name: String| path.parent().unwrap_or(Path::new("")).join(name);
    let includes: Vec<PathBuf> = mjcf::included(&text)
        .into_iter()
        .map(in_its_folder)
        .collect();
    let texts: Result<Vec<(String, String)>> = includes.iter().map(|path| read(path)).collect();
    let texts = texts?;
    let others: Vec<MjcfText> = texts
        .iter()
        .map(|(label, text)| MjcfText { label, text })
        .collect();
    let file = MjcfText {
        label: &label,
        text: &text,
    };
    let mut all = Vec::new();
    for text in texts.iter().map(|(_, text)| text).chain([&text]) {
        if let Ok(document) = roxmltree::Document::parse(text) {
            let joints = document.descendants().filter(|node| {
                node.has_tag_name("joint")
                    && !matches!(node.attribute("type"), Some("free" | "ball"))
                    && node.ancestors().any(|node| node.has_tag_name("worldbody"))
            });
            all.extend(joints.filter_map(|node| node.attribute("name").map(String::from)));
        }
    }
    let mut names: Vec<String> = wanted.to_vec();
    for name in all.iter().filter(|_| wanted.is_empty()) {
        let more = [names.as_slice(), std::slice::from_ref(name)].concat();
        if mjcf::read(file, &others, &more).is_ok() {
            names = more;
        }
    }
    // With its own words where nothing is a chain.
    let arm = mjcf::read(file, &others, &names)?;
    Ok((arm, all, includes))
}

/// Whether a table of numbers was understood.
fn is_of_numbers(sheet: &Sheet) -> bool {
    sheet.trouble.is_none() && sheet.header && !sheet.header_in_comment
}

/// Files of the recording: texts or Parquet, of a folder those in it, of a data set its first.
fn tables(data: &[PathBuf], set: Option<&DataSet>) -> Result<Vec<Table>> {
    if let Some(set) = set {
        return Ok(vec![Table::read(&set.first)?]);
    }
    let is_read =
        |path: &Path| ["csv", "txt", "tsv", "parquet"].contains(&raw::ending(path).as_str());
    let mut files = Vec::new();
    for path in data {
        if path.is_dir() {
            let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
            let mut inside: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
            inside.retain(|path| is_read(path));
            inside.sort();
            files.extend(inside);
        } else {
            files.push(path.clone());
        }
    }
    if files.is_empty() || files.len() > 2 || !files.iter().all(|path| is_read(path)) {
        let names: Vec<String> = files
            .iter()
            .map(|path| path.display().to_string())
            .collect();
        let message = format!(
            "{}; with --mjcf allowed: one CSV or Parquet of commands and angles, or two, the commands' and the angles', or the folder of a LeRobot data set",
            if names.is_empty() {
                "neither CSV nor Parquet, nor meta/info.json".into()
            } else {
                names.join(", ")
            }
        );
        return Err(Error::spec("--data", message));
    }
    files.iter().map(|path| Table::read(path)).collect()
}

/// Looks at a recording of commands and angles. Fails where one of them is not found.
pub(crate) fn start_drives(folder: &Path, data: &[PathBuf], robot: &Path) -> Result<DriveStart> {
    let (arm, all, includes) = chain(robot, &[])?;
    let set = match data {
        [folder] => DataSet::open(folder)?,
        _ => None,
    };
    let set = set.as_ref();
    let tables = tables(data, set)?;
    let recorded = |names: &[String]| -> Option<[(usize, Found); 2]> {
        let commanded = |table: &Table, column: &str| {
            let file = table.path.file_stem().unwrap_or_default().to_string_lossy();
            has(column, COMMANDED) || (tables.len() == 2 && has(&file, COMMANDED))
        };
        let (mut command, mut angle) = (None, None);
        for (k, table) in tables.iter().enumerate() {
            for one in table.quantities(names) {
                if has(&one.column, OTHERS) {
                    continue;
                }
                match commanded(table, &one.column) {
                    true if command.is_none() => command = Some((k, one)),
                    false if angle.is_none() && has(&one.column.replace("{j}", " "), MEASURED) => {
                        angle = Some((k, one));
                    }
                    _ => (),
                }
            }
        }
        Some([command?, angle?])
    };
    // The last joints may be none of the recording's: a gripper.
    let mut names: Vec<String> = arm.joints.iter().map(|joint| joint.name.clone()).collect();
    let found = loop {
        if let Some(found) = recorded(&names) {
            break found;
        }
        names.pop();
        if names.is_empty() {
            let columns: Vec<String> = tables
                .iter()
                .map(|table| {
                    let head: Vec<&str> = table.head.iter().map(String::as_str).collect();
                    format!("{} has {}", table.label, listed(&head))
                })
                .collect();
            let message = format!(
                "no columns of commands and of angles for joints of {} ({}): {}; expected a word as cmd, target, action and q, pos, state in their names",
                robot.display(),
                all.join(", "),
                columns.join("; ")
            );
            return Err(Error::data("--data", message));
        }
    };
    let [(of_commands, command), (of_angles, angle)] = found;
    let table = &tables[of_angles];
    let clock = table.clock();
    let (time, time_unit, step) = clock.ok_or_else(|| {
        let message = "has no column of time (time, timestamp, t), whose values rise";
        Error::data(&table.label, message)
    })?;
    let trajectory = table.trajectory();
    let rate = (1e3 / step).round() / 1e3;
    let rate = if rate > 20.0 { rate.round() } else { rate };
    let rate = set.map_or(rate, |set| set.fps);
    let largest = angle
        .values
        .iter()
        .flatten()
        .fold(0.0, |most: f64, one| most.max(one.abs()));
    let unit = match set {
        _ if largest <= DEGREES => "rad",
        Some(set) if set.may_be_per_cent(largest) => "percent",
        _ => "deg",
    };
    if let Some(set) = set {
        set.must_be_in_order(&names)?;
    }
    let by = |joint: usize| match (unit, arm.joints[joint].range) {
        ("rad", _) => 1.0,
        ("percent", Some([low, high])) => 0.005 * (high - low),
        _ => 1f64.to_radians(),
    };
    let joints = names.iter().enumerate().map(|(k, name)| {
        let servo = arm.joints[k].servo;
        let step = by(k) * encoder(angle.values.iter().map(|row| row[k]));
        json!({
            "joint": name, "kp": servo.map(|servo| servo.kp), "kd": servo.map(|servo| servo.kd), "kd_on": "speed",
            "torque_limit_nm": servo.map(|servo| servo.limit).filter(|limit| limit.is_finite()),
            "encoder_rad": step, "noise_rad": 3e-4,
        })
    });
    let drives = json!({
        "check": "kp (Nm/rad), kd (Nm s/rad; kd_on: speed or error), torque_limit_nm as the simulation has them; command_rate_hz; noise_rad, one sigma",
        "command_rate_hz": rate,
        "joints": joints.collect::<Vec<_>>(),
        "inertia_tolerance": { "mass_rel": 0.05, "com_mm": 3.0, "inertia_rel": 0.2 },
    });
    let drives =
        serde_json::to_string_pretty(&drives).map_err(|error| Error::Bug(error.to_string()))?;
    let mut lines = vec![
        "# Commands and angles of simulated joints: what the simulation lacks. `calib check` reports every fault, `calib diagnose` answers.".into(),
        "calib: 1".into(),
        format!("name: {}", name_of(folder)),
        "seed: 1".into(),
        "stages:".into(),
        "  - uses: diagnose_drives".into(),
        "    with:".into(),
        format!("      robot: {}", from_folder(folder, robot)),
    ];
    if !includes.is_empty() {
        let files: Vec<String> = includes
            .iter()
            .map(|path| from_folder(folder, path))
            .collect();
        lines.push(format!("      includes: [{}]", files.join(", ")));
    }
    let gains = match arm.joints[..names.len()]
        .iter()
        .all(|joint| joint.servo.is_some())
    {
        true => "gains and limits are those of its actuators",
        false => "state kp of each joint, null there",
    };
    let (stated, recording) = match set {
        Some(set) => ("of meta/info.json", set.files()),
        None => ("from the stamps", table.path.clone()),
    };
    lines.push(format!("      drives: drives.json   # CHECK {gains}; {rate} Hz {stated}; steps of the encoders from the values"));
    lines.push(format!(
        "      recording: {}",
        from_folder(folder, &recording)
    ));
    if of_commands != of_angles {
        let path = &tables[of_commands].path;
        lines.push(format!("      commands: {}", from_folder(folder, path)));
    }
    if !table.text.is_empty() {
        lines.push("      text:".into());
        let text = table.text.iter();
        lines.extend(text.map(|line| format!("        {line}")));
    }
    lines.extend([
        "      columns:".into(),
        format!("        time: {}", quoted(&time)),
        format!("        time_unit: {time_unit}   # CHECK"),
        format!("        command: {}   # CHECK", quoted(&command.column)),
        format!("        angle: {}   # CHECK", quoted(&angle.column)),
        format!(
            "        unit: {unit}   # CHECK{}",
            match unit {
                "percent" =>
                    ": -100 to 100 of each joint's range; or deg, which the data set does not say",
                _ => "",
            }
        ),
    ]);
    if set.is_some() {
        lines.push(format!("        trajectory: {}", quoted(lerobot::EPISODE)));
        lines.push("      hold_out: {last: 0.25}   # CHECK the end of each episode judges".into());
    } else if let Some(column) = trajectory.filter(|column| *column != DEFAULT_TRAJECTORY) {
        lines.push(format!("        trajectory: {}   # CHECK", quoted(column)));
    }
    if set.is_none() && !table.head.iter().any(|column| column == "use") {
        lines.push("        # usage: use   # CHECK a column that says `fit` or `validate`; without it all rows are fitted, and the errors flatter".into());
    }
    lines.push("  - uses: report_drives".into());
    let known = [Some(&time), trajectory].into_iter().flatten();
    let known: Vec<&str> = known.map(String::as_str).chain(["use"]).collect();
    let is_used = |column: &String| {
        let of_joints = names.iter().enumerate().any(|(k, name)| {
            [&command, &angle].into_iter().any(|found| {
                let pattern = found.column.replace("{j}", &(k + 1).to_string());
                [name.as_str(), short(name)]
                    .iter()
                    .any(|name| pattern.replace("{name}", name) == *column)
            })
        });
        of_joints || known.contains(&column.as_str())
    };
    let unused: Vec<&str> = (table.head.iter().filter(|column| !is_used(column)))
        .map(String::as_str)
        .collect();
    let mut notes = arm.notes.clone();
    if let Some(set) = set {
        notes.push("stamps of a LeRobot data set are the number of the row over fps, not measured: an uneven rate shows as delay and friction".into());
        if set.names.len() > names.len() {
            notes.push(format!(
                "not read: {}, which no joint of the chain is",
                set.names[names.len()..].join(", ")
            ));
        }
    }
    let others: Vec<&str> = all
        .iter()
        .filter(|name| !names.contains(name))
        .map(String::as_str)
        .collect();
    if !others.is_empty() {
        notes.push(format!(
            "held at their reference: {}; another chain is another list of `joints` in drives.json",
            others.join(", ")
        ));
    }
    Ok(DriveStart {
        pipeline: lines.join("\n") + "\n",
        drives: drives + "\n",
        accounts: vec![
            format!("joints {}", names.join(", ")),
            format!(
                "commands {}, angles {} ({unit}), {rate} Hz",
                command.column, angle.column
            ),
            match trajectory {
                Some(column) => format!("trajectories by {column}"),
                None => "one trajectory, but for pauses in the stamps".into(),
            },
        ]
        .into_iter()
        .chain((!unused.is_empty()).then(|| format!("not used: {}", listed(&unused))))
        .collect(),
        notes,
    })
}

/// The steps of an encoder by the least distance of two values; 0 where they are finer than could be told.
fn encoder(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let steps = values.windows(2).map(|pair| pair[1] - pair[0]);
    let least = steps
        .filter(|step| *step > 1e-9)
        .fold(f64::INFINITY, f64::min);
    if least > 1e-4 && least.is_finite() {
        // A difference of written decimals has their rounding in it.
        (1e9 * least).round() / 1e9
    } else {
        0.0
    }
}
