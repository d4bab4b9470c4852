//! How the mass of the closed forms is spread.
//!
//! Model: of a solid of one density its volume, its centre and the mean squares of the coordinates about that centre.
//! Scaling along the axes multiplies each of them by its factors; moments are sums of two mean squares.
//! Frames: B, the form's own. All forms are symmetric enough for B's axes to be principal ones.

use std::f64::consts::PI;

use haptics::{Capsule, Form, Torus};
use nalgebra::Vector3;

/// Volume, centre and mean squares of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    /// \[m^3\]
    pub(super) volume_m3: f64,
    /// Centre of mass \[m\].
    pub(super) centre_B: Vector3<f64>,
    /// Mean squares of the coordinates about the centre \[m^2\].
    squares_m2: Vector3<f64>,
}

impl Spread {
    /// `None` for what has no end.
    pub(super) fn of(form: &Form) -> Option<Self> {
        Some(match form {
            Form::Plane(_) => return None,
            Form::Sphere(sphere) => ellipsoid([sphere.radius_m(); 3]),
            Form::Ellipsoid(ellipsoid_) => ellipsoid(ellipsoid_.radii_m()),
            Form::Cuboid(cuboid) => {
                let size = Vector3::from(cuboid.size_m());
                centred(size.product(), size.component_mul(&size) / 12.0)
            }
            Form::Cylinder(c) => frustum(c.radius_m(), c.radius_m(), c.length_m()),
            Form::Cone(c) => frustum(c.radius_bottom_m(), c.radius_top_m(), c.length_m()),
            Form::Capsule(c) => capsule(c),
            Form::Torus(t) => torus(t),
            Form::Scaled(scaled) => Self::of(&scaled.unscaled())?.stretched(&scaled.factors().into()),
        })
    }

    /// Principal moments of 1 kg of it about its centre \[m^2\].
    pub(super) fn moments_per_mass(&self) -> Vector3<f64> {
        let Vector3 { data: nalgebra::ArrayStorage([[x, y, z]]), .. } = self.squares_m2;
        Vector3::new(y + z, x + z, x + y)
    }

    fn stretched(&self, factors: &Vector3<f64>) -> Self {
        Self {
            volume_m3: self.volume_m3 * factors.product(),
            centre_B: self.centre_B.component_mul(factors),
            squares_m2: self.squares_m2.component_mul(factors).component_mul(factors),
        }
    }
}

fn centred(volume_m3: f64, squares_m2: Vector3<f64>) -> Spread {
    Spread { volume_m3, centre_B: Vector3::zeros(), squares_m2 }
}

fn ellipsoid(radii_m: [f64; 3]) -> Spread {
    let radii = Vector3::from(radii_m);
    centred(4.0 / 3.0 * PI * radii.product(), radii.component_mul(&radii) / 5.0)
}

/// Between two discs: integrals over the height of the disc's area, `pi (a + (b - a) t)^2`.
fn frustum(bottom_m: f64, top_m: f64, length_m: f64) -> Spread {
    let (a, b, h) = (bottom_m, top_m, length_m);
    let area = a * a + a * b + b * b;
    let mean = h * (a * a + 2.0 * a * b + 3.0 * b * b) / (4.0 * area);
    let mean_square = h * h * (a * a + 3.0 * a * b + 6.0 * b * b) / (10.0 * area);
    let fourths = (a * a * a + b * b * b) * (a + b) + a * a * b * b;
    let across = 3.0 / 20.0 * fourths / area;
    Spread {
        volume_m3: PI * h * area / 3.0,
        centre_B: Vector3::new(0.0, mean - 0.5 * h, 0.0),
        squares_m2: Vector3::new(across, mean_square - mean * mean, across),
    }
}

/// A cylinder and two half balls, whose own centres lie 3/8 of the radius from their flat sides.
fn capsule(capsule: &Capsule) -> Spread {
    let (r, l) = (capsule.radius_m(), capsule.length_m());
    let (straight, ends) = (PI * r * r * l, 4.0 / 3.0 * PI * r.powi(3));
    let volume_m3 = straight + ends;
    let across = (straight * r * r / 4.0 + ends * r * r / 5.0) / volume_m3;
    let end = l * l / 4.0 + 3.0 / 8.0 * l * r + r * r / 5.0;
    let along = (straight * l * l / 12.0 + ends * end) / volume_m3;
    centred(volume_m3, Vector3::new(across, along, across))
}

/// The tube's discs, of which each weighs in proportion to its distance from the axis (Pappus).
fn torus(torus: &Torus) -> Spread {
    let (ring, tube) = (torus.ring_radius_m(), torus.tube_radius_m());
    let across = 0.5 * ring * ring + 3.0 / 8.0 * tube * tube;
    let volume_m3 = 2.0 * PI * PI * ring * tube * tube;
    centred(volume_m3, Vector3::new(across, tube * tube / 4.0, across))
}
