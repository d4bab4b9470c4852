//! `io-driver emulate`.

use super::{EXIT_FAULT, EXIT_USAGE, fail, print_line};
use crate::device::encoder_trace::{EncoderReplay, EncoderTrace};
use crate::device_file::{self, ArmFile, DeviceFile};
use crate::emulator::card::Card;
use crate::emulator::motion::Motion;
use crate::emulator::process::{Emulator, Play};
use crate::say::say;
use clap::Args;
use rt_core::signals::StopSignals;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `emulate`.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct EmulateArgs {
    /// File of registers that driver and emulator share; best in /dev/shm or $XDG_RUNTIME_DIR
    #[arg(long, value_name = "FILE")]
    card: PathBuf,
    /// The arm: a built-in description, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "premium-1.5")]
    description: String,
    /// Move as this encoder trace does
    #[arg(long, value_name = "FILE", conflicts_with = "viscosity")]
    trace: Option<PathBuf>,
    /// Yield to the motors like an arm in treacle of this viscosity (N m s/rad), instead of standing still
    #[arg(long = "yield", value_name = "NMS", allow_negative_numbers = true)]
    viscosity: Option<f64>,
    /// The amplifiers switch off after so much silence of the driver
    #[arg(long, value_name = "MS", default_value_t = 10.0, allow_negative_numbers = true)]
    watchdog_ms: f64,
    /// Refuse forces beyond this [default: the description's peak]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    peak_n: Option<f64>,
    /// Refuse forces that grow by more than this from one value to the next [default: any]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    step_n: Option<f64>,
    /// Look at the registers so often
    #[arg(long, value_name = "US", default_value_t = 500.0, allow_negative_numbers = true)]
    poll_us: f64,
}

const AFTER_HELP: &str = "The driver's configuration names the card: backend = \"emulated\", card = \"FILE\".\n\
When a signal ends it, it prints what its amplifiers have seen, as JSON.\n\
Exit status: 0 every value was checked and good; 2 bad usage or input; 3 values were wrong or lost.";

/// Runs it.
pub(super) fn run(args: &EmulateArgs) -> ExitCode {
    match play(args) {
        Ok(code) => code,
        Err(error) => fail(error.as_ref(), EXIT_USAGE),
    }
}

fn play(args: &EmulateArgs) -> Result<ExitCode, Box<dyn Error>> {
    let signals = StopSignals::install()?;
    let premium = describe(&args.description)?;
    let motion = motion(args, &premium)?;
    let play = Play {
        peak_n: limit("--peak-n", args.peak_n.unwrap_or(premium.peak_force_n))?,
        step_n: limit("--step-n", args.step_n.unwrap_or(f64::INFINITY))?,
        watchdog_ns: positive("--watchdog-ms", args.watchdog_ms, 1e6)?,
        poll_ns: positive("--poll-us", args.poll_us, 1e3)?,
    };
    let card = Card::create(&args.card)?;
    say(format_args!("io-driver: playing {} at {}", premium.name, args.card.display()));
    let tally = Emulator::new(card, premium, motion, play).run(play.poll_ns, &signals);
    let _ = std::fs::remove_file(&args.card);
    let _ = print_line(&serde_json::to_string(&tally)?);
    let is_good = tally.wrong() == 0 && tally.lost == 0;
    Ok(if is_good { ExitCode::SUCCESS } else { ExitCode::from(EXIT_FAULT) })
}

fn describe(name: &str) -> Result<ArmFile, Box<dyn Error>> {
    let text = match device_file::builtin(name) {
        Some(text) => text.to_owned(),
        None => read(Path::new(name))?,
    };
    match DeviceFile::parse(&text, Path::new(name))? {
        DeviceFile::Arm(premium) => Ok(*premium),
        DeviceFile::Ideal(_) => {
            Err(format!("{name} describes no mechanism; a card needs one, such as premium-1.5").into())
        }
    }
}

fn motion(args: &EmulateArgs, premium: &ArmFile) -> Result<Motion, Box<dyn Error>> {
    if let Some(file) = &args.trace {
        let trace = EncoderTrace::parse(&read(file)?, file, premium.encoders.count_bits)?;
        return Ok(Motion::Trace(EncoderReplay::new(trace)));
    }
    match args.viscosity {
        None => Ok(Motion::Rest),
        Some(viscosity_nm_s) if viscosity_nm_s.is_finite() && viscosity_nm_s >= 1e-3 => {
            Ok(Motion::Yielding { viscosity_nm_s, joints: premium.encoders.home_joint_angles_rad })
        }
        Some(other) => Err(format!("--yield: found {other}, allowed: 0.001 N m s/rad and more").into()),
    }
}

fn read(file: &Path) -> Result<String, Box<dyn Error>> {
    std::fs::read_to_string(file).map_err(|error| format!("cannot read {}: {error}", file.display()).into())
}

/// Not a number would let everything pass.
fn limit(option: &str, newtons: f64) -> Result<f64, Box<dyn Error>> {
    if newtons >= 0.0 {
        Ok(newtons)
    } else {
        Err(format!("{option}: found {newtons}, allowed: 0 N and more").into())
    }
}

/// Nanoseconds of a positive number of `unit_ns`, up to a day.
fn positive(option: &str, number: f64, unit_ns: f64) -> Result<u64, Box<dyn Error>> {
    let ns = number * unit_ns;
    if (1.0..=86_400e9).contains(&ns) {
        Ok(ns as u64)
    } else {
        Err(format!("{option}: found {number}, allowed: more than 0, at most a day").into())
    }
}
