//! `compare`: what changed on the robot since an earlier recording of it; the earlier model is the prior and the comparison.

use crate::doubtful::{FittedRows, fit_rows};
use crate::effect::{Load, names};
use crate::error::{Error, Place, Result};
use crate::estimate::{Prior, align, changes};
use crate::settings::Repeatability;
use crate::table::{ChangeRow, Changes, Parameters, Recording, Robot, Split, Table, from_parquet};
use crate::{Context, OpenedInput, RawFile, Stage};
use calib_numerics::robot::{Measurements, NoiseBasis, RobotModel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io::Read;

/// Settings of `compare`. A fleet file with `previous` fills the files in; without them the table is empty.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Compare {
    /// Table `parameters` of the earlier model, Parquet.
    pub previous_parameters: Option<RawFile>,
    /// Table `recording` that it was fitted to, Parquet.
    pub previous_recording: Option<RawFile>,
    /// How well joints come back to a pose, as in `identify`.
    pub repeatability: Repeatability,
}

crate::stage! {
    Compare, "compare", 6, "tests which parameters changed since an earlier recording of the same robot",
        CompareReads {
            robot: Robot,
            recording: Recording,
            split: Split,
        } -> CompareWrites {
            changes: Changes,
        }
}

impl Stage for Compare {
    fn faults(&self, at: &mut Place) {
        let both = self.previous_parameters.is_some() == self.previous_recording.is_some();
        let message = "`previous_parameters` and `previous_recording` go together";
        at.at("previous_recording").must(both, message);
        self.repeatability.faults(at);
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        let parameters = ("previous_parameters", &self.previous_parameters);
        let files = [parameters, ("previous_recording", &self.previous_recording)];
        let given = |(place, file): (&str, &Option<RawFile>)| Some((place.into(), file.clone()?));
        files.into_iter().filter_map(given).collect()
    }

    fn run(&self, reads: CompareReads, context: &Context) -> Result<CompareWrites> {
        let (Some(parameters), Some(recording)) =
            (&self.previous_parameters, &self.previous_recording)
        else {
            context.note("no earlier model to compare with");
            return Ok(CompareWrites {
                changes: Changes::default(),
            });
        };
        let earlier: Parameters = table(context, parameters)?;
        let recording: Recording = table(context, recording)?;
        let robot = RobotModel::new(reads.robot.to_description()?);
        let split = Some(&reads.split);
        let first = self.session(&robot, &earlier, &recording, None, context)?;
        let second = self.session(&robot, &earlier, &reads.recording, split, context)?;
        let [first, second] = [&first, &second].map(|one| one.fit.session(&one.data));
        let (stack, specs) = (&first.model.stack, first.model.stack.specs());
        let precedence = |k: usize| {
            let mut causes = ORDER.iter();
            let cause = causes.position(|name| stack.parameters_of(name).any(|other| other == k));
            cause.unwrap_or(ORDER.len())
        };
        let found = changes(&first, &second, precedence);
        let mut rows = Vec::new();
        for change in found {
            let spec = &specs[change.parameter];
            let Some(before) = earlier.0.iter().find(|row| row.name == spec.name) else {
                continue;
            };
            let row = ChangeRow {
                name: spec.name.clone(),
                effect: effect(&before.effect).into(),
                place: spec.place.to_string(),
                unit: spec.unit.symbol().into(),
                previous: before.value,
                change: spec.unit.from_si(change.step),
                sigma: spec.unit.from_si(change.sigma),
                p_value: change.p_value,
                rank: change.rank.map(|rank| rank as i64),
            };
            if let Some(rank) = row.rank {
                context.note(format!(
                    "{rank}. {} {}: {} by {:.4e} +- {:.1e} {}",
                    row.effect, row.place, row.name, row.change, row.sigma, row.unit
                ));
            }
            rows.push(row);
        }
        Ok(CompareWrites {
            changes: Changes(rows),
        })
    }
}

/// What changes by itself on a robot, the commonest first: a zero after a collision, a tool, wear of a drive.
const ORDER: [&str; 4] = [
    "joint_offset",
    "tool_offset",
    "joint_compliance",
    "link_geometry",
];

/// The effect that a change of a parameter is.
fn effect(name: &str) -> &str {
    match name {
        "joint_offset" => "zero_shift",
        "tool_offset" => "tool_shift",
        other => other,
    }
}

fn table<T: Table>(context: &Context, file: &RawFile) -> Result<T> {
    let OpenedInput {
        label, mut reader, ..
    } = context.services.open(file)?;
    let mut bytes = Vec::new();
    let read = reader.read_to_end(&mut bytes);
    read.map_err(|error| Error::data(&label, error.to_string()))?;
    let loose = from_parquet(&label, bytes)?;
    if !loose.vouched {
        context.warn(format!(
            "{label} carries no content hash: its content cannot be verified"
        ));
    }
    Ok(loose.table)
}

/// A recording with its fit.
struct FittedRecording {
    data: Measurements,
    fit: FittedRows,
}

impl Compare {
    /// The earlier model fitted anew to a recording, from its values and held near them.
    fn session(
        &self,
        robot: &RobotModel,
        earlier: &Parameters,
        recording: &Recording,
        split: Option<&Split>,
        context: &Context,
    ) -> Result<FittedRecording> {
        let mut data = recording.measurements();
        let rows: Vec<usize> = (0..data.rows()).collect();
        if data.noise_basis == NoiseBasis::Inferred {
            let which = split.map_or("the earlier", |_| "this");
            context.note(format!(
                "{which} recording states no noise: rows are weighted by an assumed one"
            ));
        }
        let placed = earlier.clone().standing_at(&align(robot, &data, &rows));
        let mut model = placed.model(robot.clone(), &[names::BASE_FRAME], Load::GravityTorque)?;
        let base: Vec<usize> = model.stack.parameters_of(names::BASE_FRAME).collect();
        let specs = model.stack.specs().iter().enumerate();
        for (k, spec) in specs.filter(|(k, _)| !base.contains(k)) {
            let prior = Prior {
                mean: model.x[k],
                sigma: spec.tolerance,
            };
            model.known.entry(k).or_default().prior = Some(prior);
        }
        let candidates: Vec<usize> = (0..model.x.len()).collect();
        self.repeatability.apply(&model, &mut data, &rows, context);
        let fit = fit_rows(&model, &data, &rows, &candidates, split);
        Ok(FittedRecording { data, fit })
    }
}
