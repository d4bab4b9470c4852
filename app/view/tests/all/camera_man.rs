//! How people move the camera: closed forms, and the same through the events of a mouse.

use eframe::egui::{
    Event, Key, Modifiers, MouseWheelUnit, PointerButton, Pos2, Rect, TouchPhase, Vec2, pos2,
};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};
use view::Eyes;
use view::camera_man::{CameraMan, CameraTurn, Sight, depth, orbit, pan, zoom};
use view::input::{Bindings, Receiver, Router};
use world::SceneCamera;

const FOCUS: Point3<f64> = Point3::new(0.1, 0.05, -0.2);
const SIZE: [f64; 2] = [1280.0, 800.0];
/// Rounding of some hundred steps of numbers near 1.
const ROUNDED: f64 = 1e-12;

/// Looks at [`FOCUS`] from the front, above and the right; upright.
fn camera() -> SceneCamera {
    let eye = Point3::new(0.3, 0.4, 0.5);
    let pose = Isometry3::face_towards(&eye, &(eye + (eye - FOCUS)), &Vector3::y());
    SceneCamera { name: "c".into(), pose, field_of_view_deg: 35.0, near_m: 0.01, far_m: 10.0 }
}

fn away_m(camera: &SceneCamera) -> f64 {
    (camera.pose.translation.vector - FOCUS.coords).norm()
}

/// How the camera's right is inclined to the horizon, and which way its up points.
fn horizon(camera: &SceneCamera) -> [f64; 2] {
    [(camera.pose * Vector3::x()).y, (camera.pose * Vector3::y()).y]
}

/// Where a place of the world is in the picture (pixels from the upper left).
fn pixel(camera: &SceneCamera, place: &Point3<f64>) -> [f64; 2] {
    let at = camera.pose.inverse_transform_point(place);
    let pixels = 0.5 * SIZE[1] / (0.5 * camera.field_of_view_deg).to_radians().tan();
    [0.5 * SIZE[0] + pixels * at.x / -at.z, 0.5 * SIZE[1] - pixels * at.y / -at.z]
}

fn pixel_m(camera: &SceneCamera) -> f64 {
    Eyes::default().point(camera, SIZE, [0.0, 0.0]).pixel_m
}

#[test]
fn orbiting_keeps_the_distance_and_the_horizon_and_never_goes_over_the_top() {
    for roll_rad in [0.0, 0.4] {
        let mut camera = camera();
        camera.pose.rotation *= UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll_rad);
        let (begun_m, level) = (away_m(&camera), horizon(&camera)[0]);
        for step in 0..400 {
            let up_rad = if step < 200 { 0.05 } else { -0.05 };
            orbit(&mut camera, &FOCUS, 0.37, up_rad);
            assert!((away_m(&camera) - begun_m).abs() < ROUNDED);
            assert!((horizon(&camera)[0] - level).abs() < ROUNDED);
            assert!(horizon(&camera)[1] > 0.0, "upside down at {step}");
            let seen = pixel(&camera, &FOCUS);
            // Pixels: a thousand times coarser than what the distances are made of.
            assert!((seen[0] - 640.0).abs() < 1e-8 && (seen[1] - 400.0).abs() < 1e-8, "{seen:?}");
        }
    }
}

#[test]
fn all_the_way_around_is_where_it_began() {
    let begun = camera();
    let mut camera = begun.clone();
    (0..360).for_each(|_| orbit(&mut camera, &FOCUS, TAU / 360.0, 0.0));
    let apart = (camera.pose.translation.vector - begun.pose.translation.vector).norm();
    assert!(apart < ROUNDED && camera.pose.rotation.angle_to(&begun.pose.rotation) < 1e-7, "{apart}");
    orbit(&mut camera, &FOCUS, 0.5, 0.2);
    assert!(
        (camera.pose.translation.vector - begun.pose.translation.vector).norm() > 0.1,
        "it goes somewhere"
    );
    orbit(&mut camera, &FOCUS, 0.0, -0.2);
    orbit(&mut camera, &FOCUS, -0.5, 0.0);
    assert!((camera.pose.translation.vector - begun.pose.translation.vector).norm() < ROUNDED);
}

#[test]
fn panning_by_so_many_pixels_moves_the_focus_by_so_many() {
    let mut camera = camera();
    // Not in the middle.
    let focus = FOCUS + Vector3::new(0.05, 0.02, 0.1);
    let before = pixel(&camera, &focus);
    let metres = pixel_m(&camera) * depth(&camera, &focus);
    pan(&mut camera, 37.0 * metres, -12.0 * metres);
    let after = pixel(&camera, &focus);
    assert!((after[0] - before[0] - 37.0).abs() < 1e-9, "{before:?} {after:?}");
    assert!((after[1] - before[1] - 12.0).abs() < 1e-9, "down is down: {before:?} {after:?}");
}

#[test]
fn what_is_zoomed_at_stays_where_it_is_in_the_picture_and_zooming_ends() {
    let mut camera = camera();
    let at = FOCUS + Vector3::new(0.05, 0.02, 0.1);
    let (before, begun_m) = (pixel(&camera, &at), (camera.pose.translation.vector - at.coords).norm());
    zoom(&mut camera, &at, 0.5);
    let length_m = |camera: &SceneCamera| (camera.pose.translation.vector - at.coords).norm();
    assert!((length_m(&camera) - 0.5 * begun_m).abs() < ROUNDED);
    let after = pixel(&camera, &at);
    assert!((after[0] - before[0]).abs() < 1e-8 && (after[1] - before[1]).abs() < 1e-8);
    (0..100).for_each(|_| zoom(&mut camera, &at, 0.5));
    assert!((length_m(&camera) - 2.0 * camera.near_m).abs() < ROUNDED, "it is still seen");
    (0..100).for_each(|_| zoom(&mut camera, &at, 2.0));
    assert!((length_m(&camera) - 0.5 * camera.far_m).abs() < 1e-9);
}

/// A window, and a camera that people move in it.
struct Set {
    man: CameraMan,
    camera: SceneCamera,
    router: Router,
    is_over: bool,
}

impl Set {
    fn new() -> Self {
        Self { man: CameraMan::default(), camera: camera(), router: Router::default(), is_over: true }
    }

    fn tell(&mut self, event: &Event) -> bool {
        let sight = Sight {
            scene: Rect::from_min_size(Pos2::ZERO, Vec2::new(1280.0, 800.0)),
            point: &|_, _| FOCUS,
            pixel_m: pixel_m(&self.camera),
            is_over: self.is_over,
        };
        let mut turn = CameraTurn { man: &mut self.man, camera: &mut self.camera, sight: &sight };
        let receivers: &mut [&mut dyn Receiver] = &mut [&mut turn];
        self.router.tell(event, &Bindings::default(), receivers).is_some()
    }

    fn button(&mut self, button: PointerButton, pressed: bool) -> bool {
        self.tell(&Event::PointerButton { pos: Pos2::ZERO, button, pressed, modifiers: Modifiers::NONE })
    }

    fn drag(&mut self, button: PointerButton, to: Pos2) {
        self.tell(&Event::PointerMoved(pos2(100.0, 100.0)));
        assert!(self.button(button, true));
        assert!(self.tell(&Event::PointerMoved(to)));
        assert!(self.button(button, false));
        assert!(!self.tell(&Event::PointerMoved(pos2(900.0, 700.0))), "it is let go");
    }

    fn key(&mut self, key: Key, pressed: bool) -> bool {
        let modifiers = Modifiers::NONE;
        self.tell(&Event::Key { key, physical_key: None, pressed, repeat: false, modifiers })
    }
}

#[test]
fn who_drags_with_the_right_button_turns_what_is_seen_with_the_pointer() {
    let mut set = Set::new();
    // Nearer than the focus, where the pointer takes hold of it.
    let near = FOCUS + 0.1 * (set.camera.pose.translation.vector - FOCUS.coords).normalize();
    set.drag(PointerButton::Secondary, pos2(110.0, 105.0));
    let seen = pixel(&set.camera, &near);
    assert!(seen[0] > 640.5 && seen[1] > 400.25, "it goes with the pointer, right and down: {seen:?}");
    let mut other = camera();
    orbit(&mut other, &FOCUS, -10.0 * PI / 800.0, 5.0 * PI / 800.0);
    assert!((other.pose.translation.vector - set.camera.pose.translation.vector).norm() < ROUNDED);
}

#[test]
fn who_drags_with_the_middle_button_takes_the_focus_along() {
    let mut set = Set::new();
    set.drag(PointerButton::Middle, pos2(140.0, 80.0));
    let seen = pixel(&set.camera, &FOCUS);
    assert!((seen[0] - 680.0).abs() < 1e-8 && (seen[1] - 380.0).abs() < 1e-8, "{seen:?}");
}

#[test]
fn the_wheel_is_the_cameras_with_ctrl_only() {
    let mut set = Set::new();
    set.tell(&Event::PointerMoved(pos2(100.0, 100.0)));
    let wheel = |modifiers| Event::MouseWheel {
        unit: MouseWheelUnit::Line,
        delta: Vec2::new(0.0, 1.0),
        phase: TouchPhase::Move,
        modifiers,
    };
    let begun_m = away_m(&set.camera);
    assert!(!set.tell(&wheel(Modifiers::NONE)));
    assert_eq!(away_m(&set.camera), begun_m);
    assert!(set.tell(&wheel(Modifiers::CTRL)));
    assert!((away_m(&set.camera) - begun_m / 1.15).abs() < ROUNDED, "up is nearer");
    set.is_over = false;
    assert!(!set.tell(&wheel(Modifiers::CTRL)), "the panel's");
}

#[test]
fn letters_fly_while_the_right_button_is_held_and_are_others_otherwise() {
    let mut set = Set::new();
    assert!(!set.key(Key::W, true) && !set.key(Key::W, false));
    assert!(set.button(PointerButton::Secondary, true));
    assert!(set.key(Key::W, true));
    let (begun_m, ahead) = (away_m(&set.camera), set.camera.pose * -Vector3::z());
    let from = set.camera.pose.translation.vector;
    set.man.fly(&mut set.camera, 0.1);
    let flown = set.camera.pose.translation.vector - from;
    assert!((flown - 0.08 * begun_m * ahead).norm() < ROUNDED, "0.8 of the way in a second");
    assert!(set.key(Key::W, false));
    set.man.fly(&mut set.camera, 0.1);
    assert!((set.camera.pose.translation.vector - from - flown).norm() == 0.0);
    assert!(!set.key(Key::K, true), "no key of flight");
    assert!(set.key(Key::R, true) && set.man.is_flying());
    assert!(set.button(PointerButton::Secondary, false));
    assert!(!set.man.is_flying(), "without the button there is no flight");
}

#[test]
fn the_left_button_and_what_is_not_over_the_scene_are_not_the_cameras() {
    let mut set = Set::new();
    assert!(!set.button(PointerButton::Primary, true));
    set.is_over = false;
    assert!(!set.button(PointerButton::Secondary, true));
}
