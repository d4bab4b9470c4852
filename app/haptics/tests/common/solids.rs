//! Every closed form beside a slow and obvious description of the same solid, written from its equation alone.
#![allow(dead_code, non_snake_case)]

use haptics::{Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Form, Plane, Scaled, Sphere, Torus};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// A shape and what is known of it without asking it.
pub(crate) struct Solid {
    pub(crate) name: &'static str,
    pub(crate) form: Form,
    /// Is a point in the material?
    pub(crate) contains: Box<dyn Fn(&Vector3<f64>) -> bool>,
    /// Within this distance of the origin in every coordinate \[m\].
    pub(crate) size_m: f64,
    /// Radius of the ring from which every surface point can be seen; 0 for a star-shaped solid.
    pub(crate) ring_m: f64,
    pub(crate) factors: Vector3<f64>,
}

impl Solid {
    /// A surface point for each `u`, `v`: straight away from the middle (the ring), found by bisection.
    pub(crate) fn point(&self, u: f64, v: f64) -> Vector3<f64> {
        let azimuth = Vector3::new((TAU * u).cos(), 0.0, (TAU * u).sin());
        let (sine, cosine) = if self.ring_m > 0.0 { (TAU * v).sin_cos() } else { (PI * v).sin_cos() };
        let middle = (azimuth * self.ring_m).component_mul(&self.factors);
        let away = (azimuth * sine + Vector3::y() * cosine).component_mul(&self.factors);
        let (mut low, mut high) = (0.0, 4.0 * self.size_m / away.norm());
        for _ in 0..60 {
            let radius = 0.5 * (low + high);
            if (self.contains)(&(middle + away * radius)) { low = radius } else { high = radius }
        }
        middle + away * low
    }

    /// Compass search for a surface point nearer to `p`, from steps of `step` down to nothing.
    fn descend(&self, p: &Vector3<f64>, (mut u, mut v): (f64, f64), mut step: f64) -> f64 {
        let distance = |u, v| (self.point(u, v) - p).norm();
        let mut best = distance(u, v);
        while step > 1e-9 {
            let compass = [
                (1.0, 0.0),
                (-1.0, 0.0),
                (0.0, 1.0),
                (0.0, -1.0),
                (1.0, 1.0),
                (-1.0, 1.0),
                (1.0, -1.0),
                (-1.0, -1.0),
            ];
            let better = compass.iter().map(|(du, dv)| (u + du * step, v + dv * step)).find_map(|(u, v)| {
                let d = distance(u, v);
                (d < best).then_some((u, v, d))
            });
            match better {
                Some(found) => (u, v, best) = found,
                None => step *= 0.5,
            }
        }
        best
    }

    /// Distance from `p` to the surface: the best of a grid, refined.
    pub(crate) fn distance(&self, p: &Vector3<f64>) -> f64 {
        let n = 48;
        let mut grid: Vec<(f64, f64, f64)> = (0..n * n)
            .map(|i| (f64::from(i % n) / f64::from(n), f64::from(i / n) / f64::from(n)))
            .map(|(u, v)| ((self.point(u, v) - p).norm(), u, v))
            .collect();
        grid.sort_by(|a, b| a.0.total_cmp(&b.0));
        grid[..6].iter().map(|&(_, u, v)| self.descend(p, (u, v), 0.02)).fold(f64::INFINITY, f64::min)
    }

    /// `u`, `v` of a surface point.
    pub(crate) fn coordinates(&self, at: &Vector3<f64>) -> (f64, f64) {
        let p = at.component_div(&self.factors);
        let u = p.z.atan2(p.x) / TAU;
        let rho = p.x.hypot(p.z);
        let v = if self.ring_m > 0.0 { (rho - self.ring_m).atan2(p.y) / TAU } else { rho.atan2(p.y) / PI };
        (u, v)
    }

    /// The nearest to `p` that a walk from the surface point `at` can come without going away from it.
    pub(crate) fn distance_near(&self, p: &Vector3<f64>, at: &Vector3<f64>) -> f64 {
        self.descend(p, self.coordinates(at), 1e-4)
    }

    /// Fraction of `from -> to` at which the material is first met: ten thousand samples, then bisection.
    pub(crate) fn first_crossing(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<f64> {
        let inside = |fraction: f64| (self.contains)(&(from + (to - from) * fraction));
        let n = 10_000;
        let first = (0..=n).find(|&i| inside(f64::from(i) / f64::from(n)))?;
        let (mut low, mut high) = (f64::from(first - 1) / f64::from(n), f64::from(first) / f64::from(n));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if inside(middle) { high = middle } else { low = middle }
        }
        Some(high)
    }
}

fn solid(
    name: &'static str,
    form: impl Into<Form>,
    size_m: f64,
    contains: impl Fn(&Vector3<f64>) -> bool + 'static,
) -> Solid {
    let contains = Box::new(contains);
    Solid { name, form: form.into(), contains, size_m, ring_m: 0.0, factors: Vector3::repeat(1.0) }
}

fn rho(p: &Vector3<f64>) -> f64 {
    (p.x * p.x + p.z * p.z).sqrt()
}

pub(crate) fn cuboid(size: [f64; 3]) -> Solid {
    let contains = move |p: &Vector3<f64>| (0..3).all(|i| p[i].abs() <= 0.5 * size[i]);
    solid("box", Cuboid::new(size).unwrap(), 0.5 * size.into_iter().fold(0.0, f64::max), contains)
}

pub(crate) fn cylinder(r: f64, l: f64) -> Solid {
    let contains = move |p: &Vector3<f64>| p.y.abs() <= 0.5 * l && rho(p) <= r;
    solid("cylinder", Cylinder::new(r, l).unwrap(), r.max(0.5 * l), contains)
}

pub(crate) fn cone(bottom: f64, top: f64, l: f64) -> Solid {
    let contains = move |p: &Vector3<f64>| {
        let up = p.y / l + 0.5;
        (0.0..=1.0).contains(&up) && rho(p) <= bottom * (1.0 - up) + top * up
    };
    solid("cone", Cone::new(bottom, top, l).unwrap(), bottom.max(top).max(0.5 * l), contains)
}

pub(crate) fn capsule(r: f64, l: f64) -> Solid {
    let contains = move |p: &Vector3<f64>| {
        let beyond = (p.y.abs() - 0.5 * l).max(0.0);
        rho(p).hypot(beyond) <= r
    };
    solid("capsule", Capsule::new(r, l).unwrap(), r + 0.5 * l, contains)
}

pub(crate) fn torus(ring: f64, tube: f64) -> Solid {
    let contains = move |p: &Vector3<f64>| (rho(p) - ring).hypot(p.y) <= tube;
    Solid { ring_m: ring, ..solid("torus", Torus::new(ring, tube).unwrap(), ring + tube, contains) }
}

pub(crate) fn ellipsoid(radii: [f64; 3]) -> Solid {
    let contains = move |p: &Vector3<f64>| (0..3).map(|i| (p[i] / radii[i]).powi(2)).sum::<f64>() <= 1.0;
    let size = radii.into_iter().fold(0.0, f64::max);
    let factors = Vector3::from(radii) / size;
    Solid { factors, ..solid("ellipsoid", Ellipsoid::new(radii).unwrap(), size, contains) }
}

pub(crate) fn sphere(r: f64) -> Solid {
    solid("sphere", Sphere::new(r).unwrap(), r, move |p| p.norm() <= r)
}

pub(crate) fn scaled(name: &'static str, inner: Solid, factors: [f64; 3]) -> Solid {
    let form = Scaled::new(inner.form, factors).unwrap();
    assert!(matches!(form, Form::Scaled(_)), "{form:?}");
    let factors = Vector3::from(factors);
    let contains = move |p: &Vector3<f64>| (inner.contains)(&p.component_div(&factors));
    Solid { ring_m: inner.ring_m, factors, ..solid(name, form, inner.size_m * factors.max(), contains) }
}

/// One of each, of a hand's size and of uneven proportions.
pub(crate) fn all() -> Vec<Solid> {
    vec![
        sphere(0.05),
        cuboid([0.1, 0.04, 0.06]),
        cylinder(0.03, 0.08),
        cone(0.04, 0.015, 0.07),
        Solid { name: "pointed cone", ..cone(0.03, 0.0, 0.06) },
        capsule(0.02, 0.05),
        torus(0.05, 0.015),
        ellipsoid([0.06, 0.03, 0.02]),
        scaled("elliptic cylinder", cylinder(0.03, 0.08), [1.4, 1.0, 0.7]),
        scaled("elliptic cone", cone(0.04, 0.015, 0.07), [0.8, 1.0, 1.2]),
        scaled("scaled capsule", capsule(0.02, 0.05), [1.0, 1.5, 0.8]),
        scaled("scaled torus", torus(0.05, 0.015), [1.2, 1.5, 0.9]),
    ]
}

/// A plane, for what holds of it, too.
pub(crate) fn plane() -> Form {
    Plane::new(Vector3::y(), 0.0).unwrap().into()
}
