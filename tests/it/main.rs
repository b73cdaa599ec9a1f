//! Integration tests, one module a capability.

mod desk;
mod effects;
mod fixture;
mod ingest;
mod layers;
mod report;
mod split;
mod store;
mod tables;
