//! The command line of the doctor.

use super::{examine, segment, to_json};
use crate::config::DriverConfig;
use crate::loop_thread::loop_cpu;
use crate::print;
use crate::say::say;
use clap::Args;
use rt_core::cpu::parse_cpu_list;
use rt_core::doctor::live::{LiveProbes, LiveTree};
use rt_core::doctor::machine::{LoopSpec, Machine};
use rt_core::doctor::plan::{self, PlanNames};
use rt_core::doctor::table::Table;
use rt_core::doctor::{Finding, Tally};
use rt_core::plain_text::{PlainJson, PlainLines};
use shm_abi::endpoint;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Something fails.
const EXIT_NOT_READY: u8 = 1;
/// Bad usage or bad input.
const EXIT_USAGE: u8 = 2;
/// The findings could not be told.
const EXIT_LOST: u8 = 3;

/// Arguments of `doctor`.
#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct DoctorArgs {
    /// Print one JSON object; ids and verdicts are stable
    #[arg(long, conflicts_with = "fix_plan")]
    json: bool,
    /// Print a shell script for this machine that does what the remedies say; nothing is changed
    #[arg(long)]
    fix_plan: bool,
    /// Ask for the loop of this driver configuration (TOML): its CPU, priority, rate and phase
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Ask for a loop on this CPU [default: the configuration's, else the last one]
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
}

const AFTER_HELP: &str = "\
Looks at everything that is known to spoil a real-time loop, tries what can be tried (a promotion to SCHED_FIFO, \
locked memory, a loop that spins for 200 ms at the lowest real-time priority), and says for each question what was \
found. Nothing is changed, no lease is taken, and a driver that runs is not disturbed.

Verdicts:
  pass        as it should be
  warn        the loop works, and its worst ticks are worse than they need be
  FAIL        deadlines will be missed, or the loop does not get what it needs
  unreadable  could not be found out; the remedy says how it could

Ask as the user who will run the driver: rights are that user's. Ask again as root to see what only root may read.
The groups are kernel, starvation, privilege, interference, power, firmware, memory, device, segment.

The fix plan is a script to be read before it is run; each part says what it does and how to undo it. What changes \
the kernel's command line takes effect at the next boot:
  io-driver doctor --fix-plan > plan.sh
  sudo sh plan.sh

Exit status: 0 nothing fails; 1 something fails, whichever way it is printed; 2 bad usage or input; \
3 what was found could not be written.";

/// Examines the machine at hand and prints what was asked for.
pub fn run(args: &DoctorArgs) -> ExitCode {
    let (spec, socket) = match subject(args) {
        Ok(subject) => subject,
        Err(error) => {
            say(format_args!("io-driver doctor: {error}"));
            return ExitCode::from(EXIT_USAGE);
        }
    };
    let (tree, probes) = (LiveTree::default(), LiveProbes);
    let machine = Machine { tree: &tree, probes: &probes, spec: &spec };
    let answer = segment::ask(&socket);
    let findings = examine(&machine, &socket.to_string_lossy(), &answer);
    let text = match (args.json, args.fix_plan) {
        (true, _) => format!("{}\n", PlainJson(to_json(&findings, &spec))),
        (false, true) => plan::script(&machine, &findings, &plan_names()),
        (false, false) => PlainLines(Table { findings: &findings, spec: &spec }).to_string(),
    };
    print::print(&text);
    if print::is_lost() { ExitCode::from(EXIT_LOST) } else { status_of(&findings) }
}

fn status_of(findings: &[Finding]) -> ExitCode {
    match Tally::of(findings).fail {
        0 => ExitCode::SUCCESS,
        _ => ExitCode::from(EXIT_NOT_READY),
    }
}

/// The loop and the socket to ask about.
fn subject(args: &DoctorArgs) -> Result<(LoopSpec, PathBuf), String> {
    let config = match &args.config {
        Some(file) => DriverConfig::load(file).map_err(|error| error.to_string())?,
        None => defaults()?,
    };
    // A machine with a single CPU has no loop of its own; its only CPU is what there is to ask about.
    let cpu = args.cpu.or_else(|| loop_cpu(&config)).unwrap_or_else(rt_core::cpu::current_cpu);
    check_online(cpu)?;
    let spec = LoopSpec {
        cpu,
        priority: config.real_time.priority,
        period_ns: config.period_ns,
        phase_offset_ns: config.real_time.phase_offset_ns,
    };
    let socket = config.socket.unwrap_or_else(endpoint::for_application);
    Ok((spec, std::path::absolute(&socket).unwrap_or(socket)))
}

/// By the machine's list, not by this process's affinity, from which the kernel leaves isolated CPUs out.
fn check_online(cpu: usize) -> Result<(), String> {
    let list = std::fs::read_to_string("/sys/devices/system/cpu/online").unwrap_or_default();
    match parse_cpu_list(&list) {
        Some(online) if !online.is_empty() && !online.contains(&cpu) => {
            Err(format!("found CPU {cpu}, allowed: those that are online, {}", list.trim()))
        }
        _ => Ok(()),
    }
}

/// What a configuration that says nothing but a device would have.
fn defaults() -> Result<DriverConfig, String> {
    DriverConfig::parse("[[device]]\nbackend = \"ideal\"\n", Path::new("(defaults)"))
        .map_err(|error| error.to_string())
}

/// Names that a fix plan gives to its files.
#[must_use]
pub fn plan_names() -> PlanNames {
    let program = std::env::current_exe().unwrap_or_else(|_| "io-driver".into());
    PlanNames {
        // Not that of what install.sh puts there.
        prefix: "phantom3-plan".into(),
        program: program.to_string_lossy().into_owned(),
        unit_prefixes: vec!["phantom3-driver".into(), "io-driver".into()],
    }
}
