//! Every closed form beside a slow and obvious description of the same solid, written from its equation alone.
#![allow(dead_code, non_snake_case)]

use haptics::{Capsule, Cone, Cuboid, Cylinder, Ellipsoid, Form, Plane, Scaled, Sphere, Surface, Torus};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Is a point in the material?
pub(crate) type Contains = dyn Fn(&Vector3<f64>) -> bool;

/// A shape and what is known of it without asking it.
pub(crate) struct Solid {
    pub(crate) name: &'static str,
    pub(crate) form: Form,
    /// Is a point in the material?
    pub(crate) contains: Box<Contains>,
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

    /// Surface points of a grid in `u`, `v`.
    pub(crate) fn grid(&self) -> Vec<(Vector3<f64>, f64, f64)> {
        let n = 36;
        (0..n * n)
            .map(|i| (f64::from(i % n) / f64::from(n), f64::from(i / n) / f64::from(n)))
            .map(|(u, v)| (self.point(u, v), u, v))
            .collect()
    }

    /// Distance from `p` to the surface: the best of a `grid`, refined.
    pub(crate) fn distance(&self, grid: &[(Vector3<f64>, f64, f64)], p: &Vector3<f64>) -> f64 {
        let mut grid: Vec<(f64, f64, f64)> =
            grid.iter().map(|&(point, u, v)| ((point - p).norm(), u, v)).collect();
        grid.sort_by(|a, b| a.0.total_cmp(&b.0));
        grid[..4].iter().map(|&(_, u, v)| self.descend(p, (u, v), 0.02)).fold(f64::INFINITY, f64::min)
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

    /// Fraction of `from -> to` at which the material is first met: ten thousand samples, then bisection. Those that are
    /// farther out than the size are not in it.
    pub(crate) fn first_crossing(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> Option<f64> {
        let inside = |fraction: f64| (self.contains)(&(from + (to - from) * fraction));
        let n = 10_000;
        let is_near = |i: &i32| {
            (from + (to - from) * (f64::from(*i) / f64::from(n))).amax() <= self.size_m * (1.0 + 1e-9)
        };
        let first = (0..=n).filter(is_near).find(|&i| inside(f64::from(i) / f64::from(n)))?;
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

/// What the centre of a ball of this radius must not enter; `beside` tells the distance of a point outside the solid.
fn grown(
    name: &'static str,
    inner: Solid,
    radius_m: f64,
    beside: impl Fn(&Vector3<f64>) -> f64 + 'static,
) -> Solid {
    let form = inner.form.grown(radius_m).unwrap();
    let contains = move |p: &Vector3<f64>| (inner.contains)(p) || beside(p) <= radius_m;
    Solid {
        ring_m: inner.ring_m,
        factors: inner.factors,
        ..solid(name, form, inner.size_m + radius_m, contains)
    }
}

fn grown_cuboid(size: [f64; 3], radius_m: f64) -> Solid {
    let beside = move |p: &Vector3<f64>| {
        (0..3).map(|i| (p[i].abs() - 0.5 * size[i]).max(0.0).powi(2)).sum::<f64>().sqrt()
    };
    grown("grown box", cuboid(size), radius_m, beside)
}

fn grown_cone(name: &'static str, bottom: f64, top: f64, l: f64, radius_m: f64) -> Solid {
    // The outline in the half-plane through the axis: three straight pieces.
    let outline = [(0.0, -0.5 * l), (bottom, -0.5 * l), (top, 0.5 * l), (0.0, 0.5 * l)];
    let beside = move |p: &Vector3<f64>| {
        let (x, y) = (rho(p), p.y);
        let to_piece = |(a, b): ((f64, f64), (f64, f64))| {
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            let length_squared = (dx * dx + dy * dy).max(1e-30);
            let along = (((x - a.0) * dx + (y - a.1) * dy) / length_squared).clamp(0.0, 1.0);
            (x - a.0 - along * dx).hypot(y - a.1 - along * dy)
        };
        (0..3).map(|i| to_piece((outline[i], outline[i + 1]))).fold(f64::INFINITY, f64::min)
    };
    let inner = if bottom == top { cylinder(bottom, l) } else { cone(bottom, top, l) };
    grown(name, inner, radius_m, beside)
}

fn grown_ellipsoid(radii: [f64; 3], radius_m: f64) -> Solid {
    let beside = move |p: &Vector3<f64>| {
        // x_i = a_i^2 p_i / (t + a_i^2) lies on the ellipsoid for one t > 0. Sum of squares over a_i^2 minus one falls
        // and is convex, so that Newton from 0 walks up to it; 20 steps are several more than it takes.
        let mut t = 0.0;
        for _ in 0..20 {
            let terms: [f64; 3] = std::array::from_fn(|i| radii[i] * p[i] / (t + radii[i] * radii[i]));
            let excess = terms.iter().map(|x| x * x).sum::<f64>() - 1.0;
            let slope = (0..3).map(|i| 2.0 * terms[i] * terms[i] / (t + radii[i] * radii[i])).sum::<f64>();
            t += excess / slope;
        }
        Vector3::from_fn(|i, _| p[i] * t / (t + radii[i] * radii[i])).norm()
    };
    grown("grown ellipsoid", ellipsoid(radii), radius_m, beside)
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
        grown_cuboid([0.08, 0.02, 0.05], 0.008),
        grown_cone("grown cylinder", 0.03, 0.03, 0.06, 0.006),
        grown_cone("grown cone", 0.03, 0.012, 0.05, 0.006),
        grown_cone("grown pointed cone", 0.0, 0.03, 0.05, 0.004),
        grown_ellipsoid([0.05, 0.03, 0.015], 0.005),
    ]
}

/// A plane, for what holds of it, too.
pub(crate) fn plane() -> Form {
    Plane::new(Vector3::y(), 0.0).unwrap().into()
}
