//! Telling a device that it is in its zeroing pose: when that is believed, and what follows.
//!
//! Problem: counters know how far joints turned, not where they were. A zero taken in another pose makes every
//! position, force and limit of the workspace wrong by as much, and nothing in the driver could see it.
//! Model: a zero is asked for by a person ([`Cycle::zero`](crate::cycle::Cycle::zero)) and granted only while no
//! force is let through, nobody is being answered and the device stands still ([`Stillness`]). It is refused as a
//! whole or granted as a whole, and a refused one changes nothing.
//! After it the devices stay not valid for a tick at least, and until a commander that has been answering before
//! has answered a tick in which they were not: else one that slept meanwhile would go on with contacts at the old
//! places.
//! Cost: constant for each device; no allocation.

use crate::safety::elapsed::Elapsed;
use crate::safety::stillness::Stillness;
use shm_abi::MAX_DEVICES;
use std::fmt;
use thiserror::Error;

/// What a device has to do with zeroing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZeroState {
    /// It has no counters, and always knows where it is.
    Innate,
    /// It knows where it is.
    Zeroed,
    /// It knows only how far it moved.
    Needed,
}

/// Devices by the bits of a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DeviceSet(pub u64);

impl DeviceSet {
    /// Whether a device is one of them.
    pub fn has(self, device: usize) -> bool {
        device < MAX_DEVICES && self.0 >> device & 1 == 1
    }
}

impl fmt::Display for DeviceSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<String> =
            (0..MAX_DEVICES).filter(|device| self.has(*device)).map(|device| device.to_string()).collect();
        f.write_str(&names.join(", "))
    }
}

/// Why devices were not zeroed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ZeroRefusal {
    /// A force is let through, or could be in this very tick.
    #[error("somebody commands the devices")]
    Commanded,
    /// There is no such device.
    #[error("there is no device with this number")]
    NoSuchDevice,
    /// It has no counters.
    #[error("a device has no counters, it always knows where it is")]
    Innate,
    /// It moved, or could not be read.
    #[error("device {0} did not stand still for half a second, or could not be read")]
    Moving(usize),
}

impl ZeroRefusal {
    /// What the loop may log, and the number that belongs into it.
    pub fn for_log(self) -> (&'static str, Option<f64>) {
        match self {
            Self::Commanded => ("zero refused: somebody commands the devices", None),
            Self::NoSuchDevice => ("zero refused: there is no device with this number", None),
            Self::Innate => ("zero refused: a device has no counters, it always knows where it is", None),
            Self::Moving(device) => {
                let words =
                    "zero refused: device {} did not stand still for half a second, or could not be read";
                (words, Some(device as f64))
            }
        }
    }
}

/// What the loop remembers of rest and of zeros.
#[derive(Debug, Clone)]
pub(crate) struct ZeroWatch {
    still: [Stillness; MAX_DEVICES],
    /// Zeroed, and not valid yet.
    withheld: DeviceSet,
    /// The first tick in which they are told so; `None`: that is the next one.
    withheld_since: Option<u64>,
}

impl ZeroWatch {
    pub(crate) fn new() -> Self {
        let still = [Stillness::default(); MAX_DEVICES];
        Self { still, withheld: DeviceSet(0), withheld_since: None }
    }

    pub(crate) fn observe(&mut self, device: usize, counts: [i64; 6], elapsed: Elapsed) {
        self.still[device].observe(counts, elapsed);
    }

    pub(crate) fn lose_sight(&mut self, device: usize) {
        self.still[device].lose_sight();
    }

    /// Which devices a request means, if it may be granted.
    pub(crate) fn choose(
        &self,
        asked: DeviceSet,
        is_commanded: bool,
        states: &[ZeroState],
    ) -> Result<DeviceSet, ZeroRefusal> {
        let present = (1u64 << states.len()) - 1;
        if asked.0 & !present != 0 {
            return Err(ZeroRefusal::NoSuchDevice);
        }
        let is_innate =
            |(device, state): (usize, &ZeroState)| u64::from(*state == ZeroState::Innate) << device;
        let innate = states.iter().enumerate().map(is_innate).fold(0, |bits, bit| bits | bit);
        let chosen = DeviceSet(if asked.0 == 0 { present & !innate } else { asked.0 });
        if chosen.0 & innate != 0 || chosen.0 == 0 {
            return Err(ZeroRefusal::Innate);
        }
        if is_commanded {
            return Err(ZeroRefusal::Commanded);
        }
        let moves = |device: &usize| chosen.has(*device) && !self.still[*device].is_still();
        match (0..states.len()).find(moves) {
            Some(device) => Err(ZeroRefusal::Moving(device)),
            None => Ok(chosen),
        }
    }

    /// They were zeroed after the last tick.
    pub(crate) fn withhold(&mut self, devices: DeviceSet) {
        self.withheld = DeviceSet(self.withheld.0 | devices.0);
        self.withheld_since = None;
    }

    /// A tick begins. `answered`: the tick that the commander answered last, if somebody commands and has.
    pub(crate) fn begin_tick(&mut self, tick: u64, answered: Option<u64>) {
        let Some(since) = self.withheld_since else {
            self.withheld_since = Some(tick);
            return;
        };
        if answered.is_none_or(|answered| answered >= since) {
            self.withheld = DeviceSet(0);
        }
    }

    /// Whether a device that was zeroed is not to be valid yet.
    pub(crate) fn is_withheld(&self, device: usize) -> bool {
        self.withheld.has(device)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATES: [ZeroState; 3] = [ZeroState::Needed, ZeroState::Innate, ZeroState::Zeroed];

    const TICK: Elapsed = Elapsed::new(100_000_000, 100_000_000);

    fn resting() -> ZeroWatch {
        let mut watch = ZeroWatch::new();
        for device in [0, 1, 2] {
            (0..5).for_each(|_| watch.observe(device, [0; 6], TICK));
        }
        watch
    }

    fn choose(watch: &ZeroWatch, asked: u64, is_commanded: bool) -> Result<u64, ZeroRefusal> {
        watch.choose(DeviceSet(asked), is_commanded, &STATES).map(|chosen| chosen.0)
    }

    #[test]
    fn nobody_named_means_every_device_that_counts() {
        assert_eq!(choose(&resting(), 0, false), Ok(0b101));
        assert_eq!(choose(&resting(), 0b100, false), Ok(0b100));
    }

    #[test]
    fn what_cannot_be_zeroed_is_refused_with_its_reason() {
        let mut watch = resting();
        assert_eq!(choose(&watch, 0b1001, false), Err(ZeroRefusal::NoSuchDevice));
        assert_eq!(choose(&watch, 1 << 63, false), Err(ZeroRefusal::NoSuchDevice));
        assert_eq!(choose(&watch, 0b011, false), Err(ZeroRefusal::Innate));
        assert_eq!(choose(&watch, 0b101, true), Err(ZeroRefusal::Commanded));
        watch.observe(2, [3, 0, 0, 0, 0, 0], TICK);
        assert_eq!(choose(&watch, 0, false), Err(ZeroRefusal::Moving(2)));
        assert_eq!(choose(&watch, 0b001, false), Ok(0b001), "the one that rests can be zeroed");
        watch.lose_sight(0);
        assert_eq!(choose(&watch, 0b001, false), Err(ZeroRefusal::Moving(0)));
    }

    #[test]
    fn devices_without_counters_have_nothing_to_zero() {
        let watch = resting();
        let none = watch.choose(DeviceSet(0), false, &[ZeroState::Innate]);
        assert_eq!(none, Err(ZeroRefusal::Innate));
    }

    #[test]
    fn a_zeroed_device_is_withheld_for_a_tick_and_until_its_commander_has_seen_that() {
        let mut watch = resting();
        let begin = |watch: &mut ZeroWatch, tick, answered| {
            watch.begin_tick(tick, answered);
            watch.is_withheld(0)
        };
        watch.withhold(DeviceSet(1));
        assert!(begin(&mut watch, 11, None));
        assert!(!begin(&mut watch, 12, None), "nobody had to see it");
        watch.withhold(DeviceSet(1));
        assert!(begin(&mut watch, 13, Some(7)));
        assert!(begin(&mut watch, 14, Some(7)), "it sleeps");
        assert!(begin(&mut watch, 15, Some(12)), "it answered an old one");
        assert!(!begin(&mut watch, 16, Some(13)));
    }
}
