//! A set of concealed recordings as a folder: what a user has, and the truth of each apart.

use super::seal::{RECORDINGS, SEALED, Seal};
use crate::error::{Error, Result};
use crate::estimate::threads::in_order;
use crate::twin::conceal::case::Case;
use crate::twin::conceal::design::{Content, Design};
use std::path::Path;

/// Writes the recordings, their truths and the seal; gives the number of points. No byte depends on the number of threads.
pub fn conceal(folder: &Path, design: &Design, threads: usize) -> Result<usize> {
    let contents = design.contents();
    let made = in_order(threads, contents.len(), |number| written(design, number, contents[number]));
    let mut seal = Seal::new(design);
    let mut points = 0;
    for case in made {
        let case = case.map_err(|message| Error::spec("conceal", message))?;
        for (name, text) in &case.recording {
            seal.write(folder, format!("{RECORDINGS}/{}/{name}", case.name), text)?;
        }
        seal.write(folder, format!("{SEALED}/{}.json", case.name), &case.sealed)?;
        points += case.points;
    }
    seal.close(folder)?;
    Ok(points)
}

/// A case as it goes to the disk.
struct Written {
    name: String,
    points: usize,
    recording: [(&'static str, String); 3],
    sealed: String,
}

fn written(design: &Design, number: usize, content: Content) -> Result<Written, String> {
    let case = Case::make(design, number, content)?;
    Ok(Written { recording: case.recording()?, sealed: case.sealed(), points: case.shots.len(), name: case.name })
}

/// Nothing is overwritten: the folder is new or empty.
pub fn vacant(folder: &Path) -> Result<()> {
    let taken = std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if taken {
        return Err(Error::spec(folder.display().to_string(), "is not empty; name a new folder"));
    }
    Ok(())
}
