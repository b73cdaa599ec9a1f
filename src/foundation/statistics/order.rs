//! Quantiles: between order statistics, or one of them.

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
