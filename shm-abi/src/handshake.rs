//! What is said over the socket before a descriptor changes hands.
//!
//! The application sends one [`Request`], the driver answers with one [`Answer`] and, where it grants,
//! the descriptors. Both messages begin with magic, ABI version and layout hash and never change their
//! size, so that any two versions understand each other well enough to part with a clear message.
//! Afterwards the connection carries nothing: a lease lasts as long as it stays open.

use crate::enumeration::from_word;
use crate::frame::Frame;
use crate::layout::{
    ABI_MAJOR, ABI_MINOR, ABI_VERSION, CommanderSegment, DriverSegment, LAYOUT_HASH, MAGIC, NAME_BYTES,
    assert_layout,
};
use bytemuck::{Pod, Zeroable};

/// What the application wants.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Request {
    /// [`MAGIC`].
    pub magic: u64,
    /// The application's [`ABI_VERSION`].
    pub abi_version: u64,
    /// The application's [`LAYOUT_HASH`].
    pub layout_hash: u64,
    /// A [`RequestKind`].
    pub kind: u64,
    /// Who asks: UTF-8, padded with zeros.
    pub name: [u8; NAME_BYTES],
    /// Since 1.2. Bit `i`: device `i` is meant; 0: all are. Only [`RequestKind::Zero`] looks at it.
    pub devices: u64,
    /// Since 1.3. When it was asked, by CLOCK_MONOTONIC (ns); 0: not told.
    pub asked_ns: u64,
    /// Zero.
    pub reserved: [u64; 2],
}

assert_layout!(Request: 128, 8 {
    magic: u64 = 0,
    abi_version: u64 = 8,
    layout_hash: u64 = 16,
    kind: u64 = 24,
    name: [u8; NAME_BYTES] = 32,
    reserved: [u64; 4] = 96 => {
        devices: u64 = 96,
        asked_ns: u64 = 104,
        reserved: [u64; 2] = 112,
    },
});

/// What the driver says to it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Answer {
    /// [`MAGIC`].
    pub magic: u64,
    /// The driver's [`ABI_VERSION`].
    pub abi_version: u64,
    /// The driver's [`LAYOUT_HASH`].
    pub layout_hash: u64,
    /// Bytes of the driver's segment.
    pub driver_segment_bytes: u64,
    /// Bytes of the commander's segment.
    pub commander_segment_bytes: u64,
    /// A [`Verdict`].
    pub verdict: u64,
    /// Number of the granted lease; 0: none.
    pub lease: u64,
    /// Process id of the driver.
    pub driver_pid: u64,
    /// Process id of whoever holds the lease; 0: nobody.
    pub holder_pid: u64,
    /// Its name: UTF-8, padded with zeros.
    pub holder_name: [u8; NAME_BYTES],
    /// Since 1.3. With [`Verdict::NotAllowed`]: the number of the group whose members may, plus one; 0: only root
    /// and the user that the driver runs as.
    pub allowed_group_plus_one: u64,
    /// Since 1.3. To an emergency stop: tick of the newest frame, plus one; 0: not told, or there is none.
    pub latest_tick_plus_one: u64,
    /// Since 1.3. 1: that frame shows an emergency stop, and no force of any device.
    pub latest_is_stopped: u64,
    /// Zero.
    pub reserved: [u64; 4],
}

assert_layout!(Answer: 192, 8 {
    magic: u64 = 0,
    abi_version: u64 = 8,
    layout_hash: u64 = 16,
    driver_segment_bytes: u64 = 24,
    commander_segment_bytes: u64 = 32,
    verdict: u64 = 40,
    lease: u64 = 48,
    driver_pid: u64 = 56,
    holder_pid: u64 = 64,
    holder_name: [u8; NAME_BYTES] = 72,
    reserved: [u64; 7] = 136 => {
        allowed_group_plus_one: u64 = 136,
        latest_tick_plus_one: u64 = 144,
        latest_is_stopped: u64 = 152,
        reserved: [u64; 4] = 160,
    },
});

/// What can be asked for.
#[repr(u64)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RequestKind {
    /// To read the driver's segment.
    Observe = 1,
    /// To read it and to command the devices.
    Command = 2,
    /// That the driver stops.
    Stop = 3,
    /// That the driver leaves its fault state.
    ClearFault = 4,
    /// Since 1.1. That all motors are switched off at once and stay so until the fault is cleared.
    EmergencyStop = 5,
    /// Since 1.2. That devices are taken to be in their home pose, in which they lie now; see
    /// [`Request::devices`].
    Zero = 6,
    /// Since 1.3. That the lease of whoever commands ends: its force ramps out, and somebody else may command.
    EndLease = 7,
}

from_word!(RequestKind { Observe, Command, Stop, ClearFault, EmergencyStop, Zero, EndLease });

impl RequestKind {
    /// What is asked, to stand behind "asked to".
    pub fn wish(self) -> &'static str {
        match self {
            Self::Observe => "look on",
            Self::Command => "command the devices",
            Self::Stop => "stop the driver",
            Self::ClearFault => "clear the fault",
            Self::EmergencyStop => "stop the motors",
            Self::Zero => "zero devices",
            Self::EndLease => "end the lease of whoever commands",
        }
    }
}

/// How the driver decided.
#[repr(u64)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// As asked; descriptors follow where there are any.
    Granted = 1,
    /// This is not a request of this protocol.
    WrongMagic = 2,
    /// The two were built for different ABI versions.
    WrongVersion = 3,
    /// Same version, different layout: one of them is a modified build.
    WrongLayout = 4,
    /// Somebody commands already.
    LeaseHeld = 5,
    /// The driver does not know this kind of request.
    UnknownKind = 6,
    /// The driver has too many connections.
    Crowded = 7,
    /// The driver could not make a segment.
    NoSegment = 8,
    /// Since 1.3. Whoever asks may not; [`Answer::allowed_group_plus_one`] says who may.
    NotAllowed = 9,
    /// Since 1.3. The driver's loop takes no requests at the moment.
    Busy = 10,
    /// Since 1.3. It was asked before what it would undo, or too long ago.
    Outdated = 11,
    /// Since 1.3. An administrator has ended this user's lease, and others come first for some seconds.
    LeaseEnded = 12,
}

from_word!(Verdict {
    Granted,
    WrongMagic,
    WrongVersion,
    WrongLayout,
    LeaseHeld,
    UnknownKind,
    Crowded,
    NoSegment,
    NotAllowed,
    Busy,
    Outdated,
    LeaseEnded,
});

impl Request {
    /// A request of this version, asked now.
    pub fn new(kind: RequestKind, name: &str) -> Self {
        let kind = kind as u64;
        Self {
            magic: MAGIC,
            abi_version: ABI_VERSION,
            layout_hash: LAYOUT_HASH,
            kind,
            name: name_bytes(name),
            devices: 0,
            asked_ns: monotonic_ns(),
            reserved: [0; 2],
        }
    }

    /// Whether the two sides speak of the same thing.
    pub fn check(&self) -> Result<RequestKind, Verdict> {
        if self.magic != MAGIC {
            return Err(Verdict::WrongMagic);
        }
        if !is_compatible(self.abi_version) {
            return Err(Verdict::WrongVersion);
        }
        if self.layout_hash != LAYOUT_HASH {
            return Err(Verdict::WrongLayout);
        }
        RequestKind::from_word(self.kind).ok_or(Verdict::UnknownKind)
    }
}

impl Answer {
    /// An answer of this version, nothing granted.
    pub fn new(verdict: Verdict) -> Self {
        Self {
            magic: MAGIC,
            abi_version: ABI_VERSION,
            layout_hash: LAYOUT_HASH,
            driver_segment_bytes: size_of::<DriverSegment>() as u64,
            commander_segment_bytes: size_of::<CommanderSegment>() as u64,
            verdict: verdict as u64,
            driver_pid: u64::from(std::process::id()),
            ..Self::zeroed()
        }
    }

    /// That whoever asks may not, but the members of this group; `None`: only root and the driver's own user.
    pub fn not_allowed(group: Option<u32>) -> Self {
        let allowed_group_plus_one = group.map_or(0, |group| u64::from(group) + 1);
        Self { allowed_group_plus_one, ..Self::new(Verdict::NotAllowed) }
    }

    /// That an emergency stop is passed on, and what the newest frame shows.
    pub fn to_emergency_stop(latest: Option<&Frame>) -> Self {
        let tick = latest.and_then(|frame| frame.tick.checked_add(1));
        let is_stopped = latest.is_some_and(Frame::shows_emergency_stop);
        Self {
            latest_tick_plus_one: tick.unwrap_or(0),
            latest_is_stopped: is_stopped.into(),
            ..Self::new(Verdict::Granted)
        }
    }

    /// Tick of the newest frame, if it is told, and whether that shows an emergency stop and no force.
    pub fn latest(&self) -> Option<(u64, bool)> {
        Some((self.latest_tick_plus_one.checked_sub(1)?, self.latest_is_stopped == 1))
    }

    /// The group whose members may what was asked for; `None`: only root and the driver's own user.
    pub fn allowed_group(&self) -> Option<u32> {
        // A driver that names a greater one than there can be names none that we know.
        self.allowed_group_plus_one.checked_sub(1).map(|group| u32::try_from(group).unwrap_or(u32::MAX))
    }
}

/// Now, by the clock of [`Request::asked_ns`].
pub(crate) fn monotonic_ns() -> u64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    // Neither is negative.
    now.tv_sec.unsigned_abs() * 1_000_000_000 + now.tv_nsec.unsigned_abs()
}

/// Two builds can share memory when their major versions are equal; the layout hash has the last word.
pub fn is_compatible(version: u64) -> bool {
    version >> 32 == u64::from(ABI_MAJOR)
}

/// The minor half of a version.
pub fn minor_of(version: u64) -> u32 {
    // The cut takes the major half away.
    version as u32
}

/// A version as a person reads it.
pub fn version_text(version: u64) -> String {
    format!("{}.{}", version >> 32, minor_of(version))
}

/// This build's version as a person reads it.
pub fn own_version_text() -> String {
    format!("{ABI_MAJOR}.{ABI_MINOR}")
}

/// A name as it travels: cut at a character, padded with zeros.
pub fn name_bytes(name: &str) -> [u8; NAME_BYTES] {
    let mut bytes = [0; NAME_BYTES];
    let mut length = name.len().min(NAME_BYTES);
    while !name.is_char_boundary(length) {
        length -= 1;
    }
    bytes[..length].copy_from_slice(&name.as_bytes()[..length]);
    bytes
}

/// A name as it came: whatever is not a printable character is replaced.
pub fn name_text(bytes: &[u8; NAME_BYTES]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(NAME_BYTES);
    printable(&bytes[..end])
}

/// Foreign text that may go to a terminal.
pub(crate) fn printable(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mismatch_has_its_own_verdict() {
        let good = Request::new(RequestKind::Command, "test");
        assert_eq!(good.check(), Ok(RequestKind::Command));
        assert_eq!(Request { magic: 1, ..good }.check(), Err(Verdict::WrongMagic));
        assert_eq!(Request { abi_version: 2 << 32, ..good }.check(), Err(Verdict::WrongVersion));
        assert_eq!(Request { layout_hash: !LAYOUT_HASH, ..good }.check(), Err(Verdict::WrongLayout));
        assert_eq!(Request { kind: 99, ..good }.check(), Err(Verdict::UnknownKind));
    }

    #[test]
    fn a_request_tells_when_it_was_asked_by_the_monotonic_clock() {
        let now_ns = || {
            let now = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
            i128::from(now.tv_sec) * 1_000_000_000 + i128::from(now.tv_nsec)
        };
        let before = now_ns();
        let asked = i128::from(Request::new(RequestKind::Observe, "test").asked_ns);
        assert!((before..=now_ns()).contains(&asked), "{before} {asked}");
    }

    #[test]
    fn a_refusal_names_the_group_that_may() {
        for (group, word) in [(None, 0), (Some(0), 1), (Some(1000), 1001), (Some(u32::MAX), 1 << 32)] {
            let answer = Answer::not_allowed(group);
            assert_eq!((answer.verdict, answer.allowed_group_plus_one), (Verdict::NotAllowed as u64, word));
            assert_eq!(answer.allowed_group(), group);
        }
        let beyond = Answer { allowed_group_plus_one: u64::MAX, ..Answer::not_allowed(None) };
        assert_eq!(beyond.allowed_group(), Some(u32::MAX));
    }

    #[test]
    fn a_name_is_cut_between_characters_and_cleaned_of_controls() {
        let long = "ä".repeat(NAME_BYTES);
        assert_eq!(name_text(&name_bytes(&long)), "ä".repeat(NAME_BYTES / 2));
        // The last character would lie half within the room.
        assert_eq!(
            name_text(&name_bytes(&format!("a{long}"))),
            format!("a{}", "ä".repeat(NAME_BYTES / 2 - 1))
        );
        assert_eq!(name_text(&name_bytes("a\u{1b}[2J")), "a?[2J");
    }
}
