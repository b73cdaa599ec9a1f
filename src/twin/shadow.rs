//! What remains of an effect in data when other causes have absorbed what they can: columns less their shadow on the space of the others
//! (modified Gram-Schmidt, twice).

/// An effect in all rows, a number each.
pub(crate) type Column = Vec<f64>;

/// An orthonormal basis.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shadow {
    basis: Vec<Column>,
}

/// What remains of a column below this share of it is rounding, not a new direction.
const ROUNDING: f64 = 1e-6;

impl Shadow {
    /// The space of columns of any size. The column with most outside of those before comes next, so that what hardly differs from them
    /// cannot pass on its rounding.
    pub(crate) fn of(columns: Vec<Column>) -> Shadow {
        let mut shadow = Shadow::default();
        let mut waiting: Vec<Column> = columns.into_iter().filter_map(unit).collect();
        while let Some(most) =
            (0..waiting.len()).max_by(|a, b| norm(&waiting[*a]).total_cmp(&norm(&waiting[*b])))
        {
            let column = waiting.swap_remove(most);
            if norm(&column) < ROUNDING {
                break;
            }
            shadow.add(column);
            if let Some(direction) = shadow.basis.last() {
                waiting
                    .iter_mut()
                    .for_each(|other| take_out(other, direction));
            }
        }
        shadow
    }

    /// Dimension of the space.
    pub(crate) fn rank(&self) -> usize {
        self.basis.len()
    }

    /// Takes a direction in; none where the space holds it already.
    pub(crate) fn add(&mut self, column: Column) {
        let size = norm(&column);
        let outside = self.outside(column);
        if norm(&outside) > ROUNDING * size {
            self.basis.extend(unit(outside));
        }
    }

    /// What of a column lies outside of the space.
    pub(crate) fn outside(&self, mut column: Column) -> Column {
        for _ in 0..2 {
            self.basis
                .iter()
                .for_each(|direction| take_out(&mut column, direction));
        }
        column
    }
}

/// Length of a column.
pub(crate) fn norm(column: &[f64]) -> f64 {
    column.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Takes what lies along a unit direction out of a column.
fn take_out(column: &mut [f64], direction: &[f64]) {
    let along: f64 = direction.iter().zip(&*column).map(|(a, b)| a * b).sum();
    column
        .iter_mut()
        .zip(direction)
        .for_each(|(x, d)| *x -= along * d);
}

/// The column at length 1; none for one of no length.
fn unit(column: Column) -> Option<Column> {
    let length = norm(&column);
    (length > 0.0).then(|| column.into_iter().map(|x| x / length).collect())
}
