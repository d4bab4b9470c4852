//! Fingers with volume, felt through scene file, model file, hand file and recording alone.

use crate::written::Format;
use haptics::mesh::make;
use nalgebra::Vector3;
use system_tests::recording::{Sample, Table};
use system_tests::workplace::{Workplace, hand};

const RADIUS_M: f64 = 0.008;
const STIFFNESS_N_PER_M: f64 = 1000.0;
/// Exact in binary, in single precision and in decimals.
const HALF_M: f64 = 0.03125;

fn scene(shape: &str, rest: &str) -> String {
    format!(
        "[[finger]]\nradius_m = {RADIUS_M}\nstart_m = [0.0, 0.2, 0.0]\n[[entity]]\nname = \"thing\"\n\
         shape = {{ {shape} }}\nstiffness_n_per_m = {STIFFNESS_N_PER_M}\n{rest}"
    )
}

fn played(scene: &str, path: &str) -> Table {
    let place = Workplace::new();
    place.write("cube.obj", Format::Obj.write(&make::cuboid([2.0 * HALF_M; 3])));
    place.play(scene, path, &[])
}

/// Onto the top of the cube, along it, lightly round an edge, and away.
fn around_the_cube() -> String {
    hand([
        (0.0, [0.003, 0.05, 0.002]),
        (0.3, [0.003, 0.037, 0.002]),
        (0.9, [-0.013, 0.0373, 0.017]),
        (1.5, [0.0301, 0.0371, 0.011]),
        (1.7, [0.0355, 0.0355, 0.010]),
        (1.9, [0.0371, 0.0301, 0.008]),
        (2.4, [0.0374, -0.0151, -0.013]),
        (2.6, [0.0511, -0.0151, -0.013]),
    ])
}

#[test]
fn a_ball_feels_a_cube_of_triangles_as_it_feels_a_box_tick_by_tick() {
    for friction in ["", "friction = { model = \"coulomb\", mu = 0.4 }\n"] {
        let path = around_the_cube();
        let of_triangles = scene("kind = \"mesh\", file = \"cube.obj\"", friction);
        let of_equations = scene("kind = \"box\", size_m = [0.0625, 0.0625, 0.0625]", friction);
        let [meshes, boxes] = [&of_triangles, &of_equations].map(|scene| played(scene, &path).finger("f0"));
        meshes.iter().chain(&boxes).for_each(Sample::check);
        assert!(boxes.iter().filter(|s| s.touches()).count() > 2000);
        let edges = boxes.iter().filter(|s| s.feature == "edge").count();
        assert!(edges > 100, "{edges} ticks on an edge");
        for (mesh, box_) in meshes.iter().zip(&boxes) {
            // On faces both are exact. Round the edge each slides in steps of its own, and the direction turns with them:
            // ways of 1e-4 m on arcs of 8e-3 m differ by their square, 1.5e-4 of a force of 3 N at the most, and mend.
            let difference_n = (mesh.force - box_.force).norm();
            assert!(
                difference_n <= 4.5e-4,
                "{friction}: {difference_n} N apart\nmesh {mesh:?}\nbox  {box_:?}"
            );
        }
    }
}

#[test]
fn the_torque_of_friction_is_recorded_behind_the_finger_s_other_columns() {
    let scene =
        scene("kind = \"mesh\", file = \"cube.obj\"", "friction = { model = \"coulomb\", mu = 0.4 }\n");
    let path = hand([(0.0, [-0.02, 0.05, 0.0]), (0.3, [-0.02, 0.037, 0.0]), (1.3, [0.02, 0.037, 0.0])]);
    let table = played(&scene, &path);
    let columns = table.columns();
    let added = ["f0_torque_x", "f0_torque_y", "f0_torque_z"];
    assert_eq!(columns[columns.len() - 3..], added);
    let (torques, samples) = (table.vectors("f0_torque"), table.finger("f0"));
    let mut turned = 0;
    for (torque, sample) in torques.iter().zip(&samples) {
        // About the centre, of a force at the lowest point; numbers are recorded to the last digit.
        let expected = Vector3::new(0.0, -RADIUS_M, 0.0).cross(&sample.force);
        assert!((torque - expected).norm() < 1e-12, "{torque} {expected}");
        turned += u32::from(torque.z < -1e-3);
    }
    assert!(turned > 500, "{turned}");
}

#[test]
fn a_point_s_recording_has_no_torque() {
    let scene = scene("kind = \"sphere\", radius_m = 0.05", "").replace("radius_m = 0.008\n", "");
    let table = played(&scene, &hand([(0.0, [0.0, 0.06, 0.0]), (0.2, [0.0, 0.045, 0.0])]));
    assert!(table.columns().iter().all(|column| !column.contains("torque")));
}
