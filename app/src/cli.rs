//! The command line of `phantom3`.
//!
//! Exit status: 0 done; 1 of `replay --expect-same`, something differs; 2 bad usage or bad input, nothing was started;
//! 3 a fault during the run or of a recording, which up to it is complete; 128 + n: signal n ended the run, the recording up to it is complete.

use crate::calibrate::{self, CalibrateArgs, default_layout};
use crate::check::{self, CheckArgs};
use crate::control::desk::OrderSource;
use crate::convert::{self, ConvertArgs};
use crate::demo;
use crate::export::{self, ExportArgs};
use crate::outcome::{RunFailure, Stop};
use crate::picture::{self, PlotArgs};
use crate::replay::{self, ReplayArgs};
use crate::report::Report;
use crate::rig::{HandMode, Rig};
use crate::run::{self, Attach, RunPlan};
use crate::settings::{self, SettingsArgs};
use crate::simulated::SimulatedDevices;
use crate::study::{self, StudyCommand};
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use haptics::Material;
use io_driver::config::period_of;
use io_driver::say::say;
use io_driver::sim::hand::model_file::Firmness;
use rt_core::signals::StopSignals;
use shm_abi::endpoint;
use shm_abi::segment::ClockMode;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;
use world::{Layout, Scene, Settings};

const EXIT_USAGE: u8 = 2;
const EXIT_FAULT: u8 = 3;
const DEFAULT_RATE_HZ: f64 = 1000.0;
/// A day: longer runs are asked for by repeating them.
const MAX_SECONDS: f64 = 86_400.0;

const AFTER_HELP: &str = "Without a command the default scene is played for ten seconds.\n\n\
Exit status: 0 done; 1 of replay --expect-same, something differs; 2 bad usage or bad input, nothing was started; \
3 a fault during the run or of a recording; 128 + n: ended by signal n. \
Whatever was recorded until then is complete on disk.";

/// Haptic rendering with friction cones for several fingers.
#[derive(Debug, Parser)]
#[command(name = "phantom3", version, after_help = AFTER_HELP)]
pub struct Cli {
    /// Open no window; this version has none to open
    #[arg(long, global = true)]
    headless: bool,
    #[command(flatten)]
    settings: SettingsArgs,
    #[command(subcommand)]
    command: Option<AppCommand>,
}

#[derive(Debug, Subcommand)]
enum AppCommand {
    /// Play a scene with a scripted hand
    Run(RunArgs),
    /// Say what is wrong with a scene, all of it, and what is in it, without running it
    Check(CheckArgs),
    /// Turn the scene files of the thesis' own program into a scene (TOML)
    Convert(ConvertArgs),
    /// Find where a device stands, from points that it and another one measured together
    Calibrate(CalibrateArgs),
    /// Feed a recording's fingers to its scene, or to another one, and tell what differs
    Replay(ReplayArgs),
    /// Turn a recording into a table: CSV or Parquet
    Export(ExportArgs),
    /// Draw a recording: what the fingers felt
    Plot(PlotArgs),
    /// Print the settings of this workplace, and where each comes from
    Settings,
    /// List the materials that an entity of a scene can be made of
    Materials,
    /// Answer a question about the whole system with a table and a picture
    #[command(subcommand)]
    Study(StudyCommand),
    /// Drive the devices: what `io-driver` does, in this program
    #[command(subcommand)]
    Driver(io_driver::cli::DriverCommand),
}

#[derive(Debug, Clone, Args)]
struct RunArgs {
    /// The scene (TOML)
    scene: PathBuf,
    /// What the fingers do (CSV); default: the scene's own hand, else they rest at their start
    #[arg(long, value_name = "CSV")]
    hand: Option<PathBuf>,
    /// How the hand moves the devices
    #[arg(long, value_enum, default_value_t = HandModeName::Kinematic)]
    hand_mode: HandModeName,
    /// With --hand-mode impedance: how the hand pulls, a built-in's name or a file (TOML); nobody: nobody holds them
    /// [default: pen-grip]
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
    /// Write every tick here, as a table (CSV) or, with the ending .mcap, with all that replays and shows it; may be
    /// given several times
    #[arg(long, value_name = "FILE")]
    record: Vec<PathBuf>,
    /// Write what happens here, a line each: contacts, slips, grasps and more, as JSON or, with the ending .csv, as a table;
    /// may be given several times
    #[arg(long, value_name = "FILE")]
    events: Vec<PathBuf>,
    /// How long; default: as long as the hand file, at least 1 s
    #[arg(long, value_name = "S", value_parser = parse_seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Ticks per second [default: 1000]
    #[arg(long, value_name = "HZ", value_parser = parse_rate, allow_negative_numbers = true)]
    rate_hz: Option<f64>,
    /// Seed of everything random: with --hand-mode impedance the hand's tremor and the sensors' noise
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_seed, allow_negative_numbers = true)]
    seed: u64,
    /// What changes while it runs: a script of lines such as `at 2.5 reset`, or `-` for orders on the standard input, without
    /// `at`: reset; stiffness 1.1 [of ENTITY]; damping 0.9 [of ENTITY]; move ENTITY to X Y Z in S; swap SCENE
    #[arg(long, value_name = "FILE")]
    orders: Option<PathBuf>,
    /// Where the devices stand in the world (TOML) [with --attach: what `calibrate --write` wrote, if it is there]
    #[arg(long, value_name = "FILE")]
    layout: Option<PathBuf>,
    /// Use the devices of a driver that runs already, at this socket or the usual place; goes after the scene
    #[arg(long, value_name = "SOCKET", num_args = 0..=1, default_missing_value = "", value_parser = path_or_nothing(), conflicts_with_all = ["hand", "rate_hz"])]
    attach: Option<PathBuf>,
    /// With --attach: how long to wait for the driver's return, should it end
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = parse_grace, allow_negative_numbers = true)]
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
    fn with(&self, settings: &Settings) -> Self {
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

/// Runs the program with the process's own arguments.
pub fn main() -> ExitCode {
    let Cli { settings, command, .. } = Cli::parse();
    match command {
        Some(AppCommand::Driver(command)) => io_driver::cli::execute(command),
        Some(AppCommand::Calibrate(args)) => calibrate::run(&args),
        Some(AppCommand::Materials) => {
            print_materials();
            ExitCode::SUCCESS
        }
        Some(AppCommand::Settings) => match settings.load() {
            Ok(settings) => {
                settings::print(&settings);
                ExitCode::SUCCESS
            }
            Err(failure) => failed(&failure),
        },
        Some(AppCommand::Run(args)) => {
            conclude(settings.load().and_then(|settings| run_scene(&args, &settings)))
        }
        Some(AppCommand::Check(args)) => settings
            .load()
            .map_or_else(|failure| failed(&failure), |settings| check::execute(&args, &settings)),
        Some(AppCommand::Convert(args)) => {
            convert::execute(&args).map_or_else(|failure| failed(&failure), stopped)
        }
        Some(AppCommand::Replay(args)) => {
            let result = install_signals().and_then(|signals| replay::execute(&args, &signals));
            result.unwrap_or_else(|failure| failed(&failure))
        }
        Some(AppCommand::Export(args)) => {
            export::execute(&args).map_or_else(|failure| failed(&failure), stopped)
        }
        Some(AppCommand::Plot(args)) => {
            picture::execute(&args).map_or_else(|failure| failed(&failure), stopped)
        }
        Some(AppCommand::Study(command)) => {
            let result = install_signals().and_then(|signals| study::execute(&command, &signals));
            result.map_or_else(|failure| failed(&failure), stopped)
        }
        None => conclude(settings.load().and_then(|settings| run_demo(&settings))),
    }
}

fn run_demo(settings: &Settings) -> Result<(Report, Stop), RunFailure> {
    let signals = install_signals()?;
    let mut demo = demo::unpack(period_of(DEFAULT_RATE_HZ))?;
    let directory = settings.recording_directory.value.as_deref();
    let socket = settings.driver_socket.value.clone().unwrap_or_else(endpoint::for_application);
    let plan = demo::plan(&demo.rig, socket, directory);
    if plan.attach.is_some() {
        demo.rig.layout = calibrated_layout()?;
    }
    run::run(&demo.rig, &plan, &signals)
}

fn run_scene(args: &RunArgs, settings: &Settings) -> Result<(Report, Stop), RunFailure> {
    let signals = install_signals()?;
    let args = &args.with(settings);
    let rig = make_rig(args, settings)?;
    run::run(&rig, &make_plan(args, &rig)?, &signals)
}

fn install_signals() -> Result<StopSignals, RunFailure> {
    StopSignals::install().map_err(|error| RunFailure::Start(format!("cannot catch signals: {error}")))
}

/// Clap's own paths are never empty, not even by default.
fn path_or_nothing() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().map(PathBuf::from)
}

fn make_rig(args: &RunArgs, settings: &Settings) -> Result<Rig, RunFailure> {
    let wrong = |error: &dyn std::fmt::Display| RunFailure::Start(error.to_string());
    let hand_mode = match args.hand_mode {
        HandModeName::Kinematic => HandMode::Kinematic,
        HandModeName::Impedance if args.attach.is_some() => {
            return Err(wrong(
                &"--attach and --hand-mode impedance exclude each other: the devices of a driver that runs are moved by whoever holds them",
            ));
        }
        HandModeName::Impedance => HandMode::Impedance(simulated_devices(args)),
    };
    refuse_without_impedance(args)?;
    let mut scene = Scene::load(&args.scene).map_err(|error| wrong(&error))?;
    if args.attach.is_some() {
        // The devices are the fingers; nothing follows a script.
        scene.hand = None;
    }
    settings::find_data(&mut scene, &args.scene, settings);
    let layout = find_layout(args)?;
    let period_ns = period_of(args.rate_hz.unwrap_or(DEFAULT_RATE_HZ));
    Rig::new(&args.scene, scene, layout, args.hand.as_deref(), hand_mode, period_ns)
        .map_err(|error| wrong(&error))
}

fn simulated_devices(args: &RunArgs) -> SimulatedDevices {
    let usual = SimulatedDevices::default();
    SimulatedDevices {
        description: args.device.clone().unwrap_or(usual.description),
        hand_model: args.hand_model.clone().unwrap_or(usual.hand_model),
        firmness: args.firmness.unwrap_or(usual.firmness),
        trembles: usual.trembles,
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
fn calibrated_layout() -> Result<Option<Layout>, RunFailure> {
    let found = default_layout::load().map_err(|error| RunFailure::Start(error.to_string()))?;
    Ok(found.map(|(file, layout)| {
        say(format_args!(
            "phantom3: the devices stand as {} says; `run --layout` names another file",
            file.display()
        ));
        layout
    }))
}

fn make_plan(args: &RunArgs, rig: &Rig) -> Result<RunPlan, RunFailure> {
    if args.attach.is_some() && args.clock == Some(Clock::Virtual) {
        return Err(RunFailure::Start(
            "--attach and --clock virtual exclude each other: a driver that runs has its own clock".into(),
        ));
    }
    refuse_to_overwrite_input(args, rig)?;
    let attach = args.attach.as_ref().map(|socket| Attach {
        socket: if socket.as_os_str().is_empty() { endpoint::for_application() } else { socket.clone() },
        grace: Duration::from_secs_f64(args.grace),
    });
    Ok(RunPlan {
        clock: args.clock.map(ClockMode::from),
        seconds: args.seconds,
        record: args.record.clone(),
        events: args.events.clone(),
        seed: args.seed,
        orders: order_source(args)?,
        attach,
    })
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

fn refuse_to_overwrite_input(args: &RunArgs, rig: &Rig) -> Result<(), RunFailure> {
    // The hand that counts may be the one that the scene names.
    let hand = rig.hand.as_ref().map(|hand| &hand.path);
    let inputs = [
        Some(&args.scene),
        args.hand.as_ref(),
        hand,
        args.layout.as_ref(),
        args.hand_model.as_ref(),
        args.device.as_ref(),
        args.orders.as_ref(),
    ];
    let inputs: Vec<&PathBuf> = inputs.into_iter().flatten().chain(rig.model_files()).collect();
    let written: Vec<(&str, &PathBuf)> = args
        .record
        .iter()
        .map(|file| ("--record", file))
        .chain(args.events.iter().map(|file| ("--events", file)))
        .collect();
    for (index, (option, record)) in written.iter().enumerate() {
        if let Some(input) = inputs.iter().find(|input| is_same_file(record, input)) {
            return Err(RunFailure::Start(format!(
                "{option} {} would overwrite the input {}; name another file",
                record.display(),
                input.display()
            )));
        }
        let absolute = std::path::absolute(record).ok();
        let is_record = |(_, other): &(&str, &PathBuf)| {
            std::path::absolute(other).ok() == absolute || is_same_file(record, other)
        };
        if written[..index].iter().any(is_record) {
            return Err(RunFailure::Start(format!(
                "{option} {} is given twice; each recording needs a file of its own",
                record.display()
            )));
        }
    }
    Ok(())
}

/// By inode: links of both kinds lead to the same bytes.
pub(crate) fn is_same_file(a: &Path, b: &Path) -> bool {
    let identity = |path: &Path| path.metadata().map(|file| (file.dev(), file.ino()));
    matches!((identity(a), identity(b)), (Ok(a), Ok(b)) if a == b)
}

fn conclude(result: Result<(Report, Stop), RunFailure>) -> ExitCode {
    match result {
        Ok((report, stop)) => {
            print_report(&report);
            let ended = stopped(stop);
            if report.lacks_a_recording() { ExitCode::from(EXIT_FAULT) } else { ended }
        }
        Err(failure) => failed(&failure),
    }
}

fn stopped(stop: Stop) -> ExitCode {
    match stop {
        Stop::Finished => ExitCode::SUCCESS,
        Stop::Signal(signal) => {
            say(format_args!("phantom3: ended by signal {signal} before its time"));
            ExitCode::from(128u8.saturating_add(u8::try_from(signal).unwrap_or(0)))
        }
    }
}

fn failed(failure: &RunFailure) -> ExitCode {
    say(format_args!("phantom3: {failure}"));
    ExitCode::from(failure.exit_status())
}

/// A closed pipe is no reason to fail: the run is done.
fn print_report(report: &Report) {
    use std::io::Write;
    let _ = writeln!(std::io::stdout(), "{report}");
}

/// What `material = "..."` of an entity stands for, a line each.
fn print_materials() {
    use std::io::Write;
    let mut out = std::io::stdout();
    let _ = writeln!(
        out,
        "{:<10} {:>5} {:>5} {:>14} {:>15} {:>14}  source of the friction; of the density",
        "material", "mu_s", "mu_d", "stiffness N/m", "damping N s/m", "density kg/m3"
    );
    for made_of in Material::ALL {
        let Material { name, mu_s, mu_d, stiffness_n_per_m, damping_n_s_per_m, source, .. } = made_of;
        let (density_kg_m3, density_source) = (made_of.density_kg_m3, made_of.density_source);
        let _ = writeln!(
            out,
            "{name:<10} {mu_s:>5.2} {mu_d:>5.2} {stiffness_n_per_m:>14.0} {damping_n_s_per_m:>15.1} \
             {density_kg_m3:>14.0}  {source}; density: {density_source}"
        );
    }
    let _ = writeln!(out, "Friction is that of a dry fingertip; all of stiffness and damping is a choice.");
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    parse_number(text, "seconds", f64::MIN_POSITIVE, MAX_SECONDS)
}

fn parse_firmness(text: &str) -> Result<Firmness, String> {
    Firmness::from_name(text).ok_or_else(|| format!("found {text}, allowed: light, usual, firm"))
}

pub(crate) fn parse_rate(text: &str) -> Result<f64, String> {
    parse_number(text, "Hz", 10.0, 20_000.0)
}

fn parse_grace(text: &str) -> Result<f64, String> {
    parse_number(text, "seconds", 0.0, 3600.0)
}

fn parse_seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("found {text}, allowed: a whole number from 0 to {}", u64::MAX))
}

fn parse_number(text: &str, unit: &str, min: f64, max: f64) -> Result<f64, String> {
    let allowed = if min == f64::MIN_POSITIVE {
        format!("more than 0, at most {max} {unit}")
    } else {
        format!("{min} to {max} {unit}")
    };
    match text.parse::<f64>() {
        Ok(number) if (min..=max).contains(&number) => Ok(number),
        _ => Err(format!("found {text}, allowed: {allowed}")),
    }
}

// The exit status of a usage error is clap's own, which is the contract's.
const _: () = assert!(EXIT_USAGE == 2);

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn what_is_for_simulated_devices_is_refused_where_none_are() {
        for given in [["--firmness", "firm"], ["--hand-model", "fingertip"], ["--device", "premium-1.5"]] {
            let words = ["phantom3", "run", "no-scene.toml"].into_iter().chain(given);
            let Some(AppCommand::Run(args)) = Cli::try_parse_from(words).expect("good words").command else {
                panic!("not a run");
            };
            let said = make_rig(&args, &Settings::default()).expect_err("kinematic").to_string();
            assert!(said.starts_with(given[0]) && said.contains("--hand-mode impedance"), "{said}");
        }
    }

    #[test]
    fn numbers_out_of_range_name_what_is_allowed() {
        assert_eq!(parse_rate("0").unwrap_err(), "found 0, allowed: 10 to 20000 Hz");
        assert_eq!(parse_seconds("0").unwrap_err(), "found 0, allowed: more than 0, at most 86400 seconds");
        assert_eq!(
            parse_seconds("nan").unwrap_err(),
            "found nan, allowed: more than 0, at most 86400 seconds"
        );
        assert_eq!(parse_seconds("-1").unwrap_err(), "found -1, allowed: more than 0, at most 86400 seconds");
    }
}
