//! The length that a normal vector in space keeps below with 95 %.

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
mod tests {
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
