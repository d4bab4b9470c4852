//! What a foot lies on: one patch, the edge of two, or the corner of three.

/// Up to three patches, by their numbers in the solid, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct On {
    numbers: [u16; 3],
    count: u8,
}

impl On {
    pub(super) const NOTHING: Self = Self { numbers: [u16::MAX; 3], count: 0 };

    /// The first three of some patches.
    pub(super) fn of(numbers: impl IntoIterator<Item = u16>) -> Self {
        numbers.into_iter().fold(Self::NOTHING, |on, number| on.and(number).unwrap_or(on))
    }

    /// With one patch more, if there is room.
    pub(super) fn and(mut self, number: u16) -> Option<Self> {
        if self.has(number) {
            return Some(self);
        }
        *self.numbers.get_mut(usize::from(self.count))? = number;
        self.count += 1;
        self.numbers.sort_unstable();
        Some(self)
    }

    pub(super) fn has(&self, number: u16) -> bool {
        self.numbers().contains(&number)
    }

    pub(super) fn is_part_of(&self, other: &Self) -> bool {
        self.numbers().iter().all(|&number| other.has(number))
    }

    pub(super) fn numbers(&self) -> &[u16] {
        self.numbers.get(..usize::from(self.count)).unwrap_or_default()
    }
}
