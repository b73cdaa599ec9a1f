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

/// The joints that a program declares, row by row, in deg.
pub(super) struct ListedRows {
    label: String,
    /// `name`, then the axes.
    names: Vec<&'static str>,
    /// With the line at which each stands.
    rows: Vec<(u64, Vec<String>)>,
    /// How many poses were left out.
    poses: usize,
    is_named: bool,
    /// Rows handed out.
    next: usize,
}

impl ListedRows {
    /// Reads a program from first byte to last.
    pub(super) fn open(source: impl Read, label: &str, language: Language) -> Result<Self> {
        let mut bytes = Vec::new();
        // One byte more than may be tells that there are too many.
        source
            .take(MOST_BYTES as u64 + 1)
            .read_to_end(&mut bytes)
            .map_err(|error| failed(label, &error))?;
        let list = joint_list(&bytes, language).map_err(|notes| {
            let fault = |note: crate::program::Note| {
                let place = format!("{label}:{}:{}", note.line, note.column);
                Fault::new(place, note.message)
            };
            Error::Data(notes.into_iter().map(fault).collect())
        })?;
        if list.rows.is_empty() {
            return Err(Error::data(label, none(&list, language)));
        }
        let all = match language {
            Language::Krl => KRL,
            Language::Rapid => RAPID,
            Language::Fanuc | Language::UrScript => NUMBERED,
        };
        // An axis that no position has makes no column.
        let has = |k: &usize| {
            let mut rows = list.rows.iter();
            rows.any(|row| row.external.get(*k).is_some_and(Option::is_some))
        };
        let used: Vec<usize> = (0..6).filter(has).collect();
        let names = std::iter::once("name")
            .chain(all[..6].iter().copied())
            .chain(used.iter().map(|k| all[6 + k]));
        let rows = list.rows.iter().map(|row| {
            let external = used.iter().map(|k| row.external[*k]);
            let joints = row.joints.iter().map(|joint| Some(*joint));
            let numbers = joints.chain(external);
            let cells =
                numbers.map(|number| number.map_or_else(String::new, |number| number.to_string()));
            let cells = std::iter::once(row.name.clone()).chain(cells);
            (row.line as u64, cells.collect())
        });
        Ok(Self {
            label: label.into(),
            names: names.collect(),
            rows: rows.collect(),
            poses: list.poses,
            is_named: false,
            next: 0,
        })
    }
}

/// That a program declares no joints, and how it would.
fn none(list: &JointList, language: Language) -> String {
    let example = match language {
        Language::Krl => "DECL E6AXIS XP1={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0}",
        Language::Fanuc => "P[1]{ GP1: UF : 0, UT : 1, J1= 0.000 deg, ... J6= 0.000 deg };",
        Language::UrScript => "wp1_q = [0.0, -1.57, 1.57, 0.0, 1.57, 0.0]",
        Language::Rapid => "CONST jointtarget p10:=[[0,-10,20,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];",
    };
    let poses = if list.poses > 0 {
        format!(" ({} without joints)", counted(list.poses, "pose"))
    } else {
        String::new()
    };
    format!("declares no joint position{poses}; allowed: declarations such as `{example}`")
}

impl RecordReader for ListedRows {
    fn label(&self) -> &str {
        &self.label
    }
    fn next(&mut self, record: &mut Record) -> Result<bool> {
        if !std::mem::replace(&mut self.is_named, true) {
            record.begin(1);
            self.names
                .iter()
                .for_each(|name| record.push(name.as_bytes()));
            return Ok(true);
        }
        let Some((line, cells)) = self.rows.get(self.next) else {
            return Ok(false);
        };
        self.next += 1;
        record.begin(*line);
        cells.iter().for_each(|cell| record.push(cell.as_bytes()));
        Ok(true)
    }
    /// The line of the last row handed out.
    fn lines(&self) -> u64 {
        self.next
            .checked_sub(1)
            .and_then(|row| self.rows.get(row))
            .map_or(0, |(line, _)| *line)
    }
    fn bytes(&self) -> u64 {
        self.next as u64
    }
    fn remark(&self) -> Option<String> {
        let poses = self.poses;
        (poses > 0).then(|| format!("{} without joints left out", counted(poses, "pose")))
    }
}
