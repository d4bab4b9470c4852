//! Offers of the lease that give way: who takes one from whom before it is in force.
//!
//! Problem: as long as an offer stands nobody else gets one; who asks, takes no lease and asks again would keep everybody from
//! commanding. And whoever takes offers away must not keep others from it in turn.
//! Model: an offer that nobody has mapped for [`MAPPED_WITHIN`] gives way to another user. Whoever lets that happen, keeps his
//! memory from being sealed, or hands a second offer back within [`REMEMBERED`], has lapsed: for that time his offers give
//! way at once, to whoever has not lapsed. It is his own loss: without others he commands as before. Administrators take
//! every offer of others, give theirs to none but each other, and do not lapse. A user whose lease they ended waits for that
//! time: else he who asks at once has it again before anybody else. More users than [`MOST`] of each kind at once are not
//! remembered, the oldest first.
//! Limit: users that cannot be told apart lapse together, and are told from each other only by time.

use std::time::{Duration, Instant};

/// A commander that has not mapped its memory by then gives way: an honest one takes milliseconds.
pub(super) const MAPPED_WITHIN: Duration = Duration::from_millis(100);
/// Time for which a lapse counts.
const REMEMBERED: Duration = Duration::from_secs(10);
/// Users at once.
const MOST: usize = 16;

/// One who wants the lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rival {
    /// None: one of those who cannot be told apart.
    pub(super) user: Option<u32>,
    pub(super) is_administrator: bool,
}

/// Users who let offers lapse or handed them back, and users whose leases administrators ended, the oldest first.
#[derive(Debug, Default)]
pub(super) struct Lapsed {
    entries: Vec<Entry>,
    ended: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    user: Option<u32>,
    at: Instant,
    /// Else he handed one back, as a run does that cannot start.
    has_lapsed: bool,
}

impl Lapsed {
    /// An offer to this one has lapsed.
    pub(super) fn note(&mut self, rival: Rival) {
        self.put(rival, true);
    }

    /// This one handed an offer back before it was in force.
    pub(super) fn note_handed_back(&mut self, rival: Rival) {
        let is_second = self.entries.iter().any(|entry| entry.user == rival.user && entry.counts());
        self.put(rival, is_second);
    }

    /// An administrator has ended this one's lease.
    pub(super) fn note_ended(&mut self, rival: Rival) {
        put(&mut self.ended, rival.user, false);
    }

    /// True of one whose lease an administrator ended shortly before.
    pub(super) fn must_wait(&self, rival: Rival) -> bool {
        let is_it = |ended: &Entry| ended.user == rival.user && ended.counts();
        !rival.is_administrator && self.ended.iter().any(is_it)
    }

    /// True if an offer to this user lapsed shortly before.
    pub(super) fn contains(&self, user: Option<u32>) -> bool {
        self.entries.iter().any(|entry| entry.user == user && entry.has_lapsed && entry.counts())
    }

    /// True if an offer that is not in force goes from its holder to a newcomer; `is_idle`: it has not been mapped in time.
    pub(super) fn gives_way(&self, holder: Rival, newcomer: Rival, is_idle: bool) -> bool {
        let is_same_user = holder.user.is_some() && holder.user == newcomer.user;
        match (holder.is_administrator, newcomer.is_administrator) {
            _ if is_same_user => false,
            (true, false) => false,
            (false, true) => true,
            _ => is_idle || self.contains(holder.user) && !self.contains(newcomer.user),
        }
    }

    fn put(&mut self, rival: Rival, has_lapsed: bool) {
        if rival.is_administrator {
            return;
        }
        put(&mut self.entries, rival.user, has_lapsed);
    }
}

fn put(entries: &mut Vec<Entry>, user: Option<u32>, has_lapsed: bool) {
    entries.retain(|entry| entry.user != user && entry.counts());
    if entries.len() == MOST {
        entries.remove(0);
    }
    entries.push(Entry { user, at: Instant::now(), has_lapsed });
}

impl Entry {
    fn counts(&self) -> bool {
        self.at.elapsed() < REMEMBERED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOT: Rival = Rival { user: Some(0), is_administrator: true };

    fn rival(user: Option<u32>) -> Rival {
        Rival { user, is_administrator: false }
    }

    #[test]
    fn the_last_users_are_remembered() {
        let mut lapsed = Lapsed::default();
        assert!(!lapsed.contains(None));
        (0..=MOST as u32).for_each(|user| lapsed.note(rival(Some(user))));
        assert!(!lapsed.contains(Some(0)) && lapsed.contains(Some(1)) && !lapsed.contains(None));
        // A second time is no second place.
        (0..MOST).for_each(|_| lapsed.note(rival(Some(1))));
        assert!(lapsed.contains(Some(2)) && lapsed.contains(Some(1)));
        lapsed.note(rival(None));
        assert!(lapsed.contains(None));
    }

    #[test]
    fn a_lapse_of_long_ago_counts_no_more() {
        let at =
            Instant::now().checked_sub(REMEMBERED + Duration::from_secs(1)).expect("it has been up for long");
        let mut lapsed = Lapsed::default();
        lapsed.entries.extend([true, false].map(|has_lapsed| Entry {
            user: Some(has_lapsed.into()),
            at,
            has_lapsed,
        }));
        assert!(!lapsed.contains(Some(1)));
        lapsed.note_handed_back(rival(Some(0)));
        assert!(!lapsed.contains(Some(0)), "the first one for long");
    }

    #[test]
    fn who_hands_a_second_offer_back_has_lapsed_and_administrators_never_have() {
        let mut lapsed = Lapsed::default();
        for (user, expected) in [(1, false), (2, false), (1, true), (1, true), (2, true)] {
            lapsed.note_handed_back(rival(Some(user)));
            assert_eq!(lapsed.contains(Some(user)), expected, "{user}");
        }
        for _ in 0..3 {
            lapsed.note(ROOT);
            lapsed.note_handed_back(ROOT);
        }
        assert!(!lapsed.contains(ROOT.user));
    }

    #[test]
    fn whose_lease_an_administrator_ended_waits_for_some_seconds() {
        let mut lapsed = Lapsed::default();
        let [one, other] = [1, 2].map(|user| rival(Some(user)));
        lapsed.note_ended(one);
        assert_eq!(
            [one, other, rival(None), ROOT].map(|rival| lapsed.must_wait(rival)),
            [true, false, false, false]
        );
        let long_ago =
            Instant::now().checked_sub(REMEMBERED + Duration::from_secs(1)).expect("it has been up for long");
        // Nor do two who take turns have it.
        lapsed.note_ended(other);
        assert_eq!([one, other].map(|rival| lapsed.must_wait(rival)), [true; 2]);
        lapsed.ended[0].at = long_ago;
        assert_eq!([one, other].map(|rival| lapsed.must_wait(rival)), [false, true]);
    }

    #[test]
    fn an_offer_gives_way_by_time_by_lapse_and_to_administrators() {
        let mut lapsed = Lapsed::default();
        let [one, other] = [1, 2].map(|user| rival(Some(user)));
        let gives_way = |lapsed: &Lapsed, holder, newcomer| {
            [false, true].map(|is_idle| lapsed.gives_way(holder, newcomer, is_idle))
        };
        assert_eq!(gives_way(&lapsed, one, one), [false, false], "his own");
        assert_eq!(gives_way(&lapsed, one, other), [false, true]);
        assert_eq!(gives_way(&lapsed, rival(None), rival(None)), [false, true], "perhaps another");
        assert_eq!(gives_way(&lapsed, one, ROOT), [true, true]);
        assert_eq!(gives_way(&lapsed, ROOT, one), [false, false]);
        let owner = Rival { user: Some(7), is_administrator: true };
        assert_eq!(gives_way(&lapsed, ROOT, owner), [false, true]);
        lapsed.note(one);
        assert_eq!(gives_way(&lapsed, one, other), [true, true]);
        assert_eq!(gives_way(&lapsed, other, one), [false, true]);
        // Of two who have both lapsed whoever asks more often is no better off.
        lapsed.note(other);
        assert_eq!(gives_way(&lapsed, one, other), [false, true]);
    }
}
