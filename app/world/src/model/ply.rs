//! PLY, as text and binary in either byte order.
//!
//! Read: of the element `vertex` the properties `x`, `y` and `z`, of any kind of number; of `face` the list `vertex_indices`
//! or `vertex_index`, polygons with any number of corners; of `tristrips` the list of the same name, in which -1 begins a
//! new strip. Other elements and properties (colours, normals, qualities) are passed over, whatever they hold, and in a text
//! with a line for each instance also what follows the last property. Elements may come in any order.
//!
//! Nothing is reserved for what the header promises: how many bytes that takes at least is compared with what is there,
//! before anything is read.
//!
//! A reader of our own: `ply-rs-bw` 4.0 names no place, and makes a table of names for each vertex.

mod header;
mod source;

use super::polygon::{Polygons, indivisible};
use super::{ModelError, with_triangles};
use haptics::mesh::TriangleSoup;
use header::{Element, Header, Kind};
use nalgebra::Vector3;
use source::Source;

/// Reads a PLY file.
///
/// # Errors
/// The first thing found to be wrong, with its line or byte.
pub fn read_ply(bytes: &[u8]) -> Result<TriangleSoup, ModelError> {
    let header = Header::read(bytes)?;
    header.check_length(bytes.len())?;
    let mut source = Source::new(&header, bytes);
    let mut read = Read { promised: header.count_of("vertex"), ..Read::default() };
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => read.vertices(element, &mut source)?,
            "face" => read.faces(element, &mut source)?,
            "tristrips" => read.strips(element, &mut source)?,
            _ => skip(element, &mut source)?,
        }
    }
    source.end()?;
    read.soup()
}

/// Whether a file without a name would be taken for PLY.
pub(super) fn looks_like_ply(bytes: &[u8]) -> bool {
    bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r")
}

#[derive(Default)]
struct Read {
    /// Number of vertices by the header.
    promised: u64,
    vertices: Vec<Vector3<f64>>,
    polygons: Polygons,
    /// Of strips.
    faces: Vec<[u32; 3]>,
}

impl Read {
    fn vertices(&mut self, element: &Element, source: &mut Source<'_>) -> Result<(), ModelError> {
        let axis_of = |name: &str| ["x", "y", "z"].iter().position(|axis| *axis == name);
        let mut axes = Vec::new();
        for property in &element.properties {
            axes.push(axis_of(&property.name).filter(|_| matches!(property.kind, Kind::One(_))));
        }
        for axis in 0..3 {
            if axes.iter().filter(|found| **found == Some(axis)).count() != 1 {
                let found =
                    format!("an element `vertex` without exactly one number `{}`", ["x", "y", "z"][axis]);
                return Err(element.wrong(found, "properties `x`, `y` and `z`"));
            }
        }
        for _ in 0..element.count {
            let mut vertex = Vector3::zeros();
            for (property, axis) in element.properties.iter().zip(&axes) {
                match (axis, property.kind) {
                    (Some(axis), Kind::One(number)) => {
                        let x = source.number(number)?;
                        if !x.is_finite() {
                            return Err(source.wrong(&format!("{} = {x:?}", property.name), "finite numbers"));
                        }
                        vertex[*axis] = x;
                    }
                    (_, kind) => source.skip(kind)?,
                }
            }
            source.end_instance();
            self.vertices.push(vertex);
        }
        Ok(())
    }

    fn faces(&mut self, element: &Element, source: &mut Source<'_>) -> Result<(), ModelError> {
        let promised = self.promised;
        each_list(element, source, |source, count, number| {
            if count < 3 {
                let corners = if count == 1 { "corner" } else { "corners" };
                return Err(source.wrong(&format!("a face of {count} {corners}"), "three corners or more"));
            }
            for _ in 0..count {
                let index = source.number(number)?;
                self.polygons
                    .corner(vertex(index, promised).ok_or_else(|| out_of_range(source, index, promised))?);
            }
            self.polygons.close();
            Ok(())
        })
    }

    fn strips(&mut self, element: &Element, source: &mut Source<'_>) -> Result<(), ModelError> {
        let promised = self.promised;
        each_list(element, source, |source, count, number| {
            let mut strip = Strip::default();
            for _ in 0..count {
                let index = source.number(number)?;
                if index == -1.0 {
                    strip = Strip::default();
                    continue;
                }
                let corner = vertex(index, promised).ok_or_else(|| out_of_range(source, index, promised))?;
                self.faces.extend(strip.next(corner));
            }
            Ok(())
        })
    }

    fn soup(self) -> Result<TriangleSoup, ModelError> {
        let mut faces = self.polygons.divide(&self.vertices).map_err(|(corners, number)| {
            let (found, allowed) = indivisible(corners);
            ModelError::Place { place: format!("face {number} (counted from 0)"), found, allowed }
        })?;
        faces.extend(self.faces);
        with_triangles(TriangleSoup { vertices: self.vertices, faces })
    }
}

/// Corners that come one after the other: from the third on each makes a triangle with the two before it.
#[derive(Default)]
pub(super) struct Strip {
    last: [Option<u32>; 2],
    is_odd: bool,
}

impl Strip {
    /// Triangles of which two corners are the same vertex turn the strip, and are none.
    pub(super) fn next(&mut self, corner: u32) -> Option<[u32; 3]> {
        let [first, second] = self.last;
        self.last = [second, Some(corner)];
        let (first, second) = (first?, second?);
        let face = if self.is_odd { [second, first, corner] } else { [first, second, corner] };
        self.is_odd = !self.is_odd;
        (first != second && second != corner && corner != first).then_some(face)
    }
}

/// Tells of the list of vertices of each instance; everything else of it is passed over.
fn each_list(
    element: &Element,
    source: &mut Source<'_>,
    mut tell: impl FnMut(&mut Source<'_>, u64, header::Number) -> Result<(), ModelError>,
) -> Result<(), ModelError> {
    let is_list = |name: &str| name == "vertex_indices" || name == "vertex_index";
    let lists = element.properties.iter().filter(|p| is_list(&p.name) && matches!(p.kind, Kind::List { .. }));
    if element.count > 0 && lists.count() != 1 {
        let found = format!("an element `{}` without exactly one list `vertex_indices`", element.name);
        return Err(element.wrong(found, "`property list uchar int vertex_indices`, or `vertex_index`"));
    }
    for _ in 0..element.count {
        for property in &element.properties {
            match property.kind {
                Kind::List { count, item } if is_list(&property.name) => {
                    let count = source.count(count)?;
                    tell(source, count, item)?;
                }
                kind => source.skip(kind)?,
            }
        }
        source.end_instance();
    }
    Ok(())
}

fn skip(element: &Element, source: &mut Source<'_>) -> Result<(), ModelError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    for _ in 0..element.count {
        element.properties.iter().try_for_each(|property| source.skip(property.kind))?;
        source.end_instance();
    }
    Ok(())
}

/// An index of one of so many vertices.
fn vertex(index: f64, vertices: u64) -> Option<u32> {
    let is_one =
        index.fract() == 0.0 && index >= 0.0 && index < vertices as f64 && index <= f64::from(u32::MAX);
    is_one.then_some(index as u32)
}

fn out_of_range(source: &Source<'_>, index: f64, vertices: u64) -> ModelError {
    let allowed = match vertices.checked_sub(1) {
        None => "a vertex, but there is none".into(),
        Some(last) => format!("0 to {last}, since there are {vertices} vertices"),
    };
    source.wrong(&format!("vertex {index}"), &allowed)
}
