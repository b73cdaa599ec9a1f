//! XML as exports write it: two blanks a level, and at the head, as comments, what the reader must know of the model.

use crate::error::{Error, Result};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};
use std::io;

/// What elements are written to.
pub(super) type Xml = Writer<Vec<u8>>;

/// A document: the remarks, then what `root` writes.
pub(super) fn document(
    remarks: &[String],
    root: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> Result<String> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    let written = || -> io::Result<Vec<u8>> {
        xml.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
        remarks
            .iter()
            .try_for_each(|line| comment(&mut xml, line))?;
        root(&mut xml)?;
        Ok(xml.into_inner())
    };
    let text = written().map_err(|error| Error::Bug(error.to_string()))?;
    String::from_utf8(text)
        .map(|text| text + "\n")
        .map_err(|error| Error::Bug(error.to_string()))
}

pub(super) fn comment(xml: &mut Xml, text: &str) -> io::Result<()> {
    // Two hyphens would end the comment; of three, the first pass leaves two.
    let text = text.replace("--", "- -").replace("--", "- -");
    xml.write_event(Event::Comment(BytesText::from_escaped(format!(" {text} "))))
}

/// An element without content.
pub(super) fn empty(xml: &mut Xml, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
    xml.create_element(name)
        .with_attributes(attributes.iter().copied())
        .write_empty()?;
    Ok(())
}

/// A point as seen from another.
pub(super) fn offset(point: [f64; 3], from: [f64; 3]) -> String {
    numbers(point.iter().zip(from).map(|(now, then)| now - then))
}

/// Numbers with blanks between them, each the shortest text that reads as the same number.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    values
        .into_iter()
        .map(|value| format!("{value:?}"))
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hyphens_of_a_name_end_no_comment() {
        for name in ["a--b", "---", "-----", "-", "<!-- -->"] {
            let text = document(&[name.to_string()], |xml| {
                xml.create_element("robot").write_empty().map(drop)
            })
            .unwrap();
            let read = roxmltree::Document::parse(&text)
                .unwrap_or_else(|error| panic!("{error} in {text}"));
            assert_eq!(read.root_element().tag_name().name(), "robot");
        }
    }

    #[test]
    fn numbers_read_back_as_they_are() {
        let values = [0.1 + 0.2, -0.0, 1e-300, 1594.0];
        let read = numbers(values)
            .split(' ')
            .map(|number| number.parse::<f64>().unwrap().to_bits())
            .collect::<Vec<_>>();
        assert_eq!(read, values.map(f64::to_bits));
    }
}
