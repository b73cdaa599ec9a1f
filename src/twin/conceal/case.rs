//! One concealed recording: a drawn robot, its errors, its effects sized to be as visible as drawn, and what was measured.

use super::design::{Content, Design};
use super::family::{Bench, Collection, Column, Draft};
use super::points::{self, Amount, FIT};
use super::robots::Kind;
use super::size::{Concealed, Sight, conceal};
use super::visible::Site;
use crate::effect::{HoldingFriction, Physical};
use crate::folder::{Decimals, File, Log, pretty, robot};
use crate::matrix;
use crate::noise::{Noise, Purpose};
use crate::plan::{Climate, Point, Poses};
use crate::recorder::{Experiment, Motors, Shot};
use crate::tracker::{SCATTERS, Scatter, Tracker};
use crate::truth::{ARCSEC, CouplingError, LinkError, TrueRobot, TrueValue};
use calib_foundation::description::{Coupling, RobotDescription};
use serde_json::{Value, json};
use std::collections::BTreeSet;

/// A recording that was tampered with.
#[derive(Debug, Clone, PartialEq)]
pub struct Tampering {
    /// What was done, by its canonical name.
    pub(crate) effect: &'static str,
    /// Rows, from 0.
    pub(crate) rows: Vec<usize>,
}

/// A finished case.
#[derive(Debug, Clone)]
pub struct Case {
    /// As its folder is called.
    pub name: String,
    /// What it conceals.
    pub content: Content,
    /// The list that its effects are drawn from.
    pub collection: Collection,
    pub seed: u64,
    pub kind: Kind,
    /// As its owner believes it to be.
    pub robot: RobotDescription,
    /// Whether the robot file keeps the masses of the links to itself.
    pub bare: bool,
    /// As it is.
    pub truth: TrueRobot,
    /// Where it stands and how well it measures.
    pub tracker: Tracker,
    /// Joint repeatability, rad.
    pub play_rad: f64,
    /// Clock and temperature.
    pub climate: Climate,
    /// Effects, each with how visible it is.
    pub concealed: Vec<Concealed>,
    /// Friction of the joints, which currents show and positions do not, and the motors.
    pub friction: Vec<Physical>,
    /// As their currents are logged.
    pub motors: Motors,
    /// Names and places that are right too, since the data cannot separate them.
    pub accepted: Vec<(&'static str, String)>,
    /// Columns that the recording lacks.
    pub hidden: BTreeSet<Column>,
    /// Gross errors and exchanged points.
    pub tampered: Vec<Tampering>,
    /// Measured points in their order.
    pub shots: Vec<Shot>,
    /// Declared payload of every shot, kg, and what the arm's thermometer says, C.
    pub payload_kg: Vec<f64>,
    pub thermometer_c: Vec<f64>,
    /// How many of the points, from the first, are to be fitted.
    pub fit: usize,
    /// Root mean square of a coordinate's noise at the points to fit and at those held out, mm.
    pub noise_mm: [f64; 2],
    /// Root mean square of a coordinate that foreign effects do at the points held out beyond what the points to fit show of them, mm.
    pub unseen_mm: f64,
    /// Numbers that geometry, ratios, couplings and the tracker's pose amount to.
    pub geometry_rank: usize,
}

/// Standard deviation of the thermometer, K.
const THERMOMETER_K: f64 = 0.15;
/// Share of points that are approached from near by, where memory is to be seen.
const NEAR: f64 = 0.35;

impl Case {
    /// The case of this number; fails with what is wrong where no pose is allowed.
    pub fn make(design: &Design, number: usize, content: Content) -> Result<Case, String> {
        let seed = design.seed_of(number);
        let mut draw = Noise::new(seed, Purpose::Design);
        let (kind, robot) = arm(design, &mut draw);
        let truth = errors(&robot, &mut draw);
        let beyond_list = design.collection == Collection::Beyond;
        let tracker = tracker(design, kind, content, &mut draw);
        let (play_rad, repeated) = match draw.chance(0.5) {
            true => (1e-6 * draw.uniform(4.0, 16.0), 0.1),
            false => (0.0, 0.0),
        };
        let points = design.points;
        let fit = points.unwrap_or_else(|| draw.size(50.0, 400.0).round() as usize);
        let validate = (draw.uniform(0.25, 0.5) * fit as f64).round().max(1.0) as usize;
        let climate = weather((fit + validate) as f64 * 19.0, beyond_list, &mut draw);
        let joints = robot.joints.iter();
        let limits = joints.map(|joint| joint.limits.unwrap_or_default());
        let ranges: Vec<[f64; 2]> = limits.map(|limits| narrowed(limits, &mut draw)).collect();
        let amount = Amount {
            fit,
            validate,
            repeated,
            near: if beyond_list { NEAR } else { 0.0 },
            loaded: !design.bare,
            layout: design.layout,
        };
        let points = points::plan(kind, &ranges, amount, &climate, seed)?;
        let (to_fit, held_out) = points.split_at(fit);
        let at = |points| Site {
            robot: &robot,
            truth: &truth,
            tracker: &tracker,
            points,
        };
        let (site, held_out) = (at(to_fit), at(held_out));
        let noise_mm = [&site, &held_out].map(|site| 1e3 * site.noise(play_rad));
        let shadow = site.shadow();
        let bench = Bench::new(&robot, &ranges, to_fit);
        let sight = Sight {
            site: &site,
            shadow: &shadow,
            noise: 1e-3 * noise_mm[0],
        };
        let (drafts, concealed) = conceal(design, content, &bench, &sight, &mut draw);
        let mut hidden = hidden(&drafts, &mut draw);
        hidden.extend(design.bare.then_some(Column::Current));
        let payload_kg = points.iter().map(|point| point.payload_kg).collect();
        let (friction, motors) = drives(&robot, &bench, &mut draw);
        let causes = concealed.iter().flat_map(|one| &one.cause.physical);
        let effects: Vec<Physical> = causes.chain(&friction).cloned().collect();
        let unseen_mm = 1e3 * at(&points).unseen(fit, &effects);
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
        let carried = points.into_iter().map(|point| Point {
            payload_kg: point.payload_kg + design.tool_mass_kg,
            ..point
        });
        let mut shots = experiment.measure(carried.collect(), || ());
        let mut faults = Noise::new(seed, Purpose::Faults);
        let mut shown = |shot: &Shot| shot.temperature_c + THERMOMETER_K * faults.normal();
        let thermometer_c = shots.iter().map(&mut shown).collect();
        let tampered = tamper(design, &mut shots, fit, &mut faults);
        if design.log_step_deg > 0.0 {
            // As a controller's log does; all joints turn.
            let step = design.log_step_deg.to_radians();
            let angles = shots.iter_mut().flat_map(|shot| &mut shot.q);
            angles.for_each(|angle| *angle = (*angle / step).round() * step);
        }
        let accepted = drafts.into_iter().flat_map(|draft| draft.accepted);
        Ok(Case {
            name: format!("c{:04}", number + 1),
            content,
            collection: design.collection,
            seed,
            kind,
            accepted: accepted.collect(),
            geometry_rank: shadow.rank(),
            robot,
            bare: design.bare,
            truth,
            tracker,
            play_rad,
            climate,
            concealed,
            friction,
            motors,
            hidden,
            tampered,
            shots,
            payload_kg,
            thermometer_c,
            fit,
            noise_mm,
            unseen_mm,
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
        let named = |one: &Concealed| (one.cause.effect, one.cause.place.clone());
        let tampered = self.tampered.iter();
        let tampered = tampered.map(|one| (one.effect, "recording".to_string()));
        causes.into_iter().map(named).chain(tampered).collect()
    }
}

/// One of the design's robots; the reflector off the last axis in half of the cases, else that joint's own turn cannot be seen.
fn arm(design: &Design, draw: &mut Noise) -> (Kind, RobotDescription) {
    let kinds = design.kinds();
    let kind = kinds[draw.index(kinds.len())];
    let aside = match draw.chance(0.5) {
        true => draw.vector(30.0, 80.0).map(f64::round),
        false => [0.0; 3],
    };
    (kind, kind.description(aside))
}

/// Clock and temperature of a recording that lasts so many seconds: two time constants, more or less.
fn weather(lasts_s: f64, swings: bool, draw: &mut Noise) -> Climate {
    let warm_up_h = lasts_s / draw.uniform(1.5, 3.5) / 3600.0;
    let climate = Climate {
        pace_s: [12.0, 26.0],
        start_c: 20.0,
        rise_k: 15.0,
        warm_up_h,
        ..Climate::default()
    };
    if !swings {
        return climate;
    }
    // Without a swing temperature is a function of time, and what lags it another one.
    Climate {
        swing_k: draw.uniform(2.0, 4.0),
        swing_h: lasts_s / draw.uniform(2.0, 5.0) / 3600.0,
        ..climate
    }
}

/// Friction, in half of the cases, and the motors that show it.
fn drives(robot: &RobotDescription, bench: &Bench, draw: &mut Noise) -> (Vec<Physical>, Motors) {
    let share = if draw.chance(0.5) { 0.02 } else { 0.0 };
    let of_joint = |(joint, peak): (usize, &f64)| {
        HoldingFriction::effect(joint + 1, share * draw.uniform(0.2, 1.0) * peak)
    };
    let friction = bench.peak.iter().enumerate().map(of_joint).collect();
    let largest = robot.joints.iter().zip(&bench.peak).map(|(joint, peak)| {
        peak / (joint.reduction_ratio.unwrap_or(1.0) * joint.motor_constant.unwrap_or(1.0))
    });
    let motors = Motors {
        sign: Vec::new(),
        noise_a: 0.003 * largest.fold(0.0, f64::max),
    };
    (friction, motors)
}

/// Manufacturing errors everywhere.
fn errors(robot: &RobotDescription, draw: &mut Noise) -> TrueRobot {
    let joints = robot.joints.len();
    // A gear's error is a misjudged ratio: as large as the tool's turn allows to see, and larger on the big robot.
    let is_big = joints == 6 && robot.payload_mass > 100.0;
    let gear = if is_big { 4e-4 } else { 1e-4 };
    let mut offset = || (5e-4 * draw.normal()).to_degrees();
    let offset_deg = (0..joints).map(|_| offset()).collect();
    let ratio = (0..joints).map(|_| 1.0 + gear * draw.normal()).collect();
    let mut links = Vec::new();
    for link in 1..=joints {
        let shift_mm = [(); 3].map(|()| 0.4 * draw.normal());
        let tilt_arcsec = match link == joints {
            true => [0.0; 3],
            false => [(); 3].map(|()| 3e-4 / ARCSEC * draw.normal()),
        };
        links.push(LinkError {
            link,
            shift_mm,
            tilt_arcsec,
        });
    }
    let coupling = |pair: &Coupling| CouplingError {
        moved: pair.moved + 1,
        by: pair.by + 1,
        error: 3e-4 * draw.normal(),
    };
    TrueRobot {
        offset_deg,
        ratio,
        links,
        couplings: robot.couplings.iter().map(coupling).collect(),
        ..TrueRobot::default()
    }
}

/// A tracker somewhere around the robot, turned anyhow, with the scatter that the design asks for. Unasked nulls of the library see other
/// scatter than the Gaussian one, and beyond the library now and then everything does.
fn tracker(design: &Design, kind: Kind, content: Content, draw: &mut Noise) -> Tracker {
    let far = kind.reach_m() * draw.uniform(1.2, 2.0);
    let (sine, cosine) = draw.uniform(-180.0, 180.0f64).to_radians().sin_cos();
    let high = draw.uniform(0.0, 1.5);
    let position_mm = [1e3 * far * cosine, 1e3 * far * sine, 1e3 * high].map(f64::round);
    let roll_pitch_yaw_deg = [10.0, 10.0, 180.0].map(|most| draw.uniform(-most, most));
    let mut scatter = match (content == Content::Null, draw.index(3)) {
        (true, 1) => Scatter::Student,
        (true, 2) => Scatter::Uneven,
        _ => Scatter::Gaussian,
    };
    if design.collection == Collection::Beyond && design.scatter.is_none() {
        let (plain, other) = (draw.chance(0.6), draw.index(SCATTERS.len() - 1));
        scatter = SCATTERS[if plain { 0 } else { 1 + other }];
    }
    Tracker {
        position_mm,
        roll_pitch_yaw_deg,
        scatter: design.scatter.unwrap_or(scatter),
        ..Tracker::default()
    }
}

/// A part of a joint's range that a cell may leave free, deg.
fn narrowed(limits: [f64; 2], draw: &mut Noise) -> [f64; 2] {
    let [lower, upper] = limits.map(f64::to_degrees);
    let (free, place) = (draw.uniform(0.75, 1.0), draw.uniform(0.0, 1.0));
    let from = lower + place * (1.0 - free) * (upper - lower);
    [from.round(), (from + free * (upper - lower)).round()]
}

/// Columns that the recording lacks: what a form takes away, and now and then one that it can do without.
fn hidden(drafts: &[Draft], draw: &mut Noise) -> BTreeSet<Column> {
    let hides = drafts.iter().flat_map(|draft| &draft.hides);
    let mut out: BTreeSet<Column> = hides.copied().collect();
    for (column, share) in [
        (Column::Temperature, 0.15),
        (Column::Current, 0.12),
        (Column::Direction, 0.08),
        (Column::Time, 0.05),
    ] {
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
    let to_fit = shots.iter().filter(|shot| shot.block == FIT);
    let last = to_fit.count().min(fit);
    if !faulty || last < 10 {
        return Vec::new();
    }
    let first = draw.index(last - 5);
    if exchanged {
        let second = first + 1 + draw.index(4);
        let positions = [first, second].map(|row| shots[row].position);
        [shots[second].position, shots[first].position] = positions;
        let (effect, rows) = ("mislabelled_point", vec![first, second]);
        return vec![Tampering { effect, rows }];
    }
    let mut rows: Vec<usize> = (0..1 + draw.index(3)).map(|_| draw.index(last)).collect();
    rows.sort_unstable();
    rows.dedup();
    for row in &rows {
        let jump = draw.vector(0.5e-3, 4e-3);
        shots[*row].position = matrix::add(shots[*row].position, jump);
    }
    let effect = "outlier";
    vec![Tampering { effect, rows }]
}

/// A controller's display and a tracker's.
const DECIMALS: Decimals = Decimals {
    angle: 4,
    length: 5,
    time: 2,
};

impl Case {
    /// The files that a user has; fails with what of the robot they cannot state.
    pub fn recording(&self) -> Result<[File; 3], String> {
        let log = self.log();
        Ok([
            ("robot.json", robot(&self.stated())?),
            ("controller.csv", log.controller(DECIMALS)),
            ("tracker.csv", log.tracker(DECIMALS)),
        ])
    }

    /// The robot as its file states it.
    fn stated(&self) -> RobotDescription {
        let mut stated = self.robot.clone();
        for joint in stated.joints.iter_mut().filter(|_| self.bare) {
            (joint.mass, joint.centre) = (None, None);
        }
        stated
    }

    /// The truth.
    pub fn sealed(&self) -> String {
        let pair =
            |(effect, place): &(&'static str, String)| json!({ "effect": effect, "where": place });
        let hidden: Vec<&str> = self.hidden.iter().map(|column| column.name()).collect();
        let tampered = self.tampered.iter().map(|one| {
            let points: Vec<String> = one.rows.iter().map(|row| id(*row)).collect();
            json!({ "effect": one.effect, "where": "recording", "points": points })
        });
        let families = self.collection.families();
        let (family, content) = match self.content {
            Content::Null => (String::new(), "null"),
            Content::Single(row) if families[row].name == "unknown" => ("unknown".into(), "open"),
            Content::Single(row) => (families[row].name.into(), "single"),
            Content::Foreign => ("unknown".into(), "foreign"),
            Content::Pair(a, b) => (format!("{}+{}", families[a].name, families[b].name), "pair"),
        };
        pretty(&json!({
            "case": self.name,
            "content": content,
            "family": family,
            "seed": self.seed,
            "robot": self.kind.name(),
            "want": self.want().iter().map(pair).collect::<Vec<_>>(),
            // Whole answers that are as good as `want`; single names that neither count nor hurt.
            "accept": [self.want_all().iter().map(pair).collect::<Vec<_>>()],
            "accepted": self.accepted.iter().map(pair).collect::<Vec<_>>(),
            "effects": self.concealed.iter().map(effect).collect::<Vec<_>>(),
            "tampered": tampered.collect::<Vec<_>>(),
            "hidden_columns": hidden,
            "points": { "fit": self.fit, "validate": self.shots.len() - self.fit },
            "geometry_rank": self.geometry_rank,
            "noise": {
                "fit_rms_per_axis_mm": self.noise_mm[0],
                "validate_rms_per_axis_mm": self.noise_mm[1],
                "unseen_rms_per_axis_mm": self.unseen_mm,
                "joint_repeatability_rad": self.play_rad,
                "scatter": self.tracker.scatter,
            },
            // The whole robot in the settings of the stage `simulate`, effects apart: it can be measured again.
            "tracker": self.tracker,
            "climate": self.climate,
            "true": self.truth,
            "motors": self.motors,
            "friction": self.friction,
        }))
    }

    fn log(&self) -> Log {
        let shown = |column: Column| !self.hidden.contains(&column);
        let each = |value: fn(&Shot) -> f64| self.shots.iter().map(value).collect::<Vec<f64>>();
        let joints = |value: fn(&Shot) -> &Vec<f64>| -> Vec<f64> {
            self.shots.iter().flat_map(value).copied().collect()
        };
        let usage = |shot: &Shot| if shot.block == FIT { "fit" } else { "validate" }.to_string();
        Log {
            joints: self.robot.joints.len(),
            id: (0..self.shots.len()).map(id).collect(),
            time_s: shown(Column::Time).then(|| each(|shot| shot.time_s)),
            usage: self.shots.iter().map(usage).collect(),
            payload_kg: self.payload_kg.clone(),
            q: joints(|shot| &shot.q),
            current: shown(Column::Current).then(|| joints(|shot| &shot.current)),
            direction: shown(Column::Direction).then(|| joints(|shot| &shot.direction)),
            velocity: None,
            at_once: false,
            temperature_c: shown(Column::Temperature).then(|| self.thermometer_c.clone()),
            position: self.shots.iter().map(|shot| shot.position).collect(),
        }
    }
}

fn id(row: usize) -> String {
    format!("P{:04}", row + 1)
}

fn effect(one: &Concealed) -> Value {
    let number = |one: TrueValue| json!({ "name": one.name, "value": one.value, "unit": one.unit });
    let numbers = one.cause.physical.iter().flat_map(|effect| effect.truth());
    let numbers = numbers.map(number);
    let mut out = json!({
        "effect": one.cause.effect,
        "where": one.cause.place,
        "form": one.cause.form,
        "wanted": one.cause.wanted,
        "L": one.strength,
        "L_alone": one.strength_alone,
        "rms_mm": one.raw_mm,
        "visible_rms_mm": one.visible_mm,
        "parameters": numbers.collect::<Vec<_>>(),
        "physical": one.cause.physical,
    });
    if one.strange {
        out["strange"] = json!(true);
    }
    out
}
