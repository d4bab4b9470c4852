//! What a check may know of a machine: a tree of files, probes, and the loop that is to run there.
//!
//! Invariant: every text that comes out of here is text: no control characters but tab and line end, and none that is
//! invisible or turns the direction of writing, so that it may go to a terminal and into a comment of a script. Whatever
//! else lies in a file is an [`Obstacle`].

use super::probe::Probes;
use crate::cpu::parse_cpu_list;
use crate::installed::READ_BACK;
use crate::plain_text::is_harmful;
use crate::read_back::{ReadBack, Writers};
use std::fmt;
use std::io;
use std::str::FromStr;

/// The loop whose needs are asked about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoopSpec {
    /// The CPU it runs on.
    pub cpu: usize,
    /// `SCHED_FIFO` priority; none: not real-time.
    pub priority: Option<u8>,
    /// Length of a tick (ns).
    pub period_ns: u64,
    /// Phase of the tick against whole periods of the clock (ns).
    pub phase_offset_ns: u64,
}

/// Files of a machine, by absolute path.
pub trait Tree {
    /// The content of a file, at most [`MOST_BYTES`] of it.
    ///
    /// # Errors
    /// As the file system says.
    fn read(&self, path: &str) -> io::Result<Vec<u8>>;
    /// The names in a directory, sorted.
    ///
    /// # Errors
    /// As the file system says.
    fn list(&self, path: &str) -> io::Result<Vec<String>>;
    /// What a file is, without following a link.
    ///
    /// # Errors
    /// As the file system says.
    fn status(&self, path: &str) -> io::Result<FileStatus>;
    /// Where a symbolic link points.
    ///
    /// # Errors
    /// As the file system says.
    fn link(&self, path: &str) -> io::Result<String>;
}

/// No file that is looked at needs more; `/proc/stat` and `/proc/cpuinfo` of large machines come near.
pub const MOST_BYTES: usize = 4 << 20;

/// Owner and permissions of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileStatus {
    /// Permission bits, with set-id and sticky bits.
    pub mode: u32,
    /// User id of the owner.
    pub uid: u32,
    /// Group id.
    pub gid: u32,
    /// Whether it is a directory.
    pub is_directory: bool,
}

/// Why something could not be known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Obstacle {
    /// No such file.
    Absent(String),
    /// Not for this user, or for nobody under lockdown.
    Denied(String),
    /// Something else than what the kernel writes there.
    Garbled {
        /// The file.
        path: String,
        /// What lies there, cut and cleaned.
        found: String,
    },
    /// The system said something else.
    Failed {
        /// The file.
        path: String,
        /// What it said.
        error: String,
    },
}

impl Obstacle {
    fn of(path: &str, error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => Self::Absent(path.into()),
            io::ErrorKind::PermissionDenied => Self::Denied(path.into()),
            _ => Self::Failed { path: path.into(), error: error.to_string() },
        }
    }

    /// Content that makes no sense.
    pub fn garbled(path: impl Into<String>, found: &str) -> Self {
        Self::Garbled { path: path.into(), found: one_line(found, 40) }
    }

    pub(super) fn way_round(&self) -> String {
        match self {
            Self::Absent(path) => format!("look whether this kernel offers {path} at all"),
            Self::Denied(_) => {
                "run the doctor as root; what the kernel locks down root may not read either".into()
            }
            Self::Garbled { path, .. } => format!("look at {path} yourself"),
            Self::Failed { path, .. } => format!("look at {path} yourself"),
        }
    }
}

impl fmt::Display for Obstacle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Absent(path) => write!(f, "{path} does not exist"),
            Self::Denied(path) => write!(f, "{path}: permission denied"),
            Self::Garbled { path, found } => write!(f, "{path} says \"{found}\", which makes no sense"),
            Self::Failed { path, error } => write!(f, "{path}: {error}"),
        }
    }
}

/// A machine and the loop that is to run there.
#[derive(Clone, Copy)]
pub struct Machine<'a> {
    /// Its files.
    pub tree: &'a dyn Tree,
    /// What can be tried on it.
    pub probes: &'a dyn Probes,
    /// The loop.
    pub spec: &'a LoopSpec,
}

impl fmt::Debug for Machine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Machine").field("spec", self.spec).finish_non_exhaustive()
    }
}

impl Machine<'_> {
    /// The text of a file.
    ///
    /// # Errors
    /// Why there is none.
    pub fn text(&self, path: &str) -> Result<String, Obstacle> {
        let bytes = self.tree.read(path).map_err(|error| Obstacle::of(path, &error))?;
        let garbled = |bytes: &[u8]| Obstacle::garbled(path, &String::from_utf8_lossy(bytes));
        let text = String::from_utf8(bytes).map_err(|error| garbled(error.as_bytes()))?;
        let odd = text.chars().any(|c| is_harmful(c) && !matches!(c, '\n' | '\t'));
        if odd { Err(garbled(text.as_bytes())) } else { Ok(text) }
    }

    /// The text of a file that need not exist.
    ///
    /// # Errors
    /// Why it cannot be known, though it exists.
    pub fn text_if_any(&self, path: &str) -> Result<Option<String>, Obstacle> {
        if_any(self.text(path))
    }

    /// The one line that a file holds, without its end.
    ///
    /// # Errors
    /// Why there is none.
    pub fn line(&self, path: &str) -> Result<String, Obstacle> {
        let text = self.text(path)?;
        let line = text.trim();
        match line.is_empty() || line.contains('\n') {
            true => Err(Obstacle::garbled(path, line)),
            false => Ok(line.to_owned()),
        }
    }

    /// The number that a file holds.
    ///
    /// # Errors
    /// Why there is none.
    pub fn number<T: FromStr>(&self, path: &str) -> Result<T, Obstacle> {
        let line = self.line(path)?;
        line.parse().map_err(|_| Obstacle::garbled(path, &line))
    }

    /// The on-or-off that a file holds as 1 or 0.
    ///
    /// # Errors
    /// Why there is none.
    pub fn switch(&self, path: &str) -> Result<bool, Obstacle> {
        match self.number::<u8>(path)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(Obstacle::garbled(path, &other.to_string())),
        }
    }

    /// The word in brackets of a file such as `always [madvise] never`.
    ///
    /// # Errors
    /// Why there is none.
    pub fn chosen(&self, path: &str) -> Result<String, Obstacle> {
        let line = self.line(path)?;
        let chosen = line.split_once('[').and_then(|(_, rest)| rest.split_once(']')).map(|(word, _)| word);
        chosen.map(str::to_owned).ok_or_else(|| Obstacle::garbled(path, &line))
    }

    /// The CPUs in a list such as `0-3,8`; empty where the kernel writes `(null)` or nothing.
    ///
    /// # Errors
    /// Why there is none.
    pub fn cpu_list(&self, path: &str) -> Result<Vec<usize>, Obstacle> {
        let text = self.text(path)?;
        match text.trim() {
            "(null)" => Ok(Vec::new()),
            list => parse_cpu_list(list).ok_or_else(|| Obstacle::garbled(path, list)),
        }
    }

    /// The names in a directory; none where there is no such directory.
    ///
    /// # Errors
    /// Why they cannot be known.
    pub fn names(&self, path: &str) -> Result<Vec<String>, Obstacle> {
        let names = self.tree.list(path).map_err(|error| Obstacle::of(path, &error));
        Ok(if_any(names)?.unwrap_or_default())
    }

    /// Owner and permissions of a file.
    ///
    /// # Errors
    /// Why they cannot be known.
    pub fn status(&self, path: &str) -> Result<FileStatus, Obstacle> {
        self.tree.status(path).map_err(|error| Obstacle::of(path, &error))
    }

    /// Whether something lies there that can be seen.
    #[must_use]
    pub fn exists(&self, path: &str) -> bool {
        self.tree.status(path).is_ok()
    }

    /// The last part of where a link points, if it is one.
    #[must_use]
    pub fn link_name(&self, path: &str) -> Option<String> {
        let target = self.tree.link(path).ok()?;
        let name = target.rsplit('/').next()?;
        (!name.is_empty()).then(|| one_line(name, 80))
    }

    /// What root has set, read back and published, if that may be believed.
    #[must_use]
    pub fn read_back(&self) -> Option<ReadBack> {
        let writers = |path: &str| {
            self.status(path).ok().map(|s| (s.is_directory, Writers { uid: s.uid, mode: s.mode }))
        };
        let (directory, _) = READ_BACK.rsplit_once('/')?;
        let (true, directory) = writers(directory)? else { return None };
        let (false, file) = writers(READ_BACK)? else { return None };
        ReadBack::believed(directory, file, self.text(READ_BACK).ok()?)
    }

    /// The CPUs that are switched on.
    ///
    /// # Errors
    /// Why they cannot be known.
    pub fn online_cpus(&self) -> Result<Vec<usize>, Obstacle> {
        let cpus = self.cpu_list("/sys/devices/system/cpu/online")?;
        match cpus.is_empty() {
            true => Err(Obstacle::garbled("/sys/devices/system/cpu/online", "")),
            false => Ok(cpus),
        }
    }

    /// The value of the last `key=value` on the kernel's command line; empty for a bare `key`.
    ///
    /// # Errors
    /// Why the command line cannot be known.
    pub fn boot_parameter(&self, key: &str) -> Result<Option<String>, Obstacle> {
        let line = self.text("/proc/cmdline")?;
        let value = |word: &str| match word.split_once('=') {
            Some((name, value)) => (name == key).then(|| value.to_owned()),
            None => (word == key).then(String::new),
        };
        Ok(line.split_whitespace().filter_map(value).next_back())
    }

    /// Whether a hypervisor runs it: x86 CPUs say so, Xen has a file, and elsewhere the firmware names itself.
    ///
    /// # Errors
    /// Why that cannot be known.
    pub fn is_virtual(&self) -> Result<bool, Obstacle> {
        let info = self.text("/proc/cpuinfo")?;
        let flags = info.lines().find_map(|line| {
            let (key, flags) = line.split_once(':')?;
            matches!(key.trim(), "flags" | "Features").then(|| flags.to_owned())
        });
        let flags = flags.ok_or_else(|| Obstacle::garbled("/proc/cpuinfo", &info))?;
        let flagged = flags.split_whitespace().any(|flag| flag == "hypervisor");
        Ok(flagged || self.exists("/sys/hypervisor/type") || self.is_called_virtual()?)
    }

    /// By the names that hypervisors give to their make-believe firmware.
    fn is_called_virtual(&self) -> Result<bool, Obstacle> {
        const NAMES: [&str; 7] = ["Virtual Machine", "VirtualBox", "VMware", "QEMU", "KVM", "Xen", "Bochs"];
        for file in ["/sys/class/dmi/id/product_name", "/sys/class/dmi/id/sys_vendor"] {
            let text = self.text_if_any(file)?.unwrap_or_default();
            if NAMES.iter().any(|name| text.contains(name)) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// An absent file is no obstacle where none need be.
pub(super) fn if_any<T>(result: Result<T, Obstacle>) -> Result<Option<T>, Obstacle> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Obstacle::Absent(_)) => Ok(None),
        Err(obstacle) => Err(obstacle),
    }
}

/// Foreign text as one harmless line of at most so many characters.
#[must_use]
pub fn one_line(text: &str, most: usize) -> String {
    let clean = text.trim().chars().map(|c| if is_harmful(c) { '?' } else { c });
    let mut line: String = clean.take(most).collect();
    if text.trim().chars().count() > most {
        line.push_str("...");
    }
    line
}
