//! Messages of ROS 2 in JSON, as bridges to browsers record them, as the same bytes that CDR has.

use super::{FieldFault, FieldType, MessageKind};
use serde_json::{Map, Value};

/// Whether a message is JSON: CDR begins with a zero.
pub(super) fn is_json(message: &[u8]) -> bool {
    let mut bytes = message.iter().filter(|byte| !byte.is_ascii_whitespace());
    bytes.next() == Some(&b'{')
}

/// The message in plain CDR, little endian.
pub(super) fn in_cdr(kind: &MessageKind, message: &[u8]) -> Result<Vec<u8>, FieldFault> {
    let value: Value = serde_json::from_slice(message)
        .map_err(|error| format!("the message is no whole JSON ({error})"))?;
    let mut out = CdrWriter(vec![0, 1, 0, 0]);
    if !kind.of_frames {
        out.parts(kind, &value)?;
        return Ok(out.0);
    }
    let all = array(&value, "transforms")?;
    out.count(all.len());
    all.iter().try_for_each(|one| out.parts(kind, one))?;
    Ok(out.0)
}

fn field<'v>(value: &'v Value, name: &str) -> Result<&'v Value, FieldFault> {
    let found = value.get(name);
    found.ok_or_else(|| format!("the message has no `{name}`"))
}

fn array<'v>(value: &'v Value, name: &str) -> Result<&'v [Value], FieldFault> {
    match value.get(name) {
        Some(Value::Array(all)) => Ok(all),
        None | Some(Value::Null) => Ok(&[]),
        Some(_) => Err(format!("`{name}` is no list")),
    }
}

/// Where the numbers of a pose, a transform or a point stand: one or two levels down, by the names of the columns.
fn number(value: &Value, path: &str) -> Result<f64, FieldFault> {
    let levels = [&["transform"][..], &["pose"], &[]];
    let found = levels.iter().find_map(|outer| {
        let steps = outer.iter().copied().chain(path.split('.'));
        steps
            .into_iter()
            .try_fold(value, |value, step| value.get(step))
    });
    float(found, path)
}

/// JSON knows no number that is none.
fn float(value: Option<&Value>, name: &str) -> Result<f64, FieldFault> {
    match value {
        Some(Value::Number(number)) => number.as_f64(),
        Some(Value::Null) => Some(f64::NAN),
        Some(Value::String(text)) => text.parse().ok(),
        _ => None,
    }
    .ok_or_else(|| format!("the message has no number `{name}`"))
}

fn text<'v>(value: &'v Value, name: &str) -> Result<&'v str, FieldFault> {
    let found = value.as_str();
    found.ok_or_else(|| format!("`{name}` is no text"))
}

struct CdrWriter(Vec<u8>);

impl CdrWriter {
    fn put<const N: usize>(&mut self, little: [u8; N]) {
        let end = 4 + (self.0.len() - 4).next_multiple_of(N);
        self.0.resize(end, 0);
        self.0.extend(little);
    }
    fn count(&mut self, count: usize) {
        self.put((count as u32).to_le_bytes());
    }
    fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn parts(&mut self, kind: &MessageKind, value: &Value) -> Result<(), FieldFault> {
        let empty = Value::Object(Map::new());
        for part in kind.parts {
            match part {
                FieldType::Header => {
                    let header = value.get("header").unwrap_or(&empty);
                    let stamp = header.get("stamp").unwrap_or(&empty);
                    let whole = |names: [&str; 2]| {
                        let found = names.iter().find_map(|name| stamp.get(*name));
                        found.and_then(Value::as_i64).unwrap_or_default()
                    };
                    let [seconds, ns] = [whole(["sec", "secs"]), whole(["nanosec", "nsecs"])];
                    self.put((seconds as i32).to_le_bytes());
                    self.put((ns as u32).to_le_bytes());
                    let frame = header.get("frame_id").and_then(Value::as_str);
                    self.text(frame.unwrap_or_default());
                }
                FieldType::Text(name) => self.text(text(field(value, name)?, name)?),
                FieldType::Numbers(names) => {
                    for name in *names {
                        self.put(number(value, name)?.to_le_bytes());
                    }
                }
                FieldType::Names => {
                    let names = array(value, "name")?;
                    self.count(names.len());
                    for name in names {
                        self.text(text(name, "name")?);
                    }
                }
                FieldType::OfNames(name) | FieldType::List(name) => {
                    let all = array(value, name)?;
                    self.count(all.len());
                    for one in all {
                        self.put(float(Some(one), name)?.to_le_bytes());
                    }
                }
                // What says of how many dimensions a list is has no bearing on its columns.
                FieldType::Dimensions => {
                    self.count(0);
                    self.count(0);
                }
            }
        }
        Ok(())
    }
}
