//! A baseline without memory: the finger is pushed out of the material by the shortest way (Melder ch. 3.1.2.1).
//!
//! Model: while the HIP is inside, `force = k depth n` with n the normal of the nearest surface point. Nothing is known
//! of where the finger came in. What the thesis says of such methods therefore holds: the force jumps where another
//! piece of the surface becomes the nearest (its figure 3.2), and whoever presses through the middle of a thin part is
//! pushed out at the far side ("push through").
//!
//! It is here to be compared with, not to be felt. Open meshes, which have no inside, cannot be rendered so at all.
//!
//! Of a mesh the nearest point is one of the nearest where very many are about as near: deep inside a ball of a million
//! faces the way out may then lead to any side.
//!
//! Cost: one question for inside, one for the nearest point, each bounded.

use crate::algorithm::{ContactAlgorithm, ContactMemory, Touch, TouchInput};

/// The vector field method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct VectorField;

impl ContactAlgorithm for VectorField {
    fn touch(&self, input: &TouchInput<'_>, _memory: &mut ContactMemory) -> Option<Touch> {
        if !input.is_inside() {
            return None;
        }
        let at = input.nearest()?;
        let depth_m = at.normal_B.dot(&(at.point_B - input.cone.hip_B));
        Some(Touch::frictionless(at, depth_m, &input.cone))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{Isometry3, Vector3};

    use crate::mesh::{Mesh, POPPED, make};
    use crate::{Algorithm, Entity, Finger, Shape};

    /// What a finger's tick takes off the stacks of its queries, and the force felt \[N\].
    fn tick(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) -> (usize, Vector3<f64>) {
        let before = POPPED.get();
        let out = finger.step(std::slice::from_ref(entity), hip, 1e-3);
        (POPPED.get() - before, out.force_on_user_W)
    }

    fn ball(meridians: usize, algorithm: Algorithm) -> Entity {
        let (mesh, _) = Mesh::build(make::uv_sphere(meridians, meridians / 2 + 1, 0.1)).unwrap();
        let shape = Shape::from(Arc::new(mesh));
        Entity::new(shape, Isometry3::identity(), 500.0).unwrap().with_algorithm(algorithm)
    }

    #[test]
    fn a_tick_at_the_centre_of_a_ball_looks_at_no_more_of_a_large_mesh_than_of_a_small_one() {
        for algorithm in [Algorithm::VectorField, Algorithm::ClassicGodObject] {
            for meridians in [100, 400] {
                let ball = ball(meridians, algorithm.clone());
                let mut finger = Finger::new(0.0, 1).unwrap().with_ramp_in(0.0).unwrap();
                for offset in
                    [Vector3::zeros(), Vector3::new(1e-9, 0.0, 0.0), Vector3::new(1e-5, -1e-5, 2e-5)]
                {
                    let (popped, force) = tick(&mut finger, &ball, &offset);
                    // Two bounded queries of 1024 visits, four children each, and three segments of some tens; looked
                    // at in full, 10,000 faces are three times as many, and 160,000 fifty times.
                    assert!(popped < 9000, "{algorithm:?}, {meridians}: {popped}");
                    // 100 mm to any side; facets of 3.6 degrees cut off 0.1 mm.
                    assert!((force.norm() - 50.0).abs() < 0.1, "{algorithm:?}, {meridians}: {force:?}");
                }
            }
        }
    }

    #[test]
    fn what_a_tick_asks_of_a_ball_is_what_looking_at_all_faces_says_but_deep_inside() {
        let (mesh, _) = Mesh::build(make::bumpy_sphere(200, 101, 0.1)).unwrap();
        let mut nearest = 0;
        for i in 0..2000 {
            // Golden ratios fill the box evenly.
            let share = |k: f64| (f64::from(i) * k).fract() - 0.5;
            let p = Vector3::new(share(0.819_172_5), share(0.671_043_6), share(0.549_700_5)) * 0.22;
            let (found, exact) = (mesh.nearest(&p), mesh.nearest_unbounded(&p));
            assert_eq!(mesh.is_inside(&p), mesh.is_inside_unbounded(&p), "{p:?}");
            // Bumps are 5 mm high: what was seen first is not much farther than what was not.
            let excess_m = found.distance_m - exact.distance_m;
            assert!((0.0..0.011).contains(&excess_m), "{p:?}: {excess_m}");
            nearest += usize::from(excess_m == 0.0);
        }
        assert!(nearest > 1900, "{nearest}");
    }
}
