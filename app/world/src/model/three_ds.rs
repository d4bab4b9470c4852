//! 3DS, the chunks of 3D Studio.
//!
//! A chunk is a number of two bytes, its length of four with these six, and what is in it: data, then other chunks. Read: of
//! the editor's objects (0x3D3D, 0x4000) each mesh (0x4100) with its vertices (0x4110) and faces (0x4120), and which of
//! them are of which material (0x4130). Vertices
//! are in the world already. Everything else is passed over. The z axis of such files points up; their unit is any.

use super::{FaceNames, ModelError, with_triangles};
use haptics::mesh::TriangleSoup;
use nalgebra::Vector3;

/// Reads a 3DS file.
///
/// # Errors
/// The first thing found to be wrong, with its byte.
pub fn read_three_ds(bytes: &[u8]) -> Result<TriangleSoup, ModelError> {
    Ok(read(bytes)?.0)
}

/// Names of the triangles: of their object and their material.
///
/// # Errors
/// As [`read_three_ds`].
pub(super) fn read_three_ds_names(bytes: &[u8]) -> Result<FaceNames, ModelError> {
    Ok(read(bytes)?.1)
}

fn read(bytes: &[u8]) -> Result<(TriangleSoup, FaceNames), ModelError> {
    let whole = Part { bytes, at: 0, end: bytes.len() };
    let mut soup = TriangleSoup { vertices: Vec::new(), faces: Vec::new() };
    let mut names = FaceNames::default();
    match whole.chunks().next() {
        Some(Ok((MAIN, main))) => main.each(EDITOR, |editor| {
            editor.each(OBJECT, |object| {
                let (name, object) = object.name()?;
                object.each(MESH, |mesh| read_mesh(mesh, &name, &mut soup, &mut names))
            })
        })?,
        Some(Err(error)) => return Err(error),
        _ => return Err(whole.wrong(0, "no chunk 0x4D4D".into(), "one, as every 3DS file begins")),
    }
    Ok((with_triangles(soup)?, names))
}

/// Whether a file without a name would be taken for 3DS.
pub(super) fn looks_like_three_ds(bytes: &[u8]) -> bool {
    let says = |length: &[u8]| *length == (bytes.len() as u32).to_le_bytes();
    bytes.starts_with(b"MM") && bytes.get(2..6).is_some_and(says)
}

const MAIN: u16 = 0x4D4D;
const EDITOR: u16 = 0x3D3D;
const OBJECT: u16 = 0x4000;
const MESH: u16 = 0x4100;
const VERTICES: u16 = 0x4110;
const FACES: u16 = 0x4120;
const FACES_OF_MATERIAL: u16 = 0x4130;
const VERTEX_BYTES: usize = 12;
const FACE_BYTES: usize = 8;

fn read_mesh(
    mesh: Part<'_>,
    name: &str,
    soup: &mut TriangleSoup,
    names: &mut FaceNames,
) -> Result<(), ModelError> {
    let begin = soup.vertices.len();
    mesh.each(VERTICES, |part| {
        for at in part.items(VERTEX_BYTES, "vertices")? {
            let vertex = Vector3::from_fn(|axis, _| f64::from(f32::from_bits(part.word(at + 4 * axis))));
            if !vertex.iter().all(|x| x.is_finite()) {
                let [x, y, z] = vertex.into();
                return Err(part.wrong(at, format!("a vertex at [{x:?}, {y:?}, {z:?}]"), "finite numbers"));
            }
            soup.vertices.push(vertex);
        }
        Ok(())
    })?;
    let count = soup.vertices.len() - begin;
    let own = names.set([name]);
    mesh.each(FACES, |part| {
        let first = soup.faces.len();
        for at in part.items(FACE_BYTES, "faces")? {
            let corners = [0, 2, 4].map(|corner| usize::from(part.half(at + corner)));
            if let Some(beyond) = corners.iter().find(|corner| **corner >= count) {
                let allowed = format!("indices of the {count} vertices of its mesh, from 0");
                return Err(part.wrong(at, format!("vertex {beyond}"), &allowed));
            }
            soup.faces.push(corners.map(|corner| (begin + corner) as u32));
        }
        names.add(own, soup.faces.len() - first);
        let behind = part.at + 2 + (soup.faces.len() - first) * FACE_BYTES;
        let materials = Part { at: behind.min(part.end), ..part };
        // A shape is worth more than the names of its faces.
        let _ = materials.each(FACES_OF_MATERIAL, |part| {
            let (material, part) = part.name()?;
            let both = names.set([name, &material]);
            for at in part.items(2, "faces")? {
                names.rename(first + usize::from(part.half(at)), both);
            }
            Ok(())
        });
        Ok(())
    })
}

/// A part of the file that lies in it.
#[derive(Clone, Copy)]
struct Part<'b> {
    bytes: &'b [u8],
    at: usize,
    end: usize,
}

impl<'b> Part<'b> {
    /// The chunks that it is made of.
    fn chunks(self) -> impl Iterator<Item = Result<(u16, Self), ModelError>> {
        let mut at = self.at;
        std::iter::from_fn(move || {
            // Less than the head of a chunk is what some programs leave.
            if self.end - at < 6 {
                return None;
            }
            let (kind, length) = (self.half(at), self.word(at + 2) as usize);
            if length < 6 || length > self.end - at {
                let found = format!("a chunk {kind:#06x} of {length} bytes");
                let allowed =
                    format!("6 to {}, as many as are left; the file may be cut short", self.end - at);
                let wrong = self.wrong(at, found, &allowed);
                at = self.end;
                return Some(Err(wrong));
            }
            let inner = Self { at: at + 6, end: at + length, ..self };
            at += length;
            Some(Ok((kind, inner)))
        })
    }

    /// Tells of all chunks of a kind in it.
    fn each(self, kind: u16, mut tell: impl FnMut(Self) -> Result<(), ModelError>) -> Result<(), ModelError> {
        for chunk in self.chunks() {
            let (found, inner) = chunk?;
            if found == kind {
                tell(inner)?;
            }
        }
        Ok(())
    }

    /// A name that ends in a zero, and the rest behind it.
    fn name(self) -> Result<(String, Self), ModelError> {
        let length = self.bytes[self.at..self.end].iter().position(|&byte| byte == 0);
        let length = length.ok_or_else(|| {
            self.wrong(self.at, "a name without end".into(), "one that ends in a zero byte")
        })?;
        let name = &self.bytes[self.at..self.at + length];
        Ok((String::from_utf8_lossy(name).into_owned(), Self { at: self.at + length + 1, ..self }))
    }

    /// Beginnings of the items that it counts at its own beginning.
    fn items(self, bytes: usize, what: &str) -> Result<impl Iterator<Item = usize> + use<>, ModelError> {
        let room = (self.end - self.at).saturating_sub(2) / bytes;
        let count = if self.end - self.at < 2 { 0 } else { usize::from(self.half(self.at)) };
        if count > room {
            let found = format!("{count} {what} in a chunk with room for {room}");
            return Err(self.wrong(self.at, found, "as many as there are; the file may be cut short"));
        }
        let begin = self.at + 2;
        Ok((0..count).map(move |item| begin + item * bytes))
    }

    fn half(self, at: usize) -> u16 {
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    fn word(self, at: usize) -> u32 {
        u32::from(self.half(at)) | u32::from(self.half(at + 2)) << 16
    }

    fn wrong(self, offset: usize, found: String, allowed: &str) -> ModelError {
        ModelError::Byte { offset, found, allowed: allowed.into() }
    }
}
