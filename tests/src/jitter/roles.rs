//! This program's other roles: what it is when it starts itself again as a child.
//!
//! Problem: driver, application, bare loops, cyclictest and load must be real processes, and none may outlive
//! the measurement, however that ends.
//! Model: the environment names the role and the parent; the command line stays free for the role's own words,
//! as `phantom3` reads it. Entering a role ties the process to its parent and gives it back the CPUs that the
//! parent does without (the parent stays off the CPU that is measured).

use crate::jitter::load;
use crate::jitter::waiting_loop;
use rustix::process::Signal;
use rustix::thread::CpuSet;
use std::os::unix::process::CommandExt;
use std::process::{Command, ExitCode, Stdio};

const ROLE: &str = "JITTER_ROLE";
const PARENT: &str = "JITTER_PARENT";
const CPUS: &str = "JITTER_CPUS";

/// What a child does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// `phantom3`, driver included.
    Phantom3,
    /// A bare waiting loop.
    WaitingLoop,
    /// Becomes the program that its arguments name.
    Become,
    /// One kind of load.
    Load,
    /// Ends at once: what the load of forks starts.
    Nothing,
}

impl Role {
    const ALL: [Self; 5] = [Self::Phantom3, Self::WaitingLoop, Self::Become, Self::Load, Self::Nothing];

    fn name(self) -> &'static str {
        match self {
            Self::Phantom3 => "phantom3",
            Self::WaitingLoop => "waiting-loop",
            Self::Become => "become",
            Self::Load => "load",
            Self::Nothing => "nothing",
        }
    }

    /// This program in that role, ready for arguments: no input, no output, out of reach of the terminal's Ctrl-C.
    pub fn command(self) -> std::io::Result<Command> {
        let mut command = Command::new(std::env::current_exe()?);
        command
            .env(ROLE, self.name())
            .env(PARENT, std::process::id().to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .process_group(0);
        if std::env::var_os(CPUS).is_none() {
            let cpus: Vec<_> = rt_core::cpu::online_cpus().iter().map(ToString::to_string).collect();
            command.env(CPUS, cpus.join(","));
        }
        Ok(command)
    }
}

/// Remembers all CPUs open to this process, then leaves `cpu` to the measured loop, if another is left.
/// Children get all CPUs back.
pub fn keep_off(cpu: Option<usize>) -> Vec<usize> {
    let all = rt_core::cpu::online_cpus();
    let rest: Vec<usize> = all.iter().copied().filter(|other| Some(*other) != cpu).collect();
    if !rest.is_empty() && rest.len() < all.len() {
        // Best effort: the observer is polite, not necessary to the result.
        let _ = allow(&rest);
    }
    all
}

/// The same program in that role, on all the CPUs that [`keep_off`] found.
pub fn command_on(role: Role, cpus: &[usize]) -> std::io::Result<Command> {
    let mut command = role.command()?;
    let list: Vec<_> = cpus.iter().map(ToString::to_string).collect();
    command.env(CPUS, list.join(","));
    Ok(command)
}

/// Plays the role that the environment asks for; `None`: this is the program itself.
pub fn play() -> Option<ExitCode> {
    let name = std::env::var(ROLE).ok()?;
    let role = Role::ALL.into_iter().find(|role| role.name() == name)?;
    if role == Role::Nothing {
        return Some(ExitCode::SUCCESS);
    }
    // The programs catch SIGHUP and end in order; the others have nothing to put in order.
    let signal = if role == Role::Phantom3 { Signal::HUP } else { Signal::KILL };
    let parent = std::env::var(PARENT).ok().and_then(|pid| pid.parse().ok()).unwrap_or(0);
    if let Err(error) = rt_core::process::die_with_parent(parent, signal.as_raw()) {
        eprintln!("jitter: as {name}: {error}");
        return Some(ExitCode::from(3));
    }
    if let Some(cpus) = std::env::var(CPUS).ok().and_then(|list| rt_core::cpu::parse_cpu_list(&list)) {
        let _ = allow(&cpus);
    }
    Some(match role {
        Role::Phantom3 => phantom3::cli::main(),
        Role::WaitingLoop => waiting_loop::main(),
        Role::Become => become_another(),
        Role::Load => load::main(),
        Role::Nothing => ExitCode::SUCCESS,
    })
}

fn allow(cpus: &[usize]) -> rustix::io::Result<()> {
    let mut set = CpuSet::new();
    cpus.iter().filter(|cpu| **cpu < CpuSet::MAX_CPU).for_each(|cpu| set.set(*cpu));
    rustix::thread::sched_setaffinity(None, &set)
}

/// The request to die with the parent survives this, as long as the program has no special rights by file.
fn become_another() -> ExitCode {
    let mut words = std::env::args_os().skip(1);
    let Some(program) = words.next() else { return ExitCode::from(2) };
    let error = Command::new(&program).args(words).env_remove(ROLE).env_remove(PARENT).exec();
    eprintln!("jitter: cannot start {}: {error}", program.display());
    ExitCode::from(127)
}
