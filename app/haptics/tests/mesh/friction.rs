//! Friction on meshes: its ratio is the coefficient's, whatever the god-object slides over.

use crate::common::meshes::*;
use crate::common::path::{self, Phase};
use crate::common::*;
use haptics::mesh::Mesh;
use haptics::{ContactState, Feature, Friction, Plane};
use nalgebra::Vector3;
use std::sync::Arc;

/// |F_t| / F_n over mu, of the ticks that slide on faces.
fn ratios(mesh: &Arc<Mesh>, mu: f64, hips: impl Iterator<Item = Vector3<f64>>) -> Vec<f64> {
    let entity = touchable(mesh, Friction::Coulomb { mu });
    let mut finger = point_finger();
    let (mut ratios, mut last_place) = (Vec::new(), Vector3::zeros());
    for hip in hips {
        let out = step(&mut finger, &entity, &hip);
        let Some(contact) = finger.contact(0) else { continue };
        let has_moved = (contact.god_object_W - last_place).norm() > 1e-9;
        last_place = contact.god_object_W;
        let is_sliding = out.friction == ContactState::Slip && has_moved;
        if is_sliding && contact.feature == Feature::Face && contact.normal_force_n > 0.1 {
            ratios.push(ratio(&out, &contact.normal_W) / mu);
        }
    }
    ratios
}

#[test]
fn over_flat_sides_the_sliding_ratio_is_the_coefficient() {
    // From corner to corner over a cube's top, and so along and across its diagonal.
    for mu in [0.1, 0.3, 0.8, 1.5] {
        for (dx, dz) in [(1.0, 1.0), (1.0, -1.0), (0.3, 1.0), (1.0, 0.0)] {
            let at = |i: i32| {
                let along = f64::from(i) * 2e-4 - 0.04;
                Vector3::new(along * dx, 0.05 - DEPTH, along * dz)
            };
            let above = std::iter::once(Vector3::new(-0.04 * dx, 0.06, -0.04 * dz));
            let ratios = ratios(&cube(), mu, above.chain((0..400).map(at)));
            assert!(ratios.len() > 300, "{}", ratios.len());
            // The ratio is asked for to 12 digits of the depth; positions of 0.05 m carry 1e-17 m of 5 mm.
            assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 1e-11), "mu {mu}");
        }
    }
}

#[test]
fn over_balls_of_any_fineness_the_sliding_ratio_on_faces_is_the_coefficient() {
    for (mesh, radius_at, most_less) in [
        (uv_sphere(32), path::smooth as path::RadiusAt, 10),
        (uv_sphere(316), path::smooth, 10),
        (bumpy_sphere(316), path::bumpy, 1000),
    ] {
        for mu in [0.1, 0.5] {
            let path = path::standard_path(radius_at);
            let slide = path.iter().filter(|(phase, _)| *phase != Phase::Free).map(|(_, hip)| *hip);
            let ratios = ratios(&mesh, mu, slide);
            assert!(ratios.len() > 1000, "{mesh:?}: {}", ratios.len());
            assert!(ratios.iter().all(|&ratio| ratio < 1.0 + 1e-9), "{mesh:?}, mu {mu}: never more");
            // Over an edge the god-object comes to another circle, and may be inside it at once: breaking away, at
            // most a handful of times, and in dales, where the next face is turned back.
            let less = ratios.iter().filter(|&ratio| (ratio - 1.0).abs() > 1e-9).count();
            assert!(less <= most_less, "{mesh:?}, mu {mu}: {less} of {}", ratios.len());
        }
    }
}

#[test]
fn a_slide_over_an_edge_between_coplanar_faces_is_one_over_a_plane() {
    // The top of a cube is two triangles; a table is none. The same HIPs, the same forces.
    let cube = touchable(&cube(), stiction());
    let table = table(stiction());
    let (mut over_cube, mut over_table) = (point_finger(), point_finger());
    let mut noise = Noise(11);
    let mut hip = Vector3::new(0.0, 0.01, 0.0);
    for _ in 0..20_000 {
        let pull = hip * -1e-2;
        hip += noise.vector(5e-4) + pull;
        hip.y = hip.y.clamp(-0.01, 0.01);
        let on_cube = step(&mut over_cube, &cube, &(hip + Vector3::y() * 0.05));
        let on_table = step(&mut over_table, &table, &hip);
        if hip.xz().amax() > 0.03 {
            // Near the cube's rim they differ, for good reason.
            (over_cube, over_table) = (point_finger(), point_finger());
            hip = Vector3::new(0.0, 0.01, 0.0);
            continue;
        }
        assert_eq!(on_cube.friction, on_table.friction, "{hip:?}");
        // Depths are rounded 0.05 m away from the origin there, times 500 N/m, and the slide's 1e-12.
        let off = (on_cube.force_on_user_W - on_table.force_on_user_W).norm();
        assert!(off < 1e-11, "{hip:?}: {off}");
    }
}

#[test]
fn every_friction_on_the_face_of_a_cube_is_that_on_a_plane_whatever_edges_run_through_the_face() {
    // The face's two triangles meet along x = z. A slide that comes to that edge halfway must go on as if it was not there:
    // laws that fall with speed would else catch the god-object on it.
    for (name, friction) in laws::drift_free().into_iter().chain(laws::drifting()) {
        let on_mesh = touchable(&cube(), friction.clone());
        let on_plane = entity(Plane::new(Vector3::y(), 0.05).unwrap(), friction);
        for seed in 0..10 {
            let (mut on_mesh_feels, mut on_plane_feels, mut noise) =
                (point_finger(), point_finger(), Noise(seed));
            let (mut hip, mut step_m) = (Vector3::y() * 0.055, Vector3::y() * -1e-4);
            for tick in 0..2000 {
                step_m = (step_m + noise.vector(1e-5)) * 0.99 - Vector3::y() * (3e-3 * (hip.y - 0.049));
                hip += step_m;
                let [x, y, z] =
                    [hip.x.clamp(-0.03, 0.03), hip.y.clamp(0.035, 0.06), hip.z.clamp(-0.03, 0.03)];
                hip = Vector3::new(x, y, z);
                let mesh = step(&mut on_mesh_feels, &on_mesh, &hip);
                let plane = step(&mut on_plane_feels, &on_plane, &hip);
                assert_eq!(
                    (mesh.entity, mesh.friction),
                    (plane.entity, plane.friction),
                    "{name}, {seed}, {tick}"
                );
                // Some newtons, over a slide in two parts, to the tolerance that a curve's roots are found with.
                let difference = (mesh.force_on_user_W - plane.force_on_user_W).norm();
                assert!(difference < 1e-9, "{name}, {seed}, {tick}: {mesh:?} {plane:?}");
            }
        }
    }
}
