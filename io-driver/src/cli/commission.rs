//! `io-driver commission`.

use super::enter::{Entered, wait_for_enter};
use super::places::SocketArgs;
use super::zero::Zeroing;
use super::{EXIT_FAULT, EXIT_USAGE, fail};
use crate::commission::hand_check::HandVerdict;
use crate::commission::motor_check::MotorVerdict;
use crate::commission::session::{Session, SessionError};
use crate::config::{Backend, DriverConfig};
use crate::device_file::ArmFile;
use crate::open;
use crate::print::print_line;
use clap::Args;
use rt_core::signals::StopSignals;
use shm_abi::client;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `commission`.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct CommissionArgs {
    /// The driver's configuration, which names the device's description
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Which device [default: the only one]
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Leave out the part in which you move the tip by hand
    #[arg(long)]
    motors_only: bool,
    /// Do not wait for Enter before each step
    #[arg(long)]
    yes: bool,
    #[command(flatten)]
    socket: SocketArgs,
}

const AFTER_HELP: &str = "First start the driver with little force: io-driver run --config FILE --commissioning\n\
If the device has to be zeroed, that comes first. Then you move the tip along each axis and the counters have\n\
to agree; then each motor pushes for some seconds with less than 0.5 N, and its joint has to turn the right way.\n\
Meanwhile hold the tip loosely and still: let go, many arms fall by their weight. Keep the other hand on the\n\
emergency stop (or ready for Ctrl-C, which ends in zero force).\n\
Exit status: 0 all signs and channels are right; 2 bad usage or input; 3 something is wrong, or a fault.";

const AXES: [&str; 3] = ["to the right (x)", "up (y)", "towards you (z)"];
const JOINTS: [&str; 3] = ["turret", "upper arm", "forearm"];

/// Runs it.
pub(super) fn run(args: &CommissionArgs) -> ExitCode {
    match commission(args) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(EXIT_FAULT),
        Err(Failure::Usage(error)) => fail(error.as_ref(), EXIT_USAGE),
        Err(Failure::During(error)) => fail(error.as_ref(), EXIT_FAULT),
    }
}

enum Failure {
    Usage(Box<dyn Error>),
    During(Box<dyn Error>),
}

fn usage<E: Into<Box<dyn Error>>>(error: E) -> Failure {
    Failure::Usage(error.into())
}

fn during<E: Into<Box<dyn Error>>>(error: E) -> Failure {
    Failure::During(error.into())
}

/// Whether everything is right.
fn commission(args: &CommissionArgs) -> Result<bool, Failure> {
    let signals = StopSignals::install().map_err(usage)?;
    let config = DriverConfig::load(&args.config).map_err(usage)?;
    let device = choose(&config, args.device.as_deref()).map_err(usage)?;
    let arm_file = describe(&config, device).map_err(usage)?;
    let socket = args.socket.path();
    prepare(args, &socket, device, &signals)?;
    let attachment = client::command(&socket, "io-driver commission").map_err(usage)?;
    let mut session = Session::new(attachment, device, &signals).map_err(usage)?;
    let mut all_right = true;
    if !args.motors_only {
        for axis in 0..3 {
            all_right &= try_axis(args, &signals, &mut session, axis).map_err(during)?;
        }
        if !all_right {
            say("Set the counters right first; the motors are compared with them.");
            return Ok(false);
        }
    }
    prompt(args, &signals, "Now the motors. Hold the tip loosely and still, so that the arm's weight does not move it, and stay clear of the rest").map_err(during)?;
    let kinematics = arm_file.mechanism;
    let per_count = arm_file.joint_map().rad_per_count();
    let tell = |joint: usize| say(&format!("  {} ...", JOINTS[joint]));
    let verdicts = session.check_motors(&kinematics, per_count, tell).map_err(during)?;
    for (joint, verdict) in verdicts.into_iter().enumerate() {
        say(&format!("{}: {}", JOINTS[joint], motor_words(joint, verdict)));
        all_right &= verdict == MotorVerdict::Right;
    }
    let all = if args.motors_only { "All motors turn" } else { "All counters and motors turn" };
    if all_right {
        say(&format!("{all} the right way. Take `commissioning` out again, and give it force."));
    }
    Ok(all_right)
}

/// Nothing is asked of a driver with full force, nor of the person before it. Positions that mean nothing cannot be
/// compared with a hand, so that zeroing comes first.
fn prepare(
    args: &CommissionArgs,
    socket: &Path,
    device: usize,
    signals: &StopSignals,
) -> Result<(), Failure> {
    let mut zeroing = Zeroing::attach(socket, signals).map_err(usage)?;
    if !zeroing.driver().info().is_commissioning {
        return Err(usage(SessionError::FullForce));
    }
    if !zeroing.needs(device) {
        return Ok(());
    }
    say("First its zeroing pose.");
    zeroing.zero(&[device], UNTIL_REST_S, args.yes).map_err(during)
}

/// How long a person may take to bring an arm into its zeroing pose (s).
const UNTIL_REST_S: f64 = 300.0;

fn try_axis(
    args: &CommissionArgs,
    signals: &StopSignals,
    session: &mut Session<'_>,
    axis: usize,
) -> Result<bool, Box<dyn Error>> {
    prompt(args, signals, &format!("Then move the tip 5 cm {}", AXES[axis]))?;
    let verdict = session.check_by_hand(axis)?;
    say(&match verdict {
        HandVerdict::Right => format!("{}: right", AXES[axis]),
        HandVerdict::Reversed => format!(
            "{}: WRONG, it was counted the other way; change the `sign` of {} under [encoders] in the description",
            AXES[axis],
            ["the first counter", "the second or third counter", "the second or third counter"][axis]
        ),
        HandVerdict::Crossed { axis: other } => format!(
            "{}: WRONG, it was counted {}; look at `channel` under [encoders], then at `sign`",
            AXES[axis], AXES[other]
        ),
    });
    Ok(verdict == HandVerdict::Right)
}

fn motor_words(joint: usize, verdict: MotorVerdict) -> String {
    let place = ["first", "second", "third"][joint];
    match verdict {
        MotorVerdict::Right => "right".into(),
        MotorVerdict::Reversed => {
            format!("WRONG, it turned the other way; change the {place} `sign` under [motors] in the description")
        }
        MotorVerdict::Crossed { joint: other } => {
            format!("WRONG, the {} turned instead; look at `channel` under [motors]", JOINTS[other])
        }
        MotorVerdict::Stuck => {
            "did not turn; is it connected, switched on, free to move, held loosely enough, and is the force enough against its friction?"
                .into()
        }
    }
}

/// The device by its name, or the only one.
fn choose(config: &DriverConfig, name: Option<&str>) -> Result<usize, String> {
    let names: Vec<&str> = config.devices.iter().map(|device| device.name.as_str()).collect();
    match name {
        None if names.len() == 1 => Ok(0),
        None => Err(format!("which device? --device one of {}", names.join(", "))),
        Some(name) => names
            .iter()
            .position(|other| *other == name)
            .ok_or_else(|| format!("no device \"{name}\"; --device one of {}", names.join(", "))),
    }
}

fn describe(config: &DriverConfig, device: usize) -> Result<ArmFile, Box<dyn Error>> {
    let device = &config.devices[device];
    match &device.backend {
        Backend::Emulated { description, .. } => Ok(open::mechanism(device, description)?),
        Backend::Ideal(_) | Backend::Simulated { .. } | Backend::Replay { .. } => {
            Err(format!("device {} has no motors that could be tried", device.name).into())
        }
    }
}

fn prompt(args: &CommissionArgs, signals: &StopSignals, what: &str) -> Result<(), Box<dyn Error>> {
    if args.yes {
        say(what);
        return Ok(());
    }
    say(&format!("Press Enter. {what}."));
    match wait_for_enter(signals)? {
        Entered::Line => Ok(()),
        Entered::Stopped => Err(SessionError::Interrupted.into()),
        Entered::NoInput => Err("standard input has ended; --yes goes on without it".into()),
    }
}

fn say(text: &str) {
    print_line(text);
}
