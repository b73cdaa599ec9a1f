//! Order statistics and the normal distribution: what every floor may need of statistics, without a robot or a frame.

mod normal;
mod order;
mod radius;

pub use normal::normal_quantile;
pub use order::{nearest, quantile};
pub use radius::radius_95;

/// Median of the squared length of one, two and three unit normals (chi-square), by that number; 1 for none.
pub const MEDIAN_CHI2: [f64; 4] = [1.0, 0.454_94, 1.386_29, 2.366];
