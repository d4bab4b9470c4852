//! Meshes as Wavefront OBJ.

use haptics::mesh::Mesh;
use std::fmt::Write;

/// The mesh as it was understood; faces for which `is_lid` says so are in a group `lid`, the others in a group `mesh`.
///
/// Numbers are written so that they are read to the bit, and so the same faces are built of what is read.
pub fn write_obj(mesh: &Mesh, is_lid: &[bool]) -> String {
    let mut text = String::new();
    for vertex in mesh.vertices() {
        let [x, y, z]: [f64; 3] = (*vertex).into();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "v {x:?} {y:?} {z:?}");
    }
    for (group, wanted) in [("mesh", false), ("lid", true)] {
        let mut is_begun = false;
        for (face, _) in mesh.faces().iter().zip(is_lid).filter(|(_, is_lid)| **is_lid == wanted) {
            if !std::mem::replace(&mut is_begun, true) {
                let _ = writeln!(text, "g {group}");
            }
            let [a, b, c] = face.vertices.map(|vertex| vertex + 1);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
    }
    text
}
