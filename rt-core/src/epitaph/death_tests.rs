//! Real deaths: a child process dies, the parent reads its epitaph and its exit status.

use super::*;
use crate::sys::shared_words;
use crate::test_child;
use nix::sys::memfd::{MFdFlags, memfd_create};
use nix::sys::resource::{Resource, setrlimit};
use patience::prelude::*;
use std::fs::File;
use std::os::fd::AsRawFd;
use std::os::unix::fs::FileExt;
use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;

const TEST: &str = "epitaph::death_tests::a_death_leaves_an_epitaph_and_its_true_exit_status";
const CELL_PATH: &str = "RT_CORE_TEST_EPITAPH";

static TICK: AtomicU64 = AtomicU64::new(77);

#[test]
fn a_death_leaves_an_epitaph_and_its_true_exit_status() {
    if let Some(role) = test_child::role(TEST) {
        die(&role);
    }
    // abort(3): the signal is sent, not raised by the CPU.
    let (status, epitaph) = death_by("abort");
    assert_eq!(status.signal(), Some(libc::SIGABRT));
    assert_eq!(epitaph.unwrap().to_string(), "killed by signal 6 in tick 77: SIGABRT: abort");

    // A signal sent by another process.
    let (status, epitaph) = death_by("raise");
    assert_eq!(status.signal(), Some(libc::SIGFPE));
    assert_eq!(epitaph.unwrap().kind, EpitaphKind::Signal(libc::SIGFPE));

    // A fault, by an instruction that the CPU refuses.
    let (status, epitaph) = death_by("illegal");
    assert_eq!(status.signal(), Some(libc::SIGILL));
    let text = epitaph.unwrap().text;
    assert!(text.starts_with("SIGILL: illegal instruction at address 0x"), "{text}");
}

/// Sent by anybody, by a terminal or for a limit: no fault of the program, but its end all the same.
#[test]
fn whatever_signal_kills_performs_the_last_act_first() {
    use libc::{
        SIGALRM, SIGIO, SIGPROF, SIGPWR, SIGQUIT, SIGSTKFLT, SIGTRAP, SIGUSR1, SIGUSR2, SIGVTALRM, SIGXCPU,
    };
    for signal in
        [SIGQUIT, SIGTRAP, SIGXCPU, SIGALRM, SIGVTALRM, SIGPROF, SIGUSR1, SIGUSR2, SIGIO, SIGPWR, SIGSTKFLT]
    {
        // A shell's background process ignores Ctrl-\, and so do its children.
        if is_ignored(signal) {
            continue;
        }
        let (status, words) = words_after(&["last act ", &signal.to_string()].concat());
        assert_eq!((status.signal(), words[REGISTER].load(Ordering::Relaxed)), (Some(signal), 2048));
        assert_eq!(read(&words).map(|epitaph| epitaph.kind), Some(EpitaphKind::Signal(signal)));
    }
    // The kernel's own, which names no address and does not come back by itself.
    let (status, words) = words_after("last act cpu");
    assert_eq!((status.signal(), words[REGISTER].load(Ordering::Relaxed)), (Some(SIGXCPU), 2048));
    assert_eq!(read(&words).map(|epitaph| epitaph.text), Some("SIGXCPU: limit of CPU time".into()));
}

/// Of this process, as children inherit it, proc(5).
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap().trim();
    u64::from_str_radix(mask, 16).unwrap() >> (signal - 1) & 1 == 1
}

/// The standard library's own check still gets the fault and aborts with its message, after the
/// epitaph said what came first; that the handler ran at all shows it has a stack of its own.
#[test]
fn a_stack_overflow_leaves_an_epitaph_too() {
    let (status, epitaph) = death_by("overflow");
    assert_eq!(status.signal(), Some(libc::SIGABRT));
    assert_eq!(epitaph.unwrap().kind, EpitaphKind::Signal(libc::SIGSEGV));
}

#[test]
fn the_last_act_is_performed_too() {
    let (_, words) = words_after("last act");
    assert_eq!(words[REGISTER].load(Ordering::Relaxed), 2048);
    let (_, words) = words_after("abort");
    assert_eq!(words[REGISTER].load(Ordering::Relaxed), 0, "where nothing is guarded nothing is stored");
}

/// Two cards are gone, one of them before anybody knows, or one while something else kills: the other is switched off, and
/// the last words say why.
#[test]
fn a_register_that_is_gone_keeps_no_other_from_its_safe_value() {
    for role in ["gone cards 2, touched", "gone cards 1, aborted"] {
        let (status, words) = words_after(role);
        assert_eq!(status.signal(), Some(libc::SIGBUS), "{role}");
        assert_eq!(words[REGISTER].load(Ordering::Relaxed), 2048, "{role}");
        let epitaph = read(&words).unwrap();
        assert_eq!(epitaph.kind, EpitaphKind::Signal(libc::SIGBUS), "{role}");
        assert!(epitaph.text.starts_with("SIGBUS: memory that cannot be reached at address 0x"), "{epitaph}");
    }
}

/// Whoever asks twice waits for no orderly end, so the motors have to be off by then.
#[test]
fn a_second_stop_signal_kills_and_performs_the_last_act() {
    let (status, words) = words_after("stop");
    assert_eq!(
        (status.code(), words[REGISTER].load(Ordering::Relaxed)),
        (Some(99), 3000),
        "one is a request"
    );
    let (status, words) = words_after("stop twice");
    assert_eq!((status.signal(), words[REGISTER].load(Ordering::Relaxed)), (Some(libc::SIGTERM), 2048));
}

#[test]
fn a_panic_leaves_place_and_message_and_reaches_the_former_hook() {
    let (status, epitaph) = death_by("panic");
    // The former hook exits with this code.
    assert_eq!(status.code(), Some(55));
    let epitaph = epitaph.unwrap();
    assert_eq!((epitaph.kind, epitaph.tick), (EpitaphKind::Panic, 77));
    assert!(epitaph.text.contains("death_tests.rs:") && epitaph.text.ends_with(": joint 3 is lost"));
}

#[test]
fn being_killed_outright_leaves_none() {
    let (status, epitaph) = death_by("kill");
    assert_eq!((status.signal(), epitaph), (Some(libc::SIGKILL), None));
}

#[test]
fn a_second_set_of_handlers_is_refused() {
    let (status, _) = death_by("twice");
    assert_eq!(status.code(), Some(0));
}

/// The child shares the cell through a memory file that the parent holds.
fn death_by(role: &str) -> (ExitStatus, Option<Epitaph>) {
    let (status, words) = words_after(role);
    (status, read(&words))
}

/// The last of the words, which no short text reaches.
const REGISTER: usize = 31;

fn words_after(role: &str) -> (ExitStatus, EpitaphWords) {
    let file = File::from(memfd_create("epitaph", MFdFlags::MFD_CLOEXEC).unwrap());
    file.set_len(size_of::<EpitaphWords>() as u64).unwrap();
    let path = format!("/proc/{}/fd/{}", std::process::id(), file.as_raw_fd());
    let status = test_child::command(TEST, role).env(CELL_PATH, path).bounded_status().unwrap();
    let mut bytes = [0; size_of::<EpitaphWords>()];
    file.read_exact_at(&mut bytes, 0).unwrap();
    let words = bytes.as_chunks().0.iter().map(|word| AtomicU64::new(u64::from_ne_bytes(*word)));
    let words: Vec<AtomicU64> = words.collect();
    (status, words.try_into().unwrap())
}

fn die(role: &str) -> ! {
    // No core file for a death that is meant.
    setrlimit(Resource::RLIMIT_CORE, 0, 0).unwrap();
    let path = std::env::var(CELL_PATH).unwrap();
    let cell = shared_words::map(&File::options().read(true).write(true).open(path).unwrap());
    match role {
        "panic" => die_by_panic(cell),
        _ if role.starts_with("gone cards") => {
            let cards = [(), ()].map(|()| File::from(memfd_create("card", MFdFlags::MFD_CLOEXEC).unwrap()));
            let registers = cards.each_ref().map(|card| {
                card.set_len(256).unwrap();
                shared_words::low_half(&shared_words::map(card)[0])
            });
            for register in registers.into_iter().chain([shared_words::low_half(&cell[REGISTER])]) {
                crate::last_act::guard(register, 2048).unwrap();
            }
            install_fatal_handlers(cell, &TICK).unwrap();
            let gone = if role.contains('2') { &cards[..] } else { &cards[..1] };
            gone.iter().for_each(|card| card.set_len(0).unwrap());
            if role.ends_with("touched") {
                registers[1].store(3000, Ordering::Relaxed);
            }
        }
        _ if role.starts_with("last act") => {
            crate::last_act::guard(shared_words::low_half(&cell[REGISTER]), 2048).unwrap();
            install_fatal_handlers(cell, &TICK).unwrap();
        }
        "stop" | "stop twice" => die_by_stop_signals(cell, if role == "stop" { 1 } else { 2 }),
        _ => install_fatal_handlers(cell, &TICK).unwrap(),
    }
    match role {
        "raise" => nix::sys::signal::raise(nix::sys::signal::Signal::SIGFPE).unwrap(),
        "illegal" => shared_words::execute_illegal_instruction(),
        "overflow" => assert_ne!(overflow_stack(0), 0),
        "kill" => nix::sys::signal::raise(nix::sys::signal::Signal::SIGKILL).unwrap(),
        "last act cpu" => {
            setrlimit(Resource::RLIMIT_CPU, 1, 20).unwrap();
            let begun = std::time::Instant::now();
            while begun.elapsed() < patience::limit() {
                std::hint::spin_loop();
            }
        }
        _ if role.starts_with("last act ") => {
            let number: i32 = role["last act ".len()..].parse().unwrap();
            nix::sys::signal::raise(number.try_into().unwrap()).unwrap();
        }
        "twice" => std::process::exit(i32::from(install_fatal_handlers(cell, &TICK).is_ok())),
        _ => std::process::abort(),
    }
    std::process::exit(99)
}

fn die_by_stop_signals(cell: &'static EpitaphWords, times: usize) -> ! {
    let register = shared_words::low_half(&cell[REGISTER]);
    register.store(3000, Ordering::Relaxed);
    crate::last_act::guard(register, 2048).unwrap();
    let _stop = crate::signals::StopSignals::install().unwrap();
    for _ in 0..times {
        nix::sys::signal::raise(nix::sys::signal::Signal::SIGTERM).unwrap();
        std::thread::sleep(crate::signals::SAME_REQUEST);
    }
    std::process::exit(99)
}

fn die_by_panic(cell: &'static EpitaphWords) {
    std::panic::set_hook(Box::new(|_| std::process::exit(55)));
    install_panic_hook(cell, &TICK);
    panic!("joint {} is lost", std::hint::black_box(3));
}

#[expect(unconditional_recursion, reason = "it is meant to die")]
fn overflow_stack(depth: u64) -> u64 {
    let frame = std::hint::black_box([depth; 512]);
    overflow_stack(depth + 1) + std::hint::black_box(frame)[7]
}
