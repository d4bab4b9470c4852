//! Meshes as Wavefront OBJ.

use haptics::mesh::Mesh;
use std::fmt::Write;

/// The mesh as it was understood; faces for which `is_lid` says so are in a group `lid`, the others in a group `mesh`.
/// `names` tells what else a face is called: names in one word are groups, too; of those with spaces the first is its
/// material, the second its object.
///
/// Numbers are written so that they are read to the bit, and so the same faces are built of what is read.
pub fn write_obj<'n>(mesh: &Mesh, is_lid: &[bool], names: impl Fn(usize) -> &'n [String]) -> String {
    let mut text = String::new();
    for vertex in mesh.vertices() {
        let [x, y, z]: [f64; 3] = (*vertex).into();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "v {x:?} {y:?} {z:?}");
    }
    let mut spaced = [None; 2];
    for (group, wanted) in [("mesh", false), ("lid", true)] {
        let mut called: Option<&[String]> = None;
        for (index, (face, _)) in
            mesh.faces().iter().zip(is_lid).enumerate().filter(|(_, (_, is_lid))| **is_lid == wanted)
        {
            let own = names(index);
            if called.replace(own) != Some(own) {
                call(&mut text, group, own, &mut spaced);
            }
            let [a, b, c] = face.vertices.map(|vertex| vertex + 1);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
    }
    text
}

/// Names of the next faces; `spaced`: the material and the object of the last ones.
fn call<'n>(text: &mut String, group: &str, names: &'n [String], spaced: &mut [Option<&'n str>; 2]) {
    // A comment would begin there, and a line end.
    let can_be_written = |name: &&String| !name.contains(['#', '\\']) && !name.contains(char::is_control);
    let (words, others): (Vec<&String>, Vec<&String>) =
        names.iter().filter(can_be_written).partition(|name| !name.contains(char::is_whitespace));
    let _ = write!(text, "g {group}");
    words.iter().for_each(|word| {
        let _ = write!(text, " {word}");
    });
    text.push('\n');
    for (at, keyword) in ["usemtl", "o"].into_iter().enumerate() {
        let name = others.get(at).map(|name| name.as_str());
        if std::mem::replace(&mut spaced[at], name) != name {
            let _ = writeln!(text, "{keyword} {}", name.unwrap_or_default());
        }
    }
}
