//! Friction before it slides: after each reversal lost motion builds up over a travel, instead of at once as in a gap.
//!
//! P. R. Dahl, 1968: `dz = (s - z) |dq| / travel`, s the direction of motion. Maxwell slip: elastic elements side by side, each of
//! which slips at its own travel (stop operators of Prandtl and Ishlinskii).

use super::{Act, Motion, State, effect};
use crate::memory::Moment;
use crate::truth::ARCSEC;

effect! {
    /// A joint that stops short of where its motor stands, by up to `amplitude` against the last motion.
    pub struct Presliding {
        /// From 1.
        pub joint: usize,
        /// Lost motion when all slides, arcsec: half of the loop.
        pub amplitude_arcsec: f64,
        /// Travel of Dahl's law, deg; 0: none.
        #[serde(default)]
        pub dahl_deg: f64,
        /// Travel at which each element of equal force slips, deg; for Maxwell slip.
        #[serde(default)]
        pub slip_deg: Vec<f64>,
    }
    "presliding" at joint, scaled by amplitude_arcsec, |self| {
        let slip = self.slip_deg.iter().sum::<f64>() / self.slip_deg.len().max(1) as f64;
        let travel = if self.dahl_deg > 0.0 { self.dahl_deg } else { slip };
        [("amplitude", "arcsec", self.amplitude_arcsec), ("travel", "deg", travel)]
    }
}

impl Presliding {
    fn dahl(&self, past: &[Moment]) -> Vec<f64> {
        let (travel, mut z) = (self.dahl_deg.to_radians(), 0.0);
        let live = |moment: &Moment| {
            for way in moment.travels(self.joint).filter(|way| *way != 0.0) {
                z = way.signum() + (z - way.signum()) * (-way.abs() / travel).exp();
            }
            z
        };
        past.iter().map(live).collect()
    }

    fn maxwell(&self, past: &[Moment]) -> Vec<f64> {
        let limits: Vec<f64> = self
            .slip_deg
            .iter()
            .map(|slip| slip.to_radians().max(f64::MIN_POSITIVE))
            .collect();
        let mut stretch = vec![0.0; limits.len()];
        let live = |moment: &Moment| {
            for way in moment.travels(self.joint) {
                stretch
                    .iter_mut()
                    .zip(&limits)
                    .for_each(|(stretch, limit)| *stretch = (*stretch + way).clamp(-limit, *limit));
            }
            let forces = stretch
                .iter()
                .zip(&limits)
                .map(|(stretch, limit)| stretch / limit);
            forces.sum::<f64>() / limits.len().max(1) as f64
        };
        past.iter().map(live).collect()
    }
}

impl Act for Presliding {
    fn act(&self, state: &State, motion: &mut Motion) {
        motion.joint[self.joint - 1] -= self.amplitude_arcsec * ARCSEC * state.memory;
    }
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        if self.dahl_deg > 0.0 {
            self.dahl(past)
        } else {
            self.maxwell(past)
        }
    }
}
