//! A panic is a bug in calib: one line that says where, and exit code 70.
//!
//! Panics that somebody catches, as of a decoder at a damaged file, are told by whoever catches them, and by nobody else.

use crate::error::{Error, Result};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::{Mutex, PoisonError};

/// The last panic of any thread: what it said, and where.
static LAST: Mutex<String> = Mutex::new(String::new());

/// Runs a verb; its panic becomes a bug, told on stderr.
pub(super) fn guarded(verb: impl FnOnce() -> u8) -> u8 {
    std::panic::set_hook(Box::new(keep));
    caught(verb).unwrap_or_else(|bug| super::complain(&bug))
}

/// What a verb gives, or the bug that its panic is.
fn caught(verb: impl FnOnce() -> u8) -> Result<u8> {
    catch_unwind(AssertUnwindSafe(verb))
        .map_err(|_| Error::Bug(LAST.lock().unwrap_or_else(PoisonError::into_inner).clone()))
}

fn keep(panic: &PanicHookInfo) {
    let said = panic.payload_as_str().unwrap_or("stopped without a word");
    let place = panic.location().map_or_else(String::new, |place| {
        format!(", at {}:{}", place.file(), place.line())
    });
    *LAST.lock().unwrap_or_else(PoisonError::into_inner) =
        format!("{}{place}", said.replace('\n', " "));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A verb with an index that is out of bounds, in a thread of its own.
    fn faulty(rows: &[u8]) -> u8 {
        let found = std::thread::scope(|scope| scope.spawn(|| rows[rows.len()]).join());
        found.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }

    #[test]
    fn a_panic_of_a_verb_is_a_bug_with_its_place_and_exit_code_70() {
        let hook = std::panic::take_hook();
        let code = guarded(|| faulty(&[1, 2, 3]));
        let bug = caught(|| faulty(&[1, 2, 3]));
        let sound = guarded(|| 10);
        std::panic::set_hook(hook);
        assert_eq!((code, sound), (70, 10));
        let said = super::super::message(&bug.unwrap_err());
        assert!(
            said.starts_with(
                "error: index out of bounds: the len is 3 but the index is 3, at src/cli/panics.rs:"
            ),
            "{said}"
        );
        assert!(
            said.ends_with("(this is a bug in calib)") && said.lines().count() == 1,
            "{said}"
        );
    }
}
