//! The screen, drawn from made-up drivers.

use crate::monitor::commander::Commander;
use crate::monitor::keys::Key;
use crate::monitor::look::{Latencies, Look};
use crate::monitor::state::Monitor;
use crate::status::{CounterStatus, DeviceStatus, Percentiles, Status};
use ratatui_core::backend::TestBackend;
use ratatui_core::buffer::Cell;
use ratatui_core::style::Modifier;
use ratatui_core::terminal::Terminal;
use rt_core::histogram::Histogram;
use std::time::Duration;

fn device(name: &str, force_n: [f64; 3], peak_force_n: Option<f64>) -> DeviceStatus {
    DeviceStatus {
        name: name.into(),
        kind: "premium".into(),
        position_valid: true,
        zero_needed: false,
        orientation_wxyz: None,
        position_m: [0.0123, -0.0456, 0.1],
        velocity_m_per_s: [0.0; 3],
        buttons: 0,
        force_on_user_n_applied: force_n,
        limits: Vec::new(),
        motor_heat: 0.0,
        peak_force_n,
    }
}

fn counters() -> CounterStatus {
    CounterStatus {
        ticks: 123_457,
        overruns: 4,
        ticks_commanded: 100_003,
        replies_fresh: 100_000,
        replies_missed: 3,
        commands_torn: 0,
        commands_refused: 0,
        forces_limited: 0,
        forces_slewed: 0,
        forces_derated: 0,
        forces_faded: 0,
        ticks_unattended: 0,
        leases_granted: 1,
        leases_refused: 0,
        faults: 0,
        log_dropped: 0,
    }
}

fn look(devices: Vec<DeviceStatus>) -> Look {
    let nothing = Percentiles::of(&Histogram::new());
    let status = Status {
        driver_pid: 4711,
        clock: "real",
        rate_hz: 1000.0,
        reply_budget_ns: Some(500_000),
        wait: "futex",
        cpu: Some(3),
        tick: Some(123_456),
        silent_for_s: None,
        other_time_namespace: false,
        state: "active",
        fault: None,
        lease: 2,
        authority: 1.0,
        commissioning: false,
        emergency_stop_pressed: false,
        dead_man_held: None,
        counters: counters(),
        wake_error_ns: nothing,
        cycle_ns: nothing,
        round_trip_ns: nothing,
        devices,
        guarantees: Vec::new(),
        epitaph: None,
    };
    Look { status, latencies: latencies(&[]), at: Duration::ZERO }
}

fn latencies(wake_error_ns: &[u64]) -> Latencies {
    let mut wake_error = Histogram::new();
    wake_error_ns.iter().for_each(|ns| wake_error.record(*ns));
    Latencies { wake_error, round_trip: Histogram::new(), work: Histogram::new() }
}

fn commander() -> Option<Commander> {
    Some(Commander { pid: 4802, name: "phantom3".into() })
}

fn monitor(look: Look) -> Monitor {
    let mut monitor = Monitor::default();
    monitor.see(look, commander());
    monitor
}

fn terminal(width: u16, height: u16) -> Terminal<TestBackend> {
    Terminal::new(TestBackend::new(width, height)).expect("nothing can fail")
}

fn draw(monitor: &Monitor, terminal: &mut Terminal<TestBackend>) -> Vec<String> {
    terminal.draw(|frame| monitor.draw(frame.area(), frame.buffer_mut())).expect("nothing can fail");
    let buffer = terminal.backend().buffer();
    let width = usize::from(buffer.area.width).max(1);
    let rows = buffer.content.chunks(width);
    rows.map(|row| row.iter().map(Cell::symbol).collect::<String>().trim_end().to_owned()).collect()
}

fn shown(monitor: &Monitor, width: u16, height: u16) -> Vec<String> {
    draw(monitor, &mut terminal(width, height))
}

fn assert_shows(rows: &[String], words: &[&str]) {
    for word in words {
        assert!(rows.iter().any(|row| row.contains(word)), "{word:?} is not in\n{}", rows.join("\n"));
    }
}

/// Signed lengths of a screen's force bars, in eighths of a cell, from left to right and top to bottom.
fn bars(monitor: &Monitor, width: u16, height: u16) -> Vec<i32> {
    let mut terminal = terminal(width, height);
    draw(monitor, &mut terminal);
    let content = &terminal.backend().buffer().content;
    let eighths = |index: usize| {
        let left = " ▏▎▍▌▋▊▉█".chars().position(|block| content[index].symbol() == block.to_string())? as i32;
        let is_exchanged = content[index].modifier.contains(Modifier::REVERSED);
        Some(if is_exchanged { 8 - left } else { left }).filter(|eighths| *eighths > 0)
    };
    let middles = (0..content.len()).filter(|index| content[*index].symbol() == "│");
    let length = |middle: usize| {
        let right: i32 = (middle + 1..).map_while(eighths).sum();
        let left: i32 = (0..middle).rev().map_while(eighths).sum();
        right - left
    };
    middles.map(length).collect()
}

#[test]
fn the_screen_is_drawn_as_often_as_the_documents_say() {
    let times = (1.0 / super::REFRESH.as_secs_f64()) as u32;
    let words = format!("up to {times} times a second");
    let documents = [
        ("README.md", include_str!("../../../README.md")),
        ("CHANGELOG.md", include_str!("../../../CHANGELOG.md")),
    ];
    for (name, text) in documents {
        let line = text.lines().find(|line| {
            line.contains("status --watch` ") && line.contains("on a terminal")
                || line.contains("On a terminal `driver status --watch`")
        });
        assert!(line.is_some_and(|line| line.contains(&words)), "{name} does not say {words:?}");
    }
}

#[test]
fn a_screen_of_the_usual_size_tells_everything() {
    let mut left = device("left", [0.0, 0.5, -2.0], Some(8.5));
    left.limits = vec!["slew", "heat"];
    left.motor_heat = 0.62;
    left.buttons = 0b101;
    let thousand = [vec![1_500; 985], vec![16_000; 13], vec![40_000], vec![250_000]].concat();
    let look =
        Look { latencies: latencies(&thousand), ..look(vec![device("right", [1.0; 3], Some(8.5)), left]) };
    let mut monitor = monitor(look.clone());
    let mut later = Look { at: Duration::from_millis(500), ..look };
    later.status.tick = Some(123_456 + 500);
    monitor.see(later, commander());
    let rows = shown(&monitor, 80, 24);
    assert_shows(&rows, &["driver 4711   real clock   1000 Hz   CPU 3   futex wait", "? keys"]);
    assert_shows(
        &rows,
        &[" ACTIVE  authority 1.00 ████████", "lease 2   commanded by process 4802 (phantom3)"],
    );
    assert_shows(&rows, &["ticks 123457   1000.0 Hz   overruns 4   faults 0"]);
    assert_shows(&rows, &["replies 100000 in time   3 missed   0 torn   0 refused"]);
    assert_shows(&rows, &["right  +0.0123  -0.0456  +0.1000 m  buttons -  premium"]);
    assert_shows(&rows, &["left   +0.0123  -0.0456  +0.1000 m  buttons 0,2  limit: slew, heat  warm 62 %"]);
    assert_shows(&rows, &[" +0.50", " -2.00 N of 8.5"]);
    // Buckets end at 1503, 16127 and 40959 ns; the greatest value is exact.
    assert_shows(&rows, &["wake error     1.50    16.13    40.96   250.00", "round trip nothing recorded"]);
}

#[test]
fn bars_are_as_long_as_the_force_is_of_the_peak() {
    let forces = [-8.0, -4.0, -0.4, 0.0, 0.8, 2.0, 6.0, 8.0, 80.0];
    let devices = forces.chunks(3).map(|n| device("d", [n[0], n[1], n[2]], Some(8.0))).collect();
    let monitor = monitor(look(devices));
    for width in [40, 80, 200] {
        let lengths = bars(&monitor, width, 40);
        assert_eq!(lengths.len(), 9, "{width}");
        let full = lengths[7];
        assert!(full >= 8 * 2, "two cells at least: {full}");
        for (force, length) in forces.iter().zip(&lengths) {
            let wanted = (force / 8.0).clamp(-1.0, 1.0) * f64::from(full);
            // Rounded to an eighth of a cell.
            assert!((f64::from(*length) - wanted).abs() <= 0.5, "{width}: {force} N is {length} of {full}");
        }
    }
}

#[test]
fn without_a_peak_the_bars_are_measured_by_the_largest_force_seen_until_that_is_forgotten() {
    let seen = |monitor: &mut Monitor, newtons| {
        monitor.see(look(vec![device("d", [newtons, 0.0, 0.0], None)]), None);
        bars(monitor, 80, 24)[0]
    };
    let mut monitor = Monitor::default();
    assert_eq!(seen(&mut monitor, 0.0), 0);
    let full = seen(&mut monitor, -4.0).abs();
    assert!(full >= 16);
    assert!((seen(&mut monitor, 1.0) - full / 4).abs() <= 1);
    monitor.press(Key::Reset);
    assert_eq!(seen(&mut monitor, 1.0), full);
}

#[test]
fn a_fault_tells_its_reason_even_where_it_has_to_be_broken() {
    let mut look = look(vec![device("right", [0.0; 3], Some(8.5))]);
    look.status.state = "fault";
    look.status.fault = Some("a position jumped farther in a tick than anything can move".into());
    look.status.emergency_stop_pressed = true;
    look.status.dead_man_held = Some(false);
    let monitor = monitor(look);
    let words = ["emergency stop pressed", "dead-man's switch let go"];
    let rows = shown(&monitor, 80, 24);
    assert_shows(&rows, &[" FAULT  a position jumped farther in a tick than anything can move"]);
    assert_shows(&rows, &words);
    let rows = shown(&monitor, 40, 10);
    assert_shows(&rows, &[" FAULT  a position jumped farther in a", "tick than anything can move"]);
    assert_shows(&rows, &words);
}

#[test]
fn values_that_are_no_numbers_are_told_as_such() {
    let mut lost = device("lost", [f64::NAN, f64::INFINITY, -1e300], Some(8.5));
    lost.position_m = [f64::NAN, f64::NEG_INFINITY, 1e300];
    lost.position_valid = false;
    lost.motor_heat = f64::NAN;
    let mut unzeroed = device("\u{1b}[2J\u{202e}evil", [f64::NAN; 3], Some(f64::NAN));
    unzeroed.zero_needed = true;
    let mut look = look(vec![lost, unzeroed, device("strong", [f64::NAN; 3], Some(0.0))]);
    look.status.authority = f64::NAN;
    look.status.rate_hz = f64::INFINITY;
    let monitor = monitor(look);
    let rows = shown(&monitor, 80, 24);
    assert_shows(
        &rows,
        &["not valid      NaN     -inf   +1e300 m", "not zeroed", "authority NaN", "   NaN", "warm NaN %"],
    );
    assert_shows(&rows, &["+inf", "?│?"]);
    assert!(
        rows.iter().all(|row| !row.contains(['\u{1b}', '\u{202e}'])),
        "a name must not steer the terminal"
    );
    // The one that is infinite and the one that is huge are full, those that are no numbers have no length.
    let lengths = bars(&monitor, 80, 24);
    assert!(lengths[1] > 0 && lengths[2] == -lengths[1] && lengths[0] == 0, "{lengths:?}");
}

#[test]
fn what_has_no_room_is_said_to_be_missing_and_no_size_is_too_small() {
    let devices =
        |count: usize| (0..count).map(|i| device(&format!("finger-{i}"), [1.0; 3], Some(8.5))).collect();
    let rows = shown(&monitor(look(devices(8))), 80, 24);
    assert_shows(&rows, &["finger-0", "finger-7", "latencies need a taller window"]);
    let rows = shown(&monitor(look(devices(5))), 80, 24);
    assert_shows(&rows, &["finger-0", "finger-4", "wake error", "work"]);
    let rows = shown(&monitor(look(devices(8))), 40, 10);
    assert_shows(&rows, &["ACTIVE", "finger-0", "finger-1", "6 more in a taller window"]);
    assert!(!rows.iter().any(|row| row.contains("finger-2")));
    let rows = shown(&monitor(look(devices(1))), 40, 11);
    assert_shows(&rows, &["finger-0  +0.0123  -0.0456  +0.1000 m", "trip nothing recorded"]);
    for (width, height) in (0..60).flat_map(|width| (0..20).map(move |height| (width, height))) {
        let mut monitor = monitor(look(devices(3)));
        shown(&monitor, width, height);
        monitor.lose(Some("stopped in tick 5".into()));
        monitor.press(Key::Pause);
        shown(&monitor, width, height);
    }
}

#[test]
fn a_terminal_that_changes_its_size_is_drawn_anew() {
    let monitor = monitor(look(vec![device("right", [1.0; 3], Some(8.5))]));
    let mut terminal = terminal(120, 30);
    draw(&monitor, &mut terminal);
    for (width, height) in [(40, 10), (80, 24)] {
        terminal.backend_mut().resize(width, height);
        assert_eq!(draw(&monitor, &mut terminal), shown(&monitor, width, height));
    }
}

#[test]
fn pausing_holds_the_picture_and_going_on_shows_the_newest() {
    let at = |x| {
        let mut there = device("right", [0.0; 3], Some(8.5));
        there.position_m[0] = x;
        look(vec![there])
    };
    let mut monitor = monitor(at(0.1));
    monitor.press(Key::Pause);
    monitor.see(at(0.2), commander());
    assert_shows(&shown(&monitor, 80, 24), &["PAUSED", "+0.1000  -0.0456"]);
    monitor.press(Key::Pause);
    monitor.see(at(0.2), commander());
    let rows = shown(&monitor, 80, 24);
    assert_shows(&rows, &["+0.2000  -0.0456"]);
    assert!(!rows.iter().any(|row| row.contains("PAUSED")));
}

#[test]
fn a_reset_forgets_the_maxima_and_keeps_what_comes_after() {
    let mut monitor = monitor(Look { latencies: latencies(&[9_000_000]), ..look(Vec::new()) });
    assert_shows(&shown(&monitor, 80, 24), &["wake error  9000.00  9000.00  9000.00  9000.00"]);
    monitor.press(Key::Reset);
    assert_shows(&shown(&monitor, 80, 24), &["wake error nothing recorded"]);
    monitor.see(Look { latencies: latencies(&[9_000_000, 31]), ..look(Vec::new()) }, None);
    // Below 32 ns buckets have one value.
    assert_shows(&shown(&monitor, 80, 24), &["wake error     0.03     0.03     0.03     0.03"]);
    let mut other = Look { latencies: latencies(&[5_000]), ..look(Vec::new()) };
    other.status.driver_pid = 4712;
    monitor.see(other, None);
    assert_shows(&shown(&monitor, 80, 24), &["wake error     5.00     5.00     5.00     5.00"]);
}

#[test]
fn a_histogram_has_its_cells_where_its_axis_says_and_logarithms_for_heights() {
    let mut histogram = Histogram::new();
    (0..9_999).for_each(|_| histogram.record(1_500));
    (0..99).for_each(|_| histogram.record(150_000));
    histogram.record(50);
    histogram.record(60_000_000_000);
    let bar = crate::monitor::bar::histogram(&histogram, 50);
    let axis = crate::monitor::bar::axis(50);
    // Ten cells for each power of ten. 0.05 us and 60 s are in the outermost cells. ln(100) / ln(10000) of 8 is 4, and
    // ln(2) / ln(10000) of 8 is 0.6.
    let expected: String = [("▁", 0), ("█", 11), ("▄", 31), ("▁", 49)]
        .iter()
        .scan(0, |next, (block, cell)| {
            let gap = " ".repeat(cell - *next);
            *next = cell + 1;
            Some(gap + block)
        })
        .collect();
    assert_eq!(bar, expected);
    assert_eq!(axis.find("100 "), Some(30));
    assert_eq!(axis.find("1 "), Some(2), "of 0.1");
    assert_eq!(crate::monitor::bar::histogram(&Histogram::new(), 3), "   ");
    assert_eq!(crate::monitor::bar::histogram(&histogram, 0), "");
}

#[test]
fn a_driver_that_has_ended_is_told_with_its_last_words_until_there_is_another_one() {
    let mut monitor = monitor(look(vec![device("right", [1.0; 3], Some(8.5))]));
    monitor.lose(Some("stopped in tick 123456".into()));
    let rows = shown(&monitor, 80, 24);
    assert_shows(
        &rows,
        &["DRIVER GONE", "The driver has ended: stopped in tick 123456. Waiting for its return", "right"],
    );
    monitor.hear_why_not("no driver is running".into());
    assert_shows(&shown(&monitor, 100, 24), &["Waiting for its return (no driver is running)"]);
    monitor.see(look(Vec::new()), None);
    let rows = shown(&monitor, 80, 24);
    assert!(!rows.iter().any(|row| row.contains("GONE")));
    assert_shows(&rows, &["lease 2   commanded by a process not to be seen from here"]);
}

#[test]
fn a_driver_that_stands_still_is_noticed() {
    let mut monitor = monitor(look(Vec::new()));
    monitor.see(Look { at: Duration::from_millis(3500), ..look(Vec::new()) }, None);
    assert_shows(&shown(&monitor, 80, 24), &["no tick for 3 s", "   0.0 Hz"]);
}

#[test]
fn the_help_fits_the_smallest_screen() {
    let mut monitor = monitor(look(Vec::new()));
    monitor.press(Key::Help);
    let rows = shown(&monitor, 42, 10);
    assert_shows(&rows, &["q, Esc, Ctrl-C   leave", "pause", "forget", "it counts."]);
    monitor.press(Key::Help);
    assert_shows(&shown(&monitor, 80, 24), &["ACTIVE"]);
}
