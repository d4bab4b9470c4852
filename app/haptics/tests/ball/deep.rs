//! Balls pressed deeper than their radius: nothing changes there.

use crate::common::meshes::cube;
use crate::common::*;
use haptics::{Cuboid, Friction, Plane, Shape};
use nalgebra::Vector3;

#[test]
fn a_ball_pressed_deeper_than_its_radius_is_held_as_before() {
    let radius = 5e-3;
    let (block, plate) = (Cuboid::new([0.1; 3]).unwrap(), Cuboid::new([0.1, 0.004, 0.1]).unwrap());
    let solids: [(&str, Shape, f64); 4] = [
        ("plane", Plane::new(Vector3::y(), 0.0).unwrap().into(), 0.0),
        ("block", block.into(), 0.05),
        ("plate of 4 mm", plate.into(), 0.002),
        ("mesh", cube().into(), 0.05),
    ];
    for (name, shape, top) in solids {
        let entities = [entity(shape, Friction::None)];
        let mut finger = finger(radius);
        // Down until its centre is four radii below the surface, and up again, 0.1 mm a tick.
        let heights = (-300..=250).chain((-300..=249).rev()).map(|step: i32| -1e-4 * f64::from(step));
        for height in heights {
            let out = finger.step(&entities, &Vector3::new(3e-3, top + height, 2e-3), DT);
            let depth = (radius - height).max(0.0);
            let expected = Vector3::y() * (K * depth);
            // Sums of numbers of 0.1 m, times the stiffness.
            assert!((out.force_on_user_W - expected).norm() < 1e-9, "{name} at {height}: {out:?}");
            if depth > 0.0 {
                assert!((out.god_object_W.y - top - radius).abs() < 1e-12, "{name} at {height}: {out:?}");
            }
        }
    }
}
