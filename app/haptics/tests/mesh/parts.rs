//! Parts of a mesh that touch at a point, and meshes that take each other's place.

use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::winding_number;
use haptics::Friction;
use haptics::mesh::{TriangleSoup, make};
use nalgebra::Vector3;

/// Cubes of 0.1 m around the origin and around (0.1, 0.1, 0.1): they touch at one corner alone.
fn cubes_that_touch_at_a_corner() -> TriangleSoup {
    let mut soup = make::cuboid([0.1; 3]);
    let other = soup.clone();
    soup.vertices.extend(other.vertices.iter().map(|v| v + Vector3::repeat(0.1)));
    soup.faces.extend(other.faces.iter().map(|face| face.map(|v| v + 8)));
    soup
}

#[test]
fn a_finger_does_not_get_from_one_cube_into_the_other_where_they_touch() {
    let cubes = touchable(&built(cubes_that_touch_at_a_corner()), Friction::None);
    let mut noise = Noise(1);
    for _ in 0..1000 {
        let mut finger = point_finger();
        step(&mut finger, &cubes, &Vector3::new(0.04, 0.06, 0.04));
        step(&mut finger, &cubes, &Vector3::repeat(0.045));
        // The god-object is led to the shared corner, and from there the HIP goes on into the other cube.
        assert!(step(&mut finger, &cubes, &Vector3::repeat(0.05)).entity.is_some());
        let inside_the_other = Vector3::from_fn(|_, _| 0.05 + noise.between(1e-6, 0.02));
        let out = step(&mut finger, &cubes, &inside_the_other);
        assert!(out.entity.is_some(), "{inside_the_other:?}");
    }
}

#[test]
fn pressed_through_one_of_two_overlapping_parts_into_the_other_a_finger_is_held_where_they_cross() {
    let mut soup = make::cuboid([0.1; 3]);
    let other = soup.clone();
    soup.vertices.extend(other.vertices.iter().map(|v| v + Vector3::new(0.05, 0.03, 0.04)));
    soup.faces.extend(other.faces.iter().map(|face| face.map(|v| v + 8)));
    let cubes = touchable(&built(soup), Friction::None);
    let mut finger = point_finger();
    for y in [0.06, 0.045] {
        step(&mut finger, &cubes, &Vector3::new(-0.02, y, 0.0));
    }
    // Through the one cube and over its edge, all inside the other, at whose wall the way over the one ended.
    let hip = Vector3::new(0.095, 0.045, 0.04);
    let out = step(&mut finger, &cubes, &hip);
    assert_eq!(out.entity, Some(0));
    assert!((out.god_object_W - Vector3::new(0.0, 0.05, 0.04)).norm() < 1e-12, "{out:?}");
    assert!((out.force_on_user_W - (out.god_object_W - hip) * K).norm() < 1e-9, "{out:?}");
}

/// One solid and another one, moved.
fn both(one: TriangleSoup, other: &TriangleSoup, by: [f64; 3]) -> TriangleSoup {
    let mut soup = one;
    let first = soup.vertices.len() as u32;
    soup.vertices.extend(other.vertices.iter().map(|v| v + Vector3::from(by)));
    soup.faces.extend(other.faces.iter().map(|face| face.map(|v| v + first)));
    soup
}

#[test]
fn inside_solids_that_overlap_or_cut_through_themselves_no_finger_is_lost() {
    let (cube, ball) = (make::cuboid([0.1; 3]), make::uv_sphere(24, 12, 0.05));
    let beam = make::cuboid([0.02, 0.1, 0.03]);
    for (name, soup) in [
        ("cubes", both(cube.clone(), &cube, [0.05, 0.03, 0.04])),
        ("balls", both(ball.clone(), &ball, [0.04, 0.01, 0.02])),
        ("cube and ball", both(cube, &ball, [0.05, 0.02, 0.01])),
        ("cross", both(make::cuboid([0.1, 0.02, 0.02]), &beam, [0.003, 0.001, 0.002])),
        // Its tube is thicker than its ring is wide: one surface, which goes through itself around the axis.
        ("spindle torus", make::torus(24, 16, 0.03, 0.05)),
    ] {
        let mesh = built(soup);
        for friction in [Friction::None, Friction::Coulomb { mu: 0.5 }] {
            let entity = touchable(&mesh, friction);
            let (mut finger, mut roaming) = (point_finger(), Roaming::new(9, 0.09, 5e-4));
            let (mut inside, mut last) = (0, None);
            let (low, high) = mesh.vertices().iter().fold(
                (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
                |(low, high), v| (low.inf(v), high.sup(v)),
            );
            for tick in 0..25_000 {
                let hip = roaming.next();
                let out = step(&mut finger, &entity, &hip);
                // Outside of the box around it nothing is inside.
                let is_inside = hip == hip.sup(&low).inf(&high) && winding_number(&mesh, &hip) > 0.5;
                inside += u32::from(is_inside);
                let told = || format!("{name}, tick {tick}, {hip:?}: {out:?}");
                assert!(out.entity.is_some() || !is_inside, "lost: {}", told());
                // Who is outside and was free comes to touch only by a step through the surface; who rolls, by one that ends
                // nearer to it than the radius.
                let rolls_m = mesh.point_radius_m();
                if let Some((last_hip, false)) = last.replace((hip, out.entity.is_some()))
                    && !is_inside
                    && out.entity.is_some()
                {
                    let is_near = rolls_m > 0.0 && mesh.nearest(&hip).distance_m <= rolls_m;
                    assert!(is_near || mesh.first_hit(&last_hip, &hip).is_some(), "drawn: {}", told());
                }
            }
            assert!(inside > 750, "{name}: {inside}");
        }
    }
}

#[test]
fn a_point_where_parts_touch_is_a_vertex_of_each() {
    let mesh = built(cubes_that_touch_at_a_corner());
    assert_eq!(mesh.vertices().len(), 16);
    // Two leaves of a sheet that hang together by a point.
    let flat = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let vertices = vec![flat(0.0, 0.0), flat(1.0, 1.0), flat(1.0, -1.0), flat(-1.0, -1.0), flat(-1.0, 1.0)];
    let leaves = built(TriangleSoup { vertices, faces: vec![[0, 1, 2], [0, 3, 4]] });
    assert_eq!(leaves.vertices().len(), 6);
}

#[test]
fn a_mesh_that_was_built_where_another_one_is_gone_is_another_mesh() {
    let mut reused = 0;
    for size in [4, 8, 16, 32] {
        let mut finger = point_finger();
        let mesh = uv_sphere(size);
        let address = mesh.faces().as_ptr();
        let near = touchable(&mesh, Friction::None);
        step(&mut finger, &near, &Vector3::new(0.0, 0.2, 0.0));
        assert!(step(&mut finger, &near, &Vector3::new(0.0, 0.099, 0.0)).entity.is_some());
        drop((near, mesh));
        // Of the same size, so that the faces of one of them come to lie where the others' were.
        let mut kept = Vec::new();
        for _ in 0..50 {
            let mut soup = make::uv_sphere(size, path::rings(size), 0.1);
            soup.vertices.iter_mut().for_each(|v| v.y += 1.0);
            kept.push(built(soup));
        }
        let Some(elsewhere) = kept.iter().find(|mesh| mesh.faces().as_ptr() == address) else { continue };
        reused += 1;
        let out = step(&mut finger, &touchable(elsewhere, Friction::None), &Vector3::new(0.0, 0.099, 0.0));
        assert_eq!(out.entity, None, "a metre away: {out:?}");
    }
    if reused == 0 {
        println!("skipped: this allocator gave no address twice");
    }
}
