//! A low-pass without delay: Butterworth of fourth order, run forwards and backwards.

use std::f64::consts::PI;

/// Above this share of the rate the low-pass would do nothing.
const IDLE: f64 = 0.45;

/// A section of second order: b0 b1 b2 a1 a2.
type Section = [f64; 5];

/// The zero-phase low-pass for one rate and cut-off.
#[derive(Debug, Clone)]
pub(super) struct ZeroPhase {
    sections: Vec<Section>,
    /// Rows by which a course is continued at each end.
    padding: usize,
}

impl ZeroPhase {
    /// Of a rate and a cut-off, Hz; above 0.45 times the rate it changes nothing.
    pub fn new(rate: f64, cutoff: f64) -> Self {
        if cutoff >= IDLE * rate {
            return Self { sections: Vec::new(), padding: 0 };
        }
        let warped = (PI * cutoff / rate).tan();
        let section = |pole: usize| {
            let damping = 2.0 * (PI * (2 * pole + 1) as f64 / 8.0).sin();
            let scale = 1.0 / (1.0 + damping * warped + warped * warped);
            let b = warped * warped * scale;
            [b, 2.0 * b, b, 2.0 * (warped * warped - 1.0) * scale, (1.0 - damping * warped + warped * warped) * scale]
        };
        Self { sections: vec![section(0), section(1)], padding: (3.0 * rate / cutoff) as usize + 15 }
    }

    /// Filters a course in place; `room` is reused from call to call.
    pub fn apply(&self, course: &mut [f64], room: &mut Vec<f64>) {
        if self.sections.is_empty() || course.len() < 3 {
            return;
        }
        let (rows, padding) = (course.len(), self.padding.min(course.len() - 2));
        room.clear();
        // Continued by a half turn about each end.
        room.extend((1..=padding).rev().map(|back| 2.0 * course[0] - course[back]));
        room.extend_from_slice(course);
        room.extend((1..=padding).map(|ahead| 2.0 * course[rows - 1] - course[rows - 1 - ahead]));
        for _ in 0..2 {
            self.sections.iter().for_each(|section| run(section, room));
            room.reverse();
        }
        course.copy_from_slice(&room[padding..padding + rows]);
    }
}

/// One section over a course, begun as if the first value had stood for ever.
fn run([b0, b1, b2, a1, a2]: &Section, course: &mut [f64]) {
    let first = course[0];
    let mut second_state = (b2 - a2) * first;
    let mut first_state = (b1 - a1) * first + second_state;
    for value in course {
        let input = *value;
        let output = b0 * input + first_state;
        first_state = b1 * input - a1 * output + second_state;
        second_state = b2 * input - a2 * output;
        *value = output;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(rate: f64, hertz: f64, rows: usize) -> Vec<f64> {
        (0..rows).map(|row| (2.0 * PI * hertz * row as f64 / rate).sin()).collect()
    }

    #[test]
    fn a_sine_keeps_its_phase_and_loses_what_butterworth_says() {
        // |H|^2 = 1 / (1 + (tan(pi f / fs) / tan(pi fc / fs))^8), once forwards and once backwards.
        let (rate, cutoff, rows) = (100.0, 10.0, 2000);
        let filter = ZeroPhase::new(rate, cutoff);
        for hertz in [1.0, 5.0, 10.0, 14.0] {
            let mut course = sine(rate, hertz, rows);
            filter.apply(&mut course, &mut Vec::new());
            let ratio = (PI * hertz / rate).tan() / (PI * cutoff / rate).tan();
            let expected = 1.0 / (1.0 + ratio.powi(8));
            let before = sine(rate, hertz, rows);
            let worst = (400..1600).map(|row| (course[row] - expected * before[row]).abs()).fold(0.0, f64::max);
            assert!(worst < 2e-4, "{hertz} Hz: {worst}");
        }
    }

    #[test]
    fn what_stands_still_or_rises_evenly_is_left_as_it_is() {
        let filter = ZeroPhase::new(100.0, 10.0);
        let mut course: Vec<f64> = (0..300).map(|row| 3.0 + 0.2 * f64::from(row)).collect();
        filter.apply(&mut course, &mut Vec::new());
        let worst = course.iter().enumerate().map(|(row, value)| (value - 3.0 - 0.2 * row as f64).abs()).fold(0.0, f64::max);
        assert!(worst < 0.02, "{worst}");
    }
}
