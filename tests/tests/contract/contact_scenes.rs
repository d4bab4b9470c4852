//! The scenes of docs/contacts.md do what the page says, and the page has a picture of each.

use std::path::Path;
use system_tests::recording::Table;
use system_tests::workplace::Workplace;

/// [m/s^2]
const G: f64 = 9.81;
const TICK_S: f64 = 1e-3;

fn project(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the project").join(path).display().to_string()
}

fn played(scene: &str, seconds: &str) -> Table {
    let place = Workplace::new();
    let file = project(&format!("config/scenes/contacts/{scene}.toml"));
    let said =
        place.run(["run", file.as_str(), "--clock", "virtual", "--seconds", seconds, "--record", "r.csv"]);
    assert_eq!(said.status, Some(0), "{scene}: {}", said.err);
    Table::read(&place.path("r.csv"))
}

fn check(what: &str, found: f64, expected: f64, within: f64) {
    assert!((found - expected).abs() <= within, "{what}: {found}, expected {expected} within {within}");
}

#[test]
fn balls_of_the_scene_bounce_as_high_as_their_restitution_says() {
    let table = played("bounce", "1");
    for (name, e) in [("e-0_0", 0.0), ("e-0_5", 0.5), ("e-0_8", 0.8), ("e-0_95", 0.95_f64)] {
        let heights = table.numbers(&format!("{name}_y"));
        // It falls until it rises again, or is at rest.
        let lowest = heights.windows(2).position(|pair| pair[1] >= pair[0] && pair[0] < 0.1);
        let highest =
            heights[lowest.expect("it has come down")..].iter().map(|y| y - 0.02).fold(0.0, f64::max);
        // A bounce begins and ends within a tick, in which it moves 2 mm.
        check(name, highest, 0.2 * e * e, 0.003);
    }
}

#[test]
fn boxes_of_the_scene_slide_as_far_as_their_friction_says() {
    let table = played("slide", "1");
    for (name, mu) in [("mu-0_2", 0.2), ("mu-0_4", 0.4), ("mu-0_6", 0.6)] {
        let x = table.numbers(&format!("{name}_x"));
        // They settle on the floor while they begin to slide: some ticks at 1 m/s.
        let way = x[x.len() - 1] - x[0];
        check(name, way, 0.5 / (mu * G), 10.0 * TICK_S);
    }
}

#[test]
fn balls_of_the_scene_roll_as_far_and_spin_as_long_as_their_friction_says() {
    let table = played("roll", "2");
    for (name, rho) in [("rho-0_0-mm", 0.0), ("rho-0_2-mm", 2e-4), ("rho-1_0-mm", 1e-3)] {
        let x = table.numbers(&format!("{name}_x"));
        let braking = rho * G / (1.4 * 0.02);
        let expected = if braking * 2.0 < 0.3 { 0.3 * 2.0 - 0.5 * braking * 4.0 } else { 0.045 / braking };
        check(name, x[x.len() - 1] - x[0], expected, 5.0 * TICK_S);
    }
    let table = played("spin", "1.2");
    for (name, s) in [("s-0_0-mm", 0.0), ("s-0_02-mm", 2e-5), ("s-0_1-mm", 1e-4)] {
        let spins = table.numbers(&format!("{name}_wy"));
        let braking = 2.5 * s * G / 0.02_f64.powi(2);
        let expected = if s == 0.0 { 1.2 } else { 1.0 / braking };
        let stopped = spins.iter().position(|w| w.abs() < 1e-3).unwrap_or(spins.len());
        // While it settles less presses.
        check(name, stopped as f64 * TICK_S, expected, 0.02);
    }
}

#[test]
fn boxes_of_the_scene_rest_as_deep_as_their_stiffness_says() {
    let table = played("settle", "1");
    for (name, k) in [("k-100", 100.0), ("k-400", 400.0), ("k-1600", 1600.0)] {
        let y = table.numbers(&format!("{name}_y"));
        check(name, 0.02 - y[y.len() - 1], 0.1 * G / (4.0 * k), 1e-6);
    }
}

#[test]
fn the_page_of_contacts_has_a_picture_of_each_scene() {
    let page = std::fs::read_to_string(project("docs/contacts.md")).expect("the page");
    let scenes = std::fs::read_dir(project("config/scenes/contacts")).expect("the scenes");
    for scene in scenes {
        let path = scene.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        assert!(page.contains(&format!("](contacts/{name}.svg)")), "{name}");
        assert!(Path::new(&project(&format!("docs/contacts/{name}.svg"))).exists(), "{name}");
    }
}
