//! Wavefront OBJ: vertices and polygons.
//!
//! Read: `v x y z` (with a weight or a colour behind it, ignored) and `f` with three or more corners `a`, `a/b`, `a//c`
//! or `a/b/c`; negative indices count back from the last vertex; texture coordinates `vt`, if a picture is to lie on the
//! model. Polygons are divided into triangles. Objects, groups
//! and materials give the faces names; the materials' file need not be there. Ignored: normals, lines and points. Refused: free-form curves
//! and surfaces, which have no polygons.
//!
//! A face may name a vertex that comes later in the file, so polygons are divided when all vertices are known.

use super::polygon::{Divider, indivisible};
use super::words::BYTE_ORDER_MARK;
use super::{FaceNames, ModelError, a_number, number, shown, with_triangles};
use haptics::mesh::{CornerUv, TriangleSoup};
use nalgebra::Vector3;
use std::borrow::Cow;

/// Reads an OBJ file.
///
/// # Errors
/// The first thing found to be wrong, with its line.
pub fn read_obj(bytes: &[u8]) -> Result<TriangleSoup, ModelError> {
    let read = Polygons::read(bytes)?;
    let mut faces = Vec::with_capacity(read.polygons.len());
    read.for_each_triangle(|corners, begin, face| {
        faces.push(face.map(|number| corners[begin + number as usize]));
    })?;
    with_triangles(TriangleSoup { vertices: read.vertices, faces })
}

/// Reads an OBJ file whose faces have texture coordinates; one triple for each triangle of the soup.
///
/// # Errors
/// As [`read_obj`]; a corner of a face without a texture coordinate.
pub fn read_obj_with_uv(bytes: &[u8]) -> Result<(TriangleSoup, Vec<CornerUv>), ModelError> {
    let read = Polygons::read(bytes)?;
    let textures = Textures::read(bytes)?;
    let (mut faces, mut uv) = (Vec::with_capacity(read.polygons.len()), Vec::new());
    read.for_each_triangle(|corners, begin, face| {
        // By the number of the corner within its polygon, which tells its vertex and its texture coordinate.
        let at = face.map(|number| begin + number as usize);
        faces.push(at.map(|corner| corners[corner]));
        uv.push(at.map(|corner| textures.uv[textures.corners[corner] as usize]));
    })?;
    Ok((with_triangles(TriangleSoup { vertices: read.vertices, faces })?, uv))
}

/// Names of the triangles that [`read_obj`] returns: their object (`o`), their groups (`g`) and their material
/// (`usemtl`).
///
/// # Errors
/// As [`read_obj`].
pub(super) fn read_obj_names(bytes: &[u8]) -> Result<FaceNames, ModelError> {
    let read = Polygons::read(bytes)?;
    let mut names = FaceNames::default();
    let mut called = Called::default();
    let (mut set, mut begin) = (None, 0);
    let mut polygons = read.polygons.iter();
    for (_, statement) in Statements::new(bytes) {
        match words(&statement).next() {
            Some(b"f" | b"fo") => {
                let Some(polygon) = polygons.next() else { break };
                let set = *set.get_or_insert_with(|| names.set(called.all()));
                names.add(set, (polygon.end - begin) as usize - 2);
                begin = polygon.end;
            }
            Some(b"o" | b"g" | b"usemtl") => {
                called.take(&statement);
                set = None;
            }
            _ => {}
        }
    }
    Ok(names)
}

/// The line on which the polygon begins that became triangle `face` (counted from 0) of what [`read_obj`] returns.
///
/// For messages: it reads the file once more.
pub fn line_of_face(bytes: &[u8], face: usize) -> Option<usize> {
    let mut triangles = 0;
    let mut begin = 0;
    for Polygon { line, end } in Polygons::read(bytes).ok()?.polygons {
        triangles += (end - begin) as usize - 2;
        if face < triangles {
            return Some(line as usize);
        }
        begin = end;
    }
    None
}

/// Whether a file without a name would be taken for OBJ.
pub(super) fn looks_like_obj(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let mut lines = text.split(|&byte| byte == b'\n').take(1000);
    let first = lines.find_map(|line| words(line).next());
    first.is_some_and(|word| word == b"v" || word == b"f" || IGNORED.contains(&word))
}

pub(super) const IGNORED: [&[u8]; 18] = [
    b"vt",
    b"vn",
    b"o",
    b"g",
    b"s",
    b"mg",
    b"l",
    b"p",
    b"usemtl",
    b"mtllib",
    b"usemap",
    b"maplib",
    b"shadow_obj",
    b"trace_obj",
    b"bevel",
    b"c_interp",
    b"d_interp",
    b"lod",
];
pub(super) const FREE_FORM: [&[u8]; 19] = [
    b"cstype", b"deg", b"bmat", b"step", b"curv", b"curv2", b"surf", b"parm", b"trim", b"hole", b"scrv",
    b"sp", b"end", b"con", b"vp", b"ctech", b"stech", b"bzp", b"bsp",
];

/// A face of the file.
struct Polygon {
    line: u32,
    /// Behind its last corner.
    end: u32,
}

/// What the file says, before polygons become triangles.
#[derive(Default)]
struct Polygons {
    vertices: Vec<Vector3<f64>>,
    /// Of all polygons, one after another.
    corners: Vec<u32>,
    polygons: Vec<Polygon>,
}

impl Polygons {
    fn read(bytes: &[u8]) -> Result<Self, ModelError> {
        let mut read = Self::default();
        // Lines and indices of corners whose vertices have not come yet.
        let mut awaited = Vec::new();
        for (line, statement) in Statements::new(bytes) {
            let mut words = words(&statement);
            match words.next() {
                Some(b"v") => read.vertices.push(vertex(line, words)?),
                Some(b"f" | b"fo") => read.polygon(line, words, &mut awaited)?,
                Some(word) if FREE_FORM.contains(&word) => return Err(free_form(line, word)),
                Some(word) if !IGNORED.contains(&word) => return Err(unknown(line, word)),
                _ => {}
            }
        }
        let count = read.vertices.len();
        match awaited.into_iter().find(|(_, index)| *index as usize >= count) {
            Some((line, index)) => Err(out_of_range(line, &(u64::from(index) + 1).to_string(), count)),
            None => Ok(read),
        }
    }

    /// Divides all polygons; `tell` hears of all corners, where those of the polygon begin, and of a triangle as numbers of
    /// the polygon's corners.
    fn for_each_triangle(&self, mut tell: impl FnMut(&[u32], usize, [u32; 3])) -> Result<(), ModelError> {
        let begins = std::iter::once(0).chain(self.polygons.iter().map(|polygon| polygon.end as usize));
        let ranges = begins.zip(&self.polygons).map(|(begin, polygon)| begin..polygon.end as usize);
        let mut divider = Divider::new(&self.vertices, ranges.clone().map(|range| &self.corners[range]));
        let mut divided = Vec::new();
        for (range, polygon) in ranges.zip(&self.polygons) {
            divided.clear();
            divider.divide(&self.corners[range.clone()], &mut divided).ok_or_else(|| {
                let (found, allowed) = indivisible(range.len());
                ModelError::Line { line: polygon.line as usize, found, allowed }
            })?;
            divided.iter().for_each(|&face| tell(&self.corners, range.start, face));
        }
        Ok(())
    }

    fn polygon<'l>(
        &mut self,
        line: usize,
        words: impl Iterator<Item = &'l [u8]>,
        awaited: &mut Vec<(usize, u32)>,
    ) -> Result<(), ModelError> {
        let begin = self.corners.len();
        for word in words {
            let index = self.index(line, word)?;
            if index as usize >= self.vertices.len() {
                awaited.push((line, index));
            }
            self.corners.push(index);
        }
        let count = self.corners.len() - begin;
        if count < 3 {
            let found = format!("a face of {count} corners");
            return Err(ModelError::Line { line, found, allowed: "three corners or more".into() });
        }
        self.polygons.push(Polygon { line: line as u32, end: self.corners.len() as u32 });
        Ok(())
    }

    /// The vertex that a corner such as `7`, `-1/2` or `7//3` names, counted from 0. It may not have come yet.
    fn index(&self, line: usize, word: &[u8]) -> Result<u32, ModelError> {
        let mut parts = word.split(|&byte| byte == b'/');
        let vertex = parts.next().and_then(integer);
        let others_are_sound =
            parts.clone().count() <= 2 && parts.all(|part| part.is_empty() || integer(part).is_some());
        let Some(number) = vertex.filter(|_| others_are_sound) else {
            let allowed = "corners such as 7, 7/2, 7//3 or 7/2/3 in whole numbers".into();
            return Err(ModelError::Line { line, found: shown(word), allowed });
        };
        let count = self.vertices.len();
        let index = match number {
            1.. => u32::try_from(number - 1).ok(),
            0 => None,
            // Counted back from the last vertex so far.
            _ => usize::try_from(count as i64 + number).ok().map(|index| index as u32),
        };
        index.ok_or_else(|| out_of_range(line, &number.to_string(), count))
    }
}

/// Names of the polygons that follow.
#[derive(Default)]
struct Called {
    object: String,
    groups: Vec<String>,
    material: String,
}

impl Called {
    fn take(&mut self, statement: &[u8]) {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        let mut words = words(statement);
        match words.next() {
            Some(b"g") => self.groups = words.map(text).collect(),
            // Names with spaces are common.
            Some(b"o") => self.object = text(&words.collect::<Vec<_>>().join(&b' ')),
            _ => self.material = text(&words.collect::<Vec<_>>().join(&b' ')),
        }
    }

    fn all(&self) -> impl Iterator<Item = &String> {
        [&self.material, &self.object].into_iter().chain(&self.groups)
    }
}

/// What the file says of texture coordinates. It is read apart from the polygons, so that files without cost nothing.
#[derive(Default)]
struct Textures {
    uv: Vec<[f64; 2]>,
    /// Of all corners of all polygons, one after another.
    corners: Vec<u32>,
}

impl Textures {
    /// Of a file whose polygons have been read, and whose corners are sound.
    fn read(bytes: &[u8]) -> Result<Self, ModelError> {
        let mut read = Self::default();
        let mut awaited = Vec::new();
        for (line, statement) in Statements::new(bytes) {
            let mut words = words(&statement);
            match words.next() {
                Some(b"vt") => read.uv.push(texture(line, words)?),
                Some(b"f" | b"fo") => {
                    for word in words {
                        let index = read.index(line, word)?;
                        if index as usize >= read.uv.len() {
                            awaited.push((line, index));
                        }
                        read.corners.push(index);
                    }
                }
                _ => {}
            }
        }
        let count = read.uv.len();
        match awaited.into_iter().find(|(_, index)| *index as usize >= count) {
            Some((line, index)) => Err(no_texture(line, &(u64::from(index) + 1).to_string(), count)),
            None => Ok(read),
        }
    }

    /// The texture coordinate that a corner such as `7/2` or `7/-1/3` names, counted from 0.
    fn index(&self, line: usize, word: &[u8]) -> Result<u32, ModelError> {
        let Some(number) = word.split(|&byte| byte == b'/').nth(1).and_then(integer) else {
            let found = format!("corner {} without a texture coordinate", shown(word));
            let allowed =
                "corners such as 7/2 or 7/2/3, and lines `vt`, since a picture is to lie on this model"
                    .into();
            return Err(ModelError::Line { line, found, allowed });
        };
        let count = self.uv.len();
        let index = match number {
            1.. => u32::try_from(number - 1).ok(),
            0 => None,
            _ => usize::try_from(count as i64 + number).ok().map(|index| index as u32),
        };
        index.ok_or_else(|| no_texture(line, &number.to_string(), count))
    }
}

/// One or two coordinates; a third may follow, for textures with a depth.
fn texture<'l>(line: usize, words: impl Iterator<Item = &'l [u8]>) -> Result<[f64; 2], ModelError> {
    let (mut uv, mut count) = ([0.0; 2], 0);
    for word in words {
        let Some(number) = number(word) else {
            return Err(ModelError::Line { line, found: shown(word), allowed: a_number(Some(word)) });
        };
        if let Some(coordinate) = uv.get_mut(count) {
            *coordinate = number;
        }
        count += 1;
    }
    if (1..=3).contains(&count) {
        return Ok(uv);
    }
    let allowed = "one to three of them".into();
    Err(ModelError::Line { line, found: format!("a texture coordinate of {count} numbers"), allowed })
}

fn no_texture(line: usize, index: &str, count: usize) -> ModelError {
    let allowed = match count {
        0 => "a texture coordinate, but there is none".into(),
        count => format!("1 to {count}, or -{count} to -1, since there are {count} texture coordinates"),
    };
    ModelError::Line { line, found: format!("texture coordinate {index}"), allowed }
}

/// A whole number of a few digits; none is longer in a file that we read.
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    let (sign, digits) = match word {
        [b'-', digits @ ..] => (-1, digits),
        [b'+', digits @ ..] => (1, digits),
        digits => (1, digits),
    };
    let is_number = (1..=15).contains(&digits.len()) && digits.iter().all(u8::is_ascii_digit);
    is_number.then(|| sign * digits.iter().fold(0, |sum, digit| 10 * sum + i64::from(digit - b'0')))
}

/// Three coordinates; a weight, or a colour, may follow.
fn vertex<'l>(line: usize, words: impl Iterator<Item = &'l [u8]>) -> Result<Vector3<f64>, ModelError> {
    let mut coordinates = [0.0; 3];
    let mut count = 0;
    for word in words {
        // Some write colours that are not set as nan.
        let is_number = match (number(word), coordinates.get_mut(count)) {
            (Some(number), Some(coordinate)) => {
                *coordinate = number;
                true
            }
            (None, None) => word.eq_ignore_ascii_case(b"nan"),
            (number, _) => number.is_some(),
        };
        if !is_number {
            return Err(ModelError::Line { line, found: shown(word), allowed: a_number(Some(word)) });
        }
        count += 1;
    }
    if [3, 4, 6, 7].contains(&count) {
        return Ok(coordinates.into());
    }
    let allowed = "three coordinates, and perhaps a weight or a colour behind them".into();
    Err(ModelError::Line { line, found: format!("a vertex of {count} numbers"), allowed })
}

fn out_of_range(line: usize, index: &str, vertices: usize) -> ModelError {
    let allowed = match vertices {
        0 => "a vertex, but there is none".into(),
        count => format!("1 to {count}, or -{count} to -1, since there are {count} vertices"),
    };
    ModelError::Line { line, found: format!("vertex {index}"), allowed }
}

fn free_form(line: usize, word: &[u8]) -> ModelError {
    let found = format!("{}, which belongs to free-form curves and surfaces", shown(word));
    let allowed = "polygons (`v` and `f`): export the model as a mesh, or take `kind = \"nurbs\"`".into();
    ModelError::Line { line, found, allowed }
}

fn unknown(line: usize, word: &[u8]) -> ModelError {
    let allowed = "statements of OBJ, such as `v`, `f`, `vn`, `g` or `usemtl`, or a comment after `#`".into();
    ModelError::Line { line, found: shown(word), allowed }
}

/// The words of a statement, up to a comment.
pub(super) fn words(statement: &[u8]) -> impl Iterator<Item = &[u8]> {
    let code = statement.split(|&byte| byte == b'#').next().unwrap_or_default();
    code.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Lines with their numbers, counted from 1; one that ends in a backslash goes on in the next.
pub(super) struct Statements<'t> {
    /// What has not been read.
    rest: Option<&'t [u8]>,
    line: usize,
}

impl<'t> Statements<'t> {
    pub(super) fn new(bytes: &'t [u8]) -> Self {
        Self { rest: Some(bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes)), line: 0 }
    }

    fn next_line(&mut self) -> Option<&'t [u8]> {
        let rest = self.rest?;
        let end = rest.iter().position(|&byte| byte == b'\n');
        self.rest = end.map(|end| &rest[end + 1..]);
        self.line += 1;
        Some(rest[..end.unwrap_or(rest.len())].trim_ascii_end())
    }
}

impl<'t> Iterator for Statements<'t> {
    type Item = (usize, Cow<'t, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        let mut statement = Cow::Borrowed(self.next_line()?);
        let begin = self.line;
        while statement.ends_with(b"\\") {
            let whole = statement.to_mut();
            whole.pop();
            whole.push(b' ');
            whole.extend_from_slice(self.next_line().unwrap_or_default());
        }
        Some((begin, statement))
    }
}
