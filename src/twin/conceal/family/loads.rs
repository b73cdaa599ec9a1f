//! What loads do, and what is wrong about them: soft links, a soft base, balancers, masses.
//!
//! What changes in time or in the log: heat, steps of mountings, the creeping tracker, logs that are behind.

use crate::conceal::family::gears::springs;
use crate::conceal::family::{Bench, Column, Draft, Form, fixed, joint, link, sized};
use crate::effect::{
    Balancer, BaseCompliance, BaseShift, Counterbalance, Course, JointLogLag, LinkCompliance,
    LinkHinge, LinkMass, PayloadError, ThermalGrowth, ThermalWarmUp, ToolShift, TrackerDrift,
    TrackerScale,
};
use crate::noise::Noise;
use crate::truth::ARCSEC;

pub(super) fn link_compliance(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    // Bending needs a length, and a load that the next joint feels.
    let long: Vec<usize> = bench
        .long_links()
        .into_iter()
        .filter(|number| *number + 1 < bench.joints())
        .collect();
    let number = *long.get(draw.index(long.len()))?;
    let heavy = bench.peak[number - 1..]
        .iter()
        .copied()
        .fold(0.0, f64::max)
        .max(1e-9);
    let rad_per_nm = draw.size(10.0, 60.0) * ARCSEC / heavy;
    let (beam, name) = match form {
        Form::Obvious => (LinkHinge::effect(number, rad_per_nm), "at the middle"),
        Form::Other => {
            let torsion_rad_per_nm = if draw.chance(0.3) { rad_per_nm } else { 0.0 };
            let beam = LinkCompliance::effect(number, rad_per_nm, torsion_rad_per_nm);
            (beam, "cantilever")
        }
    };
    Some(Draft::one(
        name,
        "link_compliance",
        link(number),
        vec![beam],
    ))
}

pub(super) fn base_compliance(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let soft = draw.size(8.0, 50.0) * ARCSEC / bench.overturning.max(1e-9);
    let (rad_per_nm, pivot_mm, name) = match (form, draw.chance(0.5)) {
        (Form::Obvious, _) => ([soft; 2], [0.0; 3], "isotropic"),
        (Form::Other, true) => (
            [soft, soft * draw.size(0.25, 0.6)],
            [0.0; 3],
            "two stiffnesses",
        ),
        (Form::Other, false) => (
            [soft; 2],
            [0.0, 0.0, -draw.uniform(300.0, 1200.0).round()],
            "about a point below",
        ),
    };
    let base = BaseCompliance::effect(rad_per_nm, pivot_mm);
    Some(Draft::one(name, "base_compliance", "base", vec![base]))
}

/// The joint that carries most.
fn heaviest(bench: &Bench) -> Option<usize> {
    bench
        .loaded()
        .into_iter()
        .max_by(|a, b| bench.peak[a - 1].total_cmp(&bench.peak[b - 1]))
}

pub(super) fn counterbalance(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = heaviest(bench)?;
    let (balancer, name) = match form {
        Form::Obvious => (Balancer::Spring, "coil spring"),
        Form::Other => (Balancer::Gas, "gas strut"),
    };
    let torque_nm = draw.sign() * draw.uniform(0.15, 0.5) * bench.peak[number - 1];
    let phase_deg = draw.uniform(-40.0, 40.0).round();
    let spring = Counterbalance::effect(number, balancer, torque_nm, phase_deg);
    let mut causes = vec![fixed("counterbalance", joint(number), vec![spring])];
    causes.extend(springs(bench, draw));
    Some(Draft::new(name, causes).accepting("gear_cyclic", joint(number)))
}

pub(super) fn link_mass(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let carried: Vec<usize> = bench.loaded().into_iter().take(3).collect();
    let number = *carried.get(draw.index(carried.len()))?;
    let (mass_share, centre_mm, name) = match (form, draw.chance(0.5)) {
        (Form::Obvious, true) => (draw.sign() * 0.03, [0.0; 3], "mass by 3 %"),
        (Form::Obvious, false) => (draw.sign() * 0.1, [0.0; 3], "mass by 10 %"),
        (Form::Other, _) => (0.0, draw.vector(20.0, 60.0).map(f64::round), "centre"),
    };
    let heavy = LinkMass::effect(number, mass_share, centre_mm);
    let mut causes = vec![fixed("link_mass", link(number), vec![heavy])];
    causes.extend(springs(bench, draw));
    // Of neighbouring links only sums of moments show.
    let draft = carried
        .iter()
        .filter(|other| **other != number)
        .fold(Draft::new(name, causes), |draft, other| {
            draft.accepting("link_mass", link(*other))
        });
    Some(draft)
}

pub(super) fn payload_error(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let (mass_share, centre_mm, name) = match form {
        Form::Obvious => (draw.sign() * draw.uniform(0.04, 0.15), [0.0; 3], "mass"),
        Form::Other => (0.0, draw.vector(20.0, 60.0).map(f64::round), "centre"),
    };
    let wrong = PayloadError::effect(mass_share, centre_mm);
    let mut causes = vec![fixed("payload_error", "tool".into(), vec![wrong])];
    causes.extend(springs(bench, draw));
    Some(Draft::new(name, causes))
}

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
