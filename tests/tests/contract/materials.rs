//! Materials: each loads by its name and feels as the table that the program prints says.

use system_tests::workplace::{Workplace, felt, hand};

/// Name, mu_s, mu_d, stiffness (N/m) and damping (N s/m) as `phantom3 materials` prints them.
fn printed() -> Vec<(String, [f64; 4])> {
    let said = Workplace::new().run(["materials"]);
    assert_eq!((said.status, said.err.as_str()), (Some(0), ""));
    let rows = said.out.lines().skip(1).filter(|line| !line.starts_with("Friction"));
    rows.map(|line| {
        let words: Vec<&str> = line.split_whitespace().collect();
        assert!(words.len() > 5, "the source of its friction: {line}");
        (words[0].to_owned(), [1, 2, 3, 4].map(|i| words[i].parse().expect("a number")))
    })
    .collect()
}

fn table(keys: &str) -> String {
    format!(
        "[[finger]]\n[[entity]]\nname = \"table\"\n\
         shape = {{ kind = \"plane\", normal = [0.0, 1.0, 0.0], offset_m = 0.0 }}\n{keys}\n"
    )
}

#[test]
fn every_material_feels_as_the_printed_table_says() {
    let materials = printed();
    assert!(materials.len() >= 10);
    for (name, [mu_s, mu_d, stiffness, damping]) in materials {
        // 1 N deep, and along: far enough for the softest.
        let depth = 1.0 / stiffness;
        let way = hand([(0.0, [0.0, -depth, 0.0]), (1.0, [0.03, -depth, 0.0])]);
        let (mut held, mut slid) = (0.0f64, 0);
        for s in felt(&table(&format!("material = \"{name}\"")), &way, &[]) {
            // Products and quotients of a few numbers near 1; damping of roundings of a depth over 1 ms.
            assert!((s.force.y - 1.0).abs() < 1e-12, "{name}: {s:?}");
            let drag = -s.force.x / s.force.y;
            if s.friction == "slip" {
                assert!((drag - mu_d).abs() < 1e-9, "{name}: {s:?}");
                slid += 1;
            } else {
                // While it sticks the damper adds to the spring: 0.03 m/s.
                held = held.max((s.hip.x - s.god.x) * stiffness);
            }
        }
        assert!(slid > 100, "{name}: {slid}");
        // A tick's way of 0.03 mm is the resolution of where it broke away.
        assert!(
            held <= mu_s + 1e-9 && held > mu_s - 3.1e-5 * stiffness,
            "{name}: {held}, damped by {damping}"
        );
    }
}

#[test]
fn damping_of_a_material_is_felt_on_the_way_in() {
    let way = hand([(0.0, [0.0, 0.01, 0.0]), (1.0, [0.0, -0.01, 0.0])]);
    for s in felt(&table("material = \"rubber\""), &way, &[]).iter().filter(|s| s.hip.y < -1e-4 && s.t < 1.0)
    {
        // 0.02 m/s, 2 N s/m; differences of positions of 1e-2 m over 1 ms.
        assert!((s.force.y - (-400.0 * s.hip.y + 0.04)).abs() < 1e-11, "{s:?}");
    }
}

#[test]
fn what_the_entity_says_wins_over_its_material() {
    let keys = "material = \"rubber\"\nstiffness_n_per_m = 500\ndamping_n_s_per_m = 0\n\
                friction = { model = \"coulomb\", mu = 0.2 }";
    let way = hand([(0.0, [0.0, -0.002, 0.0]), (1.0, [0.03, -0.002, 0.0])]);
    let samples = felt(&table(keys), &way, &[]);
    let last = &samples[999];
    assert_eq!((last.force.y, last.friction.as_str()), (1.0, "slip"));
    assert!((last.force.x + 0.2).abs() < 1e-9, "{last:?}");
}

#[test]
fn an_unknown_material_is_refused_with_those_that_there_are() {
    let place = Workplace::new();
    place.write("scene.toml", table("material = \"aluminum\""));
    let said = place.run(["run", "scene.toml", "--clock", "virtual"]);
    assert_eq!(said.status, Some(2));
    assert!(
        said.err.contains("scene.toml:5: entity[0].material: unknown material `aluminum`"),
        "{}",
        said.err
    );
    for (name, _) in printed() {
        assert!(said.err.contains(&name), "{name}: {}", said.err);
    }
}

#[test]
fn a_cube_of_a_material_weighs_its_volume_times_the_printed_density() {
    let said = Workplace::new().run(["materials"]);
    let density = |name: &str| {
        let line = said.out.lines().find(|line| line.starts_with(name)).expect("a line");
        line.split_whitespace().nth(5).expect("a density").parse::<f64>().expect("a number")
    };
    for name in ["foam", "wood", "aluminium", "steel"] {
        let scene = format!(
            "gravity_m_s2 = [0, 0, 0]\n[[finger]]\n[[entity]]\nname = \"cube\"\n\
             shape = {{ kind = \"box\", size_m = [0.05, 0.05, 0.05] }}\nmaterial = \"{name}\"\nmovable = true\n"
        );
        // A finger pushes it.
        let way = hand([(0.0, [-0.03, 0.0, 0.0]), (0.5, [0.02, 0.0, 0.0])]);
        let table = Workplace::new().play(&scene, &way, &[]);
        let (cube, finger) = (table.body("cube"), table.finger("f0"));
        let mass = density(name) * 0.05_f64.powi(3);
        let mut pushed = 0;
        for (pair, finger) in cube.windows(2).zip(&finger) {
            let force = (pair[1].velocity - pair[0].velocity) * (mass / 1e-3);
            // Rounding of 0.2 m/s over a tick, times a kilogram.
            assert!((force + finger.force).norm() < 1e-12, "{name}: {force} {finger:?}");
            pushed += usize::from(finger.force.x < -1e-3);
        }
        assert!(pushed > 5, "{name}: {pushed}");
    }
}
