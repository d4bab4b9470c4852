//! Meshes as people make them: walls and fins on edges, skins upon each other, T-junctions, holes. What is solid stays solid.

use crate::common::flawed::*;
use crate::common::meshes::*;
use crate::common::*;
use crate::mesh_oracle::{winding_number, winding_number_of_all};
use haptics::Friction;
use haptics::mesh::{CloseHoles, Mesh, MeshReport, Sides, TriangleSoup, make};
use nalgebra::Vector3;

fn point(x: f64, y: f64, z: f64) -> Vector3<f64> {
    Vector3::new(x, y, z)
}

fn build(soup: TriangleSoup) -> (Mesh, MeshReport) {
    Mesh::build(soup).unwrap()
}

fn faces_of(mesh: &Mesh, sides: Sides) -> usize {
    mesh.faces().iter().filter(|face| face.sides == sides).count()
}

/// A cube of 1 m, a quad beside or within it on some of its edges: four more points and the quads' corners.
fn cube_and(points: &[Vector3<f64>], quads: &[[u32; 4]]) -> TriangleSoup {
    let mut soup = make::cuboid([1.0; 3]);
    soup.vertices.extend(points);
    soup.faces.extend(quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]));
    soup
}

/// The number of the cube's corner.
fn corner(x: f64, y: f64, z: f64) -> u32 {
    let cube = make::cuboid([1.0; 3]);
    cube.vertices.iter().position(|v| *v == point(x, y, z)).unwrap() as u32
}

#[test]
fn a_solid_with_a_fin_on_an_edge_stays_solid_and_the_fin_is_a_sheet() {
    let [a, b] = [corner(0.5, 0.5, 0.5), corner(0.5, 0.5, -0.5)];
    let fin = [point(1.0, 1.0, -0.5), point(1.0, 1.0, 0.5)];
    for quad in [[a, b, 8, 9], [9, 8, b, a]] {
        let (mesh, report) = build(cube_and(&fin, &[quad]));
        assert_eq!((faces_of(&mesh, Sides::Solid), faces_of(&mesh, Sides::Sheet)), (12, 2));
        assert_eq!((report.crowded_edges.count, report.boundary_edges.count), (1, 4));
        assert_eq!((mesh.sides(), mesh.has_inside()), (Sides::Sheet, true));
        assert!(mesh.is_inside(&point(0.1, 0.2, 0.3)) && !mesh.is_inside(&point(0.7, 0.71, 0.3)));
        // The fin is felt from either side, the cube from outside.
        let beside = |from: Vector3<f64>, to: Vector3<f64>| mesh.first_hit(&from, &to).is_some();
        assert!(beside(point(0.9, 0.7, 0.0), point(0.7, 0.9, 0.0)));
        assert!(beside(point(0.7, 0.9, 0.0), point(0.9, 0.7, 0.0)));
        assert!(beside(point(0.6, 0.1, 0.0), point(0.4, 0.1, 0.0)));
        assert!(!beside(point(0.4, 0.1, 0.0), point(0.6, 0.1, 0.0)));
    }
}

#[test]
fn two_rooms_with_a_wall_between_are_one_solid() {
    let mut soup = make::cuboid([1.0; 3]);
    let other = moved(soup.clone(), [1.0, 0.0, 0.0]);
    soup = together([soup, other]);
    // The wall that both share comes once: the triangles of the second one are left out as given before, or cut otherwise.
    let is_wall = |face: &[u32; 3]| face.iter().all(|&v| soup.vertices[v as usize].x == 0.5);
    let second: Vec<usize> = (12..24).filter(|&i| is_wall(&soup.faces[i])).collect();
    let mut once = soup.clone();
    once.faces = (0..24).filter(|i| !second.contains(i)).map(|i| soup.faces[i]).collect();
    for wound in [false, true] {
        let mut soup = once.clone();
        if wound {
            let wall = soup.faces.iter().position(is_wall).unwrap();
            soup.faces[wall].swap(0, 1);
        }
        let (mesh, report) = build(soup);
        assert_eq!((faces_of(&mesh, Sides::Solid), faces_of(&mesh, Sides::Sheet)), (20, 2), "{report}");
        assert!(mesh.is_inside(&point(0.1, 0.2, 0.3)) && mesh.is_inside(&point(1.1, 0.2, 0.3)));
        assert!(!mesh.is_inside(&point(1.6, 0.2, 0.3)));
    }
}

#[test]
fn a_flange_around_a_solid_leaves_it_solid() {
    let at = [[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]];
    let inner = at.map(|[x, z]| corner(x, 0.5, z));
    let outer = at.map(|[x, z]| point(1.5 * x, 0.8, 1.5 * z));
    let quads: Vec<_> =
        (0..4).map(|i| [inner[i], inner[(i + 1) % 4], 8 + (i as u32 + 1) % 4, 8 + i as u32]).collect();
    for turned in [false, true] {
        let quads: Vec<_> =
            quads.iter().map(|&[a, b, c, d]| if turned { [d, c, b, a] } else { [a, b, c, d] }).collect();
        let (mesh, report) = build(cube_and(&outer, &quads));
        assert_eq!((faces_of(&mesh, Sides::Solid), faces_of(&mesh, Sides::Sheet)), (12, 8), "{report}");
        assert_eq!(report.crowded_edges.count, 4);
        assert!(mesh.is_inside(&point(0.1, 0.2, 0.3)));
    }
}

#[test]
fn a_skin_that_lies_on_a_solid_with_other_diagonals_does_no_harm() {
    let cube = make::cuboid([1.0; 3]);
    let mut soup = cube.clone();
    // Each wall once more, cut along its other diagonal: all edges but the diagonals have four faces.
    let wall = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| cube.vertices[v as usize]);
        (b - a).cross(&(c - a))
    };
    for (i, one) in cube.faces.iter().enumerate() {
        let other = cube.faces[i + 1..].iter().find(|other| wall(other) == wall(one));
        let Some(other) = other else { continue };
        let alone = |of: &[u32; 3], not: &[u32; 3]| of.iter().position(|v| !not.contains(v)).unwrap();
        let (i, j) = (alone(one, other), alone(other, one));
        let (a, b, c, d) = (one[i], one[(i + 1) % 3], other[j], one[(i + 2) % 3]);
        soup.faces.extend([[a, b, c], [a, c, d]]);
    }
    let (mesh, report) = build(soup);
    assert_eq!(faces_of(&mesh, Sides::Solid), 24, "{report}");
    for p in [point(0.1, 0.2, 0.3), point(0.4, -0.45, 0.3), point(0.6, 0.1, 0.1), point(0.1, -0.55, 0.0)] {
        assert_eq!(mesh.is_inside(&p), winding_number(&mesh, &p) > 0.5);
        assert_eq!(mesh.is_inside(&p), p.amax() < 0.5);
    }
}

/// Three sheets meet at an edge, as in a carton: whatever way each is wound, each is felt from both sides.
#[test]
fn sheets_that_meet_at_an_edge_are_felt_from_both_sides() {
    let flat = |angle: f64, z: f64| point(angle.cos(), angle.sin(), z) * 0.1;
    let angles = [0.2, 2.0, 4.4];
    let mut vertices = vec![point(0.0, 0.0, -0.1), point(0.0, 0.0, 0.1)];
    vertices.extend(angles.iter().flat_map(|&angle| [flat(angle, -1.0), flat(angle, 1.0)]));
    for wound in 0..8_u32 {
        let sheet = |i: u32| {
            let [a, b, c, d] = [0, 1, 3 + 2 * i, 2 + 2 * i];
            let [a, b, c, d] = if wound >> i & 1 == 1 { [d, c, b, a] } else { [a, b, c, d] };
            [[a, b, c], [a, c, d]]
        };
        let faces = (0..3).flat_map(sheet).collect();
        let (mesh, report) = build(TriangleSoup { vertices: vertices.clone(), faces });
        // The outer ends and sides, and at the edge the one that was left.
        assert_eq!((report.faces, report.crowded_edges.count, report.boundary_edges.count), (6, 1, 10));
        let entity = touchable(&std::sync::Arc::new(mesh), Friction::None);
        for (angle, side) in angles.iter().flat_map(|&angle| [(angle, 1.0), (angle, -1.0)]) {
            let mut finger = point_finger();
            let normal = point(-angle.sin(), angle.cos(), 0.0) * side;
            let at = |height: f64| flat(angle, 0.0) * 0.5 + normal * height;
            step(&mut finger, &entity, &at(0.01));
            let out = step(&mut finger, &entity, &at(-0.002));
            assert!((out.force_on_user_W - normal * (K * 0.002)).norm() < 1e-12, "{wound} {angle} {out:?}");
        }
    }
}

#[test]
fn a_face_with_corners_of_others_on_its_edge_is_divided_there() {
    // A cube whose top has one more point on each of two edges, which the walls below do not know.
    for off in [0.0, 2e-7] {
        let cube = make::cuboid([1.0; 3]);
        let is_top = |face: &[u32; 3]| face.iter().all(|&v| cube.vertices[v as usize].y == 0.5);
        let mut soup = cube.clone();
        soup.faces.retain(|face| !is_top(face));
        let outline = [
            point(0.5, 0.5, 0.5),
            point(0.5, 0.5 + off, 0.2),
            point(0.5, 0.5, -0.1),
            point(0.5, 0.5, -0.5),
            point(-0.5, 0.5, -0.5),
            point(-0.5, 0.5, off),
            point(-0.5, 0.5, 0.5),
        ];
        let first = soup.vertices.len() as u32;
        soup.vertices.extend(outline);
        soup.vertices.push(point(0.0, 0.5, 0.0));
        soup.faces.extend((0..7).map(|i| [first + 7, first + i, first + (i + 1) % 7]));
        let (mesh, report) = build(soup);
        assert_eq!((report.divided.count, report.boundary_edges.count), (2, 0), "{report}");
        assert_eq!((mesh.sides(), mesh.faces().len()), (Sides::Solid, 10 + 7 + 3));
    }
}

/// A ball without some of its faces.
fn pierced_ball(pierced: &[usize]) -> TriangleSoup {
    let mut soup = icosphere(4, 0.1);
    soup.faces = (0..soup.faces.len()).filter(|i| !pierced.contains(i)).map(|i| soup.faces[i]).collect();
    soup
}

#[test]
fn small_holes_of_what_is_nearly_closed_are_closed_and_a_cup_stays_open() {
    let (mesh, report) = build(pierced_ball(&[17, 18, 2000, 3001]));
    assert_eq!((mesh.sides(), report.boundary_edges.count), (Sides::Solid, 0), "{report}");
    assert!((3..=4).contains(&report.closed_holes.count), "{report}");
    let mut noise = Noise(2);
    for _ in 0..2000 {
        let p = noise.vector(0.07);
        assert_eq!(mesh.is_inside(&p), winding_number(&mesh, &p) > 0.5, "{p:?}");
    }
    // On demand they stay open.
    let (mesh, report) =
        Mesh::build_closing(pierced_ball(&[17, 18, 2000, 3001]), CloseHoles::UpTo(0.0)).unwrap();
    assert_eq!((mesh.sides(), report.closed_holes.count), (Sides::Sheet, 0));
    assert!(report.boundary_edges.count >= 10);
    // A cup: a ball without its top. It is closed only for who says how large its mouth is.
    let mut cup = icosphere(3, 0.1);
    let is_below = |face: &[u32; 3]| face.iter().all(|&v| cup.vertices[v as usize].y < 0.08);
    cup.faces = cup.faces.iter().copied().filter(is_below).collect();
    let (mesh, report) = build(cup.clone());
    assert_eq!((mesh.sides(), mesh.has_inside(), report.closed_holes.count), (Sides::Sheet, false, 0));
    assert!(report.to_string().contains("1 part not closed: felt from both sides"), "{report}");
    // Its hollow is no inside, though the winding number says so by itself of any place in it: 0.9 in the middle.
    let in_the_middle = winding_number_of_all(&mesh, &Vector3::zeros());
    assert!((in_the_middle - 0.9).abs() < 0.02, "{in_the_middle}");
    assert!(mesh.first_hit(&point(0.0, 0.2, 0.0), &point(0.0, -0.09, 0.0)).is_none());
    for (size_m, is_solid) in [(0.1, false), (0.2, true)] {
        let (mesh, report) = Mesh::build_closing(cup.clone(), CloseHoles::UpTo(size_m)).unwrap();
        assert_eq!(mesh.sides() == Sides::Solid, is_solid, "{report}");
    }
}

#[test]
fn holes_that_stay_open_are_told_with_their_sizes_and_places_the_largest_first() {
    let (_, report) = build(pierced_ball(&[17, 18, 2000, 3001]));
    assert_eq!((report.open_holes.count, report.open_holes.largest), (0, [None; 3]), "{report}");
    // A cube of 0.2 m without its top and two sides beside that, which leave one hole; and a ball without one triangle.
    let mut cube = make::cuboid([0.2; 3]);
    let normal = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| cube.vertices[v as usize]);
        (b - a).cross(&(c - a)).normalize()
    };
    let is_kept = |face: &[u32; 3]| normal(face).y < 0.5 && normal(face).x.abs() < 0.5;
    cube.faces = cube.faces.iter().copied().filter(is_kept).collect();
    let mut ball = pierced_ball(&[17]);
    ball.vertices.iter_mut().for_each(|vertex| vertex.x += 5.0);
    let open = |soup| Mesh::build_closing(soup, CloseHoles::UpTo(0.0)).unwrap().1.open_holes;
    let holes = open(together([cube, ball]));
    assert_eq!(holes.count, 2, "{holes}");
    let [Some(large), Some(small), None] = holes.largest else { panic!("{holes}") };
    // Its rim goes around the whole of the cube; sums of lengths, rounded.
    assert!((large.size_m - 0.2 * 3f64.sqrt()).abs() < 1e-12, "{large:?}");
    assert!(small.size_m < 0.02 && (small.middle_B[0] - 5.0).abs() < 0.2, "{small:?}");
    let told = holes.to_string();
    assert!(told.starts_with("2 holes stay open, the largest: 0.346 m at ["), "{told}");
}

#[test]
fn faces_of_lids_are_told_apart_from_those_of_the_input() {
    let soup = pierced_ball(&[17, 18, 2000, 3001]);
    let given: std::collections::HashSet<[[u64; 3]; 3]> =
        soup.faces.iter().map(|face| key(&soup.vertices, face)).collect();
    let mut is_lid = Vec::new();
    let (mesh, report) =
        Mesh::build_and_tell(soup, CloseHoles::Small, |_, of_lid| is_lid.push(of_lid)).unwrap();
    assert_eq!(is_lid.len(), mesh.faces().len());
    for (face, is_lid) in mesh.faces().iter().zip(&is_lid) {
        assert_eq!(*is_lid, !given.contains(&key(mesh.vertices(), &face.vertices)), "{face:?}");
    }
    assert!(
        is_lid.iter().filter(|is_lid| **is_lid).count() >= report.closed_holes.count
            && report.closed_holes.count >= 3
    );
}

/// The corners of a face in an order of their own.
fn key(vertices: &[Vector3<f64>], face: &[u32; 3]) -> [[u64; 3]; 3] {
    let mut corners = face.map(|v| vertices[v as usize].data.0[0].map(|x| (x + 0.0).to_bits()));
    corners.sort_unstable();
    corners
}

/// One open part among closed ones made sheets of all, and of fingers that were let go inside of one nothing was known.
#[test]
fn an_open_part_beside_solids_that_overlap_leaves_them_solid() {
    let mut cup = icosphere(2, 0.02);
    let is_below = |face: &[u32; 3]| face.iter().all(|&v| cup.vertices[v as usize].y < 0.01);
    cup.faces = cup.faces.iter().copied().filter(is_below).collect();
    let balls =
        [[0.0, 0.0, 0.0], [0.04, 0.01, 0.02], [-0.01, 0.05, 0.01]].map(|at| moved(icosphere(2, 0.05), at));
    let (mesh, _) = build(together(balls.into_iter().chain([moved(cup, [0.2, 0.0, 0.0])])));
    assert_eq!((mesh.sides(), mesh.has_inside()), (Sides::Sheet, true));
    let mesh = std::sync::Arc::new(mesh);
    let entity = touchable(&mesh, Friction::None);
    let (mut finger, mut roaming) = (point_finger(), Roaming::new(9, 0.09, 5e-4));
    let mut inside = 0;
    for tick in 0..30_000 {
        let hip = roaming.next();
        let out = step(&mut finger, &entity, &hip);
        if mesh.is_inside(&hip) {
            inside += 1;
            assert!(out.entity.is_some(), "lost in tick {tick} at {hip:?}");
        }
    }
    assert!(inside > 2000, "{inside}");
}

/// Sheets that share an edge of 1 m, all wound alike, at the same angle from each other.
fn book(pages: usize) -> TriangleSoup {
    let mut soup = TriangleSoup { vertices: vec![Vector3::zeros(), Vector3::x()], faces: Vec::new() };
    for page in 0..pages {
        let (sin, cos) = (page as f64 * std::f64::consts::TAU / pages as f64).sin_cos();
        soup.faces.push([0, 1, soup.vertices.len() as u32]);
        soup.vertices.push(point(0.5, cos, sin));
    }
    soup
}

/// Every pair of pages was compared, each with a search through all of them: a thousand took a second, and the time grew with
/// their cube.
#[test]
fn of_a_book_of_many_pages_two_opposite_ones_are_neighbours() {
    let pages = 2000;
    let (mesh, report) = build(book(pages));
    assert_eq!((report.crowded_edges.count, report.boundary_edges.count), (1, 3 * pages - 2));
    let joined: Vec<_> = mesh.faces().iter().filter(|f| f.links.iter().any(|l| !l.is_boundary())).collect();
    let [one, other] = joined[..] else { panic!("{} pages are joined", joined.len()) };
    // They lie in one plane, up to rounding, wherever each looks.
    assert!(one.normal_B.dot(&other.normal_B).abs() > 1.0 - 1e-9);
}

/// Each was divided at each corner: of 200 faces in 10 kB became 10,000.
#[test]
fn many_faces_on_an_edge_with_many_corners_on_it_are_not_all_divided() {
    let count = 150;
    let mut soup = book(count);
    let first = soup.vertices.len() as u32;
    let along = |i: usize| (i + 1) as f64 / (count + 2) as f64;
    soup.vertices.extend((0..=count).map(|i| point(along(i), 0.0, 0.0)));
    for tooth in 0..count as u32 {
        soup.faces.push([first + tooth + 1, first + tooth, soup.vertices.len() as u32]);
        soup.vertices.push(point(along(tooth as usize), 0.01, 0.01));
    }
    let input = soup.faces.len();
    let (mesh, report) = build(soup);
    assert!(report.divided.count > 0 && mesh.faces().len() <= 4 * input, "{report}");
}

fn assert_all_vertices_are_used(mesh: &Mesh) {
    let mut is_used = vec![false; mesh.vertices().len()];
    mesh.faces().iter().flat_map(|face| face.vertices).for_each(|vertex| is_used[vertex as usize] = true);
    assert!(is_used.iter().all(|&is_used| is_used), "a vertex without a face");
}

#[test]
fn a_hole_whose_lid_has_no_area_stays_open_and_leaves_no_vertex() {
    let mut soup = icosphere(4, 0.1);
    let removed = soup.faces[17];
    let has = |face: &[u32; 3], v: u32| face.contains(&v);
    let other = (0..soup.faces.len())
        .find(|&i| i != 17 && has(&soup.faces[i], removed[0]) && has(&soup.faces[i], removed[1]))
        .unwrap();
    let opposite = soup.faces[other].into_iter().find(|&v| v != removed[0] && v != removed[1]).unwrap();
    // The hole's corners are 0, opposite, 1, 2. Their mean lies on the edge from 1 to 2.
    let at = removed.map(|v| soup.vertices[v as usize]);
    soup.vertices[opposite as usize] = at[1] + at[2] - at[0];
    soup.faces = (0..soup.faces.len()).filter(|&i| i != 17 && i != other).map(|i| soup.faces[i]).collect();
    let (mesh, report) = build(soup);
    assert_eq!((report.closed_holes.count, report.boundary_edges.count), (0, 4), "{report}");
    assert_all_vertices_are_used(&mesh);
}

/// The vertex in the middle of a lid had more faces than a vertex may have, and the mesh was refused for it.
#[test]
fn a_hole_of_more_corners_than_a_vertex_may_have_stays_open() {
    // A beaker: rings of 2^15 corners at its mouth, 2^14 below, ... 4 at its foot, each as far below as its corners are apart:
    // needles would be near each other by thousands.
    let mut soup = TriangleSoup::default();
    let (radius, mut height) = (0.1, 0.0);
    for level in (2..=15).rev() {
        let count = 1_u32 << level;
        let first = soup.vertices.len() as u32;
        height -= radius * std::f64::consts::TAU / f64::from(count);
        let corner = |i: u32| (f64::from(i) * std::f64::consts::TAU / f64::from(count)).sin_cos();
        soup.vertices.extend((0..count).map(|i| {
            let (sin, cos) = corner(i);
            point(radius * cos, height, radius * sin)
        }));
        if level < 15 {
            let above = |i: u32| first - 2 * count + i % (2 * count);
            let here = |i: u32| first + i % count;
            soup.faces.extend((0..count).flat_map(|i| {
                [
                    [here(i), above(2 * i), above(2 * i + 1)],
                    [here(i), above(2 * i + 1), here(i + 1)],
                    [here(i + 1), above(2 * i + 1), above(2 * i + 2)],
                ]
            }));
        }
    }
    let foot = soup.vertices.len() as u32 - 4;
    soup.faces.extend([[foot, foot + 1, foot + 2], [foot, foot + 2, foot + 3]]);
    let (mesh, report) = build(soup);
    assert_eq!((report.closed_holes.count, report.boundary_edges.count), (0, 1 << 15), "{report}");
    assert_all_vertices_are_used(&mesh);
}
