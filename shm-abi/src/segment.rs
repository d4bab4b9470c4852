//! The two segments as memory: created, sealed, mapped.
//!
//! Model: the driver creates both memfds and maps them. Sealing forbids shrinking and growing, so nobody can cause
//! SIGBUS; every further writable mapping, and with it every hole, is forbidden for the driver's segment from the
//! beginning, for the commander's once the commander has mapped it ([`LeaseOffer`]). Whoever receives a descriptor
//! checks seals and size before touching a byte. The driver writes one word of the commander's segment, the one
//! that the commander sleeps on.
//!
//! Invariant of the `unsafe` here: a mapping lives as long as the value that hands out references into it,
//! is as long as the segment type, page-aligned, and the type is made of atomic words only, for which
//! every bit pattern and every concurrent change is valid.

mod bounds;
mod offer;

pub use offer::{LeaseOffer, MAPPED_WITHIN};

use crate::command::Command;
use crate::doorbell::{self, Place, WaitMode};
use crate::enumeration::from_word;
use crate::frame::{DeviceFrame, Frame};
use crate::handshake;
use crate::layout::{
    ABI_VERSION, CommanderSegment, DRIVER_COMMISSIONING, DeviceDescription, DriverSegment, LAYOUT_HASH,
    MAGIC, MAX_DEVICES, RING_COMMANDS, RING_FRAMES, SLEEPS_ON_OWN_WORD,
};
use crate::seqlock::{self, Torn};
use bytemuck::Zeroable;
use memmap2::{MmapOptions, MmapRaw};
use rustix::fs::{FallocateFlags, MemfdFlags, SealFlags};
use rustix::io::Errno;
use std::fs::File;
use std::io;
use std::marker::PhantomData;
use std::ops::Deref;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use thiserror::Error;

/// Which clock moves the ticks.
#[repr(u64)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClockMode {
    /// CLOCK_MONOTONIC, two processes.
    Real = 0,
    /// Two processes; a tick ends when both have done their part.
    Lockstep = 1,
    /// One process, as fast as the machine allows.
    Virtual = 2,
}

from_word!(ClockMode { Real, Lockstep, Virtual });

impl ClockMode {
    /// The name a person reads.
    pub fn name(self) -> &'static str {
        match self {
            Self::Real => "real",
            Self::Lockstep => "lockstep",
            Self::Virtual => "virtual",
        }
    }
}

/// What a driver says of itself once.
#[derive(Debug, Clone, PartialEq)]
pub struct DriverInfo {
    /// Length of a tick (ns).
    pub period_ns: u64,
    /// How long it waits for a reply (ns); u64::MAX: for ever.
    pub reply_budget_ns: u64,
    /// How many ticks an old command may still drive the motors.
    pub max_command_age_ticks: u64,
    /// Ticks from no force to all of it for a new lease.
    pub ramp_in_ticks: u64,
    /// Ticks from all force to none once commands fail.
    pub ramp_out_ticks: u64,
    /// Whether forces and speeds are cut to those of commissioning.
    pub is_commissioning: bool,
    /// Which clock moves the ticks.
    pub clock_mode: ClockMode,
    /// How it waits for a reply.
    pub wait_mode: WaitMode,
    /// The CPU of its loop.
    pub cpu: Option<usize>,
    /// The devices, [`MAX_DEVICES`] at most.
    pub devices: Vec<DeviceInfo>,
    /// Which real-time guarantees its loop obtained, a line each; cut to 4096 bytes.
    pub setup_report: String,
}

/// What a device is.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceInfo {
    /// Name from the driver's configuration; cut to 64 bytes.
    pub name: String,
    /// Kind, such as "premium".
    pub kind: String,
    /// The largest force (N); infinite: no limit.
    pub peak_force_n: f64,
    /// The force it can hold for ever (N).
    pub continuous_force_n: f64,
    /// Smallest corner of the workspace in the base frame D (m).
    pub workspace_min_m: [f64; 3],
    /// Its largest corner (m).
    pub workspace_max_m: [f64; 3],
    /// How fast a force may grow (N/s); infinite: no limit.
    pub slew_n_per_s: f64,
    /// The tip's speed that is a fault (m/s); infinite: none.
    pub speed_limit_m_per_s: f64,
}

/// A descriptor is not a segment of this contract.
#[derive(Debug, Error)]
pub enum SegmentError {
    /// The kernel refused.
    #[error("cannot {what} a shared segment: {source}")]
    System {
        /// What was tried.
        what: &'static str,
        /// What the kernel said.
        source: io::Error,
    },
    /// It can still change its size.
    #[error(
        "the segment handed over is not sealed (found {found}, expected at least {expected}); do not trust this driver"
    )]
    NotSealed {
        /// The seals found.
        found: u32,
        /// The seals needed.
        expected: u32,
    },
    /// It is shorter or longer than the contract says.
    #[error(
        "the segment handed over has {found} bytes, expected {expected}; rebuild both sides from one version"
    )]
    WrongSize {
        /// Bytes found.
        found: u64,
        /// Bytes expected.
        expected: u64,
    },
    /// Its first words are wrong.
    #[error(
        "the segment's {what} is 0x{found:x}, expected 0x{expected:x}; rebuild both sides from one version"
    )]
    WrongHeader {
        /// Which word.
        what: &'static str,
        /// The word found.
        found: u64,
        /// The word expected.
        expected: u64,
    },
    /// The driver says of itself what cannot be.
    #[error(
        "the driver says of itself: {what}: {found}, expected {least} to {most}; do not trust this driver, start the one \
         that belongs to this program"
    )]
    Impossible {
        /// Which word.
        what: &'static str,
        /// The word found.
        found: u64,
        /// The least that can be.
        least: u64,
        /// The most.
        most: u64,
    },
    /// The driver has more devices than a frame has room for.
    #[error("there are {found} devices, and a driver can have {MAX_DEVICES} at most; start a second driver")]
    TooManyDevices {
        /// Devices that were listed.
        found: usize,
    },
}

/// Why a frame could not be had.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum FrameUnavailable {
    /// Its tick has not come.
    #[error("frame {0} is not published yet")]
    NotYet(u64),
    /// The ring has gone round.
    #[error("frame {0} has been overwritten")]
    Overwritten(u64),
    /// It was being overwritten.
    #[error("frame {0} was torn")]
    Torn(u64),
}

/// The driver's segment, in the driver.
#[derive(Debug)]
pub struct DriverMemory {
    map: Mapping<DriverSegment>,
    fd: OwnedFd,
    /// How much of a frame is written.
    frame_words: usize,
}

impl DriverMemory {
    /// Creates, fills in and seals it.
    pub fn create(info: &DriverInfo) -> Result<Self, SegmentError> {
        if info.devices.len() > MAX_DEVICES {
            return Err(SegmentError::TooManyDevices { found: info.devices.len() });
        }
        let fd = create_memfd(c"phantom3-driver", size_of::<DriverSegment>())?;
        let map = Mapping::<DriverSegment>::writable(&fd)?;
        describe(&map, info);
        // After our own mapping stands, nobody gets another writable one.
        seal(&fd, SealFlags::SHRINK | SealFlags::GROW | SealFlags::FUTURE_WRITE | SealFlags::SEAL)?;
        Ok(Self { map, fd, frame_words: frame_words(info.devices.len()) })
    }

    /// Replaces the set-up report. Only before the segment is handed over for the first time: a reader takes
    /// the text as it stands.
    pub fn tell_setup_report(&self, report: &str) {
        put_text(&self.map.setup_report, report);
    }

    /// Writes frame `k`. Call [`ring`](Self::ring) next. Devices beyond those of the description are not
    /// written: their words stay zero for as long as the memory lives, so that a reader may as well read all.
    #[inline]
    pub fn write_frame(&self, frame: &Frame) {
        let slot = &self.map.frames[slot_of(frame.tick, RING_FRAMES)];
        let used = self.frame_words;
        seqlock::write(&slot.sequence, &slot.words[..used], &words_of(frame)[..used], frame.tick);
    }

    /// Announces frame `tick` and wakes the commander if it sleeps. Returns how many sleepers were woken.
    #[inline]
    pub fn ring(&self, tick: u64, commander: Option<&CommanderView>) -> usize {
        match commander {
            Some(view) => {
                let own = &view.map;
                doorbell::ring_frame(&self.map.bell, tick, &own.bell.owner_sleeps, &own.header.frame_doorbell)
            }
            None => {
                doorbell::tell(&self.map.bell, tick);
                0
            }
        }
    }

    /// The descriptor to hand over.
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.fd.as_fd()
    }
}

impl Deref for DriverMemory {
    type Target = DriverSegment;
    fn deref(&self) -> &DriverSegment {
        &self.map
    }
}

/// The driver's segment, everywhere else: read-only.
#[derive(Debug)]
pub struct DriverView {
    map: Mapping<DriverSegment>,
    /// How much of a frame is read.
    frame_words: usize,
}

impl DriverView {
    /// Maps a descriptor that was handed over, after checking seals, size and header.
    pub fn map(fd: BorrowedFd<'_>) -> Result<Self, SegmentError> {
        check(fd, size_of::<DriverSegment>(), SealFlags::SHRINK | SealFlags::GROW)?;
        let map = Mapping::<DriverSegment>::read_only(&fd)?;
        let header = &map.header;
        expect("magic", &header.magic, MAGIC)?;
        expect_compatible(&header.abi_version)?;
        expect("layout hash", &header.layout_hash, LAYOUT_HASH)?;
        expect("ready word", &header.ready, 1)?;
        bounds::check(header)?;
        let frame_words = frame_words(device_count(&map));
        Ok(Self { map, frame_words })
    }

    /// The driver's minor version. What later ones than this added reads as zero.
    pub fn abi_minor(&self) -> u32 {
        // The major half was checked when the memory was mapped.
        handshake::minor_of(get(&self.map.header.abi_version))
    }

    /// Over how many ticks the driver lets forces come on; of [`Self::info`], without the heap.
    pub fn ramp_in_ticks(&self) -> u64 {
        get(&self.map.header.ramp_in_ticks)
    }

    /// What the driver says of itself. Values that became impossible since the memory was mapped are replaced by
    /// harmless ones.
    pub fn info(&self) -> DriverInfo {
        let header = &self.map.header;
        DriverInfo {
            period_ns: get(&header.period_ns).clamp(*bounds::PERIOD_NS.start(), *bounds::PERIOD_NS.end()),
            reply_budget_ns: get(&header.reply_budget_ns),
            max_command_age_ticks: get(&header.max_command_age_ticks),
            ramp_in_ticks: get(&header.ramp_in_ticks),
            ramp_out_ticks: get(&header.ramp_out_ticks),
            clock_mode: ClockMode::from_word(get(&header.clock_mode)).unwrap_or(ClockMode::Real),
            is_commissioning: get(&header.flags) & DRIVER_COMMISSIONING != 0,
            wait_mode: WaitMode::from_word(get(&header.wait_mode)).unwrap_or(WaitMode::Futex),
            cpu: get(&header.cpu_plus_one).checked_sub(1).and_then(|cpu| usize::try_from(cpu).ok()),
            devices: self.map.devices[..device_count(&self.map)]
                .iter()
                .map(DeviceInfo::from_description)
                .collect(),
            setup_report: lines_of(&self.map.setup_report),
        }
    }

    /// The tick of the newest frame.
    #[inline]
    pub fn latest_tick(&self) -> Option<u64> {
        doorbell::latest(&self.map.bell)
    }

    /// Reads frame `tick` whole into `frame`, or says why it cannot be had; `frame` is of no use then. Devices
    /// beyond those that the driver described are zero, whatever stood in `frame`.
    #[inline]
    pub fn read_frame(&self, tick: u64, frame: &mut Frame) -> Result<(), FrameUnavailable> {
        if tick > LAST_TICK {
            return Err(FrameUnavailable::NotYet(tick));
        }
        let slot = &self.map.frames[slot_of(tick, RING_FRAMES)];
        let (used, beyond) = words_of_mut(frame).split_at_mut(self.frame_words);
        beyond.fill(0);
        let stamp = seqlock::read(&slot.sequence, &slot.words[..used.len()], used)
            .map_err(|Torn| FrameUnavailable::Torn(tick))?;
        match stamp.cmp(&seqlock::stamp(tick)) {
            std::cmp::Ordering::Equal => Ok(()),
            std::cmp::Ordering::Less => Err(FrameUnavailable::NotYet(tick)),
            std::cmp::Ordering::Greater => Err(FrameUnavailable::Overwritten(tick)),
        }
    }

    /// Reads the newest frame. `None`: there is none, or a few tries in a row were overtaken.
    pub fn read_latest(&self) -> Option<Frame> {
        const TRIES: usize = 8;
        let mut frame = Frame::zeroed();
        for _ in 0..TRIES {
            let tick = self.latest_tick()?;
            if self.read_frame(tick, &mut frame).is_ok() {
                return Some(frame);
            }
        }
        None
    }

    /// Sleeps until there is a newer frame than `seen`, or `timeout` passes, or a signal comes. The driver
    /// wakes only the commander, whose memory is passed here; observers sleep by the clock.
    pub fn sleep_for_frame(&self, seen: Option<u64>, own: &CommanderMemory, timeout: Duration) {
        let own = &own.map;
        let place = if self.abi_minor() >= FIRST_WITH_OWN_WORD {
            Place { word: &own.header.frame_doorbell, flag: SLEEPS_ON_OWN_WORD }
        } else {
            Place::bell(&self.map.bell)
        };
        doorbell::sleep(place, &self.map.bell, seen, &own.bell.owner_sleeps, timeout);
    }
}

impl Deref for DriverView {
    type Target = DriverSegment;
    /// The segment; it is mapped read-only, so a store through one of its atomics ends in SIGSEGV.
    fn deref(&self) -> &DriverSegment {
        &self.map
    }
}

/// The commander's segment, in the application that holds the lease.
#[derive(Debug)]
pub struct CommanderMemory {
    map: Mapping<CommanderSegment>,
    lease: u64,
}

impl CommanderMemory {
    /// Maps a descriptor that was handed over, after checking seals, size and header.
    pub fn map(fd: BorrowedFd<'_>) -> Result<Self, SegmentError> {
        check(fd, size_of::<CommanderSegment>(), SealFlags::SHRINK | SealFlags::GROW)?;
        let map = Mapping::<CommanderSegment>::writable(&fd)?;
        expect("magic", &map.header.magic, MAGIC)?;
        expect_compatible(&map.header.abi_version)?;
        expect("layout hash", &map.header.layout_hash, LAYOUT_HASH)?;
        let lease = get(&map.header.lease);
        // From here on the driver may forbid further mappings.
        map.header.mapped.store(1, Ordering::Release);
        Ok(Self { map, lease })
    }

    /// The number to put into every command.
    pub fn lease(&self) -> u64 {
        self.lease
    }

    /// Answers a tick and wakes the driver if it sleeps.
    #[inline]
    pub fn publish(&self, command: &Command, driver: &DriverView) {
        let slot = &self.map.commands[slot_of(command.tick, RING_COMMANDS)];
        seqlock::write(&slot.sequence, &slot.words, words_of(command), command.tick);
        doorbell::ring(&self.map.bell, command.tick, &driver.map.bell.owner_sleeps);
    }
}

impl Deref for CommanderMemory {
    type Target = CommanderSegment;
    fn deref(&self) -> &CommanderSegment {
        &self.map
    }
}

/// The first minor version whose drivers ring the commander's own word.
const FIRST_WITH_OWN_WORD: u32 = 3;

/// The commander's segment, in the driver, which writes nothing into it but the word to sleep on.
#[derive(Debug)]
pub struct CommanderView {
    map: Mapping<CommanderSegment>,
    lease: u64,
}

impl CommanderView {
    /// Creates the segment for one lease. Returns the driver's view and the descriptor to hand over. This alone is for
    /// a commander in the same process; what another process may get is a [`LeaseOffer`].
    pub fn create(lease: u64) -> Result<(Self, OwnedFd), SegmentError> {
        let fd = create_memfd(c"phantom3-commander", size_of::<CommanderSegment>())?;
        let map = Mapping::<CommanderSegment>::writable(&fd)?;
        let header = &map.header;
        put(&header.magic, MAGIC);
        put(&header.abi_version, ABI_VERSION);
        put(&header.layout_hash, LAYOUT_HASH);
        put(&header.segment_bytes, size_of::<CommanderSegment>() as u64);
        put(&header.lease, lease);
        seal(&fd, SealFlags::SHRINK | SealFlags::GROW)?;
        Ok((Self { map, lease }, fd))
    }

    /// Number of the lease; the driver's own knowledge, not read from the segment.
    pub fn lease(&self) -> u64 {
        self.lease
    }

    /// The tick that the commander says it answered last.
    #[inline]
    pub fn latest_tick(&self) -> Option<u64> {
        doorbell::latest(&self.map.bell)
    }

    /// Reads whatever stands in the slot of `tick`; an allegation.
    #[inline]
    pub fn read_command(&self, tick: u64, command: &mut Command) -> Result<(), Torn> {
        let slot = &self.map.commands[slot_of(tick, RING_COMMANDS)];
        seqlock::read(&slot.sequence, &slot.words, words_of_mut(command)).map(|_| ())
    }

    /// Sleeps until the commander rings, `timeout` passes or a signal comes.
    pub fn sleep_for_command(&self, seen: Option<u64>, own: &DriverMemory, timeout: Duration) {
        let bell = &self.map.bell;
        doorbell::sleep(Place::bell(bell), bell, seen, &own.map.bell.owner_sleeps, timeout);
    }

    /// Touches every page, so that the loop's first look at one is no page fault.
    fn prefault(&self) {
        for slot in &self.map.commands {
            // A read of a page that is not there would map it for reading only.
            slot.padding[0].fetch_add(0, Ordering::Relaxed);
        }
        self.map.header.frame_doorbell.fetch_add(0, Ordering::Relaxed);
    }

    /// Wakes the driver's own loop out of [`sleep_for_command`](Self::sleep_for_command). If it is only about
    /// to sleep, it misses this (see [`doorbell::wake`]) and sleeps for its whole time-out.
    pub fn wake_sleeper(&self) {
        doorbell::wake(&self.map.bell);
    }
}

impl DeviceInfo {
    fn from_description(from: &DeviceDescription) -> Self {
        Self {
            name: text_of(&from.name),
            kind: text_of(&from.kind),
            peak_force_n: f64::from_bits(get(&from.peak_force_n)),
            continuous_force_n: f64::from_bits(get(&from.continuous_force_n)),
            workspace_min_m: from.workspace_min_m.each_ref().map(|word| f64::from_bits(get(word))),
            workspace_max_m: from.workspace_max_m.each_ref().map(|word| f64::from_bits(get(word))),
            slew_n_per_s: limit_of(&from.slew_n_per_s),
            speed_limit_m_per_s: limit_of(&from.speed_limit_m_per_s),
        }
    }

    fn write_to(&self, to: &DeviceDescription) {
        put_text(&to.name, &self.name);
        put_text(&to.kind, &self.kind);
        put(&to.peak_force_n, self.peak_force_n.to_bits());
        put(&to.continuous_force_n, self.continuous_force_n.to_bits());
        for axis in 0..3 {
            put(&to.workspace_min_m[axis], self.workspace_min_m[axis].to_bits());
            put(&to.workspace_max_m[axis], self.workspace_max_m[axis].to_bits());
        }
        put(&to.slew_n_per_s, self.slew_n_per_s.to_bits());
        put(&to.speed_limit_m_per_s, self.speed_limit_m_per_s.to_bits());
    }
}

/// A limit that a 1.0 driver does not tell is none.
fn limit_of(word: &AtomicU64) -> f64 {
    let limit = f64::from_bits(get(word));
    if limit == 0.0 { f64::INFINITY } else { limit }
}

fn describe(segment: &DriverSegment, info: &DriverInfo) {
    let header = &segment.header;
    put(&header.magic, MAGIC);
    put(&header.abi_version, ABI_VERSION);
    put(&header.layout_hash, LAYOUT_HASH);
    put(&header.segment_bytes, size_of::<DriverSegment>() as u64);
    put(&header.driver_pid, u64::from(std::process::id()));
    put(&header.period_ns, info.period_ns);
    put(&header.reply_budget_ns, info.reply_budget_ns);
    put(&header.max_command_age_ticks, info.max_command_age_ticks);
    put(&header.ramp_in_ticks, info.ramp_in_ticks);
    put(&header.ramp_out_ticks, info.ramp_out_ticks);
    put(&header.clock_mode, info.clock_mode as u64);
    put(&header.wait_mode, info.wait_mode as u64);
    put(&header.flags, if info.is_commissioning { DRIVER_COMMISSIONING } else { 0 });
    put(&header.cpu_plus_one, info.cpu.map_or(0, |cpu| cpu as u64 + 1));
    put(&header.device_count, info.devices.len() as u64);
    for (device, to) in info.devices.iter().zip(&segment.devices) {
        device.write_to(to);
    }
    put_text(&segment.setup_report, &info.setup_report);
    header.ready.store(1, Ordering::Release);
}

/// The stamps of later ticks would be those of early ones again (after 292 million years at 1 kHz, so that
/// only an allegation names one).
const LAST_TICK: u64 = (u64::MAX >> 1) - 1;

/// The devices of a driver; a count beyond the array is cut to it.
fn device_count(segment: &DriverSegment) -> usize {
    usize::try_from(get(&segment.header.device_count)).unwrap_or(MAX_DEVICES).min(MAX_DEVICES)
}

/// The words of a frame that mean something where so many devices exist: they come last in it.
const fn frame_words(devices: usize) -> usize {
    (std::mem::offset_of!(Frame, devices) + devices * size_of::<DeviceFrame>()) / size_of::<u64>()
}

fn slot_of(tick: u64, slots: usize) -> usize {
    // Both rings are powers of two, so the cut of the cast does not matter.
    tick as usize & (slots - 1)
}

fn words_of<P: bytemuck::Pod>(payload: &P) -> &[u64] {
    bytemuck::cast_slice(std::slice::from_ref(payload))
}

fn words_of_mut<P: bytemuck::Pod>(payload: &mut P) -> &mut [u64] {
    bytemuck::cast_slice_mut(std::slice::from_mut(payload))
}

fn get(word: &AtomicU64) -> u64 {
    word.load(Ordering::Acquire)
}

fn put(word: &AtomicU64, value: u64) {
    word.store(value, Ordering::Relaxed);
}

/// Cuts at a character and pads with zeros.
fn put_text(words: &[AtomicU64], text: &str) {
    let room = words.len() * 8;
    let mut length = text.len().min(room);
    while !text.is_char_boundary(length) {
        length -= 1;
    }
    let bytes = &text.as_bytes()[..length];
    for (index, word) in words.iter().enumerate() {
        let mut eight = [0; 8];
        let rest = bytes.get(index * 8..).unwrap_or_default();
        let filled = rest.len().min(8);
        eight[..filled].copy_from_slice(&rest[..filled]);
        put(word, u64::from_le_bytes(eight));
    }
}

fn text_of(words: &[AtomicU64]) -> String {
    handshake::printable(&bytes_of(words))
}

/// As [`text_of`], keeping the ends of lines.
fn lines_of(words: &[AtomicU64]) -> String {
    let lines: Vec<String> = bytes_of(words).split(|byte| *byte == b'\n').map(handshake::printable).collect();
    lines.join("\n")
}

fn bytes_of(words: &[AtomicU64]) -> Vec<u8> {
    words.iter().flat_map(|word| get(word).to_le_bytes()).take_while(|byte| *byte != 0).collect()
}

fn expect(what: &'static str, word: &AtomicU64, expected: u64) -> Result<(), SegmentError> {
    match get(word) {
        found if found == expected => Ok(()),
        found => Err(SegmentError::WrongHeader { what, found, expected }),
    }
}

/// A minor version only adds what an older reader may ignore.
fn expect_compatible(version: &AtomicU64) -> Result<(), SegmentError> {
    match get(version) {
        found if handshake::is_compatible(found) => Ok(()),
        found => Err(SegmentError::WrongHeader { what: "ABI version", found, expected: ABI_VERSION }),
    }
}

fn create_memfd(name: &std::ffi::CStr, bytes: usize) -> Result<OwnedFd, SegmentError> {
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    let fd = rustix::fs::memfd_create(name, flags | MemfdFlags::NOEXEC_SEAL)
        .or_else(|errno| match errno {
            // Linux before 6.3 does not know the flag; a hardened one later on insists on it.
            Errno::INVAL => rustix::fs::memfd_create(name, flags),
            other => Err(other),
        })
        .map_err(|errno| SegmentError::System { what: "create", source: errno.into() })?;
    // Not only sized: a page that does not exist yet costs a page fault inside a tick, and SIGBUS if there
    // is no memory left by then.
    rustix::fs::fallocate(&fd, FallocateFlags::empty(), 0, bytes as u64)
        .map_err(|errno| SegmentError::System { what: "reserve the memory of", source: errno.into() })?;
    Ok(fd)
}

fn seal(fd: &OwnedFd, seals: SealFlags) -> Result<(), SegmentError> {
    rustix::fs::fcntl_add_seals(fd, seals)
        .map_err(|errno| SegmentError::System { what: "seal", source: errno.into() })
}

fn check(fd: BorrowedFd<'_>, bytes: usize, needed: SealFlags) -> Result<(), SegmentError> {
    let seals = rustix::fs::fcntl_get_seals(fd)
        .map_err(|errno| SegmentError::System { what: "read the seals of", source: errno.into() })?;
    if !seals.contains(needed) {
        return Err(SegmentError::NotSealed { found: seals.bits(), expected: needed.bits() });
    }
    let found = rustix::fs::fstat(fd)
        .map_err(|errno| SegmentError::System { what: "measure", source: errno.into() })?
        .st_size as u64;
    if found != bytes as u64 {
        return Err(SegmentError::WrongSize { found, expected: bytes as u64 });
    }
    Ok(())
}

/// A segment type: `repr(C)`, atomic words only, alignment at most a page.
trait Segment {}
impl Segment for DriverSegment {}
impl Segment for CommanderSegment {}

/// A shared mapping seen as a segment.
#[derive(Debug)]
struct Mapping<T> {
    map: MmapRaw,
    segment: PhantomData<T>,
}

impl<T: Segment> Mapping<T> {
    fn writable(fd: &impl AsFd) -> Result<Self, SegmentError> {
        Self::new(fd, |options, file| options.map_raw(file))
    }

    fn read_only(fd: &impl AsFd) -> Result<Self, SegmentError> {
        Self::new(fd, |options, file| options.map_raw_read_only(file))
    }

    fn new(
        fd: &impl AsFd,
        map: impl Fn(&MmapOptions, &File) -> io::Result<MmapRaw>,
    ) -> Result<Self, SegmentError> {
        let system = |source| SegmentError::System { what: "map", source };
        let file = File::from(fd.as_fd().try_clone_to_owned().map_err(system)?);
        // Populated at once: a first touch inside a tick would be a page fault.
        let map = map(MmapOptions::new().len(size_of::<T>()).populate(), &file).map_err(system)?;
        Ok(Self { map, segment: PhantomData })
    }
}

impl<T: Segment> Deref for Mapping<T> {
    type Target = T;
    #[allow(unsafe_code)]
    fn deref(&self) -> &T {
        // SAFETY: the invariant in this file's head: length, alignment and lifetime are this value's, and a
        // `Segment` is atomic words, valid for every bit pattern under every concurrent change.
        unsafe { &*self.map.as_ptr().cast::<T>() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::MetadataExt;

    #[test]
    fn every_page_of_a_segment_exists_before_it_is_mapped() {
        /// What stat(2) counts in, whatever the file system's block is.
        const STAT_BLOCK: u64 = 512;
        for bytes in [size_of::<DriverSegment>(), size_of::<CommanderSegment>()] {
            let meta = File::from(create_memfd(c"test", bytes).unwrap()).metadata().unwrap();
            assert_eq!(meta.size(), bytes as u64);
            assert!(meta.blocks() * STAT_BLOCK >= meta.size(), "{} blocks", meta.blocks());
        }
    }
}
