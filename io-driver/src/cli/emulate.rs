//! `io-driver emulate`.

use super::{EXIT_FAULT, EXIT_USAGE, fail};
use crate::device::encoder_trace::{EncoderReplay, EncoderTrace};
use crate::device::simulated::Wish;
use crate::device_file::{self, ArmFile, DeviceFile};
use crate::emulator::card::Card;
use crate::emulator::held_arm::HeldArm;
use crate::emulator::motion::Motion;
use crate::emulator::process::{Emulator, Play};
use crate::kinematics::Mechanism;
use crate::print::print_line;
use crate::say::say;
use crate::sim::hand::HandModel;
use crate::sim::hand::model_file::{self, Firmness};
use crate::sim::script::{HandPlayer, HandScript};
use crate::table::MAX_TABLE_BYTES;
use clap::Args;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rt_core::input_file;
use rt_core::plain_text::listed;
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
    /// Move as an arm of this description does: with its mass, its weight and its friction, held by a hand
    #[arg(long, conflicts_with_all = ["trace", "viscosity"])]
    simulated: bool,
    #[command(flatten)]
    holder: HolderArgs,
    /// The counters read this in the home pose, instead of zero
    #[arg(long, value_name = "COUNTS", default_value_t = 0, allow_negative_numbers = true)]
    counter_offset: i32,
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

/// Who holds a simulated arm.
#[derive(Debug, Args)]
#[command(next_help_heading = "With --simulated")]
struct HolderArgs {
    /// How the hand pulls, a built-in's name or a file (TOML); nobody: nobody holds the arm
    #[arg(long, value_name = "HAND", default_value = "pen-grip", requires = "simulated")]
    hand_model: PathBuf,
    /// How tightly it holds: light, usual, firm
    #[arg(long, value_name = "HOW", default_value = "usual", value_parser = parse_firmness, requires = "simulated")]
    firmness: Firmness,
    /// It does not tremble
    #[arg(long, requires = "simulated")]
    calm: bool,
    /// Where it holds the tip (m), in the base's frame [default: the home position]
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, conflicts_with = "hand", allow_negative_numbers = true, requires = "simulated")]
    hold: Option<Place>,
    /// Where it takes the tip (CSV), in the base's frame
    #[arg(long, value_name = "FILE", requires = "simulated")]
    hand: Option<PathBuf>,
    /// Which finger of that file it is
    #[arg(long, value_name = "NAME", default_value = "f0", requires = "hand")]
    finger: String,
    /// How the base stands in the world, as `base_orientation_wxyz` of the driver's configuration says [default: upright]
    #[arg(long, value_name = "W,X,Y,Z", value_parser = parse_orientation, allow_negative_numbers = true, requires = "simulated")]
    base_orientation: Option<UnitQuaternion<f64>>,
    /// Seed of tremor and noise
    #[arg(long, value_name = "N", default_value_t = 0, requires = "simulated")]
    seed: u64,
}

/// A point (m).
#[derive(Debug, Clone, Copy)]
struct Place([f64; 3]);

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
    let arm_file = describe(&args.description)?;
    let (motion, held_by) = motion(args, &arm_file)?;
    let play = Play {
        peak_n: limit("--peak-n", args.peak_n.unwrap_or(arm_file.peak_force_n))?,
        step_n: limit("--step-n", args.step_n.unwrap_or(f64::INFINITY))?,
        watchdog_ns: positive("--watchdog-ms", args.watchdog_ms, 1e6)?,
        poll_ns: positive("--poll-us", args.poll_us, 1e3)?,
        counter_offset: args.counter_offset.into(),
    };
    let card = Card::create(&args.card)?;
    say(format_args!("io-driver: playing {}{held_by} at {}", arm_file.name, args.card.display()));
    let tally = Emulator::new(card, arm_file, motion, play).run(play.poll_ns, &signals);
    let _ = std::fs::remove_file(&args.card);
    print_line(&serde_json::to_string(&tally)?);
    let is_good = tally.wrong() == 0 && tally.lost == 0;
    Ok(if is_good { ExitCode::SUCCESS } else { ExitCode::from(EXIT_FAULT) })
}

fn describe(name: &str) -> Result<ArmFile, Box<dyn Error>> {
    let text = match device_file::builtin(name) {
        Some(text) => text.to_owned(),
        None => read(Path::new(name)).map_err(|error| {
            format!("{error}; name a description's file, or one of {}", device_file::BUILTIN_NAMES.join(", "))
        })?,
    };
    match DeviceFile::parse(&text, Path::new(name))? {
        DeviceFile::Arm(arm_file) => Ok(*arm_file),
        DeviceFile::Ideal(_) => {
            Err(format!("{name} describes no mechanism; a card needs one, such as premium-1.5").into())
        }
    }
}

/// And who holds the arm, in words.
fn motion(args: &EmulateArgs, arm_file: &ArmFile) -> Result<(Motion, String), Box<dyn Error>> {
    if args.simulated {
        return simulated(&args.holder, arm_file);
    }
    Ok((unheld(args, arm_file)?, String::new()))
}

fn unheld(args: &EmulateArgs, arm_file: &ArmFile) -> Result<Motion, Box<dyn Error>> {
    if let Some(file) = &args.trace {
        let trace = EncoderTrace::parse(&read(file)?, file, arm_file.encoders.count_bits)?;
        return Ok(Motion::Trace(EncoderReplay::new(trace)));
    }
    match args.viscosity {
        None => Ok(Motion::Rest),
        Some(viscosity_nm_s) if viscosity_nm_s.is_finite() && viscosity_nm_s >= 1e-3 => {
            Ok(Motion::Yielding { viscosity_nm_s, joints: arm_file.encoders.home_joint_angles_rad })
        }
        Some(other) => Err(format!("--yield: found {other}, allowed: 0.001 N m s/rad and more").into()),
    }
}

fn simulated(args: &HolderArgs, arm: &ArmFile) -> Result<(Motion, String), Box<dyn Error>> {
    let home = arm.mechanism.forward(arm.encoders.home_joint_angles_rad);
    let wish = match &args.hand {
        Some(file) => {
            let (script, finger) = script(file, &args.finger)?;
            Wish::Scripted(HandPlayer::new(script), finger)
        }
        None => Wish::Resting(args.hold.map_or(home, |Place(place)| place.into())),
    };
    let model = hand_model(args)?;
    let held_by = model.as_ref().map_or_else(|| "nobody".to_owned(), |model| model.name.clone());
    let arm = arm.clone().in_base(&args.base_orientation.unwrap_or_default());
    let held = HeldArm::new(&arm, wish, model.as_ref(), args.seed)?;
    Ok((Motion::Simulated(Box::new(held)), format!(", held by: {held_by},")))
}

/// A hand file tells of all fingers of a hand; here one of them is played.
fn script(file: &Path, finger: &str) -> Result<(HandScript, usize), Box<dyn Error>> {
    let text = read(file)?;
    let header = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let named: Vec<&str> = header.split(',').filter_map(|column| column.trim().strip_suffix("_x")).collect();
    match named.iter().position(|name| *name == finger) {
        Some(place) => Ok((HandScript::parse(&text, file, &named)?, place)),
        // What is wrong with the file comes before a finger that is not in it.
        None => Err(match HandScript::parse(&text, file, &named) {
            Err(error) if !named.is_empty() => error.into(),
            _ => format!("{}: no finger {finger}; --finger one of {}", file.display(), listed(named)).into(),
        }),
    }
}

fn hand_model(args: &HolderArgs) -> Result<Option<HandModel>, Box<dyn Error>> {
    let (file, name) = (&args.hand_model, args.hand_model.to_string_lossy());
    let text = match model_file::builtin(&name) {
        _ if name == "nobody" => return Ok(None),
        Some(text) => text.to_owned(),
        None => read(file).map_err(|error| {
            format!(
                "{error}; name a hand's model, or one of {}, nobody",
                model_file::BUILTIN_NAMES.join(", ")
            )
        })?,
    };
    let mut model = model_file::parse(&text, file, args.firmness)?;
    if args.calm {
        model.tremor.rms_m = Vector3::zeros();
    }
    Ok(Some(model))
}

fn parse_firmness(text: &str) -> Result<Firmness, String> {
    Firmness::from_name(text).ok_or_else(|| format!("found {text}, allowed: light, usual, firm"))
}

fn parse_place(text: &str) -> Result<Place, String> {
    numbers(text)
        .map(Place)
        .ok_or_else(|| format!("found {text}, allowed: three numbers of metres, as in 0.0,0.05,-0.02"))
}

fn parse_orientation(text: &str) -> Result<UnitQuaternion<f64>, String> {
    let given = numbers(text).map(|[w, x, y, z]| Quaternion::new(w, x, y, z));
    given.filter(|q| (q.norm() - 1.0).abs() < 1e-3).map(UnitQuaternion::new_normalize).ok_or_else(|| {
        format!("found {text}, allowed: w,x,y,z of a quaternion of length 1, as in 0.7071,0.0,0.0,0.7071")
    })
}

/// So many finite numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    numbers?.try_into().ok().filter(|numbers: &[f64; N]| numbers.iter().all(|n| n.is_finite()))
}

fn read(file: &Path) -> Result<String, Box<dyn Error>> {
    input_file::read_text(file, MAX_TABLE_BYTES)
        .map_err(|error| format!("cannot read {}: {error}", file.display()).into())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_and_an_orientation_are_as_many_numbers_as_they_have() {
        assert_eq!(parse_place("0.1, -0.2,3e-2").unwrap().0, [0.1, -0.2, 0.03]);
        let turn = parse_orientation("0.6,0,0,0.8").unwrap();
        assert!((turn.w - 0.6).abs() < 1e-15 && (turn.k - 0.8).abs() < 1e-15);
        for wrong in ["", "0.1,0.2", "0.1,0.2,0.3,0.4,0.5", "a,b,c", "0.1,0.2,inf", "0.1,,0.2", "nan,0,0"] {
            assert!(parse_place(wrong).unwrap_err().contains("three numbers"), "{wrong}");
        }
        for wrong in ["1,0,0", "1,1,0,0", "0,0,0,0", "nan,0,0,1", "0.6,0,0,0.8,0"] {
            assert!(parse_orientation(wrong).unwrap_err().contains("length 1"), "{wrong}");
        }
    }
}
