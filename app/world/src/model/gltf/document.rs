//! The text of a glTF file, as far as it is about shapes.

use super::{missing, wrong};
use crate::model::ModelError;
use rt_core::type_words::type_in_words;
use serde::Deserialize;
use serde_json::Value;

/// A text of nothing but `{}` must not become gigabytes.
const MOST_OBJECTS: usize = 1 << 18;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
pub(super) struct Document {
    asset: Asset,
    extensions_required: Vec<String>,
    extensions_used: Vec<String>,
    scene: Option<usize>,
    scenes: Vec<Scene>,
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) skins: Vec<Skin>,
    pub(super) materials: Vec<Material>,
    /// These three only matter to eyes: whoever reads them minds what they are.
    pub(super) textures: Value,
    pub(super) images: Value,
    pub(super) samplers: Value,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Asset {
    /// A text; in files of version 1 that some programs wrote, a number.
    version: Value,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Scene {
    nodes: Vec<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: Name,
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    pub(super) skin: Option<usize>,
    /// Of morph targets; else the mesh's.
    pub(super) weights: Option<Vec<f64>>,
    pub(super) matrix: Option<Box<[f64; 16]>>,
    pub(super) translation: Option<[f64; 3]>,
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Mesh {
    pub(super) name: Name,
    pub(super) primitives: Vec<Primitive>,
    pub(super) weights: Vec<f64>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Skin {
    pub(super) joints: Vec<usize>,
    pub(super) inverse_bind_matrices: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Primitive {
    pub(super) material: Option<usize>,
    pub(super) attributes: Attributes,
    pub(super) indices: Option<usize>,
    pub(super) targets: Vec<Attributes>,
    pub(super) mode: Option<u32>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Material {
    pub(super) name: Name,
    pub(super) pbr_metallic_roughness: Value,
    pub(super) alpha_mode: Name,
    pub(super) alpha_cutoff: Value,
}

/// Of a node, a mesh or a material, or its mode; whatever is no text is none.
#[derive(Deserialize, Default)]
#[serde(from = "serde_json::Value")]
pub(super) struct Name(pub(super) Option<String>);

impl From<Value> for Name {
    fn from(value: Value) -> Self {
        Self(if let Value::String(text) = value { Some(text) } else { None })
    }
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub(super) position: Option<usize>,
    #[serde(rename = "JOINTS_0")]
    pub(super) joints_0: Option<usize>,
    #[serde(rename = "WEIGHTS_0")]
    pub(super) weights_0: Option<usize>,
    #[serde(rename = "JOINTS_1")]
    pub(super) joints_1: Option<usize>,
    #[serde(rename = "WEIGHTS_1")]
    pub(super) weights_1: Option<usize>,
    #[serde(rename = "TEXCOORD_0")]
    pub(super) uv_0: Value,
    #[serde(rename = "TEXCOORD_1")]
    pub(super) uv_1: Value,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
    pub(super) normalized: bool,
    pub(super) count: usize,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) indices: SparsePart,
    pub(super) values: SparsePart,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct SparsePart {
    pub(super) buffer_view: Option<usize>,
    pub(super) byte_offset: usize,
    pub(super) component_type: u32,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    pub(super) byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
pub(super) struct Buffer {
    pub(super) uri: Option<String>,
    pub(super) byte_length: usize,
}

/// What every version has.
#[derive(Deserialize)]
struct VersionOnly {
    asset: Asset,
}

impl Asset {
    fn check_version(&self) -> Result<(), ModelError> {
        if self.version.as_str().is_some_and(|version| version.starts_with("2.")) {
            return Ok(());
        }
        let found = match &self.version {
            Value::String(text) => format!("\"{}\"", text.escape_default().take(20).collect::<String>()),
            Value::Number(number) => number.to_string(),
            _ => "none".into(),
        };
        let allowed = "\"2.0\"; export the model as glTF 2.0 or GLB";
        Err(wrong("asset.version".into(), found, allowed))
    }
}

impl Document {
    pub(super) fn parse(text: &[u8]) -> Result<Self, ModelError> {
        let objects = text.iter().filter(|&&byte| byte == b'{').count();
        if objects > MOST_OBJECTS {
            let found = format!("a text of {objects} objects");
            return Err(wrong(
                "JSON".into(),
                found,
                &format!("{MOST_OBJECTS} at most: join its nodes and meshes"),
            ));
        }
        serde_json::from_slice(text).map_err(|error| {
            let said = error.to_string();
            let said = said.split(" at line ").next().unwrap_or_default();
            let (what, expected) = said.rsplit_once(", expected ").unwrap_or((said, ""));
            let what = what.strip_prefix("invalid type: ").unwrap_or(what);
            let what = if what == "map" { "an object" } else { what };
            let expected = match type_in_words(expected).unwrap_or(expected) {
                "" => String::new(),
                words => format!(", expected {words}"),
            };
            let found: String = format!("{what}{expected}").escape_default().take(LONGEST_WORDS).collect();
            let found = found.replace("\\\"", "\"");
            let other = || ModelError::Line {
                line: error.line(),
                found,
                allowed: "a text of glTF 2.0 (JSON)".into(),
            };
            // Version 1 names its lists by keys.
            serde_json::from_slice(text)
                .ok()
                .and_then(|VersionOnly { asset }| asset.check_version().err())
                .unwrap_or_else(other)
        })
    }

    pub(super) fn check(&self) -> Result<(), ModelError> {
        self.asset.check_version()?;
        // What is used but not required may be there without compression as well.
        let is_missing = |accessor: &Accessor| accessor.buffer_view.is_none() && accessor.sparse.is_none();
        let used = if self.accessors.iter().any(is_missing) { &self.extensions_used[..] } else { &[] };
        let named = [("extensionsRequired", &self.extensions_required[..]), ("extensionsUsed", used)];
        let is_compressed = |name: &&String| COMPRESSED.contains(&name.as_str());
        match named.iter().find_map(|(key, names)| Some((*key, names.iter().find(is_compressed)?))) {
            Some((key, name)) => {
                let allowed = "geometry that is not compressed: export it without, or unpack it (`gltf-transform copy`)";
                Err(wrong(key.into(), name.clone(), allowed))
            }
            None => self.check_required(),
        }
    }

    /// Without an extension that it requires, the shape may be another one.
    fn check_required(&self) -> Result<(), ModelError> {
        let is_known = |name: &&String| WITHOUT_SHAPE.iter().any(|begin| name.starts_with(begin));
        match self.extensions_required.iter().find(|name| !is_known(name)) {
            Some(name) => {
                let found = name.escape_default().take(LONGEST_WORDS).collect();
                Err(wrong(
                    "extensionsRequired".into(),
                    found,
                    "what the shape does not depend on; export it without",
                ))
            }
            None => Ok(()),
        }
    }

    /// The nodes that a scene begins with.
    pub(super) fn roots(&self) -> Result<Vec<usize>, ModelError> {
        if self.scenes.is_empty() {
            let mut is_child = vec![false; self.nodes.len()];
            for &child in self.nodes.iter().flat_map(|node| &node.children) {
                if let Some(is_child) = is_child.get_mut(child) {
                    *is_child = true;
                }
            }
            return Ok((0..self.nodes.len()).filter(|&node| !is_child[node]).collect());
        }
        let scene = self.scene.unwrap_or(0);
        let found = self.scenes.get(scene);
        found
            .map(|scene| scene.nodes.clone())
            .ok_or_else(|| missing(&format!("scene = {scene}"), self.scenes.len()))
    }
}

const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Beginnings of the names of extensions that change no shape, or are read.
const WITHOUT_SHAPE: [&str; 10] = [
    "KHR_mesh_quantization",
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_animation_",
    "KHR_xmp",
    "KHR_audio",
];
const LONGEST_WORDS: usize = 160;
