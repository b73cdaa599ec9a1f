//! `calib poses --run`: poses that tell a finding of a diagnosis from a rival, at the sizes that the run found.
//!
//! What the poses promise of a finding against its rival, as text and as JSON.

use crate::audit::{POSITIONS, diagnosis};
use crate::description::RobotDescription;
use crate::diagnose::{DiagnosedModel, discrimination_problem, other_means};
use crate::effect::{CAUSES, Form, Load, Place, cause};
use crate::error::{Error, Result, counted, nearest};
use crate::estimate::choose::{
    Aim, Circumstances, Discrimination, MIN_SEPARATION_L, Site, median, tell,
};
use crate::identified::convention_of;
use crate::pipeline::StageReport;
use crate::poses::proposal::closing;
use crate::poses::site::site;
use crate::poses::{Drive, PoseAnswer, PoseRequest, drive, wish};
use crate::robot::{JointConvention, Measurements, RobotModel};
use crate::store::{Store, TableRef};
use crate::table::{FindingRow, Findings, Parameters, Prediction, Recording, Rivals, Robot, Table};
use crate::text::filled;
use minijinja::context;
use minijinja::value::Serde;
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Payloads of the recording that are asked for at most.
const PAYLOADS: usize = 4;

/// An effect at a place.
type EffectAtPlace = (String, Place);

/// A finding and a rival, and what tells them apart.
pub struct Apart<'a> {
    request: &'a PoseRequest,
    run: String,
    finding: FindingRow,
    rival: EffectAtPlace,
    /// None where the two are one by an identity.
    form: Option<Form>,
    robot: RobotDescription,
    ranges: Vec<[f64; 2]>,
    convention: JointConvention,
    rows: usize,
    /// mm.
    sigma: f64,
    circumstances: Circumstances,
    discrimination: Discrimination,
}

/// A run by its name, and which of its diagnoses.
pub struct RunStage<'a> {
    /// As `calib log` names it.
    pub(crate) run: &'a str,
    /// The stage, where there are several diagnoses.
    pub(crate) step: Option<&'a str>,
}

/// Proposes poses that tell a finding from a rival; `names` say which, or nothing for the first that has one.
pub fn apart<'a>(
    request: &'a PoseRequest,
    store: &Store,
    run_stage: &RunStage,
    names: &[String],
) -> Result<Apart<'a>> {
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
    let estimated = |name: &String| {
        parameters
            .0
            .iter()
            .any(|row| row.name == *name && row.status == "free")
    };
    let free: Vec<usize> = (0..model.x.len())
        .filter(|k| estimated(&model.stack.specs()[*k].name))
        .collect();
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
    let listed = rivals
        .0
        .iter()
        .any(|row| row.rank == finding.rank && row.effect == rival.0 && is_at(&row.place, rival.1));
    if cause(&rival.0).is_none()
        && !model
            .stack
            .effects()
            .any(|(effect, _)| effect.name() == rival.0)
    {
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
            if forms
                .iter()
                .chain([&form])
                .any(|form| form.cause().is_nameless())
            {
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
    Ok(Apart {
        request,
        run: manifest.run_id,
        finding,
        rival,
        form: tried,
        robot,
        ranges: site.ranges,
        convention,
        rows: rows.len(),
        sigma: sigma * 1e3,
        circumstances,
        discrimination,
    })
}

fn written<T: Table>(store: &Store, stage: &StageReport) -> Result<T> {
    let reference = stage
        .outputs
        .iter()
        .find(|output| output.kind == T::KIND)
        .map(|output| &output.table);
    table(store, reference)
}

fn read<T: Table>(store: &Store, stage: &StageReport) -> Result<T> {
    table(
        store,
        stage
            .inputs
            .iter()
            .find(|input| input.port == T::KIND)
            .map(|input| &input.table),
    )
}

fn table<T: Table>(store: &Store, table: Option<&TableRef>) -> Result<T> {
    let table =
        table.ok_or_else(|| Error::Bug(format!("a diagnosis without a table `{}`", T::KIND)))?;
    T::from_frame(&store.load(table)?)
}

/// `joint_compliance@joint 2`, `joint_compliance at joint 2` or `joint_compliance` -> effect and place; effects of the library, and those
/// that the diagnosis found.
fn name<'t>(text: &'t str, found: &[&str]) -> Result<(&'t str, Option<Place>)> {
    let (effect, place) = match text.split_once('@').or_else(|| text.split_once(" at ")) {
        Some((effect, place)) => (effect.trim(), Some(place.trim())),
        None => (text.trim(), None),
    };
    let known = || {
        CAUSES
            .iter()
            .map(|cause| cause.name())
            .chain(found.iter().copied())
    };
    let named = |place: &str| {
        let allowed = "allowed are e.g. `joint 2`, `joint 4->5`, `link 3`, `link 2-4`, `base`, `tool`, `tracker`, `recording`";
        place
            .parse()
            .map_err(|()| Error::spec("--separate", format!("`{place}` is no place; {allowed}")))
    };
    if known().any(|name| name == effect) {
        return Ok((effect, place.map(named).transpose()?));
    }
    let near = nearest(effect, known())
        .map(|near| format!("did you mean `{near}`? "))
        .unwrap_or_default();
    Err(Error::spec(
        "--separate",
        format!("unknown effect `{effect}`; {near}`calib effects` lists them"),
    ))
}

/// The finding that is meant, and what to tell it from.
fn pair(
    place: &str,
    findings: &Findings,
    rivals: &Rivals,
    names: &[String],
) -> Result<(FindingRow, EffectAtPlace)> {
    let list: Vec<String> = findings
        .0
        .iter()
        .map(|row| format!("{} ({}@{})", row.rank, row.effect, row.place))
        .collect();
    if list.is_empty() {
        return Err(Error::spec(
            place,
            "has no finding that could be separated from another cause",
        ));
    }
    // The first by name of equally close rivals, as the table is sorted.
    let closest = |row: &FindingRow| {
        let of_finding = rivals.0.iter().filter(|rival| rival.rank == row.rank);
        of_finding
            .min_by(|a, b| a.delta_bic.total_cmp(&b.delta_bic))
            .and_then(|rival| Some((rival.effect.clone(), rival.place.parse().ok()?)))
    };
    let name_one = |found: &FindingRow| {
        let message = format!(
            "{} at {} has no rival: this recording separates it from all others; name one as a second, e.g. 'link_compliance@link 2'",
            found.effect, found.place
        );
        Error::spec("--separate", message)
    };
    let Some(first) = names.first() else {
        let found = findings
            .0
            .iter()
            .find_map(|row| Some((row.clone(), closest(row)?)));
        let message = format!(
            "no finding has a rival; name a finding and the cause to separate it from: --separate {list:?}"
        );
        return found.ok_or_else(|| Error::spec(place, message.replace(['[', ']', '"'], "")));
    };
    let named: Vec<&str> = findings
        .0
        .iter()
        .map(|row| row.effect.as_str())
        .chain(rivals.0.iter().map(|row| row.effect.as_str()))
        .collect();
    let fits = |row: &&FindingRow| match (first.trim().parse::<i64>(), name(first, &named)) {
        (Ok(rank), _) => row.rank == rank,
        (_, Ok((effect, place))) => {
            row.effect == effect && place.is_none_or(|place| is_at(&row.place, place))
        }
        _ => false,
    };
    let fitting: Vec<&FindingRow> = findings.0.iter().filter(fits).collect();
    let [found] = fitting[..] else {
        if first.trim().parse::<i64>().is_err() {
            name(first, &named)?;
        }
        let many = if fitting.is_empty() {
            "no finding"
        } else {
            "several findings"
        };
        return Err(Error::spec(
            "--separate",
            format!(
                "`{first}` matches {many} of {place}; its findings: {}",
                list.join(", ")
            ),
        ));
    };
    let Some(second) = names.get(1) else {
        let rival = closest(found).ok_or_else(|| name_one(found))?;
        return Ok((found.clone(), rival));
    };
    let (effect, at) = name(second, &named)?;
    let Some(at) = at else {
        return Err(Error::spec(
            "--separate",
            format!("`{second}`: say where, e.g. '{effect}@{}'", found.place),
        ));
    };
    if effect == found.effect && is_at(&found.place, at) {
        return Err(Error::spec(
            "--separate",
            format!("`{second}` is the finding itself"),
        ));
    }
    Ok((found.clone(), (effect.into(), at)))
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
        _ => (0..PAYLOADS)
            .map(|k| all[k * last / (PAYLOADS - 1)])
            .collect(),
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
        target: data
            .target
            .as_ref()
            .and_then(|_| rows.first().map(|row| data.target(*row).to_string())),
    }
}

/// Nobody measures more poses than these.
const LIMIT: f64 = 10_000.0;

impl Apart<'_> {
    /// Finding and rival in words.
    fn names(&self) -> [String; 2] {
        [
            format!("{} at {}", self.finding.effect, self.finding.place),
            format!("{} at {}", self.rival.0, self.rival.1),
        ]
    }

    /// What becomes of it, a sentence a line.
    fn conclusion(&self) -> Vec<String> {
        let [finding, rival] = self.names();
        let other = other_means(&self.finding.effect, &self.rival.0);
        let Discrimination {
            before,
            alike,
            proposed,
        } = &self.discrimination;
        let Some(proposed) = proposed else {
            let means =
                other.unwrap_or("measure something else: another payload, another temperature, a second target off the first");
            return vec![
                format!(
                    "no pose separates {finding} from {rival}: they move the point identically at every pose"
                ),
                format!("instead: {means}"),
            ];
        };
        let mut out = Vec::new();
        for (k, (true_one, fitted)) in [(&finding, &rival), (&rival, &finding)]
            .into_iter()
            .enumerate()
        {
            if alike[k] {
                out.push(format!("{fitted} can imitate {true_one} completely: only if {fitted} is true are they separable"));
            }
        }
        // What can show at all must.
        let least = |l: &[f64; 2]| {
            (0..2)
                .filter(|k| !alike[*k])
                .map(|k| l[k])
                .fold(f64::INFINITY, f64::min)
        };
        let (was, will, count) = (least(before), least(&proposed.after), proposed.poses.rows());
        if will >= MIN_SEPARATION_L {
            let already = if was >= MIN_SEPARATION_L {
                "; the recording alone should do"
            } else {
                ""
            };
            out.push(format!(
                "measured at {}, they are separable{already}",
                counted(count, "pose")
            ));
        } else {
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
            out.push(format!(
                "measured at {}, they are not separable: {more}{size}",
                counted(count, "pose")
            ));
            out.extend(other.map(|means| format!("instead: {means}")));
        }
        out
    }
}

impl PoseAnswer for Apart<'_> {
    fn drive(&self) -> Option<Drive<'_>> {
        let proposed = self.discrimination.proposed.as_ref()?;
        let Self {
            robot,
            ranges,
            convention,
            ..
        } = self;
        Some(Drive {
            robot,
            ranges,
            poses: &proposed.poses,
            direction: &proposed.direction,
            convention,
        })
    }

    fn text(&self) -> String {
        let count = self
            .discrimination
            .proposed
            .as_ref()
            .map_or(0, |proposed| proposed.poses.rows());
        let mut rows = vec![(
            format!("the recording, {}", counted(self.rows, "point")),
            self.discrimination.before,
        )];
        if let Some(proposed) = &self.discrimination.proposed {
            rows.push((
                format!("and {count} random poses, median of 200"),
                proposed.random,
            ));
            rows.push((format!("and the {count} proposed"), proposed.after));
        }
        let names = self.names();
        let about = context! {
            of => Serde(self.document()), statement => &self.finding.statement, rival => &names[1],
            least => MIN_SEPARATION_L.to_string(), width => rows.iter().map(|(name, _)| name.len()).max(),
            rows => Serde(rows), heads => names.map(|name| format!("if {name}")),
            counts_otherwise => !self.convention.is_of_the_robot_file(), closing => closing(self.request),
        };
        filled(include_str!("apart.txt"), about)
    }

    fn document(&self) -> Value {
        let names = self.names();
        let Discrimination {
            before,
            alike,
            proposed,
        } = &self.discrimination;
        let separation = [0, 1].map(|k: usize| {
            json!({
                "if": names[k], "fitted": names[1 - k], "recorded": before[k], "imitated": alike[k],
                "random": proposed.as_ref().map(|proposed| proposed.random[k]),
                "proposed": proposed.as_ref().map(|proposed| proposed.after[k]),
            })
        });
        json!({
            "robot": self.robot.name,
            "run": self.run,
            "seed": self.request.seed,
            "finding": { "rank": self.finding.rank, "effect": self.finding.effect, "where": self.finding.place },
            "rival": { "effect": self.rival.0, "where": self.rival.1.to_string(), "form": self.form },
            "sigma_mm": self.sigma,
            "temperature_c": self.circumstances.temperature,
            "points": self.rows,
            "told_from": MIN_SEPARATION_L,
            "separation": separation,
            "conclusion": self.conclusion(),
            "approach_visible_share": proposed.as_ref().map(|proposed| proposed.approach_seen),
            "self_collision_checked": false,
            "counting": drive::counting(&self.convention, &self.robot),
            "out": self.request.out.as_ref().map(|out| out.to_string_lossy()),
            "poses": self.drive().map_or_else(Vec::new, |poses| drive::objects(&poses)),
        })
    }
}
