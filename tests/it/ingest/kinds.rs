//! Targets, orientations, some axes and distances arrive as the file has them; what is missing beside them is said.

use super::{faults_of, refusal, rr, take};
use crate::answer::{has, starts_with};
use crate::desk::Desk;
use nalgebra::{Rotation3, Vector3};

const COLUMNS: &str = r#"
files:
  - file: a.csv
    columns:
      q: {column: "q{j}", unit: deg}
"#;

fn with(lines: &str) -> String {
    format!("{COLUMNS}{lines}")
}

fn faults(lines: &str) -> String {
    faults_of(&with(lines)).join("\n")
}

const POINT: &str = "      x: {column: x, unit: mm, optional: true}\n      y: {column: y, unit: mm, optional: true}\n      z: {column: z, unit: mm, optional: true}\n";

#[test]
fn targets_and_gaps_arrive_by_row() {
    let yaml = with(&format!(
        "      target: {{column: smr, optional: true}}\n{POINT}"
    ));
    let desk = Desk::default().with(
        "a.csv",
        "q1,q2,smr,x,y,z\n1,2,A,10,20,30\n1,2,B,,,35\n1,2,,1,2,3\n5,6,A,,,\n",
    );
    let taken = take(&desk, &yaml, rr()).unwrap();
    assert_eq!(
        taken.recording.target,
        Some(vec![Some("A".into()), Some("B".into()), None])
    );
    assert_eq!(taken.recording.position[1][2], 0.035);
    assert!(
        taken.recording.position[1][0].is_nan()
            && taken.recording.point(1).is_none()
            && taken.recording.point(2).is_some()
    );
    assert_eq!(
        taken.rejected.0[0].detail,
        "nothing was measured in this row"
    );
}

#[test]
fn all_conventions_of_orientation_are_one_rotation() {
    let lines = "      sigma_orientation: {value: 20, unit: arcsec}\n";
    let by = |orientation: &str, cells: &str| {
        let yaml = with(&format!("      orientation: {orientation}\n{lines}"));
        let desk = Desk::default().with("a.csv", format!("q1,q2,a,b,c,d\n1,2,{cells}\n"));
        let taken = take(&desk, &yaml, rr()).unwrap();
        assert!(
            (taken.recording.readings["sigma_orientation"][0] - 20.0 / 206_264.806).abs() < 1e-12
        );
        Vector3::from_column_slice(&taken.recording.readings["orientation"])
    };
    let rpy = by("{rpy: [a, b, c], unit: deg}", "30,-20,100,");
    let ours = Rotation3::new(rpy) * Vector3::new(1.0, 0.0, 0.0);
    // Rz(100) Ry(-20) Rx(30) takes x to cos(20) (cos 100, sin 100) and up by sin 20.
    let expected = Vector3::new(-0.163_175_911, 0.925_416_578, 0.342_020_143);
    assert!((ours - expected).norm() < 1e-8, "{ours}");
    assert!(
        (by(
            "{rotation_vector: [a, b, c], unit: rad}",
            &format!("{},{},{},", rpy.x, rpy.y, rpy.z)
        ) - rpy)
            .norm()
            < 1e-12
    );
    // The same angles about moving axes in the other order are fixed ones in this: Rx(30) Ry(-20) Rz(100) takes z to
    // (sin -20, -sin 30 cos 20, cos 30 cos 20).
    let moving =
        Rotation3::new(by("{euler_xyz: [a, b, c], unit: deg}", "30,-20,100,")) * Vector3::z();
    assert!(
        (moving - Vector3::new(-0.342_020_143, -0.469_846_310, 0.813_797_681)).norm() < 1e-8,
        "{moving}"
    );
    let turned = nalgebra::UnitQuaternion::from_scaled_axis(rpy);
    let cells = format!("{},{},{},{}", turned.w, turned.i, turned.j, turned.k);
    assert!((by("{quaternion: [a, b, c, d]}", &cells) - rpy).norm() < 1e-9);
}

#[test]
fn images_of_a_camera_need_their_noise_and_no_unit() {
    let lines = "      image_x: {column: u}\n      image_y: {column: v, unit: \"1\"}\n";
    let desk = || {
        Desk::default().with(
            "a.csv",
            "q1,q2,u,v\n1,2,0.25,-0.125\n3,4,12,0\n5,6,0.5,\n7,8,0,1e-3\n",
        )
    };
    let yaml = with(&format!("{lines}      sigma_image: {{value: 5.0e-6}}\n"));
    let taken = take(&desk(), &yaml, rr()).unwrap();
    assert_eq!(taken.recording.readings["image_x"], [0.25, 0.0]);
    assert_eq!(taken.recording.readings["image_y"], [-0.125, 1e-3]);
    assert_eq!(taken.recording.readings["sigma_image"], [5e-6; 2]);
    let details = taken.rejected.0.iter().map(|row| row.detail.as_str());
    let details: Vec<&str> = details.collect();
    starts_with(details[0], "u: `12`; allowed: -10 to 10");
    assert_eq!(details[1..], ["v is blank"]);
    let asked = "map `image_x`, `image_y` and `sigma_image` together";
    has(&faults(lines), asked);
}

#[test]
fn distances_need_no_point_and_half_an_orientation_is_refused() {
    let distance = "      distance: {column: l, unit: mm}\n      sigma_distance: {value: 0.05, unit: mm}\n      anchor: {column: box}\n";
    let desk = Desk::default().with("a.csv", "q1,q2,l,box\n1,2,1500,N\n3,4,1400.5,S\n");
    let taken = take(&desk, &with(distance), rr()).unwrap();
    assert_eq!(taken.recording.readings["distance"], [1.5, 1.4005]);
    assert_eq!(
        taken.recording.names["anchor"],
        [Some("N".to_string()), Some("S".into())]
    );
    let mut axes = taken.recording.position.iter().flatten();
    assert!(axes.all(|axis| axis.is_nan()));
    let turn = "      orientation: {quaternion: [a, b, c, d], optional: true}\n      sigma_orientation: {value: 1, unit: mrad}\n";
    let desk = Desk::default().with("a.csv", "q1,q2,a,b,c,d\n1,2,1,0,0,\n3,4,1,0,0,0.2\n");
    let message = refusal(&desk, &with(turn), rr());
    has(&message, "the orientation is incomplete");
}

#[test]
fn what_belongs_together_is_asked_for_together() {
    let alone = faults("      distance: {column: l, unit: mm}\n");
    has(&alone, "map `distance` and `sigma_distance` together");
    let two = faults(
        "      orientation: {rpy: [a, b, c], quaternion: [d, e, f, g], unit: deg}\n      sigma_orientation: {value: 1, unit: deg}\n",
    );
    has(
        &two,
        "say `quaternion: [w, x, y, z]`, `rpy: [roll, pitch, yaw]`, `euler_xyz",
    );
    let height = faults("      z: {column: z, unit: mm}\n");
    has(&height, "not mapped: x, y");
    assert_eq!(faults("      z: {column: z, unit: mm}\naxes: [z]\n"), "");
    let unread = faults(&format!("{POINT}axes: [z]\n"));
    let expected = "files[0].columns.x: `axes: [z]` says that x was not measured; take `x` out of `columns`, or add it to `axes`\n\
                    files[0].columns.y: `axes: [z]` says that y";
    starts_with(&unread, expected);
    assert_eq!(
        faults("      z: {column: z, unit: mm}\naxes: [z, z]\n"),
        "axes[1]: `z` is named twice"
    );
    let none = faults(&format!("{POINT}axes: []\n"));
    starts_with(&none, "axes: no axis; name those that were measured");
    let anchor = faults(&format!("{POINT}      anchor: {{column: box}}\n"));
    has(&anchor, "an anchor is the end of a `distance`");
}

#[test]
fn both_angles_of_a_level_arrive_and_one_alone_is_refused() {
    let columns = "      tilt_x: {column: a, unit: mrad, optional: true}\n      tilt_y: {column: b, unit: mrad, optional: true}\n      sigma_tilt: {value: 20, unit: arcsec}\n";
    let desk = Desk::default().with(
        "a.csv",
        "q1,q2,a,b\n1,2,-12.5,300\n3,4,7,\n5,6,0,1\n7,8,1,2\n",
    );
    let taken = take(&desk, &with(columns), rr()).unwrap();
    assert_eq!(taken.recording.readings["tilt_x"], [-0.0125, 0.0, 0.001]);
    assert_eq!(taken.recording.readings["tilt_y"], [0.3, 0.001, 0.002]);
    assert_eq!(taken.rejected.0[0].detail, "the inclination is incomplete");
    let alone = faults("      tilt_x: {column: a, unit: mrad}\n");
    has(&alone, "map all of tilt_x, tilt_y, or none");
}
