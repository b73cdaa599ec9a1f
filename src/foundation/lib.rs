//! What all packages may use: errors by reader, the robot as plain data, the units of numbers, their digits, order statistics. It computes no pose.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod description;
pub mod error;
pub mod figures;
pub mod statistics;
pub mod units;
