//! Gives each part that meets others at a point alone a vertex of its own there.
//!
//! Problem: two cubes that touch at a corner share a vertex, but no walk leads from one to the other. A finger that
//! one of them lets go there must still meet the other, so faces around *its* vertex must not be those of both.
//!
//! Model: the corners that links join around a vertex are a fan. The first fan keeps the vertex, each further one
//! gets a copy of it. Both ends of an edge belong to the same fans for both of its faces, so edges stay what they were.
//!
//! Cost: linear.

use super::Link;
use super::order::Triangle;
use nalgebra::Vector3;

/// Copies go behind the other vertices, in the order of their fans' first faces; gives for each which vertex it is a copy of.
pub(super) fn part(
    triangles: &mut [Triangle],
    links: &[[Link; 3]],
    vertices: &mut Vec<Vector3<f64>>,
) -> Vec<u32> {
    let mut copies = Vec::new();
    let mut is_taken = vec![false; vertices.len()];
    let mut is_done = vec![[false; 3]; triangles.len()];
    for face in 0..triangles.len() {
        for corner in 0..3 {
            if is_done[face][corner] {
                continue;
            }
            let old = triangles[face].corners[corner] as usize;
            let new = if is_taken[old] {
                vertices.push(vertices[old]);
                copies.push(old as u32);
                vertices.len() - 1
            } else {
                old
            };
            is_taken[old] = true;
            around(links, (face, corner), &mut is_done, |face, corner| {
                triangles[face].corners[corner] = new as u32;
            });
        }
    }
    copies
}

/// Visits the corners of a fan: one way round, and where the mesh ends, from the first one the other way.
fn around(
    links: &[[Link; 3]],
    first: (usize, usize),
    is_done: &mut [[bool; 3]],
    mut visit: impl FnMut(usize, usize),
) {
    is_done[first.0][first.1] = true;
    visit(first.0, first.1);
    for first_edge in [(first.1 + 2) % 3, first.1] {
        let ((mut face, mut corner), mut edge) = (first, first_edge);
        loop {
            let link = links[face][edge];
            if link.is_boundary() {
                break;
            }
            // Neighbours run along the shared edge in opposite directions, unless one of them is turned.
            let is_at_start = (edge == corner) == link.is_turned();
            let shared = link.edge();
            (face, corner) = (link.face() as usize, if is_at_start { shared } else { (shared + 1) % 3 });
            if is_done[face][corner] {
                break;
            }
            is_done[face][corner] = true;
            visit(face, corner);
            edge = if shared == corner { (corner + 2) % 3 } else { corner };
        }
    }
}
