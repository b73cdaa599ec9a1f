//! Friction that falls while the gear warms up.

use super::{COULOMB, FittedNumber, ShapeSpan, TorqueCause, TorqueForm, VISCOUS, about, fill};
use crate::dynamics::scene::DynamicScene;

/// exp(-t / T) times velocity and its sign; shape: T and the end of its search, `with` marks the form that stands in the rich model.
pub(super) struct Warmup;

/// s.
const TIMES: [f64; 9] = [2.0, 4.0, 8.0, 12.0, 18.0, 26.0, 40.0, 120.0, 400.0];
/// Share of the recording: what lasts longer is friction that stays.
const LONGEST: f64 = 0.45;
/// Share of the recording at which the search for it ends: what is best there is not known.
const END: f64 = 0.9;
/// s, the longest that stands in the rich model.
const USUAL: f64 = 18.0;

impl TorqueCause for Warmup {
    about! {
        name: "warmup_friction",
        coefficients: &[("viscous_cold", "Nm s/rad"), ("coulomb_cold", "Nm")],
        of_sign: true,
        modifies: &[VISCOUS, COULOMB],
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let longest = LONGEST * scene.duration();
        let times: Vec<f64> = TIMES.into_iter().filter(|time| *time <= longest).collect();
        let rich = times
            .iter()
            .copied()
            .rfind(|time| *time <= USUAL.max(longest / 3.0));
        let of = |joint| {
            let form = move |time: &f64| {
                let with = [usize::from(Some(*time) == rich), 0];
                TorqueForm {
                    with,
                    ..TorqueForm::at_joint(&Warmup, joint, 2)
                        .shaped(&[*time, END * scene.duration()])
                }
            };
            times.iter().map(form).collect::<Vec<_>>()
        };
        (0..scene.joints()).flat_map(of).collect()
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.with[0] == 1
    }

    fn spans(&self, form: &TorqueForm) -> Vec<ShapeSpan> {
        vec![ShapeSpan {
            name: "time",
            unit: "s",
            index: 0,
            least: 1.0,
            most: form.shape[1],
            by_ratio: true,
            usual: None,
        }]
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let velocity = &scene.velocity[form.joint()];
        let decay = |row: usize| (-scene.time[row] / form.shape[0]).exp();
        match column {
            0 => fill(out, |row| decay(row) * velocity[row]),
            _ => fill(out, |row| decay(row) * scene.direction(form.joint(), row)),
        }
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let [viscous, coulomb, time] = [fitted[0].value, fitted[1].value, form.shape[0]];
        format!(
            "friction of {} begins {coulomb:.3} Nm and {viscous:.3} Nm s/rad higher and falls over {time:.1} s",
            form.place
        )
    }
}
