//! Two laws at one place: a gear under load, teeth with two flanks, warmth and ratio, warmth and spring, load and direction.
//!
//! What follows from the rows before: friction before it slides, heat that cools off, metal that lags.

use crate::conceal::family::gears::spring;
use crate::conceal::family::{Bench, Cause, Column, Draft, Form, fixed, joint, link, sized};
use crate::effect::{
    Backlash, BacklashGrowth, GearFlank, GearLoad, Heat, JointHysteresis, JointWarming, Physical,
    Presliding, ThermalBow, ThermalLag,
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

pub(super) fn presliding(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let (amplitude_arcsec, travel) = (draw.size(10.0, 60.0), draw.size(0.5, 4.0));
    let (dahl_deg, slip_deg, name) = match form {
        Form::Obvious => (travel, Vec::new(), "Dahl"),
        Form::Other => {
            let elements = 3 + draw.index(2);
            (
                0.0,
                (0..elements)
                    .map(|_| travel * draw.size(0.3, 3.0))
                    .collect(),
                "Maxwell slip",
            )
        }
    };
    let friction = Presliding::effect(number, amplitude_arcsec, dahl_deg, slip_deg);
    let draft = Draft::one(name, "presliding", joint(number), vec![friction]);
    Some(draft.needing(&[Column::Direction]))
}

/// A joint that warms in this way and is off by nothing yet.
pub(super) fn warming(number: usize, heat: Heat, time_s: f64) -> JointWarming {
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
fn off(warming: JointWarming, usual: f64, draw: &mut Noise) -> JointWarming {
    let size = draw.sign() * draw.size(15.0, 80.0) / usual;
    match draw.chance(0.6) {
        true => JointWarming {
            zero_arcsec: size,
            ..warming
        },
        false => JointWarming {
            ratio_arcsec_per_rad: size,
            ..warming
        },
    }
}

/// Mean time from point to point, s, and travel of a joint in it, rad, about.
const PACE_S: f64 = 19.0;
const TRAVEL_RAD: f64 = 0.8;

pub(super) fn own_heat(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let time_s = draw.uniform(0.06, 0.25) * bench.end_s;
    let usual = TRAVEL_RAD * time_s / PACE_S;
    let (heat, name) = match form {
        Form::Obvious => (warming(number, Heat::Work, time_s), "own work"),
        Form::Other => {
            let oil_s = (time_s * draw.uniform(0.1, 0.4)).round();
            let full = usual * draw.uniform(0.5, 1.0);
            (
                JointWarming {
                    oil_s,
                    full,
                    ..warming(number, Heat::Oil, time_s)
                },
                "casing and oil, saturating",
            )
        }
    };
    let warm = Physical::JointWarming(off(heat, usual, draw));
    Some(Draft::one(name, "joint_warming", joint(number), vec![warm]).needing(&[Column::Time]))
}

/// Usual rise of the arm's temperature, K.
pub(super) const RISE_K: f64 = 12.0;

pub(super) fn late_heat(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let time_s = draw.uniform(0.04, 0.2) * bench.end_s;
    let first = off(warming(number, Heat::Temperature, time_s), RISE_K, draw);
    let (parts, name) = match form {
        Form::Obvious => (vec![first], "behind the temperature"),
        Form::Other => {
            let second = JointWarming {
                time_s: (time_s * draw.uniform(3.0, 6.0)).round(),
                ..first.clone()
            };
            (vec![first, second], "behind the temperature by two times")
        }
    };
    let parts = parts.into_iter().map(Physical::JointWarming).collect();
    let draft = Draft::one(name, "joint_warming", joint(number), parts);
    Some(draft.needing(&[Column::Temperature, Column::Time]))
}

pub(super) fn lagging_link(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.long_link(draw)?;
    let (core_s, name) = match form {
        Form::Obvious => (0.0, "behind the temperature"),
        Form::Other => (draw.uniform(0.2, 0.5) * bench.end_s, "skin and core"),
    };
    let (um_per_m_k, lag_s) = (
        draw.uniform(8.0, 16.0),
        draw.uniform(0.05, 0.2) * bench.end_s,
    );
    let growth = ThermalLag::effect(number, um_per_m_k, 20.0, lag_s.round(), core_s.round());
    let draft = Draft::one(name, "thermal_growth", link(number), vec![growth]);
    Some(draft.needing(&[Column::Temperature, Column::Time]))
}
