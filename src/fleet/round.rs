//! A round of a fleet's diagnosis: every robot asked what all cells say of it given those that its group has so far.

use super::file::{FleetRobot, Groups};
use crate::error::{Error, Result};
use crate::pipeline::Plan;
use crate::stage::{
    CellEvidence, DIAGNOSES, DeclaredStage, Diagnose, Given, STAGES, TorqueEvidence,
};
use crate::yaml;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The label by which robots are grouped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum GroupColumn {
    /// Model of the robot.
    Model,
    /// Where it stands.
    Plant,
    /// Date of the measurement.
    Campaign,
}

impl GroupColumn {
    /// The group of a robot; empty where the roster has no label for it.
    pub fn of(self, groups: &Groups) -> &str {
        let label = match self {
            Self::Model => &groups.model,
            Self::Plant => &groups.plant,
            Self::Campaign => &groups.campaign,
        };
        label.as_deref().unwrap_or_default()
    }
}

/// Which cells robots are taken to have.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Round {
    /// The label by which robots are grouped.
    pub(crate) by: GroupColumn,
    /// Of all robots of a group.
    pub(crate) groups: BTreeMap<String, Vec<Given>>,
    /// Of single robots, by name.
    pub(crate) robots: BTreeMap<String, Vec<Given>>,
}

impl Round {
    /// The first: nothing is given.
    pub(crate) fn first(by: GroupColumn) -> Self {
        Self {
            by,
            groups: BTreeMap::new(),
            robots: BTreeMap::new(),
        }
    }

    fn given(&self, robot: &FleetRobot) -> Vec<Given> {
        let group = self.groups.get(self.by.of(&robot.groups));
        let given = self.robots.get(&robot.name);
        group.into_iter().chain(given).flatten().cloned().collect()
    }

    /// The plan of a robot up to its last stage `diagnose` or `diagnose_torques`, which says what its cells do in place of a diagnosis.
    pub(super) fn plan(&self, plan: Plan, robot: &FleetRobot) -> Result<Plan> {
        let at = plan
            .stages
            .iter()
            .rposition(|stage| DIAGNOSES.contains(&stage.entry.name));
        let at = at.ok_or_else(|| {
            Error::spec(
                plan.file.display().to_string(),
                "has no stage `diagnose` or `diagnose_torques`, whose settings say what is asked of each robot: add `- uses: diagnose`",
            )
        })?;
        let mut plan = plan.needed_for(at);
        let Some(stage) = plan.stages.last_mut() else {
            return Ok(plan);
        };
        let mut settings = stage.stage.settings();
        if !stage.files.is_empty() {
            settings["effects"] = stage
                .files
                .iter()
                .map(|file| file.path.to_string_lossy().into())
                .collect::<Vec<Value>>()
                .into();
        }
        let settings = json!({ "diagnose": settings, "given": self.given(robot) });
        let name = match stage.entry.name {
            Diagnose::NAME => CellEvidence::NAME,
            _ => TorqueEvidence::NAME,
        };
        let entry = STAGES.iter().find(|entry| entry.name == name);
        let (tree, _) = yaml::parse(&settings.to_string());
        let (Some(entry), Some(tree)) = (entry, tree) else {
            return Err(Error::Bug(format!("no stage {name}")));
        };
        let body = (entry.parse)(&tree).map_err(|troubles| {
            let faults = troubles.into_iter().map(|trouble| trouble.fault("given"));
            Error::Spec(faults.collect())
        })?;
        stage.entry = entry;
        stage.stage = body;
        stage.outputs = (entry.writes)();
        for file in &mut stage.files {
            file.place = format!("diagnose.{}", file.place);
        }
        Ok(plan)
    }
}
