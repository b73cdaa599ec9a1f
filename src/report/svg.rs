//! A minimal SVG writer: elements with a class, coordinates to a tenth of a unit, text escaped. Colours are the style sheet's.

use std::fmt::Write as _;

pub(super) type SvgPoint = [f64; 2];

/// A picture under construction, in user units (about a CSS pixel on a wide screen).
pub(super) struct Svg {
    width: f64,
    height: f64,
    body: String,
}

impl Svg {
    pub fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            body: String::new(),
        }
    }
    pub fn line(&mut self, class: &str, from: SvgPoint, to: SvgPoint) {
        self.path(class, &[from, to]);
    }
    /// An open line through the points.
    pub fn path(&mut self, class: &str, points: &[SvgPoint]) {
        let _ = write!(self.body, "<path class=\"{class}\" d=\"");
        for (i, point) in points.iter().enumerate() {
            let _ = write!(
                self.body,
                "{}{} {}",
                if i == 0 { 'M' } else { 'L' },
                tenth(point[0]),
                tenth(point[1])
            );
        }
        self.body.push_str("\"/>\n");
    }
    pub fn rect(&mut self, class: &str, corner: SvgPoint, size: SvgPoint) {
        let _ = writeln!(
            self.body,
            "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
            tenth(corner[0]),
            tenth(corner[1]),
            tenth(size[0]),
            tenth(size[1])
        );
    }
    pub fn circle(&mut self, class: &str, centre: SvgPoint, radius: f64) {
        let _ = writeln!(
            self.body,
            "<circle class=\"{class}\" cx=\"{}\" cy=\"{}\" r=\"{}\"/>",
            tenth(centre[0]),
            tenth(centre[1]),
            tenth(radius)
        );
    }
    /// Text at its baseline; the class says how it is anchored.
    pub fn text(&mut self, class: &str, at: SvgPoint, text: &str) {
        self.words(class, "", at, text);
    }
    /// A name that somebody gave, which no language changes.
    pub fn name(&mut self, class: &str, at: SvgPoint, text: &str) {
        self.words(class, " translate=\"no\"", at, text);
    }
    fn words(&mut self, class: &str, more: &str, at: SvgPoint, text: &str) {
        let [x, y] = at.map(tenth);
        let _ = writeln!(
            self.body,
            "<text class=\"{class}\"{more} x=\"{x}\" y=\"{y}\">{}</text>",
            escape(text)
        );
    }
    /// The `svg` element; `title` is what a screen reader says.
    pub fn finish(self, title: &str) -> String {
        format!(
            "<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\">\n<title>{}</title>\n{}</svg>",
            tenth(self.width),
            tenth(self.height),
            escape(title),
            self.body
        )
    }
}

fn tenth(value: f64) -> String {
    let text = format!("{value:.1}");
    match text.strip_suffix(".0").unwrap_or(&text) {
        "-0" => "0".into(),
        short => short.into(),
    }
}

/// Text as XML; control characters, which XML cannot hold at all, are replaced.
fn escape(text: &str) -> String {
    let held = text.chars().map(|c| match c {
        '\t' | '\n' => ' ',
        c if c.is_control() || c == '\u{fffe}' || c == '\u{ffff}' => '\u{fffd}',
        c => c,
    });
    quick_xml::escape::escape(held.collect::<String>()).into_owned()
}
