//! Force shading, felt through scene file, model file, hand file and recording alone.

use crate::written::Format;
use haptics::mesh::make;
use nalgebra::Vector3;
use system_tests::recording::Sample;
use system_tests::workplace::{Workplace, hand};

const BALL: &str = "kind = \"mesh\", file = \"ball.obj\"";
const BOX: &str = "kind = \"box\", size_m = [0.1, 0.1, 0.1]";

/// What a scene around this shape makes of a path; nothing may be said on standard error.
fn felt(shape: &str, rest: &str, path: &str) -> Vec<Sample> {
    let place = Workplace::new();
    place.write("ball.obj", Format::Obj.write(&make::uv_sphere(16, 9, 0.05)));
    let scene = format!(
        "[[finger]]\nstart_m = [0.0, 0.2, 0.0]\n[[entity]]\nname = \"thing\"\n\
         shape = {{ {shape} }}\nstiffness_n_per_m = 1000.0\n{rest}\n"
    );
    let samples = place.play(&scene, path, &[]).finger("f0");
    samples.iter().for_each(Sample::check);
    samples.into_iter().filter(Sample::touches).collect()
}

/// Around the ball, about 2 mm below its facets.
fn around_ball() -> String {
    let at = |r: f64, turn: f64| [r * turn.cos(), 0.3 * r, r * turn.sin()];
    let arc = (0..=1000).map(|i| (0.3 + f64::from(i) * 1e-3, at(0.043, 5e-3 * f64::from(i))));
    hand([(0.0, at(0.06, 0.0))].into_iter().chain(arc))
}

/// Straight over the top of the box and its edge, 2 mm deep.
fn over_box() -> String {
    hand([(0.0, [0.0, 0.06, 0.01]), (0.2, [0.0, 0.048, 0.01]), (1.2, [0.052, 0.048, 0.01])])
}

/// The mean angle between the force and the direction from the ball's middle (degrees).
fn off_a_ball(samples: &[Sample]) -> f64 {
    assert!(samples.len() > 900, "{}", samples.len());
    samples.iter().map(|s| s.force.angle(&s.hip).to_degrees()).sum::<f64>() / samples.len() as f64
}

#[test]
fn an_interpolated_mesh_of_a_scene_feels_like_the_ball_it_stands_for() {
    let path = around_ball();
    let facets = off_a_ball(&felt(BALL, "", &path));
    let shaded = |keys: &str| {
        off_a_ball(&felt(BALL, &format!("shading = {{ kind = \"interpolated\"{keys} }}"), &path))
    };
    // Facets of 20 by 22 degrees.
    assert!(facets > 3.0, "{facets}");
    let [round, half, sharp] = ["", ", form = \"bisect\"", ", crease_angle_deg = 10.0"].map(shaded);
    assert!(round < facets / 5.0, "{round} of {facets}");
    // Half way there; the part of an angle that leans sideways adds up a little differently.
    assert!((half - 0.5 * facets).abs() < 0.15 * facets, "{half} of {facets}");
    // All edges are sharper than that, but for the flat diagonals.
    assert!((sharp - facets).abs() < 1e-6, "{sharp} of {facets}");
}

#[test]
fn a_mesh_with_regions_is_between_its_facets_and_a_ball() {
    let path = around_ball();
    let off = |length: &str| {
        let keys = format!("shading = {{ kind = \"regions\", length_m = {length}, crease_angle_deg = 60 }}");
        off_a_ball(&felt(BALL, &keys, &path))
    };
    let facets = off_a_ball(&felt(BALL, "", &path));
    let [long, short] = [off("0.1"), off("1e-5")];
    assert!(long < 0.8 * facets && (short - facets).abs() < 0.02 * facets, "{long} {short} {facets}");
}

#[test]
fn a_box_with_regions_rounds_its_edges_and_keeps_its_faces() {
    let path = over_box();
    let l = 0.005;
    let flat = felt(BOX, "", &path);
    let shaded = felt(BOX, "shading = { kind = \"regions\", length_m = 0.005 }", &path);
    assert!(flat.len() > 900 && flat.len() == shaded.len(), "{}", flat.len());
    let mut turned = 0;
    for (flat, s) in flat.iter().zip(&shaded) {
        assert_eq!(flat.god, s.god);
        let alpha = (0.5 + 0.5 * (0.05 - s.hip.x) / l).min(1.0);
        let expected = Vector3::new(1.0 - alpha, alpha, 0.0).normalize() * flat.force.norm();
        // The recording has nine digits of a newton.
        assert!((s.force - expected).norm() < 1e-8, "{s:?}, not {expected:?}");
        turned += u32::from(alpha < 1.0);
    }
    assert!(turned > 80, "{turned}");
}

#[test]
fn shading_a_ball_that_is_none_of_triangles_is_refused_with_its_place() {
    let place = Workplace::new();
    let scene = "[[finger]]\n[[entity]]\nshape = { kind = \"sphere\", radius_m = 0.05 }\n\
                 shading = { kind = \"interpolated\" }\n";
    place.write("s.toml", scene);
    let said = place.run(["run", "s.toml", "--clock", "virtual", "--headless"]);
    assert_eq!(said.status, Some(2), "{said:?}");
    let wanted = "s.toml:4: entity[0].shading.kind: found the string \"interpolated\"; \
                  allowed: interpolated or regions on a mesh, regions on a box without scale; this is a sphere";
    assert!(said.err.contains(wanted), "{said:?}");
}
