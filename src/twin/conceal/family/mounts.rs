//! What changes in time or in the log: heat, steps of mountings, the creeping tracker, logs that are behind.

use super::{Bench, Column, Draft, Form, fixed, link, sized};
use crate::effect::{
    BaseShift, Course, JointLogLag, ThermalGrowth, ThermalWarmUp, ToolShift, TrackerDrift,
    TrackerScale,
};
use crate::noise::Noise;

pub(super) fn thermal_growth(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let long = bench.long_links();
    let first = draw.index(long.len());
    // One link, or a run of neighbours that grow alike.
    let count = if draw.chance(0.4) { 2 } else { 1 };
    let links: Vec<usize> = long.into_iter().skip(first).take(count).collect();
    let (start, end) = (*links.first()?, *links.last()?);
    let place = if start == end {
        link(start)
    } else {
        format!("link {start}-{end}")
    };
    // What lies between the ends of a run grows too, as short as it may be.
    let links = start..=end;
    let strain = draw.uniform(8.0, 16.0);
    if form == Form::Obvious {
        let grown = links.map(|link| ThermalGrowth::effect(link, strain, 20.0));
        let draft = Draft::one("with temperature", "thermal_growth", place, grown.collect());
        return Some(draft.needing(&[Column::Temperature]));
    }
    let warm_up_h = draw.uniform(0.15, 0.6) * bench.end_s / 3600.0;
    let grown = links.map(|link| ThermalWarmUp::effect(link, 15.0 * strain, warm_up_h));
    let causes = vec![sized("thermal_growth", place, grown.collect())];
    Some(if draw.chance(0.5) {
        Draft::new("by its own warm-up, no temperature", causes)
            .needing(&[Column::Time])
            .hiding(Column::Temperature)
    } else {
        Draft::new("by its own warm-up", causes).needing(&[Column::Time])
    })
}

pub(super) fn tool_shift(bench: &Bench, _form: Form, draw: &mut Noise) -> Option<Draft> {
    let shift_um = draw.vector(30.0, 250.0).map(f64::round);
    let step = ToolShift::effect(shift_um, bench.moment(draw));
    Some(Draft::one("step", "tool_shift", "tool", vec![step]).needing(&[Column::Time]))
}

pub(super) fn base_shift(bench: &Bench, _form: Form, draw: &mut Noise) -> Option<Draft> {
    let (shift_um, turn_arcsec) = (
        draw.vector(30.0, 200.0).map(f64::round),
        draw.vector(2.0, 20.0),
    );
    let step = BaseShift::effect(shift_um, turn_arcsec, bench.moment(draw));
    let draft = Draft::one("step", "base_shift", "base", vec![step]);
    Some(draft.needing(&[Column::Time]))
}

pub(super) fn tracker_drift(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let (course, settling_h, name) = match (form, draw.chance(0.5)) {
        (Form::Obvious, true) => (
            Course::Settling,
            draw.uniform(0.15, 0.8) * bench.end_s / 3600.0,
            "settling",
        ),
        (Form::Obvious, false) => (Course::Linear, bench.end_s / 3600.0, "linear"),
        (Form::Other, _) => (Course::Root, bench.end_s / 3600.0, "with the root of time"),
    };
    let shift_um = draw.vector(40.0, 200.0).map(f64::round);
    let turn_arcsec = if draw.chance(0.5) {
        draw.vector(1.0, 8.0)
    } else {
        [0.0; 3]
    };
    let drift = TrackerDrift::effect(shift_um, turn_arcsec, settling_h, course);
    Some(Draft::one(name, "tracker_drift", "tracker", vec![drift]).needing(&[Column::Time]))
}

pub(super) fn joint_log_lag(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let (only, name) = match form {
        Form::Obvious => (None, "all joints"),
        Form::Other => (Some(bench.turning(draw)), "one joint"),
    };
    let lag = JointLogLag::effect(draw.size(1e-4, 1e-3), 0.0, only);
    Some(Draft::one(name, "joint_log_lag", "recording", vec![lag]))
}

/// Position data cannot tell a wrong metre from a larger robot: the one right answer is silence.
pub(super) fn tracker_scale(_bench: &Bench, _form: Form, draw: &mut Noise) -> Option<Draft> {
    let scale = TrackerScale::effect(draw.sign() * draw.size(1.0, 10.0));
    Some(Draft::new(
        "scale",
        vec![fixed("tracker_scale", "tracker".into(), vec![scale])],
    ))
}
