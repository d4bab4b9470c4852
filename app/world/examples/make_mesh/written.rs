//! Meshes by name, and how they are written down.
//!
//! Coordinates are rounded to nanometres and to `f32`, which is what binary STL holds.

use haptics::mesh::{TriangleSoup, make};
use std::fmt::Write;

/// A mesh of a kind: its number, and about its size (m).
type Make = fn(usize, f64) -> TriangleSoup;

/// Name, usual number, and the mesh.
pub(crate) const KINDS: [(&str, usize, Make); 8] = [
    ("sphere", 48, |nu, size_m| make::uv_sphere(nu, (nu / 2).max(2), 0.5 * size_m)),
    ("bumpy", 48, |nu, size_m| make::bumpy_sphere(nu, (nu / 2).max(2), 0.5 * size_m)),
    ("torus", 48, |nu, size_m| make::torus(nu, (nu / 2).max(3), 0.35 * size_m, 0.15 * size_m)),
    ("klein", 32, |nu, size_m| make::klein_bottle(nu, (nu / 2).max(3), size_m)),
    ("mobius", 64, |nu, size_m| make::mobius_strip(nu, (nu / 8).max(1), 0.35 * size_m, 0.3 * size_m)),
    ("star", 5, |points, size_m| make::star(points, 0.5 * size_m, 0.25 * size_m, 0.5 * size_m)),
    ("wedge", 60, |degrees, size_m| make::wedge((degrees.min(179) as f64).to_radians(), size_m, size_m)),
    ("cuboid", 0, |_, size_m| make::cuboid([size_m; 3])),
];

/// How a mesh is written down.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Format {
    /// Wavefront OBJ.
    Obj,
    /// Binary STL.
    Stl,
    /// STL as text.
    StlText,
}

impl Format {
    /// The bytes of a file.
    pub(crate) fn write(self, soup: &TriangleSoup) -> Vec<u8> {
        match self {
            Self::Obj => obj(soup).into_bytes(),
            Self::Stl => stl(soup),
            Self::StlText => stl_text(soup).into_bytes(),
        }
    }
}

fn obj(soup: &TriangleSoup) -> String {
    let mut text = String::new();
    for vertex in &soup.vertices {
        let [x, y, z] = rounded(vertex);
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in &soup.faces {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

/// Normals are left zero: readers are to work them out of the corners.
fn stl(soup: &TriangleSoup) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((soup.faces.len() as u32).to_le_bytes());
    for face in &soup.faces {
        bytes.extend([0; 12]);
        for corner in face {
            bytes.extend(rounded(&soup.vertices[*corner as usize]).into_iter().flat_map(f32::to_le_bytes));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn stl_text(soup: &TriangleSoup) -> String {
    let mut text = String::from("solid mesh\n");
    for face in &soup.faces {
        text.push_str("facet normal 0 0 0\n outer loop\n");
        for corner in face {
            let [x, y, z] = rounded(&soup.vertices[*corner as usize]);
            let _ = writeln!(text, "  vertex {x} {y} {z}");
        }
        text.push_str(" endloop\nendfacet\n");
    }
    text + "endsolid mesh\n"
}

/// What sines leave of a zero, and its sign, are left out.
fn rounded(vertex: &nalgebra::Vector3<f64>) -> [f32; 3] {
    [vertex.x, vertex.y, vertex.z].map(|x| ((x * 1e9).round() / 1e9) as f32 + 0.0)
}
