//! A box: six faces, centred at the origin of its frame, edges along its axes.
//!
//! Frames and signs: object frame B; sizes are whole edge lengths. Pieces are numbered +y, -y, +x, -x, +z, -z; where
//! several faces are as near, the lowest number counts, so that a finger that begins at the centre is pushed up.
//! The signed distance is that to the farthest face plane: exact inside and on the surface, a lower bound outside.
//! Invariant: points it returns lie exactly on a face. Cost: a few comparisons per question.

use nalgebra::Vector3;

use crate::convex::{Level, first_entry};
use crate::error::{ParameterError, above_zero};
use crate::surface::{Feature, Surface, SurfacePoint};

/// A box around the origin of its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    half_m: Vector3<f64>,
}

impl Cuboid {
    /// A box with these edge lengths along x, y, z.
    ///
    /// Errors: a length that is not finite or not positive.
    pub fn new(size_m: [f64; 3]) -> Result<Self, ParameterError> {
        for length_m in size_m {
            above_zero("size_m", 0.5 * length_m)?;
        }
        Ok(Self { half_m: Vector3::from(size_m) * 0.5 })
    }

    /// Edge lengths along x, y, z \[m\].
    pub fn size_m(&self) -> [f64; 3] {
        (self.half_m * 2.0).into()
    }

    fn level(&self, point_B: &Vector3<f64>) -> Level {
        let height_m = |axis: usize| point_B[axis].abs() - self.half_m[axis];
        let mut rank = 0;
        for other in 1..3 {
            if height_m(AXES[other]) > height_m(AXES[rank]) {
                rank = other;
            }
        }
        let axis = AXES[rank];
        let piece = 2 * rank as u32 + u32::from(point_B[axis] < 0.0);
        Level { height_m: height_m(axis), gradient_B: normal(piece), piece }
    }

    /// The point of a face nearest to `point_B`.
    fn on(&self, piece: u32, point_B: &Vector3<f64>) -> SurfacePoint {
        let normal_B = normal(piece);
        let axis = axis(piece);
        let mut at_B = point_B.zip_map(&self.half_m, |x, half| x.clamp(-half, half));
        at_B[axis] = normal_B[axis] * self.half_m[axis];
        SurfacePoint { point_B: at_B, normal_B, feature: Feature::Face, piece }
    }
}

/// The axes in the order of the pieces.
const AXES: [usize; 3] = [1, 0, 2];

fn axis(piece: u32) -> usize {
    AXES[(piece / 2 % 3) as usize]
}

fn normal(piece: u32) -> Vector3<f64> {
    let mut normal_B = Vector3::zeros();
    normal_B[axis(piece)] = if piece.is_multiple_of(2) { 1.0 } else { -1.0 };
    normal_B
}

impl Surface for Cuboid {
    fn signed_distance(&self, point_B: &Vector3<f64>) -> f64 {
        self.level(point_B).height_m
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        self.on(self.level(point_B).piece, point_B)
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        let (point_B, piece) = first_entry(from_B, to_B, |point_B| self.level(point_B))?;
        Some(self.on(piece, &point_B))
    }

    /// Straight over the face; on the first edge in the way the face beyond takes over.
    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        let path_B = on_tangent_plane_B - from.point_B;
        let (mut fraction, mut piece) = (1.0, from.piece);
        for (rank, &axis) in AXES.iter().enumerate() {
            let over_m = on_tangent_plane_B[axis].abs() - self.half_m[axis];
            if rank as u32 == from.piece / 2 || over_m.is_nan() || over_m <= 0.0 {
                continue;
            }
            let part = 1.0 - over_m / path_B[axis].abs();
            if part < fraction {
                fraction = part.max(0.0);
                piece = 2 * rank as u32 + u32::from(on_tangent_plane_B[axis] < 0.0);
            }
        }
        if piece == from.piece {
            return self.on(piece, on_tangent_plane_B);
        }
        self.on(piece, &(from.point_B + path_B * fraction))
    }

    fn tangent_offset(&self, at: &SurfacePoint) -> f64 {
        self.half_m[axis(at.piece)]
    }

    /// Faces are flat: nobody is pushed through, however thin the box.
    fn holds_outside(&self, _at: &SurfacePoint, _depth_m: f64) -> bool {
        true
    }

    fn grown(&self, _radius_m: f64) -> Option<Self> {
        None
    }
}
