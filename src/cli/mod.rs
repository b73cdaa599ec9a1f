//! The command line: one file per verb. Results go to stdout, progress and messages to stderr; nothing below here prints.

mod companions;
mod compensate;
mod diagnose;
mod diff;
mod excite;
mod export;
mod feed_forward;
mod fleet;
mod help;
mod init;
mod interrupted;
mod log;
mod pipeline_arguments;
mod poses;
mod query;
mod run;
mod serve_model;
mod simulate;
mod surroundings;
mod verify_robot;

pub use surroundings::{cores, open_store, surroundings};

use crate::error::{Error, Result, counted, nearest};
use crate::targets::{unwritten, whole};
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;

/// Makes industrial robots accurate, and says why they were not: from laser-tracker recordings through pipelines of stages
/// to an identified model and a report.
#[derive(Parser)]
#[command(name = "calib", version, max_term_width = 110, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    Init(init::InitArguments),
    Check(run::CheckArguments),
    Run(run::RunArguments),
    Diagnose(diagnose::DiagnoseArguments),
    Compensate(Box<compensate::CompensateArguments>),
    ServeModel(Box<serve_model::ServeModelArguments>),
    VerifyRobot(verify_robot::VerifyRobotArguments),
    Export(export::ExportArguments),
    CheckExport(Box<export::CheckExportArguments>),
    Show(log::ShowArguments),
    Log(log::LogArguments),
    Diff(diff::DiffArguments),
    Explain(log::ExplainArguments),
    Query(query::QueryArguments),
    Lineage(log::LineageArguments),
    Schema(query::SchemaArguments),
    Poses(poses::PosesArguments),
    Excite(excite::ExciteArguments),
    Fleet(fleet::FleetArguments),
    Tag(log::TagArguments),
    Verify(log::VerifyArguments),
    Gc(log::GcArguments),
    Simulate(simulate::SimulateArguments),
    Effects(query::EffectsArguments),
    Robots(query::RobotsArguments),
    Completions(help::CompletionsArguments),
    Man(help::ManArguments),
}

const EXIT_CODES: &str = "Exit codes: 0 done; 1 diff or verify found a difference, init understood nothing of the recordings, or a run is beyond its report's limits; 2 wrong usage or a faulty YAML; 10 the data were rejected, or the set-up is wrong (do not retry); \
70 a bug in calib; 75 try again later (disk, permissions).";

/// The command line as a description: every verb with its options, for pages, completions and checks of typed lines.
pub fn command() -> clap::Command {
    // What other verbs work with is there what a file is held against.
    let against = |verb: clap::Command| verb.mut_arg("model", |model| model.long("against"));
    help::grouped(Arguments::command().mut_subcommand("check-export", against))
}

/// Runs a command line, prints what comes of it and gives the exit code.
pub fn main(arguments: Vec<OsString>) -> u8 {
    let found = command()
        .try_get_matches_from(&arguments)
        .and_then(|found| Arguments::from_arg_matches(&found));
    let parsed = match found {
        Ok(parsed) => parsed,
        Err(error) => {
            let error = with_nearest_verb(error);
            // Help and version come this way too, with code 0 and on stdout.
            let code = u8::try_from(error.exit_code()).unwrap_or(2);
            let _ = error.print();
            return code;
        }
    };
    surroundings::guarded(|| done(parsed.verb, &arguments))
}

/// Names the verb that a misspelt one is nearest to, also where letters changed places (`rnu`), which clap's own measure does not see.
fn with_nearest_verb(mut error: clap::Error) -> clap::Error {
    let given = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(given))
            if error.get(ContextKind::SuggestedSubcommand).is_none() =>
        {
            given.clone()
        }
        _ => return error,
    };
    let command = Arguments::command();
    if let Some(near) = nearest(
        &given,
        command.get_subcommands().map(clap::Command::get_name),
    ) {
        error.insert(
            ContextKind::SuggestedSubcommand,
            ContextValue::Strings(vec![near.into()]),
        );
    }
    error
}

fn done(verb: Verb, arguments: &[OsString]) -> u8 {
    let result = match verb {
        Verb::Run(verb) => return coded(verb.run(arguments)),
        Verb::CheckExport(verb) => return coded(verb.run(arguments)),
        Verb::Check(verb) => verb.run(arguments),
        Verb::Compensate(verb) => verb.run(arguments),
        Verb::Effects(verb) => verb.run(),
        Verb::Diagnose(verb) => return coded(verb.run(arguments)),
        Verb::Diff(verb) => return coded(verb.run()),
        Verb::Fleet(verb) => verb.run(arguments),
        Verb::Export(verb) => verb.run(arguments),
        Verb::Init(verb) => return coded(verb.run()),
        Verb::Excite(verb) => verb.run(),
        Verb::Explain(verb) => verb.run(),
        Verb::Gc(verb) => verb.run(),
        Verb::Lineage(verb) => verb.run(),
        Verb::Log(verb) => verb.run(),
        Verb::Poses(verb) => verb.run(),
        Verb::Query(verb) => verb.run(),
        Verb::Robots(verb) => verb.run(),
        Verb::Completions(verb) => verb.run(),
        Verb::Man(verb) => verb.run(),
        Verb::Schema(verb) => verb.run(),
        Verb::ServeModel(verb) => verb.run(arguments),
        Verb::Show(verb) => verb.run(),
        Verb::Simulate(verb) => verb.run(arguments),
        Verb::Tag(verb) => verb.run(),
        Verb::Verify(verb) => return coded(verb.run()),
        Verb::VerifyRobot(verb) => verb.run(arguments),
    };
    coded(result.map(|()| 0))
}

/// The exit code of what a verb did.
fn coded(result: Result<u8>) -> u8 {
    result.unwrap_or_else(|error| complain(&error))
}

/// Says what went wrong, and with which exit code.
fn complain(error: &Error) -> u8 {
    note(message(error) + "\n");
    error.exit_code()
}

/// One fault a line, and how many there are where there are several.
fn message(error: &Error) -> String {
    match error {
        Error::Spec(faults) | Error::Data(faults) if faults.len() > 1 => {
            format!("{error}\nerror: {}", counted(faults.len(), "fault"))
        }
        _ => format!("error: {error}"),
    }
}

/// Prints a result on stdout; a reader that has gone away is no fault.
fn emit(text: &str) -> Result<()> {
    emit_bytes(text.as_bytes())
}

fn emit_bytes(bytes: &[u8]) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::store("stdout", error.to_string()))
        }
        _ => Ok(()),
    }
}

/// Warnings on stderr, a line each.
fn warn<T: std::fmt::Display>(lines: impl IntoIterator<Item = T>) {
    note(
        lines
            .into_iter()
            .map(|line| format!("warning: {line}\n"))
            .collect::<String>(),
    );
}

/// Lines on stderr.
fn note(text: impl AsRef<[u8]>) {
    let _ = std::io::stderr().write_all(text.as_ref());
}

/// A result where the command line says, whole, else on stdout.
fn put(out: Option<&Path>, result: impl AsRef<[u8]>) -> Result<()> {
    let Some(out) = out else {
        return emit_bytes(result.as_ref());
    };
    whole(out, |mut file| {
        let written = file.write_all(result.as_ref());
        written.map_err(|error| unwritten(out, &error))
    })
}

/// What a file holds, or what it is when it cannot be read.
fn readable<T>(path: &Path, read: std::io::Result<T>) -> Result<T> {
    let fault = |error| {
        Error::spec(
            path.display().to_string(),
            format!("cannot be read: {error}"),
        )
    };
    read.map_err(fault)
}

/// Writes a page where the command line names it.
fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text)
        .map_err(|error| Error::spec(path.display().to_string(), format!("cannot write: {error}")))
}

/// Lines of a result, folded and in colour where stdout is a terminal.
fn emit_lines(text: &str) -> Result<()> {
    let Some(columns) = surroundings::columns() else {
        return emit(text);
    };
    let text = crate::summary::folded(text, columns);
    match surroundings::colours() {
        true => emit(&surroundings::painted(&text)),
        false => emit(&text),
    }
}

/// Prints one JSON document, keys in their order.
fn emit_json(result: &impl serde::Serialize) -> Result<()> {
    let value = serde_json::to_value(result).map_err(|error| Error::Bug(error.to_string()))?;
    emit(&format!("{value:#}\n"))
}
