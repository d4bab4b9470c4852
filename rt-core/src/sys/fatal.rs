//! Handlers for the signals that kill: last act, last words, then the death that was due.
//!
//! Problem: a segmentation fault in the driver must still zero the motors and say why, yet the exit
//! status, the core dump and the message of a debugger or of Rust's own stack-overflow check must
//! stay what they would have been.
//! Model: the handler performs the last act ([`crate::last_act`]), writes the epitaph and then steps aside. A fault
//! that the CPU raised is repeated under the former action, so that action sees the true address; a
//! signal that was sent (`abort`, `kill`, a terminal's Ctrl-\, a limit of CPU time) is raised again under the default
//! action. Signals that do not tell of a fault are left to whoever ignores or handles them already.
//! A register that faults within the last act brings the handler up once more: it gives that one up, performs the rest,
//! writes the epitaph, and the fault repeated kills. Its stack has room for one such fault beside the first signal.
//! Invariants: async-signal-safe: no allocation, no lock, no I/O. Runs on the alternate stack that
//! the standard library gives every thread it starts, so that a stack overflow is handled too.
//! Two threads that fault at once both come here; the first one's epitaph stays.
//! Cost: a few hundred nanoseconds besides the last act.

use crate::call_names::ForbiddenCall;
use crate::epitaph::{EpitaphKind, EpitaphRef, EpitaphWords, FixedText};
use std::fmt::Write as _;
use std::io;
use std::mem::MaybeUninit;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Those whose default action is to kill with a core dump and that mean "this program is broken".
const FAULTS: usize = 6;
/// Those first, then others whose default action is to kill, and which nobody here has a use for.
const FATAL_SIGNALS: [(libc::c_int, &str); FAULTS + 11] = [
    (libc::SIGSEGV, "SIGSEGV: invalid memory reference"),
    (libc::SIGBUS, "SIGBUS: memory that cannot be reached"),
    (libc::SIGILL, "SIGILL: illegal instruction"),
    (libc::SIGFPE, "SIGFPE: arithmetic fault"),
    (libc::SIGABRT, "SIGABRT: abort"),
    (libc::SIGSYS, "SIGSYS: forbidden system call"),
    (libc::SIGQUIT, "SIGQUIT: asked to quit at once"),
    (libc::SIGTRAP, "SIGTRAP: breakpoint without debugger"),
    (libc::SIGXCPU, "SIGXCPU: limit of CPU time"),
    (libc::SIGALRM, "SIGALRM: alarm"),
    (libc::SIGVTALRM, "SIGVTALRM: alarm of CPU time"),
    (libc::SIGPROF, "SIGPROF: alarm of a profiler"),
    (libc::SIGUSR1, "SIGUSR1"),
    (libc::SIGUSR2, "SIGUSR2"),
    (libc::SIGIO, "SIGIO: input or output"),
    (libc::SIGPWR, "SIGPWR: power failure"),
    (libc::SIGSTKFLT, "SIGSTKFLT: sent by somebody"),
];

/// What the handlers need; set once, before the first handler is installed.
struct Fatal {
    cell: &'static EpitaphWords,
    tick: &'static AtomicU64,
    former: [libc::sigaction; FATAL_SIGNALS.len()],
}

static FATAL: OnceLock<Fatal> = OnceLock::new();

/// Lets SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT, SIGSYS, and others that would kill now, write an epitaph before they do.
///
/// `tick` is read when it happens. Exit status and core dump stay what they would have been.
///
/// # Errors
/// `AlreadyExists` on a second call in one process; the first call's cell stays in force.
pub fn install_fatal_handlers(cell: &'static EpitaphWords, tick: &'static AtomicU64) -> io::Result<()> {
    let mut former = [default_action(); FATAL_SIGNALS.len()];
    for ((signal, _), former) in FATAL_SIGNALS.iter().zip(&mut former) {
        *former = current_action(*signal)?;
    }
    let set = FATAL.set(Fatal { cell, tick, former });
    set.map_err(|_| io::Error::new(io::ErrorKind::AlreadyExists, "fatal handlers are already installed"))?;
    let ours = FATAL_SIGNALS
        .iter()
        .zip(&former)
        .enumerate()
        .filter(|(index, (_, former))| *index < FAULTS || former.sa_sigaction == libc::SIG_DFL);
    ours.map(|(_, ((signal, _), _))| *signal).try_for_each(|signal| set_action(signal, &handler_action()))
}

/// An instruction that could not be done, which is tried again when the handler returns.
fn is_of_an_instruction(signal: libc::c_int) -> bool {
    matches!(signal, libc::SIGSEGV | libc::SIGBUS | libc::SIGILL | libc::SIGFPE)
}

extern "C" fn on_fatal(signal: libc::c_int, info: *mut libc::siginfo_t, _context: *mut libc::c_void) {
    let Some(fatal) = FATAL.get() else { return };
    // SAFETY: with SA_SIGINFO the kernel passes a valid record that lives as long as the handler.
    let info = unsafe { &*info };
    // si_code is positive when the kernel raised the signal, sigaction(2): for what the thread did, a terminal or a limit.
    let raised_by_kernel = info.si_code > 0;
    if raised_by_kernel && matches!(signal, libc::SIGBUS | libc::SIGSEGV) {
        // SAFETY: a fault's record carries an address.
        crate::last_act::give_up(unsafe { info.si_addr() }.addr());
    }
    crate::last_act::perform();
    let tells_more = is_of_an_instruction(signal) || signal == libc::SIGSYS;
    fatal.write_epitaph(signal, (raised_by_kernel && tells_more).then_some(info));
    // A fault happens again when the handler returns. A forbidden system call does not: the thread would go on
    // behind it.
    fatal.step_aside(signal, raised_by_kernel && is_of_an_instruction(signal));
}

impl Fatal {
    fn write_epitaph(&self, signal: libc::c_int, fault: Option<&libc::siginfo_t>) {
        let mut text = FixedText::new();
        let name =
            FATAL_SIGNALS.iter().find(|(number, _)| *number == signal).map_or("signal", |(_, name)| name);
        let _ = text.write_str(name);
        if let Some(info) = fault.filter(|_| signal == libc::SIGSYS) {
            let _ = write!(text, " {}", forbidden_call(info));
        } else if let Some(info) = fault {
            // SAFETY: a fault's record carries an address.
            let address = unsafe { info.si_addr() };
            let _ = write!(text, " at address {:#x}", address.addr());
        }
        let tick = self.tick.load(Ordering::Relaxed);
        EpitaphRef::new(self.cell).write(EpitaphKind::Signal(signal), tick, text.as_str());
    }

    /// After this the handler returns: a fault happens again under the former action, a raised
    /// signal kills at once, or as soon as it is not blocked any more.
    fn step_aside(&self, signal: libc::c_int, raised_by_fault: bool) {
        let former = FATAL_SIGNALS.iter().position(|(number, _)| *number == signal).map(|i| self.former[i]);
        let next = if raised_by_fault { former } else { None };
        let _ = set_action(signal, &next.unwrap_or_else(default_action));
        if !raised_by_fault {
            // SAFETY: takes no pointer; raise(3) is async-signal-safe.
            unsafe { libc::raise(signal) };
        }
    }
}

/// The part of a siginfo that a system call filter fills in (sigaction(2): si_call_addr, si_syscall, si_arch).
#[repr(C)]
struct CallInfo {
    signal: libc::c_int,
    errno: libc::c_int,
    code: libc::c_int,
    address: *const libc::c_void,
    number: libc::c_int,
    architecture: libc::c_uint,
}

const _: () = assert!(size_of::<CallInfo>() <= size_of::<libc::siginfo_t>());
const _: () = assert!(align_of::<CallInfo>() <= align_of::<libc::siginfo_t>());

/// The call that a SIGSYS raised by the kernel is about.
fn forbidden_call(info: &libc::siginfo_t) -> ForbiddenCall {
    // SAFETY: the record of a SIGSYS from the kernel has this layout; size and alignment are asserted above.
    let call = unsafe { &*(&raw const *info).cast::<CallInfo>() };
    ForbiddenCall { number: call.number, architecture: call.architecture }
}

/// Other signals wait: a stop request must not interrupt the last act. Only a register that cannot be reached does.
fn handler_action() -> libc::sigaction {
    let mut action = default_action();
    action.sa_sigaction = on_fatal as *const () as libc::sighandler_t;
    action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK | libc::SA_NODEFER;
    // SAFETY: the mask is ours and valid.
    unsafe { libc::sigfillset(&mut action.sa_mask) };
    for fault in [libc::SIGBUS, libc::SIGSEGV] {
        // SAFETY: as above.
        unsafe { libc::sigdelset(&mut action.sa_mask, fault) };
    }
    action
}

fn default_action() -> libc::sigaction {
    // SAFETY: all zero is a valid sigaction: SIG_DFL, empty mask, no flags.
    unsafe { MaybeUninit::zeroed().assume_init() }
}

fn current_action(signal: libc::c_int) -> io::Result<libc::sigaction> {
    let mut action = default_action();
    // SAFETY: a null new action only asks; `action` is ours.
    let result = unsafe { libc::sigaction(signal, std::ptr::null(), &mut action) };
    if result == 0 { Ok(action) } else { Err(io::Error::last_os_error()) }
}

fn set_action(signal: libc::c_int, action: &libc::sigaction) -> io::Result<()> {
    // SAFETY: `action` is valid: our async-signal-safe handler, the default, or what was there before.
    let result = unsafe { libc::sigaction(signal, action, std::ptr::null_mut()) };
    if result == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}
