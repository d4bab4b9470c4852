//! How many ticks a finger's claims waited: the count of each number, so that the median is exact.

/// Waits so far.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Waits {
    counts: [u64; LONG as usize + 1],
    most: u64,
}

/// Waits from this one on are counted together.
const LONG: u64 = 64;

impl Default for Waits {
    fn default() -> Self {
        Self { counts: [0; LONG as usize + 1], most: 0 }
    }
}

impl std::fmt::Debug for Waits {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (count, median, most) = (self.count(), self.median_ticks(), self.most);
        write!(f, "{count} waits, median {median}, longest {most} ticks")
    }
}

impl Waits {
    pub(super) fn add(&mut self, ticks: u64) {
        self.counts[ticks.min(LONG) as usize] += 1;
        self.most = self.most.max(ticks);
    }

    /// How many there were.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// The longest.
    pub fn most_ticks(&self) -> u64 {
        self.most
    }

    /// Half of them were no longer; 64 stands for that and more. 0 if there was none.
    pub fn median_ticks(&self) -> u64 {
        let (half, mut so_far) = (self.count().div_ceil(2), 0);
        let is_half = |count: &u64| {
            so_far += count;
            so_far >= half
        };
        self.counts.iter().position(is_half).map_or(0, |ticks| ticks as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_waits_are_no_longer_than_their_median() {
        let mut waits = Waits::default();
        assert_eq!((waits.count(), waits.median_ticks(), waits.most_ticks()), (0, 0, 0));
        for ticks in [7, 3, 3, 1000, 9] {
            waits.add(ticks);
        }
        assert_eq!((waits.count(), waits.median_ticks(), waits.most_ticks()), (5, 7, 1000));
        waits.add(1);
        assert_eq!(waits.median_ticks(), 3);
        (0..20).for_each(|_| waits.add(64));
        assert_eq!(waits.median_ticks(), 64);
    }
}
