//! Who moves the camera (Melder 7.2.12): around what is looked at, across, towards it, or in flight.
//!
//! Model: a camera goes around, and is shifted by, a place in the world, its focus. The horizon stays as it is: turns are
//! about the world's vertical and the camera's own sideways axis, and none goes over the top.

use crate::input::{Receiver, Told};
use eframe::egui::{Event, Key, Modifiers, MouseWheelUnit, PointerButton, Pos2, Rect, Vec2};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, PI};
use world::SceneCamera;

/// So far up or down cameras look at most (rad).
const STEEPEST_RAD: f64 = FRAC_PI_2 - 0.02;
/// Who drags over the scene's whole height turns the camera by so much (rad).
const TURN_RAD: f64 = PI;
/// A notch of the wheel brings the camera nearer by this factor.
const NOTCH: f64 = 1.15;
/// What a notch is in points, where the wheel tells those.
const POINTS_A_NOTCH: f32 = 50.0;
/// The nearest and the farthest that a camera is brought to its focus, as shares of what it sees.
const NEAREST: f64 = 2.0;
const FARTHEST: f64 = 0.5;
/// In a second of flight, this share of the way to the focus.
const FLIGHT: f64 = 0.8;
/// A window that was busy or covered does not make up for it (s).
const LONGEST_S: f64 = 0.1;

/// Around a place, by these angles (rad): to the right about the vertical, and up.
pub fn orbit(camera: &mut SceneCamera, focus: &Point3<f64>, right_rad: f64, up_rad: f64) {
    let side = camera.pose * Vector3::x();
    let (up, back) = (camera.pose * Vector3::y(), camera.pose * Vector3::z());
    // Above the horizon; what is left upright turns the camera's own vertical.
    let raised = f64::atan2(back.y, up.y);
    let up_rad = (raised + up_rad).clamp(-STEEPEST_RAD, STEEPEST_RAD) - raised;
    let raise = UnitQuaternion::from_axis_angle(&nalgebra::Unit::new_normalize(side), -up_rad);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), right_rad) * raise;
    let position = focus + turn * (camera.pose.translation.vector - focus.coords);
    camera.pose = Isometry3::from_parts(Translation3::from(position), turn * camera.pose.rotation);
    camera.pose.rotation.renormalize();
}

/// Lets the picture's content go so far to the right and up (m at the focus).
pub fn pan(camera: &mut SceneCamera, right_m: f64, up_m: f64) {
    camera.pose.translation.vector -= camera.pose * Vector3::new(right_m, up_m, 0.0);
}

/// To this share of the way to a place, which stays where it is in the picture.
pub fn zoom(camera: &mut SceneCamera, towards: &Point3<f64>, share: f64) {
    let way = camera.pose.translation.vector - towards.coords;
    let (nearest, farthest) = (NEAREST * camera.near_m, FARTHEST * camera.far_m);
    let length = way.norm();
    // A camera that is out of the limits already comes nearer to them, and goes no farther away.
    let (nearest, farthest) = (nearest.min(length), farthest.max(length));
    let share = if length > 0.0 { (share * length).clamp(nearest, farthest) / length } else { 1.0 };
    camera.pose.translation.vector = towards.coords + share * way;
}

/// How far the focus lies along the view (m).
pub fn depth(camera: &SceneCamera, focus: &Point3<f64>) -> f64 {
    -camera.pose.inverse_transform_point(focus).z
}

/// Where the scene is in the window, and what can be pointed at.
pub struct Sight<'s> {
    /// Its place (points).
    pub scene: Rect,
    /// Of a place, what lies there in the world, or a place as far away as both eyes agree.
    pub point: &'s dyn Fn(&SceneCamera, Pos2) -> Point3<f64>,
    /// A point of the window, a metre away along the view (m).
    pub pixel_m: f64,
    /// Whether the pointer is over the scene, and over nothing else.
    pub is_over: bool,
}

/// What whoever moves the camera remembers.
#[derive(Debug, Default)]
pub struct CameraMan {
    drag: Option<Drag>,
    /// Keys of flight that are held: forward, left, back, right, up, down.
    flies: [bool; 6],
    pointer: Option<Pos2>,
}

#[derive(Debug, Clone, Copy)]
struct Drag {
    button: PointerButton,
    focus: Point3<f64>,
}

const FLIGHT_KEYS: [(Key, [f64; 3]); 6] = [
    (Key::W, [0.0, 0.0, -1.0]),
    (Key::A, [-1.0, 0.0, 0.0]),
    (Key::S, [0.0, 0.0, 1.0]),
    (Key::D, [1.0, 0.0, 0.0]),
    (Key::R, [0.0, 1.0, 0.0]),
    (Key::F, [0.0, -1.0, 0.0]),
];

/// The camera, for a while, as somebody who takes what people do.
pub struct CameraTurn<'t> {
    /// Who moves it.
    pub man: &'t mut CameraMan,
    /// What is moved.
    pub camera: &'t mut SceneCamera,
    /// What is seen.
    pub sight: &'t Sight<'t>,
}

impl CameraMan {
    /// Flies on for so long (s), if keys of flight are held.
    pub fn fly(&mut self, camera: &mut SceneCamera, dt_s: f64) {
        let Some(drag) = &mut self.drag else {
            self.flies = [false; 6];
            return;
        };
        let ways = FLIGHT_KEYS.iter().zip(self.flies).filter(|(_, is_held)| *is_held);
        let way: Vector3<f64> = ways.map(|((_, way), _)| Vector3::from(*way)).sum();
        let away_m = depth(camera, &drag.focus).abs().max(NEAREST * camera.near_m);
        let moved = camera.pose * (FLIGHT * away_m * dt_s.min(LONGEST_S) * way);
        camera.pose.translation.vector += moved;
        drag.focus += moved;
    }

    /// Whether keys of flight are held: there is no rest.
    pub fn is_flying(&self) -> bool {
        self.flies.contains(&true)
    }
}

impl CameraTurn<'_> {
    fn begin(&mut self, button: PointerButton) -> bool {
        if !self.sight.is_over || !matches!(button, PointerButton::Secondary | PointerButton::Middle) {
            return false;
        }
        self.man.drag =
            Some(Drag { button, focus: (self.sight.point)(self.camera, self.sight.scene.center()) });
        true
    }

    fn end(&mut self, button: PointerButton) -> bool {
        if self.man.drag.is_some_and(|drag| drag.button == button) {
            self.man.drag = None;
            self.man.flies = [false; 6];
            return true;
        }
        false
    }

    fn drag(&mut self, by: Vec2) -> bool {
        let Some(Drag { button, focus }) = self.man.drag else { return false };
        let (right, up) = (f64::from(by.x), -f64::from(by.y));
        if button == PointerButton::Secondary {
            let rad = TURN_RAD / f64::from(self.sight.scene.height().max(1.0));
            orbit(self.camera, &focus, -right * rad, -up * rad);
        } else {
            let metres = self.sight.pixel_m * depth(self.camera, &focus);
            pan(self.camera, right * metres, up * metres);
        }
        true
    }

    fn wheel(&mut self, notches: f64) -> bool {
        let Some(pointer) = self.man.pointer.filter(|_| self.sight.is_over) else { return false };
        let towards = (self.sight.point)(self.camera, pointer);
        zoom(self.camera, &towards, NOTCH.powf(-notches));
        true
    }

    fn fly(&mut self, key: Key, is_pressed: bool) -> bool {
        let flies = self.man.drag.is_some_and(|drag| drag.button == PointerButton::Secondary);
        let Some(at) = FLIGHT_KEYS.iter().position(|(known, _)| *known == key) else { return false };
        if is_pressed && !flies {
            return false;
        }
        std::mem::replace(&mut self.man.flies[at], is_pressed) || is_pressed
    }
}

impl Receiver for CameraTurn<'_> {
    fn take(&mut self, told: &Told<'_>) -> bool {
        match *told.event {
            Event::PointerButton { button, pressed: true, .. } => self.begin(button),
            Event::PointerButton { button, pressed: false, .. } => self.end(button),
            Event::PointerMoved(to) => {
                let from = self.man.pointer.replace(to);
                from.is_some_and(|from| self.drag(to - from))
            }
            Event::PointerGone => {
                self.man.pointer = None;
                false
            }
            Event::MouseWheel { unit, delta, modifiers: Modifiers { ctrl: true, .. }, .. } => {
                let notches = if unit == MouseWheelUnit::Point { delta.y / POINTS_A_NOTCH } else { delta.y };
                self.wheel(f64::from(notches))
            }
            Event::Key { key, pressed, modifiers, .. } if !modifiers.ctrl && !modifiers.alt => {
                self.fly(key, pressed)
            }
            _ => false,
        }
    }
}
