//! Where in the workspace the error is: points from above and from the side, coloured by error, with residual vectors.

use super::axis::{Area, Scale, baseline, label, name_x, name_y, round_down};
use super::svg::Svg;
use crate::table::{Prediction, PredictionRow};

/// Points drawn in one picture: more would hide each other.
const DRAWN: usize = 600;
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
    fn class(&self, error: f64) -> usize {
        self.edges.iter().take_while(|edge| error > **edge).count()
    }
    /// What each class means, e.g. `0.1 - 0.2`.
    pub fn legend(&self) -> Vec<(String, String)> {
        let text = |k: usize| match (
            k.checked_sub(1).and_then(|k| self.edges.get(k)),
            self.edges.get(k),
        ) {
            (None, Some(upper)) => format!("\u{2264} {}", label(*upper)),
            (Some(lower), Some(upper)) => format!("{}\u{2013}{}", label(*lower), label(*upper)),
            (Some(lower), None) => format!("> {}", label(*lower)),
            (None, None) => "all".into(),
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

    let mut svg = Svg::new(WIDTH, area.bottom + 38.0);
    x.grid_x(&mut svg, area, 5);
    y.grid_y(&mut svg, area, 5);
    let every = rows.0.len().div_ceil(DRAWN).max(1);
    for row in rows.0.iter().step_by(every) {
        let [at, residual] = [
            [0, 1].map(|a| view.axes[a].1(row)),
            [0, 1].map(|a| view.axes[a].2(row)),
        ];
        let class = colours.class(row.error_mm);
        let from = [x.at(at[0]), y.at(at[1])];
        let to = [
            x.at(at[0] + residual[0] * magnified),
            y.at(at[1] + residual[1] * magnified),
        ];
        svg.line(&format!("vector e{class}"), from, to);
        svg.circle(
            &format!("dot e{class}{}", if row.held_out { "" } else { " fitted" }),
            from,
            if row.held_out { 2.3 } else { 1.7 },
        );
    }
    baseline(&mut svg, area);
    name_x(&mut svg, area, &format!("{}, mm", view.axes[0].0));
    name_y(&mut svg, area, &format!("{}, mm", view.axes[1].0));
    let thinned = if every > 1 {
        format!(", one point in {every}")
    } else {
        String::new()
    };
    (
        svg.finish(title),
        format!("vectors \u{d7}{}{thinned}", label(magnified)),
    )
}
