//! Integration tests, one module a capability.

mod arms;
mod cmd;
mod desk;
mod disk;
mod effects;
mod fixture;
mod identify;
mod ingest;
mod layers;
mod learn;
mod network;
mod pipelines;
mod poses;
mod readme;
mod report;
mod resume;
mod robot;
mod robot_faults;
mod schema;
mod screen;
mod split;
mod sr210d;
mod store;
mod swarm;
mod tables;
mod twin;
