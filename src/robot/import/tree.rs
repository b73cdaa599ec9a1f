//! A parsed file as an untyped tree, and a cursor that reads typed values from it and collects every fault with its path.
//!
//! A value that could not be read becomes NaN (or empty) after its fault was noted; so one pass finds all faults, and
//! nothing unread can leave, because [`Faults::finish`] fails when there is any.

use crate::error::{Error, Fault, Result, nearest};
use serde::de::{Deserialize, Deserializer, Error as _, MapAccess, SeqAccess, Visitor};
use std::cell::RefCell;
use std::fmt;

pub(super) enum Node {
    Null,
    Bool(bool),
    Number(f64),
    Text(String),
    List(Vec<Node>),
    Map(Vec<(String, Node)>),
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(NodeVisitor)
    }
}

struct NodeVisitor;

impl<'de> Visitor<'de> for NodeVisitor {
    type Value = Node;
    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a number, a text, a list or a map")
    }
    fn visit_unit<E>(self) -> std::result::Result<Node, E> {
        Ok(Node::Null)
    }
    fn visit_none<E>(self) -> std::result::Result<Node, E> {
        Ok(Node::Null)
    }
    fn visit_bool<E>(self, value: bool) -> std::result::Result<Node, E> {
        Ok(Node::Bool(value))
    }
    fn visit_i64<E>(self, value: i64) -> std::result::Result<Node, E> {
        Ok(Node::Number(value as f64))
    }
    fn visit_u64<E>(self, value: u64) -> std::result::Result<Node, E> {
        Ok(Node::Number(value as f64))
    }
    fn visit_f64<E>(self, value: f64) -> std::result::Result<Node, E> {
        Ok(Node::Number(value))
    }
    fn visit_str<E>(self, value: &str) -> std::result::Result<Node, E> {
        Ok(Node::Text(value.into()))
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> std::result::Result<Node, A::Error> {
        let mut list = Vec::new();
        while let Some(item) = items.next_element()? {
            list.push(item);
        }
        Ok(Node::List(list))
    }
    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> std::result::Result<Node, A::Error> {
        let mut map: Vec<(String, Node)> = Vec::new();
        while let Some(key) = entries.next_key::<String>()? {
            if map.iter().any(|(known, _)| *known == key) {
                return Err(A::Error::custom(format!("the key `{key}` is there twice")));
            }
            map.push((key, entries.next_value()?));
        }
        Ok(Node::Map(map))
    }
}

impl Node {
    /// Parses YAML; fails with line, column and the lines around a syntax error or a key that is there twice.
    pub fn from_yaml(text: &str, file: &str) -> Result<Node> {
        let options = serde_saphyr::options! {
            strict_booleans: true,
            // NaN gets its fault here, with its path.
            non_finite_float_policy: serde_saphyr::options::NonFiniteFloatPolicy::PassThrough,
        };
        serde_saphyr::from_str_with_options(text, options).map_err(|e| Error::spec(file, e.to_string()))
    }
    /// Parses JSON; fails with line and column.
    pub fn from_json(text: &str, file: &str) -> Result<Node> {
        serde_json::from_str(text).map_err(|e| Error::spec(file, e.to_string()))
    }
    fn describe(&self) -> String {
        match self {
            Node::Null => "nothing".into(),
            Node::Bool(value) => format!("`{value}`"),
            Node::Number(value) => format!("`{value}`"),
            Node::Text(text) => format!("the text `{text}`"),
            Node::List(items) => format!("a list of {}", items.len()),
            Node::Map(_) => "a map".into(),
        }
    }
}

/// The faults found so far in one file.
pub(super) struct Faults {
    file: String,
    list: RefCell<Vec<Fault>>,
}

impl Faults {
    pub fn new(file: &str) -> Self {
        Self { file: file.into(), list: RefCell::default() }
    }
    /// Notes a fault at a path, or at the file as a whole.
    pub fn push(&self, path: &str, message: impl Into<String>) {
        let place = if path.is_empty() { self.file.clone() } else { format!("{}: {path}", self.file) };
        self.list.borrow_mut().push(Fault::new(place, message));
    }
    /// Takes over faults that already carry their place; passes on what is no fault of a file.
    pub fn absorb<T>(&self, result: Result<T>) -> Result<Option<T>> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(Error::Spec(faults)) => {
                self.list.borrow_mut().extend(faults);
                Ok(None)
            }
            Err(other) => Err(other),
        }
    }
    pub fn finish(self) -> Result<()> {
        let list = self.list.into_inner();
        if list.is_empty() { Ok(()) } else { Err(Error::Spec(list)) }
    }
}

/// What is at a place; children of something unreadable are unreadable too, and silent: one fault, one message.
#[derive(Clone, Copy)]
enum Content<'a> {
    There(&'a Node),
    Missing,
    Unreadable,
}

/// A place in the tree.
#[derive(Clone)]
pub(super) struct Value<'a> {
    content: Content<'a>,
    path: String,
    faults: &'a Faults,
}

impl<'a> Value<'a> {
    pub fn root(node: &'a Node, faults: &'a Faults) -> Self {
        Self { content: Content::There(node), path: String::new(), faults }
    }
    fn child(&self, node: Option<&'a Node>, path: String) -> Self {
        let content = node.filter(|node| !matches!(node, Node::Null)).map_or(Content::Missing, Content::There);
        Self { content, path, faults: self.faults }
    }
    pub fn fault(&self, message: impl Into<String>) {
        self.faults.push(&self.path, message);
    }
    fn expected(&self, what: &str) {
        match self.content {
            Content::There(node) => self.fault(format!("expected {what}, found {}", node.describe())),
            Content::Missing => self.fault(format!("missing; expected {what}")),
            Content::Unreadable => {}
        }
    }
    fn node(&self) -> Option<&'a Node> {
        if let Content::There(node) = self.content { Some(node) } else { None }
    }
    /// The place if there is something other than null.
    pub fn given(&self) -> Option<&Self> {
        self.node().map(|_| self)
    }
    /// The keys of a map; none for anything else.
    pub fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        let entries: &[(String, Node)] = if let Some(Node::Map(entries)) = self.node() { entries } else { &[] };
        entries.iter().map(|(key, _)| key.as_str())
    }
    /// The same place, checked to be a map with no other keys than `allowed`.
    pub fn map(self, allowed: &[&str]) -> Self {
        let value = self.open_map(allowed);
        for key in value.keys().filter(|key| !allowed.contains(key)) {
            let hint = nearest(key, allowed.iter().copied()).map(|name| format!("; did you mean `{name}`?")).unwrap_or_default();
            value.fault(format!("unknown key `{key}`{hint} (allowed: {})", allowed.join(", ")));
        }
        value
    }
    /// The same place, checked to be a map; it may have other keys than the `known` ones.
    pub fn open_map(self, known: &[&str]) -> Self {
        if let Some(Node::Map(_)) = self.node() {
            return self;
        }
        self.expected(&format!("a map with the keys {}", known.join(", ")));
        Self { content: Content::Unreadable, ..self }
    }
    pub fn get(&self, key: &str) -> Self {
        let path = if self.path.is_empty() { key.into() } else { format!("{}.{key}", self.path) };
        match self.content {
            Content::There(Node::Map(entries)) => {
                self.child(entries.iter().find(|(name, _)| name == key).map(|(_, node)| node), path)
            }
            Content::There(_) | Content::Unreadable => Self { content: Content::Unreadable, path, faults: self.faults },
            Content::Missing => self.child(None, path),
        }
    }
    pub fn items(&self) -> Vec<Self> {
        match self.node() {
            Some(Node::List(items)) => {
                items.iter().enumerate().map(|(i, node)| self.child(Some(node), format!("{}[{i}]", self.path))).collect()
            }
            _ => {
                self.expected("a list");
                Vec::new()
            }
        }
    }
    /// A list with one entry per joint; one fault when the count differs.
    pub fn per_joint(&self, joints: usize) -> Vec<Self> {
        let items = self.items();
        if matches!(self.node(), Some(Node::List(_))) && items.len() != joints {
            self.fault(format!("{} entries for {joints} joints; expected one per joint", items.len()));
        }
        items
    }
    pub fn number(&self) -> f64 {
        match self.node() {
            Some(Node::Number(value)) if value.is_finite() => *value,
            _ => {
                self.expected("a finite number");
                f64::NAN
            }
        }
    }
    /// A mass, kg.
    pub fn not_negative(&self) -> f64 {
        let number = self.number();
        if number < 0.0 {
            self.fault(format!("expected a mass in kg, not less than 0, found {number}"));
        }
        number
    }
    pub fn vector<const N: usize>(&self) -> [f64; N] {
        if let Some(Node::List(items)) = self.node()
            && items.len() == N
        {
            let mut vector = [f64::NAN; N];
            for (slot, item) in vector.iter_mut().zip(self.items()) {
                *slot = item.number();
            }
            return vector;
        }
        self.expected(&format!("a list of {N} numbers"));
        [f64::NAN; N]
    }
    pub fn text(&self) -> String {
        match self.node() {
            Some(Node::Text(text)) => text.clone(),
            // Names like 7 are texts that YAML takes for numbers.
            Some(Node::Number(value)) => value.to_string(),
            _ => {
                self.expected("a text");
                String::new()
            }
        }
    }
    /// The one of `allowed` that is named here.
    pub fn choice<T: Copy>(&self, allowed: &[(&str, T)]) -> Option<T> {
        let list = allowed.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        let Some(Node::Text(text)) = self.node() else {
            self.expected(&format!("one of {list}"));
            return None;
        };
        let found = allowed.iter().find(|(name, _)| name == text).map(|(_, value)| *value);
        if found.is_none() {
            // No nearest name: for units it would mislead (`cm` is not `m`).
            self.fault(format!("unknown value `{text}` (allowed: {list})"));
        }
        found
    }
    /// A joint counted from 1, as its index.
    pub fn joint(&self, joints: usize) -> Option<usize> {
        let value = self.number();
        if value.is_nan() {
            return None;
        }
        let found = (1..=joints).find(|j| *j as f64 == value);
        if found.is_none() {
            self.fault(format!("there is no joint {value}; expected a number from 1 to {joints}"));
        }
        found.map(|j| j - 1)
    }
}
