//! STL, text and binary.
//!
//! Binary: a header of 80 bytes, the number of triangles, then 50 bytes each: normal and three corners as `f32`, and two
//! bytes nobody agrees on. Many programs begin the header with "solid", as text does; so a file is binary if its length
//! is what its count says, or if its beginning holds a zero byte, which no text does.
//!
//! Normals are ignored: often zero, often wrong, and given by the corners anyway. Each triangle gets three vertices of
//! its own; `Mesh::build` merges those that are equal to the bit.

use super::obj::looks_like_obj;
use super::words::{BYTE_ORDER_MARK, Words};
use super::{ModelError, shown, with_triangles};
use haptics::mesh::TriangleSoup;
use nalgebra::Vector3;

const HEADER_BYTES: usize = 84;
const TRIANGLE_BYTES: usize = 50;
/// Where the corners of a triangle begin, behind its normal.
const CORNERS_AT: usize = 12;

/// Reads an STL file.
///
/// # Errors
/// The first thing found to be wrong, with its line or byte.
pub fn read_stl(bytes: &[u8]) -> Result<TriangleSoup, ModelError> {
    if !looks_like_stl(bytes) && looks_like_obj(bytes) {
        let found = format!("a text that looks like OBJ, which begins with {}", shown(bytes));
        let allowed = "STL; if it is OBJ, let its name end in .obj".into();
        return Err(ModelError::Byte { offset: 0, found, allowed });
    }
    with_triangles(if is_text(bytes) { read_text(bytes) } else { read_binary(bytes) }?)
}

/// Whether a file without a name would be taken for STL.
pub(super) fn looks_like_stl(bytes: &[u8]) -> bool {
    has_the_length_it_says(bytes) || begins_with_solid(bytes)
}

/// True of the kind that consists of words.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    let beginning = &bytes[..bytes.len().min(HEADER_BYTES)];
    begins_with_solid(bytes) && !has_the_length_it_says(bytes) && !beginning.contains(&0)
}

fn begins_with_solid(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes).trim_ascii_start();
    text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"))
}

fn has_the_length_it_says(bytes: &[u8]) -> bool {
    said_triangles(bytes).is_some_and(|count| bytes.len() == HEADER_BYTES + count * TRIANGLE_BYTES)
}

fn said_triangles(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(80..84)?.try_into().ok()?;
    Some(u32::from_le_bytes(count) as usize)
}

fn read_binary(bytes: &[u8]) -> Result<TriangleSoup, ModelError> {
    check_length(bytes)?;
    let triangles = bytes[HEADER_BYTES..].chunks_exact(TRIANGLE_BYTES);
    let mut vertices = Vec::with_capacity(3 * triangles.len());
    for (index, triangle) in triangles.enumerate() {
        for corner in triangle[CORNERS_AT..][..36].chunks_exact(12) {
            let vertex = Vector3::from_fn(|axis, _| {
                let at = 4 * axis;
                f64::from(f32::from_le_bytes([corner[at], corner[at + 1], corner[at + 2], corner[at + 3]]))
            });
            if !vertex.iter().all(|x| x.is_finite()) {
                return Err(not_finite(index, vertices.len() % 3, &vertex));
            }
            vertices.push(vertex);
        }
    }
    Ok(soup_of(vertices))
}

fn check_length(bytes: &[u8]) -> Result<(), ModelError> {
    let length = bytes.len();
    let wrong = |offset, found, allowed| Err(ModelError::Byte { offset, found, allowed });
    let Some(count) = said_triangles(bytes) else {
        let allowed =
            format!("a binary STL file of at least {HEADER_BYTES} bytes, or a text that begins with `solid`");
        return wrong(length, format!("the end of the file, which begins with {}", shown(bytes)), allowed);
    };
    let expected = HEADER_BYTES + count * TRIANGLE_BYTES;
    if length == expected {
        return Ok(());
    }
    let room = (length - HEADER_BYTES) / TRIANGLE_BYTES;
    if length < expected {
        let found = format!(
            "the end of the file after {room} of the {count} triangles that byte 80 promises; it may be cut short"
        );
        wrong(length, found, format!("{expected} bytes for {count} triangles"))
    } else {
        let found = format!("{} bytes behind the {count} triangles that byte 80 promises", length - expected);
        wrong(expected, found, format!("the end of the file, or a count of {room} triangles"))
    }
}

fn not_finite(triangle: usize, corner: usize, vertex: &Vector3<f64>) -> ModelError {
    let [x, y, z] = (*vertex).into();
    ModelError::Byte {
        offset: HEADER_BYTES + triangle * TRIANGLE_BYTES + CORNERS_AT + 12 * corner,
        found: format!("corner {corner} of triangle {triangle} (counted from 0) at [{x:?}, {y:?}, {z:?}]"),
        allowed: "finite numbers".into(),
    }
}

/// Three vertices to a triangle.
fn soup_of(vertices: Vec<Vector3<f64>>) -> TriangleSoup {
    let faces = (0..vertices.len() as u32 / 3).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
    TriangleSoup { vertices, faces }
}

/// `solid NAME`, facets, `endsolid NAME`; any number of these one after another.
fn read_text(bytes: &[u8]) -> Result<TriangleSoup, ModelError> {
    let mut words = Words::new(bytes);
    let mut vertices = Vec::new();
    loop {
        let Some(word) = words.next() else { return Ok(soup_of(vertices)) };
        if !word.eq_ignore_ascii_case(b"solid") {
            return Err(words.wrong(Some(word), "`solid`, or the end of the file"));
        }
        words.skip_line();
        loop {
            match words.next() {
                Some(word) if word.eq_ignore_ascii_case(b"facet") => read_facet(&mut words, &mut vertices)?,
                Some(word) if word.eq_ignore_ascii_case(b"endsolid") => break words.skip_line(),
                other => return Err(words.wrong(other, "`facet` or `endsolid`")),
            }
        }
    }
}

fn read_facet(words: &mut Words<'_>, vertices: &mut Vec<Vector3<f64>>) -> Result<(), ModelError> {
    words.expect("normal")?;
    for _ in 0..3 {
        // Whatever it is: programs write `nan` for the normal of a triangle without an area.
        if words.next().is_none() {
            return Err(words.wrong(None, "a normal's three numbers"));
        }
    }
    words.expect("outer")?;
    words.expect("loop")?;
    for _ in 0..3 {
        words.expect("vertex")?;
        vertices.push(Vector3::new(words.number()?, words.number()?, words.number()?));
    }
    words.expect("endloop")?;
    words.expect("endfacet")
}
