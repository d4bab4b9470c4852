//! Closed forms, where their surface points are, and where contact points of two of them are asked for.
#![allow(dead_code, non_snake_case, unreachable_pub)]

use std::f64::consts::{PI, TAU};

use haptics::{Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Form, Scaled, Shape, Sphere, Surface, Torus};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use physics::collide::{ContactPoint, ContactPoints, PairMemory, Solid, contact_points};

/// Forms of some centimetres.
pub fn all() -> Vec<(&'static str, Form)> {
    vec![
        ("sphere", Sphere::new(0.02).unwrap().into()),
        ("box", Cuboid::new([0.06, 0.03, 0.04]).unwrap().into()),
        ("capsule", Capsule::new(0.01, 0.05).unwrap().into()),
        ("cylinder", Cylinder::new(0.02, 0.05).unwrap().into()),
        ("cone", Cone::new(0.025, 0.0, 0.05).unwrap().into()),
        ("truncated cone", Cone::new(0.025, 0.01, 0.03).unwrap().into()),
        ("torus", Torus::new(0.03, 0.01).unwrap().into()),
        ("ellipsoid", Ellipsoid::new([0.03, 0.015, 0.02]).unwrap().into()),
    ]
}

/// Scaled forms that can move.
pub fn scaled() -> Vec<(&'static str, Form)> {
    let scaled = |form: Form, factors| Scaled::new(form, factors).unwrap();
    vec![
        ("scaled cylinder", scaled(Cylinder::new(0.02, 0.05).unwrap().into(), [1.5, 0.8, 0.7])),
        ("scaled cone", scaled(Cone::new(0.025, 0.0, 0.05).unwrap().into(), [0.7, 1.2, 1.3])),
        ("scaled capsule", scaled(Capsule::new(0.01, 0.05).unwrap().into(), [1.5, 0.8, 0.7])),
    ]
}

/// xorshift64*.
pub struct Noise(pub u64);

impl Noise {
    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    pub fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }

    pub fn direction(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal()).normalize()
    }

    pub fn turn(&mut self) -> UnitQuaternion<f64> {
        let [w, x, y, z] = [0; 4].map(|_| self.normal());
        UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
    }
}

/// A surface point of a form for each u, v in 0..1: every point has some.
pub fn surface_point(form: &Form, u: f64, v: f64) -> Vector3<f64> {
    let around = |radius: f64, y: f64| {
        let (sine, cosine) = (TAU * u).sin_cos();
        Vector3::new(radius * cosine, y, radius * sine)
    };
    let latitude = PI * (v.clamp(0.0, 1.0) - 0.5);
    match form {
        Form::Sphere(s) => around(s.radius_m() * latitude.cos(), s.radius_m() * latitude.sin()),
        Form::Ellipsoid(e) => {
            around(latitude.cos(), latitude.sin()).component_mul(&Vector3::from(e.radii_m()))
        }
        Form::Capsule(c) => {
            let (r, l) = (c.radius_m(), c.length_m());
            let along = (l + PI * r) * (v.clamp(0.0, 1.0) - 0.5);
            let beyond = (along.abs() - 0.5 * l).max(0.0) / r;
            let y = along.abs().min(0.5 * l) + r * beyond.sin();
            around(r * beyond.cos(), y.copysign(along))
        }
        Form::Cylinder(c) => frustum(c.radius_m(), c.radius_m(), c.length_m(), u, v),
        Form::Cone(c) => frustum(c.radius_bottom_m(), c.radius_top_m(), c.length_m(), u, v),
        Form::Torus(t) => {
            let (sine, cosine) = (TAU * v).sin_cos();
            around(t.ring_radius_m() + t.tube_radius_m() * cosine, t.tube_radius_m() * sine)
        }
        Form::Cuboid(b) => {
            // Around all four sides; top and bottom by going on to the middle.
            let half = Vector3::from(b.size_m()) * 0.5;
            let turn = 4.0 * u.rem_euclid(1.0);
            let part = 2.0 * turn.fract() - 1.0;
            let (x, z) = [(1.0, part), (-part, 1.0), (-1.0, -part), (part, -1.0)][turn as usize % 4];
            let rise = 4.0 * v.clamp(0.0, 1.0) - 2.0;
            let inward = (2.0 - rise.abs()).min(1.0);
            Vector3::new(x * half.x * inward, rise.clamp(-1.0, 1.0) * half.y, z * half.z * inward)
        }
        Form::Scaled(s) => surface_point(&s.unscaled(), u, v).component_mul(&Vector3::from(s.factors())),
        Form::Plane(_) => unreachable!(),
    }
}

fn frustum(bottom: f64, top: f64, length: f64, u: f64, v: f64) -> Vector3<f64> {
    let (sine, cosine) = (TAU * u).sin_cos();
    let rise = 4.0 * v.clamp(0.0, 1.0) - 2.0;
    let up = 0.5 * (rise.clamp(-1.0, 1.0) + 1.0);
    let radius = (bottom + (top - bottom) * up) * (2.0 - rise.abs()).min(1.0);
    Vector3::new(radius * cosine, (up - 0.5) * length, radius * sine)
}

/// How far a point is outside of a form, exactly \[m\].
pub fn distance_outside(form: &Form, point: &Vector3<f64>) -> f64 {
    let round = |form: &Form| form.grown(ROUND_M).unwrap().signed_distance(point) + ROUND_M;
    match form {
        Form::Plane(_) | Form::Sphere(_) | Form::Capsule(_) | Form::Torus(_) => form.signed_distance(point),
        // Sharp forms know their distance where they are round.
        Form::Cuboid(_) | Form::Cylinder(_) | Form::Cone(_) | Form::Ellipsoid(_) => round(form),
        Form::Scaled(_) => unreachable!(),
    }
}

const ROUND_M: f64 = 1e-6;

/// Distance of two forms that are apart, of which one is not scaled: the best of A's surface points on a grid, refined by a compass search.
pub fn distance(a: &Form, X_WA: &Isometry3<f64>, b: &Form, X_WB: &Isometry3<f64>) -> f64 {
    if let Form::Scaled(_) = b {
        return distance(b, X_WB, a, X_WA);
    }
    let X_BA = X_WB.inv_mul(X_WA);
    let at = |u: f64, v: f64| distance_outside(b, &(X_BA * Point3::from(surface_point(a, u, v))).coords);
    let n = 48;
    let mut grid: Vec<(f64, f64, f64)> = (0..n * n)
        .map(|i| (f64::from(i % n) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n)))
        .map(|(u, v)| (at(u, v), u, v))
        .collect();
    grid.sort_by(|a, b| a.0.total_cmp(&b.0));
    grid[..8].iter().map(|&(_, u, v)| descend(&at, u, v)).fold(f64::INFINITY, f64::min)
}

fn descend(at: &dyn Fn(f64, f64) -> f64, mut u: f64, mut v: f64) -> f64 {
    let (mut best, mut step) = (at(u, v), 0.02);
    while step > 1e-10 {
        let compass = (0..16).map(|i| (TAU * f64::from(i) / 16.0).sin_cos());
        let better = compass.map(|(dv, du)| (u + du * step, v + dv * step)).find_map(|(u, v)| {
            let d = at(u, v);
            (d < best).then_some((u, v, d))
        });
        match better {
            Some(found) => (u, v, best) = found,
            None => step *= 0.5,
        }
    }
    best
}

/// All contact points of two forms.
pub fn points(
    a: &Form,
    X_WA: &Isometry3<f64>,
    b: &Form,
    X_WB: &Isometry3<f64>,
    reach: f64,
    memory: &mut PairMemory,
) -> Vec<ContactPoint> {
    let (a, b) = (Shape::Form(*a), Shape::Form(*b));
    let mut found = ContactPoints::default();
    let (a, b) = (Solid { shape: &a, X_W: X_WA }, Solid { shape: &b, X_W: X_WB });
    contact_points(a, b, reach, memory, &mut found);
    found.as_slice().to_vec()
}

/// The smallest gap of all.
pub fn deepest(points: &[ContactPoint]) -> f64 {
    points.iter().map(|point| point.gap_m).fold(f64::INFINITY, f64::min)
}

pub fn pose(turn: UnitQuaternion<f64>, at: Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(at), turn)
}
