//! One factor on the whole torque of each joint, asked before masses: currents of several joints by wrong constants look like a payload, a
//! link and another joint's constant, one after the other.

use super::cause::TORQUE_CONSTANT;
use super::choice::CauseChoice;
use super::search::search;
use crate::criteria::torque::APART;

/// Wrong masses, drives and mountings that would stand in place of those of a set, together.
pub(super) struct OtherInertials {
    pub forms: Vec<usize>,
    /// By how much the criterion with them is worse; not below 0.
    pub worse: f64,
}

/// The best set from what hardly an arm is without, and what stands in place of its wrong masses or drives. Where factors on the torques of
/// joints explain as much as masses, it is these.
pub(super) fn from_common(choice: &CauseChoice) -> (Vec<usize>, Option<OtherInertials>) {
    let is_drive = |number: &usize| choice.form(*number).cause.name() == TORQUE_CONSTANT;
    let inertial = |set: &[usize]| -> Vec<usize> {
        set.iter().copied().filter(|number| choice.form(*number).cause.about().inertial).collect()
    };
    let masses = search(choice, choice.common());
    let drives: Vec<usize> =
        (0..choice.open).filter(|number| is_drive(number) && choice.form(*number).shape.is_empty()).collect();
    if drives.is_empty() || inertial(&masses).is_empty() {
        return (masses, None);
    }
    let scaled = search(choice, choice.common().into_iter().chain(drives).collect());
    let worse = choice.criterion(&scaled) - choice.criterion(&masses);
    let all_drives = inertial(&scaled).iter().all(is_drive);
    let (chosen, other, worse) =
        if worse <= if all_drives { *APART } else { 0.0 } { (scaled, masses, -worse) } else { (masses, scaled, worse) };
    let forms: Vec<usize> = inertial(&other).into_iter().filter(|number| !chosen.contains(number)).collect();
    let other = (!forms.is_empty()).then_some(OtherInertials { forms, worse: worse.max(0.0) });
    (chosen, other)
}
