//! Finds the row of a table that a time belongs to.
//!
//! Model: time mostly runs on in small steps, so the answer is near the last one: a few steps from
//! there, and only then a search.
//! Invariant: the answer never depends on earlier questions.
//! Cost: constant while time runs on, logarithmic after a jump; no allocation.

/// Remembers the row of the last question, which is near the row of the next.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TimeCursor {
    row: usize,
}

impl TimeCursor {
    /// Steps tried before searching: a tick passes at most a few rows.
    const NEAR: usize = 8;

    /// The last row at or before `time_s`; `None` before the first row and for NaN.
    ///
    /// `times_s` rise strictly and are the same at every call.
    pub fn seek(&mut self, times_s: &[f64], time_s: f64) -> Option<usize> {
        let last = times_s.len().checked_sub(1)?;
        self.row = self.row.min(last);
        for _ in 0..Self::NEAR {
            if time_s < times_s[self.row] {
                self.row = self.row.checked_sub(1)?;
            } else if self.row < last && times_s[self.row + 1] <= time_s {
                self.row += 1;
            } else {
                // Neither comparison holds for NaN.
                return (times_s[self.row] <= time_s).then_some(self.row);
            }
        }
        self.row = times_s.partition_point(|&t| t <= time_s).checked_sub(1)?;
        Some(self.row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Oracle: search from scratch at every question, in any order of times.
        #[test]
        fn the_cursor_finds_the_same_row_as_a_search(
            steps in prop::collection::vec(1u32..5, 0..60),
            questions in prop::collection::vec(-3i32..200, 1..40),
        ) {
            let times: Vec<f64> = steps.iter().scan(0, |t, s| { *t += s; Some(f64::from(*t)) }).collect();
            let mut cursor = TimeCursor::default();
            for question in questions {
                let time = f64::from(question) * 0.5;
                let expected = times.iter().rposition(|&t| t <= time);
                prop_assert_eq!(cursor.seek(&times, time), expected);
                prop_assert_eq!(cursor.seek(&times, f64::NAN), None);
            }
        }
    }
}
