//! A ball that was taken off and put back elsewhere: from some row on, what does not close lies the same way in the frame of the tool.

use super::model::Model;
use crate::observation::{RowView, kinds};
use crate::robot::Measurements;
use nalgebra::Vector3;

/// Where a ball was put back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reseat {
    /// The first row with it there.
    pub row: usize,
    /// How far it moved at least, m: the fit has taken up a part.
    pub shift: f64,
    /// The same in standard errors.
    pub statistic: f64,
}

/// Beyond so many standard errors no chance among all places of a recording gets.
const CERTAIN: f64 = 8.0;
/// Rows on either side.
const FEWEST: usize = 6;
/// Standard deviations to which single rows are cut: a slip of a plate is another matter.
const CUT: f64 = 4.0;

/// The place in the order of `rows` that parts them best, of rows that lay in sockets; `sigma` is what they scatter by, m per axis.
pub fn reseated(model: &Model, data: &Measurements, rows: &[usize], sigma: f64) -> Option<Reseat> {
    let socket = kinds(data)
        .into_iter()
        .find(|kind| kind.is_contact() && kind.about().axes == 3)?;
    let mut scratch = model.stack.scratch(&model.robot);
    let mut seen: Vec<(usize, Vector3<f64>)> = Vec::new();
    for row in rows {
        let placed = model.place(data, *row, &mut scratch);
        if let Some((error, _)) = socket.residual(RowView {
            data,
            row: *row,
            placed: &placed,
        }) {
            let off = placed.orientation().tr_mul(&error);
            seen.push((*row, off * (CUT * sigma / off.norm().max(CUT * sigma))));
        }
    }
    let total: Vector3<f64> = seen.iter().map(|(_, off)| off).sum();
    let mut before = Vector3::zeros();
    let mut best: Option<Reseat> = None;
    for (count, (_, off)) in (1..).zip(&seen) {
        before += off;
        let after = seen.len() - count;
        if count < FEWEST || after < FEWEST {
            continue;
        }
        let apart = ((total - before) / after as f64 - before / count as f64).norm();
        let statistic = apart / (sigma * (1.0 / count as f64 + 1.0 / after as f64).sqrt());
        if statistic > best.map_or(CERTAIN, |best| best.statistic) {
            best = Some(Reseat {
                row: seen[count].0,
                shift: apart,
                statistic,
            });
        }
    }
    best
}
