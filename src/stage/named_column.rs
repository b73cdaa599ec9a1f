//! Columns of a recording that name what rows measured, or what with.

use crate::error::{Error, Result, listed};
use crate::table::Recording;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A column of names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedColumn {
    /// What sockets the target lay in.
    Socket,
    /// Planes that it touched.
    Plane,
    /// Spheres that it touched.
    Sphere,
    /// Ends of distances.
    Anchor,
    /// Targets on the tool.
    Target,
}

impl NamedColumn {
    fn name(self) -> &'static str {
        match self {
            Self::Socket => "socket",
            Self::Plane => "plane",
            Self::Sphere => "sphere",
            Self::Anchor => "anchor",
            Self::Target => "target",
        }
    }

    /// The names of the rows; blank where a row has none. Fails where the recording has no such column.
    pub(super) fn of<'a>(self, recording: &'a Recording, place: &str) -> Result<Vec<&'a str>> {
        let column = if self == Self::Target {
            recording.target.as_ref()
        } else {
            recording.names.get(self.name())
        };
        let column = column.ok_or_else(|| {
            let there = recording
                .names
                .keys()
                .copied()
                .chain(recording.target.as_ref().map(|_| "target"));
            Error::data(
                format!("with.{place}"),
                format!(
                    "the recording has no names of `{}`; it has: {}",
                    self.name(),
                    listed(there)
                ),
            )
        })?;
        Ok(column
            .iter()
            .map(|name| name.as_deref().unwrap_or_default())
            .collect())
    }
}
