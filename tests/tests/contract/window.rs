//! The window on a run: it opens where there is a display, shows the scene, closes by a key and by the run's end, and a
//! run does without it where there is none.

use bytemuck::Zeroable;
use shm_abi::Frame;
use std::path::Path;
use std::time::{Duration, Instant};
use system_tests::recording::Table;
use system_tests::screen::{SIZE, Screen};
use system_tests::workplace::{Running, Said, Workplace};

/// A red ball before a camera that looks along -z at it.
const SCENE: &str = "\
[[finger]]
start_m = [0.0, 0.1, 0.0]
[[entity]]
name = \"ball\"
shape = { kind = \"sphere\", radius_m = 0.05 }
visual = { colour = [0.8, 0.1, 0.1] }
[[camera]]
name = \"front\"
position_m = [0.0, 0.0, 0.5]
field_of_view_deg = 40.0
";
/// A machine that draws in software beside other tests needs so long for a window at most.
const PATIENCE: Duration = Duration::from_secs(30);

fn start(place: &Workplace, display: &str, arguments: &[&str]) -> Running {
    place.write("scene.toml", SCENE);
    let mut run = place.phantom3();
    run.args(["run", "scene.toml"]).args(arguments).env("DISPLAY", display).env("LIBGL_ALWAYS_SOFTWARE", "1");
    Running::start(run)
}

fn is_red([red, green, blue]: [u8; 3]) -> bool {
    red > 120 && green < 90 && blue < 90
}

/// Whether the ball is seen, in a picture of which panels may have a part, before anybody's patience ends.
fn shows_the_ball(screen: &Screen, running: &Running) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        let said = running.said_so_far();
        if said.contains("no window: ") {
            println!("skipped: {said}");
            return false;
        }
        let row = SIZE[1] / 2;
        let red = (0..SIZE[0]).filter(|&column| is_red(screen.pixel(column, row))).count();
        // 10 cm of 36 cm from the upper edge to the lower one.
        if red > SIZE[1] / 5 {
            return true;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    panic!("nothing is seen: {}", running.said_so_far());
}

#[test]
fn a_display_that_does_not_answer_leaves_the_run_as_it_is() {
    let place = Workplace::new();
    let said = start(&place, ":4094", &["--seconds", "0.2", "--record", "run.csv"]).wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.err.contains("no window: "), "{}", said.err);
    assert!(!said.err.contains(".rs:"), "nobody's sources: {}", said.err);
    assert!(place.path("run.csv").exists());
}

#[test]
fn headless_is_headless_and_the_virtual_clock_has_no_window() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    for words in [&["--headless", "--seconds", "0.3"][..], &["--clock", "virtual", "--seconds", "0.3"]] {
        let Said { status, err, .. } = start(&place, screen.display(), words).wait();
        assert_eq!(status, Some(0), "{err}");
        assert!(!err.contains("window"), "{err}");
        assert_eq!(screen.pixel(SIZE[0] / 2, SIZE[1] / 2), [0; 3], "nothing was drawn");
    }
}

#[test]
fn a_run_is_seen_and_its_window_closes_with_it() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    let running = start(&place, screen.display(), &["--seconds", "12"]);
    if !shows_the_ball(&screen, &running) {
        return;
    }
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
}

#[test]
fn escape_ends_a_run_and_what_was_recorded_is_complete() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    let running = start(&place, screen.display(), &["--seconds", "100", "--record", "run.csv"]);
    if !shows_the_ball(&screen, &running) || !screen.press("Escape") {
        return;
    }
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    let recorded = std::fs::read_to_string(place.path("run.csv")).expect("a recording");
    assert!(recorded.ends_with('\n') && recorded.lines().count() > 100);
}

#[test]
fn a_signal_ends_a_run_with_a_window() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    let running = start(&place, screen.display(), &["--seconds", "100"]);
    if !shows_the_ball(&screen, &running) {
        return;
    }
    let process = rustix::process::Pid::from_raw(running.child.id().cast_signed()).expect("a process");
    rustix::process::kill_process(process, rustix::process::Signal::INT).expect("it is ours");
    assert_eq!(running.wait().status, Some(130));
}

/// As at the end of a session, or of a forwarded connection.
#[test]
fn a_display_that_goes_away_ends_neither_a_run_nor_its_recording() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    let running = start(&place, screen.display(), &["--seconds", "12", "--record", "run.csv"]);
    if !shows_the_ball(&screen, &running) {
        return;
    }
    drop(screen);
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.err.contains("the display is gone; the run goes on without a window"), "{}", said.err);
    let recorded = std::fs::read_to_string(place.path("run.csv")).expect("a recording");
    let last = recorded.lines().last().and_then(|row| row.split(',').next()?.parse().ok());
    assert_eq!(last, Some(11.999), "the time of the last row");
}

#[test]
fn a_display_that_goes_away_ends_a_play_in_order() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    let mut play = place.phantom3();
    play.args(["play", "--seconds", "1000", "--record", "play.csv"]);
    play.env("DISPLAY", screen.display()).env("LIBGL_ALWAYS_SOFTWARE", "1");
    let running = Running::start(play);
    let is_open = || place.path("play.csv").metadata().is_ok_and(|file| file.len() > 100_000);
    patience::until("a window, and rows", is_open);
    drop(screen);
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.err.contains("the display is gone, and with it the hand; the run ends"), "{}", said.err);
    assert!(said.out.contains("recording"), "{}", said.out);
}

/// Behind the ball, many more that take long to draw without a graphics card.
const SLOW: &str = "\
[[entity]]
name = \"crowd\"
shape = { kind = \"sphere\", radius_m = 0.004 }
position_m = [-0.1, -0.1, -0.2]
grid = { count = [6, 6, 6], spacing_m = [0.035, 0.035, 0.03] }
haptic = false
collidable = false
";

/// Of the events of a kind, when they were (s).
fn times(events: &Table, kind: &str) -> Vec<f64> {
    let kinds = events.texts("kind").into_iter();
    kinds.zip(events.numbers("t_s")).filter(|(is, _)| *is == kind).map(|(_, t)| t).collect()
}

/// When a run began, on the system's monotonic clock (s), as any of its driver's frames tells.
fn beginning_s(runtime: &Path) -> f64 {
    let entries = std::fs::read_dir(runtime).expect("a directory").flatten();
    let socket = entries.map(|entry| entry.path().join("driver.sock")).find(|socket| socket.exists());
    let driver = shm_abi::client::observe(&socket.expect("the driver's socket"), "test").expect("its memory");
    let mut frame = Frame::zeroed();
    patience::until("a frame of the run", || {
        let tick = driver.driver.latest_tick();
        tick.is_some_and(|tick| driver.driver.read_frame(tick, &mut frame).is_ok()) && frame.run_tick >= 0
    });
    frame.deadline_ns as f64 * 1e-9 - frame.run_tick as f64 * 1e-3
}

#[test]
fn a_key_s_press_is_told_when_it_was_however_slowly_its_window_draws() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    place.write("scene.toml", [SCENE, SLOW].concat());
    let runtime = place.path("runtime");
    std::fs::create_dir(&runtime).expect("a directory");
    let mut run = place.phantom3();
    run.args(["run", "scene.toml", "--seconds", "100", "--events", "events.csv"]);
    run.env("DISPLAY", screen.display()).env("LIBGL_ALWAYS_SOFTWARE", "1").env("XDG_RUNTIME_DIR", &runtime);
    let running = Running::start(run);
    if !shows_the_ball(&screen, &running) {
        return;
    }
    let began_s = beginning_s(&runtime);
    let mut presses = Vec::new();
    for milliseconds in [20, 50, 20, 50, 20, 50] {
        let Some(press) = screen.press_for("y", Duration::from_millis(milliseconds)) else { return };
        presses.push(press);
    }
    assert!(screen.press("Escape"));
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    let events = Table::read(&place.path("events.csv"));
    let (downs, ups, orders) =
        (times(&events, "key-down"), times(&events, "key-up"), times(&events, "order"));
    assert_eq!((downs.len(), ups.len()), (presses.len(), presses.len()), "{downs:?} {ups:?}");
    for (at, ((down, up), pressed)) in downs.into_iter().zip(ups).zip(presses).enumerate() {
        let told = [orders[2 * at], orders[2 * at + 1]];
        let within = [pressed.down_ns, pressed.up_ns].map(|both| both.map(|ns| ns as f64 * 1e-9 - began_s));
        println!("a press within {within:.4?}: {down} to {up}, told at {told:.4?}");
        for (is, [before, after]) in [(down, within[0]), (up, within[1])] {
            // The server's times are whole milliseconds, and so are the run's; both are cut off.
            assert!(
                (before - 2e-3..after + 2e-3).contains(&is),
                "{is} s is not within {before} and {after} s"
            );
        }
        assert!(up <= told[1], "nothing is told before it was");
    }
}

#[test]
fn an_arrow_key_moves_what_was_chosen() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    let scene = SCENE.replace("visual =", "mass_kg = 0.1\nvisual =");
    place.write("scene.toml", format!("gravity_m_s2 = [0.0, 0.0, 0.0]\n{scene}"));
    let mut run = place.phantom3();
    run.args(["run", "scene.toml", "--seconds", "100", "--record", "run.csv"]);
    run.env("DISPLAY", screen.display()).env("LIBGL_ALWAYS_SOFTWARE", "1");
    let running = Running::start(run);
    if !shows_the_ball(&screen, &running) || !screen.press("period") || !screen.press("Right") {
        return;
    }
    // A step of 5 mm; a key that a busy machine holds longer makes more of them.
    wait_for(&place, "ball_x", 0.0049);
    assert!(screen.press("Escape"));
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert_eq!(Table::read(&place.path("run.csv")).numbers("ball_x")[0], 0.0);
}

/// Until a column of the recording that is being written is as much as this.
fn wait_for(place: &Workplace, column: &str, least: f64) {
    let newest = || {
        let text = std::fs::read_to_string(place.path("run.csv")).ok()?;
        let whole = &text[..=text.rfind('\n')?];
        let at = whole.lines().next()?.split(',').position(|name| name == column)?;
        whole.lines().skip(1).last()?.split(',').nth(at)?.parse::<f64>().ok()
    };
    let begun = Instant::now();
    while newest().is_none_or(|newest| newest < least) {
        assert!(begun.elapsed() < PATIENCE, "{column} is {:?} after {PATIENCE:?}, not {least}", newest());
        std::thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn devices_that_are_attached_to_the_camera_go_with_the_window_s() {
    let Some(screen) = Screen::open() else { return };
    let place = Workplace::new();
    let other = "[[camera]]\nname = \"aside\"\nposition_m = [0.1, 0.0, 0.55]\nfield_of_view_deg = 40.0\n";
    place.write("scene.toml", [SCENE, other].concat());
    let device = "[[device]]\nposition_m = [0.0, 0.1, -0.5]\n";
    place.write("layout.toml", format!("master = 0\nattached_to = \"camera\"\n{device}"));
    let mut run = place.phantom3();
    run.args(["run", "scene.toml", "--layout", "layout.toml", "--seconds", "100", "--record", "run.csv"]);
    run.env("DISPLAY", screen.display()).env("LIBGL_ALWAYS_SOFTWARE", "1");
    let running = Running::start(run);
    if !shows_the_ball(&screen, &running) || !screen.press("c") {
        return;
    }
    wait_for(&place, "f0_hip_x", 0.1 - 1e-7);
    assert!(screen.press("Escape"));
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{}", said.err);
    let samples = Table::read(&place.path("run.csv")).finger("f0");
    let (first, last) = (samples[0].hip, samples[samples.len() - 1].hip);
    // Where the scene has it, though the layout says nothing of where the camera is; then as far as the camera goes.
    assert!((first - nalgebra::Vector3::new(0.0, 0.1, 0.0)).norm() < 1e-6, "{first}");
    assert!((last - first - nalgebra::Vector3::new(0.1, 0.0, 0.05)).norm() < 1e-6, "{last}");
    for ticks in samples.windows(2) {
        let ticks_between = ((ticks[1].t - ticks[0].t) * 1e3).round();
        assert!(
            (ticks[1].hip - ticks[0].hip).norm() <= ticks_between * 0.5e-3 + 1e-9,
            "{} s: a blow",
            ticks[1].t
        );
    }
}
