//! Integration tests, one module a capability.

mod arms;
mod desk;
mod arms;
mod effects;
mod fixture;
mod ingest;
mod layers;
mod report;
mod robot;
mod split;
mod store;
mod tables;
mod identify;
mod layers;
mod report;
mod robot;
mod store;
mod tables;
