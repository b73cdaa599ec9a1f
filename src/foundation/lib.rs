//! What estimator and twin may both use: the robot as plain data, the units of numbers, order statistics. It computes no pose.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod description;
pub mod statistics;
pub mod units;
