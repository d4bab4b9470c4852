//! Scenes with everything that a scene may have, their models, pictures and hand.
//!
//! There are two, because fingers with a radius feel no solids joined of others.

use std::fmt::Write as _;
use std::path::Path;

/// How long the hand is on its way (s).
pub const SECONDS: f64 = 5.0;

/// Names of the entities, in the order in which the fingers come over them, from -x to x.
pub const ENTITIES: [&str; 4] = ["model", "raised", "ring", "patches"];

const PICTURE: &[u8] = include_bytes!("../../config/pictures/bumps.png");
const PATCHES: &str = include_str!("../../config/nurbs/ball.toml");

const EFFECTS: &str = r#"
hand = "hand.csv"
[[field]]
kind = "viscous"
damping_n_s_per_m = 2.0
shape = { kind = "box", size_m = [0.3, 0.1, 0.1] }
[[field]]
kind = "inertial"
mass_kg = 0.05
[[field]]
kind = "constant"
force_n = [0.0, -0.1, 0.0]
[[guide]]
kind = "path"
points_m = [[-0.2, 0.004, 0.0], [0.0, 0.006, 0.01], [0.2, 0.004, 0.0]]
stiffness_n_per_m = 100.0
capture_m = 0.004
break_away_n = 0.9
"#;

const BODIES: &str = r#"
[[entity]]
name = "model"
shape = { kind = "mesh", file = "block.obj" }
position_m = [-0.14, 0.0, 0.0]
material = "wood"
damping_n_s_per_m = 0.5
shading = { kind = "regions", length_m = 0.004 }
height_map = { file = "bumps.png", amplitude_m = 0.0005, zero_level = 1.0 }
magnetism = { force_n = 0.5, distance_m = 0.006 }
vibration = { frequency_hz = 90.0, amplitude_n = 0.1 }
[[entity]]
name = "raised"
shape = { kind = "box", size_m = [0.06, 0.04, 0.06] }
position_m = [-0.05, -0.02, 0.0]
material = "rubber"
stiffness_n_per_m = 500.0
shading = { kind = "regions" }
height_map = { file = "bumps.png", amplitude_m = 0.0004, size_m = [0.02, 0.02] }
magnetism = { force_n = 0.5, distance_m = 0.006 }
vibration = { frequency_hz = 110.0, amplitude_n = 0.1 }
[[entity]]
name = "ring"
shape = { kind = "torus", ring_radius_m = 0.011, tube_radius_m = 0.01 }
position_m = [0.03, -0.01, 0.011]
friction = { model = "lugre", mu_s = 0.6, mu_d = 0.4 }
height_map = { file = "bumps.png", amplitude_m = 0.0002, repeat = [8, 8], form = "along-force" }
magnetism = { force_n = 0.3, distance_m = 0.006 }
[[entity]]
name = "patches"
shape = { kind = "nurbs", file = "ball.toml" }
position_m = [0.12, -0.04, 0.0]
material = "glass"
vibration = { frequency_hz = 130.0, amplitude_n = 0.1 }
"#;

const SOLID: &str = r#"
[[entity]]
name = "solid"
shape = { kind = "csg", op = "difference", children = [{ shape = { kind = "box", size_m = [0.03, 0.04, 0.06] } }, { shape = { kind = "cylinder", radius_m = 0.006, length_m = 0.2 }, position_m = [0.0, 0.0, 0.013] }] }
position_m = [0.07, -0.02, 0.0]
material = "skin"
vibration = { frequency_hz = 70.0, amplitude_n = 0.1 }
"#;

/// Writes `scene.toml` and all that belongs to it; with round fingers, or with points.
pub fn write(directory: &Path, is_round: bool) {
    let mut scene = String::from(EFFECTS);
    let radius = if is_round { "radius_m = 0.003\n" } else { "" };
    let _ = write!(
        scene,
        "[[finger]]\n{radius}[[finger]]\n{radius}passivity = true\n[[finger]]\npassivity = {{ bound_j = 0.001 }}\n"
    );
    scene += BODIES;
    scene += SOLID;
    let files: [(&str, &[u8]); 5] = [
        ("scene.toml", scene.as_bytes()),
        ("hand.csv", &hand().into_bytes()),
        ("block.obj", &block().into_bytes()),
        ("bumps.png", PICTURE),
        ("ball.toml", PATCHES.as_bytes()),
    ];
    for (name, bytes) in files {
        std::fs::write(directory.join(name), bytes).expect("a file");
    }
}

/// Three fingers, one behind the other, over all of it and back.
fn hand() -> String {
    let mut text = String::from("t");
    for finger in 0..3 {
        let _ = write!(text, ",f{finger}_x,f{finger}_y,f{finger}_z");
    }
    text.push('\n');
    for i in 0..=500 {
        let t = f64::from(i) * SECONDS / 500.0;
        let _ = write!(text, "{t:?}");
        for finger in [0.0, 1.0, 2.0] {
            let along = -0.19 * (std::f64::consts::TAU * t / SECONDS + 0.3 * finger).cos();
            let height = above(along) + 0.0005 * (40.0 * t + finger).sin();
            let _ = write!(text, ",{along:?},{height:?},{:?}", 0.006 * finger - 0.006);
        }
        text.push('\n');
    }
    text
}

/// 3 mm deep in the middle of each entity, and 6 mm above what is between them: whoever comes in by a side is held there.
fn above(x: f64) -> f64 {
    let places = [(-0.14, 0.02), (-0.05, 0.02), (0.03, 0.02), (0.07, 0.013), (0.12, 0.02)];
    let dips = places.map(|(middle, width): (f64, f64)| ((x - middle).abs() / width).min(1.0));
    let nearest = dips.into_iter().fold(1.0, f64::min);
    0.006 - 0.009 * (std::f64::consts::FRAC_PI_2 * nearest).cos().powi(2)
}

/// A block whose upper side, at y = 0, has pictures of 20 mm on it.
fn block() -> String {
    let corners = [[-0.03, -0.03], [0.03, -0.03], [0.03, 0.03], [-0.03, 0.03]];
    let mut obj = String::new();
    for [x, z] in corners {
        let _ = write!(obj, "v {x} 0 {z}\nvt {} {}\n", x / 0.02 + 0.5, 0.5 - z / 0.02);
    }
    for [x, z] in corners {
        let _ = writeln!(obj, "v {x} -0.05 {z}");
    }
    obj += "f 4/4 3/3 2/2 1/1\nf 5/1 6/1 7/1 8/1\n";
    for (a, b) in [(1, 2), (2, 3), (3, 4), (4, 1)] {
        let _ = writeln!(obj, "f {a}/1 {b}/2 {}/3 {}/4", b + 4, a + 4);
    }
    obj
}
