//! The scene within the window: a part of it in which a painter draws with the window's own graphics.

use crate::eyes::Eyes;
use crate::moment::Moment;
use crate::painter::Painter;
use crate::stage::Stage;
use eframe::{egui, egui_glow};
use std::cell::RefCell;
use std::sync::Arc;
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
    /// Whether there are shadows.
    pub(super) with_shadows: bool,
}

impl SceneView {
    pub(super) fn new(
        creation: &eframe::CreationContext<'_>,
        stage: Stage,
        with_shadows: bool,
    ) -> Result<Self, String> {
        let gl = creation.gl.clone().ok_or("the window has no OpenGL")?;
        let context = three_d::Context::from_gl_context(gl).map_err(|error| error.to_string())?;
        let mut view = Self { context, stage: Arc::default(), with_overlay: true, with_shadows };
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
        &self,
        ui: &mut egui::Ui,
        moment: Moment,
        camera: &SceneCamera,
        eyes: &Eyes,
    ) -> egui::Response {
        let (place, response) = ui.allocate_exact_size(ui.available_size(), egui::Sense::click_and_drag());
        let (camera, eyes) = (camera.clone(), *eyes);
        let (with_overlay, with_shadows) = (self.with_overlay, self.with_shadows);
        let draw = move |info: egui::PaintCallbackInfo, _: &egui_glow::Painter| {
            PAINTER.with_borrow_mut(|painter| {
                let Some(painter) = painter else { return };
                (painter.with_overlay, painter.with_shadows) = (with_overlay, with_shadows);
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
