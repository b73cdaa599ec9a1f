//! Commands and responses of drives whose truth is known: recordings of servos with concealed physics.
//!
//! `rig` is an arm with its drives, `law` what is concealed and what it changes of a rig, `motion` moves it by small explicit steps, `draw` draws a
//! case of a seed, `record` measures it and writes the files, `visible` says how much of each effect data can show.

mod draw;
mod law;
mod motion;
mod record;
mod rig;
mod visible;

pub use draw::DriveCase;
