//! A place in a robot file: a cursor that reads typed values from the tree and collects every fault with its line and path.
//!
//! A value that could not be read becomes NaN (or empty) after its fault was noted; so one pass finds all faults, and
//! nothing unread can leave, because [`Faults::finish`] fails when there is any.

use super::RobotFileText;
use crate::error::{Error, Fault, Result};
use crate::robot::Bound;
use crate::units::Unit;
use crate::yaml::{self, Mark, Node, Trouble, YamlValue, join};
use std::cell::RefCell;

/// The faults found so far in one file.
pub(super) struct Faults<'f> {
    file: &'f str,
    list: RefCell<Vec<Fault>>,
    notes: RefCell<Vec<String>>,
}

impl<'f> Faults<'f> {
    /// Parses YAML or JSON, which is YAML too; fails where nothing of the file can be read.
    pub fn parse(file: RobotFileText<'f>) -> Result<(Node, Self)> {
        let (node, troubles) = yaml::parse(file.text);
        let list: Vec<Fault> = troubles
            .into_iter()
            .map(|trouble| trouble.fault(file.label))
            .collect();
        match node {
            Some(node) => Ok((
                node,
                Self {
                    file: file.label,
                    list: RefCell::new(list),
                    notes: RefCell::default(),
                },
            )),
            None => Err(Error::Spec(list)),
        }
    }
    fn push(&self, trouble: Trouble) {
        self.list.borrow_mut().push(trouble.fault(self.file));
    }
    /// Takes over faults that already carry their place; passes on what is no fault of a file.
    pub(crate) fn absorb<T>(&self, result: Result<T>) -> Result<Option<T>> {
        match result {
            Ok(value) => Ok(Some(value)),
            Err(Error::Spec(faults)) => {
                self.list.borrow_mut().extend(faults);
                Ok(None)
            }
            Err(other) => Err(other),
        }
    }
    /// What was noted, a sentence each with its place. Fails with all faults.
    pub(crate) fn finish(self) -> Result<Vec<String>> {
        let list = self.list.into_inner();
        if list.is_empty() {
            Ok(self.notes.into_inner())
        } else {
            Err(Error::Spec(list))
        }
    }
}

/// What is at a place; children of something unreadable are unreadable too, and silent: one fault, one message.
#[derive(Clone, Copy)]
enum Content<'a> {
    There(&'a Node),
    Missing,
    Unreadable,
}

#[derive(Clone)]
pub(super) struct DocumentNode<'a> {
    content: Content<'a>,
    path: String,
    /// Place in the file of the nearest value that is there.
    mark: Mark,
    faults: &'a Faults<'a>,
}

impl<'a> DocumentNode<'a> {
    pub(crate) fn root(node: &'a Node, faults: &'a Faults<'a>) -> Self {
        Self {
            content: Content::There(node),
            path: String::new(),
            mark: node.mark,
            faults,
        }
    }
    fn child(&self, node: Option<&'a Node>, path: String) -> Self {
        let given = node.filter(|node| !matches!(node.value, YamlValue::Null));
        let mark = node.map_or(self.mark, |node| node.mark);
        Self {
            content: given.map_or(Content::Missing, Content::There),
            path,
            mark,
            faults: self.faults,
        }
    }
    pub fn fault(&self, message: impl Into<String>) {
        self.faults
            .push(Trouble::new(message).at(self.mark).below(&self.path));
    }
    /// Something that a person should know and that is no fault.
    pub(crate) fn note(&self, message: impl Into<String>) {
        let fault = Trouble::new(message)
            .at(self.mark)
            .below(&self.path)
            .fault(self.faults.file);
        self.faults
            .notes
            .borrow_mut()
            .push(format!("{}: {}", fault.place, fault.message));
    }
    fn expected(&self, what: &str) {
        match self.content {
            Content::There(node) => {
                self.fault(format!("expected {what}, found {}", describe(node)))
            }
            Content::Missing => self.fault(format!("missing; expected {what}")),
            Content::Unreadable => {}
        }
    }
    fn node(&self) -> Option<&'a Node> {
        if let Content::There(node) = self.content {
            Some(node)
        } else {
            None
        }
    }
    fn value(&self) -> Option<&'a YamlValue> {
        self.node().map(|node| &node.value)
    }
    /// The place if there is something other than null.
    pub(crate) fn given(&self) -> Option<&Self> {
        self.node().map(|_| self)
    }
    /// The keys of a map; none for anything else.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.node()
            .map(Node::entries)
            .unwrap_or_default()
            .iter()
            .map(|(key, _, _)| key.as_str())
    }
    /// The same place, checked to be a map with no other keys than `allowed`.
    pub(crate) fn map(self, allowed: &[&str]) -> Self {
        let place = self.open_map(allowed);
        for (key, mark, _) in place.node().map(Node::entries).unwrap_or_default() {
            if !allowed.contains(&key.as_str()) {
                place.faults.push(
                    Trouble::unknown_key(key, allowed)
                        .at(*mark)
                        .below(&join(&place.path, key)),
                );
            }
        }
        place
    }
    /// The same place, checked to be a map; it may have other keys than the `known` ones.
    pub(crate) fn open_map(self, known: &[&str]) -> Self {
        if let Some(YamlValue::Map(_)) = self.value() {
            return self;
        }
        self.expected(&format!("a map with the keys {}", known.join(", ")));
        Self {
            content: Content::Unreadable,
            ..self
        }
    }
    pub(crate) fn get(&self, key: &str) -> Self {
        let path = join(&self.path, key);
        match self.content {
            Content::There(node) if matches!(node.value, YamlValue::Map(_)) => {
                self.child(node.get(key), path)
            }
            Content::There(_) | Content::Unreadable => Self {
                content: Content::Unreadable,
                path,
                ..self.clone()
            },
            Content::Missing => self.child(None, path),
        }
    }
    /// The value of a key, if there is something other than null.
    pub(crate) fn opt(&self, key: &str) -> Option<Self> {
        let value = self.get(key);
        value.node().is_some().then_some(value)
    }
    pub(crate) fn items(&self) -> Vec<Self> {
        match self.value() {
            Some(YamlValue::List(items)) => items
                .iter()
                .enumerate()
                .map(|(i, node)| self.child(Some(node), format!("{}[{i}]", self.path)))
                .collect(),
            _ => {
                self.expected("a list");
                Vec::new()
            }
        }
    }
    /// A list with one entry per joint; one fault when the count differs.
    pub(crate) fn per_joint(&self, joints: usize) -> Vec<Self> {
        let items = self.items();
        if matches!(self.value(), Some(YamlValue::List(_))) && items.len() != joints {
            self.fault(format!(
                "{} entries for {joints} joints; expected one per joint",
                items.len()
            ));
        }
        items
    }
    pub fn number(&self) -> f64 {
        match self.value() {
            Some(YamlValue::Integer(value)) => *value as f64,
            Some(YamlValue::Float(value)) if value.is_finite() => *value,
            _ => {
                self.expected("a finite number");
                f64::NAN
            }
        }
    }
    /// A number in SI, of a size that a robot's can have.
    pub(crate) fn sized(&self, bound: Bound, unit: Unit) -> f64 {
        let value = unit.to_si(self.number());
        if let Some(message) = bound.fault(value) {
            self.fault(message);
        }
        value
    }
    /// A mass, kg.
    pub(crate) fn not_negative(&self) -> f64 {
        let number = self.sized(Bound::Mass, Unit::Kilogram);
        if number < 0.0 {
            self.fault(format!(
                "expected a mass in kg, not less than 0, found {number}"
            ));
        }
        number
    }
    pub(crate) fn vector<const N: usize>(&self) -> [f64; N] {
        self.numbers(Self::number)
    }
    /// Numbers in SI, of sizes that a robot's can have.
    pub(crate) fn sized_vector<const N: usize>(&self, bound: Bound, unit: Unit) -> [f64; N] {
        self.numbers(|item| item.sized(bound, unit))
    }
    fn numbers<const N: usize>(&self, number: impl Fn(&Self) -> f64) -> [f64; N] {
        if let Some(YamlValue::List(items)) = self.value()
            && items.len() == N
        {
            let mut vector = [f64::NAN; N];
            for (slot, item) in vector.iter_mut().zip(self.items()) {
                *slot = number(&item);
            }
            return vector;
        }
        self.expected(&format!("a list of {N} numbers"));
        [f64::NAN; N]
    }
    pub fn text(&self) -> String {
        match self.value() {
            // Names like 7 are texts that YAML takes for numbers.
            Some(YamlValue::Text(_) | YamlValue::Integer(_) | YamlValue::Float(_)) => {
                self.node().and_then(Node::text).unwrap_or_default()
            }
            _ => {
                self.expected("a text");
                String::new()
            }
        }
    }
    /// The one of `allowed` that is named here.
    pub(crate) fn choice<T: Copy>(&self, allowed: &[(&str, T)]) -> Option<T> {
        let list = allowed
            .iter()
            .map(|(name, _)| *name)
            .collect::<Vec<_>>()
            .join(", ");
        let Some(YamlValue::Text(text)) = self.value() else {
            self.expected(&format!("one of {list}"));
            return None;
        };
        let found = allowed
            .iter()
            .find(|(name, _)| name == text)
            .map(|(_, value)| *value);
        if found.is_none() {
            // No nearest name: for units it would mislead (`cm` is not `m`).
            self.fault(format!("unknown value `{text}` (allowed: {list})"));
        }
        found
    }
    /// A joint counted from 1, as its index.
    pub(crate) fn joint(&self, joints: usize) -> Option<usize> {
        let value = self.number();
        if value.is_nan() {
            return None;
        }
        let found = (1..=joints).find(|j| *j as f64 == value);
        if found.is_none() {
            self.fault(format!(
                "there is no joint {value}; expected a number from 1 to {joints}"
            ));
        }
        found.map(|j| j - 1)
    }
}

fn describe(node: &Node) -> String {
    match &node.value {
        YamlValue::Null => "nothing".into(),
        YamlValue::Text(text) => format!("the text `{text}`"),
        YamlValue::List(items) => format!("a list of {}", items.len()),
        YamlValue::Map(_) => "a map".into(),
        YamlValue::Bool(_) | YamlValue::Integer(_) | YamlValue::Float(_) => {
            format!("`{}`", node.text().unwrap_or_default())
        }
    }
}
