//! The `calib` binary: hands the command line to [`calib::cli`] and turns the result into an exit code.

use std::process::ExitCode;

#[expect(
    clippy::disallowed_methods,
    reason = "the command line comes from here"
)]
fn main() -> ExitCode {
    ExitCode::from(calib::cli::main(std::env::args_os().collect()))
}
