//! The stable human paths: the latest table of every port, and the latest documents, under names that people can open.

use std::fs;
use std::path::PathBuf;

use super::Store;
use super::actions::TableRef;
use super::disk::{component, refused, replace, write_synced};
use crate::error::Result;

impl Store {
    /// Shows a table as `tables/<pipeline>/<stage>.<port>.parquet`: another name of the object, or a copy where links cannot be.
    pub fn expose(&self, pipeline: &str, stage: &str, port: &str, table: &TableRef) -> Result<PathBuf> {
        let name = format!("{}.{}.parquet", component(stage)?, component(port)?);
        let path = self.root().join("tables").join(component(pipeline)?).join(name);
        let object = self.object_path(table);
        let aside = self.workspace()?.fresh();
        if fs::hard_link(&object, &aside).is_err() {
            fs::copy(&object, &aside).map_err(|e| refused(&aside, "copy", &e))?;
        }
        replace(&aside, &path)?;
        Ok(path)
    }

    /// Writes a document (a report) as `documents/<pipeline>/<name>`.
    pub fn expose_document(&self, pipeline: &str, name: &str, content: &[u8]) -> Result<PathBuf> {
        let path = self.root().join("documents").join(component(pipeline)?).join(component(name)?);
        let aside = self.workspace()?.fresh();
        write_synced(&aside, content)?;
        replace(&aside, &path)?;
        Ok(path)
    }
}
