//! Effects that are in no list: a diagnosis should say where they sit and what they look like, and give them no name.

use super::{Bench, Column, Draft, Form, joint, sized};
use crate::effect::{BaseSway, JointBump, JointHinge, JointProduct, Physical};
use crate::noise::Noise;

fn unknown(form: &'static str, number: usize, effect: Physical) -> Option<Draft> {
    Some(Draft::new(
        form,
        vec![sized("unknown", joint(number), vec![effect])],
    ))
}

pub(super) fn bump(bench: &Bench, _form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let [lower, upper] = bench.ranges_deg[number - 1];
    let (centre_deg, width_deg) = (
        bench.angle(number, draw),
        draw.uniform(0.06, 0.16) * (upper - lower),
    );
    let amplitude_arcsec = draw.sign() * draw.size(40.0, 200.0);
    let bump = JointBump::effect(
        number,
        amplitude_arcsec,
        centre_deg.round(),
        width_deg.round(),
    );
    // A bump is a table of no formula, too.
    unknown("bump", number, bump).map(|draft| draft.accepting("joint_table", joint(number)))
}

pub(super) fn hinge(bench: &Bench, _form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = bench.turning(draw);
    let from_deg = bench.angle(number, draw).round();
    let hinge = JointHinge::effect(number, from_deg, draw.sign() * draw.size(30.0, 150.0));
    unknown("hinge", number, hinge).map(|draft| draft.accepting("joint_table", joint(number)))
}

pub(super) fn product(bench: &Bench, _form: Form, draw: &mut Noise) -> Option<Draft> {
    let number = 2 + draw.index(bench.joints() - 2);
    let other = 1 + draw.index(bench.joints());
    if other == number {
        return None;
    }
    let product =
        JointProduct::effect(number, [number, other], draw.sign() * draw.size(10.0, 60.0));
    unknown("product of two angles", number, product)
        .map(|draft| draft.accepting("cable_drag", joint(number)))
}

pub(super) fn sway(bench: &Bench, _form: Form, draw: &mut Noise) -> Option<Draft> {
    let period_s = (bench.end_s / draw.uniform(2.0, 6.0)).round();
    let (shift_um, turn_arcsec) = match draw.chance(0.5) {
        true => (draw.vector(30.0, 150.0).map(f64::round), [0.0; 3]),
        false => ([0.0; 3], draw.vector(3.0, 20.0)),
    };
    let sway = BaseSway::effect(
        shift_um,
        turn_arcsec,
        period_s,
        draw.uniform(-180.0, 180.0).round(),
    );
    let cause = sized("unknown", "base".into(), vec![sway]);
    // The tracker's stand may swing as well as the base.
    Some(
        Draft::new("slow swing", vec![cause])
            .needing(&[Column::Time])
            .accepting("unknown", "tracker".into()),
    )
}
