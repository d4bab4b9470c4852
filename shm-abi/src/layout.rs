//! What lies where: the two segments, byte by byte.
//!
//! Everything that crosses a process border is an atomic word, so that a hostile or dying neighbour can
//! give wrong values but never undefined behaviour. Every offset is asserted at compile time, and the text
//! of those assertions is hashed into [`LAYOUT_HASH`], which both sides compare before anything is mapped.
//!
//! The hash is over the layout as the major version's first minor published it, see `assert_layout!`; what
//! raises which number, and how a field is added, is told in the [crate's documentation](crate#versions).

use crate::command::Command;
use crate::frame::Frame;
use std::sync::atomic::{AtomicU32, AtomicU64};

/// "PHANTOM3" read as a little-endian word: the first word of every segment and message.
pub const MAGIC: u64 = 0x334D_4F54_4E41_4850;
/// Raised when an old reader would misread.
pub const ABI_MAJOR: u32 = 1;
/// Raised when something is added that an old reader may ignore.
pub const ABI_MINOR: u32 = 3;
/// Both, the major in the upper half.
pub const ABI_VERSION: u64 = ((ABI_MAJOR as u64) << 32) | ABI_MINOR as u64;

/// Devices in one frame.
pub const MAX_DEVICES: usize = 8;
/// Frames in the ring: four seconds at 1 kHz. A power of two.
pub const RING_FRAMES: usize = 4096;
/// Commands in the commander's ring: a writer that dies inside a write spoils one tick.
pub const RING_COMMANDS: usize = 4;
/// Words of a [`Frame`].
pub const FRAME_WORDS: usize = 335;
/// Words of a [`Command`].
pub const COMMAND_WORDS: usize = 36;
/// Buckets of a histogram: values below 32 ns exactly, then 32 buckets an octave; the last is open.
pub const HISTOGRAM_BUCKETS: usize = 1024;
/// Words of the epitaph.
pub const EPITAPH_WORDS: usize = 32;
/// Words of the set-up report.
pub const REPORT_WORDS: usize = 512;
/// Bytes of a device's or client's name, padded with zeros.
pub const NAME_BYTES: usize = 64;
/// The same in words.
pub const NAME_WORDS: usize = 8;

const _: () = assert!(NAME_WORDS * 8 == NAME_BYTES);
const _: () = assert!(size_of::<Frame>() == FRAME_WORDS * 8);
const _: () = assert!(size_of::<Command>() == COMMAND_WORDS * 8);
const _: () = assert!(RING_FRAMES.is_power_of_two() && RING_COMMANDS.is_power_of_two());
// A futex is a 32-bit word of its own here, and C readers rely on the byte order below.
const _: () = assert!(cfg!(target_endian = "little"), "the ABI is little-endian");

/// Checks size, alignment, type and offset of every field at compile time and writes them down as text.
///
/// What a minor version made of reserved words stands behind an arrow: `reserved: [u64; 3] = 16 => { heat:
/// f64 = 16, reserved: [u64; 2] = 24, }`. The text, and with it the layout hash, keeps the words as they were
/// published, so that readers of the older version are not refused; what is checked is what stands there now.
macro_rules! assert_layout {
    ($type:ident: $size:literal, $align:literal { $($entries:tt)+ }) => {
        assert_layout!(@walk $type, $size, $align, [], [], [], $($entries)+);
    };
    (@walk $type:ident, $size:literal, $align:literal, [$($now:tt)*], [$($text:tt)*], [$($span:tt)*],
        $field:ident: $was:ty = $offset:literal => { $($new:ident: $new_type:ty = $new_offset:literal,)+ },
        $($rest:tt)*) => {
        assert_layout!(@walk $type, $size, $align,
            [$($now)* $({ $new, $new_type, $new_offset })+],
            [$($text)* { $field, $was, $offset }],
            [$($span)* { $field, $was, $($new_type),+ }],
            $($rest)*);
    };
    (@walk $type:ident, $size:literal, $align:literal, [$($now:tt)*], [$($text:tt)*], [$($span:tt)*],
        $field:ident: $field_type:ty = $offset:literal, $($rest:tt)*) => {
        assert_layout!(@walk $type, $size, $align,
            [$($now)* { $field, $field_type, $offset }],
            [$($text)* { $field, $field_type, $offset }],
            [$($span)*],
            $($rest)*);
    };
    (@walk $type:ident, $size:literal, $align:literal,
        [$({ $now:ident, $now_type:ty, $now_offset:literal })+],
        [$({ $field:ident, $field_type:ty, $offset:literal })+],
        [$({ $was:ident, $was_type:ty, $($new_type:ty),+ })*],) => {
        const _: () = {
            assert!(size_of::<$type>() == $size, concat!("size of ", stringify!($type)));
            assert!(align_of::<$type>() == $align, concat!("alignment of ", stringify!($type)));
            $(assert!(
                std::mem::offset_of!($type, $now) == $now_offset,
                concat!("offset of ", stringify!($type), ".", stringify!($now))
            );)+
            $(assert!(
                size_of::<$was_type>() == 0 $(+ size_of::<$new_type>())+,
                concat!("what became of ", stringify!($type), ".", stringify!($was))
            );)*
            #[allow(dead_code)]
            fn every_field_is_listed(value: &$type) {
                let $type { $($now),+ } = value;
                $(let _: &$now_type = $now;)+
            }
        };
        impl $crate::layout::Described for $type {
            const LAYOUT: &'static str = concat!(
                stringify!($type), ":", $size, ",", $align, "{",
                $(stringify!($field), ":", stringify!($field_type), "=", $offset, ";",)+
                "}"
            );
        }
    };
}
pub(crate) use assert_layout;

/// A type whose layout is written down.
pub(crate) trait Described {
    /// Size, alignment, and each field's name, type and offset.
    const LAYOUT: &'static str;
}

/// The driver's segment: written by the driver, read by everybody.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct DriverSegment {
    /// Who made this and how it is laid out; constant once `ready` is set.
    pub header: DriverHeader,
    /// The latest tick and the word to wait on.
    pub bell: Bell,
    /// What has happened so far.
    pub counters: Counters,
    /// The devices; constant once `header.ready` is set.
    pub devices: [DeviceDescription; MAX_DEVICES],
    /// How late the driver's loop woke, against the first deadline that it had not served: one value a wake.
    pub wake_error_ns: HistogramBlock,
    /// From wake-up to motors written, the wait for the reply not counted.
    pub cycle_ns: HistogramBlock,
    /// From a frame's doorbell to its accepted reply.
    pub round_trip_ns: HistogramBlock,
    /// The driver's last words.
    pub epitaph: [AtomicU64; EPITAPH_WORDS],
    /// Which real-time guarantees the driver's loop obtained, a line each: UTF-8, padded with zeros;
    /// constant once `header.ready` is set.
    pub setup_report: [AtomicU64; REPORT_WORDS],
    /// Frame `k` lies in slot `k % RING_FRAMES`.
    pub frames: [FrameSlot; RING_FRAMES],
}

assert_layout!(DriverSegment: 11041024, 64 {
    header: DriverHeader = 0,
    bell: Bell = 128,
    counters: Counters = 192,
    devices: [DeviceDescription; MAX_DEVICES] = 320,
    wake_error_ns: HistogramBlock = 1856,
    cycle_ns: HistogramBlock = 10112,
    round_trip_ns: HistogramBlock = 18368,
    epitaph: [AtomicU64; EPITAPH_WORDS] = 26624,
    setup_report: [AtomicU64; REPORT_WORDS] = 26880,
    frames: [FrameSlot; RING_FRAMES] = 30976,
});

/// The start of the driver's segment.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct DriverHeader {
    /// [`MAGIC`].
    pub magic: AtomicU64,
    /// [`ABI_VERSION`].
    pub abi_version: AtomicU64,
    /// [`LAYOUT_HASH`].
    pub layout_hash: AtomicU64,
    /// Bytes of the whole segment.
    pub segment_bytes: AtomicU64,
    /// Process id of the driver.
    pub driver_pid: AtomicU64,
    /// Length of a tick (ns).
    pub period_ns: AtomicU64,
    /// How long the driver waits for a reply within a tick (ns); u64::MAX: for ever (lockstep).
    pub reply_budget_ns: AtomicU64,
    /// How many ticks an old command may still drive the motors.
    pub max_command_age_ticks: AtomicU64,
    /// How many ticks the force takes from full to zero once commands fail.
    pub ramp_out_ticks: AtomicU64,
    /// How many ticks it takes from zero to full for a new lease.
    pub ramp_in_ticks: AtomicU64,
    /// How many devices exist.
    pub device_count: AtomicU64,
    /// A [`ClockMode`](crate::segment::ClockMode).
    pub clock_mode: AtomicU64,
    /// A [`WaitMode`](crate::doorbell::WaitMode): how the driver waits for a reply.
    pub wait_mode: AtomicU64,
    /// CPU of the driver's loop plus one; 0: any.
    pub cpu_plus_one: AtomicU64,
    /// Since 1.1. Bit 0: commissioning, with little force; see [`DRIVER_COMMISSIONING`].
    pub flags: AtomicU64,
    /// 1 once everything above stands; written last.
    pub ready: AtomicU64,
}

/// [`DriverHeader::flags`]: forces and speeds are cut to those of commissioning.
pub const DRIVER_COMMISSIONING: u64 = 1;

assert_layout!(DriverHeader: 128, 64 {
    magic: AtomicU64 = 0,
    abi_version: AtomicU64 = 8,
    layout_hash: AtomicU64 = 16,
    segment_bytes: AtomicU64 = 24,
    driver_pid: AtomicU64 = 32,
    period_ns: AtomicU64 = 40,
    reply_budget_ns: AtomicU64 = 48,
    max_command_age_ticks: AtomicU64 = 56,
    ramp_out_ticks: AtomicU64 = 64,
    ramp_in_ticks: AtomicU64 = 72,
    device_count: AtomicU64 = 80,
    clock_mode: AtomicU64 = 88,
    wait_mode: AtomicU64 = 96,
    cpu_plus_one: AtomicU64 = 104,
    reserved: AtomicU64 = 112 => { flags: AtomicU64 = 112, },
    ready: AtomicU64 = 120,
});

/// The number of the newest value, the word to sleep on, and whether its own side sleeps on the other's.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct Bell {
    /// Number of the newest complete value plus one; 0: none yet. Written after the value.
    pub latest_plus_one: AtomicU64,
    /// The low half of `latest_plus_one`, written after it: the futex word.
    pub doorbell: AtomicU32,
    /// Keeps the next word aligned.
    pub padding: AtomicU32,
    /// [`SLEEPS_ON_OTHERS_BELL`] while the owner of *this* segment sleeps on the *other* segment's doorbell; since
    /// 1.3 [`SLEEPS_ON_OWN_WORD`] while the commander sleeps on its own [`CommanderHeader::frame_doorbell`].
    pub owner_sleeps: AtomicU64,
    /// Fills the cache line, so that ringing disturbs nothing else.
    pub reserved: [AtomicU64; 5],
}

/// [`Bell::owner_sleeps`]: on the other segment's doorbell.
pub const SLEEPS_ON_OTHERS_BELL: u64 = 1;
/// [`Bell::owner_sleeps`]: on the word of the own segment that the other side rings.
pub const SLEEPS_ON_OWN_WORD: u64 = 2;

assert_layout!(Bell: 64, 64 {
    latest_plus_one: AtomicU64 = 0,
    doorbell: AtomicU32 = 8,
    padding: AtomicU32 = 12,
    owner_sleeps: AtomicU64 = 16,
    reserved: [AtomicU64; 5] = 24,
});

/// Counts since the driver's start.
#[repr(C, align(64))]
#[derive(Debug, Default)]
pub struct Counters {
    /// Ticks done.
    pub ticks: AtomicU64,
    /// Deadlines skipped because the loop was still busy or asleep.
    pub overruns: AtomicU64,
    /// Ticks under a lease.
    pub ticks_commanded: AtomicU64,
    /// Of these, ticks whose reply arrived in time.
    pub replies_fresh: AtomicU64,
    /// Of these, ticks without a reply in time.
    pub replies_missed: AtomicU64,
    /// Commands that were torn.
    pub commands_torn: AtomicU64,
    /// Commands that were whole but not believed.
    pub commands_refused: AtomicU64,
    /// Forces cut to a device's peak.
    pub forces_limited: AtomicU64,
    /// Leases granted.
    pub leases_granted: AtomicU64,
    /// Would-be commanders refused because somebody held the lease.
    pub leases_refused: AtomicU64,
    /// Faults entered.
    pub faults: AtomicU64,
    /// Log records dropped.
    pub log_dropped: AtomicU64,
    /// Since 1.1. Forces that grew slower than commanded.
    pub forces_slewed: AtomicU64,
    /// Since 1.1. Forces cut because motors were warm.
    pub forces_derated: AtomicU64,
    /// Since 1.1. Forces cut outside the workspace.
    pub forces_faded: AtomicU64,
    /// Since 1.1. Ticks without force because the dead-man's switch was not held.
    pub ticks_unattended: AtomicU64,
}

assert_layout!(Counters: 128, 64 {
    ticks: AtomicU64 = 0,
    overruns: AtomicU64 = 8,
    ticks_commanded: AtomicU64 = 16,
    replies_fresh: AtomicU64 = 24,
    replies_missed: AtomicU64 = 32,
    commands_torn: AtomicU64 = 40,
    commands_refused: AtomicU64 = 48,
    forces_limited: AtomicU64 = 56,
    leases_granted: AtomicU64 = 64,
    leases_refused: AtomicU64 = 72,
    faults: AtomicU64 = 80,
    log_dropped: AtomicU64 = 88,
    reserved: [AtomicU64; 4] = 96 => {
        forces_slewed: AtomicU64 = 96,
        forces_derated: AtomicU64 = 104,
        forces_faded: AtomicU64 = 112,
        ticks_unattended: AtomicU64 = 120,
    },
});

/// What a device is.
#[repr(C, align(64))]
#[derive(Debug, Default)]
pub struct DeviceDescription {
    /// UTF-8, padded with zeros.
    pub name: [AtomicU64; NAME_WORDS],
    /// UTF-8, padded with zeros: the kind, such as "premium" or "ideal".
    pub kind: [AtomicU64; 2],
    /// Bits of an f64: the largest force (N); infinite where there is no limit.
    pub peak_force_n: AtomicU64,
    /// Bits of an f64: the force it can hold for ever (N).
    pub continuous_force_n: AtomicU64,
    /// Bits of f64s: the smallest corner of the workspace in D (m).
    pub workspace_min_m: [AtomicU64; 3],
    /// Bits of f64s: its largest corner (m).
    pub workspace_max_m: [AtomicU64; 3],
    /// Since 1.1. Bits of an f64: how fast a force may grow (N/s); infinite: no limit, 0: the driver is 1.0.
    pub slew_n_per_s: AtomicU64,
    /// Since 1.1. Bits of an f64: the tip's speed that is a fault (m/s); infinite: none, 0: the driver is 1.0.
    pub speed_limit_m_per_s: AtomicU64,
    /// Room for later minor versions; zero.
    pub reserved: [AtomicU64; 4],
}

assert_layout!(DeviceDescription: 192, 64 {
    name: [AtomicU64; NAME_WORDS] = 0,
    kind: [AtomicU64; 2] = 64,
    peak_force_n: AtomicU64 = 80,
    continuous_force_n: AtomicU64 = 88,
    workspace_min_m: [AtomicU64; 3] = 96,
    workspace_max_m: [AtomicU64; 3] = 120,
    reserved: [AtomicU64; 6] = 144 => {
        slew_n_per_s: AtomicU64 = 144,
        speed_limit_m_per_s: AtomicU64 = 152,
        reserved: [AtomicU64; 4] = 160,
    },
});

/// A histogram of nanoseconds with one writer.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct HistogramBlock {
    /// Values recorded.
    pub count: AtomicU64,
    /// The largest (ns).
    pub max_ns: AtomicU64,
    /// Their sum (ns).
    pub sum_ns: AtomicU64,
    /// Fills the cache line.
    pub reserved: [AtomicU64; 5],
    /// How many fell into each bucket; see [`HISTOGRAM_BUCKETS`].
    pub buckets: [AtomicU64; HISTOGRAM_BUCKETS],
}

assert_layout!(HistogramBlock: 8256, 64 {
    count: AtomicU64 = 0,
    max_ns: AtomicU64 = 8,
    sum_ns: AtomicU64 = 16,
    reserved: [AtomicU64; 5] = 24,
    buckets: [AtomicU64; HISTOGRAM_BUCKETS] = 64,
});

/// One [`Frame`] under its sequence.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct FrameSlot {
    /// `2k + 1` while frame `k` is written, `2k + 2` once it stands.
    pub sequence: AtomicU64,
    /// The frame's words.
    pub words: [AtomicU64; FRAME_WORDS],
}

assert_layout!(FrameSlot: 2688, 64 {
    sequence: AtomicU64 = 0,
    words: [AtomicU64; FRAME_WORDS] = 8,
});

/// The commander's segment: written by the holder of the lease, read by the driver.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct CommanderSegment {
    /// Which lease this belongs to; written by the driver before it is handed over.
    pub header: CommanderHeader,
    /// The tick last answered (plus one) and the word the driver waits on.
    pub bell: Bell,
    /// The answer to tick `k` lies in slot `k % RING_COMMANDS`.
    pub commands: [CommandSlot; RING_COMMANDS],
}

assert_layout!(CommanderSegment: 1408, 64 {
    header: CommanderHeader = 0,
    bell: Bell = 64,
    commands: [CommandSlot; RING_COMMANDS] = 128,
});

/// The start of the commander's segment.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct CommanderHeader {
    /// [`MAGIC`].
    pub magic: AtomicU64,
    /// [`ABI_VERSION`].
    pub abi_version: AtomicU64,
    /// [`LAYOUT_HASH`].
    pub layout_hash: AtomicU64,
    /// Bytes of the whole segment.
    pub segment_bytes: AtomicU64,
    /// The lease.
    pub lease: AtomicU64,
    /// Since 1.3. The futex word that the commander sleeps on, and nobody else can: changed and rung by the
    /// driver while [`Bell::owner_sleeps`] is [`SLEEPS_ON_OWN_WORD`].
    pub frame_doorbell: AtomicU32,
    /// Keeps the next word aligned.
    pub padding: AtomicU32,
    /// Since 1.3. 1 once the commander has mapped the segment; written by it, so that the driver may forbid
    /// everybody to map or to punch it again.
    pub mapped: AtomicU64,
    /// Fills the cache line.
    pub reserved: AtomicU64,
}

assert_layout!(CommanderHeader: 64, 64 {
    magic: AtomicU64 = 0,
    abi_version: AtomicU64 = 8,
    layout_hash: AtomicU64 = 16,
    segment_bytes: AtomicU64 = 24,
    lease: AtomicU64 = 32,
    reserved: [AtomicU64; 3] = 40 => {
        frame_doorbell: AtomicU32 = 40,
        padding: AtomicU32 = 44,
        mapped: AtomicU64 = 48,
        reserved: AtomicU64 = 56,
    },
});

/// One [`Command`] under its sequence.
#[repr(C, align(64))]
#[derive(Debug)]
pub struct CommandSlot {
    /// `2k + 1` while the answer to tick `k` is written, `2k + 2` once it stands.
    pub sequence: AtomicU64,
    /// The command's words.
    pub words: [AtomicU64; COMMAND_WORDS],
    /// Fills the cache line.
    pub padding: [AtomicU64; 3],
}

assert_layout!(CommandSlot: 320, 64 {
    sequence: AtomicU64 = 0,
    words: [AtomicU64; COMMAND_WORDS] = 8,
    padding: [AtomicU64; 3] = 296,
});

/// Hash of every type, name, size and offset of the contract.
pub const LAYOUT_HASH: u64 = hash_of(&[
    DriverSegment::LAYOUT,
    DriverHeader::LAYOUT,
    Bell::LAYOUT,
    Counters::LAYOUT,
    DeviceDescription::LAYOUT,
    HistogramBlock::LAYOUT,
    FrameSlot::LAYOUT,
    Frame::LAYOUT,
    crate::frame::Outcome::LAYOUT,
    crate::frame::DeviceFrame::LAYOUT,
    CommanderSegment::LAYOUT,
    CommanderHeader::LAYOUT,
    CommandSlot::LAYOUT,
    Command::LAYOUT,
    crate::command::DeviceCommand::LAYOUT,
]);

/// FNV-1a over the texts: cheap, in a constant, and any change shows.
const fn hash_of(texts: &[&str]) -> u64 {
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    let mut text = 0;
    while text < texts.len() {
        let bytes = texts[text].as_bytes();
        let mut at = 0;
        while at < bytes.len() {
            hash = (hash ^ bytes[at] as u64).wrapping_mul(0x0000_0100_0000_01b3);
            at += 1;
        }
        text += 1;
    }
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_the_one_that_was_published() {
        // A failure here means that old programs would be refused. If that is meant, raise ABI_MAJOR, give it a
        // row in the CHANGELOG, then update the constant here and make the C header anew:
        // `PHANTOM3_BLESS=1 cargo test -p shm-abi --test c_header`.
        assert_eq!(LAYOUT_HASH, PUBLISHED_LAYOUT_HASH, "now 0x{LAYOUT_HASH:016x}");
    }

    const PUBLISHED_LAYOUT_HASH: u64 = 0x8568_8db9_fa62_8dbf;

    #[test]
    fn the_hash_notices_a_renamed_field_and_a_moved_one() {
        assert_ne!(hash_of(&["a:0;"]), hash_of(&["b:0;"]));
        assert_ne!(hash_of(&["a:0;"]), hash_of(&["a:8;"]));
    }
}
