//! A set of concealed recordings as a folder: what a user has, and the truth of each apart.

use super::seal::{RECORDINGS, SEALED, Seal};
use crate::error::{Error, Result};
use crate::estimate::threads::in_order;
use crate::twin::conceal::case::Case;
use crate::twin::conceal::design::{Content, Design};
use crate::twin::torque::{TorqueCase, TorqueDesign};
use std::path::Path;

/// What a set is drawn from.
#[derive(Debug, Clone, PartialEq)]
pub enum ConcealedSet {
    /// Points that were measured.
    Positions(Box<Design>),
    /// Torques of an arm that moves.
    Torques(TorqueDesign),
}

impl ConcealedSet {
    /// Recordings in it.
    pub fn cases(&self) -> usize {
        match self {
            Self::Positions(design) => design.cases,
            Self::Torques(design) => design.cases,
        }
    }
}

/// Writes the recordings, their truths and the seal; gives the number of rows. No byte depends on the number of threads.
pub fn conceal(folder: &Path, set: &ConcealedSet, threads: usize) -> Result<usize> {
    let contents = match set {
        ConcealedSet::Positions(design) => design.contents(),
        ConcealedSet::Torques(_) => Vec::new(),
    };
    let made = in_order(threads, set.cases(), |number| match set {
        ConcealedSet::Positions(design) => points(design, number, contents[number]),
        ConcealedSet::Torques(design) => Ok(torques(design, number)),
    });
    let mut seal = Seal::new(set);
    let mut rows = 0;
    for case in made {
        let case = case.map_err(|message| Error::spec("conceal", message))?;
        for (name, text) in &case.recording {
            seal.write(folder, format!("{RECORDINGS}/{}/{name}", case.name), text)?;
        }
        seal.write(folder, format!("{SEALED}/{}.json", case.name), &case.sealed)?;
        rows += case.rows;
    }
    seal.close(folder)?;
    Ok(rows)
}

/// A case as it goes to the disk.
struct Written {
    name: String,
    rows: usize,
    recording: Vec<(&'static str, String)>,
    sealed: String,
}

fn points(design: &Design, number: usize, content: Content) -> Result<Written, String> {
    let case = Case::make(design, number, content)?;
    Ok(Written {
        recording: case.recording()?.into(),
        sealed: case.sealed(),
        rows: case.shots.len(),
        name: case.name,
    })
}

fn torques(design: &TorqueDesign, number: usize) -> Written {
    let case = TorqueCase::draw(design, number);
    let recording: Vec<(&'static str, String)> = case.recording().into();
    // The header is a line of its own.
    let rows = recording
        .iter()
        .map(|(name, text)| {
            if name.ends_with(".csv") {
                text.lines().count() - 1
            } else {
                0
            }
        })
        .sum();
    Written {
        recording,
        sealed: case.sealed(),
        rows,
        name: case.name,
    }
}

/// Nothing is overwritten: the folder is new or empty.
pub fn vacant(folder: &Path) -> Result<()> {
    let taken = std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if taken {
        return Err(Error::spec(
            folder.display().to_string(),
            "is not empty; name a new folder",
        ));
    }
    Ok(())
}
