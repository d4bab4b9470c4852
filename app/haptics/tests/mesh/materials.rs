//! Faces of one mesh that are made of different things.

use haptics::mesh::{CloseHoles, FaceData, Mesh, TriangleSoup, make};
use haptics::{Entity, FaceMaterial, FaceMaterials, Finger, Friction, FrictionState};
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

const DT_S: f64 = 1e-3;
const MU: [f64; 2] = [0.1, 0.8];

/// A box of 100 mm in many faces, the left half (x < 0) without a label, the right half with 1.
fn halves() -> (TriangleSoup, Vec<u16>) {
    let soup = cut_box();
    let middle_x = |face: &[u32; 3]| face.iter().map(|v| soup.vertices[*v as usize].x).sum::<f64>() / 3.0;
    let labels = soup.faces.iter().map(|face| u16::from(middle_x(face) > 0.0)).collect();
    (soup, labels)
}

/// A box whose long faces are cut at x = 0.
fn cut_box() -> TriangleSoup {
    let mut soup = make::cuboid([0.05, 0.1, 0.1]);
    let count = soup.vertices.len() as u32;
    let left: Vec<_> = soup.vertices.iter().map(|v| v - Vector3::x() * 0.025).collect();
    let right: Vec<_> = soup.vertices.iter().map(|v| v + Vector3::x() * 0.025).collect();
    // Two boxes that share a wall, which belongs to neither.
    let is_wall = |v: &[Vector3<f64>], face: &[u32; 3]| face.iter().all(|i| v[*i as usize].x.abs() < 1e-9);
    let own: Vec<_> = soup.faces.iter().filter(|face| !is_wall(&left, face)).copied().collect();
    let other = soup.faces.iter().filter(|face| !is_wall(&right, face)).map(|face| face.map(|v| v + count));
    soup.faces = own.into_iter().chain(other).collect();
    soup.vertices = left.into_iter().chain(right).collect();
    soup
}

/// The left half of 500 N/m and one friction, the right of another friction and stiffness.
fn entity(mu: [f64; 2], stiffness: [f64; 2]) -> Entity {
    let (soup, labels) = halves();
    let of_faces = FaceData { uv: None, labels: Some(&labels) };
    let (mesh, _) = Mesh::build_with(soup, of_faces, CloseHoles::Small).unwrap();
    let right = FaceMaterial::new(Friction::coulomb(mu[1]).unwrap(), stiffness[1], 0.0).unwrap();
    Entity::new(Arc::new(mesh), Isometry3::identity(), stiffness[0])
        .unwrap()
        .with_friction(Friction::coulomb(mu[0]).unwrap())
        .unwrap()
        .with_face_materials(FaceMaterials::new(vec![right]))
}

fn finger(radius_m: f64) -> Finger {
    Finger::new(radius_m, 1).unwrap()
}

fn at(x: f64, depth: f64, radius_m: f64) -> Vector3<f64> {
    Vector3::new(x, 0.05 + radius_m - depth, 0.003)
}

#[test]
fn labels_follow_their_faces_through_the_build() {
    let (mut soup, mut labels) = halves();
    // In another order, and with a face that is turned over and one without an area.
    soup.faces.rotate_left(5);
    labels.rotate_left(5);
    soup.faces[3].swap(0, 1);
    let [a, b, _] = soup.faces[7];
    soup.faces.push([a, b, a]);
    labels.push(9);
    let of_faces = FaceData { uv: None, labels: Some(&labels) };
    let (mesh, _) = Mesh::build_with(soup.clone(), of_faces, CloseHoles::Small).unwrap();
    assert_eq!(mesh.faces().len(), 20);
    for (index, face) in (0..).zip(mesh.faces()) {
        let x: f64 = face.vertices.iter().map(|v| mesh.vertices()[*v as usize].x).sum();
        assert_eq!(mesh.label(index), u16::from(x > 0.0), "{index}");
    }
    assert_eq!(mesh.label(20), 0);
    let few = FaceData { uv: None, labels: Some(&labels[1..]) };
    assert!(Mesh::build_with(soup, few, CloseHoles::Small).unwrap_err().to_string().contains("have labels"));
}

/// Sliding, the tangential force is the face's own coefficient times the normal one.
#[test]
fn a_finger_slides_with_the_friction_of_the_face_that_it_is_on() {
    for radius_m in [0.0, 5e-3] {
        let entity = [entity(MU, [1000.0; 2])];
        let mut finger = finger(radius_m);
        let mut seen = [0; 2];
        for tick in -10..=700 {
            let x = -0.035 + 1e-4 * f64::from(tick);
            let output =
                finger.step(&entity, &at(x, (1e-4 * f64::from(tick)).clamp(-1e-4, 2e-3), radius_m), DT_S);
            let Some(contact) = finger.contact(0) else { continue };
            let god_x = contact.god_object_W.x;
            if tick < 100 || god_x.abs() < 2e-4 || contact.friction == FrictionState::Stick {
                continue;
            }
            let on = usize::from(god_x > 0.0);
            let ratio = -output.force_on_user_W.x / output.force_on_user_W.y;
            assert!((ratio - MU[on]).abs() < 1e-9, "{radius_m} {god_x}: {ratio}");
            seen[on] += 1;
        }
        assert!(seen.iter().all(|ticks| *ticks > 200), "{seen:?}");
    }
}

/// Also where the first tick already is on the other material.
#[test]
fn a_contact_begins_with_the_material_of_the_face_that_it_meets() {
    for radius_m in [0.0, 5e-3] {
        for (x, k) in [(-0.02, 500.0), (0.02, 2000.0)] {
            let entity = [entity(MU, [500.0, 2000.0])];
            let mut finger = finger(radius_m);
            finger.step(&entity, &at(x, -1e-3, radius_m), DT_S);
            for depth in [1e-3, 2e-3, 1.5e-3] {
                let force = finger.step(&entity, &at(x, depth, radius_m), DT_S).force_on_user_W;
                assert!((force - Vector3::y() * (k * depth)).norm() < 1e-9, "{radius_m} {x}: {force}");
                assert_eq!(finger.contact(0).unwrap().stiffness_n_per_m, k);
            }
        }
    }
}

/// Over and back, shallow and deep, with and without friction: no tick's force rises by more than stiffness times way.
#[test]
fn between_soft_and_stiff_no_force_leaps() {
    for radius_m in [0.0, 5e-3] {
        for mu in [[0.0, 0.0], MU] {
            let entity = [entity(mu, [500.0, 2000.0])];
            let mut finger = finger(radius_m);
            let mut last = finger.step(&entity, &at(-0.02, -1e-4, radius_m), DT_S).force_on_user_W;
            let mut largest = 0.0_f64;
            let mut before = at(-0.02, -1e-4, radius_m);
            for tick in 0..20_000 {
                let t = f64::from(tick) * DT_S;
                let hip = at(0.02 * (2.0 * t).sin(), 4e-3 + 4.1e-3 * (0.7 * t).sin(), radius_m);
                let force = finger.step(&entity, &hip, DT_S).force_on_user_W;
                let explained = 2000.0 * 1.1 * (hip - before).norm() + 1e-9;
                let rise = force.norm() - last.norm();
                assert!(rise <= explained, "{radius_m} {mu:?} {t}: {rise} of {explained}");
                largest = largest.max(force.norm());
                // Falls are slow but for what the way explains.
                assert!(-rise <= explained + 0.05 * (1.0 + mu[1]) + 0.8 * force.norm(), "{t}: {rise}");
                (last, before) = (force, hip);
            }
            assert!(largest > 8.0, "{largest}");
        }
    }
}

/// Pressed on soft, over to stiff, out, back and in again: the user has not got more than the tenth of the way.
#[test]
fn a_closed_way_over_both_gives_no_energy_but_what_the_short_spring_regains() {
    let entity = [entity([0.0; 2], [500.0, 2000.0])];
    let mut finger = finger(0.0);
    let corners = [[-0.02, -1e-4], [-0.02, 6e-3], [0.02, 6e-3], [0.02, -1e-4], [-0.02, -1e-4]];
    let (mut hip, mut held) = (at(-0.02, -1e-4, 0.0), Vector3::zeros());
    let (mut fed_j, mut way_m, mut most_n) = (0.0, 0.0, 0.0_f64);
    for leg in corners.windows(2) {
        for step in 1..=2000 {
            let share = f64::from(step) / 2000.0;
            let to = at(
                leg[0][0] + (leg[1][0] - leg[0][0]) * share,
                leg[0][1] + (leg[1][1] - leg[0][1]) * share,
                0.0,
            );
            fed_j += held.dot(&(to - hip));
            hip = to;
            held = finger.step(&entity, &hip, DT_S).force_on_user_W;
            most_n = most_n.max(held.norm());
            way_m += if leg[0][1] == 6e-3 && leg[1][1] == 6e-3 && hip.x > 0.0 { 2e-5 } else { 0.0 };
        }
    }
    // A tenth of 20 mm at 3 to 7 N.
    assert!(fed_j <= 0.1 * way_m * most_n && fed_j > -0.05, "{fed_j} {most_n}");
}

/// Found inside, at once over faces of another material: the ramp, and all else, as on a mesh of that material alone.
#[test]
fn a_finger_that_begins_inside_feels_the_ramp_of_the_material_there() {
    for radius_m in [0.0, 5e-3] {
        let both = [entity(MU, [500.0, 2000.0])];
        let (mesh, _) = Mesh::build(halves().0).unwrap();
        let alone = [Entity::new(Arc::new(mesh), Isometry3::identity(), 2000.0)
            .unwrap()
            .with_friction(Friction::coulomb(MU[1]).unwrap())
            .unwrap()];
        let mut fingers = [finger(radius_m), finger(radius_m)];
        for tick in 0..300 {
            let hip = at(0.02 + 2e-5 * f64::from(tick), 2e-3, radius_m);
            let [a, b] =
                [0, 1].map(|i| fingers[i].step([&both[..], &alone[..]][i], &hip, DT_S).force_on_user_W);
            assert!((a - b).norm() < 1e-12, "{radius_m}, tick {tick}: {a} {b}");
            assert!(tick > 50 || a.norm() < 0.6 * 2000.0 * 2e-3 * 1.5, "{tick}: {a}");
        }
        assert!(fingers[0].contact(0).unwrap().normal_force_n > 3.9);
    }
}

/// From soft and rough to stiff and slippery, the hand level: what friction held back is let go, what presses is not.
#[test]
fn onto_stiff_and_slippery_faces_the_normal_force_goes_on() {
    for radius_m in [0.0, 5e-3] {
        let entity = [entity([1.2, 0.05], [300.0, 1500.0])];
        let mut finger = finger(radius_m);
        finger.step(&entity, &at(-0.03, -1e-3, radius_m), DT_S);
        let mut last_n = 0.0;
        for tick in 0..1400 {
            let hip = at(-0.03 + 5e-5 * f64::from(tick), 5e-3, radius_m);
            let normal_n = finger.step(&entity, &hip, DT_S).force_on_user_W.y;
            assert!(normal_n >= last_n - 1e-9, "{radius_m}, {}: {last_n} N, then {normal_n} N", hip.x);
            last_n = normal_n;
        }
        assert!(last_n > 4.0, "{last_n}");
    }
}

/// Pressed in on stiff faces after soft ones, the force grows as their spring does, and no faster.
#[test]
fn pressing_in_regains_nothing_of_a_short_spring() {
    let entity = [entity([0.0; 2], [300.0, 3000.0])];
    let mut finger = finger(0.0);
    for tick in 0..400 {
        finger.step(
            &entity,
            &at(-0.02 + 1e-4 * f64::from(tick), if tick == 0 { -1e-3 } else { 5e-3 }, 0.0),
            DT_S,
        );
    }
    let force = |finger: &mut Finger, depth: f64| {
        finger.step(&entity, &at(0.0199, depth, 0.0), DT_S).force_on_user_W.y
    };
    let mut last_n = force(&mut finger, 5e-3);
    for tick in 1..100 {
        let now_n = force(&mut finger, 5e-3 + 1e-5 * f64::from(tick));
        assert!((now_n - last_n - 0.03).abs() < 1e-9, "{tick}: {last_n} {now_n}");
        last_n = now_n;
    }
}
