//! The order in which rows were measured, where a file has them in another one: sorted by name, or one target after the other.

/// Rows by time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sequence {
    rows: Vec<usize>,
    /// Place of each row by time.
    places: Vec<usize>,
}

/// Rows are in no order of time where more than one step in so many goes back in time: clocks that were set anew do so a few times.
const BACK: usize = 10;
/// Fewer steps back are those of a file of one target after the other, where by time so many fewer stops are made.
const STOPS: f64 = 0.7;

impl Sequence {
    /// The order of rows whose `time` (s, of each) is far from their order in the file; none where they follow each other, or two
    /// recordings do whose clocks begin anew. `near` says whether two rows are of one pose.
    pub fn by_time(time: &[f64], near: impl Fn(usize, usize) -> bool) -> Option<Self> {
        let back = time.windows(2).filter(|pair| pair[1] < pair[0]).count();
        if back == 0 || time.iter().any(|time| !time.is_finite()) {
            return None;
        }
        let mut rows: Vec<usize> = (0..time.len()).collect();
        rows.sort_by(|a, b| time[*a].total_cmp(&time[*b]));
        let stops = |order: &[usize]| {
            1 + order
                .windows(2)
                .filter(|pair| !near(pair[0], pair[1]))
                .count()
        };
        let fewer = || (stops(&rows) as f64) < STOPS * stops(&Vec::from_iter(0..time.len())) as f64;
        if BACK * back <= time.len() && !fewer() {
            return None;
        }
        let mut places = vec![0; rows.len()];
        rows.iter()
            .enumerate()
            .for_each(|(place, row)| places[*row] = place);
        Some(Self { rows, places })
    }

    /// The row at a place of the order.
    pub fn row(&self, place: usize) -> usize {
        self.rows[place]
    }

    /// The place of a row.
    pub fn rank_in_time(&self, row: usize) -> usize {
        self.places[row]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_by_name_have_an_order_of_measurement_and_clocks_that_begin_anew_do_not() {
        let by_name = [50.0, 10.0, 40.0, 0.0, 20.0, 30.0];
        let sequence = Sequence::by_time(&by_name, |_, _| false).expect("an order");
        assert_eq!(
            (0..6).map(|place| sequence.row(place)).collect::<Vec<_>>(),
            [3, 1, 4, 5, 2, 0]
        );
        assert_eq!(
            (0..6)
                .map(|row| sequence.rank_in_time(row))
                .collect::<Vec<_>>(),
            [5, 1, 4, 0, 2, 3]
        );
        let in_order: Vec<f64> = (0..40).map(f64::from).collect();
        let twice: Vec<f64> = in_order.iter().chain(&in_order).copied().collect();
        for time in [&in_order, &twice, &[f64::NAN; 40].to_vec()] {
            assert_eq!(Sequence::by_time(time, |_, _| false), None);
        }
    }

    #[test]
    fn targets_one_after_the_other_are_brought_together_where_they_are_of_one_pose() {
        let time: Vec<f64> = (0..3)
            .flat_map(|target| (0..30).map(move |pose| f64::from(60 * pose + 10 * target)))
            .collect();
        let sequence = Sequence::by_time(&time, |a, b| a % 30 == b % 30).expect("an order");
        assert_eq!(
            (0..6).map(|place| sequence.row(place)).collect::<Vec<_>>(),
            [0, 30, 60, 1, 31, 61]
        );
        assert_eq!(Sequence::by_time(&time, |_, _| false), None);
    }
}
