//! Which row serves what.

use super::Split;
use crate::error::{Error, Result, instead};
use crate::table::Recording;

impl Split {
    /// Rows of the recording in any of `sets`. A set without rows, or a split of another recording, is an error.
    pub fn rows(&self, recording: &Recording, sets: &[String]) -> Result<Vec<usize>> {
        let same = self.0.len() == recording.rows()
            && self
                .0
                .iter()
                .zip(&recording.sequence)
                .all(|(row, s)| row.sequence == *s);
        if !same {
            return Err(Error::data(
                "table split",
                "does not belong to this recording: their sequence numbers differ",
            ));
        }
        for (k, set) in sets.iter().enumerate() {
            if !self.0.iter().any(|row| row.set == *set) {
                let mut names: Vec<&str> = self.0.iter().map(|row| row.set.as_str()).collect();
                names.sort_unstable();
                names.dedup();
                return Err(Error::data(
                    format!("with.on[{k}]"),
                    format!("no row is in set `{set}`{}", instead(set, &names)),
                ));
            }
        }
        Ok((0..self.0.len())
            .filter(|row| sets.contains(&self.0[*row].set))
            .collect())
    }
}
