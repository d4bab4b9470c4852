//! ASE, the text of 3D Studio MAX's ASCII scene export.
//!
//! Read: of each `*MESH` the lists `*MESH_VERTEX_LIST` and `*MESH_FACE_LIST`. Vertices are in the world already, so that the
//! nodes' transforms (`*NODE_TM`) have nothing to add; names of nodes and materials; of animated meshes (`*MESH_ANIMATION`) the one before is read. Everything
//! else is passed over. The z axis of such files points up, and their unit is the one that was exported in.

use super::words::BYTE_ORDER_MARK;
use super::{FaceNames, ModelError, a_number, number, shown};
use haptics::mesh::TriangleSoup;
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Reads an ASE file.
///
/// # Errors
/// The first thing found to be wrong, with its line.
pub fn read_ase(bytes: &[u8]) -> Result<TriangleSoup, ModelError> {
    let read = Read::of(bytes)?;
    Ok(TriangleSoup { vertices: read.vertices, faces: read.faces })
}

/// Names of the triangles: of their node, its material and theirs within that.
///
/// # Errors
/// As [`read_ase`].
pub(super) fn read_ase_names(bytes: &[u8]) -> Result<FaceNames, ModelError> {
    Ok(Read::of(bytes)?.names())
}

/// Whether a file without a name would be taken for ASE.
pub(super) fn looks_like_ase(bytes: &[u8]) -> bool {
    bytes
        .strip_prefix(BYTE_ORDER_MARK)
        .unwrap_or(bytes)
        .trim_ascii_start()
        .starts_with(b"*3DSMAX_ASCIIEXPORT")
}

struct Read<'t> {
    tokens: Tokens<'t>,
    vertices: Vec<Vector3<f64>>,
    faces: Vec<[u32; 3]>,
    /// The first vertex of the mesh.
    begin: usize,
    /// Of each face the number of its material within that of its node.
    part_of_face: Vec<u32>,
    nodes: Vec<NodeNames<'t>>,
    /// By the number of a material, and of one within it.
    materials: BTreeMap<(u32, Option<u32>), &'t [u8]>,
    material: (u32, Option<u32>),
}

/// Name and material of a node.
#[derive(Default)]
struct NodeNames<'t> {
    first_face: usize,
    name: &'t [u8],
    material: Option<u32>,
}

impl<'t> Read<'t> {
    fn of(bytes: &'t [u8]) -> Result<Self, ModelError> {
        let mut read = Self {
            tokens: Tokens::new(bytes),
            vertices: Vec::new(),
            faces: Vec::new(),
            begin: 0,
            part_of_face: Vec::new(),
            nodes: Vec::new(),
            materials: BTreeMap::new(),
            material: (0, None),
        };
        read.all()?;
        if read.faces.is_empty() {
            Err(ModelError::NoTriangle { points: read.vertices.len() })
        } else {
            Ok(read)
        }
    }

    fn names(&self) -> FaceNames {
        let mut names = FaceNames::default();
        let text = |name: &[u8]| {
            let name = name.strip_prefix(b"\"").unwrap_or(name);
            String::from_utf8_lossy(name.strip_suffix(b"\"").unwrap_or(name)).into_owned()
        };
        let mut nodes = self.nodes.iter().peekable();
        let nobody = NodeNames::default();
        let mut node = &nobody;
        for (face, part) in self.part_of_face.iter().enumerate() {
            while let Some(next) = nodes.next_if(|next| next.first_face <= face) {
                node = next;
            }
            let material = |part| node.material.and_then(|number| self.materials.get(&(number, part)));
            let all = [Some(&node.name), material(None), material(Some(*part))];
            let set = names.set(all.into_iter().flatten().map(|name| text(name)));
            names.add(set, 1);
        }
        names
    }

    /// Reads names and materials.
    fn name(&mut self, keyword: &[u8], block: Option<&[u8]>) {
        match (keyword, block) {
            (b"*NODE_NAME", Some(b"*GEOMOBJECT")) => {
                let name = self.tokens.next().unwrap_or_default();
                self.nodes.push(NodeNames { first_face: self.faces.len(), name, material: None });
            }
            (b"*MATERIAL_REF", _) => {
                let number = self.number();
                if let Some(node) = self.nodes.last_mut() {
                    node.material = number;
                }
            }
            (b"*MATERIAL", _) => self.material = (self.number().unwrap_or(0), None),
            (b"*SUBMATERIAL", _) => self.material.1 = self.number(),
            (b"*MATERIAL_NAME", _) => {
                let name = self.tokens.next().unwrap_or_default();
                self.materials.insert(self.material, name);
            }
            (b"*MESH_MTLID", _) => {
                let number = self.number().unwrap_or(0);
                if let Some(last) = self.part_of_face.last_mut() {
                    *last = number;
                }
            }
            _ => {}
        }
    }

    fn number(&mut self) -> Option<u32> {
        std::str::from_utf8(self.tokens.next()?).ok()?.parse().ok()
    }

    fn all(&mut self) -> Result<(), ModelError> {
        match self.tokens.next() {
            Some(b"*3DSMAX_ASCIIEXPORT") => {}
            other => return Err(self.tokens.wrong(other, "`*3DSMAX_ASCIIEXPORT`, as every ASE file begins")),
        }
        let mut blocks: Vec<&[u8]> = Vec::new();
        // The blocks around an animation of a mesh, and it; whatever is in there is passed over.
        let mut animated = None;
        let mut keyword: &[u8] = b"";
        while let Some(token) = self.tokens.next() {
            match token {
                b"{" => {
                    blocks.push(keyword);
                    match keyword {
                        b"*MESH_ANIMATION" if animated.is_none() => animated = Some(blocks.len()),
                        b"*MESH" if animated.is_none() => self.begin = self.vertices.len(),
                        _ => {}
                    }
                }
                b"}" => {
                    if animated == Some(blocks.len()) {
                        animated = None;
                    }
                    if blocks.pop().is_none() {
                        return Err(self.tokens.wrong(Some(token), "`{` before it"));
                    }
                }
                _ if !token.starts_with(b"*") => {}
                _ => {
                    keyword = token;
                    match (keyword, blocks.last()) {
                        _ if animated.is_some() => {}
                        (b"*MESH_VERTEX", Some(&b"*MESH_VERTEX_LIST")) => self.vertex()?,
                        (b"*MESH_FACE", Some(&b"*MESH_FACE_LIST")) => self.face()?,
                        (_, block) => self.name(keyword, block.copied()),
                    }
                }
            }
        }
        match blocks.last() {
            Some(block) => {
                let allowed = format!("`}}`, the end of {}", shown(block));
                Err(self.tokens.wrong(None, &allowed))
            }
            None => Ok(()),
        }
    }

    /// `*MESH_VERTEX 0 1.0 2.0 3.0`
    fn vertex(&mut self) -> Result<(), ModelError> {
        let expected = self.vertices.len() - self.begin;
        self.index(|index| index == expected, || format!("{expected}, the next vertex of the mesh"))?;
        let mut vertex = Vector3::zeros();
        for x in &mut vertex {
            let word = self.tokens.next();
            *x = word.and_then(number).ok_or_else(|| self.tokens.wrong(word, &a_number(word)))?;
        }
        self.vertices.push(vertex);
        Ok(())
    }

    /// `*MESH_FACE 0: A: 0 B: 1 C: 2`, in which colons are spaces.
    fn face(&mut self) -> Result<(), ModelError> {
        self.index(|_| true, || "the number of a face".into())?;
        let count = self.vertices.len() - self.begin;
        let mut face = [0; 3];
        for (corner, name) in face.iter_mut().zip([b"A", b"B", b"C"]) {
            match self.tokens.next() {
                Some(word) if word == name => {}
                other => {
                    return Err(self.tokens.wrong(other, &format!("`{}:` of a face", name.escape_ascii())));
                }
            }
            let index = self.index(
                |index| index < count,
                || match count {
                    0 => "a vertex, but the mesh has none before its faces".into(),
                    count => format!("0 to {}, since the mesh has {count} vertices", count - 1),
                },
            )?;
            *corner = (self.begin + index) as u32;
        }
        self.faces.push(face);
        self.part_of_face.push(0);
        Ok(())
    }

    fn index(
        &mut self,
        is_good: impl Fn(usize) -> bool,
        allowed: impl Fn() -> String,
    ) -> Result<usize, ModelError> {
        let word = self.tokens.next();
        let index = word.and_then(|word| std::str::from_utf8(word).ok()?.parse().ok());
        index.filter(|index| is_good(*index)).ok_or_else(|| self.tokens.wrong(word, &allowed()))
    }
}

/// Words, braces, and names in quotes.
struct Tokens<'t> {
    rest: &'t [u8],
    line: usize,
}

impl<'t> Tokens<'t> {
    fn new(bytes: &'t [u8]) -> Self {
        Self { rest: bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes), line: 1 }
    }

    fn next(&mut self) -> Option<&'t [u8]> {
        let is_space = |byte: &u8| byte.is_ascii_whitespace() || *byte == b':';
        while self.rest.first().is_some_and(is_space) {
            self.line += usize::from(self.rest[0] == b'\n');
            self.rest = &self.rest[1..];
        }
        let length = match self.rest.first()? {
            b'{' | b'}' => 1,
            // A name ends with its line at the latest.
            b'"' => {
                let end = self.rest[1..].iter().position(|&byte| byte == b'"' || byte == b'\n');
                end.map_or(self.rest.len(), |end| end + 1 + usize::from(self.rest[end + 1] == b'"'))
            }
            _ => {
                let ends = |byte: &u8| is_space(byte) || matches!(byte, b'{' | b'}');
                self.rest.iter().position(ends).unwrap_or(self.rest.len())
            }
        };
        let (token, rest) = self.rest.split_at(length);
        self.rest = rest;
        Some(token)
    }

    fn wrong(&self, found: Option<&[u8]>, allowed: &str) -> ModelError {
        let found = found.map_or_else(|| "the end of the file; it may be cut short".into(), shown);
        ModelError::Line { line: self.line, found, allowed: allowed.into() }
    }
}
