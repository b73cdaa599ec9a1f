//! What is wrong with the instrument: its circles, its ranges, its air, its stand.

use super::{Bench, Column, Draft, Form, sized};
use crate::effect::{
    Circle, Physical, TrackerCircle, TrackerElevation, TrackerKnock, TrackerOffset,
    TrackerRefraction, TrackerSway,
};
use crate::noise::Noise;

fn tracker(effect: &'static str, form: &'static str, physical: Physical) -> Draft {
    Draft::new(form, vec![sized(effect, "tracker".into(), vec![physical])])
}

fn phase(draw: &mut Noise) -> f64 {
    draw.uniform(-180.0, 180.0).round()
}

pub(super) fn circle(_bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let (circle, name) = match (form, draw.chance(0.5)) {
        (Form::Obvious, _) => (Circle::Eccentric, "eccentric"),
        (Form::Other, true) => (Circle::Elliptic, "elliptic"),
        (Form::Other, false) => (Circle::OffCentre, "centre off the axis"),
    };
    let circle = TrackerCircle::effect(circle, draw.size(4.0, 40.0), phase(draw));
    Some(tracker("tracker_circle", name, circle))
}

pub(super) fn elevation(_bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let (size, second) = (draw.sign() * draw.size(5.0, 40.0), draw.uniform(-1.0, 1.0));
    let head = TrackerElevation::effect;
    let (head, name) = match (form, draw.chance(0.5)) {
        (Form::Obvious, _) => (head(size * second, size, 0.0, 0.0, 0.0), "index and sag"),
        (Form::Other, true) => {
            let circle = head(0.0, 0.0, size, phase(draw), 0.0);
            (circle, "eccentric vertical circle")
        }
        (Form::Other, false) => (head(0.0, 0.0, 0.0, 0.0, size), "tilted transit axis"),
    };
    Some(tracker("tracker_elevation", name, head))
}

pub(super) fn offset(_bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let size = draw.sign() * draw.size(30.0, 300.0);
    let (ranges, name) = match (form, draw.chance(0.5)) {
        (Form::Obvious, _) => {
            let path = TrackerOffset {
                constant_um: size,
                ..TrackerOffset::default()
            };
            (path, "dead path")
        }
        (Form::Other, true) => {
            let (wave_mm, phase_deg) = (draw.size(300.0, 1500.0).round(), phase(draw));
            let cycle = TrackerOffset {
                cyclic_um: 0.3 * size,
                wave_mm,
                phase_deg,
                ..TrackerOffset::default()
            };
            (cycle, "cyclic")
        }
        (Form::Other, false) => {
            let square = TrackerOffset {
                um_per_m2: 0.2 * size,
                ..TrackerOffset::default()
            };
            (square, "square of the range")
        }
    };
    Some(tracker(
        "tracker_offset",
        name,
        Physical::TrackerOffset(ranges),
    ))
}

pub(super) fn refraction(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let um_per_m_k = draw.sign() * draw.uniform(0.8, 1.2);
    let air = |lag_s, own_rise_k, warm_up_h| {
        TrackerRefraction::effect(um_per_m_k, 20.0, lag_s, own_rise_k, warm_up_h)
    };
    let (air, name, needs): (_, _, &[Column]) = match (form, draw.chance(0.5)) {
        (Form::Obvious, _) => {
            let name = "with the logged temperature";
            (air(0.0, 0.0, 1.0), name, &[Column::Temperature])
        }
        (Form::Other, true) => {
            let lag_s = (bench.end_s * draw.uniform(0.05, 0.2)).round();
            let name = "behind the logged temperature";
            (
                air(lag_s, 0.0, 1.0),
                name,
                &[Column::Temperature, Column::Time],
            )
        }
        (Form::Other, false) => {
            let warm_up_h = draw.uniform(0.15, 0.6) * bench.end_s / 3600.0;
            let name = "air that warms by its own";
            (air(0.0, 12.0, warm_up_h), name, &[Column::Time])
        }
    };
    Some(tracker("tracker_refraction", name, air).needing(needs))
}

/// A direction of motion of the stand: along, or about the tracker's origin.
fn stand(draw: &mut Noise) -> ([f64; 3], [f64; 3]) {
    if draw.chance(0.5) {
        (draw.vector(30.0, 150.0).map(f64::round), [0.0; 3])
    } else {
        ([0.0; 3], draw.vector(3.0, 15.0))
    }
}

pub(super) fn swing(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let (shift_um, turn_arcsec) = stand(draw);
    let (period_s, phase_deg) = ((bench.end_s / draw.uniform(2.0, 6.0)).round(), phase(draw));
    let (fading_s, name) = match form {
        Form::Obvious => (0.0, "slow swing"),
        Form::Other => (
            (draw.uniform(0.3, 0.8) * bench.end_s).round(),
            "fading swing",
        ),
    };
    let sway = TrackerSway::effect(shift_um, turn_arcsec, period_s, phase_deg, fading_s);
    // The base may swing as well as the stand.
    Some(
        tracker("unknown", name, sway)
            .needing(&[Column::Time])
            .accepting("unknown", "base".into()),
    )
}

pub(super) fn knock(bench: &Bench, form: Form, draw: &mut Noise) -> Option<Draft> {
    let (shift_um, turn_arcsec) = (
        draw.vector(30.0, 150.0).map(f64::round),
        draw.vector(2.0, 15.0),
    );
    let (back_share, name) = match form {
        Form::Obvious => (0.0, "knock"),
        Form::Other => (draw.uniform(0.3, 0.7), "knock, settling back in part"),
    };
    let back_s = (draw.uniform(0.05, 0.15) * bench.end_s).round().max(1.0);
    let knock = TrackerKnock::effect(
        shift_um,
        turn_arcsec,
        bench.moment(draw),
        back_share,
        back_s,
    );
    let cause = sized("base_shift", "base".into(), vec![knock]);
    Some(
        Draft::new(name, vec![cause])
            .needing(&[Column::Time])
            .accepting("tracker_drift", "tracker".into()),
    )
}
