//! Where the driver's socket lies.
//!
//! `$PHANTOM3_SOCKET` if set, else `driver.sock` in the first of: `$RUNTIME_DIRECTORY` (systemd),
//! `$XDG_RUNTIME_DIR/phantom3`, `/run/phantom3`. A driver creates it in the first of these that its
//! environment names; an application looks through all of them, for a driver that systemd started is not in
//! the user's own directory.

use std::io;
use std::path::{Path, PathBuf};

/// Overrides every other place.
pub const SOCKET_VARIABLE: &str = "PHANTOM3_SOCKET";
/// The directory where a system-wide driver lies.
pub const SYSTEM_DIRECTORY: &str = "/run/phantom3";
const SOCKET_NAME: &str = "driver.sock";

/// Every place where a driver's socket may lie, the preferred one first; never empty.
pub fn candidates() -> Vec<PathBuf> {
    candidates_from(|name| std::env::var_os(name).map(PathBuf::from))
}

/// Where a new driver puts its socket.
pub fn for_driver() -> PathBuf {
    candidates().swap_remove(0)
}

/// Where an application finds the driver: the first place where something lies, else the first that we are
/// not allowed to look at (so that the permission is what gets reported), else the preferred one.
pub fn for_application() -> PathBuf {
    choose(candidates(), |path| std::fs::symlink_metadata(path).map(|_| ()))
}

fn choose(mut places: Vec<PathBuf>, look: impl Fn(&Path) -> io::Result<()>) -> PathBuf {
    let is_hidden = |path: &Path| look(path).is_err_and(|e| e.kind() == io::ErrorKind::PermissionDenied);
    let found = places
        .iter()
        .position(|path| look(path).is_ok())
        .or_else(|| places.iter().position(|path| is_hidden(path)));
    places.swap_remove(found.unwrap_or(0))
}

fn candidates_from(variable: impl Fn(&str) -> Option<PathBuf>) -> Vec<PathBuf> {
    if let Some(path) = variable(SOCKET_VARIABLE).filter(|path| !path.as_os_str().is_empty()) {
        return vec![path];
    }
    // Systemd lists several runtime directories separated by colons; the first is ours.
    let systemd = variable("RUNTIME_DIRECTORY").and_then(|list| {
        list.to_str()?.split(':').next().filter(|first| !first.is_empty()).map(PathBuf::from)
    });
    let user =
        variable("XDG_RUNTIME_DIR").filter(|path| path.is_absolute()).map(|path| path.join("phantom3"));
    let mut directories: Vec<PathBuf> = systemd.into_iter().chain(user).collect();
    directories.push(Path::new(SYSTEM_DIRECTORY).to_path_buf());
    directories.dedup();
    directories.into_iter().map(|directory| directory.join(SOCKET_NAME)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(pairs: &[(&str, &str)]) -> Vec<PathBuf> {
        candidates_from(|name| {
            pairs.iter().find(|(key, _)| *key == name).map(|(_, value)| PathBuf::from(value))
        })
    }

    #[test]
    fn the_explicit_variable_is_the_only_place() {
        assert_eq!(with(&[("PHANTOM3_SOCKET", "/a/b"), ("XDG_RUNTIME_DIR", "/x")]), [PathBuf::from("/a/b")]);
    }

    #[test]
    fn an_empty_variable_counts_as_unset() {
        assert_eq!(with(&[("PHANTOM3_SOCKET", "")]), [PathBuf::from("/run/phantom3/driver.sock")]);
    }

    #[test]
    fn a_place_that_is_hidden_from_us_is_chosen_before_one_where_nothing_lies() {
        let places = || vec![PathBuf::from("/absent"), PathBuf::from("/hidden"), PathBuf::from("/there")];
        let look = |there: &'static str| {
            move |path: &Path| match path.to_str() {
                Some(name) if name == there => Ok(()),
                Some("/hidden") => Err(io::ErrorKind::PermissionDenied.into()),
                _ => Err(io::ErrorKind::NotFound.into()),
            }
        };
        assert_eq!(choose(places(), look("/there")), Path::new("/there"));
        assert_eq!(choose(places(), look("/nowhere")), Path::new("/hidden"));
        assert_eq!(choose(vec!["/absent".into()], look("/nowhere")), Path::new("/absent"));
    }

    #[test]
    fn systemd_comes_before_the_user_and_the_system_last() {
        assert_eq!(
            with(&[("RUNTIME_DIRECTORY", "/run/one:/run/two"), ("XDG_RUNTIME_DIR", "/run/user/7")]),
            [
                PathBuf::from("/run/one/driver.sock"),
                PathBuf::from("/run/user/7/phantom3/driver.sock"),
                PathBuf::from("/run/phantom3/driver.sock"),
            ]
        );
        assert_eq!(with(&[]), [PathBuf::from("/run/phantom3/driver.sock")]);
    }
}
