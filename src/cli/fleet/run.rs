//! `calib fleet run` and `retry`.
//!
//! `calib fleet exec`: the one command that a cluster runs; idempotent, and silent about names.

use super::super::surroundings::surroundings;
use super::super::{emit, emit_json, warn};
use super::cluster::EngineArguments;
use super::{FleetLocation, records, verdict, workshop};
use crate::error::{Error, Result, counted, visible};
use crate::fleet::ledger::{Member, RunNote};
use crate::fleet::work::{self, FleetResults};
use crate::fleet::{Ending, Fleet, Ledger, RobotRecord, Workshop, tables};
use crate::progress::{FleetProgress, Verbosity};
use crate::store::Store;
use crate::table::{FleetRow, picked};
use clap::Args;
use serde_json::json;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Instant;

/// Run the pipeline for every robot that has no record yet; a robot with bad data is reported and the others finish.
///
/// The same command again goes on where it stood: what is recorded is never computed again. Tables of the whole fleet and a page
/// are made at the end. Exit codes: 0 all done, also where a robot is beyond the limits of its report; 10 some robots' data were rejected;
/// 75 some could not be computed now; 70 a bug.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct FleetRunArguments {
    #[command(flatten)]
    pub(super) place: FleetLocation,
    #[command(flatten)]
    pub(super) how: FleetRunOptions,
}

#[derive(Args)]
pub(super) struct FleetRunOptions {
    /// Only these robots, by name; may be given several times
    #[arg(long, value_name = "NAME")]
    robot: Vec<String>,
    #[command(flatten)]
    engine: EngineArguments,
    /// Stops at the first robot that is not done
    #[arg(long)]
    fail_fast: bool,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Prints no progress
    #[arg(long, short)]
    quiet: bool,
}

/// Compute robots again that were rejected or failed.
#[derive(Args)]
#[command(after_help = "Examples:
  calib fleet retry FLEET.yaml --failed
  calib fleet retry FLEET.yaml --failed --robot r7")]
pub(super) struct RetryArguments {
    #[command(flatten)]
    place: FleetLocation,
    /// Those that are not done; the only choice so far
    #[arg(long)]
    failed: bool,
    #[command(flatten)]
    how: FleetRunOptions,
}

const EXAMPLES: &str = "Examples:
  calib fleet run FLEET.yaml
  calib fleet run FLEET.yaml --robot 'cell 4' --robot r7 -j 1
  calib fleet run FLEET.yaml --engine slurm --partition main --robots-per-task 4 --store /shared/store";

impl FleetRunArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let store = self.place.store()?;
        let fleet = Fleet::load(&self.place.fleet, &store)?;
        run(&fleet, &store, &self.place, &self.how, command_line)
    }
}

pub(super) fn retry(arguments: &RetryArguments, command_line: &[OsString]) -> Result<()> {
    if !arguments.failed {
        return Err(Error::spec("retry", "say which: --failed"));
    }
    let store = arguments.place.store()?;
    let fleet = Fleet::load(&arguments.place.fleet, &store)?;
    let fresh = || surroundings(command_line);
    let workshop = workshop(&fleet, &store, &fresh);
    let (place, how) = (&arguments.place, &arguments.how);
    let bad = records(&workshop)?.into_iter().flatten();
    for record in bad.filter(|record| record.ending != Ending::Done) {
        if how.robot.is_empty() || how.robot.contains(&record.robot) {
            workshop.ledger.forget(&record.key)?;
        }
    }
    run(&fleet, &store, place, how, command_line)
}

fn run(
    fleet: &Fleet,
    store: &Store,
    place: &FleetLocation,
    how: &FleetRunOptions,
    command_line: &[OsString],
) -> Result<()> {
    let begun = Instant::now();
    let fresh = || surroundings(command_line);
    let workshop = workshop(fleet, store, &fresh);
    sound(&workshop)?;
    let chosen = chosen(fleet, &how.robot)?;
    let mut note = note(fleet, place, &fresh().run_id)?;
    let progress = how.engine.progress(how.quiet, chosen.len());
    let worked = how
        .engine
        .work(&workshop, &mut note, &chosen, how.fail_fast, &progress);
    progress.finish();
    let Some(FleetResults {
        records: all,
        computed,
    }) = worked?
    else {
        let jobs = note.jobs.join(", ");
        return emit(&format!("submitted: jobs {jobs} of run {}\n", note.run));
    };
    for (member, record) in note.robots.iter_mut().zip(&all) {
        member.key = record.as_ref().map(|record| record.key.clone());
    }
    workshop.ledger.close(&note)?;
    let shown = tables::publish(fleet, &workshop.ledger, &all)?;
    warn(&shown.untranslated);
    let seconds = begun.elapsed().as_secs_f64();
    if how.json {
        emit_json(&document(fleet, &note.run, &all, computed, seconds, &shown))?;
    } else {
        emit(&text(&all, computed, seconds, &shown))?;
    }
    let asked: Vec<Option<RobotRecord>> = chosen.iter().map(|index| all[*index].clone()).collect();
    verdict(fleet, &asked)
}

/// Fails with the pipeline's faults where not a single robot could be planned: then they are not the robots'.
pub(super) fn sound(workshop: &Workshop) -> Result<()> {
    let mut first = None;
    for robot in &workshop.fleet.roster.0 {
        match workshop.plan(robot) {
            Ok(_) => return Ok(()),
            Err(error) => drop(first.get_or_insert(error)),
        }
    }
    first.map_or(Ok(()), Err)
}

/// The positions of the robots that were asked for.
fn chosen(fleet: &Fleet, names: &[String]) -> Result<Vec<usize>> {
    if names.is_empty() {
        return Ok((0..fleet.roster.0.len()).collect());
    }
    let find = |name: &String| {
        let unknown = || {
            let known = fleet.roster.0.iter().map(|robot| robot.name.as_str());
            let hint = crate::error::nearest(name, known);
            let hint = hint.map_or_else(String::new, |near| format!("; did you mean {near:?}?"));
            Error::spec("--robot", format!("no robot {name:?} in the fleet{hint}"))
        };
        fleet.roster.position(name).ok_or_else(unknown)
    };
    names.iter().map(find).collect()
}

/// The run as engines and later campaigns find it.
pub(super) fn note(fleet: &Fleet, place: &FleetLocation, run: &str) -> Result<RunNote> {
    let file = std::path::absolute(&place.fleet);
    let file =
        file.map_err(|error| Error::store(place.fleet.display().to_string(), error.to_string()))?;
    if file.to_str().is_none() {
        let message = "its path is not UTF-8, so that no record can name it for other hosts: move or rename the file";
        return Err(Error::spec(file.display().to_string(), message));
    }
    let member = |robot: &crate::fleet::FleetRobot| Member {
        name: robot.name.clone(),
        groups: robot.groups.clone(),
        key: None,
    };
    Ok(RunNote {
        run: run.into(),
        fleet: fleet.name().into(),
        engine: "local".into(),
        file,
        robots: fleet.roster.0.iter().map(member).collect(),
        tasks: Vec::new(),
        jobs: Vec::new(),
        round: None,
    })
}

pub(super) fn count(records: &[Option<RobotRecord>], ending: Ending) -> usize {
    records
        .iter()
        .flatten()
        .filter(|record| record.ending == ending)
        .count()
}

fn text(
    records: &[Option<RobotRecord>],
    computed: usize,
    seconds: f64,
    shown: &tables::FleetSummary,
) -> String {
    let flagged = shown.fleet.0.iter().filter_map(|row| {
        let flags = row.flags.as_deref()?;
        Some(format!("{}: {}\n", visible(&row.robot), visible(flags)))
    });
    let tables = shown.tables.iter();
    let tables = tables.map(|path| format!("table: {}\n", path.display()));
    let page = format!("page: {}\n", shown.page.display());
    let rate = match computed {
        0 => String::new(),
        _ => format!(", {:.0} a minute", computed as f64 / seconds * 60.0),
    };
    let robots = counted(records.len(), "robot");
    let [done, rejected, failed] =
        [Ending::Done, Ending::Rejected, Ending::Failed].map(|ending| count(records, ending));
    let all = format!(
        "{done} of {robots} done, {rejected} rejected, {failed} failed; {computed} computed now ({seconds:.1} s{rate})\n"
    );
    let good = quality(&shown.fleet.0);
    flagged
        .chain(good)
        .chain(tables)
        .chain([page, all])
        .collect()
}

/// Robots that are named of those to visit first.
const VISITED: usize = 3;

/// How good the robots are, and which to visit first: those that changed, then those that are not done, then the least accurate.
fn quality(rows: &[FleetRow]) -> Vec<String> {
    let name = |row: &FleetRow| visible(&row.robot).to_string();
    let mut rated: Vec<(f64, &FleetRow)> = rows
        .iter()
        .filter_map(|row| Some((row.after_rms_mm?, row)))
        .collect();
    rated.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut lines = Vec::new();
    if let Some((worst, row)) = rated.first() {
        let median = rated[rated.len() / 2].0;
        let before = rows.iter().filter_map(|row| row.before_rms_mm);
        let before = before.fold(0.0, f64::max);
        lines.push(format!(
            "error: worst {worst:.3} mm rms ({}), median {median:.3} mm; worst before {before:.3} mm\n",
            name(row)
        ));
    }
    let changes = |row: &FleetRow| row.changes.unwrap_or(0);
    let mut changed: Vec<&FleetRow> = rows.iter().filter(|row| changes(row) > 0).collect();
    changed.sort_by_key(|row| -changes(row));
    if let Some(row) = changed.first() {
        let what = row.flags.as_deref().unwrap_or_default();
        lines.push(format!("worst change: {} ({})\n", name(row), visible(what)));
    }
    let mut visit: Vec<String> = Vec::new();
    let why = |row: &FleetRow| match (row.after_rms_mm, changes(row)) {
        (_, changes @ 1..) => format!("{}: {}", name(row), counted(changes as usize, "change")),
        (Some(mm), _) => format!("{}: {mm:.3} mm", name(row)),
        (None, _) => format!("{}: {}", name(row), row.status),
    };
    let open = rows.iter().filter(|row| row.after_rms_mm.is_none());
    let rated = rated.iter().map(|(_, row)| *row);
    for row in changed.into_iter().chain(open).chain(rated) {
        let line = why(row);
        if visit.len() < VISITED && !visit.contains(&line) {
            visit.push(line);
        }
    }
    if rows.len() > 1 && !visit.is_empty() {
        lines.push(format!("visit first: {}\n", visit.join(", ")));
    }
    lines
}

fn document(
    fleet: &Fleet,
    run: &str,
    records: &[Option<RobotRecord>],
    computed: usize,
    seconds: f64,
    shown: &tables::FleetSummary,
) -> serde_json::Value {
    let robots = fleet.roster.0.iter().zip(records).zip(&shown.fleet.0).map(|((robot, record), row)| {
        let columns = "status reason before_rms_mm after_rms_mm floor_mm noise_basis verdict causes flags";
        let mut shown = picked(row, columns);
        shown["robot"] = json!(robot.name);
        shown["exit_code"] = json!(record.as_ref().map(|record| record.exit_code));
        shown["run"] = json!(record.as_ref().and_then(|record| record.run.as_ref()));
        shown
    });
    let tables: Vec<_> = shown
        .tables
        .iter()
        .map(|path| path.to_string_lossy())
        .collect();
    json!({
        "fleet": fleet.name(), "run": run, "robots": robots.collect::<Vec<_>>(), "computed": computed, "wall_seconds": seconds,
        "done": count(records, Ending::Done), "rejected": count(records, Ending::Rejected), "failed": count(records, Ending::Failed),
        "missing": records.iter().filter(|record| record.is_none()).count(), "tables": tables, "page": shown.page.to_string_lossy(),
    })
}

/// The ledger of a fleet whose robots need not be known.
pub(super) fn ledger<'a>(store: &'a Store, name: &str) -> Ledger<'a> {
    Ledger::new(store, name)
}

/// Compute the robots of one task of a run.
#[derive(Args)]
pub(super) struct ExecArguments {
    #[arg(long, value_name = "DIR")]
    store: PathBuf,
    #[arg(long, value_name = "NAME")]
    fleet: String,
    #[arg(long, value_name = "ID")]
    run: String,
    #[arg(long, value_name = "N")]
    task: usize,
}

impl ExecArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let store = super::folder(&self.store)?;
        let ledger = ledger(&store, &self.fleet);
        let note = ledger.run(Some(&self.run))?;
        let note = note.ok_or_else(|| {
            Error::store(
                &self.run,
                "no such run in the store, or not yet visible here",
            )
        })?;
        let tasks = note.tasks.len();
        let robots = note.tasks.get(self.task).ok_or_else(|| {
            Error::spec("--task", format!("the run has {}", counted(tasks, "task")))
        })?;
        let fleet = Fleet::load(&note.file, &store)?;
        // By name: the roster may have grown since.
        let names = robots
            .iter()
            .filter_map(|index| note.robots.get(*index))
            .map(|member| member.name.as_str());
        let chosen: Vec<usize> = names
            .filter_map(|name| fleet.roster.position(name))
            .collect();
        let fresh = || surroundings(command_line);
        let mut workshop = workshop(&fleet, &store, &fresh);
        let variable = |name: &str| std::env::var(name).ok();
        workshop.name = variable("SLURMD_NODENAME").unwrap_or(workshop.name);
        let task = variable("SLURM_ARRAY_JOB_ID").zip(variable("SLURM_ARRAY_TASK_ID"));
        workshop.round.clone_from(&note.round);
        workshop.log = task.map(|(job, task)| format!("{job}_{task}.out"));
        let progress = FleetProgress::new(Verbosity::Normal, 1, chosen.len());
        let stop = || workshop.ledger.cancelled(&note.run);
        let worked = work::work(
            &workshop,
            &chosen,
            &work::WorkerOptions {
                workers: 1,
                fail_fast: false,
                stop: &stop,
            },
            &progress,
        )?;
        let recorded = worked.records.iter().flatten().count();
        emit(&format!(
            "{recorded} of {} recorded, {} computed here\n",
            counted(robots.len(), "robot"),
            worked.computed
        ))?;
        if recorded < robots.len() {
            return Err(Error::store(
                &self.run,
                "not all robots of this task are recorded",
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_says_how_good_its_robots_are_and_which_to_visit_first() {
        let row = |robot: &str, after_rms_mm: Option<f64>, changes: i64| FleetRow {
            robot: robot.into(),
            status: "rejected".into(),
            before_rms_mm: after_rms_mm.map(|mm| 10.0 * mm),
            after_rms_mm,
            changes: Some(changes),
            flags: (changes > 0).then(|| "zero of joint 2 moved".into()),
            ..FleetRow::default()
        };
        let rows = [
            row("a", Some(0.03), 0),
            row("b", Some(0.2), 0),
            row("c", Some(0.05), 2),
            row("d", None, 0),
        ];
        assert_eq!(
            quality(&rows),
            [
                "error: worst 0.200 mm rms (b), median 0.050 mm; worst before 2.000 mm\n",
                "worst change: c (zero of joint 2 moved)\n",
                "visit first: c: 2 changes, d: rejected, b: 0.200 mm\n",
            ]
        );
        assert!(quality(&[row("d", None, 0)]).is_empty());
    }
}
