//! A driver in which something makes a forbidden system call dies at once, says of what, and leaves nothing.

use rt_core::epitaph::{self, EpitaphKind};
use rustix::process::Signal;
use std::os::unix::process::ExitStatusExt;
use std::time::Duration;
use system_tests::driver::{Driver, HANG};
use system_tests::faults::commander::Commander;
use system_tests::faults::press;
use system_tests::faults::process::{children_of, send};
use system_tests::faults::ring::RingLog;
use system_tests::intruder::{CALL_VARIABLE, DEEDS};
use system_tests::programs;

/// A driver with an intruder who waits for SIGUSR1, and a commander under whom its motors push.
struct Scene {
    driver: Driver,
    observer: shm_abi::client::Attachment,
    _commander: Commander,
}

impl Scene {
    fn with(deed: &str, config: &str) -> Self {
        let mut command = programs::io_driver();
        command.env(CALL_VARIABLE, deed).env("RUST_BACKTRACE", "1").stderr(std::process::Stdio::null());
        let driver = Driver::start_as(config, command);
        let observer = driver.observe();
        let commander = Commander::start(driver.command(), [0.0, 3.0, 0.0]);
        RingLog::begin(&observer.driver).follow_to_force(&observer.driver);
        Self { driver, observer, _commander: commander }
    }

    fn let_it_happen(&mut self) -> std::process::ExitStatus {
        send(self.driver.child.id(), Signal::USR1);
        self.driver.wait()
    }
}

#[test]
fn a_forbidden_call_while_motors_push_ends_the_driver_and_its_last_words_name_the_call() {
    for clock in ["real", "lockstep"] {
        for (deed, call) in DEEDS {
            let mut scene = Scene::with(deed, &press::config(clock));
            let status = scene.let_it_happen();
            assert_eq!(status.signal(), Some(libc::SIGSYS), "{deed}: {status:?}");
            let words = epitaph::read(&scene.observer.driver.epitaph).expect("last words");
            assert_eq!((words.kind, words.complete), (EpitaphKind::Signal(libc::SIGSYS), true), "{deed}");
            assert!(words.text.starts_with("SIGSYS: forbidden system call "), "{deed}: {words}");
            assert!(words.text.ends_with(&format!("({call})")), "{deed}: {words}");
            assert!(!scene.observer.connection.is_open(), "{deed}: the observer sees it");
            assert!(children_of(scene.driver.child.id()).is_empty(), "{deed}: nobody is left");
            assert!(words.tick > 0, "{deed}: {words}");
        }
    }
}

#[test]
fn an_app_says_of_what_its_driver_died() {
    let mut command = programs::io_driver();
    command.env(CALL_VARIABLE, "open a file").stderr(std::process::Stdio::null());
    let mut driver = Driver::start_as(&press::config("real"), command);
    let observer = driver.observe();
    let table = press::Table::new();
    let mut app = table.app("real");
    app.arg("--attach").arg(driver.socket()).args(["--seconds", "80000", "--grace", "0"]);
    let mut app = system_tests::faults::process::Running::start(&mut app);
    RingLog::begin(&observer.driver).follow_to_force(&observer.driver);
    send(driver.child.id(), Signal::USR1);
    driver.wait();
    let end = app.end();
    assert_eq!(end.status, Some(3), "{end:?}");
    assert!(end.err.contains("the driver is gone: killed by signal 31 in tick "), "{end:?}");
    assert!(end.err.contains("SIGSYS: forbidden system call "), "{end:?}");
}

/// The next one starts where the dead one was.
#[test]
fn a_driver_that_died_of_a_forbidden_call_does_not_hinder_the_next() {
    let mut scene = Scene::with("make a socket", &press::config("real"));
    scene.let_it_happen();
    scene.driver.restart(&press::config("real"));
    let observer = scene.driver.observe();
    let _commander = Commander::start(scene.driver.command(), [0.0, 3.0, 0.0]);
    RingLog::begin(&observer.driver).follow_to_force(&observer.driver);
}

/// Deaths that need system calls of their own must stay the deaths they are.
#[test]
fn other_violent_ends_are_not_taken_for_forbidden_calls() {
    let ends = [
        ("overflow the stack", libc::SIGABRT, EpitaphKind::Signal(libc::SIGSEGV)),
        ("abort", libc::SIGABRT, EpitaphKind::Signal(libc::SIGABRT)),
    ];
    for (deed, signal, kind) in ends {
        let mut scene = Scene::with(deed, &press::config("real"));
        let status = scene.let_it_happen();
        let words = epitaph::read(&scene.observer.driver.epitaph).expect("last words");
        assert_eq!((status.signal(), words.kind), (Some(signal), kind), "{deed}: {words}");
    }
}

/// The C library starts threads with all signals blocked, when a forbidden call could not be caught. So this one
/// fails, and the panic of whoever wanted the thread is told like any other. With a backtrace asked for, it must
/// not open a file either.
#[test]
fn a_thread_that_may_not_be_started_is_a_panic_like_any_other() {
    for deed in ["start a thread", "do something unheard of"] {
        let mut scene = Scene::with(deed, &press::config("real"));
        send(scene.driver.child.id(), Signal::USR1);
        let words = wait_for_last_words(&scene);
        assert_eq!(words.kind, EpitaphKind::Panic, "{words}");
        send(scene.driver.child.id(), Signal::TERM);
        assert_eq!(scene.driver.wait().code(), Some(0));
    }
}

fn wait_for_last_words(scene: &Scene) -> epitaph::Epitaph {
    let begun = std::time::Instant::now();
    loop {
        if let Some(words) = epitaph::read(&scene.observer.driver.epitaph).filter(|words| words.complete) {
            return words;
        }
        assert!(begun.elapsed() < HANG, "no last words");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn without_the_sandbox_the_same_call_harms_nobody() {
    let config = press::config("real").replace("[safety]", "[process]\nsandbox = false\n[safety]");
    let mut scene = Scene::with("open a file", &config);
    let report = scene.observer.driver.info().setup_report;
    assert!(report.contains("system calls: all (`sandbox = false` in the configuration)"), "{report}");
    send(scene.driver.child.id(), Signal::USR1);
    let mut log = RingLog::begin(&scene.observer.driver);
    log.follow_for(&scene.observer.driver, 200);
    log.follow_to_force(&scene.observer.driver);
    send(scene.driver.child.id(), Signal::TERM);
    assert_eq!(scene.driver.wait().code(), Some(0));
}
