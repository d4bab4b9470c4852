//! Users that asked to command and let the offer lapse.
//!
//! Problem: as long as an offer stands nobody else gets one; who asks, takes no lease and asks again would keep everybody from
//! commanding.
//! Model: for [`REMEMBERED`] an offer to such a user gives way to whoever else asks. It is his own loss: without others he
//! commands as before. More of them than [`MOST`] at once are not remembered, the oldest first.

use std::time::{Duration, Instant};

/// Time for which a lapse counts.
const REMEMBERED: Duration = Duration::from_secs(10);
/// Users at once.
const MOST: usize = 16;

/// Users of the last offers that lapsed, and when, the oldest first; `None`: those who cannot be told apart.
#[derive(Debug, Default)]
pub(super) struct Lapsed(Vec<(Option<u32>, Instant)>);

impl Lapsed {
    /// An offer to this user has lapsed.
    pub(super) fn note(&mut self, user: Option<u32>) {
        self.0.retain(|(other, at)| *other != user && at.elapsed() < REMEMBERED);
        if self.0.len() == MOST {
            self.0.remove(0);
        }
        self.0.push((user, Instant::now()));
    }

    /// True if an offer to this user lapsed shortly before.
    pub(super) fn contains(&self, user: &Option<u32>) -> bool {
        self.0.iter().any(|(other, at)| other == user && at.elapsed() < REMEMBERED)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_users_are_remembered() {
        let mut lapsed = Lapsed::default();
        assert!(!lapsed.contains(&None));
        (0..=MOST as u32).for_each(|user| lapsed.note(Some(user)));
        assert!(!lapsed.contains(&Some(0)) && lapsed.contains(&Some(1)) && !lapsed.contains(&None));
        // A second time is no second place.
        lapsed.note(Some(1));
        assert!(lapsed.contains(&Some(2)) && lapsed.contains(&Some(1)));
        lapsed.note(None);
        assert!(lapsed.contains(&None));
    }
}
