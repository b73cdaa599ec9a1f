//! What identifications do about rows that no smooth model can follow, and what they tell the person about them.

use crate::estimate::{
    FitOptions, Fitted, Model, Screening, Session, Suspect, SuspectKind, fit, fit_screened,
};
use crate::robot::Measurements;
use crate::stage::Context;
use crate::table::{Recording, Split, slip};
use std::collections::BTreeMap;

/// A model fitted to rows of a recording.
pub struct FittedRows {
    pub(crate) model: Model,
    pub(crate) fitted: Fitted,
    pub(crate) screening: Screening,
}

impl FittedRows {
    /// With the recording.
    pub(crate) fn session<'a>(&'a self, data: &'a Measurements) -> Session<'a> {
        Session {
            data,
            rows: &self.screening.kept,
            model: &self.model,
            fitted: &self.fitted,
        }
    }
}

/// Fits, and with `screen` sets aside what does not belong.
pub(crate) fn fit_rows(
    start: &Model,
    data: &Measurements,
    options: &FitOptions,
    split: &Split,
    screen: bool,
) -> FittedRows {
    let (model, fitted, screening) = if screen {
        fit_screened(start, data, options, &numbered(split))
    } else {
        let (model, fitted) = fit(start, data, options);
        let kept = options.rows.to_vec();
        (
            model,
            fitted,
            Screening {
                kept,
                ..Screening::default()
            },
        )
    };
    FittedRows {
        model,
        fitted,
        screening,
    }
}

/// The number of the set that each row belongs to.
pub(crate) fn numbered(split: &Split) -> Vec<usize> {
    let mut numbers: BTreeMap<&str, usize> = BTreeMap::new();
    split
        .0
        .iter()
        .map(|row| {
            let next = numbers.len();
            *numbers.entry(&row.set).or_insert(next)
        })
        .collect()
}

/// So many cases of one kind are named; the table has all.
const NAMED: usize = 4;

/// Notes for the person: who was set aside and why, and what looks like mistakes and was kept.
pub(crate) fn note(context: &Context, screening: &Screening, recording: &Recording) {
    if let Some(offset) = screening.apart {
        context.warn(format!(
            "most points belong to the joints {offset:+} rows away: the two logs are misaligned: join them again before anything else"
        ));
    }
    let id = |row: usize| recording.point_id[row].as_str();
    let (events, aside): (Vec<&Suspect>, Vec<&Suspect>) = screening
        .suspects
        .iter()
        .partition(|suspect| suspect.used());
    if !aside.is_empty() {
        let mut by_kind: BTreeMap<u8, Vec<String>> = BTreeMap::new();
        for case in cases(&aside) {
            let (first, last) = (case[0], case[case.len() - 1]);
            let who = if case.len() == 1 {
                id(first.row).to_string()
            } else {
                format!(
                    "{} to {} ({} rows)",
                    id(first.row),
                    id(last.row),
                    case.len()
                )
            };
            let partner = first.partner.map_or("another row", id);
            let many = case.len() > 1;
            let (order, text) = match first.kind {
                SuspectKind::Exchanged if first.partner > Some(first.row) => {
                    (0, format!("{who} and {partner} look exchanged"))
                }
                SuspectKind::Exchanged => continue,
                SuspectKind::ShiftedBlock(offset) => (
                    1,
                    format!("{who}: points and joints are {offset:+} rows apart"),
                ),
                SuspectKind::Mislabelled => (
                    2,
                    format!("{who} lies where the joints of {partner} put it"),
                ),
                SuspectKind::UnitSlip(factor) => (
                    3,
                    format!("{who} {} {}", if many { "are" } else { "is" }, slip(factor)),
                ),
                SuspectKind::Zero => (4, format!("{who} {} zero", if many { "are" } else { "is" })),
                SuspectKind::Outlier | SuspectKind::Event => {
                    (5, format!("{who} is {:.3} mm off", first.size * 1e3))
                }
            };
            by_kind.entry(order).or_default().push(text);
        }
        let texts = by_kind.into_values().flat_map(|mut texts| {
            let more = texts.len().saturating_sub(NAMED);
            texts.truncate(NAMED);
            texts.extend((more > 0).then(|| format!("{more} more like these (table suspects)")));
            texts
        });
        let texts: Vec<String> = texts.collect();
        let rows = if aside.len() == 1 { "row" } else { "rows" };
        context.warn(format!(
            "{} {rows} set aside: {}",
            aside.len(),
            texts.join("; ")
        ));
    }
    for run in events.chunk_by(|a, b| a.row + 1 == b.row) {
        context.warn(format!(
            "{} to {} ({} rows) stand out together: something happened there that the model does not know; they are kept",
            id(run[0].row),
            id(run[run.len() - 1].row),
            run.len()
        ));
    }
    if screening.crowd > 0 {
        context.note(format!(
            "{} far out without evidence beside this model that they are mistakes of the recording: it lacks something there; they are kept",
            if screening.crowd == 1 { "one row stands".into() } else { format!("{} rows stand", screening.crowd) }
        ));
    }
}

/// Suspects that are one thing to a person: consecutive rows with the same slip, zero or shift; all others one by one.
fn cases<'a>(suspects: &'a [&'a Suspect]) -> impl Iterator<Item = &'a [&'a Suspect]> {
    suspects.chunk_by(|a, b| {
        let together = matches!(
            a.kind,
            SuspectKind::ShiftedBlock(_) | SuspectKind::UnitSlip(_) | SuspectKind::Zero
        );
        together && a.kind == b.kind && a.row + 1 == b.row
    })
}
