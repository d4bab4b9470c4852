//! A hand without hardware: the mouse's (Melder 7.2.6, PhantomPhantom).

use crate::news::Wish;
use eframe::egui;
use world::SceneCamera;

/// The fingers of a hand that a mouse moves.
#[derive(Debug, Default)]
pub struct MouseHand {
    wishes: Vec<Wish>,
}

impl MouseHand {
    /// Where the fingers begin.
    pub fn new(wishes: Vec<Wish>) -> Self {
        Self { wishes }
    }

    /// What the mouse does over the scene, which is seen so, moves the fingers for so long (s).
    pub fn turn(&mut self, scene: &egui::Response, camera: &SceneCamera, dt_s: f64) -> &[Wish] {
        let _ = (scene, camera, dt_s);
        &self.wishes
    }
}
