//! A comparison as one self-contained HTML page. Names and texts come from files: the template escapes all of them.

use minijinja::{AutoEscape, Environment, context};

use super::TableDiff;
use super::text::{cell, short};
use crate::error::{Error, Result};

const PAGE: &str = include_str!("page.html");

/// Tables compared, each under its name, as a page with a title.
pub fn html(title: &str, notes: &[String], tables: &[(String, TableDiff)]) -> Result<String> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let bug = |e: minijinja::Error| Error::Bug(format!("diff page: {e}"));
    environment.add_template("page", PAGE).map_err(bug)?;
    let tables: Vec<minijinja::Value> = tables
        .iter()
        .map(|(name, diff)| {
            let columns: Vec<minijinja::Value> = diff
                .columns
                .iter()
                .filter(|column| column.changed + column.within > 0)
                .map(|column| {
                    let of = |pick: fn(&super::DifferenceStatistics) -> f64| column.statistics.as_ref().map(|found| short(pick(found)));
                    context! {
                        name => column.name.clone(), unit => column.unit.clone(), changed => column.changed, within => column.within,
                        max => of(|found| found.max), rms => of(|found| found.rms), bias => of(|found| found.bias),
                        p95 => of(|found| found.p95), sigmas => column.max_sigmas.map(short), at => column.worst_key.clone(),
                    }
                })
                .collect();
            let worst: Vec<minijinja::Value> = diff
                .worst
                .iter()
                .map(|row| context! { key => row.key.clone(), cells => row.cells.iter().map(cell).collect::<Vec<_>>() })
                .collect();
            context! {
                name, columns, worst, same => diff.is_same(),
                equal_columns => diff.columns.iter().filter(|column| column.changed + column.within == 0).count(),
                diff => minijinja::Value::from(minijinja::value::Serde(diff)),
            }
        })
        .collect();
    let template = environment.get_template("page").map_err(bug)?;
    template.render(context! { title, notes => minijinja::Value::from(minijinja::value::Serde(notes)), tables }).map_err(bug)
}
