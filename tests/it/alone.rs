//! A test in a process of its own: what it measures of the process is its own.

use std::process::Command;

/// What the child is told by.
const MARK: &str = "CALIB_TEST_ALONE";

/// True in a process that runs this test and no other: there the test does its work. Elsewhere it starts that process, `module::name`
/// of the test, and fails where the test fails there.
pub fn alone(test: &str) -> bool {
    if std::env::var_os(MARK).is_some_and(|printed| printed == test) {
        return true;
    }
    let mut child = Command::new(std::env::current_exe().unwrap());
    let output = child
        .args(["--exact", test, "--nocapture", "--test-threads=1"])
        .env(MARK, test)
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stdout);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && message.contains("1 passed"),
        "{message}{complaint}"
    );
    false
}
