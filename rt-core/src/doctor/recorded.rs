//! A machine as one compact text: files, links, permissions and the outcomes of probes.
//!
//! ```text
//! # a comment, before the first entry
//! === /proc/sys/kernel/osrelease
//! 6.12.0-rt
//! === /proc/irq/24/smp_affinity_list mode 0444
//! 3
//! === /dev/cpu_dma_latency mode 0660 uid 0 gid 29
//! === /run/phantom3/ mode 0750
//! === /sys/bus/pci/devices/0000:03:00.0/driver -> ../../../bus/pci/drivers/phantom
//! === /sys/kernel/debug denied
//! === probe promotion
//! placed=ok asked=ok policy=1 priority=80 limit=99
//! ```
//! A path that ends in `/` is a directory (those that hold a file need no entry), `denied` hides a
//! path and all below it, `removed` takes away what an earlier entry put there. Contents go up to the next
//! entry.

use super::machine::{FileStatus, Tree};
use super::probe::{GapProbe, LockProbe, Probes, PromotionProbe};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::str::FromStr;
use std::time::Duration;

/// One file of a recorded machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Entry {
    /// Content, permissions.
    File(Vec<u8>, FileStatus),
    /// An explicit directory.
    Directory(FileStatus),
    /// Where it points.
    Link(String),
    /// May not be looked at, nor anything below.
    Denied,
}

/// A recorded machine.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RecordedMachine {
    /// Files by path.
    pub files: BTreeMap<String, Entry>,
    /// Outcomes of probes by name: `key=value` pairs.
    pub probes: BTreeMap<String, String>,
}

impl FromStr for RecordedMachine {
    type Err = String;

    /// Reads the format above.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut machine = Self::default();
        let start =
            if text.starts_with("=== ") { 0 } else { text.find("\n=== ").map_or(text.len(), |at| at + 1) };
        for block in text[start..].split_inclusive('\n').fold(Vec::<String>::new(), add_line) {
            let (head, body) = block.split_once('\n').unwrap_or((&block, ""));
            machine.add(head.trim_start_matches("=== ").trim(), body)?;
        }
        Ok(machine)
    }
}

fn add_line(mut blocks: Vec<String>, line: &str) -> Vec<String> {
    match blocks.last_mut() {
        Some(block) if !line.starts_with("=== ") => block.push_str(line),
        _ => blocks.push(line.to_owned()),
    }
    blocks
}

impl RecordedMachine {
    fn add(&mut self, head: &str, body: &str) -> Result<(), String> {
        if let Some(name) = head.strip_prefix("probe ") {
            self.probes.insert(name.to_owned(), body.trim().to_owned());
            return Ok(());
        }
        if let Some((path, target)) = head.split_once(" -> ") {
            self.files.insert(path.to_owned(), Entry::Link(target.to_owned()));
            return Ok(());
        }
        let mut words = head.split(' ');
        let path = words.next().unwrap_or_default();
        let is_directory = path.ends_with('/');
        let mut status =
            FileStatus { mode: if is_directory { 0o755 } else { 0o644 }, uid: 0, gid: 0, is_directory };
        while let Some(word) = words.next() {
            let value =
                if matches!(word, "denied" | "removed") { "" } else { words.next().unwrap_or_default() };
            let number =
                |radix| u32::from_str_radix(value, radix).map_err(|e| format!("{head}: {value}: {e}"));
            match word {
                "denied" => {
                    self.files.insert(path.to_owned(), Entry::Denied);
                    return Ok(());
                }
                "removed" => {
                    self.remove(path);
                    return Ok(());
                }
                "mode" => status.mode = number(8)?,
                "uid" => status.uid = number(10)?,
                "gid" => status.gid = number(10)?,
                _ => return Err(format!("{head}: unknown word {word}")),
            }
        }
        let entry = if is_directory { Entry::Directory(status) } else { Entry::File(body.into(), status) };
        self.files.insert(path.trim_end_matches('/').to_owned(), entry);
        Ok(())
    }

    /// Puts a content in place of a file's, or makes the file.
    pub fn set(&mut self, path: &str, content: impl Into<Vec<u8>>) {
        let status = match self.files.get(path) {
            Some(Entry::File(_, status)) => *status,
            _ => FileStatus { mode: 0o644, uid: 0, gid: 0, is_directory: false },
        };
        self.files.insert(path.to_owned(), Entry::File(content.into(), status));
    }

    /// Removes a path and all below it.
    pub fn remove(&mut self, path: &str) {
        let below = format!("{path}/");
        self.files.retain(|name, _| name != path && !name.starts_with(&below));
    }

    fn find(&self, path: &str) -> io::Result<&Entry> {
        let hidden = ancestors(path).any(|place| self.files.get(place) == Some(&Entry::Denied));
        if hidden {
            return Err(io::ErrorKind::PermissionDenied.into());
        }
        self.files.get(path).ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn outcome(&self, probe: &str) -> Result<Outcome<'_>, String> {
        let text = self.probes.get(probe).ok_or_else(|| "not recorded".to_owned())?;
        match text.strip_prefix("error ") {
            Some(error) => Err(error.to_owned()),
            None => Ok(Outcome(text)),
        }
    }
}

/// A path and the directories it lies in.
fn ancestors(path: &str) -> impl Iterator<Item = &str> {
    let ends = path.char_indices().filter(|(at, c)| *c == '/' && *at > 0).map(|(at, _)| &path[..at]);
    ends.chain([path])
}

impl Tree for RecordedMachine {
    fn read(&self, path: &str) -> io::Result<Vec<u8>> {
        match self.find(path)? {
            Entry::File(content, _) => Ok(content.clone()),
            _ => Err(io::ErrorKind::IsADirectory.into()),
        }
    }

    fn list(&self, path: &str) -> io::Result<Vec<String>> {
        if let Err(error) = self.find(path)
            && error.kind() == io::ErrorKind::PermissionDenied
        {
            return Err(error);
        }
        let below = format!("{path}/");
        let inside = self.files.keys().filter_map(|name| name.strip_prefix(&below));
        let names: BTreeSet<String> =
            inside.filter_map(|rest| rest.split('/').next()).map(str::to_owned).collect();
        match names.is_empty() && !self.files.contains_key(path) {
            true => Err(io::ErrorKind::NotFound.into()),
            false => Ok(names.into_iter().collect()),
        }
    }

    fn status(&self, path: &str) -> io::Result<FileStatus> {
        match self.find(path) {
            Ok(Entry::File(_, status) | Entry::Directory(status)) => Ok(*status),
            Ok(_) => Ok(FileStatus { mode: 0o777, uid: 0, gid: 0, is_directory: false }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                self.list(path).map(|_| FileStatus { mode: 0o755, uid: 0, gid: 0, is_directory: true })
            }
            Err(error) => Err(error),
        }
    }

    fn link(&self, path: &str) -> io::Result<String> {
        match self.find(path)? {
            Entry::Link(target) => Ok(target.clone()),
            _ => Err(io::ErrorKind::InvalidInput.into()),
        }
    }
}

/// `key=value` pairs of a probe's outcome.
struct Outcome<'a>(&'a str);

impl Outcome<'_> {
    fn value(&self, key: &str) -> Option<&str> {
        self.0.split_whitespace().find_map(|pair| pair.strip_prefix(key)?.strip_prefix('='))
    }

    fn number<T: FromStr>(&self, key: &str) -> Option<T> {
        self.value(key)?.parse().ok()
    }

    /// `ok` or an errno.
    fn answer(&self, key: &str) -> Result<(), i32> {
        match self.value(key) {
            Some("ok") => Ok(()),
            other => Err(other.and_then(|errno| errno.parse().ok()).unwrap_or(libc::EINVAL)),
        }
    }
}

impl Probes for RecordedMachine {
    fn promotion(&self, _cpu: usize, _priority: u8) -> PromotionProbe {
        let outcome = self.outcome("promotion").unwrap_or(Outcome(""));
        let found = outcome.number("policy").zip(outcome.number("priority"));
        PromotionProbe {
            placed: outcome.answer("placed"),
            asked: outcome.answer("asked"),
            found: found.ok_or(libc::EINVAL),
            rtprio_limit: outcome.number("limit").unwrap_or(0),
        }
    }

    fn memory_lock(&self) -> LockProbe {
        let outcome = self.outcome("memory_lock").unwrap_or(Outcome(""));
        let kib = |key: &str| outcome.value(key).unwrap_or("?").to_owned();
        LockProbe {
            asked: outcome.answer("asked"),
            status: format!("VmLck:\t{} kB\nVmRSS:\t{} kB\n", kib("locked"), kib("resident")),
            limit: outcome.number("limit"),
        }
    }

    fn gaps(&self, _cpu: usize, _length: Duration) -> Result<GapProbe, String> {
        let outcome = self.outcome("gaps")?;
        let number = |key| outcome.number(key).ok_or_else(|| format!("no {key} recorded"));
        Ok(GapProbe {
            largest_ns: number("largest_ns")?,
            long_gaps: number("long_gaps")?,
            was_fifo: number("fifo")? == 1,
            preemptions: number("preemptions")?,
            smi: outcome.number("smi"),
        })
    }

    fn loop_faults(&self, _cpu: usize) -> Result<u64, String> {
        self.outcome("loop_faults")?.number("faults").ok_or_else(|| "not recorded".to_owned())
    }

    fn held_dma_latency_us(&self) -> Result<i32, String> {
        self.outcome("dma_latency")?.number("us").ok_or_else(|| "not recorded".to_owned())
    }

    fn kernel_tick_ns(&self) -> Result<u64, String> {
        self.outcome("kernel_tick")?.number("ns").ok_or_else(|| "not recorded".to_owned())
    }

    fn smi_count(&self, _cpu: usize) -> Result<u32, String> {
        self.outcome("smi_count")?.number("count").ok_or_else(|| "not recorded".to_owned())
    }

    fn mapped_word(&self, path: &str, offset: usize) -> Result<u32, String> {
        let outcome = self.outcome(&format!("word {path} {offset:#x}"))?;
        let word = outcome.value("word").and_then(|word| u32::from_str_radix(word, 16).ok());
        word.ok_or_else(|| "not recorded".to_owned())
    }
}
