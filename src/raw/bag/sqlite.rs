//! Messages of a bag in SQLite, read from the file's pages as <https://www.sqlite.org/fileformat2.html> lays them out: tables `topics` and
//! `messages`, row by row, in bounded memory. No library of SQLite is used: it takes a path and reads files next to it, which no key of a
//! table would know of, and it refuses a file that was cut, of which all pages that are there are read here.

use super::{BagSource, Container, Message, Topic};
use crate::InputSource;
use std::collections::BTreeMap;
use std::io::SeekFrom;
use std::sync::Arc;

type Source = Box<dyn InputSource>;

/// How a file begins.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";
/// Pages from the root of a table to a row, at most.
const DEEPEST: usize = 24;
/// Bytes of a row, at most.
const LONGEST: u64 = 1 << 30;

struct DatabasePages {
    start: u64,
    size: u64,
    /// Bytes of a page that hold content.
    usable: usize,
    /// Whole pages that are there, and those that the file says it has.
    there: u64,
    stated: u64,
    /// Pages that a table has and the file has not.
    missing: u64,
    /// Written with a write-ahead log.
    logged: bool,
}

/// A row, as far as it stands in its page.
struct PageCell {
    id: i64,
    local: Vec<u8>,
    length: usize,
    /// Where the rest stands.
    overflow: u32,
}

enum Value<'a> {
    Nothing,
    Integer(i64),
    Bytes(&'a [u8]),
}

fn big(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0, |number, byte| (number << 8) | u64::from(*byte))
}

/// A number of one to nine bytes, and how many they are.
fn varint(bytes: &[u8]) -> Option<(u64, usize)> {
    let mut number = 0u64;
    for (index, byte) in bytes.iter().take(9).enumerate() {
        if index == 8 {
            return Some(((number << 8) | u64::from(*byte), 9));
        }
        number = (number << 7) | u64::from(byte & 0x7f);
        if byte & 0x80 == 0 {
            return Some((number, index + 1));
        }
    }
    None
}

impl DatabasePages {
    fn open(source: &mut Source, [start, end]: [u64; 2]) -> Result<Self, String> {
        let mut head = [0; 100];
        let read = source
            .seek(SeekFrom::Start(start))
            .and_then(|_| source.read_exact(&mut head));
        let size = match big(&head[16..18]) {
            1 => 1 << 16,
            size => size,
        };
        if read.is_err()
            || end - start < 100
            || size < 512
            || !size.is_power_of_two()
            || u64::from(head[20]) > size - 480
        {
            return Err("its first page is damaged".into());
        }
        let usable = (size - u64::from(head[20])) as usize;
        Ok(Self {
            start,
            size,
            usable,
            there: (end - start) / size,
            stated: big(&head[28..32]),
            missing: 0,
            logged: head[19] == 2,
        })
    }

    fn page(&mut self, source: &mut Source, number: u64) -> Result<Option<Vec<u8>>, String> {
        if number == 0 || number > self.there {
            self.missing += 1;
            return Ok(None);
        }
        let mut page = vec![0; self.size as usize];
        let place = SeekFrom::Start(self.start + (number - 1) * self.size);
        source
            .seek(place)
            .and_then(|_| source.read_exact(&mut page))
            .map_err(|error| error.to_string())?;
        Ok(Some(page))
    }

    /// All bytes of a row; none where a page of it is missing, or its length is more than the file's.
    fn whole(&mut self, source: &mut Source, cell: &PageCell) -> Result<Option<Vec<u8>>, String> {
        if cell.length as u64 > self.there * self.size {
            return Ok(None);
        }
        let (mut bytes, mut next) = (cell.local.clone(), cell.overflow);
        while bytes.len() < cell.length {
            let Some(page) = self.page(source, u64::from(next))? else {
                return Ok(None);
            };
            let more = (cell.length - bytes.len()).min(self.usable - 4);
            bytes.extend_from_slice(&page[4..4 + more]);
            next = big(&page[..4]) as u32;
        }
        Ok(Some(bytes))
    }
}

/// The rows of a table in the order of their numbers.
struct TableRows {
    /// Pages from the root down: content, where the tree's header begins, the next cell.
    path: Vec<(Vec<u8>, usize, usize)>,
    /// The page to go down to.
    down: Option<u64>,
    /// Pages that were visited: no page stands twice in a tree.
    visited: u64,
}

impl TableRows {
    fn new(root: u64) -> Self {
        Self {
            path: Vec::new(),
            down: Some(root),
            visited: 0,
        }
    }

    fn next(
        &mut self,
        source: &mut Source,
        pages: &mut DatabasePages,
    ) -> Result<Option<PageCell>, String> {
        loop {
            if let Some(number) = self.down.take() {
                self.visited += 1;
                if self.path.len() >= DEEPEST || self.visited > pages.there.max(pages.stated) {
                    return Err("a table goes in circles".into());
                }
                if let Some(page) = pages.page(source, number)? {
                    self.path.push((page, if number == 1 { 100 } else { 0 }, 0));
                }
            }
            let Some((page, head, cell)) = self.path.last_mut() else {
                return Ok(None);
            };
            let (head, index) = (*head, *cell);
            *cell += 1;
            let count = big(&page[head + 3..head + 5]) as usize;
            let of_leaf = match page[head] {
                0x0d => true,
                0x05 => false,
                _ => return Err("a page of a table is damaged".into()),
            };
            let width = if of_leaf { 8 } else { 12 };
            if index >= count {
                self.down = (!of_leaf && index == count).then(|| big(&page[head + 8..head + 12]));
                if self.down.is_none() {
                    self.path.pop();
                }
                continue;
            }
            let pointer = head + width + 2 * index;
            let at = page.get(pointer..pointer + 2).map_or(0, big) as usize;
            let bytes = page.get(at..pages.usable).unwrap_or_default();
            if of_leaf {
                return cell_of(bytes, pages.usable)
                    .map(Some)
                    .ok_or_else(|| "a row is damaged".into());
            }
            self.down = Some(
                bytes
                    .get(..4)
                    .map(big)
                    .ok_or("a page of a table is damaged")?,
            );
        }
    }
}

/// The row that begins with these bytes of a page.
fn cell_of(bytes: &[u8], usable: usize) -> Option<PageCell> {
    let (length, a) = varint(bytes)?;
    let (id, b) = varint(bytes.get(a..)?)?;
    let bytes = &bytes[a + b..];
    let length = usize::try_from(length)
        .ok()
        .filter(|length| *length as u64 <= LONGEST)?;
    let (local, overflow) = if length <= usable - 35 {
        (length, 0)
    } else {
        let least = (usable - 12) * 32 / 255 - 23;
        let fits = least + (length - least) % (usable - 4);
        let local = if fits <= usable - 35 { fits } else { least };
        (local, big(bytes.get(local..local + 4)?) as u32)
    };
    Some(PageCell {
        id: id as i64,
        local: bytes.get(..local)?.to_vec(),
        length,
        overflow,
    })
}

/// A column of a row, counted from 0; none where its bytes are not there.
fn value(row: &[u8], column: usize) -> Option<Value<'_>> {
    let (header, mut at) = varint(row)?;
    let mut start = usize::try_from(header).ok()?;
    for index in 0..=column {
        let (kind, bytes) = varint(row.get(at..header as usize)?)?;
        at += bytes;
        let width = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind as usize,
            5 => 6,
            6 | 7 => 8,
            10 | 11 => return None,
            _ => usize::try_from((kind - 12) / 2).ok()?,
        };
        if index == column {
            let bytes = row.get(start..start.checked_add(width)?);
            return Some(match kind {
                0 | 7 => Value::Nothing,
                8 | 9 => Value::Integer(kind as i64 - 8),
                1..=6 => {
                    let bytes = bytes?;
                    let unused = 64 - 8 * width as u32;
                    Value::Integer(((big(bytes) << unused) as i64) >> unused)
                }
                _ => Value::Bytes(bytes?),
            });
        }
        start = start.checked_add(width)?;
    }
    None
}

fn text(row: &[u8], column: usize) -> Option<String> {
    let Value::Bytes(bytes) = value(row, column)? else {
        return None;
    };
    Some(String::from_utf8_lossy(bytes).into_owned())
}

/// Names of the columns by the statement that made a table.
fn columns(statement: &str) -> Vec<String> {
    let inside = statement.split_once('(').map_or("", |(_, tail)| tail);
    let name = |part: &str| {
        part.split_whitespace()
            .next()
            .unwrap_or_default()
            .trim_matches(['"', '`', '[', ']'])
            .to_lowercase()
    };
    inside.split(',').map(name).collect()
}

/// Hands on the rows of a table that are there, each with its number.
fn each_row(
    source: &mut Source,
    pages: &mut DatabasePages,
    root: u64,
    mut take: impl FnMut(i64, &[u8]),
) -> Result<(), String> {
    let mut rows = TableRows::new(root);
    while let Some(cell) = rows.next(source, pages)? {
        if let Some(row) = pages.whole(source, &cell)? {
            take(cell.id, &row);
        }
    }
    Ok(())
}

pub(super) struct SqliteMessages {
    pages: DatabasePages,
    topics: BTreeMap<i64, Arc<Topic>>,
    messages: TableRows,
    /// Places of topic, time and content among the columns.
    places: [usize; 3],
    cut: u64,
}

impl SqliteMessages {
    /// The file between two places of the source.
    pub(super) fn open(source: &mut Source, bounds: [u64; 2]) -> Result<Self, String> {
        let mut pages = DatabasePages::open(source, bounds)?;
        let mut tables: BTreeMap<String, (u64, Vec<String>)> = BTreeMap::new();
        each_row(source, &mut pages, 1, |_, row| {
            if let (Some(name), Some(Value::Integer(root)), Some(statement)) =
                (text(row, 1), value(row, 3), text(row, 4))
            {
                tables.insert(name, (root as u64, columns(&statement)));
            }
        })?;
        let table = |name: &str, wanted: &[&str]| {
            let (root, columns) = tables
                .get(name)
                .ok_or(format!("it has no table `{name}`: it is no bag of ROS 2"))?;
            let place = |wanted: &&str| columns.iter().position(|column| column == wanted);
            let places: Option<Vec<usize>> = wanted.iter().map(place).collect();
            Ok::<_, String>((
                *root,
                places.ok_or(format!(
                    "its table `{name}` has not the columns of a bag of ROS 2"
                ))?,
            ))
        };
        let (root, places) = table("topics", &["name", "type", "serialization_format"])?;
        let mut topics = BTreeMap::new();
        each_row(source, &mut pages, root, |id, row| {
            if let [Some(name), Some(kind), Some(encoding)] =
                [0, 1, 2].map(|k| text(row, places[k]))
            {
                let topic = Topic {
                    name,
                    kind,
                    encoding,
                };
                topics.insert(id, Arc::new(topic));
            }
        })?;
        let (root, places) = table("messages", &["topic_id", "timestamp", "data"])?;
        Ok(Self {
            pages,
            topics,
            messages: TableRows::new(root),
            places: [places[0], places[1], places[2]],
            cut: 0,
        })
    }
}

impl Container for SqliteMessages {
    fn next(
        &mut self,
        source: &mut BagSource,
        wanted: &dyn Fn(&str) -> bool,
        message: &mut Message,
    ) -> Result<bool, String> {
        // Pages stand anywhere: nothing is read ahead.
        let source = source.get_mut();
        let lost =
            |why: String| format!("it is damaged ({why}): what was recorded after that is lost");
        while let Some(cell) = self.messages.next(source, &mut self.pages).map_err(lost)? {
            let Some(Value::Integer(topic)) = value(&cell.local, self.places[0]) else {
                self.cut += 1;
                continue;
            };
            let Some(topic) = self
                .topics
                .get(&topic)
                .filter(|topic| wanted(&topic.name))
                .cloned()
            else {
                continue;
            };
            let row = self.pages.whole(source, &cell).map_err(lost)?;
            let found = row
                .as_ref()
                .map(|row| (value(row, self.places[1]), value(row, self.places[2])));
            if let Some((Some(Value::Integer(received)), Some(Value::Bytes(data)))) = found {
                (message.topic, message.received) = (topic, received);
                message.data.clear();
                message.data.extend_from_slice(data);
                return Ok(true);
            }
            self.cut += 1;
        }
        match (
            self.pages.missing,
            self.pages.stated.saturating_sub(self.pages.there),
        ) {
            (0, _) if self.cut == 0 => Ok(false),
            (0, _) => Err(format!(
                "it is damaged: {} of its messages cannot be read, which are lost",
                self.cut
            )),
            (missing, pages) => Err(format!(
                "it is cut: {pages} of {} pages are not there, {missing} of them hold messages, which are lost",
                self.pages.stated
            )),
        }
    }
    fn remark(&self) -> Option<String> {
        let message = "written with a write-ahead log: messages that still stand in a file NAME-wal next to it are not read";
        self.pages.logged.then(|| message.into())
    }
    fn topics(&self) -> Vec<Arc<Topic>> {
        self.topics.values().cloned().collect()
    }
    fn position(&self) -> u64 {
        self.pages.start
            + (self.messages.visited * self.pages.size).min(self.pages.there * self.pages.size)
    }
}
