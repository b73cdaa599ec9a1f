//! The rows that a diagnosis, or a fleet, asks of: measured, placed, and compared with an outside simulation where there is one.

use super::{CellPrior, Diagnose, DiagnoseReads};
use crate::diagnose::{KnownCell, Question, against_simulation};
use crate::effect::DeclaredCause;
use crate::error::{Error, Result};
use crate::estimate::gauge;
use crate::observation::values;
use crate::robot::{Measurements, RobotModel};
use crate::stage::declared_effects::declared_effects;
use crate::stage::unmoved::must_move;
use crate::stage::{Context, screened};
use crate::table::Corrected;
use std::collections::BTreeMap;

/// Fewest rows that place a robot before the tracker; what is missing takes more of them.
const FEWEST: usize = 3;

const SORTED_OTHERWISE: &str = "rows stand in another order than their times (sorted by name?): approach, lag and drift follow the times";

/// The rows that a diagnosis is asked of, and the robot that they belong to.
pub(in crate::stage) struct AskedRows {
    own: Vec<&'static DeclaredCause>,
    known: Vec<KnownCell>,
    pub data: Measurements,
    pub corrected: Corrected,
    pub fit: Vec<usize>,
    validate: Vec<usize>,
    robot: RobotModel,
    set: Vec<usize>,
}

impl AskedRows {
    /// Of the tables of a stage with these settings; fails where they do not place the robot.
    pub fn of(settings: &Diagnose, reads: &DiagnoseReads, context: &Context) -> Result<Self> {
        let own = declared_effects(&settings.effects, context)?;
        let asked = reads.split.rows(&reads.recording, &settings.on)?;
        let (data, corrected) = mismatch(reads, &asked, context)?;
        if data.sequence.is_some() {
            context.warn(SORTED_OTHERWISE);
        }
        let measured = |row: &usize| values(&data, *row) > 0;
        let fit: Vec<usize> = asked.iter().copied().filter(measured).collect();
        if fit.len() < FEWEST {
            let message = format!(
                "{} measured rows to fit do not even place the robot: at least {FEWEST} are needed",
                fit.len()
            );
            return Err(Error::data("table recording", message));
        }
        must_move(&data, &fit)?;
        let validate: Vec<usize> = (0..data.rows())
            .filter(|row| asked.binary_search(row).is_err() && measured(row))
            .collect();
        let (robot, _) = gauge(
            RobotModel::new(reads.robot.to_description()?),
            &data,
            &fit,
            &BTreeMap::new(),
        )
        .map_err(|message| Error::data("table recording", message))?;
        let set = screened::numbered(&reads.split);
        Ok(Self {
            own,
            known: settings.prior.iter().map(CellPrior::known).collect(),
            data,
            corrected,
            fit,
            validate,
            robot,
            set,
        })
    }

    /// What is asked of them.
    pub fn question<'a>(&'a self, settings: &'a Diagnose, seed: u64) -> Question<'a> {
        Question {
            robot: &self.robot,
            data: &self.data,
            fit: &self.fit,
            validate: &self.validate,
            set: &self.set,
            prior_weight: settings.prior_weight,
            open_world: settings.open_world,
            without: &settings.without,
            own: &self.own,
            beside_simulation: self.corrected == Corrected::OutsideSimulation,
            known: &self.known,
            seed,
        }
    }
}

/// What is diagnosed, and what its parameters correct: the measurements, or what they differ by from an outside simulation.
fn mismatch(
    reads: &DiagnoseReads,
    asked: &[usize],
    context: &Context,
) -> Result<(Measurements, Corrected)> {
    let data = reads.recording.measurements();
    let Some(simulated) = &reads.recording.simulated else {
        return Ok((data, Corrected::RobotFile));
    };
    let robot = RobotModel::new(reads.robot.to_description()?);
    let message = "aligning simulation and recording needs three rows to fit with sim_x, sim_y, sim_z and a measured point";
    let data = against_simulation(&robot, &data, simulated, asked)
        .ok_or_else(|| Error::data("table recording", message))?;
    context.note("the mismatch is measured minus simulated (sim_x, sim_y, sim_z)");
    context.warn("parameters correct that simulation: they are not the robot file's");
    Ok((data, Corrected::OutsideSimulation))
}
