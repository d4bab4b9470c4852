//! Meshes with the faults that scans and artists' models have: noise, folds, pockets, overlapping parts, cavities.
#![allow(dead_code)]

use haptics::mesh::{TriangleSoup, make};
use nalgebra::{Rotation3, Vector3};

use crate::common::Noise;
use crate::common::meshes::icosphere;

/// Its vertices moved by so much in any direction.
pub(crate) fn noisy(mut soup: TriangleSoup, sigma_m: f64, seed: u64) -> TriangleSoup {
    let mut noise = Noise(seed);
    soup.vertices.iter_mut().for_each(|vertex| *vertex += noise.vector(sigma_m));
    soup
}

/// A ball of which every so manieth vertex was drawn along the surface, over its neighbours and beyond: the fan around
/// it lies upon itself.
pub(crate) fn folded_ball(every: usize, by_m: f64) -> TriangleSoup {
    let mut soup = icosphere(3, 0.1);
    let mut noise = Noise(5);
    for vertex in soup.vertices.iter_mut().step_by(every) {
        let along = vertex.cross(&noise.vector(1.0)).normalize();
        *vertex += along * by_m;
    }
    soup
}

/// A square-based double pyramid in which one apex was pulled through the base and out beside the other apex: vertices of
/// valence 4 whose fans cut through themselves.
pub(crate) fn pulled_pyramid(apex: [f64; 3]) -> TriangleSoup {
    let flat = |x: f64, z: f64| Vector3::new(x, 0.0, z);
    let mut vertices = vec![flat(-0.05, -0.05), flat(0.05, -0.05), flat(0.05, 0.05), flat(-0.05, 0.05)];
    vertices.extend([Vector3::from(apex), -Vector3::y() * 0.04]);
    let faces = vec![[4, 1, 0], [4, 2, 1], [4, 3, 2], [4, 0, 3], [5, 0, 1], [5, 1, 2], [5, 2, 3], [5, 3, 0]];
    TriangleSoup { vertices, faces }
}

/// A ball pushed in from above until the dent comes out below: there the surface is inside out.
pub(crate) fn ball_pushed_through_itself() -> TriangleSoup {
    let mut soup = icosphere(3, 0.1);
    for vertex in soup.vertices.iter_mut().filter(|vertex| vertex.y > 0.07) {
        vertex.y -= 0.25 * (1.0 - (vertex.x.powi(2) + vertex.z.powi(2)) / 0.0051);
    }
    soup
}

/// All in one, each as it is.
pub(crate) fn together(soups: impl IntoIterator<Item = TriangleSoup>) -> TriangleSoup {
    let mut all = TriangleSoup::default();
    for soup in soups {
        let first = all.vertices.len() as u32;
        all.vertices.extend(soup.vertices);
        all.faces.extend(soup.faces.iter().map(|face| face.map(|v| v + first)));
    }
    all
}

pub(crate) fn moved(mut soup: TriangleSoup, by: [f64; 3]) -> TriangleSoup {
    soup.vertices.iter_mut().for_each(|vertex| *vertex += Vector3::from(by));
    soup
}

pub(crate) fn turned(mut soup: TriangleSoup, by: [f64; 3]) -> TriangleSoup {
    let turn = Rotation3::from_euler_angles(by[0], by[1], by[2]);
    soup.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex);
    soup
}

/// Wound the other way round: what was inside is outside.
pub(crate) fn inverted(mut soup: TriangleSoup) -> TriangleSoup {
    soup.faces.iter_mut().for_each(|face| face.swap(1, 2));
    soup
}

/// Closed meshes with these faults.
pub(crate) fn flawed_solids() -> Vec<(&'static str, TriangleSoup)> {
    let ball = || icosphere(2, 0.05);
    let cube = |size: f64| make::cuboid([size; 3]);
    let crowd = (0..12).map(|i| {
        let mut noise = Noise(100 + i);
        let at = noise.vector(0.03);
        let soup = if i % 2 == 0 { cube(0.05) } else { ball() };
        moved(turned(soup, noise.vector(1.0).into()), at.into())
    });
    vec![
        ("noise", noisy(icosphere(3, 0.1), 0.006, 1)),
        ("much noise", noisy(make::torus(24, 16, 0.07, 0.03), 0.02, 2)),
        ("folds", folded_ball(7, 0.025)),
        ("pulled pyramid", pulled_pyramid([0.06, -0.05, 0.02])),
        ("pushed through itself", ball_pushed_through_itself()),
        ("spindle torus", make::torus(24, 16, 0.03, 0.05)),
        ("cavity", together([icosphere(3, 0.1), inverted(icosphere(2, 0.06))])),
        ("crossed cavity", together([cube(0.2), inverted(ball()), moved(ball(), [0.03, 0.01, 0.02])])),
        ("crowd", together(crowd)),
        ("face to face", together([cube(0.1), moved(cube(0.1), [0.1, 0.03, 0.0])])),
        ("steps", together([cube(0.1), moved(cube(0.1), [0.05, 0.0, 0.0])])),
    ]
}
