//! Where the fit of a new cause begins.

use crate::fit::DriveFit;
use crate::key::Key;
use crate::problem::Drives;
use crate::rollout::Which;
use calib_engine::Accepted;

impl Drives {
    /// A set whose last member is new to a fit begins with that of its starts that a roll-out of its own likes best: where a number has no
    /// small size (a limit, a play) a linear scan hardly tells them apart.
    pub(crate) fn begun(&self, set: &[Accepted<Key>], before: &DriveFit) -> Vec<Accepted<Key>> {
        let mut begun = set.to_vec();
        let Some(last) = begun.last().filter(|last| {
            let starts = last.cell.shapes.iter();
            let is_new = |one: &Accepted<Key>| one.cell.key != last.cell.key;
            starts.len() > 1
                && starts
                    .clone()
                    .all(|shape| shape.columns == [shape.start.clone()])
                && before.set.iter().all(is_new)
        }) else {
            return begun;
        };
        let (shapes, at) = (last.cell.shapes.clone(), begun.len() - 1);
        let square = |shape: usize| {
            let mut set = set.to_vec();
            (set[at].shape, set[at].numbers) = (shape, shapes[shape].start.clone());
            let angles = self.angles(&self.physics(&before.inertia, &set), Which::Fitted);
            let squares = self.noise_squares(&angles).into_iter().zip(&before.doubt);
            let square: f64 = squares
                .map(|(square, doubt)| square / (doubt * doubt))
                .sum();
            if square.is_finite() {
                square
            } else {
                f64::INFINITY
            }
        };
        let best = (0..shapes.len()).map(|shape| (square(shape), shape));
        if let Some((_, best)) = best.min_by(|a, b| a.0.total_cmp(&b.0)) {
            (begun[at].shape, begun[at].numbers) = (best, shapes[best].start.clone());
        }
        begun
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::against_mujoco::{TOLERANCE, motion};
    use crate::causes::cells;
    use calib_engine::Problem;

    #[test]
    fn what_inertials_take_up_beyond_their_tolerance_is_seen_as_a_cell_of_their_own() {
        let (chain, base, mut recording) = motion();
        let drives = Drives::new(chain, base.clone(), recording.clone(), TOLERANCE);
        let mut shifted = base.clone();
        for axis in 0..3 {
            shifted.bodies.links[1].centre[axis] += 0.02;
        }
        recording.angle = drives.angles(&shifted, Which::All);
        let measured = Drives::new(drives.chain.clone(), base, recording, TOLERANCE);
        let fit = measured.fit(&[], None, f64::NEG_INFINITY);
        let around = measured.around(&fit, None);
        let scanned = measured.scan(&fit, &around, None);
        let is_it = |one: &&calib_engine::Scanned<Key>| one.accepted.cell.key == Key::LinkCentre(1);
        let odds = scanned.iter().find(is_it).map(|one| one.log_odds);
        assert!(odds.is_some_and(|odds| odds > 10.0), "{odds:?}");
    }

    #[test]
    fn a_cause_without_a_small_size_begins_where_a_roll_out_says() {
        let (chain, base, mut recording) = motion();
        let drives = Drives::new(chain, base.clone(), recording.clone(), TOLERANCE);
        let all = cells(&base, &drives.usual, recording.period, drives.shown);
        let cell = all.into_iter().find(|cell| cell.key == Key::DeadBand(0));
        let cell = cell.unwrap();
        for wanted in [1, 3] {
            let mut accepted = Accepted {
                numbers: cell.shapes[wanted].start.clone(),
                cell: cell.clone(),
                shape: wanted,
            };
            let with = drives.physics(&[], std::slice::from_ref(&accepted));
            recording.angle = drives.angles(&with, Which::All);
            let measured = Drives::new(
                drives.chain.clone(),
                base.clone(),
                recording.clone(),
                TOLERANCE,
            );
            let mut nothing = measured.fit(&[], None, f64::NEG_INFINITY);
            // What inertials within their tolerance take up is not the question here.
            nothing.inertia.fill(0.0);
            accepted.shape = 0;
            accepted.numbers.clone_from(&cell.shapes[0].start);
            let begun = measured.begun(&[accepted], &nothing);
            assert_eq!(begun[0].shape, wanted);
        }
    }
}
