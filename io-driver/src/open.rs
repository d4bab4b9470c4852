//! From configuration to devices that can be read: files are opened here and nowhere later.

mod simulated;
mod weight;

pub use simulated::ROUND_TRIP_NS;

use crate::config::{Backend, DeviceConfig, DriverConfig, HandSource, Wish};
use crate::device::Device;
use crate::device::arm::Arm;
use crate::device::emulated::{Channels, EmulatedDevice};
use crate::device::encoder_trace::{EncoderReplay, EncoderTrace, TraceError};
use crate::device::ideal::{Hand, IdealDevice};
use crate::device::replay::ReplayDevice;
use crate::device_file::{self, ArmFile, DeviceFile, DeviceFileError};
use crate::emulator::card::{Card, CardError};
use crate::live_hand::{LiveFinger, LiveHandError, LiveWish};
use crate::sim::script::{HandError, HandPlayer, HandScript};
use crate::sim::tip_board::TipBoard;
use crate::table::MAX_TABLE_BYTES;
use crate::toml_report::{MAX_TOML_BYTES, TomlReport};
use rt_core::input_file;
use shm_abi::segment::{ClockMode, DeviceInfo};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;
use weight::TooHeavy;

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
    /// A description is neither built in nor a file.
    #[error(
        "device {device}: `description`: {file} is neither a file that can be read ({source}) nor built in; name a file, or one \
         of {}", device_file::BUILTIN_NAMES.join(", ")
    )]
    NoDescription {
        /// Whose.
        device: String,
        /// The file.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// A switch on a button that the hand file does not tell of: it would never be pressed.
    #[error(
        "device {device}: a switch is wired to its buttons, but {file} has no column `{finger}_buttons`; add it, or remove the switch from [safety]"
    )]
    NoButtons {
        /// Whose.
        device: String,
        /// Which.
        file: PathBuf,
        /// The finger in it.
        finger: String,
    },
    /// A switch on a button that nobody could press.
    #[error(
        "device {device}: a switch is wired to its buttons, but no script presses any; give it a hand and a hand file with a \
         column of buttons, or remove the switch from [safety]"
    )]
    NobodyPresses {
        /// Whose.
        device: String,
    },
    /// The hand file is wrong.
    #[error(transparent)]
    Hand(#[from] HandError),
    /// The live hand is none.
    #[error("device {device}: {source}")]
    LiveHand {
        /// Whose.
        device: String,
        /// Why.
        source: LiveHandError,
    },
    /// The trace is wrong.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The description is wrong.
    #[error(transparent)]
    Description(#[from] DeviceFileError),
    /// The description of a hand is wrong.
    #[error(transparent)]
    HandModel(#[from] TomlReport),
    /// The description does not say how the arm moves.
    #[error(
        "device {device}: {file} has no table [simulation], so the arm cannot be simulated; add it, see the built-in premium-1.5"
    )]
    NoSimulation {
        /// Whose.
        device: String,
        /// Which.
        file: PathBuf,
    },
    /// The arm cannot be where its hand begins.
    #[error(
        "device {device}: the hand begins at {start_m:?} m in the world, which this arm cannot reach from its base: {why}; \
         move the base (`base_position_m`, or the run's --layout) or the hand"
    )]
    OutOfReach {
        /// Whose.
        device: String,
        /// Where, in W.
        start_m: [f64; 3],
        /// Why not.
        why: String,
    },
    /// The emulated card cannot be had.
    #[error("device {device}: {source}")]
    Card {
        /// Whose.
        device: String,
        /// Why.
        source: CardError,
    },
    /// More registers than a dying process can switch off.
    #[error("device {device}: {source}")]
    Registers {
        /// Whose.
        device: String,
        /// How many there may be.
        source: rt_core::last_act::NoRoom,
    },
    /// Gravity cannot be compensated without masses.
    #[error(
        "device {device}: `gravity_compensation` needs a table [bodies] in {file}, as in the built-in premium-1.5"
    )]
    NoBodies {
        /// Whose.
        device: String,
        /// Which.
        file: PathBuf,
    },
    /// Motors that cannot hold the arm up.
    #[error(
        "device {device}: `gravity_compensation`: in its worst pose the weight that {file} describes asks for {weight_nm:.3} N m \
         of joint {number}, whose motor makes {continuous_nm:.3} N m for ever; expected at least {margin} times the weight, so \
         that something is left for forces; check [bodies] and [motors], or leave `gravity_compensation` out"
    )]
    TooHeavy {
        /// Whose.
        device: String,
        /// The description.
        file: PathBuf,
        /// The joint, counted from 1.
        number: usize,
        /// Torque that holds it in the worst pose (N m).
        weight_nm: f64,
        /// Torque of the continuous current (N m).
        continuous_nm: f64,
        /// Smallest ratio of the two that is allowed.
        margin: f64,
    },
    /// Motors know no time but the real one.
    #[error(
        "device {device}: it has registers, behind which motors may be, and they know no time but the real one; it was asked \
         for under the clock \"{clock}\""
    )]
    NotInRealTime {
        /// Whose.
        device: String,
        /// The clock.
        clock: &'static str,
    },
    /// An emulated card has four converters.
    #[error("device {device}: {file} names motor channel {channel}; an emulated card has 0 to 3")]
    NoConverter {
        /// Whose.
        device: String,
        /// Which.
        file: PathBuf,
        /// The channel.
        channel: u8,
    },
    /// The description has no mechanism that encoders could move.
    #[error(
        "device {device}: {file} describes an ideal device, which has no encoders; a replay or an emulated card needs a mechanism such as premium-1.5"
    )]
    NoMechanism {
        /// Whose.
        device: String,
        /// Which.
        file: PathBuf,
    },
}

/// Texts of hand files that were read, by the names of the files: whoever follows such a file follows what was read, also
/// if somebody changes it meanwhile.
#[derive(Debug, Clone, Default)]
pub struct HandFiles(BTreeMap<PathBuf, Arc<str>>);

impl FromIterator<(PathBuf, Arc<str>)> for HandFiles {
    fn from_iter<I: IntoIterator<Item = (PathBuf, Arc<str>)>>(files: I) -> Self {
        Self(files.into_iter().collect())
    }
}

impl HandFiles {
    fn text(&mut self, device: &DeviceConfig, file: &Path) -> Result<Arc<str>, OpenError> {
        if let Some(text) = self.0.get(file) {
            return Ok(Arc::clone(text));
        }
        let text: Arc<str> = read(device, file, MAX_TABLE_BYTES)?.into();
        self.0.insert(file.into(), Arc::clone(&text));
        Ok(text)
    }
}

/// Opens all devices of a configuration.
///
/// # Errors
/// The first that cannot be had, and why.
pub fn open_devices(config: &DriverConfig) -> Result<Vec<Box<dyn Device>>, OpenError> {
    open_devices_with(config, HandFiles::default())
}

/// The same, where some hand files were read already.
///
/// # Errors
/// As [`open_devices`].
pub fn open_devices_with(
    config: &DriverConfig,
    mut hands: HandFiles,
) -> Result<Vec<Box<dyn Device>>, OpenError> {
    let board = Arc::new(TipBoard::default());
    config.devices.iter().map(|device| open(device, config, &board, &mut hands)).collect()
}

fn open(
    device: &DeviceConfig,
    config: &DriverConfig,
    board: &Arc<TipBoard>,
    hands: &mut HandFiles,
) -> Result<Box<dyn Device>, OpenError> {
    if device.backend.has_registers() && config.clock != ClockMode::Real {
        return Err(OpenError::NotInRealTime { device: device.name.clone(), clock: config.clock.name() });
    }
    match &device.backend {
        Backend::Ideal(wish) => {
            let hand = match (live_finger(device, wish)?, script(device, wish, config, hands)?) {
                (Some(live), _) => Hand::Live(live),
                (None, Some((player, finger))) => Hand::Scripted(player, finger),
                (None, None) => Hand::Resting(wish.start_m),
            };
            let info = commissioned(ideal_info(device), config);
            Ok(Box::new(IdealDevice::new(info, wish.base_in_world, hand)))
        }
        Backend::Simulated { .. } => simulated::open(device, config, board, hands),
        Backend::Replay { description, trace, .. } => {
            let arm_file = mechanism(device, description)?;
            let trace = EncoderTrace::parse(
                &read(device, trace, MAX_TABLE_BYTES)?,
                trace,
                arm_file.encoders.count_bits,
            )?;
            let info = commissioned(arm_info(device, &arm_file), config);
            let arm = arm(device, config, &arm_file);
            Ok(Box::new(ReplayDevice::new(info, EncoderReplay::new(trace), arm)))
        }
        Backend::Emulated { description, card, .. } => {
            let arm_file = mechanism(device, description)?;
            let info = commissioned(arm_info(device, &arm_file), config);
            let arm = arm(device, config, &arm_file);
            emulated(device, description, card, &arm_file, info, arm)
        }
    }
}

/// In commissioning every device is told to be weak and slow, which its guard then enforces.
fn commissioned(info: DeviceInfo, config: &DriverConfig) -> DeviceInfo {
    match config.safety.commissioning {
        None => info,
        Some(limits) => DeviceInfo {
            peak_force_n: info.peak_force_n.min(limits.force_n),
            continuous_force_n: info.continuous_force_n.min(limits.force_n),
            speed_limit_m_per_s: info.speed_limit_m_per_s.min(limits.speed_m_per_s),
            ..info
        },
    }
}

fn arm(device: &DeviceConfig, config: &DriverConfig, description: &ArmFile) -> Arm {
    Arm::new(description, holds_its_weight(device, config)).with_zeroing(device.zeroing)
}

/// Not in commissioning: the torques that hold an arm up are no force that a guard could cut, and a motor whose
/// sign nobody has tried yet would drive the arm with them.
fn holds_its_weight(device: &DeviceConfig, config: &DriverConfig) -> bool {
    device.compensates_gravity && config.safety.commissioning.is_none()
}

fn emulated(
    device: &DeviceConfig,
    description: &Path,
    card: &Path,
    arm_file: &ArmFile,
    info: DeviceInfo,
    arm: Arm,
) -> Result<Box<dyn Device>, OpenError> {
    let name = || device.name.clone();
    if let Some(channel) = arm_file.motors.channel.into_iter().find(|channel| *channel > 3) {
        return Err(OpenError::NoConverter { device: name(), file: description.into(), channel });
    }
    let hold = Card::take(card).map_err(|source| OpenError::Card { device: name(), source })?;
    let channels = Channels {
        encoders: arm_file.encoders.channel,
        gimbal: arm_file.gimbal.map(|gimbal| gimbal.channel),
        buttons: arm_file.buttons,
        motors: arm_file.motors.channel,
    };
    let device = EmulatedDevice::new(info, hold, arm, channels)
        .map_err(|source| OpenError::Registers { device: name(), source })?;
    Ok(Box::new(device))
}

/// The script of a finger, and its place in it; `None`: it has none.
///
/// The hand file may hold other fingers' columns: those of all devices that share it are known.
fn script(
    device: &DeviceConfig,
    wish: &Wish,
    config: &DriverConfig,
    hands: &mut HandFiles,
) -> Result<Option<(HandPlayer, usize)>, OpenError> {
    let HandSource::Script { file, finger } = &wish.hand else { return Ok(None) };
    let wishes = config.devices.iter().filter_map(|other| match &other.backend.wish()?.hand {
        HandSource::Script { file: path, finger } if path == file => Some(finger.as_str()),
        _ => None,
    });
    let fingers: Vec<&str> = wishes.collect();
    let script = HandScript::parse(&hands.text(device, file)?, file, &fingers)?;
    let index = fingers.iter().position(|name| name == finger).unwrap_or(0);
    if has_switch(device, config) && !script.has_buttons(index) {
        let (device, finger) = (device.name.clone(), finger.clone());
        return Err(OpenError::NoButtons { device, file: file.clone(), finger });
    }
    Ok(script.is_scripted(index).then(|| (HandPlayer::new(script), index)))
}

/// Who moves it live, if anybody does.
fn live_finger(device: &DeviceConfig, wish: &Wish) -> Result<Option<LiveFinger>, OpenError> {
    let HandSource::Live { file, finger } = &wish.hand else { return Ok(None) };
    let opened = LiveFinger::open(file, *finger, LiveWish::at(wish.start_m));
    opened.map(Some).map_err(|source| OpenError::LiveHand { device: device.name.clone(), source })
}

fn has_switch(device: &DeviceConfig, config: &DriverConfig) -> bool {
    let switches = &config.safety.switches;
    [switches.emergency_stop, switches.dead_man]
        .iter()
        .flatten()
        .any(|switch| config.devices[switch.device].name == device.name)
}

/// The mechanism that a device's description tells, in a base that stands as the configuration tells.
///
/// # Errors
/// If it cannot be read, is wrong, or has none.
pub fn mechanism(device: &DeviceConfig, description: &Path) -> Result<ArmFile, OpenError> {
    let name = || device.name.clone();
    match describe(device, description)? {
        DeviceFile::Arm(arm_file) if device.compensates_gravity && arm_file.gravity.is_none() => {
            Err(OpenError::NoBodies { device: name(), file: description.into() })
        }
        DeviceFile::Arm(arm_file) => {
            let arm_file = arm_file.in_base(&device.backend.base_orientation());
            match weight::too_heavy(&arm_file).filter(|_| device.compensates_gravity) {
                Some(found) => Err(too_heavy(name(), description, found)),
                None => Ok(arm_file),
            }
        }
        DeviceFile::Ideal(_) => Err(OpenError::NoMechanism { device: name(), file: description.into() }),
    }
}

fn too_heavy(device: String, file: &Path, found: TooHeavy) -> OpenError {
    let TooHeavy { joint, weight_nm, continuous_nm } = found;
    let (file, number, margin) = (file.into(), joint + 1, weight::MARGIN);
    OpenError::TooHeavy { device, file, number, weight_nm, continuous_nm, margin }
}

fn describe(device: &DeviceConfig, description: &Path) -> Result<DeviceFile, OpenError> {
    let text = match device_file::builtin(&description.to_string_lossy()) {
        Some(text) => text.to_owned(),
        None => input_file::read_text(description, MAX_TOML_BYTES).map_err(|source| {
            OpenError::NoDescription { device: device.name.clone(), file: description.into(), source }
        })?,
    };
    Ok(DeviceFile::parse(&text, description)?)
}

fn read(device: &DeviceConfig, file: &Path, most_bytes: u64) -> Result<String, OpenError> {
    input_file::read_text(file, most_bytes).map_err(|source| OpenError::Unreadable {
        device: device.name.clone(),
        file: file.into(),
        source,
    })
}

/// As the arms that are described here: what is tried with an ideal device shall feel the same limits as what is felt.
const IDEAL_SLEW_N_PER_S: f64 = 5000.0;

fn ideal_info(device: &DeviceConfig) -> DeviceInfo {
    let peak_force_n = device.peak_force_n.unwrap_or(f64::INFINITY);
    DeviceInfo {
        name: device.name.clone(),
        kind: "ideal".into(),
        peak_force_n,
        continuous_force_n: peak_force_n,
        workspace_min_m: [f64::NEG_INFINITY; 3],
        workspace_max_m: [f64::INFINITY; 3],
        slew_n_per_s: device.slew_n_per_s.unwrap_or(IDEAL_SLEW_N_PER_S),
        speed_limit_m_per_s: f64::INFINITY,
    }
}

fn arm_info(device: &DeviceConfig, arm_file: &ArmFile) -> DeviceInfo {
    let corner = |sign: f64| {
        std::array::from_fn(|axis| {
            arm_file.workspace.centre_m[axis] + sign * 0.5 * arm_file.workspace.size_m[axis]
        })
    };
    DeviceInfo {
        name: device.name.clone(),
        kind: arm_file.kind.into(),
        peak_force_n: device.peak_force_n.unwrap_or(arm_file.peak_force_n).min(arm_file.peak_force_n),
        continuous_force_n: arm_file.continuous_force_n,
        workspace_min_m: corner(-1.0),
        workspace_max_m: corner(1.0),
        slew_n_per_s: device.slew_n_per_s.unwrap_or(arm_file.slew_n_per_s).min(arm_file.slew_n_per_s),
        speed_limit_m_per_s: arm_file.speed_limit_m_per_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Effort, TickTime};

    /// An arm in a replay, told to hold its weight and nothing else: the codes that come out.
    fn codes(commissioning: bool, more: &str) -> [i64; 3] {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("trace.csv"), "t,c0,c1,c2\n0,0,0,0\n").unwrap();
        let text = format!(
            "[safety]\ncommissioning = {commissioning}\n[[device]]\nbackend = \"replay\"\n\
             description = \"premium-1.5\"\ntrace = \"trace.csv\"\ngravity_compensation = true\n{more}"
        );
        let config = DriverConfig::parse(&text, &directory.path().join("driver.toml")).unwrap();
        let device = &mut open_devices(&config).unwrap()[0];
        device.read(TickTime::counted(1, 1_000_000, 0)).unwrap();
        let effort = Effort { gravity_share: 1.0, ..Effort::default() };
        device.write(effort).unwrap().motor_codes
    }

    /// At home the upper arm's weight is -16 mN m, as its motor balances more than it weighs, and the forearm hangs.
    #[test]
    fn an_arm_that_lies_on_its_side_is_held_by_its_turret_and_upside_down_the_other_way_round() {
        let upright = codes(false, "");
        assert_eq!(codes(false, "base_orientation_wxyz = [1, 0, 0, 0]\n"), upright, "no word: upright");
        assert!(upright[1] < 2048 && upright[0] == 2048 && upright[2] == 2048, "{upright:?}");
        // Half a turn about the user's axis.
        let overhead = codes(false, "base_orientation_wxyz = [0, 0, 0, 1]\n");
        assert_eq!(overhead, upright.map(|code| 4096 - code));
        // A quarter turn about it: the base's y is to the world's left, its x up.
        let side = codes(false, "base_orientation_wxyz = [0.70710678, 0, 0, 0.70710678]\n");
        assert!(side[0] < 2048 && side[1] == 2048 && side[2] == 2048, "{side:?}");
        // The same the other way.
        let other = codes(false, "base_orientation_wxyz = [0.70710678, 0, 0, -0.70710678]\n");
        assert_eq!(other, side.map(|code| 4096 - code));
    }

    #[test]
    fn an_arm_in_commissioning_does_not_hold_its_weight_with_motors_that_nobody_has_tried() {
        assert_ne!(codes(false, ""), [2048; 3], "the weight can be felt in the zeroing pose");
        assert_eq!(codes(true, ""), [2048; 3]);
        // Nor in a base that may stand otherwise than told.
        assert_eq!(codes(true, "base_orientation_wxyz = [0, 0, 0, 1]\n"), [2048; 3]);
    }

    /// An ideal device with a dead-man's switch and this hand file.
    fn switched(columns: &str) -> Result<Vec<Box<dyn Device>>, OpenError> {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("hand.csv"), columns).unwrap();
        let text = "[safety]\ndead_man = { device = \"f0\", button = 3 }\n\
                    [[device]]\nbackend = \"ideal\"\nhand = \"hand.csv\"\n";
        let config = DriverConfig::parse(text, &directory.path().join("driver.toml")).unwrap();
        open_devices(&config)
    }

    #[test]
    fn a_switch_on_a_simulated_device_needs_a_hand_with_a_script_that_presses_it() {
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("hand.csv"), "t,f0_x,f0_y,f0_z,f0_buttons\n0,0,0,0,8\n")
            .unwrap();
        let open = |hand: &str| {
            let text = format!(
                "[safety]\nemergency_stop = {{ device = \"f0\", button = 3 }}\n[[device]]\nbackend = \"simulated\"\n\
                 description = \"premium-1.5\"\n{hand}"
            );
            let config = DriverConfig::parse(&text, &directory.path().join("driver.toml")).unwrap();
            open_devices(&config).map(drop).map_err(|refused| refused.to_string())
        };
        assert_eq!(open("hand = \"hand.csv\"\n"), Ok(()));
        for nobody in ["", "hand_model = \"nobody\"\n", "hand_model = \"nobody\"\nhand = \"hand.csv\"\n"] {
            let message = open(nobody).unwrap_err();
            assert!(
                message.starts_with("device f0: a switch is wired to its buttons, but no script"),
                "{message}"
            );
        }
    }

    #[test]
    fn a_simulated_handle_that_nobody_holds_is_measured_all_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let gimbal = "[gimbal]\ncounts_per_rev = 4000\nreduction = [1.0, 1.0, 2.0]\nsign = [1, 1, 1]\n\
                      channel = [3, 4, 5]\nhome_angles_rad = [0.0, 0.0, 0.0]\n";
        let arm = format!("{}\n{gimbal}", device_file::builtin("premium-1.5").unwrap());
        std::fs::write(directory.path().join("handle.toml"), arm).unwrap();
        for holder in ["nobody", "pen-grip"] {
            let text = format!(
                "[[device]]\nbackend = \"simulated\"\ndescription = \"handle.toml\"\nhand_model = \"{holder}\"\n"
            );
            let config = DriverConfig::parse(&text, &directory.path().join("driver.toml")).unwrap();
            let device = &mut open_devices(&config).unwrap()[0];
            let reading = device.read(TickTime::counted(1, 1_000_000, -1)).unwrap();
            assert!(reading.is_orientation_measured && device.extras().orientation, "{holder}");
        }
    }

    #[test]
    fn a_switch_on_an_ideal_device_needs_a_script_with_buttons() {
        let devices = switched("t,f0_x,f0_y,f0_z,f0_buttons\n0,0,0,0,8\n");
        let time = TickTime::counted(1, 1_000_000, 0);
        assert_eq!(devices.unwrap()[0].read(time).unwrap().buttons, 8);
        let Err(refused) = switched("t,f0_x,f0_y,f0_z\n0,0,0,0\n") else { panic!("opened") };
        let message = refused.to_string();
        assert!(message.contains("device f0: a switch") && message.contains("hand.csv"), "{message}");
        assert!(message.contains("no column `f0_buttons`"), "{message}");
    }

    /// SAFETY.md promises it of the arms that are described here and of ideal devices.
    #[test]
    fn a_force_grows_by_five_newton_a_millisecond_at_most_unless_a_configuration_says_otherwise() {
        let mut simulated = simulated_premium();
        assert_eq!(ideal_info(&simulated).slew_n_per_s, 5000.0);
        for name in ["premium-1.5", "wooden-haptics"] {
            let file = DeviceFile::parse(device_file::builtin(name).unwrap(), Path::new(name));
            let Ok(DeviceFile::Arm(arm)) = file else { panic!("{name} is an arm") };
            simulated.slew_n_per_s = None;
            assert_eq!(arm_info(&simulated, &arm).slew_n_per_s, 5000.0, "{name}");
            // A configuration may ask for less, and not for more.
            for (asked, given) in [(1000.0, 1000.0), (9000.0, 5000.0)] {
                simulated.slew_n_per_s = Some(asked);
                assert_eq!(arm_info(&simulated, &arm).slew_n_per_s, given, "{name}");
            }
        }
    }

    #[test]
    fn in_commissioning_every_device_is_weak_and_slow() {
        let text = "[safety]\ncommissioning = true\n[[device]]\nbackend = \"simulated\"\n\
                    description = \"premium-1.5\"\n[[device]]\nbackend = \"ideal\"\n";
        let config = DriverConfig::parse(text, Path::new("driver.toml")).unwrap();
        for device in open_devices(&config).unwrap() {
            let DeviceInfo { peak_force_n, continuous_force_n, speed_limit_m_per_s, .. } = *device.info();
            assert_eq!((peak_force_n, speed_limit_m_per_s), (0.5, 0.25), "SAFETY.md");
            assert!(continuous_force_n <= 0.5);
        }
    }

    fn simulated_premium() -> DeviceConfig {
        let text = "[[device]]\nbackend = \"simulated\"\ndescription = \"premium-1.5\"\n";
        DriverConfig::parse(text, Path::new("driver.toml")).unwrap().devices.remove(0)
    }

    /// A tree of tables takes far more memory than its text.
    #[test]
    fn a_description_larger_than_any_is_refused_before_it_is_parsed() {
        let directory = tempfile::tempdir().unwrap();
        let large = format!("{}{}", device_file::builtin("premium-1.5").unwrap(), "#".repeat(1 << 16));
        std::fs::write(directory.path().join("large.toml"), large).unwrap();
        let text = "[[device]]\nbackend = \"simulated\"\ndescription = \"large.toml\"\n";
        let config = DriverConfig::parse(text, &directory.path().join("driver.toml")).unwrap();
        let Err(OpenError::NoDescription { source, .. }) = open_devices(&config) else {
            panic!("it was read")
        };
        assert!(source.to_string().contains("larger than 65536 bytes"), "{source}");
    }

    #[test]
    fn a_description_that_is_not_there_is_refused_with_the_names_of_those_that_are_built_in() {
        let text = "[[device]]\nbackend = \"simulated\"\ndescription = \"premium-3.0\"\n";
        let config = DriverConfig::parse(text, Path::new("driver.toml")).unwrap();
        let error = open_devices(&config).err().expect("there is none").to_string();
        let names = device_file::BUILTIN_NAMES.iter().chain(&["premium-3.0"]);
        names.for_each(|name| assert!(error.contains(name), "{error}"));
    }

    /// Heavier bodies and weaker motors than a WoodenHaptics has.
    #[test]
    fn an_arm_that_its_motors_cannot_hold_for_ever_is_not_compensated() {
        let mut text = device_file::builtin("wooden-haptics").unwrap().to_owned();
        for (from, to) in [
            ("continuous_current_a = 3.0 ", "continuous_current_a = 0.6 "),
            ("mass_a_kg = 0.0817", "mass_a_kg = 0.15"),
            ("mass_be_kg = 0.170", "mass_be_kg = 0.40"),
        ] {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("heavy.toml"), text).unwrap();
        let open = |description: &str, keys: &str| {
            let text =
                format!("[[device]]\nbackend = \"simulated\"\ndescription = \"{description}\"\n{keys}");
            let config = DriverConfig::parse(&text, &directory.path().join("driver.toml")).unwrap();
            open_devices(&config).map(drop)
        };
        let refused = open("heavy.toml", "gravity_compensation = true\n").unwrap_err();
        let OpenError::TooHeavy { weight_nm, continuous_nm, margin, .. } = refused else {
            panic!("{refused}")
        };
        assert!(continuous_nm < margin * weight_nm, "{refused}");
        let words = [format!("{weight_nm:.3} N m"), format!("{continuous_nm:.3} N m"), "heavy.toml".into()];
        words.iter().for_each(|word| assert!(refused.to_string().contains(word), "{refused}"));
        assert!(open("heavy.toml", "").is_ok(), "its weight is the hand's then");
        assert!(open("wooden-haptics", "gravity_compensation = true\n").is_ok());
    }

    /// A configuration that was not read from a file has not been asked.
    #[test]
    fn registers_are_opened_in_real_time_only() {
        let text = "[[device]]\nname = \"arm\"\nbackend = \"emulated\"\ndescription = \"premium-1.5\"\ncard = \"/nowhere\"\n";
        let mut config = DriverConfig::parse(text, Path::new("driver.toml")).unwrap();
        for clock in [ClockMode::Lockstep, ClockMode::Virtual] {
            config.clock = clock;
            let Err(OpenError::NotInRealTime { device, .. }) = open_devices(&config) else {
                panic!("{clock:?}: opened, or refused for another reason")
            };
            assert_eq!(device, "arm");
        }
    }
}
