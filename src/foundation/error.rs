//! Errors by reader: who can mend it decides the type, and the type decides the exit code.

use std::ops::RangeInclusive;
use std::{fmt, io};

/// One fault with the place where it is: `stages[2].with.cycles`, `controller.csv:17`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Where: a file with line and column, a YAML path, a table.
    pub place: String,
    /// What is wrong there, and what is allowed.
    pub message: String,
}

impl Fault {
    /// A fault at a place.
    pub fn new(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            place: place.into(),
            message: message.into(),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.place.is_empty() {
            write!(f, "{}", self.message)
        } else {
            write!(f, "{}: {}", self.place, self.message)
        }
    }
}

/// A place in settings, and the faults that were found so far.
pub struct Place<'f> {
    faults: &'f mut Vec<Fault>,
    path: String,
}

impl Place<'_> {
    /// What a check of all settings finds.
    pub fn faults(check: impl FnOnce(&mut Place)) -> Vec<Fault> {
        let mut faults = Vec::new();
        let path = String::new();
        check(&mut Place {
            faults: &mut faults,
            path,
        });
        faults
    }
    /// A key, or a path of keys, below this place.
    pub fn at(&mut self, key: impl fmt::Display) -> Place<'_> {
        let path = match self.path.as_str() {
            "" => key.to_string(),
            path => format!("{path}.{key}"),
        };
        let faults = &mut *self.faults;
        Place { faults, path }
    }
    /// An item of the list at this place.
    pub fn item(&mut self, index: usize) -> Place<'_> {
        let path = format!("{}[{index}]", self.path);
        let faults = &mut *self.faults;
        Place { faults, path }
    }
    /// A fault of what stands here.
    pub fn fault(&mut self, message: impl Into<String>) {
        self.faults.push(Fault::new(&self.path, message));
    }
    /// A fault unless it holds.
    pub fn must(&mut self, holds: bool, message: impl Into<String>) {
        if !holds {
            self.fault(message);
        }
    }
    /// A fault unless a whole number is allowed.
    pub fn whole(&mut self, value: usize, allowed: RangeInclusive<usize>) {
        let (least, most) = (allowed.start(), allowed.end());
        let message = format!("expected a whole number from {least} to {most}, not {value}");
        self.must(allowed.contains(&value), message);
    }
}

/// Everything that can go wrong, by who can mend it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The author of a YAML file or of a command line: all faults at once. Exit code 2.
    #[error("{}", join(.0))]
    Spec(Vec<Fault>),
    /// The owner of the measurements: do not retry with the same data. Exit code 10.
    #[error("{}", join(.0))]
    Data(Vec<Fault>),
    /// The machine: disk, permissions, locks; later may work. Exit code 75.
    #[error("{0}")]
    Store(Fault),
    /// A bug in calib. Exit code 70.
    #[error("{0} (this is a bug in calib)")]
    Bug(String),
}

impl Error {
    /// One fault of a specification: code 2.
    pub fn spec(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Spec(vec![Fault::new(place, message)])
    }
    /// One fault of the data: code 10.
    pub fn data(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Data(vec![Fault::new(place, message)])
    }
    /// A fault of the machine or the store: code 75.
    pub fn store(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Store(Fault::new(place, message))
    }
    /// A file that does not open: a fault of the machine, unless there is no such file or it is none to read.
    pub fn unreadable(place: impl Into<String>, error: &io::Error) -> Self {
        use io::ErrorKind::{InvalidInput, IsADirectory, NotADirectory, NotFound};
        let message = format!("cannot be read: {error}");
        match error.kind() {
            NotFound | NotADirectory | IsADirectory | InvalidInput => Self::data(place, message),
            _ => Self::store(place, message),
        }
    }
    /// Fails with faults of a specification, where there are any.
    pub fn if_spec(faults: Vec<Fault>) -> Result<()> {
        if faults.is_empty() {
            return Ok(());
        }
        Err(Self::Spec(faults))
    }
    /// Fails with faults of the data, where there are any.
    pub fn if_data(faults: Vec<Fault>) -> Result<()> {
        if faults.is_empty() {
            return Ok(());
        }
        Err(Self::Data(faults))
    }
    /// The exit code of the process that fails with this error.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Spec(_) => 2,
            Self::Data(_) => 10,
            Self::Store(_) => 75,
            Self::Bug(_) => 70,
        }
    }
}

fn join(faults: &[Fault]) -> String {
    faults
        .iter()
        .map(Fault::to_string)
        .collect::<Vec<_>>()
        .join("\n")
}

/// A result whose error is an [`Error`] unless another one is named.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// A count with its noun: `1 row`, `2 rows`, `0 copies`. Of several words the last one changes.
pub fn counted(count: impl fmt::Display, noun: &str) -> String {
    let count = count.to_string();
    let last = |back: usize| noun.chars().rev().nth(back).unwrap_or_default();
    match last(0) {
        _ if count == "1" => format!("{count} {noun}"),
        'y' if !"aeiou".contains(last(1)) => format!("{count} {}ies", &noun[..noun.len() - 1]),
        's' | 'x' => format!("{count} {noun}es"),
        'h' if "cs".contains(last(1)) => format!("{count} {noun}es"),
        _ => format!("{count} {noun}s"),
    }
}

/// A text from a file on one line: control characters become blanks.
pub fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// A text from outside on one line, without a terminal's commands; what cannot be seen, as marks that turn the direction of writing, is
/// written out.
pub fn visible(text: &str) -> String {
    let hidden = |c: char| {
        c.is_control()
            || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    text.chars()
        .map(|c| {
            if hidden(c) {
                c.escape_default().to_string()
            } else {
                c.to_string()
            }
        })
        .collect()
}

/// The nearest of `allowed` to `given`, for "did you mean".
pub fn nearest<'a>(given: &str, allowed: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    allowed
        .into_iter()
        .map(|name| (strsim::damerau_levenshtein(given, name), name))
        // A single letter is not near to another.
        .filter(|(distance, name)| {
            *distance <= 1 + name.len() / 3 && *distance < given.len().max(name.len())
        })
        .min()
        .map(|(_, name)| name)
}

/// `; did you mean X?` where one of `allowed` is near to `given`; else nothing.
pub fn did_you_mean<'a>(given: &str, allowed: impl IntoIterator<Item = &'a str>) -> String {
    nearest(given, allowed).map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// The same with a full stop where none is near.
pub fn suggestion<'a>(given: &str, allowed: impl IntoIterator<Item = &'a str>) -> String {
    nearest(given, allowed).map_or_else(|| ".".into(), |name| format!("; did you mean `{name}`?"))
}

/// What may stand there instead: `; did you mean X? Allowed: X, Y`.
pub fn instead(found: &str, allowed: &[&str]) -> String {
    let hint = suggestion(found, allowed.iter().copied());
    format!("{hint} Allowed: {}", allowed.join(", "))
}

/// Names with commas, or `none`.
pub fn listed<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let names: Vec<S> = names.into_iter().collect();
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    if names.is_empty() {
        return "none".into();
    }
    names.join(", ")
}

/// The first `most` of some names, and how many more there are: `a, b and 3 more`.
pub fn first_of(names: &[impl AsRef<str>], most: usize) -> String {
    let shown: Vec<&str> = names.iter().take(most).map(AsRef::as_ref).collect();
    match names.len().saturating_sub(most) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::{Error, counted};
    use std::io::{self, ErrorKind};

    #[test]
    fn a_file_that_is_refused_now_may_open_later_and_one_that_is_not_there_is_a_fault_of_the_data()
    {
        let code =
            |kind: ErrorKind| Error::unreadable("day2.csv", &io::Error::from(kind)).exit_code();
        assert_eq!(
            [
                ErrorKind::PermissionDenied,
                ErrorKind::Other,
                ErrorKind::StaleNetworkFileHandle
            ]
            .map(code),
            [75; 3]
        );
        assert_eq!(
            [ErrorKind::NotFound, ErrorKind::InvalidInput].map(code),
            [10; 2]
        );
    }

    #[test]
    fn one_of_a_thing_is_named_as_one() {
        let counts = [
            (1, "row"),
            (2, "row"),
            (0, "fault"),
            (1, "copy"),
            (3, "copy"),
            (2, "key"),
            (2, "class"),
            (5, "action record"),
        ];
        let counts = counts.map(|(count, noun)| counted(count, noun));
        assert_eq!(
            counts,
            [
                "1 row",
                "2 rows",
                "0 faults",
                "1 copy",
                "3 copies",
                "2 keys",
                "2 classes",
                "5 action records"
            ]
        );
    }
}
