//! A step never allocates: counted over ticks that touch, slide and leave.
#![allow(non_snake_case)]

use crate::{common, counting, solids, trees};

use common::flawed;
use common::*;
use counting::CALLS;
use haptics::mesh::{self, Mesh, make};
use haptics::passivity::{Passivity, PassivitySpec, Port};
use haptics::{Finger, Friction, Nurbs, Shading, nurbs};
use nalgebra::Vector3;

#[test]
fn a_step_on_a_mesh_never_allocates() {
    let bumpy = std::sync::Arc::new(Mesh::build(make::bumpy_sphere(100, 51, 0.02)).unwrap().0);
    let knot = std::sync::Arc::new(Mesh::build(make::klein_bottle(40, 20, 0.04)).unwrap().0);
    // Over sheets that cross a point rolls.
    let corners = [[-0.03, 0.0, -0.03], [-0.03, 0.0, 0.03], [0.03, 0.0, 0.03], [0.03, 0.0, -0.03]];
    let sheet = |turn: f64| {
        let faces = vec![[0, 1, 2], [0, 2, 3]];
        let soup = mesh::TriangleSoup { vertices: corners.map(Vector3::from).to_vec(), faces };
        flawed::turned(soup, [0.0, 0.0, turn])
    };
    let crossing = std::sync::Arc::new(Mesh::build(flawed::together([sheet(0.1), sheet(1.4)])).unwrap().0);
    assert!(crossing.point_radius_m() > 0.0);
    let entities = [
        entity(bumpy, stiction()),
        entity(knot, Friction::coulomb(0.3).unwrap()),
        entity(crossing, stiction()),
    ];
    let mut finger = Finger::new(0.0, entities.len()).unwrap();
    let mut noise = Noise(10);
    let (mut free, mut stuck, mut slid) = (0, 0, 0);
    let before = CALLS.get();
    for i in 0..100_000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.025 * (2.0 * t).sin(), 0.025 * (3.0 * t).cos(), 0.01 * t.sin())
            + noise.vector(1e-5);
        match finger.step(&entities, &hip, DT).friction {
            haptics::ContactState::Free => free += 1,
            haptics::ContactState::Stick => stuck += 1,
            haptics::ContactState::Slip => slid += 1,
        }
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(free > 1000 && stuck > 1000 && slid > 1000, "{free} {stuck} {slid}");
}

#[test]
fn a_slide_over_a_hairline_crack_never_allocates() {
    let tile = |x: f64| flawed::moved(make::cuboid([0.04, 0.02, 0.04]), [x, 0.0, 0.0]);
    let tiles = flawed::together([tile(-0.02 - 1e-7), tile(0.02 + 1e-7), tile(0.06)]);
    let (mesh, report) = Mesh::build(tiles).unwrap();
    assert!(report.narrow_gaps.faces > 0, "{report}");
    let entity = entity(std::sync::Arc::new(mesh), stiction());
    let mut finger = Finger::new(0.0, 1).unwrap();
    let (mut noise, mut held) = (Noise(12), 0);
    let before = CALLS.get();
    for i in 0..50_000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.02 * (7.0 * t).sin(), 0.0095 + 1e-3 * (2.0 * t).sin(), 0.01 * t.cos());
        let out = finger.step(std::slice::from_ref(&entity), &(hip + noise.vector(1e-6)), DT);
        held += u32::from(out.entity.is_some());
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(held > 20_000, "{held}");
}

#[test]
fn shading_never_allocates() {
    let bumpy = std::sync::Arc::new(Mesh::build(make::bumpy_sphere(50, 26, 0.02)).unwrap().0);
    let cuboid = haptics::Cuboid::new([0.03; 3]).unwrap();
    let form = haptics::ShadingForm::Rotate;
    let shadings = [
        Shading::interpolated(&bumpy, 0.3, form).unwrap(),
        Shading::interpolated(&bumpy, 3.0, haptics::ShadingForm::Bisect).unwrap(),
        Shading::regions(&bumpy, 1e-3, 3.0, form).unwrap(),
    ];
    let shaded = shadings.map(|shading| entity(bumpy.clone(), stiction()).with_shading(shading));
    let of_box = Shading::box_regions(&cuboid, 1e-3, form).unwrap();
    let entities: Vec<_> =
        shaded.into_iter().chain([entity(cuboid, stiction()).with_shading(of_box)]).collect();
    let mut finger = Finger::new(0.0, entities.len()).unwrap();
    let (mut noise, mut touched) = (Noise(11), 0);
    let before = CALLS.get();
    for i in 0..50_000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.025 * (2.0 * t).sin(), 0.025 * (3.0 * t).cos(), 0.01 * t.sin());
        finger.step(&entities, &(hip + noise.vector(1e-5)), DT);
        touched += finger.contacts().count();
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(touched > 10_000, "{touched}");
}

#[test]
fn no_tree_of_shapes_makes_a_step_allocate() {
    for tree in trees::all() {
        for friction in [Friction::None, stiction()] {
            let entities = [trees::touchable(&tree.tree, friction)];
            let mut finger = point_finger();
            let mut noise = Noise(8);
            let (mut hip, mut touched) = (Vector3::y(), 0);
            let before = CALLS.get();
            for i in 0..20_000u32 {
                // Also begins inside now and then, where the nearest way out is searched for.
                if i.is_multiple_of(100) {
                    finger.forget(0);
                }
                hip = hip * 0.99 + noise.vector(0.1 * tree.size_m);
                touched += u32::from(finger.step(&entities, &hip, DT).entity.is_some());
            }
            assert_eq!(CALLS.get() - before, 0, "{}", tree.name);
            assert!(touched > 500, "{}: {touched}", tree.name);
        }
    }
}

#[test]
fn a_ball_on_a_tree_of_shapes_never_allocates() {
    for tree in trees::all() {
        for radius_m in [1e-3, 6e-3] {
            let entities = [trees::touchable(&tree.tree, stiction())];
            let mut finger = Finger::new(radius_m, 1).unwrap();
            let mut noise = Noise(8);
            let (mut hip, mut touched) = (Vector3::y(), 0);
            let before = CALLS.get();
            for i in 0..5_000u32 {
                if i.is_multiple_of(100) {
                    finger.forget(0);
                }
                // Fast and slow by turns.
                let step = if i / 500 % 2 == 0 { 0.1 } else { 2e-3 };
                hip = hip * (1.0 - 0.1 * step) + noise.vector(step * tree.size_m);
                finger.step(&entities, &hip, DT);
                touched += finger.touch_points(&entities, 0).as_slice().len().min(1);
            }
            assert_eq!(CALLS.get() - before, 0, "{}", tree.name);
            assert!(touched > 100, "{}: {touched}", tree.name);
        }
    }
}

#[test]
fn a_step_on_rational_patches_never_allocates() {
    let solid = std::sync::Arc::new(Nurbs::build(&nurbs::make::vase(0.05)).unwrap().0);
    let sheet = std::sync::Arc::new(Nurbs::build(&nurbs::make::sheet(6, 0.05, 0.002)).unwrap().0);
    for radius in [0.0, 0.002] {
        let entities =
            [entity(solid.clone(), stiction()), entity(sheet.clone(), Friction::coulomb(0.3).unwrap())];
        let mut finger = Finger::new(radius, entities.len()).unwrap();
        let mut noise = Noise(10);
        let mut touched = 0;
        let before = CALLS.get();
        for i in 0..20_000u32 {
            if i.is_multiple_of(500) {
                finger.forget(0);
            }
            let t = f64::from(i) * DT;
            let hip = Vector3::new(0.02 * (2.0 * t).sin(), 0.03 * (3.0 * t).cos(), 0.01 * t.sin())
                + noise.vector(1e-5);
            touched += u32::from(finger.step(&entities, &hip, DT).entity.is_some());
        }
        assert_eq!(CALLS.get() - before, 0);
        assert!(touched > 1000, "{touched}");
    }
}

#[test]
fn no_shape_makes_a_step_allocate() {
    for solid in solids::all() {
        let entities = [entity(solid.form, stiction())];
        let mut finger = point_finger();
        let mut noise = Noise(8);
        let (mut hip, mut touched) = (Vector3::y(), 0);
        let before = CALLS.get();
        for i in 0..20_000u32 {
            // Also begins inside now and then, where the nearest point is searched for.
            if i.is_multiple_of(100) {
                finger.forget(0);
            }
            hip = hip * 0.99 + noise.vector(0.1 * solid.size_m);
            touched += u32::from(finger.step(&entities, &hip, DT).entity.is_some());
        }
        assert_eq!(CALLS.get() - before, 0, "{}", solid.name);
        assert!(touched > 500, "{}: {touched}", solid.name);
    }
}

#[test]
fn heights_on_a_surface_never_allocate() {
    let soup = make::bumpy_sphere(40, 21, 0.02);
    let uv: Vec<_> = (0..soup.faces.len()).map(|i| [[0.1, 0.2], [i as f64, 0.3], [0.4, 0.9]]).collect();
    let mesh = std::sync::Arc::new(Mesh::build_with_uv(soup, &uv).unwrap().0);
    let shapes = solids::all().into_iter().map(|solid| haptics::Shape::from(solid.form)).chain([mesh.into()]);
    for shape in shapes {
        for form in [haptics::HeightForm::AlongForce, haptics::HeightForm::Gradient] {
            let map =
                pictures::repeated(&pictures::rough(16, 1), 2e-3, [2.0; 2]).with_zero_level(0.5).unwrap();
            let entities = [pictures::with(entity(shape.clone(), stiction()), map.with_form(form))];
            let mut finger = point_finger();
            let mut noise = Noise(8);
            let (mut hip, mut touched) = (Vector3::y() * 0.05, 0);
            let before = CALLS.get();
            for i in 0..5_000u32 {
                if i.is_multiple_of(100) {
                    finger.forget(0);
                }
                hip = hip * 0.99 + noise.vector(5e-3);
                touched += u32::from(finger.step(&entities, &hip, DT).entity.is_some());
            }
            assert_eq!(CALLS.get() - before, 0, "{shape:?}");
            assert!(touched > 100, "{shape:?}: {touched}");
        }
    }
}

#[test]
fn no_friction_model_ever_allocates() {
    for (name, friction) in laws::drift_free().into_iter().chain(laws::drifting()) {
        let entities = [table(friction.clone()), ball(0.02, friction)];
        let mut finger = point_finger();
        let mut noise = Noise(10);
        let before = CALLS.get();
        for i in 0..5000 {
            let t = f64::from(i) * DT;
            let hip = Vector3::new(0.03 * (2.0 * t).sin(), 0.02 * (3.0 * t).cos(), 0.0) + noise.vector(1e-4);
            finger.step(&entities, &hip, DT);
        }
        assert_eq!(CALLS.get() - before, 0, "{name}");
    }
}

#[test]
fn a_step_never_allocates() {
    let entities = [table(stiction()), ball(0.02, Friction::coulomb_viscous(0.3, 1.0).unwrap())];
    let mut finger = Finger::new(0.001, entities.len()).unwrap();
    let mut noise = Noise(9);
    let (mut free, mut stuck, mut slid, mut both) = (0, 0, 0, 0);
    let before = CALLS.get();
    for i in 0..100_000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.03 * (2.0 * t).sin(), 0.02 * (3.0 * t).cos(), 0.0) + noise.vector(1e-4);
        let out = finger.step(&entities, &hip, DT);
        match out.friction {
            haptics::ContactState::Free => free += 1,
            haptics::ContactState::Stick => stuck += 1,
            haptics::ContactState::Slip => slid += 1,
        }
        both += u32::from(finger.contacts().count() == 2);
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(free > 1000 && stuck > 100 && slid > 1000 && both > 1000, "{free} {stuck} {slid} {both}");
    drop(vec![0u8; 16]);
    assert!(CALLS.get() > before, "the counter counts");
}

#[test]
fn keeping_a_finger_passive_never_allocates() {
    let mut passivity = Passivity::new(PassivitySpec::usual(DT), DT).unwrap();
    let mut noise = Noise(12);
    let (mut at, mut changed) = (Vector3::zeros(), 0);
    let before = CALLS.get();
    for i in 0..20_000u32 {
        at = at * 0.99 + noise.vector(1e-4);
        let port = Port { is_late: i % 3 == 0, ..Port::new(at, noise.vector(5.0), DT) };
        changed += u32::from(passivity.step(&port).changed_n > 0.0);
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(changed > 1000, "{changed}");
}

#[test]
fn queries_of_a_mesh_never_allocate() {
    let mesh = Mesh::build(make::bumpy_sphere(100, 50, 0.1)).unwrap().0;
    let mut noise = Noise(10);
    let (mut hits, mut inside) = (0, 0);
    let before = CALLS.get();
    for _ in 0..10_000 {
        let (p, q) = (noise.vector(0.06), noise.vector(0.06));
        hits += u32::from(mesh.first_hit(&p, &q).is_some());
        inside += u32::from(mesh.is_inside(&p));
        assert!(mesh.clearance(&p, 1.0) <= mesh.nearest(&p).distance_m);
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(hits > 1000 && inside > 1000, "{hits} {inside}");
}

#[test]
fn a_ball_on_a_mesh_never_allocates() {
    let bumpy = std::sync::Arc::new(Mesh::build(make::bumpy_sphere(100, 51, 0.02)).unwrap().0);
    let knot = std::sync::Arc::new(Mesh::build(make::klein_bottle(40, 20, 0.04)).unwrap().0);
    let entities = [entity(bumpy, stiction()), entity(knot, Friction::None)];
    let mut finger = Finger::new(2e-3, entities.len()).unwrap();
    let mut noise = Noise(10);
    let (mut free, mut touched) = (0, 0);
    let before = CALLS.get();
    for i in 0..20_000 {
        let t = f64::from(i) * DT;
        let hip = Vector3::new(0.025 * (2.0 * t).sin(), 0.025 * (3.0 * t).cos(), 0.01 * t.sin())
            + noise.vector(1e-5);
        if i % 500 == 0 {
            finger.forget(0);
        }
        match finger.step(&entities, &hip, DT).friction {
            haptics::ContactState::Free => free += 1,
            _ => touched += finger.touch_points(&entities, 0).as_slice().len().min(1),
        }
    }
    assert_eq!(CALLS.get() - before, 0);
    assert!(free > 1000 && touched > 1000, "{free} {touched}");
}
