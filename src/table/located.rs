//! Where the residual sits and what it depends on, before and after the findings: two tables.

use crate::diagnose::{Diagnosis, Located};

crate::table::rows! { "shares",
    /// The most that any single cause at a place, or of a variable, could explain; key (`moment`, `by`, `name`).
    pub struct Shares of ShareRow {
        /// `before` the findings or `after` them.
        moment: String,
        /// `place` or `variable`.
        by: String,
        /// E.g. `joint 3`, `link 2-4`; `q3`, `load of joint 2`, `time` (`row` where none was recorded).
        name: String,
        /// Of the squared residual, in standard deviations.
        share: f64,
        /// How many numbers it takes.
        numbers: i64,
        /// Fall of the Bayesian information criterion: positive where it is more than chance.
        delta_bic: f64,
        /// The effect that does it.
        effect: String,
    }
}

crate::table::rows! { "spectrum",
    /// What each order of each joint explains; key (`moment`, `joint`, `of`, `order`).
    pub struct Spectrum of SpectrumRow {
        /// `before` the findings or `after` them.
        moment: String,
        /// From 1.
        joint: i64,
        /// `joint` or `motor`: whose turn the order counts.
        of: String,
        order: i64,
        /// Of the squared residual, in standard deviations, that a sine and a cosine explain.
        share: f64,
    }
}

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
