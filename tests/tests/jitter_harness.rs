//! The program `jitter` itself, from start to end. Nothing is asserted on latencies: only that what it says adds up,
//! that it ends as it should, and that it leaves nothing behind.

use rustix::process::{Pid, Signal, kill_process};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use system_tests::driver::{Driver, HANG, resting};
use system_tests::jitter::document::Document;
use system_tests::jitter::metric::{Metric, Style};
use system_tests::programs;
use system_tests::workplace::{Running, Workplace};

/// Without rights, so that it may run beside anything, and without cyclictest, which may not be there.
const MODEST: [&str; 5] = ["--quiet", "--priority", "0", "--reference", "sleep"];

fn jitter(place: &Workplace, arguments: &[&str]) -> Command {
    let mut command = place.prepare(programs::jitter());
    command.args(arguments);
    command
}

fn modest(place: &Workplace, arguments: &[&str]) -> Command {
    jitter(place, &[&MODEST, arguments].concat())
}

fn result(place: &Workplace) -> Document {
    Document::load(&place.path("out/result.json")).expect("a result")
}

fn interrupt(running: &Running, signal: Signal) {
    kill_process(Pid::from_child(&running.child), signal).expect("our child");
}

fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !done() {
        assert!(begun.elapsed() < HANG, "{what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Every histogram is the sum of its slices and of its time line.
fn check_sums(document: &Document) {
    for series in &document.series {
        let (name, count) = (series.metric.name(), series.percentiles.count);
        assert_eq!(series.runs.iter().map(|run| run.percentiles.count).sum::<u64>(), count, "{name}");
        assert_eq!(series.timeline.iter().map(|row| row.count).sum::<u64>(), count, "{name}");
        let max = series.runs.iter().map(|run| run.percentiles.max).max().unwrap_or(0);
        assert_eq!(max, series.percentiles.max, "{name}");
        assert!(series.worst.windows(2).all(|pair| pair[0].value_ns >= pair[1].value_ns), "{name}");
        if let Some(worst) = series.worst.first() {
            assert_eq!(worst.value_ns, max, "{name}: the worst event is the maximum");
        }
    }
}

fn count(document: &Document, metric: Metric) -> u64 {
    document.series(metric).map_or(0, |series| series.percentiles.count)
}

#[test]
fn a_short_run_writes_everything_and_the_numbers_add_up() {
    let place = Workplace::new();
    let said =
        Running::start(modest(&place, &["--runs", "2", "--slice", "1", "--worst", "5", "--out", "out"]))
            .wait();
    assert_eq!((said.status, said.err.as_str(), said.out.as_str()), (Some(0), "", ""));
    for file in ["runs.csv", "timeline.csv", "worst.csv", "histogram", "tail", "timeline"] {
        let files = if file.contains('.') {
            vec![file.to_owned()]
        } else {
            vec![format!("{file}.svg"), format!("{file}.png")]
        };
        for file in files {
            assert!(place.path("out").join(&file).metadata().is_ok_and(|found| found.len() > 100), "{file}");
        }
    }
    let document = result(&place);
    assert_eq!(document.end, "completed");
    check_sums(&document);
    for style in [Style::Hybrid, Style::Reference] {
        let metric = if style == Style::Hybrid { Metric::HybridWake } else { Metric::ReferenceWake };
        let (ticks, skipped) = (document.counter(style, "ticks"), document.counter(style, "overruns"));
        assert_eq!(
            count(&document, metric) + document.counter(style, "samples_lost"),
            ticks,
            "{}",
            style.name()
        );
        // Two slices of 1000 ticks, each done or slept through; a stall across an end counts beyond it.
        assert!(ticks + skipped >= 2000, "{} {ticks} {skipped}", style.name());
    }
    let of = |name: &str| document.counter(Style::Driver, name);
    assert_eq!(of("frames_seen"), count(&document, Metric::DeadlineToRead));
    let judged = of("frames_answered") + of("frames_held") + of("frames_expired");
    assert_eq!(judged, count(&document, Metric::EndToEnd));
    assert!(count(&document, Metric::RoundTrip) <= of("frames_answered"));
    assert!(of("frames_seen") > 0 && of("frames_lost") == 0, "polled well within the ring");
    assert!(document.series(Metric::EndToEnd).unwrap().worst.iter().all(|event| event.tick.is_some()));
    assert!(place.processes().is_empty());
}

#[test]
fn ctrl_c_ends_it_early_with_everything_that_was_measured() {
    let place = Workplace::new();
    let arguments = ["--runs", "50", "--slice", "3", "--save-every", "1", "--out", "out"];
    let running = Running::start(modest(&place, &arguments));
    wait_until("nothing was saved on the way", || place.path("out/result.json").exists());
    assert_eq!(result(&place).end, "running");
    interrupt(&running, Signal::INT);
    let said = running.wait();
    assert_eq!((said.status, said.err.as_str()), (Some(130), ""));
    let document = result(&place);
    assert_eq!(document.end, "signal 2");
    check_sums(&document);
    // Between two slices it cuts none.
    assert!(document.series.iter().all(|series| series.complete_runs().count() < 50));
    assert!(place.path("out/timeline.png").exists());
    assert!(place.processes().is_empty());
}

#[test]
fn it_looks_on_at_a_driver_that_runs_and_leaves_it_alone() {
    let place = Workplace::new();
    let driver = Driver::start(&resting("real", 1));
    let socket = driver.socket().to_str().expect("UTF-8");
    let arguments = ["--quiet", "--attach", socket, "--runs", "2", "--slice", "0.5", "--out", "out"];
    let said = Running::start(jitter(&place, &arguments)).wait();
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    let document = result(&place);
    check_sums(&document);
    assert_eq!(document.series(Metric::DeadlineToRead).unwrap().runs.len(), 2);
    assert!(document.counter(Style::Driver, "frames_seen") > 0);
    assert_eq!(count(&document, Metric::EndToEnd), 0, "nobody commands, so nothing is answered");
    let seen = driver.observe().driver;
    assert_eq!(io_driver::status::CounterStatus::of(&seen).leases_granted, 0, "an observer takes no lease");
}

#[test]
fn the_end_of_a_driver_that_it_looks_on_at_is_a_fault_with_results() {
    let place = Workplace::new();
    let mut driver = Driver::start(&resting("real", 1));
    let socket = driver.socket().to_str().expect("UTF-8").to_owned();
    let arguments = [
        "--quiet",
        "--attach",
        &socket,
        "--runs",
        "1",
        "--slice",
        "600",
        "--save-every",
        "1",
        "--out",
        "out",
    ];
    let running = Running::start(jitter(&place, &arguments));
    wait_until("nothing was saved on the way", || place.path("out/result.json").exists());
    shm_abi::client::stop(Path::new(&socket), "test").expect("it stops");
    driver.wait();
    let said = running.wait();
    assert_eq!(said.status, Some(3));
    assert!(said.err.contains("the driver is gone"), "{}", said.err);
    check_sums(&result(&place));
}

#[test]
fn load_is_started_and_none_of_it_is_left() {
    let place = Workplace::new();
    let load = ["--load", "memory,disk,fork,loopback", "--load-workers", "1"];
    let arguments = ["--styles", "hybrid", "--runs", "2", "--slice", "1", "--out", "out"];
    let running = Running::start(modest(&place, &[&load[..], &arguments].concat()));
    // The program, a loop, and a worker of each kind; the forks come on top.
    wait_until("the load does not run", || place.processes().len() >= 5);
    let said = running.wait();
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    wait_until("some load is left", || place.processes().is_empty());
    assert_eq!(result(&place).configuration["load"], "1 x memory,disk,fork,loopback");
    let left: Vec<_> =
        std::fs::read_dir(place.path("out")).expect("out").flatten().map(|e| e.file_name()).collect();
    assert_eq!(left.len(), 10, "four tables, six pictures, no file of the load: {left:?}");
}

#[test]
fn nothing_outlives_a_jitter_that_is_killed() {
    let place = Workplace::new();
    let arguments =
        ["--load", "memory,fork", "--styles", "driver", "--runs", "9", "--slice", "9", "--out", "out"];
    let running = Running::start(modest(&place, &arguments));
    // The program, driver, application, and two kinds of load.
    wait_until("it does not run", || place.processes().len() >= 5);
    interrupt(&running, Signal::KILL);
    assert_eq!(running.wait().status, None);
    wait_until("something outlived it", || place.processes().is_empty());
}

#[test]
fn two_results_are_compared_and_garbage_is_refused() {
    let place = Workplace::new();
    for out in ["a", "b"] {
        let arguments =
            ["--priority", "0", "--styles", "hybrid", "--runs", "3", "--slice", "0.3", "--out", out];
        let said = Running::start(jitter(&place, &arguments)).wait();
        assert_eq!(said.status, Some(0), "{}", said.err);
        let plan = "plan: 3 runs of 0.300 s of each style (hybrid), 0.900 s a style";
        assert!(said.err.contains(plan), "{}", said.err);
    }
    let said = Running::start(jitter(&place, &["compare", "a/result.json", "b/result.json"])).wait();
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    assert!(said.out.contains("hybrid.wake_error") && said.out.contains("B / A"), "{}", said.out);
    assert!(place.path("comparison.svg").exists() && place.path("comparison.png").exists());
    place.write("garbage.json", b"\x00\xff{");
    for (a, b) in
        [("a/result.json", "garbage.json"), ("none.json", "a/result.json"), ("a/runs.csv", "a/result.json")]
    {
        let said = Running::start(jitter(&place, &["compare", a, b])).wait();
        assert_eq!(said.status, Some(2), "{a} {b}");
        let culprit = if a == "a/result.json" { b } else { a };
        assert!(said.err.contains(culprit), "{}", said.err);
    }
    let said = Running::start(jitter(&place, &["report", "a/result.json", "--out", "anew"])).wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.contains("p99.99") && place.path("anew/tail.svg").exists());
}

#[test]
fn a_table_that_cannot_be_written_is_named_and_the_results_are_there() {
    let place = Workplace::new();
    std::fs::create_dir(place.path("out")).expect("a directory");
    // As on a disk that has no room for the table.
    std::os::unix::fs::symlink("/dev/full", place.path("out/timeline.csv.part")).expect("a link");
    let arguments = ["--styles", "hybrid", "--runs", "1", "--slice", "0.3", "--out", "out"];
    let said = Running::start(modest(&place, &arguments)).wait();
    assert_eq!(said.status, Some(3), "{}", said.err);
    assert!(said.err.contains("cannot write out/timeline.csv: No space left"), "{}", said.err);
    assert!(said.err.contains("out/result.json is there with all results"), "{}", said.err);
    assert!(!said.err.contains("lost"), "{}", said.err);
    assert!(!result(&place).series.is_empty());
}

#[test]
fn what_makes_no_sense_is_refused_before_anything_starts() {
    let place = Workplace::new();
    let gate = place.write("gate.toml", "[ratio_at_most]\np50 = 0.01\n");
    place.write("bad.toml", "[ratio_at_most]\nmax = 1.0\n");
    std::fs::create_dir(place.path("old")).expect("a directory");
    place.write("old/result.json", "{}");
    let gate = gate.to_str().expect("UTF-8");
    for (arguments, words) in [
        (vec!["--gate", gate, "--runs", "4"], "5 interleaved runs at least, 4 were asked for"),
        (vec!["--gate", gate, "--styles", "hybrid"], "add reference to --styles"),
        (vec!["--gate", "bad.toml"], "never gated"),
        (vec!["--gate", "none.toml"], "none.toml"),
        (vec!["--styles", "hybrid,luck"], "allowed: hybrid, reference, driver"),
        (vec!["--load", "coffee"], "allowed: memory, disk, fork, loopback"),
        (vec!["--cpu", "4095"], "open to this process are"),
        (vec!["--phase-us", "1001"], "allowed are 0 to 1000"),
        (vec!["--config", "none.toml"], "none.toml"),
        (vec!["--rate-hz", "0"], "rate_hz"),
        (vec!["--out", "old"], "holds results already"),
        (vec!["--slice", "0"], "allowed are 0.1"),
        (vec!["--attach", "none.sock", "--quiet"], "none.sock"),
    ] {
        let arguments =
            if arguments[0] == "--attach" { arguments } else { [&MODEST[..], &arguments].concat() };
        let said = Running::start(jitter(&place, &arguments)).wait();
        assert_eq!(said.status, Some(2), "{arguments:?}: {}", said.err);
        assert!(said.err.contains(words), "{arguments:?}: {}", said.err);
        assert!(!place.path("out").exists());
    }
}
