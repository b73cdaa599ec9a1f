//! `compare`: what changed on the robot since an earlier recording of it; the earlier model is the prior and the comparison.

use crate::effect::{Load, names};
use crate::error::{Place, Result};
use crate::estimate::{Prior, align, changes};
use crate::robot::{Measurements, NoiseBasis, RobotModel};
use crate::stage::doubtful::{FittedRows, fit_rows};
use crate::stage::settings::Repeatability;
use crate::stage::{Context, RawFile, Stage};
use crate::table::{ChangeRow, Changes, Parameters, Recording, Robot, Split, Table, from_parquet};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io::Read;

/// Settings of `compare`. A fleet file with `previous` fills the files in; without them the table is empty.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Compare {
    /// Table `parameters` of the earlier model, Parquet.
    pub(crate) previous_parameters: Option<RawFile>,
    /// Table `recording` that it was fitted to, Parquet.
    pub(crate) previous_recording: Option<RawFile>,
    /// How well joints come back to a pose, as in `identify`.
    pub(crate) repeatability: Repeatability,
}

crate::stage::stage! {
    Compare, "compare", 5, "tests which parameters changed since an earlier recording of the same robot",
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
        at.at("previous_recording").must(
            both,
            "`previous_parameters` and `previous_recording` go together",
        );
        self.repeatability.faults(at);
    }

    fn files(&self) -> Vec<(String, RawFile)> {
        let files = [
            ("previous_parameters", &self.previous_parameters),
            ("previous_recording", &self.previous_recording),
        ];
        files
            .into_iter()
            .filter_map(|(place, file)| Some((place.to_string(), file.clone()?)))
            .collect()
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
        let first = self.session(&robot, &earlier, &recording, None, context)?;
        let second = self.session(
            &robot,
            &earlier,
            &reads.recording,
            Some(&reads.split),
            context,
        )?;
        let (first, second) = (
            first.fit.session(&first.data),
            second.fit.session(&second.data),
        );
        let (stack, specs) = (&first.model.stack, first.model.stack.specs());
        let first_causes: Vec<Vec<usize>> = ORDER
            .iter()
            .map(|name| stack.parameters_of(name).collect())
            .collect();
        let precedence = |k: usize| {
            first_causes
                .iter()
                .position(|parameters| parameters.contains(&k))
                .unwrap_or(ORDER.len())
        };
        let found = changes(&first, &second, precedence);
        let mut rows = Vec::new();
        for change in found {
            let spec = &specs[change.parameter];
            let Some(before) = earlier.0.iter().find(|row| row.name == spec.name) else {
                continue;
            };
            let show = |value: f64| spec.unit.from_si(value);
            if let Some(rank) = change.rank {
                context.note(format!(
                    "{rank}. {} {}: {} by {:.4e} +- {:.1e} {}",
                    effect(&before.effect),
                    spec.place,
                    spec.name,
                    show(change.step),
                    show(change.sigma),
                    spec.unit.symbol()
                ));
            }
            rows.push(ChangeRow {
                name: spec.name.clone(),
                effect: effect(&before.effect).into(),
                place: spec.place.to_string(),
                unit: spec.unit.symbol().into(),
                previous: before.value,
                change: show(change.step),
                sigma: show(change.sigma),
                p_value: change.p_value,
                rank: change.rank.map(|rank| rank as i64),
            });
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
    let mut source = context.services.open(file)?;
    let mut bytes = Vec::new();
    source
        .reader
        .read_to_end(&mut bytes)
        .map_err(|error| crate::error::Error::data(&source.label, error.to_string()))?;
    let loose = from_parquet(&source.label, bytes)?;
    if !loose.vouched {
        let label = &source.label;
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
            let which = if split.is_some() {
                "this"
            } else {
                "the earlier"
            };
            context.note(format!(
                "{which} recording states no noise: rows are weighted by an assumed one"
            ));
        }
        let placed = earlier.clone().standing_at(&align(robot, &data, &rows));
        let mut model = placed.model(robot.clone(), &[names::BASE_FRAME], Load::GravityTorque)?;
        let base: Vec<usize> = model.stack.parameters_of(names::BASE_FRAME).collect();
        for (k, spec) in model
            .stack
            .specs()
            .iter()
            .enumerate()
            .filter(|(k, _)| !base.contains(k))
        {
            let prior = Prior {
                mean: model.x[k],
                sigma: spec.prior_sigma,
            };
            model.known.entry(k).or_default().prior = Some(prior);
        }
        let candidates: Vec<usize> = (0..model.x.len()).collect();
        self.repeatability.apply(&model, &mut data, &rows, context);
        let fit = fit_rows(&model, &data, &rows, &candidates, split);
        Ok(FittedRecording { data, fit })
    }
}
