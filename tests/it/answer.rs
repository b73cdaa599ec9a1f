//! The program as its user has it: files in a folder, words on a line, and what it answers.

use serde_json::Value;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A path below the repository.
pub fn root(path: impl AsRef<Path>) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

#[track_caller]
pub fn put(folder: impl AsRef<Path>, name: impl AsRef<Path>, content: impl AsRef<[u8]>) {
    std::fs::write(folder.as_ref().join(name), content).unwrap();
}

#[track_caller]
pub fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// Words of a command line: a text that blanks part, but for what stands between single quotes, or a list.
pub trait Words {
    fn words(&self) -> Vec<OsString>;
}

impl Words for str {
    fn words(&self) -> Vec<OsString> {
        let mut words = Vec::new();
        for (part, text) in self.split('\'').enumerate() {
            match part % 2 {
                0 => words.extend(text.split_whitespace().map(OsString::from)),
                _ => words.push(text.into()),
            }
        }
        words
    }
}

impl Words for String {
    fn words(&self) -> Vec<OsString> {
        self.as_str().words()
    }
}

impl<T: AsRef<OsStr>> Words for [T] {
    fn words(&self) -> Vec<OsString> {
        self.iter().map(|word| word.as_ref().into()).collect()
    }
}

impl<T: AsRef<OsStr>> Words for Vec<T> {
    fn words(&self) -> Vec<OsString> {
        self.as_slice().words()
    }
}

impl<T: AsRef<OsStr>, const N: usize> Words for [T; N] {
    fn words(&self) -> Vec<OsString> {
        self.as_slice().words()
    }
}

/// What a run of calib answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Answer {
    pub fn of(output: Output) -> Answer {
        let [out, err] =
            [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
        let code = output.status.code();
        Answer { code, out, err }
    }
    /// It ended with this code.
    #[track_caller]
    pub fn code(self, code: i32) -> Answer {
        assert_eq!(self.code, Some(code), "{}{}", self.out, self.err);
        self
    }
    /// What a run that succeeded printed.
    #[track_caller]
    pub fn ok(self) -> String {
        self.code(0).out
    }
    /// Why a run that was refused wrote nothing.
    #[track_caller]
    pub fn refused(self) -> String {
        let refused = self.code(10);
        assert_eq!(refused.out, "", "{}", refused.err);
        refused.err
    }
    /// The document that it printed, whatever its code.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|_| panic!("{}{}", self.out, self.err))
    }
    pub fn both(&self) -> String {
        self.out.clone() + &self.err
    }
}

/// Runs calib in a folder.
pub fn calib(folder: impl AsRef<Path>, words: &(impl Words + ?Sized)) -> Answer {
    fed(folder, words, "")
}

/// Runs calib in a folder with a text on its stdin.
pub fn fed(folder: impl AsRef<Path>, words: &(impl Words + ?Sized), input: &str) -> Answer {
    Answer::of(output(folder, words, input))
}

pub fn output(folder: impl AsRef<Path>, words: &(impl Words + ?Sized), input: &str) -> Output {
    let mut child = command(words)
        .current_dir(folder)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // A program that refuses its arguments does not read.
    let _ = std::io::Write::write_all(&mut child.stdin.take().unwrap(), input.as_bytes());
    child.wait_with_output().unwrap()
}

/// A run of calib that is not begun.
pub fn command(words: &(impl Words + ?Sized)) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calib"));
    command.args(words.words());
    command
}

/// One part of a text, or several.
pub trait Parts {
    fn missing(self, text: &str) -> Option<String>;
}

impl Parts for &str {
    fn missing(self, text: &str) -> Option<String> {
        (!text.contains(self)).then(|| self.into())
    }
}

impl Parts for &&str {
    fn missing(self, text: &str) -> Option<String> {
        (*self).missing(text)
    }
}

impl Parts for &String {
    fn missing(self, text: &str) -> Option<String> {
        self.as_str().missing(text)
    }
}

impl<const N: usize> Parts for [&str; N] {
    fn missing(self, text: &str) -> Option<String> {
        self.into_iter().find_map(|part| part.missing(text))
    }
}

/// The text has these parts; one that lacks any is shown whole.
#[track_caller]
pub fn has(text: &str, parts: impl Parts) {
    if let Some(part) = parts.missing(text) {
        panic!("`{part}` is not in: {text}");
    }
}

#[track_caller]
pub fn starts_with(text: &str, part: &str) {
    assert!(text.starts_with(part), "`{part}` does not begin: {text}");
}

#[track_caller]
pub fn ends_with(text: &str, part: &str) {
    assert!(text.ends_with(part), "`{part}` does not end: {text}");
}
