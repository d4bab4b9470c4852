//! A C program, by the header alone: it zeroes the arm, moves the motors of a real driver and stops them in every way.

use crate::service::{check_stopped, setup};
use nalgebra::Vector3;
use shm_abi::frame::DEVICE_NOT_ZEROED;
use shm_abi::handshake::RequestKind;
use shm_abi::{DriverState, FaultReason};
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;
use system_tests::c_program::{HEADERS, compiled};
use system_tests::faults::amplifiers::wait_for;
use system_tests::faults::process::{End, Running};
use system_tests::faults::ring::RingLog;
use system_tests::faults::stand::{CODE_N, Setup, Stand};

/// Force that it commands (N).
const FORCE_N: f64 = 2.0;

/// The program and the driver that it meets.
struct Operator {
    program: PathBuf,
    stand: Stand,
}

impl Operator {
    fn start(&self, arguments: &[&str]) -> Running {
        Running::start(Command::new(&self.program).arg(self.stand.socket()).args(arguments))
    }

    /// Asks for what is granted.
    fn ask(&self, what: &str) {
        let End { status, err, .. } = self.start(&[what]).end();
        assert_eq!((status, err.as_str()), (Some(0), ""), "{what}");
    }

    /// A commander in C whose whole force is in the motors.
    fn push(&self) -> Running {
        let pusher = self.start(&["push", &FORCE_N.to_string()]);
        self.wait_for_force();
        pusher
    }

    fn wait_for_force(&self) {
        wait_for("the whole force in the motors", || {
            let told = self.stand.view().read_latest().map(|frame| frame.devices[0].force_on_user_n_applied);
            let is_whole = |force| (Vector3::from(force) - Vector3::new(0.0, FORCE_N, 0.0)).norm() < CODE_N;
            told.is_some_and(is_whole) && self.stand.amplifiers.are_enabled()
        });
    }
}

#[test]
fn a_c_program_zeroes_the_arm_pushes_and_stops_the_motors_in_every_way() {
    let stand = Stand::start(Setup { zeroing: "ask", ..setup("") });
    let Some(program) =
        compiled("operator", HEADERS, stand.path("driver.sock").parent().expect("a directory"))
    else {
        stand.finish();
        return;
    };
    let mut operator = Operator { program, stand };

    let is_zeroed = |operator: &Operator| {
        operator
            .stand
            .view()
            .read_latest()
            .is_some_and(|frame| frame.devices[0].flags & DEVICE_NOT_ZEROED == 0)
    };
    wait_for("a frame", || operator.stand.view().read_latest().is_some());
    assert!(!is_zeroed(&operator), "nobody has zeroed it");
    wait_for("the zeroed arm", || {
        // It is believed once the arm has been still for long enough, and a refusal is seen in the frames only.
        operator.ask("zero");
        std::thread::sleep(Duration::from_millis(50));
        is_zeroed(&operator)
    });

    let mut pusher = operator.push();
    // To attach with what only asks stops nothing: it is not even sent.
    let stop = (RequestKind::Stop as u64).to_string();
    let End { status, err, .. } = operator.start(&["attach", &stop]).end();
    assert_eq!(status, Some(1), "{err}");
    assert!(err.contains("hands over nothing to attach to, and was not sent; use phantom_stop"), "{err}");
    RingLog::begin(operator.stand.view()).follow_for(operator.stand.view(), 100);
    operator.wait_for_force();

    operator.ask("emergency-stop");
    check_stopped(&operator.stand, FaultReason::EmergencyStop, "an emergency stop from C");
    operator.ask("clear-fault");
    wait_for("the end of the fault", || {
        operator.stand.view().read_latest().is_some_and(|frame| frame.state != DriverState::Fault as u64)
    });
    operator.wait_for_force();

    operator.ask("end-lease");
    wait_for("the end of the lease and of its force", || {
        let frame = operator.stand.view().read_latest();
        frame.is_some_and(|frame| frame.lease == 0 && frame.devices[0].force_on_user_n_applied == [0.0; 3])
    });
    let end = pusher.end();
    assert_eq!((end.status, end.err.as_str()), (Some(0), ""), "its driver is gone for it: {end:?}");
    operator.stand.amplifiers.settle();
    operator.stand.amplifiers.check_off("nobody commands");

    let mut pusher = operator.push();
    operator.ask("stop");
    let end = operator.stand.driver.end();
    assert_eq!(end.status, Some(0), "{end:?}");
    operator.stand.amplifiers.settle();
    operator.stand.amplifiers.check_off("a stop from C");
    assert_eq!(pusher.end().status, Some(0), "the driver is gone");
    // Every value that was ever written was good.
    operator.stand.finish_after_death();
}

/// Whoever allocates holds a lock, and a handler that waits for it waits for the thread that it has interrupted.
#[test]
fn a_c_program_stops_the_motors_in_a_signal_handler_that_interrupts_allocations() {
    /// Each of them at another point of the program. The first handlers are the ones that count: one in ten of them or
    /// more comes while the lock is held.
    const STOPS: &str = "200";
    let stand = Stand::start(setup(""));
    let directory = stand.path("driver.sock").parent().expect("a directory").to_path_buf();
    let Some(handler) = compiled("handler", HEADERS, &directory) else {
        stand.finish();
        return;
    };
    let program = compiled("operator", HEADERS, &directory).expect("there is a compiler");
    let link = stand.path("link.sock");
    std::os::unix::fs::symlink(stand.socket(), &link).expect("a link");
    let operator = Operator { program, stand };

    let mut pusher = operator.push();
    for place in [operator.stand.socket(), link] {
        for what in ["send-stop", "emergency-stop"] {
            let when = format!("{what} in a signal handler at {}", place.display());
            let end = Running::start(Command::new(&handler).arg(&place).args([what, STOPS])).end();
            check_stopped(&operator.stand, FaultReason::EmergencyStop, &when);
            let said = (end.status, end.out.as_str(), end.err.as_str());
            assert_eq!(said, (Some(0), format!("{STOPS} stops, 0 refused\n").as_str(), ""), "{when}");
            // The last stops may still be on their way: it is refused then, or undone.
            wait_for("the end of the fault", || {
                operator.start(&["clear-fault"]).end();
                std::thread::sleep(Duration::from_millis(50));
                operator
                    .stand
                    .view()
                    .read_latest()
                    .is_some_and(|frame| frame.state != DriverState::Fault as u64)
            });
            operator.wait_for_force();
        }
    }
    operator.ask("stop");
    let Operator { mut stand, .. } = operator;
    assert_eq!(stand.driver.end().status, Some(0), "it was asked to end");
    assert_eq!(pusher.end().status, Some(0), "the driver is gone");
    stand.finish_after_death();
}
