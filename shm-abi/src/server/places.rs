//! Places of the server: how many connections there are at once, and who loses one when there are too many.
//!
//! Problem: connections are few and strangers are many; one process could take all places by looking on, or by asking
//! nothing again and again.
//! Model: only who looks on or commands keeps a place. Observers have [`MAX_OBSERVERS`] places, of which one user and
//! one process get only some, and [`FOR_ADMINISTRATORS`] are kept for administrators, however many others look on. Those
//! who have yet to say what they want have places of their own; a newcomer that finds them taken gets the place of the
//! oldest silent connection of whoever has the most, so that opening more of them costs nobody but the opener.

/// Connections at once: observers, the commander, those who have yet to ask.
pub const MAX_CONNECTIONS: usize = MAX_OBSERVERS + 1 + MAX_ASKING;
/// Who looks on.
pub const MAX_OBSERVERS: usize = 60;
/// Of these, administrators': whoever is to find out what is wrong can look on.
pub const FOR_ADMINISTRATORS: usize = 8;
/// Of these, one user's: others can look on, too.
pub const MAX_OBSERVERS_OF_USER: usize = 48;
/// Of these, one process's.
pub const MAX_OBSERVERS_OF_PROCESS: usize = 24;
/// Beside them, of those who command or have left unread what they were sent: whoever looks on takes none of these.
pub const FOR_COMMANDERS: usize = 4;
/// Who has yet to say what he wants.
pub const MAX_ASKING: usize = 32;

/// Whose connection it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Owner {
    pub(super) uid: u32,
    pub(super) pid: u32,
}

/// Whether there is a place for one more observer beside these.
pub(super) fn may_observe(
    newcomer: Owner,
    is_administrator: bool,
    observers: impl Iterator<Item = Owner>,
) -> bool {
    let most = if is_administrator { MAX_OBSERVERS } else { MAX_OBSERVERS - FOR_ADMINISTRATORS };
    has_place(newcomer, most, observers)
}

/// True if there is a place for a commander beside those who have left unread what they were sent.
pub(super) fn may_command(newcomer: Owner, left: impl Iterator<Item = Owner>) -> bool {
    has_place(newcomer, MAX_OBSERVERS + FOR_COMMANDERS, left)
}

fn has_place(newcomer: Owner, most: usize, others: impl Iterator<Item = Owner>) -> bool {
    let (mut all, mut of_user, mut of_process) = (0, 0, 0);
    for owner in others {
        all += 1;
        of_user += usize::from(owner.uid == newcomer.uid);
        of_process += usize::from(owner == newcomer);
    }
    all < most && of_user < MAX_OBSERVERS_OF_USER && of_process < MAX_OBSERVERS_OF_PROCESS
}

/// Which of these silent connections, oldest first, loses its place.
pub(super) fn to_evict(silent: &[Owner]) -> Option<usize> {
    let of_user = |owner: &Owner| silent.iter().filter(|other| other.uid == owner.uid).count();
    let of_process = |owner: &Owner| silent.iter().filter(|other| *other == owner).count();
    // Of equals the first, which is the oldest.
    let rank = |owner: &Owner| (of_user(owner), of_process(owner));
    silent.iter().map(rank).enumerate().rev().max_by_key(|(_, rank)| *rank).map(|(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owner(uid: u32, pid: u32) -> Owner {
        Owner { uid, pid }
    }

    #[test]
    fn one_process_and_one_user_leave_places_for_others() {
        let process = [owner(1, 1); MAX_OBSERVERS_OF_PROCESS];
        assert!(!may_observe(owner(1, 1), true, process.iter().copied()));
        assert!(may_observe(owner(1, 2), false, process.iter().copied()));
        let user: Vec<_> = (0..MAX_OBSERVERS_OF_USER as u32).map(|pid| owner(1, pid)).collect();
        assert!(!may_observe(owner(1, 999), true, user.iter().copied()));
        assert!(may_observe(owner(2, 999), false, user.iter().copied()));
    }

    #[test]
    fn the_last_places_are_kept_for_administrators() {
        let strangers = MAX_OBSERVERS - FOR_ADMINISTRATORS;
        let all: Vec<_> = (0..MAX_OBSERVERS as u32).map(|id| owner(id, id)).collect();
        assert!(may_observe(owner(999, 999), false, all[1..strangers].iter().copied()));
        assert!(!may_observe(owner(999, 999), false, all[..strangers].iter().copied()));
        assert!(may_observe(owner(999, 999), true, all[1..].iter().copied()));
        assert!(!may_observe(owner(999, 999), true, all.iter().copied()));
    }

    #[test]
    fn whoever_may_only_look_takes_no_place_from_commanders() {
        let left = MAX_OBSERVERS - FOR_ADMINISTRATORS;
        let strangers: Vec<_> = (0..left as u32).map(|id| owner(id % 2, id)).collect();
        assert!(!may_observe(owner(999, 999), false, strangers.iter().copied()));
        assert!(may_command(owner(999, 999), strangers.iter().copied()));
        // One who leaves unread what commanders are sent keeps nobody else out.
        let own: Vec<_> = (0..MAX_OBSERVERS_OF_USER as u32).map(|pid| owner(1, pid)).collect();
        assert!(!may_command(owner(1, 999), own.iter().copied()));
        assert!(may_command(owner(2, 999), own.iter().copied()));
        let all: Vec<_> = (0..(MAX_OBSERVERS + FOR_COMMANDERS) as u32).map(|id| owner(id, id)).collect();
        assert!(may_command(owner(999, 999), all[1..].iter().copied()));
        assert!(!may_command(owner(999, 999), all.iter().copied()));
    }

    #[test]
    fn who_has_the_most_silent_connections_loses_the_oldest_of_them() {
        assert_eq!(to_evict(&[]), None);
        let [quiet, first, second] = [owner(1, 1), owner(2, 2), owner(2, 3)];
        assert_eq!(to_evict(&[quiet, first, second]), Some(1));
        assert_eq!(to_evict(&[quiet, first, second, second]), Some(2));
        assert_eq!(to_evict(&[first, quiet]), Some(0), "of equals the oldest");
    }
}
