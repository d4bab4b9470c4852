//! What the commander answers: one [`Command`] per tick, for all devices.
//!
//! A command is an allegation until [`Command::validate`] has looked at it.

use crate::layout::{MAX_DEVICES, assert_layout};
use bytemuck::{Pod, Zeroable};
use thiserror::Error;

/// The reply to one frame.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Command {
    /// The tick of the frame that this answers.
    pub tick: u64,
    /// The lease number that the commander was given.
    pub lease: u64,
    /// How many of `devices` are meant.
    pub device_count: u64,
    /// Room for later minor versions; zero.
    pub reserved: u64,
    /// One per device, in the frame's order.
    pub devices: [DeviceCommand; MAX_DEVICES],
}

assert_layout!(Command: 288, 8 {
    tick: u64 = 0,
    lease: u64 = 8,
    device_count: u64 = 16,
    reserved: u64 = 24,
    devices: [DeviceCommand; MAX_DEVICES] = 32,
});

/// What one device shall do.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct DeviceCommand {
    /// The force on the user, in the device's base frame D (N).
    pub force_on_user_n: [f64; 3],
    /// Room for later minor versions; zero.
    pub reserved: u64,
}

assert_layout!(DeviceCommand: 32, 8 {
    force_on_user_n: [f64; 3] = 0,
    reserved: u64 = 24,
});

/// Why a command was not believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum CommandRefusal {
    /// It was being written, or its writer died.
    #[error("the command was torn")]
    Torn,
    /// It answers another tick than the slot and doorbell say.
    #[error("the command answers tick {found}, expected {expected}")]
    WrongTick {
        /// The tick in the command.
        found: u64,
        /// The tick its place stands for.
        expected: u64,
    },
    /// It was written under another lease.
    #[error("the command carries lease {found}, expected {expected}")]
    WrongLease {
        /// The lease in the command.
        found: u64,
        /// The lease in force.
        expected: u64,
    },
    /// It commands another number of devices than there are.
    #[error("the command is for {found} devices, expected {expected}")]
    WrongDeviceCount {
        /// The count in the command.
        found: u64,
        /// The devices that exist.
        expected: u64,
    },
    /// A force is NaN or infinite.
    #[error("the force for device {device} is not finite")]
    NotFinite {
        /// Index of the first such device.
        device: usize,
    },
}

impl Command {
    /// A command of zero force.
    pub fn zero(tick: u64, lease: u64, device_count: u64) -> Self {
        Self { tick, lease, device_count, ..Self::zeroed() }
    }

    /// Believes the command, or says why not. No force beyond `device_count` is looked at.
    pub fn validate(&self, tick: u64, lease: u64, device_count: u64) -> Result<(), CommandRefusal> {
        if self.tick != tick {
            return Err(CommandRefusal::WrongTick { found: self.tick, expected: tick });
        }
        if self.lease != lease {
            return Err(CommandRefusal::WrongLease { found: self.lease, expected: lease });
        }
        if self.device_count != device_count {
            return Err(CommandRefusal::WrongDeviceCount {
                found: self.device_count,
                expected: device_count,
            });
        }
        let meant = usize::try_from(device_count).unwrap_or(MAX_DEVICES).min(MAX_DEVICES);
        for (device, command) in self.devices[..meant].iter().enumerate() {
            if !command.force_on_user_n.iter().all(|n| n.is_finite()) {
                return Err(CommandRefusal::NotFinite { device });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_lie_is_told_apart() {
        let good = Command::zero(5, 2, 3);
        assert_eq!(good.validate(5, 2, 3), Ok(()));
        assert_eq!(good.validate(6, 2, 3), Err(CommandRefusal::WrongTick { found: 5, expected: 6 }));
        assert_eq!(good.validate(5, 1, 3), Err(CommandRefusal::WrongLease { found: 2, expected: 1 }));
        assert_eq!(good.validate(5, 2, 1), Err(CommandRefusal::WrongDeviceCount { found: 3, expected: 1 }));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut command = good;
            command.devices[2].force_on_user_n[1] = bad;
            assert_eq!(command.validate(5, 2, 3), Err(CommandRefusal::NotFinite { device: 2 }));
        }
        let mut beyond = good;
        beyond.devices[3].force_on_user_n[0] = f64::NAN;
        assert_eq!(beyond.validate(5, 2, 3), Ok(()), "a device that does not exist is not looked at");
    }
}
