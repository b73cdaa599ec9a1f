//! Sentences with holes: `the zero of {place} follows ... by {value}`.

/// The words in the holes of a sentence; `None` for one that is not closed.
pub fn holes(sentence: &str) -> Vec<Option<&str>> {
    let parts = sentence.split('{').skip(1);
    parts.map(|part| part.split_once('}').map(|(word, _)| word)).collect()
}

/// The sentence with what is known of each word.
pub fn filled(sentence: &str, known: &dyn Fn(&str) -> String) -> String {
    let mut parts = sentence.split('{');
    let mut out = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (word, rest) = part.split_once('}').unwrap_or(("", part));
        out.push_str(&known(word));
        out.push_str(rest);
    }
    out
}
