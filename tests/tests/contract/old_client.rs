//! A commander in C, built with the headers as they were released with an older minor version, moves the motors
//! of a real driver process of today.

use patience::prelude::*;
use std::process::{Child, Command};
use system_tests::c_program::compiled;
use system_tests::driver::Driver;
use system_tests::faults::press;
use system_tests::faults::ring::RingLog;

/// As they were released.
const HEADERS_OF_1_0: &str = "shm-abi/tests/frozen/1.0";

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
    let Some(program) = compiled("pusher", HEADERS_OF_1_0, directory.path()) else { return };
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
