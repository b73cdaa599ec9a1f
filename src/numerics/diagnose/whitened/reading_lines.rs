//! Which residual rows hold what a row of the recording measured: as many as its kinds have numbers there.

use crate::observation::{MeasurementKind, Sensitivity};
use std::ops::Range;

/// What a row measured of one kind, as the present model sees it.
pub(super) struct SeenReading {
    pub(crate) kind: &'static dyn MeasurementKind,
    /// Lines of the kind's residual that were measured.
    pub(crate) lines: &'static [usize],
    /// How it follows the target's motion, in standard deviations.
    pub(crate) sensitivity: Sensitivity,
}

/// Readings of all rows, one row after another.
#[derive(Default)]
pub(super) struct ReadingLines {
    readings: Vec<SeenReading>,
    /// The first residual row of each reading.
    first: Vec<usize>,
    /// By row: past its last reading.
    end: Vec<usize>,
    /// By row: past its last residual row.
    end_line: Vec<usize>,
    /// By residual row: the place of its row.
    pub(crate) row_of: Vec<usize>,
}

impl ReadingLines {
    /// Takes the readings of the next row.
    pub(crate) fn push(&mut self, readings: Vec<SeenReading>) {
        let place = self.end.len();
        for reading in readings {
            self.first.push(self.row_of.len());
            self.row_of
                .extend(std::iter::repeat_n(place, reading.lines.len()));
            self.readings.push(reading);
        }
        self.end.push(self.readings.len());
        self.end_line.push(self.row_of.len());
    }

    /// Readings of a row, each with its first residual row.
    pub(crate) fn seen(&self, place: usize) -> impl Iterator<Item = (usize, &SeenReading)> {
        let own = begin(&self.end, place)..self.end[place];
        self.first[own.clone()]
            .iter()
            .copied()
            .zip(&self.readings[own])
    }

    /// Residual rows of a row.
    pub(crate) fn of_row(&self, place: usize) -> Range<usize> {
        begin(&self.end_line, place)..self.end_line[place]
    }
}

fn begin(end: &[usize], place: usize) -> usize {
    place.checked_sub(1).map_or(0, |before| end[before])
}
