//! Premises of a run about its driver: what must be the same when the driver ends and comes back.
//!
//! Problem: a run counts its time in the driver's ticks, steps by their length, and takes each finger's place from a device
//! by its number. A driver that was started again with another configuration would make it go on at another speed, or
//! move another finger, without a word.
//! Model: the length of a tick, the clock, the version of the contract, and names and kinds of the devices that the run
//! uses are kept from the first driver, and compared before a lease is asked of the next. More devices do no harm.

use shm_abi::segment::{ClockMode, DriverInfo};
use shm_abi::{ABI_MAJOR, DriverView};
use thiserror::Error;

/// Driver that a run was begun with, as far as the run depends on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Premises {
    period_ns: u64,
    clock: ClockMode,
    abi_minor: u32,
    /// Name and kind of each device that is used.
    devices: Vec<[String; 2]>,
}

/// The driver is another one than before.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum OtherDriver {
    /// Its ticks have another length.
    #[error("its tick lasts {found} ns, the run began with {before} ns")]
    Period {
        /// Of this driver.
        found: u64,
        /// Of the first one.
        before: u64,
    },
    /// Something else moves its ticks.
    #[error("its clock is {found}, the run began with {before}")]
    Clock {
        /// Of this driver.
        found: &'static str,
        /// Of the first one.
        before: &'static str,
    },
    /// It speaks another version.
    #[error(
        "it speaks version {ABI_MAJOR}.{found} of the shared-memory contract, the run began with {ABI_MAJOR}.{before}"
    )]
    Contract {
        /// The minor version of this driver.
        found: u32,
        /// That of the first one.
        before: u32,
    },
    /// It has fewer devices than the run uses.
    #[error("it has {found} devices, the run uses {used}")]
    Fewer {
        /// Of this driver.
        found: usize,
        /// By the run.
        used: usize,
    },
    /// Another device is in its place.
    #[error("its device {place} is {} ({}), the run began with {} ({})", found[0], found[1], before[0], before[1])]
    Device {
        /// Its number, from 0.
        place: usize,
        /// Name and kind now.
        found: [String; 2],
        /// Name and kind at first.
        before: [String; 2],
    },
}

impl Premises {
    /// Of a run that uses the first `used` devices of this driver.
    pub fn of(driver: &DriverView, used: usize) -> Self {
        Self::told(&driver.info(), driver.abi_minor(), used)
    }

    /// Looks whether this driver can take the place of the first one.
    ///
    /// # Errors
    /// The first difference.
    pub fn judge(&self, driver: &DriverView) -> Result<(), OtherDriver> {
        self.compare(&Self::told(&driver.info(), driver.abi_minor(), self.devices.len()))
    }

    fn told(info: &DriverInfo, abi_minor: u32, used: usize) -> Self {
        let devices = info.devices.iter().take(used);
        Self {
            period_ns: info.period_ns,
            clock: info.clock_mode,
            abi_minor,
            devices: devices.map(|device| [device.name.clone(), device.kind.clone()]).collect(),
        }
    }

    fn compare(&self, found: &Self) -> Result<(), OtherDriver> {
        if found.abi_minor != self.abi_minor {
            return Err(OtherDriver::Contract { found: found.abi_minor, before: self.abi_minor });
        }
        if found.clock != self.clock {
            return Err(OtherDriver::Clock { found: found.clock.name(), before: self.clock.name() });
        }
        if found.period_ns != self.period_ns {
            return Err(OtherDriver::Period { found: found.period_ns, before: self.period_ns });
        }
        if found.devices.len() < self.devices.len() {
            return Err(OtherDriver::Fewer { found: found.devices.len(), used: self.devices.len() });
        }
        let mut pairs = found.devices.iter().zip(&self.devices).enumerate();
        let Some((place, (found, before))) = pairs.find(|(_, (found, before))| found != before) else {
            return Ok(());
        };
        Err(OtherDriver::Device { place, found: found.clone(), before: before.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn premises(names: &[&str]) -> Premises {
        let devices = names.iter().map(|name| [(*name).into(), "premium".into()]).collect();
        Premises { period_ns: 1_000_000, clock: ClockMode::Real, abi_minor: 3, devices }
    }

    #[test]
    fn each_difference_is_told_with_both_values() {
        let began = premises(&["f0", "f1"]);
        let others = [
            (Premises { period_ns: 4_000_000, ..began.clone() }, "4000000 ns, the run began with 1000000 ns"),
            (Premises { clock: ClockMode::Lockstep, ..began.clone() }, "lockstep, the run began with real"),
            (
                Premises { abi_minor: 2, ..began.clone() },
                "version 1.2 of the shared-memory contract, the run began with 1.3",
            ),
            (premises(&["f0"]), "it has 1 devices, the run uses 2"),
            (premises(&["f1", "f0"]), "its device 0 is f1 (premium), the run began with f0 (premium)"),
            (premises(&["f0", "thumb"]), "its device 1 is thumb (premium), the run began with f1 (premium)"),
        ];
        for (other, words) in others {
            let told = began.compare(&other).expect_err(words).to_string();
            assert!(told.contains(words), "{told}");
        }
        assert_eq!(began.compare(&began), Ok(()));
    }
}
