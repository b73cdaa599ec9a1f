//! The library of physical effects, one file each.
