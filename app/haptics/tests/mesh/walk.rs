//! The transitions of a god-object between faces, edges, vertices and free space (Melder fig. 4.7), one by one.

use std::sync::Arc;

use crate::common::*;
use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{ContactState, Entity, Feature, Finger, FingerOutput, Friction};
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

fn mesh(soup: TriangleSoup, friction: Friction) -> Entity {
    entity(Arc::new(Mesh::build(soup).unwrap().0), friction)
}

/// Triangles in the planes through these points, each counter-clockwise from the free side.
fn sheet(triangles: &[[[f64; 3]; 3]]) -> TriangleSoup {
    let vertices = triangles.iter().flatten().map(|point| Vector3::from(*point)).collect();
    let faces = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    TriangleSoup { vertices, faces }
}

/// A square of 0.2 m with this corner and these edges; the free side is where they turn counter-clockwise.
fn square(corner: [f64; 3], one: [f64; 3], other: [f64; 3]) -> [[[f64; 3]; 3]; 2] {
    let [corner, one, other] = [corner, one, other].map(Vector3::from);
    let [b, c, d] =
        [corner + one * 0.2, corner + one * 0.2 + other * 0.2, corner + other * 0.2].map(Into::into);
    let a = corner.into();
    [[a, b, c], [a, c, d]]
}

const ORIGIN: [f64; 3] = [0.0; 3];
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// Floor y = 0 and walls x = 0, z = 0, meeting at the origin; free where all coordinates are positive.
fn corner_of_a_room() -> TriangleSoup {
    sheet(&[square(ORIGIN, Z, X), square(ORIGIN, Y, Z), square(ORIGIN, X, Y)].concat())
}

/// Goes to each place in turn and returns what is felt at the last.
fn go(entity: &Entity, places: &[[f64; 3]]) -> FingerOutput {
    let mut finger = point_finger();
    let mut out = None;
    for place in places {
        out = Some(finger.step(std::slice::from_ref(entity), &Vector3::from(*place), DT));
    }
    out.unwrap()
}

fn assert_near(found: Vector3<f64>, expected: [f64; 3]) {
    // Coordinates of 0.1 m and forces of some newtons, a few roundings each.
    assert!((found - Vector3::from(expected)).norm() < 1e-14, "{found:?} {expected:?}");
}

#[test]
fn free_to_face_and_back() {
    let room = mesh(corner_of_a_room(), Friction::None);
    let inside = go(&room, &[[0.05, 0.01, 0.07], [0.05, -0.004, 0.07]]);
    assert_eq!((inside.feature, inside.entity), (Feature::Face, Some(0)));
    assert_near(inside.god_object_W, [0.05, 0.0, 0.07]);
    assert_near(inside.force_on_user_W, [0.0, K * 0.004, 0.0]);
    let out = go(&room, &[[0.05, 0.01, 0.07], [0.05, -0.004, 0.07], [0.06, 1e-9, 0.07]]);
    assert_eq!((out.entity, out.force_on_user_W), (None, Vector3::zeros()));
}

#[test]
fn face_to_coplanar_face_without_a_trace() {
    // The floor's two triangles meet along x = z.
    let room = mesh(corner_of_a_room(), Friction::None);
    let out = go(&room, &[[0.05, 0.01, 0.07], [0.05, -0.004, 0.07], [0.09, -0.004, 0.07]]);
    assert_eq!(out.feature, Feature::Face);
    assert_near(out.god_object_W, [0.09, 0.0, 0.07]);
    assert_near(out.force_on_user_W, [0.0, K * 0.004, 0.0]);
}

#[test]
//= melder#4.21 type=test
//= melder#4.22 type=test
//= melder#4.23 type=test
//= melder#4.24 type=test
fn face_to_concave_edge_along_it_and_up_the_other_face() {
    let room = mesh(corner_of_a_room(), Friction::None);
    let start = [[0.05, 0.01, 0.07], [0.05, -0.004, 0.07]];
    let edge = go(&room, &[start[0], start[1], [-0.003, -0.004, 0.07]]);
    assert_eq!(edge.feature, Feature::Edge);
    assert_near(edge.god_object_W, [0.0, 0.0, 0.07]);
    assert_near(edge.force_on_user_W, [K * 0.003, K * 0.004, 0.0]);
    let along = go(&room, &[start[0], start[1], [-0.003, -0.004, 0.07], [-0.003, -0.004, 0.11]]);
    assert_near(along.god_object_W, [0.0, 0.0, 0.11]);
    let up = go(&room, &[start[0], start[1], [-0.003, -0.004, 0.07], [-0.003, 0.02, 0.07]]);
    assert_eq!(up.feature, Feature::Face);
    assert_near(up.god_object_W, [0.0, 0.02, 0.07]);
    assert_near(up.force_on_user_W, [K * 0.003, 0.0, 0.0]);
    let free = go(&room, &[start[0], start[1], [-0.003, -0.004, 0.07], [1e-9, 1e-9, 0.07]]);
    assert_eq!(free.entity, None, "in front of both");
}

#[test]
fn edge_to_vertex_and_from_there_to_edge_face_and_free_space() {
    let room = mesh(corner_of_a_room(), Friction::None);
    let to_vertex =
        [[0.05, 0.01, 0.07], [0.05, -0.004, 0.07], [-0.003, -0.004, 0.07], [-0.003, -0.004, -0.002]];
    let vertex = go(&room, &to_vertex);
    assert_eq!(vertex.feature, Feature::Vertex);
    assert_near(vertex.god_object_W, [0.0; 3]);
    assert_near(vertex.force_on_user_W, [K * 0.003, K * 0.004, K * 0.002]);
    let then = |place: [f64; 3]| go(&room, &[&to_vertex[..], &[place]].concat());
    let edge = then([-0.003, -0.004, 0.03]);
    assert_eq!(edge.feature, Feature::Edge);
    assert_near(edge.god_object_W, [0.0, 0.0, 0.03]);
    let face = then([0.02, -0.004, 0.03]);
    assert_eq!(face.feature, Feature::Face);
    assert_near(face.god_object_W, [0.02, 0.0, 0.03]);
    assert_eq!(then([1e-9, 1e-9, 1e-9]).entity, None);
}

#[test]
fn a_concave_edge_ends_at_its_vertex_whichever_of_its_faces_one_came_by() {
    // The two faces of an edge run along it in opposite directions: to one its end is at 0, to the other at 1.
    let room = mesh(corner_of_a_room(), Friction::None);
    for [along, up, across] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let place = |a: f64, b: f64, c: f64| {
            let mut place = [0.0; 3];
            (place[along], place[up], place[across]) = (a, b, c);
            place
        };
        let way = [place(0.07, 0.01, 0.05), place(0.07, -0.004, 0.05), place(0.07, -0.004, -0.003)];
        assert_eq!(go(&room, &way).feature, Feature::Edge);
        let end = place(-0.002, -0.004, -0.003);
        let out = go(&room, &[&way[..], &[end]].concat());
        assert_eq!(out.feature, Feature::Vertex, "{along} {up} {across}");
        assert_near(out.god_object_W, [0.0; 3]);
        assert_near(out.force_on_user_W, end.map(|x| -K * x));
    }
}

#[test]
fn from_the_very_edge_a_finger_goes_in_by_the_face_whose_plane_is_nearer() {
    let cube = mesh(make::cuboid([0.1; 3]), Friction::None);
    // By less than what counts as in front, the HIP is beyond the edge: there the god-object waits on the edge itself.
    let beyond = 0.05 + 1e-14;
    let from_the_top = [[0.04, 0.06, 0.01], [0.04, 0.045, 0.01], [beyond, 0.05, 0.01]];
    let from_the_side = [[0.06, 0.04, 0.01], [0.045, 0.04, 0.01], [0.05, beyond, 0.01]];
    for start in [from_the_top, from_the_side] {
        let waiting = go(&cube, &start);
        assert_eq!((waiting.feature, waiting.entity), (Feature::Edge, Some(0)));
        let then = |place| go(&cube, &[&start[..], &[place]].concat());
        assert_near(then([0.049, 0.047, 0.01]).force_on_user_W, [K * (0.05 - 0.049), 0.0, 0.0]);
        assert_near(then([0.047, 0.049, 0.01]).force_on_user_W, [0.0, K * (0.05 - 0.049), 0.0]);
    }
}

/// Four steep faces that meet at the origin; their other corners are at this height. Counter-clockwise seen from the
/// axis, or from the other side.
fn steep_pyramid(height_m: f64, is_seen_from_axis: bool) -> TriangleSoup {
    let corner = |i: u32| [(0.01, 0.01), (0.01, -0.01), (-0.01, -0.01), (-0.01, 0.01)][i as usize % 4];
    let vertices = std::iter::once(Vector3::zeros())
        .chain((0..4).map(|i| Vector3::new(corner(i).0, height_m, corner(i).1)))
        .collect();
    let is_flipped = is_seen_from_axis == (height_m > 0.0);
    let face = |i: u32| {
        let (one, other) = (1 + i, 1 + (i + 1) % 4);
        if is_flipped { [0, other, one] } else { [0, one, other] }
    };
    TriangleSoup { vertices, faces: (0..4).map(face).collect() }
}

#[test]
fn beside_and_below_the_bottom_of_a_steep_pit_a_finger_is_held_by_that_bottom() {
    // The HIP is behind one wall and in front of the one opposite, prolonged downwards: the mean normal decides.
    for is_seen_from_axis in [true, false] {
        let pit = mesh(steep_pyramid(0.05, is_seen_from_axis), Friction::None);
        for hip in [[2e-3, -1e-3, 0.0], [0.0, -1e-3, -2e-3], [1e-3, -1e-3, 2e-3], [0.0, -1e-3, 0.0]] {
            let out = go(&pit, &[[0.0, 0.04, 0.0], hip]);
            assert_eq!((out.entity, out.feature), (Some(0), Feature::Vertex), "{hip:?}");
            assert_near(out.god_object_W, [0.0; 3]);
            assert_near(out.force_on_user_W, hip.map(|x| -K * x));
        }
    }
}

#[test]
fn beside_and_above_the_tip_of_a_spike_a_finger_is_free() {
    let spike = steep_pyramid(-0.05, false);
    let base = [[1, 2, 3], [1, 3, 4]];
    for base in [base, base.map(|[a, b, c]| [a, c, b])] {
        let mut spike = spike.clone();
        spike.faces.extend(base);
        let spike = mesh(spike, Friction::None);
        let pressed = [[0.02, -0.01, 0.0], [1e-3, -0.01, 0.0]];
        assert_eq!(go(&spike, &pressed).entity, Some(0));
        // Behind the flank that it came by, prolonged, and in front of the one opposite.
        let out = go(&spike, &[pressed[0], pressed[1], [-2e-3, 1e-3, 0.0]]);
        assert_eq!(out.entity, None, "{out:?}");
    }
}

#[test]
fn a_finger_that_stops_on_a_sheet_by_rounding_stays_on_the_side_it_came_from() {
    let [one, other] = [[0.6, 0.48, 0.64], [0.8, -0.36, -0.48]];
    let roof = sheet(&square([0.011, 0.013, 0.017], one, other));
    let normal = Vector3::from(one).cross(&Vector3::from(other));
    let roof = mesh(roof, Friction::None);
    let mut noise = Noise(5);
    for _ in 0..1000 {
        let [u, v] = [0; 2].map(|_| noise.between(0.01, 0.19));
        // On the plane but for a rounding to either side.
        let on_it = Vector3::new(0.011, 0.013, 0.017) + Vector3::from(one) * u + Vector3::from(other) * v;
        for side in [1.0, -1.0] {
            let at = |height: f64| (on_it + normal * (side * height)).into();
            assert_eq!(go(&roof, &[at(0.01), at(0.0), at(1e-3)]).entity, None, "{u} {v}");
            let pressed = go(&roof, &[at(0.01), at(0.0), at(-1e-3)]);
            // Positions of 0.2 m, a few roundings of 3e-17 m each, times 500 N/m.
            assert!((pressed.force_on_user_W - normal * (side * K * 1e-3)).norm() < 1e-13, "{pressed:?}");
        }
    }
}

#[test]
fn over_a_convex_edge_the_nearest_face_plane_wins_and_beside_it_the_finger_is_free() {
    let cube = mesh(make::cuboid([0.1; 3]), Friction::None);
    let start = [[0.01, 0.06, 0.02], [0.01, 0.046, 0.02]];
    let over = go(&cube, &[start[0], start[1], [0.0505, 0.046, 0.02]]);
    assert_eq!(over.entity, None, "beyond the edge");
    let still_on_top = go(&cube, &[start[0], start[1], [0.049, 0.046, 0.02]]);
    assert_near(still_on_top.force_on_user_W, [0.0, K * 0.004, 0.0]);
    // From the face x = 0.05 near the top: up beyond the edge is free, and so is a jump round the corner.
    let side = [[0.06, 0.02, 0.02], [0.046, 0.02, 0.02]];
    assert_eq!(go(&cube, &[side[0], side[1], [0.046, 0.0501, 0.02]]).entity, None);
}

#[test]
fn an_obtuse_ridge_is_crossed_to_the_nearer_plane() {
    // A roof: two slopes that fall by 30 degrees to either side of the ridge along z.
    let down = [30f64.to_radians().cos(), -30f64.to_radians().sin(), 0.0];
    let roof = sheet(&[square(ORIGIN, Z, down), square(ORIGIN, [-down[0], down[1], 0.0], Z)].concat());
    let roof = mesh(roof, Friction::None);
    let left = [[-0.02, 0.02, 0.1], [-0.02, -0.02, 0.1]];
    let normal = Vector3::new(down[1].abs(), down[0], 0.0);
    let out = go(&roof, &[left[0], left[1], [0.015, -0.02, 0.1]]);
    let hip = Vector3::new(0.015, -0.02, 0.1);
    let depth = -normal.dot(&hip);
    assert_eq!(out.feature, Feature::Face);
    assert_near(out.force_on_user_W, (normal * (K * depth)).into());
    assert_near(out.god_object_W, (hip + normal * depth).into());
}

#[test]
fn a_needle_lets_go_of_a_finger_beside_its_apex_also_with_friction() {
    // Beside the apex the HIP is outside, yet in front of one plane only: Melder ch. 4.2.4.6 keeps it for ever.
    let wedge = make::wedge(10f64.to_radians(), 0.1, 0.1);
    let tip_is_at_the_origin = Vector3::zeros();
    for friction in [Friction::None, Friction::coulomb(0.5).unwrap(), stiction()] {
        let needle = mesh(wedge.clone(), friction.clone());
        let soup = &wedge.vertices;
        let inwards = soup.iter().sum::<Vector3<f64>>() / soup.len() as f64 - tip_is_at_the_origin;
        let inwards = Vector3::new(inwards.x, inwards.y, 0.0).normalize();
        let across = Vector3::z().cross(&inwards);
        let mut finger = point_finger();
        let mut felt = |place: Vector3<f64>| finger.step(std::slice::from_ref(&needle), &place, DT);
        felt(inwards * 0.02 + across * 0.01);
        let pressed = felt(inwards * 0.02 - across * 0.001);
        assert!(pressed.force_on_user_W.dot(&across) > 0.0, "out of the face it came in by: {pressed:?}");
        let through = felt(inwards * 0.02 - across * 0.006);
        assert!(through.force_on_user_W.dot(&across) > K * 0.006, "pressed right through a thin part: held");
        assert_eq!(felt(-inwards * 0.001 - across * 0.001).entity, None, "{friction:?}");
    }
}

#[test]
fn friction_holds_on_a_face_and_slides_at_mu_over_many_small_triangles() {
    let sphere = mesh(make::uv_sphere(316, 159, 0.1), stiction());
    let mut finger = point_finger();
    finger.step(std::slice::from_ref(&sphere), &on_circle(0.101, 1.0), DT);
    let mut slipping = 0;
    for tick in 0..3000 {
        let hip = on_circle(0.095, 1.0 + 2e-6 * f64::from(tick) * f64::from(tick.min(300)));
        let out = finger.step(std::slice::from_ref(&sphere), &hip, DT);
        let contact = finger.contact(0).unwrap();
        let ratio = ratio(&out, &contact.normal_W);
        // On the rim exactly, where the slide ended within a face; inside it, where it ended on an edge.
        let limit = if out.friction == ContactState::Stick { MU_S } else { MU_D };
        assert!(ratio <= limit * (1.0 + 1e-9), "{tick}: {ratio}");
        slipping += u32::from(out.friction == ContactState::Slip && (ratio - MU_D).abs() < 1e-9);
    }
    assert!(slipping > 2000, "{slipping}");
}

#[test]
fn a_finger_that_starts_inside_is_pushed_out_along_the_nearest_face() {
    let cube = mesh(make::cuboid([0.1; 3]), Friction::None);
    let out = go(&cube, &[[0.01, 0.02, -0.047]]);
    assert_near(out.force_on_user_W, [0.0, 0.0, -K * 0.003]);
    let mut ramped = Finger::new(0.0, 1).unwrap();
    let first = ramped.step(std::slice::from_ref(&cube), &Vector3::new(0.01, 0.02, -0.047), DT);
    assert!(first.force_on_user_W.norm() < 0.02 * K * 0.003, "with the force ramped in");
}

#[test]
fn a_jump_over_many_triangles_goes_on_in_the_next_tick_and_never_lets_go() {
    let sphere = mesh(make::uv_sphere(1000, 501, 0.1), Friction::None);
    let mut finger = point_finger();
    let mut feel = |hip: Vector3<f64>| finger.step(std::slice::from_ref(&sphere), &hip, DT);
    feel(on_circle(0.101, 0.5));
    feel(on_circle(0.095, 0.5));
    let target = on_circle(0.095, 2.5);
    let ticks = (0..20).take_while(|_| {
        let out = feel(target);
        assert_eq!(out.entity, Some(0));
        (out.force_on_user_W.norm() - K * DEPTH).abs() > 0.02 * K * DEPTH
    });
    // 200 mm over triangles of half a millimetre.
    assert!((1..=10).contains(&ticks.count()));
}

#[test]
fn another_mesh_in_the_same_place_is_met_anew() {
    let fine = mesh(make::uv_sphere(100, 51, 0.1), stiction());
    let coarse = mesh(make::cuboid([0.1; 3]), stiction());
    let mut finger = point_finger();
    let mut feel = |entity: &Entity, hip| finger.step(std::slice::from_ref(entity), &hip, DT);
    feel(&fine, on_circle(0.101, 1.0));
    assert_eq!(feel(&fine, on_circle(0.095, 1.0)).entity, Some(0));
    assert_eq!(
        feel(&coarse, Vector3::new(0.048, 0.0, 0.0)).force_on_user_W,
        Vector3::x() * (K * (0.05 - 0.048))
    );
    assert_eq!(feel(&fine, on_circle(0.12, 1.0)).entity, None);
}

#[test]
fn an_entity_that_is_a_plane_for_a_while_is_met_anew_as_a_mesh() {
    let cube = mesh(make::cuboid([0.1; 3]), stiction());
    let mut finger = point_finger();
    let mut feel = |entity: &Entity, hip| finger.step(std::slice::from_ref(entity), &hip, DT);
    feel(&cube, Vector3::new(0.0, 0.06, 0.0));
    feel(&cube, Vector3::new(0.0, 0.049, 0.0));
    feel(&table(stiction()), Vector3::new(0.0, -0.001, 0.0));
    // At another side of the cube: the contact of long ago would pull it back across.
    let out = feel(&cube, Vector3::new(0.049, 0.0, 0.0));
    assert_near(out.force_on_user_W, [K * (0.05 - 0.049), 0.0, 0.0]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_input_gives_a_finite_output(
        hips in prop::collection::vec(prop::array::uniform3(any_size()), 1..20),
        shift in prop::array::uniform3(any_size()), k in any_size(), b in any_size(), dt in any_size(),
    ) {
        for soup in [make::cuboid([0.1; 3]), make::klein_bottle(20, 10, 0.1)] {
            let mut entity = Entity { stiffness_n_per_m: k, damping_n_s_per_m: b, ..mesh(soup, stiction()) };
            let mut finger = point_finger();
            for hip in &hips {
                let out = finger.step(std::slice::from_ref(&entity), &Vector3::from(*hip), dt);
                prop_assert!(out.force_on_user_W.iter().all(|x| x.is_finite()), "{out:?}");
                prop_assert!(out.god_object_W.iter().all(|x| x.is_finite()), "{out:?}");
                entity.move_to(Isometry3::translation(shift[0], shift[1], shift[2]));
            }
        }
    }
}

fn any_size() -> impl Strategy<Value = f64> {
    prop_oneof![-0.1..0.1f64, any::<f64>()]
}
