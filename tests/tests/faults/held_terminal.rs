//! Somebody holds an application's terminal by Ctrl-S, to read what went by: its force goes with its time and with a
//! signal all the same.

use rustix::process::Signal;
use system_tests::faults::process::Running;
use system_tests::faults::ring::{RingLog, Told};
use system_tests::faults::stand::{Setup, Stand};
use system_tests::faults::terminal::Terminal;

/// An application that presses, and whose terminal takes nothing any more.
fn held(stand: &Stand, seconds: &str) -> (Running, Terminal, RingLog) {
    let terminal = Terminal::open();
    let app = Running::start_saying_to(&mut stand.app_for(seconds), terminal.end());
    let log = stand.wait_for_force();
    terminal.hold();
    (app, terminal, log)
}

fn follow_to_the_end_of_the_lease(log: &mut RingLog, stand: &Stand) {
    log.follow(stand.view(), "the end of the lease and of its force", |told| {
        told.last().is_some_and(|last: &Told| last.lease == 0 && !last.is_pushing())
    });
    log.check_promise(stand.view());
}

#[test]
fn a_run_whose_terminal_is_held_ends_at_its_time() {
    let stand = Stand::start(Setup::new("real"));
    let (mut app, _terminal, mut log) = held(&stand, "4");
    follow_to_the_end_of_the_lease(&mut log, &stand);
    let end = app.end();
    assert_eq!(end.status, Some(0), "{end:?}");
    stand.finish();
}

#[test]
fn a_run_whose_terminal_is_held_ends_by_the_first_signal() {
    let stand = Stand::start(Setup::new("real"));
    for (signal, status) in [(Signal::TERM, 143), (Signal::INT, 130), (Signal::HUP, 129)] {
        let (mut app, _terminal, mut log) = held(&stand, "80000");
        // It has something to say meanwhile.
        log.follow_for(stand.view(), 2000);
        app.signal(signal);
        follow_to_the_end_of_the_lease(&mut log, &stand);
        let end = app.end();
        assert_eq!(end.status, Some(status), "{end:?}");
    }
    stand.finish();
}
