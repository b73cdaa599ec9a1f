//! Messages of ROS 2 as cells: which types are read, a row of a table each, and CDR (both orders of bytes, as DDS writes it).

mod json;

use json::{in_cdr, is_json};
use std::borrow::Cow;
use std::collections::HashMap;

/// A part of a message, in the order in which they stand.
pub(super) enum FieldType {
    /// The time of the header and its frame: the columns `stamp` and `frame_id`.
    Header,
    /// A text: a column of this name.
    Text(&'static str),
    /// Numbers of 64 bits: columns of these names.
    Numbers(&'static [&'static str]),
    Names,
    /// A list of numbers, one for each name: columns `NAME.position`, and so on. It may be empty.
    OfNames(&'static str),
    /// What says of how many dimensions a list is.
    Dimensions,
    /// A list of numbers: columns `data[1]`, `data[2]`, and so on.
    List(&'static str),
}

pub(super) struct MessageKind {
    pub name: &'static str,
    /// It holds any number of them; its two frames select the one that is read.
    pub of_frames: bool,
    pub parts: &'static [FieldType],
}

use FieldType::{Dimensions, Header, List, Names, Numbers, OfNames, Text};

const POSITION: FieldType = Numbers(&["position.x", "position.y", "position.z"]);
const ORIENTATION: FieldType = Numbers(&[
    "orientation.x",
    "orientation.y",
    "orientation.z",
    "orientation.w",
]);
const TRANSFORM: &[FieldType] = &[
    Header,
    Text("child_frame_id"),
    Numbers(&["translation.x", "translation.y", "translation.z"]),
    Numbers(&["rotation.x", "rotation.y", "rotation.z", "rotation.w"]),
];
const STATE: &[FieldType] = &[
    Header,
    Names,
    OfNames("position"),
    OfNames("velocity"),
    OfNames("effort"),
];
const POINT: &[FieldType] = &[Header, Numbers(&["point.x", "point.y", "point.z"])];
const TEMPERATURE: &[FieldType] = &[Header, Numbers(&["temperature", "variance"])];

const fn kind(name: &'static str, parts: &'static [FieldType]) -> MessageKind {
    MessageKind {
        name,
        of_frames: false,
        parts,
    }
}

pub(super) const KINDS: &[MessageKind] = &[
    kind("sensor_msgs/msg/JointState", STATE),
    kind("geometry_msgs/msg/PointStamped", POINT),
    kind(
        "geometry_msgs/msg/PoseStamped",
        &[Header, POSITION, ORIENTATION],
    ),
    kind("geometry_msgs/msg/TransformStamped", TRANSFORM),
    MessageKind {
        of_frames: true,
        ..kind("tf2_msgs/msg/TFMessage", TRANSFORM)
    },
    kind("sensor_msgs/msg/Temperature", TEMPERATURE),
    kind("std_msgs/msg/Float64", &[Numbers(&["data"])]),
    kind(
        "std_msgs/msg/Float64MultiArray",
        &[Dimensions, List("data")],
    ),
];

/// Elements of a list, at most.
const LONGEST: usize = 1 << 16;

/// Bytes of a message, from value to value.
struct Cdr<'a> {
    data: &'a [u8],
    at: usize,
    is_big: bool,
}

pub(super) type FieldFault = String;

impl<'a> Cdr<'a> {
    fn open(message: &'a [u8]) -> Result<Self, FieldFault> {
        match message {
            [0, order @ (0 | 1), _, _, data @ ..] => Ok(Self {
                data,
                at: 0,
                is_big: *order == 0,
            }),
            [a, b, ..] => Err(format!(
                "the message is in another form than plain CDR ({a:02x} {b:02x})"
            )),
            _ => Err("the message is empty".into()),
        }
    }
    fn take(&mut self, bytes: usize, what: &str) -> Result<&'a [u8], FieldFault> {
        let taken = self
            .at
            .checked_add(bytes)
            .and_then(|end| self.data.get(self.at..end));
        self.at += bytes;
        taken.ok_or_else(|| format!("the message ends within `{what}`"))
    }
    fn fixed<const N: usize>(&mut self, what: &str) -> Result<[u8; N], FieldFault> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N, what)?);
        if self.is_big {
            bytes.reverse();
        }
        Ok(bytes)
    }
    fn count(&mut self, what: &str) -> Result<usize, FieldFault> {
        self.fixed(what)
            .map(|bytes| u32::from_le_bytes(bytes) as usize)
    }
    fn number(&mut self, what: &str) -> Result<f64, FieldFault> {
        self.fixed(what).map(f64::from_le_bytes)
    }
    fn text(&mut self, what: &str) -> Result<&'a [u8], FieldFault> {
        let length = self.count(what)?;
        let text = self.take(length, what)?;
        Ok(text.strip_suffix(&[0]).unwrap_or(text))
    }
    fn list(&mut self, what: &str) -> Result<usize, FieldFault> {
        let count = self.count(what)?;
        // No element is shorter than a byte.
        match count <= LONGEST.min(self.data.len()) {
            true => Ok(count),
            false => Err(format!("`{what}` says that it has {count} elements")),
        }
    }
}

/// What stands in a column of a row.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) enum FieldValue {
    /// The message has no such name.
    #[default]
    Absent,
    /// It has the name, and nothing of this kind for it.
    Blank,
    Number(f64),
    /// Nanoseconds since 1970.
    Time(i64),
    Text(String),
}

/// The columns that messages have, and the cells of the present one.
#[derive(Default)]
pub(super) struct MessageCells {
    pub names: Vec<String>,
    pub cells: Vec<FieldValue>,
    /// New names make no columns any more.
    pub is_closed: bool,
    places: HashMap<String, usize>,
    /// Names of the joints of the last message as they stand in it, and the columns that are theirs, by name and kind of list.
    joints: Vec<u8>,
    columns: Vec<Vec<Option<usize>>>,
}

impl MessageCells {
    pub(super) fn set(&mut self, name: &str, cell: FieldValue) {
        if let Some(place) = self.place(name) {
            self.cells[place] = cell;
        }
    }
    fn set_text(&mut self, name: &str, cdr: &mut Cdr) -> Result<(), FieldFault> {
        let text = String::from_utf8_lossy(cdr.text(name)?).into_owned();
        self.set(name, FieldValue::Text(text));
        Ok(())
    }
    pub(super) fn joints(&self) -> String {
        let mut cdr = Cdr {
            data: &self.joints,
            at: 0,
            is_big: false,
        };
        let names = std::iter::from_fn(|| cdr.text("").ok()).take(20);
        let names: Vec<_> = names.map(String::from_utf8_lossy).collect();
        names.join(", ")
    }
    fn place(&mut self, name: &str) -> Option<usize> {
        if let Some(place) = self.places.get(name) {
            return Some(*place);
        }
        if self.is_closed {
            return None;
        }
        self.places.insert(name.into(), self.names.len());
        self.names.push(name.into());
        self.cells.push(FieldValue::Absent);
        Some(self.names.len() - 1)
    }
    /// Takes the names of joints, unless they are those of the message before.
    fn take_joints(&mut self, names: &[&[u8]]) -> Result<(), FieldFault> {
        let mut values = Vec::with_capacity(self.joints.len());
        for name in names {
            values.resize(values.len().next_multiple_of(4), 0);
            values.extend_from_slice(&(name.len() as u32).to_le_bytes());
            values.extend_from_slice(name);
        }
        if values == self.joints && self.is_closed {
            return Ok(());
        }
        self.joints = values;
        let names: Vec<_> = names
            .iter()
            .map(|name| String::from_utf8_lossy(name))
            .collect();
        if let Some(twice) = (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
            let message = format!("the message names the joint `{}` twice", names[twice]);
            self.joints.clear();
            return Err(message);
        }
        self.columns = Vec::new();
        for name in names {
            let columns = ["position", "velocity", "effort"]
                .map(|what| self.place(&format!("{name}.{what}")));
            self.columns.push(columns.to_vec());
        }
        Ok(())
    }
}

fn seconds(cdr: &mut Cdr) -> Result<i64, FieldFault> {
    let whole = i32::from_le_bytes(cdr.fixed("stamp")?);
    Ok(i64::from(whole) * 1_000_000_000 + i64::from(u32::from_le_bytes(cdr.fixed("stamp")?)))
}

/// Reads the parts of a message into the cells.
fn parts(kind: &MessageKind, cdr: &mut Cdr, cells: &mut MessageCells) -> Result<(), FieldFault> {
    let (mut joints, mut list) = (0, 0);
    for part in kind.parts {
        match part {
            Header => {
                // A publisher that does not know the time leaves it at 0.
                let stamp = match seconds(cdr)? {
                    0 => FieldValue::Blank,
                    stamp => FieldValue::Time(stamp),
                };
                cells.set("stamp", stamp);
                cells.set_text("frame_id", cdr)?;
            }
            Text(name) => cells.set_text(name, cdr)?,
            Numbers(names) => {
                for name in *names {
                    let number = cdr.number(name)?;
                    cells.set(name, FieldValue::Number(number));
                }
            }
            Names => {
                joints = cdr.list("name")?;
                let names = (0..joints)
                    .map(|_| cdr.text("name"))
                    .collect::<Result<Vec<_>, _>>()?;
                cells.take_joints(&names)?;
            }
            OfNames(name) => {
                let count = cdr.list(name)?;
                if count != joints && count != 0 {
                    return Err(format!("`{name}` has {count} numbers for {joints} names"));
                }
                for joint in 0..joints {
                    let cell = if count == 0 {
                        FieldValue::Blank
                    } else {
                        FieldValue::Number(cdr.number(name)?)
                    };
                    if let Some(place) = cells.columns[joint][list] {
                        cells.cells[place] = cell;
                    }
                }
                list += 1;
            }
            Dimensions => {
                for _ in 0..cdr.list("layout")? {
                    cdr.text("layout")?;
                    cdr.count("layout")?;
                    cdr.count("layout")?;
                }
                cdr.count("layout")?;
            }
            List(name) => {
                for index in 1..=cdr.list(name)? {
                    let number = cdr.number(name)?;
                    cells.set(&format!("{name}[{index}]"), FieldValue::Number(number));
                }
            }
        }
    }
    Ok(())
}

/// Reads a message; of one of frames the transform between these. Whether there is one; fails where it cannot be read.
pub(super) fn read(
    kind: &MessageKind,
    frames: Option<&str>,
    message: &[u8],
    cells: &mut MessageCells,
) -> Result<bool, FieldFault> {
    cells.cells.fill(FieldValue::Absent);
    let message = plain(kind, message)?;
    let mut cdr = Cdr::open(&message)?;
    let Some(wanted) = frames else {
        return parts(kind, &mut cdr, cells).map(|()| true);
    };
    for _ in 0..cdr.list("transforms")? {
        let at = cdr.at;
        if frames_of(&mut cdr)? == wanted {
            cdr.at = at;
            return parts(kind, &mut cdr, cells).map(|()| true);
        }
    }
    Ok(false)
}

/// The frames of a transform, as a topic names them; what follows is the next transform.
fn frames_of(cdr: &mut Cdr) -> Result<String, FieldFault> {
    seconds(cdr)?;
    let [parent, child] =
        [cdr.text("frame_id")?, cdr.text("child_frame_id")?].map(String::from_utf8_lossy);
    (0..7).try_for_each(|_| cdr.number("transform").map(drop))?;
    Ok(format!("{parent}->{child}"))
}

/// The message in CDR, whatever it was encoded in.
fn plain<'m>(kind: &MessageKind, message: &'m [u8]) -> Result<Cow<'m, [u8]>, FieldFault> {
    match is_json(message) {
        true => in_cdr(kind, message).map(Cow::Owned),
        false => Ok(Cow::Borrowed(message)),
    }
}

/// All frames of a message of frames; none where it cannot be read.
pub(super) fn frames(kind: &MessageKind, message: &[u8]) -> Vec<String> {
    let Ok(message) = plain(kind, message) else {
        return Vec::new();
    };
    let Ok(mut cdr) = Cdr::open(&message) else {
        return Vec::new();
    };
    let count = cdr.list("transforms").unwrap_or_default();
    (0..count).map_while(|_| frames_of(&mut cdr).ok()).collect()
}
