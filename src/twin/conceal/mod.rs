//! Concealed recordings: a seed draws a robot, its errors and what physics is hidden in it; the truth is sealed apart.
//!
//! `design` says what is drawn, [`family`] which effects there are and in which forms, `points` what is measured, `visible` how much
//! of an effect is left when geometry has absorbed what it can, `size` how large it is made, [`case`] makes one recording of it and
//! writes it down.
//! Adding a family: a row of [`family::FAMILIES`], or of [`family::BEYOND`] for what no library of effects holds yet.

pub mod case;
pub mod design;
pub mod family;
pub mod points;
pub mod robots;
pub(crate) mod size;
pub(crate) mod visible;
