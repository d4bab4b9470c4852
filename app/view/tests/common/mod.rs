//! Pictures to ask for the colours of places.
#![allow(dead_code)] // Not every file asks for everything.

use nalgebra::Point3;
use view::{Picture, Stage, Studio};
use world::SceneCamera;

/// Of all pictures that say nothing else.
pub(crate) const SIZE: [u32; 2] = [800, 600];

/// `None`, and said so: there are no pictures on this machine.
pub(crate) fn studio(stage: &Stage, size: [u32; 2]) -> Option<Studio> {
    Studio::new(stage, size).inspect_err(|missing| println!("skipped: {missing}")).ok()
}

/// The colour of a place of the world in a picture of [`SIZE`], where a pinhole camera sees it.
pub(crate) fn colour(picture: &Picture, camera: &SceneCamera, place: [f64; 3]) -> [i32; 3] {
    let at = camera.pose.inverse() * Point3::from(place);
    let [across, half] = SIZE.map(|side| 0.5 * f64::from(side));
    let pixels = half / (0.5 * camera.field_of_view_deg).to_radians().tan();
    let (column, row) = (across + pixels * at.x / -at.z, half - pixels * at.y / -at.z);
    let [r, g, b, _] = picture.at(column as u32, row as u32);
    [r, g, b].map(i32::from)
}
