//! Where in the workspace the error is: points from above and from the side, coloured by error, with residual vectors.

use super::language::{Locale, say};
use super::svg::{Area, Scale, Svg, baseline, label, name_x, name_y, round_down};
use crate::table::{Prediction, PredictionRow};

/// Points drawn in one picture: more would hide each other. Every so many of the recording are taken, so that no region is left out.
const DRAWN: usize = 600;
/// Colours that an eye still tells apart on paper and by night.
const CLASSES: usize = 7;

/// Two coordinates of a point, as a view of the workspace.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorkspaceView {
    pub name: &'static str,
    axes: [ViewAxis; 2],
}

type Coordinate = fn(&PredictionRow) -> f64;
/// Name, position and residual along one axis.
type ViewAxis = (&'static str, Coordinate, Coordinate);
const X: ViewAxis = ("X", |row| row.x_mm, |row| row.dx_mm);
const Y: ViewAxis = ("Y", |row| row.y_mm, |row| row.dy_mm);
const Z: ViewAxis = ("Z", |row| row.z_mm, |row| row.dz_mm);
pub(super) const VIEWS: [WorkspaceView; 2] = [
    WorkspaceView {
        name: "X-Y",
        axes: [X, Y],
    },
    WorkspaceView {
        name: "X-Z",
        axes: [X, Z],
    },
];

/// Classes of error with their colours: upper edges in mm, ascending, the last one open.
pub(super) struct Colours {
    edges: Vec<f64>,
}

impl Colours {
    /// Round edges from below the median error of `after` to within the largest errors of `before`.
    pub fn new(before: &Prediction, after: &Prediction) -> Self {
        let quantile = |table: &Prediction, share: f64| {
            let mut errors: Vec<f64> = table.0.iter().map(|row| row.error_mm).collect();
            errors.sort_by(f64::total_cmp);
            errors
                .get(((errors.len() as f64 * share) as usize).min(errors.len().saturating_sub(1)))
                .copied()
                .unwrap_or(1.0)
        };
        // Quantiles, not ends: one wrong point would give all others the same colour.
        let upper = round_down(quantile(before, 0.9).max(quantile(after, 0.9)).max(1e-6));
        let lower = quantile(after, 0.4).max(upper * 1e-6);
        let count = CLASSES - 1;
        let digits: [&[f64]; 3] = [&[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
        let mut tries = digits
            .into_iter()
            .map(|digits| descending(upper, digits, count));
        let fitting = tries
            .clone()
            .find(|edges| edges.last().is_some_and(|edge| *edge <= lower));
        let mut edges = fitting.or_else(|| tries.next_back()).unwrap_or_default();
        edges.reverse();
        Self { edges }
    }
    /// Its class, from 0.
    pub(super) fn class(&self, error: f64) -> usize {
        self.edges.iter().take_while(|edge| error > **edge).count()
    }
    /// What each class means, e.g. `0.1 - 0.2`.
    pub fn legend(&self, locale: &Locale) -> Vec<(String, String)> {
        let label = |edge: f64| locale.decimal(label(edge));
        let text = |k: usize| match (
            k.checked_sub(1).and_then(|k| self.edges.get(k)),
            self.edges.get(k),
        ) {
            (None, Some(upper)) => format!("\u{2264} {}", label(*upper)),
            (Some(lower), Some(upper)) => format!("{}\u{2013}{}", label(*lower), label(*upper)),
            (Some(lower), None) => format!("> {}", label(*lower)),
            (None, None) => say!(locale, "all"),
        };
        (0..=self.edges.len())
            .map(|k| (format!("e{k}"), text(k)))
            .collect()
    }
}

/// `count` values made of these digits and powers of ten, from the first at or above `upper` down.
fn descending(upper: f64, digits: &[f64], count: usize) -> Vec<f64> {
    let decade = upper.log10().floor() as i32 + 1;
    (0..)
        .map(|k| decade - k)
        .flat_map(|power| {
            digits
                .iter()
                .rev()
                .map(move |digit| digit * 10f64.powi(power))
        })
        .skip_while(|edge| *edge > upper * 1.001)
        .take(count)
        .collect()
}

/// One view: the points of one step, framed by all points of both steps, and how much its vectors are magnified.
pub(super) fn scatter(
    locale: &Locale,
    view: WorkspaceView,
    rows: &Prediction,
    frame: [&Prediction; 2],
    colours: &Colours,
    title: &str,
) -> (String, String) {
    const WIDTH: f64 = 420.0;
    let area = Area::new([52.0, 26.0, WIDTH - 14.0, 300.0]);
    let extent = |axis: ViewAxis| {
        let values = frame.iter().flat_map(|table| &table.0).map(axis.1);
        let (lower, upper) = values.fold((f64::MAX, f64::MIN), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        if lower > upper {
            (0.0, 0.0)
        } else {
            (lower, upper)
        }
    };
    let ((x0, x1), (y0, y1)) = (extent(view.axes[0]), extent(view.axes[1]));
    // One millimetre is as long in both directions; a margin leaves room for the vectors.
    let per_unit = ((x1 - x0) / (area.right - area.left))
        .max((y1 - y0) / (area.bottom - area.top))
        .max(1e-3)
        * 1.16;
    let half = [
        per_unit * (area.right - area.left) / 2.0,
        per_unit * (area.bottom - area.top) / 2.0,
    ];
    let centre = [(x0 + x1) / 2.0, (y0 + y1) / 2.0];
    let x = Scale::linear(centre[0] - half[0], centre[0] + half[0]).over(area.left, area.right);
    let y = Scale::linear(centre[1] - half[1], centre[1] + half[1]).over(area.bottom, area.top);

    let mut errors: Vec<f64> = rows.0.iter().map(|row| row.error_mm).collect();
    errors.sort_by(f64::total_cmp);
    let large = errors.get(errors.len() * 9 / 10).copied().unwrap_or(0.0);
    // A large residual is drawn a tenth of the workspace long, the same in all views.
    let widest = [X, Y, Z]
        .map(extent)
        .into_iter()
        .map(|(lower, upper)| upper - lower)
        .fold(0.0, f64::max);
    let magnified = if large > 0.0 {
        round_down((widest / 10.0 / large).max(1.0))
    } else {
        1.0
    };

    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
    x.grid_x(&mut svg, area, 5);
    y.grid_y(&mut svg, area, 5);
    let every = rows.0.len().div_ceil(DRAWN).max(1);
    let drawn: Vec<&PredictionRow> = rows.0.iter().step_by(every).collect();
    let place = |row: &PredictionRow, factor: f64| {
        let at = |a: usize| view.axes[a].1(row) + factor * view.axes[a].2(row);
        [x.at(at(0)), y.at(at(1))]
    };
    for class in 0..CLASSES {
        let of_class = |row: &&&PredictionRow| colours.class(row.error_mm) == class;
        let lines: Vec<_> = drawn
            .iter()
            .filter(of_class)
            .map(|row| [place(row, 0.0), place(row, magnified)])
            .collect();
        svg.lines(&format!("vector e{class}"), &lines);
        for (held_out, fitted, width) in [(true, "", 4.6), (false, " fitted", 3.4)] {
            let dots: Vec<_> = drawn
                .iter()
                .filter(of_class)
                .filter(|row| row.held_out == held_out)
                .map(|row| place(row, 0.0))
                .collect();
            svg.dots(&format!("dots e{class}{fitted}"), width, &dots);
        }
    }
    baseline(&mut svg, area);
    name_x(&mut svg, area, &format!("{}, mm", view.axes[0].0));
    name_y(&mut svg, area, &format!("{}, mm", view.axes[1].0));
    let factor = locale.decimal(label(magnified));
    let remark = match every {
        1 => say!(locale, "vectors ×{factor}", factor),
        _ => say!(
            locale,
            "vectors ×{factor}, one point in {every}",
            factor,
            every
        ),
    };
    (svg.finish(title), remark)
}

/// The errors of one set of points after one step.
pub(super) struct StepErrors {
    pub step: String,
    /// Class of its colour, the same in all pictures.
    pub colour: String,
    /// Ascending, mm; not empty.
    pub sorted_mm: Vec<f64>,
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
pub(super) fn histogram(locale: &Locale, all: &[StepErrors], title: &str) -> String {
    let area = Area::new([16.0, TOP, WIDTH - 12.0, TOP + ROW * all.len() as f64]);
    let scale = scale(all).over(area.left, area.right);
    let counts: Vec<[usize; BINS]> = all
        .iter()
        .map(|errors| bins(&errors.sorted_mm, scale, area))
        .collect();
    let highest = counts.iter().flatten().copied().max().unwrap_or(1).max(1) as f64;
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
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
            &say!(locale, "mean {length}", length = locale.mm(errors.mean_mm)),
        );
    }
    name_x(&mut svg, area, &say!(locale, "position error, mm"));
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
pub(super) fn cumulative(locale: &Locale, all: &[StepErrors], title: &str) -> String {
    let area = Area::new([
        44.0,
        26.0,
        WIDTH - 12.0,
        (TOP + ROW * all.len() as f64).clamp(190.0, 330.0),
    ]);
    let scale = scale(all).over(area.left, area.right);
    let share = Scale::linear(0.0, 100.0).over(area.bottom, area.top);
    let mut svg = Svg::new(locale, WIDTH, area.bottom + 38.0);
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
    name_x(&mut svg, area, &say!(locale, "position error, mm"));
    name_y(&mut svg, area, &say!(locale, "% of the points at or below"));
    svg.finish(title)
}
