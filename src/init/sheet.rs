//! A delimited text as a table of cells, as far as it can be understood without being told.

use crate::error::{Error, Result, listed};
use crate::raw::{
    self, BagTopic, DecimalMark, Delimiter, InputSource, Record, Workbook, bag_content, failed,
    fields, is_utf16, shown, unquoted_text,
};
use crate::stage::ingest::{FileKind, TableLayout, records};
use crate::units::{Unit, written};
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::Path;

pub(super) use crate::raw::number_of_any_mark as number;

/// So many lines say what separates fields: a decimal comma shows within a few rows, and notes above the data are shorter.
const ENOUGH: usize = 500;

/// Of SpatialAnalyzer, of scripts, of MATLAB and TeX, of FANUC.
const COMMENTS: [&str; 4] = ["//", "#", "%", "!"];

/// Fewer columns are no table of joints or points.
const NARROWEST: usize = 3;

#[derive(Default)]
pub(super) struct Sheet {
    /// Its name in its workbook, where it is of one.
    pub(crate) of_book: Option<String>,
    /// The topic, where it is of a recording of ROS 2.
    pub(crate) topic: Option<String>,
    /// What else is to be known of it, in the pipeline and on the terminal.
    pub(crate) notes: Vec<String>,
    pub(crate) delimiter: char,
    pub(crate) comma: bool,
    /// Lines above the header, or above the data where there is none.
    pub(crate) skip: usize,
    /// Whether a row of units stands below the header.
    pub(crate) unit_row: bool,
    pub(crate) comment: Option<&'static str>,
    pub(crate) header_in_comment: bool,
    pub(crate) header: bool,
    /// Names of the columns; in a file without a header the numbers from 1.
    pub(crate) names: Vec<String>,
    pub(crate) units: Vec<Option<&'static str>>,
    pub(crate) rows: Vec<Vec<String>>,
    /// Why nothing was understood, and what stands in the file.
    pub(crate) trouble: Option<String>,
}

/// A line that is neither blank nor a comment, and its number from 0.
struct Content<'a> {
    at: usize,
    text: &'a str,
}

/// The last mark of a number.
fn decimal_mark(text: &str) -> Option<char> {
    text.chars()
        .rev()
        .find(|letter| ['.', ','].contains(letter))
}

fn numeric(cells: &[String]) -> usize {
    cells.iter().filter(|cell| number(cell).is_some()).count()
}

/// The fields of a line; a quoted one may hold the delimiter. A blank stands for any run of blanks and tabs.
fn cells(line: &str, delimiter: char) -> Vec<String> {
    let delimiter = if delimiter == ' ' {
        Delimiter::Whitespace
    } else {
        Delimiter::Byte(delimiter as u8)
    };
    let line = line.trim_end();
    fields(line, delimiter)
        .0
        .into_iter()
        .map(|place| unquoted_text(&line[place]).into_owned())
        .collect()
}

/// Without the blank cells that a delimiter at the end of a line makes.
fn filled(mut cells: Vec<String>) -> Vec<String> {
    while cells.last().is_some_and(String::is_empty) {
        cells.pop();
    }
    cells
}

impl Sheet {
    /// What nothing can be said of, and why.
    pub(crate) fn not_understood(trouble: String) -> Self {
        Self {
            trouble: Some(trouble),
            delimiter: ',',
            header: true,
            ..Self::default()
        }
    }

    /// A sheet of a workbook, with tabs between its cells.
    pub(crate) fn of_workbook(name: &str, lines: &[String]) -> Self {
        // What separates cells is the workbook's own.
        Self {
            of_book: Some(name.into()),
            delimiter: ',',
            ..Self::delimited(lines, Some('\t'))
        }
    }

    pub(crate) fn of_columns(names: Vec<String>, rows: Vec<Vec<String>>) -> Self {
        Self {
            delimiter: ',',
            header: true,
            names,
            rows,
            ..Self::default()
        }
    }

    /// The first messages of a topic; its times are in s.
    pub(crate) fn of_topic(topic: &BagTopic, names: Vec<String>, rows: Vec<Vec<String>>) -> Self {
        // ROS states everything in SI (REP 103); efforts are torques or whatever the driver has.
        let unit = |name: &String| match name.rsplit_once('.') {
            None => ["received", "stamp"]
                .contains(&name.as_str())
                .then_some("s"),
            Some((_, "position")) => Some("rad"),
            Some(("point" | "position" | "translation", _)) => Some("m"),
            _ => None,
        };
        let (units, topic) = (names.iter().map(unit).collect(), Some(topic.name.clone()));
        Self {
            topic,
            units,
            ..Self::of_columns(names, rows)
        }
    }

    /// A text; what separates its cells where that is known.
    pub(crate) fn delimited(lines: &[String], given: Option<char>) -> Self {
        let comment = comment(lines);
        let is_comment = |line: &str| comment.is_some_and(|mark| line.starts_with(mark));
        let content: Vec<Content> = (lines.iter().enumerate())
            .filter(|(_, line)| !line.trim().is_empty() && !is_comment(line))
            .map(|(at, text)| Content { at, text })
            .collect();
        let delimiter = given.unwrap_or_else(|| delimiter(&content));
        let mut sheet = Self {
            delimiter,
            comment,
            header: true,
            ..Self::default()
        };
        let lines_of_table = content.iter().map(|line| cells(line.text, delimiter));
        let table: Vec<Vec<String>> = lines_of_table.collect();
        let begins = if let Some(k) = plain_header(&table) {
            sheet.skip = content[k].at;
            sheet.names = filled(table[k].clone());
            k + 1
        } else if let Some((at, names, mark)) = commented_header(lines, &sheet, &content, &table) {
            (sheet.skip, sheet.names, sheet.header_in_comment) = (at, names, mark);
            sheet.comment = sheet.comment.filter(|_| mark);
            content.partition_point(|line| line.at <= at)
        } else if let Some(k) = bare_rows(&table) {
            sheet.skip = content[k].at;
            sheet.header = false;
            let numbers = 1..=table[k].len();
            sheet.names = numbers.map(|number| number.to_string()).collect();
            sheet.trouble = Some("no header found".into());
            k
        } else {
            let begin = |line: &Content| -> String { line.text.trim().chars().take(60).collect() };
            let seen = content.iter().take(3);
            let seen = match content[..] {
                [] => "the file is empty".into(),
                _ => format!(
                    "it begins {}",
                    listed(seen.map(|line| format!("`{}`", begin(line))))
                ),
            };
            sheet.trouble = Some(format!("no header found and no rows of numbers; {seen}"));
            return sheet;
        };
        let units = table.get(begins);
        let units = units.filter(|row| is_units(row) && sheet.header);
        sheet.unit_row = units.is_some();
        sheet.units = units.into_iter().flatten().map(|cell| unit(cell)).collect();
        let (width, first) = (sheet.names.len(), begins + usize::from(sheet.unit_row));
        let rows = table.into_iter().skip(first).map(filled);
        sheet.rows = rows
            .filter(|row| !row.is_empty() && row.len() <= width)
            .map(|mut row| {
                row.resize(width, String::new());
                row
            })
            .collect();
        let marks = |mark: char| {
            let cells = sheet.rows.iter().flatten();
            let marked = cells.filter(|cell| decimal_mark(cell) == Some(mark));
            marked.filter(|cell| number(cell).is_some()).count()
        };
        sheet.comma = marks(',') > marks('.');
        sheet
    }

    /// Whether both are written alike, with the same columns.
    pub(crate) fn is_laid_out_as(&self, other: &Self) -> bool {
        let layout = |sheet: &Self| {
            let lines = (sheet.skip, sheet.unit_row, sheet.comment, sheet.header);
            (sheet.delimiter, sheet.comma, lines)
        };
        self.names == other.names && layout(self) == layout(other)
    }

    pub(crate) fn numbers(&self, column: usize) -> impl Iterator<Item = f64> + '_ {
        self.rows
            .iter()
            .filter_map(move |row| row.get(column).and_then(|cell| number(cell)))
    }

    pub(crate) fn texts(&self, column: usize) -> impl Iterator<Item = &str> {
        self.rows
            .iter()
            .filter_map(move |row| row.get(column))
            .map(String::as_str)
            .filter(|cell| !cell.is_empty())
    }

    /// Whether nine of ten cells are numbers.
    pub(crate) fn is_numeric(&self, column: usize) -> bool {
        !self.rows.is_empty() && 10 * self.numbers(column).count() >= 9 * self.rows.len()
    }

    /// Whether every cell that is not blank is a number, and some are.
    pub(crate) fn holds_numbers(&self, column: usize) -> bool {
        let numbers = self.numbers(column).count();
        numbers > 0 && numbers == self.texts(column).count()
    }

    /// Largest number without its sign.
    pub(crate) fn largest(&self, column: usize) -> f64 {
        self.numbers(column).map(f64::abs).fold(0.0, f64::max)
    }

    /// What a column holds, for a person: `column 3: -12.5 to 80`, `column 1: P1, P2, ...`.
    pub(crate) fn seen(&self, column: usize) -> String {
        if self.is_numeric(column) {
            let (lower, upper) = self
                .numbers(column)
                .fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
            return format!("column {}: {lower} to {upper}", column + 1);
        }
        let texts = self.texts(column).take(3);
        let texts: Vec<String> = texts.map(|text| text.chars().take(20).collect()).collect();
        format!("column {}: {}, ...", column + 1, texts.join(", "))
    }
}

/// How comments begin here, if some lines are such and most are not.
fn comment(lines: &[String]) -> Option<&'static str> {
    let filled = lines.iter().filter(|line| !line.trim().is_empty()).count();
    let begun = |mark: &str| lines.iter().filter(|line| line.starts_with(mark)).count();
    COMMENTS
        .into_iter()
        .find(|mark| begun(mark) > 0 && 2 * begun(mark) < filled)
}

/// What separates fields: what makes most lines rows of one width with most numbers in them.
fn delimiter(content: &[Content]) -> char {
    let worth = |delimiter: char| {
        let rows = content.iter().take(ENOUGH);
        let rows: Vec<Vec<String>> = rows.map(|line| cells(line.text, delimiter)).collect();
        let mut widths = std::collections::BTreeMap::new();
        for row in rows.iter().filter(|row| row.len() >= NARROWEST) {
            *widths.entry(row.len()).or_insert(0) += 1;
        }
        let usual = widths.into_iter().max_by_key(|(_, rows)| *rows);
        let usual = usual.map_or(0, |(width, _)| width);
        let worth = |row: &Vec<String>| {
            // A cell that is left blank is of any kind.
            let stated = row.iter().filter(|cell| !cell.is_empty()).count();
            (1 + numeric(row)) as f64 / (1 + stated) as f64
        };
        let of_width = rows.iter().filter(|row| row.len() == usual);
        of_width.map(worth).sum::<f64>()
    };
    let mut best = (0.0, ',');
    for delimiter in [';', '\t', ',', '|', ' '] {
        let worth = worth(delimiter);
        if worth > best.0 + 1e-9 {
            best = (worth, delimiter);
        }
    }
    best.1
}

/// Whether a row of numbers stands here, as wide as most below it.
fn is_data(table: &[Vec<String>], k: usize, width: usize) -> bool {
    let below = table.get(k..).unwrap_or_default();
    let Some(row) = below.first() else {
        return false;
    };
    let alike = below.iter().filter(|other| other.len() == row.len());
    let alike = alike.count();
    row.len() >= NARROWEST
        && filled(row.clone()).len() <= width
        && numeric(row) >= 2
        && 2 * alike >= below.len()
}

fn is_names(row: &[String]) -> bool {
    let named = row.iter().filter(|cell| !cell.is_empty()).count();
    filled(row.to_vec()).len() >= NARROWEST && numeric(row) == 0 && 2 * named > row.len()
}

/// The unit that a cell holds, with brackets or without.
fn unit(cell: &str) -> Option<&'static str> {
    written(cell.to_lowercase().trim_matches(['[', ']', '(', ')', ' '])).map(Unit::symbol)
}

fn is_units(row: &[String]) -> bool {
    let mut stated = row
        .iter()
        .filter(|cell| !cell.is_empty() && *cell != "-")
        .peekable();
    stated.peek().is_some() && stated.all(|cell| unit(cell).is_some())
}

/// The line of names above the first line of numbers as wide as itself.
fn plain_header(table: &[Vec<String>]) -> Option<usize> {
    (0..table.len()).find(|k| {
        let width = filled(table[*k].clone()).len();
        let data = k + 1 + usize::from(table.get(k + 1).is_some_and(|row| is_units(row)));
        is_names(&table[*k]) && is_data(table, data, width) && table[data].len() <= table[*k].len()
    })
}

/// A header that is written as a comment: line, names, and whether the mark is no part of the first name. The one next to the data goes
/// before others.
fn commented_header(
    lines: &[String],
    sheet: &Sheet,
    content: &[Content],
    table: &[Vec<String>],
) -> Option<(usize, Vec<String>, bool)> {
    let mark = sheet.comment?;
    let fits = |names: &[String], at: usize| {
        let Some(next) = content.iter().position(|line| line.at > at) else {
            return false;
        };
        is_names(names)
            && !names[0].is_empty()
            && is_data(table, next, names.len())
            && table[next].len() == names.len()
    };
    let first = content.first()?.at;
    let mut places = (0..first).rev().chain(first..lines.len());
    places.find_map(|at| {
        let bare = lines[at].strip_prefix(mark)?;
        let [bare, whole] = [bare, &lines[at]].map(|text| filled(cells(text, sheet.delimiter)));
        if fits(&bare, at) {
            return Some((at, bare, true));
        }
        fits(&whole, at).then_some((at, whole, false))
    })
}

/// The first row of a file without a header.
fn bare_rows(table: &[Vec<String>]) -> Option<usize> {
    (0..table.len()).find(|k| is_data(table, *k, table[*k].len()))
}

/// Bytes and lines that are looked at: `init` answers at once whatever is behind them, and columns do not change their meaning there.
const LOOKED: u64 = 16 << 20;
const LINES: usize = 20_000;

/// The table of a file; of a workbook its sheets with rows of numbers, where there are so many places for them.
pub(super) fn tables(path: &Path, places: usize) -> Result<Vec<Sheet>> {
    let place = path.display().to_string();
    let file = raw::source(path)
        .map_err(|error| Error::spec(&place, format!("cannot be read: {error}")))?;
    let failed = |error: std::io::Error| Error::store(&place, format!("cannot be read: {error}"));
    let mut reader = BufReader::new(file);
    let head = reader.fill_buf().map_err(failed)?;
    let understood = |sheets: Result<Vec<Sheet>, String>| {
        Ok(sheets.unwrap_or_else(|trouble| vec![Sheet::not_understood(trouble)]))
    };
    match FileKind::of(&place, head) {
        FileKind::Workbook => return understood(sheets(reader, places)),
        FileKind::Bag => return understood(in_words(topics(path, &place))),
        FileKind::NotRead(what) => return understood(Err(what.into())),
        FileKind::Text => {}
        // What says itself what its columns are.
        kind => {
            let mut file = reader.into_inner();
            file.rewind().map_err(failed)?;
            let sheet = first_rows(file, &place, None).map(|(names, rows)| {
                // A name, then six joints.
                let degrees =
                    |column| matches!(kind, FileKind::Program(_)) && (1..=6).contains(&column);
                let unit = |column| degrees(column).then_some("deg");
                vec![Sheet {
                    units: (0..names.len()).map(unit).collect(),
                    ..Sheet::of_columns(names, rows)
                }]
            });
            return understood(in_words(sheet));
        }
    }
    if !is_utf16(head) && head.contains(&0) {
        return understood(Err("no text".into()));
    }
    let mut lines: Vec<String> = Vec::new();
    let text = raw::without_utf16(reader).map_err(failed)?;
    for line in BufReader::new(text).take(LOOKED).split(b'\n').take(LINES) {
        let line = line.map_err(failed)?;
        let line = shown(&line);
        let line = line.trim_end_matches('\r').trim_start_matches('\u{feff}');
        lines.push(line.to_string());
    }
    Ok(vec![Sheet::delimited(&lines, None)])
}

fn in_words<T>(found: Result<T>) -> Result<T, String> {
    found.map_err(|error| error.to_string())
}

/// The names and the first rows of a table that says itself what its columns are.
fn first_rows(
    source: Box<dyn InputSource>,
    label: &str,
    topic: Option<&str>,
) -> Result<(Vec<String>, Vec<Vec<String>>)> {
    let layout = TableLayout {
        topic,
        ..TableLayout::default()
    };
    let (_, mut rows) = records(source, label, layout)?;
    let (mut record, mut found) = (Record::default(), Vec::new());
    while found.len() <= LINES && rows.next(&mut record)? {
        if record.fault.is_none() {
            found.push(record.cells());
        }
    }
    Ok((found.remove(0), found))
}

/// Of a recording of ROS 2 the topic of joints with most messages, and that of points; with a line on every topic.
fn topics(path: &Path, place: &str) -> Result<Vec<Sheet>> {
    let opened = || raw::source(path).map_err(|error| failed(place, &error));
    let content = bag_content(opened()?, place)?;
    let most = |wanted: &&[&str]| {
        let fits = |topic: &&BagTopic| {
            topic.messages > 0 && wanted.iter().any(|kind| topic.kind.ends_with(kind))
        };
        let found = content.topics.iter().filter(fits);
        found.max_by_key(|topic| topic.messages)
    };
    let mut sheets = Vec::new();
    for topic in [JOINTS, POINTS].iter().filter_map(most) {
        let (names, rows) = first_rows(opened()?, place, Some(&topic.name))?;
        sheets.push(Sheet::of_topic(topic, names, rows));
    }
    if sheets.is_empty() {
        sheets.push(Sheet::not_understood("no topic of joints or points".into()));
    }
    let lines = content.topics.iter().map(BagTopic::account);
    sheets[0].notes = lines.chain(content.loss).collect();
    Ok(sheets)
}

const JOINTS: &[&str] = &["/JointState"];
const POINTS: &[&str] = &[
    "/PointStamped",
    "/PoseStamped",
    "/TransformStamped",
    "/TFMessage",
];

fn sheets(source: impl Read, places: usize) -> Result<Vec<Sheet>, String> {
    let mut book = Workbook::read(source)?;
    let tables = book.tables()?;
    let names = match (1..=places).contains(&tables.len()) {
        true => tables,
        false => vec![book.sheet(None)?],
    };
    let sheet = |name: &String| {
        let lines = book.lines(name, DecimalMark::Point)?;
        let lines: Vec<String> = lines.lines().take(LINES).map(String::from).collect();
        Ok(Sheet::of_workbook(name, &lines))
    };
    names.iter().map(sheet).collect()
}
