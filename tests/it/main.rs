//! Integration tests, one module a capability.

mod effects;
mod fixture;
mod layers;
mod store;
mod tables;
mod report;
