//! A minimal SVG writer: elements with a class, coordinates to a tenth of a unit, text escaped. Colours are the style sheet's.

use super::language::Locale;
use super::number::fixed;
use std::fmt::Write as _;

pub(super) type SvgPoint = [f64; 2];

/// A picture under construction, in user units (about a CSS pixel on a wide screen).
pub(super) struct Svg<'a> {
    locale: &'a Locale,
    width: f64,
    height: f64,
    body: String,
}

impl<'a> Svg<'a> {
    pub fn new(locale: &'a Locale, width: f64, height: f64) -> Self {
        Self {
            locale,
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
    /// An open line with gaps as one element.
    pub fn strokes(&mut self, class: &str, strokes: &[Vec<SvgPoint>]) {
        let mut d = String::new();
        for stroke in strokes {
            for (k, [x, y]) in stroke.iter().enumerate() {
                let _ = write!(
                    d,
                    "{}{} {}",
                    if k == 0 { 'M' } else { 'L' },
                    tenth(*x),
                    tenth(*y)
                );
            }
        }
        self.many(class, "", d);
    }
    /// Many lines as one element.
    pub fn lines(&mut self, class: &str, lines: &[[SvgPoint; 2]]) {
        let each = lines.iter().map(|[from, to]| {
            let [x, y, to_x, to_y] = [from[0], from[1], to[0], to[1]].map(tenth);
            format!("M{x} {y}L{to_x} {to_y}")
        });
        self.many(class, "", each.collect());
    }
    /// Many dots as one element: thousands of circles make a page slow and its print large.
    pub fn dots(&mut self, class: &str, width: f64, centres: &[SvgPoint]) {
        let each = centres
            .iter()
            .map(|[x, y]| format!("M{} {}h0", tenth(*x), tenth(*y)));
        self.many(
            class,
            &format!(" stroke-width=\"{}\"", tenth(width)),
            each.collect(),
        );
    }
    fn many(&mut self, class: &str, more: &str, d: String) {
        if !d.is_empty() {
            let _ = writeln!(self.body, "<path class=\"{class}\"{more} d=\"{d}\"/>");
        }
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

/// Where in a picture the data go: left, top, right, bottom, in user units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Area {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Area {
    /// Left, top, right, bottom.
    pub fn new([left, top, right, bottom]: [f64; 4]) -> Self {
        Self {
            left,
            top,
            right,
            bottom,
        }
    }
}

/// Data to user units along one axis, linear or logarithmic.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    log: bool,
    lower: f64,
    upper: f64,
    from: f64,
    to: f64,
}

impl Scale {
    /// Linear over [lower, upper], widened where that is empty.
    pub fn linear(lower: f64, upper: f64) -> Self {
        let upper = if upper > lower {
            upper
        } else {
            lower + lower.abs().max(1.0)
        };
        Self {
            log: false,
            lower,
            upper,
            from: 0.0,
            to: 1.0,
        }
    }
    /// Logarithmic over the next rounder numbers around positive [lower, upper].
    pub fn log(lower: f64, upper: f64) -> Self {
        let upper = round_up(upper.max(1e-9));
        let lower = round_down(lower.max(upper * 1e-16)).min(upper * 0.5);
        Self {
            log: true,
            lower,
            upper,
            from: 0.0,
            to: 1.0,
        }
    }
    /// For positive values: logarithmic where they differ by more than a linear axis can show, else linear from zero.
    pub fn positive(lower: f64, upper: f64) -> Self {
        // Over a ratio of 12, the smaller values would share less than a tenth of a linear axis.
        if lower > 0.0 && upper / lower > 12.0 {
            Self::log(lower, upper)
        } else {
            Self::linear(0.0, upper * 1.04)
        }
    }
    /// The same scale drawn from `from` to `to`.
    pub fn over(self, from: f64, to: f64) -> Self {
        Self { from, to, ..self }
    }
    /// Where a value is drawn; what lies outside is drawn on the edge.
    pub fn at(&self, value: f64) -> f64 {
        let share = if self.log {
            (value.max(self.lower) / self.lower).ln() / (self.upper / self.lower).ln()
        } else {
            (value - self.lower) / (self.upper - self.lower)
        };
        self.from + share.clamp(0.0, 1.0) * (self.to - self.from)
    }
    /// Round values within the scale, about `wanted` of them.
    pub fn ticks(&self, wanted: usize) -> Vec<f64> {
        if !self.log {
            let step = round_up((self.upper - self.lower) / wanted.max(1) as f64);
            let first = (self.lower / step).ceil() as i64;
            let last = (self.upper / step * (1.0 + 1e-12)).floor() as i64;
            return (first..=last).map(|k| k as f64 * step).collect();
        }
        let decades = (self.upper / self.lower).log10();
        let per_decade: &[f64] = match decades / wanted.max(1) as f64 {
            density if density <= 0.36 => &[1.0, 2.0, 5.0],
            density if density <= 0.55 => &[1.0, 3.0],
            _ => &[1.0],
        };
        let every = if per_decade.len() == 1 {
            (decades / wanted.max(1) as f64).ceil() as i32
        } else {
            1
        };
        let (first, last) = (
            self.lower.log10().floor() as i32,
            self.upper.log10().ceil() as i32,
        );
        (first..=last)
            .filter(|k| k.rem_euclid(every) == 0)
            .flat_map(|k| per_decade.iter().map(move |digit| digit * 10f64.powi(k)))
            .filter(|tick| (self.lower * 0.999..=self.upper * 1.001).contains(tick))
            .collect()
    }
    pub fn grid_x(&self, svg: &mut Svg, area: Area, wanted: usize) {
        for tick in self.ticks(wanted) {
            let x = self.at(tick);
            svg.line("grid", [x, area.top], [x, area.bottom]);
            svg.text(
                "tick mid",
                [x, area.bottom + 14.0],
                &svg.locale.decimal(label(tick)),
            );
        }
    }
    pub fn grid_y(&self, svg: &mut Svg, area: Area, wanted: usize) {
        for tick in self.ticks(wanted) {
            let y = self.at(tick);
            svg.line("grid", [area.left, y], [area.right, y]);
            svg.text(
                "tick end",
                [area.left - 6.0, y + 3.5],
                &svg.locale.decimal(label(tick)),
            );
        }
    }
}

/// The name of a horizontal axis, below its ticks.
pub(super) fn name_x(svg: &mut Svg, area: Area, name: &str) {
    svg.text(
        "axis mid",
        [(area.left + area.right) / 2.0, area.bottom + 30.0],
        name,
    );
}
/// The name of a vertical axis, above its upper end: no turned text to read.
pub(super) fn name_y(svg: &mut Svg, area: Area, name: &str) {
    svg.text("axis", [4.0, area.top - 9.0], name);
}
pub(super) fn baseline(svg: &mut Svg, area: Area) {
    svg.path(
        "base",
        &[[area.left, area.bottom], [area.right, area.bottom]] as &[SvgPoint],
    );
}

/// A tick without needless zeros.
pub(super) fn label(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let power = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&power) {
        return format!("{value:.0e}");
    }
    let text = fixed(value, (2.0 - power).clamp(0.0, 6.0) as usize);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        text
    }
}

const ROUND: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

/// The next of 1, 2, 5, 10, ... at or above a positive value.
pub(super) fn round_up(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    ROUND
        .iter()
        .map(|digit| digit * decade)
        .find(|round| *round >= value * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}
/// The next of 1, 2, 5, 10, ... at or below a positive value.
pub(super) fn round_down(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    ROUND
        .iter()
        .rev()
        .map(|digit| digit * decade)
        .find(|round| *round <= value * (1.0 + 1e-9))
        .unwrap_or(decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within_the_axis() {
        assert_eq!(Scale::linear(0.0, 1.04).ticks(5), [0.0, 0.5, 1.0]);
        assert_eq!(Scale::linear(-830.0, 410.0).ticks(6), [-500.0, 0.0]);
        let ticks: Vec<String> = Scale::log(0.03, 4.2)
            .ticks(8)
            .into_iter()
            .map(label)
            .collect();
        assert_eq!(ticks, ["0.02", "0.05", "0.1", "0.2", "0.5", "1", "2", "5"]);
        assert_eq!(Scale::log(1e-9, 1e3).ticks(5).len(), 5);
    }

    #[test]
    fn an_axis_without_extent_or_with_zeros_still_draws() {
        for scale in [
            Scale::linear(2.0, 2.0),
            Scale::log(0.0, 0.0),
            Scale::positive(0.0, 0.0),
            Scale::positive(0.0, 3.0),
        ] {
            let scale = scale.over(10.0, 90.0);
            assert!((10.0..=90.0).contains(&scale.at(0.0)));
            assert!(
                scale
                    .ticks(5)
                    .iter()
                    .all(|tick| (10.0..=90.0).contains(&scale.at(*tick)))
            );
        }
    }
}
