//! The verdict against the user's limits: figures of the held-out points of the model that stands, each beside what it may be.

use super::Tables;
use super::errors::Steps;
use super::findings::wrong_setup;
use super::number::mm;
use crate::table::StatisticsRow;

/// What the user accepts, mm; of held-out points of the diagnosed model, without a diagnosis after the last step.
#[derive(Debug, Clone, Copy, Default)]
pub struct AcceptanceLimits {
    /// Of the held-out points.
    pub mean_mm: Option<f64>,
    /// Of the held-out points, 95th percentile.
    pub p95_mm: Option<f64>,
    /// Of the held-out points.
    pub max_mm: Option<f64>,
}

#[derive(Debug)]
pub(super) struct Judgement {
    pub sentence: String,
    /// Figure, found, allowed, whether it is kept.
    pub lines: Vec<(&'static str, String, String, bool)>,
    /// What was found and what is allowed, mm, of each line.
    pub values: Vec<[f64; 2]>,
    pub kept: bool,
    /// Whether there are limits: a wrong set-up is not accepted without any.
    pub asked: bool,
}

/// The row that is judged: of `set`, else of the held-out set with most points, after the step that stands.
pub(super) fn judged<'a>(tables: &'a Tables, set: Option<&str>) -> Option<&'a StatisticsRow> {
    let standing = Steps::new(&tables.statistics, tables.standing.as_deref()).standing()?;
    let rows = tables.statistics.0.iter().filter(|row| row.held_out && row.order == standing);
    let rows = rows.filter(|row| set.is_none_or(|set| row.set == set));
    rows.max_by_key(|row| row.points)
}

impl Judgement {
    /// None where there are no limits and the set-up is right.
    pub fn new(tables: &Tables, limits: &AcceptanceLimits, set: Option<&str>) -> Option<Self> {
        let figures = [("mean", limits.mean_mm), ("95 % of the points", limits.p95_mm), ("largest", limits.max_mm)];
        let asked = figures.iter().any(|(_, limit)| limit.is_some());
        let unjudged = |sentence: String| Self { sentence, lines: Vec::new(), values: Vec::new(), kept: false, asked };
        if let Some(wrong) = wrong_setup(tables) {
            return Some(unjudged(format!("Not accepted: {wrong}.")));
        }
        if !asked {
            return None;
        }
        let Some(row) = judged(tables, set) else {
            return Some(unjudged("The limits cannot be judged: no points were held out.".into()));
        };
        let found = [row.mean_mm, row.p95_mm, row.max_mm];
        let judged: Vec<(&'static str, [f64; 2])> =
            figures.iter().zip(found).filter_map(|((name, limit), found)| Some((*name, [found, (*limit)?]))).collect();
        let line = |(name, [found, limit]): (&'static str, [f64; 2])| (name, mm(found), mm(limit), found <= limit);
        let lines: Vec<_> = judged.iter().copied().map(line).collect();
        let values = judged.iter().map(|(_, values)| *values).collect();
        let kept = lines.iter().all(|line| line.3);
        let sentence = format!(
            "{} the limits at {} held-out points of set {}, step {}.",
            if kept { "Accepted: within" } else { "Not accepted: beyond" },
            row.points,
            row.set,
            row.step
        );
        Some(Self { sentence, lines, values, kept, asked })
    }
}
