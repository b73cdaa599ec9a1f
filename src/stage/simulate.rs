//! `simulate`: a recording from a twin of the robot whose truth is known.

use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Place, Result, counted};
use crate::table::{Recording, Robot, Truth, TruthRow};
use crate::twin::effect::Physical;
use crate::twin::plan::{Block, Climate, Poses, given};
use crate::twin::recorder::{Experiment, Motors, Shot};
use crate::twin::touch::{Fixture, FixtureKind, Touch};
use crate::twin::tracker::Tracker;
use crate::twin::truth::TrueRobot;
use crate::twin::truth::TrueValue;
use crate::twin::way::Way;
use crate::{Context, Stage};
use calib_numerics::robot::{Instrument, START, SigmaSource};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Display;

/// Whether the effects listed in `effects` act.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Remainder {
    /// They do.
    #[default]
    All,
    /// The twin is its `truth` and nothing else: rigid errors, gears and linear wind-up.
    None,
}

/// Records an experiment on a twin of the robot.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Simulate {
    /// What the true robot is, against the robot file.
    #[serde(default)]
    pub truth: TrueRobot,
    /// What acts on it besides; the name of an effect and its numbers each.
    #[serde(default)]
    pub effects: Vec<Physical>,
    /// `none` switches `effects` off.
    #[serde(default)]
    pub remainder: Remainder,
    /// Where the tracker stands and how well it measures.
    #[serde(default)]
    pub tracker: Tracker,
    /// The motors as the controller logs them.
    #[serde(default)]
    pub motors: Motors,
    /// Standard deviation of each joint from move to move, arcsec (um for a prismatic joint); empty: none.
    #[serde(default)]
    pub repeatability_arcsec: Vec<f64>,
    /// Which poses may be measured.
    #[serde(default)]
    pub poses: Poses,
    /// Runs of points in the order of measurement; their labels become the column `usage`.
    #[serde(default)]
    pub blocks: Vec<Block>,
    /// Sockets, planes and spheres to which the ball on the tool is brought instead: no tracker, nothing but joints is recorded.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fixtures: Vec<Fixture>,
    /// The arm moves while it is measured: the rows of all blocks follow one way, so many a second. Missing: it stands at every point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<Way>,
    /// The clock and the temperature.
    #[serde(default)]
    pub climate: Climate,
    /// Seed of poses and noise; missing: from the pipeline's seed.
    #[serde(default)]
    pub seed: Option<u64>,
}

crate::stage! {
    Simulate, "simulate", 3, "records an experiment on a twin whose truth is known",
        SimulateReads {
            robot: Robot,
        } -> SimulateWrites {
            recording: Recording,
            truth: Truth,
        }
}

/// Points of a block, and candidates of a pose, at most: what fits into memory.
const LIMIT: usize = 10_000_000;

impl Stage for Simulate {
    fn faults(&self, at: &mut Place) {
        for (index, fixture) in self.fixtures.iter().enumerate() {
            let mut at = at.at(format!("fixtures[{index}]"));
            all_faults(&mut at, fixture.faults());
            let mut others = self.fixtures[..index].iter();
            at.at("name").must(
                others.all(|other| other.name != fixture.name),
                "another one has this name",
            );
        }
        let measured = !self.blocks.is_empty() || self.motion.is_some();
        at.at("fixtures").must(
            self.fixtures.is_empty() || !measured,
            "nothing but joints is recorded at fixtures; leave out `blocks` and `motion`",
        );
        at.at("blocks").must(
            !self.fixtures.is_empty() || self.blocks.iter().any(|block| block.count() > 0),
            "expected at least one block with points, e.g. [{usage: fit, points: 50}]",
        );
        at.at("poses.candidates").must(
            self.poses.candidates <= LIMIT,
            format!("expected {LIMIT} candidates at most"),
        );
        for (place, pose) in given(&self.blocks) {
            all_faults(&mut at.at(place), pose.faults());
        }
        for (index, block) in self.blocks.iter().enumerate() {
            let mut at = at.at(format!("blocks[{index}]"));
            at.at("points").must(
                block.points <= LIMIT,
                format!("expected {LIMIT} points at most"),
            );
            at.at("given").must(
                self.motion.is_none() || block.given.is_empty(),
                "given poses need an arm at rest; leave out `given` or `motion`",
            );
            let mass = block.payload_kg;
            at.at("payload_kg").must(
                mass.is_finite() && mass >= 0.0,
                "expected a mass, 0 or more",
            );
        }
        for (index, [low, high]) in self.poses.range_deg.iter().enumerate() {
            let possible = low.is_finite() && high.is_finite() && low <= high;
            at.at(format!("poses.range_deg[{index}]"))
                .must(possible, "expected [lower, upper], lower first");
        }
        let tracker = &self.tracker;
        let is_noise = tracker.noise_um >= 0.0 && tracker.noise_um_per_m >= 0.0;
        at.at("tracker").must(
            tracker.coverage > 0.0 && is_noise,
            "expected noise_um and noise_um_per_m of 0 or more, and a coverage above 0, e.g. 2",
        );
        let climate = &self.climate;
        at.at("climate.begin_s").must(
            climate.begin_s >= 0.0 && climate.begin_s.is_finite(),
            "expected a time of 0 or more, s",
        );
        let [shortest, longest] = climate.pace_s;
        let paced = shortest > 0.0 && shortest <= longest && longest.is_finite();
        at.at("climate").must(
            paced && climate.warm_up_h > 0.0 && climate.swing_h > 0.0,
            "expected pace_s as [shortest, longest] above 0, and warm_up_h and swing_h above 0",
        );
        if let Some(way) = &self.motion {
            let mut positive = [way.rate_hz, way.speed_deg_s].into_iter();
            let mut more = [way.dwell_s, way.wander_s].into_iter();
            at.at("motion").must(
                positive.all(|value| value > 0.0 && value.is_finite())
                    && more.all(|value| value >= 0.0 && value.is_finite()),
                "expected rate_hz and speed_deg_s above 0, dwell_s and wander_s of 0 or more",
            );
        }
    }

    fn run(&self, reads: SimulateReads, context: &Context) -> Result<SimulateWrites> {
        let robot = reads.robot.to_description()?;
        let place = format!("{}.with", context.id);
        Error::if_spec(Place::faults(|at| self.against(&robot, &mut at.at(&place))))?;
        let effects = self.acting();
        let tick = |done: &mut u64| {
            *done += 1;
            context.services.advance(*done, "");
        };
        let experiment = Experiment {
            robot: &robot,
            truth: &self.truth,
            effects,
            tracker: &self.tracker,
            motors: &self.motors,
            repeatability_arcsec: &self.repeatability_arcsec,
            poses: &self.poses,
            blocks: &self.blocks,
            climate: &self.climate,
            seed: self.seed.unwrap_or(context.seed),
        };
        if !self.fixtures.is_empty() {
            let touches = experiment.touch(&self.fixtures);
            let touches = touches.map_err(|message| Error::spec(place, message))?;
            let rows = counted(touches.len(), "row");
            let things = counted(self.fixtures.len(), "fixture");
            context.note(format!("{rows} of joints at {things} of a twin"));
            let mut truth = truth(&robot, &self.truth, &self.tracker, effects);
            truth.0.extend(self.fixtures.iter().flat_map(fixture_truth));
            return Ok(SimulateWrites {
                recording: contact_recording(&robot, &self.fixtures, &touches),
                truth,
            });
        }
        let points: usize = self.blocks.iter().map(Block::count).sum();
        let services = context.services;
        services.begin("measuring the twin", Some(points as u64), "points");
        let mut done = 0;
        let shots = match &self.motion {
            Some(way) => experiment.follow(way, || tick(&mut done)),
            None => experiment.record(|| tick(&mut done)),
        };
        let shots = shots.map_err(|message| Error::spec(place, message))?;
        context.note(format!(
            "{} measured on a twin with {} besides its truth",
            counted(points, "point"),
            counted(effects.len(), "effect")
        ));
        Ok(SimulateWrites {
            recording: self.recording(&robot, &shots),
            truth: truth(&robot, &self.truth, &self.tracker, effects),
        })
    }
}

/// Faults of what stands at a place, each with its place below that.
fn all_faults<K: Display, M: Into<String>>(at: &mut Place, faults: Vec<(K, M)>) {
    for (key, message) in faults {
        at.at(key).fault(message);
    }
}

impl Simulate {
    fn acting(&self) -> &[Physical] {
        match self.remainder {
            Remainder::All => &self.effects,
            Remainder::None => &[],
        }
    }

    /// Settings that this robot cannot have.
    fn against(&self, robot: &RobotDescription, at: &mut Place) {
        let joints = robot.joints.len();
        all_faults(&mut at.at("truth"), self.truth.faults(robot));
        for (place, pose) in given(&self.blocks) {
            all_faults(&mut at.at(place), pose.against(robot));
        }
        for (index, effect) in self.effects.iter().enumerate() {
            let mut at = at.at(format!("effects[{index}]"));
            if let Some(what) = effect.fault(joints) {
                at.fault(what);
            }
            at.must(
                self.motion.is_some() || !effect.moves_only(),
                "shows on a moving arm only; say `motion`, e.g. motion: {rate_hz: 100}",
            );
        }
        for (name, list) in [
            ("motors.sign", &self.motors.sign),
            ("repeatability_arcsec", &self.repeatability_arcsec),
        ] {
            let (numbers, all) = (counted(list.len(), "number"), counted(joints, "joint"));
            at.at(name).must(
                list.is_empty() || list.len() == joints,
                format!("has {numbers}, the robot {all}"),
            );
        }
        let factors = self.truth.compliance_rad_a.iter().enumerate();
        for (joint, factor) in factors.filter(|(_, factor)| **factor != 0.0) {
            let mut at = at.at(format!("truth.compliance_rad_a[{joint}]"));
            let described = robot.joints.get(joint);
            let known = described.is_some_and(|joint| {
                joint.reduction_ratio.is_some() && joint.motor_constant.is_some()
            });
            let sign = self.motors.sign.get(joint).copied().unwrap_or(1.0);
            at.must(
                known,
                "needs reduction_ratio and motor_constant of this joint in the robot file",
            );
            at.must(
                !known || factor.signum() != sign.signum(),
                "has the sign of motors.sign: the gear would wind up against its load; the signs must differ",
            );
        }
    }

    /// What the tracker states of its noise; nothing where it has none, since no fit can weigh by zero.
    fn noise(&self) -> (Instrument, SigmaSource) {
        let stated = Instrument {
            constant_um: self.tracker.noise_um,
            per_metre_um: self.tracker.noise_um_per_m,
            coverage: self.tracker.coverage,
        };
        match stated.fault() {
            None => (stated, SigmaSource::Instrument),
            Some(_) => (START, SigmaSource::Inferred),
        }
    }

    fn recording(&self, robot: &RobotDescription, shots: &[Shot]) -> Recording {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        let mut ids = Vec::with_capacity(shots.len());
        for shot in shots {
            let usage = self.blocks[shot.block].usage.as_str();
            let count = counts.entry(usage).or_default();
            *count += 1;
            ids.push(format!("{usage}-{count:04}"));
        }
        let (figures, source) = self.noise();
        let of_joints = |value: fn(&Shot) -> &Vec<f64>| -> Vec<f64> {
            shots.iter().flat_map(value).copied().collect()
        };
        let of_rows = |value: fn(&Shot) -> f64| Some(shots.iter().map(value).collect());
        let usage = |shot: &Shot| self.blocks[shot.block].usage.as_str();
        let sigma = |shot: &Shot| [figures.sigma(&shot.position.into()); 3];
        let still = self.motion.is_none();
        let logs_velocity = self.motion.as_ref().is_some_and(|way| way.log_velocity);
        Recording {
            point_id: ids,
            q: of_joints(|shot| &shot.q),
            position: shots.iter().map(|shot| shot.position).collect(),
            position_sigma: Some(shots.iter().map(sigma).collect()),
            sigma_source: Some(vec![source; shots.len()]),
            time: of_rows(|shot| shot.time_s),
            payload: of_rows(|shot| shot.payload_kg),
            temperature: of_rows(|shot| shot.temperature_c),
            current: still.then(|| of_joints(|shot| &shot.current)),
            velocity: logs_velocity.then(|| of_joints(|shot| &shot.velocity)),
            direction: Some(of_joints(|shot| &shot.direction)),
            ..blank(robot, shots.iter().map(usage))
        }
    }
}

/// A recording of rows of this usage, of which nothing else is known yet.
fn blank<'a>(robot: &RobotDescription, usage: impl Iterator<Item = &'a str>) -> Recording {
    let joints = robot.joints.iter();
    let usage: Vec<Option<String>> = usage.map(|usage| Some(usage.to_string())).collect();
    Recording {
        joints: robot.joints.len(),
        prismatic: joints
            .map(|joint| joint.kind == JointKind::Prismatic)
            .collect(),
        sequence: (0..usage.len() as i64).collect(),
        usage,
        ..Recording::default()
    }
}

/// The true numbers in canonical names, the names that identified parameters have; effects named twice are numbered.
fn truth(
    robot: &RobotDescription,
    truth: &TrueRobot,
    tracker: &Tracker,
    effects: &[Physical],
) -> Truth {
    let values = truth.values(robot).into_iter().chain(tracker.values());
    let values = values.chain(effects.iter().flat_map(|effect| effect.truth()));
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let row = |one: TrueValue| {
        let count = seen.entry(one.name.clone()).or_default();
        *count += 1;
        let ending = (*count > 1).then(|| format!("#{count}"));
        TruthRow {
            name: one.name + &ending.unwrap_or_default(),
            effect: one.effect.into(),
            place: one.place,
            unit: one.unit.into(),
            value: one.value,
        }
    };
    Truth(values.map(row).collect())
}

/// m; what is stated where the ball comes back exactly: no fit can weigh by zero.
const LEAST_SIGMA: f64 = 1e-6;

const FIXTURES: [(FixtureKind, &str, &str); 3] = [
    (FixtureKind::Socket, "socket", "sigma_socket"),
    (FixtureKind::Plane, "plane", "sigma_plane"),
    (FixtureKind::Sphere, "sphere", "sigma_sphere"),
];

/// Joints with the names of what holds the ball.
pub(super) fn contact_recording(
    robot: &RobotDescription,
    fixtures: &[Fixture],
    touches: &[Touch],
) -> Recording {
    let fixture_of = |touch: &Touch| &fixtures[touch.fixture];
    let (mut readings, mut names) = (BTreeMap::new(), BTreeMap::new());
    for (kind, setting, sigma) in FIXTURES {
        if !fixtures.iter().any(|fixture| fixture.kind == kind) {
            continue;
        }
        let touched =
            |touch: &Touch| Some(fixture_of(touch)).filter(|fixture| fixture.kind == kind);
        let name = |touch: &Touch| Some(touched(touch)?.name.clone());
        names.insert(setting, touches.iter().map(name).collect());
        let stated = |fixture: &Fixture| (1e-6 * fixture.sigma_um).max(LEAST_SIGMA);
        let noise = |touch: &Touch| touched(touch).map_or(f64::NAN, stated);
        readings.insert(sigma, touches.iter().map(noise).collect());
    }
    let mut counts = vec![0; fixtures.len()];
    let mut name = |touch: &Touch| {
        counts[touch.fixture] += 1;
        format!("{}-{:04}", fixture_of(touch).name, counts[touch.fixture])
    };
    let usage = touches.iter().map(|touch| fixture_of(touch).usage.as_str());
    Recording {
        point_id: touches.iter().map(&mut name).collect(),
        q: touches.iter().flat_map(|touch| &touch.q).copied().collect(),
        position: vec![[f64::NAN; 3]; touches.len()],
        time: Some(touches.iter().map(|touch| touch.time_s).collect()),
        temperature: Some(touches.iter().map(|touch| touch.temperature_c).collect()),
        readings,
        names,
        ..blank(robot, usage)
    }
}

/// Where a fixture truly is, under the names that identified parameters have.
pub(super) fn fixture_truth(fixture: &Fixture) -> Vec<TruthRow> {
    let row = |ending: &str, value: f64| TruthRow {
        name: format!("anchor.{}.{ending}", fixture.name),
        effect: "anchor".into(),
        place: "anchor".into(),
        unit: "mm".into(),
        value,
    };
    let [x, y, z] = fixture.centre_mm;
    let radius = fixture.radius_mm.unwrap_or_default();
    match fixture.kind {
        FixtureKind::Plane => vec![],
        FixtureKind::Socket => vec![row("x", x), row("y", y), row("z", z)],
        FixtureKind::Sphere => vec![row("x", x), row("y", y), row("z", z), row("radius", radius)],
    }
}
