//! Whose an export is: format, serial number and hash of the model, in a line of every file; and whether a file belongs to a model.

use super::{Export, FORMATS, Format};
use crate::error::{Error, Result, one_line};
use crate::table::{Robot, Table};
use std::fmt;

/// What stands in every export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ExportMark {
    /// Of the file.
    pub(crate) format: String,
    /// Of the robot, where the pipeline's report states it.
    pub(crate) serial: Option<String>,
    /// Of the nominal robot and all that was identified.
    pub(crate) model: String,
}

/// How a mark begins.
const BEGINS: &str = "calib export: format ";
/// Digits of the hash.
const DIGITS: usize = 16;

impl fmt::Display for ExportMark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let serial = self.serial.as_deref().unwrap_or("not stated");
        write!(
            f,
            "{BEGINS}{}, model {}, robot serial {serial}",
            self.format, self.model
        )
    }
}

impl ExportMark {
    /// The mark of a file; none where it has none.
    fn of(text: &str) -> Option<Self> {
        let (_, tail) = text.split_once(BEGINS)?;
        let line = tail
            .lines()
            .next()?
            .trim_end_matches(['"', ',', ' '])
            .trim_end_matches("-->")
            .trim_end();
        let (format, tail) = line.split_once(", model ")?;
        let (model, serial) = tail.split_once(", robot serial ")?;
        let serial = (serial != "not stated").then(|| serial.to_string());
        Some(Self {
            format: format.into(),
            serial,
            model: model.into(),
        })
    }
}

/// Whether a file is the export of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Belonging {
    /// It is.
    Same(ExportMark),
    /// It is that of another model or robot: the file's mark, and that of the model.
    Other(ExportMark, ExportMark),
    /// It was, and this line of it (from 1) is another one now.
    Edited(ExportMark, usize),
}

impl Export {
    /// The mark of a file in this format.
    pub(crate) fn mark(&self, format: &str) -> ExportMark {
        // As text that holds no sign of another format; hashes of tables are those of their content.
        let plain = |serial: &String| {
            one_line(serial)
                .replace(['"', '\\', '-'], "_")
                .chars()
                .take(80)
                .collect::<String>()
        };
        let serial = self.identified.serial.as_ref().map(plain);
        ExportMark {
            format: format.into(),
            serial,
            model: self.hash(),
        }
    }

    fn hash(&self) -> String {
        let robot = Robot::from_description(&self.identified.robot).to_frame();
        let parameters = self.identified.parameters.to_frame();
        let torques = self.identified.torques.as_ref();
        let torques = torques.map(|torques| torques.parameters.to_frame());
        let mut hasher = blake3::Hasher::new();
        for table in [robot, parameters].into_iter().chain(torques).flatten() {
            hasher.update(table.table_hash().as_str().as_bytes());
        }
        hasher.finalize().to_hex().chars().take(DIGITS).collect()
    }

    /// The mark, and what the reader of a format must know, as comments at the head of a file of text.
    pub(super) fn head(&self, format: &Format) -> String {
        let line = |line: String| format!("{} {line}\n", format.comment);
        self.remarks_in(format).into_iter().map(line).collect()
    }

    /// Whether a file is this model's export. Fails where it carries no mark.
    pub(crate) fn check(&self, label: &str, text: &str) -> Result<Belonging> {
        let message = "carries no mark of calib: it is no export, or one of a version before marks";
        let none = || Error::data(label, message);
        let found = ExportMark::of(text).ok_or_else(none)?;
        let mut formats = FORMATS.iter();
        let format = formats
            .find(|format| format.name == found.format)
            .ok_or_else(none)?;
        let mark = self.mark(format.name);
        if mark != found {
            return Ok(Belonging::Other(found, mark));
        }
        let written = (format.text)(self)?;
        let (theirs, ours) = (content(text, format), content(&written, format));
        let differs = (0..theirs.len().max(ours.len()))
            .find(|k| theirs.get(*k).map(|line| line.1) != ours.get(*k).map(|line| line.1));
        Ok(match differs {
            None => Belonging::Same(mark),
            Some(k) => {
                let end = text.lines().count() + 1;
                Belonging::Edited(mark, theirs.get(k).map_or(end, |line| line.0))
            }
        })
    }
}

/// The lines that are no comments, with their numbers.
fn content<'t>(text: &'t str, format: &Format) -> Vec<(usize, &'t str)> {
    let is_comment = |line: &str| line.trim_start().starts_with(format.comment);
    (1..)
        .zip(text.lines())
        .filter(|(_, line)| !is_comment(line) && !line.trim().is_empty())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_is_read_back_from_every_kind_of_line() {
        let mark = ExportMark {
            format: "urdf".into(),
            serial: Some("2022 3/91".into()),
            model: "00ff".into(),
        };
        for line in [
            format!("<!-- {mark} -->"),
            format!("# {mark}"),
            format!("  \"mark\": \"{mark}\","),
        ] {
            assert_eq!(
                ExportMark::of(&format!("<?xml?>\n{line}\nmore")),
                Some(mark.clone()),
                "{line}"
            );
        }
        assert_eq!(ExportMark::of("calib export: format urdf"), None);
    }
}
