//! The families of effects on positions, a row each: how likely physics of a natural size is drawn for the robot and the plan at hand, in
//! the form that a library expects and in others.

use super::{Column, Draft, DrawEffect, families, fixed, joint, link, spring, springs};
use crate::effect::*;
use crate::noise::Noise;
use crate::truth::ARCSEC;

families! {
    /// Families in canonical names; several rows of one name are different causes.
    FAMILIES: DrawEffect, |name, on, other, draw|
    paired "joint_compliance" {
        if other {
            return Some(Draft::new("all loaded joints", springs(on, draw)));
        }
        let number = on.bearing(draw)?;
        Draft::one("one joint", name, joint(number), [spring(on, number, draw.size(60.0, 250.0))])
    };
    alone "joint_hardening" {
        let number = on.bearing(draw)?;
        let peak = on.peak[number - 1];
        let (form, curve, scale_nm, amplitude_arcsec) = match (other, draw.chance(0.5)) {
            (false, true) => ("saturating", Curve::Tanh, peak * draw.uniform(0.15, 0.35), draw.size(20.0, 60.0)),
            (false, false) => ("progressive", Curve::Cubic, peak, draw.size(20.0, 50.0)),
            (true, true) => ("two slopes", Curve::TwoSlope, peak * draw.uniform(0.15, 0.4), draw.size(20.0, 60.0)),
            (true, false) => ("progressive, quadratic", Curve::Square, peak, draw.size(20.0, 50.0)),
        };
        let curve = JointHardening::effect(number, curve, amplitude_arcsec, scale_nm);
        Draft::one(form, name, joint(number), [curve]).over_spring(on, number, [150.0, 300.0], draw)
    };
    paired "gear_cyclic" {
        let (number, amplitude) = (on.turning(draw), draw.size(10.0, 60.0));
        let ripple = |order: usize, size: f64, draw: &mut Noise| GearCyclic::effect(number, order as f64, size, 0.0, draw.phase());
        let (form, effects) = match (other, draw.index(3)) {
            (false, _) => ("one low order", vec![ripple(1 + draw.index(4), amplitude, draw)]),
            (true, 0) => ("one high order", vec![ripple(8 + draw.index(17), amplitude, draw)]),
            (true, 1) => {
                let (low, high, share) = (1 + draw.index(3), 4 + draw.index(9), draw.uniform(0.5, 1.0));
                ("two orders", vec![ripple(low, amplitude, draw), ripple(high, share * amplitude, draw)])
            }
            (true, _) => {
                let (order, skew) = (2.0 + draw.index(3) as f64, draw.uniform(0.3, 0.6));
                ("eccentric wheel", vec![GearEccentricity::effect(number, order, amplitude, skew, draw.phase())])
            }
        };
        Draft::one(form, name, joint(number), effects)
    };
    paired "gear_motor_cyclic" {
        let (number, amplitude) = (on.turning(draw), draw.size(8.0, 40.0));
        let ripple = |order: f64, size: f64, phase_deg: f64| GearMotorCyclic::effect(number, order, size, phase_deg);
        let (first, second) = (draw.phase(), draw.phase());
        let (form, effects) = if other {
            ("two orders", vec![ripple(1.0, amplitude, first), ripple(2.0, draw.uniform(0.4, 1.0) * amplitude, second)])
        } else {
            ("one order", vec![ripple(1.0 + draw.index(2) as f64, amplitude, first)])
        };
        Draft::one(form, name, joint(number), effects)
    };
    paired "backlash" {
        let gap_arcsec = draw.size(20.0, 80.0);
        if !other {
            let number = on.turning(draw);
            let gap = Backlash::effect(number, gap_arcsec, 0.0, 0.0, 0.0);
            return Some(Draft::one("by direction", name, joint(number), [gap]).needing(&[Column::Direction]));
        }
        let number = on.bearing(draw)?;
        let peak = on.peak[number - 1];
        let (form, closing_nm, soft_nm) = match draw.index(3) {
            // Any torque at all decides the side.
            0 => ("by sign of load", 1e-6 * peak, 0.0),
            1 => ("by direction, by load where it is heavy", peak * draw.uniform(0.1, 0.4), 0.0),
            _ => ("by sign of load, soft", 0.0, peak * draw.uniform(0.03, 0.1)),
        };
        let draft = Draft::one(form, name, joint(number), [Backlash::effect(number, gap_arcsec, 0.0, closing_nm, soft_nm)]);
        // What saturates at little load is the same thing by two names.
        if form.starts_with("by sign") { draft.accepting("joint_hardening", joint(number)) } else { draft.needing(&[Column::Direction]) }
    };
    paired "axis_wobble" {
        let number = on.turning(draw);
        let (form, order, ellipse) = match other {
            false => ("in one plane", 1.0 + draw.index(2) as f64, 0.0),
            true => ("elliptic", 2.0, draw.uniform(0.4, 0.9)),
        };
        Draft::one(form, name, joint(number), [AxisWobble::effect(number, order, draw.size(8.0, 40.0), ellipse, draw.phase())])
    };
    paired "zero_shift" {
        let (number, step_arcsec) = (on.turning(draw), draw.sign() * draw.size(10.0, 80.0));
        let step = ZeroShift::effect(number, step_arcsec, on.moment(draw));
        let draft = Draft::one("step", name, joint(number), [step]).needing(&[Column::Time]);
        // A step of the first zero is a step of the whole arm about the same axis.
        if number == 1 { draft.accepting("base_shift", "base".into()) } else { draft }
    };
    alone "cable_drag" {
        let number = 3 + draw.index(on.joints().saturating_sub(3).max(1));
        if number >= on.joints() {
            return None;
        }
        let by = if draw.chance(0.5) { number - 1 } else { number + 1 };
        let (form, pull) = if other { ("bent by two joints", Pull::Bend) } else { ("hung over two joints", Pull::Swing) };
        let (lead, phase_deg) = (draw.sign() * draw.uniform(0.5, 1.0), draw.uniform(-60.0, 60.0).round());
        let hose = CableDrag::effect(number, by, lead, pull, draw.size(15.0, 80.0), 0.0, phase_deg);
        Draft::one(form, name, joint(number), [hose]).accepting("unknown", joint(number))
    };
    paired "link_compliance" {
        // Bending needs a length, and a load that the next joint feels.
        let long: Vec<usize> = on.long_links().into_iter().filter(|number| *number + 1 < on.joints()).collect();
        let number = *long.get(draw.index(long.len()))?;
        let heavy = on.peak[number - 1..].iter().copied().fold(0.0, f64::max).max(1e-9);
        let rad_per_nm = draw.size(10.0, 60.0) * ARCSEC / heavy;
        let (form, beam) = if other {
            let torsion_rad_per_nm = if draw.chance(0.3) { rad_per_nm } else { 0.0 };
            ("cantilever", LinkCompliance::effect(number, rad_per_nm, torsion_rad_per_nm))
        } else {
            ("at the middle", LinkHinge::effect(number, rad_per_nm))
        };
        Draft::one(form, name, link(number), [beam])
    };
    paired "base_compliance" {
        let soft = draw.size(8.0, 50.0) * ARCSEC / on.overturning.max(1e-9);
        let (form, rad_per_nm, pivot_mm) = match (other, draw.chance(0.5)) {
            (false, _) => ("isotropic", [soft; 2], [0.0; 3]),
            (true, true) => ("two stiffnesses", [soft, soft * draw.size(0.25, 0.6)], [0.0; 3]),
            (true, false) => ("about a point below", [soft; 2], [0.0, 0.0, -draw.uniform(300.0, 1200.0).round()]),
        };
        Draft::one(form, name, "base", [BaseCompliance::effect(rad_per_nm, pivot_mm)])
    };
    alone "counterbalance" {
        let number = on.loaded().into_iter().max_by(|a, b| on.peak[a - 1].total_cmp(&on.peak[b - 1]))?;
        let (form, balancer) = if other { ("gas strut", Balancer::Gas) } else { ("coil spring", Balancer::Spring) };
        let torque_nm = draw.sign() * draw.uniform(0.15, 0.5) * on.peak[number - 1];
        let spring = Counterbalance::effect(number, balancer, torque_nm, draw.uniform(-40.0, 40.0).round());
        Draft::on_springs(form, name, joint(number), spring, on, draw).accepting("gear_cyclic", joint(number))
    };
    alone "link_mass" {
        let carried: Vec<usize> = on.loaded().into_iter().take(3).collect();
        let number = *carried.get(draw.index(carried.len()))?;
        let (form, mass_share, centre_mm) = match (other, draw.chance(0.5)) {
            (false, true) => ("mass by 3 %", draw.sign() * 0.03, [0.0; 3]),
            (false, false) => ("mass by 10 %", draw.sign() * 0.1, [0.0; 3]),
            (true, _) => ("centre", 0.0, draw.vector(20.0, 60.0).map(f64::round)),
        };
        let draft = Draft::on_springs(form, name, link(number), LinkMass::effect(number, mass_share, centre_mm), on, draw);
        // Of neighbouring links only sums of moments show.
        carried.iter().filter(|other| **other != number).fold(draft, |draft, other| draft.accepting(name, link(*other)))
    };
    alone "payload_error" {
        let (form, mass_share, centre_mm) = match other {
            false => ("mass", draw.sign() * draw.uniform(0.04, 0.15), [0.0; 3]),
            true => ("centre", 0.0, draw.vector(20.0, 60.0).map(f64::round)),
        };
        Draft::on_springs(form, name, "tool", PayloadError::effect(mass_share, centre_mm), on, draw)
    };
    paired "thermal_growth" {
        let long = on.long_links();
        let first = draw.index(long.len());
        // One link, or a run of neighbours that grow alike; what lies between its ends grows too, as short as it may be.
        let count = if draw.chance(0.4) { 2 } else { 1 };
        let links: Vec<usize> = long.into_iter().skip(first).take(count).collect();
        let (start, end) = (*links.first()?, *links.last()?);
        let place = if start == end { link(start) } else { format!("link {start}-{end}") };
        let strain = draw.uniform(8.0, 16.0);
        if !other {
            let grown: Vec<Physical> = (start..=end).map(|link| ThermalGrowth::effect(link, strain, 20.0)).collect();
            return Some(Draft::one("with temperature", name, place, grown).needing(&[Column::Temperature]));
        }
        let warm_up_h = draw.uniform(0.15, 0.6) * on.end_s / 3600.0;
        let grown: Vec<Physical> = (start..=end).map(|link| ThermalWarmUp::effect(link, 15.0 * strain, warm_up_h)).collect();
        let (form, hidden): (_, &[Column]) = match draw.chance(0.5) {
            true => ("by its own warm-up, no temperature", &[Column::Temperature]),
            false => ("by its own warm-up", &[]),
        };
        Draft { hides: hidden.to_vec(), ..Draft::one(form, name, place, grown).needing(&[Column::Time]) }
    };
    paired "tool_shift" {
        let shift_um = draw.vector(30.0, 250.0).map(f64::round);
        Draft::one("step", name, "tool", [ToolShift::effect(shift_um, on.moment(draw))]).needing(&[Column::Time])
    };
    paired "base_shift" {
        let (shift_um, turn_arcsec) = (draw.vector(30.0, 200.0).map(f64::round), draw.vector(2.0, 20.0));
        Draft::one("step", name, "base", [BaseShift::effect(shift_um, turn_arcsec, on.moment(draw))]).needing(&[Column::Time])
    };
    paired "tracker_drift" {
        let (form, course, settling_h) = match (other, draw.chance(0.5)) {
            (false, true) => ("settling", Course::Settling, draw.uniform(0.15, 0.8) * on.end_s / 3600.0),
            (false, false) => ("linear", Course::Linear, on.end_s / 3600.0),
            (true, _) => ("with the root of time", Course::Root, on.end_s / 3600.0),
        };
        let shift_um = draw.vector(40.0, 200.0).map(f64::round);
        let turn_arcsec = if draw.chance(0.5) { draw.vector(1.0, 8.0) } else { [0.0; 3] };
        let drift = TrackerDrift::effect(shift_um, turn_arcsec, settling_h, course);
        Draft::one(form, name, "tracker", [drift]).needing(&[Column::Time])
    };
    alone "joint_log_lag" {
        let (form, only) = if other { ("one joint", Some(on.turning(draw))) } else { ("all joints", None) };
        Draft::one(form, name, "recording", [JointLogLag::effect(draw.size(1e-4, 1e-3), 0.0, only)])
    };
    // Position data cannot tell a wrong metre from a larger robot: the one right answer is silence.
    alone "tracker_scale" {
        Draft::new("scale", vec![fixed(name, "tracker".into(), [TrackerScale::effect(draw.sign() * draw.size(1.0, 10.0))])])
    };
    // A bump and a hinge are tables of no formula, too.
    alone "unknown" {
        let number = on.turning(draw);
        let [lower, upper] = on.ranges_deg[number - 1];
        let (centre_deg, width_deg) = (on.angle(number, draw).round(), (draw.uniform(0.06, 0.16) * (upper - lower)).round());
        let bump = JointBump::effect(number, draw.sign() * draw.size(40.0, 200.0), centre_deg, width_deg);
        Draft::one("bump", name, joint(number), [bump]).accepting("joint_table", joint(number))
    };
    alone "unknown" {
        let number = on.turning(draw);
        let from_deg = on.angle(number, draw).round();
        let hinge = JointHinge::effect(number, from_deg, draw.sign() * draw.size(30.0, 150.0));
        Draft::one("hinge", name, joint(number), [hinge]).accepting("joint_table", joint(number))
    };
    alone "unknown" {
        let (number, second) = (2 + draw.index(on.joints() - 2), 1 + draw.index(on.joints()));
        if second == number {
            return None;
        }
        let product = JointProduct::effect(number, [number, second], draw.sign() * draw.size(10.0, 60.0));
        Draft::one("product of two angles", name, joint(number), [product]).accepting("cable_drag", joint(number))
    };
    // The tracker's stand may swing as well as the base, in the next list the base as well as the stand.
    alone "unknown" {
        let period_s = (on.end_s / draw.uniform(2.0, 6.0)).round();
        let (shift_um, turn_arcsec) = stand(20.0, draw);
        let sway = BaseSway::effect(shift_um, turn_arcsec, period_s, draw.phase());
        Draft::one("slow swing", name, "base", [sway]).needing(&[Column::Time]).accepting(name, "tracker".into())
    };
}

/// A motion of a stand: along, um, or about its origin by so many arcsec at most.
fn stand(most_arcsec: f64, draw: &mut Noise) -> ([f64; 3], [f64; 3]) {
    if draw.chance(0.5) {
        (draw.vector(30.0, 150.0).map(f64::round), [0.0; 3])
    } else {
        ([0.0; 3], draw.vector(3.0, most_arcsec))
    }
}

/// Mean time from point to point, s, and travel of a joint in it, rad, about.
const PACE_S: f64 = 19.0;
const TRAVEL_RAD: f64 = 0.8;
/// Usual rise of the arm's temperature, K.
const RISE_K: f64 = 12.0;

families! {
    /// Families of physics that no list of effects holds yet: instruments, memory, interactions.
    BEYOND: DrawEffect, |name, on, other, draw|
    alone "tracker_circle" {
        let (form, circle) = match (other, draw.chance(0.5)) {
            (false, _) => ("eccentric", Circle::Eccentric),
            (true, true) => ("elliptic", Circle::Elliptic),
            (true, false) => ("centre off the axis", Circle::OffCentre),
        };
        Draft::one(form, name, "tracker", [TrackerCircle::effect(circle, draw.size(4.0, 40.0), draw.phase())])
    };
    alone "tracker_elevation" {
        let (size, second) = (draw.sign() * draw.size(5.0, 40.0), draw.uniform(-1.0, 1.0));
        let (form, head) = match (other, draw.chance(0.5)) {
            (false, _) => ("index and sag", TrackerElevation::effect(size * second, size, 0.0, 0.0, 0.0)),
            (true, true) => ("eccentric vertical circle", TrackerElevation::effect(0.0, 0.0, size, draw.phase(), 0.0)),
            (true, false) => ("tilted transit axis", TrackerElevation::effect(0.0, 0.0, 0.0, 0.0, size)),
        };
        Draft::one(form, name, "tracker", [head])
    };
    alone "tracker_offset" {
        let size = draw.sign() * draw.size(30.0, 300.0);
        let usual = TrackerOffset::default();
        let (form, ranges) = match (other, draw.chance(0.5)) {
            (false, _) => ("dead path", TrackerOffset { constant_um: size, ..usual }),
            (true, true) => {
                let (wave_mm, phase_deg) = (draw.size(300.0, 1500.0).round(), draw.phase());
                ("cyclic", TrackerOffset { cyclic_um: 0.3 * size, wave_mm, phase_deg, ..usual })
            }
            (true, false) => ("square of the range", TrackerOffset { um_per_m2: 0.2 * size, ..usual }),
        };
        Draft::one(form, name, "tracker", [Physical::TrackerOffset(ranges)])
    };
    alone "tracker_refraction" {
        let um_per_m_k = draw.sign() * draw.uniform(0.8, 1.2);
        let air = |lag_s, rise_k, warm_up_h| [TrackerRefraction::effect(um_per_m_k, 20.0, lag_s, rise_k, warm_up_h)];
        let (form, air, needs): (_, _, &[Column]) = match (other, draw.chance(0.5)) {
            (false, _) => ("with the logged temperature", air(0.0, 0.0, 1.0), &[Column::Temperature]),
            (true, true) => {
                let lag_s = (on.end_s * draw.uniform(0.05, 0.2)).round();
                ("behind the logged temperature", air(lag_s, 0.0, 1.0), &[Column::Temperature, Column::Time])
            }
            (true, false) => {
                let warm_up_h = draw.uniform(0.15, 0.6) * on.end_s / 3600.0;
                ("air that warms by its own", air(0.0, 12.0, warm_up_h), &[Column::Time])
            }
        };
        Draft::one(form, name, "tracker", air).needing(needs)
    };
    alone "unknown" {
        let (shift_um, turn_arcsec) = stand(15.0, draw);
        let (period_s, phase_deg) = ((on.end_s / draw.uniform(2.0, 6.0)).round(), draw.phase());
        let (form, fading_s) = if other { ("fading swing", (draw.uniform(0.3, 0.8) * on.end_s).round()) } else { ("slow swing", 0.0) };
        let sway = TrackerSway::effect(shift_um, turn_arcsec, period_s, phase_deg, fading_s);
        Draft::one(form, name, "tracker", [sway]).needing(&[Column::Time]).accepting(name, "base".into())
    };
    alone "base_shift" {
        let (shift_um, turn_arcsec) = (draw.vector(30.0, 150.0).map(f64::round), draw.vector(2.0, 15.0));
        let (form, back_share) = if other { ("knock, settling back in part", draw.uniform(0.3, 0.7)) } else { ("knock", 0.0) };
        let back_s = (draw.uniform(0.05, 0.15) * on.end_s).round().max(1.0);
        let knock = TrackerKnock::effect(shift_um, turn_arcsec, on.moment(draw), back_share, back_s);
        Draft::one(form, name, "base", [knock]).needing(&[Column::Time]).accepting("tracker_drift", "tracker".into())
    };
    alone "presliding" {
        let number = on.turning(draw);
        let (amplitude_arcsec, travel) = (draw.size(10.0, 60.0), draw.size(0.5, 4.0));
        let (form, dahl_deg, slip_deg) = match other {
            false => ("Dahl", travel, Vec::new()),
            true => ("Maxwell slip", 0.0, (0..3 + draw.index(2)).map(|_| travel * draw.size(0.3, 3.0)).collect()),
        };
        let friction = Presliding::effect(number, amplitude_arcsec, dahl_deg, slip_deg);
        Draft::one(form, name, joint(number), [friction]).needing(&[Column::Direction])
    };
    alone "joint_warming" {
        let (number, time_s) = (on.turning(draw), draw.uniform(0.06, 0.25) * on.end_s);
        let usual = TRAVEL_RAD * time_s / PACE_S;
        let (form, heat) = match other {
            false => ("own work", warming(number, Heat::Work, time_s)),
            true => {
                let (oil_s, full) = ((time_s * draw.uniform(0.1, 0.4)).round(), usual * draw.uniform(0.5, 1.0));
                ("casing and oil, saturating", JointWarming { oil_s, full, ..warming(number, Heat::Oil, time_s) })
            }
        };
        let warm = Physical::JointWarming(off(heat, usual, draw));
        Draft::one(form, name, joint(number), [warm]).needing(&[Column::Time])
    };
    alone "joint_warming" {
        let (number, time_s) = (on.turning(draw), draw.uniform(0.04, 0.2) * on.end_s);
        let first = off(warming(number, Heat::Temperature, time_s), RISE_K, draw);
        let (form, parts) = match other {
            false => ("behind the temperature", vec![first]),
            true => {
                let second = JointWarming { time_s: (time_s * draw.uniform(3.0, 6.0)).round(), ..first.clone() };
                ("behind the temperature by two times", vec![first, second])
            }
        };
        let parts: Vec<Physical> = parts.into_iter().map(Physical::JointWarming).collect();
        Draft::one(form, name, joint(number), parts).needing(&[Column::Temperature, Column::Time])
    };
    alone "thermal_growth" {
        let number = on.long_link(draw)?;
        let (form, core_s) = if other { ("skin and core", draw.uniform(0.2, 0.5) * on.end_s) } else { ("behind the temperature", 0.0) };
        let (um_per_m_k, lag_s) = (draw.uniform(8.0, 16.0), draw.uniform(0.05, 0.2) * on.end_s);
        let growth = ThermalLag::effect(number, um_per_m_k, 20.0, lag_s.round(), core_s.round());
        Draft::one(form, name, link(number), [growth]).needing(&[Column::Temperature, Column::Time])
    };
    alone "gear_load" {
        let number = on.bearing(draw)?;
        let peak = on.peak[number - 1].max(1e-9);
        let (order, phase_deg) = (1.0 + draw.index(5) as f64, draw.phase());
        let (form, full_nm) = if other { ("with the load, saturating", peak * draw.uniform(0.2, 0.5)) } else { ("with the load", 0.0) };
        Draft::one(form, name, joint(number), [GearLoad::effect(number, order, draw.size(15.0, 60.0) / peak, phase_deg, full_nm)])
    };
    alone "gear_flank" {
        let number = on.turning(draw);
        let flank = |order: usize, size: f64, draw: &mut Noise| GearFlank::effect(number, order as f64, size, draw.phase());
        let (first, size) = (1 + draw.index(4), draw.size(10.0, 50.0));
        let mut waves = vec![flank(first, size, draw)];
        if other {
            let (second, share) = (first + 1 + draw.index(4), draw.uniform(0.5, 1.0));
            waves.push(flank(second, share * size, draw));
        }
        Draft::one(if other { "two orders" } else { "one order" }, name, joint(number), waves).needing(&[Column::Direction])
    };
    alone "joint_warming" {
        let number = on.turning(draw);
        let ratio_arcsec_per_rad = draw.sign() * draw.size(15.0, 80.0) / RISE_K;
        let warm = JointWarming { ratio_arcsec_per_rad, ..warming(number, Heat::Temperature, 0.0) };
        let (form, warm) = match other {
            false => ("ratio with temperature", warm),
            true => ("ratio with temperature, saturating", JointWarming { full: draw.uniform(5.0, 10.0), ..warm }),
        };
        Draft::one(form, name, joint(number), [Physical::JointWarming(warm)]).needing(&[Column::Temperature])
    };
    alone "joint_warming" {
        let number = on.bearing(draw)?;
        let softening_rad_per_nm = on.softness(number, draw.size(20.0, 80.0)) / RISE_K;
        let warm = JointWarming { softening_rad_per_nm, ..warming(number, Heat::Temperature, 0.0) };
        let (form, warm) = match other {
            false => ("spring with temperature", warm),
            true => ("spring with temperature, saturating", JointWarming { full: draw.uniform(5.0, 10.0), ..warm }),
        };
        Draft::one(form, name, joint(number), [Physical::JointWarming(warm)])
            .over_spring(on, number, [60.0, 200.0], draw)
            .needing(&[Column::Temperature])
            .accepting("joint_compliance", joint(number))
    };
    alone "backlash" {
        let (number, size) = (on.bearing(draw)?, draw.size(20.0, 80.0));
        let (form, gap) = match other {
            false => ("spring by direction", JointHysteresis::effect(number, -2.0 * on.softness(number, size))),
            true => {
                let arcsec_per_nm = 2.0 * size / on.peak[number - 1].max(1e-9);
                ("loop that opens with the load", Backlash::effect(number, 0.0, arcsec_per_nm, 0.0, 0.0))
            }
        };
        Draft::one(form, name, joint(number), [gap])
            .over_spring(on, number, [60.0, 200.0], draw)
            .needing(&[Column::Direction])
            .accepting("joint_hardening", joint(number))
    };
    alone "backlash" {
        let number = on.turning(draw);
        let (form, time_s) = if other { ("grows and settles", draw.uniform(0.15, 0.5) * on.end_s) } else { ("grows with time", on.end_s) };
        let gap = BacklashGrowth::effect(number, draw.size(20.0, 80.0), draw.uniform(0.1, 0.4), time_s.round(), other);
        Draft::one(form, name, joint(number), [gap])
            .needing(&[Column::Direction, Column::Time])
            .accepting("unknown", joint(number))
    };
    alone "unknown" {
        let number = on.long_link(draw)?;
        let (form, power) = if other { ("by the squared cosine of the next joint", 2) } else { ("by the cosine of the next joint", 1) };
        Draft::one(form, name, link(number), [ThermalBow::effect(number, draw.uniform(8.0, 16.0), 20.0, power)])
            .needing(&[Column::Temperature])
            .accepting("thermal_growth", link(number))
    };
}

/// A joint that warms in this way and is off by nothing yet.
fn warming(number: usize, heat: Heat, time_s: f64) -> JointWarming {
    JointWarming {
        joint: number,
        heat,
        time_s: time_s.round(),
        oil_s: 0.0,
        full: 0.0,
        reference_c: 20.0,
        zero_arcsec: 0.0,
        ratio_arcsec_per_rad: 0.0,
        softening_rad_per_nm: 0.0,
    }
}

/// So many arcsec (per rad) at a usual warmth, of the zero or of the ratio.
fn off(mut warming: JointWarming, usual: f64, draw: &mut Noise) -> JointWarming {
    let size = draw.sign() * draw.size(15.0, 80.0) / usual;
    if draw.chance(0.6) {
        warming.zero_arcsec = size;
    } else {
        warming.ratio_arcsec_per_rad = size;
    }
    warming
}
