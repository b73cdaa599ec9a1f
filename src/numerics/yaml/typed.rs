//! Trees as typed values: the serde deserializer over [`Node`].

use super::trouble::Clue;
use super::{Mark, Node, Trouble, YamlValue};
use serde::de::value::StrDeserializer;
use serde::de::{
    self, DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, IntoDeserializer, MapAccess,
    SeqAccess, Unexpected, VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

/// Types a tree; all faults that can be found at once, each with its path below `node`.
pub fn typed<T: DeserializeOwned>(node: &Node) -> Result<T, Vec<Trouble>> {
    let mut troubles: Vec<Trouble> = Vec::new();
    let mut removed: Vec<String> = Vec::new();
    let mut remaining = node.clone();
    // serde stops at the first fault: what is faulty is taken out and the remainder is read again.
    loop {
        match T::deserialize(&remaining) {
            Ok(value) if troubles.is_empty() => return Ok(value),
            Ok(_) => return Err(troubles),
            Err(trouble) => {
                let trouble = locate::<T>(trouble, &remaining);
                if let Some(field) = trouble.missing {
                    let path = super::node::join(&trouble.path, field);
                    if !removed.iter().any(|gone: &String| gone.starts_with(&path)) {
                        troubles.push(trouble);
                    }
                    return Err(troubles);
                }
                let path = trouble.path.clone();
                troubles.push(trouble);
                if path.is_empty() || !remaining.remove(&path) {
                    return Err(troubles);
                }
                removed.push(path);
            }
        }
    }
}

/// Finds the place of a fault inside a block that serde had to buffer (variants distinguished by a key), where places are lost:
/// the value that, put out of shape, still is not what was expected there.
fn locate<T: DeserializeOwned>(trouble: Trouble, root: &Node) -> Trouble {
    let (Some(clue), Some(block)) = (trouble.clue.clone(), root.at(&trouble.path)) else {
        return trouble;
    };
    let mut candidates: Vec<(String, Mark)> = Vec::new();
    block.walk(&trouble.path, &mut |path, node| match &clue {
        Clue::Expected(_) => candidates.push((path.into(), node.mark)),
        Clue::Word(word) if matches!(&node.value, YamlValue::Text(text) if text == word) => {
            candidates.push((path.into(), node.mark))
        }
        Clue::Key(key) => {
            let entry = node.entries().iter().find(|(name, _, _)| name == key);
            candidates.extend(entry.map(|(name, mark, _)| (super::node::join(path, name), *mark)));
        }
        Clue::Word(_) => {}
    });
    let still = |path: &str| {
        let mut bent = root.clone();
        let Some(place) = bent.at_mut(path) else {
            return false;
        };
        // Null, or true in the place of null, is another value than what stands there.
        place.value = if matches!(place.value, YamlValue::Null) {
            YamlValue::Bool(true)
        } else {
            YamlValue::Null
        };
        T::deserialize(&bent)
            .is_err_and(|other| other.clue == trouble.clue && other.message != trouble.message)
    };
    let found = match clue {
        Clue::Expected(_) => candidates.into_iter().rev().find(|(path, _)| still(path)),
        Clue::Key(_) | Clue::Word(_) => candidates.into_iter().next(),
    };
    match found {
        Some((path, mark)) => Trouble {
            path,
            mark: Some(mark),
            ..trouble
        },
        None => trouble,
    }
}

impl Node {
    fn unexpected(&self) -> Unexpected<'_> {
        match &self.value {
            YamlValue::Null => Unexpected::Unit,
            YamlValue::Bool(value) => Unexpected::Bool(*value),
            YamlValue::Integer(_) => Unexpected::Other("a number"),
            YamlValue::Float(value) => Unexpected::Float(*value),
            YamlValue::Text(text) => Unexpected::Str(text),
            YamlValue::List(_) => Unexpected::Seq,
            YamlValue::Map(_) => Unexpected::Map,
        }
    }
}

/// No setting is larger, in whatever unit: what is would leave the range of numbers on its way through a stage.
const LARGEST: f64 = 1e15;

impl<'de> Deserializer<'de> for &'de Node {
    type Error = Trouble;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Trouble> {
        let result = match &self.value {
            YamlValue::Null => visitor.visit_unit(),
            YamlValue::Bool(value) => visitor.visit_bool(*value),
            YamlValue::Integer(value) => match (u64::try_from(*value), i64::try_from(*value)) {
                (Ok(value), _) => visitor.visit_u64(value),
                (_, Ok(value)) => visitor.visit_i64(value),
                _ => visitor.visit_i128(*value),
            },
            YamlValue::Float(value) if value.is_finite() && value.abs() > LARGEST => {
                Err(Trouble::new(format!(
                    "{value:e} is no quantity of a cell; expected at most {LARGEST:e}"
                )))
            }
            YamlValue::Float(value) => visitor.visit_f64(*value),
            YamlValue::Text(text) => visitor.visit_borrowed_str(text),
            YamlValue::List(items) => visitor.visit_seq(Items {
                items: items.iter().enumerate(),
            }),
            YamlValue::Map(entries) => visitor.visit_map(Entries {
                entries: entries.iter(),
                value: None,
            }),
        };
        result.map_err(|trouble| trouble.at(self.mark))
    }
    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Trouble> {
        match (&self.value, &self.raw) {
            (YamlValue::Bool(_) | YamlValue::Integer(_) | YamlValue::Float(_), Some(raw)) => {
                visitor
                    .visit_borrowed_str(raw)
                    .map_err(|trouble: Trouble| trouble.at(self.mark))
            }
            _ => self.deserialize_any(visitor),
        }
    }
    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Trouble> {
        self.deserialize_str(visitor)
    }
    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Trouble> {
        if matches!(self.value, YamlValue::Null) {
            visitor.visit_none()
        } else {
            visitor.visit_some(self)
        }
    }
    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Trouble> {
        visitor.visit_newtype_struct(self)
    }
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Trouble> {
        let result = match &self.value {
            YamlValue::Text(text) => visitor.visit_enum(StrDeserializer::new(text)),
            YamlValue::Map(entries) => match entries.as_slice() {
                [(key, mark, node)] => visitor.visit_enum(Variant {
                    key,
                    mark: *mark,
                    node,
                }),
                _ => Err(Trouble::new(format!(
                    "expected one of: {}",
                    variants.join(", ")
                ))),
            },
            _ => Err(de::Error::invalid_type(
                self.unexpected(),
                &format!("one of: {}", variants.join(", ")).as_str(),
            )),
        };
        result.map_err(|trouble| trouble.at(self.mark))
    }
    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char bytes byte_buf unit unit_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}

struct Items<'de> {
    items: std::iter::Enumerate<std::slice::Iter<'de, Node>>,
}

impl<'de> SeqAccess<'de> for Items<'de> {
    type Error = Trouble;
    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Trouble> {
        let Some((index, node)) = self.items.next() else {
            return Ok(None);
        };
        seed.deserialize(node)
            .map(Some)
            .map_err(|trouble| trouble.at(node.mark).below(&format!("[{index}]")))
    }
    fn size_hint(&self) -> Option<usize> {
        Some(self.items.len())
    }
}

struct Entries<'de> {
    entries: std::slice::Iter<'de, (String, Mark, Node)>,
    value: Option<(&'de str, &'de Node)>,
}

impl<'de> MapAccess<'de> for Entries<'de> {
    type Error = Trouble;
    fn next_key_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Trouble> {
        let Some((key, mark, node)) = self.entries.next() else {
            return Ok(None);
        };
        self.value = Some((key, node));
        let deserializer: StrDeserializer<'_, Trouble> = key.as_str().into_deserializer();
        seed.deserialize(deserializer)
            .map(Some)
            .map_err(|trouble| trouble.at(*mark).below(key))
    }
    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, Trouble> {
        let (key, node) = self
            .value
            .take()
            .ok_or_else(|| Trouble::new("a value without a key"))?;
        seed.deserialize(node)
            .map_err(|trouble| trouble.at(node.mark).below(key))
    }
}

struct Variant<'de> {
    key: &'de str,
    mark: Mark,
    node: &'de Node,
}

impl<'de> EnumAccess<'de> for Variant<'de> {
    type Error = Trouble;
    type Variant = Self;
    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self), Trouble> {
        let deserializer: StrDeserializer<'_, Trouble> = self.key.into_deserializer();
        let name = seed
            .deserialize(deserializer)
            .map_err(|trouble| trouble.at(self.mark))?;
        Ok((name, self))
    }
}

impl<'de> VariantAccess<'de> for Variant<'de> {
    type Error = Trouble;
    fn unit_variant(self) -> Result<(), Trouble> {
        match self.node.value {
            YamlValue::Null => Ok(()),
            _ => Err(
                Trouble::new(format!("`{}` takes no settings of its own", self.key))
                    .at(self.node.mark)
                    .below(self.key),
            ),
        }
    }
    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, Trouble> {
        seed.deserialize(self.node)
            .map_err(|trouble| trouble.at(self.node.mark).below(self.key))
    }
    fn tuple_variant<V: Visitor<'de>>(
        self,
        _length: usize,
        visitor: V,
    ) -> Result<V::Value, Trouble> {
        self.struct_variant(&[], visitor)
    }
    fn struct_variant<V: Visitor<'de>>(
        self,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Trouble> {
        self.node
            .deserialize_any(visitor)
            .map_err(|trouble| trouble.below(self.key))
    }
}
