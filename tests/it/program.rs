//! Programs of controllers: what is read as a target, what is refused, and that nothing but numbers of targets changes.

mod fanuc;
mod flow;
mod krl;
mod mutated;
mod random;
mod rapid;
mod reader;
mod surroundings;
mod urscript;

use calib::program::{
    Language, Literal, Note, Partial, PostureStatement, Program, SolvedLiteral, TargetKind,
};

fn message_of(notes: &[Note]) -> Vec<String> {
    notes
        .iter()
        .map(|note| format!("{}:{}: {}", note.line, note.column, note.message))
        .collect()
}

/// Targets and warnings of a program that is accepted.
fn accepted(language: Language, text: &str) -> (Vec<(TargetKind, Vec<f64>)>, Vec<String>) {
    let program = Program::parse(text.as_bytes(), language, Partial::Refused)
        .unwrap_or_else(|refusal| panic!("{text}\n{:#?}", message_of(&refusal.faults)));
    let targets = program
        .literals()
        .iter()
        .map(|literal| (literal.kind, literal.values.clone()))
        .collect();
    (targets, message_of(program.warnings()))
}

/// The faults of a program that is refused.
fn refused(language: Language, text: &str) -> Vec<String> {
    match Program::parse(text.as_bytes(), language, Partial::Refused) {
        Ok(program) => panic!("accepted: {text}\n{:?}", program.literals()),
        Err(refusal) => message_of(&refusal.faults),
    }
}

/// The program with `by` added to every number of every target.
fn moved(program: &Program, by: f64) -> Vec<u8> {
    let answer = |literal: &Literal| SolvedLiteral {
        values: literal.values.iter().map(|value| value + by).collect(),
        posture: literal.posture,
        remark: String::new(),
    };
    let answers = program
        .literals()
        .iter()
        .map(|literal| Ok(answer(literal)))
        .collect();
    program.rewritten(answers).unwrap().bytes
}

#[test]
fn a_number_stays_as_it_was_written_where_nothing_is_to_be_corrected() {
    let text = "DECL E6AXIS H={A1 -0,A2 - 10.50,A3 2E1,A4 +5,A5 30.0000004,A6 1e-3,E1 0}\r\n";
    let program = Program::parse(text.as_bytes(), Language::Krl, Partial::Refused).unwrap();
    assert_eq!(String::from_utf8_lossy(&moved(&program, 0.0)), text);
    assert_eq!(String::from_utf8_lossy(&moved(&program, 4e-7)), text);
    assert_eq!(
        String::from_utf8_lossy(&moved(&program, 1e-6)),
        "DECL E6AXIS H={A1 0.000001,A2 -10.499999,A3 20.000001,A4 5.000001,A5 30.000001,A6 0.001001,E1 0}\r\n"
    );
}

#[test]
fn a_number_that_loses_its_sign_does_not_run_into_its_name() {
    let text = "PTP {A1-0.1,A2-0.3,A3+0,A4 0,A5 0,A6-9}";
    let program = Program::parse(text.as_bytes(), Language::Krl, Partial::Refused).unwrap();
    assert_eq!(
        program.literals()[0].values,
        [-0.1, -0.3, 0.0, 0.0, 0.0, -9.0]
    );
    let written = "PTP {A1 0.100000,A2-0.100000,A3 0.200000,A4 0.200000,A5 0.200000,A6-8.800000}";
    assert_eq!(String::from_utf8_lossy(&moved(&program, 0.2)), written);
}

#[test]
fn a_program_with_one_target_without_an_answer_is_refused_whole() {
    let text = "PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\nPTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 7}\n";
    let program = Program::parse(text.as_bytes(), Language::Krl, Partial::Refused).unwrap();
    let good = SolvedLiteral {
        values: vec![1.0; 6],
        posture: PostureStatement::Unstated,
        remark: String::new(),
    };
    let refusal = program
        .rewritten(vec![Ok(good), Err("not reached".into())])
        .expect_err("no answer");
    assert_eq!(message_of(&refusal.faults), ["2:9: not reached"]);
}

#[test]
fn what_other_readers_may_take_for_the_end_of_a_line_is_refused() {
    let text = "; a comment\rPTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\r\n";
    assert_eq!(
        refused(Language::Krl, text),
        ["1:12: a carriage return without a line feed"]
    );
    let text = "! a comment\rMoveAbsJ p,v1,z1,t;\n\0";
    assert_eq!(
        refused(Language::Rapid, text),
        [
            "1:12: a carriage return without a line feed",
            "2:1: a zero byte: no program text (UTF-16 is not read)"
        ]
    );
}

#[test]
fn a_language_is_known_by_the_ending_of_a_file() {
    let of_ending = |ending| Language::of_ending(ending);
    assert_eq!(
        (
            of_ending("SRC"),
            of_ending("dat"),
            of_ending("Mod"),
            of_ending("csv")
        ),
        (
            Some(Language::Krl),
            Some(Language::Krl),
            Some(Language::Rapid),
            None
        )
    );
}

#[test]
fn brackets_without_end_are_a_fault_and_no_overflow() {
    let deep =
        |open: &str, close: &str| format!("{}{}", open.repeat(200_000), close.repeat(200_000));
    assert_eq!(
        refused(Language::Krl, &format!("X={}", deep("{", "}"))),
        ["1:18: brackets are nested too deep"]
    );
    assert_eq!(
        refused(Language::Rapid, &format!("X:={};", deep("[", "]"))),
        ["1:19: brackets are nested too deep"]
    );
    let tool = format!("PERS tooldata t:={};", deep("[", "]"));
    assert_eq!(
        refused(Language::Rapid, &tool),
        ["1:33: brackets are nested too deep"]
    );
}

#[test]
fn configurations_and_turns_are_read_as_postures() {
    let postures = |language: Language, text: &str| -> Vec<PostureStatement> {
        let program = Program::parse(text.as_bytes(), language, Partial::Refused).unwrap();
        program
            .literals()
            .iter()
            .map(|literal| literal.posture)
            .collect()
    };
    let robtarget =
        |cf: &str| format!("MoveL [[1,2,3],[1,0,0,0],[{cf}],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;");
    assert_eq!(
        postures(Language::Rapid, &robtarget("1,-2,0,4")),
        [PostureStatement::Configuration([1, -2, 0, 4])]
    );
    assert_eq!(
        postures(Language::Rapid, &robtarget("9E9,9E9,9E9,9E9")),
        [PostureStatement::Unstated]
    );
    assert_eq!(
        refused(Language::Rapid, &robtarget("0,0,0,8")),
        ["1:33: 8 is no configuration cfx, expected a whole number from 0 to 7"]
    );
    let found = refused(Language::Rapid, &robtarget("0.5,0,0,0"));
    assert_eq!(
        found,
        ["1:27: 0.5 is no quadrant of a joint, expected a whole number"]
    );
    let of_status = |status, turn| PostureStatement::StatusTurn { status, turn };
    let pos = |tail: &str| format!("LIN {{X 1,Y 2,Z 3,A 4,B 5,C 6{tail}}}");
    for (text, bits) in [("T 10", 10), ("T 'B101010'", 42), ("T 'H2A'", 42)] {
        assert_eq!(
            postures(Language::Krl, &pos(&format!(",{text}"))),
            [of_status(None, Some(bits))],
            "{text}"
        );
    }
    assert_eq!(
        postures(Language::Krl, &pos("")),
        [PostureStatement::Unstated]
    );
    assert_eq!(
        postures(Language::Krl, &pos(",S 2")),
        [of_status(Some(2), None)]
    );
    assert_eq!(
        postures(Language::Krl, &pos(",S 'B110',T 27")),
        [of_status(Some(6), Some(27))]
    );
    for text in ["T -1", "T 1.5", "T 'B12'", "T x"] {
        assert!(
            refused(Language::Krl, &pos(&format!(",{text}")))[0]
                .contains("expected a whole number or a bit pattern"),
            "{text}"
        );
    }
}
