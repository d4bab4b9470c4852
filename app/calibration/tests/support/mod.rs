//! Points, noise and transforms that are the same in every run.

#![allow(dead_code, reason = "every test file is a program of its own and uses its part")]

use calibration::{Pair, Transform};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Splitmix64 of Steele, Lea and Flood: small, and good enough for noise.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in [0, 1).
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal (Box, Muller).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    pub(crate) fn normal3(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// In a box of these edges, whose middle is where a Premium's is in front of its base (m).
    pub(crate) fn in_box(&mut self, edges: [f64; 3]) -> Vector3<f64> {
        Vector3::from_fn(|i, _| (self.uniform() - 0.5) * edges[i]) + Vector3::new(0.02, 0.1, -0.03)
    }
}

/// A base turned by a little more than a right angle and moved by half a metre.
pub(crate) fn rigid_truth() -> Transform {
    let turn = Rotation3::from_euler_angles(0.3, 1.7, -0.4);
    Transform { matrix: turn.into_inner(), position: Vector3::new(0.5, -0.1, 0.25) }
}

/// The same with scales and shear of a few percent.
pub(crate) fn affine_truth() -> Transform {
    let shape = Matrix3::new(1.02, 0.01, 0.0, -0.02, 0.97, 0.015, 0.0, 0.03, 1.01);
    let rigid = rigid_truth();
    Transform { matrix: rigid.matrix * shape, ..rigid }
}

/// Points that both devices see, the fiducial's with noise of this standard deviation per coordinate (m).
pub(crate) fn pairs_of(
    truth: &Transform,
    count: usize,
    edges: [f64; 3],
    noise_m: f64,
    seed: u64,
) -> Vec<Pair> {
    let mut random = Random::new(seed);
    (0..count)
        .map(|i| {
            let other = random.in_box(edges);
            Pair { line: i + 1, fiducial: truth.apply(&other) + random.normal3() * noise_m, other }
        })
        .collect()
}

/// Angle between two rotations (rad).
pub(crate) fn angle_between(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let turn = a.transpose() * b;
    let twice_sine =
        Vector3::new(turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)]);
    (twice_sine.norm() / 2.0).asin()
}

/// A workspace's box (m).
pub(crate) const WIDE: [f64; 3] = [0.3, 0.2, 0.15];
