//! Diagnosis on recordings of the twin with one effect that the simulation does not know, and on the practice cases.

use crate::desk::Desk;
use serde_json::Value;

