//! Files that are known and not read, by how they begin, and what to do with each.

/// How programs begin, and what they are.
const PROGRAMS: [(&str, &str); 7] = [
    ("/PROG", FANUC),
    ("MODULE", RAPID),
    ("%%%", RAPID),
    ("&ACCESS", KRL),
    ("&REL", KRL),
    ("DEFDAT", KRL),
    ("DEF", KRL),
];
const FANUC: &str =
    "is a FANUC program (a listing of TP): name it .ls, and its joint positions are read";
const RAPID: &str =
    "is an ABB program in RAPID: name it .mod or .prg, and its joint positions are read";
const KRL: &str =
    "is a KUKA program in KRL: name it .src or .dat, and its joint positions are read";

/// What a file is that begins so and is not read under its name, and what to do; none where it may be delimited text.
pub fn not_read(head: &[u8]) -> Option<&'static str> {
    let begins = head.trim_ascii_start();
    let is = |word: &str| {
        let rest = begins.get(word.len()..).unwrap_or_default();
        begins.starts_with(word.as_bytes())
            && (word == "%%%"
                || rest
                    .first()
                    .is_some_and(|next| [b' ', b'\t'].contains(next)))
    };
    PROGRAMS
        .iter()
        .find(|(word, _)| is(word))
        .map(|(_, what)| *what)
}

#[cfg(test)]
mod tests {
    use super::not_read;

    #[test]
    fn programs_are_told_from_text_by_how_they_begin() {
        let said = |head: &[u8]| not_read(head).unwrap_or_default();
        assert!(said(b"/PROG  MEASURE\n/ATTR\n").contains("FANUC"));
        assert!(
            said(b"\r\nMODULE Measure\n").contains("ABB")
                && said(b"%%%\n  VERSION:1\n").contains("ABB")
        );
        assert!(said(b"DEF MEASURE( )\n").contains("KUKA"));
        for text in [
            &b"MODULE,X,Y\n"[..],
            b"DEFLECTION X Y\n",
            b"name;A1;A2\n",
            b"% made by hand\n",
            b"",
        ] {
            assert_eq!(not_read(text), None);
        }
    }
}
