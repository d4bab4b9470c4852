//! The command line of `io-driver`, which `phantom3 driver` offers as well.
//!
//! Exit status: 0 done; 2 bad usage or bad input, nothing was started; 3 a fault during the run.

mod clearing;
mod commission;
mod emergency;
mod emulate;
mod enter;
mod held_sockets;
mod lease_end;
mod listeners;
mod places;
mod prompt;
mod socket_table;
mod stopping;
#[cfg(test)]
pub(crate) mod told;
mod zero;

use crate::config::DriverConfig;
use crate::doctor::cli::{self as doctor, DoctorArgs};
use crate::driver::{self, Fit, RunOptions};
use crate::log_thread;
use crate::monitor::{self, End};
use crate::print::{self, print_line};
use crate::say::{self, say};
use crate::status::Status;
use clap::{Args, Parser, Subcommand};
use commission::CommissionArgs;
use emulate::EmulateArgs;
use places::SocketArgs;
pub use places::usual_socket;
pub use prompt::say_line_if_late;
use rt_core::plain_text::PlainJson;
use shm_abi::client::{self, AttachError};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;
use zero::ZeroArgs;

/// Bad usage or bad input.
pub const EXIT_USAGE: u8 = 2;
/// A fault during the run.
pub const EXIT_FAULT: u8 = 3;

/// Drives haptic devices in real time and shares them through memory.
#[derive(Debug, Parser)]
#[command(name = "io-driver", version, after_help = AFTER_HELP)]
pub struct Cli {
    #[command(subcommand)]
    command: DriverCommand,
}

const AFTER_HELP: &str = "Exit status: 0 done; 2 bad usage or input, nothing was started; 3 a fault during the run, or a driver that does \
not answer.\n\
The socket lies at $PHANTOM3_SOCKET, or driver.sock in $RUNTIME_DIRECTORY, $XDG_RUNTIME_DIR/phantom3 or /run/phantom3.";

/// What can be asked of the driver.
#[derive(Debug, Subcommand)]
pub enum DriverCommand {
    /// Run a driver until a signal or `stop` ends it
    Run(RunArgs),
    /// Show what a running driver is doing
    Status(StatusArgs),
    /// Ask a running driver to stop
    Stop(SocketArgs),
    /// Ask a running driver to leave its fault state
    ClearFault(SocketArgs),
    /// Switch all motors off at once and keep them off until `clear-fault`
    EmergencyStop(SocketArgs),
    /// End the lease of whoever commands: its force ramps out, and somebody else may command. That of another user, ended by
    /// an administrator, is not his again for ten seconds
    EndLease(SocketArgs),
    /// Tell devices that they are in their zeroing pose
    Zero(ZeroArgs),
    /// Try a device for the first time: do its counters and motors turn the right way?
    Commission(CommissionArgs),
    /// Play a card with counters, converters and amplifiers, for a driver without hardware
    Emulate(Box<EmulateArgs>),
    /// Say whether this machine is ready for real time, and what to do about it
    Doctor(DoctorArgs),
}

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Driver configuration (TOML); `-` reads standard input
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Refuse to start when a real-time guarantee is missing
    #[arg(long)]
    strict: bool,
    /// Little force and little speed, for the first trial of a device
    #[arg(long)]
    commissioning: bool,
    /// Say nothing but errors
    #[arg(long)]
    quiet: bool,
    /// Listen here instead
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
    /// End when this process, which must be the parent, ends
    #[arg(long, value_name = "PID", hide = true)]
    parent: Option<u32>,
}

/// Arguments of `status`.
#[derive(Debug, Args)]
pub struct StatusArgs {
    #[command(flatten)]
    socket: SocketArgs,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Show it on the full screen until `q`; with --json, or where there is no terminal, print an object or a line
    /// every second until interrupted
    #[arg(long)]
    watch: bool,
}

/// Runs the program with the process's own arguments.
pub fn main() -> ExitCode {
    execute(crate::arguments::parse::<Cli>().command)
}

/// The same, with something of one's own around each device.
pub fn main_with(fit: Fit) -> ExitCode {
    execute_with(crate::arguments::parse::<Cli>().command, Some(fit))
}

/// Runs one command.
pub fn execute(command: DriverCommand) -> ExitCode {
    execute_with(command, None)
}

fn execute_with(command: DriverCommand, fit: Option<Fit>) -> ExitCode {
    // A system that refuses this kills whoever writes too much, as it would anyway.
    let _ = rt_core::signals::outlive_full_files();
    let code = perform(command, fit);
    // A result that nobody got is none.
    if print::is_lost() && code == ExitCode::SUCCESS { ExitCode::from(EXIT_FAULT) } else { code }
}

fn perform(command: DriverCommand, fit: Option<Fit>) -> ExitCode {
    match command {
        DriverCommand::Run(args) => run(args, fit),
        DriverCommand::Status(args) if args.watch && !args.json && monitor::has_terminal() => watch(&args),
        DriverCommand::Status(args) => report(status(&args)),
        DriverCommand::Stop(args) => stopping::stop(&args.places()),
        DriverCommand::Doctor(args) => doctor::run(&args),
        DriverCommand::ClearFault(args) => clearing::clear_fault(&args.path()),
        DriverCommand::EmergencyStop(args) => emergency::emergency_stop(&args.places()),
        DriverCommand::EndLease(args) => lease_end::end_lease(&args.path()),
        DriverCommand::Zero(args) => zero::run(&args),
        DriverCommand::Commission(args) => commission::run(&args),
        DriverCommand::Emulate(args) => emulate::run(&args),
    }
}

fn run(args: RunArgs, fit: Option<Fit>) -> ExitCode {
    let loaded = match args.config.to_str() {
        Some("-") => DriverConfig::load_from_stdin(),
        _ => DriverConfig::load(&args.config),
    };
    let mut config = match loaded {
        Ok(config) => config,
        Err(error) => return fail(&error, EXIT_USAGE),
    };
    if args.commissioning {
        config.safety.begin_trial();
    }
    let RunArgs { strict, quiet, parent, socket, .. } = args;
    let options = RunOptions { fit, strict, quiet, parent, socket };
    let code = match driver::run(&config, &options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(&error, if error.is_fault() { EXIT_FAULT } else { EXIT_USAGE }),
    };
    // One that could not start has no thread for its lines yet.
    let _ = log_thread::start("io-driver");
    // Whoever holds the other end of standard error does not hold the end of the process.
    say::flush(LAST_WORDS);
    code
}

/// How long the lines of a driver that ends may take to be written.
const LAST_WORDS: Duration = Duration::from_millis(500);

fn watch(args: &StatusArgs) -> ExitCode {
    match monitor::run(&args.socket.path()) {
        Ok(End::Left) => ExitCode::SUCCESS,
        Ok(End::Signal(number)) => ExitCode::from(128 + number as u8),
        Err(error) => fail(&error, EXIT_USAGE),
    }
}

fn status(args: &StatusArgs) -> Result<(), AttachError> {
    let attachment = client::observe(&args.socket.path(), "io-driver status")?;
    loop {
        let status = Status::of(&attachment.driver, attachment.driver_pid);
        let text = match (args.json, args.watch) {
            (true, _) => PlainJson(serde_json::to_string(&status).unwrap_or_default()).to_string(),
            (false, true) => status.line(),
            (false, false) => status.to_string(),
        };
        if !print_line(&text) || !args.watch {
            return Ok(());
        }
        if !attachment.connection.is_open() {
            let words = rt_core::epitaph::read(&attachment.driver.epitaph);
            let words = words.map_or_else(String::new, |words| format!(": {words}"));
            print_line(&format!("the driver has ended{words}"));
            return Ok(());
        }
        std::thread::sleep(Duration::from_secs(1));
    }
}

fn report(result: Result<(), AttachError>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail_to_ask(&error),
    }
}

/// Somebody who listens and does not answer may have heard all the same; from everybody else nothing came.
fn fail_to_ask(error: &AttachError) -> ExitCode {
    fail(error, if error.may_be_heard() { EXIT_FAULT } else { EXIT_USAGE })
}

pub(crate) fn fail(error: &dyn std::error::Error, code: u8) -> ExitCode {
    say(format_args!("io-driver: {error}"));
    ExitCode::from(code)
}
