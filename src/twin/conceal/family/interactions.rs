//! Two laws at one place: a gear under load, teeth with two flanks, warmth and ratio, warmth and spring, load and direction.

use super::gears::spring;
use super::memories::{RISE_K, warming};
use super::{Bench, Cause, Column, Draft, Form, fixed, joint, link, sized};
use crate::effect::{
    Backlash, BacklashGrowth, GearFlank, GearLoad, Heat, JointHysteresis, JointWarming, Physical,
    ThermalBow,
};
use crate::noise::Noise;

pub(super) fn gear_load(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.bearing(draw)?;
    let peak = bench.peak[number - 1].max(1e-9);
    let (order, phase_deg) = (
        1.0 + draw.index(5) as f64,
        draw.uniform(-180.0, 180.0).round(),
    );
    let (full_nm, name) = match form {
        Form::Obvious => (0.0, "with the load"),
        Form::Other => (peak * draw.uniform(0.2, 0.5), "with the load, saturating"),
    };
    let gear = GearLoad::effect(
        number,
        order,
        draw.size(15.0, 60.0) / peak,
        phase_deg,
        full_nm,
    );
    Some(Draft::one(name, "gear_load", joint(number), vec![gear]))
}

pub(super) fn gear_flank(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let flank = |order: f64, amplitude_arcsec: f64, draw: &mut Noise| {
        let phase_deg = draw.uniform(-180.0, 180.0).round();
        GearFlank::effect(number, order, amplitude_arcsec, phase_deg)
    };
    let (first, size) = (1.0 + draw.index(4) as f64, draw.size(10.0, 50.0));
    let mut waves = vec![flank(first, size, draw)];
    let name = if form == Form::Other {
        let (second, share) = (first + 1.0 + draw.index(4) as f64, draw.uniform(0.5, 1.0));
        waves.push(flank(second, share * size, draw));
        "two orders"
    } else {
        "one order"
    };
    Some(Draft::one(name, "gear_flank", joint(number), waves).needing(&[Column::Direction]))
}

/// The spring that a change of the spring belongs to: it may be named, or counted to the change.
fn beside(bench: &Bench, number: usize, draw: &mut Noise) -> Cause {
    let linear = fixed(
        "joint_compliance",
        joint(number),
        vec![spring(bench, number, draw.size(60.0, 200.0))],
    );
    Cause {
        wanted: false,
        ..linear
    }
}

pub(super) fn warm_ratio(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let ratio_arcsec_per_rad = draw.sign() * draw.size(15.0, 80.0) / RISE_K;
    let warm = JointWarming {
        ratio_arcsec_per_rad,
        ..warming(number, Heat::Temperature, 0.0)
    };
    let (warm, name) = match form {
        Form::Obvious => (warm, "ratio with temperature"),
        Form::Other => (
            JointWarming {
                full: draw.uniform(5.0, 10.0),
                ..warm
            },
            "ratio with temperature, saturating",
        ),
    };
    let draft = Draft::one(
        name,
        "joint_warming",
        joint(number),
        vec![Physical::JointWarming(warm)],
    );
    Some(draft.needing(&[Column::Temperature]))
}

pub(super) fn warm_spring(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.bearing(draw)?;
    let softening_rad_per_nm = bench.softness(number, draw.size(20.0, 80.0)) / RISE_K;
    let warm = JointWarming {
        softening_rad_per_nm,
        ..warming(number, Heat::Temperature, 0.0)
    };
    let (warm, name) = match form {
        Form::Obvious => (warm, "spring with temperature"),
        Form::Other => (
            JointWarming {
                full: draw.uniform(5.0, 10.0),
                ..warm
            },
            "spring with temperature, saturating",
        ),
    };
    let causes = vec![
        sized(
            "joint_warming",
            joint(number),
            vec![Physical::JointWarming(warm)],
        ),
        beside(bench, number, draw),
    ];
    Some(
        Draft::new(name, causes)
            .needing(&[Column::Temperature])
            .accepting("joint_compliance", joint(number)),
    )
}

pub(super) fn spring_by_direction(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.bearing(draw)?;
    let size = draw.size(20.0, 80.0);
    let (physical, name) = match form {
        Form::Obvious => {
            let rad_per_nm = -2.0 * bench.softness(number, size);
            (
                JointHysteresis::effect(number, rad_per_nm),
                "spring by direction",
            )
        }
        Form::Other => {
            let arcsec_per_nm = 2.0 * size / bench.peak[number - 1].max(1e-9);
            let gap = Backlash::effect(number, 0.0, arcsec_per_nm, 0.0, 0.0);
            (gap, "loop that opens with the load")
        }
    };
    let causes = vec![
        sized("backlash", joint(number), vec![physical]),
        beside(bench, number, draw),
    ];
    Some(
        Draft::new(name, causes)
            .needing(&[Column::Direction])
            .accepting("joint_hardening", joint(number)),
    )
}

pub(super) fn growing_gap(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let (time_s, settling, name) = match form {
        Form::Obvious => (bench.end_s, false, "grows with time"),
        Form::Other => (
            draw.uniform(0.15, 0.5) * bench.end_s,
            true,
            "grows and settles",
        ),
    };
    let (gap_arcsec, start) = (draw.size(20.0, 80.0), draw.uniform(0.1, 0.4));
    let gap = BacklashGrowth::effect(number, gap_arcsec, start, time_s.round(), settling);
    let draft = Draft::one(name, "backlash", joint(number), vec![gap]);
    Some(
        draft
            .needing(&[Column::Direction, Column::Time])
            .accepting("unknown", joint(number)),
    )
}

pub(super) fn bent_link(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.long_link(draw)?;
    let (power, name) = match form {
        Form::Obvious => (1, "by the cosine of the next joint"),
        Form::Other => (2, "by the squared cosine of the next joint"),
    };
    let bow = ThermalBow::effect(number, draw.uniform(8.0, 16.0), 20.0, power);
    let draft = Draft::one(name, "unknown", link(number), vec![bow]);
    Some(
        draft
            .needing(&[Column::Temperature])
            .accepting("thermal_growth", link(number)),
    )
}
