//! Workbooks (.xlsx, .xlsm): a sheet as lines of text with tabs between its cells, so that it is read as any text table is.
//!
//! A line is a row of the sheet, and every line but a blank one is as wide as the sheet. What is unpacked is counted beforehand: an
//! archive may hold a thousand times its size, and the decoder believes what a file says of its own sizes.

use super::arrays::is_arrays;
use super::{DecimalMark, decoded};
use calamine::{Cell, DataRef, ExcelDateTime, Reader, SheetVisible, Xlsx, XlsxError};
use jiff::SignedDuration;
use jiff::civil::date;
use std::fmt::Write;
use std::io::{Cursor, Read};

/// Bytes of a workbook, all its parts unpacked: some 600,000 rows of ten columns.
const MOST_BYTES: u64 = 512 << 20;
/// Bytes of the texts of all cells.
const MOST_TEXTS: u64 = 64 << 20;
const MOST_CELLS: usize = 10_000_000;
const MOST_LINES: usize = 512 << 20;
/// Rows of a sheet, by the format.
const MOST_ROWS: u32 = 1 << 20;
/// The shortest text there is, `<si/>`, bytes.
const SHORTEST: u64 = 5;
/// So many numbers in a row are a table's.
const NARROWEST: usize = 3;

/// What is allowed instead of other workbooks.
const ALLOWED: &str = "allowed: .xlsx, .xlsm, or the sheet saved as CSV";

/// Whether a file that begins so is an archive, as workbooks are, or an older workbook.
pub fn is_workbook(head: &[u8]) -> bool {
    head.starts_with(b"PK\x03\x04") && !is_arrays(head)
        || head.starts_with(&[0xd0, 0xcf, 0x11, 0xe0])
}

/// An opened workbook.
pub struct Workbook {
    book: Xlsx<Cursor<Vec<u8>>>,
    is_1904: bool,
}

impl Workbook {
    /// Reads a workbook from first byte to last; what is wrong comes in words.
    pub fn read(source: impl Read) -> Result<Self, String> {
        let mut bytes = Vec::new();
        source
            .take(MOST_BYTES + 1)
            .read_to_end(&mut bytes)
            .map_err(|error| format!("could not be read: {error}"))?;
        if !bytes.starts_with(b"PK") {
            return Err(format!(
                "is a workbook of the older kind (.xls), or has a password; {ALLOWED}"
            ));
        }
        unpacked(&bytes)?;
        let book = decode(|| Xlsx::new(Cursor::new(bytes)))?;
        let is_1904 = decode(|| Ok(book.has_1904_epoch()))?;
        Ok(Self { book, is_1904 })
    }

    /// The sheet that is read: the one of this name, else the only visible one with rows of numbers.
    pub fn sheet(&mut self, wanted: Option<&str>) -> Result<String, String> {
        let listed = |names: &[String]| {
            let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
            names.join(", ")
        };
        let Some(wanted) = wanted else {
            let tables = self.tables()?;
            return match tables.as_slice() {
                [only] => Ok(only.clone()),
                [] => Err(format!(
                    "has no sheet with rows of numbers; its sheets: {}",
                    listed(&self.book.sheet_names())
                )),
                several => Err(format!(
                    "has numbers in several sheets; say which, `sheet: NAME`; allowed: {}",
                    listed(several)
                )),
            };
        };
        let names = self.book.sheet_names();
        match names.iter().any(|name| name == wanted) {
            true => Ok(wanted.into()),
            false => Err(format!(
                "has no sheet `{wanted}`; allowed: {}",
                listed(&names)
            )),
        }
    }

    /// The visible sheets with rows of numbers.
    pub fn tables(&mut self) -> Result<Vec<String>, String> {
        let sheets = self.book.sheets_metadata().to_vec();
        let mut tables = Vec::new();
        for sheet in sheets {
            if sheet.visible == SheetVisible::Visible && self.has_numbers(&sheet.name)? {
                tables.push(sheet.name);
            }
        }
        Ok(tables)
    }

    fn has_numbers(&mut self, sheet: &str) -> Result<bool, String> {
        let (mut row, mut numbers) = (0, 0);
        let found = self.cells(sheet, |cell| {
            if cell.get_position().0 != row {
                (row, numbers) = (cell.get_position().0, 0);
            }
            numbers += usize::from(is_number(cell.get_value()));
            Ok(numbers < NARROWEST)
        });
        found.map(|()| numbers >= NARROWEST)
    }

    /// Hands on the cells of a sheet until there is none left or none wanted.
    fn cells(
        &mut self,
        sheet: &str,
        mut take: impl FnMut(Cell<DataRef>) -> Result<bool, String>,
    ) -> Result<(), String> {
        let book = &mut self.book;
        let read = decoded(|| {
            let mut reader = match book.worksheet_cells_reader(sheet) {
                Ok(reader) => reader,
                // A chart has no cells.
                Err(XlsxError::NotAWorksheet(_)) => return Ok(()),
                Err(error) => return Err(damaged(error)),
            };
            while let Some(cell) = reader.next_cell().map_err(damaged)? {
                if !take(cell)? {
                    break;
                }
            }
            Ok(())
        });
        read?.map_err(|message| format!("sheet `{sheet}`: {message}"))
    }

    /// A sheet as lines, numbers with this decimal mark.
    pub fn lines(&mut self, sheet: &str, decimal: DecimalMark) -> Result<String, String> {
        let is_1904 = self.is_1904;
        let mut texts = String::new();
        let mut cells: Vec<([u32; 2], [usize; 2])> = Vec::new();
        self.cells(sheet, |cell| {
            let ((row, column), start) = (cell.get_position(), texts.len());
            written(&mut texts, cell.get_value(), decimal, is_1904);
            if texts.len() > start {
                cells.push(([row, column], [start, texts.len()]));
            }
            if cells.len() > MOST_CELLS || texts.len() > MOST_LINES || row >= MOST_ROWS {
                return Err(format!(
                    "more than {MOST_CELLS} cells; allowed: up to that, or the sheet saved as CSV"
                ));
            }
            Ok(true)
        })?;
        cells.sort_unstable();
        cells.dedup_by_key(|(place, _)| *place);
        let width = cells
            .iter()
            .map(|([_, column], _)| *column + 1)
            .max()
            .unwrap_or_default();
        let rows = cells.chunk_by(|(a, _), (b, _)| a[0] == b[0]);
        if rows.clone().count() * width as usize + texts.len() > MOST_LINES {
            return Err(format!(
                "sheet `{sheet}`: {width} columns; allowed: fewer, or the sheet saved as CSV"
            ));
        }
        let mut lines = String::with_capacity(texts.len() + cells.len());
        let mut line = 0;
        for row in rows {
            let first_row = row.first().map_or(0, |([row, _], _)| *row);
            lines.extend(std::iter::repeat_n('\n', (first_row - line) as usize));
            let mut at = 0;
            for ([_, column], [start, end]) in row {
                lines.extend(std::iter::repeat_n('\t', (column - at) as usize));
                lines.push_str(&texts[*start..*end]);
                at = *column;
            }
            lines.extend(std::iter::repeat_n('\t', (width - 1 - at) as usize));
            line = first_row;
        }
        lines.push('\n');
        Ok(lines)
    }
}

/// Whether a cell holds a number, or a text that is one, with a decimal point or comma.
fn is_number(value: &DataRef) -> bool {
    let text = match value {
        DataRef::Float(_) | DataRef::Int(_) => return true,
        DataRef::String(text) => text.as_str(),
        DataRef::SharedString(text) => *text,
        _ => return false,
    };
    let number = text.trim().replacen(',', ".", 1).parse();
    number.is_ok_and(f64::is_finite)
}

fn damaged(error: XlsxError) -> String {
    format!("is a workbook that cannot be read: {error}")
}

fn decode<T>(work: impl FnOnce() -> Result<T, XlsxError>) -> Result<T, String> {
    match decoded(work)? {
        Err(XlsxError::Password) => Err(format!("has a password; {ALLOWED}")),
        other => other.map_err(damaged),
    }
}

/// Unpacks every part to nowhere, and refuses what a workbook is not, and what is larger than it may be.
fn unpacked(bytes: &[u8]) -> Result<(), String> {
    let foreign = |error: zip::result::ZipError| {
        format!("is an archive that cannot be read ({error}); {ALLOWED}")
    };
    let counted = decoded(|| {
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(foreign)?;
        let is_book = |name: &str| name.eq_ignore_ascii_case("xl/workbook.xml");
        if !archive
            .file_names()
            .any(|name| name.is_ok_and(|name| is_book(&name)))
        {
            return Err(format!(
                "is an archive or a workbook of another kind; {ALLOWED}"
            ));
        }
        let mut left = MOST_BYTES;
        for index in 0..archive.len() {
            let mut part = archive.by_index(index).map_err(foreign)?;
            let name = part.name().map_err(foreign)?.into_owned();
            left -= match name.to_ascii_lowercase().ends_with("sharedstrings.xml") {
                true => texts(&mut part, &name)?,
                false => size(&mut part, left, &name, &mut std::io::sink())?,
            };
        }
        Ok(())
    });
    counted?
}

/// Copies a part and gives its size; refuses one of more than so many bytes.
fn size(
    part: &mut impl Read,
    most: u64,
    name: &str,
    into: &mut impl std::io::Write,
) -> Result<u64, String> {
    let copied = std::io::copy(&mut part.take(most + 1), into);
    let size = copied.map_err(|error| format!("is a workbook that cannot be unpacked: {error}"))?;
    if size > most {
        let [all, texts] = [MOST_BYTES, MOST_TEXTS].map(|most| most >> 20);
        let allowed = format!(
            "allowed: up to {all} MB unpacked, {texts} MB of them texts, or the sheet saved as CSV"
        );
        return Err(format!("is too large at `{name}`; {allowed}"));
    }
    Ok(size)
}

/// The size of the part with the texts of all cells. It says how many they are, and the decoder makes room for so many.
fn texts(part: &mut impl Read, name: &str) -> Result<u64, String> {
    let mut content = Vec::new();
    let size = size(part, MOST_TEXTS, name, &mut content)?;
    let text = std::str::from_utf8(&content)
        .ok()
        .filter(|text| !text.contains(['\0', '\x1b']));
    let text = text.ok_or_else(|| {
        format!("has texts in another encoding than UTF-8 at `{name}`; {ALLOWED}")
    })?;
    let digits = |stated: &str| {
        let number = stated.trim_start_matches(|c: char| c.is_whitespace() || "='\"".contains(c));
        match number.split(|c: char| !c.is_ascii_digit()).next() {
            None | Some("") => 0,
            // No count of texts has more digits than fit.
            Some(digits) => digits.parse().unwrap_or(u64::MAX),
        }
    };
    match text.split("uniqueCount").skip(1).map(digits).max() {
        Some(stated) if stated > size / SHORTEST => Err(format!(
            "is damaged: `{name}` says that it has more texts than it can hold"
        )),
        _ => Ok(size),
    }
}

fn written(texts: &mut String, value: &DataRef, decimal: DecimalMark, is_1904: bool) {
    let start = texts.len();
    let result = match value {
        DataRef::Empty => Ok(()),
        DataRef::Int(number) => write!(texts, "{number}"),
        DataRef::Float(number) => write!(texts, "{number}"),
        DataRef::Bool(value) => write!(texts, "{value}"),
        DataRef::Error(error) => write!(texts, "{error}"),
        DataRef::DateTime(moment) => {
            texts.push_str(&clock(moment, is_1904));
            return;
        }
        DataRef::String(text) | DataRef::DateTimeIso(text) | DataRef::DurationIso(text) => {
            return quoted(texts, text);
        }
        DataRef::SharedString(text) => return quoted(texts, text),
    };
    if result.is_ok() && decimal == DecimalMark::Comma && matches!(value, DataRef::Float(_)) {
        let number = texts.split_off(start).replace('.', ",");
        texts.push_str(&number);
    }
}

/// A text in one line, in quotes where it has some itself.
fn quoted(texts: &mut String, text: &str) {
    let plain = text.trim().replace(['\t', '\n', '\r'], " ");
    if plain.contains('"') {
        texts.push_str(&format!("\"{}\"", plain.replace('"', "\"\"")));
    } else {
        texts.push_str(&plain);
    }
}

/// A date with its time, or a time of day: workbooks count days, from the end of 1899 or the beginning of 1904.
fn clock(moment: &ExcelDateTime, is_1904: bool) -> String {
    let days = moment.as_f64();
    // Counted to 10 us: a number of 64 bits holds a day of this century to 1 us.
    let time = SignedDuration::try_from_secs_f64((days * 8.64e9).round() / 1e5);
    let Ok(time) =
        time.map(|time| SignedDuration::from_micros(((time.as_micros() + 5) / 10 * 10) as i64))
    else {
        return days.to_string();
    };
    // There was no 29th of February in 1900, but for workbooks.
    let first = if is_1904 {
        date(1904, 1, 1)
    } else if days < 60.0 {
        date(1899, 12, 31)
    } else {
        date(1899, 12, 30)
    };
    match first.at(0, 0, 0, 0).checked_add(time) {
        Ok(moment) if (0.0..1.0).contains(&days) => moment.time().to_string(),
        // More than a day of elapsed time is no time of day.
        Ok(_) if moment.is_duration() => format!("{} h", days * 24.0),
        Ok(moment) => moment.to_string(),
        Err(_) => days.to_string(),
    }
}
