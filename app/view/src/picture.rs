//! Pictures in files, drawn without a display.

use crate::eyes::Eyes;
use crate::moment::Moment;
use crate::offscreen::{NoPictures, Offscreen};
use crate::painter::Painter;
use crate::stage::Stage;
use rt_core::replacement;
use std::path::Path;
use three_d::{DepthTexture2D, Interpolation, RenderTarget, Texture2D, Wrapping};

/// A picture: rows from above, red, green, blue and opacity of each place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Columns and rows.
    pub size: [u32; 2],
    /// `size[0] * size[1]` of them.
    pub pixels: Vec<[u8; 4]>,
}

impl Picture {
    /// At a column and a row from above.
    pub fn at(&self, column: u32, row: u32) -> [u8; 4] {
        self.pixels[(row * self.size[0] + column) as usize]
    }

    /// Writes the whole picture as PNG, or leaves what was there.
    ///
    /// # Errors
    /// As [`replacement::write`].
    pub fn save(&self, file: &Path) -> std::io::Result<()> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.size[0], self.size[1]);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        replacement::write(file, bytes)
    }
}

/// Makes pictures of a stage.
pub struct Studio {
    painter: Painter,
    colour: Texture2D,
    depth: DepthTexture2D,
    size: [u32; 2],
    // Last, so that everything else is gone before it.
    offscreen: Offscreen,
}

impl Studio {
    /// For pictures of this size.
    ///
    /// # Errors
    /// What is missing on this machine.
    pub fn new(stage: &Stage, size: [u32; 2]) -> Result<Self, NoPictures> {
        let offscreen = Offscreen::new()?;
        let context = &offscreen.context;
        let [width, height] = size;
        let (near, edge) = (Interpolation::Nearest, Wrapping::ClampToEdge);
        let colour = Texture2D::new_empty::<[u8; 4]>(context, width, height, near, near, None, edge, edge);
        let depth = DepthTexture2D::new::<f32>(context, width, height, edge, edge);
        Ok(Self { painter: Painter::new(context, stage), colour, depth, size, offscreen })
    }

    /// A moment, seen by eyes at a camera.
    pub fn take(&mut self, moment: &Moment, camera: &world::SceneCamera, eyes: &Eyes) -> Picture {
        let target = RenderTarget::new(self.colour.as_color_target(None), self.depth.as_depth_target());
        self.painter.draw(moment, camera, eyes, &target);
        Picture { size: self.size, pixels: target.read_color() }
    }

    /// Who draws, in its own words.
    pub fn renderer(&self) -> &str {
        &self.offscreen.renderer
    }

    /// What draws.
    pub fn painter(&mut self) -> &mut Painter {
        &mut self.painter
    }
}
