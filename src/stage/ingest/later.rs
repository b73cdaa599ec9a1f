//! Files of later measurements: of the same layout, joined among themselves, behind all rows before.

use super::Ingest;
use super::columns::FileLayout;
use crate::RawFile;
use crate::error::{Place, counted};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Component, PathBuf};

/// Files of a later measurement, in the layout of `files`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LaterFiles {
    /// A path for each of `files`, in their order.
    pub files: Vec<RawFile>,
    /// Where the clock of these files starts again: from the last row before to their first one, s.
    #[serde(default = "hour")]
    pub gap_s: f64,
    /// The target that these files measured, where several reflectors were measured in the same poses, each into a file: it stands for
    /// the `target` of `files`. A file of joints may then be the same, and rows keep their times.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
}

impl LaterFiles {
    /// What their first row comes after the last one by, s; none where they were measured together with those before.
    pub(super) fn gap(&self) -> Option<f64> {
        self.target.is_none().then_some(self.gap_s)
    }
}

fn hour() -> f64 {
    3600.0
}

impl Ingest {
    /// The settings of each measurement alone, in their order.
    pub(super) fn measurements(&self) -> Vec<Self> {
        let later = self.later.iter().map(|later| {
            let layouts = self.files.iter().zip(&later.files);
            let columns = |layout: &FileLayout| match &later.target {
                Some(target) => layout.columns.of_target(target),
                None => layout.columns.clone(),
            };
            let files = layouts.map(|(layout, file)| FileLayout {
                file: file.clone(),
                columns: columns(layout),
                ..layout.clone()
            });
            Self {
                files: files.collect(),
                later: Vec::new(),
                ..self.clone()
            }
        });
        std::iter::once(Self {
            later: Vec::new(),
            ..self.clone()
        })
        .chain(later)
        .collect()
    }

    /// Where the files of the later measurement `index` already stand, all of them.
    fn earlier_of_the_same_files(&self, index: usize) -> Option<String> {
        let later = |k: usize| self.later.get(k).map(|later| paths(later.files.iter()));
        let here = later(index)?;
        if paths(self.files.iter().map(|layout| &layout.file)) == here {
            return Some("files".into());
        }
        (0..index)
            .find(|k| later(*k).as_ref() == Some(&here))
            .map(|k| format!("later[{k}].files"))
    }
}

/// Paths without what does not change them, as `./`.
fn paths<'a>(files: impl Iterator<Item = &'a RawFile>) -> Vec<PathBuf> {
    let plain = |file: &RawFile| {
        let parts = file.0.components();
        parts.filter(|part| *part != Component::CurDir).collect()
    };
    files.map(plain).collect()
}

pub(super) fn faults(settings: &Ingest, at: &mut Place) {
    let expected = settings.files.len();
    let named = |layout: &FileLayout| {
        let target = layout.columns.text("target");
        target.is_some_and(|text| text.value.is_some())
    };
    for (index, later) in settings.later.iter().enumerate() {
        let mut at = at.at(format!("later[{index}]"));
        let files = counted(later.files.len(), "file");
        let message =
            format!("{files} here; allowed: one for each of the {expected} under `files`");
        at.at("files").must(later.files.len() == expected, message);
        if let Some(earlier) = settings.earlier_of_the_same_files(index) {
            at.at("files").fault(format!(
                "the files of `{earlier}` again: every row would be used twice, and copies look like perfect repeatability; name the files \
                 of another measurement, or take these out"
            ));
        }
        at.at("target").must(
            later.target.is_none() || settings.files.iter().any(named),
            "the reflector of `files` has no name; say it there, e.g. `columns: {target: {value: A}, ..}`",
        );
        let possible = later.gap_s >= 0.0 && later.gap_s.is_finite();
        at.at("gap_s").must(possible, "allowed: 0 or more, s");
    }
}

/// Numbers rows through and lets their time go on where files start again.
#[derive(Debug)]
pub(super) struct Continuation {
    last: Option<i64>,
    latest: f64,
    /// Gap before a later measurement, s, until its first row is there; none where its clock is that of the rows before.
    begun: Option<Option<f64>>,
    sequence_by: i64,
    time_by: f64,
}

impl Default for Continuation {
    fn default() -> Self {
        Self {
            last: None,
            latest: f64::NEG_INFINITY,
            begun: None,
            sequence_by: 0,
            time_by: 0.0,
        }
    }
}

impl Continuation {
    /// Before the first row of a later measurement; without a gap its clock is that of the rows before.
    pub fn begin(&mut self, gap_s: Option<f64>) {
        (self.begun, self.sequence_by, self.time_by) = (Some(gap_s), 0, 0.0);
    }

    /// The place and the time of the next row in the recording, from those of its file. `Err` holds the place of the row before where
    /// the row does not follow it.
    pub fn next(&mut self, sequence: i64, time: f64) -> Result<(i64, f64), (i64, i64)> {
        if let Some(gap) = self.begun.take() {
            let last = self.last.filter(|last| sequence <= *last);
            self.sequence_by = last.map_or(0, |last| last.saturating_sub(sequence - 1));
            if let Some(gap) = gap.filter(|_| time <= self.latest) {
                self.time_by = self.latest + gap - time;
            }
        }
        let sequence = sequence.saturating_add(self.sequence_by);
        let time = time + self.time_by;
        self.latest = self.latest.max(time);
        match self.last.replace(sequence) {
            Some(last) if sequence <= last => Err((sequence, last)),
            _ => Ok((sequence, time)),
        }
    }
}
