//! Where the driver's socket lies.
//!
//! `$PHANTOM3_SOCKET` if set, else `driver.sock` in the first of: `$RUNTIME_DIRECTORY` (systemd),
//! `$XDG_RUNTIME_DIR/phantom3`, `/run/phantom3`. A driver creates it in the first of these that its
//! environment names; an application looks through all of them, for a driver that systemd started is not in
//! the user's own directory. A socket at which nobody listens is left over from a driver that died, and passed over
//! where another place has more.

use crate::socket_file;
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

/// The place that the environment names; then it is the only one.
pub fn named() -> Option<PathBuf> {
    named_by(&|name| std::env::var_os(name).map(PathBuf::from))
}

/// The driver's place for an application, without a word about sockets that were passed over.
pub fn for_application() -> PathBuf {
    find().socket
}

/// The driver's place for an application: the first place where something lies at which somebody may listen, else the
/// first that we are not allowed to look at (so that the permission is what gets reported), else the first socket that
/// is left over, else the preferred place.
pub fn find() -> Found {
    let places = candidates();
    match <[PathBuf; 1]>::try_from(places) {
        Ok([socket]) => Found { socket, left_over: Vec::new() },
        Err(places) => choose(places, look),
    }
}

/// The place at which the driver is looked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// The place.
    pub socket: PathBuf,
    /// Sockets of drivers that died, which lie in places that come before it.
    pub left_over: Vec<PathBuf>,
}

impl Found {
    /// The sockets that were passed over, for a person; `None`: there was none.
    pub fn words(&self) -> Option<String> {
        let names: Vec<String> = self.left_over.iter().map(|path| path.display().to_string()).collect();
        let socket = self.socket.display();
        (!names.is_empty()).then(|| {
            format!(
                "the driver at {socket} is taken; passed over, left over from one that died: {}",
                names.join(", ")
            )
        })
    }
}

/// State of a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum There {
    Something,
    /// A socket at which nobody listens.
    LeftOver,
    /// We may not look.
    Hidden,
    Nothing,
}

fn look(path: &Path) -> There {
    match std::fs::symlink_metadata(path) {
        Ok(_) if socket_file::is_left_over(path) => There::LeftOver,
        Ok(_) => There::Something,
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => There::Hidden,
        Err(_) => There::Nothing,
    }
}

fn choose(mut places: Vec<PathBuf>, look: impl Fn(&Path) -> There) -> Found {
    let seen: Vec<There> = places.iter().map(|path| look(path)).collect();
    let find = |wanted| seen.iter().position(|there| *there == wanted);
    let index = find(There::Something).or_else(|| find(There::Hidden)).or_else(|| find(There::LeftOver));
    let index = index.unwrap_or(0);
    let passed = places.iter().zip(&seen).take(index).filter(|(_, there)| **there == There::LeftOver);
    let left_over = passed.map(|(path, _)| path.clone()).collect();
    Found { socket: places.swap_remove(index), left_over }
}

fn named_by(variable: &impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    variable(SOCKET_VARIABLE).filter(|path| !path.as_os_str().is_empty())
}

fn candidates_from(variable: impl Fn(&str) -> Option<PathBuf>) -> Vec<PathBuf> {
    if let Some(path) = named_by(&variable) {
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
                Some(name) if name == there => There::Something,
                Some("/hidden") => There::Hidden,
                _ => There::Nothing,
            }
        };
        let chosen = |places, there| choose(places, look(there)).socket;
        assert_eq!(chosen(places(), "/there"), Path::new("/there"));
        assert_eq!(chosen(places(), "/nowhere"), Path::new("/hidden"));
        assert_eq!(chosen(vec!["/absent".into()], "/nowhere"), Path::new("/absent"));
    }

    #[test]
    #[cfg_attr(miri, ignore = "sockets and directories are the system's")]
    fn a_socket_that_is_left_over_is_chosen_only_where_no_other_place_has_more() {
        let directory = tempfile::tempdir().expect("a directory");
        let [stale, living, absent] = ["stale", "living", "absent"].map(|name| directory.path().join(name));
        drop(std::os::unix::net::UnixListener::bind(&stale).expect("a socket"));
        let _listener = std::os::unix::net::UnixListener::bind(&living).expect("a socket");
        let found = choose(vec![absent.clone(), stale.clone(), living.clone()], look);
        assert_eq!(found, Found { socket: living.clone(), left_over: vec![stale.clone()] });
        let words = found.words().expect("something was passed over");
        assert!([&living, &stale].iter().all(|path| words.contains(&*path.to_string_lossy())), "{words}");
        let first = choose(vec![living.clone(), stale.clone()], look);
        assert_eq!((&first.socket, first.words()), (&living, None));
        assert_eq!(choose(vec![absent, stale.clone()], look).socket, stale);
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
