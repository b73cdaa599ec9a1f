//! What loads do, and what is wrong about them: soft links, a soft base, balancers, masses.

use super::gears::springs;
use super::{Bench, Draft, Form, fixed, joint, link};
use crate::effect::{
    Balancer, BaseCompliance, Counterbalance, LinkCompliance, LinkHinge, LinkMass, PayloadError,
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
