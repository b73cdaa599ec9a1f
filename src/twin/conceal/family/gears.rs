//! What sits on a joint: its gear, its encoder, its bearing, its zero, its hoses.

use super::{Bench, Cause, Column, Draft, Form, fixed, joint, sized};
use crate::effect::{
    AxisWobble, Backlash, CableDrag, Curve, GearCyclic, GearEccentricity, GearMotorCyclic,
    JointCompliance, JointHardening, Physical, Pull, ZeroShift,
};
use crate::noise::Noise;

/// The linear spring of a joint that turns by so many arcsec under its largest torque.
pub(super) fn spring(bench: &Bench, number: usize, arcsec: f64) -> Physical {
    JointCompliance::effect(number, bench.softness(number, arcsec))
}

/// The springs of all loaded joints, of their natural size.
pub(super) fn springs(bench: &Bench, draw: &mut Noise) -> Vec<Cause> {
    let all = bench.loaded().into_iter();
    all.map(|number| {
        fixed(
            "joint_compliance",
            joint(number),
            vec![spring(bench, number, draw.size(60.0, 250.0))],
        )
    })
    .collect()
}

pub(super) fn joint_compliance(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    if form == Form::Other {
        return Some(Draft::new("all loaded joints", springs(bench, draw)));
    }
    let number = bench.bearing(draw)?;
    let cause = sized(
        "joint_compliance",
        joint(number),
        vec![spring(bench, number, draw.size(60.0, 250.0))],
    );
    Some(Draft::new("one joint", vec![cause]))
}

pub(super) fn joint_hardening(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.bearing(draw)?;
    let peak = bench.peak[number - 1];
    let (curve, scale_nm, amplitude_arcsec, name) = match (form, draw.chance(0.5)) {
        (Form::Obvious, true) => (
            Curve::Tanh,
            peak * draw.uniform(0.15, 0.35),
            draw.size(20.0, 60.0),
            "saturating",
        ),
        (Form::Obvious, false) => (Curve::Cubic, peak, draw.size(20.0, 50.0), "progressive"),
        (Form::Other, true) => (
            Curve::TwoSlope,
            peak * draw.uniform(0.15, 0.4),
            draw.size(20.0, 60.0),
            "two slopes",
        ),
        (Form::Other, false) => (
            Curve::Square,
            peak,
            draw.size(20.0, 50.0),
            "progressive, quadratic",
        ),
    };
    let curve = JointHardening::effect(number, curve, amplitude_arcsec, scale_nm);
    let linear = fixed(
        "joint_compliance",
        joint(number),
        vec![spring(bench, number, draw.size(150.0, 300.0))],
    );
    // Whoever names the curve may count its slope to it.
    let linear = Cause {
        wanted: false,
        ..linear
    };
    Some(Draft::new(
        name,
        vec![sized("joint_hardening", joint(number), vec![curve]), linear],
    ))
}

fn ripple(number: usize, order: f64, amplitude_arcsec: f64, draw: &mut Noise) -> Physical {
    let phase_deg = draw.uniform(-180.0, 180.0).round();
    GearCyclic::effect(number, order, amplitude_arcsec, 0.0, phase_deg)
}

pub(super) fn gear_cyclic(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let amplitude = draw.size(10.0, 60.0);
    let (effects, name) = match (form, draw.index(3)) {
        (Form::Obvious, _) => {
            let order = 1.0 + draw.index(4) as f64;
            (
                vec![ripple(number, order, amplitude, draw)],
                "one low order",
            )
        }
        (Form::Other, 0) => {
            let order = 8.0 + draw.index(17) as f64;
            (
                vec![ripple(number, order, amplitude, draw)],
                "one high order",
            )
        }
        (Form::Other, 1) => {
            let (low, high) = (1.0 + draw.index(3) as f64, 4.0 + draw.index(9) as f64);
            let share = draw.uniform(0.5, 1.0);
            (
                vec![
                    ripple(number, low, amplitude, draw),
                    ripple(number, high, share * amplitude, draw),
                ],
                "two orders",
            )
        }
        (Form::Other, _) => {
            let (order, skew) = (2.0 + draw.index(3) as f64, draw.uniform(0.3, 0.6));
            let phase_deg = draw.uniform(-180.0, 180.0).round();
            let wheel = GearEccentricity::effect(number, order, amplitude, skew, phase_deg);
            (vec![wheel], "eccentric wheel")
        }
    };
    Some(Draft::one(name, "gear_cyclic", joint(number), effects))
}

pub(super) fn gear_motor_cyclic(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let amplitude = draw.size(8.0, 40.0);
    let ripple = |order: f64, amplitude_arcsec: f64, phase_deg: f64| {
        GearMotorCyclic::effect(number, order, amplitude_arcsec, phase_deg)
    };
    let (first, second) = (
        draw.uniform(-180.0, 180.0).round(),
        draw.uniform(-180.0, 180.0).round(),
    );
    let (effects, name) = match form {
        Form::Obvious => (
            vec![ripple(1.0 + draw.index(2) as f64, amplitude, first)],
            "one order",
        ),
        Form::Other => (
            vec![
                ripple(1.0, amplitude, first),
                ripple(2.0, draw.uniform(0.4, 1.0) * amplitude, second),
            ],
            "two orders",
        ),
    };
    Some(Draft::one(
        name,
        "gear_motor_cyclic",
        joint(number),
        effects,
    ))
}

pub(super) fn backlash(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let gap_arcsec = draw.size(20.0, 80.0);
    if form == Form::Obvious {
        let number = bench.turning(draw);
        let gap = Backlash::effect(number, gap_arcsec, 0.0, 0.0, 0.0);
        let draft = Draft::one("by direction", "backlash", joint(number), vec![gap]);
        return Some(draft.needing(&[Column::Direction]));
    }
    let number = bench.bearing(draw)?;
    let peak = bench.peak[number - 1];
    let (closing_nm, soft_nm, name, needs): (f64, f64, &'static str, &[Column]) =
        match draw.index(3) {
            // Any torque at all decides the side.
            0 => (1e-6 * peak, 0.0, "by sign of load", &[]),
            1 => (
                peak * draw.uniform(0.1, 0.4),
                0.0,
                "by direction, by load where it is heavy",
                &[Column::Direction],
            ),
            _ => (
                0.0,
                peak * draw.uniform(0.03, 0.1),
                "by sign of load, soft",
                &[],
            ),
        };
    let gap = Backlash::effect(number, gap_arcsec, 0.0, closing_nm, soft_nm);
    let draft = Draft::one(name, "backlash", joint(number), vec![gap]).needing(needs);
    // What saturates at little load is the same thing by two names.
    Some(if needs.is_empty() {
        draft.accepting("joint_hardening", joint(number))
    } else {
        draft
    })
}

pub(super) fn axis_wobble(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let (order, ellipse, name) = match form {
        Form::Obvious => (1.0 + draw.index(2) as f64, 0.0, "in one plane"),
        Form::Other => (2.0, draw.uniform(0.4, 0.9), "elliptic"),
    };
    let (amplitude_arcsec, phase_deg) = (draw.size(8.0, 40.0), draw.uniform(-180.0, 180.0).round());
    let wobble = AxisWobble::effect(number, order, amplitude_arcsec, ellipse, phase_deg);
    Some(Draft::one(name, "axis_wobble", joint(number), vec![wobble]))
}

pub(super) fn zero_shift(bench: &Bench, _form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let step_arcsec = draw.sign() * draw.size(10.0, 80.0);
    let step = ZeroShift::effect(number, step_arcsec, bench.moment(draw));
    let draft =
        Draft::one("step", "zero_shift", joint(number), vec![step]).needing(&[Column::Time]);
    // A step of the first zero is a step of the whole arm about the same axis.
    Some(if number == 1 {
        draft.accepting("base_shift", "base".into())
    } else {
        draft
    })
}

pub(super) fn cable_drag(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let joints = bench.joints();
    let number = 3 + draw.index(joints.saturating_sub(3).max(1));
    if number >= joints {
        return None;
    }
    let by = if draw.chance(0.5) {
        number - 1
    } else {
        number + 1
    };
    let (pull, name) = match form {
        Form::Obvious => (Pull::Swing, "hung over two joints"),
        Form::Other => (Pull::Bend, "bent by two joints"),
    };
    let (lead, phase_deg) = (
        draw.sign() * draw.uniform(0.5, 1.0),
        draw.uniform(-60.0, 60.0).round(),
    );
    let hose = CableDrag::effect(
        number,
        by,
        lead,
        pull,
        draw.size(15.0, 80.0),
        0.0,
        phase_deg,
    );
    let draft = Draft::one(name, "cable_drag", joint(number), vec![hose]);
    Some(draft.accepting("unknown", joint(number)))
}
