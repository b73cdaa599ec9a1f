//! What follows from the rows before: friction before it slides, heat that cools off, metal that lags.

use super::{Bench, Column, Draft, Form, joint, link};
use crate::effect::{Heat, JointWarming, Physical, Presliding, ThermalLag};
use crate::noise::Noise;

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
