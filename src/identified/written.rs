//! Tables that a stage wrote.

use crate::error::Result;
use crate::pipeline::StageReport;
use crate::store::TableRef;
use crate::store::frame::Frame;
use crate::table::Table;

/// The table of a kind that a stage wrote, if it wrote one.
pub(super) fn written<T: Table>(
    stage: &StageReport,
    load: impl Fn(&TableRef) -> Result<Frame>,
) -> Result<Option<T>> {
    let own = stage.outputs.iter().find(|output| output.kind == T::KIND);
    own.map(|output| T::from_frame(&load(&output.table)?))
        .transpose()
}
