//! `io-driver` by itself: refusing to start, and being watched.

use system_tests::driver::{Driver, HANG, resting};
use system_tests::faults::process::{self, End, Running};
use system_tests::programs::io_driver;

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
fn watching_prints_a_line_a_second_until_the_driver_ends_and_says_how_it_ended() {
    for json in [false, true] {
        let mut driver = Driver::start(&resting("real", 2));
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
