//! Rights to look, command and administer, among those who can reach the driver's socket.
//!
//! Model: three rights, each of which includes those before it, and for each the group that has it. A right without a
//! group of its own belongs to whoever has the one before; to look belongs to whoever can connect. Root and the
//! driver's own user have all of them. Whoever may look may stop the motors.

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
    /// The group for [`Right::Administer`]; `None`: whoever may command.
    pub administer: Option<u32>,
}

impl Rights {
    /// Whoever can connect may do everything.
    pub fn open() -> Self {
        let owner = rustix::process::geteuid().as_raw();
        Self { owner, look: None, command: None, administer: None }
    }

    /// Whether a user in these groups has a right; if not, the group that has it.
    ///
    /// # Errors
    /// The group.
    pub fn check(&self, right: Right, uid: u32, groups: impl FnOnce() -> Vec<u32>) -> Result<(), u32> {
        let by_right = [self.look, self.command, self.administer];
        let Some(needed) = by_right[..=right as usize].iter().rev().find_map(|group| *group) else {
            return Ok(());
        };
        if uid == 0 || uid == self.owner {
            return Ok(());
        }
        let groups = groups();
        // Those with a greater right have this one.
        let higher = by_right[right as usize..].iter().flatten();
        if groups.contains(&needed) || higher.into_iter().any(|group| groups.contains(group)) {
            return Ok(());
        }
        Err(needed)
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
    fn allowed(rights: Rights, uid: u32, groups: &[u32]) -> [Result<(), u32>; 3] {
        [Right::Look, Right::Command, Right::Administer]
            .map(|right| rights.check(right, uid, || groups.to_vec()))
    }

    #[test]
    fn without_groups_whoever_connects_may_everything() {
        assert_eq!(allowed(rights(None, None, None), ANN, &[]), [Ok(()); 3]);
    }

    #[test]
    fn a_right_without_a_group_belongs_to_whoever_has_the_one_before_it() {
        let rights = rights(None, Some(20), None);
        assert_eq!(allowed(rights, ANN, &[20]), [Ok(()); 3]);
        assert_eq!(allowed(rights, ANN, &[21]), [Ok(()), Err(20), Err(20)]);
    }

    #[test]
    fn each_right_includes_those_before_it_and_none_behind_it() {
        let rights = rights(Some(10), Some(20), Some(30));
        assert_eq!(allowed(rights, ANN, &[]), [Err(10), Err(20), Err(30)]);
        assert_eq!(allowed(rights, ANN, &[10]), [Ok(()), Err(20), Err(30)]);
        assert_eq!(allowed(rights, ANN, &[20]), [Ok(()), Ok(()), Err(30)]);
        assert_eq!(allowed(rights, ANN, &[5, 30]), [Ok(()); 3]);
    }

    #[test]
    fn root_and_the_drivers_own_user_may_everything() {
        let rights = rights(Some(10), Some(20), Some(30));
        assert_eq!(allowed(rights, 0, &[]), [Ok(()); 3]);
        assert_eq!(allowed(rights, OWNER, &[]), [Ok(()); 3]);
    }
}
