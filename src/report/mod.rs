//! Tables to one self-contained HTML file: no script, no network, inline SVG, light and dark, fit to print.
//!
//! Every figure is a column of a table; the pictures only bin, sort and scale them, and values are shown in people's units.

mod axis;
mod course;
mod data;
mod distribution;
mod errors;
mod fits;
pub mod fleet;
mod number;
mod parameters;
mod svg;
mod workspace;

use crate::error::{Error, Result};
use crate::table::{Fit, Intake, Observability, Parameters, Prediction, Recording, Rejected, Robot, Split, Statistics, Training};
use serde::Serialize;

/// What a report is made of; lists are in pipeline order and may be empty.
pub struct Tables {
    pub statistics: Statistics,
    pub prediction: Vec<Prediction>,
    pub parameters: Parameters,
    pub robot: Robot,
    pub recording: Recording,
    pub split: Split,
    pub intake: Vec<Intake>,
    pub rejected: Vec<Rejected>,
    pub fit: Vec<Fit>,
    pub observability: Vec<Observability>,
    pub training: Vec<Training>,
}

/// What the person who asked for the report chose.
pub struct Wishes<'a> {
    pub title: Option<&'a str>,
    /// The held-out set of the first sentence; else the one with most points.
    pub set: Option<&'a str>,
}

#[derive(Serialize)]
struct Page<'a> {
    title: String,
    style: &'static str,
    version: &'static str,
    robot: String,
    errors: errors::Errors,
    workspace: Option<errors::Workspace>,
    parameters: parameters::Section,
    fits: fits::Section,
    data: data::Section,
    choices: Vec<(&'static str, &'a str)>,
}

/// The report as HTML; fails where `wishes.set` is no held-out set.
pub fn html(tables: &Tables, wishes: &Wishes) -> Result<String> {
    let steps = errors::Steps::new(&tables.statistics);
    let robot = data::robot_name(&tables.robot);
    let page = Page {
        title: wishes.title.map_or_else(|| format!("Calibration of {robot}"), str::to_owned),
        style: include_str!("report.css"),
        version: env!("CARGO_PKG_VERSION"),
        errors: errors::Errors::new(tables, &steps, wishes.set)?,
        workspace: errors::Workspace::new(&tables.prediction),
        parameters: parameters::Section::new(&tables.parameters),
        fits: fits::Section::new(tables, &steps),
        data: data::Section::new(tables),
        choices: [("title", wishes.title), ("set", wishes.set)]
            .into_iter()
            .filter_map(|(name, value)| value.map(|value| (name, value)))
            .collect(),
        robot,
    };
    let mut environment = minijinja::Environment::new();
    // A name in the template that does not exist is a bug, not an empty cell.
    environment.set_undefined_behavior(minijinja::UndefinedBehavior::Strict);
    environment
        .add_template("report.html", include_str!("report.html"))
        .and_then(|()| environment.get_template("report.html")?.render(minijinja::value::Serde(&page)))
        .map_err(|e| Error::Bug(format!("report template: {e:#}")))
}
