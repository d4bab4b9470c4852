//! Materials of a glTF file, as far as they are colours and pictures of faces.
//!
//! Model: base colours of the metallic-roughness model, with their textures; what is wrong with one leaves it out and says
//! so, since it is nothing that a finger feels. How metallic or rough, normal maps and lights are passed over.

use std::sync::Arc;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::buffers::Buffers;
use super::document::{Document, Material};
use crate::model::appearance::Finish;
use crate::model::texture::{ALLOWED, Texture, Wrap};
use crate::model::{ModelError, shown};

/// The finishes of a file's materials, and one more for faces of none.
pub(super) struct Materials {
    pub(super) finishes: Vec<Finish>,
    /// Of each material, how its texture lies on faces.
    lies: Vec<Option<Lie>>,
    pub(super) unread: Vec<String>,
    /// Of all pictures together.
    most_texels: usize,
    texels_left: usize,
    /// The pictures together are too much: why, and how many more there are.
    excess: Option<(String, usize)>,
}

/// Of all pictures of a file together: half a gigabyte.
const MOST_TEXELS: usize = 1 << 27;

/// Place of an image's bytes.
#[derive(Clone, PartialEq, Eq)]
enum Origin {
    Uri(String),
    View(usize),
    Nowhere,
}

/// Way of light where a texture is not opaque.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    Opaque,
    Clear,
    /// It goes through where the opacity is less.
    Cut(f64),
}

/// A texture, or none if it could not be read, and what it was made of.
type Known = (Origin, [Wrap; 2], Mode, Option<Arc<Texture>>);

/// Number of the texture coordinates, and what is done to them.
#[derive(Clone, Copy)]
pub(super) struct Lie {
    pub(super) set: usize,
    offset: [f64; 2],
    turn_rad: f64,
    scale: [f64; 2],
}

impl Lie {
    pub(super) fn placed(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn_rad.sin_cos();
        let [u, v] = [u * self.scale[0], v * self.scale[1]];
        [self.offset[0] + cos * u + sin * v, self.offset[1] - sin * u + cos * v]
    }
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Pbr {
    base_color_factor: Option<[f64; 4]>,
    base_color_texture: Option<TextureInfo>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct TextureInfo {
    index: usize,
    tex_coord: usize,
    extensions: Extensions,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Extensions {
    #[serde(rename = "KHR_texture_transform")]
    transform: Option<Transform>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Transform {
    offset: Option<[f64; 2]>,
    rotation: f64,
    scale: Option<[f64; 2]>,
    tex_coord: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct TextureOf {
    source: Option<usize>,
    sampler: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Image {
    uri: Option<String>,
    buffer_view: Option<usize>,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default)]
struct Sampler {
    wrap_s: u32,
    wrap_t: u32,
}

/// An element of a list of the document; what is not as the format has it is as if it said nothing.
fn element<T: DeserializeOwned + Default>(list: &Value, index: usize) -> T {
    list.get(index).and_then(|value| T::deserialize(value).ok()).unwrap_or_default()
}

impl Materials {
    pub(super) fn read(document: &Document, buffers: &mut Buffers<'_>) -> Self {
        Self::read_within(document, buffers, MOST_TEXELS)
    }

    fn read_within(document: &Document, buffers: &mut Buffers<'_>, most_texels: usize) -> Self {
        let mut read = Self {
            finishes: Vec::new(),
            lies: Vec::new(),
            unread: Vec::new(),
            most_texels,
            texels_left: most_texels,
            excess: None,
        };
        let mut images = Vec::new();
        for material in &document.materials {
            let pbr = Pbr::deserialize(&material.pbr_metallic_roughness).unwrap_or_default();
            let info = pbr.base_color_texture.as_ref();
            let mode = mode(material);
            let texture =
                info.and_then(|info| read.texture(info.index, mode, (document, buffers), &mut images));
            let lie = texture.as_ref().and(info).map(TextureInfo::lie);
            let says_nothing = pbr.base_color_factor.is_none() && texture.is_none();
            let colour = (!says_nothing).then(|| colour(pbr.base_color_factor.unwrap_or([1.0; 4]), material));
            read.finishes.push(Finish { colour, texture });
            read.lies.push(lie);
        }
        read.finishes.push(Finish::default());
        if let Some((why, more)) = read.excess.take() {
            read.unread.push(if more == 0 {
                why
            } else {
                format!("{why}; {more} more pictures are left out")
            });
        }
        read
    }

    /// The finish of a primitive's faces, and how its texture lies there.
    pub(super) fn of(&self, material: Option<usize>) -> (u32, Option<Lie>) {
        let none = self.lies.len();
        let index = material.filter(|index| *index < none).unwrap_or(none);
        (index as u32, self.lies.get(index).copied().flatten())
    }

    fn texture(
        &mut self,
        index: usize,
        mode: Mode,
        (document, buffers): (&Document, &mut Buffers<'_>),
        images: &mut Vec<Known>,
    ) -> Option<Arc<Texture>> {
        let of: TextureOf = element(&document.textures, index);
        let Some(source) = of.source else {
            self.unread.push(format!("textures[{index}]: found no picture of its own; allowed: {ALLOWED}"));
            return None;
        };
        let sampler = of.sampler.map(|sampler| element::<Sampler>(&document.samplers, sampler));
        let sampler = sampler.unwrap_or_default();
        let wraps = [sampler.wrap_s, sampler.wrap_t].map(|wrap| match wrap {
            33071 => Wrap::Edge,
            33648 => Wrap::Mirror,
            _ => Wrap::Repeat,
        });
        let image: Image = element(&document.images, source);
        let place = format!("images[{source}]");
        let origin = match (image.uri, image.buffer_view) {
            (Some(uri), _) => Origin::Uri(uri),
            (None, Some(view)) => Origin::View(view),
            _ => Origin::Nowhere,
        };
        // Many images may be one picture.
        let is_it = |(of, by, how, _): &&Known| (of, by, how) == (&origin, &wraps, &mode);
        if let Some((.., known)) = images.iter().find(is_it) {
            return known.clone();
        }
        if let Some((_, more)) = &mut self.excess {
            *more += 1;
            images.push((origin, wraps, mode, None));
            return None;
        }
        let bytes = match &origin {
            Origin::Uri(uri) => buffers.of_uri(uri, &place),
            Origin::View(view) => buffers.of_view(document, *view).map(<[u8]>::to_vec),
            Origin::Nowhere => Ok(Vec::new()),
        };
        let named = match &origin {
            Origin::Uri(uri) if !uri.starts_with("data:") => format!("{place} ({})", shown(uri.as_bytes())),
            _ => place.clone(),
        };
        if let Err(ModelError::TooLarge { limit_bytes }) = bytes {
            let why = format!("{named}: found more than {limit_bytes} bytes in all files; allowed: so many");
            self.excess = Some((why, 0));
            return None;
        }
        let read = bytes.map_err(|error| error.to_string()).and_then(|bytes| {
            Texture::read(&bytes).map_err(|found| format!("{named}: found {found}; allowed: {ALLOWED}"))
        });
        let read = read.map(|texture| match mode {
            Mode::Opaque => texture.opaque(),
            Mode::Clear => texture.cleared(None),
            Mode::Cut(cutoff) => texture.cleared(Some(cutoff)),
        });
        let read = read.map_err(|said| self.unread.push(said)).ok();
        let read = read.and_then(|texture| match self.texels_left.checked_sub(texture.texels.len()) {
            Some(left) => {
                self.texels_left = left;
                Some(texture)
            }
            None => {
                let why = format!(
                    "{named}: found more than {} places in all pictures; allowed: so many",
                    self.most_texels
                );
                self.excess = Some((why, 0));
                None
            }
        });
        let texture = read.map(|texture| Arc::new(Texture { wraps, ..texture }));
        images.push((origin, wraps, mode, texture.clone()));
        texture
    }
}

impl TextureInfo {
    fn lie(&self) -> Lie {
        let transform = self.extensions.transform.as_ref();
        Lie {
            set: transform.and_then(|transform| transform.tex_coord).unwrap_or(self.tex_coord),
            offset: transform.and_then(|transform| transform.offset).unwrap_or_default(),
            turn_rad: transform.map_or(0.0, |transform| transform.rotation),
            scale: transform.and_then(|transform| transform.scale).unwrap_or([1.0; 2]),
        }
    }
}

/// Of a share of light's power, what it looks like: as a scene's colours are.
fn colour([r, g, b, opacity]: [f64; 4], material: &Material) -> [f64; 4] {
    let seen = |share: f64| {
        let share = share.clamp(0.0, 1.0);
        if share <= 0.003_130_8 { 12.92 * share } else { 1.055 * share.powf(1.0 / 2.4) - 0.055 }
    };
    let is_clear = mode(material) == Mode::Clear;
    [seen(r), seen(g), seen(b), if is_clear { opacity.clamp(0.0, 1.0) } else { 1.0 }]
}

fn mode(material: &Material) -> Mode {
    match material.alpha_mode.0.as_deref() {
        Some("BLEND") => Mode::Clear,
        Some("MASK") => Mode::Cut(material.alpha_cutoff.as_f64().unwrap_or(USUAL_CUTOFF)),
        _ => Mode::Opaque,
    }
}

/// The format's.
const USUAL_CUTOFF: f64 = 0.5;

#[cfg(test)]
mod tests {
    use super::*;

    /// Two places, one above the other.
    fn picture() -> Vec<u8> {
        let mut made = Vec::new();
        let mut encoder = png::Encoder::new(&mut made, 1, 2);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.write_header().unwrap().write_image_data(&[7, 9]).unwrap();
        made
    }

    #[test]
    fn pictures_that_are_too_much_together_are_told_once_by_the_first() {
        let list = |of: &dyn Fn(usize) -> String| (0..5).map(of).collect::<Vec<_>>().join(",");
        let picture = picture();
        let length = picture.len();
        let text = format!(
            r#"{{"asset": {{"version": "2.0"}}, "materials": [{}], "textures": [{}], "images": [{}], "bufferViews": [{}],
                "buffers": [{{"byteLength": {}}}]}}"#,
            list(&|k| format!(r#"{{"pbrMetallicRoughness": {{"baseColorTexture": {{"index": {k}}}}}}}"#)),
            list(&|k| format!(r#"{{"source": {k}}}"#)),
            list(&|k| format!(r#"{{"bufferView": {k}}}"#)),
            list(&|k| format!(r#"{{"buffer": 0, "byteOffset": {}, "byteLength": {length}}}"#, k * length)),
            5 * length
        );
        let document = Document::parse(text.as_bytes()).unwrap();
        let binary = picture.repeat(5);
        let mut buffers = Buffers::load(&document, Some(&binary), None).unwrap();
        let read = Materials::read_within(&document, &mut buffers, 5);
        let has = |finish: &Finish| finish.texture.is_some();
        assert_eq!(
            read.finishes.iter().map(has).collect::<Vec<_>>(),
            [true, true, false, false, false, false]
        );
        let [said] = &read.unread[..] else { panic!("{:?}", read.unread) };
        assert!(said.starts_with("images[2]: found more than 5 places in all pictures"), "{said}");
        assert!(said.ends_with("; 2 more pictures are left out"), "{said}");
    }
}
