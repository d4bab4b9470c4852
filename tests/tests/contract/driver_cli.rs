//! `io-driver` by itself: refusing to start, being watched, and not answering.

use patience::prelude::*;
use rustix::process::{Pid, Signal, kill_process};
use shm_abi::{DriverState, FaultReason, stop_socket};
use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use system_tests::driver::{Driver, HANG, resting};
use system_tests::faults::process::{self, End, Running};
use system_tests::programs::io_driver;
use system_tests::workplace::Workplace;

#[test]
fn strict_refuses_to_start_without_a_guarantee_and_leaves_nothing_behind() {
    let directory = tempfile::tempdir().expect("a directory");
    let (config, socket) = (directory.path().join("driver.toml"), directory.path().join("s/driver.sock"));
    // No machine has this CPU, so the guarantee is missing whatever else was obtained.
    std::fs::write(&config, "[real_time]\ncpu = 4095\npriority = 0\n[[device]]\nbackend = \"ideal\"\n")
        .expect("written");
    let mut command = io_driver();
    command.args(["run", "--strict", "--config"]).arg(&config).arg("--socket").arg(&socket);
    // One that starts in spite of it is stopped by its time limit.
    let End { status, out, err, .. } = Running::start(&mut command).end();
    assert_eq!((status, out.as_str()), (Some(2), ""), "{err}");
    assert!(err.starts_with("io-driver: --strict: not every real-time guarantee was obtained"), "{err}");
    assert!(err.contains("MISSING   cpu: wanted 4095"), "{err}");
    assert!(!socket.exists() && !socket.parent().expect("a directory").exists());
}

#[test]
fn status_is_json_whatever_a_device_is_called() {
    const NAME: &str = "a\u{202e}b";
    let driver = Driver::start(&format!(
        "[real_time]\npriority = 0\nlock_memory = false\n[[device]]\nname = \"{NAME}\"\nbackend = \"ideal\"\n"
    ));
    let End { status, out, err, .. } = process::io_driver(&["status", "--json"], driver.socket());
    assert_eq!((status, err.as_str()), (Some(0), ""), "{out}");
    let told: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!(told["devices"][0]["name"].as_str(), Some(NAME));
    assert!(!out.contains('\u{202e}'), "{out:?}");
}

/// As its parent gives it: what is no configuration must not fill the memory.
#[test]
fn a_configuration_from_standard_input_that_never_ends_is_refused() {
    let mut command = Command::new("sh");
    command.args(["-c", "exec \"$0\" run --config - < /dev/zero"]).arg(io_driver().get_program());
    let End { status, out, err, .. } = Running::start(&mut command).end();
    assert_eq!((status, out.as_str()), (Some(2), ""), "{err}");
    assert!(err.contains("<standard input>") && err.contains("larger than 65536 bytes"), "{err}");
}

#[test]
fn watching_prints_a_line_a_second_until_the_driver_ends_and_says_how_it_ended() {
    for json in [false, true] {
        let mut driver = Driver::start(&resting("real", 2));
        let observer = driver.observe();
        let is_idle = |frame: shm_abi::Frame| frame.state == DriverState::Idle as u64;
        patience::until("the first tick", || observer.driver.read_latest().is_some_and(is_idle));
        let mut watch = io_driver();
        watch.args(["status", "--watch", "--socket"]).arg(driver.socket());
        if json {
            watch.arg("--json");
        }
        let mut watch = Running::start(&mut watch);
        let heard = watch.take_lines();
        let next = || heard.recv_timeout(HANG).expect("a line in time");
        let ticks: Vec<u64> = (0..2).map(|_| tick_of(&next(), json)).collect();
        assert!(ticks[1] > ticks[0], "{ticks:?}");
        let stop = process::io_driver(&["stop"], driver.socket());
        assert_eq!(stop.status, Some(0), "{stop:?}");
        assert_eq!(driver.wait().code(), Some(0));
        let last = std::iter::from_fn(|| heard.recv_timeout(HANG).ok()).last().expect("a last line");
        assert!(last.starts_with("the driver has ended: stopped in tick"), "{last}");
        let end = watch.end();
        assert_eq!(end.status, Some(0), "{end:?}");
    }
}

fn tick_of(line: &str, json: bool) -> u64 {
    if json {
        let status: serde_json::Value = serde_json::from_str(line).expect("an object in each line");
        assert_eq!(status["state"], "idle");
        assert_eq!(status["devices"].as_array().map(Vec::len), Some(2));
        return status["tick"].as_u64().expect("a tick");
    }
    let words: Vec<&str> = line.split(' ').collect();
    assert_eq!((words[0], words[2]), ("tick", "idle"), "{line}");
    words[1].parse().expect("a number")
}

/// An administrator may: these tests and the driver have one user.
fn asked(driver: &Driver, command: &str) -> End {
    process::io_driver(&[command], driver.socket())
}

fn signal(driver: &Driver, signal: Signal) {
    let pid = Pid::from_child(&driver.child);
    kill_process(pid, signal).expect("our own child");
}

/// The words name the time after which they come, from the constant that it is. They come long before the five seconds
/// for which it is looked on: half of them are for a busy machine.
fn told_in_time(driver: &Driver, command: &str, words: &str) -> End {
    let begun = Instant::now();
    let mut asking = Running::start(io_driver().arg(command).arg("--socket").arg(driver.socket()));
    asking.hear(words);
    assert!(begun.elapsed() < Duration::from_millis(2500), "{command}: {:?}", begun.elapsed());
    asking.end()
}

#[test]
fn a_driver_that_is_stopped_is_not_taken_for_one_that_obeyed() {
    let mut driver = Driver::start(&resting("real", 1));
    signal(&driver, Signal::STOP);
    let stop = told_in_time(&driver, "stop", "it has not stopped within 100 ms: the motors may still be on");
    assert_eq!(stop.status, Some(3), "{stop:?}");
    let words = ["does not answer", "io-driver emergency-stop"];
    assert!(words.iter().all(|words| stop.err.contains(words)), "{stop:?}");
    let uncertain =
        "the emergency stop is not confirmed within 100 ms: the motors may still be on; cut their power";
    let emergency = told_in_time(&driver, "emergency-stop", uncertain);
    assert_eq!(emergency.status, Some(3), "{emergency:?}");
    assert!(emergency.err.contains("no frame has shown it"), "{emergency:?}");
    let zero = told_in_time(&driver, "zero", "the driver has not answered within 100 ms; nothing is zeroed");
    assert_eq!(zero.status, Some(3), "{zero:?}");
    assert!(zero.err.contains("does not answer within 2 s"), "{zero:?}");
    // What was asked while it stood still is done once it goes on.
    signal(&driver, Signal::CONT);
    assert_eq!(driver.wait().code(), Some(0));
}

#[test]
fn a_driver_that_is_killed_while_it_is_asked_to_stop_has_not_written_zero() {
    let driver = Driver::start(&resting("real", 1));
    signal(&driver, Signal::STOP);
    let mut asking = Running::start(io_driver().arg("stop").arg("--socket").arg(driver.socket()));
    asking.hear("it has not stopped within 100 ms: the motors may still be on");
    signal(&driver, Signal::KILL);
    let stop = asking.end();
    assert_eq!(stop.status, Some(3), "{stop:?}");
    assert!(stop.err.contains("it ended without last words: the motors may still be on"), "{stop:?}");
    assert!(!stop.err.contains("start it again"), "{stop:?}");
}

/// Who asked looked at arms that stood still; somebody else continues the driver later.
#[test]
fn a_fault_is_not_left_because_somebody_asked_long_ago() {
    let driver = Driver::start(&resting("real", 1));
    let stop = asked(&driver, "emergency-stop");
    assert_eq!(stop.status, Some(0), "{stop:?}");
    let observer = driver.observe();
    signal(&driver, Signal::STOP);
    let late = asked(&driver, "clear-fault");
    assert_eq!(late.status, Some(3), "{late:?}");
    let before = observer.driver.latest_tick().expect("frames");
    signal(&driver, Signal::CONT);
    // The service hears the request within its next turn, which is 20 ms.
    let settled = || observer.driver.read_latest().filter(|frame| frame.tick > before + 500);
    let frame = wait_for(settled);
    assert_eq!(frame.fault, FaultReason::EmergencyStop as u64, "{frame:?}");
    let clear = asked(&driver, "clear-fault");
    assert_eq!(clear.status, Some(0), "{clear:?}");
}

/// A command is short of memory just when it is answered.
#[test]
fn a_request_whose_answer_is_lost_may_have_been_done_and_is_told_so() {
    let driver = Driver::start(&resting("real", 1));
    let stop = asked(&driver, "emergency-stop");
    assert_eq!(stop.status, Some(0), "{stop:?}");
    let mut clear = Command::new("strace");
    // The first answer gives a place to look from.
    clear.args(["-o", "/dev/null", "-e", "trace=recvmsg", "-e", "inject=recvmsg:error=ENOMEM:when=2"]);
    clear.arg(io_driver().get_program()).args(["clear-fault", "--socket"]).arg(driver.socket());
    if !Command::new("strace").args(["-o", "/dev/null", "true"]).bounded_status().is_ok_and(|s| s.success()) {
        return eprintln!("skipped: there is no strace that may trace here");
    }
    let clear = Running::start(&mut clear).end();
    assert_eq!(clear.status, Some(3), "{clear:?}");
    assert!(clear.err.contains("may have heard it, but its answer cannot be read"), "{clear:?}");
    let observer = driver.observe();
    wait_for(|| observer.driver.read_latest().filter(|frame| frame.fault == FaultReason::None as u64));
}

#[test]
fn a_run_at_a_driver_in_its_fault_state_names_the_fault_and_the_command_that_leaves_it() {
    let driver = Driver::start(&resting("real", 1));
    let stop = asked(&driver, "emergency-stop");
    assert_eq!(stop.status, Some(0), "{stop:?}");
    let place = Workplace::new();
    place.write("scene.toml", "[[finger]]\n");
    for name in ["old.csv", "old.jsonl"] {
        place.write(name, "earlier");
    }
    let outputs = ["--record", "old.csv", "--events", "old.jsonl"];
    let run = ["run", "scene.toml", "--seconds", "1", "--attach"].map(OsStr::new);
    let run = run.into_iter().chain([driver.socket().as_os_str()]).chain(outputs.map(OsStr::new));
    let said = place.run(run);
    assert_eq!(said.status, Some(3), "{said:?}");
    let command = format!("`io-driver clear-fault --socket {}`", driver.socket().display());
    for words in ["an emergency stop was pressed; the motors are off; find the cause, then", &command] {
        assert!(said.err.contains(words), "{words}: {}", said.err);
    }
    assert_eq!(said.out, "", "there is nothing to report");
    for name in ["old.csv", "old.jsonl"] {
        assert_eq!(std::fs::read(place.path(name)).expect("it is there"), b"earlier", "{name}");
    }
}

#[test]
fn a_run_whose_recording_nobody_reads_tells_at_once_why_it_ended() {
    let driver = Driver::start(&resting("real", 1));
    let place = Workplace::new();
    place.write("scene.toml", "[[finger]]\n");
    let words = place.path("words.txt");
    let mut run = place.phantom3();
    run.args(["run", "scene.toml", "--seconds", "600", "--record", "-", "--events", "e.jsonl", "--attach"])
        .arg(driver.socket());
    run.stdout(Stdio::piped()).stderr(std::fs::File::create(&words).expect("a file"));
    let mut run = run.spawn().expect("it starts");
    let observer = driver.observe();
    // A pipe holds 64 KiB, which is a fifth of that.
    wait_for(|| observer.driver.read_latest().filter(|frame| frame.run_tick > 1000));
    let stop = asked(&driver, "emergency-stop");
    assert_eq!(stop.status, Some(0), "{stop:?}");
    let told = || std::fs::read_to_string(&words).expect("its words");
    patience::until("the reason", || told().contains("an emergency stop was pressed"));
    assert!(run.try_wait().expect("our child").is_none(), "it waits for its reader: {}", told());
    // Which the events do not.
    let events = || std::fs::read_to_string(place.path("e.jsonl")).expect("events");
    patience::until("the event", || events().contains("\"fault\""));
    assert!(run.try_wait().expect("our child").is_none(), "it waits for its reader still");
    drop(run.stdout.take());
    assert_eq!(run.bounded_wait().code(), Some(3), "{}", told());
}

/// Clocks of time namespaces differ by as much as somebody says.
#[test]
fn a_driver_in_another_time_namespace_is_told_as_such_and_has_no_ages() {
    let driver = Driver::start(&resting("real", 1));
    let place = Workplace::new();
    place.write("scene.toml", "[[finger]]\n");
    for shift in ["100000", "-1000"] {
        let apart = |program: &Command| {
            let mut apart = Command::new("unshare");
            apart.args(["--time", "--monotonic", shift]).arg(program.get_program());
            apart
        };
        if !apart(&Command::new("true")).bounded_status().is_ok_and(|status| status.success()) {
            println!("skipped: no time namespace can be had here");
            return;
        }
        let mut status = apart(&io_driver());
        status.args(["status", "--json", "--socket"]).arg(driver.socket());
        let end = Running::start(&mut status).end();
        assert_eq!(end.status, Some(0), "{end:?}");
        let told: serde_json::Value = serde_json::from_str(&end.out).expect("JSON");
        assert!(told["silent_for_s"].is_null() && told["other_time_namespace"] == true, "{}", end.out);
        let mut status = apart(&io_driver());
        status.args(["status", "--socket"]).arg(driver.socket());
        let end = Running::start(&mut status).end();
        assert!(end.out.contains("the driver lives in another time namespace"), "{end:?}");
        let mut run = place.prepare(apart(&place.phantom3()));
        run.args(["run", "scene.toml", "--seconds", "1", "--attach"]).arg(driver.socket());
        let end = Running::start(&mut run).end();
        assert_eq!((end.status, end.out.as_str()), (Some(2), ""), "{end:?}");
        assert!(end.err.contains("lives in another time namespace, and its clock differs"), "{end:?}");
    }
    let told = asked(&driver, "status");
    assert!(!told.out.contains("time namespace"), "{told:?}");
}

/// Shells and scripts put a slash behind what they take for a directory; who stops a driver has no time for that.
#[test]
fn a_slash_behind_the_name_of_a_socket_does_not_count() {
    let mut driver = Driver::start(&resting("real", 1));
    let slash = Path::new(driver.socket()).join("");
    let status = process::io_driver(&["status"], &slash);
    assert_eq!((status.status, status.err.as_str()), (Some(0), ""), "{status:?}");
    let stop = process::io_driver(&["emergency-stop"], &slash);
    assert_eq!((stop.status, stop.err.as_str()), (Some(0), ""), "{stop:?}");
    let stop = process::io_driver(&["stop"], &slash);
    assert_eq!(stop.status, Some(0), "{stop:?}");
    assert_eq!(driver.wait().code(), Some(0));
}

/// A mistyped name would make directories that nobody asked for.
#[test]
fn a_directory_that_a_driver_makes_for_its_socket_is_told() {
    let directory = tempfile::tempdir().expect("a directory");
    let config = directory.path().join("driver.toml");
    std::fs::write(&config, resting("real", 1)).expect("written");
    let start = |socket: &Path, words: &str| {
        let mut command = io_driver();
        command.args(["run", "--config"]).arg(&config).arg("--socket").arg(socket);
        let mut driver = Running::start(&mut command);
        driver.hear("listening at");
        driver.signal(Signal::TERM);
        let end = driver.end();
        assert_eq!(end.status, Some(0), "{end:?}");
        assert_eq!(end.err.contains("made the directory"), !words.is_empty(), "{end:?}");
        assert!(end.err.contains(words), "{end:?}");
    };
    let made = directory.path().join("a/b");
    let words = format!("made the directory {} for the socket", made.display());
    start(&made.join("driver.sock"), &words);
    start(&made.join("driver.sock"), "");
}

#[test]
fn a_decimal_comma_of_an_option_is_told_with_a_point() {
    let mut zero = io_driver();
    let end = Running::start(zero.args(["zero", "--wait", "0,5"])).end();
    assert_eq!((end.status, end.out.as_str()), (Some(2), ""), "{end:?}");
    assert!(end.err.contains("tip: a decimal number has a point, as in 0.1"), "{end:?}");
}

/// As the installed service has it: with a network, and so a table of sockets, of its own.
#[test]
fn a_driver_in_a_network_of_its_own_is_found_though_its_sockets_file_is_gone() {
    let program = io_driver();
    let mut apart = Command::new("unshare");
    apart.arg("--net").arg(program.get_program());
    if !Command::new("unshare").args(["--net", "true"]).bounded_status().is_ok_and(|status| status.success())
    {
        println!("skipped: no network of its own can be had here");
        return;
    }
    let driver = Driver::start_as(&resting("real", 1), apart);
    for file in [driver.socket().to_path_buf(), stop_socket::path_beside(driver.socket())] {
        std::fs::remove_file(file).expect("its file");
    }
    let words = format!("process {} listens there", driver.child.id());
    for command in ["emergency-stop", "stop"] {
        let end = asked(&driver, command);
        assert_eq!(end.status, Some(3), "{end:?}");
        assert!(end.err.contains(&words), "{end:?}");
    }
    signal(&driver, Signal::TERM);
}

fn wait_for<T>(mut find: impl FnMut() -> Option<T>) -> T {
    let until = Instant::now() + HANG;
    loop {
        if let Some(found) = find() {
            return found;
        }
        assert!(Instant::now() < until, "waited in vain");
        std::thread::sleep(Duration::from_millis(1));
    }
}
