//! A second reader of programs, written apart from calib's: text is cut by separators, nothing is tokenized.
//!
//! It knows the forms that `random` writes; of what it cannot read it says `None`.

use super::TargetKind;

pub type Targets = Vec<(TargetKind, Vec<f64>)>;

/// Bytes as characters, with what is behind the comment sign taken out, and texts blanked.
fn bare(line: &[u8], comment: u8) -> String {
    let mut text = String::new();
    let mut quote = None;
    for byte in line {
        match (quote, *byte) {
            (Some(open), byte) => {
                if byte == open {
                    quote = None;
                }
                text.push('\u{1}');
            }
            (None, byte) if byte == comment => break,
            (None, byte) if byte == b'"' || (byte == b'\'' && comment == b';') => {
                quote = Some(byte);
                text.push('\u{1}');
            }
            (None, byte) => text.push(char::from(byte).to_ascii_uppercase()),
        }
    }
    text
}

fn blank(c: char) -> bool {
    matches!(c, ' ' | '\t' | '\r' | '\n')
}

/// One number with its sign: sign, digits, fraction, power of ten, each by itself.
fn number(text: &str, rapid: bool) -> Option<f64> {
    let text = text.trim_matches(blank);
    let (sign, text) = match text.chars().next()? {
        '-' => (-1.0, text[1..].trim_start_matches(blank)),
        '+' => (1.0, text[1..].trim_start_matches(blank)),
        _ => (1.0, text),
    };
    let (mantissa, power) = match text.split_once('E') {
        Some((mantissa, power)) => (mantissa, Some(power)),
        None => (text, None),
    };
    let digits = |text: &str| text.chars().all(|c| c.is_ascii_digit());
    let (whole, part) = match mantissa.split_once('.') {
        Some((whole, part)) => (whole, Some(part)),
        None => (mantissa, None),
    };
    let filled = match part {
        _ if !rapid => !whole.is_empty() && part != Some(""),
        Some(part) => !(whole.is_empty() && part.is_empty()),
        None => !whole.is_empty(),
    };
    if !(filled && digits(whole) && digits(part.unwrap_or_default())) {
        return None;
    }
    if let Some(power) = power {
        let plain = power.strip_prefix(['+', '-']).unwrap_or(power);
        if plain.is_empty() || !digits(plain) {
            return None;
        }
    }
    let text = format!(
        "{}.{}e{}",
        if whole.is_empty() { "0" } else { whole },
        part.filter(|p| !p.is_empty()).unwrap_or("0"),
        power.unwrap_or("0")
    );
    text.parse::<f64>().ok().map(|value| sign * value)
}

fn words(text: &str) -> Vec<&str> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '$' || c as u32 >= 0x80))
        .filter(|word| !word.is_empty())
        .collect()
}

pub fn krl(program: &[u8]) -> Option<Targets> {
    const TYPES: [&str; 4] = ["E6AXIS", "AXIS", "E6POS", "POS"];
    let mut out = Vec::new();
    let mut code = false;
    for line in program.split(|byte| *byte == b'\n') {
        if line.starts_with(b"&") && !code {
            continue;
        }
        let text = bare(line, b';');
        let all = words(&text);
        code |= !text.trim_matches(blank).is_empty();
        let first = all.first().copied().unwrap_or_default();
        let motion = ["PTP", "LIN", "CIRC", "SPTP", "SLIN"].contains(&first);
        let settings = text.find("WITH").filter(|_| motion).unwrap_or(text.len());
        for group in text[..settings].split('{').skip(1) {
            let inner = group.split('}').next()?;
            let (prefix, inner) = inner
                .split_once(':')
                .map_or((None, inner), |(prefix, tail)| {
                    (Some(prefix.trim_matches(blank)), tail)
                });
            let wanted = match prefix {
                Some(prefix) => TYPES.contains(&prefix),
                None if first == "DECL" => all.get(1).is_some_and(|kind| TYPES.contains(kind)),
                None => motion,
            };
            if wanted {
                out.push(fields(inner)?);
            }
        }
    }
    Some(out)
}

fn fields(inner: &str) -> Option<(TargetKind, Vec<f64>)> {
    let mut given: Vec<(String, &str)> = Vec::new();
    for field in inner.split(',') {
        let field = field.trim_matches(blank);
        let name: String = field
            .chars()
            .take_while(char::is_ascii_alphanumeric)
            .collect();
        let tail = &field[name.len()..];
        if given.iter().any(|(known, _)| *known == name) {
            return None;
        }
        given.push((name, tail));
    }
    let take = |names: [&str; 6]| -> Option<Vec<f64>> {
        names
            .iter()
            .map(|name| number(given.iter().find(|(known, _)| known == name)?.1, false))
            .collect()
    };
    take(["A1", "A2", "A3", "A4", "A5", "A6"])
        .map(|values| (TargetKind::Joints, values))
        .or_else(|| take(["X", "Y", "Z", "A", "B", "C"]).map(|values| (TargetKind::Frame, values)))
}

/// A bracket list, or the text between commas.
#[derive(Debug)]
enum Piece {
    List(Vec<Piece>),
    Text(String),
}

fn piece(text: &mut std::iter::Peekable<std::str::Chars>) -> Option<Piece> {
    while text.peek().is_some_and(|c| blank(*c)) {
        text.next();
    }
    if text.peek() != Some(&'[') {
        let mut leaf = String::new();
        while text.peek().is_some_and(|c| !matches!(c, ',' | ']')) {
            leaf.push(text.next()?);
        }
        return Some(Piece::Text(leaf));
    }
    text.next();
    let mut items = Vec::new();
    loop {
        items.push(piece(text)?);
        while text.peek().is_some_and(|c| blank(*c)) {
            text.next();
        }
        match text.next()? {
            ',' => {}
            ']' => return Some(Piece::List(items)),
            _ => return None,
        }
    }
}

fn collect(piece: &Piece, pose: bool, out: &mut Targets) -> Option<()> {
    let Piece::List(items) = piece else {
        return None;
    };
    let deep = |piece: &Piece| matches!(piece, Piece::List(items) if items.iter().any(|item| matches!(item, Piece::List(_))));
    if items.iter().any(deep) {
        return items.iter().try_for_each(|item| collect(item, pose, out));
    }
    let sizes: &[usize] = if pose { &[3, 4, 4, 6] } else { &[6, 6] };
    let mut values = Vec::new();
    if items.len() != sizes.len() {
        return None;
    }
    for (item, size) in items.iter().zip(sizes) {
        let Piece::List(leaves) = item else {
            return None;
        };
        if leaves.len() != *size {
            return None;
        }
        for leaf in leaves {
            let Piece::Text(text) = leaf else { return None };
            values.push(number(text, true)?);
        }
    }
    values.truncate(if pose { 7 } else { 6 });
    out.push((
        if pose {
            TargetKind::Quaternion
        } else {
            TargetKind::Joints
        },
        values,
    ));
    Some(())
}

pub fn rapid(program: &[u8]) -> Option<Targets> {
    let lines: Vec<String> = program
        .split(|byte| *byte == b'\n')
        .map(|line| bare(line, b'!'))
        .collect();
    let text = lines.join("\n");
    let mut out = Vec::new();
    for statement in text.split(';') {
        let Some(open) = statement.find('[') else {
            continue;
        };
        let all = words(&statement[..open]);
        let storage = all
            .iter()
            .rposition(|word| ["CONST", "PERS", "VAR"].contains(word));
        let kind = storage.and_then(|k| all.get(k + 1)).copied();
        let motion = all
            .iter()
            .find(|word| word.starts_with("MOVE"))
            .filter(|_| kind.is_none())
            .copied();
        let pose = match (kind, motion) {
            (Some("ROBTARGET"), _) => true,
            (Some("JOINTTARGET"), _) => false,
            (None, Some(motion)) => !motion.contains("ABSJ"),
            _ => continue,
        };
        let count = if motion.is_some_and(|motion| motion.starts_with("MOVEC")) {
            2
        } else {
            1
        };
        let mut others = statement[open..].chars().peekable();
        for position in 0..count {
            // The second position of a circle may be a variable.
            if position > 0 && others.peek() != Some(&'[') {
                break;
            }
            collect(&piece(&mut others)?, pose, &mut out)?;
            // To the next position.
            while others.next_if(|c| blank(*c) || *c == ',').is_some() {}
        }
    }
    Some(out)
}
