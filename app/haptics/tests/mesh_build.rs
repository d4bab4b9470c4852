//! Building meshes: what is linked, wound, ordered, repaired, reported and refused.
#![allow(non_snake_case)]

use haptics::mesh::{Face, Finding, Mesh, MeshError, MeshReport, Sides, TriangleSoup, make};
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};

fn build(soup: TriangleSoup) -> (Mesh, MeshReport) {
    Mesh::build(soup).unwrap()
}

fn point(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

fn found(count: usize, first: usize) -> Finding {
    Finding { count, first: Some(first) }
}

/// Everything a builder has to offer, small.
fn generators() -> Vec<(&'static str, TriangleSoup)> {
    vec![
        ("sphere", make::uv_sphere(32, 16, 0.05)),
        ("coarsest sphere", make::uv_sphere(3, 2, 0.05)),
        ("bumpy sphere", make::bumpy_sphere(100, 50, 0.05)),
        ("cuboid", make::cuboid([0.1, 0.2, 0.3])),
        ("wedge", make::wedge(0.3, 0.1, 0.2)),
        ("star", make::star(5, 0.1, 0.04, 0.02)),
        ("torus", make::torus(24, 12, 0.1, 0.03)),
        ("Klein bottle", make::klein_bottle(40, 20, 0.2)),
        ("Moebius strip", make::mobius_strip(40, 4, 0.1, 0.05)),
    ]
}

fn edge_of(face: &Face, edge: usize) -> [u32; 2] {
    [face.vertices[edge], face.vertices[(edge + 1) % 3]]
}

fn edge_count(mesh: &Mesh) -> usize {
    let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    mesh.faces()
        .iter()
        .flat_map(|f| (0..3).map(move |e| sorted(edge_of(f, e))))
        .collect::<BTreeSet<_>>()
        .len()
}

/// V - E + F.
fn euler(mesh: &Mesh) -> i64 {
    mesh.vertices().len() as i64 - edge_count(mesh) as i64 + mesh.faces().len() as i64
}

fn corners(mesh: &Mesh, face: &Face) -> [Vector3<f64>; 3] {
    face.vertices.map(|v| mesh.vertices()[v as usize])
}

fn volume(mesh: &Mesh) -> f64 {
    let six = |face: &Face| {
        let [a, b, c] = corners(mesh, face);
        a.dot(&b.cross(&c))
    };
    mesh.faces().iter().map(six).sum::<f64>() / 6.0
}

/// Every link leads over the same edge and back, says truly how the neighbour is wound, and a boundary has no one
/// else: found out by comparing all edges, without the links.
fn assert_linked(mesh: &Mesh) {
    let mut at_edge: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for face in mesh.faces() {
        for edge in 0..3 {
            let [a, b] = edge_of(face, edge);
            *at_edge.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    for (index, face) in mesh.faces().iter().enumerate() {
        for (edge, link) in face.links.iter().enumerate() {
            let [a, b] = edge_of(face, edge);
            if link.is_boundary() {
                assert_eq!(at_edge[&[a.min(b), a.max(b)]], 1, "face {index} alone at its edge {edge}");
                continue;
            }
            assert_eq!(at_edge[&[a.min(b), a.max(b)]], 2);
            let beyond = &mesh.faces()[link.face() as usize];
            let expected = if link.is_turned() { [a, b] } else { [b, a] };
            assert_eq!(edge_of(beyond, link.edge()), expected, "face {index} over its edge {edge}");
            let back = beyond.links[link.edge()];
            assert_eq!(
                (back.face() as usize, back.edge(), back.is_turned()),
                (index, edge, link.is_turned())
            );
        }
    }
}

/// Planes agree with corners and winding.
fn assert_planes(mesh: &Mesh) {
    for face in mesh.faces() {
        let [a, b, c] = corners(mesh, face);
        let cross = (b - a).cross(&(c - a));
        assert!((face.normal_B.norm() - 1.0).abs() < 1e-15 * 4.0, "rounding of a square root and a division");
        assert!(face.normal_B.dot(&cross) > 0.0, "counter-clockwise");
        for corner in [a, b, c] {
            // Rounding of the normal's direction, of a product and of a sum.
            let off = (face.normal_B.dot(&corner) - face.offset_m).abs();
            assert!(off <= 1e-14 * mesh.extent_m(), "{off} m from the plane");
        }
    }
}

#[test]
fn generators_have_the_euler_characteristic_of_their_shape() {
    let expected = [2, 2, 2, 2, 2, 2, 0, 0, 0];
    for ((name, soup), expected) in generators().into_iter().zip(expected) {
        assert_eq!(euler(&build(soup).0), expected, "{name}");
    }
}

#[test]
fn every_link_leads_back() {
    for (name, soup) in generators() {
        let (mesh, report) = build(soup);
        println!("{name}: {report}");
        assert_linked(&mesh);
        assert_planes(&mesh);
    }
}

#[test]
fn solids_are_built_as_they_come_and_need_no_repair() {
    for (name, soup) in generators() {
        let (mesh, report) = build(soup.clone());
        let is_solid = !name.contains("Klein") && !name.contains("Moebius");
        assert_eq!(report.is_clean(), is_solid, "{name}: {report}");
        assert_eq!(mesh.sides(), if is_solid { Sides::Solid } else { Sides::Sheet }, "{name}");
        assert_eq!(
            (mesh.faces().len(), mesh.vertices().len()),
            (soup.faces.len(), soup.vertices.len()),
            "{name}"
        );
        assert_eq!(report.components, 1, "{name}");
        assert_eq!(mesh.extent_m(), soup.vertices.iter().map(|v| v.amax()).fold(0.0, f64::max), "{name}");
    }
}

#[test]
fn normals_point_outward_for_the_volume_is_that_of_the_shape() {
    let close = |mesh: &Mesh, expected: f64, relative: f64, why: &str| {
        let found = volume(mesh);
        assert!((found / expected - 1.0).abs() < relative, "{found} m^3, {expected} m^3 expected: {why}");
    };
    let flat = |soup: TriangleSoup, expected: f64| {
        close(&build(soup).0, expected, 1e-13, "flat faces: rounding only")
    };
    flat(make::cuboid([0.1, 0.2, 0.3]), 0.1 * 0.2 * 0.3);
    flat(make::wedge(0.3, 0.1, 0.2), 0.5 * 0.1 * 0.1 * 0.3_f64.sin() * 0.2);
    flat(make::star(5, 0.1, 0.04, 0.02), 10.0 * 0.5 * 0.1 * 0.04 * (PI / 5.0).sin() * 0.02);
    // Inscribed: an n-gon has 1 - (2 pi / n)^2 / 6 of its circle's area, once around and once from pole to pole.
    let sphere = 4.0 / 3.0 * PI * 0.05_f64.powi(3);
    let inscribed = |n: f64| 1.5 * (TAU / n).powi(2) / 6.0 * 2.0;
    close(&build(make::uv_sphere(100, 50, 0.05)).0, sphere, inscribed(100.0), "inscribed");
    // Mean of r^3: 1 + 3/4 0.05^2 as sin^2 sin^2 has the mean 1/4 (weighted by sin v: to 1%).
    let bumpy = sphere * (1.0 + 0.75 * 0.0025);
    close(&build(make::bumpy_sphere(400, 200, 0.05)).0, bumpy, inscribed(400.0) + 1e-4, "inscribed");
    let torus = 2.0 * PI * PI * 0.1 * 0.03 * 0.03;
    close(&build(make::torus(200, 100, 0.1, 0.03)).0, torus, inscribed(100.0), "inscribed");
}

#[test]
fn a_sphere_has_nu_squared_triangles_less_the_flat_ones_at_its_poles() {
    for (nu, raw) in [(32, 1024), (100, 10_000), (316, 99_856)] {
        assert_eq!(make::uv_sphere(nu, nu / 2, 1.0).faces.len(), raw - 2 * nu);
        assert_eq!(make::bumpy_sphere(nu, nu / 2, 1.0).faces.len(), raw - 2 * nu);
    }
}

#[test]
fn the_blade_of_a_wedge_runs_along_z_through_the_origin() {
    let soup = make::wedge(0.5, 0.1, 0.2);
    let highest: Vec<_> = soup.vertices.iter().filter(|v| v.y == 0.0).collect();
    assert_eq!(highest, [&point(0.0, 0.0, 0.1), &point(0.0, 0.0, -0.1)]);
    assert!(soup.vertices.iter().all(|v| v.y <= 0.0));
}

#[test]
fn the_order_of_the_input_changes_nothing() {
    for (name, soup) in generators() {
        let (mesh, report) = build(soup.clone());
        for seed in 0..3 {
            let shuffled = make::shuffled(&soup, seed);
            assert_ne!(shuffled, soup);
            let (again, report_again) = build(shuffled);
            assert_eq!(mesh.vertices(), again.vertices(), "{name}");
            assert_eq!(mesh.faces(), again.faces(), "{name}: to the bit");
            assert_eq!(counts(&report), counts(&report_again), "{name}");
        }
    }
}

fn counts(report: &MeshReport) -> [usize; 10] {
    [
        report.faces,
        report.vertices,
        report.components,
        report.degenerate.count,
        report.duplicate.count,
        report.flipped.count,
        report.inside_out.count,
        report.boundary_edges.count,
        report.turned_edges.count,
        report.unused_vertices.count,
    ]
}
