//! Rigid motions as plain 4x4 arrays, and the few vector operations that statics needs.

/// A homogeneous transform, rows first.
pub(crate) type Matrix = [[f64; 4]; 4];
/// Three numbers: a point or a direction.
pub(crate) type Vector = [f64; 3];

/// No motion.
pub const IDENTITY: Matrix = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 1.0],
];

/// The motion `a` followed by `b` in a's frame.
pub(crate) fn times(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * b[k][j]).sum()))
}

/// A displacement.
pub(crate) fn shift(v: Vector) -> Matrix {
    let mut m = IDENTITY;
    for i in 0..3 {
        m[i][3] = v[i];
    }
    m
}

/// Rotation by `angle` (rad) about the unit vector `axis` through the origin (Rodrigues, written out).
pub(crate) fn turn(axis: Vector, angle: f64) -> Matrix {
    let [x, y, z] = axis;
    let (s, c) = angle.sin_cos();
    let u = 1.0 - c;
    [
        [c + x * x * u, x * y * u - z * s, x * z * u + y * s, 0.0],
        [y * x * u + z * s, c + y * y * u, y * z * u - x * s, 0.0],
        [z * x * u - y * s, z * y * u + x * s, c + z * z * u, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

/// Rotation by a rotation vector (rad).
pub(crate) fn turn_by(v: Vector) -> Matrix {
    let angle = norm(v);
    if angle == 0.0 {
        IDENTITY
    } else {
        turn(scale(v, 1.0 / angle), angle)
    }
}

/// Roll, pitch, yaw (rad) about the fixed x, y and z axis, in this order.
pub(crate) fn roll_pitch_yaw(v: Vector) -> Matrix {
    let x = turn([1.0, 0.0, 0.0], v[0]);
    let y = turn([0.0, 1.0, 0.0], v[1]);
    let z = turn([0.0, 0.0, 1.0], v[2]);
    times(&z, &times(&y, &x))
}

/// The inverse of a rigid motion.
pub(crate) fn inverse(m: &Matrix) -> Matrix {
    let mut out = IDENTITY;
    for i in 0..3 {
        for j in 0..3 {
            out[i][j] = m[j][i];
        }
        out[i][3] = -(0..3).map(|k| m[k][i] * m[k][3]).sum::<f64>();
    }
    out
}

/// Where a point goes.
pub(crate) fn place(m: &Matrix, p: Vector) -> Vector {
    add(direct(m, p), origin(m))
}

/// Where a direction goes.
pub(crate) fn direct(m: &Matrix, v: Vector) -> Vector {
    std::array::from_fn(|i| (0..3).map(|k| m[i][k] * v[k]).sum())
}

/// A direction of the outer frame as seen in the inner one.
pub(crate) fn see(m: &Matrix, v: Vector) -> Vector {
    std::array::from_fn(|i| (0..3).map(|k| m[k][i] * v[k]).sum())
}

/// What a motion makes of the origin.
pub(crate) fn origin(m: &Matrix) -> Vector {
    [m[0][3], m[1][3], m[2][3]]
}

/// a + b.
pub(crate) fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] + b[i])
}

/// a - b.
pub(crate) fn minus(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] - b[i])
}

/// s a.
pub(crate) fn scale(a: Vector, s: f64) -> Vector {
    a.map(|x| x * s)
}

/// a . b.
pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// a x b.
pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Length.
pub(crate) fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

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
            (0..waiting.len()).max_by(|a, b| length(&waiting[*a]).total_cmp(&length(&waiting[*b])))
        {
            let column = waiting.swap_remove(most);
            if length(&column) < ROUNDING {
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
        let size = length(&column);
        let outside = self.outside(column);
        if length(&outside) > ROUNDING * size {
            self.basis.extend(unit(outside));
        }
    }

    /// The space with all of these columns but one.
    pub(crate) fn with_others(&self, columns: &[Column], one: usize) -> Shadow {
        let mut shadow = self.clone();
        let others = columns.iter().enumerate().filter(|(k, _)| *k != one);
        others.for_each(|(_, column)| shadow.add(column.clone()));
        shadow
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
pub(crate) fn length(column: &[f64]) -> f64 {
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
    let size = length(&column);
    (size > 0.0).then(|| column.into_iter().map(|x| x / size).collect())
}
