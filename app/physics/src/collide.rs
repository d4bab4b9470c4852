//! Where two entities touch: contact points that keep their identity.
//!
//! Model (Melder ch. 6.2.1, 7.4): a contact that fills an edge gives its two ends, one that fills a face its corners. A
//! point is reported from a given reach on before it touches, so that its spring is there when it does.
//! Frames and signs: W; normals leave B and point to A; gaps are negative where they overlap.
//! Invariants: no allocation; at most [`MAX_POINTS`] points; an id stands for the same features from tick to tick.

mod mesh;
mod mesh_ball;
mod mesh_corner;
mod mesh_plane;
mod mesh_span;

use haptics::{Form, Shape};
use nalgebra::{Isometry3, Point3, Vector3};

/// The most contact points of two entities.
pub const MAX_POINTS: usize = 8;

/// A contact point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactPoint {
    /// Which features of A and B touch; different for each point of a pair.
    pub id: u32,
    /// On the surface of A \[m\].
    pub point_W: Vector3<f64>,
    /// Unit, from B to A.
    pub normal_W: Vector3<f64>,
    /// From B's surface to that of A along the normal \[m\]; negative: the depth.
    pub gap_m: f64,
}

/// All contact points of two entities.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ContactPoints {
    points: [ContactPoint; MAX_POINTS],
    count: usize,
}

impl ContactPoints {
    /// Adds one; beyond the room, it takes the place of the one that is least deep, if it is deeper.
    pub fn push(&mut self, point: ContactPoint) {
        if let Some(place) = self.points.get_mut(self.count) {
            *place = point;
            self.count += 1;
            return;
        }
        let least = self.points.iter_mut().max_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
        if let Some(least) = least.filter(|least| point.gap_m < least.gap_m) {
            *least = point;
        }
    }

    /// All of them.
    pub fn as_slice(&self) -> &[ContactPoint] {
        &self.points[..self.count]
    }
}

/// An entity as collision sees it.
#[derive(Debug, Clone, Copy)]
pub struct Solid<'s> {
    /// In its own frame.
    pub shape: &'s Shape,
    /// Where that is.
    pub X_W: &'s Isometry3<f64>,
}

/// What finding the contact points of a pair remembers from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PairMemory {
    /// Whatever the pair's algorithm makes of them.
    pub words: [f64; 8],
    /// Numbers of features plus one; 0: none.
    pub features: [u32; MAX_POINTS],
}

/// Whether contact points of such an entity as `A` can be found.
pub fn can_move(shape: &Shape) -> bool {
    matches!(shape, Shape::Form(Form::Sphere(_) | Form::Cuboid(_)) | Shape::Mesh(_))
}

/// A ball around an entity: its centre in the entity's frame and its radius (m); `None` where it has no end.
pub fn bounding_ball(shape: &Shape) -> Option<(Vector3<f64>, f64)> {
    match shape {
        Shape::Form(Form::Sphere(sphere)) => Some((Vector3::zeros(), sphere.radius_m())),
        Shape::Form(Form::Cuboid(cuboid)) => {
            Some((Vector3::zeros(), 0.5 * Vector3::from(cuboid.size_m()).norm()))
        }
        Shape::Mesh(mesh) => Some(mesh::bounding_ball(mesh)),
        _ => None,
    }
}

/// Where A and B touch, or come nearer than `reach_m`.
pub fn contact_points(
    a: Solid<'_>,
    b: Solid<'_>,
    reach_m: f64,
    memory: &mut PairMemory,
    found: &mut ContactPoints,
) {
    if let (Shape::Mesh(_), _) | (_, Shape::Mesh(_)) = (a.shape, b.shape) {
        mesh::contact_points(a, b, reach_m, memory, found);
        return;
    }
    let Shape::Form(Form::Plane(plane)) = b.shape else { return };
    let normal_W = b.X_W.rotation * plane.normal_B();
    let offset_m = plane.offset_m() + normal_W.dot(&b.X_W.translation.vector);
    let mut report = |id: u32, point_W: Vector3<f64>| {
        let gap_m = normal_W.dot(&point_W) - offset_m;
        if gap_m <= reach_m {
            found.push(ContactPoint { id, point_W, normal_W, gap_m });
        }
    };
    match a.shape {
        Shape::Form(Form::Sphere(sphere)) => {
            report(0, a.X_W.translation.vector - normal_W * sphere.radius_m());
        }
        Shape::Form(Form::Cuboid(cuboid)) => {
            let half = Vector3::from(cuboid.size_m()) * 0.5;
            for corner in 0..8_u32 {
                let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                let corner_A = half.component_mul(&Vector3::new(sign(0), sign(1), sign(2)));
                report(corner, (a.X_W * Point3::from(corner_A)).coords);
            }
        }
        _ => {}
    }
}
