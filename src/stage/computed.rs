//! Residuals far below the instrument's noise: points that no instrument has measured.

/// A residual that is this much smaller than the noise is no luck: chi-square of ten values is below 0.4 once in a million times.
const FAR_BELOW: f64 = 5.0;
/// Fewer values beyond the parameters may be small by luck.
const FEWEST: f64 = 10.0;

/// What to tell the person where whole points miss the model by far less than their noise, both mm; `parameters` were fitted to them.
pub fn suspicion(points: impl Iterator<Item = [f64; 2]>, parameters: usize) -> Option<String> {
    let (mut count, mut error, mut noise) = (0usize, 0.0, 0.0);
    for [missed, expected] in points {
        count += 1;
        error += missed.powi(2);
        noise += expected.powi(2);
    }
    let free = 3.0 * count as f64 - parameters as f64;
    if free < FEWEST {
        return None;
    }
    // A fit of p parameters to n values leaves (n - p) / n of the noise's squares.
    let expected = noise * free / (3.0 * count as f64);
    let [rms, stated] = [error, noise].map(|sum| (sum / count as f64).sqrt());
    (FAR_BELOW.powi(2) * error < expected).then(|| {
        format!(
            "the points miss the model by {} mm rms, far below the {} mm of the recording's noise: they are probably computed (a target, \
             a nominal point), not measured; check the column mapping in `ingest`, or state the `instrument` there. Where they were measured, the \
             noise is stated too large: check the unit of `sigma_x`, `u95` or the like",
            plain(rms),
            plain(stated)
        )
    })
}

/// To three digits, without a power of ten.
fn plain(mm: f64) -> String {
    let digits = if mm > 0.0 {
        (2.0 - mm.log10().floor()).clamp(0.0, 12.0)
    } else {
        0.0
    };
    format!("{mm:.*}", digits as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(count: usize, error_mm: f64) -> impl Iterator<Item = [f64; 2]> {
        std::iter::repeat_n([error_mm, 0.02], count)
    }

    #[test]
    fn only_a_residual_far_below_the_noise_is_suspected() {
        assert!(
            suspicion(points(20, 0.0003), 30)
                .unwrap()
                .contains("0.000300 mm rms, far below the 0.0200 mm")
        );
        assert!(suspicion(points(20, 0.005), 30).is_none());
        // Ten points and thirty parameters: a fit passes through all of them.
        assert!(suspicion(points(10, 0.0), 30).is_none());
        assert!(suspicion(points(10, 0.0), 20).is_some());
    }
}
