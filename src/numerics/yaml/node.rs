//! A YAML value with its place in the file.

/// Where a value was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// In the text.
    Line {
        /// From 1.
        line: u64,
        /// From 1.
        column: u64,
    },
    /// `--set`.
    CommandLine,
    /// Not in a text, e.g. from the command line.
    Unknown,
}

/// A value with its place.
#[derive(Debug, Clone)]
pub struct Node {
    /// What stands there.
    pub value: YamlValue,
    /// Where it stands.
    pub mark: Mark,
    /// A number or boolean as it was spelt, for where text is wanted.
    pub raw: Option<String>,
    /// Given on the command line: a relative path starts at the working directory.
    pub overridden: bool,
    /// First byte and length in the text; nothing of what is in no text.
    pub bytes: Option<(u64, u64)>,
}

/// What YAML can hold, keys in the order of the text.
#[derive(Debug, Clone)]
pub enum YamlValue {
    /// `null`, `~` or nothing.
    Null,
    /// `true` or `false`, and no other word.
    Bool(bool),
    /// A whole number.
    Integer(i128),
    /// Another number.
    Float(f64),
    /// Anything else.
    Text(String),
    /// In block or flow style.
    List(Vec<Node>),
    /// In the order of the file.
    Map(Vec<(String, Mark, Node)>),
}

impl Node {
    /// A value at a place.
    pub fn new(value: YamlValue, mark: Mark) -> Self {
        Self {
            value,
            mark,
            raw: None,
            overridden: false,
            bytes: None,
        }
    }
    /// A map without entries.
    pub fn empty_map(mark: Mark) -> Self {
        Self::new(YamlValue::Map(Vec::new()), mark)
    }

    /// Remembers how numbers and booleans were spelt.
    pub(super) fn fill_raw(&mut self, text: &str) {
        let bytes = self.bytes.take();
        match &mut self.value {
            YamlValue::Bool(_) | YamlValue::Integer(_) | YamlValue::Float(_) => {
                self.raw = bytes.and_then(|(start, length)| {
                    let start = usize::try_from(start).ok()?;
                    let end = start.checked_add(usize::try_from(length).ok()?)?;
                    text.get(start..end).map(|raw| raw.trim().to_string())
                });
            }
            YamlValue::List(items) => items.iter_mut().for_each(|item| item.fill_raw(text)),
            YamlValue::Map(entries) => entries
                .iter_mut()
                .for_each(|(_, _, value)| value.fill_raw(text)),
            YamlValue::Null | YamlValue::Text(_) => {}
        }
    }

    /// A scalar as text, as it was spelt; nothing for lists, blocks and null.
    pub fn text(&self) -> Option<String> {
        let plain = match &self.value {
            YamlValue::Text(text) => return Some(text.clone()),
            YamlValue::Bool(value) => value.to_string(),
            YamlValue::Integer(value) => value.to_string(),
            YamlValue::Float(value) => value.to_string(),
            YamlValue::Null | YamlValue::List(_) | YamlValue::Map(_) => return None,
        };
        Some(self.raw.clone().unwrap_or(plain))
    }

    /// Entries of a map, each with the place of its key; none of anything else.
    pub fn entries(&self) -> &[(String, Mark, Node)] {
        if let YamlValue::Map(entries) = &self.value {
            entries
        } else {
            &[]
        }
    }
    /// Items of a list; none of anything else.
    pub fn items(&self) -> &[Node] {
        if let YamlValue::List(items) = &self.value {
            items
        } else {
            &[]
        }
    }
    /// The value of a key of a map.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entries()
            .iter()
            .find(|(name, _, _)| name == key)
            .map(|(_, _, node)| node)
    }

    /// The node at a path like `effects[0].cycles` or `effects.0.cycles`.
    pub fn at(&self, path: &str) -> Option<&Node> {
        if path.is_empty() {
            return Some(self);
        }
        match &self.value {
            YamlValue::Map(entries) => entries
                .iter()
                .find_map(|(key, _, node)| rest_after(path, key).and_then(|tail| node.at(tail))),
            YamlValue::List(items) => {
                let (index, tail) = split_index(path)?;
                items.get(index)?.at(tail)
            }
            _ => None,
        }
    }
    /// The node of a path like `stages[2].with.n`, to be changed.
    pub fn at_mut(&mut self, path: &str) -> Option<&mut Node> {
        if path.is_empty() {
            return Some(self);
        }
        match &mut self.value {
            YamlValue::Map(entries) => entries.iter_mut().find_map(|(key, _, node)| {
                rest_after(path, key).and_then(|tail| node.at_mut(tail))
            }),
            YamlValue::List(items) => {
                let (index, tail) = split_index(path)?;
                items.get_mut(index)?.at_mut(tail)
            }
            _ => None,
        }
    }
    /// The mark of the deepest node on a path that exists.
    pub fn nearest_mark(&self, path: &str) -> Mark {
        let mut end = path.len();
        loop {
            if let Some(node) = self.at(&path[..end]) {
                return node.mark;
            }
            match path[..end].rfind(['.', '[']) {
                Some(shorter) => end = shorter,
                None => return self.mark,
            }
        }
    }

    /// Puts a value at a path, making blocks on the way; an index must exist or be the next one.
    pub fn put(&mut self, path: &str, node: Node) -> Result<(), String> {
        if let Some(place) = self.at_mut(path) {
            *place = node;
            return Ok(());
        }
        if matches!(self.value, YamlValue::Null) {
            self.value = YamlValue::Map(Vec::new());
        }
        match &mut self.value {
            YamlValue::Map(entries) => {
                for (key, _, child) in entries.iter_mut() {
                    if let Some(tail) = rest_after(path, key) {
                        return child.put(tail, node);
                    }
                }
                let (key, tail) = split_key(path);
                let mut child = Node::new(YamlValue::Null, node.mark);
                let mark = node.mark;
                child.put(tail, node)?;
                entries.push((key.into(), mark, child));
                Ok(())
            }
            YamlValue::List(items) => {
                let (index, tail) =
                    split_index(path).ok_or_else(|| format!("`{path}` is no index of a list"))?;
                if index > items.len() {
                    return Err(format!(
                        "the list has {}; index {index} is too large",
                        crate::error::counted(items.len(), "entry")
                    ));
                }
                if index == items.len() {
                    items.push(Node::new(YamlValue::Null, node.mark));
                }
                items[index].put(tail, node)
            }
            _ => Err(format!("`{path}` lies below a plain value")),
        }
    }

    /// Takes the map entry out that holds the path; false where there is none.
    pub(super) fn remove(&mut self, path: &str) -> bool {
        match &mut self.value {
            YamlValue::Map(entries) => {
                let Some(index) = entries
                    .iter()
                    .position(|(key, _, _)| rest_after(path, key).is_some())
                else {
                    return false;
                };
                let tail = rest_after(path, &entries[index].0)
                    .unwrap_or_default()
                    .to_string();
                // The innermost entry that can go, so that the siblings are still looked at.
                if tail.is_empty() || !entries[index].2.remove(&tail) {
                    entries.remove(index);
                }
                true
            }
            YamlValue::List(items) => match split_index(path) {
                Some((index, tail)) => items.get_mut(index).is_some_and(|item| item.remove(tail)),
                None => false,
            },
            _ => false,
        }
    }

    /// Calls `visit` with every node and its path below this one.
    pub fn walk(&self, path: &str, visit: &mut dyn FnMut(&str, &Node)) {
        visit(path, self);
        match &self.value {
            YamlValue::List(items) => {
                for (index, item) in items.iter().enumerate() {
                    item.walk(&format!("{path}[{index}]"), visit);
                }
            }
            YamlValue::Map(entries) => {
                for (key, _, value) in entries {
                    value.walk(&join(path, key), visit);
                }
            }
            _ => {}
        }
    }
    /// Visits this node and all below it, each with its path, outer ones first.
    pub fn walk_mut(&mut self, path: &str, visit: &mut dyn FnMut(&str, &mut Node)) {
        visit(path, self);
        match &mut self.value {
            YamlValue::List(items) => {
                for (index, item) in items.iter_mut().enumerate() {
                    item.walk_mut(&format!("{path}[{index}]"), visit);
                }
            }
            YamlValue::Map(entries) => {
                for (key, _, value) in entries {
                    value.walk_mut(&join(path, key), visit);
                }
            }
            _ => {}
        }
    }
}

/// `stages[2]` + `with.every` -> `stages[2].with.every`.
pub(crate) fn join(path: &str, tail: &str) -> String {
    match (path.is_empty(), tail.is_empty() || tail.starts_with('[')) {
        (true, _) => tail.into(),
        (false, true) => format!("{path}{tail}"),
        (false, false) => format!("{path}.{tail}"),
    }
}

/// What follows a key at the head of a path.
pub(super) fn rest_after<'p>(path: &'p str, key: &str) -> Option<&'p str> {
    let tail = path.strip_prefix(key)?;
    if tail.is_empty() || tail.starts_with('[') {
        Some(tail)
    } else {
        tail.strip_prefix('.')
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
    let (digits, tail) = match path.strip_prefix('[') {
        Some(inner) => inner.split_once(']')?,
        None => path.split_at(path.find(['.', '[']).unwrap_or(path.len())),
    };
    Some((digits.parse().ok()?, tail.strip_prefix('.').unwrap_or(tail)))
}
