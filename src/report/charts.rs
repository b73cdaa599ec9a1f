//! Charts of a fit and of a search: how a positive number fell, and the singular values of what was determined.

use super::language::{Locale, say};
use super::svg::{Area, Scale, Svg, baseline, name_x, name_y};

/// One line of a chart.
pub(super) struct Line {
    /// Class of its colour; with a further word, of its style.
    pub colour: String,
    pub points: Vec<[f64; 2]>,
}

const WIDTH: f64 = 420.0;
/// Points of one line: more would not be seen.
const DRAWN: usize = 300;

/// Positive values over a count (iterations, generations).
pub(super) fn course(
    locale: &Locale,
    lines: &[Line],
    x_name: &str,
    y_name: &str,
    title: &str,
) -> String {
    let area = Area::new([52.0, 26.0, WIDTH - 14.0, 220.0]);
    let all = || lines.iter().flat_map(|line| &line.points);
    let last = all().map(|p| p[0]).fold(1.0, f64::max);
    let upper = all().map(|p| p[1]).fold(0.0, f64::max);
    let lower = all().map(|p| p[1]).fold(upper, f64::min);
    let x = Scale::linear(0.0, last).over(area.left, area.right);
    let y = Scale::positive(lower, upper).over(area.bottom, area.top);
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    x.grid_x(&mut svg, area, 6);
    y.grid_y(&mut svg, area, 6);
    for line in lines {
        let every = line.points.len().div_ceil(DRAWN).max(1);
        let end = line.points.len().saturating_sub(1);
        let drawn = line
            .points
            .iter()
            .enumerate()
            .filter(|(i, _)| i % every == 0 || *i == end);
        let points: Vec<[f64; 2]> = drawn.map(|(_, p)| [x.at(p[0]), y.at(p[1])]).collect();
        svg.path(&format!("curve {}", line.colour), &points);
        if points.len() <= 40 {
            points
                .iter()
                .for_each(|point| svg.circle(&format!("mark {}", line.colour), *point, 2.2));
        }
    }
    baseline(&mut svg, area);
    name_x(&mut svg, area, x_name);
    name_y(&mut svg, area, y_name);
    svg.finish(title)
}

/// Singular values as (number, value), on a logarithmic axis.
pub(super) fn spectrum(locale: &Locale, values: &[(i64, f64)], title: &str) -> String {
    let area = Area::new([52.0, 26.0, WIDTH - 14.0, 220.0]);
    let upper = values.iter().map(|v| v.1).fold(0.0, f64::max);
    let lower = values
        .iter()
        .map(|v| v.1)
        .filter(|v| *v > 0.0)
        .fold(upper, f64::min);
    let count = values.iter().map(|v| v.0).max().unwrap_or(1).max(1);
    let x = Scale::linear(0.5, count as f64 + 0.5).over(area.left, area.right);
    // Below 1e-16 of the largest there is only rounding.
    let y = Scale::log(lower.max(upper * 1e-16), upper).over(area.bottom, area.top);
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    y.grid_y(&mut svg, area, 6);
    for tick in x
        .ticks(8)
        .into_iter()
        .filter(|tick| tick.fract() == 0.0 && *tick >= 1.0)
    {
        svg.text(
            "tick mid",
            [x.at(tick), area.bottom + 14.0],
            &format!("{tick:.0}"),
        );
    }
    for (number, value) in values {
        let top = [x.at(*number as f64), y.at(*value)];
        svg.line("stem seen", [top[0], area.bottom], top);
        svg.circle("mark seen", top, 2.4);
    }
    baseline(&mut svg, area);
    name_x(
        &mut svg,
        area,
        &say!(locale, "number of the singular value"),
    );
    name_y(&mut svg, area, &say!(locale, "singular value"));
    svg.finish(title)
}
