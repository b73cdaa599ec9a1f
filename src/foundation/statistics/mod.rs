//! Order statistics and the normal distribution: what every floor may need of statistics, without a robot or a frame.
//!
//! Quantiles: between order statistics, or one of them.
//!
//! The length that a normal vector in space keeps below with 95 %.

pub use crate::statistics::normal::normal_quantile;

mod normal;

/// Median of the squared length of one, two and three unit normals (chi-square), by that number; 1 for none.
pub const MEDIAN_CHI2: [f64; 4] = [1.0, 0.454_94, 1.386_29, 2.366];

/// The number at this share of an ascending list, linear between order statistics (Hyndman and Fan's type 7, the default of numpy,
/// R and polars' `linear`); none of none.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let place = share * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (
        sorted.get(place.floor() as usize)?,
        sorted.get(place.ceil() as usize)?,
    );
    Some(below + (above - below) * place.fract())
}

/// The value nearest to this share of the values in order, the upper of two that are equally near; none of none. The order is lost.
pub fn nearest(values: &mut [f64], share: f64) -> Option<f64> {
    let place = (values.len().checked_sub(1)? as f64 * share).round() as usize;
    (place < values.len()).then(|| *values.select_nth_unstable_by(place, f64::total_cmp).1)
}

/// 95 % quantiles of chi-square with one, two and three degrees of freedom.
const CHI2_95: [f64; 3] = [3.841_459, 5.991_465, 7.814_728];

/// Radius of the sphere that holds a normal vector of this covariance with 95 %, in the covariance's unit of length; `trace` is the sum of
/// its variances, `square` the sum of their squares along its axes (the trace of its square).
///
/// The squared length is approximated by a multiple of chi-square with as many degrees of freedom as match mean and variance
/// (Satterthwaite, 1946), between one and three; the radius is right to 0.5 %.
pub fn radius_95(trace: f64, square: f64) -> f64 {
    if trace <= 0.0 || square <= 0.0 {
        return 0.0;
    }
    let freedom = (trace * trace / square).clamp(1.0, 3.0);
    // The parabola through the three quantiles, exact at whole numbers and to 0.1 % between them.
    let [one, two, three] = CHI2_95;
    let (a, b, c) = (freedom - 1.0, freedom - 2.0, freedom - 3.0);
    let quantile = one * b * c / 2.0 - two * a * c + three * a * b / 2.0;
    (trace / freedom * quantile).sqrt()
}

#[cfg(test)]
mod radius_tests {
    use super::radius_95;

    #[test]
    fn whole_numbers_of_equal_axes_give_the_tabulated_quantiles() {
        // Square roots of chi-square's 95 % quantiles: 1.960, 2.448, 2.795.
        for (axes, radius) in [(1.0, 1.959_964), (2.0, 2.447_747), (3.0, 2.795_483)] {
            assert!((radius_95(4.0 * axes, 16.0 * axes) - 2.0 * radius).abs() < 1e-5);
        }
        assert_eq!(radius_95(0.0, 0.0), 0.0);
    }

    /// 300,000 draws of each by another program: the 95 % quantile of their lengths.
    #[test]
    fn unequal_axes_agree_with_draws() {
        for (sigma, drawn) in [
            ([1.0, 0.5, 0.25], 2.053_f64),
            ([1.0, 1.0, 0.3], 2.466),
            ([1.0, 0.2, 0.2], 1.978),
            ([1.0, 0.8, 0.6], 2.333),
        ] {
            let trace: f64 = sigma.iter().map(|s: &f64| s * s).sum();
            let square: f64 = sigma.iter().map(|s| s.powi(4)).sum();
            let radius = radius_95(trace, square);
            assert!(
                (radius / drawn - 1.0).abs() < 0.01,
                "{sigma:?}: {radius} {drawn}"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_numpy() {
        // numpy.quantile([1, 2, 4, 8], q) and [1, 2, 4, 8, 16].
        let four = [1.0, 2.0, 4.0, 8.0];
        for (share, expected) in [(0.0, 1.0), (0.25, 1.75), (0.5, 3.0), (0.9, 6.8), (1.0, 8.0)] {
            assert!(
                (quantile(&four, share).unwrap() - expected).abs() < 1e-12,
                "{share}"
            );
        }
        assert_eq!(quantile(&[1.0, 2.0, 4.0, 8.0, 16.0], 0.5), Some(4.0));
        assert_eq!(
            (quantile(&[], 0.5), quantile(&[7.0], 0.9)),
            (None, Some(7.0))
        );
    }

    #[test]
    fn the_nearest_value_is_one_of_them_and_the_upper_of_two() {
        // What `values[len / 2]` of the sorted values is, for even and odd numbers of them.
        for count in 1..60_usize {
            let mut values: Vec<f64> = (0..count).map(|k| (k * 7919 % 101) as f64).collect();
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            assert_eq!(
                nearest(&mut values, 0.5),
                Some(sorted[count / 2]),
                "{count}"
            );
            assert_eq!(nearest(&mut values, 1.0), sorted.last().copied());
            assert_eq!(nearest(&mut values, 0.0), sorted.first().copied());
        }
        assert_eq!(nearest(&mut [], 0.5), None);
    }
}
