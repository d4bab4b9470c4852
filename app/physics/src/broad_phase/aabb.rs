//! Boxes along the axes of the world, around entities.

use haptics::{Entity, Form, Shape};
use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::collide::bounding_ball;

/// All points between two corners \[m\], in W.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// The lowest coordinates.
    pub low_W: Vector3<f64>,
    /// The highest.
    pub high_W: Vector3<f64>,
}

impl Aabb {
    /// Around a ball.
    pub fn of_ball(centre_W: &Vector3<f64>, radius_m: f64) -> Self {
        Self { low_W: *centre_W, high_W: *centre_W }.grown(radius_m)
    }

    /// Around an entity where it is, and what stands out of its surface; `None` where it has no end, or nobody knows it.
    pub fn of_entity(entity: &Entity) -> Option<Self> {
        let around = Self::of_shape(&entity.shape, &entity.X_WB)?;
        let stands_out_m =
            entity.height_map.as_ref().map_or(0.0, |heights| heights.lift_m(&entity.shape, 0.0).abs());
        Some(around.grown(stands_out_m)).filter(Self::is_finite)
    }

    /// Around a shape whose frame is there; `None` where it has no end, or nobody knows it.
    pub fn of_shape(shape: &Shape, X_WB: &Isometry3<f64>) -> Option<Self> {
        let (centre_B, half_B) = match shape {
            Shape::Form(form) => (Vector3::zeros(), half_size(form)?),
            Shape::Mesh(mesh) => {
                let [low_B, high_B] = mesh.bounds_B();
                ((low_B + high_B) * 0.5, (high_B - low_B) * 0.5)
            }
            _ => {
                let (centre_B, radius_m) = bounding_ball(shape)?;
                return Some(Self::of_ball(&(X_WB * nalgebra::Point3::from(centre_B)).coords, radius_m));
            }
        };
        let turn: Matrix3<f64> = X_WB.rotation.to_rotation_matrix().into_inner();
        let (centre_W, half_W) = (X_WB * nalgebra::Point3::from(centre_B), turn.abs() * half_B);
        Some(Self { low_W: centre_W.coords - half_W, high_W: centre_W.coords + half_W })
    }

    /// Its middle (m).
    pub fn middle_W(&self) -> Vector3<f64> {
        0.5 * (self.low_W + self.high_W)
    }

    /// Larger by so much on each side (m).
    #[must_use]
    pub fn grown(&self, by_m: f64) -> Self {
        let by = Vector3::repeat(by_m);
        Self { low_W: self.low_W - by, high_W: self.high_W + by }
    }

    /// Around this one and itself moved.
    #[must_use]
    pub fn swept(&self, way_W: &Vector3<f64>) -> Self {
        let zero = Vector3::zeros();
        Self { low_W: self.low_W + way_W.inf(&zero), high_W: self.high_W + way_W.sup(&zero) }
    }

    /// Around both.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        Self { low_W: self.low_W.inf(&other.low_W), high_W: self.high_W.sup(&other.high_W) }
    }

    /// Whether they have a point in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|i| self.low_W[i] <= other.high_W[i] && other.low_W[i] <= self.high_W[i])
    }

    /// Whether all of the other is in this one.
    pub fn contains(&self, other: &Self) -> bool {
        (0..3).all(|i| self.low_W[i] <= other.low_W[i] && other.high_W[i] <= self.high_W[i])
    }

    /// What it costs to keep it in a tree: half its surface \[m^2\].
    pub(crate) fn cost(&self) -> f64 {
        let size = self.high_W - self.low_W;
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    fn is_finite(&self) -> bool {
        self.low_W.iter().chain(self.high_W.iter()).all(|x| x.is_finite())
    }
}

/// Half the size of the box around a form, along the axes of its frame, with the origin in its middle \[m\].
fn half_size(form: &Form) -> Option<Vector3<f64>> {
    let upright = |radius_m: f64, half_m: f64| Vector3::new(radius_m, half_m, radius_m);
    Some(match form {
        Form::Plane(_) => return None,
        Form::Sphere(sphere) => Vector3::repeat(sphere.radius_m()),
        Form::Cuboid(cuboid) => Vector3::from(cuboid.size_m()) * 0.5,
        Form::Cylinder(c) => upright(c.radius_m(), 0.5 * c.length_m()),
        Form::Cone(c) => upright(c.radius_bottom_m().max(c.radius_top_m()), 0.5 * c.length_m()),
        Form::Capsule(c) => upright(c.radius_m(), 0.5 * c.length_m() + c.radius_m()),
        Form::Torus(t) => upright(t.ring_radius_m() + t.tube_radius_m(), t.tube_radius_m()),
        Form::Ellipsoid(ellipsoid) => Vector3::from(ellipsoid.radii_m()),
        Form::Scaled(scaled) => {
            half_size(&scaled.unscaled())?.component_mul(&Vector3::from(scaled.factors()))
        }
    })
}
