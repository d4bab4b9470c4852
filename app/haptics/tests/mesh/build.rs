//! Building meshes: what is linked, wound, ordered, repaired, reported and refused.

use haptics::mesh::{Face, Finding, Mesh, MeshError, MeshReport, Sides, TriangleSoup, make};
use nalgebra::Vector3;
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
    assert_linked_but_at_crowds(mesh, false);
}

/// The same; at an edge of three and more faces some end although others go on.
fn assert_linked_but_at_crowds(mesh: &Mesh, has_crowds: bool) {
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
                let is_alone = at_edge[&[a.min(b), a.max(b)]] == 1;
                assert!(is_alone || has_crowds, "face {index} alone at its edge {edge}");
                continue;
            }
            let is_even = at_edge[&[a.min(b), a.max(b)]].is_multiple_of(2);
            assert!(is_even || has_crowds, "more than two where parts touch");
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
        assert_eq!(mesh.extent_m(), soup.vertices.iter().map(Vector3::amax).fold(0.0, f64::max), "{name}");
    }
}

#[test]
fn normals_point_outward_for_the_volume_is_that_of_the_shape() {
    let close = |mesh: &Mesh, expected: f64, relative: f64, why: &str| {
        let found = volume(mesh);
        assert!((found / expected - 1.0).abs() < relative, "{found} m^3, {expected} m^3 expected: {why}");
    };
    let flat = |soup: TriangleSoup, expected: f64| {
        close(&build(soup).0, expected, 1e-13, "flat faces: rounding only");
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

#[test]
fn the_order_of_the_input_changes_nothing_where_all_faces_share_a_cell_of_the_curve() {
    // Beside one face as large as this, the sphere lies in a cell and a half.
    let mut soup = make::uv_sphere(16, 8, 1e-4);
    let far = soup.vertices.len() as u32;
    soup.vertices.extend([Vector3::x(), Vector3::y(), Vector3::z()].map(|v| v * 1e3));
    soup.faces.push([far, far + 1, far + 2]);
    let (mesh, _) = build(soup.clone());
    for seed in 0..3 {
        let (again, _) = build(make::shuffled(&soup, seed));
        assert_eq!((mesh.vertices(), mesh.faces()), (again.vertices(), again.faces()));
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

/// The four faces of a tetrahedron, outward, whose corners begin at `base`.
fn tetrahedron(base: u32) -> [[u32; 3]; 4] {
    [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|face| face.map(|v| v + base))
}

fn tetrahedron_points(at: Vector3<f64>, size: f64) -> [Vector3<f64>; 4] {
    [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()].map(|v| at + v * size)
}

/// Tetrahedra side by side.
fn tetrahedra(places: &[(Vector3<f64>, f64)]) -> TriangleSoup {
    TriangleSoup {
        vertices: places.iter().flat_map(|&(at, size)| tetrahedron_points(at, size)).collect(),
        faces: (0..places.len() as u32).flat_map(|i| tetrahedron(4 * i)).collect(),
    }
}

fn one_tetrahedron() -> TriangleSoup {
    tetrahedra(&[(Vector3::zeros(), 1.0)])
}

#[test]
fn vertices_that_are_equal_up_to_rounding_are_merged_and_minus_zero_is_zero() {
    let cube = make::cuboid([0.1, 0.2, 0.3]);
    let own_corners = TriangleSoup {
        vertices: cube.faces.iter().flatten().map(|&v| cube.vertices[v as usize]).collect(),
        faces: (0..12).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect(),
    };
    let (mesh, report) = build(own_corners.clone());
    assert_eq!((report.vertices, report.welded_vertices.count), (8, 0));
    assert!(report.is_clean(), "{report}");
    assert_eq!(mesh.faces(), build(cube.clone()).0.faces());

    // As CAD programs write STL: each face has roundings of its own, around zero, too.
    let noise = |i: usize| 2e-16 * 0.3 * ((i * 7919 % 13) as f64 - 6.0) / 6.0;
    let noisy = TriangleSoup {
        vertices: (0..)
            .zip(&own_corners.vertices)
            .map(|(i, v)| v.map(|x| x + noise(i + x.to_bits() as usize % 5)))
            .collect(),
        faces: own_corners.faces,
    };
    let (mesh, report) = build(noisy);
    // Two of the others are equal to the first to the bit.
    assert_eq!((report.vertices, report.welded_vertices.count, mesh.sides()), (8, 26, Sides::Solid));
    assert!(report.is_clean(), "{report}");

    let mut soup = one_tetrahedron();
    soup.vertices[0] = point(-0.0, 0.0, -0.0);
    soup.vertices.push(point(-0.0, 1.0, -0.0));
    soup.faces[3][0] = 4;
    let (mesh, report) = build(soup);
    assert_eq!((report.vertices, report.welded_vertices.count), (4, 0));
    assert_eq!(mesh.sides(), Sides::Solid);
    assert!(mesh.vertices().iter().flat_map(|v| v.iter()).all(|x| x.is_sign_positive()));

    for (y, merged) in [(1.0_f64.next_up(), 1), (1.0 + 1e-14, 0)] {
        let mut soup = one_tetrahedron();
        soup.vertices.push(point(0.0, y, 0.0));
        soup.faces[3][0] = 4;
        assert_eq!(build(soup).1.welded_vertices.count, merged, "beyond roundings it is another place");
    }
}

#[test]
fn faces_without_an_area_are_left_out() {
    let mut soup = one_tetrahedron();
    soup.faces.insert(1, [2, 2, 3]);
    soup.faces.push([0, 0, 0]);
    let (mesh, report) = build(soup);
    assert_eq!(report.degenerate, found(2, 1));
    assert_eq!((report.divided.count, mesh.faces().len(), mesh.sides()), (0, 4, Sides::Solid));
}

#[test]
fn a_crack_left_by_a_face_without_an_area_is_closed() {
    // Half of the edge from 0 to 1 is vertex 4: one side knows it, a face without an area hides it from the other.
    let mut soup = one_tetrahedron();
    soup.vertices.push(point(0.5, 0.0, 0.0));
    soup.faces = vec![[0, 2, 4], [4, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 4, 1]];
    let (mesh, report) = build(soup.clone());
    assert_eq!((report.degenerate, report.divided), (found(1, 5), found(1, 2)));
    assert_eq!((mesh.faces().len(), mesh.sides(), euler(&mesh)), (6, Sides::Solid, 2));
    assert_linked(&mesh);
    assert_planes(&mesh);

    // Two slivers, one on the long edge of the other.
    soup.vertices.push(point(0.25, 0.0, 0.0));
    soup.faces = vec![[0, 2, 5], [5, 2, 4], [4, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 4, 1], [0, 5, 4]];
    let (mesh, report) = build(soup);
    assert_eq!((report.degenerate, report.divided), (found(2, 6), found(2, 3)));
    assert_eq!((mesh.faces().len(), mesh.sides()), (8, Sides::Solid));
    assert_linked(&mesh);
}

#[test]
fn repeated_faces_are_left_out_however_they_are_wound() {
    let mut soup = one_tetrahedron();
    soup.faces.insert(2, [1, 3, 0]);
    soup.faces.push([2, 1, 0]);
    let (mesh, report) = build(soup);
    assert_eq!(report.duplicate, found(2, 2));
    assert_eq!((mesh.faces().len(), mesh.sides()), (4, Sides::Solid));
}

#[test]
fn faces_wound_against_their_neighbours_are_turned_over() {
    let clean = make::uv_sphere(16, 8, 0.1);
    let (expected, _) = build(clean.clone());
    let mut soup = clean;
    for face in [20, 33, 34, 100] {
        soup.faces[face].swap(1, 2);
    }
    let (mesh, report) = build(soup);
    assert_eq!((report.flipped, report.inside_out.count), (found(4, 20), 0));
    assert_linked(&mesh);
    assert_eq!(mesh.sides(), Sides::Solid);
    assert!((volume(&mesh) / volume(&expected) - 1.0).abs() < 1e-13, "rounding: another order of the sum");
}

fn inside_out(soup: &mut TriangleSoup, faces: std::ops::Range<usize>) {
    soup.faces[faces].iter_mut().for_each(|face| face.swap(0, 1));
}

#[test]
fn a_part_that_is_inside_out_is_turned_outward_and_no_other() {
    let mut cube = make::cuboid([0.1; 3]);
    inside_out(&mut cube, 0..12);
    let (mesh, report) = build(cube);
    assert_eq!((report.inside_out, report.flipped.count), (found(1, 0), 0));
    assert!(volume(&mesh) > 0.0);

    let mut three =
        tetrahedra(&[(Vector3::zeros(), 1.0), (Vector3::x() * 2.0, 1.0), (Vector3::x() * 4.0, 1.0)]);
    inside_out(&mut three, 4..8);
    let (mesh, report) = build(three);
    assert_eq!((report.components, report.inside_out, report.cavities.count), (3, found(1, 4), 0));
    assert!((volume(&mesh) - 0.5).abs() < 1e-14, "three sixths of a cubic metre, up to rounding");
}

#[test]
fn a_cavity_stays_a_cavity_also_in_a_file_that_is_inside_out() {
    let mut hollow = tetrahedra(&[(Vector3::zeros(), 1.0), (Vector3::repeat(0.1), 0.2)]);
    inside_out(&mut hollow, 4..8);
    let (mesh, report) = build(hollow.clone());
    let expected = (1.0 - 0.2_f64.powi(3)) / 6.0;
    assert_eq!((report.cavities, report.inside_out.count), (found(1, 4), 0));
    assert!((volume(&mesh) - expected).abs() < 1e-15, "rounding");
    assert_eq!(mesh.sides(), Sides::Solid);

    inside_out(&mut hollow, 0..8);
    let (mesh, report) = build(hollow);
    assert_eq!((report.cavities, report.inside_out), (found(1, 4), found(2, 0)));
    assert!((volume(&mesh) - expected).abs() < 1e-15, "rounding");
}

#[test]
fn what_lies_in_a_cavity_is_solid_again() {
    // Shells in one another, wound out, in, out; two of them, one inside out. The order along x differs from that of
    // their size.
    let shells = [1.0, 0.6, 0.3].map(|size| (Vector3::repeat(0.2 - 0.2 * size), size));
    let beside = shells.map(|(at, size)| (at + Vector3::x() * 0.05 + Vector3::y() * 2.0, size));
    let mut soup = tetrahedra(&[beside, shells].concat());
    inside_out(&mut soup, 4..8);
    inside_out(&mut soup, 12..16);
    inside_out(&mut soup, 20..24);
    let (mesh, report) = build(soup);
    let expected = 2.0 * (1.0 - 0.6_f64.powi(3) + 0.3_f64.powi(3)) / 6.0;
    assert!((volume(&mesh) - expected).abs() < 1e-14, "rounding");
    assert_eq!((report.cavities, report.inside_out, report.components), (found(2, 4), found(3, 12), 6));
}

#[test]
fn unused_vertices_are_left_out_and_open_edges_counted() {
    let mut soup = one_tetrahedron();
    soup.vertices.insert(0, point(9.0, 9.0, 9.0));
    soup.vertices.push(point(8.0, 8.0, 8.0));
    soup.faces = tetrahedron(1).to_vec();
    soup.faces.remove(2);
    let (mesh, report) = build(soup);
    assert_eq!((report.unused_vertices, report.boundary_edges), (found(2, 0), found(3, 0)));
    assert_eq!((mesh.vertices().len(), mesh.extent_m(), mesh.sides()), (4, 1.0, Sides::Sheet));
    assert_linked(&mesh);
}

#[test]
fn a_klein_bottle_and_a_moebius_strip_are_sheets_that_know_where_their_winding_changes() {
    let (klein, report) = build(make::klein_bottle(40, 20, 0.2));
    assert_eq!(
        (klein.sides(), report.boundary_edges.count, report.turned_edges.count),
        (Sides::Sheet, 0, 20)
    );
    assert_linked(&klein);
    let (strip, report) = build(make::mobius_strip(40, 4, 0.1, 0.05));
    // Both ends of each of the 40 segments are rim; it closes over 4 edges.
    assert_eq!(
        (strip.sides(), report.boundary_edges.count, report.turned_edges.count),
        (Sides::Sheet, 80, 4)
    );
    assert_linked(&strip);
    // Across its length it is as large as asked for, to a tenth.
    assert!((klein.extent_m() / 0.1 - 1.0).abs() < 0.1, "{}", klein.extent_m());
}

#[test]
fn an_open_sheet_keeps_the_winding_of_most_of_its_faces() {
    // A fan of four quarters; the last one is wound the other way.
    let rim = [Vector3::x(), -Vector3::z(), -Vector3::x(), Vector3::z()];
    let vertices = std::iter::once(Vector3::zeros()).chain(rim).collect();
    let soup = TriangleSoup { vertices, faces: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 4]] };
    let (mesh, report) = build(soup);
    assert_eq!((report.flipped, report.boundary_edges), (found(1, 3), found(4, 0)));
    assert!(mesh.faces().iter().all(|face| face.normal_B == Vector3::y()));
}

#[test]
fn scaling_the_input_scales_the_mesh_and_changes_nothing_else() {
    let mut soups = generators();
    // Needles at the poles, 6 um long and 40 nm wide: of the ball its caps.
    let mut fine = make::uv_sphere(1000, 500, 0.002);
    fine.faces.retain(|face| fine.vertices[face[0] as usize].y.abs() > 0.99 * 0.002);
    soups.push(("caps of a fine sphere", fine));
    for (name, soup) in soups {
        let (mesh, report) = build(soup.clone());
        for scale in [1e-3, 1e3] {
            let mut scaled = soup.clone();
            scaled.vertices.iter_mut().for_each(|v| *v *= scale);
            let (again, report_again) = build(scaled);
            assert_eq!(counts(&report), counts(&report_again), "{name} times {scale}");
            assert_eq!(fingerprint(&mesh, 1.0), fingerprint(&again, 1.0 / scale), "{name} times {scale}");
        }
    }
}

/// Number of links, Euler characteristic and a sum over all faces: the same for scaled meshes, though rounding may
/// change the order where two centroids all but share a cell of the curve.
fn fingerprint(mesh: &Mesh, to_original: f64) -> (usize, i64, [i64; 3]) {
    let linked = mesh.faces().iter().flat_map(|f| f.links).filter(|link| !link.is_boundary()).count();
    let euler = if mesh.faces().len() < 100_000 { euler(mesh) } else { 0 };
    let weighted = |face: &Face| {
        let [a, b, c] = corners(mesh, face).map(|v| v * to_original);
        (b - a).cross(&(c - a)).component_mul(&(a + b + c))
    };
    let sum: Vector3<f64> = mesh.faces().iter().map(weighted).sum();
    (linked, euler, sum.map(|x| (x * 1e9).round() as i64).into())
}

#[test]
fn what_contradicts_itself_is_refused_with_the_first_offender() {
    let refusal = |change: &dyn Fn(&mut TriangleSoup)| {
        let mut soup = one_tetrahedron();
        change(&mut soup);
        Mesh::build(soup).unwrap_err()
    };
    let error = refusal(&|soup| soup.vertices[2].y = f64::NAN);
    assert!(matches!(error, MeshError::Coordinate { vertex: 2, .. }), "{error}");
    let error = refusal(&|soup| soup.vertices[1].z = -f64::INFINITY);
    assert!(matches!(error, MeshError::Coordinate { vertex: 1, .. }), "{error}");
    let error = refusal(&|soup| soup.vertices[3].x = 1e200);
    assert!(matches!(error, MeshError::Coordinate { vertex: 3, .. }), "{error}");
    let error = refusal(&|soup| soup.faces[2][1] = 4);
    assert_eq!(error, MeshError::Index { face: 2, found: [1, 4, 3], vertices: 4 });
    let error = refusal(&|soup| soup.faces.clear());
    assert!(matches!(error, MeshError::Number { what: "faces", found: 0, .. }), "{error}");
    let error = refusal(&|soup| *soup = TriangleSoup::default());
    assert!(matches!(error, MeshError::Number { found: 0, .. }), "{error}");
    let error = refusal(&|soup| soup.vertices.fill(Vector3::x()));
    assert_eq!(error, MeshError::NothingLeft { faces: 4 });
}

#[test]
fn cubes_that_stand_edge_to_edge_are_joined_across_the_outside() {
    // Towards +x +y, and towards -x -y: they share the edge on the z axis.
    let mut soup = make::cuboid([1.0; 3]);
    let other = soup.clone();
    soup.vertices.iter_mut().for_each(|v| *v += point(0.5, 0.5, 0.0));
    soup.faces.extend(other.faces.iter().map(|face| face.map(|v| v + 8)));
    soup.vertices.extend(other.vertices.iter().map(|v| v - point(0.5, 0.5, 0.0)));
    let (mesh, report) = build(soup.clone());
    assert_eq!((report.vertices, report.touching_edges.count, report.components), (14, 1, 1));
    assert_eq!((mesh.sides(), mesh.faces().len()), (Sides::Solid, 24));
    assert_linked(&mesh);
    assert!((volume(&mesh) - 2.0).abs() < 1e-14, "rounding");
    // At that edge each wall of one cube leads to a wall of the other, in the same quarter of the outside.
    let on_axis = |v: u32| mesh.vertices()[v as usize].xy().norm() == 0.0;
    let mut met = 0;
    for face in mesh.faces() {
        for edge in (0..3).filter(|&edge| edge_of(face, edge).into_iter().all(on_axis)) {
            let beyond = &mesh.faces()[face.links[edge].face() as usize];
            let middle = |f: &Face| corners(&mesh, f).iter().sum::<Vector3<f64>>();
            assert!(face.normal_B.dot(&middle(beyond)) > 0.0, "beyond lies in front of the face");
            assert!(face.normal_B.dot(&beyond.normal_B).abs() < 1e-15, "at a right angle");
            met += 1;
        }
    }
    assert_eq!(met, 4);

    // Also with one wall wound the wrong way round: its cube tells how it is meant.
    let at_edge =
        |face: &[u32; 3]| face.iter().filter(|&&v| soup.vertices[v as usize].xy().norm() == 0.0).count();
    let wall = soup.faces.iter().position(|face| at_edge(face) == 2).unwrap();
    soup.faces[wall].swap(0, 1);
    let (same, report) = build(soup);
    assert_eq!((report.flipped, report.touching_edges.count), (found(1, wall), 1));
    assert_eq!(same.faces(), mesh.faces());
}

#[test]
fn a_vertex_with_more_faces_than_can_be_walked_round_is_refused() {
    let fan = |n: usize| make::uv_sphere(n, 2, 1.0);
    assert!(Mesh::build(fan(16_384)).is_ok());
    let error = Mesh::build(fan(16_385)).unwrap_err();
    let MeshError::Valence { at_B, faces: 16_385, allowed: 16_384 } = error else { panic!("{error}") };
    assert_eq!([at_B[0].abs(), at_B[1].abs(), at_B[2].abs()], [0.0, 1.0, 0.0], "a pole");
}

#[test]
fn the_normal_of_a_needle_is_right_to_the_last_digits() {
    // 10^12 times as long as wide. In whole units of 2^-40 m, so that the exact normal is known in integers; from
    // the two long edges rounding would leave four digits of it.
    let corners: [[i128; 3]; 3] = [
        [0, 0, 0],
        [(1 << 40) + 1, (1 << 39) + 3, (1 << 38) + 5],
        [(1 << 40) + 4, (1 << 39) - 2, (1 << 38) + 12],
    ];
    let [e, f] = [1, 2].map(|i| corners[i]);
    let exact = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]];
    let exact = Vector3::from(exact.map(|x| x as f64)).normalize();
    let vertices: Vec<_> =
        corners.iter().map(|c| Vector3::from(c.map(|x| x as f64 / 2_f64.powi(40)))).collect();
    for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1]] {
        let (mesh, _) = build(TriangleSoup { vertices: vertices.clone(), faces: vec![order] });
        let normal = mesh.faces()[0].normal_B * if order == [0, 2, 1] { -1.0 } else { 1.0 };
        assert!((normal - exact).norm() < 1e-15, "a few roundings");
    }
}

proptest! {
    // Faces of tetrahedra, so that some meshes are closed and some parts touch, and a few faces besides.
    #[test]
    fn any_triples_of_a_few_points_make_a_linked_mesh_or_an_error(
        points in prop::collection::vec(prop::array::uniform3(-3_i8..=3), 4..10),
        tetrahedra in prop::collection::vec(prop::array::uniform4(0_u32..9), 0..4),
        others in prop::collection::vec(prop::array::uniform3(0_u32..9), 0..4),
    ) {
        let vertices = points.iter().map(|p| Vector3::from(p.map(|x| f64::from(x) * 0.1))).collect();
        let sides = tetrahedra.iter().flat_map(|t| tetrahedron(0).map(|face| face.map(|v| t[v as usize])));
        let faces = sides.chain(others).map(|face| face.map(|v| v % points.len() as u32)).collect();
        if let Ok((mesh, report)) = Mesh::build(TriangleSoup { vertices, faces }) {
            assert_linked_but_at_crowds(&mesh, report.crowded_edges.count > 0);
            prop_assert_eq!(report.faces, mesh.faces().len());
            prop_assert_eq!(mesh.sides() == Sides::Solid, report.boundary_edges.count + report.turned_edges.count == 0);
        }
    }

    #[test]
    fn random_windings_of_a_sphere_all_give_the_same_mesh(flips in prop::collection::vec(any::<bool>(), 960)) {
        let mut soup = make::uv_sphere(32, 16, 0.05);
        let (expected, _) = build(soup.clone());
        for (face, _) in soup.faces.iter_mut().zip(flips).filter(|(_, flip)| *flip) {
            face.swap(1, 2);
        }
        let (mesh, report) = build(soup);
        assert_linked(&mesh);
        prop_assert_eq!(mesh.sides(), Sides::Solid);
        prop_assert!(report.flipped.count <= 480, "the smaller half");
        prop_assert!((volume(&mesh) / volume(&expected) - 1.0).abs() < 1e-12);
    }
}
