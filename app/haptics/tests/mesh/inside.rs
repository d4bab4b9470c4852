//! Inside and outside of meshes that fold, cut through themselves, overlap and enclose: against the sum of all solid angles.

use crate::common::flawed::*;
use crate::common::meshes::*;
use crate::common::models::models;
use crate::common::{ugly, *};
use crate::mesh_oracle as oracle;
use haptics::Friction;
use haptics::mesh::{Mesh, Sides};
use nalgebra::Vector3;

/// Points in the box of a mesh, and points near its corners, edges and faces.
fn points(mesh: &Mesh, count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let [low, high] = mesh.bounds_B();
    let mut noise = Noise(11);
    (0..count).map(move |i| {
        if i % 3 == 0 {
            return Vector3::from_fn(|axis, _| noise.between(low[axis], high[axis]));
        }
        let [a, b, c] = oracle::corners(mesh, (noise.uniform() * mesh.faces().len() as f64) as usize);
        let (s, t) = (noise.uniform(), noise.uniform() * (i % 2) as f64);
        let away = noise.vector(1.0) * 10f64.powf(noise.between(-9.0, -2.0));
        a + (b - a) * s * (1.0 - t) + (c - a) * s * t + away
    })
}

/// Nearer than this to the surface, both we and the sum of solid angles are rounding: some of 1e-16 for each of a few
/// thousand faces, over the least height of a face.
const ROUNDING_M: f64 = 1e-12;

/// Of so many points those inside and outside by the sum of solid angles, as all queries see it.
fn check_sides(name: &str, mesh: &Mesh, count: usize) -> [usize; 2] {
    let mut found = [0, 0];
    for p in points(mesh, count) {
        if mesh.nearest_unbounded(&p).distance_m < ROUNDING_M {
            continue;
        }
        let number = oracle::winding_number(mesh, &p);
        assert!((number - number.round()).abs() < 1e-3, "{name}: {p:?} {number}");
        let is_inside = number > 0.5;
        found[usize::from(!is_inside)] += 1;
        assert_eq!(mesh.is_inside(&p), is_inside, "{name}: {p:?} {number}");
        assert_eq!(mesh.is_inside_unbounded(&p), is_inside, "{name}: {p:?} {number}");
        assert_eq!(mesh.nearest_and_side(&p).1, is_inside, "{name}: {p:?} {number}");
    }
    found
}

#[test]
fn inside_is_where_the_winding_number_is_positive_whatever_the_surface_does() {
    for (name, soup) in flawed_solids() {
        let mesh = built(soup);
        assert_eq!(mesh.sides(), Sides::Solid, "{name}");
        let [inside, outside] = check_sides(name, &mesh, 3000);
        assert!(inside > 125 && outside > 125, "{name}: {inside} {outside}");
    }
}

/// `cargo test --release -p haptics --test mesh inside -- --ignored --nocapture`
#[test]
#[ignore = "six minutes"]
fn inside_is_where_the_winding_number_is_positive_at_ten_million_points() {
    let ugly = (1..10).flat_map(ugly::all).map(|(name, soup)| (name, Mesh::build(soup).unwrap().0));
    let flawed = flawed_solids().into_iter().map(|(name, soup)| (name, Mesh::build(soup).unwrap().0));
    let mut all = [0, 0];
    for (name, mesh) in flawed.chain(ugly).filter(|(_, mesh)| mesh.sides() == Sides::Solid) {
        let [inside, outside] = check_sides(name, &mesh, 170_000);
        println!("{name}, {} faces: {inside} points inside, {outside} outside", mesh.faces().len());
        all = [all[0] + inside, all[1] + outside];
    }
    println!("{} points inside, {} outside", all[0], all[1]);
    assert!(all[0] + all[1] > 10_000_000, "{all:?}");
}

/// As many points of each model as a sum over a hundred million faces takes.
#[test]
#[ignore = "of other people's models: MODELS=DIRECTORY"]
fn inside_of_models_is_where_the_winding_number_is_positive() {
    for (name, soup) in models() {
        let (mesh, _) = Mesh::build(soup).unwrap();
        let [inside, outside] = check_sides(&name, &mesh, 100_000_000 / mesh.faces().len());
        println!("{name}, {} faces: {inside} points inside, {outside} outside", mesh.faces().len());
    }
}

#[test]
fn the_way_out_leads_to_the_outside_of_all_parts() {
    for (name, soup) in flawed_solids() {
        let mesh = built(soup);
        let mut found = 0;
        for p in points(&mesh, 1_500) {
            let way_out = mesh.way_out(&p);
            assert_eq!(way_out.is_some(), mesh.is_inside(&p), "{name}: {p:?}");
            let Some(way) = way_out else { continue };
            found += 1;
            // On the surface, up to rounding, and beside it is where nothing is inside.
            assert!(oracle::distance(&mesh, &way.point_B) < 1e-14, "{name}: {p:?} {way:?}");
            assert!(((way.point_B - p).norm() - way.distance_m).abs() < 1e-14, "{name}: {p:?} {way:?}");
            let mut noise = Noise(3);
            let mut beside = (0..400).map(|_| way.point_B + noise.vector(1e-9));
            assert!(beside.any(|q| oracle::winding_number(&mesh, &q) < 0.5), "{name}: {p:?} {way:?}");
        }
        assert!(found > 200, "{name}: {found}");
    }
}

/// Around a vertex of valence 4 whose fan is folded, and where the surface is inside out.
#[test]
fn beside_a_folded_vertex_a_finger_is_free() {
    let soup = pulled_pyramid([0.06, -0.05, 0.02]);
    let pyramid = built(soup);
    let entity = touchable(&pyramid, Friction::None);
    let mut free = 0;
    // Over this one a point rolls as a ball, which begins to touch a radius away.
    assert!((1e-7..=1e-5).contains(&pyramid.point_radius_m()));
    let touches = |p: &Vector3<f64>| oracle::distance(&pyramid, p) <= pyramid.point_radius_m();
    for p in points(&pyramid, 3000) {
        if oracle::winding_number(&pyramid, &p) > -0.5 || touches(&p) {
            continue;
        }
        // Where the surface is inside out, and its normals point to the finger that sees it first.
        free += 1;
        let out = step(&mut point_finger(), &entity, &p);
        assert_eq!(out.entity, None, "{p:?} {out:?}");
    }
    let mut noise = Noise(8);
    let apex = Vector3::new(0.06, -0.05, 0.02);
    for _ in 0..3000 {
        let p = apex + noise.vector(0.01);
        let number = oracle::winding_number(&pyramid, &p);
        let out = step(&mut point_finger(), &entity, &p);
        assert_eq!(out.entity.is_some(), number > 0.5 || touches(&p), "{p:?} {number} {out:?}");
    }
    assert!(free > 100, "{free}");
}

/// On a face, an edge and a corner of a cube, in its planes and along its edges beyond: rays along the axes run in faces.
#[test]
fn in_the_planes_of_faces_inside_and_outside_are_exact() {
    let cube = cube();
    let at = [-0.07, -0.05, -0.03, 0.0, 0.05, 0.07];
    for i in 0..216 {
        let p = Vector3::new(at[i / 36], at[i / 6 % 6], at[i % 6]);
        let is_on_it = p.amax() == 0.05;
        if !is_on_it {
            assert_eq!(cube.is_inside(&p), p.amax() < 0.05, "{p:?}");
        }
    }
    // A grid whose lines meet in points of whole numbers, seen along its lines.
    let ball = built(haptics::mesh::make::torus(4, 4, 2.0, 1.0));
    for (i, j) in (-30..=30).flat_map(|i| (-30..=30).map(move |j| (i, j))) {
        let p = Vector3::new(f64::from(i) * 0.1, 0.25, f64::from(j) * 0.1);
        let number = oracle::winding_number(&ball, &p);
        if oracle::distance(&ball, &p) > 1e-12 {
            assert_eq!(ball.is_inside(&p), number > 0.5, "{p:?} {number}");
        }
    }
}
