//! A constant torque that no mass explains: the zero of a current or torque sensor.

use super::{
    FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, at_each_joint, at_each_joint_with,
    fill,
};
use crate::dynamics::scene::DynamicScene;

/// Its name.
pub(crate) const OFFSET: &str = "current_offset";

/// A constant torque that no mass explains: the zero of a current or torque sensor. With a shape (s, and the end of its search) a part of it
/// comes only as the sensor warms up.
pub(super) struct Offset;

/// s.
const TIMES: [f64; 3] = [5.0, USUAL, 45.0];
/// s, of the form that stands in the rich model.
const USUAL: f64 = 15.0;
/// Share of the recording: a zero that moves for longer is one that stays.
const LONGEST: f64 = 0.45;
/// Share of the recording at which the search for it ends: what is best there is not known.
const END: f64 = 0.9;

impl TorqueCause for Offset {
    about! { name: OFFSET, coefficients: &[("offset", "Nm"), ("cold", "Nm")], of_angle: true }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let longest = LONGEST * scene.duration();
        let times: Vec<[f64; 2]> = TIMES
            .into_iter()
            .filter(|time| *time <= longest)
            .map(|time| [time, END * scene.duration()])
            .collect();
        let times: Vec<&[f64]> = times.iter().map(|shape| &shape[..]).collect();
        let steady = at_each_joint(&Offset, scene, 1);
        steady
            .into_iter()
            .chain(at_each_joint_with(&Offset, scene, 2, &times))
            .collect()
    }

    fn price(&self, form: &TorqueForm) -> f64 {
        if form.width == 1 { 0.0 } else { 4.0 }
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.width == 1 || form.shape[0] == USUAL
    }

    fn spans(&self, form: &TorqueForm) -> Vec<ShapeSpan> {
        let span = |most: &f64| ShapeSpan {
            name: "time",
            unit: "s",
            index: 0,
            least: 2.0,
            most: *most,
            by_ratio: true,
            usual: None,
        };
        form.shape.get(1).map(span).into_iter().collect()
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        match column {
            0 => out.fill(1.0),
            _ => fill(out, |row| (-scene.time[row] / form.shape[0]).exp()),
        }
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let (size, how) = (
            fitted[0].value.abs(),
            if fitted[0].value < 0.0 {
                "little"
            } else {
                "much"
            },
        );
        let constant = format!(
            "the torque of {} reads {size:.3} Nm too {how}, whatever it does",
            form.place
        );
        match fitted.get(1) {
            None => constant,
            Some(cold) => {
                format!(
                    "{constant}; it begins {:.3} Nm from that and comes there over {:.1} s",
                    cold.value, form.shape[0]
                )
            }
        }
    }
}
