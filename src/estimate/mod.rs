//! Estimation: least squares, observability, swarm, network.

pub mod network;
pub mod swarm;
