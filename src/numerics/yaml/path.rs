//! Paths of values in YAML: `stages[2].with.every`.

/// `stages[2]` + `with.every` -> `stages[2].with.every`.
pub(crate) fn join(path: &str, rest: &str) -> String {
    match (path.is_empty(), rest.is_empty() || rest.starts_with('[')) {
        (true, _) => rest.into(),
        (false, true) => format!("{path}{rest}"),
        (false, false) => format!("{path}.{rest}"),
    }
}

/// What follows a key at the head of a path.
pub(super) fn rest_after<'p>(path: &'p str, key: &str) -> Option<&'p str> {
    let rest = path.strip_prefix(key)?;
    if rest.is_empty() || rest.starts_with('[') {
        Some(rest)
    } else {
        rest.strip_prefix('.')
    }
}

/// The first key of a path and what follows it.
pub(super) fn split_key(path: &str) -> (&str, &str) {
    match path.find(['.', '[']) {
        Some(end) if path[end..].starts_with('.') => (&path[..end], &path[end + 1..]),
        Some(end) => (&path[..end], &path[end..]),
        None => (path, ""),
    }
}

/// The index at the head of a path, `[2]` or `2`, and what follows it.
pub(super) fn split_index(path: &str) -> Option<(usize, &str)> {
    let (digits, rest) = match path.strip_prefix('[') {
        Some(inner) => inner.split_once(']')?,
        None => path.split_at(path.find(['.', '[']).unwrap_or(path.len())),
    };
    Some((digits.parse().ok()?, rest.strip_prefix('.').unwrap_or(rest)))
}
