//! A panic is a bug in calib: one line that says where, and exit code 70.
//!
//! Panics that somebody catches, as of a decoder at a damaged file, are told by whoever catches them, and by nobody else.

use crate::error::Error;
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::{Mutex, PoisonError};

/// The last panic of any thread: what it said, and where.
static LAST: Mutex<String> = Mutex::new(String::new());

/// Runs a verb; its panic becomes a bug.
pub(super) fn guarded(verb: impl FnOnce() -> u8) -> u8 {
    std::panic::set_hook(Box::new(keep));
    catch_unwind(AssertUnwindSafe(verb)).unwrap_or_else(|_| {
        let last = LAST.lock().unwrap_or_else(PoisonError::into_inner).clone();
        super::complain(&Error::Bug(last))
    })
}

fn keep(panic: &PanicHookInfo) {
    let said = panic.payload_as_str().unwrap_or("stopped without a word");
    let place = panic.location().map_or_else(String::new, |place| format!(", at {}:{}", place.file(), place.line()));
    *LAST.lock().unwrap_or_else(PoisonError::into_inner) = format!("{}{place}", said.replace('\n', " "));
}
