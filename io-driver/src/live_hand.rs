//! Where a hand without hardware wants its fingers, in a file that the driver and whoever moves the hand map.
//!
//! Problem: a wish that is made while a run goes on, at a window or by a program, has to reach simulated and ideal devices
//! without a call, a lock or a wait in the driver's loop.
//! Model: of each finger a sequence word and eight words of payload (`shm_abi::seqlock`): where its tip is wanted, how its
//! last link is turned, and its buttons. One writer; any number of readers. A reader that overlaps the writer tries again a
//! few times and then keeps the last wish; so it does with one that is no number, too far away or no rotation. A writer
//! that dies, even inside a write, leaves the hand where it was.
//! Frames: places and rotations in the world W; SI.
//! The file belongs into memory (`/dev/shm`, `$XDG_RUNTIME_DIR`), in a place that nobody else may write: whoever shortens it
//! under a mapping kills the process that reads it (SIGBUS).
//! Invariant of the `unsafe` here: a mapping is as long as `Page`, page-aligned, and made of atomic words only, for which
//! every bit pattern and every concurrent change is valid.
//! Cost: a read is some 20 ns, at most [`TRIES`] times; no allocation, no system call.

use memmap2::{MmapOptions, MmapRaw};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use shm_abi::MAX_DEVICES;
use shm_abi::seqlock;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use thiserror::Error;

/// "PHHAND" and a version.
pub const MAGIC: u64 = 0x0001_444e_4148_4850;
/// What is wanted farther away than this from the world's origin, along an axis, is no wish (m).
pub const FARTHEST_M: f64 = 10.0;
/// As often a reader looks before it keeps what it has.
pub const TRIES: usize = 4;
/// Of a quaternion's length from 1; four digits after the point are a rotation.
const LENGTH_TOLERANCE: f64 = 1e-3;
/// Place, rotation, buttons.
const WORDS: usize = 8;

/// What one finger wants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiveWish {
    /// Of its tip, in W (m).
    pub place: Vector3<f64>,
    /// `R_WF` of its last link.
    pub orientation: UnitQuaternion<f64>,
    /// Bit `i`: button `i` is pressed.
    pub buttons: u32,
}

#[repr(C, align(64))]
#[derive(Debug)]
struct Slot {
    sequence: AtomicU64,
    words: [AtomicU64; WORDS],
}

/// All of it.
#[repr(C, align(4096))]
#[derive(Debug)]
struct Page {
    /// [`MAGIC`], written last by whoever makes the file.
    magic: AtomicU64,
    fingers: [Slot; MAX_DEVICES],
}

const _: () = assert!(size_of::<Slot>() == 128 && size_of::<Page>() == 4096);
const _: () = assert!(std::mem::offset_of!(Page, fingers) == 64);

/// Why there is no live hand.
#[derive(Debug, Error)]
pub enum LiveHandError {
    /// The system refused.
    #[error("cannot {what} the live hand {file}: {source}")]
    System {
        /// What was tried.
        what: &'static str,
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It is something else.
    #[error(
        "{file} is no live hand of this version (found {found}, expected {expected}); name the file that the program of \
         the same release makes which moves the hand"
    )]
    NoHand {
        /// Which.
        file: PathBuf,
        /// What was found.
        found: String,
        /// What was expected.
        expected: String,
    },
}

/// The writer's end.
#[derive(Debug)]
pub struct LiveHand {
    map: Mapping,
    /// How many wishes each finger has had.
    written: [u64; MAX_DEVICES],
}

impl LiveHand {
    /// Makes the file, which must not be there yet, readable and writable for its owner only.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn create(path: &Path) -> Result<Self, LiveHandError> {
        let system = |what| move |source| LiveHandError::System { what, file: path.into(), source };
        let mut options = OpenOptions::new();
        options.read(true).write(true).create_new(true).mode(0o600);
        let file = options.open(path).map_err(system("make"))?;
        // Blocks are taken now: a full file system is told here instead of by a SIGBUS later.
        let room = size_of::<Page>() as u64;
        rustix::fs::fallocate(&file, rustix::fs::FallocateFlags::empty(), 0, room)
            .map_err(|errno| system("make room for")(errno.into()))?;
        let map = MmapOptions::new().len(size_of::<Page>()).populate().map_raw(&file);
        let map = Mapping(map.map_err(system("map"))?);
        map.page().magic.store(MAGIC, Ordering::Release);
        Ok(Self { map, written: [0; MAX_DEVICES] })
    }

    /// Finger number `finger` wants this. What readers would not take is left out; so is a finger that cannot be.
    pub fn want(&mut self, finger: usize, wish: &LiveWish) {
        let Some(written) = self.written.get_mut(finger).filter(|_| wish.is_sound()) else { return };
        let slot = &self.map.page().fingers[finger];
        seqlock::write(&slot.sequence, &slot.words, &wish.words(), *written);
        *written += 1;
    }
}

/// A reader's end: one finger.
#[derive(Debug)]
pub struct LiveFinger {
    map: Mapping,
    finger: usize,
    last: LiveWish,
}

impl LiveFinger {
    /// Finger number `finger` of a file that somebody made; it wants `first` until it is told otherwise.
    ///
    /// # Errors
    /// If the file is none, or the system refuses.
    pub fn open(path: &Path, finger: usize, first: LiveWish) -> Result<Self, LiveHandError> {
        let system = |what| move |source| LiveHandError::System { what, file: path.into(), source };
        let no_hand =
            |found: String, expected: String| LiveHandError::NoHand { file: path.into(), found, expected };
        // Before it is opened: a pipe would have this process wait for a writer.
        if !path.metadata().map_err(system("look at"))?.is_file() {
            return Err(no_hand("a device, a directory or a pipe".into(), "a file".into()));
        }
        if finger >= MAX_DEVICES {
            return Err(no_hand(format!("{MAX_DEVICES} fingers"), format!("one of number {finger}")));
        }
        let file = File::open(path).map_err(system("open"))?;
        let bytes = file.metadata().map_err(system("look at"))?.len();
        if bytes != size_of::<Page>() as u64 {
            return Err(no_hand(format!("{bytes} bytes"), size_of::<Page>().to_string()));
        }
        // Populated at once: a first touch inside a tick would be a page fault.
        let map = MmapOptions::new().len(size_of::<Page>()).populate().map_raw_read_only(&file);
        let map = Mapping(map.map_err(system("map"))?);
        let magic = map.page().magic.load(Ordering::Acquire);
        if magic != MAGIC {
            return Err(no_hand(format!("0x{magic:x}"), format!("0x{MAGIC:x}")));
        }
        Ok(Self { map, finger, last: first })
    }

    /// What it wants now.
    pub fn wish(&mut self) -> LiveWish {
        let slot = &self.map.page().fingers[self.finger];
        let mut words = [0; WORDS];
        let whole = (0..TRIES).any(|_| seqlock::read(&slot.sequence, &slot.words, &mut words).is_ok());
        if whole && let Some(wish) = LiveWish::of(words) {
            self.last = wish;
        }
        self.last
    }
}

impl LiveWish {
    /// To be here, upright, without a button pressed.
    pub fn at(place: Vector3<f64>) -> Self {
        Self { place, orientation: UnitQuaternion::identity(), buttons: 0 }
    }

    fn words(&self) -> [u64; WORDS] {
        let [x, y, z] = self.place.into();
        let turn = self.orientation.quaternion();
        let [x, y, z, qw, qx, qy, qz] = [x, y, z, turn.w, turn.i, turn.j, turn.k].map(f64::to_bits);
        [x, y, z, qw, qx, qy, qz, u64::from(self.buttons)]
    }

    /// `None`: nobody can want that.
    fn of(words: [u64; WORDS]) -> Option<Self> {
        let [x, y, z, qw, qx, qy, qz] = std::array::from_fn(|i| f64::from_bits(words[i]));
        let turn = Quaternion::new(qw, qx, qy, qz);
        let wish = Self {
            place: Vector3::new(x, y, z),
            orientation: UnitQuaternion::new_unchecked(turn),
            buttons: u32::try_from(words[7]).ok()?,
        };
        wish.is_sound().then(|| Self { orientation: UnitQuaternion::new_normalize(turn), ..wish })
    }

    fn is_sound(&self) -> bool {
        // Nothing of this holds of what is no number.
        let is_near = self.place.iter().all(|coordinate| coordinate.abs() <= FARTHEST_M);
        is_near && (self.orientation.quaternion().norm() - 1.0).abs() <= LENGTH_TOLERANCE
    }
}

#[derive(Debug)]
struct Mapping(MmapRaw);

impl Mapping {
    fn page(&self) -> &Page {
        // SAFETY: the invariant in this file's head: `create` and `open` map nothing else, and the mapping lives as long as
        // `self`.
        unsafe { &*self.0.as_ptr().cast::<Page>() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;
    use std::time::{Duration, Instant};

    fn place() -> (tempfile::TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("hand");
        (directory, path)
    }

    /// All of its numbers say which one it is.
    fn wish(number: u32) -> LiveWish {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, f64::from(number) * 1e-4, 0.0));
        let x = f64::from(number) * 1e-4;
        LiveWish { place: Vector3::new(x, -x, 2.0 * x), orientation: turn, buttons: number }
    }

    #[test]
    fn a_finger_wants_what_it_was_told_last_and_its_start_before() {
        let (_directory, path) = place();
        let mut hand = LiveHand::create(&path).unwrap();
        let mut fingers = [0, 7].map(|finger| LiveFinger::open(&path, finger, wish(9)).unwrap());
        assert_eq!(fingers[0].wish(), wish(9));
        hand.want(7, &wish(1));
        assert_eq!(fingers[0].wish(), wish(9), "another finger's");
        let read = fingers[1].wish();
        // Brought to length 1 once more: a rounding.
        assert!(read.orientation.angle_to(&wish(1).orientation) < 1e-15);
        assert_eq!((read.place, read.buttons), (wish(1).place, 1));
        hand.want(8, &wish(2));
        assert_eq!(fingers[1].wish(), read, "there is no such finger");
    }

    #[test]
    fn each_wish_that_is_read_while_somebody_writes_is_one_that_was_written() {
        let (_directory, path) = place();
        let mut hand = LiveHand::create(&path).unwrap();
        let mut finger = LiveFinger::open(&path, 3, wish(0)).unwrap();
        let going_on = AtomicBool::new(true);
        let (mut seen, mut mixed) = (0, Vec::new());
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let numbers = (0..10_000).cycle().take_while(|_| going_on.load(Ordering::Relaxed));
                numbers.for_each(|number| hand.want(3, &wish(number)));
            });
            let (mut last, begun) = (0, Instant::now());
            // On a busy machine the two take turns of some milliseconds.
            while seen < 10_000 && begun.elapsed() < Duration::from_secs(10) {
                let read = finger.wish();
                let written = wish(read.buttons);
                let turned = read.orientation.angle_to(&written.orientation);
                if read.place != written.place || turned > 1e-15 {
                    mixed.push(read);
                }
                seen += u32::from(read.buttons != last);
                last = read.buttons;
            }
            going_on.store(false, Ordering::Relaxed);
        });
        assert_eq!(mixed, []);
        assert!(seen > 10, "the writer came to nothing: {seen}");
    }

    #[test]
    fn a_writer_that_dies_inside_a_write_leaves_the_hand_where_it_was() {
        let (_directory, path) = place();
        let mut hand = LiveHand::create(&path).unwrap();
        let mut finger = LiveFinger::open(&path, 0, wish(0)).unwrap();
        hand.want(0, &wish(5));
        let before = finger.wish();
        let slot = &hand.map.page().fingers[0];
        slot.sequence.store(seqlock::stamp(1) - 1, Ordering::Relaxed);
        slot.words[0].store(1.0f64.to_bits(), Ordering::Relaxed);
        assert_eq!(finger.wish(), before);
        drop(hand);
        std::fs::remove_file(&path).unwrap();
        assert_eq!(finger.wish(), before, "the mapping stays");
    }

    #[test]
    fn what_nobody_can_want_leaves_the_last_wish() {
        let (_directory, path) = place();
        let mut hand = LiveHand::create(&path).unwrap();
        let mut finger = LiveFinger::open(&path, 0, wish(0)).unwrap();
        hand.want(0, &wish(4));
        let last = finger.wish();
        let no_turn = UnitQuaternion::new_unchecked(Quaternion::new(0.5, 0.0, 0.0, 0.0));
        let no_number = UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
        let bad = [
            LiveWish::at(Vector3::new(0.0, f64::NAN, 0.0)),
            LiveWish::at(Vector3::new(0.0, 0.0, f64::INFINITY)),
            LiveWish::at(Vector3::new(-10.001, 0.0, 0.0)),
            LiveWish { orientation: no_turn, ..wish(1) },
            LiveWish { orientation: no_number, ..wish(1) },
        ];
        for wish in bad {
            hand.want(0, &wish);
            assert_eq!(finger.wish(), last, "not written: {wish:?}");
            // By a writer who does not mind.
            let slot = &hand.map.page().fingers[0];
            seqlock::write(&slot.sequence, &slot.words, &wish.words(), 50);
            assert_eq!(finger.wish(), last, "not read: {wish:?}");
        }
        let mut words = wish(1).words();
        words[7] = 1 << 32;
        let slot = &hand.map.page().fingers[0];
        seqlock::write(&slot.sequence, &slot.words, &words, 51);
        assert_eq!(finger.wish(), last, "there are 32 buttons");
        hand.want(0, &LiveWish::at(Vector3::new(-10.0, 10.0, 0.0)));
        assert_eq!(finger.wish().place, Vector3::new(-10.0, 10.0, 0.0), "just near enough");
    }

    #[test]
    fn what_is_no_live_hand_is_refused_with_what_was_found() {
        let (directory, path) = place();
        let refused = |path: &Path| LiveFinger::open(path, 0, wish(0)).unwrap_err().to_string();
        assert!(refused(&path).starts_with("cannot look at the live hand"), "{}", refused(&path));
        std::fs::write(&path, b"no hand").unwrap();
        assert!(refused(&path).contains("found 7 bytes, expected 4096"), "{}", refused(&path));
        std::fs::write(&path, vec![0; 4096]).unwrap();
        assert!(refused(&path).contains("found 0x0, expected 0x1444e41484850"), "{}", refused(&path));
        assert!(refused(directory.path()).contains("found a device, a directory or a pipe, expected a file"));
        let there = LiveHand::create(&path).unwrap_err().to_string();
        assert!(there.starts_with("cannot make the live hand") && there.contains("exists"), "{there}");
        let nine = directory.path().join("nine");
        LiveHand::create(&nine).unwrap();
        let refused = LiveFinger::open(&nine, 8, wish(0)).unwrap_err().to_string();
        assert!(refused.contains("found 8 fingers, expected one of number 8"), "{refused}");
    }
}
