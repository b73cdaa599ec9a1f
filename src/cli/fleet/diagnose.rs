//! `calib fleet diagnose`: causes that the robots of a model have in common.

use super::super::surroundings::surroundings;
use super::super::{emit, emit_json, warn};
use super::cluster::EngineArguments;
use super::run::{note, sound};
use super::{FleetLocation, workshop};
use crate::error::{Error, Result, counted};
use crate::fleet::causes::{self, CauseSearch, Published};
use crate::fleet::round::GroupColumn;
use crate::fleet::{Ending, Fleet};
use crate::text::filled;
use clap::{Args, ValueEnum};
use minijinja::context;
use minijinja::value::Serde;
use serde_json::json;
use std::ffi::OsString;
use std::time::Instant;

/// Find the causes that robots of a model have in common, though each recording is too small to tell them from chance.
///
/// The evidence of every possible cause is summed over the robots of a group, round after round, with the settings of the pipeline's stage
/// `diagnose`; sizes stay each robot's own. Then causes of single robots, robots that lack what all others have, and robots of another
/// size are listed. The same command again goes on where it stood.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct FleetDiagnoseArguments {
    #[command(flatten)]
    place: FleetLocation,
    /// Label of the roster by which robots are grouped
    #[arg(long, value_enum, default_value_t = By::Model)]
    by: By,
    #[command(flatten)]
    engine: EngineArguments,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Prints no progress
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum By {
    /// Model of the robot
    Model,
    /// Where it stands
    Plant,
    /// Date of the measurement
    Campaign,
}

const EXAMPLES: &str = "Examples:
  calib fleet diagnose FLEET.yaml
  calib fleet diagnose FLEET.yaml --by plant -j 2 --json";

/// Rounds after which a search ends whatever it finds.
const ROUNDS: usize = 40;

impl FleetDiagnoseArguments {
    pub fn run(&self, command_line: &[OsString]) -> Result<()> {
        let begun = Instant::now();
        let store = self.place.store()?;
        let fleet = Fleet::load(&self.place.fleet, &store)?;
        let fresh = || surroundings(command_line);
        let mut workshop = workshop(&fleet, &store, &fresh);
        let by = match self.by {
            By::Model => GroupColumn::Model,
            By::Plant => GroupColumn::Plant,
            By::Campaign => GroupColumn::Campaign,
        };
        let mut search = CauseSearch::new(by);
        workshop.round = Some(search.round().clone());
        sound(&workshop)?;
        let chosen: Vec<usize> = (0..fleet.roster.0.len()).collect();
        let mut computed = 0;
        let last = loop {
            let mut note = note(&fleet, &self.place, &fresh().run_id)?;
            note.round.clone_from(&workshop.round);
            let progress = self.engine.progress(self.quiet, chosen.len());
            let worked = self
                .engine
                .work(&workshop, &mut note, &chosen, false, &progress)?;
            let Some(worked) = worked else {
                return emit("submitted the robots of one round; the same command again goes on\n");
            };
            computed += worked.computed;
            let records = worked.records;
            let missing = records.iter().filter(|record| record.is_none()).count();
            if missing > 0 {
                let message = format!("{} not computed yet; run again", counted(missing, "robot"));
                return Err(Error::store(fleet.name(), message));
            }
            let goes_on = search.take(&fleet, &workshop.ledger, &records)?;
            let found = search.so_far();
            progress.say(&format!(
                "round {}: {} given now{}{}",
                search.rounds,
                counted(found.len(), "cause"),
                if found.is_empty() { "" } else { ": " },
                found.join(", ")
            ));
            progress.finish();
            if !goes_on || search.rounds >= ROUNDS {
                break records;
            }
            workshop.round = Some(search.round().clone());
        };
        let made = causes::publish(&fleet, &workshop.ledger, &search, &last)?;
        warn(&made.untranslated);
        let seconds = begun.elapsed().as_secs_f64();
        if self.json {
            let rejected = last
                .iter()
                .flatten()
                .filter(|record| record.ending != Ending::Done);
            return emit_json(&json!({
                "fleet": fleet.name(), "robots": last.len(), "not_asked": rejected.count(), "rounds": search.rounds, "computed": computed,
                "wall_seconds": seconds, "findings": made.answers.findings.0, "outliers": made.answers.outliers.0,
                "tables": made.tables.iter().map(|path| path.to_string_lossy()).collect::<Vec<_>>(), "page": made.page.to_string_lossy(),
            }));
        }
        emit(&text(&made, last.len(), search.rounds, computed, seconds))
    }
}

/// Sentences of each kind that the terminal shows; the tables have all.
const SHOWN: usize = 20;

fn text(made: &Published, robots: usize, rounds: usize, computed: usize, seconds: f64) -> String {
    let findings = made.answers.findings.0.iter();
    let shared: Vec<_> = findings.filter(|row| row.robot.is_empty()).collect();
    let outliers = &made.answers.outliers.0;
    let about = context! {
        shared => Serde(shared), outliers => Serde(&outliers[..outliers.len().min(SHOWN)]),
        more => outliers.len().saturating_sub(SHOWN), page => made.page.display().to_string(),
        tables => made.tables.iter().map(|path| path.display().to_string()).collect::<Vec<_>>(),
        robots, rounds, computed, seconds,
    };
    filled(include_str!("causes.txt"), about)
}
