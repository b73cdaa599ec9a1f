//! How the error is distributed after each step: histograms above each other on one axis, and cumulative curves.

use super::axis::{Area, Scale, baseline, name_x, name_y};
use super::number::mm;
use super::svg::Svg;

/// The errors of one set of points after one step.
pub(super) struct StepErrors {
    pub step: String,
    /// Class of its colour, the same in all pictures.
    pub colour: String,
    /// Ascending, mm; not empty.
    pub sorted_mm: Vec<f64>,
    /// From the statistics.
    pub mean_mm: f64,
}

const WIDTH: f64 = 420.0;
const TOP: f64 = 12.0;
/// Height of one histogram.
const ROW: f64 = 62.0;
/// Width of a bold letter, roughly: enough to keep labels apart.
const GLYPH: f64 = 6.6;
const BINS: usize = 36;
/// Points of a cumulative curve: more would not be seen.
const CURVE: usize = 240;

/// One axis for all steps, or the pictures could not be compared.
fn scale(all: &[StepErrors]) -> Scale {
    let upper = all
        .iter()
        .filter_map(|e| e.sorted_mm.last())
        .fold(0.0, |a: f64, b| a.max(*b));
    // The smallest single error is luck: the axis starts where the fifth percentile of the best step is.
    let lower = all
        .iter()
        .filter_map(|e| e.sorted_mm.get(e.sorted_mm.len() / 20))
        .fold(upper, |a: f64, b| a.min(*b));
    Scale::positive(lower, upper)
}

/// Points per equal bin (equal on the axis as drawn), a row per step, one height scale for all.
pub(super) fn histogram(all: &[StepErrors], title: &str) -> String {
    let area = Area::new([16.0, TOP, WIDTH - 12.0, TOP + ROW * all.len() as f64]);
    let scale = scale(all).over(area.left, area.right);
    let counts: Vec<[usize; BINS]> = all
        .iter()
        .map(|errors| bins(&errors.sorted_mm, scale, area))
        .collect();
    let highest = counts.iter().flatten().copied().max().unwrap_or(1).max(1) as f64;
    let mut svg = Svg::new(WIDTH, area.bottom + 38.0);
    scale.grid_x(&mut svg, area, 7);
    for (i, (errors, counts)) in all.iter().zip(&counts).enumerate() {
        let foot = area.top + ROW * (i + 1) as f64;
        let width = (area.right - area.left) / BINS as f64;
        for (k, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let height = (*count as f64 / highest * (ROW - 24.0)).max(0.8);
            svg.rect(
                &format!("fill {}", errors.colour),
                [area.left + width * k as f64 + 0.4, foot - height],
                [width - 0.8, height],
            );
        }
        baseline(
            &mut svg,
            Area {
                bottom: foot,
                ..area
            },
        );
        let mean = scale.at(errors.mean_mm);
        svg.line("mean", [mean, foot - ROW + 22.0], [mean, foot]);
        svg.name("name", [area.left, foot - ROW + 18.0], &errors.step);
        // Clear of the name on the left, and of the edge on the right.
        let clear = area.left + GLYPH * errors.step.chars().count() as f64 + 8.0;
        let (class, x) = if mean > (area.left + area.right) / 2.0 {
            ("value end", mean - 4.0)
        } else {
            ("value", clear.max(mean + 4.0))
        };
        svg.text(
            class,
            [x, foot - ROW + 18.0],
            &format!("mean {}", mm(errors.mean_mm)),
        );
    }
    name_x(&mut svg, area, "position error, mm");
    svg.finish(title)
}

fn bins(errors: &[f64], scale: Scale, area: Area) -> [usize; BINS] {
    let mut counts = [0; BINS];
    for error in errors {
        let share = (scale.at(*error) - area.left) / (area.right - area.left);
        counts[((share * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    counts
}

/// Share of the points whose error is at most so large, a curve per step.
pub(super) fn cumulative(all: &[StepErrors], title: &str) -> String {
    let area = Area::new([
        44.0,
        26.0,
        WIDTH - 12.0,
        (TOP + ROW * all.len() as f64).clamp(190.0, 330.0),
    ]);
    let scale = scale(all).over(area.left, area.right);
    let share = Scale::linear(0.0, 100.0).over(area.bottom, area.top);
    let mut svg = Svg::new(WIDTH, area.bottom + 38.0);
    scale.grid_x(&mut svg, area, 7);
    share.grid_y(&mut svg, area, 5);
    let p95 = share.at(95.0);
    svg.line("limit", [area.left, p95], [area.right, p95]);
    svg.text("tick end", [area.left - 6.0, p95 + 7.0], "95");
    for (i, errors) in all.iter().enumerate() {
        let count = errors.sorted_mm.len();
        let every = count.div_ceil(CURVE).max(1);
        let mut line = vec![[scale.at(errors.sorted_mm[0]), share.at(0.0)]];
        for (k, error) in errors
            .sorted_mm
            .iter()
            .enumerate()
            .filter(|(k, _)| k % every == every - 1 || k + 1 == count)
        {
            line.push([
                scale.at(*error),
                share.at(100.0 * (k + 1) as f64 / count as f64),
            ]);
        }
        line.push([area.right, share.at(100.0)]);
        svg.path(
            &format!(
                "curve {}{}",
                errors.colour,
                if i + 1 == all.len() { " last" } else { "" }
            ),
            &line,
        );
    }
    baseline(&mut svg, area);
    name_x(&mut svg, area, "position error, mm");
    name_y(&mut svg, area, "% of the points at or below");
    svg.finish(title)
}
