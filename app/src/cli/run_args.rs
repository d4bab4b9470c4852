//! The arguments of `run`, and what they make: a rig, and a plan for it.

use super::DEFAULT_RATE_HZ;
use super::numbers::{parse_grace, parse_rate, parse_seconds, parse_seed};
use super::run_help::RUN_HELP;
use crate::calibrate::default_layout;
use crate::control::desk::OrderSource;
use crate::loading::while_reading;
use crate::outcome::RunFailure;
use crate::record::read::is_mcap;
use crate::rig::{HandMode, Rig};
use crate::run::{Attach, RunPlan};
use crate::settings;
use crate::simulated::SimulatedDevices;
use crate::snapshots::PictureArgs;
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{Args, ValueEnum};
use io_driver::cli::usual_socket;
use io_driver::config::period_of;
use io_driver::say::say;
use io_driver::sim::hand::model_file::Firmness;
use rt_core::signals::StopSignals;
use shm_abi::segment::ClockMode;
use std::path::PathBuf;
use std::time::Duration;
use world::{Layout, Scene, Settings};

#[derive(Debug, Clone, Args)]
#[command(after_long_help = RUN_HELP)]
pub(super) struct RunArgs {
    /// The scene (TOML)
    scene: PathBuf,
    /// What the fingers do (CSV); default: the scene's own hand, else they rest at their start
    #[arg(long, value_name = "CSV")]
    hand: Option<PathBuf>,
    /// How the hand moves the devices
    #[arg(long, value_enum, default_value_t = HandModeName::Kinematic)]
    hand_mode: HandModeName,
    /// With --hand-mode impedance: how the hand pulls, a built-in's name or a file (TOML); nobody: nobody holds them
    /// [default: pen-grip; for several fingers fingertip]
    #[arg(long, value_name = "HAND")]
    hand_model: Option<PathBuf>,
    /// With --hand-mode impedance: how tightly the hand holds: light, usual, firm [default: usual]
    #[arg(long, value_name = "HOW", value_parser = parse_firmness)]
    firmness: Option<Firmness>,
    /// With --hand-mode impedance: which device is simulated, a built-in's name or a description (TOML)
    /// [default: premium-1.5]
    #[arg(long, value_name = "DEVICE")]
    device: Option<PathBuf>,
    /// What moves time [default: real; with --attach: the driver's own clock]
    #[arg(long, value_enum)]
    clock: Option<Clock>,
    /// Write every tick here: FILE.csv (a table), FILE.mcap (all that replays and shows it), or - (CSV on the standard
    /// output; the report then goes to standard error); may be given several times
    #[arg(long, value_name = "FILE")]
    record: Vec<PathBuf>,
    /// Write what happens here, a line each: contacts, slips, grasps and more: FILE.jsonl, FILE.csv (a table), or - (JSON on
    /// the standard output); may be given several times
    #[arg(long, value_name = "FILE")]
    events: Vec<PathBuf>,
    #[command(flatten)]
    pictures: PictureArgs,
    /// How long; default: as long as the hand file, at least 1 s
    #[arg(long, alias = "duration", value_name = "S", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Ticks per second [default: 1000]
    #[arg(long, value_name = "HZ", value_parser = parse_rate, allow_negative_numbers = true)]
    rate_hz: Option<f64>,
    /// Seed of everything random: with --hand-mode impedance the hand's tremor and the sensors' noise
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_seed, allow_negative_numbers = true)]
    seed: u64,
    /// What changes while it runs: a script of lines such as `at 2.5 reset`, or - for orders on the standard input, without
    /// `at`; all orders are listed below
    #[arg(long, value_name = "FILE")]
    orders: Option<PathBuf>,
    /// Where the devices stand in the world (TOML) [with --attach: what `calibrate --write` wrote, if it is there]
    #[arg(long, value_name = "FILE")]
    pub(super) layout: Option<PathBuf>,
    /// Use the devices of a driver that runs already, at this socket or the usual place; goes after the scene
    #[arg(long, value_name = "SOCKET", num_args = 0..=1, default_missing_value = "", value_parser = path_or_nothing(), conflicts_with_all = ["hand", "rate_hz"])]
    attach: Option<PathBuf>,
    /// With --attach: how long to wait for the driver's return, should it end
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = parse_grace, allow_negative_numbers = true, requires = "attach")]
    grace: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum HandModeName {
    /// The fingers follow the hand file exactly
    Kinematic,
    /// A simulated hand pulls simulated devices, with their weight, friction, encoders and motors
    Impedance,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Clock {
    /// One process, as fast as the machine allows; repeatable
    Virtual,
    /// Two processes; a tick ends when both have done their part
    Lockstep,
    /// Two processes in real time
    Real,
}

impl RunArgs {
    /// With what the settings say where the command line says nothing.
    pub(super) fn with(&self, settings: &Settings) -> Self {
        let mut args = self.clone();
        args.scene = settings::find(&args.scene, &settings.scenes.value);
        args.hand = args.hand.map(|hand| settings::find(&hand, &settings.hands.value));
        let socket = settings.driver_socket.value.as_ref();
        args.attach = args
            .attach
            .map(|said| if said.as_os_str().is_empty() { socket.unwrap_or(&said).clone() } else { said });
        if args.clock.is_none() && args.attach.is_none() {
            args.clock = Clock::from_str(settings.clock.value, false).ok();
        }
        args
    }
}

impl From<Clock> for ClockMode {
    fn from(clock: Clock) -> Self {
        match clock {
            Clock::Virtual => Self::Virtual,
            Clock::Lockstep => Self::Lockstep,
            Clock::Real => Self::Real,
        }
    }
}

pub(super) fn make_rig(
    args: &RunArgs,
    settings: &Settings,
    signals: &StopSignals,
) -> Result<Rig, RunFailure> {
    let wrong = |error: &dyn std::fmt::Display| RunFailure::Start(error.to_string());
    if args.hand_mode == HandModeName::Impedance && args.attach.is_some() {
        return Err(wrong(
            &"--attach and --hand-mode impedance exclude each other: the devices of a driver that runs are moved by whoever holds them",
        ));
    }
    refuse_without_impedance(args)?;
    if let Some(name) = args.pictures.idle_option() {
        return Err(wrong(&format_args!(
            "{name} is for pictures; add --snapshot T:FILE.png or --frames DIR, or leave it out"
        )));
    }
    if is_mcap(&args.scene) {
        let recording = args.scene.display();
        return Err(wrong(&format_args!(
            "{recording} is a recording; `phantom3 replay {recording}` plays it again"
        )));
    }
    let mut scene = Scene::load(&args.scene).map_err(|error| wrong(&error))?;
    settings::find_data(&mut scene, &args.scene, settings);
    // The devices are the fingers; nothing follows a script.
    let unread_hand = if args.attach.is_some() { scene.hand.take() } else { None };
    let hand_mode = match args.hand_mode {
        HandModeName::Kinematic => HandMode::Kinematic,
        HandModeName::Impedance => HandMode::Impedance(simulated_devices(args, scene.fingers.len())),
    };
    let layout = find_layout(args)?;
    let period_ns = period_of(args.rate_hz.unwrap_or(DEFAULT_RATE_HZ));
    let make = || Rig::new(&args.scene, scene, layout, args.hand.as_deref(), hand_mode, period_ns);
    let mut rig = while_reading(&args.scene, signals, make).map_err(|error| wrong(&error))?;
    rig.scene.hand = rig.scene.hand.or(unread_hand);
    Ok(rig)
}

fn simulated_devices(args: &RunArgs, fingers: usize) -> SimulatedDevices {
    let usual = SimulatedDevices::for_fingers(fingers);
    SimulatedDevices {
        description: args.device.clone().unwrap_or(usual.description),
        hand_model: args.hand_model.clone().unwrap_or(usual.hand_model),
        firmness: args.firmness.unwrap_or(usual.firmness),
        trembles: usual.trembles,
        is_live: false,
        seed: args.seed,
    }
}

/// A firm hand that is not there would be looked for in the recording in vain.
fn refuse_without_impedance(args: &RunArgs) -> Result<(), RunFailure> {
    let given = [
        ("--hand-model", args.hand_model.is_some()),
        ("--firmness", args.firmness.is_some()),
        ("--device", args.device.is_some()),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((name, _)) if args.hand_mode == HandModeName::Kinematic => Err(RunFailure::Start(format!(
            "{name} is for simulated devices; add --hand-mode impedance, or leave it out"
        ))),
        _ => Ok(()),
    }
}

/// Where the devices stand: as said; real ones, of which nothing is said, as they were calibrated.
fn find_layout(args: &RunArgs) -> Result<Option<Layout>, RunFailure> {
    let wrong = |error: &dyn std::fmt::Display| RunFailure::Start(error.to_string());
    let Some(file) = &args.layout else {
        if args.attach.is_none() {
            return Ok(None);
        }
        return calibrated_layout();
    };
    let layout = Layout::load(file).map_err(|error| wrong(&error))?;
    let affine = (0..world::MAX_DEVICES).find(|index| layout.placement(*index).rigid().is_none());
    match affine {
        Some(index) if args.attach.is_none() => Err(wrong(&format_args!(
            "{}: device {index} has a matrix, which corrects a real device's geometry; ideal and simulated \
             devices need none: leave out the matrix, or attach to real devices with --attach",
            file.display()
        ))),
        _ => Ok(Some(layout)),
    }
}

/// What `calibrate --write` wrote, if it is there.
pub(super) fn calibrated_layout() -> Result<Option<Layout>, RunFailure> {
    let found = default_layout::load().map_err(|error| RunFailure::Start(error.to_string()))?;
    Ok(found.map(|(file, layout)| {
        say(format_args!(
            "phantom3: the devices stand as {} says; `run --layout` names another file",
            file.display()
        ));
        layout
    }))
}

pub(super) fn make_plan(args: &RunArgs, rig: &Rig, settings: &Settings) -> Result<RunPlan, RunFailure> {
    if args.attach.is_some() && args.clock == Some(Clock::Virtual) {
        return Err(RunFailure::Start(
            "--attach and --clock virtual exclude each other: a driver that runs has its own clock".into(),
        ));
    }
    let attach = args.attach.as_ref().map(|socket| Attach {
        socket: if socket.as_os_str().is_empty() { usual_socket("phantom3") } else { socket.clone() },
        grace: Duration::from_secs_f64(args.grace),
    });
    let plan = RunPlan {
        clock: args.clock.map(ClockMode::from),
        seconds: args.seconds,
        record: args.record.clone(),
        events: args.events.clone(),
        pictures: args.pictures.wanted(settings),
        window: None,
        inputs: inputs(args, rig, settings),
        seed: args.seed,
        orders: order_source(args)?,
        settings: settings.clone(),
        attach,
    };
    plan.check_outputs(&plan.inputs)?;
    Ok(plan)
}

fn order_source(args: &RunArgs) -> Result<Option<OrderSource>, RunFailure> {
    let Some(file) = &args.orders else { return Ok(None) };
    if file.as_os_str() != "-" {
        return Ok(Some(OrderSource::File(file.clone())));
    }
    if args.clock == Some(Clock::Virtual) {
        return Err(RunFailure::Start(
            "--orders - and --clock virtual exclude each other: that clock waits for nobody; name a script, or use \
             --clock real"
                .into(),
        ));
    }
    Ok(Some(OrderSource::Input))
}

fn inputs(args: &RunArgs, rig: &Rig, settings: &Settings) -> Vec<PathBuf> {
    let said = [&args.hand, &args.layout, &args.hand_model, &args.device, &args.orders];
    let said = said.into_iter().flatten().cloned();
    said.chain(rig.input_files()).chain(settings.input_files()).collect()
}

/// Clap's own paths are never empty, not even by default.
fn path_or_nothing() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().map(PathBuf::from)
}

fn parse_firmness(text: &str) -> Result<Firmness, String> {
    Firmness::from_name(text).ok_or_else(|| format!("found {text}, allowed: light, usual, firm"))
}

#[cfg(test)]
mod tests {
    use super::super::{AppCommand, Cli};
    use super::*;
    use clap::Parser;

    #[test]
    fn what_is_for_simulated_devices_is_refused_where_none_are() {
        for given in [["--firmness", "firm"], ["--hand-model", "fingertip"], ["--device", "premium-1.5"]] {
            let words = ["phantom3", "run", "no-scene.toml"].into_iter().chain(given);
            let Some(AppCommand::Run(args)) = Cli::try_parse_from(words).expect("good words").command else {
                panic!("not a run");
            };
            let said = make_rig(&args, &Settings::default(), &StopSignals::default())
                .expect_err("kinematic")
                .to_string();
            assert!(said.starts_with(given[0]) && said.contains("--hand-mode impedance"), "{said}");
        }
    }

    #[test]
    fn what_would_have_no_effect_is_refused() {
        for given in [["--camera", "side"], ["--stereo", "anaglyph"]] {
            let words = ["phantom3", "run", "no-scene.toml"].into_iter().chain(given);
            let Some(AppCommand::Run(args)) = Cli::try_parse_from(words).expect("good words").command else {
                panic!("not a run");
            };
            let said = make_rig(&args, &Settings::default(), &StopSignals::default())
                .expect_err("no pictures")
                .to_string();
            assert!(said.starts_with(given[0]) && said.contains("--snapshot"), "{said}");
        }
        let said = Cli::try_parse_from(["phantom3", "run", "no-scene.toml", "--grace", "3"]).unwrap_err();
        assert!(said.to_string().contains("--attach"), "{said}");
    }
}
