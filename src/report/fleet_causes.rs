//! What the robots of a fleet have in common, as one self-contained page.

use crate::error::Result;
use crate::table::{FleetCells, FleetFindings, FleetOutliers};

/// The page.
pub fn html(
    _name: &str,
    _findings: &FleetFindings,
    _cells: &FleetCells,
    _outliers: &FleetOutliers,
) -> Result<String> {
    Ok(String::new())
}
