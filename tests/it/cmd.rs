//! The command line does what the golden cases in `tests/cmd` say.

#[test]
fn commands_answer_as_their_golden_cases() {
    trycmd::TestCases::new().case("tests/cmd/*.trycmd").run();
}
