//! Rights to look, command and administer, among those who can reach the driver's socket.
//!
//! Model: three rights, each of which includes those before it, and for each the group that has it. Root and the
//! driver's own user have all of them; without a group of its own, administering is theirs alone, commanding belongs to
//! whoever may look, and looking to whoever can connect. Whoever may look may stop the motors.

use crate::handshake::RequestKind;

/// What somebody may do; each includes those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Right {
    /// See the frames, and stop the motors.
    Look,
    /// Command the devices, zero them, leave a fault.
    Command,
    /// End the driver, the lease of somebody else, the emergency stop of somebody else.
    Administer,
}

impl Right {
    /// What a request needs, whoever's lease or stop it is about.
    pub fn for_request(kind: RequestKind) -> Self {
        match kind {
            // That a lease ends whoever holds it may ask, too.
            RequestKind::Observe | RequestKind::EmergencyStop | RequestKind::EndLease => Self::Look,
            RequestKind::Command | RequestKind::Zero | RequestKind::ClearFault => Self::Command,
            RequestKind::Stop => Self::Administer,
        }
    }
}

/// Which groups have which rights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rights {
    /// The user that has all of them, besides root.
    pub owner: u32,
    /// The group for [`Right::Look`]; `None`: whoever can connect.
    pub look: Option<u32>,
    /// The group for [`Right::Command`]; `None`: whoever may look.
    pub command: Option<u32>,
    /// The group for [`Right::Administer`]; `None`: only root and the owner.
    pub administer: Option<u32>,
}

impl Rights {
    /// Whoever can connect may look and command; the process' own user administers.
    pub fn open() -> Self {
        let owner = rustix::process::geteuid().as_raw();
        Self { owner, look: None, command: None, administer: None }
    }

    /// Checks that a user in these groups has a right; of one who cannot be told from others only the groups count.
    ///
    /// # Errors
    /// The group that has it, if it is anybody's but root's and the owner's.
    pub fn check(
        &self,
        right: Right,
        user: Option<u32>,
        groups: impl FnOnce() -> Vec<u32>,
    ) -> Result<(), Option<u32>> {
        if user.is_some_and(|uid| uid == 0 || uid == self.owner) {
            return Ok(());
        }
        let needed = match right {
            Right::Look => self.look,
            Right::Command => self.command.or(self.look),
            Right::Administer => Some(self.administer.ok_or(None)?),
        };
        let Some(needed) = needed else { return Ok(()) };
        let groups = groups();
        // Those with a greater right have this one.
        let greater = [self.look, self.command, self.administer].into_iter().skip(right as usize).flatten();
        if std::iter::once(needed).chain(greater).any(|group| groups.contains(&group)) {
            return Ok(());
        }
        Err(Some(needed))
    }

    /// Checks that a user in these groups may end the lease of `holder`: one's own anybody may who reaches the socket.
    ///
    /// # Errors
    /// As of [`check`](Self::check), for [`Right::Administer`].
    pub fn check_end_of_lease(
        &self,
        holder: Option<u32>,
        user: Option<u32>,
        groups: impl FnOnce() -> Vec<u32>,
    ) -> Result<(), Option<u32>> {
        let is_own = user.is_some() && user == holder;
        if is_own { Ok(()) } else { self.check(Right::Administer, user, groups) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OWNER: u32 = 7;
    const ANN: u32 = 1000;

    fn rights(look: Option<u32>, command: Option<u32>, administer: Option<u32>) -> Rights {
        Rights { owner: OWNER, look, command, administer }
    }

    /// What somebody in these groups may do.
    fn allowed(rights: Rights, uid: u32, groups: &[u32]) -> [Result<(), Option<u32>>; 3] {
        [Right::Look, Right::Command, Right::Administer]
            .map(|right| rights.check(right, Some(uid), || groups.to_vec()))
    }

    #[test]
    fn without_groups_whoever_connects_may_look_and_command() {
        assert_eq!(allowed(rights(None, None, None), ANN, &[5]), [Ok(()), Ok(()), Err(None)]);
    }

    #[test]
    fn to_command_belongs_to_whoever_may_look_and_to_administer_to_nobody_unless_there_is_a_group() {
        let commanders = rights(None, Some(20), None);
        assert_eq!(allowed(commanders, ANN, &[20]), [Ok(()), Ok(()), Err(None)]);
        assert_eq!(allowed(commanders, ANN, &[21]), [Ok(()), Err(Some(20)), Err(None)]);
        let lookers = rights(Some(10), None, Some(30));
        assert_eq!(allowed(lookers, ANN, &[10]), [Ok(()), Ok(()), Err(Some(30))]);
        assert_eq!(allowed(lookers, ANN, &[]), [Err(Some(10)), Err(Some(10)), Err(Some(30))]);
    }

    #[test]
    fn each_right_includes_those_before_it_and_none_behind_it() {
        let rights = rights(Some(10), Some(20), Some(30));
        assert_eq!(allowed(rights, ANN, &[]), [Err(Some(10)), Err(Some(20)), Err(Some(30))]);
        assert_eq!(allowed(rights, ANN, &[10]), [Ok(()), Err(Some(20)), Err(Some(30))]);
        assert_eq!(allowed(rights, ANN, &[20]), [Ok(()), Ok(()), Err(Some(30))]);
        assert_eq!(allowed(rights, ANN, &[5, 30]), [Ok(()); 3]);
    }

    #[test]
    fn a_lease_is_ended_by_its_holders_user_and_by_administrators() {
        let rights = rights(None, None, Some(30));
        let may = |uid, groups: &[u32]| rights.check_end_of_lease(Some(ANN), Some(uid), || groups.to_vec());
        assert_eq!(may(ANN, &[]), Ok(()));
        assert_eq!([0, OWNER].map(|uid| may(uid, &[])), [Ok(()); 2]);
        assert_eq!(may(ANN + 1, &[]), Err(Some(30)));
        assert_eq!(may(ANN + 1, &[30]), Ok(()));
    }

    /// Two of them are not the same, and the driver's own user is none of them.
    #[test]
    fn whoever_cannot_be_told_from_others_owns_nothing_and_has_the_rights_of_the_groups() {
        let rights = Rights { owner: 65_534, ..rights(None, None, Some(30)) };
        let may = |holder, groups: &[u32]| rights.check_end_of_lease(holder, None, || groups.to_vec());
        for holder in [None, Some(65_534), Some(ANN)] {
            assert_eq!(may(holder, &[]), Err(Some(30)), "{holder:?}");
            assert_eq!(may(holder, &[30]), Ok(()), "{holder:?}");
        }
        assert_eq!(rights.check(Right::Administer, None, Vec::new), Err(Some(30)));
        assert_eq!(rights.check(Right::Command, None, Vec::new), Ok(()));
    }

    #[test]
    fn root_and_the_drivers_own_user_may_everything() {
        for rights in [rights(None, None, None), rights(Some(10), Some(20), Some(30))] {
            assert_eq!(allowed(rights, 0, &[]), [Ok(()); 3]);
            assert_eq!(allowed(rights, OWNER, &[]), [Ok(()); 3]);
        }
    }
}
