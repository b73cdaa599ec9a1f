//! A fleet as one self-contained page: every robot a row, sorted and filtered in the browser without a request.

use super::Page;
use super::language::{Locale, PageLanguage, say};
use super::number::render;
use super::svg::Svg;
use crate::error::{Result, visible};
use crate::table::{FleetChanges, FleetRow, FleetTable};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The page; `links` are the robots' own reports, relative to it.
pub fn html(
    name: &str,
    fleet: &FleetTable,
    changes: &FleetChanges,
    links: &BTreeMap<String, String>,
    language: PageLanguage,
) -> Result<Page> {
    let locale = &Locale::new(language);
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for row in &fleet.0 {
        *counts.entry(&row.status).or_default() += 1;
    }
    let mut rows: Vec<(Option<(u8, String)>, &FleetRow)> = fleet
        .0
        .iter()
        .map(|row| (needs(locale, row), row))
        .collect();
    // Robots that need nobody come last, in the order of the fleet.
    rows.sort_by_key(|(needs, _)| needs.as_ref().map_or(u8::MAX, |(urgency, _)| *urgency));
    let urgent = rows.iter().filter_map(|(needs, row)| {
        let (_, needs) = needs.clone()?;
        Some(json!({ "name": visible(&row.robot), "link": links.get(&row.robot).map(String::as_str), "needs": needs }))
    });
    let page = json!({
        // So many more of them, which stand at the head of the table.
        "more": urgent.clone().count().saturating_sub(NAMED),
        // The robots that need a technician, the most urgent first.
        "urgent": urgent.take(NAMED).collect::<Vec<_>>(),
        "name": name,
        "title": say!(locale, "Fleet {name}", name),
        "policy": "; script-src 'unsafe-inline'; img-src data:",
        "style": include_str!("fleet.css"),
        "script": include_str!("fleet.js"),
        "counts": counts.into_iter().map(|(status, count)| (status.to_string(), count)).collect::<Vec<_>>(),
        "robots": rows.iter().map(|(_, row)| self::row(locale, row, links)).collect::<Vec<_>>(),
        "changes": changes.0.iter().filter(|row| row.flagged).map(change).collect::<Vec<_>>(),
        "flagged": fleet.0.iter().filter(|row| row.flags.is_some()).count(),
        "diagnosed": fleet.0.iter().any(|row| row.verdict.is_some()),
        "compared": fleet.0.iter().any(|row| row.changes.is_some()),
        "grouped": fleet.0.iter().any(|row| row.model.is_some() || row.plant.is_some() || row.campaign.is_some()),
    });
    let html = render(locale, "fleet.html", include_str!("fleet.html"), page)?;
    Ok(Page {
        html,
        missing: locale.missing(),
    })
}

/// Robots that are named above the table, at most.
const NAMED: usize = 30;

/// What a robot needs a technician for, in a sentence, and how urgently, 0 first; nothing where it needs none.
fn needs(locale: &Locale, row: &FleetRow) -> Option<(u8, String)> {
    let verdict = row.verdict.as_deref();
    let errors = row.before_rms_mm.zip(row.after_rms_mm);
    let stored = |text: &Option<String>| {
        let given = text.as_deref().filter(|text| !text.is_empty());
        given.map(|text| locale.stored(text))
    };
    let (urgency, what, why) = match () {
        // A reason is what calib said of the data, with places and names.
        () if matches!(row.status.as_str(), "failed" | "rejected") => {
            (0, say!(locale, "was not calibrated"), row.reason.clone())
        }
        () if verdict == Some("wrong_setup") => {
            let what = say!(locale, "its set-up is wrong");
            (1, what, stored(&row.causes))
        }
        () if errors.is_some_and(|(before, after)| after >= before) => {
            let what = say!(locale, "the calibration did not make it more accurate");
            (2, what, None)
        }
        () if row.flags.is_some() => {
            let what = say!(
                locale,
                "changed beyond its limits since the last calibration"
            );
            (3, what, stored(&row.flags))
        }
        () if verdict == Some("unexplained") => {
            let what = say!(locale, "its error is not explained");
            (4, what, stored(&row.causes))
        }
        () => return None,
    };
    let why = why.filter(|why| !why.is_empty());
    let sentence = why.map_or_else(|| what.clone(), |why| format!("{what}: {why}"));
    Some((urgency, sentence))
}

fn row(locale: &Locale, row: &FleetRow, links: &BTreeMap<String, String>) -> Value {
    let group: Vec<&str> = [&row.model, &row.plant, &row.campaign]
        .into_iter()
        .filter_map(|group| group.as_deref())
        .collect();
    let course = row.course.as_deref();
    let mut shown = json!(row);
    shown["name"] = visible(&row.robot).into();
    shown["link"] = json!(links.get(&row.robot));
    shown["group"] = group.join(", ").into();
    shown["spark"] = json!(course.and_then(|course| spark(locale, course, row.floor_mm)));
    let stored = |text: &Option<String>| text.as_deref().map(|text| locale.stored(text));
    shown["causes"] = json!(stored(&row.causes));
    shown["flags"] = json!(stored(&row.flags));
    shown
}

fn change(row: &crate::table::FleetChangeRow) -> Value {
    let (factor, unit) = if row.unit == "rad" {
        (180.0 / std::f64::consts::PI, "deg")
    } else {
        (1.0, row.unit.as_str())
    };
    let show = |value: f64| format!("{:.3e}", value * factor);
    json!({
        "robot": visible(&row.robot),
        "effect": &row.effect,
        "place": &row.place,
        "parameter": &row.parameter,
        "change": show(row.change),
        "sigma": show(row.sigma),
        "limit": show(row.limit),
        "unit": unit,
    })
}

/// Width and height of a sparkline.
const SIZE: [f64; 2] = [72.0, 18.0];

/// The error after every step on a logarithmic scale, with the noise as a line below.
fn spark(locale: &Locale, course: &str, floor: Option<f64>) -> Option<String> {
    let values: Vec<f64> = course
        .split(' ')
        .filter_map(|value| value.parse::<f64>().ok())
        .filter(|value| *value > 0.0)
        .collect();
    if values.len() < 2 {
        return None;
    }
    let floor = floor.filter(|floor| *floor > 0.0);
    let all = || values.iter().copied().chain(floor);
    let (low, high) = (
        all().fold(f64::INFINITY, f64::min).ln(),
        all().fold(0.0, f64::max).ln(),
    );
    let height = |value: f64| 1.0 + (SIZE[1] - 2.0) * (high - value.ln()) / (high - low).max(1e-9);
    let step = (SIZE[0] - 4.0) / (values.len() - 1) as f64;
    let points: Vec<[f64; 2]> = values
        .iter()
        .enumerate()
        .map(|(i, value)| [2.0 + step * i as f64, height(*value)])
        .collect();
    let mut svg = Svg::new(locale, SIZE[0], SIZE[1]);
    if let Some(floor) = floor {
        svg.line("floor", [0.0, height(floor)], [SIZE[0], height(floor)]);
    }
    svg.path("course", &points);
    if let Some(last) = points.last() {
        svg.circle("end", *last, 1.5);
    }
    let course = locale.decimal(course.into());
    Some(svg.finish(&say!(
        locale,
        "rms error after each step, mm: {course}",
        course
    )))
}
