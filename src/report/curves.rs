//! Curves of recordings of any length: lines over time, dots of errors over another quantity. Rows are thinned to what a screen can show, so
//! that the picture of a million rows is as small as that of a thousand.

use super::language::{Locale, say};
use super::svg::{Area, Scale, Svg, SvgPoint, baseline, name_x, name_y};

/// As wide as the style sheet shows a chart, so that its words have their size.
pub(super) const WIDTH: f64 = 540.0;
/// Columns of a picture over time. Of each the least and the largest value of a line are drawn: a screen shows no more of a line through all
/// rows, and no peak is lost, as it would be if every so many rows were taken.
const COLUMNS: f64 = 300.0;
/// Steps of the clock without rows that break a line.
const GAP: f64 = 8.0;
/// Dots of one colour: more would lie on each other.
const DOTS: usize = 1_500;

/// The clock of a recording, on which each row has its place in a picture.
struct Clock {
    /// s; where a trajectory begins its clock anew, it goes on behind the one before.
    along: Vec<f64>,
    /// The step between most rows, s.
    step: f64,
    begins_anew: bool,
}

impl Clock {
    fn of(time: &[f64]) -> Self {
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.retain(|step| *step > 0.0);
        steps.sort_by(f64::total_cmp);
        let step = steps.get(steps.len() / 2).copied().unwrap_or(1.0);
        let (mut along, mut shift): (Vec<f64>, f64) = (Vec::new(), 0.0);
        let mut before = time.first().copied().unwrap_or_default();
        for now in time {
            if *now < before {
                // Wide enough to break the lines.
                shift += before - now + 2.0 * GAP * step;
            }
            along.push(now + shift);
            before = *now;
        }
        Self {
            along,
            step,
            begins_anew: shift > 0.0,
        }
    }
}

/// Lines over time, of rows with whether they are held out, which is shaded; the title, and what is over time.
pub(super) fn over_time(
    locale: &Locale,
    (time, held_out): (&[f64], &[bool]),
    lines: &[(&str, &[f64])],
    [title, what]: [&str; 2],
) -> String {
    let area = Area::new([52.0, 26.0, WIDTH - 14.0, 200.0]);
    let clock = Clock::of(time);
    let ends = [clock.along.first(), clock.along.last()];
    let [first, last] = ends.map(|end| end.copied().unwrap_or_default());
    let x = Scale::linear(first, last).over(area.left, area.right);
    let values = lines.iter().flat_map(|(_, values)| values.iter().copied());
    let y = around_zero(values).over(area.bottom, area.top);
    let column = |row: usize| {
        ((x.at(clock.along[row]) - area.left) / (area.right - area.left) * COLUMNS) as usize
    };
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    for [from, to] in shaded(held_out, &column) {
        let wide = (area.right - area.left) / COLUMNS;
        let left = area.left + wide * from as f64;
        svg.rect(
            "held",
            [left, area.top],
            [wide * (to - from + 1) as f64, area.bottom - area.top],
        );
    }
    x.grid_x(&mut svg, area, 7);
    y.grid_y(&mut svg, area, 5);
    for (colour, values) in lines {
        let strokes: Vec<Vec<SvgPoint>> = thinned(&clock, values, &column)
            .iter()
            .map(|rows| {
                let point = |row: &usize| [x.at(clock.along[*row]), y.at(values[*row])];
                rows.iter().map(point).collect()
            })
            .collect();
        svg.strokes(&format!("curve {colour}"), &strokes);
    }
    baseline(&mut svg, area);
    let named = match clock.begins_anew {
        true => say!(locale, "time, s; trajectories one after the other"),
        false => say!(locale, "time, s"),
    };
    name_x(&mut svg, area, &named);
    name_y(&mut svg, area, what);
    svg.finish(title)
}

/// From the least to the largest of the values and zero.
fn around_zero(values: impl Iterator<Item = f64>) -> Scale {
    let [low, high] = values.fold([0.0, 0.0], |[low, high]: [f64; 2], value| {
        [low.min(value), high.max(value)]
    });
    Scale::linear(low, high)
}

/// Columns of rows that are held out, from the first to the last of each stretch.
fn shaded(held_out: &[bool], column: &impl Fn(usize) -> usize) -> Vec<[usize; 2]> {
    let mut stretches: Vec<[usize; 2]> = Vec::new();
    for row in (0..held_out.len()).filter(|row| held_out[*row]) {
        let at = column(row);
        match stretches.last_mut() {
            Some(last) if at <= last[1] + 1 => last[1] = last[1].max(at),
            _ => stretches.push([at, at]),
        }
    }
    stretches
}

/// Rows of the strokes of a line: of each column those of the least and of the largest value, in their order. A gap that is narrower than a
/// column breaks nothing that could be seen.
fn thinned(clock: &Clock, values: &[f64], column: &impl Fn(usize) -> usize) -> Vec<Vec<usize>> {
    let mut strokes = vec![Vec::new()];
    let mut begin = 0;
    while begin < values.len() {
        let at = column(begin);
        let end = (begin..values.len())
            .find(|row| column(*row) != at)
            .unwrap_or(values.len());
        let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
        let rows = || begin..end;
        let mut kept: Vec<usize> = [rows().min_by(by_value), rows().max_by(by_value)]
            .into_iter()
            .flatten()
            .collect();
        kept.sort_unstable();
        kept.dedup();
        let breaks = begin > 0 && clock.along[begin] - clock.along[begin - 1] > GAP * clock.step;
        if breaks {
            strokes.push(Vec::new());
        }
        if let Some(stroke) = strokes.last_mut() {
            stroke.extend(kept);
        }
        begin = end;
    }
    strokes
}

/// Dots of errors over a quantity of their rows; the title, and the names of both axes.
pub(super) fn over_quantity(
    locale: &Locale,
    quantity: &[f64],
    errors: &[(&str, &[f64])],
    [title, across, what]: [&str; 3],
) -> String {
    let area = Area::new([52.0, 26.0, WIDTH - 14.0, 200.0]);
    let every = quantity.len().div_ceil(DOTS).max(1);
    let rows = || (0..quantity.len()).step_by(every);
    let x = around_zero(rows().map(|row| quantity[row])).over(area.left, area.right);
    let shown = errors
        .iter()
        .flat_map(|(_, values)| rows().map(|row| values[row]));
    let y = around_zero(shown).over(area.bottom, area.top);
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    x.grid_x(&mut svg, area, 7);
    y.grid_y(&mut svg, area, 5);
    for (colour, values) in errors {
        let dots: Vec<SvgPoint> = rows()
            .map(|row| [x.at(quantity[row]), y.at(values[row])])
            .collect();
        svg.dots(&format!("dots fitted {colour}"), 2.6, &dots);
    }
    baseline(&mut svg, area);
    name_x(&mut svg, area, across);
    name_y(&mut svg, area, what);
    svg.finish(title)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_rows_make_a_picture_of_some_kilobytes_that_keeps_their_peak() {
        let time: Vec<f64> = (0..1_000_000).map(|row| 1e-3 * f64::from(row)).collect();
        let mut values: Vec<f64> = time.iter().map(|t| t.sin()).collect();
        values[777_777] = 9.0;
        let held_out: Vec<bool> = time.iter().map(|t| (300.0..400.0).contains(t)).collect();
        let locale = Locale::default();
        let lines = [("s0", values.as_slice())];
        let page = over_time(&locale, (&time, &held_out), &lines, ["a", "b"]);
        assert!(page.len() < 20_000, "{} bytes", page.len());
        assert_eq!(page.matches("class=\"held\"").count(), 1);
        // The largest value is at the upper edge.
        assert!(page.contains(" 26"), "{page}");
        let errors = [("s1", values.as_slice())];
        let dots = over_quantity(&locale, &time, &errors, ["a", "b", "c"]);
        assert!(dots.len() < 40_000, "{} bytes", dots.len());
    }

    #[test]
    fn trajectories_whose_clocks_begin_anew_lie_one_behind_the_other_and_gaps_break_lines() {
        let clock = Clock::of(&[0.0, 1.0, 2.0, 0.0, 1.0, 40.0]);
        assert!(clock.begins_anew);
        assert!(clock.along.windows(2).all(|pair| pair[0] < pair[1]));
        let strokes = thinned(&clock, &[0.0; 6], &|row| row);
        assert_eq!(strokes, [vec![0, 1, 2], vec![3, 4], vec![5]]);
    }
}
