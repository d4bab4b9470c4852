//! Output of `io-driver` into something that takes nothing.

use patience::prelude::*;
use shm_abi::FaultReason;
use std::process::Stdio;
use system_tests::driver::{Driver, resting};
use system_tests::faults::process::{self, End, Running};
use system_tests::programs;
use system_tests::workplace::Workplace;

const LOST: &str = "io-driver: cannot write the standard output: No space left on device (os error 28); what was to be \
                    told is lost";

/// Each command line as `io-driver` and as `phantom3 driver` has it, to a full disk.
fn on_a_full_disk(command: &str, driver: &Driver) -> Vec<End> {
    let socket = if command.starts_with("doctor") { "" } else { "--socket \"$1\"" };
    let programs = [(programs::io_driver(), ""), (programs::phantom3(), "driver")];
    let ends = programs.map(|(program, word)| {
        let script = format!("exec \"$0\" {word} {command} {socket} > /dev/full");
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", &script]).arg(program.get_program()).arg(driver.socket());
        Running::start(&mut shell).end()
    });
    ends.into()
}

#[test]
fn what_io_driver_cannot_print_is_told_and_is_a_fault() {
    let driver = Driver::start(&resting("real", 1));
    for command in [
        "status",
        "status --json",
        "status --watch",
        "status --watch --json",
        "clear-fault",
        "doctor",
        "doctor --json",
        "doctor --fix-plan",
    ] {
        for end in on_a_full_disk(command, &driver) {
            assert_eq!(end.status, Some(3), "{command}: {end:?}");
            assert_eq!(end.err.matches(LOST).count(), 1, "{command}: {end:?}");
        }
    }
}

/// Its status says what became of the motors.
#[test]
fn a_stop_whose_words_cannot_be_printed_says_them_on_standard_error() {
    for which in 0..2 {
        let mut driver = Driver::start(&resting("real", 1));
        let stop = on_a_full_disk("emergency-stop", &driver).swap_remove(which);
        assert_eq!(stop.status, Some(0), "{stop:?}");
        assert!(stop.err.contains(LOST) && stop.err.contains("shows the fault and no force"), "{stop:?}");
        let frame = driver.observe().driver.read_latest().expect("frames");
        assert_eq!(frame.fault, FaultReason::EmergencyStop as u64);
        // The second of the two finds no driver any more.
        let end = on_a_full_disk("stop", &driver).swap_remove(0);
        assert_eq!(end.status, Some(0), "{end:?}");
        assert!(end.err.contains(LOST) && end.err.contains("the motors were written zero"), "{end:?}");
        assert_eq!(driver.wait().code(), Some(0));
    }
}

#[test]
fn a_closed_pipe_is_no_fault_of_io_drivers() {
    let mut driver = Driver::start(&resting("real", 1));
    for arguments in
        [&["status"][..], &["status", "--json"], &["status", "--watch"], &["emergency-stop"], &["stop"]]
    {
        let mut command = programs::io_driver();
        command.args(arguments).arg("--socket").arg(driver.socket());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        drop(child.stdout.take());
        let output = child.bounded_output();
        let said = programs::said(&output);
        assert_eq!((said.0, said.2.as_str()), (Some(0), ""), "{arguments:?}");
    }
    assert_eq!(driver.wait().code(), Some(0));
}

#[test]
fn a_fault_that_was_left_is_told_from_one_that_never_was() {
    let driver = Driver::start(&resting("real", 1));
    let clear = || process::io_driver(&["clear-fault"], driver.socket());
    let none = clear();
    assert_eq!((none.status, none.out.as_str()), (Some(0), "there was no fault, and there is none\n"));
    assert_eq!(process::io_driver(&["emergency-stop"], driver.socket()).status, Some(0));
    let cleared = clear();
    assert_eq!(
        (cleared.status, cleared.out.as_str()),
        (Some(0), "fault cleared: an emergency stop was pressed\n")
    );
    assert_eq!(clear().out, none.out);
}

#[test]
fn a_description_that_is_not_there_is_refused_with_the_built_in_names() {
    let place = Workplace::new();
    place.write("driver.toml", "[[device]]\nbackend = \"simulated\"\ndescription = \"premium-3.0\"\n");
    let mut command = place.prepare(programs::io_driver());
    let run = Running::start(command.args(["run", "--config", "driver.toml"])).end();
    let mut command = place.prepare(programs::io_driver());
    let emulate =
        Running::start(command.args(["emulate", "--card", "card", "--description", "premium-3.0"])).end();
    for end in [run, emulate] {
        assert_eq!(end.status, Some(2), "{end:?}");
        let names = ["premium-3.0", "premium-1.5", "wooden-haptics", "ideal"];
        assert!(names.iter().all(|name| end.err.contains(name)), "{end:?}");
    }
}
