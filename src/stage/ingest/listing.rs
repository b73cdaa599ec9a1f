//! Joint positions that a controller's program declares, as the rows of a table: `name`, the six joints, the external axes.

use crate::error::{Error, Fault, Result, counted};
use crate::program::{JointList, Language, MOST_BYTES, joint_list};
use crate::raw::{Record, RecordReader, failed};
use std::io::Read;

/// Names of the columns: as the languages call the axes.
const RAPID: [&str; 12] = [
    "rax_1", "rax_2", "rax_3", "rax_4", "rax_5", "rax_6", "eax_a", "eax_b", "eax_c", "eax_d",
    "eax_e", "eax_f",
];
const KRL: [&str; 12] = [
    "A1", "A2", "A3", "A4", "A5", "A6", "E1", "E2", "E3", "E4", "E5", "E6",
];

const NUMBERED: [&str; 12] = [
    "J1", "J2", "J3", "J4", "J5", "J6", "E1", "E2", "E3", "E4", "E5", "E6",
];

/// The table that a program lists; its joints are in deg.
pub struct ListedTable {
    /// Names of the columns: `name`, then the axes.
    pub names: Vec<&'static str>,
    /// With the line at which each stands.
    pub rows: Vec<(u64, Vec<String>)>,
    /// How many poses were left out.
    pub poses: usize,
}

impl ListedTable {
    /// Reads a program from first byte to last.
    pub fn read(source: impl Read, label: &str, language: Language) -> Result<Self> {
        let mut bytes = Vec::new();
        // One byte more than may be tells that there are too many.
        source
            .take(MOST_BYTES as u64 + 1)
            .read_to_end(&mut bytes)
            .map_err(|error| failed(label, &error))?;
        let list = joint_list(&bytes, language).map_err(|notes| {
            let fault = |note: crate::program::Note| {
                Fault::new(
                    format!("{label}:{}:{}", note.line, note.column),
                    note.message,
                )
            };
            Error::Data(notes.into_iter().map(fault).collect())
        })?;
        Self::of(&list, language).ok_or_else(|| {
            let example = match language {
                Language::Krl => "DECL E6AXIS XP1={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0}",
                Language::Fanuc => "P[1]{ GP1: UF : 0, UT : 1, J1= 0.000 deg, ... J6= 0.000 deg };",
                Language::UrScript => "wp1_q = [0.0, -1.57, 1.57, 0.0, 1.57, 0.0]",
                Language::Rapid => {
                    "CONST jointtarget p10:=[[0,-10,20,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];"
                }
            };
            let poses = if list.poses > 0 {
                format!(" ({} without joints)", counted(list.poses, "pose"))
            } else {
                String::new()
            };
            Error::data(
                label,
                format!(
                    "declares no joint position{poses}; allowed: declarations such as `{example}`"
                ),
            )
        })
    }

    fn of(list: &JointList, language: Language) -> Option<Self> {
        let all = match language {
            Language::Krl => KRL,
            Language::Rapid => RAPID,
            Language::Fanuc | Language::UrScript => NUMBERED,
        };
        // An axis that no position has makes no column.
        let used: Vec<usize> = (0..6)
            .filter(|k| {
                list.rows
                    .iter()
                    .any(|row| row.external.get(*k).is_some_and(Option::is_some))
            })
            .collect();
        let names = ["name"]
            .into_iter()
            .chain(all[..6].iter().copied())
            .chain(used.iter().map(|k| all[6 + k]));
        let rows = list.rows.iter().map(|row| {
            let external = used.iter().map(|k| {
                row.external[*k]
                    .map(|value| value.to_string())
                    .unwrap_or_default()
            });
            let joints = row.joints.iter().map(f64::to_string);
            (
                row.line as u64,
                [row.name.clone()]
                    .into_iter()
                    .chain(joints)
                    .chain(external)
                    .collect(),
            )
        });
        (!list.rows.is_empty()).then(|| Self {
            names: names.collect(),
            rows: rows.collect(),
            poses: list.poses,
        })
    }
}

/// Opens a program.
pub(super) fn open(
    source: impl Read,
    label: &str,
    language: Language,
) -> Result<Box<dyn RecordReader>> {
    let table = ListedTable::read(source, label, language)?;
    Ok(Box::new(ListingReader {
        label: label.into(),
        table,
        is_named: false,
        rows: 0,
    }))
}

/// Hands out such a table row by row.
struct ListingReader {
    label: String,
    table: ListedTable,
    is_named: bool,
    /// Rows handed out.
    rows: usize,
}

impl RecordReader for ListingReader {
    fn label(&self) -> &str {
        &self.label
    }
    fn next(&mut self, record: &mut Record) -> Result<bool> {
        if !std::mem::replace(&mut self.is_named, true) {
            record.begin(1);
            self.table
                .names
                .iter()
                .for_each(|name| record.push(name.as_bytes()));
            return Ok(true);
        }
        let Some((line, cells)) = self.table.rows.get(self.rows) else {
            return Ok(false);
        };
        self.rows += 1;
        record.begin(*line);
        cells.iter().for_each(|cell| record.push(cell.as_bytes()));
        Ok(true)
    }
    /// The line of the last row handed out.
    fn lines(&self) -> u64 {
        self.rows
            .checked_sub(1)
            .and_then(|row| self.table.rows.get(row))
            .map_or(0, |(line, _)| *line)
    }
    fn bytes(&self) -> u64 {
        self.rows as u64
    }
    fn remark(&self) -> Option<String> {
        let poses = self.table.poses;
        (poses > 0).then(|| format!("{} without joints left out", counted(poses, "pose")))
    }
}
