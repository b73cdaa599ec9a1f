//! `calib serve-model`: JSON lines in, JSON lines out, for programs in other languages.

use super::model_arguments::ModelArguments;
use crate::api::Model;
use crate::compensate::{Circumstance, CommandTarget, Corrector, Stated, unstated_payload};
use crate::error::{Error, Fault, Result, counted};
use crate::pipeline::Purpose;
use crate::raw;
use clap::Args;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

/// Answer joints with corrected joints, or points: JSON lines on stdin and stdout, for programs in other languages.
///
/// A line is a list of joints, rad (mm of a joint that slides), as the controller counts them, or an object: joints_rad, and where known
/// payload_kg, temp_c, dir (+1: the joint comes from below) and id, which the answer repeats. Every line gets one line, in order: joints_rad,
/// with which the real arm comes to where the nominal robot would be, uncorrected_mm, how far it would be off without, u95_mm, the 95 %
/// uncertainty of the point, and remark where something is wrong; a command that is not reached or refused gets null for its joints. With
/// --predict the answer is point_mm, where the model puts the tool in the frame of the instrument. A line that cannot be used is answered with
/// error. Answers are written as soon as no further line waits.
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    joints_rad: Vec<f64>,
    payload_kg: Option<f64>,
    temp_c: Option<f64>,
    dir: Option<Vec<f64>>,
    id: Option<serde_json::Value>,
}

#[derive(Default, Serialize)]
struct Answer {
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<serde_json::Value>,
    #[serde(skip_serializing_if = "Option::is_none")]
    joints_rad: Option<Option<Vec<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    point_mm: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    uncorrected_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    u95_mm: Option<f64>,
    #[serde(skip_serializing_if = "String::is_empty")]
    remark: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

pub(super) fn main(arguments: &ServeModelArguments, command_line: &[OsString]) -> Result<()> {
    let stated = arguments
        .payload
        .and_then(|payload| Stated::Payload.fault(payload));
    if let Some(message) = stated {
        return Err(Error::Spec(vec![Fault::new("--payload", message)]));
    }
    let force = arguments.model.force;
    let identified = arguments.model.load(Purpose::Compensate, command_line)?;
    let model = Model::new(identified);
    let server = Server {
        // Without a load that matters none has to be stated.
        needed: model.needed_load().filter(|_| arguments.payload.is_none()),
        payload: arguments.payload,
        predict: arguments.predict,
        model: &model,
    };
    let threads = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.model.jobs())
        .build()
        .map_err(|error| Error::store("--jobs", error.to_string()))?;
    threads.install(|| server.answer(force, &arguments.lines))
}

struct Server<'a> {
    model: &'a Model,
    predict: bool,
    payload: Option<f64>,
    /// The largest load that was measured, kg, where lines must state theirs.
    needed: Option<f64>,
}

impl Server<'_> {
    fn answer(&self, insisted: bool, lines: &Path) -> Result<()> {
        let mut corrector = match self.predict {
            true => None,
            false => Some(self.model.corrector(insisted, "--force")?),
        };
        let source: Box<dyn Read> = match lines.as_os_str() == "-" {
            true => Box::new(std::io::stdin()),
            false => Box::new(raw::open(lines).map_err(|error| {
                let place = lines.display().to_string();
                Error::spec(place, format!("cannot be read: {error}"))
            })?),
        };
        let mut lines = BufReader::with_capacity(AHEAD, source);
        let mut number = 0;
        loop {
            let batch = waiting(&mut lines)?;
            if batch.is_empty() {
                return Ok(());
            }
            let asked: Vec<Result<Asked, String>> = batch
                .par_iter()
                .enumerate()
                .map(|(k, line)| {
                    self.read(line)
                        .map_err(|message| format!("line {}: {message}", number + k + 1))
                })
                .collect();
            number += batch.len();
            let answers = match &mut corrector {
                Some(corrector) => self.corrected(asked, corrector),
                None => self.predicted(asked),
            };
            let texts: Vec<Vec<u8>> = answers
                .par_iter()
                .map(|answer| {
                    let mut text = serde_json::to_vec(answer).unwrap_or_default();
                    text.push(b'\n');
                    text
                })
                .collect();
            let mut out = std::io::stdout().lock();
            match out.write_all(&texts.concat()).and_then(|()| out.flush()) {
                Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return Ok(()),
                Err(error) => return Err(Error::store("stdout", error.to_string())),
                Ok(()) => (),
            }
        }
    }

    fn read(&self, line: &[u8]) -> Result<Asked, String> {
        let wrong = |error: serde_json::Error| error.to_string();
        let list = line.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'[');
        let mut asked = match list {
            true => Asked {
                joints_rad: serde_json::from_slice(line).map_err(wrong)?,
                payload_kg: None,
                temp_c: None,
                dir: None,
                id: None,
            },
            false => serde_json::from_slice::<Asked>(line).map_err(wrong)?,
        };
        let joints = self.model.identified.model.robot.joints();
        for (name, values) in [
            ("joints_rad", Some(&asked.joints_rad)),
            ("dir", asked.dir.as_ref()),
        ] {
            if let Some(values) = values.filter(|values| values.len() != joints) {
                let found = counted(values.len(), "number");
                return Err(format!("{name}: {found}; the robot has {joints} joints"));
            }
        }
        asked.payload_kg = asked.payload_kg.or(self.payload);
        let directions = asked.dir.iter().flatten().copied();
        let stated = [
            (Stated::Payload, asked.payload_kg),
            (Stated::Temperature, asked.temp_c),
        ];
        let stated = stated
            .into_iter()
            .chain(directions.map(|side| (Stated::Direction, Some(side))));
        let mut faults = stated.filter_map(|(what, value)| what.fault(value?));
        match (faults.next(), self.needed) {
            (Some(fault), _) => Err(fault),
            (None, Some(load)) if asked.payload_kg.is_none() => Err(unstated_payload(load)),
            _ => Ok(asked),
        }
    }

    fn corrected(
        &self,
        asked: Vec<Result<Asked, String>>,
        corrector: &mut Corrector,
    ) -> Vec<Answer> {
        let robot = self.model.robot();
        let target = |asked: &Asked| CommandTarget {
            q: Some(robot.to_si(&asked.joints_rad)),
            payload: asked.payload_kg,
            temperature: asked.temp_c,
            direction: asked.dir.clone(),
            ..CommandTarget::default()
        };
        let targets = asked.iter().flatten().map(target).collect();
        let mut commands = corrector.batch(targets).into_iter();
        let answer = |asked: Result<Asked, String>| {
            let asked = match asked {
                Ok(asked) => asked,
                Err(error) => return faulty(error),
            };
            let Some(command) = commands.next() else {
                return Answer::default();
            };
            Answer {
                id: asked.id,
                remark: command.remark(),
                uncorrected_mm: Some(command.uncorrected * 1e3),
                u95_mm: command.uncertainty.map(|known| known.u95 * 1e3),
                joints_rad: Some(command.q.map(|q| robot.from_si(&q))),
                ..Answer::default()
            }
        };
        asked.into_iter().map(answer).collect()
    }

    fn predicted(&self, asked: Vec<Result<Asked, String>>) -> Vec<Answer> {
        let joints = self.model.identified.model.robot.joints();
        let robot = self.model.robot();
        let answer = |place: &mut dyn FnMut(&Circumstance, Vec<f64>) -> [f64; 3],
                      asked: Result<Asked, String>| {
            let asked = match asked {
                Ok(asked) => asked,
                Err(error) => return faulty(error),
            };
            let circumstance = Circumstance {
                payload: asked.payload_kg.unwrap_or(0.0),
                temperature: asked.temp_c,
                direction: asked.dir.unwrap_or_else(|| vec![0.0; joints]),
                ..Circumstance::unknown(joints)
            };
            Answer {
                id: asked.id,
                point_mm: Some(place(&circumstance, robot.to_si(&asked.joints_rad))),
                ..Answer::default()
            }
        };
        asked
            .into_par_iter()
            .map_init(|| self.model.placing(), |place, asked| answer(place, asked))
            .collect()
    }
}

fn faulty(error: String) -> Answer {
    Answer {
        error: Some(error),
        ..Answer::default()
    }
}

/// Lines that are there: at least one, unless there are no more, and all others that wait. Blank lines are none.
fn waiting(lines: &mut BufReader<impl Read>) -> Result<Vec<Vec<u8>>> {
    let mut batch = Vec::new();
    while batch.is_empty() || (batch.len() < BATCH && lines.buffer().contains(&b'\n')) {
        let mut line = Vec::new();
        let read = lines
            .read_until(b'\n', &mut line)
            .map_err(|error| Error::store("stdin", error.to_string()))?;
        if read == 0 {
            break;
        }
        if !line.trim_ascii().is_empty() {
            batch.push(line);
        }
    }
    Ok(batch)
}
