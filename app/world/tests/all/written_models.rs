//! Meshes that are written as they were understood.

use haptics::mesh::{CloseHoles, Mesh, MeshReport, TriangleSoup, make};
use world::model::{read_obj, write_obj};

/// A mesh as built, and the text of its report.
fn written(soup: TriangleSoup) -> (Mesh, MeshReport, String) {
    let mut is_lid = Vec::new();
    let told = |_, of_lid| is_lid.push(of_lid);
    let (mesh, report) = Mesh::build_and_tell(soup, CloseHoles::Small, told).expect("a mesh");
    let text = write_obj(&mesh, &is_lid, |_| &[]);
    (mesh, report, text)
}

/// A ball with all that can be repaired: vertices of its own for each face, one of them rounded otherwise, faces turned over, given twice, without area,
/// missing, with a vertex on an edge, and a vertex of none.
fn spoilt() -> TriangleSoup {
    let ball = make::bumpy_sphere(24, 12, 0.04);
    let mut soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    for (number, face) in ball.faces.iter().enumerate() {
        if number == 100 {
            continue;
        }
        let begin = soup.vertices.len() as u32;
        soup.vertices.extend(face.iter().map(|&v| ball.vertices[v as usize]));
        let corners = if number % 7 == 0 { [0, 2, 1] } else { [0, 1, 2] };
        soup.faces.push(corners.map(|corner| begin + corner));
    }
    // Another one up to rounding.
    soup.vertices[150].x = soup.vertices[150].x.next_up();
    soup.vertices.push([1.0, 2.0, 3.0].into());
    // In two halves along a line to the middle of an edge, which the neighbour knows nothing of.
    let [a, b, c] = soup.faces[200];
    soup.vertices.push(0.5 * (soup.vertices[a as usize] + soup.vertices[b as usize]));
    let middle = soup.vertices.len() as u32 - 1;
    soup.faces[200] = [a, middle, c];
    soup.faces.extend([[middle, b, c], soup.faces[3], [a, a, b]]);
    soup
}

/// Corners of all faces to the bit, in an order of their own: that of the mesh depends on vertices of no face, too.
fn faces(mesh: &Mesh) -> Vec<[[u64; 3]; 3]> {
    let corners = |face: &haptics::mesh::Face| {
        let mut corners = face.vertices.map(|v| mesh.vertices()[v as usize].data.0[0].map(f64::to_bits));
        let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        corners.rotate_left(first);
        corners
    };
    let mut faces: Vec<_> = mesh.faces().iter().map(corners).collect();
    faces.sort_unstable();
    faces
}

#[test]
fn what_is_written_is_read_as_the_same_mesh_with_nothing_left_to_repair() {
    let (mesh, report, text) = written(spoilt());
    let found =
        [report.welded_vertices, report.unused_vertices, report.degenerate, report.divided, report.duplicate];
    assert!(
        found.iter().chain([&report.flipped, &report.closed_holes]).all(|finding| finding.count > 0),
        "{report}"
    );
    let (_, lid) = text.split_once("g lid\n").expect("a group of lids");
    assert!(lid.lines().all(|line| line.starts_with("f ")) && lid.lines().count() == 1, "{lid}");
    let (again, report, _) = written(read_obj(text.as_bytes()).expect("what we wrote"));
    assert!(report.is_clean() && report.welded_vertices.count == 0, "{report}");
    assert!(faces(&again) == faces(&mesh), "other faces");
}

#[test]
fn whatever_stays_open_or_touches_is_the_same_when_it_is_written_and_read() {
    let touching = {
        // Two cubes that share an edge.
        let mut soup = make::cuboid([0.2; 3]);
        let other: Vec<_> = soup.vertices.iter().map(|v| v + nalgebra::Vector3::new(0.2, 0.2, 0.0)).collect();
        let count = soup.vertices.len() as u32;
        soup.faces.extend(soup.faces.clone().iter().map(|face| face.map(|v| v + count)));
        soup.vertices.extend(other);
        soup
    };
    for soup in [make::mobius_strip(64, 8, 0.3, 0.1), make::klein_bottle(32, 16, 0.1), touching] {
        let (mesh, report, text) = written(soup);
        let (again, report_again, text_again) = written(read_obj(text.as_bytes()).expect("what we wrote"));
        assert_eq!(
            (again.vertices(), again.faces()),
            (mesh.vertices(), mesh.faces()),
            "{report}\n{report_again}"
        );
        assert_eq!(text_again, text);
        assert!(!report.is_clean() && report_again.flipped.count == 0, "{report_again}");
    }
}

/// Names in a word, with spaces, with what OBJ cannot say, and none.
#[test]
fn names_of_faces_are_written_so_that_they_are_read() {
    let soup = make::cuboid([0.1; 3]);
    let names: [&[&str]; 4] = [&["tyre", "soft rubber", "The Wheel"], &["hub"], &["a#b", "plain"], &[]];
    let names: Vec<Vec<String>> =
        names.iter().map(|set| set.iter().map(|name| (*name).to_owned()).collect()).collect();
    let mut origins = Vec::new();
    let (mesh, _) =
        Mesh::build_and_tell(soup, CloseHoles::Small, |origin, _| origins.push(origin)).expect("a mesh");
    let text = write_obj(&mesh, &[false; 12], |face| &names[origins[face] % 4]);
    let file = std::path::Path::new("a.obj");
    let read = world::model::read_names(file, text.as_bytes()).expect("what we wrote").expect("names");
    let all: Vec<_> = read.all().into_iter().collect();
    let expected =
        [("The Wheel", 3), ("hub", 3), ("mesh", 12), ("plain", 3), ("soft rubber", 3), ("tyre", 3)];
    assert_eq!(all, expected, "{text}");
}
