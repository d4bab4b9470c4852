//! What is wrong with a file, all of it: whoever mends a scene wants one list and not ten attempts.

use crate::error::SceneError;
use crate::reader::Table;
use crate::vocabulary::Vocabulary;

/// What was found so far, in the order in which it was found. A mistake that many entities share is told once.
#[derive(Debug, Default)]
pub(crate) struct Problems {
    found: Vec<(String, SceneError)>,
}

/// More are no help.
const MOST: usize = 100;

impl Problems {
    pub(crate) fn note(&mut self, problem: SceneError) {
        let message = problem.to_string();
        if self.found.len() < MOST && self.found.iter().all(|(known, _)| *known != message) {
            self.found.push((message, problem));
        }
    }

    /// The value; without one the reason is noted.
    pub(crate) fn keep<T>(&mut self, result: Result<T, SceneError>) -> Option<T> {
        result.map_err(|problem| self.note(problem)).ok()
    }

    /// Notes all keys that may not stand in a table.
    pub(crate) fn keys(&mut self, table: &Table<'_>, keys: &Vocabulary) {
        table.wrong_keys(keys).into_iter().for_each(|problem| self.note(problem));
    }

    pub(crate) fn all(self) -> Vec<SceneError> {
        self.found.into_iter().map(|(_, problem)| problem).collect()
    }
}
