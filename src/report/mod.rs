//! Tables to one self-contained HTML file: no script, no network, inline SVG, light and dark, fit to print.
//!
//! Every figure is a column of a table; the pictures only bin, sort and scale them, and values are shown in people's units.

mod certificate;
mod closure;
mod data;
mod errors;
mod findings;
mod fits;
pub mod fleet;
pub mod fleet_causes;
mod language;
mod number;
mod parameters;
mod svg;
mod torques;
mod workspace;

pub use certificate::{AcceptanceLimits, AchievedTables, achieved_page};
pub use findings::diagnosed_page;
pub use language::PageLanguage;
use language::{Locale, say};
pub use torques::{TorqueTables, torque_page};

use crate::error::Result;
use crate::table::{
    Acceptance, Cells, Corrections, Curves, FindingNumberRow, FindingNumbers, Findings, Fit, Forms,
    Intake, Observability, Parameters, Prediction, Recording, Rejected, RivalRow, Rivals, Robot,
    Split, Statistics, Suspects, Training, Verdict, VerdictSentences, VerdictTopic, Withdrawn,
};
use serde_json::json;
use std::collections::BTreeMap;

/// What a report is made of; lists are in pipeline order and may be empty.
pub(crate) struct Tables {
    /// Errors of every step and set.
    pub(crate) statistics: Statistics,
    /// Predictions of every step that predicts.
    pub(crate) prediction: Vec<Prediction>,
    /// Parameters of the last identified model.
    pub(crate) parameters: Parameters,
    /// The nominal arm.
    pub(crate) robot: Robot,
    /// What the controller counts otherwise than the robot file, where it does.
    pub(crate) counting: Option<String>,
    /// What was measured.
    pub(crate) recording: Recording,
    /// Who is fitted, who judges.
    pub(crate) split: Split,
    /// What was read from each file.
    pub(crate) intake: Vec<Intake>,
    /// Rows that could not be used.
    pub(crate) rejected: Vec<Rejected>,
    /// Course of every fit.
    pub(crate) fit: Vec<Fit>,
    /// What the data determine.
    pub(crate) observability: Vec<Observability>,
    /// Course of every training.
    pub(crate) training: Vec<Training>,
    /// Rivals of learned corrections.
    pub(crate) corrections: Vec<Corrections>,
    /// The verdict of every diagnosis.
    pub(crate) verdict: Vec<Verdict>,
    /// Sentences of the verdict of every diagnosis.
    pub(crate) sentences: Vec<VerdictSentences>,
    /// Findings of every diagnosis.
    pub(crate) findings: Vec<Findings>,
    /// Numbers of the findings of every diagnosis.
    pub(crate) finding_numbers: Vec<FindingNumbers>,
    /// Rivals of the findings of every diagnosis.
    pub(crate) rivals: Vec<Rivals>,
    /// Formulas of findings without a name.
    pub(crate) forms: Vec<Forms>,
    /// The table of causes of every diagnosis.
    pub(crate) cells: Vec<Cells>,
    /// Rows that were set aside.
    pub(crate) suspects: Vec<Suspects>,
    /// Findings over what reveals them.
    pub(crate) curves: Curves,
    /// The step that the report speaks of; without one, the last.
    pub(crate) standing: Option<String>,
    /// Later steps that are worse on the same held-out points.
    pub(crate) withdrawn: Vec<Withdrawn>,
}

impl Tables {
    /// Numbers of a finding.
    fn numbers(&self, rank: i64) -> impl Iterator<Item = &FindingNumberRow> {
        let all = self.finding_numbers.iter().flat_map(|table| &table.0);
        all.filter(move |number| number.rank == rank)
    }

    /// Rivals of a finding.
    fn rivals(&self, rank: i64) -> impl Iterator<Item = &RivalRow> {
        let all = self.rivals.iter().flat_map(|table| &table.0);
        all.filter(move |rival| rival.rank == rank)
    }

    /// What the diagnosis of a step says of a topic.
    fn statements(&self, step: &str, topic: VerdictTopic) -> Vec<&str> {
        self.sentences
            .iter()
            .flat_map(|table| table.about(step, topic))
            .collect()
    }
}

/// What the person who asked for the report chose.
pub(crate) struct ReportOptions<'a> {
    /// Head of the page.
    pub(crate) title: Option<&'a str>,
    /// The held-out set of the first sentence; else the one with most points.
    pub(crate) set: Option<&'a str>,
    /// What the user calls good enough.
    pub(crate) limits: AcceptanceLimits,
    /// Language of the page; its JSON is English.
    pub(crate) language: PageLanguage,
    /// Who, with what, where and when: shown as it was given.
    pub(crate) identity: &'a BTreeMap<String, String>,
    /// Content hashes of the tables that the report rests on.
    pub(crate) hashes: Vec<(String, String)>,
}

/// The report as HTML and as JSON.
pub(crate) struct Pages {
    /// One file that needs no other.
    pub(crate) html: String,
    /// The same for programs.
    pub(crate) json: String,
    /// The user's limits and what was found.
    pub(crate) acceptance: Acceptance,
    /// What the page says in English since its language lacks it.
    pub(crate) missing: Vec<String>,
}

/// The report; fails where `options.set` is no held-out set.
pub(crate) fn pages(tables: &Tables, options: &ReportOptions) -> Result<Pages> {
    let steps = errors::Steps::new(&tables.statistics, tables.standing.as_deref());
    let judgement = certificate::Judgement::new(tables, &options.limits, options.set);
    let head = |locale: &Locale| {
        let robot = data::robot_name(locale, &tables.robot);
        let title = options.title.map(str::to_owned);
        let title = title.unwrap_or_else(|| say!(locale, "Calibration of {robot}", robot));
        (robot, title)
    };
    let json = data::document(
        tables,
        options,
        head(&Locale::default()),
        judgement.as_ref(),
    )?;
    let locale = &Locale::new(options.language);
    let (robot, title) = head(locale);
    let choices = [("title", options.title), ("set", options.set)];
    let page = json!({
        "title": title,
        "certificate": certificate::certificate(locale, tables, judgement.as_ref(), options.set),
        "identity": options.identity,
        "hashes": &options.hashes,
        "diagnosis": findings::section(locale, tables),
        "errors": errors::errors_section(locale, tables, &steps, options.set)?,
        "closure": closure::section(locale, tables),
        "workspace": errors::workspace_section(locale, &tables.prediction, tables.standing.as_deref()),
        "parameters": parameters::section(locale, &tables.parameters, tables.counting.as_deref()),
        "fits": fits::section(locale, tables, &steps),
        "comparisons": fits::comparisons(tables),
        "data": data::section(locale, tables),
        "choices": choices.into_iter().filter(|(_, value)| value.is_some()).collect::<Vec<_>>(),
        "robot": robot,
        // Steps that do not stand.
        "withdrawn": tables.withdrawn.iter().map(|gone| &gone.step).collect::<Vec<_>>(),
    });
    let html = number::render(locale, "report.html", include_str!("report.html"), page)?;
    let limits = judgement.map(|judgement| judgement.limits);
    Ok(Pages {
        html,
        json,
        acceptance: Acceptance(limits.unwrap_or_default()),
        missing: locale.missing(),
    })
}
