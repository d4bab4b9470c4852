//! How a camera sees what is shown in a part of the window: from places in the world to points, and back along the picture.

use eframe::egui::{Pos2, Rect, Vec2};
use nalgebra::{Point3, Vector3};
use world::SceneCamera;

/// Nearer than this nothing is where it seems to be (m).
const NEAREST_M: f64 = 1e-3;

/// One eye's view, filling this part of the window.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'c> {
    camera: &'c SceneCamera,
    part: Rect,
}

impl<'c> Seen<'c> {
    /// What this camera shows there.
    pub fn new(camera: &'c SceneCamera, part: Rect) -> Self {
        Self { camera, part }
    }

    /// Where a place (m) is in the window; `None`: not before the camera.
    pub fn project(&self, place: &Vector3<f64>) -> Option<Pos2> {
        let in_camera = self.camera.pose.inverse_transform_point(&Point3::from(*place));
        let away_m = -in_camera.z;
        (away_m > NEAREST_M).then(|| {
            let points = 1.0 / self.metres_per_point(place);
            self.part.center() + Vec2::new((in_camera.x * points) as f32, (-in_camera.y * points) as f32)
        })
    }

    /// What a point of the window is as far away as this place is (m).
    pub fn metres_per_point(&self, place: &Vector3<f64>) -> f64 {
        let tangent = (0.5 * self.camera.field_of_view_deg).to_radians().tan();
        2.0 * tangent * self.away_m(place) / f64::from(self.part.height().max(1.0))
    }

    /// To the right in the picture; unit length, as the others are.
    pub fn right(&self) -> Vector3<f64> {
        self.camera.pose.rotation * Vector3::x()
    }

    /// Upwards in it.
    pub fn up(&self) -> Vector3<f64> {
        self.camera.pose.rotation * Vector3::y()
    }

    /// Into its middle.
    pub fn ahead(&self) -> Vector3<f64> {
        self.camera.pose.rotation * -Vector3::z()
    }

    /// From the eye to a place, for one metre along the view: what moves so stays at its point.
    pub fn along(&self, place: &Vector3<f64>) -> Vector3<f64> {
        (place - self.camera.pose.translation.vector) / self.away_m(place)
    }

    /// Along the view.
    fn away_m(&self, place: &Vector3<f64>) -> f64 {
        (place - self.camera.pose.translation.vector).dot(&self.ahead()).max(NEAREST_M)
    }
}
