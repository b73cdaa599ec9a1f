//! `calib poses --run`: poses that tell a finding of a diagnosis from a rival, at the sizes that the run found.

use super::site::site;
use super::{Drive, PoseAnswer, PoseRequest, closing, drive, wish};
use crate::audit::{POSITIONS, diagnosis};
use crate::diagnose::{DiagnosedModel, discrimination_problem, other_means};
use crate::effect::{CAUSES, Form, Load, Place, cause};
use crate::error::{Error, Result, counted, nearest};
use crate::estimate::choose::{
    Aim, Circumstances, Discrimination, MIN_SEPARATION_L, Site, median, tell,
};
use crate::identified::convention_of;
use crate::pipeline::StageReport;
use crate::robot::{JointConvention, Measurements, RobotModel};
use crate::store::{Store, TableRef};
use crate::table::{
    FindingRow, Findings, Parameters, Prediction, Recording, RivalRow, Rivals, Robot, Table,
};
use crate::text::filled;
use minijinja::context;
use minijinja::value::Serde;
use nalgebra::Vector3;
use serde_json::json;

/// Payloads of the recording that are asked for at most.
const PAYLOADS: usize = 4;

/// An effect at a place.
type EffectAtPlace = (String, Place);

/// A run by its name, and which of its diagnoses.
pub struct RunStage<'a> {
    /// As `calib log` names it.
    pub(crate) run: &'a str,
    /// The stage, where there are several diagnoses.
    pub(crate) step: Option<&'a str>,
}

/// Proposes poses that tell a finding from a rival; `names` say which, or nothing for the first that has one.
pub fn apart(
    request: &PoseRequest,
    store: &Store,
    run_stage: &RunStage,
    names: &[String],
) -> Result<PoseAnswer> {
    let (manifest, stage) = diagnosis(store, run_stage.run, run_stage.step, &POSITIONS)?;
    let place = format!("run {}", manifest.run_id);
    let findings: Findings = written(store, &stage)?;
    let rivals: Rivals = written(store, &stage)?;
    let (finding, rival) = pair(&place, &findings, &rivals, names)?;
    let forms: Vec<Form> = serde_json::from_str(&finding.forms)
        .map_err(|error| Error::store(&place, format!("its findings: {error}")))?;
    if forms.is_empty() {
        let message = format!(
            "finding {}, {}, is a fault of the recording: correct it there, no pose helps",
            finding.rank, finding.effect
        );
        return Err(Error::spec(place, message));
    }
    let robot = read::<Robot>(store, &stage)?.to_description()?;
    let convention = convention_of(&manifest, store)?
        .unwrap_or_else(|| JointConvention::of_the_robot_file(robot.joints.len()));
    let parameters: Parameters = written(store, &stage)?;
    let model = parameters.model(RobotModel::new(robot.clone()), &[], Load::GravityTorque)?;
    let recording: Recording = read(store, &stage)?;
    let mut data = recording.measurements();
    let predicted = model.predict(&data);
    let rows = as_fitted(&mut data, &written(store, &stage)?, &predicted);
    let estimated = |k: &usize| {
        let name = &model.stack.specs()[*k].name;
        let mut rows = parameters.0.iter();
        rows.any(|row| row.name == *name && row.status == "free")
    };
    let free: Vec<usize> = (0..model.x.len()).filter(estimated).collect();
    let diagnosed = DiagnosedModel {
        model: &model,
        data: &data,
        rows: &rows,
        free: &free,
    };
    let recorded = ranges(&data, &rows);
    let mut site = site(request, &robot, &place, Some(&recorded))?;
    if request.payloads.is_empty() {
        site.payloads = payloads(&data, &rows);
    }
    let usual = median(rows.iter().map(|row| data.points.sigma[*row].x).collect());
    let sigma = request.sigma.map_or(usual, |sigma| sigma * 1e-3);
    let circumstances = circumstances(&data, &rows);
    let is_rival = |row: &RivalRow| {
        row.rank == finding.rank && row.effect == rival.0 && is_at(&row.place, rival.1)
    };
    let listed = rivals.0.iter().any(is_rival);
    let mut effects = model.stack.effects();
    if cause(&rival.0).is_none() && !effects.any(|(effect, _)| effect.name() == rival.0) {
        let message = format!(
            "`{}` is a declared effect; a run keeps only those that it found, and it did not find this one",
            rival.0
        );
        return Err(Error::spec("--separate", message));
    }
    let mut tried = None;
    let discrimination = match discrimination_problem(&diagnosed, &forms, (&rival.0, rival.1)) {
        Ok((problem, form)) => {
            // A free curve is known where points were fitted, and nowhere else.
            let is_free = |form: &Form| form.cause().is_nameless();
            if is_free(&form) || forms.iter().any(is_free) {
                within(&mut site, &recorded);
            }
            tried = Some(form);
            let wish = wish(request, Aim::Information, sigma);
            tell(&problem, (&data, &rows), (&site, &circumstances), &wish)
                .map_err(|fault| Error::spec(&place, fault))?
        }
        // An identity of kinematics or statics: there is nothing of the rival's own to be tried.
        Err(_) if listed => Discrimination {
            before: [0.0; 2],
            alike: [true; 2],
            proposed: None,
        },
        Err(fault) => return Err(Error::spec("--separate", fault)),
    };
    let names = [
        format!("{} at {}", finding.effect, finding.place),
        format!("{} at {}", rival.0, rival.1),
    ];
    let proposed = discrimination.proposed.as_ref();
    let drive = proposed.map(|proposed| Drive {
        robot: robot.clone(),
        ranges: site.ranges.clone(),
        poses: proposed.poses.clone(),
        direction: proposed.direction.clone(),
        convention: convention.clone(),
    });
    let before = discrimination.before;
    let separation = [0, 1].map(|k: usize| {
        json!({
            "if": names[k], "fitted": names[1 - k], "recorded": before[k], "imitated": discrimination.alike[k],
            "random": proposed.map(|proposed| proposed.random[k]),
            "proposed": proposed.map(|proposed| proposed.after[k]),
        })
    });
    let other = other_means(&finding.effect, &rival.0);
    let document = json!({
        "robot": robot.name,
        "run": manifest.run_id,
        "seed": request.seed,
        "finding": { "rank": finding.rank, "effect": finding.effect, "where": finding.place },
        "rival": { "effect": rival.0, "where": rival.1.to_string(), "form": tried },
        "sigma_mm": sigma * 1e3,
        "temperature_c": circumstances.temperature,
        "points": rows.len(),
        "told_from": MIN_SEPARATION_L,
        "separation": separation,
        "conclusion": conclusion(&names, other, &discrimination),
        "approach_visible_share": proposed.map(|proposed| proposed.approach_seen),
        "self_collision_checked": false,
        "counting": drive::counting(&convention, &robot),
        "out": request.out.as_ref().map(|out| out.to_string_lossy()),
        "poses": drive.as_ref().map_or_else(Vec::new, drive::objects),
    });
    let mut lines = vec![(
        format!("the recording, {}", counted(rows.len(), "point")),
        before,
    )];
    if let Some(proposed) = proposed {
        let count = proposed.poses.rows();
        lines.extend([
            (
                format!("and {count} random poses, median of 200"),
                proposed.random,
            ),
            (format!("and the {count} proposed"), proposed.after),
        ]);
    }
    let about = context! {
        of => Serde(&document), statement => &finding.statement, rival => &names[1],
        least => MIN_SEPARATION_L.to_string(), width => lines.iter().map(|(name, _)| name.len()).max(),
        rows => Serde(lines), heads => names.map(|name| format!("if {name}")),
        counts_otherwise => !convention.is_of_the_robot_file(), closing => closing(request),
    };
    Ok(PoseAnswer {
        text: filled(include_str!("apart.txt"), about),
        document,
        drive,
        warnings: Vec::new(),
    })
}

fn written<T: Table>(store: &Store, stage: &StageReport) -> Result<T> {
    let mut outputs = stage.outputs.iter();
    let output = outputs.find(|output| output.kind == T::KIND);
    table(store, output.map(|output| &output.table))
}

fn read<T: Table>(store: &Store, stage: &StageReport) -> Result<T> {
    let input = stage.inputs.iter().find(|input| input.port == T::KIND);
    table(store, input.map(|input| &input.table))
}

fn table<T: Table>(store: &Store, table: Option<&TableRef>) -> Result<T> {
    let none = || Error::Bug(format!("a diagnosis without a table `{}`", T::KIND));
    T::from_frame(&store.load(table.ok_or_else(none)?)?)
}

/// `joint_compliance@joint 2`, `joint_compliance at joint 2` or `joint_compliance` -> effect and place; effects of the library, and those
/// that the diagnosis found.
fn name<'t>(text: &'t str, found: &[&str]) -> Result<(&'t str, Option<Place>)> {
    let (effect, place) = match text.split_once('@').or_else(|| text.split_once(" at ")) {
        Some((effect, place)) => (effect.trim(), Some(place.trim())),
        None => (text.trim(), None),
    };
    let listed = CAUSES.iter().map(|cause| cause.name());
    let known: Vec<&str> = listed.chain(found.iter().copied()).collect();
    let named = |place: &str| {
        let allowed = "allowed are e.g. `joint 2`, `joint 4->5`, `link 3`, `link 2-4`, `base`, `tool`, `tracker`, `recording`";
        let message = || format!("`{place}` is no place; {allowed}");
        place
            .parse()
            .map_err(|()| Error::spec("--separate", message()))
    };
    if known.contains(&effect) {
        return Ok((effect, place.map(named).transpose()?));
    }
    let near = nearest(effect, known);
    let near = near
        .map(|near| format!("did you mean `{near}`? "))
        .unwrap_or_default();
    let message = format!("unknown effect `{effect}`; {near}`calib effects` lists them");
    Err(Error::spec("--separate", message))
}

/// The finding that is meant, and what to tell it from.
fn pair(
    place: &str,
    findings: &Findings,
    rivals: &Rivals,
    names: &[String],
) -> Result<(FindingRow, EffectAtPlace)> {
    let wrong = |message: String| Error::spec("--separate", message);
    let all = || findings.0.iter();
    let listed = all().map(|row| format!("{} ({}@{})", row.rank, row.effect, row.place));
    let list: Vec<String> = listed.collect();
    if list.is_empty() {
        let message = "has no finding that could be separated from another cause";
        return Err(Error::spec(place, message));
    }
    let list = list.join(", ");
    // The first by name of equally close rivals, as the table is sorted.
    let closest = |row: &FindingRow| {
        let of_finding = rivals.0.iter().filter(|rival| rival.rank == row.rank);
        let rival = of_finding.min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic))?;
        Some((rival.effect.clone(), rival.place.parse().ok()?))
    };
    let Some(first) = names.first() else {
        let found = all().find_map(|row| Some((row.clone(), closest(row)?)));
        let message = format!(
            "no finding has a rival; name a finding and the cause to separate it from: --separate {list}"
        );
        return found.ok_or_else(|| Error::spec(place, message));
    };
    let rank = first.trim().parse::<i64>();
    let effects = all().map(|row| row.effect.as_str());
    let named: Vec<&str> = effects
        .chain(rivals.0.iter().map(|row| row.effect.as_str()))
        .collect();
    let fits = |row: &&FindingRow| match (&rank, name(first, &named)) {
        (Ok(rank), _) => row.rank == *rank,
        (_, Ok((effect, place))) => {
            row.effect == effect && place.is_none_or(|place| is_at(&row.place, place))
        }
        _ => false,
    };
    let fitting: Vec<&FindingRow> = all().filter(fits).collect();
    let [found] = fitting[..] else {
        if rank.is_err() {
            name(first, &named)?;
        }
        let many = if fitting.is_empty() {
            "no finding"
        } else {
            "several findings"
        };
        let message = format!("`{first}` matches {many} of {place}; its findings: {list}");
        return Err(wrong(message));
    };
    let (effect, at) = (&found.effect, &found.place);
    let Some(second) = names.get(1) else {
        let none = || {
            wrong(format!(
                "{effect} at {at} has no rival: this recording separates it from all others; name one as a second, e.g. 'link_compliance@link 2'"
            ))
        };
        return Ok((found.clone(), closest(found).ok_or_else(none)?));
    };
    match name(second, &named)? {
        (rival, None) => Err(wrong(format!("`{second}`: say where, e.g. '{rival}@{at}'"))),
        (rival, Some(place)) if rival == effect && is_at(at, place) => {
            Err(wrong(format!("`{second}` is the finding itself")))
        }
        (rival, Some(place)) => Ok((found.clone(), (rival.into(), place))),
    }
}

/// Whether a table means this place.
fn is_at(text: &str, place: Place) -> bool {
    text.parse() == Ok(place)
}

/// Puts noise and residuals as they were fitted into the recording; returns the fitted rows.
fn as_fitted(
    data: &mut Measurements,
    prediction: &Prediction,
    predicted: &[Vector3<f64>],
) -> Vec<usize> {
    let mut rows = Vec::new();
    for (row, seen) in prediction.0.iter().enumerate().take(data.rows()) {
        let sigma = seen.noise_mm * 1e-3 / 3f64.sqrt();
        if seen.measured.is_some() || !(sigma.is_finite() && sigma > 0.0) {
            continue;
        }
        data.points.set(
            row,
            predicted[row] + Vector3::new(seen.dx_mm, seen.dy_mm, seen.dz_mm) * 1e-3,
            sigma,
        );
        if !seen.held_out && !seen.suspect {
            rows.push(row);
        }
    }
    rows
}

/// Range of every joint over some rows, rad or m.
fn ranges(data: &Measurements, rows: &[usize]) -> Vec<[f64; 2]> {
    let of_joint = |joint: usize| {
        let all = rows.iter().map(|row| data.q(*row)[joint]);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
            [low.min(q), high.max(q)]
        })
    };
    (0..data.joints).map(of_joint).collect()
}

fn within(site: &mut Site, recorded: &[[f64; 2]]) {
    for (range, [low, high]) in site.ranges.iter_mut().zip(recorded) {
        *range = [range[0].max(*low).min(*high), range[1].min(*high).max(*low)];
    }
}

/// The payloads of the recording, or some of them, evenly taken.
fn payloads(data: &Measurements, rows: &[usize]) -> Vec<f64> {
    let mut all: Vec<f64> = rows.iter().map(|row| data.payload[*row]).collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    let last = all.len().saturating_sub(1);
    match all.len() {
        0..=PAYLOADS => all,
        _ => {
            let some = (0..PAYLOADS).map(|k| all[k * last / (PAYLOADS - 1)]);
            some.collect()
        }
    }
}

/// After the recording, the arm as far from its first temperature as it came.
fn circumstances(data: &Measurements, rows: &[usize]) -> Circumstances {
    let last = rows.iter().map(|row| data.time(*row)).fold(0.0, f64::max);
    let temperatures = || rows.iter().filter_map(|row| data.temperature(*row));
    let first = temperatures().next();
    let away = |t: &f64| first.map_or(0.0, |first| (t - first).abs());
    Circumstances {
        time: Some(last + 1.0),
        temperature: temperatures().max_by(|a, b| away(a).total_cmp(&away(b))),
        target: rows
            .first()
            .filter(|_| data.target.is_some())
            .map(|row| data.target(*row).to_string()),
    }
}

/// Nobody measures more poses than these.
const LIMIT: f64 = 10_000.0;

/// What becomes of a finding and its rival, a sentence a line; `other`: what else tells them apart.
fn conclusion(
    [finding, rival]: &[String; 2],
    other: Option<&str>,
    discrimination: &Discrimination,
) -> Vec<String> {
    let alike = discrimination.alike;
    let Some(proposed) = &discrimination.proposed else {
        let means = other.unwrap_or("measure something else: another payload, another temperature, a second target off the first");
        return vec![
            format!(
                "no pose separates {finding} from {rival}: they move the point identically at every pose"
            ),
            format!("instead: {means}"),
        ];
    };
    let mut out = Vec::new();
    for (k, (true_one, fitted)) in [(finding, rival), (rival, finding)].into_iter().enumerate() {
        if alike[k] {
            out.push(format!("{fitted} can imitate {true_one} completely: only if {fitted} is true are they separable"));
        }
    }
    // What can show at all must.
    let least = |l: &[f64; 2]| {
        let shown = (0..2).filter(|k| !alike[*k]).map(|k| l[k]);
        shown.fold(f64::INFINITY, f64::min)
    };
    let (was, will, count) = (
        least(&discrimination.before),
        least(&proposed.after),
        proposed.poses.rows(),
    );
    let measured = format!("measured at {}, they are", counted(count, "pose"));
    if will >= MIN_SEPARATION_L {
        let already = if was >= MIN_SEPARATION_L {
            "; the recording alone should do"
        } else {
            ""
        };
        out.push(format!("{measured} separable{already}"));
        return out;
    }
    let needed = ((MIN_SEPARATION_L - was) / (will - was) * count as f64).ceil();
    let more = if needed < LIMIT {
        format!("some {needed:.0} such poses would")
    } else {
        "no number of poses would".into()
    };
    let size = if alike.contains(&true) {
        ", if the effect is as large as this recording estimates"
    } else {
        ""
    };
    out.push(format!("{measured} not separable: {more}{size}"));
    out.extend(other.map(|means| format!("instead: {means}")));
    out
}
