//! Places of the server: how many connections there are at once, and who loses one when there are too many.
//!
//! Problem: connections are few and strangers are many; one process could take all places by looking on, or by asking
//! nothing again and again, or by asking to command and never reading the answer.
//! Model: only who looks on or commands keeps a place, and so does whoever leaves unread what it was sent. Observers have
//! the places of [`OBSERVERS`]; of those who asked to command, who leave unread what commanders are sent have those of
//! [`COMMANDERS`], so that neither takes any of the other's. One user and one process get only some, and some are kept
//! for administrators, however many others there are. Users that this process cannot tell apart count as one. Those
//! who have yet to say what they want have places of their own; a newcomer that finds them taken gets the place of the
//! oldest silent connection of whoever has the most, so that opening more of them costs nobody but the opener.
//! Limit: whoever has a range of users of his own (`/etc/subuid`) can take all places but those of administrators.

/// Connections at once: observers, commanders of once, the commander, those who have yet to ask.
pub const MAX_CONNECTIONS: usize = OBSERVERS.all + COMMANDERS.all + 1 + MAX_ASKING;
/// Who looks on.
pub const OBSERVERS: Places = Places { all: 60, of_administrators: 8, of_user: 48, of_process: 24 };
/// Commanders of once that have left unread what they were sent.
pub const COMMANDERS: Places = Places { all: 24, of_administrators: 4, of_user: 8, of_process: 4 };
/// Who has yet to say what he wants.
pub const MAX_ASKING: usize = 32;

/// Numbers of places for one purpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Places {
    /// Of everybody.
    pub all: usize,
    /// Of these, administrators': whoever is to find out what is wrong finds one.
    pub of_administrators: usize,
    /// Of these, one user's at most: others find some, too.
    pub of_user: usize,
    /// Of these, one process's at most.
    pub of_process: usize,
}

/// Purposes for which a connection is sent descriptors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    Observe,
    Command,
}

impl Purpose {
    fn places(self) -> Places {
        match self {
            Self::Observe => OBSERVERS,
            Self::Command => COMMANDERS,
        }
    }
}

/// Whose connection it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Owner {
    /// None: one of those who cannot be told apart.
    pub(super) user: Option<u32>,
    pub(super) pid: u32,
}

/// True if there is a place for one more beside these, which have places of the same purpose.
pub(super) fn has_place(
    purpose: Purpose,
    newcomer: Owner,
    is_administrator: bool,
    others: impl Iterator<Item = Owner>,
) -> bool {
    let places = purpose.places();
    let (mut all, mut of_user, mut of_process) = (0, 0, 0);
    for owner in others {
        all += 1;
        of_user += usize::from(owner.user == newcomer.user);
        of_process += usize::from(owner == newcomer);
    }
    let kept = if is_administrator { 0 } else { places.of_administrators };
    all < places.all - kept && of_user < places.of_user && of_process < places.of_process
}

/// Which of these silent connections, oldest first, loses its place.
pub(super) fn to_evict(silent: &[Owner]) -> Option<usize> {
    let of_user = |owner: &Owner| silent.iter().filter(|other| other.user == owner.user).count();
    let of_process = |owner: &Owner| silent.iter().filter(|other| *other == owner).count();
    // Of equals the first, which is the oldest.
    let rank = |owner: &Owner| (of_user(owner), of_process(owner));
    silent.iter().map(rank).enumerate().rev().max_by_key(|(_, rank)| *rank).map(|(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PURPOSES: [Purpose; 2] = [Purpose::Observe, Purpose::Command];

    fn owner(user: u32, pid: u32) -> Owner {
        Owner { user: Some(user), pid }
    }

    #[test]
    fn one_process_and_one_user_leave_places_for_others() {
        for purpose in PURPOSES {
            let Places { of_user, of_process, .. } = purpose.places();
            let has_place = |user, pid, is_administrator, others: &[Owner]| {
                has_place(purpose, owner(user, pid), is_administrator, others.iter().copied())
            };
            let process = vec![owner(1, 1); of_process];
            assert!(!has_place(1, 1, true, &process), "{purpose:?}");
            assert!(has_place(1, 1, true, &process[1..]), "{purpose:?}");
            assert!(has_place(1, 2, false, &process), "{purpose:?}");
            let user: Vec<_> = (0..of_user as u32).map(|pid| owner(1, pid)).collect();
            assert!(!has_place(1, 999, false, &user), "{purpose:?}");
            assert!(has_place(1, 999, false, &user[1..]), "{purpose:?}");
            assert!(has_place(2, 999, false, &user), "{purpose:?}");
        }
    }

    #[test]
    fn the_last_places_are_kept_for_administrators() {
        for purpose in PURPOSES {
            let Places { all, of_administrators, .. } = purpose.places();
            let strangers = all - of_administrators;
            let others: Vec<_> = (0..all as u32).map(|id| owner(id, id)).collect();
            let has_place = |is_administrator, others: &[Owner]| {
                has_place(purpose, owner(999, 999), is_administrator, others.iter().copied())
            };
            assert!(has_place(false, &others[1..strangers]), "{purpose:?}");
            assert!(!has_place(false, &others[..strangers]), "{purpose:?}");
            assert!(has_place(true, &others[1..]), "{purpose:?}");
            assert!(!has_place(true, &others), "{purpose:?}");
        }
    }

    #[test]
    fn those_who_cannot_be_told_apart_take_no_place_from_anybody_else() {
        let nobody = |pid| Owner { user: None, pid };
        let others: Vec<_> = (0..OBSERVERS.of_user as u32).map(nobody).collect();
        let has_place = |newcomer| has_place(Purpose::Observe, newcomer, false, others.iter().copied());
        assert!(!has_place(nobody(999)));
        // The overflow number itself may be a user's where everybody is mapped.
        assert!(has_place(owner(65_534, 999)));
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
