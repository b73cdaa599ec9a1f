//! The mark of a corrected program: a comment line with a hash of the program that was corrected, by which it is known again.
//!
//! It stands behind what must come first: the line of DEF or DEFDAT in KRL, of MODULE in RAPID, of /MN in a listing of FANUC's (as a remark
//! of the program, 32 letters at most), else the `&` lines of KRL's head.

use super::Language;

/// What the comment begins with, behind the sign of a comment.
const MARK: &str = "corrected by calib";

/// Whether a program carries the mark.
pub fn stands_in(bytes: &[u8], language: Language) -> bool {
    lines(bytes).any(|line| {
        let is_before = |byte: &u8| {
            byte.is_ascii_whitespace()
                || language == Language::Fanuc && (byte.is_ascii_digit() || *byte == b':')
        };
        let line = &line[line.iter().take_while(|byte| is_before(byte)).count()..];
        line.strip_prefix(sign(language).as_bytes())
            .is_some_and(|rest| rest.trim_ascii_start().starts_with(MARK.as_bytes()))
    })
}

/// A corrected program with its mark, which carries `remarks`, too. `source`: the program as it was.
pub fn written(program: &[u8], source: &[u8], language: Language, remarks: &[&str]) -> Vec<u8> {
    let hash = blake3::hash(source).to_hex();
    let at = place(program, language);
    let ending = if program.windows(2).any(|two| two == b"\r\n") {
        "\r\n"
    } else {
        "\n"
    };
    // A head that no line ends.
    let before = if at > 0 && !program[..at].ends_with(b"\n") {
        ending
    } else {
        ""
    };
    let remarks: String = remarks.iter().map(|remark| format!(", {remark}")).collect();
    let comment = match language {
        Language::Fanuc => format!("{before}   :  !{MARK} from {} ;{ending}", &hash[..8]),
        _ => format!(
            "{before}{} {MARK} from {}{remarks}{ending}",
            sign(language),
            &hash[..16]
        ),
    };
    [&program[..at], comment.as_bytes(), &program[at..]].concat()
}

fn sign(language: Language) -> &'static str {
    match language {
        Language::Krl => ";",
        Language::Rapid | Language::Fanuc => "!",
        Language::UrScript => "#",
    }
}

fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes.split_inclusive(|byte| *byte == b'\n')
}

/// The byte before which the comment goes.
fn place(bytes: &[u8], language: Language) -> usize {
    let heads: &[&str] = match language {
        Language::Krl => &["DEF", "DEFDAT", "DEFFCT", "GLOBAL"],
        Language::Rapid => &["MODULE"],
        Language::Fanuc => &["/MN"],
        Language::UrScript => &[],
    };
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
