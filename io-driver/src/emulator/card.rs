//! The registers of an emulated card, in a file that driver and emulator map.
//!
//! Model: like the registers of a card on the bus, these are words that either side may read and write at any
//! time. Besides the registers that a real card has (counters, buttons, status; converters, amplifier enable)
//! there is a queue of all values ever written, since a register shows only the last.
//! The file belongs into memory (`/dev/shm`, `$XDG_RUNTIME_DIR`): on a disk, writing back its pages would stop
//! the driver's loop.
//! Who writes what: the emulator all of [`Inputs`] but the buttons, and [`TallyWords`]; anybody the
//! buttons and [`Hand`], as a finger would;
//! the driver, one at a time, [`Outputs`] and the queue.
//! Invariant of the `unsafe` here: a mapping is never unmapped, is as long as [`Card`], page-aligned, and made
//! of atomic words only, for which every bit pattern and every concurrent change is valid. Whoever shortens the
//! file under a mapping kills the process that touches it (SIGBUS), whose last act switches off what it can.

use memmap2::{MmapOptions, MmapRaw};
use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicI32, AtomicU32, AtomicU64, Ordering};
use std::time::Duration;
use thiserror::Error;

/// "PHCARD" and a version.
pub const MAGIC: u64 = 0x0002_4452_4143_4850;
/// Counters and converters.
pub const CHANNELS: usize = 8;
/// Values that wait for being checked: a minute at 1 kHz.
pub const QUEUE: usize = 1 << 16;

/// [`Record::flags`]: where the arming that a value follows begins.
pub const ARM_SHIFT: u32 = 32;

/// [`Inputs::status`]: the amplifiers have switched themselves off.
pub const STATUS_TRIPPED: u32 = 1;

/// What the card tells.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct Inputs {
    /// Raw counters.
    pub counters: [AtomicU32; CHANNELS],
    /// Bit `i`: button `i` is pressed.
    pub buttons: AtomicU32,
    /// Bits of `STATUS_...`.
    pub status: AtomicU32,
    /// Process id of the emulator.
    pub pid: AtomicU32,
    /// Another number each time that the card was switched on: the counters began anew then.
    pub session: AtomicU32,
    /// Grows while the emulator lives.
    pub heartbeat: AtomicU64,
}

/// What the card is told.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct Outputs {
    /// Converter codes; offset binary.
    pub codes: [AtomicU32; CHANNELS],
    /// 1: the amplifiers are on.
    pub enable: AtomicU32,
    /// A change lets tripped amplifiers be switched on again.
    pub arm: AtomicU32,
    /// How many values were ever written; written last.
    pub written: AtomicU64,
}

/// One value that was written.
#[repr(C, align(32))]
#[derive(Debug)]
pub struct Record {
    /// Its number, from 1.
    pub number: AtomicU64,
    /// When, CLOCK_MONOTONIC (ns).
    pub time_ns: AtomicU64,
    /// Codes of channels 0 to 3, 16 bits each, the first lowest.
    pub codes: AtomicU64,
    /// Bit 0: the amplifiers are to be on. From [`ARM_SHIFT`] on: what [`Outputs::arm`] was.
    pub flags: AtomicU64,
}

/// A hand that turns the arm, as far as it goes beyond what the emulator itself does. Like the buttons, anybody's. One
/// that holds a simulated arm wants it to be turned by so much, and gets there as hands do.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct Hand {
    /// Counts by which each counter is turned.
    pub counts: [AtomicI32; CHANNELS],
}

/// What the amplifiers have seen; see [`super::amplifier::Tally`].
#[repr(C, align(64))]
#[derive(Debug)]
pub struct TallyWords {
    /// One word for each count.
    pub words: [AtomicU64; 16],
}

/// All of it.
#[repr(C, align(4096))]
#[derive(Debug)]
pub struct Card {
    /// [`MAGIC`], written last by whoever makes the card.
    pub magic: AtomicU64,
    /// What the card tells.
    pub inputs: Inputs,
    /// What the card is told.
    pub outputs: Outputs,
    /// What turns the arm besides its motors.
    pub hand: Hand,
    /// What the amplifiers have seen.
    pub tally: TallyWords,
    /// Every value, by its number.
    pub queue: [Record; QUEUE],
}

/// Why there is no card.
#[derive(Debug, Error)]
pub enum CardError {
    /// The system refused.
    #[error("cannot {what} the emulated card {file}: {source}")]
    System {
        /// What was tried.
        what: &'static str,
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// There is none.
    #[error("there is no emulated card {file}; start `io-driver emulate --card {file}` first")]
    Missing {
        /// Which.
        file: PathBuf,
    },
    /// It is something else.
    #[error(
        "{file} is no emulated card of this version (found {found}, expected {expected}); start `io-driver emulate --card {file}` of the same release first"
    )]
    NoCard {
        /// Which.
        file: PathBuf,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
    },
    /// It is something else, which is not replaced.
    #[error(
        "{file} is there already and is no emulated card of this version; name another file, or remove it"
    )]
    InTheWay {
        /// Which.
        file: PathBuf,
    },
    /// A driver has it.
    #[error("the emulated card {file} belongs to another driver; one card has one driver")]
    Taken {
        /// Which.
        file: PathBuf,
    },
    /// An emulator plays it.
    #[error("the emulated card {file} is played by process {pid} already")]
    Played {
        /// Which.
        file: PathBuf,
        /// By whom.
        pid: u32,
    },
}

/// A driver's hold on a card, until its process ends: the mapping, which stays, keeps the lock.
#[derive(Debug)]
pub struct DriversCard {
    /// The registers.
    pub card: &'static Card,
    _lock: File,
}

impl Card {
    /// Makes a card for an emulator, readable and writable for its owner only. One that nobody plays any more is
    /// replaced; anything else that has that name is somebody's, and stays.
    ///
    /// # Errors
    /// If it is played by another process, if there is something else, or if the system refuses.
    pub fn create(path: &Path) -> Result<&'static Self, CardError> {
        match open_file(path, UNFINISHED) {
            Ok((former, _)) => former.is_played(path)?,
            Err(CardError::Missing { .. }) => {}
            Err(CardError::NoCard { .. }) => return Err(CardError::InTheWay { file: path.into() }),
            Err(error) => return Err(error),
        }
        let system = |what| move |source| CardError::System { what, file: path.into(), source };
        // A former driver may still hold the former file; it keeps that, under no name.
        match std::fs::remove_file(path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(system("replace")(error)),
            _ => {}
        }
        let mut options = OpenOptions::new();
        options.read(true).write(true).create_new(true).mode(0o600);
        let file = options.open(path).map_err(system("make"))?;
        // Blocks are taken now: a full file system is told here instead of by a SIGBUS later.
        let room = size_of::<Self>() as u64;
        if let Err(error) = rustix::fs::fallocate(&file, rustix::fs::FallocateFlags::empty(), 0, room) {
            // What is no card is in everybody's way.
            let _ = std::fs::remove_file(path);
            return Err(system("make room for")(error.into()));
        }
        let card = map(&file).map_err(system("map"))?;
        card.inputs.pid.store(std::process::id(), Ordering::Relaxed);
        card.inputs.session.store(new_session(), Ordering::Relaxed);
        card.magic.store(MAGIC, Ordering::Release);
        Ok(card)
    }

    /// Maps a card that somebody made.
    ///
    /// # Errors
    /// If it is none, or the system refuses.
    pub fn open(path: &Path) -> Result<&'static Self, CardError> {
        open_file(path, MAGIC).map(|(card, _)| card)
    }

    /// Maps a card for a driver.
    ///
    /// # Errors
    /// As [`open`](Self::open), and if another driver has it.
    pub fn take(path: &Path) -> Result<DriversCard, CardError> {
        let (card, file) = open_file(path, MAGIC)?;
        match file.try_lock() {
            Ok(()) => Ok(DriversCard { card, _lock: file }),
            Err(TryLockError::WouldBlock) => Err(CardError::Taken { file: path.into() }),
            Err(TryLockError::Error(source)) => {
                Err(CardError::System { what: "lock", file: path.into(), source })
            }
        }
    }

    fn is_played(&self, path: &Path) -> Result<(), CardError> {
        let before = self.inputs.heartbeat.load(Ordering::Relaxed);
        std::thread::sleep(HEARTBEATS);
        if self.inputs.heartbeat.load(Ordering::Relaxed) == before {
            return Ok(());
        }
        Err(CardError::Played { file: path.into(), pid: self.inputs.pid.load(Ordering::Relaxed) })
    }

    /// The value of that number, if it is still in the queue.
    pub fn record(&self, number: u64) -> Option<&Record> {
        let record = &self.queue[(number % QUEUE as u64) as usize];
        (record.number.load(Ordering::Acquire) == number).then_some(record)
    }
}

/// Not that of the card before: no two are made within a microsecond of a day by the same process.
fn new_session() -> u32 {
    let us = rt_core::clock::monotonic_ns() / 1000;
    (us as u32 ^ std::process::id().rotate_left(16)) | 1
}

/// Longer than an emulator takes between two heartbeats.
const HEARTBEATS: Duration = Duration::from_millis(200);

/// Magic of a card whose emulator died while it made it.
const UNFINISHED: u64 = 0;

/// The card, if it is one, or has this other magic.
fn open_file(path: &Path, or_magic: u64) -> Result<(&'static Card, File), CardError> {
    let system = |what| move |source| CardError::System { what, file: path.into(), source };
    let opened = OpenOptions::new().read(true).write(true).open(path);
    let file = opened.map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => CardError::Missing { file: path.into() },
        _ => system("open")(source),
    })?;
    let metadata = file.metadata().map_err(system("look at"))?;
    let no_card = |found: String, expected: String| CardError::NoCard { file: path.into(), found, expected };
    if !metadata.is_file() {
        return Err(no_card("a device or a pipe".into(), "a file".into()));
    }
    let bytes = metadata.len();
    if bytes != size_of::<Card>() as u64 {
        return Err(no_card(format!("{bytes} bytes"), size_of::<Card>().to_string()));
    }
    let card = map(&file).map_err(system("map"))?;
    let magic = card.magic.load(Ordering::Acquire);
    if magic != MAGIC && magic != or_magic {
        return Err(no_card(format!("0x{magic:x}"), format!("0x{MAGIC:x}")));
    }
    Ok((card, file))
}

/// Maps the file for the rest of the process's life, all its pages present.
fn map(file: &File) -> io::Result<&'static Card> {
    let raw: MmapRaw = MmapOptions::new().len(size_of::<Card>()).populate().map_raw(file)?;
    let start = std::mem::ManuallyDrop::new(raw).as_mut_ptr().cast::<Card>();
    // SAFETY: the mapping is as long as `Card` and page-aligned, never unmapped (its owner is forgotten), and
    // `Card` is made of atomic words only.
    Ok(unsafe { &*start })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> (tempfile::TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("card");
        (directory, path)
    }

    #[test]
    fn a_card_has_one_driver() {
        let (_directory, path) = place();
        Card::create(&path).unwrap();
        let first = Card::take(&path).unwrap();
        let refused = Card::take(&path).unwrap_err().to_string();
        assert!(refused.ends_with("belongs to another driver; one card has one driver"), "{refused}");
        drop(first);
        assert!(matches!(Card::take(&path), Err(CardError::Taken { .. })), "while its process lives");
    }

    #[test]
    fn what_is_no_card_is_refused_with_what_was_found() {
        let (_directory, path) = place();
        assert!(Card::take(&path).unwrap_err().to_string().starts_with("there is no emulated card"));
        std::fs::write(&path, b"no card").unwrap();
        let short = Card::take(&path).unwrap_err().to_string();
        assert!(short.contains("found 7 bytes"), "{short}");
        std::fs::write(&path, vec![0; size_of::<Card>()]).unwrap();
        let empty = Card::take(&path).unwrap_err().to_string();
        assert!(empty.contains("found 0x0, expected 0x2445241434850"), "{empty}");
    }

    #[test]
    fn nothing_but_a_former_card_is_replaced() {
        let (directory, path) = place();
        std::fs::write(&path, b"a thesis").unwrap();
        let refused = Card::create(&path).unwrap_err().to_string();
        assert!(refused.contains("is there already") && refused.contains("name another file"), "{refused}");
        assert_eq!(std::fs::read(&path).unwrap(), b"a thesis");
        let link = directory.path().join("null");
        std::os::unix::fs::symlink("/dev/null", &link).unwrap();
        assert!(matches!(Card::create(&link), Err(CardError::InTheWay { .. })));
        assert!(link.is_symlink());
        assert!(Card::create(directory.path()).is_err());
        // One whose emulator died before it was finished is in everybody's way.
        std::fs::write(&path, vec![0; size_of::<Card>()]).unwrap();
        Card::create(&path).unwrap();
    }

    #[test]
    fn a_card_that_is_played_is_not_replaced_and_one_that_was_left_is() {
        let (_directory, path) = place();
        let card = Card::create(&path).unwrap();
        let stop = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            let _stops = patience::Raised(&stop);
            scope.spawn(|| {
                while !stop.load(Ordering::Relaxed) {
                    card.inputs.heartbeat.fetch_add(1, Ordering::Relaxed);
                    std::thread::sleep(Duration::from_millis(1));
                }
            });
            let refused = Card::create(&path).unwrap_err();
            assert!(matches!(refused, CardError::Played { pid, .. } if pid == std::process::id()));
        });
        card.outputs.written.store(7, Ordering::Relaxed);
        let anew = Card::create(&path).unwrap();
        assert_eq!(anew.outputs.written.load(Ordering::Relaxed), 0);
    }
}
