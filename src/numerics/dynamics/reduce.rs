//! From rows as recorded to judged rows: one low-pass, alike for measured torque and every column, then fewer rows.

use super::clock::RecordingClock;
use super::filter::ZeroPhase;
use std::ops::Range;

/// s cut off at each end of a stretch: the filters settle there.
const SETTLING: f64 = 0.3;
/// Judged rows a second over the cut-off.
const RATE_OVER_CUTOFF: f64 = 2.5;
/// Judged rows at most: of longer recordings fewer a second.
const MOST: usize = 4000;
/// Rows that a block of a long stretch holds, its margins apart.
const BLOCK: usize = 1 << 14;

/// The low-pass and the rows that are kept.
#[derive(Debug, Clone)]
pub(super) struct Reduction {
    /// Hz.
    pub cutoff: f64,
    /// Hz, of kept rows.
    pub rate: f64,
    /// Kept rows of the recording, ascending.
    pub rows: Vec<usize>,
    /// Runs of kept rows without a gap.
    pub runs: Vec<Range<usize>>,
    filter: ZeroPhase,
    stretches: Vec<Range<usize>>,
    /// Rows beyond which a block does not feel what is filtered with it.
    margin: usize,
}

impl Reduction {
    /// The reduction by a clock and a cut-off (Hz).
    pub fn new(clock: &RecordingClock, cutoff: f64) -> Self {
        let recorded: usize = clock.stretches.iter().map(Range::len).sum();
        let every = ((clock.rate / (RATE_OVER_CUTOFF * cutoff)).round() as usize)
            .max(recorded.div_ceil(MOST))
            .max(1);
        let settling = (SETTLING * clock.rate) as usize;
        let (mut rows, mut runs) = (Vec::new(), Vec::new());
        for stretch in &clock.stretches {
            let first = rows.len();
            rows.extend(
                (stretch.start + settling..stretch.end.saturating_sub(settling)).step_by(every),
            );
            runs.push(first..rows.len());
        }
        runs.retain(|run| !run.is_empty());
        Self {
            cutoff,
            rate: clock.rate / every as f64,
            rows,
            runs,
            filter: ZeroPhase::new(clock.rate, cutoff),
            stretches: clock.stretches.clone(),
            margin: (10.0 * clock.rate / cutoff) as usize,
        }
    }

    /// Filters whole courses (as long as the recording) in place.
    pub fn filter(&self, courses: &mut [Vec<f64>]) {
        for stretch in &self.stretches {
            let mut own: Vec<&mut [f64]> = courses
                .iter_mut()
                .map(|course| &mut course[stretch.clone()])
                .collect();
            self.filter.apply(&mut own);
        }
    }

    /// The kept rows of courses as they were recorded.
    pub fn reduce(&self, mut courses: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        self.filter(&mut courses);
        courses
            .into_iter()
            .map(|course| self.rows.iter().map(|row| course[*row]).collect())
            .collect()
    }

    /// Kept rows of `width` courses that `write` makes for a range of rows, column after column (each as long as the range): the memory
    /// is that of a block.
    pub fn reduce_blocks(
        &self,
        width: usize,
        mut write: impl FnMut(Range<usize>, &mut [f64]),
    ) -> Vec<Vec<f64>> {
        let mut kept = vec![Vec::with_capacity(self.rows.len()); width];
        let (mut block, mut next) = (Vec::new(), 0);
        for stretch in &self.stretches {
            for start in stretch.clone().step_by(BLOCK) {
                let end = (start + BLOCK).min(stretch.end);
                let wide = start.saturating_sub(self.margin).max(stretch.start)
                    ..(end + self.margin).min(stretch.end);
                let long = wide.len();
                block.clear();
                block.resize(width * long, 0.0);
                write(wide.clone(), &mut block);
                let last = next + self.rows[next..].partition_point(|row| *row < end);
                let mut courses: Vec<&mut [f64]> = block.chunks_exact_mut(long).collect();
                self.filter.apply(&mut courses);
                for (course, kept) in courses.iter().zip(&mut kept) {
                    kept.extend(
                        self.rows[next..last]
                            .iter()
                            .map(|row| course[row - wide.start]),
                    );
                }
                next = last;
            }
        }
        kept
    }
}
