//! The arm in its base frame with the error at every measured point, before and after: a still picture, and what the page's script turns it by.

use super::Tables;
use super::errors::standing_prediction;
use super::language::{Locale, say};
use super::number::count;
use super::svg::{Svg, round_down};
use super::workspace::Colours;
use crate::table::PredictionRow;
use serde_json::{Value, json};

/// An arm, and where it stands.
pub struct PlacedArm {
    /// Rotation and place (mm) of the base in the instrument's frame, row-major 3 x 4.
    pub base: [f64; 12],
    /// Axis, a point on it (mm), both in the base at the zero pose, and whether the joint slides.
    pub joints: Vec<([f64; 3], [f64; 3], bool)>,
    /// The measured point in the base at the zero pose, mm.
    pub tool: [f64; 3],
    /// Base, joints and measured point in the pose of `row`, mm in the base.
    pub chain: Vec<[f64; 3]>,
    /// Row of the recording whose pose is shown.
    pub row: usize,
}

/// Points that are drawn: more would hide each other.
const DRAWN: usize = 600;
const SIZE: [f64; 2] = [720.0, 460.0];
/// Azimuth and elevation from which the still picture is seen, rad: from no axis, so that no two axes fall onto each other.
const VIEW: [f64; 2] = [0.6, 0.45];
/// Of the height: from whatever side one looks at it, the longest way through the scene is rarely upright.
const FILLED: f64 = 1.25;
/// A large error is drawn so long, as a share of the measured region: long enough to see where it points, short enough not to cross the next.
const LONG: f64 = 0.12;

/// The row with the largest error of the first step, whose pose the still picture shows.
pub fn shown_row(rows: &[PredictionRow]) -> Option<usize> {
    let usable = rows.iter().enumerate().filter(|(_, row)| !row.suspect);
    let worst = usable.max_by(|a, b| a.1.error_mm.total_cmp(&b.1.error_mm));
    worst.map(|(at, _)| at)
}

/// None where no arm could be placed or nothing was predicted.
pub(super) fn section(locale: &Locale, tables: &Tables) -> Option<Value> {
    let arm = tables.arm.as_ref()?;
    let (first, last) = (tables.prediction.first()?, standing_prediction(tables)?);
    let (before, after) = (&first.table, &last.table);
    let rows = before
        .0
        .len()
        .min(after.0.len())
        .min(tables.recording.rows());
    if rows == 0 {
        return None;
    }
    let colours = Colours::new(before, after);
    let mut errors: Vec<f64> = before.0[..rows].iter().map(|row| row.error_mm).collect();
    errors.sort_by(f64::total_cmp);
    let every = rows.div_ceil(DRAWN);
    let mut drawn: Vec<usize> = (0..rows).step_by(every).collect();
    if !drawn.contains(&arm.row) && arm.row < rows {
        drawn.push(arm.row);
    }
    // Seen from the arm's base, which stands upright as instruments need not.
    let turned = |v: [f64; 3]| {
        [0, 1, 2].map(|column| {
            (0..3)
                .map(|row| arm.base[4 * row + column] * v[row])
                .sum::<f64>()
        })
    };
    let measured = |row: &PredictionRow| {
        let seen = [
            row.x_mm + row.dx_mm,
            row.y_mm + row.dy_mm,
            row.z_mm + row.dz_mm,
        ];
        turned([0, 1, 2].map(|axis| seen[axis] - arm.base[4 * axis + 3]))
    };
    let points: Vec<[f64; 3]> = drawn.iter().map(|at| measured(&before.0[*at])).collect();
    let ends = |axis: usize| {
        let values = points.iter().chain(&arm.chain).map(|point| point[axis]);
        values.fold([f64::MAX, f64::MIN], |[low, high], value| {
            [low.min(value), high.max(value)]
        })
    };
    let extents = [0, 1, 2].map(ends);
    let centre = extents.map(|[low, high]| (low + high) / 2.0);
    let off = |point: &[f64; 3]| {
        let squares = (0..3).map(|axis| (point[axis] - centre[axis]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let radius = points.iter().chain(&arm.chain).map(off).fold(1.0, f64::max);
    let large = errors[(errors.len() * 9 / 10).min(errors.len() - 1)].max(1e-6);
    let magnified = round_down((LONG * 2.0 * radius / large).max(1.0));
    let scale = FILLED * SIZE[1] / (2.0 * radius);
    let view = View { centre, scale };
    let [residual_before, residual_after] = [before, after].map(|table| {
        let of_row = |at: &usize| {
            let row = &table.0[*at];
            turned([row.dx_mm, row.dy_mm, row.dz_mm])
        };
        drawn.iter().map(of_row).collect::<Vec<_>>()
    });
    let class = |at: usize, table: &[PredictionRow]| colours.class(table[at].error_mm);
    let classes = [before, after].map(|table| {
        drawn
            .iter()
            .map(|at| class(*at, &table.0))
            .collect::<Vec<_>>()
    });
    let title = say!(locale, "The arm and the error at every point, before");
    let still = still(
        locale,
        &view,
        arm,
        (&points, &residual_before, &classes[0]),
        magnified,
        &title,
    );
    let round = |value: f64, digits: i32| (value * 10f64.powi(digits)).round() / 10f64.powi(digits);
    let joints = tables.recording.joints;
    let rows: Vec<Value> = drawn
        .iter()
        .enumerate()
        .map(|(k, at)| {
            let q: Vec<f64> = (0..joints)
                .map(|joint| {
                    let slides = arm.joints.get(joint).is_some_and(|one| one.2);
                    let value = tables.recording.q(*at)[joint];
                    round(
                        if slides { 1e3 * value } else { value },
                        if slides { 1 } else { 4 },
                    )
                })
                .collect();
            json!([
                before.0[*at].point_id,
                points[k].map(|mm| round(mm, 1)),
                residual_before[k].map(|mm| round(mm, 4)),
                residual_after[k].map(|mm| round(mm, 4)),
                classes[0][k],
                classes[1][k],
                q,
                i32::from(after.0[*at].held_out),
            ])
        })
        .collect();
    let data = json!({
        "size": SIZE, "view": VIEW, "centre": centre.map(|mm| round(mm, 1)), "scale": scale, "magnified": magnified,
        "tool": arm.tool,
        "joints": arm.joints.iter().map(|(axis, point, slides)| json!([axis, point, i32::from(*slides)])).collect::<Vec<_>>(),
        "points": rows, "chosen": drawn.iter().position(|at| *at == arm.row), "decimal": locale.decimal(".".into()),
    });
    Some(json!({
        "still": still,
        "data": data.to_string(),
        "legend": colours.legend(locale),
        "factor": locale.decimal(super::svg::label(magnified)),
        "every": (every > 1).then(|| count(every as i64)),
        "script": include_str!("arm.js"),
    }))
}

/// From where one looks: a point of the base frame (mm) on the picture.
struct View {
    centre: [f64; 3],
    scale: f64,
}

impl View {
    fn at(&self, point: [f64; 3]) -> [f64; 2] {
        let [x, y, z] = [0, 1, 2].map(|axis| point[axis] - self.centre[axis]);
        let [(sa, ca), (se, ce)] = VIEW.map(f64::sin_cos);
        let (across, away) = (x * ca + y * sa, y * ca - x * sa);
        [
            SIZE[0] / 2.0 + self.scale * across,
            SIZE[1] / 2.0 - self.scale * (z * ce + away * se),
        ]
    }
}

/// Points with their residuals and classes of error.
type Drawn<'a> = (&'a [[f64; 3]], &'a [[f64; 3]], &'a [usize]);

/// The picture where no script runs, and on paper.
fn still(
    locale: &Locale,
    view: &View,
    arm: &PlacedArm,
    (points, residuals, classes): Drawn,
    magnified: f64,
    title: &str,
) -> String {
    let mut svg = Svg::new(locale, SIZE[0], SIZE[1]);
    let chain: Vec<[f64; 2]> = arm.chain.iter().map(|point| view.at(*point)).collect();
    svg.path("arm", &chain);
    svg.dots("joints", 11.0, &chain[..chain.len().saturating_sub(1)]);
    let last = classes.iter().copied().max().unwrap_or(0);
    for class in 0..=last {
        let of_class = || (0..points.len()).filter(|k| classes[*k] == class);
        let modelled =
            |k: usize| [0, 1, 2].map(|axis| points[k][axis] - magnified * residuals[k][axis]);
        let lines: Vec<_> = of_class()
            .map(|k| [view.at(points[k]), view.at(modelled(k))])
            .collect();
        svg.lines(&format!("vector e{class}"), &lines);
        let dots: Vec<_> = of_class().map(|k| view.at(points[k])).collect();
        svg.dots(&format!("dots e{class}"), 4.0, &dots);
    }
    svg.finish(title)
}
