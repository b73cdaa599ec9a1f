//! The command line does what the golden cases in `tests/cmd` say.
//!
//! `TRYCMD=overwrite cargo test --test it cmd` writes what the binary prints now; look at the difference before you keep it.

#[test]
fn commands_answer_as_their_golden_cases() {
    trycmd::TestCases::new().case("tests/cmd/*.trycmd").run();
}
