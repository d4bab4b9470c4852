//! Everything that a scene may have, in one scene: the same on all clocks, and bounded.

use nalgebra::Vector3;
use system_tests::everything::{self, ENTITIES};
use system_tests::recording::Table;
use system_tests::workplace::Workplace;

fn played(place: &Workplace, more: &[&str], name: &str) -> Table {
    let mut all = vec!["run", "scene.toml", "--headless", "--record", name];
    all.extend(more);
    let said = place.run(all);
    assert_eq!(said.status, Some(0), "{}", said.err);
    Table::read(&place.path(name))
}

fn directory(is_round: bool) -> Workplace {
    let place = Workplace::new();
    everything::write(place.path("scene.toml").parent().expect("a directory"), is_round);
    place
}

#[test]
fn with_everything_in_it_lockstep_writes_what_one_process_writes_and_all_of_it_is_felt() {
    for is_round in [false, true] {
        let place = directory(is_round);
        let table = played(&place, &["--clock", "virtual"], "virtual.csv");
        played(&place, &["--clock", "lockstep"], "lockstep.csv");
        let [one, two] =
            ["virtual.csv", "lockstep.csv"].map(|name| std::fs::read(place.path(name)).expect("a recording"));
        assert!(one == two, "round: {is_round}");
        for finger in ["f0", "f1", "f2"] {
            let touched = table.texts(&format!("{finger}_entity"));
            let solid = (!is_round).then_some("solid");
            for name in ENTITIES.into_iter().chain(solid) {
                let ticks = touched.iter().filter(|touched| **touched == name).count();
                assert!(ticks > 20, "{finger} on {name}, round {is_round}: {ticks} ticks");
            }
            // At most 3.5 mm deep, a ball 3 mm more, at 1000 N/m, with friction of 1.12 of it, and effects of 4 N beside it.
            let forces = table.vectors(&format!("{finger}_force"));
            let largest = forces.iter().map(Vector3::norm).fold(0.0, f64::max);
            assert!(forces.iter().all(|force| force.iter().all(|f| f.is_finite())));
            assert!((1.0..16.0).contains(&largest), "{finger}, round {is_round}: {largest}");
        }
    }
}

#[test]
fn with_everything_in_it_a_simulated_hand_is_pushed_out_and_not_shaken() {
    for is_round in [false, true] {
        let place = directory(is_round);
        let more = ["--clock", "virtual", "--hand-mode", "impedance"];
        let table = played(&place, &more, "out.csv");
        assert_eq!(table.len(), 5000);
        for finger in ["f0", "f1", "f2"] {
            let hips = table.vectors(&format!("{finger}_hip"));
            // The hand goes at 0.24 m/s at most, and a device held lightly may let go of what it stuck to; but a millimetre
            // a tick is 1 m/s, a finger thrown.
            let fastest = hips.windows(2).map(|two| (two[1] - two[0]).norm()).fold(0.0, f64::max);
            assert!(fastest < 1e-3, "{finger}, round {is_round}: {fastest}");
            let touched = table.texts(&format!("{finger}_entity"));
            // Held lightly, it is carried over most of it by the guide.
            let ticks = touched.iter().filter(|name| !name.is_empty()).count();
            assert!(ticks > 30, "{finger}, round {is_round}: {ticks} ticks");
        }
    }
}

/// A rail is drawn off by 8 mm and let back, twice: passivity has nothing to take from it.
#[test]
fn a_guide_gives_back_to_a_passive_finger_what_it_took() {
    let rail = "[[guide]]\nkind = \"line\"\npoint_m = [0.0, 0.06, 0.0]\ndirection = [1.0, 0.0, 0.0]\n\
                [[finger]]\npassivity = true\n";
    let hand =
        "t,f0_x,f0_y,f0_z\n0,0,0.06,0\n0.5,0,0.06,0\n1,0,0.068,0\n1.5,0,0.06,0\n2,0,0.068,0\n2.5,0,0.06,0\n";
    let place = Workplace::new();
    let table = place.play(rail, hand, &[]);
    let pulled = table.vectors("f0_force").iter().map(Vector3::norm).fold(0.0, f64::max);
    // 8 mm at 500 N/m, and 2 N s/m at 16 mm/s.
    assert!((pulled - 4.032).abs() < 1e-6, "{pulled}");
    assert!(table.numbers("f0_controlled").iter().all(|changed| *changed == 0.0));
}

#[test]
fn what_does_not_go_together_is_refused_in_words_with_its_line() {
    let csg =
        "kind = \"csg\", op = \"union\", children = [{ shape = { kind = \"sphere\", radius_m = 0.05 } }]";
    let cases = [
        (
            "",
            csg,
            "magnetism = { force_n = 1.0, distance_m = 0.01 }",
            &["scene.toml:3: entity e is a csg, which cannot have magnetism; allowed: no magnetism"][..],
        ),
        (
            "",
            "kind = \"nurbs\", file = \"ball.toml\"",
            "magnetism = { force_n = 1.0, distance_m = 0.01 }",
            &["scene.toml:3: entity e is a nurbs, which cannot"],
        ),
        (
            "",
            "kind = \"nurbs\", file = \"ball.toml\"",
            "height_map = { file = \"bumps.png\", amplitude_m = 0.001 }",
            &["scene.toml:6: entity[0].height_map: this shape has no coordinates"],
        ),
        (
            "",
            csg,
            "height_map = { file = \"bumps.png\", amplitude_m = 0.001 }",
            &["scene.toml:6: entity[0].height_map: this shape has no coordinates"],
        ),
        (
            "",
            csg,
            "algorithm = \"classic\"",
            &["scene.toml:3: entity e is a csg, which algorithm classic cannot render"],
        ),
        (
            "radius_m = 0.002",
            "kind = \"cylinder\", radius_m = 0.05, length_m = 0.1, scale = [1.0, 1.0, 0.8]",
            "algorithm = \"classic\"",
            &["scene.toml:3: finger f0 has radius_m = 0.002", "algorithm = \"friction-cone\""],
        ),
        (
            "",
            "kind = \"nurbs\", file = \"none.toml\"",
            "",
            &["entity[0].shape.file: none.toml: no such file; name an existing one"],
        ),
    ];
    for (finger, shape, key, parts) in cases {
        let place = directory(false);
        place.write(
            "scene.toml",
            format!("[[finger]]\n{finger}\n[[entity]]\nname = \"e\"\nshape = {{ {shape} }}\n{key}\n"),
        );
        let said = place.run(["run", "scene.toml", "--clock", "virtual", "--headless", "--seconds", "0.1"]);
        assert_eq!((said.status, said.err.lines().count()), (Some(2), 1), "{}", said.err);
        for part in parts {
            assert!(said.err.contains(part), "`{part}` is missing in: {}", said.err);
        }
    }
}
