//! Balls against meshes of which the grown surface is known: the same as against closed forms, tick by tick.

use crate::common::meshes::{cube, touchable};
use crate::common::*;
use haptics::{Cuboid, Entity, Finger, FingerOutput, Friction};
use nalgebra::Vector3;

const R: f64 = 0.01;

fn frictions() -> [Friction; 3] {
    [Friction::None, Friction::coulomb(0.5).unwrap(), stiction()]
}

fn both(entities: [&Entity; 2], fingers: &mut [Finger; 2], hip: &Vector3<f64>) -> [FingerOutput; 2] {
    let [a, b] = fingers;
    [a.step(std::slice::from_ref(entities[0]), hip, DT), b.step(std::slice::from_ref(entities[1]), hip, DT)]
}

#[test]
fn a_ball_on_a_box_of_triangles_is_as_on_a_box() {
    for friction in frictions() {
        let mesh = touchable(&cube(), friction.clone());
        let form = entity(Cuboid::new([0.1; 3]).unwrap(), friction.clone());
        let mut fingers = [finger(R), finger(R)];
        let mut touched = 0;
        for i in 0..4000 {
            let t = f64::from(i) * DT;
            // Over the top, across the diagonal between its two triangles, now and then off it.
            let hip = Vector3::new(
                0.03 * (1.3 * t).sin(),
                0.05 + R - 2e-3 + 3e-3 * (2.1 * t).cos(),
                0.03 * (1.7 * t).cos(),
            );
            let [on_mesh, on_form] = both([&mesh, &form], &mut fingers, &hip);
            assert_eq!(on_mesh.entity, on_form.entity, "{friction:?} tick {i}");
            assert_eq!(on_mesh.friction, on_form.friction, "{friction:?} tick {i}");
            // Positions of 0.06 m with a few roundings of 1e-17 m each, at 500 N/m.
            let difference = (on_mesh.force_on_user_W - on_form.force_on_user_W).norm();
            assert!(difference < 1e-12, "{friction:?} tick {i}: {difference:e} {on_mesh:?} {on_form:?}");
            touched += u32::from(on_mesh.entity.is_some());
        }
        assert!(touched > 1000 && touched < 3900, "{touched}");
    }
}
