//! Where the residual sits and what it depends on, before and after the findings: two tables.

use super::{ShareRow, Shares, Spectrum, SpectrumRow};
use crate::diagnose::{Diagnosis, Located};

fn moments(diagnosis: &Diagnosis) -> [(&'static str, &Located); 2] {
    [("after", &diagnosis.located_after), ("before", &diagnosis.located_before)]
}

impl Shares {
    /// A row for each place and variable, before and after.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let rows = moments(diagnosis).into_iter().flat_map(|(moment, located)| {
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

impl Spectrum {
    /// A row for each order of each joint.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let rows = moments(diagnosis).into_iter().flat_map(|(moment, located)| {
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
