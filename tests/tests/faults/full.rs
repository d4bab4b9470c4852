//! No room: for the card, for the shared segments, for a lease's segment, for the recording, for a socket.

use rustix::process::{Pid, Resource, Rlimit, Signal, prlimit};
use std::path::Path;
use system_tests::driver::resting;
use system_tests::faults::amplifiers::{emulate, place_for_cards, wait_for};
use system_tests::faults::process::{End, Running};
use system_tests::faults::ring::RingLog;
use system_tests::faults::scarcity::{limited, on_small_disk};
use system_tests::faults::stand::{Setup, Stand};
use system_tests::programs;

#[test]
fn a_card_for_which_there_is_no_room_is_refused_and_leaves_no_file() {
    let place = place_for_cards();
    let file = place.path().join("card");
    // 100 blocks of 512 bytes; the card has more than 2 MB.
    let end = Running::start(&mut limited(&emulate(&file), "-f 100")).end();
    check_refused(&end, "cannot make room for the emulated card", "File too large");
    assert!(!file.exists());
    if let Some(mut command) = on_small_disk(&emulate(&file), place.path(), "size=1m") {
        let end = Running::start(&mut command).end();
        check_refused(&end, "cannot make room for the emulated card", "No space left on device");
    }
    if let Some(mut command) =
        on_small_disk(&emulate(Path::new("/dev/shm/card")), Path::new("/dev/shm"), "size=1m")
    {
        let end = Running::start(&mut command).end();
        check_refused(
            &end,
            "cannot make room for the emulated card /dev/shm/card",
            "No space left on device",
        );
    }
}

fn check_refused(end: &End, what: &str, why: &str) {
    assert_eq!((end.status, end.out.as_str()), (Some(2), ""), "{end:?}");
    assert!(end.err.contains(what) && end.err.contains(why), "{end:?}");
    assert_eq!(end.err.lines().count(), 1, "{end:?}");
}

/// A limit of files limits segments too, which are files without a name.
#[test]
fn a_driver_without_room_for_its_segment_is_refused_before_it_touches_anything() {
    let mut stand = Stand::start(Setup::new("real"));
    stand.stop_driver();
    let written = stand.amplifiers.written();
    let end = Running::start(&mut limited(&stand.driver_command(), "-f 100")).end();
    check_refused(&end, "a shared segment", "File too large");
    assert!(!stand.socket().exists());
    stand.amplifiers.check_off("after a driver that could not start");
    let more = stand.amplifiers.written() - written;
    assert!(more <= 4, "{more} values, all of them zero");
    stand.restart_driver();
    let app = stand.start_app();
    stand.wait_for_force();
    drop(app);
    stand.finish();
}

/// A full /dev/shm does not matter to programs whose segments have no name.
#[test]
fn a_driver_runs_where_the_usual_place_for_shared_memory_is_full() {
    let place = tempfile::tempdir().expect("a directory");
    let (config, socket) = (place.path().join("driver.toml"), place.path().join("driver.sock"));
    std::fs::write(&config, resting("real", 1)).expect("the configuration is written");
    let mut command = programs::io_driver();
    command.args(["run", "--quiet", "--config"]).arg(&config).arg("--socket").arg(&socket);
    let Some(mut command) = on_small_disk(&command, Path::new("/dev/shm"), "size=4k,nr_inodes=1") else {
        return;
    };
    let mut driver = Running::start(&mut command);
    wait_for("the driver", || {
        driver.must_run();
        shm_abi::client::command(&socket, "test").is_ok()
    });
    shm_abi::client::stop(&socket, "test").expect("it is told");
    assert_eq!(driver.end().status, Some(0));
}

fn limit_files(process: u32, bytes: Option<u64>) {
    let pid = Pid::from_raw(process.cast_signed());
    prlimit(pid, Resource::Fsize, Rlimit { current: bytes, maximum: None }).expect("our own child");
}

/// The driver lives, says so, and grants the next one.
#[test]
fn an_app_for_whose_lease_there_is_no_room_is_told_and_the_driver_goes_on() {
    let stand = Stand::start(Setup::new("real"));
    limit_files(stand.driver.id(), Some(100));
    let end = Running::start(&mut stand.app()).end();
    assert_eq!(end.status, Some(2), "{end:?}");
    assert!(end.err.contains("the driver refused"), "{end:?}");
    RingLog::begin(stand.view()).follow_for(stand.view(), 50);
    limit_files(stand.driver.id(), None);
    let app = stand.start_app();
    stand.wait_for_force();
    drop(app);
    stand.finish();
}

/// The application says so and goes on, with a recording that can be read; once it ends, its force goes as that of any other.
#[test]
fn a_recording_that_fills_its_disk_in_the_middle_of_a_force_ends_neither_the_app_nor_the_driver() {
    let mut stand = Stand::start(Setup::new("real"));
    let mut app = stand.app();
    app.args(["--record", "out.csv"]);
    // 500 blocks of 512 bytes; a second of rows is as much.
    let mut app = Running::start(&mut limited(&app, "-f 500"));
    stand.wait_for_force();
    app.hear("File too large");
    stand.wait_for_force();
    app.must_run();
    app.signal(Signal::INT);
    let end = app.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("File too large"), "{end:?}");
    let recording = system_tests::recording::Table::read(&stand.path("out.csv"));
    assert!(!recording.is_empty());
    let mut log = RingLog::begin(stand.view());
    log.follow(stand.view(), "the end of the force", |told| {
        told.last().is_some_and(|last| last.lease == 0 && !last.is_pushing())
    });
    log.check_promise(stand.view());
    stand.driver.must_run();
    let app = stand.start_app();
    stand.wait_for_force();
    drop(app);
    stand.finish();
}

#[test]
fn an_app_whose_runtime_directory_is_full_finds_another_place_for_its_drivers_socket() {
    let table = system_tests::faults::press::Table::new();
    let runtime = tempfile::tempdir().expect("a directory");
    let mut app = table.app("real");
    app.args(["--seconds", "1"]).env("XDG_RUNTIME_DIR", runtime.path()).env("TMPDIR", runtime.path());
    let Some(mut app) = on_small_disk(&app, runtime.path(), "nr_inodes=1") else { return };
    let end = Running::start(&mut app).end();
    assert_eq!((end.status, end.err.as_str()), (Some(0), ""), "{end:?}");
    assert!(end.out.contains("our own child"), "{end:?}");
}
