//! The application is killed at any moment: the driver stays, the force goes, the next one works. How fast it goes is
//! seen from the amplifiers' side, too.

use bytemuck::Zeroable;
use rt_core::epitaph::EpitaphKind;
use rustix::process::Signal;
use shm_abi::client;
use shm_abi::segment::DriverInfo;
use shm_abi::seqlock::stamp;
use shm_abi::{Command, Frame, doorbell};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;
use system_tests::faults::press::{self, FORCE_N, Press, Table};
use system_tests::faults::process::{Running, children_of, is_alive, myself, role};
use system_tests::faults::random::Random;
use system_tests::faults::ring::{RingLog, Told};
use system_tests::faults::stand::{Setup, Stand};
use system_tests::programs;

/// Frames that are looked at after a death: more than the 13 ticks in which the force must go, for whether it
/// stays so.
const AFTERMATH: usize = 35;

/// Ticks after the last command in which the force is gone.
fn silent_after(info: &DriverInfo) -> u64 {
    info.max_command_age_ticks + info.ramp_out_ticks
}

/// Kills applications one after the other, each at a moment of its own: one in four anywhere in its start,
/// the others while their force is applied. Then one is left alive, and must work.
fn kill_again_and_again(
    press: &mut Press,
    random: &mut Random,
    kills: u32,
    start: impl Fn(&Press) -> Running,
) {
    let mut log = RingLog::begin(&press.observer.driver);
    let mut in_force = 0;
    for round in 0..kills {
        let mut app = start(press);
        if random.once_in(4) {
            // About as long as it takes to start, attach and ramp in.
            std::thread::sleep(random.duration(Duration::from_millis(40)));
        } else {
            log.follow(&press.observer.driver, "force", |told| {
                app.must_run();
                told.iter().any(Told::is_pushing)
            });
            // Some ticks, whichever the clock, and any phase of the last.
            std::thread::sleep(random.duration(Duration::from_millis(6)));
            app.must_run();
            in_force += 1;
        }
        log.catch_up(&press.observer.driver);
        app.kill();
        let died_by = press.observer.driver.latest_tick().expect("frames");
        // On a loaded machine the end of the lease may be noticed late; the force does not wait for that.
        log.follow(&press.observer.driver, "the aftermath", |told| {
            told.iter().filter(|told| told.tick > died_by).count() >= AFTERMATH
                && told.last().is_some_and(|last| last.lease == 0)
        });
        eprintln!("round {round}: dead by tick {died_by}, last command for {:?}", log.last_command());
        check_aftermath(press, &log, died_by);
        press.driver_must_live();
        log.forget();
    }
    assert!(in_force > kills / 2, "{in_force} of {kills} kills were in the middle of a force");
    let app = start(press);
    log.follow(&press.observer.driver, "the whole force", |told| {
        // The spring's law, rounded twice.
        told.iter().any(|told| told.authority == 1.0 && (told.applied_n - FORCE_N).abs() < 1e-12)
    });
    log.check_promise(&press.observer.driver);
    app.kill();
}

/// Everything that was rendered since the former death was rendered by one application and in time.
fn check_aftermath(press: &Press, log: &RingLog, died_by: u64) {
    let info = press.observer.driver.info();
    log.check_promise(&press.observer.driver);
    assert!(log.last_command().is_none_or(|tick| tick <= died_by), "the dead do not answer");
    // Counted in frames: deadlines that the driver skipped ramp nothing. In lockstep it does nothing but notice
    // the end: the ramp begins in the tick that waits for the dead, or in the next one if that was answered.
    let after: Vec<&Told> = log.told.iter().filter(|told| told.tick > died_by).collect();
    let promise = if press.clock == "lockstep" { info.ramp_out_ticks } else { silent_after(&info) };
    for told in &after[usize::try_from(promise).expect("few")..] {
        assert!(!told.is_pushing(), "dead by tick {died_by}: {told:?}");
    }
}

fn no_fault_and_every_lease_granted(press: &Press, attempts: u64) {
    let counters = &press.observer.driver.counters;
    assert_eq!(counters.faults.load(Ordering::Relaxed), 0);
    assert_eq!(counters.leases_refused.load(Ordering::Relaxed), 0, "a dead holder holds nothing");
    // Those that were killed before they asked are not among them.
    let granted = counters.leases_granted.load(Ordering::Relaxed);
    assert!(granted > attempts / 2 && granted <= attempts, "{granted} of {attempts}");
}

#[test]
fn eighty_apps_killed_in_real_time_leave_no_force_behind() {
    let mut press = Press::start("real");
    kill_again_and_again(&mut press, &mut Random::seeded(1), 80, Press::start_app);
    no_fault_and_every_lease_granted(&press, 81);
}

#[test]
fn eighty_apps_killed_in_lockstep_leave_no_force_behind() {
    let mut press = Press::start("lockstep");
    kill_again_and_again(&mut press, &mut Random::seeded(2), 80, Press::start_app);
    no_fault_and_every_lease_granted(&press, 81);
}

/// An application is hardly ever caught in the middle of writing a command; this one is half of the time.
#[test]
fn forty_commanders_killed_in_the_middle_of_writing_leave_no_force_behind() {
    let mut press = Press::start("real");
    let slow_writer = |press: &Press| {
        let socket = press.driver.socket().to_str().expect("a temporary name");
        Running::start(&mut myself("app_killed::the_commander_that_writes_slowly", socket))
    };
    kill_again_and_again(&mut press, &mut Random::seeded(3), 40, slow_writer);
    no_fault_and_every_lease_granted(&press, 41);
    let torn = press.observer.driver.counters.commands_torn.load(Ordering::Relaxed);
    assert!(torn > 40, "{torn} torn commands: hardly anybody was caught in the middle");
}

/// Not a test of its own: the process that the test above kills. It answers every second tick as one should;
/// the others it announces while the answer is half written, and leaves it so until the next tick.
#[test]
fn the_commander_that_writes_slowly() {
    let Some(socket) = role() else { return };
    let attachment = client::command(Path::new(&socket), "slow writer").expect("the lease");
    let (driver, commander) = (attachment.driver, attachment.commander.expect("the lease"));
    let mut answered = None;
    loop {
        driver.sleep_for_frame(answered, &commander, Duration::from_millis(1));
        let Some(tick) = driver.latest_tick().filter(|tick| answered != Some(*tick)) else { continue };
        answered = Some(tick);
        let mut command = Command::zero(tick, commander.lease(), 1);
        command.devices[0].force_on_user_n = [0.0, FORCE_N, 0.0];
        if tick % 2 == 0 {
            commander.publish(&command, &driver);
        } else {
            let slot = &commander.commands[tick as usize % commander.commands.len()];
            slot.sequence.store(stamp(tick) - 1, Ordering::Relaxed);
            doorbell::ring(&commander.bell, tick, &driver.bell.owner_sleeps);
        }
    }
}

#[test]
fn a_killed_app_takes_its_own_driver_and_its_directory_with_it() {
    for clock in ["real", "lockstep"] {
        let mut random = Random::seeded(4);
        for _ in 0..20 {
            let table = Table::new();
            let app = Running::start(table.app(clock).args(["--seconds", "80000"]));
            let observer = table.observe_child();
            let mut log = RingLog::begin(&observer.driver);
            log.follow_to_force(&observer.driver);
            std::thread::sleep(random.duration(Duration::from_millis(6)));
            let children = children_of(app.id());
            assert_eq!(
                children.iter().map(|child| u64::from(*child)).collect::<Vec<_>>(),
                [observer.driver_pid]
            );
            app.kill();
            wait_until_dead(children[0]);
            // It stopped in order, motors first: it took its socket away, and the directory that nobody else can.
            let words = rt_core::epitaph::read(&observer.driver.epitaph).map(|words| words.kind);
            assert_eq!(words, Some(EpitaphKind::Stopped), "the driver did not stop in order");
            assert_eq!(table.left_behind(), Vec::<PathBuf>::new());
            assert!(!observer.connection.is_open());
        }
    }
}

/// Its driver hears of its end by SIGHUP, which it therefore never ignores.
#[test]
fn an_app_under_nohup_outlives_its_terminal_and_its_driver_does_not_outlive_it() {
    let table = Table::new();
    let mut program = table.app("real");
    program.args(["--seconds", "80000"]);
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", "trap '' HUP; exec \"$0\" \"$@\""]);
    shell.arg(program.get_program()).args(program.get_args());
    for (name, value) in program.get_envs() {
        match value {
            Some(value) => shell.env(name, value),
            None => shell.env_remove(name),
        };
    }
    let mut app = Running::start(shell.current_dir(table.path("")));
    let observer = table.observe_child();
    let mut log = RingLog::begin(&observer.driver);
    log.follow_to_force(&observer.driver);
    app.signal(Signal::HUP);
    // A tenth of a second, in which it would have ended many times over.
    log.follow_for(&observer.driver, 200);
    app.must_run();
    let child = children_of(app.id())[0];
    app.kill();
    wait_until_dead(child);
    let words = rt_core::epitaph::read(&observer.driver.epitaph).map(|words| words.kind);
    assert_eq!(words, Some(EpitaphKind::Stopped), "the driver did not stop in order");
    assert_eq!(table.left_behind(), Vec::<PathBuf>::new());
}

/// Killed at any moment of its start, before or after there is a driver.
#[test]
fn an_app_killed_while_it_starts_leaves_no_driver_running() {
    let mut random = Random::seeded(5);
    for _ in 0..30 {
        let table = Table::new();
        let app = Running::start(table.app("real").args(["--seconds", "80000"]));
        std::thread::sleep(random.duration(Duration::from_millis(12)));
        app.kill();
        // Its directory may stay if it died before there was anybody else to take it away.
        table.wait_until_abandoned();
    }
}

/// The parent died before its child could ask to be told.
#[test]
fn a_driver_that_was_orphaned_at_birth_does_not_start_and_tidies_up() {
    let directory = tempfile::tempdir().expect("a directory");
    let (private, file) = (directory.path().join("private"), directory.path().join("driver.toml"));
    std::fs::create_dir(&private).expect("a directory");
    std::fs::write(&file, press::config("real")).expect("a configuration");
    let mut driver = programs::io_driver();
    // No process has the number 0, so its parent is another one.
    driver
        .args(["run", "--parent", "0", "--config"])
        .arg(&file)
        .arg("--socket")
        .arg(private.join("driver.sock"));
    let end = Running::start(&mut driver).end();
    assert_eq!(end.status, Some(2), "{end:?}");
    assert!(end.err.contains("parent (process 0) has ended already"), "{end:?}");
    assert!(!private.exists());
}

/// At the driver's own defaults and 1 kHz: four ticks of age, five of ramp, of which the last is at zero.
const SILENT_AFTER_VALUES: u64 = 9;

/// Counted in values that the amplifiers got, of which there is one a tick: a driver that the machine keeps from running
/// writes fewer in the same time. The milliseconds are told, not judged.
#[test]
fn the_amplifiers_get_zero_within_nine_values_of_the_last_reply_at_the_usual_settings() {
    // The whole force comes soon, so that it is there on a shared machine as well.
    let mut setup = Setup { safety: "ramp_in_ms = 20", ..Setup::new("real") };
    setup.limits.rate_hz = 1000.0;
    let stand = Stand::start(setup);
    let info = stand.view().info();
    assert_eq!((info.max_command_age_ticks, info.ramp_out_ticks, info.period_ns), (4, 5, 1_000_000));
    let mut random = Random::seeded(6);
    let (mut killed_ms, mut stopped_ms, mut most) = (Vec::new(), Vec::new(), 0);
    for round in 0..24 {
        let app = stand.start_app();
        let mut log = RingLog::begin(stand.view());
        log.follow(stand.view(), "force", |told| told.last().is_some_and(|told| told.authority == 1.0));
        std::thread::sleep(random.duration(Duration::from_millis(3)));
        // Killed, its lease ends as well, if the driver hears of it in time; stopped, only its age tells.
        let is_kill = round % 2 == 0;
        if is_kill {
            app.kill();
        } else {
            app.signal(Signal::STOP);
        }
        log.follow(stand.view(), "silence", |told| {
            told.len() > 40 && told[told.len() - 40..].iter().all(|told| !told.is_pushing())
        });
        log.check_promise(stand.view());
        let (values, ns) = silence(&stand, &log);
        assert!(
            values <= SILENT_AFTER_VALUES,
            "round {round}: zero in value {values} after the last reply's"
        );
        most = most.max(values);
        (if is_kill { &mut killed_ms } else { &mut stopped_ms }).push(ns as f64 / 1e6);
    }
    for (what, mut ms) in [("killed", killed_ms), ("stopped", stopped_ms)] {
        ms.sort_by(f64::total_cmp);
        println!(
            "{what}: zero {:.2} ms (median), {:.2} ms (longest) after the last reply",
            ms[ms.len() / 2],
            ms[ms.len() - 1]
        );
    }
    println!("at most {most} values after the last reply's");
    stand.finish();
}

/// From the value of the tick that the last reply answers, which may have come too late for that one.
fn silence(stand: &Stand, log: &RingLog) -> (u64, u64) {
    let answered = log.last_command().expect("a reply");
    let told = log.told.iter().find(|told| told.tick > answered).expect("the frame after that tick");
    let mut frame = Frame::zeroed();
    stand.view().read_frame(told.tick, &mut frame).expect("a frame of the ring");
    stand.amplifiers.silence_after(frame.previous.written_ns).expect("zero is in the amplifiers' log")
}

fn wait_until_dead(process: u32) {
    let begun = std::time::Instant::now();
    while is_alive(process) {
        assert!(begun.elapsed() < system_tests::driver::HANG, "process {process} lives on");
        std::thread::sleep(Duration::from_millis(1));
    }
}
