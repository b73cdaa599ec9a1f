//! What a store asks of object storage.

use std::fmt::Debug;
use std::path::Path;

use crate::error::Result;

/// Whole files under keys with slashes, as S3 has them; what is written is seen by all at once.
pub trait Bucket: Debug + Send + Sync {
    /// As a person writes it: `s3://bucket/prefix`.
    fn name(&self) -> &str;
    /// Fetches into a new file; false where there is nothing.
    fn fetch(&self, key: &str, to: &Path) -> Result<bool>;
    /// Writes a file over what may be there.
    fn send(&self, from: &Path, key: &str) -> Result<()>;
    /// Writes a small file where nothing is, decided once for all who try; false where something is.
    fn create(&self, from: &Path, key: &str) -> Result<bool>;
    /// Takes away; nothing where there is nothing.
    fn remove(&self, key: &str) -> Result<()>;
    /// Keys below a folder (all where it is empty) with their bytes, in order, `most` at most.
    fn list(&self, folder: &str, most: usize) -> Result<Vec<(String, u64)>>;
}
