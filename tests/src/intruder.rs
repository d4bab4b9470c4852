//! Somebody inside the driver's process who does what the driver itself never does.
//!
//! Model: a thread that starts before the driver, as rightless as the driver's own, and waits for SIGUSR1: the
//! test decides when, for instance while motors push. [`CALL_VARIABLE`] says what it does then.

use patience::prelude::*;
use rt_core::privileges::{Keep, reduce_thread};
use std::os::unix::process::CommandExt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Environment variable that names the forbidden deed; without it there is no intruder.
pub const CALL_VARIABLE: &str = "PHANTOM3_TEST_FORBIDDEN_CALL";

/// The deeds: name in the variable, name of the system call that ends it.
pub const DEEDS: [(&str, &str); 4] = [
    ("open a file", "openat"),
    ("make a socket", "socket"),
    ("execute a program", "execve"),
    ("signal another process", "kill"),
];

/// Starts the intruder if the environment asks for one.
pub fn start_if_asked() {
    let Ok(deed) = std::env::var(CALL_VARIABLE) else { return };
    let told = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&told))
        .expect("a signal to wait for");
    // The environment is read here: the thread may do little.
    let limit = patience::limit();
    let (ready, is_ready) = std::sync::mpsc::channel();
    let body = move || {
        reduce_thread(Keep::Nothing);
        let _ = ready.send(());
        let begun = Instant::now();
        while !told.load(Ordering::Relaxed) {
            assert!(begun.elapsed() < limit, "nobody asks for the deed");
            std::thread::sleep(Duration::from_millis(1));
        }
        commit(&deed);
    };
    std::thread::Builder::new().name("intruder".into()).spawn(body).expect("a thread");
    is_ready.bounded_recv().expect("it lives");
}

fn commit(deed: &str) {
    match deed {
        "open a file" => drop(std::fs::File::open("/etc/passwd")),
        "make a socket" => drop(std::net::UdpSocket::bind(("127.0.0.1", 0))),
        // The prohibition stands before the kernel looks whether there is such a program.
        "execute a program" => drop(std::process::Command::new("/nowhere").exec()),
        // Refused, which makes the standard library panic.
        "start a thread" => drop(std::thread::spawn(|| ())),
        "start a process" => drop(std::process::Command::new("/bin/true").spawn()),
        "signal another process" => drop(rustix::process::test_kill_process(rustix::process::Pid::INIT)),
        "overflow the stack" => drop(std::hint::black_box(overflow(0))),
        "abort" => std::process::abort(),
        other => panic!("an intruder who is told to {other}"),
    }
}

#[expect(unconditional_recursion, reason = "it is meant to die")]
fn overflow(depth: u64) -> u64 {
    let frame = std::hint::black_box([depth; 512]);
    overflow(depth + 1) + std::hint::black_box(frame)[7]
}
