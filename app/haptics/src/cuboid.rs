//! A box: six faces, centred at the origin of its frame, edges along its axes.
//!
//! Frames and signs: object frame B; sizes are whole edge lengths. Pieces are numbered +y, -y, +x, -x, +z, -z; where
//! several faces are as near, the lowest number counts, so that a finger that begins at the centre is pushed up.
//! The signed distance is that to the farthest face plane: exact inside and on the surface, a lower bound outside.
//! Grown by a ball's radius, edges and corners are round: the surface is that at the radius from the box, piece 6 where
//! it is curved.
//! Invariant: points it returns lie exactly on a face. Cost: a few comparisons per question, a square root if round.

use nalgebra::Vector3;

use crate::chart::Chart;
use crate::convex::{Edged, Level, direction_or};
use crate::error::{ParameterError, above_zero};
use crate::surface::{Feature, Surface, SurfacePoint};

/// A box around the origin of its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cuboid {
    half_m: Vector3<f64>,
    /// Radius of edges and corners, around the box \[m\].
    rounding_m: f64,
}

/// Edges and corners of a grown box.
const ROUND: u32 = 6;

impl Cuboid {
    /// A box with these edge lengths along x, y, z.
    ///
    /// Errors: a length that is not finite or not positive.
    pub fn new(size_m: [f64; 3]) -> Result<Self, ParameterError> {
        for length_m in size_m {
            above_zero("size_m", length_m)?;
        }
        Ok(Self { half_m: Vector3::from(size_m) * 0.5, rounding_m: 0.0 })
    }

    /// Edge lengths along x, y, z \[m\], of a grown box those of the one within.
    pub fn size_m(&self) -> [f64; 3] {
        (self.half_m * 2.0).into()
    }

    fn clamped(&self, point_B: &Vector3<f64>) -> Vector3<f64> {
        point_B.zip_map(&self.half_m, |x, half| x.clamp(-half, half))
    }
}

impl Edged for Cuboid {
    fn is_round(&self) -> bool {
        self.rounding_m > 0.0
    }

    /// The farthest of the planes of the six faces.
    fn sharp_level(&self, point_B: &Vector3<f64>) -> Level {
        let height_m = |axis: usize| point_B[axis].abs() - self.half_m[axis];
        let farther = |rank: usize, other: usize| {
            if height_m(AXES[other]) > height_m(AXES[rank]) { other } else { rank }
        };
        let rank = farther(farther(0, 1), 2);
        let axis = AXES[rank];
        let piece = 2 * rank as u32 + u32::from(point_B[axis] < 0.0);
        Level { height_m: height_m(axis) - self.rounding_m, gradient_B: normal(piece), piece }
    }

    fn round_level(&self, point_B: &Vector3<f64>) -> Level {
        let away_B = point_B - self.clamped(point_B);
        if away_B.iter().filter(|x| **x != 0.0).count() < 2 {
            return self.sharp_level(point_B);
        }
        let gradient_B = direction_or(&away_B, Vector3::y());
        Level { height_m: away_B.norm() - self.rounding_m, gradient_B, piece: ROUND }
    }

    fn on(&self, piece: u32, point_B: &Vector3<f64>) -> SurfacePoint {
        let normal_B = normal(piece);
        let axis = axis(piece);
        let mut at_B = self.clamped(point_B);
        at_B[axis] = normal_B[axis] * (self.half_m[axis] + self.rounding_m);
        SurfacePoint { point_B: at_B, normal_B, feature: Feature::Face, piece }
    }

    fn on_round(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        let level = self.round_level(point_B);
        if level.piece != ROUND {
            return self.on(level.piece, point_B);
        }
        let normal_B = level.gradient_B;
        let within_B = self.clamped(point_B);
        // What a ball touches there is the box itself.
        let beyond = point_B.zip_fold(&within_B, 0, |beyond, x, within| beyond + usize::from(x != within));
        let feature = if beyond == 3 { Feature::Vertex } else { Feature::Edge };
        SurfacePoint { point_B: within_B + normal_B * self.rounding_m, normal_B, feature, piece: ROUND }
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
        self.height_m(point_B)
    }

    fn nearest(&self, point_B: &Vector3<f64>) -> SurfacePoint {
        self.nearest_point(point_B)
    }

    fn entry(&self, from_B: &Vector3<f64>, to_B: &Vector3<f64>) -> Option<SurfacePoint> {
        self.entered(from_B, to_B)
    }

    /// Straight over the face; on the first edge in the way the face beyond takes over.
    fn settle(&self, from: &SurfacePoint, on_tangent_plane_B: &Vector3<f64>) -> SurfacePoint {
        if self.is_round() {
            return self.on_round(on_tangent_plane_B);
        }
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
        if at.piece == ROUND {
            return self.half_m.dot(&at.normal_B.abs()) + self.rounding_m;
        }
        self.half_m[axis(at.piece)] + self.rounding_m
    }

    /// Faces are flat: nobody is pushed through, however thin the box. Whoever is deeper below a round edge than its
    /// radius has gone past its middle.
    fn holds_outside(&self, at: &SurfacePoint, _depth_m: f64) -> bool {
        at.piece != ROUND
    }

    /// Each face has its own; round edges share that of the face they look most like.
    fn chart(&self, at: &SurfacePoint) -> Option<Chart> {
        let axis = if at.piece == ROUND { at.normal_B.iamax() } else { axis(at.piece) };
        let mut normal_B = Vector3::zeros();
        normal_B[axis] = at.normal_B[axis].signum();
        let [x_m, y_m, z_m] = self.size_m();
        let lengths_m = [[z_m, y_m], [x_m, z_m], [x_m, y_m]][axis];
        Some(Chart::flat(&at.point_B, &normal_B, lengths_m))
    }

    fn grown(&self, radius_m: f64) -> Option<Self> {
        Some(Self { rounding_m: self.rounding_m + radius_m, ..*self })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brick() -> Cuboid {
        Cuboid::new([0.2, 0.1, 0.06]).unwrap()
    }

    #[test]
    fn sizes_must_be_positive() {
        for bad in [0.0, -0.1, f64::NAN, f64::INFINITY] {
            let message = Cuboid::new([0.1, bad, 0.1]).unwrap_err().to_string();
            assert!(message.starts_with(&format!("size_m is {bad};")), "as it was given: {message}");
        }
        assert_eq!(brick().size_m(), [0.2, 0.1, 0.06]);
    }

    #[test]
    fn depth_is_that_below_the_nearest_face_and_at_the_centre_of_a_cube_that_is_the_top() {
        let at = brick().nearest(&Vector3::new(-0.09, 0.02, 0.01));
        assert_eq!(at.point_B, Vector3::new(-0.1, 0.02, 0.01));
        assert_eq!((at.normal_B, at.piece, at.feature), (-Vector3::x(), 3, Feature::Face));
        // One subtraction of numbers of 0.1.
        assert!((brick().signed_distance(&Vector3::new(-0.09, 0.02, 0.01)) + 0.01).abs() < 1e-17);
        assert_eq!(Cuboid::new([0.1; 3]).unwrap().nearest(&Vector3::zeros()).normal_B, Vector3::y());
    }

    #[test]
    fn a_ball_beyond_an_edge_rests_on_the_edge_and_beyond_a_corner_on_the_corner() {
        let grown = brick().grown(0.01).unwrap();
        let feature = |x, y, z| grown.nearest(&Vector3::new(x, y, z)).feature;
        assert_eq!(feature(0.02, 0.055, 0.0), Feature::Face);
        assert_eq!(feature(0.105, 0.055, 0.0), Feature::Edge);
        assert_eq!(feature(0.105, -0.055, 0.035), Feature::Vertex);
    }

    #[test]
    fn a_path_enters_through_the_face_it_meets_first_and_leaving_is_no_entry() {
        let (above, below) = (Vector3::new(0.01, 0.15, 0.0), Vector3::new(0.01, -0.15, 0.0));
        let down = brick().entry(&above, &below).unwrap();
        assert_eq!((down.point_B, down.normal_B), (Vector3::new(0.01, 0.05, 0.0), Vector3::y()));
        let up = brick().entry(&below, &above).unwrap();
        assert_eq!((up.point_B, up.normal_B), (Vector3::new(0.01, -0.05, 0.0), -Vector3::y()));
        assert!(brick().entry(&Vector3::zeros(), &above).is_none());
        let beside = Vector3::new(0.1001, 0.0, 0.0);
        assert!(brick().entry(&(above + beside), &(below + beside)).is_none());
        // Over a corner: x reaches 0.1 at 1/3 of the way, y 0.05 at 1/2.
        let corner = brick().entry(&Vector3::new(0.12, 0.07, 0.0), &Vector3::new(0.06, 0.03, 0.0)).unwrap();
        assert_eq!((corner.normal_B, corner.point_B.y), (Vector3::y(), 0.05));
        assert!((corner.point_B.x - 0.09).abs() < 1e-16, "two roundings of 0.1");
    }

    #[test]
    fn landing_exactly_on_a_face_is_an_entry() {
        let on = Vector3::new(0.0, 0.05, 0.0);
        assert_eq!(brick().entry(&Vector3::new(0.0, 0.06, 0.0), &on).unwrap().point_B, on);
        assert!(brick().entry(&on, &Vector3::zeros()).is_none(), "it was in contact already");
    }

    #[test]
    fn over_an_edge_the_face_beyond_takes_over_where_the_path_crosses_it() {
        let from = brick().nearest(&Vector3::new(0.08, 0.049, 0.0));
        let over = brick().settle(&from, &Vector3::new(0.12, 0.05, 0.02));
        assert_eq!(over.normal_B, Vector3::x());
        assert!((over.point_B - Vector3::new(0.1, 0.05, 0.01)).norm() < 1e-16, "{over:?}");
        // Beyond a corner the edge met first counts.
        let corner = brick().settle(&from, &Vector3::new(0.12, 0.05, 0.09));
        assert_eq!(corner.normal_B, Vector3::z());
        let stays = brick().settle(&from, &Vector3::new(0.1, 0.05, 0.03));
        assert_eq!((stays.normal_B, stays.point_B), (Vector3::y(), Vector3::new(0.1, 0.05, 0.03)));
    }
}
