//! Meshes for tests: soups by formula, beside those of `haptics::mesh::make`.
#![allow(dead_code, unreachable_pub)]

use std::collections::BTreeMap;
use std::sync::Arc;

use haptics::mesh::{Mesh, TriangleSoup};
use nalgebra::Vector3;

pub fn build(soup: TriangleSoup) -> Arc<Mesh> {
    Arc::new(Mesh::build(soup).unwrap().0)
}

/// Every triangle in four, with corners in the middles of its edges.
pub fn cut_in_four(soup: &TriangleSoup) -> TriangleSoup {
    let mut vertices = soup.vertices.clone();
    let mut middles = BTreeMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            vertices.push((soup.vertices[a as usize] + soup.vertices[b as usize]) * 0.5);
            (vertices.len() - 1) as u32
        })
    };
    let mut faces = Vec::with_capacity(4 * soup.faces.len());
    for &[a, b, c] in &soup.faces {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    TriangleSoup { vertices, faces }
}

/// A sheet of `cells` x `cells` squares in two triangles each, `size` wide, of this height over x and z.
pub fn terrain(cells: usize, size: f64, height: impl Fn(f64, f64) -> f64) -> TriangleSoup {
    let place = |i: usize| size * (i as f64 / cells as f64 - 0.5);
    let mut vertices = Vec::new();
    for j in 0..=cells {
        vertices.extend((0..=cells).map(|i| Vector3::new(place(i), height(place(i), place(j)), place(j))));
    }
    let index = |i: usize, j: usize| (j * (cells + 1) + i) as u32;
    let mut faces = Vec::new();
    for j in 0..cells {
        for i in 0..cells {
            let [a, b, c, d] = [index(i, j), index(i, j + 1), index(i + 1, j + 1), index(i + 1, j)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriangleSoup { vertices, faces }
}

/// A block with such a top, flat below: closed.
pub fn block(cells: usize, size: f64, thickness: f64, height: impl Fn(f64, f64) -> f64) -> TriangleSoup {
    let mut soup = terrain(cells, size, height);
    let top = soup.vertices.len() as u32;
    let below = soup.vertices.iter().map(|v| Vector3::new(v.x, -thickness, v.z)).collect::<Vec<_>>();
    soup.vertices.extend(below);
    let turned = soup.faces.iter().map(|&[a, b, c]| [a + top, c + top, b + top]).collect::<Vec<_>>();
    soup.faces.extend(turned);
    let n = cells as u32;
    let index = |i: u32, j: u32| j * (n + 1) + i;
    let mut rim: Vec<u32> = (0..n).map(|j| index(0, j)).collect();
    rim.extend((0..n).map(|i| index(i, n)));
    rim.extend((0..n).map(|j| index(n, n - j)));
    rim.extend((0..n).map(|i| index(n - i, 0)));
    for (at, &a) in rim.iter().enumerate() {
        let b = rim[(at + 1) % rim.len()];
        soup.faces.extend([[a, a + top, b + top], [a, b + top, b]]);
    }
    soup
}

/// An angle: a lying and a standing arm, of these boxes (centre, size).
pub const ANGLE_PARTS: [([f64; 3], [f64; 3]); 2] =
    [([0.03, 0.01, 0.0], [0.06, 0.02, 0.03]), ([0.01, 0.05, 0.0], [0.02, 0.06, 0.03])];

/// The angle as one closed mesh.
pub fn angle() -> TriangleSoup {
    let outline = [[0.0, 0.0], [0.06, 0.0], [0.06, 0.02], [0.02, 0.02], [0.02, 0.08], [0.0, 0.08]];
    prism(&outline, &[[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]], 0.03)
}

/// A prism along z over an outline, counter-clockwise, with these triangles.
pub fn prism(outline: &[[f64; 2]], triangles: &[[u32; 3]], depth: f64) -> TriangleSoup {
    let n = outline.len() as u32;
    let end = |z: f64| outline.iter().map(move |[x, y]| Vector3::new(*x, *y, z));
    let vertices = end(0.5 * depth).chain(end(-0.5 * depth)).collect();
    let mut faces: Vec<[u32; 3]> = triangles.to_vec();
    faces.extend(triangles.iter().map(|&[a, b, c]| [a + n, c + n, b + n]));
    for a in 0..n {
        let b = (a + 1) % n;
        faces.extend([[a, a + n, b + n], [a, b + n, b]]);
    }
    TriangleSoup { vertices, faces }
}

/// Boxes of a grid between these planes, those that `is_filled` names, as one closed mesh.
pub fn cells(planes: [&[f64]; 3], is_filled: impl Fn([usize; 3]) -> bool) -> TriangleSoup {
    let [nx, ny, nz] = planes.map(<[f64]>::len);
    let is_filled = |cell: [i64; 3]| {
        let inside = cell.iter().zip([nx, ny, nz]).all(|(&at, n)| at >= 0 && at + 1 < n as i64);
        inside && is_filled(cell.map(|at| at as usize))
    };
    let mut soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    let mut numbers = BTreeMap::new();
    for cell in (0..nx * ny * nz).map(|i| [i / (ny * nz), i / nz % ny, i % nz].map(|at| at as i64)) {
        for (axis, side) in (0..6).map(|i| (i / 2, i % 2)) {
            let mut beside = cell;
            beside[axis] += 2 * side as i64 - 1;
            if !is_filled(cell) || is_filled(beside) {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut corner = |s: i64, t: i64| {
                let mut at = cell;
                (at[axis], at[u], at[v]) = (at[axis] + side as i64, at[u] + s, at[v] + t);
                *numbers.entry(at).or_insert_with(|| {
                    soup.vertices.push(Vector3::from_fn(|axis, _| planes[axis][at[axis] as usize]));
                    (soup.vertices.len() - 1) as u32
                })
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            let quad = if side == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
            soup.faces.extend(quad);
        }
    }
    soup
}

/// A block of 100 x 60 x 100 mm with a square hole from above, down to `floor`, in whose middle x and z are 0.
pub fn block_with_hole(half: f64, floor: f64) -> TriangleSoup {
    let across = [-0.05, -half, half, 0.05];
    cells([&across, &[-0.03, floor, 0.03], &across], |[x, y, z]| [x, y, z] != [1, 1, 1])
}
