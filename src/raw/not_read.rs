//! Files that are known and not read, by how they begin, and what to do with each.

/// How a bag of ROS 2 begins (SQLite), and one of MCAP.
const SQLITE: &[u8] = b"SQLite format 3\0";
const MCAP: &[u8] = b"\x89MCAP0\r\n";
/// How programs begin, and what they are.
const PROGRAMS: [(&str, &str); 7] = [
    (
        "/PROG",
        "is a FANUC program (a listing of TP): its positions are not read; write them as text, a row for each with its name and J1 to J6 in deg. \
         Programs of KUKA (.src, .dat) and ABB (.mod, .prg) are read",
    ),
    ("MODULE", RAPID),
    ("%%%", RAPID),
    ("&ACCESS", KRL),
    ("&REL", KRL),
    ("DEFDAT", KRL),
    ("DEF", KRL),
];
const RAPID: &str = "is an ABB program in RAPID: name it .mod or .prg, and its joint positions are read";
const KRL: &str = "is a KUKA program in KRL: name it .src or .dat, and its joint positions are read";

/// What a file is that begins so and is not read under its name, and what to do; none where it may be delimited text.
pub fn not_read(head: &[u8]) -> Option<&'static str> {
    if head.starts_with(SQLITE) {
        return Some(
            "is a database of SQLite (.db3: a bag of ROS 2), which is not read yet: write its joint states as text, a row for each \
             message, with the script under `Bags of ROS 2` in pipelines/dynamics/README.md",
        );
    }
    if head.starts_with(MCAP) {
        return Some(
            "is a recording in MCAP, which is not read yet: write its joint states as text, a row for each message, with the script \
             under `Bags of ROS 2` in pipelines/dynamics/README.md",
        );
    }
    let begins = head.trim_ascii_start();
    let is = |word: &str| {
        let rest = begins.get(word.len()..).unwrap_or_default();
        begins.starts_with(word.as_bytes()) && (word == "%%%" || rest.first().is_some_and(|next| [b' ', b'\t'].contains(next)))
    };
    PROGRAMS.iter().find(|(word, _)| is(word)).map(|(_, what)| *what)
}

#[cfg(test)]
mod tests {
    use super::not_read;

    #[test]
    fn bags_and_programs_are_told_from_text_by_how_they_begin() {
        let said = |head: &[u8]| not_read(head).unwrap_or_default();
        assert!(said(b"SQLite format 3\0\x10").contains("a bag of ROS 2"));
        assert!(said(b"\x89MCAP0\r\n\x01").contains("MCAP"));
        assert!(said(b"/PROG  MEASURE\n/ATTR\n").contains("FANUC"));
        assert!(said(b"\r\nMODULE Measure\n").contains("ABB") && said(b"%%%\n  VERSION:1\n").contains("ABB"));
        assert!(said(b"DEF MEASURE( )\n").contains("KUKA"));
        for text in [&b"MODULE,X,Y\n"[..], b"DEFLECTION X Y\n", b"name;A1;A2\n", b"% made by hand\n", b""] {
            assert_eq!(not_read(text), None);
        }
    }
}
