//! Tokens of all languages: words, numbers, strings and signs, each with its bytes; comments and blanks are none.
//!
//! A number is one token, everything that clings to it included (`10mm`, `0x1F`, `1.2.3`), so that what is no number by the
//! language's grammar is seen whole:
//! KRL: digits [`.` digits] [`E` [sign] digits] (KUKA System Software, Operating and Programming Instructions for System Integrators);
//! RAPID: the same, and `1.` and `.5` (ABB, Technical reference manual RAPID kernel, "Numeric literals"; its hexadecimal, octal and
//! binary integers are no coordinates), as FANUC's listings and URScript. Blanks may stand nowhere in a number, but between it and its sign, which is an operator.

use super::{DEPTH, Gathered, Language};
use std::ops::Range;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TokenKind {
    Word,
    /// Whether it is a number of the language.
    Number(bool),
    /// `"..."`, or `'...'` of KRL and FANUC.
    Text,
    /// A sign, of one byte.
    Sign(u8),
    /// `:=`, `==`, `<=`, `>=`, `<>`, by their first byte.
    Pair(u8),
    /// The end of a line of KRL and URScript, whose statements end with their line.
    LineEnd,
}

/// A token, with the bytes of the program that it stands in.
#[derive(Clone, Copy)]
pub(super) struct Token<'p> {
    pub(super) sort: TokenKind,
    pub(super) start: usize,
    pub(super) end: usize,
    bytes: &'p [u8],
}

impl<'p> Token<'p> {
    pub(super) fn is(&self, sign: u8) -> bool {
        self.sort == TokenKind::Sign(sign)
    }

    /// `:=`.
    pub(super) fn assigns(&self) -> bool {
        self.sort == TokenKind::Pair(b':')
    }

    /// A word that is one of these, in any case.
    pub(super) fn is_word(&self, words: &str) -> bool {
        let is = |word: &str| word.as_bytes().eq_ignore_ascii_case(self.text());
        self.sort == TokenKind::Word && words.split(' ').any(is)
    }

    /// +1 where a bracket opens, -1 where it closes.
    pub(super) fn opens(&self) -> i32 {
        match self.sort {
            TokenKind::Sign(b'{' | b'[' | b'(') => 1,
            TokenKind::Sign(b'}' | b']' | b')') => -1,
            _ => 0,
        }
    }

    pub(super) fn span(&self) -> Range<usize> {
        self.start..self.end
    }

    pub(super) fn text(&self) -> &'p [u8] {
        &self.bytes[self.span()]
    }

    /// As it is written.
    pub(super) fn name(&self) -> String {
        String::from_utf8_lossy(self.text()).into_owned()
    }

    /// In capitals.
    pub(super) fn upper(&self) -> String {
        self.name().to_ascii_uppercase()
    }

    /// For a message.
    pub(super) fn quoted(&self) -> String {
        quoted(&[*self])
    }
}

/// Brackets that open and close.
pub(super) const BRACKETS: [(u8, u8); 3] = [(b'[', b']'), (b'(', b')'), (b'{', b'}')];

/// The place of the bracket that closes the one at `open`.
pub(super) fn closing(tokens: &[Token], open: usize) -> usize {
    let pair = BRACKETS
        .into_iter()
        .find(|(opens, _)| tokens[open].is(*opens));
    let mut depth = 0;
    let closes = |token: &Token| {
        depth += pair.map_or(0, |(opens, closes)| {
            i32::from(token.is(opens)) - i32::from(token.is(closes))
        });
        depth == 0
    };
    let place = tokens[open..].iter().position(closes);
    place.map_or(tokens.len() - 1, |length| open + length)
}

/// Where these open from `from` on with the sign, and where they close, one behind the other.
pub(super) fn enclosed<'t>(
    tokens: &'t [Token],
    from: usize,
    sign: u8,
) -> impl Iterator<Item = (usize, usize)> + 't {
    let mut at = from;
    std::iter::from_fn(move || {
        let open = at + tokens.get(at..)?.iter().position(|token| token.is(sign))?;
        let close = closing(tokens, open);
        at = close + 1;
        Some((open, close))
    })
}

/// What stands between commas that are outside of brackets.
pub(super) fn arguments<'t, 'p>(tokens: &'t [Token<'p>]) -> impl Iterator<Item = &'t [Token<'p>]> {
    let mut depth = 0;
    tokens.split(move |token| {
        depth += token.opens();
        depth == 0 && token.is(b',')
    })
}

/// The words among some tokens.
pub(super) fn words<'t, 'p>(tokens: &'t [Token<'p>]) -> impl Iterator<Item = &'t Token<'p>> {
    let is_word = |token: &&Token| token.sort == TokenKind::Word;
    tokens.iter().filter(is_word)
}

/// Lines with something on them.
pub(super) fn lines<'t, 'p>(tokens: &'t [Token<'p>]) -> Vec<&'t [Token<'p>]> {
    let lines = tokens.split(|token| token.sort == TokenKind::LineEnd);
    lines.filter(|line| !line.is_empty()).collect()
}

/// Whether every bracket of these closes, none of them too deep; what does not is a fault. They stand in `whole`, e.g. `on its line`.
pub(super) fn brackets_match(
    tokens: &[Token],
    brackets: &[(u8, u8)],
    whole: &str,
    found: &mut Gathered,
) -> bool {
    let mut open: Vec<(&Token, u8, u8)> = Vec::new();
    let before = found.faults.len();
    for token in tokens {
        if let Some((opens, closes)) = brackets.iter().find(|(opens, _)| token.is(*opens)) {
            open.push((token, *opens, *closes));
            if open.len() == DEPTH {
                found.fault(token.start, "brackets are nested too deep");
            }
        } else if let Some((opens, closes)) = brackets.iter().find(|(_, end)| token.is(*end))
            && open.pop().is_none_or(|(_, last, _)| last != *opens)
        {
            let [opens, closes] = [*opens, *closes].map(char::from);
            found.fault(token.start, format!("`{closes}` without `{opens}`"));
        }
    }
    for (token, opens, closes) in open {
        let [opens, closes] = [opens, closes].map(char::from);
        let message = format!("`{opens}` without `{closes}` {whole}");
        found.fault(token.start, message);
    }
    found.faults.len() == before
}

/// The number that these tokens are, sign included, and its bytes; none where they are anything else.
pub(super) fn number(tokens: &[Token]) -> Option<(f64, Range<usize>)> {
    let (negative, token) = match tokens {
        [token] => (false, token),
        [sign, token] if sign.is(b'-') => (true, token),
        [sign, token] if sign.is(b'+') => (false, token),
        _ => return None,
    };
    if token.sort != TokenKind::Number(true) {
        return None;
    }
    let value: f64 = std::str::from_utf8(token.text()).ok()?.parse().ok()?;
    let signed = if negative { -value } else { value };
    value
        .is_finite()
        .then_some((signed, tokens[0].start..token.end))
}

/// The bytes from the first to the last of some tokens; where there are none, at `otherwise`.
pub(super) fn over(tokens: &[Token], otherwise: usize) -> Range<usize> {
    match (tokens.first(), tokens.last()) {
        (Some(first), Some(last)) => first.start..last.end,
        _ => otherwise..otherwise,
    }
}

/// A piece of a program for a message: on one line, and not without end.
pub(super) fn quoted(tokens: &[Token]) -> String {
    const LIMIT: usize = 40;
    let bytes = tokens.first().map_or(&[][..], |first| first.bytes);
    let text = String::from_utf8_lossy(&bytes[over(tokens, 0)]);
    let words: Vec<&str> = text.split_whitespace().collect();
    let plain = |c: char| if c.is_control() { '?' } else { c };
    let text: String = words.join(" ").chars().map(plain).collect();
    let short: String = text.chars().take(LIMIT).collect();
    if short.len() < text.len() {
        format!("`{short}..`")
    } else {
        format!("`{short}`")
    }
}

fn is_number(text: &[u8], language: Language) -> bool {
    let digits = |text: &[u8]| text.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let whole = digits(text);
    let mut remainder = &text[whole..];
    let mut fraction = None;
    if remainder.first() == Some(&b'.') {
        let count = digits(&remainder[1..]);
        (fraction, remainder) = (Some(count), &remainder[1 + count..]);
    }
    let mantissa = match (language, fraction) {
        (_, None) => whole > 0,
        (Language::Krl, Some(count)) => whole > 0 && count > 0,
        (_, Some(count)) => whole + count > 0,
    };
    if matches!(remainder.first(), Some(b'e' | b'E')) {
        remainder = &remainder[1..];
        if matches!(remainder.first(), Some(b'+' | b'-')) {
            remainder = &remainder[1..];
        }
        let count = digits(remainder);
        return mantissa && count > 0 && count == remainder.len();
    }
    mantissa && remainder.is_empty()
}

/// Letters of names; bytes beyond ASCII are such, RAPID has those of ISO 8859-1.
fn in_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'$') || byte >= 0x80
}

/// The tokens of a program; what makes their reading doubtful is a fault.
pub(super) fn tokens<'p>(
    bytes: &'p [u8],
    language: Language,
    found: &mut Gathered,
) -> Vec<Token<'p>> {
    let krl = language == Language::Krl;
    let by_line = krl || language == Language::UrScript;
    let apostrophes = krl || language == Language::Fanuc;
    let byte = |at: usize| bytes.get(at).copied();
    let mut out: Vec<Token> = Vec::with_capacity(bytes.len() / 4);
    let mut at = if bytes.starts_with(b"\xEF\xBB\xBF") {
        3
    } else {
        0
    };
    let mut line_begins = true;
    doubtful(bytes, found);
    while let Some(here) = byte(at) {
        let start = at;
        let begins = std::mem::replace(&mut line_begins, here == b'\n');
        at += 1;
        let sort = match here {
            b'\n' if by_line => TokenKind::LineEnd,
            b' ' | b'\t' | b'\r' | b'\n' => continue,
            // KRL: `&ACCESS`, `&PARAM` and the like at the head of a file, no statements.
            b'&' if krl && begins && out.iter().all(|token| token.sort == TokenKind::LineEnd) => {
                at = line_end(bytes, at);
                continue;
            }
            // A listing of FANUC's has its remarks elsewhere.
            here if language != Language::Fanuc
                && [here] == *language.grammar().comment.as_bytes() =>
            {
                at = line_end(bytes, at);
                continue;
            }
            b'"' | b'\'' if here == b'"' || apostrophes => {
                let end = line_end(bytes, at);
                match bytes[at..end].iter().position(|byte| *byte == here) {
                    Some(length) => at += length + 1,
                    None => {
                        let message = format!("`{}` is not closed on its line", here as char);
                        found.fault(start, message);
                        at = end;
                    }
                }
                TokenKind::Text
            }
            b'.' | b'0'..=b'9'
                if here != b'.' || byte(at).is_some_and(|next| next.is_ascii_digit()) =>
            {
                at = number_end(bytes, start);
                TokenKind::Number(is_number(&bytes[start..at], language))
            }
            here if in_word(here) => {
                let more = bytes[at..].iter().take_while(|byte| in_word(**byte));
                at += more.count();
                TokenKind::Word
            }
            _ => match (here, byte(at)) {
                (b':' | b'=' | b'<' | b'>', Some(b'=')) if here != b':' || !krl => {
                    at += 1;
                    TokenKind::Pair(here)
                }
                (b'<', Some(b'>')) => {
                    at += 1;
                    TokenKind::Pair(here)
                }
                _ => TokenKind::Sign(here),
            },
        };
        out.push(Token {
            sort,
            start,
            end: at,
            bytes,
        });
    }
    out
}

/// Bytes that readers take differently: what one takes for the end of a line, another takes into the comment.
fn doubtful(bytes: &[u8], found: &mut Gathered) {
    for (at, byte) in bytes.iter().enumerate() {
        match byte {
            0 => found.fault(at, "a zero byte: no program text (UTF-16 is not read)"),
            b'\r' if bytes.get(at + 1) != Some(&b'\n') => {
                found.fault(at, "a carriage return without a line feed")
            }
            _ => {}
        }
        // Text of another kind is all of them.
        if found.faults.len() >= 20 {
            return;
        }
    }
}

fn line_end(bytes: &[u8], from: usize) -> usize {
    let length = bytes[from..].iter().position(|byte| *byte == b'\n');
    length.map_or(bytes.len(), |length| from + length)
}

fn number_end(bytes: &[u8], start: usize) -> usize {
    let mut at = start;
    while let Some(byte) = bytes.get(at) {
        let plain = bytes[start..at]
            .iter()
            .all(|byte| byte.is_ascii_digit() || *byte == b'.');
        if plain && matches!(byte, b'e' | b'E') && matches!(bytes.get(at + 1), Some(b'+' | b'-')) {
            at += 2;
        } else if in_word(*byte) || *byte == b'.' {
            at += 1;
        } else {
            break;
        }
    }
    at
}
