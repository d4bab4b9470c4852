//! The scene within the window: a part of it in which a painter draws with the window's own graphics.

use crate::eyes::Eyes;
use crate::moment::Moment;
use crate::painter::Painter;
use crate::picture::Picture;
use crate::stage::Stage;
use eframe::{egui, egui_glow};
use nalgebra::UnitQuaternion;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use three_d::{RenderTarget, Viewport};
use world::SceneCamera;

thread_local! {
    /// What draws, which the window's own drawing calls back, and which cannot leave its thread.
    static PAINTER: RefCell<Option<Painter>> = const { RefCell::new(None) };
}

/// What is drawn of the scene, and how.
pub(super) struct SceneView {
    context: three_d::Context,
    /// What was told last.
    pub(super) stage: Arc<Stage>,
    /// Whether hands, forces and contacts are drawn.
    pub(super) with_overlay: bool,
    /// Whether things change their colour while they are touched.
    pub(super) with_highlight: bool,
    /// Whether there are shadows.
    pub(super) with_shadows: bool,
    /// The entity that is marked.
    pub(super) chosen: Option<usize>,
    /// How the sun is turned.
    pub(super) sun: UnitQuaternion<f64>,
    /// Where the next picture goes as a file, too.
    pub(super) picture: Option<PathBuf>,
    /// What became of such files.
    pub(super) said: Receiver<String>,
    say: Sender<String>,
}

impl SceneView {
    pub(super) fn new(
        creation: &eframe::CreationContext<'_>,
        stage: Stage,
        with_shadows: bool,
    ) -> Result<Self, String> {
        let gl = creation.gl.clone().ok_or("the window has no OpenGL")?;
        let context = three_d::Context::from_gl_context(gl).map_err(|error| error.to_string())?;
        let (say, said) = channel();
        let mut view = Self {
            context,
            stage: Arc::default(),
            with_overlay: true,
            with_highlight: true,
            with_shadows,
            chosen: None,
            sun: UnitQuaternion::identity(),
            picture: None,
            said,
            say,
        };
        view.show_stage(stage);
        Ok(view)
    }

    /// Another stage from now on.
    pub(super) fn show_stage(&mut self, stage: Stage) {
        PAINTER.set(Some(Painter::new(&self.context, &stage)));
        self.stage = Arc::new(stage);
    }

    /// Fills what is left of the window; answers where that is, and what pointers do there.
    pub(super) fn show(
        &mut self,
        ui: &mut egui::Ui,
        moment: Moment,
        camera: &SceneCamera,
        eyes: &Eyes,
    ) -> egui::Response {
        let (place, response) = ui.allocate_exact_size(ui.available_size(), egui::Sense::click_and_drag());
        let (camera, eyes) = (camera.clone(), *eyes);
        let (with_overlay, with_highlight, with_shadows) =
            (self.with_overlay, self.with_highlight, self.with_shadows);
        let (chosen, sun) = (self.chosen, self.sun);
        let file = Mutex::new(self.picture.take());
        let say = self.say.clone();
        let draw = move |info: egui::PaintCallbackInfo, _: &egui_glow::Painter| {
            PAINTER.with_borrow_mut(|painter| {
                let Some(painter) = painter else { return };
                painter.with_overlay = with_overlay;
                painter.with_highlight = with_highlight;
                painter.with_shadows = with_shadows;
                (painter.chosen, painter.sun) = (chosen, sun);
                let part = info.viewport_in_pixels();
                let part = Viewport {
                    x: part.left_px,
                    y: part.from_bottom_px,
                    width: part.width_px.max(1) as u32,
                    height: part.height_px.max(1) as u32,
                };
                let [width, height] = info.screen_size_px;
                let target = RenderTarget::screen(painter.context(), width, height);
                painter.draw_within(&moment, &camera, &eyes, &target, part);
                if let Some(file) = file.lock().ok().and_then(|mut file| file.take()) {
                    // Who listened is gone: so is the window.
                    let _ = say.send(save(&target, part, &file));
                }
            });
        };
        let callback = egui_glow::CallbackFn::new(draw);
        ui.painter().add(egui::PaintCallback { rect: place, callback: Arc::new(callback) });
        response
    }

    /// While the graphics are there still.
    pub(super) fn forget(&self) {
        PAINTER.set(None);
    }
}

/// Keeps what is drawn there; says what became of it.
fn save(target: &RenderTarget<'_>, part: Viewport, file: &Path) -> String {
    let mut pixels: Vec<[u8; 4]> = target.read_color_partially(part.into());
    // What a window is made of is opaque, whatever it says.
    pixels.iter_mut().for_each(|[.., opacity]| *opacity = u8::MAX);
    match (Picture { size: [part.width, part.height], pixels }).save(file) {
        Ok(()) => format!("saved {}", file.display()),
        Err(error) => format!("{}: {error}", file.display()),
    }
}
