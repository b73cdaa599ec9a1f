//! A program read, corrected and written again, whole: targets that cannot be reached are refused, since a program has no place for a remark.
//!
//! It stands behind what must come first: the line of DEF or DEFDAT in KRL, of MODULE in RAPID, of /MN in a listing of FANUC's (as a remark
//! of the program, 32 letters at most), else the `&` lines of KRL's head.

use super::{
    Companion, Frames, JOINTS, Language, Note, Partial, Program, ProgramRefusal, Rewritten,
    RobotTool, solve,
};
use crate::compensate::{Corrector, unstated_payload};
use crate::description::RobotDescription;
use crate::error::{Error, Fault, Result};
use crate::robot::RobotModel;

/// Faults told of a program: more are of a file that is none.
const MOST_FAULTS: usize = 500;

/// A program as a file has it.
pub struct ProgramFile<'a> {
    /// How messages name it.
    pub place: &'a str,
    /// As it is in the file.
    pub text: &'a [u8],
    /// By the ending of the file.
    pub language: Language,
    /// Its other files.
    pub companions: &'a [Companion<'a>],
}

impl ProgramFile<'_> {
    /// File, line and column.
    pub fn at(&self, note: &Note) -> String {
        format!("{}:{}:{}", self.place, note.line, note.column)
    }

    fn refused(&self, refusal: ProgramRefusal) -> Error {
        let shown = refusal.faults.iter().take(MOST_FAULTS);
        let fault = |note: &Note| Fault::new(self.at(note), &note.message);
        let mut faults: Vec<Fault> = shown.map(fault).collect();
        if refusal.faults.len() > MOST_FAULTS {
            let message = format!("and {} more", refusal.faults.len() - MOST_FAULTS);
            faults.push(Fault::new(self.place, message));
        }
        if refusal.partial > 0 {
            let message = "partial targets stay as they are with --leave-partial";
            faults.push(Fault::new(self.place, message));
        }
        Error::Data(faults)
    }
}

/// By what load targets of a program are corrected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProgramLoad {
    /// A person's, kg, whatever the program states.
    Stated(f64),
    /// The program's. One with a target of which it states none is refused: the model was measured under up to so many kg and depends on it.
    Needed(f64),
    /// The program's, if it states one.
    Optional,
}

/// How a program is taken.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgramRules {
    /// Targets that state some of their numbers.
    pub partial: Partial,
    /// Frames that are not applied.
    pub frames: Frames,
    /// What is carried.
    pub load: ProgramLoad,
    /// Which tool of the program is the robot file's, where a person says.
    pub tool: Option<RobotTool>,
    /// Why the base in which the controller counts poses is not the robot file's, where that is known.
    pub base: Option<String>,
}

/// The program with its targets corrected; fails with every fault of it.
pub fn corrected(
    source: &ProgramFile,
    rules: ProgramRules,
    robot: &RobotDescription,
    corrector: &mut Corrector,
) -> Result<Rewritten> {
    let ProgramRules {
        partial,
        frames,
        load,
        tool,
        base,
    } = rules;
    let robot = RobotModel::new(robot.clone());
    if robot.joints() != JOINTS {
        let joints = robot.joints();
        let message = format!("programs have targets of {JOINTS} joints, the robot has {joints}");
        return Err(Error::spec(source.place, message));
    }
    let mut program = Program::parse_with(source.text, source.language, partial, source.companions)
        .map_err(|refusal| source.refused(refusal))?;
    if program.literals().is_empty() {
        return Err(Error::data(source.place, "has no targets"));
    }
    program
        .relate_tools(&robot, tool.as_ref())
        .map_err(|message| Error::spec(source.place, message))?;
    if let Some(why) = &base {
        program.base_differs(why);
    }
    let refused = |notes: &[Note]| {
        let accepted = |note: &Note| Note {
            message: format!("{}; --assume-frames accepts it", note.message),
            ..note.clone()
        };
        let faults = notes.iter().map(accepted).collect();
        source.refused(ProgramRefusal { faults, partial: 0 })
    };
    if frames == Frames::Refused && !program.moving().is_empty() {
        return Err(refused(program.moving()));
    }
    // Joint targets are the same in every frame.
    let mut literals = program.literals().iter();
    let cartesian = literals.any(|literal| !literal.kind.is_of_joints());
    if frames == Frames::Refused && cartesian && !program.frames().is_empty() {
        return Err(refused(program.frames()));
    }
    let mut literals = program.literals().iter();
    match load {
        ProgramLoad::Stated(payload) => program.carries(payload),
        ProgramLoad::Needed(most) if literals.any(|literal| literal.payload.is_none()) => {
            return Err(Error::data(source.place, unstated_payload(most)));
        }
        ProgramLoad::Needed(_) | ProgramLoad::Optional => {}
    }
    let answers = solve(program.literals(), &robot, corrector);
    program
        .rewritten(answers)
        .map_err(|refusal| source.refused(refusal))
}

/// What the comment begins with, behind the sign of a comment.
const MARK: &str = "corrected by calib";

/// Whether a program carries the mark.
pub fn has_mark(bytes: &[u8], language: Language) -> bool {
    lines(bytes).any(|line| {
        let is_before = |byte: &u8| {
            byte.is_ascii_whitespace()
                || language == Language::Fanuc && (byte.is_ascii_digit() || *byte == b':')
        };
        let line = &line[line.iter().take_while(|byte| is_before(byte)).count()..];
        line.strip_prefix(language.grammar().comment.as_bytes())
            .is_some_and(|tail| tail.trim_ascii_start().starts_with(MARK.as_bytes()))
    })
}

/// A corrected program with its mark, which carries `remarks`, too. `source`: the program as it was.
pub fn with_mark(program: &[u8], source: &[u8], language: Language, remarks: &[&str]) -> Vec<u8> {
    let hash = blake3::hash(source).to_hex();
    let at = place(program, language);
    let ending = match program.windows(2).any(|two| two == b"\r\n") {
        true => "\r\n",
        false => "\n",
    };
    // A head that no line ends.
    let is_open = at > 0 && !program[..at].ends_with(b"\n");
    let before = if is_open { ending } else { "" };
    let remarks: String = remarks.iter().map(|remark| format!(", {remark}")).collect();
    let comment = match language {
        Language::Fanuc => format!("{before}   :  !{MARK} from {} ;{ending}", &hash[..8]),
        _ => {
            let (sign, hash) = (language.grammar().comment, &hash[..16]);
            format!("{before}{sign} {MARK} from {hash}{remarks}{ending}")
        }
    };
    [&program[..at], comment.as_bytes(), &program[at..]].concat()
}

fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.split_inclusive(|byte| *byte == b'\n')
}

/// The byte before which the comment goes.
fn place(bytes: &[u8], language: Language) -> usize {
    let heads = language.grammar().heads;
    let (mut end, mut first) = (0, 0);
    let mut leading = true;
    for line in lines(bytes) {
        end += line.len();
        let text = String::from_utf8_lossy(line).to_uppercase();
        let word = text.split_whitespace().next().unwrap_or_default();
        if heads.contains(&word) {
            return end;
        }
        leading = leading && (line.starts_with(b"&") || line.starts_with(b"\xef\xbb\xbf&"));
        if leading {
            first = end;
        }
    }
    first
}
