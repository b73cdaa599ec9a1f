//! The search for what robots of a group have in common: round after round the cell with the largest sum of evidence joins, as long as that
//! pays; then what single robots show alone.

use super::cause_answers::{self, Answers};
use super::cause_sums::{CellProfile, CellTotal, GroupSums, each};
use super::ledger::RobotRecord;
use super::round::{GroupColumn, Round};
use super::{Fleet, Ledger};
use crate::criteria::cells::{JOINS, LEAVES};
use crate::criteria::fleet::{ALONE, EXCHANGED};
use crate::criteria::torque::COMPONENTS;
use crate::effect::names;
use crate::error::{Result, visible};
use crate::report::fleet_causes as page;
use crate::stage::Given;
use crate::store::TableRef;
use crate::table::{CellEvidence, Table};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The stage's id and name in keys and paths.
const STAGE: &str = "fleet_diagnose";
/// Where its tables are noted among the fleet's.
pub(super) const NOTE: &str = "causes.json";

/// What a group has so far, how often it had each set of cells, what was dropped how often, and the gain in ln of odds for which each set was left.
#[derive(Default)]
struct GroupSearch {
    given: Vec<Given>,
    had: BTreeMap<Vec<String>, usize>,
    dropped: BTreeMap<String, usize>,
    left: BTreeMap<Vec<String>, f64>,
}

/// The likeliest cause of a robot by itself.
struct Alone {
    robot: String,
    given: Given,
}

/// The search over a fleet's groups.
pub(crate) struct CauseSearch {
    round: Round,
    groups: BTreeMap<String, GroupSearch>,
    pub(crate) rounds: usize,
}

impl CauseSearch {
    /// Nothing is given yet.
    pub(crate) fn new(by: GroupColumn) -> Self {
        Self {
            round: Round::first(by),
            groups: BTreeMap::new(),
            rounds: 0,
        }
    }

    /// What robots are to be asked now.
    pub(crate) fn round(&self) -> &Round {
        &self.round
    }

    /// Keys of the cells that the groups have so far.
    pub(crate) fn so_far(&self) -> Vec<String> {
        let given = self.round.groups.values().flatten();
        given.map(|given| visible(&given.cell)).collect()
    }

    /// Takes the robots' answers; whether they are to be asked again.
    pub(crate) fn take(
        &mut self,
        fleet: &Fleet,
        ledger: &Ledger,
        records: &[Option<RobotRecord>],
    ) -> Result<bool> {
        self.rounds += 1;
        let mut sums: BTreeMap<String, GroupSums> = BTreeMap::new();
        let mut alone: BTreeMap<String, Vec<Alone>> = BTreeMap::new();
        each(fleet, ledger, records, &mut |robot, cells| {
            let group = self.round.by.of(&robot.groups).to_string();
            let known = self.round.robots.get(&robot.name);
            if known.is_none_or(|known| known.len() < *ALONE)
                && let Some(given) = likeliest(cells)
            {
                let robot = robot.name.clone();
                let one = Alone { robot, given };
                alone.entry(group.clone()).or_default().push(one);
            }
            let given = self.round.groups.get(&group);
            let given = given.map_or(&[][..], Vec::as_slice);
            sums.entry(group).or_default().add(cells, given);
        })?;
        let mut goes_on = false;
        for (group, sums) in &sums {
            let search = self.groups.entry(group.clone()).or_default();
            if search.step(sums) {
                goes_on = true;
                self.round
                    .groups
                    .insert(group.clone(), search.given.clone());
                continue;
            }
            // What is plain in single robots comes when their group has all of its causes.
            for Alone { robot, given } in alone.remove(group).unwrap_or_default() {
                let of_robot = self.round.robots.entry(robot).or_default();
                if !of_robot.iter().any(|known| known.cell == given.cell) {
                    of_robot.push(given);
                    goes_on = true;
                }
            }
        }
        Ok(goes_on)
    }
}

/// The cell that a robot by itself shows next to those in its model, if its odds alone are strong.
fn likeliest(cells: &[CellProfile]) -> Option<Given> {
    let odds = |profile: &CellProfile| profile.row.log_evidence + profile.row.log_prior;
    let best = cells
        .iter()
        .filter(|CellProfile { row, .. }| {
            row.given.is_empty() && row.shape.is_empty() && row.sigma.is_none()
        })
        .max_by(|a, b| odds(a).total_cmp(&odds(b)))?;
    (odds(best) >= *JOINS).then(|| given(&best.row.cell, None, best.row.size))
}

/// A cell with a size of two digits: equal rounds have equal keys.
fn given(cell: &str, shape: Option<&str>, size: f64) -> Given {
    Given {
        cell: cell.into(),
        shape: shape.map(Into::into),
        size: format!("{:.1e}", size.max(1e-3)).parse().unwrap_or(0.01),
    }
}

impl GroupSearch {
    /// Drops, exchanges or adds cells by the sums; whether any did.
    fn step(&mut self, sums: &GroupSums) -> bool {
        let times = self.had.entry(Self::key(&self.given)).or_default();
        *times += 1;
        // What two additions led back to stays.
        let grows = *times <= 2;
        self.drop_weak(sums) || self.exchange(sums) || grows && self.add(sums)
    }

    fn key(given: &[Given]) -> Vec<String> {
        let mut cells: Vec<String> = given.iter().map(|given| given.cell.clone()).collect();
        cells.sort();
        cells
    }

    fn drop_weak(&mut self, sums: &GroupSums) -> bool {
        let odds = |given: &Given| {
            let present = sums
                .cells(&given.cell)
                .find(|present| present.cell == given.cell);
            present.map_or(f64::NEG_INFINITY, |present| {
                present.odds.min(present.of_the_others)
            })
        };
        let weak: Vec<String> = self
            .given
            .iter()
            .filter(|given| odds(given) < *LEAVES)
            .map(|given| given.cell.clone())
            .collect();
        for cell in &weak {
            *self.dropped.entry(cell.clone()).or_default() += 1;
        }
        self.given.retain(|given| !weak.contains(&given.cell));
        !weak.is_empty()
    }

    fn exchange(&mut self, sums: &GroupSums) -> bool {
        for i in 0..self.given.len() {
            let all: Vec<CellTotal> = sums.cells(&self.given[i].cell).collect();
            let present = all.iter().find(|cell| cell.cell == self.given[i].cell);
            let Some(stays) = present.map(|cell| cell.odds) else {
                continue;
            };
            let best = all.iter().max_by(|a, b| a.odds.total_cmp(&b.odds));
            let Some(best) = best.filter(|best| best.odds > stays + *EXCHANGED) else {
                continue;
            };
            let mut next = self.given.clone();
            next[i] = given(best.cell, best.shape, best.size(sums));
            // Of two sets of which each is left for the other one, that stays which gains less by it.
            let gain = best.odds - stays;
            if self.left.get(&Self::key(&next)).is_none_or(|by| gain > *by) {
                self.left.insert(Self::key(&self.given), gain);
                self.given = next;
                return true;
            }
        }
        false
    }

    fn add(&mut self, sums: &GroupSums) -> bool {
        if self.given.len() >= *COMPONENTS {
            return false;
        }
        let had_with = |cell: &str| {
            let mut cells = Self::key(&self.given);
            cells.push(cell.into());
            cells.sort();
            self.had.contains_key(&cells)
        };
        let may = |total: &CellTotal| {
            // What is plain in one robot alone is that robot's; a set that was left by drops and exchanges would be left again.
            total.odds >= *JOINS
                && total.of_the_others > 0.0
                && !had_with(total.cell)
                && self.dropped.get(total.cell).is_none_or(|times| *times < 2)
        };
        let all: Vec<CellTotal> = sums.cells("").collect();
        let best = all
            .iter()
            .filter(|total| may(total))
            .max_by(|a, b| a.odds.total_cmp(&b.odds));
        let Some(best) = best else { return false };
        // What most robots have found by themselves, each next to all others, joins with it.
        let found = |total: &&CellTotal| 2 * total.sum.found > sums.robots && may(total);
        let joining: Vec<&CellTotal> = std::iter::once(best)
            .chain(all.iter().filter(found))
            .collect();
        // One link that bends may look better than any one joint that yields, and worse than all of them.
        let is_first = self.given.is_empty() && self.dropped.is_empty();
        if is_first && best.sum.follows == "load" {
            let yields = all
                .iter()
                .filter(|total| total.sum.effect == names::JOINT_COMPLIANCE);
            self.given = yields
                .map(|total| given(total.cell, None, total.size(sums)))
                .collect();
        }
        for total in joining {
            if !self.given.iter().any(|given| given.cell == total.cell) {
                self.given
                    .push(given(total.cell, total.shape, total.size(sums)));
            }
        }
        true
    }
}

/// What a fleet's diagnosis came to.
pub struct Published {
    pub(crate) answers: Answers,
    /// Where people find the tables and the page.
    pub(crate) tables: Vec<PathBuf>,
    pub(crate) page: PathBuf,
    /// A warning for each text of the page that its language lacks.
    pub(crate) untranslated: Vec<String>,
}

/// Makes the tables and the page from the last round's records and publishes them.
pub(crate) fn publish(
    fleet: &Fleet,
    ledger: &Ledger,
    search: &CauseSearch,
    records: &[Option<RobotRecord>],
) -> Result<Published> {
    let answers = cause_answers::of(fleet, ledger, search.round(), records)?;
    let made = page::html(
        fleet.name(),
        &answers.findings,
        &answers.cells,
        &answers.outliers,
        fleet.file.language,
    )?;
    let robots = fleet.roster.0.iter().zip(records).map(|(robot, record)| {
        let table = record
            .as_ref()
            .and_then(|record| record.last(CellEvidence::KIND));
        json!([
            robot.name,
            robot.groups,
            table.map(|table| table.table_hash.to_string())
        ])
    });
    let settings = json!({
        "robots": robots.collect::<Vec<_>>(), "round": search.round(), "language": fleet.file.language,
    });
    let frames = vec![
        ("fleet_findings", answers.findings.to_frame()?),
        ("fleet_cells", answers.cells.to_frame()?),
        ("fleet_outliers", answers.outliers.to_frame()?),
    ];
    let untranslated = made.untranslated(fleet.file.language);
    let page = ("causes.html", made.html.as_str());
    let (tables, page) = ledger.publish((STAGE, 5), settings, frames, NOTE, page)?;
    Ok(Published {
        answers,
        tables,
        page,
        untranslated,
    })
}

/// A table of the diagnosis of a fleet; none where it was not diagnosed.
pub(super) fn noted<T: Table>(ledger: &Ledger, port: &str) -> Result<Option<T>> {
    let note: Option<Value> = ledger.store.note(&["fleets", &ledger.fleet], NOTE)?;
    let table =
        note.and_then(|note| serde_json::from_value::<TableRef>(note["tables"][port].clone()).ok());
    ledger.load(table.as_ref())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::STEPS;
    use crate::table::CellEvidenceRow;

    fn row(present: &str, (cell, log_evidence): (&str, f64)) -> CellProfile {
        let row = CellEvidenceRow {
            given: present.into(),
            cell: cell.into(),
            effect: "backlash".into(),
            place: "joint 2".into(),
            follows: "approach".into(),
            log_evidence,
            size: 0.05,
            unit: "mm".into(),
            ..CellEvidenceRow::default()
        };
        let at = [log_evidence; STEPS];
        CellProfile { row, at }
    }

    /// Sums of one robot that was asked in the place of a cell.
    fn in_place_of(present: &str, odds: [(&str, f64); 2]) -> GroupSums {
        let mut sums = GroupSums::default();
        let rows = odds.map(|odds| row(present, odds));
        sums.add(&rows, &[given(present, None, 0.05)]);
        sums
    }

    #[test]
    fn of_two_cells_of_which_each_looks_better_in_the_place_of_the_other_that_stays_which_gains_less()
     {
        let mut search = GroupSearch {
            given: vec![given("a", None, 0.05)],
            ..GroupSearch::default()
        };
        let cells = |search: &GroupSearch| GroupSearch::key(&search.given);
        // Around a model with a, b is 10 better; around one with b, a is 30 better: back to a, where b gains less than that.
        assert!(search.exchange(&in_place_of("a", [("a", 50.0), ("b", 60.0)])));
        assert_eq!(cells(&search), ["b"]);
        assert!(search.exchange(&in_place_of("b", [("a", 80.0), ("b", 50.0)])));
        assert_eq!(cells(&search), ["a"]);
        assert!(!search.exchange(&in_place_of("a", [("a", 50.0), ("b", 60.0)])));
        assert_eq!(cells(&search), ["a"]);
    }

    #[test]
    fn a_set_that_was_left_is_not_grown_into_again() {
        let mut sums = in_place_of("", [("a", 50.0), ("b", 60.0)]);
        sums.add(&[row("", ("a", 50.0)), row("", ("b", 60.0))], &[]);
        let mut search = GroupSearch {
            given: vec![given("c", None, 0.05)],
            ..GroupSearch::default()
        };
        search.had.insert(vec!["b".into(), "c".into()], 1);
        assert!(search.add(&sums));
        assert_eq!(GroupSearch::key(&search.given), ["a", "c"]);
    }

    #[test]
    fn a_cell_does_not_return_for_less_than_it_was_left_for() {
        let mut search = GroupSearch {
            given: vec![given("a", None, 0.05)],
            ..GroupSearch::default()
        };
        assert!(search.exchange(&in_place_of("a", [("a", 50.0), ("b", 60.0)])));
        assert!(!search.exchange(&in_place_of("b", [("a", 55.0), ("b", 50.0)])));
        assert_eq!(GroupSearch::key(&search.given), ["b"]);
    }
}
