//! How the controller of a run counts its joints.

use super::load;
use crate::error::{Error, Result};
use crate::pipeline::Manifest;
use crate::robot::{JointConvention, RobotModel};
use crate::stage::DeclaredStage;
use crate::stage::ingest::Ingest;
use crate::store::{Store, TableRef};
use crate::table::{JointConventions, Robot, Table};

/// The convention of a run's recording, none where nothing was ingested: the twin logs its joints as its robot file counts them.
/// Fails for a run of an earlier calib, which does not say.
pub fn convention_of(manifest: &Manifest, store: &Store) -> Result<Option<JointConvention>> {
    let convention = last::<JointConventions>(manifest, store)?
        .map(|table| table.to_convention())
        .transpose()?;
    if convention.is_none()
        && manifest
            .stages
            .iter()
            .any(|stage| stage.uses == Ingest::NAME)
    {
        let message = format!(
            "the run does not say how the controller counts its joints: an earlier calib made it. `calib run {}` writes it anew",
            manifest.pipeline.file
        );
        return Err(Error::data(&manifest.run_id, message));
    }
    Ok(convention)
}

/// What differs from the robot file's counting at the controller of a run; none where nothing does, or the run does not say.
pub fn counted_otherwise(manifest: &Manifest, store: &Store) -> Result<Option<String>> {
    let Some(table) = last::<JointConventions>(manifest, store)? else {
        return Ok(None);
    };
    let Some(robot) = last::<Robot>(manifest, store)? else {
        return Ok(None);
    };
    Ok(table
        .to_convention()?
        .difference(&RobotModel::new(robot.to_description()?)))
}

fn last<T: Table>(manifest: &Manifest, store: &Store) -> Result<Option<T>> {
    let mut outputs = manifest.stages.iter().flat_map(|stage| &stage.outputs);
    let table: Option<&TableRef> = outputs
        .rfind(|output| output.kind == T::KIND)
        .map(|output| &output.table);
    table
        .map(|table| T::from_frame(&load(store, table, manifest)?))
        .transpose()
}
