//! Where the residual sits and what it depends on, before and after the findings: three tables.

use super::{CellRow, Cells, ShareRow, Shares, Spectrum, SpectrumRow};
use crate::diagnose::{Diagnosis, Located};
use crate::observation::Dimension;

fn moments(diagnosis: &Diagnosis) -> [(&'static str, &Located); 2] {
    [
        ("after", &diagnosis.located_after),
        ("before", &diagnosis.located_before),
    ]
}

impl Shares {
    /// A row for each place and variable, before and after.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let rows = moments(diagnosis)
            .into_iter()
            .flat_map(|(moment, located)| {
                located.shares.iter().map(move |share| ShareRow {
                    moment: moment.into(),
                    by: share.by.into(),
                    name: share.name.clone(),
                    share: share.share,
                    numbers: share.parameters as i64,
                    delta_bic: share.delta_bic,
                    effect: share.effect.into(),
                })
            });
        let mut rows: Vec<ShareRow> = rows.collect();
        rows.sort_by(|a, b| (&a.moment, &a.by, &a.name).cmp(&(&b.moment, &b.by, &b.name)));
        Self(rows)
    }
}

impl Cells {
    /// A row for each place and kind of variable, before and after.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let lengths = diagnosis.dimension == Dimension::Length;
        let rows = moments(diagnosis)
            .into_iter()
            .flat_map(|(moment, located)| {
                located.cells.iter().map(move |cell| CellRow {
                    moment: moment.into(),
                    place: cell.place.to_string(),
                    follows: cell.follows.into(),
                    explains_mm: lengths.then_some(1e3 * cell.explains),
                    delta_bic: cell.delta_bic,
                    effect: cell.effect.into(),
                })
            });
        let mut rows: Vec<CellRow> = rows.collect();
        rows.sort_by(|a, b| {
            (&a.moment, &a.place, &a.follows).cmp(&(&b.moment, &b.place, &b.follows))
        });
        Self(rows)
    }
}

impl Spectrum {
    /// A row for each order of each joint.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let rows = moments(diagnosis)
            .into_iter()
            .flat_map(|(moment, located)| {
                located.spectrum.iter().map(move |line| SpectrumRow {
                    moment: moment.into(),
                    joint: line.joint as i64 + 1,
                    of: if line.motor { "motor" } else { "joint" }.into(),
                    order: i64::from(line.order),
                    share: line.share,
                })
            });
        Self(rows.collect())
    }
}
