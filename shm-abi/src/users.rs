//! Users as this process can tell them apart.
//!
//! Problem: in a user namespace (a container without root's rights) all users that it does not map have one number, the
//! overflow one. Whoever compares numbers takes them for the same person.
//! Model: where not every user is mapped, the overflow number is nobody's: whoever has it owns nothing here.

use std::fmt;
use std::fs;
use std::sync::OnceLock;

/// The user of this number, if it is one user's alone.
pub fn known_user(uid: u32) -> Option<u32> {
    (shared_number() != Some(uid)).then_some(uid)
}

/// A user in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UserWords(pub Option<u32>);

impl fmt::Display for UserWords {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(uid) => write!(f, "user {uid}"),
            None => f.write_str("a user of another namespace"),
        }
    }
}

/// Reads what [`known_user`] has to know, for a process that may read no files later.
pub(crate) fn look() {
    shared_number();
}

/// The number that several users may have.
fn shared_number() -> Option<u32> {
    static NUMBER: OnceLock<Option<u32>> = OnceLock::new();
    *NUMBER.get_or_init(|| {
        let read = |path| fs::read_to_string(path).unwrap_or_default();
        shared_number_of(&read("/proc/self/uid_map"), &read("/proc/sys/kernel/overflowuid"))
    })
}

/// By the texts of both files. Where they cannot be read, a number is rather nobody's than that of two.
fn shared_number_of(uid_map: &str, overflow: &str) -> Option<u32> {
    let counts = uid_map.lines().filter_map(|line| line.split_whitespace().nth(2)?.parse::<u64>().ok());
    let are_all_mapped = counts.sum::<u64>() == u64::from(u32::MAX);
    (!are_all_mapped).then(|| overflow.trim().parse().unwrap_or(USUAL))
}

/// Of `nobody`, as long as nobody sets another one.
const USUAL: u32 = 65_534;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_not_every_user_is_mapped_the_overflow_number_is_nobodys() {
        let all = "         0          0 4294967295\n";
        assert_eq!(shared_number_of(all, "65534\n"), None);
        // `unshare --map-root-user`, a container of podman's, and one without a map.
        let podman = "         0       1005          1\n         1     100000      65536\n";
        for map in ["         0       1005          1\n", podman, ""] {
            assert_eq!(shared_number_of(map, "65534\n"), Some(65_534), "{map:?}");
            assert_eq!(shared_number_of(map, "1234\n"), Some(1234), "{map:?}");
        }
        assert_eq!(shared_number_of("", ""), Some(65_534), "nothing can be read");
    }

    #[test]
    fn a_user_is_told_by_its_number_if_that_is_its_own() {
        assert_eq!(UserWords(Some(7)).to_string(), "user 7");
        assert_eq!(UserWords(None).to_string(), "a user of another namespace");
    }
}
