//! What keys and mouse do at the window.

use super::key_listener::KeyListener;
use super::scene::SceneView;
use super::writing;
use super::{WindowSpec, snapshot_file};
use crate::camera_man::{CameraMan, CameraTurn, Sight};
use crate::eyes::{Eyes, Pointed};
use crate::input::{Action, Actions, Bindings, Bound, HandKeys, Receiver, Router, Step, Unbound};
use crate::moment::Moment;
use crate::news::{Ask, KeyChange, Status};
use crate::pick::{Hit, Picker};
use crate::stage::Stage;
use crate::status_line::status_line;
use crate::steering::{Steering, next_mode, stereo_word, turned_sun};
use crate::text::{Board, Note};
use eframe::egui;
use nalgebra::Point3;
use std::path::PathBuf;
use std::sync::mpsc::Sender;
use world::{SceneCamera, StereoMode};

/// What it says of settings is read at a glance (s), and stands above.
const GLANCE_S: f64 = 1.5;
const ABOVE: [f64; 2] = [0.5, 0.06];

/// Who listens to keys and mouse, and shows text.
pub(super) struct Controls {
    bindings: Bindings,
    listener: KeyListener,
    router: Router,
    man: CameraMan,
    picker: Picker,
    /// What there is to read.
    pub(super) board: Board,
    /// What keys want of the hand.
    pub(super) hand: HandKeys,
    steering: Steering,
    status: Status,
    home: usize,
    sun_is_chosen: bool,
    with_help: bool,
    /// Whether the panel is shown.
    pub(super) with_panel: bool,
    pictures: PathBuf,
}

/// What keys and mouse change.
pub(super) struct Reach<'r> {
    pub(super) view: &'r mut SceneView,
    pub(super) camera: &'r mut SceneCamera,
    pub(super) eyes: &'r mut Eyes,
    pub(super) selected: &'r mut Option<usize>,
    pub(super) ask: &'r Sender<Ask>,
}

/// What is to be done of what people did.
struct Heard {
    moves: Vec<Bound>,
    rest: Vec<Bound>,
    keys: Vec<KeyChange>,
}

/// Everything that can be pointed at.
struct Pointing<'p> {
    picker: &'p Picker,
    moment: &'p Moment,
    eyes: Eyes,
    scene: egui::Rect,
}

impl Pointing<'_> {
    fn at(&self, camera: &SceneCamera, at: egui::Pos2) -> Pointed {
        let pair = |vector: egui::Vec2| [f64::from(vector.x), f64::from(vector.y)];
        self.eyes.point(camera, pair(self.scene.size()), pair(at - self.scene.min))
    }

    fn hit(&self, camera: &SceneCamera, at: egui::Pos2) -> Option<Hit> {
        self.picker.pick(self.moment, &self.at(camera, at).ray)
    }

    /// Of what lies there; of nothing, as far away as both eyes agree (m).
    fn place(&self, camera: &SceneCamera, at: egui::Pos2) -> Point3<f64> {
        let ray = self.at(camera, at).ray;
        self.picker.pick(self.moment, &ray).map_or_else(|| ray.at(self.eyes.convergence_m), |hit| hit.place)
    }
}

impl Controls {
    /// As a window begins; eyes that it cannot serve are one.
    pub(super) fn new(spec: &WindowSpec, eyes: &mut Eyes, stage: &Stage, listener: KeyListener) -> Self {
        let mut board = Board::default();
        if eyes.mode == StereoMode::QuadBuffer {
            // Who opens windows for us asks for no such buffers.
            eyes.mode = StereoMode::Off;
            let note = Note::from("no quad-buffer stereo: the window has one picture only; one eye");
            // Windows take a while to be seen.
            board.add(Note { seconds: 10.0, ..note }, 0.0);
        }
        Self {
            bindings: spec.bindings.clone(),
            listener,
            router: Router::default(),
            man: CameraMan::default(),
            picker: Picker::new(stage),
            board,
            hand: HandKeys::default(),
            steering: Steering::default(),
            status: Status::default(),
            home: 0,
            sun_is_chosen: false,
            with_help: false,
            with_panel: true,
            pictures: spec.pictures.clone(),
        }
    }

    /// How the run goes.
    pub(super) fn take(&mut self, status: &Status) {
        if status.is_paused != self.status.is_paused {
            self.steering.is_paused = status.is_paused;
        }
        self.status = status.clone();
    }

    /// What lies in a direction.
    pub(super) fn picker(&self) -> &Picker {
        &self.picker
    }

    /// Another scene goes on.
    pub(super) fn clear(&mut self, stage: &Stage) {
        self.picker = Picker::new(stage);
        self.steering = Steering::default();
        (self.home, self.sun_is_chosen) = (0, false);
    }

    /// What people did since the last picture, of which this is the scene.
    pub(super) fn turn(
        &mut self,
        ui: &egui::Ui,
        scene: &egui::Response,
        moment: &Moment,
        reach: &mut Reach<'_>,
    ) {
        let (now_s, dt_s) = ui.input(|input| (input.time, f64::from(input.stable_dt)));
        let picker = std::mem::take(&mut self.picker);
        let pointing = Pointing { picker: &picker, moment, eyes: *reach.eyes, scene: scene.rect };
        let heard = self.hear(ui, scene, &pointing, reach);
        self.man.fly(reach.camera, dt_s);
        if let Some(at) = scene.interact_pointer_pos().filter(|_| scene.clicked()) {
            *reach.selected = pointing.hit(reach.camera, at).map(|hit| hit.entity);
            self.sun_is_chosen = false;
        }
        self.picker = picker;
        for key in heard.keys {
            // Who listened is gone: the run is over.
            let _ = reach.ask.send(Ask::Key(key));
        }
        for bound in heard.moves {
            self.steer(bound, moment, now_s, reach);
        }
        for bound in heard.rest {
            self.act(ui.ctx(), bound.action, now_s, reach);
        }
        reach.view.chosen = *reach.selected;
        for note in reach.view.said.try_iter() {
            self.board.add(note.into(), now_s);
        }
    }

    /// Tells everybody what came in, in the order of Melder 7.2.12: the active entity, the camera, the hand, the
    /// application.
    fn hear(
        &mut self,
        ui: &egui::Ui,
        scene: &egui::Response,
        pointing: &Pointing<'_>,
        reach: &mut Reach<'_>,
    ) -> Heard {
        let is_active = self.sun_is_chosen || reach.selected.is_some();
        let moves = |action: Action| is_active && matches!(action, Action::Move(_) | Action::Turn(_));
        let (mut active, mut rest) = (Actions::new(&moves), Actions::new(&|_| true));
        self.listener.begin_picture();
        let mut time_ns = |code, is_pressed| self.listener.time_ns(code, is_pressed);
        let mut unbound = Unbound::new(&mut time_ns);
        let sight = Sight {
            scene: scene.rect,
            point: &|camera, at| pointing.place(camera, at),
            pixel_m: pointing.at(reach.camera, scene.rect.min).pixel_m,
            is_over: scene.contains_pointer(),
        };
        let mut camera = CameraTurn { man: &mut self.man, camera: reach.camera, sight: &sight };
        let receivers: &mut [&mut dyn Receiver] =
            &mut [&mut active, &mut camera, &mut self.hand, &mut rest, &mut unbound];
        let is_elsewhere = elsewhere(ui, scene);
        for event in ui.input(|input| input.events.clone()) {
            match event {
                egui::Event::Key { key, pressed: true, .. } if is_elsewhere(key) => {}
                egui::Event::WindowFocused(false) => self.router.let_go(&self.bindings, receivers),
                _ => {
                    self.router.tell(&event, &self.bindings, receivers);
                }
            }
        }
        Heard { moves: active.taken, rest: rest.taken, keys: unbound.keys }
    }

    /// Moves what is chosen.
    fn steer(&mut self, bound: Bound, moment: &Moment, now_s: f64, reach: &mut Reach<'_>) {
        if self.sun_is_chosen {
            reach.view.sun = turned_sun(bound) * reach.view.sun;
            return;
        }
        let Some(entity) = *reach.selected else { return };
        let Some(pose) = moment.poses.get(entity) else { return };
        if let Some(order) = self.steering.order(bound, (entity, reach.view.stage.name(entity)), pose, now_s)
        {
            order_of(reach, order);
        }
    }

    fn act(&mut self, ctx: &egui::Context, action: Action, now_s: f64, reach: &mut Reach<'_>) {
        self.act_on_run(ctx, action, reach);
        let said = self.act_on_picture(action, reach).or_else(|| self.choose(action, reach));
        if let Some(text) = said {
            self.board.replace(Note { text, at: ABOVE, seconds: GLANCE_S }, now_s);
        }
    }

    fn act_on_run(&mut self, ctx: &egui::Context, action: Action, reach: &mut Reach<'_>) {
        match action {
            // Who wants the help to go does not want the run to end.
            Action::Exit if self.with_help => self.with_help = false,
            Action::Exit => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
            Action::Help => self.with_help ^= true,
            Action::Panel => self.with_panel ^= true,
            Action::Record => {
                // Who listened is gone: the run is over.
                let _ = reach.ask.send(Ask::Record(self.status.recording.is_none()));
            }
            Action::Snapshot => reach.view.picture = Some(snapshot_file(&self.pictures)),
            _ => {
                let name = reach.selected.map(|entity| reach.view.stage.name(entity));
                let order = self.steering.command(action, name);
                order.into_iter().for_each(|order| order_of(reach, order));
            }
        }
    }

    /// What it says of it, if it is about the picture.
    fn act_on_picture(&mut self, action: Action, reach: &mut Reach<'_>) -> Option<String> {
        Some(match action {
            Action::Shadows => switch("shadows", &mut reach.view.with_shadows),
            Action::Overlay => switch("overlay", &mut reach.view.with_overlay),
            Action::Highlight => switch("highlight", &mut reach.view.with_highlight),
            Action::Stereo => {
                reach.eyes.mode = next_mode(reach.eyes.mode);
                stereo_word(reach.eyes.mode)
            }
            Action::Separation(step) => separate(reach.eyes, step),
            Action::Convergence(step) => converge(reach.eyes, step),
            Action::NextCamera => {
                self.home = (self.home + 1) % reach.view.stage.cameras.len().max(1);
                self.go_home(reach)?
            }
            Action::HomeCamera => self.go_home(reach)?,
            _ => return None,
        })
    }

    /// What is chosen then, if it is about that.
    fn choose(&mut self, action: Action, reach: &mut Reach<'_>) -> Option<String> {
        (*reach.selected, self.sun_is_chosen) = match action {
            Action::Choose(step) => (next_thing(&reach.view.stage, *reach.selected, step), false),
            Action::ChooseNone => (None, false),
            Action::ChooseSun => (None, !self.sun_is_chosen),
            _ => return None,
        };
        let name = reach.selected.map(|entity| reach.view.stage.name(entity));
        let sun = self.sun_is_chosen.then_some("the sun: arrows turn it");
        Some(sun.or(name).unwrap_or("nothing is chosen").to_owned())
    }

    fn go_home(&self, reach: &mut Reach<'_>) -> Option<String> {
        let camera = reach.view.stage.cameras.get(self.home)?;
        *reach.camera = camera.clone();
        Some(format!("camera {}", camera.name))
    }

    /// Writes over the scene.
    pub(super) fn write(&mut self, ui: &egui::Ui, scene: egui::Rect, moment: &Moment) {
        let now_s = ui.input(|input| input.time);
        let painter = ui.painter_at(scene);
        writing::line(&painter, scene, &status_line(&self.status, moment));
        writing::notes(&painter, scene, &self.board.shown(now_s));
        if self.with_help {
            writing::help(&painter, scene, &self.bindings);
        }
    }
}

/// Which keys are meant for what is written into, or focused, elsewhere; the scene takes focus back when it is pressed.
fn elsewhere(ui: &egui::Ui, scene: &egui::Response) -> impl Fn(egui::Key) -> bool + use<> {
    use egui::Key::{ArrowDown, ArrowLeft, ArrowRight, ArrowUp, Enter, Space};
    let focused = ui.memory(egui::Memory::focused).filter(|focused| *focused != scene.id);
    if let Some(focused) = focused.filter(|_| scene.is_pointer_button_down_on()) {
        ui.memory_mut(|memory| memory.surrender_focus(focused));
    }
    let writes = ui.ctx().text_edit_focused();
    let moving = [ArrowDown, ArrowLeft, ArrowRight, ArrowUp, Enter, Space];
    move |key| writes || focused.is_some() && moving.contains(&key)
}

fn order_of(reach: &Reach<'_>, order: String) {
    // Who listened is gone: the run is over.
    let _ = reach.ask.send(Ask::Order(order));
}

fn switch(what: &str, is_on: &mut bool) -> String {
    *is_on ^= true;
    format!("{what} {}", if *is_on { "on" } else { "off" })
}

fn separate(eyes: &mut Eyes, step: Step) -> String {
    eyes.separate(step.times(1.0, Eyes::STEP));
    format!("eyes {:.0} mm apart", 1e3 * eyes.separation_m)
}

fn converge(eyes: &mut Eyes, step: Step) -> String {
    eyes.converge(step.times(1.0, Eyes::STEP));
    format!("eyes agree {:.2} m away", eyes.convergence_m)
}

/// The next entity of which there is something to be seen.
fn next_thing(stage: &Stage, chosen: Option<usize>, step: Step) -> Option<usize> {
    let entities = || stage.things.iter().map(|thing| thing.entity);
    match step {
        Step::More => {
            let after = entities().filter(|entity| chosen.is_none_or(|chosen| *entity > chosen)).min();
            after.or_else(|| entities().min())
        }
        Step::Less => {
            let before = entities().filter(|entity| chosen.is_none_or(|chosen| *entity < chosen)).max();
            before.or_else(|| entities().max())
        }
    }
}
