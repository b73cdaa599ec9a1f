//! The bridge between Parquet columns and Rust values: one file per table, one schema file each in `schemas/`.
//!
//! Most tables are a list of rows declared by `rows!`; only the recording, whose columns depend on the number of joints,
//! is written by hand.

use crate::error::Result;
pub use crate::store::Loose;
pub use crate::store::frame::Frame;
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
    Ok(Loose { table: T::from_frame(&loose.table)?, vouched: loose.vouched })
}

/// Declares a table as a list of rows: `rows! { "kind", /// doc pub struct Name of Row { column: type, ... } }`.
macro_rules! rows {
    ($kind:literal, $(#[$doc:meta])* pub struct $table:ident of $row:ident { $( $(#[$fdoc:meta])* $field:ident: $ty:ty, )+ }) => {
        #[doc = concat!("A row of the table `", $kind, "`.")]
        #[derive(Debug, Clone, PartialEq)]
        pub struct $row { $(
            #[doc = concat!("Column `", stringify!($field), "`; its unit and meaning stand in the schema of the table.")]
            #[doc = ""]
            $(#[$fdoc])*
            pub $field: $ty,
        )+ }
        $(#[$doc])*
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct $table(pub Vec<$row>);
        impl crate::table::Table for $table {
            const KIND: &'static str = $kind;
            fn to_frame(&self) -> crate::error::Result<crate::store::frame::Frame> {
                use crate::store::frame::Cell;
                let mut frame = crate::store::frame::FrameBuilder::new(Self::KIND);
                $( frame.push_present(stringify!($field), <$ty as Cell>::to_array(self.0.iter().map(|row| row.$field.clone()).collect()))?; )+
                frame.finish()
            }
            fn from_frame(frame: &crate::store::frame::Frame) -> crate::error::Result<Self> {
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
pub(crate) use rows;

mod body_consistency;
mod changes;
mod contacts;
mod convention;
mod corrections;
mod covariance;
mod curves;
mod document;
mod findings;
mod fit;
mod fleet;
mod forms;
mod friction_curves;
mod inertials;
mod intake;
mod joint_torques;
mod located;
mod motion;
mod network;
mod observability;
mod parameters;
mod point;
mod prediction;
mod recording;
mod rejected;
mod robot;
mod scoreboard;
mod searches;
mod split;
mod standing;
mod statistics;
mod suspects;
mod torque_changes;
mod torque_course;
mod torque_findings;
mod torque_parameters;
mod torque_verdict;
mod training;
mod truth;
mod verdict;

pub use crate::store::frame::TextCells;
pub use body_consistency::{BodyConsistencies, BodyConsistencyRow};
pub use changes::{ChangeRow, Changes};
pub use contacts::{ContactRow, Contacts};
pub use convention::{JointConventionRow, JointConventions};
pub use corrections::{Corrections, CorrectionsRow};
pub use covariance::{CovarianceRow, CovarianceTable};
pub use curves::{CurveRow, Curves};
pub use document::{Document, DocumentRow};
pub use findings::{FindingNumberRow, FindingNumbers, FindingRow, Findings, RivalRow, Rivals, is_separable_by_poses};
pub use fit::{Fit, FitRow};
pub use fleet::{FleetChangeRow, FleetChanges, FleetRow, FleetTable};
pub use forms::{FormRow, Forms, formula_in_words};
pub use friction_curves::{FrictionCurveRow, FrictionCurves};
pub use inertials::{InertialRow, Inertials};
pub use intake::{Intake, IntakeRow};
pub use joint_torques::{JointTorqueRow, JointTorques};
pub use located::{ShareRow, Shares, Spectrum, SpectrumRow};
pub use motion::ArmMotion;
pub use network::{Network, NetworkRow};
pub use observability::{FitContext, Observability, ObservabilityRow, UNFOLDED};
pub use parameters::{Corrected, ParameterRow, Parameters};
pub use prediction::{Prediction, PredictionRow};
pub use recording::{Recording, SOURCE as SIGMA_SOURCE, columns as recording_columns, frame as recording_frame};
pub use rejected::{Rejected, RejectedRow};
pub use robot::{Robot, RobotRow};
pub use scoreboard::{Scoreboard, ScoreboardRow};
pub use searches::{SearchCourse, SearchCourseRow, Searches, SearchesRow};
pub use split::{Split, SplitRow};
pub use standing::{Contradicted, Standing, Step, Unseen, Withdrawn, standing};
pub use statistics::{Statistics, StatisticsRow};
pub(crate) use suspects::slip;
pub use suspects::{Suspects, SuspectsRow};
pub use torque_changes::{TorqueChangeRow, TorqueChangeTable};
pub use torque_course::TorqueCourse;
pub use torque_findings::{TorqueFindingRow, TorqueFindings, TorqueNumberRow, TorqueNumbers, TorqueRivalRow, TorqueRivals};
pub use torque_parameters::{TorqueCovariance, TorqueCovarianceRow, TorqueParameterRow, TorqueParameters};
pub use torque_verdict::{TorqueVerdict, TorqueVerdictRow};
pub use training::{Training, TrainingRow};
pub use truth::{Truth, TruthRow};
pub use verdict::{Verdict, VerdictRow};

/// Every table kind; `schemas/<kind>.json` holds its schema.
pub const TABLES: &[&str] = &[
    BodyConsistencies::KIND,
    Changes::KIND,
    Contacts::KIND,
    JointConventions::KIND,
    Corrections::KIND,
    CovarianceTable::KIND,
    Curves::KIND,
    Document::KIND,
    FindingNumbers::KIND,
    Findings::KIND,
    Fit::KIND,
    FleetTable::KIND,
    FleetChanges::KIND,
    Forms::KIND,
    FrictionCurves::KIND,
    Inertials::KIND,
    Intake::KIND,
    JointTorques::KIND,
    ArmMotion::KIND,
    Network::KIND,
    Observability::KIND,
    Parameters::KIND,
    Prediction::KIND,
    Recording::KIND,
    Rejected::KIND,
    Rivals::KIND,
    Robot::KIND,
    Scoreboard::KIND,
    SearchCourse::KIND,
    Searches::KIND,
    Shares::KIND,
    Spectrum::KIND,
    Split::KIND,
    Statistics::KIND,
    Suspects::KIND,
    TorqueChangeTable::KIND,
    TorqueCourse::KIND,
    TorqueCovariance::KIND,
    TorqueFindings::KIND,
    TorqueNumbers::KIND,
    TorqueParameters::KIND,
    TorqueRivals::KIND,
    TorqueVerdict::KIND,
    Training::KIND,
    Truth::KIND,
    Verdict::KIND,
];
