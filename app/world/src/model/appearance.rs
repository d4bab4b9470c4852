//! Looks of a model's faces, as its file says.

use std::sync::Arc;

use haptics::mesh::CornerUv;

use super::texture::Texture;

/// Looks of all faces of a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Appearance {
    /// Looks that are told apart.
    pub finishes: Vec<Finish>,
    /// Number of that which each face has.
    pub of_face: Vec<u32>,
    /// Places of each face's corners on the finish's texture, in pictures from its upper left corner.
    pub uv: Vec<CornerUv>,
    /// Pictures that cannot be shown, each with what was found and what is allowed.
    pub unread: Vec<String>,
}

/// Look of a face.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Finish {
    /// Red, green, blue and opacity, 0 to 1, as a scene's colours are; `None`: the file says nothing.
    pub colour: Option<[f64; 4]>,
    /// Picture on it; its colours are multiplied with `colour`.
    pub texture: Option<Arc<Texture>>,
}

impl Appearance {
    /// True if it says anything.
    pub fn is_told(&self) -> bool {
        self.finishes.iter().any(|finish| *finish != Finish::default())
    }
}
