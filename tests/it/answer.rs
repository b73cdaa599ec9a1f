//! What a program says, held against what it must say: a text that lacks a part is shown whole, with the part.

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
