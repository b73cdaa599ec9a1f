//! Integration tests, one module a capability.

#![allow(
    clippy::disallowed_methods,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "tests read the environment and the clock, and say what they skipped"
)]

#[cfg(target_os = "linux")]
mod alone;
mod answer;
mod api;
mod bags;
mod beyond;
mod bucket;
mod check;
mod cmd;
mod columns;
mod compensate;
mod complete_runs;
mod computed;
mod conceal;
mod covariance;
mod criteria;
mod curves;
mod declared;
mod desk;
mod diagnose;
mod diff;
mod digests;
mod drives;
mod drives_tables;
mod effects;
mod export;
mod fixture;
mod fleet;
mod folds;
mod forms;
mod gauges;
mod held_locks;
mod identify;
mod ingest;
mod init;
mod learn;
mod library;
mod library_of_arms;
mod motion;
mod network;
mod own_effects;
mod pages;
mod parameter_sets;
mod pipelines;
mod poses;
mod program;
mod query;
mod raw;
mod readme;
mod recorded;
mod remedies;
mod repeats;
mod report;
mod reported;
mod resume;
mod robot;
mod robot_faults;
mod screen;
mod shapes;
mod sockets;
mod source;
mod split;
mod sr210d;
mod store;
mod suspects;
mod swarm;
mod tables;
mod tolerances;
mod torques;
mod trail;
mod transfer;
mod twin;
mod unmoved;
mod verb_help;
mod verify_robot;
mod vouched;
mod weights;
mod whose_model;
mod workbook;
