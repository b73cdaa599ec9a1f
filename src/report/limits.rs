//! The verdict against the user's limits: figures of the held-out points of the model that stands, each beside what it may be.

use super::Tables;
use super::errors::Steps;
use super::findings::wrong_setup;
use crate::table::{AcceptanceRow, StatisticsRow};

/// What the user accepts, mm; of held-out points of the diagnosed model, without a diagnosis after the last step.
#[derive(Debug, Clone, Copy, Default)]
pub struct AcceptanceLimits {
    /// Largest mean error of the held-out points.
    pub mean_mm: Option<f64>,
    /// Largest 95th percentile of the errors of the held-out points.
    pub p95_mm: Option<f64>,
    /// Largest error of any held-out point.
    pub max_mm: Option<f64>,
}

#[derive(Debug)]
pub(super) struct Judgement {
    pub sentence: String,
    /// Limits as they were set; none where a wrong set-up alone is not accepted.
    pub limits: Vec<AcceptanceRow>,
    pub kept: bool,
}

/// The row that is judged: of `set`, else of the held-out set with most points, after the step that stands.
pub(super) fn judged<'a>(tables: &'a Tables, set: Option<&str>) -> Option<&'a StatisticsRow> {
    let standing = Steps::new(&tables.statistics, tables.standing.as_deref()).standing()?;
    let rows = tables
        .statistics
        .0
        .iter()
        .filter(|row| row.held_out && row.order == standing);
    let rows = rows.filter(|row| set.is_none_or(|set| row.set == set));
    rows.max_by_key(|row| row.points)
}

impl Judgement {
    /// None where there are no limits and the set-up is right.
    pub fn new(tables: &Tables, limits: &AcceptanceLimits, set: Option<&str>) -> Option<Self> {
        let figures = [
            ("mean", limits.mean_mm),
            ("95 % of the points", limits.p95_mm),
            ("largest", limits.max_mm),
        ];
        let wrong = wrong_setup(tables);
        if wrong.is_none() && figures.iter().all(|(_, limit)| limit.is_none()) {
            return None;
        }
        let row = judged(tables, set).filter(|_| wrong.is_none());
        let found = row.map_or([None; 3], |row| {
            [row.mean_mm, row.p95_mm, row.max_mm].map(Some)
        });
        let asked = figures
            .into_iter()
            .zip(found)
            .filter_map(|((name, limit), found)| Some((name, found, limit?)));
        let asked: Vec<(&str, Option<f64>, f64)> = asked.collect();
        let is_within = |found: Option<f64>, limit: f64| found.is_some_and(|found| found <= limit);
        let kept = row.is_some()
            && asked
                .iter()
                .all(|(_, found, limit)| is_within(*found, *limit));
        let sentence = match (wrong, row) {
            (Some(wrong), _) => format!("Not accepted: {wrong}."),
            (None, None) => "The limits cannot be judged: no points were held out.".into(),
            (None, Some(row)) => format!(
                "{} the limits at {} held-out points of set {}, step {}.",
                if kept {
                    "Accepted: within"
                } else {
                    "Not accepted: beyond"
                },
                row.points,
                row.set,
                row.step
            ),
        };
        let limit =
            |(order, (name, found_mm, limit_mm)): (i64, (&str, Option<f64>, f64))| AcceptanceRow {
                order,
                figure: name.into(),
                found_mm,
                limit_mm,
                kept: is_within(found_mm, limit_mm),
                accepted: kept,
                sentence: sentence.clone(),
            };
        let limits = (1..).zip(asked).map(limit).collect();
        Some(Self {
            sentence,
            limits,
            kept,
        })
    }

    /// Limits with what was found.
    pub fn found(&self) -> impl Iterator<Item = (&AcceptanceRow, f64)> {
        self.limits
            .iter()
            .filter_map(|row| Some((row, row.found_mm?)))
    }
}
