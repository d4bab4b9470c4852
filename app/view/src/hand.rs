//! A hand without hardware: the mouse's (Melder 7.2.6, PhantomPhantom).
//!
//! Model: the hand is a point with fingers around it ([`Grip`]). Who drags with the left button moves it in the plane through
//! it that is parallel to the picture, so that it stays under the pointer; the wheel moves it away and back, along the
//! view. Keys move it straight up and down, close the grip, turn it and say how many fingers there are. What comes out is
//! where each finger wants to be; a hand's model and a device are between that and what is felt, so that a mouse that jumps
//! does no harm. Fingers stay where they began until somebody does anything with the hand; then they gather in the grip.
//! Frames: world, y up; metres. The pointer's places are the window's (points).

mod below;
mod grip;
mod pad;
mod seen;

pub use below::Cue;
pub use grip::Grip;
pub use seen::Seen;

use crate::input::HandKeys;
use crate::moment::{FingerMoment, Moment};
use crate::news::Wish;
use crate::pick::Picker;
use eframe::egui::{self, PointerButton, Vec2};
use nalgebra::{UnitQuaternion, Vector3};
use pad::{Pad, Push};
use world::SceneCamera;

/// What a notch of the wheel is (m).
pub const NOTCH_M: f64 = 0.004;
/// What is left of wheel and keys while Shift is held.
pub const FINE: f64 = 0.25;
/// How fast keys and controllers move the hand (m/s), and turn it (rad/s).
const KEYS_M_PER_S: f64 = 0.08;
const KEYS_RAD_PER_S: f64 = 1.5;
/// How fast fingers that began elsewhere come into the grip (m/s).
const GATHERING_M_PER_S: f64 = 0.15;
/// Touchpads tell points; so many are a notch.
const POINTS_PER_NOTCH: f64 = 40.0;
/// Windows that were covered for a while do not make up for it (s).
const LONGEST_TURN_S: f64 = 0.1;

/// The fingers of a hand that a mouse moves.
#[derive(Debug, Default)]
pub struct MouseHand {
    /// How the fingers stand around the hand's place.
    pub grip: Grip,
    /// Between the fingers (m).
    place: Vector3<f64>,
    /// Corners of what the devices reach (m).
    reach: [Vector3<f64>; 2],
    wishes: Vec<Wish>,
    /// Whether anybody has done anything with it.
    is_used: bool,
    /// From each finger's place in the grip to where it is wanted still (m).
    astray: Vec<Vector3<f64>>,
    pad: Pad,
}

impl MouseHand {
    /// With so many fingers, here (m), where devices reach from one corner of a box to the other.
    pub fn new(fingers: usize, place: Vector3<f64>, reach: [Vector3<f64>; 2]) -> Self {
        let wish = Wish { place, orientation: UnitQuaternion::identity(), buttons: 0 };
        let mut hand = Self {
            grip: Grip::new(fingers),
            place,
            reach,
            wishes: vec![wish; fingers],
            is_used: true,
            astray: vec![Vector3::zeros(); fingers],
            ..Self::default()
        };
        hand.go(Vector3::zeros());
        hand.pass(0.0);
        hand
    }

    /// With fingers that begin here (m), and stay there until somebody does anything.
    pub fn starting_at(starts: &[Vector3<f64>], reach: [Vector3<f64>; 2]) -> Self {
        let mut hand = Self::new(starts.len(), middle(&starts[..starts.len().min(Grip::MOST)]), reach);
        for (wish, start) in hand.wishes.iter_mut().zip(starts) {
            wish.place = *start;
        }
        hand.is_used = false;
        hand
    }

    /// What people do over the scene, which a camera sees so, and with keys, moves the fingers for so long (s).
    pub fn turn(
        &mut self,
        scene: &egui::Response,
        camera: &SceneCamera,
        keys: &mut HandKeys,
        dt_s: f64,
    ) -> &[Wish] {
        let seen = Seen::new(camera, scene.rect);
        let dt_s = dt_s.clamp(0.0, LONGEST_TURN_S);
        self.face(&seen);
        if scene.dragged_by(PointerButton::Primary) {
            self.drag(scene.drag_delta(), &seen);
        }
        if scene.contains_pointer() {
            let (turned, is_fine) = scene.ctx.input(|input| (notches(&input.events), input.modifiers.shift));
            self.wheel(turned, is_fine, &seen);
        }
        self.obey(keys, &seen, dt_s);
        let push = self.pad.push(dt_s);
        self.follow(&push, &seen, dt_s);
        if keys.is_closed() || push.closes {
            self.grip.close();
        } else {
            self.grip.open();
        }
        self.pass(dt_s)
    }

    /// Moves it with a pointer that was dragged by so much, parallel to the picture.
    pub fn drag(&mut self, by: Vec2, seen: &Seen) {
        let scale = seen.metres_per_point(&self.place);
        self.go((seen.right() * f64::from(by.x) - seen.up() * f64::from(by.y)) * scale);
    }

    /// Moves it away by so many notches, or back; its place in the picture stays.
    pub fn wheel(&mut self, notches: f64, is_fine: bool, seen: &Seen) {
        let share = if is_fine { FINE } else { 1.0 };
        self.go(seen.along(&self.place) * (notches * NOTCH_M * share));
    }

    /// Moves it by so much (m), as far as devices reach.
    pub fn go(&mut self, by: Vector3<f64>) {
        if by != Vector3::zeros() {
            self.begin();
        }
        let [least, most] = &self.reach;
        self.place = (self.place + by).sup(least).inf(most);
    }

    /// From now on it is used: fingers leave where they began.
    fn begin(&mut self) {
        if std::mem::replace(&mut self.is_used, true) {
            return;
        }
        for (finger, (astray, wish)) in self.astray.iter_mut().zip(&self.wishes).enumerate() {
            *astray = wish.place - (self.place + self.grip.stand(finger));
        }
    }

    /// An open hand faces whoever looks; one that holds something stays as it is.
    pub fn face(&mut self, seen: &Seen) {
        self.grip.face(&seen.right());
    }

    /// Time goes by (s): the fingers close or open.
    pub fn pass(&mut self, dt_s: f64) -> &[Wish] {
        if !self.grip.is_as_it_began() {
            self.begin();
        }
        self.grip.pass(dt_s);
        if !self.is_used {
            return &self.wishes;
        }
        let [least, most] = &self.reach;
        for (finger, (wish, astray)) in self.wishes.iter_mut().zip(&mut self.astray).enumerate() {
            *astray -= astray.cap_magnitude(GATHERING_M_PER_S * dt_s);
            wish.place = (self.place + self.grip.stand(finger) + *astray).sup(least).inf(most);
            wish.orientation = self.grip.orientation();
        }
        &self.wishes
    }

    /// Where it is (m).
    pub fn place(&self) -> Vector3<f64> {
        self.place
    }

    /// Where the fingers are to be.
    pub fn wishes(&self) -> &[Wish] {
        &self.wishes
    }

    /// What the fingers feel.
    pub fn feel(&mut self, moment: &Moment) {
        let fingers = &moment.fingers[..self.grip.fingers().min(moment.fingers.len())];
        let held = fingers.iter().filter(|finger| finger.entity.is_some_and(|it| is_held(fingers, it)));
        self.grip.feel(held.map(|finger| finger.force.norm()).fold(0.0, f64::max));
    }

    /// What shows where the hand is over things.
    pub fn cue(&self, picker: &Picker, moment: &Moment) -> Option<Cue> {
        let fingers = &moment.fingers[..self.grip.fingers().min(moment.fingers.len())];
        let hips: Vec<Vector3<f64>> = fingers.iter().map(|finger| finger.hip).collect();
        // The hand is in what it holds, not over it.
        Cue::below(picker, moment, &hips, |entity| is_held(fingers, entity))
    }

    /// A controller's sticks are held like this.
    fn follow(&mut self, push: &Push, seen: &Seen, dt_s: f64) {
        let way = seen.right() * push.right + seen.up() * push.up + seen.along(&self.place) * push.away;
        self.go(way * (KEYS_M_PER_S * dt_s));
        self.grip.turn(push.turn * KEYS_RAD_PER_S * dt_s);
    }

    /// Moves and turns it as keys say that are held for so long (s).
    fn obey(&mut self, keys: &mut HandKeys, seen: &Seen, dt_s: f64) {
        let share = if keys.is_fine() { FINE } else { 1.0 };
        let level =
            |way: Vector3<f64>| Vector3::new(way.x, 0.0, way.z).try_normalize(1e-6).unwrap_or_default();
        let [right, up, nearer] = keys.way();
        let way = level(seen.right()) * right + Vector3::y() * up - level(seen.ahead()) * nearer;
        self.go(way * (share * KEYS_M_PER_S * dt_s));
        self.grip.turn(keys.turn()[1] * share * KEYS_RAD_PER_S * dt_s);
        if let Some(fingers) = keys.take_fingers() {
            self.grip.set_fingers(fingers);
        }
    }
}

/// Between the first finger, the thumb, and the middle of the others (m).
pub fn middle(fingers: &[Vector3<f64>]) -> Vector3<f64> {
    let Some((thumb, others)) = fingers.split_first() else { return Vector3::zeros() };
    if others.is_empty() {
        return *thumb;
    }
    0.5 * (thumb + others.iter().sum::<Vector3<f64>>() / others.len() as f64)
}

/// What two fingers touch they hold.
fn is_held(fingers: &[FingerMoment], entity: usize) -> bool {
    fingers.iter().filter(|finger| finger.entity == Some(entity)).count() > 1
}

/// What the wheel did for the hand; with Ctrl it is the camera's.
fn notches(events: &[egui::Event]) -> f64 {
    let turned = events.iter().map(|event| match event {
        egui::Event::MouseWheel { unit, delta, modifiers, .. } if !modifiers.command && !modifiers.ctrl => {
            // With Shift some desktops scroll sideways.
            let by = f64::from(if delta.y == 0.0 { delta.x } else { delta.y });
            match unit {
                egui::MouseWheelUnit::Point => by / POINTS_PER_NOTCH,
                egui::MouseWheelUnit::Line | egui::MouseWheelUnit::Page => by,
            }
        }
        _ => 0.0,
    });
    turned.sum()
}
