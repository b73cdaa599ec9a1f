//! Why a row is not used.

use crate::raw::RecordFault;

/// Why a row is not used; the stable word in the table `rejected`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reason {
    Blank,
    NotANumber,
    NotText,
    ShortRow,
    LongRow,
    LostBeam,
    OutOfRange,
    OutOfOrder,
    DuplicateId,
    DuplicateRow,
    DoubledStamp,
    Foreign,
    Damaged,
    Unmatched,
}

impl Reason {
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Blank => "blank",
            Self::NotANumber => "not_a_number",
            Self::NotText => "not_text",
            Self::ShortRow => "short_row",
            Self::LongRow => "long_row",
            Self::LostBeam => "lost_beam",
            Self::OutOfRange => "out_of_range",
            Self::OutOfOrder => "out_of_order",
            Self::DuplicateId => "duplicate_id",
            Self::DuplicateRow => "duplicate_row",
            Self::DoubledStamp => "doubled_stamp",
            Self::Foreign => "foreign",
            Self::Damaged => "damaged",
            Self::Unmatched => "unmatched",
        }
    }
}

impl From<RecordFault> for Reason {
    fn from(fault: RecordFault) -> Self {
        match fault {
            RecordFault::Damaged => Self::Damaged,
            RecordFault::Foreign => Self::Foreign,
            RecordFault::DoubledStamp => Self::DoubledStamp,
        }
    }
}

/// A row that is not used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RowRefusal {
    pub reason: Reason,
    pub detail: String,
}

pub(super) fn refuse<T>(reason: Reason, detail: String) -> Result<T, RowRefusal> {
    Err(RowRefusal { reason, detail })
}
