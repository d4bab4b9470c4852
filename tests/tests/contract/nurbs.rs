//! Rational patches, felt through scene file, file of patches, hand file and recording alone; and files that are none.

use haptics::NurbsPatch;
use haptics::nurbs::make;
use system_tests::recording::Sample;
use system_tests::workplace::{Said, Workplace, hand};
use world::model::write_patches;

fn scene(shape: &str, rest: &str) -> String {
    format!(
        "[[finger]]\nstart_m = [0.0, 0.2, 0.0]\n[[entity]]\nname = \"thing\"\n\
         shape = {{ {shape} }}\nstiffness_n_per_m = 1000.0\n{rest}"
    )
}

fn felt(files: &[(&str, &str)], scene: &str, path: &str) -> Vec<Sample> {
    let place = Workplace::new();
    for (name, text) in files {
        place.write(name, text);
    }
    let samples = place.play(scene, path, &[]).finger("f0");
    samples.iter().for_each(Sample::check);
    samples
}

/// Down on the pole, over a seam and the equator, and away.
fn around_the_ball() -> String {
    hand([
        (0.0, [0.0, 0.06, 0.0]),
        (0.2, [0.0, 0.038, 0.0]),
        (0.8, [0.021, 0.032, -0.002]),
        (1.4, [0.038, 0.001, 0.004]),
        (2.0, [0.012, -0.011, -0.034]),
        (2.2, [0.02, -0.03, -0.06]),
    ])
}

const FRICTIONS: [&str; 3] = [
    "",
    "friction = { model = \"coulomb\", mu = 0.4 }\n",
    "friction = { model = \"stiction\", mu_s = 0.6, mu_d = 0.3 }\n",
];

/// In millimetres, so that `scale` counts.
fn ball_mm() -> Vec<NurbsPatch> {
    make::sphere(40.0)
}

#[test]
fn a_ball_of_patches_feels_like_a_sphere_tick_by_tick() {
    let text = write_patches(&ball_mm());
    for friction in FRICTIONS {
        let of_patches = scene("kind = \"nurbs\", file = \"ball.toml\", scale = 0.001", friction);
        let of_equations = scene("kind = \"sphere\", radius_m = 0.04", friction);
        let path = around_the_ball();
        let patches = felt(&[("ball.toml", &text)], &of_patches, &path);
        let spheres = felt(&[], &of_equations, &path);
        let touching = spheres.iter().filter(|s| s.touches()).count();
        assert!(touching > 1500, "{touching}");
        for (patch, sphere) in patches.iter().zip(&spheres) {
            let difference_n = (patch.force - sphere.force).norm();
            // 1e-9 of the force, and 1e-12 m of position.
            let allowed_n = 1e-9 * (1.0 + sphere.force.norm());
            assert!(difference_n <= allowed_n, "{friction}: {difference_n} N\n{patch:?}\n{sphere:?}");
            assert_eq!(patch.friction, sphere.friction, "{patch:?}\n{sphere:?}");
        }
    }
}

#[test]
fn scaled_by_three_factors_a_ball_is_an_ellipsoid() {
    let text = write_patches(&ball_mm());
    let of_patches = scene("kind = \"nurbs\", file = \"ball.toml\", scale = [0.001, 0.0005, 0.00075]", "");
    let of_equations = scene("kind = \"ellipsoid\", radii_m = [0.04, 0.02, 0.03]", "");
    let path = hand([(0.0, [0.01, 0.06, 0.0]), (0.5, [0.01, 0.017, 0.0]), (1.5, [-0.012, 0.016, 0.006])]);
    let patches = felt(&[("ball.toml", &text)], &of_patches, &path);
    let ellipsoids = felt(&[], &of_equations, &path);
    assert!(ellipsoids.iter().filter(|s| s.touches()).count() > 700);
    for (patch, ellipsoid) in patches.iter().zip(&ellipsoids) {
        assert!((patch.force - ellipsoid.force).norm() <= 1e-9 * (1.0 + ellipsoid.force.norm()));
    }
}

#[test]
fn files_that_are_no_patches_are_refused_with_both_places() {
    let good = write_patches(&make::mouse(0.08));
    let cases = [
        (
            "p.toml",
            good.replacen("degree = [2, 2]", "degree = [9, 2]", 1),
            vec!["p.toml:2: patch[0].degree", "degree u: 9"],
        ),
        (
            "p.obj",
            "v 0 0 0\ncstype cardinal\n".into(),
            vec!["p.obj", "line 2: found `cardinal`", "`cstype bspline` or `cstype bezier`"],
        ),
        ("p.step", String::new(), vec!["p.step", "neither TOML nor OBJ"]),
        // One patch three times: nobody could say what lies beyond its edges.
        ("p.toml", good.repeat(2), vec!["p.toml", "an edge through", "two patches at an edge"]),
    ];
    for (file, text, parts) in cases {
        let place = Workplace::new();
        place.write(file, &text);
        place.write("scene.toml", scene(&format!("kind = \"nurbs\", file = \"{file}\""), ""));
        let said: Said =
            place.run(["run", "scene.toml", "--clock", "virtual", "--headless", "--record", "out.csv"]);
        assert!(said.status.is_some_and(|status| status != 0), "{file}: {said:?}");
        for part in ["scene.toml:5: entity[0].shape.file"].iter().chain(&parts) {
            assert!(said.err.contains(part), "{part}: {}", said.err);
        }
    }
}
