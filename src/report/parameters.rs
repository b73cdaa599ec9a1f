//! The identified parameters in people's units, and what the data could not tell.

use super::number::{Reading, readings, significant};
use crate::table::{ParameterRow, Parameters};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Section {
    groups: Vec<Group>,
    /// What was not estimated, and what has a remark.
    remarks: Vec<Remark>,
}

/// The parameters of one effect.
#[derive(Serialize)]
struct Group {
    effect: String,
    rows: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    name: String,
    place: String,
    nominal: String,
    value: String,
    /// Unit of nominal and value.
    unit: String,
    change: String,
    sigma: String,
    /// Unit of change and sigma.
    fine_unit: String,
    status: String,
    step: String,
    stored: String,
}

#[derive(Serialize)]
struct Remark {
    name: String,
    place: String,
    status: String,
    remark: String,
}

impl Section {
    pub fn new(parameters: &Parameters) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        for parameter in &parameters.0 {
            match groups.iter_mut().find(|group| group.effect == parameter.effect) {
                Some(group) => group.rows.push(row(parameter)),
                None => groups.push(Group { effect: parameter.effect.clone(), rows: vec![row(parameter)] }),
            }
        }
        let remarked = parameters.0.iter().filter(|p| p.remark.is_some() || p.status == "redundant" || p.status == "unseen");
        Self {
            groups,
            remarks: remarked
                .map(|p| Remark {
                    name: p.name.clone(),
                    place: p.place.clone(),
                    status: p.status.clone(),
                    remark: p.remark.clone().unwrap_or_default(),
                })
                .collect(),
        }
    }
}

fn row(p: &ParameterRow) -> Row {
    let (nominal, value, unit, change, sigma, fine_unit) = match readings(&p.unit) {
        Some((coarse, fine)) => read(p, coarse, fine),
        // A unit that calib does not know is shown as it is stored.
        None => (
            significant(p.nominal, 6),
            significant(p.value, 6),
            p.unit.clone(),
            significant(p.value - p.nominal, 4),
            p.sigma.map_or_else(String::new, |s| significant(s, 2)),
            p.unit.clone(),
        ),
    };
    Row {
        name: p.name.clone(),
        place: p.place.clone(),
        nominal,
        value,
        unit,
        change,
        sigma,
        fine_unit,
        status: p.status.clone(),
        step: p.step.clone(),
        stored: format!("{} {}", significant(p.value, 9), p.unit),
    }
}

fn read(p: &ParameterRow, coarse: Reading, fine: Reading) -> (String, String, String, String, String, String) {
    let decimals = fine.decimals_for(p.sigma);
    let same = coarse.symbol == fine.symbol;
    let coarse_decimals = if same { decimals } else { coarse.decimals_for(p.sigma) };
    (
        coarse.show(p.nominal, coarse_decimals),
        coarse.show(p.value, coarse_decimals),
        coarse.symbol.into(),
        fine.show_signed(p.value - p.nominal, decimals),
        p.sigma.map_or_else(String::new, |s| fine.show(s, decimals)),
        fine.symbol.into(),
    )
}
