//! Joint positions that a program declares under names: `CONST jointtarget` of RAPID, `DECL E6AXIS` and `DECL AXIS` of KRL, positions in joints of
//! FANUC's listings, lists of six joints of URScript.
//!
//! A robot that is measured at the positions of a program logs no joints: the program holds them. Instructions are not looked at.

use super::{Declared, Language, Literal, Note, TargetKind, fanuc, krl, placed, rapid, urscript};

/// Bytes of a program that lists joints, at most.
pub const MOST_BYTES: usize = 64 << 20;

/// A joint position under a name.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedJoints {
    /// Line at which its first number stands, from 1.
    pub line: usize,
    /// As the program calls it.
    pub name: String,
    /// Six joints, deg.
    pub joints: Vec<f64>,
    /// Six external axes, deg or mm; none where one is not connected or not given.
    pub(crate) external: Vec<Option<f64>>,
}

/// All joint positions that a program declares, in its order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointList {
    /// In the order of the program.
    pub rows: Vec<ListedJoints>,
    /// How many poses it declares, whose joints it does not say.
    pub poses: usize,
}

/// The language of a file that declares positions, by the ending of its name and by how it begins: tables of text end in `.dat`, too.
pub fn listing(ending: &str, head: &[u8]) -> Option<Language> {
    let language = Language::of_ending(ending)?;
    let words: &[&str] = match language {
        Language::Krl => &[
            "DEFDAT",
            "DEF ",
            "E6AXIS",
            "E3AXIS",
            "DECL AXIS",
            "E6POS",
            "&ACCESS",
        ],
        Language::Rapid => &["JOINTTARGET", "ROBTARGET", "MODULE"],
        Language::Fanuc => &["/PROG"],
        Language::UrScript => &["DEF ", "MOVEJ", "MOVEL"],
    };
    let head = String::from_utf8_lossy(head).to_ascii_uppercase();
    words
        .iter()
        .any(|word| head.contains(word))
        .then_some(language)
}

/// Reads what a program declares; fails with every fault of that.
pub fn joint_list(bytes: &[u8], language: Language) -> Result<JointList, Vec<Note>> {
    if bytes.len() > MOST_BYTES {
        let message = format!(
            "a program of more than {} MB; allowed: shorter ones",
            MOST_BYTES >> 20
        );
        return Err(vec![Note {
            line: 1,
            column: 1,
            message,
        }]);
    }
    let Declared {
        mut found,
        names,
        poses,
    } = match language {
        Language::Krl => krl::listed(bytes),
        Language::Rapid => rapid::listed(bytes),
        Language::Fanuc => fanuc::listed(bytes),
        Language::UrScript => urscript::listed(bytes),
    };
    found.faults.append(&mut found.partial);
    found
        .faults
        .extend(found.literals.iter().flat_map(Literal::beyond_any_robot));
    let faults = placed(bytes, found.faults);
    if !faults.is_empty() {
        return Err(faults);
    }
    // By the line at which each stands; positions are declared one after the other.
    let lines = placed(
        bytes,
        found
            .literals
            .iter()
            .zip(names)
            .map(|(literal, name)| (literal.at(), name))
            .collect(),
    );
    found.literals.sort_by_key(Literal::at);
    let rows = found.literals.into_iter().zip(lines);
    let row = |(
        literal,
        Note {
            line,
            message: name,
            ..
        },
    ): (Literal, Note)| ListedJoints {
        line,
        name,
        joints: match literal.kind {
            TargetKind::Radians => literal.values.iter().map(|rad| rad.to_degrees()).collect(),
            _ => literal.values,
        },
        external: literal.external,
    };
    Ok(JointList {
        rows: rows.map(row).collect(),
        poses,
    })
}
