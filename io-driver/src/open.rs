//! From configuration to devices that can be read: files are opened here and nowhere later.

use crate::config::{Backend, DeviceConfig, DriverConfig};
use crate::device::Device;
use crate::device::encoder_trace::{EncoderReplay, EncoderTrace, TraceError};
use crate::device::ideal::{Hand, IdealDevice};
use crate::device::replay::ReplayDevice;
use crate::device_file::{self, DeviceFile, DeviceFileError, PremiumFile};
use crate::sim::script::{HandError, HandPlayer, HandScript};
use shm_abi::segment::DeviceInfo;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why a device cannot be had.
#[derive(Debug, Error)]
pub enum OpenError {
    /// A file cannot be read.
    #[error("device {device}: cannot read {file}: {source}")]
    Unreadable {
        /// Whose.
        device: String,
        /// Which.
        file: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The hand file is wrong.
    #[error(transparent)]
    Hand(#[from] HandError),
    /// The trace is wrong.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The description is wrong.
    #[error(transparent)]
    Description(#[from] DeviceFileError),
    /// The description has no mechanism that encoders could move.
    #[error(
        "device {device}: {file} describes an ideal device, which has no encoders; a replay needs a mechanism such as premium-1.5"
    )]
    NoMechanism {
        /// Whose.
        device: String,
        /// Which.
        file: PathBuf,
    },
}

/// Opens all devices of a configuration.
///
/// # Errors
/// The first that cannot be had, and why.
pub fn open_devices(config: &DriverConfig) -> Result<Vec<Box<dyn Device>>, OpenError> {
    config.devices.iter().map(|device| open(device, config)).collect()
}

fn open(device: &DeviceConfig, config: &DriverConfig) -> Result<Box<dyn Device>, OpenError> {
    match &device.backend {
        Backend::Ideal { hand, start_m, base_in_world } => {
            let hand = match hand {
                Some((file, finger)) => scripted(device, file, finger, config, *start_m)?,
                None => Hand::Resting(*start_m),
            };
            Ok(Box::new(IdealDevice::new(ideal_info(device), *base_in_world, hand)))
        }
        Backend::Replay { description, trace } => replay(device, description, trace),
    }
}

/// The hand file may hold other fingers' columns: those of all devices that share it are known.
fn scripted(
    device: &DeviceConfig,
    file: &Path,
    finger: &str,
    config: &DriverConfig,
    start_m: nalgebra::Vector3<f64>,
) -> Result<Hand, OpenError> {
    let fingers: Vec<&str> = config
        .devices
        .iter()
        .filter_map(|other| match &other.backend {
            Backend::Ideal { hand: Some((path, name)), .. } if path == file => Some(name.as_str()),
            _ => None,
        })
        .collect();
    let script = HandScript::parse(&read(device, file)?, file, &fingers)?;
    let index = fingers.iter().position(|name| *name == finger).unwrap_or(0);
    Ok(if script.is_scripted(index) {
        Hand::Scripted(HandPlayer::new(script), index)
    } else {
        Hand::Resting(start_m)
    })
}

fn replay(device: &DeviceConfig, description: &Path, trace: &Path) -> Result<Box<dyn Device>, OpenError> {
    let premium = match describe(device, description)? {
        DeviceFile::Premium(premium) => premium,
        DeviceFile::Ideal(_) => {
            return Err(OpenError::NoMechanism { device: device.name.clone(), file: description.into() });
        }
    };
    let trace = EncoderTrace::parse(&read(device, trace)?, trace, premium.encoders.count_bits)?;
    let info = premium_info(device, &premium);
    let kinematics = crate::kinematics::Kinematics::Premium(premium.mechanism);
    let replay = EncoderReplay::new(trace);
    Ok(Box::new(ReplayDevice::new(info, replay, kinematics, &premium.encoders, &premium.motors)))
}

fn describe(device: &DeviceConfig, description: &Path) -> Result<DeviceFile, OpenError> {
    let text = match device_file::builtin(&description.to_string_lossy()) {
        Some(text) => text.to_owned(),
        None => read(device, description)?,
    };
    Ok(DeviceFile::parse(&text, description)?)
}

fn read(device: &DeviceConfig, file: &Path) -> Result<String, OpenError> {
    std::fs::read_to_string(file).map_err(|source| OpenError::Unreadable {
        device: device.name.clone(),
        file: file.into(),
        source,
    })
}

fn ideal_info(device: &DeviceConfig) -> DeviceInfo {
    let peak_force_n = device.peak_force_n.unwrap_or(f64::INFINITY);
    DeviceInfo {
        name: device.name.clone(),
        kind: "ideal".into(),
        peak_force_n,
        continuous_force_n: peak_force_n,
        workspace_min_m: [f64::NEG_INFINITY; 3],
        workspace_max_m: [f64::INFINITY; 3],
    }
}

fn premium_info(device: &DeviceConfig, premium: &PremiumFile) -> DeviceInfo {
    let corner = |sign: f64| {
        std::array::from_fn(|axis| {
            premium.workspace.centre_m[axis] + sign * 0.5 * premium.workspace.size_m[axis]
        })
    };
    DeviceInfo {
        name: device.name.clone(),
        kind: "premium".into(),
        peak_force_n: device.peak_force_n.unwrap_or(premium.peak_force_n).min(premium.peak_force_n),
        continuous_force_n: premium.continuous_force_n,
        workspace_min_m: corner(-1.0),
        workspace_max_m: corner(1.0),
    }
}
