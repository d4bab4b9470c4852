//! The unprivileged user that a process started by root becomes.

use nix::errno::Errno;
use nix::unistd::{Gid, Group, Uid, User as Entry, geteuid, getresuid, setgroups, setresgid, setresuid};
use thiserror::Error;

/// A user with one group, and no others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct User {
    /// As it was asked for.
    pub name: String,
    /// User id; never 0.
    pub uid: u32,
    /// Group id.
    pub gid: u32,
}

/// Why a process does not become a user.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum UserError {
    /// Nobody is called so.
    #[error(
        "there is no {what} \"{name}\" on this machine; use a name that `getent` knows, or numbers: \"UID:GID\""
    )]
    Unknown {
        /// "user" or "group".
        what: &'static str,
        /// What was given.
        name: String,
    },
    /// A number of which the machine knows no group.
    #[error("user {uid} has no entry on this machine, so its group is not known; write \"{uid}:GID\"")]
    NoGroup {
        /// What was given.
        uid: u32,
    },
    /// Root is whom to leave.
    #[error("\"{name}\" is root, and running as root is what this is to avoid; name another user")]
    Root {
        /// What was given.
        name: String,
    },
    /// The kernel refused.
    #[error(
        "cannot become user \"{name}\" (uid {uid}, gid {gid}) as user {own}: {cause}; start as root, or as that user"
    )]
    Refused {
        /// What was given.
        name: String,
        /// Its user id.
        uid: u32,
        /// Its group id.
        gid: u32,
        /// Who the process is.
        own: u32,
        /// What the kernel said.
        cause: Errno,
    },
}

impl User {
    /// Finds `NAME` or `UID`, and the group after a colon, by default the user's own.
    ///
    /// # Errors
    /// If there is no such user or group, or it is root.
    pub fn look_up(text: &str) -> Result<Self, UserError> {
        let (user, group) = text.split_once(':').map_or((text, None), |(user, group)| (user, Some(group)));
        let entry = match user.parse::<u32>() {
            Ok(uid) => Entry::from_uid(Uid::from_raw(uid)).ok().flatten(),
            Err(_) => Some(by_name(user)?),
        };
        let uid = match (&entry, user.parse::<u32>()) {
            (_, Ok(uid)) => uid,
            (Some(entry), Err(_)) => entry.uid.as_raw(),
            (None, Err(_)) => return Err(UserError::Unknown { what: "user", name: user.to_owned() }),
        };
        let gid = match (group, entry) {
            (Some(group), _) => group_id(group)?,
            (None, Some(entry)) => entry.gid.as_raw(),
            (None, None) => return Err(UserError::NoGroup { uid }),
        };
        if uid == 0 {
            return Err(UserError::Root { name: text.to_owned() });
        }
        Ok(Self { name: text.to_owned(), uid, gid })
    }

    /// Whether the process is this user already, and cannot be another.
    #[must_use]
    pub fn is_own(&self) -> bool {
        getresuid()
            .is_ok_and(|own| [own.real, own.effective, own.saved].iter().all(|uid| uid.as_raw() == self.uid))
    }

    /// Becomes this user, with all threads and for good; the former user's other groups go too.
    ///
    /// Clears what [`die_with_parent`](crate::process::die_with_parent) asked for, and makes the process's
    /// memory unreadable for that user's other processes.
    ///
    /// # Errors
    /// If the kernel refuses.
    pub fn become_for_good(&self) -> Result<(), UserError> {
        if self.is_own() {
            return Ok(());
        }
        let (uid, gid) = (Uid::from_raw(self.uid), Gid::from_raw(self.gid));
        // The C library does these for every thread; the group first, while there is the right to.
        let done =
            setgroups(&[gid]).and_then(|()| setresgid(gid, gid, gid)).and_then(|()| setresuid(uid, uid, uid));
        let own = geteuid().as_raw();
        done.map_err(|cause| UserError::Refused {
            name: self.name.clone(),
            uid: self.uid,
            gid: self.gid,
            own,
            cause,
        })
    }
}

fn by_name(name: &str) -> Result<Entry, UserError> {
    let unknown = || UserError::Unknown { what: "user", name: name.to_owned() };
    Entry::from_name(name).ok().flatten().ok_or_else(unknown)
}

/// Finds a group by name or number.
///
/// # Errors
/// If there is none of this name.
pub fn group_id(text: &str) -> Result<u32, UserError> {
    let unknown = || UserError::Unknown { what: "group", name: text.to_owned() };
    let by_name = || Group::from_name(text).ok().flatten().map(|group| group.gid.as_raw());
    text.parse().ok().or_else(by_name).ok_or_else(unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_is_named_or_numbered_with_or_without_a_group() {
        let user = |text: &str| User::look_up(text).map(|user| (user.uid, user.gid));
        assert_eq!(user("4711:815"), Ok((4711, 815)));
        assert_eq!(user("4711:root"), Ok((4711, 0)), "every machine has this group");
        // Every Linux distribution has this user; the number of its group differs.
        assert_eq!(user("nobody").map(|(uid, _)| uid), Ok(65534));
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_what_to_write() {
        let message = |text: &str| User::look_up(text).unwrap_err().to_string();
        assert!(
            message("no such user").starts_with("there is no user \"no such user\" on this machine; use")
        );
        assert!(message("4711:no such group").starts_with("there is no group \"no such group\""));
        assert_eq!(User::look_up("3999999999"), Err(UserError::NoGroup { uid: 3_999_999_999 }));
        assert_eq!(User::look_up("root"), Err(UserError::Root { name: "root".into() }));
        assert_eq!(User::look_up("0:1000"), Err(UserError::Root { name: "0:1000".into() }));
        assert!(message("").contains("no user \"\""));
    }
}
