//! Two eyes: what each of them sees, and where in the picture.
//!
//! Model: both eyes look along the camera's -z, half a separation to its left and right; their frusta are skewed so that
//! both see the same at the convergence distance. What is nearer stands out of the picture, what is farther lies behind it,
//! and nothing is shifted up or down as it would be by eyes that turn.

use nalgebra::{Isometry3, Point3, Vector3};
use three_d::{Camera, ColorMapping, Mat4, ToneMapping, Vec3, Viewer, Viewport, degrees};
use world::{SceneCamera, StereoMode};

use crate::painter::vector;
use crate::pick::Ray;

/// How two eyes are served; may change from picture to picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eyes {
    /// Left is left, and left is above. Pixels stay square: halves are not squeezed. `QuadBuffer` is for windows that have
    /// the buffers; other pictures are then for one eye.
    pub mode: StereoMode,
    /// Between them (m).
    pub separation_m: f64,
    /// How far away, along the view, both see the same (m); above 0.
    pub convergence_m: f64,
}

impl Default for Eyes {
    /// One eye; two would be as far apart as people's are.
    fn default() -> Self {
        Self { mode: StereoMode::Off, separation_m: 0.063, convergence_m: 0.6 }
    }
}

/// What one eye contributes to a picture.
pub struct Look {
    /// The eye.
    pub eye: Eye,
    /// Which of red, green and blue it draws.
    pub channels: [bool; 3],
}

/// What somebody points at who points at a place of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pointed {
    /// What lies there.
    pub ray: Ray,
    /// One pixel, a metre away along the view (m).
    pub pixel_m: f64,
}

/// A camera whose frustum may be skewed sideways.
pub struct Eye {
    camera: Camera,
    /// What is added to where things are in the picture, in halves of its width.
    skew: f32,
}

impl Eyes {
    /// The looks that make a picture within this part of a target (pixels), one after the other.
    pub fn looks(&self, camera: &SceneCamera, part: Viewport) -> Vec<Look> {
        let all = [true; 3];
        let Viewport { width, height, .. } = part;
        let at = |x: u32, y: u32, width, height| Viewport {
            x: part.x + x as i32,
            y: part.y + y as i32,
            width,
            height,
        };
        // Windows may be without height or width for a while.
        let (half_width, half_height) = ((width / 2).max(1), (height / 2).max(1));
        let whole = at(0, 0, width, height);
        let (left, right) = match self.mode {
            StereoMode::Off | StereoMode::QuadBuffer => {
                return vec![Look { eye: Eye::new(camera, whole, 0.0, f64::INFINITY), channels: all }];
            }
            StereoMode::SideBySide => {
                let side = |x| at(x, 0, half_width, height);
                ((side(0), all), (side(width.saturating_sub(half_width)), all))
            }
            StereoMode::TopBottom => {
                // Rows count from below.
                let side = |y| at(0, y, width, half_height);
                ((side(height.saturating_sub(half_height)), all), (side(0), all))
            }
            StereoMode::Anaglyph => ((whole, [true, false, false]), (whole, [false, true, true])),
        };
        let look = |(viewport, channels), side: f64| Look {
            eye: Eye::new(camera, viewport, side * 0.5 * self.separation_m, self.convergence_m),
            channels,
        };
        vec![look(left, -1.0), look(right, 1.0)]
    }

    /// At a place of a picture of this size (pixels, from the upper left corner; parts of them, too). What red and cyan eyes
    /// see apart is pointed at from between them.
    pub fn point(&self, camera: &SceneCamera, size: [f64; 2], at: [f64; 2]) -> Pointed {
        let [width, height] = size;
        let (mut part, mut right_m) = ([0.0, 0.0, width, height], 0.0);
        match self.mode {
            StereoMode::SideBySide => {
                let is_right = at[0] >= 0.5 * width;
                part = [if is_right { 0.5 * width } else { 0.0 }, 0.0, 0.5 * width, height];
                right_m = if is_right { 0.5 } else { -0.5 } * self.separation_m;
            }
            StereoMode::TopBottom => {
                let is_right = at[1] >= 0.5 * height;
                part = [0.0, if is_right { 0.5 * height } else { 0.0 }, width, 0.5 * height];
                right_m = if is_right { 0.5 } else { -0.5 } * self.separation_m;
            }
            StereoMode::Off | StereoMode::Anaglyph | StereoMode::QuadBuffer => {}
        }
        let [left, upper, width, height] = part;
        let pixel_m = 2.0 * (0.5 * camera.field_of_view_deg).to_radians().tan() / height.max(1.0);
        let (right, up) = (at[0] - left - 0.5 * width, upper + 0.5 * height - at[1]);
        // Where both eyes agree they see the same in the same place.
        let skewed = Vector3::new(pixel_m * right - right_m / self.convergence_m, pixel_m * up, -1.0);
        let origin = camera.pose * Point3::new(right_m, 0.0, 0.0);
        Pointed { ray: Ray { origin, direction: (camera.pose * skewed).normalize() }, pixel_m }
    }
}

impl Eye {
    /// So far to the right of a camera (m), with whose picture its own agrees at that distance (m).
    pub fn new(of: &SceneCamera, viewport: Viewport, right_m: f64, convergence_m: f64) -> Self {
        let pose = of.pose * Isometry3::translation(right_m, 0.0, 0.0);
        let at = |x, y, z| pose * Point3::new(x, y, z);
        let camera = Camera::new_perspective(
            viewport,
            vector(&at(0.0, 0.0, 0.0).coords),
            vector(&at(0.0, 0.0, -1.0).coords),
            vector(&(pose.rotation * Vector3::y())),
            degrees(of.field_of_view_deg as f32),
            of.near_m as f32,
            of.far_m as f32,
        );
        let tangent = (0.5 * of.field_of_view_deg).to_radians().tan() * f64::from(viewport.aspect());
        Self { camera, skew: (right_m / (convergence_m * tangent)) as f32 }
    }
}

impl Viewer for Eye {
    fn position(&self) -> Vec3 {
        self.camera.position()
    }

    fn view(&self) -> Mat4 {
        self.camera.view()
    }

    fn projection(&self) -> Mat4 {
        let mut skewed = self.camera.projection();
        // Depth along the view is -z.
        skewed.z.x -= self.skew;
        skewed
    }

    fn viewport(&self) -> Viewport {
        self.camera.viewport()
    }

    fn z_near(&self) -> f32 {
        self.camera.z_near()
    }

    fn z_far(&self) -> f32 {
        self.camera.z_far()
    }

    fn color_mapping(&self) -> ColorMapping {
        self.camera.color_mapping
    }

    fn tone_mapping(&self) -> ToneMapping {
        self.camera.tone_mapping
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    const SIZE: [u32; 2] = [1280, 720];

    fn camera() -> SceneCamera {
        let turned = UnitQuaternion::from_euler_angles(-0.4, 0.7, 0.1);
        let pose = Isometry3::from_parts(Vector3::new(0.2, 0.3, 0.5).into(), turned);
        SceneCamera { name: "c".into(), pose, field_of_view_deg: 35.0, near_m: 0.01, far_m: 10.0 }
    }

    #[test]
    fn who_points_at_a_pixel_points_at_what_is_drawn_there() {
        let camera = camera();
        let modes = [StereoMode::Off, StereoMode::SideBySide, StereoMode::TopBottom, StereoMode::QuadBuffer];
        for mode in modes {
            let eyes = Eyes { mode, ..Eyes::default() };
            for look in eyes.looks(&camera, Viewport::new_at_origo(SIZE[0], SIZE[1])) {
                for place in [[0.0, 0.0, -0.5], [0.05, -0.03, -0.4], [-0.1, 0.08, -1.5]] {
                    let place = camera.pose * Point3::from(place);
                    // What graphics make of it.
                    let seen = look.eye.projection() * look.eye.view() * vector(&place.coords).extend(1.0);
                    let part = look.eye.viewport();
                    let along = |at: f32, from: i32, side: u32| {
                        f64::from(from) + 0.5 * (1.0 + f64::from(at)) * f64::from(side)
                    };
                    let column = along(seen.x / seen.w, part.x, part.width);
                    let row = f64::from(SIZE[1]) - along(seen.y / seen.w, part.y, part.height);
                    let Pointed { ray, .. } = eyes.point(&camera, SIZE.map(f64::from), [column, row]);
                    let beside = (place - ray.origin).cross(&ray.direction).norm();
                    // Of the 1.6 m at most that single precision knows to a ten-millionth, some dozen times over.
                    assert!(beside < 3e-6, "{mode:?} {beside}");
                }
            }
        }
    }
}
