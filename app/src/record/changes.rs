//! Bodies that have changed since somebody looked, by their numbers.
//!
//! Model: what is noted several times is there once; to note and to forget costs as much as has changed, however many bodies
//! there are.

/// Numbers of bodies, each once.
#[derive(Debug, Default)]
pub(super) struct Changes {
    numbers: Vec<u32>,
    is_noted: Vec<bool>,
}

impl Changes {
    /// Of so many bodies none.
    pub(super) fn none(bodies: usize) -> Self {
        Self { numbers: Vec::with_capacity(bodies), is_noted: vec![false; bodies] }
    }

    /// Of so many bodies all.
    pub(super) fn all(bodies: usize) -> Self {
        Self { numbers: (0..bodies as u32).collect(), is_noted: vec![true; bodies] }
    }

    /// Notes these, of which those that are no bodies are left out.
    pub(super) fn note(&mut self, numbers: &[u32]) {
        for &number in numbers {
            if let Some(is_noted @ false) = self.is_noted.get_mut(number as usize) {
                *is_noted = true;
                self.numbers.push(number);
            }
        }
    }

    /// All that were noted, in ascending order.
    pub(super) fn sorted(&mut self) -> &[u32] {
        self.numbers.sort_unstable();
        &self.numbers
    }

    /// Somebody has looked.
    pub(super) fn forget(&mut self) {
        for number in self.numbers.drain(..) {
            self.is_noted[number as usize] = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_noted_is_there_once_until_somebody_has_looked() {
        let mut changes = Changes::none(5);
        changes.note(&[4, 1, 4, 7]);
        changes.note(&[1, 2]);
        assert_eq!(changes.sorted(), [1, 2, 4]);
        changes.forget();
        changes.note(&[4]);
        assert_eq!(changes.sorted(), [4]);
        let mut all = Changes::all(3);
        all.note(&[1]);
        assert_eq!(all.sorted(), [0, 1, 2]);
    }
}
