//! What a bag holds: its topics with their rates and gaps, which of them are read, and what is lost.

use super::message::{self, KINDS};
use super::{ENCODINGS, Message, Messages, Topic};
use crate::error::{self, Error, Result, counted};
use crate::{InputSource, failed};
use std::collections::BTreeMap;

/// What a bag holds of one topic; of one of frames, of one pair of them.
#[derive(Debug, Clone, Default)]
pub struct BagTopic {
    /// As the setting `topic` names it.
    pub name: String,
    /// Type of its messages.
    pub kind: String,
    encoding: String,
    /// Whether messages of this type, encoded so, are read.
    pub is_read: bool,
    /// How many messages.
    pub messages: u64,
    /// When the first and the last were received, s since 1970.
    pub received: [f64; 2],
    /// The longest time between two of them, s.
    pub gap: f64,
}

impl BagTopic {
    fn see(&mut self, received: f64) {
        if self.messages > 0 {
            self.gap = self.gap.max(received - self.received[1]);
        } else {
            self.received[0] = received;
        }
        self.received[1] = received;
        self.messages += 1;
    }
    /// In a line: type, number, rate, longest gap.
    pub fn account(&self) -> String {
        let span = self.received[1] - self.received[0];
        let rate = if span > 0.0 {
            let (hertz, gap) = ((self.messages - 1) as f64 / span, self.gap);
            format!(", {hertz:.4} Hz, longest gap {gap:.4} s")
        } else {
            String::new()
        };
        let is_known = KINDS.iter().any(|kind| kind.name == self.kind);
        let not = match (self.is_read, is_known) {
            (true, _) => String::new(),
            (false, true) => format!("; encoded as `{}`, which is not read", self.encoding),
            (false, false) => "; this type is not read".into(),
        };
        let (name, messages) = (&self.name, counted(self.messages, "message"));
        format!("topic `{name}`: {}, {messages}{rate}{not}", self.kind)
    }
}

/// What a bag holds.
pub struct BagContent {
    /// By topic.
    pub topics: Vec<BagTopic>,
    /// What of it could not be read, in words.
    pub loss: Option<String>,
    source: Box<dyn InputSource>,
}

/// Reads a bag once for what it holds.
pub fn bag_content(source: Box<dyn InputSource>, label: &str) -> Result<BagContent> {
    let mut messages = Messages::open(source).map_err(|error| failed(label, &error))?;
    let (mut message, mut found) = (Message::default(), BTreeMap::<String, BagTopic>::new());
    let unseen = |name: String, topic: &Topic| BagTopic {
        name,
        kind: topic.kind.clone(),
        encoding: topic.encoding.clone(),
        is_read: topic.known().is_some(),
        ..BagTopic::default()
    };
    let of_frames = |topic: &Topic| topic.known().is_some_and(|kind| kind.of_frames);
    while messages.next(&|_| true, &mut message) {
        let topic = &message.topic;
        let names = match of_frames(topic) {
            true => (topic.known().into_iter())
                .flat_map(|kind| message::frames(kind, &message.data))
                .map(|frames| format!("{} {frames}", topic.name))
                .collect(),
            false => vec![topic.name.clone()],
        };
        for name in names {
            let seen = found.entry(name.clone());
            seen.or_insert_with(|| unseen(name, topic))
                .see(message.received as f64 * 1e-9);
        }
    }
    for topic in messages.topics.iter().filter(|topic| !of_frames(topic)) {
        let name = topic.name.clone();
        let seen = found.entry(name.clone());
        seen.or_insert_with(|| unseen(name, topic));
    }
    Ok(BagContent {
        topics: found.into_values().collect(),
        loss: messages.loss(),
        source: messages.source.into_inner(),
    })
}

/// The only topic of a bag whose type is read.
pub(super) fn only_topic(
    source: Box<dyn InputSource>,
    label: &str,
) -> Result<(Box<dyn InputSource>, String)> {
    let content = bag_content(source, label)?;
    let mut read = content
        .topics
        .iter()
        .filter(|topic| topic.is_read && topic.messages > 0);
    match (read.next(), read.next()) {
        (Some(only), None) => Ok((content.source, only.name.clone())),
        (None, _) => Err(Error::data(label, no_topic("", &content))),
        _ => Err(Error::data(
            label,
            format!(
                "holds several topics; say which, `topic: NAME`; {}",
                listed(&content.topics)
            ),
        )),
    }
}

fn listed(found: &[BagTopic]) -> String {
    let allowed = found.iter().filter(|topic| topic.is_read);
    let allowed: Vec<String> = allowed.map(|topic| format!("`{}`", topic.name)).collect();
    if allowed.is_empty() {
        "none of its topics is read".into()
    } else {
        format!("allowed: {}", allowed.join(", "))
    }
}

/// Why nothing is read of a topic.
pub(super) fn no_topic(topic: &str, content: &BagContent) -> String {
    let found = &content.topics;
    let message = match found.iter().find(|other| other.name == topic) {
        Some(other) if !other.is_read && KINDS.iter().any(|kind| kind.name == other.kind) => {
            let (kind, encoding) = (&other.kind, &other.encoding);
            format!(
                "topic `{topic}` holds {kind} encoded as `{encoding}`, which is not read; allowed: {}",
                error::listed(ENCODINGS.iter().copied())
            )
        }
        Some(other) if !other.is_read => {
            format!(
                "topic `{topic}` holds {}, which is not read; allowed: {}",
                other.kind,
                error::listed(KINDS.iter().map(|kind| kind.name))
            )
        }
        _ if found.is_empty() => "holds no message".into(),
        _ => {
            let others = found.iter().filter(|topic| !topic.is_read);
            let others: Vec<String> = others
                .map(|one| format!("`{}` ({})", one.name, one.kind))
                .collect();
            let others = match others[..] {
                [] => String::new(),
                _ => format!("; of other types: {}", others.join(", ")),
            };
            let first = match topic {
                "" => "has no topic that is read".into(),
                _ => format!("has no messages of a topic `{topic}`"),
            };
            format!("{first}; {}{others}", listed(found))
        }
    };
    let loss = content.loss.iter().map(|loss| format!("; {loss}"));
    message + &loss.collect::<String>()
}
