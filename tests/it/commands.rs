//! The command line as users see it: golden cases as data in `tests/cmd`.
//!
//! `TRYCMD=overwrite cargo test --test it commands` writes what the binary prints now; look at the difference before you keep it.

use std::path::Path;

#[test]
fn commands_print_what_their_cases_say() {
    trycmd::TestCases::new().register_bin("calib", Path::new(env!("CARGO_BIN_EXE_calib"))).case("tests/cmd/*.trycmd");
}
