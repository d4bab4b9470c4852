//! Who looks on: takes the news, draws, and asks.

use super::controls::{Controls, Reach};
use super::key_listener::KeyListener;
use super::scene::SceneView;
use super::{Ends, WindowSpec};
use crate::eyes::Eyes;
use crate::hand::{MouseHand, Seen};
use crate::news::{Ask, News, Reins};
use crate::panel::Panel;
use crate::playback::Playback;
use crate::stage::Stage;
use crate::steering::camera_order;
use eframe::egui;
use nalgebra::Isometry3;
use std::sync::mpsc::{Receiver, Sender, TryRecvError};
use std::time::Duration;
use world::{SceneCamera, StereoMode};

/// So often at most the run is told where the camera is (s).
const CARRYING_S: f64 = 0.1;
/// Between two pictures.
const PICTURE: Duration = Duration::from_millis(16);

/// The window's own state.
pub(super) struct Looker {
    told: Receiver<News>,
    ask: Sender<Ask>,
    reins: Option<Box<dyn Reins>>,
    view: SceneView,
    camera: SceneCamera,
    eyes: Eyes,
    playback: Playback,
    hand: MouseHand,
    panel: Panel,
    controls: Controls,
    /// Where the camera was when the run was told last, and when that was (s); `None`: the run need not know.
    carried: Option<(Isometry3<f64>, f64)>,
    /// The entity that people have chosen.
    selected: Option<usize>,
    is_over: bool,
}

impl Looker {
    pub(super) fn new(
        creation: &eframe::CreationContext<'_>,
        spec: &WindowSpec,
        stage: Stage,
        (told, ask, reins): Ends,
    ) -> Result<Self, String> {
        let camera = stage.cameras.first().cloned().ok_or("nobody looks on")?;
        let mut eyes = spec.eyes;
        let controls = Controls::new(spec, &mut eyes, &stage, KeyListener::start(creation));
        let view = SceneView::new(creation, stage, spec.with_shadows)?;
        let carried = spec.carries_devices.then_some((camera.pose, 0.0));
        let hand = reins.as_ref().map(|reins| reins.hand()).unwrap_or_default();
        Ok(Self {
            told,
            ask,
            reins,
            view,
            camera,
            eyes,
            playback: Playback::default(),
            hand,
            carried,
            panel: Panel::default(),
            controls,
            selected: None,
            is_over: false,
        })
    }

    fn hear(&mut self, now_s: f64) {
        loop {
            match self.told.try_recv() {
                Ok(News::Glimpse(glimpse)) => {
                    self.panel.take(&glimpse);
                    self.controls.take(&glimpse.status);
                    self.playback.take(glimpse.moment, now_s);
                }
                Ok(News::Scene(stage)) => {
                    self.playback.clear();
                    self.panel.clear();
                    self.controls.clear(&stage);
                    self.selected = None;
                    self.camera = stage.cameras.first().cloned().unwrap_or_else(|| self.camera.clone());
                    self.view.show_stage(*stage);
                }
                Ok(News::Text(note)) => self.controls.board.add(note, now_s),
                Ok(News::Over) | Err(TryRecvError::Disconnected) => {
                    self.is_over = true;
                    break;
                }
                Err(TryRecvError::Empty) => break,
            }
        }
    }

    /// Tells the run where the camera is that devices go with.
    fn carry(&mut self, now_s: f64) {
        let pose = self.camera.pose;
        let Some((was, at_s)) = &mut self.carried else { return };
        if *was != pose && now_s - *at_s >= CARRYING_S {
            (*was, *at_s) = (pose, now_s);
            // Who listened is gone: the run is over.
            let _ = self.ask.send(Ask::Order(camera_order(&pose)));
        }
    }
}

impl eframe::App for Looker {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        let now_s = ui.input(|input| input.time);
        self.hear(now_s);
        if self.is_over {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            return;
        }
        if self.controls.with_panel {
            self.panel.show(ui, &self.view.stage, &mut self.selected, &self.ask);
        }
        let dt_s = f64::from(ui.input(|input| input.stable_dt));
        egui::CentralPanel::default().frame(egui::Frame::NONE).show_inside(ui, |ui| {
            let moment = self.playback.shown(now_s).unwrap_or_default();
            let cue = self.reins.as_ref().and_then(|_| self.hand.cue(self.controls.picker(), &moment));
            let scene = self.view.show(ui, moment.clone(), &self.camera, &self.eyes);
            let mut reach = Reach {
                view: &mut self.view,
                camera: &mut self.camera,
                eyes: &mut self.eyes,
                selected: &mut self.selected,
                ask: &self.ask,
            };
            self.controls.turn(ui, &scene, &moment, &mut reach);
            if let Some(reins) = &mut self.reins {
                self.playback.newest().into_iter().for_each(|newest| self.hand.feel(newest));
                reins.pull(self.hand.turn(&scene, &self.camera, &mut self.controls.hand, dt_s));
            }
            // With two eyes a line that is drawn once would be nowhere.
            if let Some(cue) = cue.filter(|_| self.eyes.mode == StereoMode::Off) {
                cue.paint(&ui.painter_at(scene.rect), &Seen::new(&self.camera, scene.rect));
            }
            self.controls.write(ui, scene.rect, &moment);
        });
        self.carry(now_s);
        ui.ctx().request_repaint_after(PICTURE);
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.view.forget();
        // Who listened is gone: the run is over.
        let _ = self.ask.send(Ask::End);
    }
}
