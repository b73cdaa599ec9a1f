//! How far two clocks are apart by a constant, as the times of their rows say.

use crate::statistics;

/// Rows of the file with fewer that are tried, and those of the other that one of them may belong to, at most.
const TRIED: usize = 200;
const MOST: usize = 20_000;
/// Fewer rows pair by chance.
const FEWEST: usize = 5;
/// Share of the tried rows that one offset pairs.
const SHARE: f64 = 0.9;
/// Clocks that are set by hand differ by this much from whole zones, s.
const BY_HAND: f64 = 300.0;
/// Zones and summer time differ by whole quarters of an hour, and by no more than this, s.
const QUARTER: f64 = 900.0;
const ZONES: f64 = 14.0 * 3600.0;
const DAY: f64 = 86_400.0;

/// An offset that pairs the rows of two files.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClocksApart {
    /// Time of the second file less that of the first, s.
    pub offset: f64,
    /// Rows that it pairs, of those that were tried.
    pub paired: usize,
    /// Rows that were tried.
    pub tried: usize,
}

impl ClocksApart {
    /// What a person is told.
    pub fn in_words(&self) -> String {
        let rows = match self.paired == self.tried {
            true => "in all rows".to_string(),
            false => format!("in {} of {} rows", self.paired, self.tried),
        };
        let offset = self.offset;
        let zone = zone(offset).map_or_else(String::new, |zone| format!(" ({zone})"));
        format!(
            "the clocks are {} s apart {rows}{zone}",
            Trimmed(offset.abs())
        )
    }
}

/// A number of seconds without zeros at its end.
pub struct Trimmed(pub f64);

impl std::fmt::Display for Trimmed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.3}", self.0);
        f.write_str(text.trim_end_matches('0').trim_end_matches('.'))
    }
}

/// What an offset is of zones or days, by name.
pub fn zone(offset: f64) -> Option<String> {
    let size = offset.abs();
    if size > ZONES + BY_HAND {
        return (size > DAY).then(|| {
            format!(
                "{:.0} days: another date, or a date against a time of day",
                size / DAY
            )
        });
    }
    let quarters = (size / QUARTER).round();
    let left = size - quarters * QUARTER;
    if quarters == 0.0 || left.abs() > BY_HAND {
        return None;
    }
    let hours = quarters / 4.0;
    let sign = if left < 0.0 { "less" } else { "and" };
    let left = match left.abs() < 5e-4 {
        true => String::new(),
        false => format!(" {sign} {} s", Trimmed(left.abs())),
    };
    let what = match quarters {
        4.0 => "summer time, or UTC against local time",
        _ => "UTC against local time",
    };
    Some(format!("{hours} h{left}: {what}"))
}

/// The one offset by which the rows of two files pair, each with one no further than `tolerance` (s); none where no offset does, or several.
pub fn clocks_apart(first: &[f64], second: &[f64], tolerance: f64) -> Option<ClocksApart> {
    let sorted = |times: &[f64]| {
        let mut out: Vec<f64> = times
            .iter()
            .copied()
            .filter(|time| time.is_finite())
            .collect();
        out.sort_by(f64::total_cmp);
        out
    };
    let (first, second) = (sorted(first), sorted(second));
    let (few, many, sign) = match first.len() <= second.len() {
        true => (&first, &second, 1.0),
        false => (&second, &first, -1.0),
    };
    if few.len() < FEWEST || many.len() > MOST {
        return None;
    }
    let step = few.len().div_ceil(TRIED);
    let tried: Vec<f64> = few.iter().copied().step_by(step).collect();
    let most_lost = ((1.0 - SHARE) * tried.len() as f64) as usize;
    let near = |time: f64| {
        let at = many.partition_point(|other| *other < time);
        let around = &many[at.saturating_sub(1)..many.len().min(at + 1)];
        let apart = around.iter().map(|other| other - time);
        apart.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    let pairs = |offset: f64| -> Option<Vec<f64>> {
        let (mut lost, mut off) = (0, Vec::new());
        for time in &tried {
            match near(time + offset).filter(|off| off.abs() <= tolerance) {
                Some(one) => off.push(offset + one),
                None => lost += 1,
            }
            if lost > most_lost {
                return None;
            }
        }
        Some(off)
    };
    let mut found: Vec<(usize, f64)> = Vec::new();
    for anchor in [tried[0], tried[tried.len() / 2]] {
        for other in many {
            if let Some(mut off) = pairs(other - anchor) {
                let count = off.len();
                found.push((count, statistics::nearest(&mut off, 0.5)?));
            }
        }
    }
    let best = *found.iter().max_by_key(|(count, _)| *count)?;
    let is_other = |(count, offset): &(usize, f64)| {
        *count == best.0 && (offset - best.1).abs() > 2.0 * tolerance
    };
    (!found.iter().any(is_other)).then_some(ClocksApart {
        offset: sign * best.1,
        paired: best.0,
        tried: tried.len(),
    })
}

/// The least time between a row of one file and one of the other, s; none where one has no rows.
pub fn least_apart(first: &[f64], second: &[f64]) -> Option<f64> {
    let mut sorted = second.to_vec();
    sorted.sort_by(f64::total_cmp);
    let apart = first.iter().flat_map(|time| {
        let at = sorted.partition_point(|other| other < time);
        let around = &sorted[at.saturating_sub(1)..sorted.len().min(at + 1)];
        around
            .iter()
            .map(|other| (other - time).abs())
            .collect::<Vec<f64>>()
    });
    apart.min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::{clocks_apart, zone};

    #[test]
    fn one_offset_pairs_all_rows_and_a_grid_of_other_length_says_none() {
        let first: Vec<f64> = (0..30).map(|k| 20.0 * f64::from(k)).collect();
        let later = |by: f64, rows: usize| -> Vec<f64> {
            first.iter().take(rows).map(|time| time + by).collect()
        };
        let found = clocks_apart(&first, &later(7201.2, 30), 5.0).unwrap();
        assert!((found.offset - 7201.2).abs() < 1e-9 && found.paired == 30);
        let back = clocks_apart(&later(7201.2, 30), &first, 5.0).unwrap();
        assert!((back.offset + 7201.2).abs() < 1e-9);
        assert_eq!(clocks_apart(&first, &later(7201.2, 20), 5.0), None);
        assert_eq!(
            found.in_words(),
            "the clocks are 7201.2 s apart in all rows (2 h and 1.2 s: UTC against local time)"
        );
        assert_eq!(zone(12.0), None);
        assert_eq!(
            zone(-3598.0).unwrap(),
            "1 h less 2 s: summer time, or UTC against local time"
        );
    }
}
