//! Ctrl-C: what was computed is in the store, and the command that was stopped goes on from there.

use signal_hook::consts::SIGINT;
use signal_hook::iterator::Signals;
use std::io::Write;

/// The exit code of a command that Ctrl-C stopped, as shells have it.
const STOPPED: i32 = 130;
const SAID: &[u8] = b"\nstopped; what was computed is kept: the same command goes on from there\n";

/// From now on Ctrl-C says how to go on before it ends the command.
#[expect(clippy::exit, reason = "nobody waits for a command that was stopped")]
pub(super) fn says_how_to_go_on() {
    let Ok(mut signals) = Signals::new([SIGINT]) else {
        return;
    };
    std::thread::spawn(move || {
        if signals.forever().next().is_some() {
            // A reader that has gone away is no fault.
            drop(std::io::stderr().write_all(SAID));
            std::process::exit(STOPPED);
        }
    });
}
