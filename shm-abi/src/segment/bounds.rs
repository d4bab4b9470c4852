//! Bounds of what a driver may say of itself.
//!
//! A driver that lies must not make a client divide by zero, wait for ever or reserve all memory. The bounds are at
//! or beyond what any driver can be configured to; whoever exceeds them is not believed at all.

use super::{SegmentError, get};
use crate::layout::{DriverHeader, DriverSegment, MAX_DEVICES};
use std::ops::RangeInclusive;
use std::sync::atomic::AtomicU64;

/// The shortest tick of a driver (ns): 20 kHz. A driver that told of a nanosecond would make hours of a run of seconds.
pub const SHORTEST_PERIOD_NS: u64 = 50_000;
/// Length of a tick: from the shortest that a driver can be configured to, to ten seconds.
pub(super) const PERIOD_NS: RangeInclusive<u64> = SHORTEST_PERIOD_NS..=10_000_000_000;
/// Ages and ramps: a day of ticks at 40 kHz.
const TICKS: RangeInclusive<u64> = 1..=1 << 32;

/// A word of the header, its name and its bounds.
type Bounded<'a> = (&'static str, &'a AtomicU64, RangeInclusive<u64>);

/// Refuses a header that no driver of this contract has.
pub(super) fn check(header: &DriverHeader) -> Result<(), SegmentError> {
    bounded(header).into_iter().try_for_each(|(what, word, expected)| match get(word) {
        found if expected.contains(&found) => Ok(()),
        found => {
            Err(SegmentError::Impossible { what, found, least: *expected.start(), most: *expected.end() })
        }
    })
}

fn bounded(header: &DriverHeader) -> [Bounded<'_>; 7] {
    let bytes = size_of::<DriverSegment>() as u64;
    [
        ("segment of so many bytes", &header.segment_bytes, bytes..=bytes),
        ("period in nanoseconds", &header.period_ns, PERIOD_NS),
        ("reply budget in nanoseconds", &header.reply_budget_ns, 1..=u64::MAX),
        ("age of a command in ticks", &header.max_command_age_ticks, 0..=*TICKS.end()),
        ("ramp out in ticks", &header.ramp_out_ticks, TICKS),
        ("ramp in in ticks", &header.ramp_in_ticks, TICKS),
        ("number of devices", &header.device_count, 0..=MAX_DEVICES as u64),
    ]
}
