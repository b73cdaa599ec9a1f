//! What a fit of base and geometry says of a recording before anything is run in earnest: rows that are used and not, ranges, what is warned
//! of, what will be observable.

use super::{labelled, tables};
use crate::error::{Result, counted};
use crate::pipeline::Manifest;
use crate::store::Store;
use crate::table::{Parameters, Prediction, Recording, Rejected, Robot};
use std::collections::BTreeMap;

/// Rejected rows that are shown of one reason.
const SHOWN: usize = 3;
/// Parameters of one status that are named.
const NAMED: usize = 12;

/// Lines of a run up to its first fits. Fails where a table has left the store.
pub fn first_look(manifest: &Manifest, store: &Store) -> Result<String> {
    let mut out = String::new();
    for recording in tables::<Recording>(manifest, store)? {
        out.push_str(&labelled(
            "rows",
            &format!(
                "{} used, of {}",
                recording.rows(),
                counted(distinct(&recording), "point")
            ),
        ));
        if let Some(robot) = tables::<Robot>(manifest, store)?.first() {
            out.push_str(&ranges(&recording, robot)?);
        }
    }
    for rejected in tables::<Rejected>(manifest, store)? {
        out.push_str(&not_used(&rejected));
    }
    for prediction in tables::<Prediction>(manifest, store)? {
        out.push_str(&errors(&prediction));
    }
    if let Some(parameters) = tables::<Parameters>(manifest, store)?.last() {
        out.push_str(&observable(parameters));
    }
    let warnings = manifest
        .stages
        .iter()
        .flat_map(|stage| stage.warnings.iter().map(|line| (stage.id.as_str(), line)));
    let mut lines = Vec::new();
    for (id, line) in warnings {
        if !lines.contains(&line) {
            out.push_str(&labelled("warning", &format!("{id}: {line}")));
            lines.push(line);
        }
    }
    Ok(out)
}

fn distinct(recording: &Recording) -> usize {
    recording
        .point_id
        .iter()
        .collect::<std::collections::BTreeSet<_>>()
        .len()
}

/// Smallest and largest position of each joint, in the robot file's counting, and joints beyond its limits.
fn ranges(recording: &Recording, robot: &Robot) -> Result<String> {
    let robot = robot.to_description()?;
    let mut out = String::new();
    for (k, joint) in robot.joints.iter().enumerate() {
        let values = (0..recording.rows()).map(|row| recording.q(row)[k]);
        let (lower, upper) = values.fold((f64::MAX, f64::MIN), |(a, b), q| (a.min(q), b.max(q)));
        let prismatic = recording.prismatic.get(k).copied().unwrap_or(false);
        let shown = |value: f64| {
            if prismatic {
                format!("{:.1} mm", 1e3 * value)
            } else {
                format!("{:.1} deg", value.to_degrees())
            }
        };
        let limits = joint
            .limits
            .filter(|[a, b]| lower < a - 1e-6 || upper > b + 1e-6);
        let beyond = limits.map(|[a, b]| {
            format!(
                "; beyond the robot file's limits, {} to {}",
                shown(a),
                shown(b)
            )
        });
        let still = if upper - lower < 1e-6 {
            "; it does not move, so that nothing of it can be seen"
        } else {
            ""
        };
        let text = format!(
            "{} {} to {}{}{still}",
            joint.name,
            shown(lower),
            shown(upper),
            beyond.unwrap_or_default()
        );
        out.push_str(&labelled(if k == 0 { "ranges" } else { "" }, &text));
    }
    Ok(out)
}

/// Reasons with how many rows each, and some of the rows.
fn not_used(rejected: &Rejected) -> String {
    let mut reasons: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, row) in rejected.0.iter().enumerate() {
        reasons.entry(&row.reason).or_default().push(k);
    }
    let one = |(reason, rows): (&str, Vec<usize>)| {
        let name = |k: &usize| {
            let row = &rejected.0[*k];
            row.point_id
                .clone()
                .unwrap_or_else(|| format!("line {}", row.line))
                + &format!(" ({}: {})", row.file, row.detail)
        };
        let shown: Vec<String> = rows.iter().take(SHOWN).map(name).collect();
        let more = if rows.len() > SHOWN {
            format!("; and {} more", rows.len() - SHOWN)
        } else {
            String::new()
        };
        labelled(
            "rejected",
            &format!(
                "{}, {}: {}{more}",
                counted(rows.len(), "row"),
                reason.replace('_', " "),
                shown.join("; ")
            ),
        )
    };
    reasons.into_iter().map(one).collect()
}

/// Mean and largest error of each step.
fn errors(prediction: &Prediction) -> String {
    let mut steps: Vec<(&str, Vec<f64>)> = Vec::new();
    for row in &prediction.0 {
        match steps.iter_mut().find(|(step, _)| *step == row.step) {
            Some((_, errors)) => errors.push(row.error_mm),
            None => steps.push((&row.step, vec![row.error_mm])),
        }
    }
    let one = |(step, errors): (&str, Vec<f64>)| {
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let most = errors.iter().copied().fold(0.0, f64::max);
        labelled(
            "error",
            &format!(
                "mean {mean:.3} mm, max {most:.3} mm after `{step}`, {}",
                counted(errors.len(), "point")
            ),
        )
    };
    steps.into_iter().map(one).collect()
}

/// How many parameters are estimated, and the others by their reason.
fn observable(parameters: &Parameters) -> String {
    let of = |status: &str| {
        parameters
            .0
            .iter()
            .filter(|row| row.status == status)
            .map(|row| row.name.as_str())
            .collect::<Vec<_>>()
    };
    let named = |names: &[&str]| {
        let more = if names.len() > NAMED {
            format!(" and {} more", names.len() - NAMED)
        } else {
            String::new()
        };
        format!("{}{more}", names[..names.len().min(NAMED)].join(", "))
    };
    let mut out = labelled(
        "seen",
        &format!(
            "{} can be estimated",
            counted(of("free").len() + of("bound").len(), "parameter")
        ),
    );
    for (status, why) in [
        ("unseen", "these data do not see"),
        ("redundant", "other parameters do the same as"),
    ] {
        let names = of(status);
        if !names.is_empty() {
            out.push_str(&labelled("", &format!("{why}: {}", named(&names))));
        }
    }
    out
}
