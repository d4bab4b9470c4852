//! Answers about shapes, each worked out once for all entities that share a shape.
//!
//! Problem: the triangles of a solid joined of others take hundredths of a second, and a scene has shelves of one solid.
//! Model: meshes, solids and patches are shared between the entities that use them alike, and are known again by that. Closed
//! forms are cheap and not remembered.
//! Cost: a comparison for each shared shape that was asked about before.

use haptics::Shape;

/// Answers that were worked out so far.
#[derive(Debug)]
pub(crate) struct PerShape<'e, T>(Vec<(&'e Shape, T)>);

impl<T> Default for PerShape<'_, T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'e, T: Clone> PerShape<'e, T> {
    /// The answer about a shape, worked out if it is the first such one.
    pub(crate) fn of(&mut self, shape: &'e Shape, work_out: impl FnOnce() -> T) -> T {
        if matches!(shape, Shape::Form(_)) {
            return work_out();
        }
        if let Some((_, answer)) = self.0.iter().find(|(other, _)| *other == shape) {
            return answer.clone();
        }
        let answer = work_out();
        self.0.push((shape, answer.clone()));
        answer
    }

    /// Number of shapes of which an answer was remembered.
    #[cfg(test)]
    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }
}
