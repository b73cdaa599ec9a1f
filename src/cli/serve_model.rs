//! `calib serve-model`: JSON lines in, JSON lines out, for programs in other languages.

use super::pipeline_arguments::ModelArguments;
use super::{emit, readable};
use crate::api::{Model, Robot};
use crate::compensate::{Circumstance, CommandTarget, Corrector, Stated, unstated_payload};
use crate::error::{Error, Result, counted};
use crate::pipeline::Purpose;
use crate::raw;
use clap::Args;
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Answer joints with corrected joints, or points: JSON lines on stdin and stdout, for programs in other languages.
///
/// A line is a list of joints, rad (mm of a joint that slides), as the controller counts them, or an object: joints_rad, and where known
/// payload_kg, temp_c and id, which the answer repeats. Every line gets one line, in order: joints_rad, with which the real arm comes to where
/// the nominal robot would be (null where that is not reached or refused), uncorrected_mm, how far it would be off without, u95_mm, the 95 %
/// uncertainty of the point, and remark, what is wrong. With --predict the answer is point_mm, where the model puts the tool in the frame of
/// the instrument, with a remark where nothing was measured. A line that cannot be used is answered with error. Answers are written as soon as no further line waits.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct ServeModelArguments {
    #[command(flatten)]
    model: ModelArguments,
    /// Lines as a file; `-` or nothing: stdin
    #[arg(value_name = "LINES", default_value = "-")]
    lines: PathBuf,
    /// Answers with the point that the model predicts instead of corrected joints
    #[arg(long)]
    predict: bool,
    /// Payload of lines that do not say, kg; needed where the model depends on load and was measured under one (0: none is carried)
    #[arg(long, value_name = "KG")]
    payload: Option<f64>,
}

const EXAMPLES: &str = "Examples:
  calib serve-model HEAD
  calib serve-model pipeline.yaml joints.jsonl --quiet > corrected.jsonl
  calib serve-model HEAD --predict --payload 12";

/// Lines that are answered together at most.
const BATCH: usize = 8192;

/// Bytes that are read ahead: that many lines, about.
const AHEAD: usize = 1 << 20;

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    joints_rad: Vec<f64>,
    payload_kg: Option<f64>,
    temp_c: Option<f64>,
    id: Option<Value>,
}

impl ServeModelArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let payload = self.payload;
        if let Some(message) = payload.and_then(|payload| Stated::Payload.fault(payload)) {
            return Err(Error::spec("--payload", message));
        }
        let model = Model::new(self.model.load(Purpose::Compensate, command_line)?);
        let reader = LineReader {
            robot: model.robot(),
            needed: model.needed_load().filter(|_| payload.is_none()),
            payload,
        };
        let mut lines = BufReader::with_capacity(AHEAD, opened(&self.lines)?);
        let mut corrector = match self.predict {
            true => None,
            false => Some(model.corrector(self.model.force, "--force")?),
        };
        let threads = self.model.threads()?;
        let mut number = 0;
        loop {
            let batch = waiting(&mut lines)?;
            if batch.is_empty() {
                return Ok(());
            }
            let text: String = threads.install(|| {
                let asked = batch.par_iter().enumerate().map(|(k, line)| {
                    let place = |message| format!("line {}: {message}", number + k + 1);
                    reader.read(line).map_err(place)
                });
                let asked: Vec<Result<Asked, String>> = asked.collect();
                let answers = match &mut corrector {
                    Some(corrector) => corrected(&reader.robot, &asked, corrector),
                    None => predicted(&reader.robot, &asked, &model),
                };
                let lines = answers.into_par_iter().zip(asked);
                let lines = lines.map(|(mut answer, asked)| {
                    if let Some(id) = asked.ok().and_then(|asked| asked.id) {
                        answer["id"] = id;
                    }
                    format!("{answer}\n")
                });
                lines.collect()
            });
            number += batch.len();
            emit(&text)?;
        }
    }
}

fn opened(lines: &Path) -> Result<Box<dyn Read>> {
    if lines.as_os_str() == "-" {
        return Ok(Box::new(std::io::stdin()));
    }
    Ok(Box::new(readable(lines, raw::open(lines))?))
}

/// Lines that are there: at least one, unless there are no more, and all others that wait. Blank lines are none.
fn waiting(lines: &mut BufReader<impl Read>) -> Result<Vec<Vec<u8>>> {
    let mut batch = Vec::new();
    while batch.is_empty() || (batch.len() < BATCH && lines.buffer().contains(&b'\n')) {
        let mut line = Vec::new();
        let read = lines.read_until(b'\n', &mut line);
        if read.map_err(|error| Error::store("stdin", error.to_string()))? == 0 {
            break;
        }
        if !line.trim_ascii().is_empty() {
            batch.push(line);
        }
    }
    Ok(batch)
}

struct LineReader {
    robot: Robot,
    payload: Option<f64>,
    /// The largest load that was measured, kg, where lines must state theirs.
    needed: Option<f64>,
}

impl LineReader {
    fn read(&self, line: &[u8]) -> Result<Asked, String> {
        let asked = match line.trim_ascii_start().first() {
            Some(b'[') => serde_json::from_slice(line).map(|joints_rad| Asked {
                joints_rad,
                ..Asked::default()
            }),
            _ => serde_json::from_slice(line),
        };
        let mut asked: Asked = asked.map_err(|error| error.to_string())?;
        let joints = self.robot.joints();
        if asked.joints_rad.len() != joints {
            let found = counted(asked.joints_rad.len(), "number");
            return Err(format!(
                "joints_rad: {found}; the robot has {joints} joints"
            ));
        }
        asked.joints_rad = self.robot.to_si(&asked.joints_rad);
        asked.payload_kg = asked.payload_kg.or(self.payload);
        let stated = [
            (Stated::Payload, asked.payload_kg),
            (Stated::Temperature, asked.temp_c),
        ];
        let mut faults = stated
            .into_iter()
            .filter_map(|(what, value)| what.fault(value?));
        match (faults.next(), self.needed) {
            (Some(fault), _) => Err(fault),
            (None, Some(load)) if asked.payload_kg.is_none() => Err(unstated_payload(load)),
            _ => Ok(asked),
        }
    }
}

fn corrected(
    robot: &Robot,
    asked: &[Result<Asked, String>],
    corrector: &mut Corrector,
) -> Vec<Value> {
    let target = |asked: &Asked| CommandTarget {
        q: Some(asked.joints_rad.clone()),
        payload: asked.payload_kg,
        temperature: asked.temp_c,
        ..CommandTarget::default()
    };
    let commands = corrector.batch(asked.iter().flatten().map(target).collect());
    let mut answers = commands.into_iter().map(|command| {
        let mut answer = json!({
            "joints_rad": command.q.as_ref().map(|q| robot.from_si(q)),
            "uncorrected_mm": command.uncorrected * 1e3,
        });
        if let Some(known) = &command.uncertainty {
            answer["u95_mm"] = json!(known.u95 * 1e3);
        }
        if !command.remarks.is_empty() {
            answer["remark"] = json!(command.remark());
        }
        answer
    });
    let of_line = |asked: &Result<Asked, String>| match asked {
        Ok(_) => answers.next().unwrap_or_default(),
        Err(error) => json!({ "error": error }),
    };
    asked.iter().map(of_line).collect()
}

fn predicted(robot: &Robot, asked: &[Result<Asked, String>], model: &Model) -> Vec<Value> {
    let coverage = model.identified.coverage();
    let placed = asked.par_iter().map_init(
        || model.placing(),
        |place, asked| match asked {
            Ok(asked) => {
                let circumstance = Circumstance {
                    payload: asked.payload_kg.unwrap_or(0.0),
                    temperature: asked.temp_c,
                    ..Circumstance::unknown(robot.joints())
                };
                let mut q = asked.joints_rad.clone();
                let mut answer = json!({ "point_mm": place(&circumstance, &mut q) });
                let beyond = coverage
                    .iter()
                    .flat_map(|all| all.beyond(&q, circumstance.payload, circumstance.temperature));
                let remarks: Vec<String> = beyond.map(|beyond| beyond.to_string()).collect();
                if !remarks.is_empty() {
                    answer["remark"] = json!(remarks.join("; "));
                }
                answer
            }
            Err(error) => json!({ "error": error }),
        },
    );
    placed.collect()
}
