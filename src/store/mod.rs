//! Columns: schemas, checked frames, content-addressed objects, action records and runs. Knows no robot.

pub mod frame;
pub mod schema;
