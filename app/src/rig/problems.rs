//! What is wrong with the input of a run, all of it.

use super::RigError;

/// In the order in which it was found.
#[derive(Debug, Default)]
pub struct Problems {
    found: Vec<RigError>,
}

/// More are no help.
const MOST: usize = 100;

impl Problems {
    /// Whether nothing was found.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// Everything that was found.
    pub fn all(self) -> Vec<RigError> {
        self.found
    }

    /// The value; without one the reason is noted.
    pub(super) fn keep<T, E: Into<RigError>>(&mut self, result: Result<T, E>) -> Option<T> {
        result.map_err(|problem| self.note(problem.into())).ok()
    }

    pub(super) fn note(&mut self, problem: RigError) {
        if self.found.len() < MOST {
            self.found.push(problem);
        }
    }

    /// Notes what may have been found already, in another entity that is made of the same.
    pub(super) fn note_once(&mut self, problem: RigError) {
        let words = problem.to_string();
        if self.found.iter().all(|found| found.to_string() != words) {
            self.note(problem);
        }
    }

    /// For whoever stops at the first problem. Without a value something was found.
    pub(super) fn first_or<T>(self, value: Option<T>) -> Result<T, RigError> {
        match (self.found.into_iter().next(), value) {
            (None, Some(value)) => Ok(value),
            (Some(problem), _) => Err(problem),
            (None, None) => unreachable!("there is always a reason"),
        }
    }
}
