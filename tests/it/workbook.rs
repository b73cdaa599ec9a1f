//! Workbooks made by hand, by ECMA-376: what Excel writes, as far as calib looks at it.

use std::io::{Cursor, Write};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Id="rId1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/officeDocument" Target="xl/workbook.xml"/></Relationships>"#;

/// Style 1 is a date with its time (number format 22), style 2 a time of day (21).
const STYLES: &str = r#"<styleSheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><cellXfs count="3"><xf numFmtId="0"/><xf numFmtId="22"/><xf numFmtId="21"/></cellXfs></styleSheet>"#;

/// A sheet by its name, with its rows from the first one on: cells between `|`, `@` before a date's number, `:` before that of a time of
/// day, texts and numbers as they stand; nothing where there is no cell. A blank row is none in the file.
pub type SheetText<'a> = (&'a str, &'a str);

/// The parts of an archive, deflated.
pub fn archive(parts: &[(&str, &[u8])]) -> Vec<u8> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in parts {
        archive
            .start_file(*name, SimpleFileOptions::default())
            .unwrap();
        archive.write_all(content).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

pub fn workbook(sheets: &[SheetText]) -> Vec<u8> {
    let texts = std::cell::RefCell::new(Vec::new());
    let bodies: Vec<String> = sheets
        .iter()
        .map(|(_, text)| sheet(text, &mut texts.borrow_mut()))
        .collect();
    let texts = texts.into_inner();
    with_texts(
        sheets,
        &bodies,
        &format!(
            r#"<sst uniqueCount="{}">{}</sst>"#,
            texts.len(),
            texts.concat()
        ),
    )
}

/// A workbook with these parts of its sheets and of its texts.
pub fn with_texts(sheets: &[SheetText], bodies: &[String], texts: &str) -> Vec<u8> {
    let (mut listed, mut related, mut parts) = (String::new(), String::new(), Vec::new());
    for (k, ((name, _), body)) in sheets.iter().zip(bodies).enumerate() {
        let hidden = if name.starts_with('_') {
            r#" state="hidden""#
        } else {
            ""
        };
        listed += &format!(
            r#"<sheet name="{name}" sheetId="{}" r:id="rId{k}"{hidden}/>"#,
            k + 1
        );
        let kind = "http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet";
        related += &format!(
            r#"<Relationship Id="rId{k}" Type="{kind}" Target="worksheets/sheet{k}.xml"/>"#
        );
        parts.push((format!("xl/worksheets/sheet{k}.xml"), body.clone()));
    }
    let main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
    let relations = "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
    let book = format!(
        r#"<workbook xmlns="{main}" xmlns:r="{relations}"><sheets>{listed}</sheets></workbook>"#
    );
    let related = format!(
        r#"<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">{related}</Relationships>"#
    );
    parts.extend([
        ("_rels/.rels".into(), RELATIONS.into()),
        ("xl/workbook.xml".into(), book),
        ("xl/_rels/workbook.xml.rels".into(), related),
        ("xl/styles.xml".into(), STYLES.into()),
        ("xl/sharedStrings.xml".into(), texts.into()),
    ]);
    archive(
        &parts
            .iter()
            .map(|(name, content)| (name.as_str(), content.as_bytes()))
            .collect::<Vec<_>>(),
    )
}

fn sheet(text: &str, texts: &mut Vec<String>) -> String {
    let mut rows = String::new();
    for (line, row) in (1..).zip(text.lines()).filter(|(_, row)| !row.is_empty()) {
        let cells: String = ('A'..)
            .zip(row.split('|'))
            .map(|(column, text)| cell(&format!("{column}{line}"), text, texts))
            .collect();
        rows += &format!(r#"<row r="{line}">{cells}</row>"#);
    }
    format!("<worksheet><sheetData>{rows}</sheetData></worksheet>")
}

fn cell(place: &str, text: &str, texts: &mut Vec<String>) -> String {
    if text.is_empty() {
        return String::new();
    }
    for (mark, style) in [('@', 1), (':', 2)] {
        if let Some(number) = text.strip_prefix(mark) {
            return format!(r#"<c r="{place}" s="{style}"><v>{number}</v></c>"#);
        }
    }
    if text.parse::<f64>().is_ok() {
        return format!(r#"<c r="{place}"><v>{text}</v></c>"#);
    }
    texts.push(format!("<si><t>{}</t></si>", text.replace('<', "&lt;")));
    format!(r#"<c r="{place}" t="s"><v>{}</v></c>"#, texts.len() - 1)
}
