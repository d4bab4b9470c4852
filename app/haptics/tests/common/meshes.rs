//! Meshes and random fingers for the tests of contact with meshes.
#![allow(dead_code, non_snake_case)]

use std::f64::consts::PI;
use std::sync::Arc;

use haptics::mesh::{Mesh, TriangleSoup, make};
use haptics::{Entity, Finger, FingerOutput, Friction, Shape};
use nalgebra::Vector3;

use crate::common::{DT, Noise, entity, path};

pub(crate) fn built(soup: TriangleSoup) -> Arc<Mesh> {
    Arc::new(Mesh::build(soup).unwrap().0)
}

pub(crate) fn touchable(mesh: &Arc<Mesh>, friction: Friction) -> Entity {
    entity(Shape::from(Arc::clone(mesh)), friction)
}

pub(crate) fn cube() -> Arc<Mesh> {
    built(make::cuboid([0.1; 3]))
}

/// An open square of so many cells each way, of such a height above x and z.
pub(crate) fn sheet(cells: u32, size_m: f64, height: impl Fn(f64, f64) -> f64) -> TriangleSoup {
    let at = |place: u32| size_m * (f64::from(place) / f64::from(cells) - 0.5);
    let mut all = TriangleSoup::default();
    let places = (0..=cells).flat_map(|i| (0..=cells).map(move |j| [at(i), at(j)]));
    all.vertices.extend(places.map(|[x, z]| Vector3::new(x, height(x, z), z)));
    for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
        let [a, b] = [i * (cells + 1) + j, (i + 1) * (cells + 1) + j];
        all.faces.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    all
}

pub(crate) fn plate() -> Arc<Mesh> {
    built(make::cuboid([0.1, 2e-3, 0.1]))
}

pub(crate) fn star() -> Arc<Mesh> {
    built(make::star(5, 0.1, 0.04, 0.05))
}

pub(crate) fn uv_sphere(meridians: usize) -> Arc<Mesh> {
    built(make::uv_sphere(meridians, path::rings(meridians), 0.1))
}

pub(crate) fn bumpy_sphere(meridians: usize) -> Arc<Mesh> {
    built(make::bumpy_sphere(meridians, path::rings(meridians), 0.1))
}

/// A ball of 20 * 4^n triangles, all nearly alike.
pub(crate) fn icosphere(subdivisions: u32, radius_m: f64) -> TriangleSoup {
    let phi = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut vertices = Vec::new();
    for (a, b) in [(1.0, phi), (-1.0, phi), (1.0, -phi), (-1.0, -phi)] {
        vertices.extend([Vector3::new(0.0, a, b), Vector3::new(a, b, 0.0), Vector3::new(b, 0.0, a)]);
    }
    // Corners of a face are 2 apart.
    let is_edge = |a: &Vector3<f64>, b: &Vector3<f64>| ((a - b).norm() - 2.0).abs() < 1e-9;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| vertices[i]);
                if is_edge(&p, &q) && is_edge(&q, &r) && is_edge(&r, &p) {
                    let is_outward = (q - p).cross(&(r - p)).dot(&p) > 0.0;
                    faces.push(if is_outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..subdivisions {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push(vertices[a as usize].normalize() + vertices[b as usize].normalize());
                vertices.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let vertices = vertices.iter().map(|v| v.normalize() * radius_m).collect();
    TriangleSoup { vertices, faces }
}

/// A prism whose first edge, along z through the origin, has this angle inside the material; up to 350 degrees.
///
/// The material lies around -y. Its two flanks are 0.1 m long, as it is wide; above 180 degrees the edge is concave.
pub(crate) fn wedge(degrees: f64) -> TriangleSoup {
    let half = 0.5 * degrees.to_radians();
    if degrees < 180.0 {
        return make::wedge(2.0 * half, 0.1, 0.1);
    }
    // The outline leads from the edge down the left flank, around the material and up the right one.
    let at = |angle: f64, r: f64| [r * angle.sin(), -r * angle.cos()];
    let outer = 24;
    let mut outline = vec![[0.0, 0.0]];
    outline.extend((0..=outer).map(|i| at(-half + 2.0 * half * f64::from(i) / f64::from(outer), 0.1)));
    prism(&outline, 0.05)
}

/// Over an outline that is counter-clockwise seen from +z and seen whole from its first point.
pub(crate) fn prism(outline: &[[f64; 2]], z: f64) -> TriangleSoup {
    let n = outline.len() as u32;
    let end = |z: f64| outline.iter().map(move |p| Vector3::new(p[0], p[1], z));
    let mut soup = TriangleSoup { vertices: end(z).chain(end(-z)).collect(), faces: Vec::new() };
    for i in 0..n {
        let (j, k, l) = (n + i, n + (i + 1) % n, (i + 1) % n);
        soup.faces.extend([[i, j, k], [i, k, l]]);
    }
    soup.faces.extend((1..n - 1).flat_map(|i| [[0, i, i + 1], [n, n + i + 1, n + i]]));
    soup
}

/// Whether a point is inside that wedge's angle, whatever its ends.
pub(crate) fn is_in_wedge(degrees: f64, p: &Vector3<f64>) -> bool {
    let from_down = p.x.atan2(-p.y).abs();
    from_down <= 0.5 * degrees.to_radians().min(2.0 * PI)
}

pub(crate) fn unit_vector(noise: &mut Noise) -> Vector3<f64> {
    noise.vector(1.0).normalize()
}

/// A finger that roams about a cube of this half width: towards a random point, in steps of about this length, until
/// it is there, then towards another.
pub(crate) struct Roaming {
    pub(crate) noise: Noise,
    pub(crate) hip: Vector3<f64>,
    goal: Vector3<f64>,
    half_width_m: f64,
    step_m: f64,
}

impl Roaming {
    /// It begins outside.
    pub(crate) fn new(seed: u64, half_width_m: f64, step_m: f64) -> Self {
        let hip = Vector3::new(1.7, 1.9, 1.8) * half_width_m;
        Self { noise: Noise(seed), hip, goal: Vector3::zeros(), half_width_m, step_m }
    }

    pub(crate) fn next(&mut self) -> Vector3<f64> {
        let way = self.goal - self.hip;
        if way.norm() < 2.0 * self.step_m {
            self.goal = Vector3::from_fn(|_, _| self.noise.between(-1.0, 1.0) * self.half_width_m);
        }
        let jitter = self.noise.vector(0.5 * self.step_m);
        self.hip += way * (self.step_m / way.norm().max(self.step_m)) + jitter;
        self.hip
    }
}

pub(crate) fn step(finger: &mut Finger, entity: &Entity, hip: &Vector3<f64>) -> FingerOutput {
    finger.step(std::slice::from_ref(entity), hip, DT)
}
