//! Numbers as people write them.

use super::layout::Decimal;

/// Why a cell is no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberFault {
    Blank,
    Text,
    /// A number with a decimal comma where a point was announced.
    Comma,
    /// A number with a point where a decimal comma was announced.
    Point,
    /// NaN or infinity, written so or too large.
    NotFinite,
}

/// A finite number, or why the cell is none. Blanks around it were removed.
pub(super) fn parse(cell: &[u8], decimal: Decimal) -> Result<f64, NumberFault> {
    if let Some(value) = short(cell, if decimal == Decimal::Comma { b',' } else { b'.' }) {
        return Ok(value);
    }
    if cell.is_empty() {
        return Err(NumberFault::Blank);
    }
    if let Some(plain) = ungrouped(cell, decimal) {
        return read(&plain);
    }
    match decimal {
        Decimal::Point => read(cell).map_err(|fault| if with_point(cell).is_some() { NumberFault::Comma } else { fault }),
        Decimal::Comma if cell.contains(&b'.') => Err(read(cell).map_or(NumberFault::Text, |_| NumberFault::Point)),
        Decimal::Comma => {
            let mut buffer = [0u8; 64];
            let Some(copy) = buffer.get_mut(..cell.len()) else { return Err(NumberFault::Text) };
            copy.copy_from_slice(cell);
            if let Some(mark) = copy.iter_mut().find(|byte| **byte == b',') {
                *mark = b'.';
            }
            read(copy)
        }
    }
}

/// Up to 15 digits with at most one mark among them, as nearly every cell is. Both parts of the quotient are exact, so that it is the
/// double nearest to what is written.
fn short(cell: &[u8], mark: u8) -> Option<f64> {
    const POWERS: [f64; 16] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (negative, digits) = cell.strip_prefix(b"-").map_or((false, cell), |digits| (true, digits));
    if digits.len() > 16 {
        return None;
    }
    let (mut whole, mut marked) = (0u64, None);
    for (place, byte) in digits.iter().enumerate() {
        if byte.is_ascii_digit() {
            whole = 10 * whole + u64::from(byte - b'0');
        } else if *byte == mark && marked.is_none() {
            marked = Some(place);
        } else {
            return None;
        }
    }
    let count = digits.len() - usize::from(marked.is_some());
    let value = whole as f64 / POWERS[marked.map_or(0, |place| count - place)];
    (1..=15).contains(&count).then_some(if negative { -value } else { value })
}

/// The number without its marks of thousands, with a decimal point, where it has both marks and every group is one: `1.234,56` with a decimal
/// comma, `1,234.56` with a point.
fn ungrouped(cell: &[u8], decimal: Decimal) -> Option<Vec<u8>> {
    let (group, mark) = if decimal == Decimal::Comma { (b'.', b',') } else { (b',', b'.') };
    if !cell.contains(&group) || cell.iter().filter(|byte| **byte == mark).count() != 1 {
        return None;
    }
    let (whole, rest) = cell.split_at(cell.iter().position(|byte| *byte == mark)?);
    let mut groups = whole.strip_prefix(b"-").unwrap_or(whole).split(|byte| *byte == group);
    let first = groups.next().is_some_and(|digits| (1..=3).contains(&digits.len()) && digits.iter().all(u8::is_ascii_digit));
    let others = groups.all(|digits| digits.len() == 3 && digits.iter().all(u8::is_ascii_digit));
    let digits = whole.iter().filter(|byte| **byte != group).copied();
    (first && others).then(|| digits.chain([b'.']).chain(rest[1..].iter().copied()).collect())
}

fn read(cell: &[u8]) -> Result<f64, NumberFault> {
    let value: f64 = std::str::from_utf8(cell).ok().and_then(|text| text.parse().ok()).ok_or(NumberFault::Text)?;
    if value.is_finite() { Ok(value) } else { Err(NumberFault::NotFinite) }
}

/// The number that a cell would be with its one comma as decimal mark.
fn with_point(cell: &[u8]) -> Option<f64> {
    let mut marks = cell.iter().filter(|byte| **byte == b',');
    if marks.next().is_none() || marks.next().is_some() {
        return None;
    }
    let text: String = std::str::from_utf8(cell).ok()?.replace(',', ".");
    read(text.as_bytes()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_announced_decimal_mark_is_the_only_one() {
        assert_eq!(parse(b"-0,000212669", Decimal::Comma), Ok(-0.000212669));
        assert_eq!(parse(b"2,02011E+13", Decimal::Comma), Ok(2.02011e13));
        assert_eq!(parse(b"17", Decimal::Comma), Ok(17.0));
        assert_eq!(parse(b"0.365", Decimal::Comma), Err(NumberFault::Point));
        assert_eq!(parse(b"+1.5e-3", Decimal::Point), Ok(1.5e-3));
        assert_eq!(parse(b"0,365", Decimal::Point), Err(NumberFault::Comma));
        assert_eq!(parse(b"1,234,5", Decimal::Point), Err(NumberFault::Text));
    }

    #[test]
    fn short_numbers_are_the_doubles_that_the_standard_library_reads() {
        let mut state = 1u64;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let (digits, behind) = (state >> 8, (state >> 3) % 8);
            let number =
                format!("{}{}", if state & 1 == 0 { "-" } else { "" }, digits % 10u64.pow(1 + (state >> 60) as u32 % 16));
            let text = if number.len() as u64 > behind + 1 {
                let (whole, rest) = number.split_at(number.len() - behind as usize);
                format!("{whole}.{rest}")
            } else {
                number
            };
            let read = parse(text.as_bytes(), Decimal::Point).map(f64::to_bits);
            assert_eq!(read, text.parse().map(f64::to_bits).map_err(|_| NumberFault::Text), "{text}");
        }
        for cell in ["-0", "0.0", "000.5", ".5", "5.", "-.5"] {
            assert_eq!(short(cell.as_bytes(), b'.').map(f64::to_bits), Some(cell.parse::<f64>().unwrap().to_bits()), "{cell}");
        }
        for cell in ["", "-", ".", "-.", "1.2.3", "+1", "1e3", "--1", "1234567890123456"] {
            assert_eq!(short(cell.as_bytes(), b'.'), None, "{cell}");
        }
    }

    #[test]
    fn marks_of_thousands_are_read_where_both_marks_stand_and_every_group_has_three_digits() {
        assert_eq!(parse(b"1.234,56", Decimal::Comma), Ok(1234.56));
        assert_eq!(parse(b"-12.345.678,5", Decimal::Comma), Ok(-12_345_678.5));
        assert_eq!(parse(b"1,234.56", Decimal::Point), Ok(1234.56));
        // One mark alone may be either.
        assert_eq!(parse(b"1.234", Decimal::Comma), Err(NumberFault::Point));
        for cell in ["1.23,4", "1.2345,6", "1234.567,8", ".123,4", "1.234,5,6"] {
            assert_eq!(parse(cell.as_bytes(), Decimal::Comma), Err(NumberFault::Text), "{cell}");
        }
    }

    #[test]
    fn what_is_not_finite_is_no_number() {
        for cell in ["NaN", "inf", "-Infinity", "1e999"] {
            assert_eq!(parse(cell.as_bytes(), Decimal::Point), Err(NumberFault::NotFinite), "{cell}");
        }
        assert_eq!(parse(b"", Decimal::Point), Err(NumberFault::Blank));
        assert_eq!(parse(b"--", Decimal::Point), Err(NumberFault::Text));
        assert_eq!(parse(&[b'1'; 70], Decimal::Comma), Err(NumberFault::Text));
    }
}
