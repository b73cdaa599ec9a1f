//! The robot as data, its import, its screws and its gravity torques.

pub mod description;
