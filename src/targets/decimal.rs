//! Numbers with a fixed count of decimals, many a microsecond.

/// Above this (2^53) whole numbers are no longer exact in f64.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Appends `value` with so many decimals (at most 15), after `point` (ASCII); rounded to the nearest.
pub(super) fn push(out: &mut String, value: f64, decimals: usize, point: char) {
    let scaled = (value.abs() * 10f64.powi(decimals as i32)).round_ties_even();
    if scaled.is_nan() || scaled >= EXACT || decimals > 15 {
        let text = format!("{value:.decimals$}");
        out.extend(text.chars().map(|c| if c == '.' { point } else { c }));
        return;
    }
    let (mut rest, negative) = (scaled as u64, value < 0.0 && scaled > 0.0);
    // From the last digit to the first, at least one before the point.
    let mut text = [b'0'; 24];
    let mut at = text.len();
    let mut put = |byte: u8| {
        at -= 1;
        text[at] = byte;
    };
    let mut count = 0;
    while rest > 0 || count <= decimals {
        if count == decimals && decimals > 0 {
            put(point as u8);
        }
        put(b'0' + (rest % 10) as u8);
        (rest, count) = (rest / 10, count + 1);
    }
    if negative {
        put(b'-');
    }
    out.extend(std::str::from_utf8(&text[at..]));
}

#[cfg(test)]
mod tests {
    use super::push;

    #[test]
    fn a_number_is_written_to_half_a_unit_of_its_last_decimal() {
        let mut seed = 1u64;
        for _ in 0..20_000 {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let value = (seed >> 11) as f64 / (1u64 << 53) as f64 * 400.0 - 200.0;
            for decimals in [0, 4, 7, 9] {
                let mut text = String::new();
                push(&mut text, value, decimals, '.');
                let whole: f64 = text.parse().expect("a number");
                // Half a unit of the last place and a rounding of the product.
                assert!(
                    (whole - value).abs() <= 0.500_1 * 10f64.powi(-(decimals as i32)),
                    "{value} {text}"
                );
                assert_eq!(text.len(), format!("{whole:.decimals$}").len());
            }
        }
        let write = |value, decimals, point| {
            let mut text = String::new();
            push(&mut text, value, decimals, point);
            text
        };
        assert_eq!(write(-12.5, 3, ','), "-12,500");
        assert_eq!(
            (
                write(-1e-9, 4, '.'),
                write(0.05, 1, '.'),
                write(3.0, 0, '.')
            ),
            ("0.0000".into(), "0.0".into(), "3".into())
        );
        assert_eq!(
            (write(1e30, 2, ',').len(), write(f64::NAN, 2, '.')),
            (34, "NaN".into())
        );
    }
}
