//! glTF 2.0: `.gltf` with its buffers within or beside it, and `.glb`.
//!
//! Read: of the file's scene (the one that it names, else the first; all nodes if it has none) the meshes of all nodes, each
//! put there by its node and those above, as one soup (of a file in which no node shows a mesh, all meshes as they are: a
//! library of them); triangles, strips and fans, with and without indices; sparse
//! accessors; positions as floats or quantised (`KHR_mesh_quantization`); names; for whoever draws it, base colours and their
//! textures (`materials`). Metres, y up, as in a scene of ours. Morph targets and skins count as they are at rest
//! ([`deformed`]). Passed over: cameras, lights, animations, points and lines.
//! Refused: compressed geometry (Draco, meshopt), other extensions that the file requires and a shape may depend on, and glTF
//! 1.0.
//!
//! Nothing is believed: every index, range and step is checked against what is there. A node may be reached in one way only, as
//! the format has it, which bounds the walk. A small file can name the same megabyte a thousand times, or count
//! what takes no bytes: what is put together may have as many vertices, indices and primitives as the files have bytes, or
//! [`ALWAYS_ALLOWED`], and no more. The text may have [`MOST_OBJECTS`] objects.
//!
//! A reader of our own: `gltf` 1.4 brings forty packages, believes counts, and names no place.

mod accessor;
mod buffers;
mod deformed;
mod document;
mod materials;

use super::appearance::Appearance;
use super::ply::Strip;
use super::{FaceNames, ModelError, with_triangles};
use accessor::Accessors;
use buffers::Buffers;
use deformed::Skin;
use document::{Document, Node, Primitive};
use haptics::mesh::{CornerUv, TriangleSoup};
use materials::Materials;
use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};
use std::path::{Path, PathBuf};

/// Vertices, indices and primitives that every file may have.
const ALWAYS_ALLOWED: usize = 1 << 22;

/// Reads a glTF file, text or binary; `beside` is the directory in which the files lie that it names.
///
/// # Errors
/// The first thing found to be wrong, with its place in the document.
pub fn read_gltf(bytes: &[u8], beside: Option<&Path>) -> Result<TriangleSoup, ModelError> {
    Ok(read(bytes, beside)?.0)
}

/// Names of the triangles: of their node, its mesh and their material.
///
/// # Errors
/// As [`read_gltf`].
pub(super) fn read_gltf_names(bytes: &[u8], beside: Option<&Path>) -> Result<FaceNames, ModelError> {
    Ok(read(bytes, beside)?.1)
}

/// Files that a glTF names, by their paths from its directory: buffers, then pictures.
pub(super) fn names_beside(bytes: &[u8]) -> Vec<PathBuf> {
    let document = buffers::parts(bytes).and_then(|(text, _)| Document::parse(text));
    let Ok(document) = document else { return Vec::new() };
    let buffers = document.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    let images = document.images.as_array().into_iter().flatten();
    let images = images.filter_map(|image| image.get("uri")?.as_str());
    let uris = buffers.chain(images).filter(|uri| !uri.starts_with("data:"));
    uris.filter_map(buffers::below).collect()
}

/// Looks of the triangles, for whoever draws them.
///
/// # Errors
/// As [`read_gltf`].
pub(super) fn read_gltf_appearance(bytes: &[u8], beside: Option<&Path>) -> Result<Appearance, ModelError> {
    let (text, binary) = buffers::parts(bytes)?;
    let document = Document::parse(text)?;
    let mut buffers = Buffers::load(&document, binary, beside)?;
    let materials = Materials::read(&document, &mut buffers);
    let mut merged = Merged::new(&document, &buffers, bytes.len());
    merged.dressing =
        Some(Dressing { materials: &materials, of_face: Vec::new(), uv: Vec::new(), unread: Vec::new() });
    merged.add_nodes()?;
    let Some(dressing) = merged.dressing else { return Ok(Appearance::default()) };
    let Dressing { of_face, uv, unread, .. } = dressing;
    let unread = materials.unread.into_iter().chain(unread).collect();
    Ok(Appearance { finishes: materials.finishes, of_face, uv, unread })
}

fn read(bytes: &[u8], beside: Option<&Path>) -> Result<(TriangleSoup, FaceNames), ModelError> {
    let (text, binary) = buffers::parts(bytes)?;
    let document = Document::parse(text)?;
    document.check()?;
    let buffers = Buffers::load(&document, binary, beside)?;
    let mut merged = Merged::new(&document, &buffers, bytes.len());
    merged.add_nodes()?;
    Ok((with_triangles(merged.soup)?, merged.names))
}

/// Whether a file without a name would be taken for glTF.
pub(super) fn looks_like_gltf(bytes: &[u8]) -> bool {
    let begin = &bytes[..bytes.len().min(LOOKED_AT_BYTES)];
    let is_text = bytes.trim_ascii_start().starts_with(b"{");
    bytes.starts_with(b"glTF") || is_text && begin.windows(7).any(|word| word == b"\"asset\"")
}

const LOOKED_AT_BYTES: usize = 1 << 16;

/// What puts a mesh into the scene.
enum Put {
    /// Its node.
    By(Matrix4<f64>),
    /// The joints that it hangs on.
    ByJoints(Skin),
}

/// The meshes of all nodes, put together.
struct Merged<'d> {
    document: &'d Document,
    accessors: Accessors<'d>,
    soup: TriangleSoup,
    names: FaceNames,
    /// If somebody asks for it.
    dressing: Option<Dressing<'d>>,
}

/// Looks of the triangles.
struct Dressing<'d> {
    materials: &'d Materials,
    of_face: Vec<u32>,
    uv: Vec<CornerUv>,
    /// Faults of texture coordinates.
    unread: Vec<String>,
}

impl<'d> Merged<'d> {
    fn new(document: &'d Document, buffers: &'d Buffers<'d>, bytes: usize) -> Self {
        let most = ALWAYS_ALLOWED.max(bytes + buffers.bytes_beside());
        Self {
            document,
            accessors: Accessors::new(document, buffers, most),
            soup: TriangleSoup { vertices: Vec::new(), faces: Vec::new() },
            names: FaceNames::default(),
            dressing: None,
        }
    }

    fn add_nodes(&mut self) -> Result<(), ModelError> {
        let nodes = &self.document.nodes;
        let mut is_reached = vec![false; nodes.len()];
        // Before it waits: a list may name the same node a million times.
        let mut reach = |index: usize, X_WP: Matrix4<f64>| {
            let place = format!("nodes[{index}]");
            let is_reached = is_reached.get_mut(index).ok_or_else(|| missing(&place, nodes.len()))?;
            if std::mem::replace(is_reached, true) {
                let found = "a node that is reached in two ways".into();
                return Err(wrong(place, found, "a tree: one parent for each"));
            }
            Ok((index, X_WP))
        };
        let mut open = Vec::new();
        for root in self.document.roots()?.into_iter().rev() {
            open.push(reach(root, Matrix4::identity())?);
        }
        let (mut shown, mut all_X_WN) = (Vec::new(), vec![None; nodes.len()]);
        while let Some((index, X_WP)) = open.pop() {
            let node = &nodes[index];
            let X_WN = X_WP * transform(&format!("nodes[{index}]"), node)?;
            all_X_WN[index] = Some(X_WN);
            if let Some(mesh) = node.mesh {
                shown.push((index, mesh, X_WN));
            }
            for &child in node.children.iter().rev() {
                open.push(reach(child, X_WN)?);
            }
        }
        // Joints may come after what hangs on them.
        for (index, mesh, X_WN) in shown {
            let (place, node) = (format!("nodes[{index}]"), &nodes[index]);
            let skin =
                node.skin.map(|skin| Skin::read(self.document, &mut self.accessors, skin, &all_X_WN, &place));
            let put = skin.transpose()?.map_or(Put::By(X_WN), Put::ByJoints);
            self.add_mesh(mesh, &put, (&place, node))?;
        }
        if nodes.iter().all(|node| node.mesh.is_none()) {
            for mesh in 0..self.document.meshes.len() {
                let put = Put::By(Matrix4::identity());
                self.add_mesh(mesh, &put, (&format!("meshes[{mesh}]"), &Node::default()))?;
            }
        }
        Ok(())
    }

    fn add_mesh(
        &mut self,
        index: usize,
        put: &Put,
        (node_place, node): (&str, &Node),
    ) -> Result<(), ModelError> {
        let meshes = &self.document.meshes;
        let mesh = meshes
            .get(index)
            .ok_or_else(|| missing(&format!("{node_place}.mesh = {index}"), meshes.len()))?;
        let weights = node.weights.as_ref().unwrap_or(&mesh.weights);
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("meshes[{index}].primitives[{number}]");
            let before = self.soup.faces.len();
            self.add_primitive(primitive, (put, weights), &place, node_place)?;
            let material = primitive.material.and_then(|index| self.document.materials.get(index));
            let all = [Some(&node.name), Some(&mesh.name), material.map(|material| &material.name)];
            let set = self.names.set(all.into_iter().flatten().filter_map(|name| name.0.as_deref()));
            self.names.add(set, self.soup.faces.len() - before);
        }
        Ok(())
    }

    fn add_primitive(
        &mut self,
        primitive: &Primitive,
        (put, weights): (&Put, &[f64]),
        place: &str,
        node: &str,
    ) -> Result<(), ModelError> {
        self.accessors.count_primitive(place)?;
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        let Some(positions) = primitive.attributes.position else { return Ok(()) };
        if mode < TRIANGLES {
            return Ok(());
        }
        let mut positions = self.accessors.positions(positions, place)?;
        deformed::morph(&mut self.accessors, primitive, weights, &mut positions, place)?;
        let is_turned = match put {
            Put::By(X_WN) => {
                positions.iter_mut().for_each(|p| *p = X_WN.transform_point(&(*p).into()).coords);
                linear(X_WN).determinant() < 0.0
            }
            Put::ByJoints(skin) => skin.place(&mut self.accessors, primitive, &mut positions, place)?,
        };
        let corners = match primitive.indices {
            Some(indices) => self.accessors.indices(indices, positions.len(), place)?,
            None => (0..positions.len() as u32).collect(),
        };
        let mut faces = triangles(mode, &corners, place)?;
        if is_turned {
            faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        self.dress(primitive, &faces, place);
        // Others may use the other vertices of the same accessor.
        let mut places = vec![u32::MAX; positions.len()];
        for corner in faces.iter_mut().flatten() {
            let own = &mut places[*corner as usize];
            if *own == u32::MAX {
                *own = self.soup.vertices.len() as u32;
                let vertex = positions[*corner as usize];
                if !vertex.iter().all(|x| x.is_finite()) {
                    let found = format!("vertex {corner} of {place} beyond all numbers");
                    return Err(wrong(node.into(), found, "a transform that leaves finite coordinates"));
                }
                self.soup.vertices.push(vertex);
            }
            *corner = *own;
        }
        self.soup.faces.extend(faces);
        Ok(())
    }
}

impl Merged<'_> {
    /// Notes how faces look, by their corners' numbers within the primitive.
    fn dress(&mut self, primitive: &Primitive, faces: &[[u32; 3]], place: &str) {
        let Some(dressing) = &mut self.dressing else { return };
        let (finish, lie) = dressing.materials.of(primitive.material);
        dressing.of_face.extend(faces.iter().map(|_| finish));
        let Some(lie) = lie else {
            dressing.uv.extend(faces.iter().map(|_| CornerUv::default()));
            return;
        };
        let sets = [&primitive.attributes.uv_0, &primitive.attributes.uv_1];
        let index = sets.get(lie.set).and_then(|set| set.as_u64());
        let index = index.and_then(|index| usize::try_from(index).ok());
        let uv = index.map_or_else(
            || {
                Err(format!(
                    "{place}: found no texture coordinates of set {}, which its material names",
                    lie.set
                ))
            },
            |index| self.accessors.uv(index, place).map_err(|error| error.to_string()),
        );
        let uv = uv.unwrap_or_else(|said| {
            dressing.unread.push(said);
            Vec::new()
        });
        let at = |corner: u32| uv.get(corner as usize).map_or([0.0; 2], |uv| lie.placed([uv.x, uv.y]));
        dressing.uv.extend(faces.iter().map(|face| face.map(at)));
    }
}

const TRIANGLES: u32 = 4;

fn triangles(mode: u32, corners: &[u32], place: &str) -> Result<Vec<[u32; 3]>, ModelError> {
    match mode {
        4 if corners.len().is_multiple_of(3) => {
            Ok(corners.chunks_exact(3).map(|face| [face[0], face[1], face[2]]).collect())
        }
        4 => {
            let found = format!("{} corners of triangles", corners.len());
            Err(wrong(place.into(), found, "three for each"))
        }
        5 => {
            let mut strip = Strip::default();
            Ok(corners.iter().filter_map(|&corner| strip.next(corner)).collect())
        }
        6 => {
            let first = corners.first().copied().unwrap_or(0);
            Ok(corners
                .get(1..)
                .unwrap_or_default()
                .windows(2)
                .map(|pair| [first, pair[0], pair[1]])
                .collect())
        }
        mode => Err(wrong(format!("{place}.mode"), mode.to_string(), "0 to 6")),
    }
}

fn transform(place: &str, node: &Node) -> Result<Matrix4<f64>, ModelError> {
    if let Some(matrix) = &node.matrix {
        let X = Matrix4::from_column_slice(&matrix[..]);
        if X.row(3) != Matrix4::identity().row(3) {
            return Err(wrong(format!("{place}.matrix"), "a projection".into(), "a last row of 0, 0, 0, 1"));
        }
        return Ok(X);
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), f64::MIN_POSITIVE);
    let Some(rotation) = rotation else {
        return Err(wrong(
            format!("{place}.rotation"),
            "a quaternion of no length".into(),
            "one of length 1",
        ));
    };
    let scale = Matrix4::new_nonuniform_scaling(&node.scale.unwrap_or([1.0; 3]).into());
    let shift = Matrix4::new_translation(&Vector3::from(node.translation.unwrap_or_default()));
    Ok(shift * rotation.to_homogeneous() * scale)
}

fn linear(X: &Matrix4<f64>) -> Matrix3<f64> {
    X.fixed_view::<3, 3>(0, 0).into_owned()
}

fn wrong(place: String, found: String, allowed: &str) -> ModelError {
    ModelError::Place { place, found, allowed: allowed.into() }
}

/// Of a reference to what is not there.
fn missing(place: &str, count: usize) -> ModelError {
    let allowed = match count {
        0 => "one that is there, but there is none".into(),
        count => format!("0 to {}", count - 1),
    };
    ModelError::Place { place: place.into(), found: "a reference to nothing".into(), allowed }
}
