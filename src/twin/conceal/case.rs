//! One concealed recording: a drawn robot, its errors, its effects sized to be as visible as drawn, and what was measured.

use super::design::{Content, Design};
use super::family::{Bench, Cause, Column, Draft, FAMILIES, Form};
use super::points::{self, Amount, FIT};
use super::robots::Kind;
use super::visible::{Shadow, Site, norm};
use crate::robot::description::{JointKind, RobotDescription};
use crate::twin::effect::{HoldingFriction, Physical};
use crate::twin::noise::{Noise, Purpose};
use crate::twin::plan::{Climate, Poses};
use crate::twin::recorder::{Experiment, Motors, Shot};
use crate::twin::tracker::{Scatter, Tracker};
use crate::twin::truth::{ARCSEC, CouplingError, LinkError, TrueRobot};
use std::collections::BTreeSet;

/// A cause with how visible it is at the points to fit.
#[derive(Debug, Clone)]
pub struct Concealed {
    pub cause: Cause,
    pub form: &'static str,
    /// Root mean square of its displacement per axis, mm: all of it, and what geometry and the other causes leave.
    pub raw_mm: f64,
    pub visible_mm: f64,
    /// Squared visible displacement over the noise's variance, `3 N SNR^2`: beside the other causes, and with geometry alone.
    pub strength: f64,
    pub strength_alone: f64,
}

/// A recording that was tampered with.
#[derive(Debug, Clone, PartialEq)]
pub struct Tampering {
    pub effect: &'static str,
    /// Rows, from 0.
    pub rows: Vec<usize>,
}

/// A finished case.
#[derive(Debug, Clone)]
pub struct Case {
    pub name: String,
    pub content: Content,
    pub seed: u64,
    pub kind: Kind,
    pub robot: RobotDescription,
    /// Whether the robot file keeps the masses of the links to itself.
    pub bare: bool,
    pub truth: TrueRobot,
    pub tracker: Tracker,
    /// Joint repeatability, rad.
    pub play_rad: f64,
    pub climate: Climate,
    pub concealed: Vec<Concealed>,
    pub accepted: Vec<(&'static str, String)>,
    pub hidden: BTreeSet<Column>,
    pub tampered: Vec<Tampering>,
    pub shots: Vec<Shot>,
    /// Declared payload of every shot, kg, and what the arm's thermometer says, C.
    pub payload_kg: Vec<f64>,
    pub thermometer_c: Vec<f64>,
    pub fit: usize,
    /// Root mean square of a coordinate's noise at the points to fit and at those held out, mm.
    pub noise_mm: [f64; 2],
    /// Numbers that geometry, ratios, couplings and the tracker's pose amount to.
    pub geometry_rank: usize,
}

/// Standard deviation of the thermometer, K.
const THERMOMETER_K: f64 = 0.15;

impl Case {
    /// The case of this number; fails with what is wrong where no pose is allowed.
    pub fn make(design: &Design, number: usize, content: Content) -> Result<Case, String> {
        let seed = design.seed_of(number);
        let mut draw = Noise::new(seed, Purpose::Design);
        let kinds = design.kinds();
        let kind = kinds[draw.index(kinds.len())];
        // The reflector off the last axis in half of the cases: else that joint's own turn cannot be seen.
        let aside = if draw.chance(0.5) { draw.vector(30.0, 80.0).map(f64::round) } else { [0.0; 3] };
        let robot = kind.description(aside);
        let truth = errors(&robot, &mut draw);
        let tracker = tracker(kind, content == Content::Null, &mut draw);
        let tracker = Tracker { scatter: design.scatter.unwrap_or(tracker.scatter), ..tracker };
        let (play_rad, repeated) = if draw.chance(0.5) { (1e-6 * draw.uniform(4.0, 16.0), 0.1) } else { (0.0, 0.0) };
        let fit = design.points.unwrap_or_else(|| draw.size(50.0, 400.0).round() as usize);
        let validate = (draw.uniform(0.25, 0.5) * fit as f64).round().max(1.0) as usize;
        let climate = Climate {
            pace_s: [12.0, 26.0],
            start_c: 20.0,
            rise_k: 15.0,
            // Two time constants in a recording, more or less.
            warm_up_h: (fit + validate) as f64 * 19.0 / draw.uniform(1.5, 3.5) / 3600.0,
        };
        let ranges: Vec<[f64; 2]> =
            robot.joints.iter().map(|joint| narrowed(joint.limits.unwrap_or_default(), &mut draw)).collect();
        let points = points::plan(kind, &ranges, Amount { fit, validate, repeated, loaded: !design.bare }, &climate, seed)?;
        let to_fit = &points[..fit.min(points.len())];
        let site = Site { robot: &robot, truth: &truth, tracker: &tracker, points: to_fit };
        let held_out = Site { points: &points[fit.min(points.len())..], ..site };
        let noise_mm = [&site, &held_out].map(|site| 1e3 * site.noise(play_rad));
        let shadow = site.shadow();
        let bench = Bench::new(&robot, &ranges, to_fit);
        let drafts = drafts(design, content, &bench, &mut draw);
        let concealed = size(design, &drafts, &site, &shadow, 1e-3 * noise_mm[0], &mut draw);
        let mut hidden = hidden(&drafts, &mut draw);
        hidden.extend(design.bare.then_some(Column::Current));

        let (payload_kg, warmth): (Vec<f64>, Vec<f64>) =
            points.iter().map(|point| (point.payload_kg, point.temperature_c)).unzip();
        let (effects, motors) = acting(&robot, &bench, &concealed, &mut draw);
        let play = vec![play_rad / ARCSEC; robot.joints.len()];
        let poses = Poses::default();
        let experiment = Experiment {
            robot: &robot,
            truth: &truth,
            effects: &effects,
            tracker: &tracker,
            motors: &motors,
            repeatability_arcsec: &play,
            poses: &poses,
            blocks: &[],
            climate: &climate,
            seed,
        };
        let mut shots = experiment.measure(points, || ());
        let mut faults = Noise::new(seed, Purpose::Faults);
        let thermometer_c = warmth.iter().map(|celsius| celsius + THERMOMETER_K * faults.normal()).collect();
        let tampered = tamper(design, &mut shots, fit, &mut faults);
        if design.log_step_deg > 0.0 {
            shots.iter_mut().for_each(|shot| round(&mut shot.q, &robot, design.log_step_deg));
        }
        Ok(Case {
            name: format!("c{:04}", number + 1),
            content,
            seed,
            kind,
            accepted: drafts.iter().flat_map(|draft| draft.accepted.clone()).collect(),
            geometry_rank: shadow.rank(),
            robot,
            bare: design.bare,
            truth,
            tracker,
            play_rad,
            climate,
            concealed,
            hidden,
            tampered,
            shots,
            payload_kg,
            thermometer_c,
            fit,
            noise_mm,
        })
    }

    /// What a diagnosis should name: effect and place, strongest first, tampering last.
    pub fn want(&self) -> Vec<(&'static str, String)> {
        self.names(|one| one.cause.wanted)
    }

    /// The same with what only goes along with it.
    pub fn want_all(&self) -> Vec<(&'static str, String)> {
        self.names(|_| true)
    }

    fn names(&self, which: fn(&Concealed) -> bool) -> Vec<(&'static str, String)> {
        let mut causes: Vec<&Concealed> = self.concealed.iter().filter(|one| which(one)).collect();
        causes.sort_by(|a, b| b.strength.total_cmp(&a.strength));
        let named = causes.into_iter().map(|one| (one.cause.effect, one.cause.place.clone()));
        named.chain(self.tampered.iter().map(|one| (one.effect, "recording".to_string()))).collect()
    }
}

/// What is concealed, with friction in half of the cases, and the motors that show it.
fn acting(robot: &RobotDescription, bench: &Bench, concealed: &[Concealed], draw: &mut Noise) -> (Vec<Physical>, Motors) {
    let mut effects: Vec<Physical> = concealed.iter().flat_map(|one| one.cause.physical.clone()).collect();
    let friction = if draw.chance(0.5) { 0.02 } else { 0.0 };
    for (joint, peak) in bench.peak.iter().enumerate() {
        let torque_nm = friction * draw.uniform(0.2, 1.0) * peak;
        effects.push(Physical::HoldingFriction(HoldingFriction { joint: joint + 1, torque_nm }));
    }
    let largest = robot
        .joints
        .iter()
        .zip(&bench.peak)
        .map(|(joint, peak)| peak / (joint.reduction_ratio.unwrap_or(1.0) * joint.motor_constant.unwrap_or(1.0)));
    let motors = Motors { sign: Vec::new(), noise_a: 0.003 * largest.fold(0.0, f64::max) };
    (effects, motors)
}

/// Manufacturing errors everywhere.
fn errors(robot: &RobotDescription, draw: &mut Noise) -> TrueRobot {
    let joints = robot.joints.len();
    // A gear's error is a misjudged ratio: as large as the tool's turn allows to see, and larger on the big robot.
    let gear = if joints == 6 && robot.payload_mass > 100.0 { 4e-4 } else { 1e-4 };
    TrueRobot {
        offset_deg: (0..joints).map(|_| (5e-4 * draw.normal()).to_degrees()).collect(),
        ratio: (0..joints).map(|_| 1.0 + gear * draw.normal()).collect(),
        links: (1..=joints)
            .map(|link| LinkError {
                link,
                shift_mm: std::array::from_fn(|_| 0.4 * draw.normal()),
                tilt_arcsec: std::array::from_fn(|_| if link == joints { 0.0 } else { 3e-4 / ARCSEC * draw.normal() }),
            })
            .collect(),
        couplings: robot
            .couplings
            .iter()
            .map(|pair| CouplingError { moved: pair.moved + 1, by: pair.by + 1, error: 3e-4 * draw.normal() })
            .collect(),
        ..TrueRobot::default()
    }
}

/// A tracker somewhere around the robot, turned anyhow; nulls see other scatter, too.
fn tracker(kind: Kind, null: bool, draw: &mut Noise) -> Tracker {
    let (far, angle) = (kind.reach_m() * draw.uniform(1.2, 2.0), draw.uniform(-180.0, 180.0f64));
    let (sine, cosine) = angle.to_radians().sin_cos();
    Tracker {
        position_mm: [1e3 * far * cosine, 1e3 * far * sine, 1e3 * draw.uniform(0.0, 1.5)].map(f64::round),
        roll_pitch_yaw_deg: [draw.uniform(-10.0, 10.0), draw.uniform(-10.0, 10.0), draw.uniform(-180.0, 180.0)],
        scatter: match (null, draw.index(3)) {
            (true, 1) => Scatter::Student,
            (true, 2) => Scatter::Uneven,
            _ => Scatter::Gaussian,
        },
        ..Tracker::default()
    }
}

/// Rounds angles (rad) of revolute joints to whole steps, as a controller's log does.
fn round(q: &mut [f64], robot: &RobotDescription, step_deg: f64) {
    let step = step_deg.to_radians();
    let angles = q.iter_mut().zip(&robot.joints).filter(|(_, joint)| joint.kind == JointKind::Revolute);
    angles.for_each(|(angle, _)| *angle = (*angle / step).round() * step);
}

/// A part of a joint's range that a cell may leave free, deg.
fn narrowed(limits: [f64; 2], draw: &mut Noise) -> [f64; 2] {
    let [lower, upper] = limits.map(f64::to_degrees);
    let (free, place) = (draw.uniform(0.75, 1.0), draw.uniform(0.0, 1.0));
    let from = lower + place * (1.0 - free) * (upper - lower);
    [from.round(), (from + free * (upper - lower)).round()]
}

/// Draws the families of a case; a pair does not sit twice in one place.
fn drafts(design: &Design, content: Content, bench: &Bench, draw: &mut Noise) -> Vec<Draft> {
    let rows = match content {
        Content::Null => vec![],
        Content::Single(row) => vec![row],
        Content::Pair(first, second) => vec![first, second],
    };
    let mut out: Vec<Draft> = Vec::new();
    for row in rows {
        for _ in 0..50 {
            let form = if draw.chance(design.other_forms) { Form::Other } else { Form::Obvious };
            let Some(draft) = (FAMILIES[row].draw)(bench, form, draw) else { continue };
            let taken = |place: &str| out.iter().flat_map(|other| &other.causes).any(|cause| cause.place == place);
            let several = matches!(content, Content::Pair(..)) && draft.causes.len() > 1;
            if !several && !draft.causes.iter().any(|cause| taken(&cause.place)) {
                out.push(draft);
                break;
            }
        }
    }
    out
}

/// A visibility to aim at: mostly 50 to 1000, some hardly there, some plain.
fn aim(draw: &mut Noise) -> f64 {
    match draw.uniform(0.0, 1.0) {
        u if u < 0.1 => draw.size(1.0, 5.0),
        u if u < 0.25 => draw.size(5.0, 50.0),
        u if u < 0.85 => draw.size(50.0, 1000.0),
        _ => draw.size(1000.0, PLAINEST),
    }
}

/// The largest visibility of an effect whose size may be changed.
const PLAINEST: f64 = 5000.0;
/// Bounds of the factor on a natural size.
const SMALLEST: f64 = 2e-3;
const LARGEST: f64 = 4.0;

/// Gives the causes their size and says how visible they are then.
fn size(design: &Design, drafts: &[Draft], site: &Site, shadow: &Shadow, noise: f64, draw: &mut Noise) -> Vec<Concealed> {
    let mut causes: Vec<(Cause, &'static str)> =
        drafts.iter().flat_map(|draft| draft.causes.iter().map(|cause| (cause.clone(), draft.form))).collect();
    let strength = |column: &[f64]| (norm(column) / noise).powi(2);
    for index in 0..causes.len() {
        let natural = draw.chance(design.natural);
        let wanted = aim(draw);
        if !causes[index].0.sized {
            continue;
        }
        let found = strength(&shadow.outside(alone(&causes, index, site))).max(1e-9);
        // What is of natural size stays so, but where it would be too plain to test anything.
        let wanted = if natural { found.min(PLAINEST) } else { wanted };
        let factor = (wanted / found).sqrt().clamp(SMALLEST, LARGEST);
        let cause = &mut causes[index].0;
        cause.physical = cause.physical.iter().map(|effect| effect.scaled(factor)).collect();
    }
    let columns: Vec<Vec<f64>> = (0..causes.len()).map(|index| alone(&causes, index, site)).collect();
    let rms = |column: &[f64]| 1e3 * norm(column) / (column.len().max(1) as f64).sqrt();
    (causes.into_iter().enumerate())
        .map(|(index, (cause, form))| {
            let mut beside = shadow.clone();
            columns.iter().enumerate().filter(|(other, _)| *other != index).for_each(|(_, column)| beside.add(column.clone()));
            let left = beside.outside(columns[index].clone());
            Concealed {
                cause,
                form,
                raw_mm: rms(&columns[index]),
                visible_mm: rms(&left),
                strength: strength(&left),
                strength_alone: strength(&shadow.outside(columns[index].clone())),
            }
        })
        .collect()
}

/// What one cause does beside all others: the displacement with all of them less that without it, m.
fn alone(causes: &[(Cause, &'static str)], index: usize, site: &Site) -> Vec<f64> {
    let effects = |skipped: Option<usize>| -> Vec<Physical> {
        let kept = causes.iter().enumerate().filter(|(other, _)| Some(*other) != skipped);
        kept.flat_map(|(_, (cause, _))| cause.physical.clone()).collect()
    };
    let (with, without) = (site.displacement(&effects(None)), site.displacement(&effects(Some(index))));
    with.iter().zip(&without).map(|(with, without)| with - without).collect()
}

/// Columns that the recording lacks: what a form takes away, and now and then one that it can do without.
fn hidden(drafts: &[Draft], draw: &mut Noise) -> BTreeSet<Column> {
    let mut out: BTreeSet<Column> = drafts.iter().flat_map(|draft| draft.hides.iter().copied()).collect();
    for (column, share) in [(Column::Temperature, 0.15), (Column::Current, 0.12), (Column::Direction, 0.08), (Column::Time, 0.05)]
    {
        let dropped = draw.chance(share);
        if dropped && !drafts.iter().any(|draft| draft.needs.contains(&column)) {
            out.insert(column);
        }
    }
    out
}

/// Gross errors at one to three points to fit, or two points exchanged.
fn tamper(design: &Design, shots: &mut [Shot], fit: usize, draw: &mut Noise) -> Vec<Tampering> {
    let (faulty, exchanged) = (draw.chance(design.faulty), draw.chance(0.4));
    let last = shots.iter().filter(|shot| shot.block == FIT).count().min(fit);
    if !faulty || last < 10 {
        return Vec::new();
    }
    let first = draw.index(last - 5);
    if exchanged {
        let second = first + 1 + draw.index(4);
        let (a, b) = (shots[first].position, shots[second].position);
        (shots[first].position, shots[second].position) = (b, a);
        return vec![Tampering { effect: "mislabelled_point", rows: vec![first, second] }];
    }
    let mut rows: Vec<usize> = (0..1 + draw.index(3)).map(|_| draw.index(last)).collect();
    rows.sort_unstable();
    rows.dedup();
    for row in &rows {
        let jump = draw.vector(0.5e-3, 4e-3);
        shots[*row].position = std::array::from_fn(|axis| shots[*row].position[axis] + jump[axis]);
    }
    vec![Tampering { effect: "outlier", rows }]
}
