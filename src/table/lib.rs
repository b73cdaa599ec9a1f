//! The bridge between Parquet columns and Rust values: each table has a schema file in `schemas/`.
//!
//! Most tables are a list of rows, and a row is a struct whose fields are the columns of the schema file (schemas/build.rs reads it); only
//! tables with columns for each joint are written by hand. A file of this folder says how tables are filled and what is made of them.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_foundation::{description, error, units};
use calib_numerics::{effect, estimate, observation, spatial};
use calib_store as store;
use {calib_diagnose as diagnose, calib_dynamics as dynamics};

use crate::error::Result;
pub use crate::store::Loose;
use crate::store::frame::{Cell, FrameBuilder};
pub use crate::store::frame::{Frame, TextCells};
pub use cause_grid::{CauseGrid, CauseGridCell};
pub use drives::DriveCourse;
pub use findings::VerdictTopic;
pub use findings::{formula_in_words, is_separable_by_poses};
pub use motion::{ArmMotion, TorqueCourse};
pub use observability::{FitContext, UNFOLDED};
pub use parameters::Corrected;
pub use ports::Labelled;
pub use recording::{
    Recording, SOURCE as SIGMA_SOURCE, columns as recording_columns, frame as recording_frame,
};
pub use standing::{Contradicted, Standing, Step, Unseen, Withdrawn, standing};
use std::path::Path;

/// A table kind: Rust values that go to and from checked columns.
pub trait Table: Sized + Send + Sync + 'static {
    /// The name of its schema.
    const KIND: &'static str;
    /// Checked columns. Fails where a value breaks the schema.
    fn to_frame(&self) -> Result<Frame>;
    /// Values from checked columns. Fails where columns of the schema are missing.
    fn from_frame(frame: &Frame) -> Result<Self>;
}

/// A table from a Parquet file outside of a store. Fails where its content is not what the hash in the file says.
pub fn from_file<T: Table>(path: &Path) -> Result<Loose<T>> {
    typed(crate::store::read_table(path, Some(T::KIND))?)
}

/// The same from the bytes of the file; `label` names it in errors.
pub fn from_parquet<T: Table>(label: &str, bytes: Vec<u8>) -> Result<Loose<T>> {
    typed(crate::store::table_of_bytes(label, bytes, T::KIND)?)
}

fn typed<T: Table>(loose: Loose<Frame>) -> Result<Loose<T>> {
    Ok(Loose {
        table: T::from_frame(&loose.table)?,
        vouched: loose.vouched,
    })
}

/// A text that a spreadsheet would run as a formula gets a quote in front, as spreadsheets mark a text.
pub fn inert(text: std::borrow::Cow<str>) -> String {
    let runs = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    if runs {
        format!("'{text}")
    } else {
        text.into_owned()
    }
}

/// Tables of one stage by their kind, none of what it did not write.
pub type TablesByKind<'a> = dyn Fn(&str) -> Result<Option<Frame>> + 'a;

/// The table of a kind as Rust values, if there is one.
pub fn of_kind<T: Table>(tables: &TablesByKind) -> Result<Option<T>> {
    tables(T::KIND)?
        .map(|frame| T::from_frame(&frame))
        .transpose()
}

/// A row as JSON with these of its columns, separated by blanks; `where=place` is the column `place` under the name `where`.
pub fn picked(row: &impl serde::Serialize, columns: &str) -> serde_json::Value {
    let mut row = serde_json::json!(row);
    let column = |column: &str| {
        let (name, column) = column.split_once('=').unwrap_or((column, column));
        let value = row.get_mut(column).expect("a column of the row").take();
        (name.to_string(), value)
    };
    columns.split(' ').map(column).collect()
}

/// Rows as JSON, each as [`picked`] has it.
pub fn picked_of<'a, R: serde::Serialize + 'a>(
    rows: impl IntoIterator<Item = &'a R>,
    columns: &str,
) -> serde_json::Value {
    rows.into_iter().map(|row| picked(row, columns)).collect()
}

/// Declares a table as a list of rows. It is handed the columns of `schemas/<kind>.json` by a macro of the kind's name (schemas/build.rs).
macro_rules! rows {
    ($kind:literal, $(#[$doc:meta])* pub struct $table:ident of $row:ident { $( $(#[$fdoc:meta])* $field:ident: $ty:ty, )+ }) => {
        #[doc = concat!("A row of the table `", $kind, "`.")]
        #[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
        pub struct $row { $( $(#[$fdoc])* pub $field: $ty, )+ }
        $(#[$doc])*
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct $table(pub Vec<$row>);
        impl Table for $table {
            const KIND: &'static str = $kind;
            fn to_frame(&self) -> Result<Frame> {
                let mut frame = FrameBuilder::new(Self::KIND);
                $( frame.push_present(stringify!($field), <$ty as Cell>::to_array(self.0.iter().map(|row| row.$field.clone()).collect()))?; )+
                frame.finish()
            }
            fn from_frame(frame: &Frame) -> Result<Self> {
                $( let mut $field = frame.read::<$ty>(stringify!($field))?.into_iter(); )+
                let mut rows = Vec::with_capacity(frame.rows());
                for _ in 0..frame.rows() {
                    rows.push($row { $( $field: $field.next().expect("columns have equal length"), )+ });
                }
                Ok(Self(rows))
            }
        }
    };
}
/// Declares every table kind, in the order of their names; one without `of` has columns for each joint and is written by hand.
macro_rules! tables {
    ($( $kind:ident => $table:ident $(of $row:ident)?, )+) => {
        $( $( calib_schemas::$kind! { $table, $row } )? )+
        /// Every table kind; `schemas/<kind>.json` holds its schema.
        pub const TABLES: &[&str] = &[$( $table::KIND, )+];
    };
}

mod cause_grid;
mod drives;
mod findings;
mod motion;
mod network;
mod observability;
mod parameters;
pub mod ports;
mod prediction;
mod recording;
mod robot;
mod standing;
mod torque_findings;
mod torque_parameters;

pub use prediction::slip;

tables! {
    acceptance => Acceptance of AcceptanceRow,
    body_consistency => BodyConsistencies of BodyConsistencyRow,
    cell_amplitudes => CellAmplitudes of CellAmplitudeRow,
    cell_evidence => CellEvidence of CellEvidenceRow,
    cells => Cells of CellRow,
    changes => Changes of ChangeRow,
    contacts => Contacts of ContactRow,
    convention => JointConventions of JointConventionRow,
    corrections => Corrections of CorrectionsRow,
    covariance => CovarianceTable of CovarianceRow,
    curves => Curves of CurveRow,
    document => Document of DocumentRow,
    drive_course => DriveCourse,
    drive_simulation => DriveSimulation of DriveSimulationRow,
    drive_verdict => DriveVerdict of DriveVerdictRow,
    finding_numbers => FindingNumbers of FindingNumberRow,
    findings => Findings of FindingRow,
    fit => Fit of FitRow,
    fleet => FleetTable of FleetRow,
    fleet_cells => FleetCells of FleetCellRow,
    fleet_changes => FleetChanges of FleetChangeRow,
    fleet_findings => FleetFindings of FleetFindingRow,
    fleet_outliers => FleetOutliers of FleetOutlierRow,
    forms => Forms of FormRow,
    friction_curves => FrictionCurves of FrictionCurveRow,
    inertials => Inertials of InertialRow,
    intake => Intake of IntakeRow,
    joint_drives => JointDrives of JointDriveRow,
    joint_torques => JointTorques of JointTorqueRow,
    motion => ArmMotion,
    network => Network of NetworkRow,
    observability => Observability of ObservabilityRow,
    parameters => Parameters of ParameterRow,
    prediction => Prediction of PredictionRow,
    recording => Recording,
    rejected => Rejected of RejectedRow,
    rivals => Rivals of RivalRow,
    robot => Robot of RobotRow,
    scoreboard => Scoreboard of ScoreboardRow,
    search_course => SearchCourse of SearchCourseRow,
    searches => Searches of SearchesRow,
    shares => Shares of ShareRow,
    spectrum => Spectrum of SpectrumRow,
    split => Split of SplitRow,
    statistics => Statistics of StatisticsRow,
    suspects => Suspects of SuspectsRow,
    torque_changes => TorqueChangeTable of TorqueChangeRow,
    torque_course => TorqueCourse,
    torque_covariance => TorqueCovariance of TorqueCovarianceRow,
    torque_findings => TorqueFindings of TorqueFindingRow,
    torque_numbers => TorqueNumbers of TorqueNumberRow,
    torque_parameters => TorqueParameters of TorqueParameterRow,
    torque_rivals => TorqueRivals of TorqueRivalRow,
    torque_verdict => TorqueVerdict of TorqueVerdictRow,
    training => Training of TrainingRow,
    truth => Truth of TruthRow,
    verdict => Verdict of VerdictRow,
    verdict_sentences => VerdictSentences of VerdictSentenceRow,
}
