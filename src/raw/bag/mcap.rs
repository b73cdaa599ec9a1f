//! Messages of an MCAP file from its first byte to its last whole record: what the index at its end says is not needed.

use super::{BagSource, Container, Message, Topic};
use crate::decoded;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};
use std::collections::BTreeMap;
use std::io::Read;
use std::sync::Arc;

/// How a file begins.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const LONGEST: usize = 1 << 30;
/// Bytes of a message before its content: channel, sequence, time of the record and of the publisher.
const HEADER: usize = 22;

pub(super) struct McapMessages {
    reader: LinearReader,
    /// Place in the source, where the file ends, and where it begins.
    at: u64,
    end: u64,
    start: u64,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Arc<Topic>>,
}

/// What a step of the decoder gives.
enum ReadStep {
    Read(usize),
    Message,
    Other,
    End,
}

impl McapMessages {
    /// The file between two places of the source.
    pub(super) fn new([start, end]: [u64; 2]) -> Self {
        let options = LinearReaderOptions::default()
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(LONGEST);
        Self {
            reader: LinearReader::new_with_options(options),
            at: start,
            end,
            start,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
        }
    }

    fn step(
        &mut self,
        wanted: &dyn Fn(&str) -> bool,
        message: &mut Message,
    ) -> Result<ReadStep, McapError> {
        let (opcode, data) = match self.reader.next_event() {
            None => return Ok(ReadStep::End),
            Some(Ok(LinearReadEvent::ReadRequest(bytes))) => return Ok(ReadStep::Read(bytes)),
            Some(Ok(LinearReadEvent::Record { opcode, data })) => (opcode, data),
            Some(Err(error)) => return Err(error),
        };
        if opcode == op::MESSAGE {
            let Some((header, content)) = data.split_at_checked(HEADER) else {
                return Err(McapError::UnexpectedEof);
            };
            let channel = u16::from_le_bytes([header[0], header[1]]);
            let Some(topic) = self
                .channels
                .get(&channel)
                .filter(|topic| wanted(&topic.name))
            else {
                return Ok(ReadStep::Other);
            };
            let time = header[6..14]
                .first_chunk()
                .map_or(0, |bytes| u64::from_le_bytes(*bytes));
            message.received = i64::try_from(time).unwrap_or(i64::MAX);
            message.topic = topic.clone();
            message.data.clear();
            message.data.extend_from_slice(content);
            return Ok(ReadStep::Message);
        }
        match opcode {
            op::SCHEMA => {
                if let Record::Schema { header, .. } = parse_record(opcode, data)? {
                    self.schemas.insert(header.id, header.name);
                }
            }
            op::CHANNEL => {
                if let Record::Channel(channel) = parse_record(opcode, data)? {
                    let kind = self
                        .schemas
                        .get(&channel.schema_id)
                        .cloned()
                        .unwrap_or_default();
                    let topic = Topic {
                        name: channel.topic,
                        kind,
                        encoding: channel.message_encoding,
                    };
                    self.channels
                        .entry(channel.id)
                        .or_insert_with(|| Arc::new(topic));
                }
            }
            _ => {}
        }
        Ok(ReadStep::Other)
    }

    /// Hands bytes to the decoder, of which it asked for so many; false where the file has fewer.
    fn feed(&mut self, source: &mut BagSource, asked: usize) -> Result<bool, String> {
        let left = self.end - self.at;
        if asked as u64 > left {
            return Ok(false);
        }
        // No more than it asked for: it keeps what it does not need yet.
        let read = source
            .read(self.reader.insert(asked))
            .map_err(|error| error.to_string())?;
        self.reader.notify_read(read);
        self.at += read as u64;
        Ok(read > 0)
    }

    fn lost(&self, why: &str) -> String {
        let (at, size) = (self.at - self.start, self.end - self.start);
        format!(
            "it is cut or damaged before byte {at} of {size} ({why}): what was recorded after that is lost"
        )
    }
}

impl Container for McapMessages {
    fn next(
        &mut self,
        source: &mut BagSource,
        wanted: &dyn Fn(&str) -> bool,
        message: &mut Message,
    ) -> Result<bool, String> {
        loop {
            let step = decoded(|| self.step(wanted, message));
            match step
                .and_then(|step| step.map_err(|error| error.to_string()))
                .map_err(|why| self.lost(&why))?
            {
                ReadStep::Message => return Ok(true),
                ReadStep::End => return Ok(false),
                ReadStep::Other => {}
                ReadStep::Read(bytes) => {
                    if !self.feed(source, bytes).map_err(|why| self.lost(&why))? {
                        return Err(self.lost(
                            "it has no end: a recorder that was stopped, or a copy that was cut",
                        ));
                    }
                }
            }
        }
    }
    fn topics(&self) -> Vec<Arc<Topic>> {
        self.channels.values().cloned().collect()
    }
    fn position(&self) -> u64 {
        self.at
    }
}
