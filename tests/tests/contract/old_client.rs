//! A commander in C, built with the headers as they were released with an older minor version, moves the motors
//! of a real driver process of today.

use patience::prelude::*;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use system_tests::driver::Driver;
use system_tests::faults::press;
use system_tests::faults::ring::RingLog;

/// The program, compiled with the headers of 1.0; `None` (and a line why) without a C compiler.
fn pusher(directory: &Path) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = directory.join("pusher");
    let named = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let mut words = named.split_whitespace();
    let mut compiler = Command::new(words.next().expect("CC is empty"));
    compiler.args(words).args(["-std=c11", "-O2"]);
    compiler.arg("-I").arg(root.join("../shm-abi/tests/frozen/1.0"));
    compiler.arg(root.join("tests/c/pusher.c")).arg("-o").arg(&program);
    match compiler.bounded_output() {
        Err(error) => {
            println!("skipped: no C compiler: {named}: {error}");
            None
        }
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            Some(program)
        }
    }
}

/// Killed when dropped.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        self.0.end();
    }
}

#[test]
fn the_motors_obey_a_commander_built_with_the_headers_of_1_0_and_stop_when_it_dies() {
    let directory = tempfile::tempdir().expect("a directory");
    let Some(program) = pusher(directory.path()) else { return };
    let driver = Driver::start(&press::config("real"));
    let observer = driver.observe();
    let mut log = RingLog::begin(&observer.driver);
    let commander = Running(Command::new(program).arg(driver.socket()).spawn().expect("the program"));
    log.follow(&observer.driver, "the old commander's force", |told| {
        told.iter().filter(|told| told.first_applied_n == [0.0, 3.0, 0.0]).count() > 200
    });
    drop(commander);
    log.follow(&observer.driver, "the end of the lease and of its force", |told| {
        told.last().is_some_and(|last| last.lease == 0 && !last.is_pushing())
    });
    log.check_promise(&observer.driver);
}
