//! Where a carried model comes from: the rows it was fitted to, and the geometry that was identified by itself from the same recording.

use super::{TransferReads, is_geometry};
use crate::effect::{Load, names};
use crate::error::Result;
use crate::estimate::{FitOptions, fit};
use crate::robot::RobotModel;
use crate::table::{ParameterRow, Parameters, Recording};

/// A recording that a model was fitted to.
pub(super) struct CarriedFrom<'a> {
    stage: String,
    pub recording: &'a Recording,
    /// Rows that it was fitted to.
    pub rows: Vec<usize>,
}

impl<'a> CarriedFrom<'a> {
    /// The recording of the carried model; none where the tables do not tell.
    pub fn of(reads: &'a TransferReads) -> Option<Self> {
        let carried = reads
            .models
            .iter()
            .rfind(|model| model.table == reads.parameters)?;
        Self::of_stage(reads, &carried.stage)
    }

    fn of_stage(reads: &'a TransferReads, stage: &str) -> Option<Self> {
        let prediction = &reads
            .predictions
            .iter()
            .find(|one| one.stage == stage)?
            .table;
        let recording = reads
            .recordings
            .iter()
            .map(|one| &one.table)
            .find(|table| prediction.is_of(table))?;
        let rows = (0..)
            .zip(&prediction.0)
            .filter(|(_, row)| !row.held_out && !row.suspect)
            .map(|(at, _)| at)
            .collect();
        Some(Self {
            stage: stage.into(),
            recording,
            rows,
        })
    }

    /// The geometry that an earlier stage identified by itself from the same recording, else the carried model's, fitted anew to the
    /// same rows without what else was found.
    pub fn geometry(&self, reads: &TransferReads, load: Load) -> Result<Parameters> {
        let of_the_arm = |row: &ParameterRow| {
            row.status == "free"
                && ![names::BASE_FRAME, names::TOOL_OFFSET].contains(&row.effect.as_str())
        };
        let alone = |parameters: &Parameters| {
            parameters.0.iter().all(is_geometry) && parameters.0.iter().any(of_the_arm)
        };
        let here = |stage: &str| {
            CarriedFrom::of_stage(reads, stage).is_some_and(|one| one.recording == self.recording)
        };
        let identified = reads
            .models
            .iter()
            .rfind(|model| model.stage != self.stage && alone(&model.table) && here(&model.stage));
        if let Some(identified) = identified {
            return Ok(identified.table.clone());
        }
        let start = stripped(&reads.parameters).model(
            RobotModel::new(reads.robot.to_description()?),
            &[],
            load,
        )?;
        let candidates: Vec<usize> = (0..start.x.len()).collect();
        let options = FitOptions {
            rows: &self.rows,
            candidates: &candidates,
        };
        let (model, fitted) = fit(&start, &self.recording.measurements(), &options);
        Ok(Parameters::of(&self.stage, &model, &fitted, &[], None))
    }
}

/// The geometry as it stands among what else was found, which it makes up for in part.
pub(super) fn stripped(parameters: &Parameters) -> Parameters {
    Parameters(
        parameters
            .0
            .iter()
            .filter(|row| is_geometry(row))
            .cloned()
            .collect(),
    )
}
