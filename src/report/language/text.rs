//! The texts of a page: runs between its elements, `code` within a sentence included.

/// Elements whose text is no sentence.
const SILENT: [&str; 2] = ["style", "script"];
/// What pages write instead of letters; what a page cannot do without (`&lt;`, `&amp;`) stays.
const LETTERS: [(&str, &str); 8] = [
    ("&#x27;", "'"),
    ("&#x2f;", "/"),
    ("&quot;", "\""),
    ("&middot;", "\u{b7}"),
    ("&sigma;", "\u{3c3}"),
    ("&plusmn;", "\u{b1}"),
    ("&times;", "\u{d7}"),
    ("&gt;", ">"),
];

/// The page with every text replaced by what `translate` makes of it; a text of which it makes nothing stays.
pub(super) fn each(page: &str, mut translate: impl FnMut(&str) -> Option<String>) -> String {
    let mut out = String::with_capacity(page.len() + page.len() / 8);
    let mut text = String::new();
    // Name of the element that is passed over, and how many of that name are open.
    let mut silent: Option<(&str, usize)> = None;
    let mut rest = page;
    while !rest.is_empty() {
        let Some(own) = rest.strip_prefix('<') else {
            let (plain, after) = rest.split_at(rest.find('<').unwrap_or(rest.len()));
            if silent.is_some() {
                out.push_str(plain)
            } else {
                text.push_str(plain)
            }
            rest = after;
            continue;
        };
        let (tag, after) = rest.split_at(rest.find('>').map_or(rest.len(), |at| at + 1));
        rest = after;
        let closes = own.starts_with('/');
        let name = own
            .trim_start_matches('/')
            .split(|c: char| !c.is_ascii_alphanumeric())
            .next()
            .unwrap_or_default();
        if let Some((element, open)) = silent {
            out.push_str(tag);
            let open = if name != element || tag.ends_with("/>") {
                open
            } else if closes {
                open - 1
            } else {
                open + 1
            };
            silent = (open > 0).then_some((element, open));
        } else if name == "code" {
            text.push_str(tag);
        } else {
            sentence(&mut out, &std::mem::take(&mut text), &mut translate);
            out.push_str(tag);
            let passed = SILENT.contains(&name) || tag.contains("translate=\"no\"");
            silent = (passed && !closes && !tag.ends_with("/>")).then_some((name, 1));
        }
    }
    sentence(&mut out, &text, &mut translate);
    out
}

/// One run, with the blanks around it.
fn sentence(out: &mut String, text: &str, translate: &mut impl FnMut(&str) -> Option<String>) {
    let bare = text.trim_matches([' ', '\n', '\t', '\r']);
    let speaks = outside_of_code(bare).chars().any(char::is_alphanumeric);
    let letters = |text: &str| {
        LETTERS
            .iter()
            .fold(text.to_string(), |text, (code, letter)| {
                text.replace(code, letter)
            })
    };
    let words = || letters(&bare.split_ascii_whitespace().collect::<Vec<_>>().join(" "));
    match speaks.then(|| translate(&words())).flatten() {
        Some(translated) => {
            let start = text.len() - text.trim_start_matches([' ', '\n', '\t', '\r']).len();
            out.push_str(&text[..start]);
            out.push_str(&translated);
            out.push_str(&text[start + bare.len()..]);
        }
        None => out.push_str(text),
    }
}

/// What is left of a run without its `code`.
fn outside_of_code(text: &str) -> String {
    let mut parts = text.split("<code>");
    let first = parts.next().unwrap_or_default().to_string();
    parts.fold(first, |left, part| {
        left + part.split_once("</code>").map_or("", |(_, after)| after)
    })
}

#[cfg(test)]
mod tests {
    use super::each;

    #[test]
    fn sentences_are_translated_and_names_styles_and_code_stay() {
        let page = "<style>p { a: b }</style><p>\n  one  <code>two</code> three &amp; &#x27;four&#x27;\n</p><code>five</code>\
                    <td translate=\"no\">six <td>seven</td></td><b>eight</b><text class=\"a\">nine</text>";
        let mut seen = Vec::new();
        let out = each(page, |text| {
            seen.push(text.to_string());
            (text != "eight").then(|| text.to_uppercase())
        });
        assert_eq!(
            seen,
            ["one <code>two</code> three &amp; 'four'", "eight", "nine"]
        );
        assert!(
            out.contains("<p>\n  ONE <CODE>TWO</CODE> THREE &AMP; 'FOUR'\n</p><code>five</code>"),
            "{out}"
        );
        assert!(
            out.contains("six <td>seven</td></td><b>eight</b>")
                && out.contains(">NINE<")
                && out.contains("a: b"),
            "{out}"
        );
    }
}
