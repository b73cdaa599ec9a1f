//! Numbers as people write them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// The decimal mark.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Decimal")]
pub enum DecimalMark {
    /// `0.365`
    #[default]
    Point,
    /// `0,365`
    Comma,
}

/// Why a cell is no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberFault {
    /// Nothing stands there.
    Blank,
    /// Anything else.
    Text,
    /// A number with a decimal comma where a point was announced.
    Comma,
    /// A number with a point where a decimal comma was announced.
    Point,
    /// NaN or infinity, written so or too large.
    NotFinite,
}

/// A finite number, or why the cell is none. Blanks around it were removed.
#[inline]
pub fn number(cell: &[u8], mark: DecimalMark) -> Result<f64, NumberFault> {
    let text = std::str::from_utf8(cell).map_err(|_| NumberFault::Text)?;
    let found = match mark {
        DecimalMark::Point => text.parse(),
        DecimalMark::Comma if text.contains('.') => return unusual(text, mark),
        DecimalMark::Comma => text.replacen(',', ".", 1).parse(),
    };
    match found {
        Ok(value) if f64::is_finite(value) => Ok(value),
        _ => unusual(text, mark),
    }
}

/// A finite number with either mark; the one that stands last is the decimal one.
pub fn number_of_any_mark(text: &str) -> Option<f64> {
    let is_ended = text.ends_with(',');
    let by = |mark| number(text.as_bytes(), mark).ok();
    by(DecimalMark::Point).or_else(|| by(DecimalMark::Comma).filter(|_| !is_ended))
}

fn unusual(text: &str, mark: DecimalMark) -> Result<f64, NumberFault> {
    if text.is_empty() {
        return Err(NumberFault::Blank);
    }
    if let Some(plain) = ungrouped(text, mark) {
        return read(&plain);
    }
    let with_point = || text.replacen(',', ".", 1);
    match mark {
        DecimalMark::Point => read(text).map_err(|fault| match read(&with_point()) {
            Ok(_) => NumberFault::Comma,
            Err(_) => fault,
        }),
        DecimalMark::Comma if text.contains('.') => {
            Err(read(text).map_or(NumberFault::Text, |_| NumberFault::Point))
        }
        DecimalMark::Comma => read(&with_point()),
    }
}

/// The number without its marks of thousands, with a decimal point, where it has both marks and every group is one: `1.234,56` with a decimal
/// comma, `1,234.56` with a point.
fn ungrouped(text: &str, mark: DecimalMark) -> Option<Cow<'_, str>> {
    let (group, mark) = if mark == DecimalMark::Comma {
        ('.', ',')
    } else {
        (',', '.')
    };
    let (whole, fraction) = text
        .split_once(mark)
        .filter(|(whole, fraction)| whole.contains(group) && !fraction.contains(mark))?;
    let mut groups = whole.strip_prefix('-').unwrap_or(whole).split(group);
    let are_digits = |digits: &str| digits.bytes().all(|byte| byte.is_ascii_digit());
    let first = groups
        .next()
        .is_some_and(|digits| (1..=3).contains(&digits.len()) && are_digits(digits));
    let others = groups.all(|digits| digits.len() == 3 && are_digits(digits));
    (first && others).then(|| format!("{}.{fraction}", whole.replace(group, "")).into())
}

fn read(text: &str) -> Result<f64, NumberFault> {
    let value: f64 = text.parse().map_err(|_| NumberFault::Text)?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(NumberFault::NotFinite)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use DecimalMark::{Comma, Point};

    /// A cell is this under a mark.
    fn read(cell: &str, mark: DecimalMark, expected: Result<f64, NumberFault>) {
        assert_eq!(number(cell.as_bytes(), mark), expected, "{cell}");
    }

    #[test]
    fn the_announced_decimal_mark_is_the_only_one() {
        read("-0,000212669", Comma, Ok(-0.000212669));
        read("2,02011E+13", Comma, Ok(2.02011e13));
        read("17", Comma, Ok(17.0));
        read("0.365", Comma, Err(NumberFault::Point));
        read("+1.5e-3", Point, Ok(1.5e-3));
        read("0,365", Point, Err(NumberFault::Comma));
        read("1,234,5", Point, Err(NumberFault::Text));
        read("1,234,5", Comma, Err(NumberFault::Text));
    }

    #[test]
    fn marks_of_thousands_are_read_where_both_marks_stand_and_every_group_has_three_digits() {
        read("1.234,56", Comma, Ok(1234.56));
        read("-12.345.678,5", Comma, Ok(-12_345_678.5));
        read("1,234.56", Point, Ok(1234.56));
        // One mark alone may be either.
        read("1.234", Comma, Err(NumberFault::Point));
        for cell in ["1.23,4", "1.2345,6", "1234.567,8", ".123,4", "1.234,5,6"] {
            read(cell, Comma, Err(NumberFault::Text));
        }
    }

    #[test]
    fn what_is_not_finite_is_no_number() {
        for cell in ["NaN", "inf", "-Infinity", "1e999"] {
            read(cell, Point, Err(NumberFault::NotFinite));
        }
        read("", Point, Err(NumberFault::Blank));
        read("--", Point, Err(NumberFault::Text));
        assert_eq!(number(b"1\xb5", Point), Err(NumberFault::Text));
    }

    #[test]
    fn without_an_announcement_the_last_mark_is_the_decimal_one() {
        for (cell, expected) in [
            ("1.234,56", Some(1234.56)),
            ("-1,234.5", Some(-1234.5)),
            ("1,5", Some(1.5)),
            ("1.5", Some(1.5)),
            ("5,", None),
            ("1.23,4", None),
            ("1,2.3", None),
        ] {
            assert_eq!(number_of_any_mark(cell), expected, "{cell}");
        }
    }
}
