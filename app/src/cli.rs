//! The command line of `phantom3`.
//!
//! Exit status: 0 done; 1 of `replay --expect-same`, something differs; 2 bad usage or bad input, nothing was started;
//! 3 a fault during the run or of a recording, which up to it is complete; 128 + n: signal n ended the run, the recording up to it is complete.

mod materials;
mod numbers;
mod play_args;
mod run_args;
mod run_help;

use self::materials::print_materials;
pub(crate) use self::numbers::parse_rate;
use self::play_args::PlayArgs;
use self::run_args::{RunArgs, calibrated_layout, make_plan, make_rig};
use crate::calibrate::{self, CalibrateArgs};
use crate::check::{self, CheckArgs};
use crate::convert::{self, ConvertArgs};
use crate::demo;
use crate::export::{self, ExportArgs};
use crate::interrupted;
use crate::outcome::{RunFailure, Stop};
use crate::outputs;
use crate::picture::{self, PlotArgs};
use crate::replay::{self, ReplayArgs};
use crate::report::Report;
use crate::run;
use crate::settings::{self, SettingsArgs};
use crate::study::{self, StudyCommand};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};
use io_driver::arguments;
use io_driver::cli::usual_socket;
use io_driver::config::period_of;
use io_driver::print;
use io_driver::say::{self, say};
use rt_core::signals::StopSignals;
use shm_abi::{client, endpoint};
use std::process::ExitCode;
use std::time::Duration;
use view::input::Bindings;
use view::{Eyes, NoWindow, WindowSpec};
use world::Settings;

const EXIT_USAGE: u8 = 2;
const EXIT_FAULT: u8 = 3;
const DEFAULT_RATE_HZ: f64 = 1000.0;

const AFTER_HELP: &str = "Without a command there is a small table to play on with the mouse; without a display, with --headless or with a \
driver that runs already, the default scene is played for ten seconds.\n\n\
Exit status: 0 done; 1 of replay --expect-same, something differs; 2 bad usage or bad input, nothing was started; \
3 a fault during the run or of a recording; 128 + n: ended by signal n. \
Whatever was recorded until then is complete on disk, if the signal was SIGINT, SIGTERM or SIGHUP; of others the last half \
second may be missing.";

/// Haptic rendering with friction cones for several fingers.
#[derive(Debug, Parser)]
#[command(name = "phantom3", version, after_help = AFTER_HELP)]
pub struct Cli {
    /// Open no window; without this word runs open one where there is a display, but for --clock virtual
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
    /// Play in a scene at a window, with a hand that the mouse moves, until the window is closed
    Play(PlayArgs),
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

/// Time limit for writing the lines of a run that has ended.
pub(crate) const LAST_WORDS: Duration = Duration::from_secs(5);

/// Runs the program with the process's own arguments.
pub fn main() -> ExitCode {
    // A system that refuses this kills whoever writes too much, as it would anyway.
    let _ = rt_core::signals::outlive_full_files();
    let ended = execute();
    // The lease is over: nobody is held up but whoever waits for this program.
    say::flush(LAST_WORDS);
    let lacks_something = print::is_lost() && ended == ExitCode::SUCCESS;
    let code = if lacks_something { ExitCode::from(EXIT_FAULT) } else { ended };
    if view::is_display_lost() {
        // Graphics libraries wait for the window's thread, which waits for ever.
        rt_core::process::exit_without_handlers(code);
    }
    code
}

fn execute() -> ExitCode {
    let Cli { settings, command, headless } = arguments::parse_with(advise);
    if settings.is_said() && !obeys_settings(command.as_ref()) {
        return RunFailure::Start(
            "--set, --settings: for run, play, check SCENE, replay and settings alone; this command goes by none".into(),
        )
        .conclude();
    }
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
            Err(failure) => failure.conclude(),
        },
        Some(AppCommand::Run(args)) => {
            conclude(settings.load().and_then(|settings| run_scene(&args, &settings, headless)))
        }
        Some(AppCommand::Play(args)) => {
            conclude(settings.load().and_then(|settings| play(&args, &settings, headless)))
        }
        Some(AppCommand::Check(args)) if args.is_model() => {
            let result = install_signals().and_then(interrupted::watch);
            result.map_or_else(|failure| failure.conclude(), |()| check::model_file::execute(&args))
        }
        Some(AppCommand::Check(args)) => settings
            .load()
            .map_or_else(|failure| failure.conclude(), |settings| check::execute(&args, &settings)),
        Some(AppCommand::Convert(args)) => conclude_or_take_back(|| convert::execute(&args)),
        Some(AppCommand::Replay(args)) => {
            let ready = settings.load().and_then(|settings| Ok((settings, install_signals()?)));
            let result = ready.and_then(|(settings, signals)| replay::execute(&args, &settings, &signals));
            result.unwrap_or_else(|failure| failure.conclude())
        }
        Some(AppCommand::Export(args)) => conclude_or_take_back(|| export::execute(&args)),
        Some(AppCommand::Plot(args)) => conclude_or_take_back(|| picture::execute(&args)),
        Some(AppCommand::Study(command)) => {
            let result = install_signals().and_then(|signals| study::execute(&command, &signals));
            result.map_or_else(|failure| failure.conclude(), Stop::conclude)
        }
        None => conclude(settings.load().and_then(|settings| play_or_demo(&settings, headless))),
    }
}

/// True for a command to which settings say something.
fn obeys_settings(command: Option<&AppCommand>) -> bool {
    match command {
        None => true,
        Some(AppCommand::Check(args)) => !args.is_model(),
        Some(command) => matches!(
            command,
            AppCommand::Run(_) | AppCommand::Play(_) | AppCommand::Replay(_) | AppCommand::Settings
        ),
    }
}

/// Who leaves out the command, or mistypes it, wants to play a scene.
fn advise(error: &mut clap::Error) {
    let is_after_a_command = || {
        let cli = Cli::command();
        std::env::args().skip(1).any(|word| cli.find_subcommand(word).is_some())
    };
    if error.kind() == ErrorKind::InvalidSubcommand
        && error.get(ContextKind::SuggestedSubcommand).is_none()
        && !is_after_a_command()
    {
        let tip = "a scene is played with 'phantom3 run SCENE.toml'".into();
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
}

/// Where people can see it and no driver runs, the mouse moves the fingers; else the demonstration.
fn play_or_demo(settings: &Settings, is_headless: bool) -> Result<(Report, Stop), RunFailure> {
    let socket = settings.driver_socket.value.clone().unwrap_or_else(endpoint::for_application);
    let is_for_play = !is_headless
        && view::window::has_display()
        && client::observe(&socket, "phantom3 looks around").is_err();
    match is_for_play.then(|| play(&PlayArgs::default(), settings, false)) {
        Some(Err(RunFailure::NoWindow(error))) => {
            say(format_args!("phantom3: {error}"));
            run_demo(settings, true)
        }
        Some(played) => played,
        None => run_demo(settings, is_headless),
    }
}

fn play(args: &PlayArgs, settings: &Settings, is_headless: bool) -> Result<(Report, Stop), RunFailure> {
    if is_headless {
        return Err(RunFailure::Start(
            "play and --headless exclude each other: the mouse moves the hand in a window; leave one out"
                .into(),
        ));
    }
    let signals = install_signals()?;
    let rig = args.rig(settings, &signals)?;
    let mut plan = args.plan(&rig, settings)?;
    plan.window = window_spec(&rig.scene.name, settings)?;
    if plan.window.is_none() {
        return Err(NoWindow::NoDisplay.into());
    }
    run::run(&rig, &plan, &signals)
}

fn run_demo(settings: &Settings, is_headless: bool) -> Result<(Report, Stop), RunFailure> {
    let signals = install_signals()?;
    let mut demo = demo::unpack(period_of(DEFAULT_RATE_HZ))?;
    let record = demo::recording_place(settings.recording_directory.value.as_deref())?;
    let socket = settings.driver_socket.value.clone().unwrap_or_else(|| usual_socket("phantom3"));
    let mut plan = demo::plan(&demo.rig, socket, record);
    plan.check_outputs(&settings.input_files().collect::<Vec<_>>())?;
    plan.window = if is_headless { None } else { window_spec(&demo.rig.scene.name, settings)? };
    if plan.attach.is_some() {
        demo.rig.layout = calibrated_layout()?;
    }
    run::run(&demo.rig, &plan, &signals)
}

fn run_scene(args: &RunArgs, settings: &Settings, is_headless: bool) -> Result<(Report, Stop), RunFailure> {
    let signals = install_signals()?;
    let args = &args.with(settings);
    let rig = make_rig(args, settings, &signals)?;
    let mut plan = make_plan(args, &rig, settings)?;
    plan.window = if is_headless { None } else { window_spec(&rig.scene.name, settings)? };
    for suspicion in check::suspicions_of_the_hand(&rig) {
        say(format_args!("phantom3: warning: {suspicion}"));
    }
    run::run(&rig, &plan, &signals)
}

/// `None`: nobody to show it to.
fn window_spec(title: &str, settings: &Settings) -> Result<Option<WindowSpec>, RunFailure> {
    let bindings = settings.bindings.value.as_deref().map_or_else(|| Ok(Bindings::default()), Bindings::read);
    let bindings = bindings.map_err(|error| RunFailure::Start(error.to_string()))?;
    Ok(view::window::has_display().then(|| WindowSpec {
        title: format!("{title} - phantom3"),
        size: settings.window_size_px.value.map(|side| side as f32),
        position: settings.window_position_px.value.map(|corner| corner.map(|side| side as f32)),
        is_fullscreen: settings.fullscreen.value,
        with_shadows: settings.shadows.value,
        eyes: Eyes {
            mode: settings.stereo_mode.value,
            separation_m: settings.eye_separation_m.value,
            convergence_m: settings.convergence_m.value,
        },
        bindings,
        pictures: settings.recording_directory.value.clone().unwrap_or_default(),
        carries_devices: false,
    }))
}

/// Of a command that a signal ends at once, without half a result.
fn conclude_or_take_back(execute: impl FnOnce() -> Result<Stop, RunFailure>) -> ExitCode {
    let result = install_signals().and_then(interrupted::watch).and_then(|()| execute());
    result.map_or_else(|failure| failure.conclude(), Stop::conclude)
}

fn install_signals() -> Result<StopSignals, RunFailure> {
    StopSignals::install().map_err(|error| RunFailure::Start(format!("cannot catch signals: {error}")))
}

fn conclude(result: Result<(Report, Stop), RunFailure>) -> ExitCode {
    match result {
        Ok((report, stop)) => {
            outputs::tell(&report, report.takes_standard_output());
            let ended = stop.conclude();
            if report.lacks_a_recording() { ExitCode::from(EXIT_FAULT) } else { ended }
        }
        Err(failure) => failure.conclude(),
    }
}

// The exit status of a usage error is clap's own, which is the contract's.
const _: () = assert!(EXIT_USAGE == 2);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
