//! The recording of a ball that fixtures hold, and the truth about these.

use crate::description::{JointKind, RobotDescription};
use crate::table::{Recording, TruthRow};
use crate::twin::touch::{Fixture, FixtureKind, Touch};
use std::collections::BTreeMap;

/// m; what is stated where the ball comes back exactly: no fit can weigh by zero.
const LEAST_SIGMA: f64 = 1e-6;

const KINDS: [(FixtureKind, &str, &str); 3] = [
    (FixtureKind::Socket, "socket", "sigma_socket"),
    (FixtureKind::Plane, "plane", "sigma_plane"),
    (FixtureKind::Sphere, "sphere", "sigma_sphere"),
];

/// Joints with the names of what holds the ball.
pub(super) fn recording(
    robot: &RobotDescription,
    fixtures: &[Fixture],
    touches: &[Touch],
) -> Recording {
    let fixture_of = |touch: &Touch| &fixtures[touch.fixture];
    let (mut readings, mut names) = (BTreeMap::new(), BTreeMap::new());
    for (kind, setting, sigma) in KINDS
        .into_iter()
        .filter(|(kind, ..)| fixtures.iter().any(|fixture| fixture.kind == *kind))
    {
        let touched =
            |touch: &Touch| Some(fixture_of(touch)).filter(|fixture| fixture.kind == kind);
        names.insert(
            setting,
            touches
                .iter()
                .map(|touch| touched(touch).map(|fixture| fixture.name.clone()))
                .collect(),
        );
        let noise = |touch: &Touch| {
            touched(touch).map_or(f64::NAN, |fixture| {
                (1e-6 * fixture.sigma_um).max(LEAST_SIGMA)
            })
        };
        readings.insert(sigma, touches.iter().map(noise).collect());
    }
    let mut counts = vec![0; fixtures.len()];
    let mut name = |touch: &Touch| {
        counts[touch.fixture] += 1;
        format!("{}-{:04}", fixture_of(touch).name, counts[touch.fixture])
    };
    Recording {
        joints: robot.joints.len(),
        prismatic: robot
            .joints
            .iter()
            .map(|joint| joint.kind == JointKind::Prismatic)
            .collect(),
        sequence: (0..touches.len() as i64).collect(),
        point_id: touches.iter().map(&mut name).collect(),
        usage: touches
            .iter()
            .map(|touch| Some(fixture_of(touch).usage.clone()))
            .collect(),
        q: touches
            .iter()
            .flat_map(|touch| touch.q.iter().copied())
            .collect(),
        position: vec![[f64::NAN; 3]; touches.len()],
        time: Some(touches.iter().map(|touch| touch.time_s).collect()),
        temperature: Some(touches.iter().map(|touch| touch.temperature_c).collect()),
        readings,
        names,
        ..Recording::default()
    }
}

/// Where a fixture truly is, under the names that identified parameters have.
pub(super) fn truth(fixture: &Fixture) -> Vec<TruthRow> {
    let row = |ending: &str, value: f64| TruthRow {
        name: format!("anchor.{}.{ending}", fixture.name),
        effect: "anchor".into(),
        place: "anchor".into(),
        unit: "mm".into(),
        value,
    };
    let [x, y, z] = fixture.centre_mm;
    let centre = [row("x", x), row("y", y), row("z", z)];
    let radius = fixture
        .radius_mm
        .filter(|_| fixture.kind == FixtureKind::Sphere)
        .map(|radius| row("radius", radius));
    centre
        .into_iter()
        .filter(|_| fixture.kind != FixtureKind::Plane)
        .chain(radius)
        .collect()
}
