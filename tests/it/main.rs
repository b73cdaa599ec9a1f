//! Integration tests, one module a capability.

mod effects;
mod fixture;
