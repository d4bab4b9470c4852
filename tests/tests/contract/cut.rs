//! The last line before a force is commanded, as a user sees it: silent on every scene that comes along, told otherwise.

use std::path::{Path, PathBuf};
use system_tests::recording::Table;
use system_tests::workplace::Workplace;

/// Scenes that have a hand of their own.
fn scenes() -> Vec<PathBuf> {
    let all = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the project").join("config/scenes");
    let (mut folders, mut scenes) = (vec![all], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if std::fs::read_to_string(&path).is_ok_and(|text| text.contains("\nhand = ")) {
                scenes.push(path);
            }
        }
    }
    scenes
}

#[test]
fn no_force_of_any_scene_that_comes_along_is_cut_whoever_moves_the_hand() {
    let scenes = scenes();
    assert!(scenes.len() > 7, "{scenes:?}");
    for scene in scenes {
        for mode in ["kinematic", "impedance"] {
            let place = Workplace::new();
            let file = scene.display().to_string();
            let run = ["run", &file, "--clock", "virtual", "--headless", "--hand-mode", mode];
            let said = place.run([&run[..], &["--events", "events.csv"]].concat());
            // Not every scene lies where the usual arm reaches.
            if mode == "impedance" && said.status == Some(2) && said.err.contains("this arm cannot reach") {
                continue;
            }
            assert_eq!(said.status, Some(0), "{file}: {}", said.err);
            let events = Table::read(&place.path("events.csv"));
            assert!(!events.texts("kind").is_empty(), "{file}: nothing happened");
            assert!(!events.texts("kind").contains(&"cut"), "{file} {mode}");
            assert!(!said.out.contains("\ncut "), "{file} {mode}: {}", said.out);
        }
    }
}

/// A magnetic ring through whose middle a finger goes: there the pull changes sides.
const RING: &str = "[[finger]]\nstart_m = [-0.01, 0.0, 0.0]\n\
    [[entity]]\nname = \"ring\"\nshape = { kind = \"torus\", ring_radius_m = 0.03, tube_radius_m = 0.01 }\n\
    magnetism = { force_n = 5, distance_m = 0.04 }\n";

#[test]
fn a_pull_that_changes_sides_is_cut_told_and_counted() {
    let place = Workplace::new();
    place.write(
        "hand.csv",
        "t,f0_x,f0_y,f0_z\n0,-0.01005,0,0\n1,-0.01005,0,0\n1.2,0.01005,0,0\n2,0.01005,0,0\n",
    );
    place.write("scene.toml", RING);
    let run = ["run", "scene.toml", "--hand", "hand.csv", "--clock", "virtual"];
    let said = place.run([&run[..], &["--events", "events.csv", "--record", "rows.csv"]].concat());
    assert_eq!(said.status, Some(0), "{}", said.err);
    assert!(said.out.contains("cut          1 times"), "{}", said.out);
    let events = Table::read(&place.path("events.csv"));
    let at = events.texts("kind").iter().position(|kind| *kind == "cut").expect("it is told");
    assert_eq!((events.texts("finger")[at], events.texts("entity")[at]), ("f0", ""));
    // 4.2 N on either side; one of them is let go, and of the other half a newton comes at once, and what the way explains.
    let cut_n: f64 = events.texts("force_n")[at].parse().expect("how much");
    assert!((cut_n - 3.5).abs() < 0.2, "{cut_n} N");
    let forces = Table::read(&place.path("rows.csv")).vectors("f0_force");
    // Once that is back, the pull is what it was as far on the other side.
    assert!((forces.last().expect("a row").norm() - forces[500].norm()).abs() < 1e-9);
}
