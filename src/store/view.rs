//! The stable human paths: the latest table of every port, and the latest documents, under names that people can open.

use std::fs;
use std::path::{Path, PathBuf};

use super::Store;
use super::disk::{component, make_dir, place, refused, write};
use super::seal::seal;
use super::table_ref::TableRef;
use crate::error::Result;

impl Store {
    /// Shows a table as `tables/<pipeline>/<stage>.<port>.parquet`: another name of the object, or a copy where links cannot be.
    pub fn expose(
        &self,
        pipeline: &str,
        stage: &str,
        port: &str,
        table: &TableRef,
    ) -> Result<PathBuf> {
        let name = format!("{}.{}.parquet", component(stage)?, component(port)?);
        let path = self
            .root()
            .join("tables")
            .join(component(pipeline)?)
            .join(name);
        let object = self.object_path(table);
        let aside = self.workspace()?.fresh();
        if fs::hard_link(&object, &aside).is_err() {
            fs::copy(&object, &aside).map_err(|e| refused(&aside, "copy", &e))?;
        }
        // Not synced: after a power cut the next run shows it again, and a sync of every name is a third of a small run's time.
        show(&aside, &path)?;
        Ok(path)
    }

    /// Whether a table of a stage was ever shown.
    pub fn shown(&self, pipeline: &str, stage: &str) -> bool {
        let opening = format!("{stage}.");
        let entries = fs::read_dir(self.root().join("tables").join(pipeline))
            .into_iter()
            .flatten()
            .flatten();
        entries
            .into_iter()
            .any(|entry| entry.file_name().to_string_lossy().starts_with(&opening))
    }

    /// Writes a document (a report) as `documents/<pipeline>/<name>`, and its hash as `seals/<pipeline>/<name>.json`.
    pub fn expose_document(&self, pipeline: &str, name: &str, content: &[u8]) -> Result<PathBuf> {
        let path = self
            .root()
            .join("documents")
            .join(component(pipeline)?)
            .join(component(name)?);
        let aside = self.workspace()?.fresh();
        let file = write(&aside, content)?;
        place(&aside, &path)?;
        self.owe(&path, file)?;
        // Afterwards: a crash in between is mended by the next run, which writes both again.
        let hash = serde_json::json!({ "blake3": blake3::hash(content).to_hex().as_str() });
        self.put_file(&["seals", pipeline], &format!("{name}.json"), &seal(&hash)?)?;
        Ok(path)
    }
}

/// Gives a file its name for people, atomically.
fn show(aside: &Path, path: &Path) -> Result<()> {
    path.parent().map_or(Ok(()), make_dir)?;
    fs::rename(aside, path).map_err(|e| refused(path, "put the file in place", &e))?;
    // Renaming one name of a file over another name of the same file does nothing, by POSIX.
    let _ = fs::remove_file(aside);
    Ok(())
}
