//! Forces that feed energy, and the hands that take it.
#![allow(dead_code)]

use super::Noise;
use nalgebra::Vector3;

/// A force by position and tick (N), and what a spring under it would have stored (J).
pub(crate) type Source = Box<dyn FnMut(&Vector3<f64>, usize) -> (Vector3<f64>, f64)>;

/// A wall at y = 0 of this stiffness (N/m).
pub(crate) fn wall(k: f64) -> Source {
    Box::new(move |x, _| {
        let force = Vector3::y() * (k * (-x.y).max(0.0));
        (force, 0.5 * force.norm_squared() / k)
    })
}

/// The same, felt some ticks late.
pub(crate) fn late_wall(k: f64, ticks: usize) -> Source {
    let mut past = std::collections::VecDeque::from(vec![Vector3::zeros(); ticks]);
    Box::new(move |x, _| {
        past.push_back(Vector3::y() * (k * (-x.y).max(0.0)));
        let force = past.pop_front().unwrap();
        (force, 0.5 * force.norm_squared() / k)
    })
}

/// Round and round the y axis: no potential, and energy in every turn one way.
pub(crate) fn whirl(n_per_m: f64) -> Source {
    Box::new(move |x, _| (Vector3::new(x.z, 0.0, -x.x) * n_per_m, 0.0))
}

/// A wall whose force is turned by this angle (rad): rubbed round it feeds one way and takes the other.
pub(crate) fn leaning_wall(k: f64, angle: f64) -> Source {
    Box::new(move |x, _| {
        let size = k * (-x.y).max(0.0);
        (Vector3::new(angle.sin(), angle.cos(), 0.0) * size, 0.5 * size * size / k)
    })
}

/// A wall whose force leans to and fro along x, as that of a shaded mesh with facets of this length (m) does.
pub(crate) fn shaded_wall(k: f64, angle: f64, facet_m: f64) -> Source {
    Box::new(move |x, _| {
        let size = k * (-x.y).max(0.0);
        let lean = angle * (std::f64::consts::TAU * x.x / facet_m).sin();
        (Vector3::new(lean.sin(), lean.cos(), 0.0) * size, 0.5 * size * size / k)
    })
}

/// Any force at all of up to this size (N).
pub(crate) fn noise(most_n: f64, seed: u64) -> Source {
    let mut noise = Noise(seed);
    Box::new(move |_, _| (noise.vector(most_n), 0.0))
}

/// A push that always goes where the finger goes: negative friction.
pub(crate) fn chase(force_n: f64) -> Source {
    let mut last = Vector3::zeros();
    Box::new(move |x, _| {
        let way = x - std::mem::replace(&mut last, *x);
        (way.try_normalize(0.0).unwrap_or_default() * force_n, 0.0)
    })
}

/// All of them, named.
pub(crate) fn active(seed: u64) -> Vec<(&'static str, Source)> {
    vec![
        ("a wall beyond what any device stands", wall(50_000.0)),
        ("a wall that comes three ticks late", late_wall(3000.0, 3)),
        ("a force that turns in a circle", whirl(300.0)),
        ("a wall that leans", leaning_wall(2000.0, 0.5)),
        ("noise", noise(8.0, seed)),
        ("negative friction", chase(4.0)),
    ]
}

/// A hand whose acceleration never exceeds a bound, read in steps.
pub(crate) struct Hand {
    pub(crate) position: Vector3<f64>,
    pub(crate) way: Vector3<f64>,
    noise: Noise,
}

impl Hand {
    pub(crate) fn new(seed: u64) -> Self {
        Self { position: Vector3::new(1e-3, 1e-3, 0.0), way: Vector3::zeros(), noise: Noise(seed) }
    }

    /// Random accelerations of up to `most` (m/s^2) in any direction, drawn back to the origin and slowed down.
    pub(crate) fn wander(&mut self, most: f64, dt: f64) {
        let random = Vector3::from_fn(|_, _| 2.0 * self.noise.uniform() - 1.0);
        let wanted = random * most - self.position * 4000.0 - self.way / dt * 20.0;
        self.accelerate(wanted, most, dt);
    }

    /// Goes where the force pushes, as hard as it may: the worst hand there is.
    pub(crate) fn follow(&mut self, force: &Vector3<f64>, most: f64, dt: f64) {
        // Now and then it comes back, into the walls, or it would be gone.
        let is_free = *force == Vector3::zeros();
        let turns_back = is_free || self.position.norm() > 0.02 || self.noise.uniform() < 0.02;
        let home = Vector3::new(1e-3, -2e-3, 0.0);
        let back = if turns_back { (home - self.position) * 1e5 } else { Vector3::zeros() };
        let wanted = force.try_normalize(0.0).unwrap_or_default() * most + back - self.way / dt * 10.0;
        self.accelerate(wanted, most, dt);
    }

    fn accelerate(&mut self, wanted: Vector3<f64>, most: f64, dt: f64) {
        let size = wanted.norm();
        let acceleration = if size > most { wanted * (most / size) } else { wanted };
        // The second difference of a path whose acceleration is bounded is at most that times dt^2.
        self.way += acceleration * (dt * dt);
        self.position += self.way;
    }

    /// As an encoder with steps of `q` (m) reads it.
    pub(crate) fn read(&self, q: f64) -> Vector3<f64> {
        if q > 0.0 { self.position.map(|x| (x / q).round() * q) } else { self.position }
    }
}
